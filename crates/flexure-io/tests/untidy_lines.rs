//! Lines that loggers, spreadsheets and historians leave around and between the samples.

mod common;

use common::{assert_log, read, refused};

/// Samples of a table with the columns t, u and y, from this number on.
fn samples(count: usize) -> String {
    (0..count)
        .map(|k| format!("{},{},{}\n", 0.01 * k as f64, k % 7, k % 5))
        .collect()
}

/// A LabVIEW file whose table has a row of units, and lines of one tab above its names.
#[test]
fn a_labview_table_with_units_below_its_names() {
    let head = "LabVIEW Measurement\t\r\nWriter_Version\t2\t\r\nTime_Pref\tRelative\t\r\n";
    let table = "X_Value\tu\ty\tComment\r\ns\tV\trad/s\t\r\n0.00\t1.5\t1\t\r\n0.01\t2.5\t2\t\r\n0.02\t3.5\t3\t\r\n";
    for between in [
        "***End_of_Header***\t\r\n\t\r\n",
        "***End_of_Header***\t\r\n",
        "\t\r\n",
        "",
    ] {
        for head in [head, ""] {
            let file = read("lvm_units", format!("{head}{between}{table}"));
            assert_log(&file, &["X_Value", "u", "y"]);
            let units = ["X_Value", "u", "y"].map(|name| file.unit(name));
            assert_eq!(units, [Some("s"), Some("V"), Some("rad/s")], "{head}{between}");
        }
    }
    // The units may also stand in the heading.
    let label = "Y_Unit_Label\tVolts\tm\t\r\n***End_of_Header***\t\r\n";
    let file = read("lvm_both_units", format!("{head}{label}{table}"));
    assert_eq!([file.unit("u"), file.unit("y")], [Some("V"), Some("rad/s")]);
    // Without instants, the heading states them.
    let label = "X0\t0\t0\t\r\nDelta_X\t0.01\t0.01\t\r\n***End_of_Header***\t\r\n";
    let table = table
        .replace("0.00\t", "\t")
        .replace("0.01\t", "\t")
        .replace("0.02\t", "\t");
    assert_log(
        &read("lvm_units_axis", format!("{head}{label}{table}")),
        &["X_Value", "u", "y"],
    );
}

/// A logger that starts again writes its titles, names and units again, often below a blank line.
#[test]
fn a_header_is_repeated_below_blank_lines() {
    let names = "t,u,y\ns,V,rad\n";
    let (first, second) = (samples(30), samples(40));
    let title = "Bench 3,,\nOperator,me\n";
    for (between, said) in [
        ("\n", None),
        ("\n\n\n", None),
        (",,\n", Some("line 33 stands above a repeated header and is left out")),
        (
            "\nBench 3\n",
            Some("line 34 stands above a repeated header and is left out"),
        ),
        (
            "\nBench 3,,\n\nrate,4\n\n",
            Some("2 lines stand above a repeated header and are left out, the first of them line 34"),
        ),
        // The last sample was not written to its end.
        (
            "0.3,1\n\n",
            Some("line 33 stands above a repeated header and is left out"),
        ),
    ] {
        for blank in ["", "\n"] {
            let file = read("restart", format!("{names}{first}{between}{names}{blank}{second}"));
            assert_eq!(file.record.len(), 70, "{between:?}");
            let u = file.finite("u").unwrap();
            assert_eq!((u[29], u[30], u[31]), (1.0, 0.0, 1.0));
            let lines = 33 + between.lines().count();
            let mut notes = vec![
                "line 2 has the columns' units".to_owned(),
                format!("2 lines repeat the header and are left out, the first of them line {lines}"),
            ];
            notes.extend(said.map(str::to_owned));
            assert_eq!(file.notes, notes, "{between:?}");
        }
    }
    // The same titles above the first table.
    let file = read(
        "restart_titles",
        format!("{title}{names}{first}\n{title}{names}{second}"),
    );
    assert_eq!((file.record.len(), file.line(30)), (70, Some(40)));
    // A first table of a few lines, beside a column of texts.
    let padded = "Messprotokoll;;;\nBediener;K;;\n\nt;u;y;Status\ns;V;rad;\n";
    let few = samples(8).replace('\n', ",ok\n").replace(',', ";");
    let more = second.replace('\n', ",ok\n").replace(',', ";");
    let file = read("restart_soon", format!("{padded}{few}\n{padded}{more}"));
    assert_eq!((file.record.len(), file.unit("y")), (48, Some("rad")));
}

/// What is not above a repeated header is data, or stays refused.
#[test]
fn blank_lines_between_samples_stay_refused() {
    let names = "t,u,y\n";
    let rows = samples(30);
    let blank = "line 32: this line is blank but data follow it";
    for below in [
        rows.clone(),
        format!("Bench 3\n{rows}"),
        format!("0.3,1,1\n{names}{rows}"),
        format!("Bench 3\n0.3,1,1\n\n{names}{rows}"),
    ] {
        let said = refused("blank_between", format!("{names}{rows}\n{below}"));
        assert!(said.contains(blank), "{below}: {said}");
    }
    // A blank line below the second table is not excused by its header.
    let said = refused("blank_later", format!("{names}{rows}\n{names}{rows}\n{rows}"));
    assert!(said.contains("line 64: this line is blank"), "{said}");
    // A text in a column of texts is one of a sample.
    let events: String = (0..30).map(|k| format!("{k},on,,\n")).collect();
    let file = read("events", format!("t,event,u,y\n{events}t,event,u,y\n30,off,1,2\n"));
    assert_eq!(file.record.len(), 31);
    // Other fields than those of the table, without a header.
    let said = refused("other_fields", format!("{names}{rows}\nBench 3\nstart,5\n{rows}"));
    assert!(said.contains("line 34: 2 fields where there are 3 columns"), "{said}");
}

/// A spreadsheet or historian leaves a row of separators below the samples, or above what it writes below them.
#[test]
fn separators_below_the_samples_are_no_sample() {
    for separator in [",", "\t", ";"] {
        let table = |rows: String| format!("Date,u,y\n{rows}").replace(',', separator);
        let stamped: String = (0..30)
            .map(|k| format!("2025-03-04 09:30:{k:02},{},\n", k % 7))
            .collect();
        for (below, said) in [
            (",,\n", "line 32 stands below the table and is left out"),
            (",,\nTotal\n", "line 32 stands below the table and is left out"),
            (
                ",,\nExported by Historian 7.2,,\n",
                "lines 32 to 33 stand below the table and are left out",
            ),
            (
                "\n,,\n,,\nExported by Historian 7.2,,\n,,\n",
                "lines 33 to 36 stand below the table and are left out",
            ),
        ] {
            let file = read("separators", table(format!("{stamped}{below}")));
            assert_eq!(file.record.len(), 30, "{below:?}");
            assert_eq!(file.finite("Date").unwrap()[29], 29.0);
            // A line of nothing but tabs is blank.
            let is_said = separator == "\t" || file.notes.iter().any(|note| note == said);
            assert!(is_said, "{below:?}: {:?}", file.notes);
        }
    }
    // Between samples, it is a missing one.
    let file = read(
        "separators_between",
        format!("t,u,y\n{}0.3,,\n,,\n0.32,1,1\n", samples(30)),
    );
    assert_eq!(file.record.len(), 33);
    assert!(file.column("t").unwrap()[31].is_nan());
    // Without a time column as well.
    let file = read("separators_untimed", "u,y\n1,2\n2,3\n3,5\n,\n");
    assert_eq!(file.record.len(), 3);
    let file = read("separators_alone", format!("u,y\n{}", ",\n".repeat(30)) + "1,2\n");
    assert_eq!(file.record.len(), 31);
}

/// A sensor without a value is written as dashes, of any number.
#[test]
fn dashes_are_missing_samples() {
    for dashes in ["-", "--", "---", "----", "-----", "----------"] {
        let file = read(
            "dashes",
            format!("t;u;y\n0,00;1,5;{dashes}\n0,01;2,5;  {dashes} \n0,02;3,5;2,5\n"),
        );
        assert_log(&file, &["t", "u", "y"]);
        let y = file.column("y").unwrap();
        assert!(y[0].is_nan() && y[1].is_nan() && y[2] == 2.5, "{y:?}");
    }
    // A line of dashes alone still divides.
    let rule = "------------------\n";
    let rows = samples(30);
    let file = read("dashes_above", format!("Bench 3\n{rule}{}", rows.replace(',', ";")));
    assert_eq!(file.record.len(), 30);
    let file = read("dashes_between", format!("t,u,y\n{rows}{rule}{rows}"));
    assert_eq!(file.record.len(), 60);
    assert_eq!(file.notes, ["line 32 is text without a number and is left out"]);
}
