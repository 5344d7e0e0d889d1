//! The block diagram of a page: there where there is one, for wide and for narrow screens, and in words.

use flexure_report::data::{DiagramBlock, Flow, Page, Sketch};
use flexure_report::render;

use super::common::page_text;
use super::pages;

fn seen(diagram: Option<Flow>) -> String {
    let page = Page {
        diagram,
        ..pages::bare()
    };
    page_text(&render(&page).unwrap())
}

fn loop_around(title: &str) -> Flow {
    let block = |title: &str| {
        Box::new(Flow::Block(DiagramBlock {
            title: title.to_owned(),
            sketch: Sketch::Fraction("B(z)".to_owned(), "A(z)".to_owned()),
            note: String::new(),
        }))
    };
    Flow::Series(vec![
        Flow::Signal("torque (N m)".to_owned()),
        Flow::Feedback {
            forward: block(title),
            back: block("Spring"),
            subtracted: true,
        },
        Flow::Signal("angle (rad)".to_owned()),
    ])
}

#[test]
fn a_page_without_diagram_has_no_place_for_one() {
    assert!(!seen(None).contains("Block diagram"));
    assert!(!page_text(&render(&pages::bare()).unwrap()).contains("id=\"diagram\""));
}

#[test]
fn a_loop_is_drawn_twice_and_described_once() {
    let html = seen(Some(loop_around("Links")));
    let label = "aria-label=\"Block diagram: torque (N m), then a loop: forward [Links]; back [Spring], subtracted from what enters, \
                 then angle (rad)\"";
    assert!(html.contains(label));
    for (text, times) in [
        (">Links<", 2),
        (">torque<", 2),
        (">N m<", 2),
        (">rad<", 2),
        ("class=\"flow-sum\"", 2),
    ] {
        assert_eq!(html.matches(text).count(), times, "{text}");
    }
    assert!(html.contains("class=\"flow-right\"") && html.contains("class=\"flow-down\""));
}

#[test]
fn names_cannot_become_markup() {
    let evil = "</svg><script>alert(1)</script>\"'&";
    let (clean, html) = (seen(Some(loop_around("Links"))), seen(Some(loop_around(evil))));
    assert_eq!(html.matches("<script").count(), clean.matches("<script").count());
    assert_eq!(html.matches("</svg").count(), clean.matches("</svg").count());
    assert!(html.contains("&lt;script&gt;"));
}
