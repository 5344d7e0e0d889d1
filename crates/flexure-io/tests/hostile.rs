//! Files that claim, or unpack to, more than there is memory for: one message each, and nothing of that size is ever taken.

mod common;

use std::io::Write;
use std::path::Path;
use std::sync::Arc;

use common::{directory, message};
use flate2::Compression;
use flate2::write::ZlibEncoder;
use flexure_io::{Error, ReadOptions, RecordFile};
use parquet::data_type::DoubleType;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;

fn read(path: &Path, memory: u64) -> Result<RecordFile, Error> {
    let options = ReadOptions {
        memory: Some(memory),
        ..ReadOptions::default()
    };
    options.read(path)
}

/// The message about the file with this much memory. With a hundred times as much it can be read if `sound`.
fn refused(path: &Path, memory: u64, sound: bool) -> String {
    let error = read(path, memory).unwrap_err();
    assert!(matches!(error, Error::TooLarge { .. }), "{error}");
    assert_eq!(read(path, 100 * memory).is_ok(), sound);
    message(&error, path.parent().unwrap())
}

/// A MAT file of one compressed array, which unpacks to `content` and claims to be `length` bytes long.
fn compressed_mat(path: &Path, length: u32, content: impl Iterator<Item = Vec<u8>>) {
    let mut packed = ZlibEncoder::new(Vec::new(), Compression::fast());
    packed
        .write_all(&[14_u32.to_le_bytes(), length.to_le_bytes()].concat())
        .unwrap();
    content.for_each(|part| packed.write_all(&part).unwrap());
    let packed = packed.finish().unwrap();
    let mut file = b"MATLAB 5.0 MAT-file".to_vec();
    file.resize(124, b' ');
    file.extend([0, 1, b'I', b'M']);
    file.extend([15_u32.to_le_bytes(), (packed.len() as u32).to_le_bytes()].concat());
    file.extend(packed);
    std::fs::write(path, file).unwrap();
}

/// An array `u` of `count` numbers of one byte, all zero.
fn bytes_array(count: u32) -> Vec<u8> {
    let integers = |integers: &[u32]| integers.iter().flat_map(|w| w.to_le_bytes()).collect::<Vec<u8>>();
    let head = integers(&[6, 8, 9, 0, 5, 8, count, 1]);
    let name = integers(&[1 | 1 << 16, u32::from(b'u')]);
    let data = integers(&[2, count]);
    [head, name, data, vec![0; count.next_multiple_of(8) as usize]].concat()
}

#[test]
fn a_mat_file_that_unpacks_to_gigabytes() {
    let folder = directory("mat_bomb");
    let path = folder.join("bomb.mat");
    let zeros = std::iter::repeat_n(vec![0; 1 << 20], 64);
    compressed_mat(&path, 64 << 20, zeros);
    assert!(std::fs::metadata(&path).unwrap().len() < 1 << 20);
    let expected = "bomb.mat: the variable that is unpacked at byte 128 takes more memory than the limit of 8 MiB; --memory SIZE (such as 8GiB) \
                    allows more";
    assert_eq!(refused(&path, 8 << 20, false), expected);
    // The claimed size alone is enough.
    compressed_mat(&path, u32::MAX - 7, std::iter::empty());
    assert_eq!(refused(&path, 8 << 20, false), expected);
}

#[test]
fn a_mat_file_of_small_numbers_that_become_large_ones() {
    let folder = directory("mat_widening");
    let path = folder.join("wide.mat");
    let array = bytes_array(1 << 20);
    compressed_mat(&path, array.len() as u32, std::iter::once(array));
    let expected = "wide.mat: the vector at byte 128 takes more memory than the limit of 4 MiB; --memory SIZE (such as 8GiB) allows more";
    assert_eq!(refused(&path, 4 << 20, true), expected);
}

#[test]
fn a_parquet_file_of_a_few_bytes_for_a_million_rows() {
    let folder = directory("parquet_run");
    let path = folder.join("run.parquet");
    let schema = Arc::new(parse_message_type("message schema { required double u; }").unwrap());
    let properties = Arc::new(WriterProperties::builder().set_dictionary_enabled(true).build());
    let file = std::fs::File::create(&path).unwrap();
    let mut writer = SerializedFileWriter::new(file, schema, properties).unwrap();
    let mut group = writer.next_row_group().unwrap();
    let mut column = group.next_column().unwrap().unwrap();
    column
        .typed::<DoubleType>()
        .write_batch(&vec![0.0; 1 << 20], None, None)
        .unwrap();
    column.close().unwrap();
    group.close().unwrap();
    writer.close().unwrap();
    assert!(std::fs::metadata(&path).unwrap().len() < 1 << 12);
    let expected =
        "run.parquet: column 'u' takes more memory than the limit of 1 MiB; --memory SIZE (such as 8GiB) allows more";
    assert_eq!(refused(&path, 1 << 20, true), expected);
}

#[test]
fn a_table_longer_than_the_limit() {
    let folder = directory("long_table");
    let path = folder.join("long.csv");
    std::fs::write(&path, "u,y\n".to_owned() + &"1,2\n".repeat(10_000)).unwrap();
    let expected =
        "long.csv: the table takes more memory than the limit of 10 KiB; --memory SIZE (such as 8GiB) allows more";
    assert_eq!(refused(&path, 10 << 10, true), expected);
}

#[test]
fn lines_without_content_have_an_end() {
    let folder = directory("blank_lines");
    let path = folder.join("blank.csv.zst");
    let content = [b"u,y\n1,2\n".to_vec(), vec![b'\n'; 11_000_000]].concat();
    std::fs::write(&path, zstd::encode_all(&content[..], 1).unwrap()).unwrap();
    let refused = message(&read(&path, 1 << 30).unwrap_err(), &folder);
    assert!(
        refused.ends_with("more than 10000000 lines without numbers follow each other; is it a table?"),
        "{refused}"
    );
}

#[test]
fn a_line_that_never_ends() {
    let folder = directory("long_line");
    let path = folder.join("line.csv");
    for (text, line) in [
        ("1".repeat(33 << 20), 1),
        ("u\n1\n".to_owned() + &"2".repeat(33 << 20), 3),
    ] {
        std::fs::write(&path, text).unwrap();
        let said = message(&read(&path, 1 << 30).unwrap_err(), &folder);
        let expected =
            format!("line.csv, line {line}: this line is longer than 32 MiB, which no table has; is it a text file?");
        assert_eq!(said, expected);
    }
}

/// A header that is longer than what is looked at first is still read whole.
#[test]
fn a_header_of_forty_thousand_names() {
    let folder = directory("wide_header");
    let path = folder.join("wide.csv");
    let names: Vec<String> = (0..40_000).map(|i| format!("column{i}")).collect();
    let row = |cell: &str| vec![cell; names.len()].join(",");
    std::fs::write(&path, format!("{}\n{}\n{}\n", names.join(","), row("1"), row("2"))).unwrap();
    let file = read(&path, 1 << 30).unwrap();
    assert_eq!(file.record.names(), names);
    assert_eq!(file.column("column39999").unwrap(), [1.0, 2.0]);
    let said = message(&file.column("z").unwrap_err(), &folder);
    assert!(
        said.ends_with("column18, column19 and 39980 more") && said.len() < 400,
        "{said}"
    );
    // Each takes memory, no matter what is below it.
    let refused = message(&read(&path, 10 << 20).unwrap_err(), &folder);
    assert!(
        refused.contains("the list of columns") && refused.contains("--memory"),
        "{refused}"
    );
}

#[cfg(unix)]
#[test]
fn a_device_without_an_end() {
    let folder = directory("endless");
    for name in ["zero.mat", "zero.parquet"] {
        let path = folder.join(name);
        std::os::unix::fs::symlink("/dev/zero", &path).unwrap();
        assert_eq!(
            message(&read(&path, 1 << 20).unwrap_err(), &folder),
            format!(
                "{name}: the file takes more memory than the limit of 1 MiB; --memory SIZE (such as 8GiB) allows more"
            )
        );
    }
    let said = flexure_io::read_text("/dev/zero").unwrap_err().to_string();
    assert_eq!(
        said,
        "/dev/zero: the file takes more memory than the limit of 16 MiB; is it the right file?"
    );
    let said = flexure_io::read_model("/dev/zero").unwrap_err().to_string();
    assert_eq!(
        said,
        "/dev/zero: the file takes more memory than the limit of 256 MiB; is it the right file?"
    );
}

/// What broke the readers once, made small (`fuzz/run`).
#[test]
fn what_broke_a_reader_once_breaks_none_again() {
    let folder = directory("broke_once");
    let path = folder.join("r.csv");
    std::fs::write(&path, b"#! a comment\n\xef\xbb\xbf").unwrap();
    let said = message(&read(&path, 1 << 20).unwrap_err(), &folder);
    assert!(said.starts_with("r.csv is empty"), "{said}");
    std::fs::write(&path, b"# a comment\n\xef\xbb\xbfu,y\n1,2\n").unwrap();
    assert_eq!(read(&path, 1 << 20).unwrap().record.names(), ["u", "y"]);
}
