//! Signals, and inputs and outputs that are no files on a disk.
#![cfg(unix)]

mod common;

use std::fs::OpenOptions;
use std::io::Write;
use std::os::unix::process::ExitStatusExt;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use common::{Folder, outcome};

fn kill(child: &Child, signal: &str) {
    let killed = Command::new("kill")
        .args([signal, &child.id().to_string()])
        .status()
        .unwrap();
    assert!(killed.success());
}

/// The names of the temporary files, which a running program may remove meanwhile.
fn temporaries(folder: &Folder) -> Vec<String> {
    std::fs::read_dir(folder.path(""))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name.ends_with(".tmp"))
        .collect()
}

/// The folder of a compiler goes with the program.
#[test]
fn a_signal_during_a_compilation_leaves_no_folder() {
    use std::os::unix::fs::PermissionsExt;

    let folder = Folder::new();
    folder.known("r.csv", 600, 1);
    folder.done("identify r.csv --input u --output y --structure linear -o m.json");
    folder.write("cc", "#!/bin/sh\nexec sleep 5\n");
    std::fs::set_permissions(folder.path("cc"), std::fs::Permissions::from_mode(0o755)).unwrap();
    std::fs::create_dir(folder.path("tmp")).unwrap();
    let mut child = folder
        .command("export m.json --to fmu --compile -o m.fmu")
        .env("CC", folder.path("cc"))
        .env("TMPDIR", folder.path("tmp"))
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let left = || std::fs::read_dir(folder.path("tmp")).unwrap().count();
    while left() == 0 && child.try_wait().unwrap().is_none() {
        std::thread::sleep(Duration::from_millis(5));
    }
    kill(&child, "-TERM");
    assert_eq!(child.wait().unwrap().signal(), Some(15));
    assert_eq!(left(), 0);
    assert!(!folder.path("m.fmu").exists());
}

/// A run that is stopped while it writes leaves the old file, and nothing else.
#[test]
fn a_signal_during_a_write_leaves_the_old_file() {
    let folder = Folder::new();
    let rows: String = (0..200_000).map(|k| format!("{k},{},{}\n", k % 7, k % 11)).collect();
    folder.write("big.csv", format!("t,u,y\n{rows}"));
    // A shell starts tests in the background with SIGINT ignored, and so would the child. What has a handler here does not stay ignored there.
    for ignored in [signal_hook::consts::SIGINT, signal_hook::consts::SIGHUP] {
        signal_hook::flag::register(ignored, Default::default()).unwrap();
    }
    for (signal, number) in [("-INT", 2), ("-TERM", 15), ("-HUP", 1)] {
        folder.write("out.csv", "old\n");
        // It may be done before it is stopped: then once more.
        let stopped = (0..20).any(|_| {
            let mut child = folder
                .command("prepare big.csv -o out.csv")
                .stderr(Stdio::null())
                .stdout(Stdio::null())
                .spawn()
                .unwrap();
            while temporaries(&folder).is_empty() && child.try_wait().unwrap().is_none() {
                std::thread::sleep(Duration::from_millis(1));
            }
            kill(&child, signal);
            let status = child.wait().unwrap();
            assert_eq!(temporaries(&folder), Vec::<String>::new());
            match status.signal() {
                Some(by) => {
                    assert_eq!(by, number);
                    assert_eq!(folder.read("out.csv"), "old\n");
                    true
                }
                None => {
                    folder.write("out.csv", "old\n");
                    false
                }
            }
        });
        assert!(stopped, "{signal}");
    }
    // What even SIGKILL leaves is gone after the next write.
    folder.write(".out.csv.1-0.tmp", "half");
    folder.done("prepare big.csv -o out.csv");
    assert_eq!(temporaries(&folder), Vec::<String>::new());
}

#[test]
fn records_models_and_arms_come_through_pipes() {
    let folder = Folder::new();
    folder.known("r.csv", 600, 1);
    folder.done("prepare r.csv -o r.parquet");
    folder.done("identify r.csv --input u --output y -o model.json");
    folder.done("simulate --preset space-arm --write-arm arm.toml");
    let short = folder.read("arm.toml").replace("duration = 10.0", "duration = 0.5");
    folder.write("arm.toml", short);
    for (file, from_file) in [
        ("r.csv", "identify INPUT --input u --output y --json"),
        ("r.parquet", "identify INPUT --input u --output y --json"),
        ("model.json", "validate INPUT r.csv --json"),
        ("arm.toml", "simulate INPUT -o s.csv --json"),
    ] {
        let expected = folder.done(&from_file.replace("INPUT", file));
        let strip = |text: &str| text.replace(file, "INPUT");
        for input in ["-", "/dev/stdin"] {
            let mut command = folder.command(&from_file.replace("INPUT", input));
            let mut child = command
                .stdin(Stdio::piped())
                .stdout(Stdio::piped())
                .stderr(Stdio::piped())
                .spawn()
                .unwrap();
            let content = std::fs::read(folder.path(file)).unwrap();
            child.stdin.take().unwrap().write_all(&content).unwrap();
            let output = child.wait_with_output().unwrap();
            let said = String::from_utf8(output.stderr).unwrap();
            assert!(output.status.success(), "{file} through {input}: {said}");
            let printed = String::from_utf8(output.stdout).unwrap();
            let lengths = [strip(&printed), strip(&expected)].map(|text| text.split(',').count());
            assert_eq!(lengths[0], lengths[1], "{file} through {input}: {printed}\n{expected}");
        }
    }
}

#[test]
fn a_model_that_is_secret_stays_secret_and_a_link_leads_to_a_new_file() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let folder = Folder::new();
    folder.known("r.csv", 600, 1);
    folder.write("model.json", "");
    std::fs::set_permissions(folder.path("model.json"), std::fs::Permissions::from_mode(0o600)).unwrap();
    folder.done("identify r.csv --input u --output y -o model.json");
    let mode = std::fs::metadata(folder.path("model.json"))
        .unwrap()
        .permissions()
        .mode();
    assert_eq!(mode & 0o777, 0o600);
    symlink("there.json", folder.path("link.json")).unwrap();
    folder.done("identify r.csv --input u --output y -o link.json");
    assert!(folder.path("link.json").is_symlink());
    folder.done("validate there.json r.csv");
}

/// A disk without room leaves the old file; where no small disk can be made, a device that is always full.
#[test]
fn a_full_disk_leaves_the_old_file() {
    let folder = Folder::new();
    folder.known("r.csv", 20_000, 1);
    let disk = folder.path("disk");
    std::fs::create_dir(&disk).unwrap();
    let mounted = Command::new("mount")
        .args(["-t", "tmpfs", "-o", "size=64k", "none"])
        .arg(&disk)
        .stderr(Stdio::null())
        .status();
    if !mounted.is_ok_and(|status| status.success()) {
        eprintln!("no small disk can be made here: not tried");
        return;
    }
    folder.write("disk/out.csv", "old\n");
    let run = outcome(&mut folder.command("prepare r.csv -o disk/out.csv"));
    let left = std::fs::read_dir(&disk).unwrap().count();
    let old = folder.read("disk/out.csv");
    assert!(Command::new("umount").arg(&disk).status().unwrap().success());
    assert_eq!(run.code, Some(1), "{run:?}");
    assert!(run.stderr.contains("cannot write disk/out.csv"), "{run:?}");
    assert_eq!((left, old.as_str()), (1, "old\n"));
}

/// A folder and a file that may not be written leave everything as it was.
#[test]
fn what_may_not_be_written_is_said_before_anything_is_computed() {
    use std::os::unix::fs::PermissionsExt;
    let folder = Folder::new();
    folder.known("r.csv", 600, 1);
    folder.write("out.json", "old");
    std::fs::set_permissions(folder.path("out.json"), std::fs::Permissions::from_mode(0o444)).unwrap();
    folder.refused(
        "identify r.csv --input u --output y -o out.json",
        1,
        "cannot write out.json: permission denied",
    );
    let unwritable = OpenOptions::new().write(true).open(folder.path("none/x"));
    assert!(unwritable.is_err());
    folder.refused(
        "identify r.csv --input u --output y -o none/x.json",
        1,
        "cannot write none/x.json: there is no such file or directory",
    );
}
