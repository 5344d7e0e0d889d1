//! Time stamps of text files.

use chrono::{DateTime, NaiveDate, NaiveDateTime, NaiveTime};

/// ISO 8601 as programs write it, dates with points or with the month's name, and hours with AM or PM, by the patterns of
/// `chrono::format::strftime`. Dates with points begin with the day wherever they are in use; see [`SLASHES`] for dates with slashes.
const FORMATS: [&str; 27] = [
    "%Y-%m-%dT%H:%M:%S%.f%#z",
    "%Y-%m-%d %H:%M:%S%.f%#z",
    "%Y-%m-%dT%H:%M:%S%.f",
    "%Y-%m-%d %H:%M:%S%.f",
    "%Y/%m/%d %H:%M:%S%.f",
    "%Y-%m-%d %H:%M",
    "%Y%m%dT%H%M%S%.f%#z",
    "%Y%m%dT%H%M%S%.f",
    "%d.%m.%Y %H:%M:%S%.f",
    "%d.%m.%Y %H:%M",
    "%d-%b-%Y %H:%M:%S%.f",
    "%d-%b-%Y %H:%M",
    "%d-%b-%y %H:%M:%S%.f",
    "%d-%b-%y %H:%M",
    "%d %b %Y %H:%M:%S%.f",
    "%d %b %Y %H:%M",
    "%b %d, %Y %H:%M:%S%.f",
    "%b %d, %Y %I:%M:%S%.f %p",
    "%Y-%m-%d %I:%M:%S%.f %p",
    "%Y-%m-%d",
    "%d.%m.%Y",
    "%d-%b-%Y",
    "%d-%b-%y",
    "%d %b %Y",
    "%I:%M:%S%.f %p",
    "%H:%M:%S%.f",
    "%H:%M",
];

/// Dates with slashes, with the month or the day first: a number above 12 in one of the rows settles which.
const SLASHES: [[&str; 2]; 5] = [
    ["%m/%d/%Y", "%d/%m/%Y"],
    ["%m/%d/%Y %H:%M:%S%.f", "%d/%m/%Y %H:%M:%S%.f"],
    ["%m/%d/%Y %I:%M:%S%.f %p", "%d/%m/%Y %I:%M:%S%.f %p"],
    ["%m/%d/%Y %H:%M", "%d/%m/%Y %H:%M"],
    ["%m/%d/%Y %I:%M %p", "%d/%m/%Y %I:%M %p"],
];

/// The name for the format of durations: `0 days 00:00:01.5`, as pandas writes them, or `1.5 sec`, as MATLAB does.
const DURATION: &str = "duration";

/// Whether a text looks like a time stamp: at least three numbers, with only such characters between and around them as stamps have.
pub(super) fn look_like(field: &str) -> bool {
    let between = |c: char| "/.-:, TZ+".contains(c) || "APMapm".contains(c);
    let numbers = field
        .split(|c: char| !c.is_ascii_digit())
        .filter(|part| !part.is_empty());
    field.chars().all(|c| c.is_ascii_digit() || between(c)) && numbers.count() >= 3
}

/// The format with which chrono reads a fraction of a second after a comma or a point: its `%f` alone counts nanoseconds.
pub(crate) fn with_fraction(format: &str) -> String {
    format.replace(",%f", "%.f").replace(".%f", "%.f")
}

/// A duration in ns.
fn duration(field: &str) -> Option<i64> {
    if let Some(number) = field.strip_suffix(" sec") {
        let seconds: f64 = number.parse().ok().filter(|s: &f64| s.abs() < 1e9)?;
        return Some((seconds * 1e9).round() as i64);
    }
    let (days, time) = field.split_once(" days ")?;
    let days: i64 = days.parse().ok()?;
    let time = NaiveTime::parse_from_str(time, "%H:%M:%S%.f").ok()?;
    let time = time.signed_duration_since(NaiveTime::MIN).num_nanoseconds()?;
    days.checked_mul(86_400_000_000_000)?.checked_add(time)
}

/// What stamps of a format have. A duration counts as both: no date belongs to it.
fn part(format: &str) -> Part {
    let has = |any: &[&str]| any.iter().any(|code| format.contains(code));
    let date = has(&["%Y", "%y", "%d", "%j", "%s", "%c", "%D", "%F", "%x", DURATION]);
    let time = has(&["%H", "%I", "%M", "%T", "%R", "%r", "%X", "%s", "%c", DURATION]);
    match (date, time) {
        (true, false) => Part::Date,
        (false, true) => Part::TimeOfDay,
        _ => Part::Both,
    }
}

/// The format of a time column stamps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Stamps<'a> {
    format: &'a str,
}

/// What a time column stamps has of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    Date,
    TimeOfDay,
    Both,
}

impl<'a> Stamps<'a> {
    /// The format of the time stamp `field`, and its instant. The format is the one `given`, or one of ISO 8601.
    pub(super) fn of(field: &str, given: Option<&'a str>) -> Option<(Self, i64)> {
        let of = |format| {
            let stamps = Stamps { format };
            stamps.nanoseconds(field).map(|instant| (stamps, instant))
        };
        if let Some(format) = given {
            let found = of(format);
            // Beside a column of dates with this format there may be one of times of day.
            let times = || FORMATS.into_iter().filter(|f| part(f) == Part::TimeOfDay);
            return match part(format) {
                Part::Date => found.or_else(|| times().find_map(of)),
                _ => found,
            };
        }
        let has_points = field.matches('.').count() == 2;
        // A number, or the name of a month.
        let starts = |c: char| c.is_ascii_digit() || "JFMASOND".contains(c);
        if !field.starts_with(starts) || !(has_points || field[1..].contains([':', '-', 'T', ' '])) {
            return None;
        }
        FORMATS.into_iter().chain([DURATION]).find_map(of)
    }

    /// The formats of a date with slashes, with the month first and with the day first, and its instants.
    pub(super) fn with_slashes(field: &str) -> Vec<(Self, i64)> {
        let of = |format| {
            let stamps = Stamps { format };
            stamps.nanoseconds(field).map(|instant| (stamps, instant))
        };
        if field.matches('/').count() != 2 {
            return Vec::new();
        }
        let found = SLASHES.iter().map(|both| both.iter().copied().filter_map(of).collect());
        found
            .into_iter()
            .find(|found: &Vec<_>| !found.is_empty())
            .unwrap_or_default()
    }

    pub(super) fn part(self) -> Part {
        part(self.format)
    }

    /// As `--time-format` takes it.
    pub(super) fn format(self) -> &'a str {
        self.format
    }

    /// The instant in ns since an origin that all stamps of one format share.
    pub(super) fn nanoseconds(self, field: &str) -> Option<i64> {
        let format = self.format;
        if format == DURATION {
            return duration(field);
        }
        // The fraction of a second follows a comma or a point. It comes last, or before a time zone.
        let field = match (format.contains("%.f"), field.rfind(',')) {
            (true, Some(comma)) => &format!("{}.{}", &field[..comma], &field[comma + 1..]),
            _ => field,
        };
        if let Ok(instant) = DateTime::parse_from_str(&field.replacen('Z', "+00:00", 1), format) {
            return instant.timestamp_nanos_opt();
        }
        if let Ok(instant) = NaiveDateTime::parse_from_str(field, format) {
            return instant.and_utc().timestamp_nanos_opt();
        }
        if let Ok(date) = NaiveDate::parse_from_str(field, format) {
            return date.and_time(NaiveTime::MIN).and_utc().timestamp_nanos_opt();
        }
        let time = NaiveTime::parse_from_str(field, format).ok()?;
        time.signed_duration_since(NaiveTime::MIN).num_nanoseconds()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Instants of one tenth of a second after ten o'clock, and how programs write them.
    #[test]
    fn stamps_as_programs_write_them() {
        let instant = |field: &str| Stamps::of(field, None).map(|(_, instant)| instant);
        let tenth = instant("2024-05-01T10:00:00.1").unwrap();
        for field in [
            "2024-05-01T10:00:00.100Z",
            "2024-05-01T12:00:00.1+02:00",
            "2024-05-01 12:00:00.100000+02:00",
            "2024-05-01 10:00:00.100000000",
            "2024/05/01 10:00:00.1",
            "20240501T100000.1",
            "20240501T100000.100Z",
            "2024-05-01T10:00:00,100",
            "01.05.2024 10:00:00,100",
            "1.5.2024 10:00:00.1",
            "2024-05-01T12:00:00,1+02:00",
        ] {
            assert_eq!(instant(field), Some(tenth), "{field}");
        }
        assert_eq!(instant("2024-05-01 10:01").unwrap() - tenth, 59_900_000_000);
        assert_eq!(instant("01.05.2024 10:01"), instant("2024-05-01 10:01"));
        assert_eq!(instant("2024-05-01 10:00:00.1 AM"), Some(tenth));
        assert_eq!(instant("01.05.2024"), instant("2024-05-01"));
        assert_eq!(instant("10:00:00.1"), Some(36_000_100_000_000));
        assert_eq!(instant("10:00:00.1 pm"), Some((22 * 3600 * 10 + 1) * 100_000_000));
        assert_eq!(instant("12:30:00 AM"), Some(1_800_000_000_000));
        assert_eq!(
            instant("2024-05-02").unwrap() - instant("2024-05-01").unwrap(),
            86_400_000_000_000
        );
        assert_eq!(instant("01-May-2024 10:00:00.100"), Some(tenth));
        assert_eq!(instant("01-May-2024 10:01"), instant("2024-05-01 10:01"));
        assert_eq!(instant("01-May-2024"), instant("2024-05-01"));
        // Month or day first? One row does not say.
        for field in ["01/02/2024 10:00:00", "1.5", "-3", "5e-3", "idle", "2024-13-01", ""] {
            assert_eq!(instant(field), None, "{field}");
        }
        for format in ["%d.%m.%Y %H:%M:%S,%f", "%d.%m.%Y %H:%M:%S.%f", "%d.%m.%Y %H:%M:%S%.f"] {
            for field in ["01.05.2024 10:00:00,1", "01.05.2024 10:00:00.100"] {
                let fraction = with_fraction(format);
                let given = Stamps::of(field, Some(&fraction));
                assert_eq!(given.map(|g| g.1), Some(tenth), "{field} {format}");
            }
        }
        let tenth = 100_000_000;
        for (field, expected) in [
            ("0 days 00:00:00.100000", tenth),
            ("2 days 00:00:00", 172_800_000_000_000),
            ("0.1 sec", tenth),
        ] {
            assert_eq!(instant(field), Some(expected), "{field}");
        }
        for field in ["1 day", "x sec", "1e300 sec", "0 days 25:00:00"] {
            assert_eq!(instant(field), None, "{field}");
        }
    }
}
