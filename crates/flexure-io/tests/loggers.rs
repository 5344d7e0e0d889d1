//! Text files of loggers, scripts and instruments that say in words of their own where the table begins, or what its columns are.

mod common;

use common::{assert_log, read, read_with, refused};
use flexure_io::ReadOptions;

/// Options with this word on the header.
fn with_header(header: bool) -> ReadOptions {
    ReadOptions {
        header: Some(header),
        ..ReadOptions::default()
    }
}

#[test]
fn the_newest_sample_first_with_instants_that_neighbours_share() {
    let file = read(
        "shared_instants",
        "t,u,y,z\n3,5,5,1\n2,4,x,1\n2,3,3,1\n1,2,2,1\n0,1,1,z\n",
    );
    assert_eq!(file.column("t").unwrap(), [0.0, 1.0, 2.0, 2.0, 3.0]);
    assert_eq!(file.column("u").unwrap(), [1.0, 2.0, 3.0, 4.0, 5.0]);
    // Samples are counted in the order that they are taken in.
    let flawed: Vec<String> = file.flawed().collect();
    assert!(
        flawed[0].starts_with("line 3: column 'y' holds 'x' at sample 3,"),
        "{flawed:?}"
    );
    assert!(
        flawed[1].starts_with("line 6: column 'z' holds 'z' at sample 0,"),
        "{flawed:?}"
    );
    let file = read(
        "shared_stamps",
        "Date,Time,u\n2026-03-02,00:00:01,5\n2026-03-02,00:00:00,4\n2026-03-02,00:00:00,3\n2026-03-01,23:59:59,2\n",
    );
    assert_eq!(file.column("Time").unwrap(), [0.0, 1.0, 1.0, 2.0]);
    assert_eq!(file.column("u").unwrap(), [2.0, 3.0, 4.0, 5.0]);
    // A clock that stands still has no order.
    let file = read("stopped_clock", "t,u\n5,1\n5,2\n5,3\n");
    assert_eq!(file.column("u").unwrap(), [1.0, 2.0, 3.0]);
}

/// The first line of a Campbell's logger has its own number of fields.
#[test]
fn a_logger_with_four_lines_above_its_rows() {
    let table = "\"TIMESTAMP\",\"RECORD\",\"u\",\"y\"\n\"TS\",\"RN\",\"Volts\",\"mV\"\n\"\",\"\",\"Avg\",\"Smp\"\n\
                 \"2026-03-14 09:00:00\",7,1.5,12\n\"2026-03-14 09:00:00.01\",8,2.5,\"NAN\"\n\"2026-03-14 09:00:00.02\",9,3.5,13\n";
    for fields in [
        "\"rig\",\"CR1000\"",
        "\"rig\"",
        "\"rig\",\"CR1000\",\"48211\",\"CPU:a.CR1\",\"Tbl\"",
    ] {
        let content = format!("\"TOA5\",{fields}\n{table}");
        let file = read("toa5", &content);
        assert_log(&file, &["TIMESTAMP", "RECORD", "u", "y"]);
        assert_eq!([file.unit("u"), file.unit("y")], [Some("Volts"), Some("mV")]);
        assert!(file.column("y").unwrap()[1].is_nan());
        let about_units =
            "line 3 has the columns' units; line 4 says how the logger formed each value, and is left out";
        assert_eq!(
            file.notes[..2],
            ["line 1 stands above the table and is left out", about_units]
        );
        let options = ReadOptions {
            skip: 1,
            ..ReadOptions::default()
        };
        let file = read_with(&options, "toa5", &content).unwrap();
        assert_log(&file, &["TIMESTAMP", "RECORD", "u", "y"]);
        assert_eq!(file.notes[0], about_units);
    }
}

#[test]
fn words_above_rows_between_other_separators_are_no_names() {
    for (words, count) in [
        ("Boot ok\nMPU init... done\n", 2),
        ("Sensor calibrated OK\n", 1),
        ("=~= log =~=\n", 1),
    ] {
        for separator in [",", "\t", ";"] {
            let rows = "0 1.5 1\n0.01 2.5 2\n0.02 3.5 3\n".replace(' ', separator);
            let file = read("words_above", format!("{words}{rows}"));
            assert_eq!(file.record.names(), ["c0", "c1", "c2"], "{words} {separator}");
            assert_eq!(file.column("c1").unwrap(), [1.5, 2.5, 3.5]);
            let above = match count {
                1 => "line 1 stands above the table and is left out",
                _ => "lines 1 to 2 stand above the table and are left out",
            };
            assert_eq!(
                file.notes,
                [above, "there is no header; the columns are called c0, c1, c2"]
            );
        }
    }
    // Names between spaces are seen by one of time.
    for content in ["t u y\n", "Boot ok\nt u y\n"] {
        let file = read(
            "names_in_words",
            format!("{content}0\t1.5\t1\n0.01\t2.5\t2\n0.02\t3.5\t3\n"),
        );
        assert_log(&file, &["t", "u", "y"]);
    }
    // Otherwise options say so, and no row is lost.
    let content = "v u y\n0\t1.5\t1\n0.01\t2.5\t2\n0.02\t3.5\t3\n";
    assert_eq!(read("no_time", content).record.names(), ["c0", "c1", "c2"]);
    let options = ReadOptions {
        separator: Some(' '),
        ..ReadOptions::default()
    };
    for options in [options, with_header(true)] {
        let file = read_with(&options, "words_given", content).unwrap();
        assert_eq!(file.record.names(), ["v", "u", "y"]);
        assert_eq!(file.record.len(), 3);
    }
    // Without decimal points, two fields may be one number with a decimal comma.
    let said = refused("one_or_two", "motor torque\n1,5\n2,5\n3,5\n");
    assert!(
        said.contains("2 fields where there is 1 column; if the table begins"),
        "{said}"
    );
    // A number above the rows may be the rest of one.
    assert!(refused("rest_of_row", "12\n0,1,2\n1,2,3\n2,3,4\n").contains("line 2: 3 fields where there is 1 column;"));
}

#[test]
fn numpy_savetxt() {
    let rows = "0.00 1.5 1\n0.01 2.5 2\n0.02 3.5 3\n";
    let note = |line: usize| {
        format!("the names are from the comment on line {line}; --header no leaves the columns without names")
    };
    for (comment, separator, line) in [
        ("# t u y\n", " ", 1),
        ("# t,u,y\n", ",", 1),
        ("# rig 5\n#t\tu\ty\n", "\t", 2),
        ("# run,5a,Anna\n# t,u,y\n", ",", 2),
        ("# t [s],u [V],y\n", ",", 1),
        ("# t u[V] y\n", " ", 1),
    ] {
        let content = format!("{comment}{}", rows.replace(' ', separator));
        let file = read("numpy", &content);
        assert_log(&file, &["t", "u", "y"]);
        assert_eq!(file.notes, [note(line)], "{comment}");
        assert!(file.unit("u").is_none_or(|unit| unit == "V"));
        let file = read_with(&with_header(false), "numpy", &content).unwrap();
        assert_eq!(file.record.names(), ["c0", "c1", "c2"]);
        assert_eq!(file.record.len(), 3);
    }
    // Names without one of time, and numbers that count as a header does.
    let file = read("numpy_no_time", "# u,y\n0,1\n2,5\n");
    assert_eq!(
        (file.record.names(), file.record.len()),
        (&["u".to_owned(), "y".to_owned()][..], 2)
    );
    for (comment, separator) in [
        ("# recorded by Anna\n", " "),
        ("# date of test\n", " "),
        ("# t u\n", " "),
        ("# 1,2,3\n", ","),
        ("# u,u,y\n", ","),
        ("# t,,y\n", ","),
        ("# rate = 100, rig: 5, Anna\n", ","),
        ("# t,u,y\n\n", ","),
        ("# run,rig,place\n# mm,V,N\n", ","),
    ] {
        let rows = rows.replace("0.00", "0.05").replace(' ', separator);
        let file = read("no_names", format!("{comment}{rows}"));
        assert_eq!(file.record.names(), ["c0", "c1", "c2"], "{comment}");
    }
    // A header of its own comes first.
    let file = read(
        "comment_above_header",
        "# t,v,w\ntime,u,y\n0,1.5,1\n0.01,2.5,2\n0.02,3.5,3\n",
    );
    assert_log(&file, &["time", "u", "y"]);
}

/// Each header ends with a line of its own; rows may end before the column for comments, and leave out the instants.
#[test]
fn a_labview_file() {
    for (decimal, instants, last) in [
        (".", true, ""),
        (",", true, ""),
        (",", true, "\t"),
        (".", false, ""),
        (".", false, "\t"),
    ] {
        let instant = |text: &'static str| if instants { text } else { "" };
        let rows = format!(
            "{}\t1.5\t4.25{last}\r\n{}\t2.5\t5.25{last}\r\n{}\t3.5\t6.25{last}\r\n",
            instant("7.00"),
            instant("7.01"),
            instant("7.02")
        );
        let content = format!(
            "LabVIEW Measurement\t\r\nWriter_Version\t2\t\r\nSeparator\tTab\t\r\nDate\t2026/03/01\t\r\n***End_of_Header***\t\r\n\t\r\n\
             Channels\t2\t\t\r\nSamples\t3\t3\t\r\nDate\t2026/03/01\t2026/03/01\t\r\nY_Unit_Label\tVolts\trad/s\t\r\n\
             X_Dimension\tTime\tTime\t\r\nX0\t7.0000000000000000E+0\t7.0000000000000000E+0\t\r\nDelta_X\t0.010000\t0.010000\t\r\n\
             ***End_of_Header***\t\t\t\r\nX_Value\tu\tUntitled 1\tComment\r\n{rows}"
        );
        let file = read("lvm", content.replace('.', decimal));
        assert_log(&file, &["X_Value", "u", "Untitled 1"]);
        assert_eq!(
            [file.unit("X_Value"), file.unit("Untitled 1")],
            [Some("s"), Some("rad/s")]
        );
        assert_eq!(file.column("X_Value").unwrap(), [7.0, 7.01, 7.02]);
        assert_eq!(file.signals(None), ["u", "Untitled 1"]);
        let stated = "column 'X_Value' has the instants that the file states: 0.01 s apart, from 7 s";
        assert_eq!(
            file.notes.iter().any(|note| note == stated),
            !instants,
            "{:?}",
            file.notes
        );
    }
    // Only the comment may be missing.
    let head = "LabVIEW Measurement\t\n***End_of_Header***\t\nX_Value\tu\ty";
    let said = refused("lvm_short", format!("{head}\tComment\n0\t1\t2\n0.01\t2\n0.02\t3\t4\n"));
    assert!(
        said.contains("line 5: 2 fields where there are 4 columns; every line"),
        "{said}"
    );
    let said = refused("lvm_cut", format!("{head}\n0\t1\t2\n0.01\t2\n0.02\t3\t4\n"));
    assert!(
        said.contains("line 5: 2 fields where there are 3 columns; every line"),
        "{said}"
    );
    // The instants that a heading states are not those of a second table.
    let rows = |x: &dyn Fn(usize) -> String| (0..30).map(|k| format!("{}\t1\t2\n", x(k))).collect::<String>();
    let second = "Channels\t2\n***End_of_Header***\nX_Value\tu\ty\n\t1\t2\n";
    let head = "LabVIEW Measurement\t\nX0\t0\t0\nDelta_X\t0.01\t0.01\n***End_of_Header***\t\nX_Value\tu\ty";
    let said = refused("lvm_twice", format!("{head}\n{}{second}", rows(&|_| String::new())));
    assert!(said.contains("line 36: 2 fields where there are 3 columns"), "{said}");
    let second = second.replace("\n\t1", "\n0\t1");
    let file = read("lvm_again", format!("{head}\n{}\n{second}", rows(&|k| k.to_string())));
    assert_eq!(file.record.len(), 31);
    assert_eq!(file.line(30), Some(40));
    assert!(
        file.notes
            .contains(&"2 lines stand above a repeated header and are left out, the first of them line 37".to_owned()),
        "{:?}",
        file.notes
    );
}

#[test]
fn an_oscilloscope_with_its_time_in_a_row_of_units() {
    for (name, unit) in [("x-axis", "second"), ("Source", "Second"), ("x", "sec")] {
        let file = read(
            "scope_unit",
            format!("{name},u\n{unit},Volt\n-0.5,1.5\n-0.49,2.5\n-0.48,3.5\n"),
        );
        assert_log(&file, &[name, "u"]);
        assert_eq!(file.signals(None), ["u"]);
    }
    let file = read("scope_length", "x,u\nmm,V\n0,1.5\n1,2.5\n2,3.5\n");
    assert_eq!(
        (file.time(None, &[]).unwrap(), file.signals(None)),
        (None, vec!["x", "u"])
    );
}

#[test]
fn twice_as_many_fields_between_tabs_are_no_decimal_commas() {
    let said = refused("tabs_twice", "t\tu\n0\t1\n1\t2\t3\t4\n2\t3\n");
    assert!(
        said.contains("4 fields where there are 2 columns; every line"),
        "{said}"
    );
}

#[test]
fn rows_with_the_names_of_their_fields() {
    for separator in [" ", ", ", "\t"] {
        let content = "t=0.00 u=1.5 y=1\nt=0.01 u=2.5 y=\nt=0.02 u=3.5 y=-3e0\n".replace(' ', separator);
        let file = read("named_fields", &content);
        assert_log(&file, &["t", "u", "y"]);
        assert_eq!(file.column("y").unwrap()[2], -3.0);
        assert_eq!(file.notes, ["each row has the columns' names, as in t=0.00"]);
    }
    // Fields change their places below the first lines.
    let rows: String = (0..30).map(|k| format!("t={k} u={k}\n")).collect();
    let said = refused("named_otherwise", format!("{rows}u=30 t=30\n"));
    assert!(
        said.starts_with("log.csv, line 31: 'u=30' does not begin with 't='"),
        "{said}"
    );
    let said = refused("names_vary", "t=0 u=1\nt=1 v=2\nt=2 u=3\n");
    assert!(said.contains("are read where all rows have the same names"), "{said}");
}
