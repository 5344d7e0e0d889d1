//! `flexure prepare`: one or several files in, a record and a line about each step out.
//!
//! The steps have a fixed order, which does not depend on the order of the options:
//!
//! 1. **keep** some columns, or all;
//! 2. **cut**: samples that are cut off do not influence the later steps;
//! 3. **convert** units;
//! 4. **outliers** become missing samples;
//! 5. **merge** several files at common instants, and **resample**: short gaps are interpolated here;
//! 6. **fill** short gaps, where nothing was resampled;
//! 7. **low-pass**;
//! 8. **means** and **trends** of the result are subtracted.

mod merge;
mod repeated;
mod steps;
mod table;
mod units;

use anyhow::{Context as _, Result, bail};
use flexure::preparation::{Grid, LONGEST_GAP, LowPass, Outliers};
use flexure::text::counted;
use serde_json::{Value, json};

use crate::text::grouped;

pub use table::{Column, Table};
pub use units::conversion;

/// A part without gaps that is shorter than this fraction of the record is not taken for the record. Convention.
const SHORTEST_PART: usize = 4;

/// The longest gap for which it is suggested to interpolate it before an identification, in samples. Convention.
pub(crate) const LONGEST_FILLED: usize = 10;

/// Some columns.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Columns {
    /// Every column.
    All,
    /// Those of these names.
    Named(Vec<String>),
}

impl Columns {
    fn has(&self, name: &str) -> bool {
        match self {
            Columns::All => true,
            Columns::Named(names) => names.iter().any(|n| n == name),
        }
    }
}

/// What is kept of a record; both ends may be open.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cut {
    /// From and to these instants, in s, both included.
    Time([Option<f64>; 2]),
    /// From this sample to the one before that, counted from 0.
    Samples([Option<usize>; 2]),
}

/// A column and the unit that it is to have.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Conversion {
    /// The column's name.
    pub column: String,
    /// Its unit, where the record does not say it.
    pub from: Option<String>,
    /// The unit that it is to have.
    pub to: String,
}

/// The steps for a record; none by default. The module's documentation gives their order.
#[derive(Debug, Clone, PartialEq)]
pub struct Preparation {
    /// The columns to keep.
    pub keep: Columns,
    /// What to keep of the samples.
    pub cut: Option<Cut>,
    /// Units to convert.
    pub convert: Vec<Conversion>,
    /// The columns whose outliers become missing.
    pub outliers: Option<Columns>,
    /// What an outlier is.
    pub rule: Outliers,
    /// The new sample time, s.
    pub resample: Option<f64>,
    /// The columns that hold their value between samples.
    pub held: Vec<String>,
    /// The longest gap, in samples, that is interpolated when something is resampled.
    pub longest_gap: usize,
    /// The same if nothing is resampled; 0 by default.
    pub fill: Option<usize>,
    /// The columns whose missing samples stay missing, as outputs that an identification leaves out where they miss.
    pub unfilled: Vec<String>,
    /// The low-pass for all columns.
    pub low_pass: Option<LowPass>,
    /// The columns whose mean is taken off.
    pub remove_mean: Option<Columns>,
    /// The columns whose linear trend is taken off, with their mean.
    pub detrend: Option<Columns>,
}

impl Default for Preparation {
    fn default() -> Self {
        Preparation {
            keep: Columns::All,
            cut: None,
            convert: Vec::new(),
            outliers: None,
            rule: Outliers::default(),
            resample: None,
            held: Vec::new(),
            longest_gap: LONGEST_GAP,
            fill: None,
            unfilled: Vec::new(),
            low_pass: None,
            remove_mean: None,
            detrend: None,
        }
    }
}

/// What a step did.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Done {
    /// The step's name.
    pub step: &'static str,
    /// What it did, as a sentence without a full stop.
    pub text: String,
}

/// A prepared record.
#[derive(Debug, Clone, PartialEq)]
pub struct Prepared {
    /// The record.
    pub table: Table,
    /// What was done, in order.
    pub done: Vec<Done>,
}

impl Preparation {
    /// Prepares one record of one or several tables.
    ///
    /// # Errors
    /// For columns that do not exist, units that do not fit, tables without common instants, and steps that leave nothing; the library's
    /// errors for parameters out of range. The message says what to do.
    pub fn run(&self, mut tables: Vec<Table>) -> Result<Prepared> {
        let mut done = Vec::new();
        for note in tables.iter_mut().filter_map(|table| table.note.take()) {
            done.push(Done {
                step: "time",
                text: note,
            });
        }
        merge::rename(&mut tables, &mut done);
        self.check(&tables).with_context(|| names(&tables))?;
        for table in &mut tables {
            steps::keep(table, &self.keep, &mut done);
        }
        tables.retain(|table| !table.columns.is_empty());
        if let Some(cut) = self.cut {
            steps::check_cut(&tables, cut).with_context(|| names(&tables))?;
        }
        let computes = tables.len() > 1 || self.computes();
        for table in &mut tables {
            let name = table.name.clone();
            let checked = if computes { table.check_sizes() } else { Ok(()) };
            checked.and_then(|()| self.clean(table, &mut done)).context(name)?;
        }
        let name = names(&tables);
        let mut table = match tables.len() {
            1 => tables.remove(0),
            _ => merge::merge(tables, self, &mut done)?,
        };
        self.smooth(&mut table, &mut done).context(name)?;
        Ok(Prepared { table, done })
    }

    /// Whether a step makes new values.
    fn computes(&self) -> bool {
        let columns = [&self.outliers, &self.remove_mean, &self.detrend];
        let steps = [self.resample.is_some(), self.fill.is_some(), self.low_pass.is_some()];
        columns.iter().any(|columns| columns.is_some()) || steps.contains(&true)
    }

    /// The steps before several tables become one.
    fn clean(&self, table: &mut Table, done: &mut Vec<Done>) -> Result<()> {
        if let Some(cut) = self.cut {
            steps::cut(table, cut, done)?;
        }
        if !self.convert.is_empty() {
            steps::convert(table, &self.convert, done)?;
            table.check_sizes()?;
        }
        if let Some(columns) = &self.outliers {
            steps::outliers(table, columns, self.rule, done)?;
        }
        Ok(())
    }

    /// The steps after.
    fn smooth(&self, table: &mut Table, done: &mut Vec<Done>) -> Result<()> {
        let resampled = |done: &[Done]| done.iter().any(|done| done.step == "resample");
        // A merge of different instants has already resampled.
        if let Some(step) = self.resample
            && !resampled(done)
        {
            let old = table.step("a new sample time")?;
            let ends = table.instants.as_ref().and_then(|t| Some([*t.first()?, *t.last()?]));
            steps::resample(table, Grid::over(ends.unwrap_or_default(), step)?, old, self, done)?;
        }
        if let Some(longest) = self.fill
            && !resampled(done)
        {
            steps::fill(table, longest, &self.unfilled, done);
        }
        if let Some(filter) = self.low_pass {
            steps::low_pass(table, filter, done)?;
        }
        if let Some(columns) = &self.remove_mean {
            steps::remove_mean(table, columns, done);
        }
        if let Some(columns) = &self.detrend {
            steps::detrend(table, columns, done)?;
        }
        Ok(())
    }

    /// Refuses names that no table has, and a cut by samples of several files.
    fn check(&self, tables: &[Table]) -> Result<()> {
        let available: Vec<&str> = tables.iter().flat_map(|t| &t.columns).map(|c| &*c.name).collect();
        let lists = [
            Some(&self.keep),
            self.outliers.as_ref(),
            self.remove_mean.as_ref(),
            self.detrend.as_ref(),
        ];
        let named = lists.into_iter().flatten().flat_map(|columns| match columns {
            Columns::All => &[][..],
            Columns::Named(names) => names,
        });
        let named = named
            .chain(self.convert.iter().map(|convert| &convert.column))
            .chain(&self.held);
        for name in named {
            if !available.contains(&name.as_str()) {
                bail!("no column '{name}'; the columns are: {}", available.join(", "));
            }
            if !self.keep.has(name) {
                bail!("column '{name}' is not among those to keep; add it, or leave out what is to be done to it");
            }
        }
        if tables.len() > 1 && matches!(self.cut, Some(Cut::Samples(_))) {
            bail!("samples of several files have no common numbers; cut by time");
        }
        Ok(())
    }
}

/// The tables' names.
fn names(tables: &[Table]) -> String {
    tables.iter().map(|table| &*table.name).collect::<Vec<_>>().join(", ")
}

impl Prepared {
    /// Samples that are missing, by column.
    pub fn missing(&self) -> Vec<usize> {
        let missing = |column: &Column| column.samples.iter().filter(|x| !x.is_finite()).count();
        self.table.columns.iter().map(missing).collect()
    }

    /// Cuts off all but the longest part in which no column misses samples, but for the columns `unfilled`. Nothing is cut off where that part is
    /// short: then gaps are no exception. Says what uses all samples instead, where that is to interpolate a few.
    fn keep_longest_part(&mut self, steps: &Preparation) {
        let columns = || {
            self.table
                .columns
                .iter()
                .filter(|column| !steps.unfilled.contains(&column.name))
        };
        let is_whole = |i: &usize| columns().all(|column| column.samples[*i].is_finite());
        let samples: Vec<usize> = (0..self.table.len()).collect();
        let parts = samples.chunk_by(|a, b| is_whole(a) == is_whole(b));
        let (parts, gaps): (Vec<&[usize]>, Vec<&[usize]>) = parts.partition(|part| is_whole(&part[0]));
        // The first one of equal length.
        let longest = parts.into_iter().rev().max_by_key(|part| part.len());
        let Some((&first, &last)) = longest.and_then(|part| part.first().zip(part.last())) else {
            return;
        };
        let kept = last + 1 - first;
        if kept == samples.len() || kept < samples.len() / SHORTEST_PART {
            return;
        }
        let mut text = format!(
            "the longest part without a gap is used, {} of {} samples, from {} to {}",
            grouped(kept),
            grouped(samples.len()),
            self.table.place(first),
            self.table.place(last)
        );
        let is_inside = |gap: &&[usize]| gap[0] > 0 && gap[gap.len() - 1] + 1 < samples.len();
        let longest = gaps.iter().map(|gap| gap.len()).max().unwrap_or(0);
        if longest <= LONGEST_FILLED && gaps.iter().all(is_inside) && steps.resample.is_none() {
            text.push_str(&format!(
                " (--fill {longest} interpolates the gaps, of at most {}, and uses all)",
                counted(longest, "sample")
            ));
        }
        self.done.push(Done { step: "cut", text });
        self.table.keep(first..last + 1);
    }

    /// The record and what was done to it, for programs.
    pub fn json(&self) -> Value {
        let columns = self.table.columns.iter().zip(self.missing());
        let columns = columns.map(|(c, missing)| json!({"name": c.name, "unit": c.unit, "missing": missing}));
        json!({
            "samples": self.table.len(),
            "sample_time": self.table.step("").ok(),
            "columns": columns.collect::<Vec<_>>(),
            "steps": self.done.iter().map(|d| json!({"step": d.step, "text": d.text})).collect::<Vec<_>>(),
        })
    }
}
