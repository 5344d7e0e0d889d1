//! Which column of a record has the sample instants, and in what unit.

use flexure::error::DataError;
use flexure::look::Clock;
use flexure::record::SampleClock;

use crate::error::{Error, Result};
use crate::record_file::RecordFile;
use crate::units::{split_unit, unit_at_end};
use flexure::text::{exact, visible};

/// Names of columns of instants, in lower case: in English, German, French, Spanish, Italian and Portuguese, the Nordic
/// languages, and Dutch.
const NAMES: [&str; 26] = [
    "t",
    "ts",
    "time",
    "timestamp",
    "datetime",
    "date",
    "elapsedtime",
    "elapsed",
    "uptime",
    "runtime",
    "seconds",
    "secs",
    "sec",
    "epoch",
    "epochtime",
    "unixtime",
    "stamp",
    "zeit",
    "zeitstempel",
    "uhrzeit",
    "datum",
    "temps",
    "tiempo",
    "tempo",
    "tid",
    "tijd",
];

/// Names of constants that are a sample time, in lower case, and of those that are its inverse.
const STEPS: [&str; 9] = [
    "ts",
    "dt",
    "deltat",
    "tsample",
    "tsampling",
    "sampletime",
    "samplingtime",
    "sampleperiod",
    "samplingperiod",
];
const RATES: [&str; 6] = [
    "fs",
    "fsample",
    "samplerate",
    "samplingrate",
    "samplefrequency",
    "samplingfrequency",
];

/// The name for a column without a name that counts the rows, as pandas writes its index.
pub(crate) const INDEX: &str = "index";

/// The unit of instants of time stamps, and of those that a file states.
pub(crate) const SECOND: &str = "s";

/// Names of the first column of oscilloscopes and LabVIEW, in lower case, which has the instants if its unit is one of time.
const AXES: [&str; 4] = ["x", "xaxis", "xvalue", "source"];

/// Seconds in a day.
pub(crate) const DAY: f64 = 86_400.0;

/// Units of time, in s.
const UNITS: [(&[&str], f64); 6] = [
    (&["s", "sec", "secs", "second", "seconds"], 1.0),
    (&["ms", "msec", "millisecond", "milliseconds"], 1e-3),
    (&["us", "µs", "μs", "usec", "microsecond", "microseconds"], 1e-6),
    (&["ns", "nanosecond", "nanoseconds"], 1e-9),
    (&["min", "minute", "minutes"], 60.0),
    (&["h", "hour", "hours"], 3600.0),
];

/// A column of at least this many samples that rise by 1 each counts the rows, under any name. Convention: a signal is no such ramp.
const COUNTER: usize = 50;
/// A step that differs from a whole number by at most this share of it is one. Rounding.
const WHOLE: f64 = 1e-6;

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

/// The sample instants of a record, uniform or not.
#[derive(Debug, Clone, PartialEq)]
pub struct Instants {
    /// The name of their column.
    pub name: String,
    /// The instants, in s.
    pub seconds: Vec<f64>,
    /// The origin of time stamps, in ns since 1970 (for times of day: since midnight).
    pub origin: Option<i64>,
}

/// The name in lower case without a unit at its end (`time_ms`), and that unit.
fn split(name: &str) -> (String, Option<f64>) {
    // ROS puts a percent sign in front of it.
    let name = name.trim_start_matches('%').to_lowercase();
    match name.rsplit_once(['_', ' ']).map(|(base, unit)| (base, seconds(unit))) {
        Some((base, Some(unit))) => {
            let base = base.strip_suffix(" in").unwrap_or(base);
            (base.replace(['_', ' ', '-'], ""), Some(unit))
        }
        _ => (name.replace(['_', ' ', '-'], ""), None),
    }
}

/// Whether a column's name ends with a unit of time.
pub(crate) fn has_unit(name: &str) -> bool {
    split(name).1.is_some()
}

/// Whether a column has the name of instants.
pub(crate) fn is_time(name: &str) -> bool {
    // The name of a vector in a group of HDF5 is its path.
    let own = name.rsplit('/').next().unwrap_or(name);
    NAMES.contains(&split(own).0.as_str())
}

/// The seconds that a unit of time lasts.
pub(crate) fn seconds(unit: &str) -> Option<f64> {
    let unit = unit.to_lowercase();
    UNITS
        .iter()
        .find(|(names, _)| names.contains(&unit.as_str()))
        .map(|(_, seconds)| *seconds)
}

impl RecordFile {
    /// The column of sample instants: the one `given`; or one named `t`, `time`, `Time [s]`, `time_ms`, `timestamp` or similar; or one of
    /// time stamps. It is none of the columns `in_use`; `None` if there is no such column.
    ///
    /// Instants are in s unless the file says otherwise.
    ///
    /// # Errors
    /// [`Error::Time`] for several such columns, and for a unit that is none of time; as [`RecordFile::finite`]; [`Error::Data`] with
    /// the line of the first instant that is not on a uniform grid.
    pub fn time(&self, given: Option<&str>, in_use: &[&str]) -> Result<Option<TimeColumn>> {
        let Some((name, seconds)) = self.instants(given, in_use)? else {
            return Ok(None);
        };
        let clock = |record: &'_ flexure::Record, name: &str| {
            let in_seconds = |error| match error {
                flexure::Error::Data(DataError::NonUniformTime { sample, step, expected }) => {
                    let usual =
                        Clock::new(record.column(name)?).map_or(expected, |clock| clock.usual_step(record.len()));
                    // In s, like all times in messages, and with four digits, as `flexure look` prints it.
                    let expected = format!("{:.3e}", usual * seconds).parse().unwrap_or(usual * seconds);
                    let step = step * seconds;
                    Err(DataError::NonUniformTime { sample, step, expected }.into())
                }
                error => Err(error),
            };
            record.sample_clock(name).or_else(in_seconds)
        };
        let SampleClock { step, jitter } = self.signal(name, clock)?;
        Ok(Some(TimeColumn {
            name: name.to_owned(),
            seconds,
            clock: SampleClock {
                step: step * seconds,
                jitter,
            },
        }))
    }

    /// The sample instants, whether uniform or not, of the column that [`RecordFile::time`] takes.
    ///
    /// # Errors
    /// As [`RecordFile::time`], except for the error about the grid.
    pub fn instants_in_seconds(&self, given: Option<&str>) -> Result<Option<Instants>> {
        let Some((name, unit)) = self.instants(given, &[])? else {
            return Ok(None);
        };
        // Division makes 7 ms exactly 0.007 s; a factor of 0.001 would not.
        let parts = (1.0 / unit).round();
        let seconds = |t: &f64| if unit < 1.0 { t / parts } else { t * unit };
        let origin = self.origins.iter().find(|(column, _)| column == name);
        Ok(Some(Instants {
            name: name.to_owned(),
            seconds: self.finite(name)?.iter().map(seconds).collect(),
            origin: origin.map(|(_, origin)| *origin),
        }))
    }

    /// The name of the column of [`RecordFile::time`], whose instants need not be uniform, and the seconds that a unit of it lasts.
    ///
    /// # Errors
    /// [`Error::Time`].
    pub fn instants<'a>(&'a self, given: Option<&'a str>, in_use: &[&str]) -> Result<Option<(&'a str, f64)>> {
        let fail = |problem: String| {
            Err(Error::Time {
                path: self.path.clone(),
                problem,
            })
        };
        let is_time = |name: &&str| is_time(name) && !in_use.contains(name);
        let names: Vec<&str> = match given {
            Some(name) => vec![self.meant(name)],
            None => self.record.names().iter().map(String::as_str).filter(is_time).collect(),
        };
        // A date that stays the same stands beside the time.
        let changes = |name: &&str| {
            let samples = self.record.column(name).unwrap_or_default();
            samples.iter().any(|t| *t != samples[0])
        };
        let names = match names.len() > 1 {
            true => names.into_iter().filter(changes).collect(),
            false => names,
        };
        // Time stamps are instants under any column name.
        let stamps = || self.origins.iter().map(|(name, _)| name.as_str());
        let names = match names.is_empty() {
            true => stamps().filter(|name| !in_use.contains(name)).collect(),
            false => names,
        };
        let names = match (names.is_empty(), self.axis()) {
            (true, Some(axis)) if !in_use.contains(&axis) => vec![axis],
            _ => names,
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
        Ok(Some((name, seconds)))
    }

    /// The columns that are signals, in order: not instants (such as columns named `time`, and time stamps), and not a mere count of the
    /// rows.
    pub fn signals(&self, time: Option<&str>) -> Vec<&str> {
        let counts = |samples: &[f64]| samples.iter().enumerate().all(|(i, &v)| v == samples[0] + i as f64);
        let columns = self.record.columns();
        let signals = columns.filter(|(name, samples)| {
            let index = (*name == INDEX || samples.len() >= COUNTER) && counts(samples);
            let stamps = self.origins.iter().any(|(column, _)| column == name);
            !(Some(*name) == time || is_time(name) || self.axis() == Some(*name) || stamps || index)
        });
        signals.map(|(name, _)| name).collect()
    }

    /// The first column, if no name says which one has the instants, and it rises evenly by a step other than 1; with names, by a step that is no
    /// whole number: it may have the instants.
    pub fn nameless_instants(&self) -> Option<&str> {
        let names = self.record.names();
        let first = names.first()?;
        let is_said = || self.axis().is_some() || !self.origins.is_empty() || names.iter().any(|name| is_time(name));
        let step = self.record.sample_clock(first).ok()?.step;
        let is_step = match self.is_nameless {
            true => step != 1.0,
            false => self.is_text() && (step - step.round()).abs() > WHOLE * step && !is_said(),
        };
        // A unit of something else says that it is no time; one of time belongs to `--time` with that unit.
        let is_seconds = self.unit(first).is_none_or(|unit| seconds(unit) == Some(1.0));
        (self.record.len() >= COUNTER && is_step && is_seconds).then_some(first)
    }

    /// Whether the file has no names of columns.
    pub fn is_nameless(&self) -> bool {
        self.is_nameless
    }

    /// The first column, if it has the name of an axis and a unit of time.
    pub(crate) fn axis(&self) -> Option<&str> {
        let first = self.record.names().first()?;
        let is_axis = AXES.contains(&split(first).0.as_str()) && self.unit(first).and_then(seconds).is_some();
        is_axis.then_some(first)
    }

    /// The column that `name` means: `name` is the column's name, its text in the header with the unit, as in `u [V]`, or its text in
    /// messages.
    pub fn meant<'a>(&'a self, name: &'a str) -> &'a str {
        let names = || self.record.names().iter();
        if names().any(|own| own == name) {
            return name;
        }
        if let Some((_, times)) = self.dates.as_ref().filter(|(dates, _)| dates == name) {
            return times;
        }
        let (base, unit) = split_unit(name);
        let with_unit = names().find(|own| **own == base && unit.is_some() && self.unit(own) == unit.as_deref());
        // Messages show invisible characters of a name in another form.
        let found = with_unit.or_else(|| names().find(|own| visible(own) == name));
        found.map_or(name, String::as_str)
    }

    /// A constant of the file that seems to be the sample time by its name, or the sampling frequency, and the sample time that follows, in s.
    pub fn stated_sample_time(&self) -> Option<(&str, f64)> {
        let stated = |(name, value): &(String, f64)| {
            let own = name.rsplit(['/', '.']).next().unwrap_or(name);
            let (base, unit) = split(own.trim_end_matches("_Hz"));
            let as_step = STEPS.contains(&base.as_str()).then(|| value * unit.unwrap_or(1.0));
            let as_rate = RATES.contains(&base.as_str()).then(|| 1.0 / value);
            as_step.or(as_rate).filter(|step| *step > 0.0 && step.is_finite())
        };
        let mut constants = self.constants.iter();
        constants.find_map(|constant| Some((constant.0.as_str(), stated(constant)?)))
    }

    /// The end of a message that asks for the sample time: where a constant may be it, with the option to type.
    pub fn sample_time_hint(&self) -> String {
        self.stated_sample_time().map_or_else(String::new, |(name, step)| {
            let step = exact(step);
            format!("; by the constant '{name}' it is {step} s: --sample-time {step}")
        })
    }

    /// A column of a text with the name of instants whose texts are no time stamps that are read.
    pub fn unread_instants(&self) -> Option<&str> {
        let mut others = self.others.iter().filter(|_| self.is_text());
        others
            .find(|other| other.is_text() && is_time(&other.name))
            .map(|other| other.name.as_str())
    }

    /// The unit of a column, if the file has it; otherwise the one at the end of its name ([`unit_at_end`]).
    pub fn unit(&self, name: &str) -> Option<&str> {
        let index = self.record.names().iter().position(|n| n == name)?;
        let own = self.units.get(index).and_then(Option::as_deref);
        // In other files, a slash divides a path.
        let may_end = self.is_text() || !name.contains('/');
        own.or_else(|| unit_at_end(name).filter(|_| may_end).map(|(_, unit)| unit))
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
    fn a_path_does_not_end_in_a_unit() {
        let file = file(&[("drive/A", None, 1.0), ("q_deg", None, 1.0), ("u_V", Some("mV"), 1.0)]);
        assert_eq!(
            ["drive/A", "q_deg", "u_V"].map(|name| file.unit(name)),
            [None, Some("deg"), Some("mV")]
        );
    }

    #[test]
    fn names_and_units_of_time() {
        for (name, unit, step, expected) in [
            ("t", None, 0.01, 0.01),
            ("Time", Some("s"), 0.01, 0.01),
            ("time_ms", None, 10.0, 0.01),
            ("Time", Some("ms"), 10.0, 0.01),
            ("Time Stamp", Some("µs"), 1e4, 0.01),
            ("elapsed_s", None, 0.01, 0.01),
            ("uptime_ms", None, 10.0, 0.01),
            ("seconds", None, 0.01, 0.01),
            ("axis/t", Some("s"), 0.01, 0.01),
            ("per/unit", None, 1.0, f64::NAN),
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
