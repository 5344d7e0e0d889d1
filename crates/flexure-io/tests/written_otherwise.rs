//! Numbers, encodings and orders of rows that are seldom, but can only be read in one way.

mod common;

use std::io::Write;

use common::{assert_log, directory, read, read_with, refused};
use flate2::write::GzEncoder;
use flexure_io::{ReadOptions, read_record};

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
fn lines_that_end_with_carriage_returns() {
    let file = read("carriage_returns", LOG.replace('\n', "\r"));
    assert_log(&file, &["t", "u", "y"]);
    assert_eq!(file.line(2), Some(4));
}

#[test]
fn json_is_named() {
    for content in [
        "{\"t\": 0, \"u\": 1.5}\n{\"t\": 1, \"u\": 2.5}\n",
        "[{\"t\": 0}, {\"t\": 1}]\n",
    ] {
        assert!(refused("json", content).starts_with("log.csv, line 1: this is JSON, not a table"));
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
    let file = read("one_state", "t,pump,u\n0,ON,1.5\n0.01,ON,2.5\n0.02,ON,3.5\n");
    assert_eq!(file.notes, ["column 'pump' has the word on; it is taken as 1"]);
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
    // The same unit with another prefix is converted.
    let file = read(
        "units_that_change",
        "t,u,y\n0,1.5,1.5 V\n0.01,2.5,-2000 mV\n0.02,3.5,1 V\n",
    );
    assert_eq!(file.column("y").unwrap(), [1.5, -2.0, 1.0]);
    assert_eq!(file.unit("y"), Some("V"));
    assert!(
        file.notes
            .contains(&"column 'y' has numbers in V and mV; all are taken in V".to_owned()),
        "{:?}",
        file.notes
    );
    let file = read("other_units", "t,u,y\n0,1.5,1.5 bar\n0.01,2.5,2 psi\n0.02,3.5,1 bar\n");
    assert_eq!(
        file.column("y").unwrap_err().to_string().split_once(": ").unwrap().1,
        "column 'y' holds '2 psi' at sample 1, but the numbers above are in bar: write all of them in one unit"
    );
    // A second unit is no text for missing samples.
    assert!(file.unread_texts().is_empty());
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
    let file = read("newest_stamp_first", stamps);
    assert_log(&file, &["when", "u"]);
    assert_eq!(file.column("when").unwrap()[0], 0.0);
    assert_eq!(
        file.notes[0],
        "column 'when' has time stamps; it counts the seconds from the instant of the last row"
    );
    // Instants that go back and forth have no order.
    let file = read("back_and_forth", "t,u\n0.02,3.5\n0.01,2.5\n0.03,1.5\n");
    assert!(file.time(None, &[]).is_err());
}

/// A log of 25 samples with these lines after it.
fn with_below(lines: &str) -> String {
    let rows: String = (0..25)
        .map(|k| format!("{:.2};{k}.5;{}\n", 0.01 * f64::from(k), k % 7))
        .collect();
    format!("t;u;y\n{rows}{lines}")
}

#[test]
fn what_stands_below_a_table_is_left_out() {
    for (lines, note) in [
        ("Summe;300;70\n", "line 27 stands below the table and is left out"),
        (";300;70\n", "line 27 stands below the table and is left out"),
        (
            "Total records: 25\n",
            "line 27 is text without a number and is left out",
        ),
        (
            "Total records: 25;;\n",
            "line 27 stands below the table and is left out",
        ),
        ("0.25;25\n", "line 27 stands below the table and is left out"),
        (
            "\n\nmean;12;3\nmax;25.5;6\n",
            "lines 29 to 30 stand below the table and are left out",
        ),
    ] {
        let file = read("below", with_below(lines));
        assert_eq!((file.record.len(), file.record.names().len()), (25, 3), "{lines}");
        assert_eq!(file.notes, [note], "{lines}");
        assert_eq!(file.column("y").unwrap()[24], 3.0);
    }
}

#[test]
fn what_stands_between_samples_is_no_end() {
    let more = "0.25;25.5;1\n";
    assert_eq!(
        refused("between", with_below(&format!("0.3\n{more}")))
            .split(" (")
            .next(),
        Some(
            "log.csv, line 27: 1 field where there are 3 columns; every line must have one field a column: remove it if it is no sample"
        )
    );
    assert!(refused("blank", with_below(&format!("\n{more}"))).starts_with("log.csv, line 27: this line is blank"));
    // A remark is none of the samples anywhere.
    let file = read("remark", with_below(&format!("--- pause ---\n{more}*** end ***\n")));
    assert_eq!(file.record.len(), 26);
    assert_eq!(
        file.notes,
        ["2 lines are text without a number and are left out, the first of them line 27"]
    );
    assert_eq!(file.line(25), Some(28));
    // A text among the last samples is that column's flaw.
    let file = read("flaw", with_below(&format!("0.25;25.5;OVER\n{}", "0.26;26.5;1\n")));
    assert_eq!(file.record.names(), ["t", "u"]);
    assert_eq!(file.record.len(), 27);
    // So are more texts than stand below a table.
    let file = read("broken", with_below(&"0.25;25.5;OVER\n".repeat(6)));
    assert_eq!(file.record.names(), ["t", "u"]);
}

#[test]
fn a_header_that_is_repeated_is_left_out() {
    let content = with_below("t;u;y\n0.25;25.5;1\n");
    let file = read("repeated", &content);
    assert_eq!(file.record.len(), 26);
    assert_eq!(file.notes, ["line 27 repeats the header and is left out"]);
    assert_eq!((file.line(24), file.line(25)), (Some(26), Some(28)));
}

/// Without instants, a row that is left out would shift all that follow.
#[test]
fn samples_like_a_header_or_a_rule_are_samples() {
    let options = ReadOptions {
        header: Some(true),
        ..ReadOptions::default()
    };
    let file = read_with(&options, "numbers_above", "0,1\n0.5,1.5\n0,1\n2,3\n").unwrap();
    assert_eq!(file.column("0").unwrap(), [0.5, 0.0, 2.0]);
    let file = read("dashes", "u,y\n1,2\n---,---\n3,4\n");
    assert_eq!(file.record.len(), 3);
    assert!(file.column("y").unwrap()[1].is_nan());
}

#[test]
fn lines_padded_to_the_width_of_the_table_stand_above_it() {
    let content = format!("Messung 3;;\nDatum:;01.03.2026;\n;;\n{}", with_below(""));
    for content in [content.clone(), content.replace("Datum:;01.03.2026;\n", "")] {
        let file = read("padded", &content);
        assert_eq!(file.record.names(), ["t", "u", "y"]);
        assert_eq!(file.record.len(), 25);
    }
    // Units in the first columns belong to the table.
    let file = read("padded_units", "t;u;y\ns;;\n0;1.5;0\n0.01;2.5;1\n0.02;3.5;2\n");
    assert_log(&file, &["t", "u", "y"]);
}

#[test]
fn texts_for_missing_samples_are_named_by_an_option() {
    let content = "t,u,y\n0,1.5,1\n0.01,2.5,Bad Input\n0.02,3.5,OVER\n";
    let said = read("words", content).column("y").unwrap_err().to_string();
    assert!(
        said.contains("--missing-text 'Bad Input' takes it for a missing sample"),
        "{said}"
    );
    assert_eq!(read("words", content).unread_texts(), ["Bad Input", "OVER"]);
    // Numbers with their unit are no such texts.
    let with_units = "t,u,y\n0,1.5,1 mm\n0.01,2.5,Err\n0.02,3.5,2 mm\n";
    assert_eq!(read("units", with_units).unread_texts(), ["Err"]);
    let options = ReadOptions {
        missing_texts: vec!["Bad Input".to_owned(), "OVER".to_owned()],
        ..ReadOptions::default()
    };
    let file = read_with(&options, "words", content).unwrap();
    assert_log(&file, &["t", "u", "y"]);
    assert!(file.column("y").unwrap()[1..].iter().all(|y| y.is_nan()));
}

#[test]
fn times_of_day_pass_midnight() {
    let file = read("midnight", "clock,u\n23:59:59.98,1.5\n23:59:59.99,2.5\n00:00:00,3.5\n");
    assert_log(&file, &["clock", "u"]);
    assert!((file.column("clock").unwrap()[2] - 0.02).abs() < 1e-9);
}

#[test]
fn the_date_of_two_columns_may_be_named() {
    let options = ReadOptions {
        time_format: Some("%m/%d/%Y".to_owned()),
        ..ReadOptions::default()
    };
    let content =
        "Date,Time,u\n03/31/2026,11:59:59.99 PM,1.5\n04/01/2026,12:00:00 AM,2.5\n04/01/2026,12:00:00.01 AM,3.5\n";
    let file = read_with(&options, "two_columns", content).unwrap();
    for name in ["Date", "Time"] {
        let time = file.time(Some(name), &["u"]).unwrap().unwrap();
        assert!((time.clock.step - 0.01).abs() < 1e-9, "{name}");
    }
}

#[test]
fn thousands_between_apostrophes_and_spaces() {
    for (content, expected) in [
        (
            "t;u\n0;20'050.03\n1;-1'234'567.5\n2;12\n",
            [20_050.03, -1_234_567.5, 12.0],
        ),
        (
            "t;u\n0;20\u{202f}050,03\n1;-1\u{a0}234\u{a0}567,5\n2;12\n",
            [20_050.03, -1_234_567.5, 12.0],
        ),
        (
            "t;u\n0;20 050,03\n1;-1 234 567,5\n2;12\n",
            [20_050.03, -1_234_567.5, 12.0],
        ),
    ] {
        assert_eq!(read("groups", content).column("u").unwrap(), expected, "{content}");
    }
}

#[test]
fn codes_are_no_numbers_with_units() {
    for code in ["0x10", "20A60301"] {
        let file = read(
            "codes",
            format!("t,u,code\n0,1.5,{code}\n0.01,2.5,{code}\n0.02,3.5,{code}\n"),
        );
        assert_eq!(file.record.names(), ["t", "u"], "{code}");
    }
}

#[test]
fn a_table_for_reading_has_a_rule_below_its_header() {
    let file = read(
        "rule",
        "t | u | y\n--- | :--: | ---\n0 | 1.5 | 0\n0.01 | 2.5 | 1\n0.02 | 3.5 | 2\n",
    );
    assert_log(&file, &["t", "u", "y"]);
    assert_eq!(file.notes, ["line 2 is text without a number and is left out"]);
}

#[test]
fn infinite_samples_may_be_missing() {
    let content = "t,u,y\n0,1.5,1\n0.01,2.5,inf\n0.02,3.5,-Infinity\n";
    let file = read("infinite", content);
    assert_eq!(file.unread_texts(), ["inf", "-Infinity"]);
    let options = ReadOptions {
        missing_texts: file.unread_texts().to_vec(),
        ..ReadOptions::default()
    };
    let file = read_with(&options, "infinite", content).unwrap();
    assert!(file.column("y").unwrap()[1..].iter().all(|y| y.is_nan()));
    let options = ReadOptions {
        missing_texts: vec!["-9999".to_owned()],
        ..ReadOptions::default()
    };
    let file = read_with(&options, "number", "t,u\n0,-9999.00\n1,-99990\n").unwrap();
    assert!(file.column("u").unwrap()[0].is_nan() && file.column("u").unwrap()[1] == -99990.0);
}

#[test]
fn units_in_words_and_dates_beside_times() {
    let file = read("minutes", "Zeit in min,u\n0,1.5\n0.5,2.5\n1,3.5\n");
    assert_eq!(file.time(None, &[]).unwrap().unwrap().clock.step, 30.0);
    let file = read(
        "datum",
        "Datum;Zeit;u\n01.03.2026;0;1,5\n01.03.2026;0,01;2,5\n01.03.2026;0,02;3,5\n",
    );
    assert_log(&file, &["Datum", "Zeit", "u"]);
}

#[test]
fn decimal_commas_between_commas_are_named() {
    let said = refused("commas", "t,u,y\n0,00,1,5,2,5\n0,01,2,5,1,5\n");
    assert!(
        said.ends_with("write decimal points, or semicolons between the columns"),
        "{said}"
    );
}
