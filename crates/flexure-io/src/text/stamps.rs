//! Time stamps of text files.

use chrono::{DateTime, NaiveDate, NaiveDateTime, NaiveTime};

/// ISO 8601 as programs write it, by the patterns of `chrono::format::strftime`.
const FORMATS: [&str; 10] = [
    "%Y-%m-%dT%H:%M:%S%.f%#z",
    "%Y-%m-%d %H:%M:%S%.f%#z",
    "%Y-%m-%dT%H:%M:%S%.f",
    "%Y-%m-%d %H:%M:%S%.f",
    "%Y/%m/%d %H:%M:%S%.f",
    "%Y-%m-%d %H:%M",
    "%Y%m%dT%H%M%S%.f",
    "%Y-%m-%d",
    "%H:%M:%S%.f",
    "%H:%M",
];

/// The format of a column of time stamps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Stamps<'a> {
    format: &'a str,
}

impl<'a> Stamps<'a> {
    /// The format in which `field` is a time stamp, and that instant; of the one `given`, or else of ISO 8601.
    pub(super) fn of(field: &str, given: Option<&'a str>) -> Option<(Self, i64)> {
        let of = |format| {
            let stamps = Stamps { format };
            stamps.nanoseconds(field).map(|instant| (stamps, instant))
        };
        if let Some(format) = given {
            return of(format);
        }
        if !field.starts_with(|c: char| c.is_ascii_digit()) || !field[1..].contains([':', '-', 'T']) {
            return None;
        }
        FORMATS.into_iter().find_map(of)
    }

    /// The instant in ns since an origin that all stamps of one format share.
    pub(super) fn nanoseconds(self, field: &str) -> Option<i64> {
        let format = self.format;
        // ISO 8601 has a comma or a point before the fraction of a second.
        let field = match FORMATS.contains(&format) {
            true => &field.replacen(',', ".", 1),
            false => field,
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
            "2024-05-01T10:00:00,100",
            "2024-05-01T12:00:00,1+02:00",
        ] {
            assert_eq!(instant(field), Some(tenth), "{field}");
        }
        assert_eq!(instant("2024-05-01 10:01").unwrap() - tenth, 59_900_000_000);
        assert_eq!(instant("10:00:00.1"), Some(36_000_100_000_000));
        assert_eq!(
            instant("2024-05-02").unwrap() - instant("2024-05-01").unwrap(),
            86_400_000_000_000
        );
        // Month or day first? That needs a format.
        for field in ["01/02/2024 10:00:00", "1.5", "-3", "5e-3", "idle", "2024-13-01", ""] {
            assert_eq!(instant(field), None, "{field}");
        }
        let given = Stamps::of("01.05.2024 10:00:00,1", Some("%d.%m.%Y %H:%M:%S,%f"));
        assert!(given.is_some());
    }
}
