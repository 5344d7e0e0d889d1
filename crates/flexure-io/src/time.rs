//! Which column of a record has the sample instants, and in what unit.

use flexure::record::SampleClock;

use crate::error::{Error, Result};
use crate::record_file::RecordFile;

/// What columns of instants are called, in lower case.
const NAMES: [&str; 6] = ["t", "time", "timestamp", "datetime", "date", "elapsedtime"];

/// Units of time, in s.
const UNITS: [(&[&str], f64); 6] = [
    (&["s", "sec", "secs", "second", "seconds"], 1.0),
    (&["ms", "msec", "millisecond", "milliseconds"], 1e-3),
    (&["us", "µs", "μs", "usec", "microsecond", "microseconds"], 1e-6),
    (&["ns", "nanosecond", "nanoseconds"], 1e-9),
    (&["min", "minute", "minutes"], 60.0),
    (&["h", "hour", "hours"], 3600.0),
];

/// The column of a record's sample instants.
#[derive(Debug, Clone, PartialEq)]
pub struct TimeColumn {
    /// Its name.
    pub name: String,
    /// The seconds that a unit of it lasts.
    pub seconds: f64,
    /// The record's clock, in s.
    pub clock: SampleClock,
}

/// The name without a unit behind it (`time_ms`), in lower case, and that unit.
fn split(name: &str) -> (String, Option<f64>) {
    let name = name.to_lowercase();
    match name.rsplit_once(['_', ' ']).map(|(base, unit)| (base, seconds(unit))) {
        Some((base, Some(unit))) => (base.replace(['_', ' ', '-'], ""), Some(unit)),
        _ => (name.replace(['_', ' ', '-'], ""), None),
    }
}

fn seconds(unit: &str) -> Option<f64> {
    let unit = unit.to_lowercase();
    UNITS
        .iter()
        .find(|(names, _)| names.contains(&unit.as_str()))
        .map(|(_, seconds)| *seconds)
}

impl RecordFile {
    /// The column of sample instants: the one `given`, or that which is called `t`, `time`, `Time [s]`, `time_ms`, `timestamp` or
    /// alike and is none of the columns `in_use`; `None` if there is none.
    ///
    /// Instants are in s unless the file says otherwise.
    ///
    /// # Errors
    /// [`Error::Time`] for several such columns, and for a unit that is none of time; as [`RecordFile::finite`]; [`Error::Data`] with
    /// the line of the first instant that is not on a uniform grid.
    pub fn time(&self, given: Option<&str>, in_use: &[&str]) -> Result<Option<TimeColumn>> {
        let fail = |problem: String| {
            Err(Error::Time {
                path: self.path.clone(),
                problem,
            })
        };
        let is_time = |name: &&str| NAMES.contains(&split(name).0.as_str()) && !in_use.contains(name);
        let names: Vec<&str> = match given {
            Some(name) => vec![name],
            None => self.record.names().iter().map(String::as_str).filter(is_time).collect(),
        };
        let name = match names[..] {
            [] => return Ok(None),
            [name] => name,
            [first, second, ..] => {
                return fail(format!(
                    "columns '{first}' and '{second}' may both have the sample instants; say which by --time"
                ));
            }
        };
        let unit = self.unit(name);
        let seconds = match (unit, split(name).1) {
            (Some(unit), _) => match seconds(unit) {
                Some(seconds) => seconds,
                None => {
                    return fail(format!(
                        "column '{name}' is in {unit}, which is no unit of time; say which column has the sample instants by --time, or give --sample-time"
                    ));
                }
            },
            (None, Some(seconds)) => seconds,
            (None, None) => 1.0,
        };
        let SampleClock { step, jitter } = self.signal(name, flexure::Record::sample_clock)?;
        Ok(Some(TimeColumn {
            name: name.to_owned(),
            seconds,
            clock: SampleClock {
                step: step * seconds,
                jitter,
            },
        }))
    }

    /// The unit of a column, if the file has it.
    pub fn unit(&self, name: &str) -> Option<&str> {
        let index = self.record.names().iter().position(|n| n == name)?;
        self.units.get(index)?.as_deref()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use flexure::Record;

    fn file(columns: &[(&str, Option<&str>, f64)]) -> RecordFile {
        let samples = |step: f64| (0..5).map(|i| step * f64::from(i)).collect::<Vec<f64>>();
        let record = Record::new(columns.iter().map(|(name, _, step)| (*name, samples(*step)))).unwrap();
        let mut file = RecordFile::in_memory(record, "log");
        file.units = columns.iter().map(|(_, unit, _)| unit.map(str::to_owned)).collect();
        file
    }

    #[test]
    fn names_and_units_of_time() {
        for (name, unit, step, expected) in [
            ("t", None, 0.01, 0.01),
            ("Time", Some("s"), 0.01, 0.01),
            ("time_ms", None, 10.0, 0.01),
            ("Time", Some("ms"), 10.0, 0.01),
            ("Time Stamp", Some("µs"), 1e4, 0.01),
            ("lifetime", None, 1.0, f64::NAN),
            ("torque_s", None, 1.0, f64::NAN),
        ] {
            let step = file(&[(name, unit, step), ("u", None, 1.0)])
                .time(None, &["u"])
                .unwrap()
                .map(|t| t.clock.step);
            match expected.is_nan() {
                true => assert_eq!(step, None, "{name}"),
                false => assert!((step.unwrap() - expected).abs() < 1e-12, "{name}"),
            }
        }
    }

    #[test]
    fn two_columns_of_time_are_settled_by_name() {
        let both = file(&[("time", None, 1.0), ("timestamp", None, 2.0)]);
        let message = both.time(None, &[]).unwrap_err().to_string();
        assert_eq!(
            message,
            "log: columns 'time' and 'timestamp' may both have the sample instants; say which by --time"
        );
        assert_eq!(both.time(Some("timestamp"), &[]).unwrap().unwrap().clock.step, 2.0);
        assert_eq!(both.time(None, &["time"]).unwrap().unwrap().name, "timestamp");
        let odd = file(&[("time", Some("V"), 1.0)]);
        assert!(odd.time(None, &[]).unwrap_err().to_string().contains("is in V"));
    }
}
