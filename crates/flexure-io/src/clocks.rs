//! Columns of instants whose numbers say what they count: ms from 1970, days of a spreadsheet, or seconds shared by several samples.

use std::borrow::Cow;
use std::cmp::Ordering;

use flexure::Record;
use flexure::text::exact;

use crate::error::{Error, LineProblem, Result};
use crate::record_file::{RecordFile, Unusable};
use crate::time::{DAY, has_unit, is_time, seconds};

/// Seconds from 1970 in the years 2001 to 2099, in which a log was recorded.
const EPOCH_SECONDS: std::ops::Range<f64> = 978_307_200.0..4_102_444_800.0;
/// Days from the end of 1899, as spreadsheets count them, in the years 2000 to 2099.
const SPREADSHEET_DAYS: std::ops::Range<f64> = 36_526.0..73_051.0;
/// The longest step of a log in days, s. Convention: a day's own steps are whole numbers.
const LONGEST_STEP: f64 = 3600.0;
/// The relative distance from a number of three digits up to which a step is such a number. Convention: one in a hundred other numbers is.
const ROUND: f64 = 1e-5;
/// The least share of samples with the instant of the sample before from which on a clock is coarse. Convention.
const COARSE: f64 = 0.4;
/// The fewest samples for that. Convention.
const FEWEST: usize = 20;
/// The largest relative width of the steps that fit a coarse clock: wider ones hold several short numbers. Convention.
const UNSURE: f64 = 0.05;
/// Halvings of an interval until it is narrower than the digits of a step that are tried.
const HALVINGS: usize = 42;

/// The unit of a clock that counts from 1970 and shows `instant`: ms, µs or ns, if the date is then a plausible one. In s it would lie
/// thousands of years ahead.
fn epoch_unit(instant: f64) -> Option<&'static str> {
    ["ms", "us", "ns"]
        .into_iter()
        .find(|unit| EPOCH_SECONDS.contains(&(instant * seconds(unit).unwrap_or(1.0))))
}

/// The mean step of instants.
fn mean_step(instants: &[f64]) -> Option<f64> {
    let [first, .., last] = instants else { return None };
    Some((last - first) / (instants.len() - 1) as f64)
}

/// Whether a step is a number of three digits, except for rounding.
fn is_round(step: f64) -> bool {
    format!("{step:.2e}")
        .parse()
        .is_ok_and(|round: f64| (step / round - 1.0).abs() < ROUND)
}

/// Whether instants are dates of a spreadsheet, in days: the step is round in seconds, and not in days.
fn are_days(instants: &[f64]) -> bool {
    let plausible = instants.first().is_some_and(|first| SPREADSHEET_DAYS.contains(first));
    plausible
        && mean_step(instants).is_some_and(|step| {
            let length = step * DAY;
            length > 0.0 && length <= LONGEST_STEP && is_round(length) && !is_round(step)
        })
}

/// Evenly spaced instants in place of those of a clock that several samples share; `None` if the clock is another, if evenly spaced
/// samples would not have its instants, or if these leave the step open.
fn evenly_spread(instants: &[f64]) -> Option<Vec<f64>> {
    let steps = || instants.windows(2).map(|w| w[1] - w[0]);
    let tick = steps().filter(|step| *step > 0.0).fold(f64::INFINITY, f64::min);
    let same = steps().filter(|step| *step == 0.0).count() as f64;
    let is_coarse = instants.len() >= FEWEST && tick.is_finite() && same > COARSE * instants.len() as f64;
    if !is_coarse || steps().any(|step| !(step >= 0.0)) {
        return None;
    }
    let [least, most] = possible_steps(instants, tick)?;
    if most - least > UNSURE * least {
        return None;
    }
    // The shortest number among them.
    let middle = 0.5 * (least + most);
    let rounded = (0..12).filter_map(|digits| format!("{middle:.digits$e}").parse::<f64>().ok());
    let step = rounded.into_iter().find(|step| (least..=most).contains(step))?;
    let first = instants[0];
    Some((0..instants.len()).map(|i| first + step * i as f64).collect())
}

/// The least and the greatest step of evenly spaced samples that have these instants on a clock of this tick. The first sample lies within its
/// tick, and so do all others, but for a step: clocks jitter. The steps that fit are an interval, since each pair of samples bounds the step.
fn possible_steps(instants: &[f64], tick: f64) -> Option<[f64; 2]> {
    // Of samples that share an instant, the first and the last bound the step.
    let differ = |i: usize, j: usize| instants.get(j).is_none_or(|t| *t != instants[i]);
    let ends = |i: &usize| *i == 0 || differ(*i, i - 1) || differ(*i, i + 1);
    let ends: Vec<usize> = (0..instants.len()).filter(ends).collect();
    // Whether a step is too small (less), too large (greater), or fits.
    let fits = |step: f64| {
        let offsets = || ends.iter().map(|&i| (instants[i] - instants[0] - step * i as f64, i));
        let (latest, i) = offsets().max_by(|a, b| a.0.total_cmp(&b.0))?;
        let (earliest, j) = offsets().min_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(match latest - earliest > tick + step {
            true if i > j => Ordering::Less,
            true => Ordering::Greater,
            false => Ordering::Equal,
        })
    };
    let mean = mean_step(instants)?;
    let bound = |within: Ordering| {
        let (mut low, mut high) = (0.0, 2.0 * mean);
        for _ in 0..HALVINGS {
            let step = 0.5 * (low + high);
            match fits(step)? {
                Ordering::Less => low = step,
                Ordering::Greater => high = step,
                Ordering::Equal if within == Ordering::Less => high = step,
                Ordering::Equal => low = step,
            }
        }
        Some([low, high])
    };
    // The sides of the bounds that fit.
    let (least, most) = (bound(Ordering::Less)?[1], bound(Ordering::Greater)?[0]);
    (least <= most).then_some([least, most])
}

impl RecordFile {
    /// Sets the unit of columns of instants that count ms, µs or ns from 1970, or days, if the file has no unit. Spreads samples that share an
    /// instant evenly. Notes both.
    ///
    /// # Errors
    /// [`Error::Data`] for instants that are too large for seconds.
    pub(crate) fn with_clocks(mut self) -> Result<Self> {
        self.put_in_order()?;
        // Only columns of instants are copied.
        let mut changed: Vec<(String, Vec<f64>)> = Vec::new();
        for (i, (name, samples)) in self.record.columns().enumerate() {
            if !self.is_clock(name) {
                continue;
            }
            let is_stamped = self.origins.iter().any(|(column, _)| column == name);
            let mut instants = Cow::Borrowed(samples);
            let first = samples.iter().copied().find(|instant| instant.is_finite());
            let has_unit = is_stamped || self.units[i].is_some() || has_unit(name);
            if let Some(unit) = first.filter(|_| !has_unit).and_then(epoch_unit) {
                self.units[i] = Some(unit.to_owned());
                self.notes.push(format!("column '{name}' counts the {unit} from 1970"));
            } else if !has_unit && are_days(samples) {
                self.units[i] = Some("s".to_owned());
                let first = samples[0];
                instants = samples.iter().map(|t| (t - first) * DAY).collect();
                self.notes.push(format!(
                    "column '{name}' has dates of a spreadsheet, in days; it counts the seconds from day {first}"
                ));
            }
            if let Some(spread) = evenly_spread(&instants) {
                let unit = self.units[i].as_ref().map_or(String::new(), |unit| format!(" {unit}"));
                self.notes.push(format!(
                    "several samples share an instant of column '{name}': they are taken as evenly spaced, every {}{unit}",
                    exact(spread[1] - spread[0])
                ));
                instants = Cow::Owned(spread);
            }
            if let Cow::Owned(instants) = instants {
                changed.push((name.to_owned(), instants));
            }
        }
        if !changed.is_empty() {
            let columns = self.record.columns().map(|(name, samples)| {
                let new = changed.iter().find(|(column, _)| column == name);
                (name, new.map_or(samples, |(_, instants)| instants).to_vec())
            });
            self.record = Record::new(columns).map_err(|error| Error::data(&self.path, error))?;
        }
        Ok(self)
    }

    /// Whether a column of this name has instants.
    fn is_clock(&self, name: &str) -> bool {
        is_time(name) || self.axis() == Some(name) || self.origins.iter().any(|(column, _)| column == name)
    }

    /// Takes the rows from the last to the first where no column of instants ever increases, and one decreases: many historians write the
    /// newest sample first. Neighbours may share an instant where its resolution is coarse, and a date may stay the same.
    fn put_in_order(&mut self) -> Result<()> {
        let clocks = || self.record.columns().filter(|(name, _)| self.is_clock(name));
        let never_increases = |samples: &[f64]| samples.windows(2).all(|pair| pair[1] <= pair[0]);
        let Some((name, _)) = clocks()
            .find(|(_, samples)| samples.first() > samples.last())
            .filter(|_| clocks().all(|(_, samples)| never_increases(samples)))
        else {
            return Ok(());
        };
        self.notes.push(format!(
            "column '{name}' decreases: the rows are taken from the last to the first"
        ));
        let reversed = |samples: &[f64]| samples.iter().rev().copied().collect::<Vec<f64>>();
        let mut columns: Vec<(String, Vec<f64>)> = self
            .record
            .columns()
            .map(|(name, samples)| (name.to_owned(), reversed(samples)))
            .collect();
        // Time stamps count from the first sample.
        for (name, origin) in &mut self.origins {
            if let Some((_, samples)) = columns.iter_mut().find(|(column, _)| column == name) {
                let first = samples[0];
                samples.iter_mut().for_each(|t| *t -= first);
                *origin += (first * 1e9).round() as i64;
                let says = format!("column '{name}' has time stamps; ");
                for note in self.notes.iter_mut().filter(|note| note.starts_with(&says)) {
                    *note = format!("{says}it counts the seconds from the instant of the last row");
                }
            }
        }
        self.record = Record::new(columns).map_err(|error| Error::data(&self.path, error))?;
        let count = self.record.len();
        self.lines.reverse(count);
        for other in &mut self.others {
            if let Unusable::At {
                problem: LineProblem::NotANumber { sample, .. } | LineProblem::OtherUnit { sample, .. },
                ..
            } = &mut other.why
            {
                *sample = count.saturating_sub(*sample + 1);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn clock(name: &str, instants: &[f64]) -> (RecordFile, f64) {
        let u: Vec<f64> = instants.iter().map(|t| (7.0 * t).sin()).collect();
        let record = Record::new([(name, instants.to_vec()), ("u", u)]).unwrap();
        let file = RecordFile::in_memory(record, "log").with_clocks().unwrap();
        let step = file.time(None, &["u"]).unwrap().unwrap().clock.step;
        (file, step)
    }

    #[test]
    fn dates_of_a_spreadsheet_are_days() {
        let days: Vec<f64> = (0..100).map(|i| 46_000.5 + f64::from(i) * 0.1 / DAY).collect();
        let (file, step) = clock("Date", &days);
        assert!((step - 0.1).abs() < 1e-6, "{step}");
        assert_eq!(
            file.notes,
            ["column 'Date' has dates of a spreadsheet, in days; it counts the seconds from day 46000.5"]
        );
        // Seconds since a start eleven hours ago.
        let seconds: Vec<f64> = (0..100).map(|i| 40_000.0 + 0.01 * f64::from(i)).collect();
        let (file, step) = clock("time", &seconds);
        assert!(file.notes.is_empty() && (step - 0.01).abs() < 1e-9, "{:?}", file.notes);
    }

    #[test]
    fn samples_that_share_an_instant_are_spread() {
        let of_rate = |rate: f64, offset: f64| -> Vec<f64> {
            (0..600)
                .map(|i| (offset + f64::from(i) / rate + 1e-9).floor())
                .collect()
        };
        // Of whole ticks, the number of samples alone would give 1199 steps in 11 s.
        let few = |rate: f64, ticks: f64| of_rate(rate, 0.0)[..(rate * ticks) as usize].to_vec();
        let short =
            [(100.0, 3.0), (100.0, 5.0), (50.0, 12.0), (20.0, 16.0)].map(|(rate, ticks)| (rate, few(rate, ticks)));
        let long =
            [(10.0, 0.0), (10.0, 0.73), (4.0, 0.1), (12.5, 0.0)].map(|(rate, offset)| (rate, of_rate(rate, offset)));
        for (rate, instants) in short.into_iter().chain(long) {
            let (file, step) = clock("time", &instants);
            assert!((step * rate - 1.0).abs() < 1e-9, "{rate}: {step}");
            assert!(file.notes[0].contains("evenly spaced"), "{:?}", file.notes);
        }
        // Four samples in each of five seconds may be 3.7 or 4.3 a second.
        assert_eq!(evenly_spread(&few(4.0, 5.0)), None);
        // A pause of half a minute is no even spacing.
        let mut paused = of_rate(10.0, 0.0);
        paused[300..].iter_mut().for_each(|t| *t += 30.0);
        assert_eq!(evenly_spread(&paused), None);
        assert_eq!(evenly_spread(&of_rate(1.0, 0.0)), None);
    }
}
