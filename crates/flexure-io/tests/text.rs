//! Text records: what is read, and what every bad one is told.

mod common;

use common::{directory, message};
use flexure_io::{RecordFile, read_record};

/// Reads `content` from a file called `name`; an error as its message.
fn read(test: &str, name: &str, content: impl AsRef<[u8]>) -> Result<RecordFile, String> {
    let dir = directory(test);
    std::fs::write(dir.join(name), content).unwrap();
    read_record(dir.join(name)).map_err(|e| message(&e, &dir))
}

fn error(test: &str, name: &str, content: impl AsRef<[u8]>) -> String {
    read(test, name, content).unwrap_err()
}

#[test]
fn headers_separators_comments_and_line_ends() {
    let variants: [(&str, &[u8], [&str; 2]); 5] = [
        ("a.csv", b"\xef\xbb\xbft,u\r\n0,1.5\r\n1,-2e3\r\n\r\n", ["t", "u"]),
        ("a.txt", b"# made by hand\n\nt;u\n0;1.5\n# pause\n1;-2e3", ["t", "u"]),
        ("a.tsv", b"t\tu\n0\t1.5\n1\t-2e3\n", ["t", "u"]),
        ("a", b" \"t\" , \"u\"\n 0 , 1.5 \n\"1\",\t-2e3\n\n\n", ["t", "u"]),
        ("a.dat", b"# t u\n  0\t 1.5 \n 1 -2e3\n", ["t", "u"]),
    ];
    for (name, content, names) in variants {
        let file = read("headers", name, content).unwrap();
        assert_eq!(file.record.names(), names, "{name}");
        assert_eq!(file.column(names[0]).unwrap(), [0.0, 1.0], "{name}");
        assert_eq!(file.column(names[1]).unwrap(), [1.5, -2e3], "{name}");
    }
}

#[test]
fn quoted_names_keep_separators_and_marks() {
    let file = read("quoted", "a.csv", "\"a, \"\"b\"\"\",\"1\",nan\n1,2,3\n").unwrap();
    assert_eq!(file.record.names(), ["a, \"b\"", "1", "nan"]);
}

#[test]
fn samples_know_their_lines_past_comments() {
    let file = read("lines", "a.csv", "#\nu\n1\n2\n# gap\n#\nnan\n4\n").unwrap();
    assert_eq!(
        (0..5).map(|s| file.line(s)).collect::<Vec<_>>(),
        [Some(3), Some(4), Some(7), Some(8), None]
    );
}

#[test]
fn unusable_samples_are_located() {
    let file = read("nonfinite", "a.csv", "t,u,v\n0,1,1\n1,,inf\n2,3,3\n4,4,4\n").unwrap();
    let dir = directory("nonfinite");
    let text = |e| message(&e, &dir);
    assert_eq!(
        text(file.finite("u").unwrap_err()),
        "a.csv, line 3: column 'u' is NaN or missing at sample 1; remove or repair that sample"
    );
    assert_eq!(
        text(file.finite("v").unwrap_err()),
        "a.csv, line 3: column 'v' is inf at sample 1; remove or repair that sample"
    );
    assert_eq!(
        text(file.column("y").unwrap_err()),
        "a.csv: no column 'y'; the columns are: t, u, v"
    );
    assert!(text(file.sample_time("t").unwrap_err()).starts_with("a.csv, line 5: the sample times are not uniform"));
    let constant = flexure::Error::constant("u", 1.0);
    assert_eq!(
        text(file.locate(constant)),
        "a.csv: column 'u' is constant (1); nothing can be identified from it"
    );
}

#[test]
fn bad_lines_are_named() {
    let ragged = "; every line must have one field a column: remove it if it is no sample (--skip-lines N leaves out N lines before the table, --separator says what separates the columns)";
    let cases: [(&str, &[u8], String); 10] = [
        (
            "a.csv",
            b"u,y\n1,2\n3\n",
            format!("a.csv, line 3: 1 field where there are 2 columns{ragged}"),
        ),
        (
            "a.csv",
            b"u,y\n1,2,3\n",
            format!("a.csv, line 2: 3 fields where there are 2 columns{ragged}"),
        ),
        (
            "a.dat",
            b"1 2\n3\n",
            format!("a.dat, line 2: 1 field where there are 2 columns{ragged}"),
        ),
        (
            "a.csv",
            b"u,y,u\n1,2,3\n",
            "a.csv, line 1: the header names both column 1 and column 3 'u'; column names must differ (or say --header no --skip-lines 1: the columns are then called c0, c1, ...)".into(),
        ),
        (
            "a.csv",
            b"u,y;z\na,b;c\n",
            "a.csv, line 1: what separates the columns is unclear; say --separator comma, semicolon, tab, pipe or space".into(),
        ),
        (
            "a.csv",
            b"u,\"y\n1,2\n",
            "a.csv, line 1: a quotation mark is not closed on this line, or text follows where it is closed".into(),
        ),
        (
            "a.csv",
            b"u\n1\n\n2\n",
            "a.csv, line 3: this line is blank but data follow it; remove it, or write nan for a missing sample".into(),
        ),
        (
            "a.csv",
            b"u\0,\0y\0\n\x001,2\n",
            "a.csv, line 1: the file is no text, or its encoding is not known; save it as CSV in UTF-8".into(),
        ),
        (
            "a.csv",
            b"u,y\n1,2\r3,4\n",
            "a.csv, line 2: there is a carriage return within the line; end the lines with line feeds".into(),
        ),
        ("a.csv", b"u,y\n\n", "a.csv has the columns u, y but no samples".into()),
    ];
    for (name, content, expected) in cases {
        assert_eq!(error("bad_lines", name, content), expected);
    }
}

#[test]
fn a_column_with_a_text_is_refused_where_it_is_used() {
    let cases = [
        (
            "a.csv",
            "u,y\n1,2\n3,x4\n",
            "y",
            "a.csv, line 3: column 'y' holds 'x4' at sample 1, which is not a number (numbers look like -1.5e-3; --missing-text 'x4' takes it for a missing sample; --time-format is for time stamps)",
        ),
        (
            "a.dat",
            "1 2\nx 3\n",
            "c0",
            "a.dat, line 2: column 'c0' holds 'x' at sample 1, which is not a number (numbers look like -1.5e-3; --missing-text 'x' takes it for a missing sample; --time-format is for time stamps)",
        ),
        (
            "a.csv",
            "u,mode\n1,idle\n2,run\n",
            "mode",
            "a.csv: 'mode' cannot serve as a signal: it is text, such as 'idle' on line 2",
        ),
    ];
    for (name, content, column, expected) in cases {
        let file = read("texts", name, content).unwrap();
        let dir = directory("texts_path");
        let message =
            message(&file.column(column).unwrap_err(), &dir).replace(&*directory("texts").display().to_string(), "");
        assert_eq!(message.trim_start_matches('/'), expected);
        assert_eq!(file.record.len(), 2);
    }
}

#[test]
fn a_bad_field_is_quoted_in_part() {
    let text = error("long_field", "a.csv", format!("u\n1\n{}\n", "x".repeat(100)));
    assert!(text.contains(&format!("'{}...'", "x".repeat(40))), "{text}");
}

#[test]
fn files_without_content_and_files_that_cannot_be_opened() {
    let empty = "a.csv is empty; a record is a CSV file with a header, whitespace-separated columns, Parquet, MAT, HDF5 or a ROS 2 bag";
    assert_eq!(error("empty", "a.csv", ""), empty);
    assert_eq!(error("empty", "a.csv", "# nothing\n\n"), empty);
    let dir = directory("open");
    std::fs::create_dir(dir.join("d.csv")).unwrap();
    let text = |name: &str| message(&read_record(dir.join(name)).unwrap_err(), &dir);
    assert_eq!(text("d.csv"), "cannot read d.csv: it is a directory, not a file");
    assert_eq!(
        text("none.csv"),
        "cannot read none.csv: there is no such file or directory"
    );
}

#[test]
fn arbitrary_bytes_never_panic() {
    let dir = directory("bytes");
    let path = dir.join("a");
    let alphabet = b"01,;\t \"\n\r#.-eE+naif\xff\0xu";
    let mut state = 1_u64;
    for _ in 0..3000 {
        let mut next = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 33) as usize
        };
        let content: Vec<u8> = (0..next() % 60).map(|_| alphabet[next() % alphabet.len()]).collect();
        std::fs::write(&path, content).unwrap();
        if let Ok(file) = read_record(&path) {
            assert!(!file.record.is_empty() && file.line(0).is_some());
        }
    }
}
