//! Parquet files part by part: row groups of all sizes, ranges that begin anywhere, and work that fails.

mod common;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use common::{directory, message};
use flexure_io::{Error, ParquetParts};
use parquet::data_type::DoubleType;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;

/// Row groups of 1, 0, 2, one batch, one more than a batch, and the rest of the rows.
const GROUPS: [usize; 6] = [1, 0, 2, 1 << 16, (1 << 16) + 1, 70_001];

/// A file with the columns `n`, which counts the rows, and `half`, in these row groups, with pages of a thousand rows.
fn counted(test: &str, groups: &[usize]) -> PathBuf {
    let path = directory(test).join("counted.parquet");
    let schema = "message schema { required double n; required double half; }";
    let schema = Arc::new(parse_message_type(schema).unwrap());
    let properties = WriterProperties::builder()
        .set_data_page_row_count_limit(1000)
        .set_write_batch_size(1000);
    let properties = Arc::new(properties.set_dictionary_enabled(false).build());
    let mut writer = SerializedFileWriter::new(std::fs::File::create(&path).unwrap(), schema, properties).unwrap();
    let mut start = 0;
    for rows in groups {
        let mut group = writer.next_row_group().unwrap();
        for factor in [1.0, 0.5] {
            let values: Vec<f64> = (start..start + rows).map(|i| factor * i as f64).collect();
            let mut column = group.next_column().unwrap().unwrap();
            column.typed::<DoubleType>().write_batch(&values, None, None).unwrap();
            column.close().unwrap();
        }
        group.close().unwrap();
        start += rows;
    }
    writer.close().unwrap();
    path
}

/// The rows of a range, as they come.
fn rows(parts: &ParquetParts, from: u64, to: u64) -> Vec<f64> {
    let mut found = Vec::new();
    let mut next = from;
    parts
        .read_rows(from..to, &mut |row, columns| {
            assert_eq!(row, next);
            assert!(columns[0].iter().zip(&columns[1]).all(|(n, half)| 0.5 * n == *half));
            found.extend_from_slice(&columns[0]);
            next += columns[0].len() as u64;
            Ok(())
        })
        .unwrap();
    found
}

#[test]
fn every_range_has_its_rows() {
    let path = counted("parts_ranges", &GROUPS);
    let parts = ParquetParts::open(&path, &["n", "half"]).unwrap();
    let all = GROUPS.iter().sum::<usize>() as u64;
    assert_eq!((parts.rows(), parts.count()), (all, GROUPS.len()));
    let ends = [
        0,
        1,
        2,
        3,
        4,
        999,
        1003,
        65_539,
        65_540,
        131_075,
        131_076,
        131_077,
        200_000,
        all - 1,
        all,
    ];
    for from in ends {
        for to in ends.into_iter().filter(|to| *to >= from) {
            let expected: Vec<f64> = (from..to).map(|i| i as f64).collect();
            assert!(rows(&parts, from, to) == expected, "{from}..{to}");
        }
    }
    // Beyond the end there is nothing.
    assert_eq!(rows(&parts, all - 2, all + 100).len(), 2);
    let excerpt = parts.excerpt(65_530..65_545).unwrap().record;
    assert_eq!(
        (excerpt.names(), excerpt.len()),
        (&["n".to_owned(), "half".to_owned()][..], 15)
    );
    let head = ParquetParts::head(&path, 5).unwrap();
    assert_eq!(head.record.column("half").unwrap(), [0.0, 0.5, 1.0, 1.5, 2.0]);
}

#[test]
fn what_fails_in_the_work_is_not_the_files_fault() {
    let path = counted("parts_failing", &[10]);
    let parts = ParquetParts::open(&path, &["n"]).unwrap();
    let thrown = catch_unwind(AssertUnwindSafe(|| {
        parts.read_rows(0..10, &mut |_, _| panic!("of the work"))
    }));
    assert_eq!(thrown.unwrap_err().downcast_ref(), Some(&"of the work"));
    let refused = parts.read_rows(0..10, &mut |_, _| {
        Err(Error::Empty {
            path: Path::new("other").to_owned(),
        })
    });
    assert!(matches!(refused, Err(Error::Empty { .. })), "{refused:?}");
}

#[test]
fn a_file_that_is_cut_off_is_refused() {
    let path = counted("parts_cut", &[5000, 5000]);
    let bytes = std::fs::read(&path).unwrap();
    let directory = path.parent().unwrap();
    for kept in [0, 3, 11, bytes.len() / 2, bytes.len() - 1] {
        std::fs::write(&path, &bytes[..kept]).unwrap();
        let Err(error) = ParquetParts::open(&path, &["n"]) else {
            panic!("{kept} bytes are read");
        };
        assert!(message(&error, directory).starts_with("counted.parquet"), "{error}");
    }
}

#[test]
fn a_file_that_changes_after_it_was_opened_is_refused() {
    let path = counted("parts_changed", &[5000, 5000]);
    let parts = ParquetParts::open(&path, &["n", "half"]).unwrap();
    assert_eq!(rows(&parts, 0, 10_000).len(), 10_000);
    counted("parts_changed", &[5000, 4000]);
    let error = parts.read_rows(0..10, &mut |_, _| Ok(())).unwrap_err();
    assert!(
        message(&error, path.parent().unwrap()).contains("it has changed since it was opened; read it again"),
        "{error}"
    );
}
