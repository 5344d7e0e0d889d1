//! HDF5 and MAT v7.3 against files that h5py wrote, and what h5py reads of them (`scripts/reference/hdf5_fixtures.py`).

mod common;

use std::collections::BTreeMap;

use common::{directory, fixture, message};
use flexure_io::{Error, ReadOptions, read_record};

fn refused(name: &str) -> String {
    message(
        &read_record(fixture(&format!("hdf5/{name}"))).unwrap_err(),
        &fixture("hdf5"),
    )
}

fn reference() -> BTreeMap<String, Vec<String>> {
    serde_json::from_str(&std::fs::read_to_string(fixture("hdf5/hdf5.json")).unwrap()).unwrap()
}

fn bits(samples: &[f64]) -> Vec<String> {
    samples.iter().map(|v| format!("{:016x}", v.to_bits())).collect()
}

#[test]
fn every_number_is_that_of_h5py_to_the_bit() {
    for name in ["plain.h5", "latest.h5", "big.h5", "chunks.h5", "v73.mat"] {
        let path = fixture(&format!("hdf5/{name}"));
        let file = read_record(&path).unwrap();
        for (column, expected) in reference() {
            assert_eq!(bits(file.finite(&column).unwrap()), expected, "{name} {column}");
        }
        assert_eq!(file.record.names().len(), reference().len(), "{name}");
        assert_eq!(file.constants, [("gain".to_owned(), 35.15)], "{name}");
    }
    assert_eq!(read_record(fixture("hdf5/big.h5")).unwrap().unit("u"), Some("N m"));
}

#[test]
fn what_is_no_signal_is_named() {
    let complaint = |name: &str, column: &str| {
        let file = read_record(fixture(&format!("hdf5/{name}"))).unwrap();
        let error = message(&file.finite(column).unwrap_err(), &fixture("hdf5"));
        let begin = format!("{name}: '{column}' cannot serve as a signal: it is ");
        error.strip_prefix(&begin).unwrap().to_owned()
    };
    for (column, what) in [
        ("gain", "a single number, 35.15; a signal is a vector"),
        ("label", "text or a list of lists ()"),
        ("pair", "a matrix (50x2); save each signal as a vector of its own"),
        ("phasor", "complex; save its real and imaginary parts apart (50)"),
        ("nothing", "empty (0)"),
        (
            "too_wide",
            "a vector of integers beyond 2^53, which cannot be represented exactly",
        ),
    ] {
        assert_eq!(complaint("plain.h5", column), what);
    }
    for (column, what) in [
        ("label", "text (5x1)"),
        ("cells", "a cell array (1x1)"),
        ("nothing", "empty (2)"),
    ] {
        assert_eq!(complaint("v73.mat", column), what);
    }
}

#[test]
fn a_group_is_chosen_where_groups_differ_in_length() {
    assert_eq!(
        refused("groups.h5"),
        "groups.h5 cannot be read as HDF5: 'axis/slow/x' has 5 samples, but 'byte' has 50; a record's vectors are equally long: choose a \
         group by --topic ('/' for what is in no group), or save them apart"
    );
    let options = |topic: &str| ReadOptions {
        topic: Some(topic.to_owned()),
        ..ReadOptions::default()
    };
    let file = options("axis/slow").read(fixture("hdf5/groups.h5")).unwrap();
    assert_eq!(file.column("x").unwrap(), [0.0, 1.0, 2.0, 3.0, 4.0]);
    let error = options("knee").read(fixture("hdf5/groups.h5")).unwrap_err();
    let expected = "groups.h5 cannot be read as HDF5: it has no group 'knee'";
    assert_eq!(message(&error, &fixture("hdf5")), expected);
}

#[test]
fn numbers_that_do_not_fill_their_bytes_are_no_signals() {
    let file = read_record(fixture("hdf5/layouts.h5")).unwrap();
    assert_eq!(file.record.names(), ["u"]);
    let own = "numbers with an unusual layout of bits; save them as int32 or float64 (50)";
    for (column, what) in [
        ("shifted", own),
        ("packed", own),
        ("other_float", own),
        (
            "half",
            "numbers of a size other than 32 or 64 bits; save them as float32 (50)",
        ),
        ("none", "empty"),
    ] {
        let error = message(&file.finite(column).unwrap_err(), &fixture("hdf5"));
        assert_eq!(
            error,
            format!("layouts.h5: '{column}' cannot serve as a signal: it is {what}")
        );
    }
}

#[test]
fn a_block_of_the_user_and_groups_of_another_length_are_passed_over() {
    let options = ReadOptions {
        topic: Some("/".to_owned()),
        ..ReadOptions::default()
    };
    let file = options.read(fixture("hdf5/block.h5")).unwrap();
    assert_eq!(file.record.names(), ["u"]);
    assert_eq!(bits(file.column("u").unwrap()), reference()["u"]);
}

#[test]
fn what_has_no_signal_or_is_damaged_is_refused() {
    assert_eq!(
        refused("nothing.h5"),
        "nothing.h5 cannot be read as HDF5: it holds no vector of real numbers: 'label' is text or a list of lists ()"
    );
    let error = read_record(fixture("hdf5/truncated.h5")).unwrap_err();
    assert!(
        matches!(error, Error::Truncated { .. } | Error::Content { .. }),
        "{error}"
    );
    let folder = directory("cut_hdf5");
    let bytes = std::fs::read(fixture("hdf5/latest.h5")).unwrap();
    let path = folder.join("cut.h5");
    for length in (8..bytes.len()).step_by(211) {
        std::fs::write(&path, &bytes[..length]).unwrap();
        assert!(read_record(&path).is_err(), "{length}");
    }
}

#[test]
fn memory_is_asked_for_first() {
    let options = ReadOptions {
        memory: Some(500),
        ..ReadOptions::default()
    };
    let error = options.read(fixture("hdf5/plain.h5")).unwrap_err();
    assert!(matches!(error, Error::TooLarge { .. }), "{error}");
}
