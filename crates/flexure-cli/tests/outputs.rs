//! What commands write: all of it or nothing, and never over what they read.

mod common;

use common::Folder;

const READ: &str = "is read and would be overwritten; give the output another name";
const TWICE: &str = "would be written twice; give every output a name of its own";

/// Names that are made of others, and files that arms and scenarios name, are kept apart too.
#[test]
fn nothing_is_written_over_what_is_read_or_twice() {
    let folder = Folder::new();
    folder.write("f-1.csv", "t,tau1,tau2,qm1,qm2,q1,q2\n0,1,2,3,4,5,6\n");
    let both = "--torque tau1,tau2 --motor qm1,qm2 --link q1,q2 --friction f.csv";
    let axes = "--axis 1..2 --torque tau{} --position q{} --friction f.csv";
    for columns in [both, axes] {
        folder.misused(&format!("joint f-1.csv {columns}"), &format!("f-1.csv {READ}"));
        folder.write("log.csv", folder.read("f-1.csv"));
        folder.misused(
            &format!("joint log.csv {columns} --report f-2.csv"),
            &format!("f-2.csv {TWICE}"),
        );
    }
    folder.done("simulate --preset space-arm --write-arm arm.toml");
    folder.done("control --preset square --write-scenario square.toml --dry-run");
    let scenario = folder.read("square.toml");
    let named = with_lines_replaced(&scenario, "arm = \"", "arm = \"arm.toml\"");
    folder.write("sc.toml", named);
    for output in ["--report arm.toml", "--write-scenario arm.toml --dry-run"] {
        folder.misused(&format!("control sc.toml {output}"), &format!("arm.toml {READ}"));
    }
    let arm = folder.read("arm.toml");
    let start = arm.find("[excitation]").unwrap();
    let end = arm[start + 1..].find("\n[").map_or(arm.len(), |end| start + 1 + end);
    let recorded = format!(
        "{}[excitation]\nkind = \"record\"\nfile = \"exc.csv\"\n{}",
        &arm[..start],
        &arm[end..]
    );
    folder.write("arec.toml", recorded);
    folder.write("exc.csv", "t,tau1,tau2\n0,1,1\n0.01,1,1\n");
    folder.misused("simulate arec.toml -o exc.csv", &format!("exc.csv {READ}"));
    folder.misused("simulate arec.toml --write-arm exc.csv", &format!("exc.csv {READ}"));
}

/// The text with `with` in place of every line that begins with `begins`.
fn with_lines_replaced(text: &str, begins: &str, with: &str) -> String {
    let line = |line: &str| match line.trim_start().starts_with(begins) {
        true => with.to_owned(),
        false => line.to_owned(),
    };
    text.lines().map(line).collect::<Vec<_>>().join("\n")
}

#[cfg(target_os = "linux")]
mod linux {
    use std::fs::OpenOptions;
    use std::process::Stdio;

    use super::common::{Folder, outcome};

    /// A file that was to be written before another one failed is as it was before.
    #[test]
    fn files_are_written_together_or_not_at_all() {
        let folder = Folder::new();
        folder.known("r.csv", 600, 1);
        for (command, kept) in [
            (
                "regress r.csv --x u --y y --grid 20 -o k.csv --report /dev/full",
                "k.csv",
            ),
            (
                "identify r.csv --input u --output y --structure linear -o k.json --report /dev/full",
                "k.json",
            ),
            ("simulate --preset space-arm -o k.csv --write-arm /dev/full", "k.csv"),
        ] {
            folder.write(kept, "OLD\n");
            let outcome = folder.run(command);
            assert_eq!(outcome.code, Some(1), "{command}: {outcome:?}");
            assert_eq!(folder.read(kept), "OLD\n", "{command}");
        }
        // Nor is anything left where the text cannot be printed.
        folder.write("k.json", "OLD\n");
        let full = || OpenOptions::new().write(true).open("/dev/full").unwrap();
        let mut command = folder.command("identify r.csv --input u --output y --structure linear -o k.json");
        assert_eq!(command.stdout(full()).status().unwrap().code(), Some(1));
        assert_eq!(folder.read("k.json"), "OLD\n");
        assert_eq!(
            folder.command("--help").stdout(full()).status().unwrap().code(),
            Some(1)
        );
        assert!(folder.content().keys().all(|name| !name.ends_with(".tmp")));
    }

    /// A program does not take what another one is about to name for what a dead one left.
    #[test]
    fn programs_that_write_the_same_files_do_not_disturb_each_other() {
        let folder = Folder::new();
        folder.known("r.csv", 600, 1);
        let command = "identify r.csv --input u --output y --structure linear -o k.json --report k.html";
        std::thread::scope(|scope| {
            for _ in 0..6 {
                scope.spawn(|| {
                    for _ in 0..4 {
                        let outcome = folder.run(command);
                        assert_eq!(outcome.code, Some(0), "{outcome:?}");
                    }
                });
            }
        });
        assert!(folder.content().keys().all(|name| !name.ends_with(".tmp")));
    }

    /// Output to the standard output by its name continues at the present place, in a file as well as in a pipe.
    #[test]
    fn the_standard_output_can_be_named() {
        let folder = Folder::new();
        folder.known("r.csv", 600, 1);
        folder.write("log.txt", "OLD\n");
        let identify = "identify r.csv --input u --output y --structure linear -o";
        let file = OpenOptions::new().append(true).open(folder.path("log.txt")).unwrap();
        let mut command = folder.command(&format!("{identify} /dev/stdout"));
        assert_eq!(command.stdout(Stdio::from(file)).status().unwrap().code(), Some(0));
        let appended = folder.read("log.txt");
        assert!(
            appended.starts_with("OLD\n{") && appended.contains("\nwrote /dev/stdout\n"),
            "{appended}"
        );
        for name in ["/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"] {
            let piped = outcome(&mut folder.command(&format!("{identify} {name}")));
            assert_eq!(piped.code, Some(0), "{piped:?}");
            assert!(
                piped.stdout.starts_with('{') && piped.stdout.contains("Linear model"),
                "{piped:?}"
            );
        }
        // A shell names a pipe so: `-o >(cat)`.
        let piped = folder.run_under(
            "{ mkfifo p; cat p > out.txt & } && exec 7> p",
            &format!("{identify} /dev/fd/7"),
        );
        assert_eq!(piped.code, Some(0), "{piped:?}");
    }
}
