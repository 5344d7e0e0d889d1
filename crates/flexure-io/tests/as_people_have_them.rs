//! Text files as programs, spreadsheets, loggers and instruments write them: read, or refused with the option that settles it.
//!
//! `time_stamps.rs` has those with time stamps; `python/tests/test_files.py` has files that pandas, polars, NumPy and Python's `csv` write.

mod common;

use common::{assert_log, read, read_with, refused};
use flexure_io::{Decimal, ReadOptions};

#[test]
fn pandas_with_its_index() {
    let file = read("pandas_index", ",t,u\n0,0.0,1.5\n1,0.01,2.5\n2,0.02,3.5\n");
    assert_log(&file, &["index", "t", "u"]);
    assert_eq!(file.notes, ["column 1 has no name; it is called index"]);
}

#[test]
fn pandas_with_numbered_columns_needs_a_word() {
    let content = "0,1\n0.0,1.5\n0.01,2.5\n";
    assert_eq!(
        refused("pandas_numbered", content),
        "log.csv, line 1: this line has the numbers 0, 1, 2, ...; say --header yes if these are the columns' names, --header no if they are the first sample"
    );
    for (header, samples) in [(true, 2), (false, 3)] {
        let options = ReadOptions {
            header: Some(header),
            ..ReadOptions::default()
        };
        assert_eq!(
            read_with(&options, "pandas_numbered", content).unwrap().record.len(),
            samples
        );
    }
}

#[test]
fn a_spreadsheet_in_english() {
    let file = read(
        "excel",
        "\u{feff}Time [s],u,y\r\n0,1.5,1\r\n0.01,2.5,2\r\n0.02,3.5,3\r\n",
    );
    assert_log(&file, &["Time", "u", "y"]);
    assert_eq!(file.unit("Time"), Some("s"));
}

#[test]
fn a_spreadsheet_with_decimal_commas() {
    let file = read(
        "excel_comma",
        "sep=;\r\nTime (ms);u;y\r\n0;1,5;0\r\n10;2,5;1\r\n20;3,5;2\r\n",
    );
    assert_log(&file, &["Time", "u", "y"]);
    assert_eq!(file.notes, ["the numbers have decimal commas"]);
}

#[test]
fn thousands_or_decimals() {
    let content = "time;u\n0;1,500\n0,01;2,500\n0,02;3,500\n";
    assert_log(&read("thousands_no", content), &["time", "u"]);
    let unclear = "u;y\n1,500;1\n2,500;2\n3,500;3\n";
    assert_eq!(
        refused("thousands", unclear),
        "log.csv, line 2: a comma in a number may be a decimal comma or group thousands; say --decimal comma (1,250 is 1.25) or --decimal point (1,250 is 1250)"
    );
    // Also where commas would divide the rows into more fields than the header has.
    let both = refused("both", "u;y\n1,500;1,100\n2,500;2,100\n3,500;3,100\n");
    assert!(both.contains("say --decimal comma"), "{both}");
    for (decimal, expected) in [(Decimal::Comma, 1.5), (Decimal::Point, 1500.0)] {
        let options = ReadOptions {
            decimal: Some(decimal),
            ..ReadOptions::default()
        };
        let file = read_with(&options, "thousands", unclear).unwrap();
        assert_eq!(file.column("u").unwrap()[0], expected);
    }
    assert_eq!(
        refused("both_decimals", "u;y\n1.5;2,5\n"),
        "log.csv, line 2: a number has a decimal point on line 2 and a decimal comma on line 2; say --decimal point or --decimal comma: the other sign then groups thousands"
    );
}

#[test]
fn decimal_commas_between_tabs_and_spaces() {
    for separator in ["\t", "  "] {
        let content = "t u\n0,00 1,5\n0,01 2,5\n0,02 3,5\n".replace(' ', separator);
        assert_log(&read("comma_tab", content), &["t", "u"]);
    }
}

#[test]
fn no_header() {
    let file = read("no_header", "0.00,1.5\n0.01,2.5\n0.02,3.5\n");
    assert_eq!(file.record.names(), ["c0", "c1"]);
    assert_eq!(file.notes, ["there is no header; the columns are called c0, c1"]);
}

/// Columns of fixed width between tabs, and a tab at the end of every line: as old collections of records have them.
#[test]
fn no_header_and_a_tab_at_the_end_of_every_line() {
    let file = read(
        "tab at the end",
        "   6.41e+00\t   4.77e+00\t\n   3.41e+00\t  -4.76e+00\t\n",
    );
    assert_eq!(file.record.names(), ["c0", "c1"]);
    assert_eq!(file.column("c1").unwrap(), [4.77, -4.76]);
}

#[test]
fn a_row_of_units() {
    let file = read(
        "units",
        "Time,u,Speed\n(s),(V),(rad/s)\n0,1.5,0\n0.01,2.5,1\n0.02,3.5,2\n",
    );
    assert_log(&file, &["Time", "u", "Speed"]);
    assert_eq!([file.unit("u"), file.unit("Speed")], [Some("V"), Some("rad/s")]);
    assert_eq!(file.notes, ["line 2 has the columns' units"]);
}

#[test]
fn a_text_column_of_states() {
    let file = read("states", "time_s,state,u\n0,idle,1.5\n0.01,run,2.5\n0.02,,3.5\n");
    assert_log(&file, &["time_s", "u"]);
    assert_eq!(
        file.notes,
        ["column 'state' is left out: 'state' is text, such as 'idle' on line 2"]
    );
}

#[test]
fn a_column_with_one_text_among_its_numbers_is_named() {
    let file = read("over", "state,t,u,y\nrun,0,1.5,1\nrun,0.01,2.5,OVER\nrun,0.02,3.5,3\n");
    assert_log(&file, &["t", "u"]);
    assert_eq!(
        file.notes,
        ["column 'state' is left out: 'state' is text, such as 'run' on line 2"]
    );
    assert!(
        file.flawed()
            .next()
            .unwrap()
            .starts_with("line 3: column 'y' holds 'OVER'")
    );
    assert_eq!(
        file.column("y")
            .unwrap_err()
            .to_string()
            .split_once("line 3: ")
            .unwrap()
            .1,
        "column 'y' holds 'OVER' at sample 1, which is not a number (numbers look like -1.5e-3; --missing-text 'OVER' takes it for a missing sample; --time-format is for time stamps)"
    );
}

#[test]
fn missing_samples_as_programs_write_them() {
    let file = read("missing", "u\n1\n\"\"\nNA\nnan\nNULL\n#N/A\n2\n");
    let missing = file.column("u").unwrap().iter().filter(|v| v.is_nan()).count();
    assert_eq!((file.record.len(), missing), (7, 5));
}

#[test]
fn an_instrument_with_lines_before_the_table() {
    let content = "Logger 7, channel list A\nStarted 10:00\nt,u,y\n0,1.5,0\n0.01,2.5,1\n0.02,3.5,2\n";
    let file = read("preamble", content);
    assert_log(&file, &["t", "u", "y"]);
    assert_eq!(file.notes, ["lines 1 to 2 stand above the table and are left out"]);
    let options = ReadOptions {
        skip: 2,
        ..ReadOptions::default()
    };
    assert_log(&read_with(&options, "preamble", content).unwrap(), &["t", "u", "y"]);
    // Without a header of its own, the table may have the first line as one.
    assert_eq!(
        refused("short_header", "u,y\n0,1.5,0\n1,2.5,1\n2,3.5,2\n3,4.5,2\n"),
        "log.csv, line 2: 3 fields where there are 2 columns; if the table begins on line 2, say --skip-lines 1"
    );
}

#[test]
fn an_oscilloscope_with_settings_before_the_table() {
    let content = "Model,MSO54\r\nSample Interval,1e-2\r\n\r\nTIME,u,y\r\n0,1.5,0\r\n1e-2,2.5,1\r\n2e-2,3.5,2\r\n";
    let file = read("scope", content);
    assert_log(&file, &["TIME", "u", "y"]);
    assert_eq!(file.notes, ["lines 1 to 3 stand above the table and are left out"]);
    // A line that is bad within the table is no beginning of one.
    assert!(!refused("scope_bad", "t,u\n0,1\n1\n2,1\n3,1\n4,1\n5,1\n").contains("begins on line"));
}

#[test]
fn below_settings_a_column_may_have_no_unit_or_no_name() {
    let settings = "Model\tDSO-X\nSerial\tMY58\n\n";
    let samples = "0\t1.5\t0\n10\t2.5\t1\n20\t3.5\t2\n";
    let file = read("unit", format!("{settings}Time\tu\ty\n(ms)\t(V)\t\n{samples}"));
    assert_log(&file, &["Time", "u", "y"]);
    assert_eq!(file.units, [Some("ms".to_owned()), Some("V".to_owned()), None]);
    let file = read("name", format!("{settings}\tu\ty\n{samples}"));
    assert_eq!(file.record.names(), ["c0", "u", "y"]);
    // Of three lines above the samples, the first is where the table begins.
    let texts = "Time\tu\ty\n(ms)\t(V)\t(mm)\nclock\tcommand\tlaser\n";
    let advice = refused("three", format!("{settings}{texts}{samples}"));
    assert!(
        advice.ends_with("if the table begins on line 4, say --skip-lines 3"),
        "{advice}"
    );
}

#[test]
fn an_oscilloscope_with_a_blank_line_below_the_units() {
    let file = read("pico", "Time,u,y\n(ms),(V),(mV)\n\n0,1.5,0\n10,2.5,1\n20,3.5,2\n");
    assert_log(&file, &["Time", "u", "y"]);
    assert!(refused("pico_gap", "t,u\n\n0,1.5\n\n1,2.5\n").contains("line 4: this line is blank"));
}

#[test]
fn an_instrument_that_quotes_all_and_ends_lines_with_commas() {
    let file = read(
        "quotes",
        "\"t\",\"u\",\n\"0\",\"1.5\",\n\"0.01\",\"2.5\",\n\"0.02\",\"3.5\",\n",
    );
    assert_log(&file, &["t", "u"]);
}

#[test]
fn an_instrument_that_writes_degrees_in_latin_1() {
    let file = read("latin", b"t,u,Temp [\xb0C]\n0,1.5,20\n0.01,2.5,20\n0.02,3.5,21\n");
    assert_log(&file, &["t", "u", "Temp"]);
    assert_eq!(file.unit("Temp"), Some("°C"));
}

#[test]
fn a_labview_file_has_two_headers() {
    let content = "LabVIEW Measurement\t\nSeparator\tTab\n***End_of_Header***\t\t\n\t\t\t\nChannels\t2\t\t\nSamples\t3\t3\t\n\
                   Y_Unit_Label\tV\tm\t\nX0\t0.0\t0.0\t\n***End_of_Header***\t\t\t\nX_Value\tu\ty\tComment\n\
                   0.00\t1.5\t4\t\n0.01\t2.5\t5\t\n0.02\t3.5\t6\t\n";
    let file = read("labview", content);
    assert_log(&file, &["X_Value", "u", "y"]);
    assert_eq!(file.unit("y"), Some("m"));
    assert_eq!(file.notes[0], "lines 1 to 9 stand above the table and are left out");
}

#[test]
fn an_oscilloscope_with_settings_beside_the_units() {
    let content = "X,CH1,Start,Increment,\nSequence,Volt,-5.0e-01,1.0e-02\n0,1.5,,\n1,2.5,,\n2,3.5,,\n";
    let file = read("rigol", content);
    assert_eq!(file.record.names(), ["X", "CH1"]);
    assert_eq!(
        (file.column("CH1").unwrap(), file.unit("CH1")),
        (&[1.5, 2.5, 3.5][..], Some("Volt"))
    );
    assert_eq!(file.column("X").unwrap(), [-0.5, -0.49, -0.48]);
    assert_eq!(file.time(None, &[]).unwrap().unwrap().name, "X");
    assert_eq!(file.signals(None), ["CH1"]);
    assert_eq!(
        file.notes,
        [
            "line 2 has the columns' units",
            "column 'X' has the instants that the file states: 0.01 s apart, from -0.5 s"
        ]
    );
}

#[test]
fn an_oscilloscope_with_settings_beside_the_samples_needs_a_word() {
    let content = "Record Length,3,,0.00,1.5\nSource,CH1,,0.01,2.5\n,,,0.02,3.5\n";
    assert!(
        refused("tek", content).contains("say --header yes if"),
        "{}",
        refused("tek", content)
    );
    let options = ReadOptions {
        header: Some(false),
        ..ReadOptions::default()
    };
    let file = read_with(&options, "tek_no_header", content).unwrap();
    assert_eq!(file.column("c4").unwrap(), [1.5, 2.5, 3.5]);
}

#[test]
fn a_workbook_is_no_text() {
    let message = refused("workbook", b"PK\x03\x04\x14\0\x06\0");
    assert!(message.contains("save its sheet as CSV"), "{message}");
}

#[test]
fn one_column_whose_name_has_a_space() {
    let file = read("one_column", "motor torque\n1.5\n2.5\n");
    assert_eq!(file.column("motor torque").unwrap(), [1.5, 2.5]);
}

#[test]
fn a_header_between_spaces() {
    assert_log(&read("spaces", "t    u\n0.00 1.5\n0.01 2.5\n0.02 3.5\n"), &["t", "u"]);
}

#[test]
fn a_first_line_of_texts_and_numbers_needs_a_word() {
    let content = "idle,1,2\nrun,3,4\n";
    assert_eq!(
        refused("mixed", content),
        "log.csv, line 1: this line has texts as well as the number 1; say --header yes if it has the columns' names, --header no if it is the first sample"
    );
}
