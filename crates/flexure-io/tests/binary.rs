//! MAT v5 and Parquet against files that SciPy and PyArrow wrote.

mod common;

use std::fs::OpenOptions;
use std::io::{Seek, SeekFrom, Write};
use std::path::Path;

use common::{directory, fixture, message};
use flexure_io::{RecordFile, read_record};

fn text(name: &str) -> String {
    message(&read_record(fixture(name)).unwrap_err(), &fixture("")).replace(&format!("{}", fixture("").display()), "")
}

fn complaint(file: &RecordFile, column: &str) -> String {
    let directory = file.path.parent().unwrap();
    message(&file.finite(column).unwrap_err(), directory)
}

fn steps(count: usize, f: impl Fn(f64) -> f64) -> Vec<f64> {
    (0..count).map(|k| f(k as f64)).collect()
}

fn close(a: &[f64], b: &[f64]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-18)
}

#[test]
fn mat_vectors_scalars_and_all_the_rest() {
    for name in ["signals.mat", "signals_compressed.mat"] {
        let file = read_record(fixture(name)).unwrap();
        assert_eq!(file.record.names(), ["t", "u", "counts", "single", "on", "wide"]);
        assert_eq!(file.constants, [("gain".to_owned(), 35.15), ("mass".to_owned(), 1.0)]);
        assert_eq!(file.finite("t").unwrap(), steps(6, |k| k / 8.0));
        assert!(close(file.finite("u").unwrap(), &steps(6, |k| k.sin() * 1e-3)));
        assert_eq!(file.finite("counts").unwrap(), steps(6, |k| k - 3.0));
        assert_eq!(file.finite("single").unwrap(), steps(6, |k| k / 4.0));
        assert_eq!(file.finite("on").unwrap(), [1.0, 0.0, 1.0, 0.0, 1.0, 0.0]);
        assert_eq!(file.finite("wide").unwrap(), steps(6, |k| k + 5.0 - 2f64.powi(53)));
        let rest = [
            (
                "too_wide",
                "a vector of integers beyond 2^53, which cannot be represented exactly",
            ),
            ("gain", "a single number, 35.15; a signal is a vector"),
            ("label", "text (1x5)"),
            ("mass", "a single number, 1; a signal is a vector"),
            ("name", "text (1x3)"),
            ("pair", "a matrix (6x2); save each signal as a vector of its own"),
            ("phasor", "complex (6x1); save its real and imaginary parts apart"),
            ("nothing", "empty (0x0)"),
            ("cells", "a cell array (1x2)"),
        ];
        for (variable, what) in rest {
            assert_eq!(
                complaint(&file, variable),
                format!("{name}: '{variable}' cannot serve as a signal: it is {what}")
            );
        }
        assert_eq!(
            complaint(&file, "y"),
            format!("{name}: no column 'y'; the columns are: t, u, counts, single, on, wide")
        );
    }
}

/// A log is often one structure: its fields are the columns.
#[test]
fn mat_structures_are_opened() {
    for name in ["structure.mat", "structure_compressed.mat"] {
        let file = read_record(fixture(name)).unwrap();
        assert_eq!(file.record.names(), ["t", "u"]);
        assert_eq!(file.finite("t").unwrap(), steps(6, |k| k / 8.0));
        assert!(close(file.finite("u").unwrap(), &steps(6, |k| k.sin() * 1e-3)));
        let constants = [("Kp", 2.5), ("Ts", 0.125)].map(|(name, value)| (name.to_owned(), value));
        assert_eq!(file.constants, constants);
        assert_eq!(file.notes[0], "the fields of the structure 'log' are read as variables");
        for (variable, what) in [
            ("limits", "a vector of 3, where the signals have 6"),
            ("note", "text (1x5)"),
            (
                "info",
                "a structure within a structure (1x1); save its fields as variables",
            ),
            ("none", "empty (0x0)"),
        ] {
            assert_eq!(
                complaint(&file, variable),
                format!("{name}: '{variable}' cannot serve as a signal: it is {what}")
            );
        }
        // Neither a single number nor a text has the instants.
        assert_eq!(file.unread_instants(), None);
        assert_eq!(file.stated_sample_time(), Some(("Ts", 0.125)));
    }
    // A name that is there twice has that of the structure in front of it.
    let file = read_record(fixture("structures.mat")).unwrap();
    assert_eq!(file.record.names(), ["u", "a.u", "a.y", "b.y", "z"]);
    assert_eq!(file.finite("b.y").unwrap(), steps(6, |k| k + 3.0));
    let constants = [("a.gain", 1.5), ("gain", 2.0)].map(|(name, value)| (name.to_owned(), value));
    assert_eq!(file.constants, constants);
    assert_eq!(
        file.notes[0],
        "the fields of the structures 'a', 'b' are read as variables"
    );
    let said = text("structure_array.mat");
    assert!(
        said.contains("'runs' is a structure (1x2); save its fields as variables; 'empty' is a structure (0x0)"),
        "{said}"
    );
}

#[test]
fn mat_doubles_stored_narrowly_in_both_byte_orders() {
    for name in ["narrow_little.mat", "narrow_big.mat"] {
        let file = read_record(fixture(name)).unwrap();
        assert_eq!(file.finite("u").unwrap(), [-300.0, 0.0, 7.0, 32767.0]);
        assert_eq!(file.finite("y").unwrap(), [0.0, 1.0, 200.0, 255.0]);
    }
}

#[test]
fn mat_files_without_a_record_say_what_they_hold() {
    assert_eq!(
        text("unequal.mat"),
        "unequal.mat: 'y' has 5 samples where 4 were expected; all columns must have the same length"
    );
    assert_eq!(
        text("matrix_only.mat"),
        "matrix_only.mat cannot be read as MAT v5: it holds no vector of real numbers: 'pair' is a matrix (2x2); save each signal as a vector of its own; 'gain' is a scalar"
    );
    let dir = directory("not_mat");
    let mut hdf5 = b"MATLAB 7.3 MAT-file".to_vec();
    hdf5.resize(512, b' ');
    hdf5.extend_from_slice(b"\x89HDF\r\n\x1a\n and more");
    for (name, content, expected) in [
        (
            "new.mat",
            hdf5,
            "new.mat cannot be read as HDF5: unsupported superblock version 32; save it again, uncompressed or with deflate",
        ),
        (
            "old.mat",
            vec![0; 200],
            "old.mat cannot be read as MAT v5: its header is not that of MAT v5; save it with -v7",
        ),
        (
            "cut.mat",
            b"MATLAB 5.0 MAT-file".to_vec(),
            "cut.mat is truncated: it ends after 19 of the 128 bytes of a MAT file's header; copy or save it again",
        ),
    ] {
        std::fs::write(dir.join(name), content).unwrap();
        assert_eq!(message(&read_record(dir.join(name)).unwrap_err(), &dir), expected);
    }
}

#[test]
fn parquet_of_every_supported_compression() {
    for codec in ["none", "snappy", "zstd"] {
        let name = format!("signals_{codec}.parquet");
        let file = read_record(fixture(&name)).unwrap();
        assert_eq!(
            file.record.names(),
            ["t", "u", "single", "counts", "unsigned", "wide", "on"]
        );
        assert_eq!(file.finite("t").unwrap(), steps(6, |k| k / 8.0));
        let u = file.column("u").unwrap();
        assert!(u[2].is_nan() && close(&u[3..], &steps(6, |k| k.sin() * 1e-3)[3..]));
        assert_eq!(file.finite("single").unwrap(), steps(6, |k| k / 4.0));
        assert_eq!(file.column("counts").unwrap()[..5], steps(5, |k| k - 3.0));
        assert_eq!(file.finite("unsigned").unwrap(), steps(6, |k| 4294967295.0 - k));
        assert_eq!(file.finite("wide").unwrap(), steps(6, |k| 2f64.powi(53) - k));
        assert_eq!(file.finite("on").unwrap(), [1.0, 0.0, 1.0, 0.0, 1.0, 0.0]);
        assert_eq!(
            complaint(&file, "u"),
            format!("{name}: column 'u' is NaN or missing at sample 2; remove or repair that sample")
        );
        assert_eq!(
            complaint(&file, "too_wide"),
            format!(
                "{name}: 'too_wide' cannot serve as a signal: it is a column of integers beyond 2^53, which cannot be represented exactly"
            )
        );
        assert_eq!(
            complaint(&file, "pair"),
            format!(
                "{name}: 'pair' cannot serve as a signal: it is a nested column; save each signal as a column of its own"
            )
        );
        for column in ["label", "when"] {
            assert!(complaint(&file, column).ends_with("; save it as floating-point numbers"));
        }
    }
}

#[test]
fn parquet_files_without_a_record_say_why() {
    assert!(
        text("no_rows.parquet").ends_with(" but no samples"),
        "{}",
        text("no_rows.parquet")
    );
    assert!(text("no_numbers.parquet").contains("it has no column of numbers: 'label' is a column of type String"));
    let gzip = text("signals_gzip.parquet");
    assert!(
        gzip.ends_with("; save it again, uncompressed or with Snappy or Zstandard"),
        "{gzip}"
    );
    let dir = directory("not_parquet");
    std::fs::write(dir.join("a.parquet"), "u,y\n1,2\n3,4\n5,6\n").unwrap();
    assert_eq!(
        message(&read_record(dir.join("a.parquet")).unwrap_err(), &dir),
        "a.parquet cannot be read as Parquet: it does not begin with PAR1; give it the extension of its true format"
    );
}

/// The bytes at which a shorter file is a valid one: the ends of its variables.
fn variable_ends(mat: &[u8]) -> Vec<usize> {
    let mut ends = vec![128];
    let mut at = 128;
    while at < mat.len() {
        at += 8 + u32::from_le_bytes(mat[at + 4..at + 8].try_into().unwrap()) as usize;
        ends.push(at);
    }
    ends
}

#[test]
fn truncation_at_every_byte_is_an_error_that_says_so() {
    let dir = directory("truncated");
    for name in [
        "signals.mat",
        "signals_compressed.mat",
        "structure.mat",
        "signals_snappy.parquet",
    ] {
        let whole = std::fs::read(fixture(name)).unwrap();
        let ends = if name.ends_with(".mat") {
            variable_ends(&whole)
        } else {
            vec![0]
        };
        std::fs::write(dir.join(name), &whole).unwrap();
        let file = OpenOptions::new().write(true).open(dir.join(name)).unwrap();
        for length in (1..whole.len()).rev().filter(|length| !ends.contains(length)) {
            file.set_len(length as u64).unwrap();
            let error = message(&read_record(dir.join(name)).unwrap_err(), &dir);
            assert!(
                error.starts_with(&format!("{name} is truncated: it ends after {length} ")),
                "{length}: {error}"
            );
        }
    }
}

fn flip_every_byte(path: &Path, whole: &[u8], step: usize) -> usize {
    let mut refused = 0;
    std::fs::write(path, whole).unwrap();
    let mut file = OpenOptions::new().write(true).open(path).unwrap();
    let mut put = |at: usize, byte: u8| {
        file.seek(SeekFrom::Start(at as u64)).unwrap();
        file.write_all(&[byte]).unwrap();
    };
    for at in (0..whole.len()).step_by(step) {
        for mask in [0x01, 0x80, 0xff] {
            put(at, whole[at] ^ mask);
            refused += usize::from(read_record(path).is_err());
        }
        put(at, whole[at]);
    }
    refused
}

#[test]
fn flipped_bits_never_panic() {
    let dir = directory("flipped");
    for name in [
        "signals.mat",
        "signals_compressed.mat",
        "structure.mat",
        "signals_none.parquet",
        "signals_zstd.parquet",
    ] {
        let whole = std::fs::read(fixture(name)).unwrap();
        let refused = flip_every_byte(&dir.join(name), &whole, if name.ends_with(".mat") { 1 } else { 7 });
        assert!(refused > 0, "{name}");
    }
}
