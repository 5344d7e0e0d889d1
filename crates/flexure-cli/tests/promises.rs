//! The table of promises, docs/promises.md: every row names tests, and they are there.

use std::path::{Path, PathBuf};

/// What a row names in place of a test.
const RUNS: [&str; 2] = ["fuzz/run", "fuzz/faults"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The text of all sources with tests in a folder and below.
fn sources(folder: &Path, text: &mut String) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if path.is_dir() && !name.starts_with('.') && name != "target" {
            sources(&path, text);
        } else if name.ends_with(".rs") || name.ends_with(".py") {
            *text += &std::fs::read_to_string(&path).unwrap();
        }
    }
}

/// The parts of a text between backquotes.
fn quoted(text: &str) -> Vec<&str> {
    text.split('`').skip(1).step_by(2).collect()
}

#[test]
fn every_promise_has_its_test() {
    let page = std::fs::read_to_string(root().join("docs/promises.md")).unwrap();
    let mut text = String::new();
    for folder in ["crates", "python", "fuzz"] {
        sources(&root().join(folder), &mut text);
    }
    let mut names = 0;
    for row in page
        .lines()
        .filter(|line| line.starts_with('|') && !line.starts_with("|---"))
    {
        let cells: Vec<&str> = row.trim_matches('|').split(" | ").collect();
        let &[_, _, tests] = &cells[..] else {
            panic!("this row has not three cells: {row}")
        };
        if tests.trim() == "test" {
            continue;
        }
        let named = quoted(tests);
        assert!(!named.is_empty(), "no test is named: {row}");
        // Behind the name of a run come its targets.
        let of_run = RUNS.contains(&named[0]);
        for name in named {
            let there = match (RUNS.contains(&name), of_run) {
                (true, _) => root().join(name).is_file(),
                (false, true) => text.contains(&format!("\"{name}\"")),
                (false, false) => text.contains(&format!("fn {name}(")) || text.contains(&format!("def {name}(")),
            };
            assert!(there, "there is no test {name}, which is named in: {row}");
            names += 1;
        }
    }
    assert!(names > 30, "{names}");
}
