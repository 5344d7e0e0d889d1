use super::*;
use crate::data::{DiagramBlock, Sketch};

fn signal(name: &str) -> Flow {
    Flow::Signal(name.to_owned())
}

fn block(title: &str, note: &str) -> Flow {
    Flow::Block(DiagramBlock {
        title: title.to_owned(),
        sketch: Sketch::Formula("f(u)".to_owned()),
        note: note.to_owned(),
    })
}

fn whole(inner: Flow) -> Flow {
    Flow::Series(vec![signal("u (V)"), inner, signal("y (rad/s)")])
}

/// Diagrams of every kind of part, with loops inside one another.
fn all() -> Vec<Flow> {
    let one = || block("Linear part", "order 3, delay 2");
    let chain = || Flow::Series(vec![block("Nonlinearity", ""), one()]);
    let feedback = |forward: Flow, back: Flow| Flow::Feedback {
        forward: Box::new(forward),
        back: Box::new(back),
        subtracted: true,
    };
    let coupled = |first: Flow, between: Flow, last: Flow| Flow::Coupled {
        first: Box::new(first),
        between: Box::new(between),
        last: Box::new(last),
    };
    vec![
        whole(chain()),
        whole(Flow::Series(vec![one(), Flow::Offset("−0.2134 rad/s".to_owned())])),
        whole(Flow::Parallel(vec![chain(), one(), chain()])),
        whole(feedback(chain(), one())),
        whole(feedback(one(), chain())),
        whole(feedback(one(), feedback(chain(), one()))),
        whole(Flow::Parallel(vec![feedback(one(), one()), chain()])),
        whole(coupled(one(), chain(), feedback(one(), one()))),
        whole(coupled(feedback(one(), chain()), one(), one())),
        Flow::Series(vec![
            Flow::Sum(vec![
                Flow::Series(vec![signal("p"), chain()]),
                Flow::Series(vec![signal("q"), one()]),
            ]),
            signal("y"),
        ]),
        Flow::Series(vec![
            Flow::Together(vec![signal("p"), signal("q"), signal("r")]),
            one(),
            signal("y"),
        ]),
    ]
}

/// All absolute coordinates of a path. Arcs and relative lines stay near the point before them.
fn points(d: &str) -> Vec<[f64; 2]> {
    let absolute = d.split(['M', 'L']).filter(|part| !part.is_empty());
    let pair = |part: &str| {
        let part = part.split(['a', 'h', 'v', 'Z']).next()?;
        let (x, y) = part.split_once(' ')?;
        Some([x.parse().ok()?, y.parse().ok()?])
    };
    absolute.filter_map(pair).collect()
}

/// The boxes of a drawing as left, top, right, bottom.
fn boxes(drawing: &Drawing) -> Vec<[f64; 4]> {
    let mut boxes = Vec::new();
    for shape in &drawing.shapes {
        if let DrawnShape::Path { class: "box", d } = shape {
            let [x, y] = points(d)[0];
            let number = |letter: char| -> f64 {
                let rest = d.split(letter).nth(1).unwrap();
                rest.split(char::is_alphabetic).next().unwrap().parse().unwrap()
            };
            boxes.push([x - 7.0, y, x + number('h') + 7.0, y + number('v') + 14.0]);
        }
    }
    boxes
}

#[test]
fn everything_is_inside_the_drawing() {
    for flow in all() {
        for direction in [Direction::Right, Direction::Down] {
            let drawing = drawing(&flow, direction);
            let inside = |[x, y]: [f64; 2]| x >= 0.0 && y >= 0.0 && x <= drawing.width && y <= drawing.height;
            for shape in &drawing.shapes {
                let places = match shape {
                    DrawnShape::Path { d, .. } => points(d),
                    DrawnShape::Text { x, y, .. } => vec![[*x, *y]],
                };
                assert!(!places.is_empty());
                for place in places {
                    assert!(inside(place), "{direction:?}: {place:?} in {shape:?} of {flow:?}");
                }
            }
        }
    }
}

#[test]
fn boxes_do_not_touch_one_another() {
    for flow in all() {
        for direction in [Direction::Right, Direction::Down] {
            let boxes = boxes(&drawing(&flow, direction));
            for (i, a) in boxes.iter().enumerate() {
                for b in &boxes[..i] {
                    let apart = a[2] < b[0] || b[2] < a[0] || a[3] < b[1] || b[3] < a[1];
                    assert!(apart, "{direction:?}: {a:?} on {b:?} in {flow:?}");
                }
            }
        }
    }
}

/// Every line of a signal begins and ends at a part: no line ends in empty space.
#[test]
fn no_line_crosses_a_box() {
    for flow in all() {
        for direction in [Direction::Right, Direction::Down] {
            let drawing = drawing(&flow, direction);
            let boxes = boxes(&drawing);
            for shape in &drawing.shapes {
                let DrawnShape::Path { class: "line", d } = shape else {
                    continue;
                };
                for ends in points(d).windows(2) {
                    for part in 1..20 {
                        let t = f64::from(part) / 20.0;
                        let [x, y] = [0, 1].map(|k| ends[0][k] + t * (ends[1][k] - ends[0][k]));
                        let hit = boxes
                            .iter()
                            .any(|b| x > b[0] + 1.0 && x < b[2] - 1.0 && y > b[1] + 1.0 && y < b[3] - 1.0);
                        assert!(!hit, "{direction:?}: {d} through a box of {flow:?}");
                    }
                }
            }
        }
    }
}

#[test]
fn a_loop_runs_back_to_its_sum() {
    let flow = whole(Flow::Feedback {
        forward: Box::new(block("Forward", "")),
        back: Box::new(block("Back", "")),
        subtracted: true,
    });
    let drawing = drawing(&flow, Direction::Right);
    let boxes = boxes(&drawing);
    let [forward, back] = boxes[..] else {
        panic!("{boxes:?}")
    };
    assert!(back[1] > forward[3], "the way back is below the way forward");
    let heads = drawing.shapes.iter().filter_map(|shape| match shape {
        DrawnShape::Path { class: "head", d } => Some(points(d)[0]),
        _ => None,
    });
    let heads: Vec<[f64; 2]> = heads.collect();
    assert!(
        heads.iter().any(|[x, y]| (x - back[2]).abs() < 0.2 && *y > back[1]),
        "into the way back from the right"
    );
    let lowest = heads.iter().filter(|[x, _]| *x < forward[0]).map(|[_, y]| *y);
    assert!(lowest.fold(0.0, f64::max) > forward[1], "from below into the sum");
    assert!(
        drawing
            .shapes
            .iter()
            .any(|s| matches!(s, DrawnShape::Text { class: "minus", .. }))
    );
}

#[test]
fn the_description_follows_the_signals() {
    let flow = whole(Flow::Parallel(vec![
        block("Nonlinearity", ""),
        block("Linear part", "order 3"),
    ]));
    assert_eq!(
        description(&flow),
        "u (V), then the sum of [Nonlinearity] and [Linear part (order 3)], then y (rad/s)"
    );
}

#[test]
fn a_curve_that_is_no_curve_is_left_out() {
    for (x, y) in [
        (vec![], vec![]),
        (vec![1.0], vec![1.0]),
        (vec![0.0, 1.0], vec![f64::NAN, f64::NAN]),
    ] {
        let flow = Flow::Block(DiagramBlock {
            title: "Nonlinearity".to_owned(),
            sketch: Sketch::Curve { x, y },
            note: String::new(),
        });
        let drawn = drawing(&whole(flow), Direction::Right);
        assert!(
            !drawn
                .shapes
                .iter()
                .any(|s| matches!(s, DrawnShape::Path { class: "curve", .. }))
        );
    }
}
