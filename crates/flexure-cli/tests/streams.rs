//! Output that nobody reads, output that cannot be written, and names that are not Unicode.

mod common;

use std::process::Stdio;

use common::{Folder, outcome};

/// Commands, in words and as JSON.
const COMMANDS: [&str; 9] = [
    "identify record.csv --input u --output y",
    "identify record.csv --input u --output y --json",
    "identify record.csv --input u --output y --method plain",
    "predict model.json record.csv --input u -o predicted.csv",
    "predict model.json record.csv --input u -o predicted.csv --json",
    "validate model.json record.csv --input u --output y",
    "validate model.json record.csv --input u --output y --json",
    "simulate --preset space-arm --write-arm arm.toml",
    "simulate --preset space-arm --write-arm arm.toml --json",
];

fn folder() -> Folder {
    let folder = Folder::new();
    folder.known("record.csv", 600, 1);
    folder.done("identify record.csv --input u --output y -o model.json");
    folder
}

/// Runs a command whose results go to `stdout`; its exit code, and what it said on the error stream.
fn run_into(folder: &Folder, command: &str, stdout: impl Into<Stdio>) -> (Option<i32>, String) {
    let mut command = folder.command(command);
    let child = command.stdout(stdout).stderr(Stdio::piped()).spawn().unwrap();
    let output = child.wait_with_output().unwrap();
    (output.status.code(), String::from_utf8(output.stderr).unwrap())
}

/// `flexure ... | true`: the reader has gone, which is its own affair.
#[test]
fn a_closed_pipe_ends_quietly() {
    let folder = folder();
    for command in COMMANDS {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        assert_eq!(
            run_into(&folder, command, writer),
            (Some(0), String::new()),
            "{command}"
        );
    }
}

/// `flexure ... > /dev/full`, which is Linux's file without room.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_an_error() {
    let folder = folder();
    for command in COMMANDS {
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let (code, message) = run_into(&folder, command, full);
        assert_eq!(code, Some(1), "{command}: {message}");
        assert!(
            message.starts_with("error: cannot write the standard output: ") && message.lines().count() == 1,
            "{command}: {message}"
        );
    }
}

/// The page says how it was made, in words that a shell takes.
#[test]
fn the_page_names_the_command_and_not_where_it_lies() {
    let folder = folder();
    std::fs::copy(folder.path("record.csv"), folder.path("my record.csv")).unwrap();
    let mut command = folder.command("identify");
    command.args([
        "my record.csv",
        "--input",
        "u",
        "--output",
        "y",
        "--report",
        "page.html",
    ]);
    assert_eq!(outcome(&mut command).code, Some(0));
    let page = folder.read("page.html");
    let (_, rest) = page.split_once("<pre tabindex=\"0\"><code>").unwrap();
    let (shown, _) = rest.split_once("</code>").unwrap();
    let shown = shown.replace("&#x27;", "'").replace("&#39;", "'");
    assert_eq!(
        shown,
        "flexure identify 'my record.csv' --input u --output y --report page.html"
    );
}

#[cfg(target_os = "linux")]
#[test]
fn names_that_are_not_unicode() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    let folder = folder();
    let name = OsStr::from_bytes(b"r\xe9cord.csv");
    std::fs::copy(folder.path("record.csv"), folder.path("").join(name)).unwrap();
    let mut command = folder.command("identify");
    command
        .arg(name)
        .args(["--input", "u", "--output", "y", "--report", "page.html"]);
    let outcome = outcome(&mut command);
    assert_eq!((outcome.code, &*outcome.stderr), (Some(0), ""), "{outcome:?}");
    assert!(folder.read("page.html").contains("r\u{fffd}cord.csv"));
}
