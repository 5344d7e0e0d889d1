//! What a result looks like: its width, its colours; completions and manual pages.

mod common;

use common::{Folder, outcome};

const IDENTIFY: &str = "identify r.csv --input u --output y --sample-time 0.01";
const REGRESS: &str = "regress r.csv --x u --y y";

/// The text without the codes of colours.
fn plain(text: &str) -> String {
    let mut parts = text.split('\u{1b}');
    let first = parts.next().unwrap_or_default();
    let others = parts.map(|part| part.split_once('m').unwrap_or_else(|| panic!("{part:?}")).1);
    std::iter::once(first).chain(others).collect()
}

#[test]
fn colours_are_for_terminals_and_for_those_who_ask() {
    let folder = Folder::new();
    folder.known("r.csv", 600, 1);
    for command in [IDENTIFY, REGRESS] {
        let run = |environment: &[(&str, &str)]| {
            let mut command = folder.command(command);
            // What the caller's own environment says does not count.
            let outer = ["NO_COLOR", "CLICOLOR", "CLICOLOR_FORCE"];
            outer.iter().for_each(|name| {
                command.env_remove(name);
            });
            outcome(command.envs(environment.iter().copied())).stdout
        };
        let piped = run(&[]);
        assert!(
            !piped.contains('\u{1b}') && piped.starts_with(|c: char| c.is_uppercase()),
            "{piped}"
        );
        assert_eq!(run(&[("NO_COLOR", "1")]), piped);
        let forced = run(&[("CLICOLOR_FORCE", "1")]);
        assert!(forced.starts_with("\u{1b}[1m"), "the result is bold: {forced:?}");
        assert_eq!(plain(&forced), piped);
        assert_eq!(run(&[("CLICOLOR_FORCE", "1"), ("NO_COLOR", "1")]), piped);
    }
}

#[test]
fn no_line_is_wide_and_the_result_comes_first() {
    let folder = Folder::new();
    folder.known("r.csv", 600, 1);
    folder.done(&format!("{IDENTIFY} -o m.json"));
    for command in [
        IDENTIFY,
        REGRESS,
        "identify r.csv --input u --output y --structure auto",
        "identify r.csv --input u --output y --structure volterra",
        "validate m.json r.csv --input u --output y",
    ] {
        for line in folder.run(command).stdout.lines() {
            assert!(line.chars().count() <= 100, "{line}");
        }
    }
    let text = folder.done(IDENTIFY);
    let first = text.lines().next().unwrap();
    assert!(first.starts_with("Hammerstein model from 'u' to 'y': fit 8"), "{first}");
    assert!(
        text.contains(" Hz with damping 0.") && text.contains("\n    coefficients      b0 = 0."),
        "{text}"
    );
}

#[test]
fn shells_know_what_can_be_typed() {
    let folder = Folder::new();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = folder.done(&format!("completions {shell}"));
        for word in ["identify", "joint", "structure", "max-torque"] {
            assert!(script.contains(word), "{shell}: {word}");
        }
    }
    assert_eq!(folder.run("completions tcsh").code, Some(2));
}

#[test]
fn manual_pages_are_printed_and_written() {
    let folder = Folder::new();
    let page = folder.done("man identify");
    assert!(page.contains(".TH") && page.contains("structure"), "{page}");
    folder.misused("man identfy", "there is no command 'identfy'; see flexure --help");
    folder.done("man --out pages");
    for command in ["flexure", "flexure-identify", "flexure-joint"] {
        let text = folder.read(&format!("pages/{command}.1"));
        assert!(text.contains(".SH SYNOPSIS"), "{text}");
    }
}
