//! Text files with time stamps as programs, spreadsheets, loggers and instruments write them.

mod common;

use common::{assert_log, read, read_with};
use flexure_io::ReadOptions;

#[test]
fn pandas_with_an_index_of_time() {
    let file = read(
        "pandas_time",
        "timestamp,u,y\n2024-05-01 10:00:00.000,1.5,0\n2024-05-01 10:00:00.010,2.5,0\n2024-05-01 10:00:00.020,3.5,0\n",
    );
    assert_log(&file, &["timestamp", "u", "y"]);
    assert_eq!(file.column("timestamp").unwrap(), [0.0, 0.01, 0.02]);
    assert_eq!(
        file.notes,
        ["column 'timestamp' has time stamps; it counts the seconds from 2024-05-01 10:00:00.000"]
    );
}

#[test]
fn pandas_with_a_time_zone() {
    let file = read(
        "pandas_zone",
        "time,u\n2024-05-01 10:00:00+02:00,1.5\n2024-05-01 10:00:00.010000+02:00,2.5\n2024-05-01 10:00:00.020000+02:00,3.5\n",
    );
    assert_log(&file, &["time", "u"]);
}

#[test]
fn time_stamps_under_another_name() {
    let content =
        "Zeitstempel;u\n2024-05-01T10:00:00.000;1,5\n2024-05-01T10:00:00.010;2,5\n2024-05-01T10:00:00.020;3,5\n";
    let file = read("stamps_named", content);
    assert_log(&file, &["Zeitstempel", "u"]);
    assert_eq!(file.signals(None), ["u"]);
    let two = "begin,end,u\n10:00:00,10:00:01,1\n10:00:01,10:00:02,2\n10:00:02,10:00:03,3\n";
    let message = read("stamps_two", two).time(None, &["u"]).unwrap_err().to_string();
    assert!(
        message.ends_with("columns 'begin' and 'end' may both have the sample instants; say which by --time"),
        "{message}"
    );
}

#[test]
fn a_spreadsheet_with_decimal_commas_in_its_time_stamps_too() {
    let file = read(
        "excel_comma_stamps",
        "time;u\n2024-05-01T10:00:00,000;1,5\n2024-05-01T10:00:00,010;2,5\n2024-05-01T10:00:00,020;3,5\n",
    );
    assert_log(&file, &["time", "u"]);
}

#[test]
fn a_logger_that_counts_from_1970() {
    for (name, unit, factor) in [("timestamp", "ms", 1), ("t", "us", 1000), ("%time", "ns", 1_000_000)] {
        let row = |step: i64, u: &str| format!("{},{u}\n", (1_714_557_600_000 + step) * factor);
        let content = [format!("{name},u\n"), row(0, "1.5"), row(10, "2.5"), row(20, "3.5")].concat();
        let file = read("epoch", content);
        assert_log(&file, &[name, "u"]);
        assert_eq!(file.notes, [format!("column '{name}' counts the {unit} from 1970")]);
    }
    // Seconds are what instants count anyway.
    let seconds = read(
        "epoch_s",
        "t,u\n1714557600.00,1.5\n1714557600.01,2.5\n1714557600.02,3.5\n",
    );
    assert!(seconds.notes.is_empty(), "{:?}", seconds.notes);
    assert!((seconds.sample_time("t").unwrap() - 0.01).abs() < 1e-6);
}

#[test]
fn a_logger_with_a_clock_that_jitters() {
    let file = read(
        "jitter",
        "time,u\n10:00:00.000,1.5\n10:00:00.0104,2.5\n10:00:00.020,3.5\n",
    );
    let time = file.time(None, &["u"]).unwrap().unwrap();
    assert!((time.clock.jitter - 0.02).abs() < 1e-6, "{time:?}");
    let late = read(
        "late",
        "time,u\n10:00:00.000,1.5\n10:00:00.0134,2.5\n10:00:00.020,3.5\n10:00:00.030,0\n10:00:00.040,0\n",
    );
    assert!(
        late.time(None, &["u"])
            .unwrap_err()
            .to_string()
            .contains("line 3: the sample times are not uniform")
    );
}

#[test]
fn a_logger_with_its_own_time_format() {
    let content = "date,u\n05/01/2024 10:00:00.00,1.5\n05/01/2024 10:00:00.01,2.5\n05/01/2024 10:00:00.02,3.5\n";
    let text = read("own_format_text", content).column("date").unwrap_err().to_string();
    assert!(
        text.contains("it is text, such as '05/01/2024 10:00:00.00' on line 2"),
        "{text}"
    );
    assert_eq!(
        read("own_format_note", content).notes,
        [
            "column 'date' is left out: 'date' is text, such as '05/01/2024 10:00:00.00' on line 2, which may begin with the month or the day; say --time-format \"%m/%d/%Y %H:%M:%S%.f\" or \"%d/%m/%Y %H:%M:%S%.f\""
        ]
    );
    let options = ReadOptions {
        time_format: Some("%m/%d/%Y %H:%M:%S%.f".to_owned()),
        ..ReadOptions::default()
    };
    assert_log(&read_with(&options, "own_format", content).unwrap(), &["date", "u"]);
}

#[test]
fn durations_of_pandas_and_matlab() {
    let pandas = ",u\n0 days 00:00:00,1.5\n0 days 00:00:00.010000,2.5\n0 days 00:00:00.020000,3.5\n";
    let file = read("timedelta", pandas);
    assert_log(&file, &["c0", "u"]);
    let file = read("duration", "Time,u\n0 sec,1.5\n0.01 sec,2.5\n0.02 sec,3.5\n");
    assert_log(&file, &["Time", "u"]);
}

#[test]
fn a_spreadsheet_in_german_with_remarks() {
    let rows: String = (0..3)
        .map(|i| format!("02.03.2026 08:00:00,0{i}0;{},5;\n", i + 1))
        .collect();
    let content = format!("sep=;\nDatum/Uhrzeit;u;Bemerkung\n{rows}");
    let file = read("german", &content);
    assert_log(&file, &["Datum/Uhrzeit", "u"]);
    assert!(
        file.notes
            .contains(&"column 'Bemerkung' is left out: 'Bemerkung' is empty".to_owned()),
        "{:?}",
        file.notes
    );
}

#[test]
fn a_time_format_that_fits_nothing_is_refused() {
    let rows: String = (0..3)
        .map(|i| format!("02/03/2026 08:00:00.0{i}0;{},5;ok\n", i + 1))
        .collect();
    let content = format!("Date;u;Remark\n{rows}");
    let with_format = |format: &str| {
        let options = ReadOptions {
            time_format: Some(format.to_owned()),
            ..ReadOptions::default()
        };
        read_with(&options, "slashes", &content)
    };
    // The format as Python writes it: %f is a fraction of a second.
    assert_log(&with_format("%d/%m/%Y %H:%M:%S.%f").unwrap(), &["Date", "u"]);
    let message = with_format("%d-%m-%Y").unwrap_err().to_string();
    let expected =
        "no column has time stamps like '%d-%m-%Y': 'Date' is text, such as '02/03/2026 08:00:00.000' on line 2";
    assert!(message.contains(expected), "{message}");
}

#[test]
fn a_logger_with_dates_and_times_in_two_columns() {
    let file = read(
        "date_and_time",
        "No.\tDate\tTime\tu\n1\t2026-06-01\t23:59:59.990\t1.5\n2\t2026-06-02\t00:00:00.000\t2.5\n3\t2026-06-02\t00:00:00.010\t3.5\n",
    );
    assert_log(&file, &["No.", "Time", "u"]);
    assert_eq!(
        file.notes,
        [
            "columns 'Date' and 'Time' are together a date and a time",
            "column 'Time' has time stamps; it counts the seconds from 2026-06-01 23:59:59.990"
        ]
    );
    let content =
        "time,u,date\n11:59:59.990 pm,1.5,06/01/2026\n12:00:00.000 am,2.5,06/02/2026\n12:00:00.010 am,3.5,06/02/2026\n";
    let options = ReadOptions {
        time_format: Some("%m/%d/%Y".to_owned()),
        ..ReadOptions::default()
    };
    assert_log(
        &read_with(&options, "us_date_and_time", content).unwrap(),
        &["time", "u"],
    );
    // A third time column stamps: which one has the instants is not guessed.
    let three =
        "timestamp,date,time,u\n2026-06-01 00:00:00,2026-06-01,00:00:01,1\n2026-06-01 00:00:01,2026-06-01,00:00:02,2\n";
    let file = read("three_stamps", three);
    assert_eq!(file.record.names(), ["timestamp", "date", "time", "u"]);
    let message = file.time(None, &[]).unwrap_err().to_string();
    assert!(message.contains("may both have the sample instants"), "{message}");
}

#[test]
fn months_with_names() {
    let file = read(
        "month_name",
        "Time,u\n01-Mar-2026 08:00:00.000,1.5\n01-Mar-2026 08:00:00.010,2.5\n01-Mar-2026 08:00:00.020,3.5\n",
    );
    assert_log(&file, &["Time", "u"]);
}

/// A number above 12 in any row says whether the month or the day comes first.
#[test]
fn a_row_settles_the_order_of_month_and_day() {
    let log = |dates: [&str; 3]| {
        let times = ["23:59:59.99", "00:00:00.00", "00:00:00.01"];
        let rows = (0..3).map(|k| format!("{} {},{}.5\n", dates[k], times[k], k + 1));
        format!("Date,u\n{}", rows.collect::<String>())
    };
    let file = read("month_first", log(["03/12/2026", "03/13/2026", "03/13/2026"]));
    assert_log(&file, &["Date", "u"]);
    assert_eq!(
        file.notes,
        [
            "column 'Date' has the month before the day, as '03/13/2026 00:00:00.00' on line 3 shows",
            "column 'Date' has time stamps; it counts the seconds from 03/12/2026 23:59:59.99"
        ]
    );
    let file = read("day_first", log(["31/03/2026", "01/04/2026", "01/04/2026"]));
    assert_log(&file, &["Date", "u"]);
    assert!(
        file.notes[0].contains("the day before the month, as '31/03/2026 23:59:59.99' on line 2"),
        "{:?}",
        file.notes
    );
    // No row settles it, and a text among the dates does not either.
    for dates in [
        ["03/01/2026", "03/02/2026", "03/02/2026"],
        ["03/01/2026", "off", "13/01/2026"],
    ] {
        let file = read("no_order", log(dates));
        assert_eq!(file.record.names(), ["u"], "{dates:?}");
    }
    let said = read("no_order", log(["03/01/2026", "03/02/2026", "03/02/2026"]));
    let said = said.column("Date").unwrap_err().to_string();
    assert!(
        said.ends_with("say --time-format \"%m/%d/%Y %H:%M:%S%.f\" or \"%d/%m/%Y %H:%M:%S%.f\""),
        "{said}"
    );
}

#[test]
fn dates_in_a_column_of_their_own_settle_their_order() {
    let content =
        "Date,Time,u\n03/31/2026,11:59:59.99 PM,1.5\n04/01/2026,12:00:00 AM,2.5\n04/01/2026,12:00:00.01 AM,3.5\n";
    let file = read("two_columns_settled", content);
    assert_log(&file, &["Time", "u"]);
    assert_eq!(
        file.notes[..2],
        [
            "column 'Date' has the month before the day, as '03/31/2026' on line 2 shows",
            "columns 'Date' and 'Time' are together a date and a time"
        ]
    );
    // Rows below the table settle nothing, and do not break the dates either.
    let rows: String = (0..25).map(|k| format!("03/01/2026 08:00:{k:02},{k}\n")).collect();
    let file = read("total_below", format!("Date,u\n{rows}Total,300\n"));
    assert!(
        file.notes.iter().any(|note| note.contains("month or the day")),
        "{:?}",
        file.notes
    );
}
