//! A record in preparation: columns with units, at instants.

use std::ops::Range;

use anyhow::{Result, bail};
use flexure::Record;
use flexure::preparation::{fill, nominal_step};
use flexure::record::{SIZES, check_values};
use flexure::text::shown_path;
use flexure_io::{Instants, RecordFile};

use crate::text::{decimal, grouped};

/// A column with its unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Its name.
    pub name: String,
    /// Its unit, if known.
    pub unit: Option<String>,
    /// The samples; NaN where they are missing.
    pub samples: Vec<f64>,
}

/// Columns of equal length, and their instants.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// The file's name, for messages.
    pub name: String,
    /// A note on changes to the file's instants, if there are any.
    pub note: Option<String>,
    /// The instants, in s, where they are known.
    pub instants: Option<Vec<f64>>,
    /// The origin of the instants, in ns, if they were time stamps: tables with an origin share a clock.
    pub origin: Option<i64>,
    /// The columns.
    pub columns: Vec<Column>,
}

impl Table {
    /// The columns of a file, except that of its `instants`.
    ///
    /// A `sample_time`, in s, takes the place of instants: the samples then have that distance.
    ///
    /// # Errors
    /// Where there is no other column.
    pub fn of(file: &RecordFile, instants: Option<Instants>, sample_time: Option<f64>) -> Result<Self> {
        let mut columns = Vec::new();
        for ((name, samples), unit) in file.record.columns().zip(&file.units) {
            if instants.as_ref().is_none_or(|instants| instants.name != name) {
                columns.push(Column {
                    name: name.to_owned(),
                    unit: unit.clone(),
                    samples: samples.to_vec(),
                });
            }
        }
        if columns.is_empty() {
            bail!("{}: there is no column but the time", shown_path(&file.path));
        }
        let name = shown_path(&file.path);
        let uniform = |step: f64| (0..file.record.len()).map(|i| i as f64 * step).collect();
        let note = match (&instants, sample_time) {
            (Some(instants), Some(step)) => Some(format!(
                "the samples of {name} count as {step} s apart; column '{}' is left out",
                instants.name
            )),
            _ => None,
        };
        Ok(Table {
            origin: instants.as_ref().and_then(|instants| instants.origin),
            instants: sample_time.map(uniform).or(instants.map(|instants| instants.seconds)),
            name,
            note,
            columns,
        })
    }

    /// Refuses values and times too large for sums, and steps of time too small.
    pub(super) fn check_sizes(&self) -> Result<()> {
        for column in &self.columns {
            let present: Vec<f64> = column.samples.iter().copied().filter(|v| v.is_finite()).collect();
            // Values too small for sums count as zero here.
            if present.iter().any(|v| v.abs() > *SIZES.end()) {
                check_values(&column.name, &present)?;
            }
        }
        if let Some(time) = &self.instants {
            let duration = time.last().zip(time.first()).map_or(0.0, |(last, first)| last - first);
            check_values("the time", &[duration])?;
        }
        Ok(())
    }

    /// The number of samples per column.
    pub fn len(&self) -> usize {
        self.columns.first().map_or(0, |column| column.samples.len())
    }

    /// Whether there is no sample.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Keeps the samples in this range alone.
    pub(super) fn keep(&mut self, range: Range<usize>) {
        for column in &mut self.columns {
            column.samples = column.samples[range.clone()].to_vec();
        }
        self.instants = self.instants.as_ref().map(|t| t[range].to_vec());
    }

    /// The usual step of the instants, in s.
    ///
    /// # Errors
    /// Where the instants are not known, or do not increase.
    pub fn step(&self, what: &str) -> Result<f64> {
        match &self.instants {
            Some(instants) => Ok(nominal_step(instants)?),
            None => bail!("{what} needs the sample time, and there is no time column"),
        }
    }

    /// The column of this name.
    pub fn column(&mut self, name: &str) -> Option<&mut Column> {
        self.columns.iter_mut().find(|column| column.name == name)
    }

    /// Where a sample is, for reading: its instant, or its number.
    pub(super) fn place(&self, sample: usize) -> String {
        match &self.instants {
            Some(instants) => self.instant(instants[sample]),
            None => format!("sample {}", grouped(sample)),
        }
    }

    /// An instant for reading, with as many digits as tell it from its neighbours: seconds from 1970 need more than others.
    pub(super) fn instant(&self, instant: f64) -> String {
        let ends = self.instants.as_ref().and_then(|t| Some([*t.first()?, *t.last()?]));
        let [first, last] = ends.unwrap_or_default();
        let step = ((last - first) / self.len().max(2) as f64).abs();
        let text = decimal(instant);
        if text
            .parse()
            .is_ok_and(|short: f64| (short - instant).abs() <= 0.1 * step)
            || !(step > 0.0)
        {
            return format!("{text} s");
        }
        let decimals = (1.0 - step.log10()).ceil().clamp(0.0, 9.0) as usize;
        let text = format!("{instant:.decimals$}");
        let text = match text.contains('.') {
            true => text.trim_end_matches('0').trim_end_matches('.'),
            false => &text,
        };
        format!("{text} s")
    }

    /// The columns as a record, the instants first as column `t`, and their units.
    ///
    /// # Errors
    /// Where another column is called `t` too.
    pub fn record(&self) -> Result<(Record, Vec<Option<String>>)> {
        self.record_over("t")
    }

    /// The columns as a record, the instants first as the column of this name, and their units.
    ///
    /// # Errors
    /// Where another column has that name too.
    pub(super) fn record_over(&self, time: &str) -> Result<(Record, Vec<Option<String>>)> {
        let instants = self.instants.iter().map(|instants| (time, instants.clone()));
        let columns = self
            .columns
            .iter()
            .map(|column| (&*column.name, column.samples.clone()));
        let units = self.instants.iter().map(|_| Some("s".to_owned()));
        let units = units
            .chain(self.columns.iter().map(|column| column.unit.clone()))
            .collect();
        Ok((Record::new(instants.chain(columns))?, units))
    }

    /// Interpolates short gaps of every column but some; returns how many samples were interpolated and how many are still missing, by column.
    pub(super) fn fill(&mut self, longest_gap: usize, unfilled: &[String]) -> Vec<[usize; 2]> {
        let missing = |x: &[f64]| x.iter().filter(|x| !x.is_finite()).count();
        let of = |column: &mut Column| {
            let before = missing(&column.samples);
            if before > 0 && !unfilled.contains(&column.name) {
                column.samples = fill(&column.samples, longest_gap);
            }
            let after = missing(&column.samples);
            [before - after, after]
        };
        self.columns.iter_mut().map(of).collect()
    }
}
