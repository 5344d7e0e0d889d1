//! Preparations that every record of a system needs in the same way: they are made while it is read, and a model keeps them for later records.

use anyhow::Result;
use flexure::preparation::Outliers;
use flexure::text::exact;
use flexure_io::RecordFile;

use super::{Columns, Done, Preparation, Table};

impl Preparation {
    /// The steps that do not belong to one record alone, as options of commands with their values: outliers, resampling, and gaps.
    pub fn repeated(&self) -> Vec<(&'static str, String)> {
        let usual = Outliers::default();
        let rule = self.outliers.as_ref().map(|_| self.rule);
        let options = [
            ("outliers", self.outliers.as_ref().map(Columns::listed)),
            (
                "threshold",
                rule.map(|r| r.threshold).filter(|t| *t != usual.threshold).map(exact),
            ),
            (
                "neighbours",
                rule.map(|r| r.neighbours)
                    .filter(|n| *n != usual.neighbours)
                    .map(|n| n.to_string()),
            ),
            ("resample", self.resample.map(exact)),
            ("hold", (!self.held.is_empty()).then(|| self.held.join(","))),
            ("fill", self.fill.map(|longest| longest.to_string())),
        ];
        options
            .into_iter()
            .filter_map(|(name, value)| Some((name, value?)))
            .collect()
    }

    /// The same steps for no other columns than these.
    pub fn only_for<S: AsRef<str>>(&self, columns: &[S]) -> Self {
        let has = |name: &String| columns.iter().any(|column| column.as_ref() == name);
        let outliers = self.outliers.clone().map(|outliers| match outliers {
            Columns::All => Columns::All,
            Columns::Named(names) => Columns::Named(names.into_iter().filter(|name| has(name)).collect()),
        });
        Preparation {
            outliers: outliers.filter(|outliers| *outliers != Columns::Named(Vec::new())),
            held: self.held.iter().filter(|name| has(name)).cloned().collect(),
            ..self.clone()
        }
    }

    /// The columns that these steps name.
    pub fn named(&self) -> impl Iterator<Item = &str> {
        let outliers = match &self.outliers {
            Some(Columns::Named(names)) => names.as_slice(),
            _ => &[],
        };
        outliers.iter().chain(&self.held).map(String::as_str)
    }

    /// Gives those columns the names that they have in another record.
    pub fn rename(&mut self, meant: impl Fn(&str) -> String) {
        let outliers = match &mut self.outliers {
            Some(Columns::Named(names)) => names.as_mut_slice(),
            _ => &mut [],
        };
        for name in outliers.iter_mut().chain(&mut self.held) {
            *name = meant(name);
        }
    }

    /// A file with these of its columns prepared, and what was done. Its instants are those of the column `time`; the column keeps its name, and
    /// is in s. Where a column that is not [`unfilled`](Self::unfilled) still misses samples, the longest part without such a gap is kept.
    ///
    /// # Errors
    /// As [`Preparation::run`].
    pub fn of_file(&self, file: &RecordFile, time: Option<&str>, columns: &[&str]) -> Result<(RecordFile, Vec<Done>)> {
        let instants = file.instants_in_seconds(time)?;
        let name = instants.as_ref().map(|instants| instants.name.clone());
        let table = Table::of(file, instants, None)?;
        let preparation = Preparation {
            keep: Columns::Named(columns.iter().map(|&name| name.to_owned()).collect()),
            ..self.clone()
        };
        let mut prepared = preparation.run(vec![table])?;
        prepared.keep_longest_part(self);
        let (record, units) = prepared.table.record_over(name.as_deref().unwrap_or_default())?;
        // Which columns are used is no news.
        let done = prepared.done.into_iter().filter(|done| done.step != "keep");
        Ok((file.with_record(record, units), done.collect()))
    }
}

impl Columns {
    /// `all`, or the names as an option takes them.
    fn listed(&self) -> String {
        match self {
            Columns::All => "all".to_owned(),
            Columns::Named(names) => names.join(","),
        }
    }
}
