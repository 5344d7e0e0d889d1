//! What becomes of files: modes, links, long names, what dead writers left, and pipes as inputs.
#![cfg(unix)]

mod common;

use std::fs::{self, File};
use std::io::Write;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::{Path, PathBuf};
use std::process::Command;

use common::{directory, fixture};
use flexure_io::{check_writable, read_record, write_atomically};

fn write(path: &Path, text: &str) {
    write_atomically(path, |out| out.write_all(text.as_bytes())).unwrap();
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn a_file_that_is_replaced_keeps_its_mode_and_owner() {
    use std::os::unix::fs::{MetadataExt, chown};
    let folder = directory("modes");
    let path = folder.join("model.json");
    for mode in [0o600, 0o640, 0o666, 0o755] {
        fs::write(&path, "old").unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(mode)).unwrap();
        write(&path, "new");
        assert_eq!(fs::read_to_string(&path).unwrap(), "new");
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o7777, mode);
    }
    // Only the superuser may give files away.
    if chown(&path, Some(1234), Some(2345)).is_ok() {
        write(&path, "newer");
        let found = fs::metadata(&path).unwrap();
        assert_eq!((found.uid(), found.gid()), (1234, 2345));
    }
}

#[test]
fn links_are_followed_to_what_is_not_there_yet() {
    let folder = directory("dangling");
    fs::create_dir(folder.join("data")).unwrap();
    symlink("data/real.csv", folder.join("second")).unwrap();
    symlink("second", folder.join("first")).unwrap();
    write(&folder.join("first"), "u\n1\n");
    assert_eq!(fs::read_to_string(folder.join("data/real.csv")).unwrap(), "u\n1\n");
    assert!(folder.join("first").is_symlink() && folder.join("second").is_symlink());

    symlink("b", folder.join("a")).unwrap();
    symlink("a", folder.join("b")).unwrap();
    let said = check_writable(folder.join("a")).unwrap_err().to_string();
    assert!(said.contains("links"), "{said}");
}

#[test]
fn names_may_be_as_long_as_the_system_has_them() {
    let folder = directory("long_names");
    for length in [170, 200, 255] {
        let name = "n".repeat(length);
        write(&folder.join(&name), "new");
        assert_eq!(names(&folder), std::slice::from_ref(&name));
        fs::remove_file(folder.join(name)).unwrap();
    }
}

#[test]
fn what_a_dead_writer_left_is_removed_and_what_a_living_one_writes_is_not() {
    let folder = directory("leftovers");
    let long = "n".repeat(250);
    for name in ["out.csv", long.as_str()] {
        // A writer that is killed: what it was writing stays, without a lock.
        let mut left = None;
        let failed = write_atomically(folder.join(name), |_| {
            left = names(&folder).into_iter().find(|found| found.ends_with(".tmp"));
            Err(std::io::Error::other("killed"))
        });
        assert!(failed.is_err());
        let left = left.unwrap();
        fs::write(folder.join(&left), "half").unwrap();
        let living = left.replace("-", "9-");
        let lock = File::create(folder.join(&living)).unwrap();
        lock.lock().unwrap();
        for other in [
            ".other.csv.1-0.tmp",
            ".out.csv.bak",
            ".out.csv.x-1.tmp",
            ".out.csv.2.1-0.tmp",
        ] {
            fs::write(folder.join(other), "").unwrap();
        }
        write(&folder.join(name), "new");
        let found = names(&folder);
        assert!(!found.contains(&left), "{found:?}");
        assert!(found.contains(&living), "{found:?}");
        drop(lock);
        write(&folder.join(name), "newer");
        let found = names(&folder);
        assert!(!found.contains(&living), "{found:?}");
        assert_eq!(found.len(), 5, "{found:?}");
        names(&folder)
            .iter()
            .for_each(|name| fs::remove_file(folder.join(name)).unwrap());
    }
}

/// Two writers of one file at a time: it is one's or the other's, whole, and nothing is left.
#[test]
fn two_writers() {
    let folder = directory("two_writers");
    let path = folder.join("out.csv");
    let texts = ["a".repeat(100_000), "b".repeat(100_000)];
    std::thread::scope(|scope| {
        for text in &texts {
            let path = &path;
            scope.spawn(move || (0..50).for_each(|_| write(path, text)));
        }
    });
    assert!(texts.contains(&fs::read_to_string(&path).unwrap()));
    assert_eq!(names(&folder), ["out.csv"]);
}

/// A pipe with a name, into which the file's content goes.
fn fifo(folder: &Path, file: &Path) -> PathBuf {
    let name = format!("pipe-{}", file.file_name().unwrap().to_str().unwrap());
    let path = folder.join(name.replace('.', "-"));
    assert!(Command::new("mkfifo").arg(&path).status().unwrap().success());
    let (content, into) = (fs::read(file).unwrap(), path.clone());
    std::thread::spawn(move || fs::write(into, content).unwrap());
    path
}

#[test]
fn every_format_can_come_through_a_pipe() {
    let folder = directory("pipes");
    let csv = folder.join("r.csv");
    fs::write(&csv, "u,y\n1,2\n3,4\n").unwrap();
    let parquet = folder.join("r.parquet");
    flexure_io::write_record(&parquet, &read_record(&csv).unwrap().record).unwrap();
    for file in [csv, parquet, fixture("signals.mat"), fixture("signals_compressed.mat")] {
        let piped = read_record(fifo(&folder, &file)).unwrap();
        assert_eq!(piped.record, read_record(&file).unwrap().record, "{}", file.display());
    }
}
