//! `flexure study rates`: tables, page, and a state to go on from.

mod common;

use common::Folder;
use serde_json::Value;

const SMALL: &str = "study rates --parts plain --lengths 200,400 --runs 20";

#[test]
fn the_tables_have_every_setting_beside_its_exponent() {
    let folder = Folder::new();
    let text = folder.done("study rates --parts plain,refined --lengths 300,600 --runs 20 --report r.html");
    for expected in [
        "|x|, Hammerstein, uniform X, at x = 0",
        "-0.333",
        "dead zone, refined",
        "<= -0.500",
        "wrote r.html",
    ] {
        assert!(text.contains(expected), "{expected}: {text}");
    }
    let page = folder.read("r.html");
    for expected in [
        "Theorems 1 and 2",
        "Hard limiter",
        "flexure study rates --parts",
        "\u{2212}0.333",
    ] {
        assert!(page.contains(expected), "{expected}");
    }
}

#[test]
fn a_seed_gives_the_same_numbers_whatever_the_threads_and_another_seed_others() {
    let folder = Folder::new();
    let json = |options: &str, threads: &str| -> Value {
        let outcome = folder.run_with(&format!("{SMALL} --json {options}"), &[("RAYON_NUM_THREADS", threads)]);
        assert_eq!(outcome.code, Some(0), "{outcome:?}");
        serde_json::from_str(&outcome.stdout).unwrap()
    };
    let one = json("", "1");
    assert_eq!(one, json("--seed 1", "3"));
    assert_ne!(one, json("--seed 2", "1"));
    let results = one["plain"]["results"].as_array().unwrap();
    assert_eq!(results.len(), 25);
    for r in results {
        let [low, high] = [0, 1].map(|k| r["interval"][k].as_f64().unwrap());
        let slope = r["slope"].as_f64().unwrap();
        assert!(low < slope && slope < high, "{r}");
    }
    assert_eq!(one["refined"], Value::Null);
}

#[test]
fn a_state_is_gone_on_from_and_gives_the_same_result() {
    let folder = Folder::new();
    let whole = folder.done(&format!("{SMALL} --json"));
    let with_state = folder.done(&format!("{SMALL} --json --resume s.json"));
    assert_eq!(whole, with_state);
    // The state that a study leaves if it is stopped halfway.
    let mut state: Value = serde_json::from_str(&folder.read("s.json")).unwrap();
    let done = state["plain"]["done"].as_object_mut().unwrap();
    done.retain(|setting, _| setting.parse::<usize>().unwrap() < 12);
    folder.write("s.json", state.to_string());
    let outcome = folder.run(&format!("{SMALL} --json --resume s.json"));
    assert_eq!(outcome.stdout, whole);
    assert!(
        outcome.stderr.contains("going on from s.json: 48 % done"),
        "{outcome:?}"
    );
}

#[test]
fn what_makes_no_sense_is_refused_and_nothing_is_written() {
    let folder = Folder::new();
    folder.done(&format!("{SMALL} --resume s.json"));
    folder.write("other.json", "{\"format\": 1}");
    let before = folder.content();
    for (command, code, message) in [
        (
            format!("{SMALL} --seed 2 --resume s.json"),
            1,
            "s.json: the state of another study",
        ),
        (
            format!("{SMALL} --resume other.json"),
            1,
            "other.json: not the state of a study",
        ),
        ("study rates --lengths 400,200".to_owned(), 2, "200 follows 400"),
        (
            "study rates --runs 5".to_owned(),
            2,
            "expected a whole number from 20 to 100000",
        ),
        ("study rates --parts none".to_owned(), 2, "invalid value 'none'"),
        ("study speed".to_owned(), 2, "invalid value 'speed'"),
        (format!("{SMALL} --report no/r.html"), 1, "no/r.html"),
    ] {
        let outcome = folder.run(&command);
        assert_eq!(outcome.code, Some(code), "{command}: {outcome:?}");
        assert!(outcome.stderr.contains(message), "{command}: {}", outcome.stderr);
        assert_eq!(outcome.stdout, "", "{command}");
    }
    assert_eq!(folder.content(), before);
}
