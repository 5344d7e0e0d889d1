//! Numbers, encodings and orders of rows that are seldom, but can only be read in one way.

mod common;

use std::io::Write;

use common::{assert_log, directory, read, refused};
use flate2::write::GzEncoder;
use flexure_io::read_record;

const LOG: &str = "t,u,y\n0,1.5,-1\n0.01,2.5,1\n0.02,3.5,2\n";

#[test]
fn unicode_text_of_a_spreadsheet() {
    for to_bytes in [u16::to_le_bytes, u16::to_be_bytes] {
        let text = format!("\u{feff}{}", LOG.replace(',', "\t"));
        let bytes: Vec<u8> = text.encode_utf16().flat_map(to_bytes).collect();
        assert_log(&read("utf16", &bytes), &["t", "u", "y"]);
        let cut = &bytes[..bytes.len() - 1];
        assert_eq!(
            refused("utf16_cut", cut),
            "log.csv, line 1: the text is marked as UTF-16, but is not; save it in UTF-8"
        );
    }
}

#[test]
fn pipes_between_columns() {
    let file = read("pipes", LOG.replace(',', "|"));
    assert_log(&file, &["t", "u", "y"]);
    assert_eq!(file.notes, Vec::<String>::new());
}

#[test]
fn packed_by_gzip() {
    let path = directory("gzip").join("log.csv.gz");
    let mut packer = GzEncoder::new(std::fs::File::create(&path).unwrap(), flate2::Compression::fast());
    packer.write_all(LOG.as_bytes()).unwrap();
    packer.finish().unwrap();
    assert_log(&read_record(&path).unwrap(), &["t", "u", "y"]);
}

#[test]
fn a_workbook_before_2007_is_named() {
    let said = refused("xls", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1\0\0\0\0");
    assert!(
        said.ends_with("old workbook (.xls) or document; save its sheet as CSV"),
        "{said}"
    );
}

#[test]
fn minus_signs_of_typesetting_and_exponents_of_fortran() {
    let file = read("minus", LOG.replace('-', "\u{2212}"));
    assert_log(&file, &["t", "u", "y"]);
    assert_eq!(file.column("y").unwrap()[0], -1.0);
    let file = read(
        "fortran",
        "t u y\n0.00D+00 1.5D+00 -1.0D-03\n1.0D-02 2.5D+00 1\n2.0D-02 0.35d+01 2\n",
    );
    assert_log(&file, &["t", "u", "y"]);
    assert_eq!(file.column("y").unwrap()[0], -1e-3);
}

#[test]
fn thousands_beside_a_decimal_sign() {
    for content in [
        "t;u;y\n0;1.5;1,234.5\n0.01;2.5;-12,345.25\n0.02;3.5;1,234,567.0\n",
        "t;u;y\n0;1,5;1.234,5\n0,01;2,5;-12.345,25\n0,02;3,5;1.234.567,0\n",
    ] {
        let file = read("thousands_and_decimals", content);
        assert_log(&file, &["t", "u", "y"]);
        assert_eq!(file.column("y").unwrap(), [1234.5, -12345.25, 1_234_567.0]);
    }
    // Groups of another size are no thousands.
    let file = read("no_thousands", "t;u;y\n0;1.5;1,23.5\n0.01;2.5;1\n0.02;3.5;2\n");
    assert_log(&file, &["t", "u"]);
}

#[test]
fn switches_are_zero_and_one() {
    for [off, on] in [["OFF", "ON"], ["False", "True"], ["no", "yes"]] {
        let file = read("switch", format!("t,valve,u\n0,{on},1.5\n0.01,{off},2.5\n0.02,,3.5\n"));
        assert_log(&file, &["t", "valve", "u"]);
        let valve = file.column("valve").unwrap();
        assert!(valve[0] == 1.0 && valve[1] == 0.0 && valve[2].is_nan(), "{valve:?}");
        let words = format!("{} and {}", off.to_lowercase(), on.to_lowercase());
        assert_eq!(
            file.notes,
            [format!(
                "column 'valve' has the words {words}; they are taken as 0 and 1"
            )]
        );
    }
    // A third state is none of a switch.
    let file = read("states", "t,valve,u\n0,ON,1.5\n0.01,OFF,2.5\n0.02,FAULT,3.5\n");
    assert_log(&file, &["t", "u"]);
    assert!(
        file.column("valve")
            .unwrap_err()
            .to_string()
            .contains("line 4: column 'valve' holds 'FAULT'")
    );
}

#[test]
fn units_behind_the_numbers() {
    let file = read(
        "units_behind",
        "t,u,y\n0 ms,1.5 V,-1.5%\n10 ms,2.5 V,2%\n20 ms,3.5 V,--\n",
    );
    assert_log(&file, &["t", "u", "y"]);
    assert_eq!(
        ["t", "u", "y"].map(|name| file.unit(name)),
        [Some("ms"), Some("V"), Some("%")]
    );
    assert_eq!(file.column("y").unwrap()[..2], [-1.5, 2.0]);
    let lines =
        "Export of the historian\nPlant 4, line B\nt\tu\ty\n0 ms\t1.5 V\t1 %\n10 ms\t2.5 V\t--\n20 ms\t3.5 V\t2 %\n";
    assert_log(&read("units_below_lines", lines), &["t", "u", "y"]);
    let file = read("units_that_change", "t,u,y\n0,1.5,1.5 V\n0.01,2.5,2 mV\n0.02,3.5,1 V\n");
    assert!(
        file.column("y")
            .unwrap_err()
            .to_string()
            .contains("line 3: column 'y' holds '2 mV'")
    );
}

#[test]
fn the_newest_sample_first() {
    let file = read("newest_first", "t,u,y\n0.02,3.5,2\n0.01,2.5,x\n0,1.5,-1\n");
    assert_log(&file, &["t", "u"]);
    assert_eq!(
        file.notes,
        ["column 't' decreases: the rows are taken from the last to the first"]
    );
    assert_eq!((file.line(0), file.line(1), file.line(2)), (Some(4), Some(3), Some(2)));
    let stamps = "when,u\n2026-03-01 08:00:00.02,3.5\n2026-03-01 08:00:00.01,2.5\n2026-03-01 08:00:00,1.5\n";
    assert_log(&read("newest_stamp_first", stamps), &["when", "u"]);
    // Instants that go back and forth have no order.
    let file = read("back_and_forth", "t,u\n0.02,3.5\n0.01,2.5\n0.03,1.5\n");
    assert!(file.time(None, &[]).is_err());
}
