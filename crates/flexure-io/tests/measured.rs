//! Real measured records, where they are at hand: row counts and first values.

use std::path::{Path, PathBuf};

use flexure_io::{RecordFile, read_record};

/// The folder of measured records: `$FLEXURE_DATA`, otherwise `../shared/data` next to the repository.
fn measured(name: &str) -> Option<RecordFile> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let path = std::env::var_os("FLEXURE_DATA")
        .map_or(beside, PathBuf::from)
        .join(name);
    if path.is_file() {
        return Some(read_record(path).unwrap());
    }
    println!("skipped: {} is not there", path.display());
    None
}

#[test]
fn text_records() {
    for (name, columns, rows, first) in [
        (
            "wiener-hammerstein-2009-estimation.csv",
            ["u", "y"],
            100_000,
            [-0.034678, -0.11124],
        ),
        ("daisy-dryer.dat", ["c0", "c1"], 1000, [6.41, 4.7660989]),
        ("daisy-robot-arm.dat", ["c0", "c1"], 1024, [0.22183165, -0.1770363]),
    ] {
        let Some(file) = measured(name) else { continue };
        assert_eq!(file.record.names(), columns);
        assert_eq!(file.record.len(), rows);
        assert_eq!(columns.map(|c| file.finite(c).unwrap()[0]), first);
    }
}

#[test]
fn mat_record() {
    let Some(file) = measured("emps-estimation.mat") else {
        return;
    };
    assert_eq!(file.record.len(), 24_841);
    for name in ["t", "qg", "qm", "vir"] {
        file.finite(name).unwrap();
    }
    assert!((file.sample_time("t").unwrap() - 1e-3).abs() < 1e-9);
    assert!(
        file.constants
            .iter()
            .any(|(name, value)| name == "gtau" && (value - 35.15).abs() < 0.01)
    );
}
