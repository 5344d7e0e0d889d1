//! The columns of a record that a regression uses, checked with the lines of the file.

use anyhow::{Result, bail};
use flexure::error::DataError;
use flexure::record::SIZES;
use flexure::text::shown_path;
use flexure_io::RecordFile;

use crate::labels::Labels;
use crate::plots::extent;

/// Points of the curve along each column, by the number of columns.
const GRID: [usize; 6] = [301, 41, 15, 9, 6, 5];

/// The names of the columns of a regression.
#[derive(Debug, Clone, Default)]
pub struct Columns {
    /// The columns to regress on.
    pub x: Vec<String>,
    /// The column to estimate.
    pub y: String,
    /// The column of weights, if there is one.
    pub weights: Option<String>,
}

/// What a regression is made from.
#[derive(Clone)]
pub struct RegressionData<'a> {
    /// The file's name without its folder.
    pub file: String,
    /// The columns' names.
    pub names: Columns,
    /// The columns of x.
    pub x: Vec<&'a [f64]>,
    /// y.
    pub y: &'a [f64],
    /// The weights, if there are any.
    pub weights: Option<&'a [f64]>,
    /// The columns' units.
    pub labels: Labels,
    /// Whether rows are repeated on purpose, in place of weights.
    pub repeated: bool,
    /// Rows that were left out as outliers, by a weight of zero.
    pub left_out: Vec<usize>,
}

impl<'a> RegressionData<'a> {
    /// The columns of these names, which must be finite; x and y must vary.
    ///
    /// # Errors
    /// Names the file, the column and where possible the line.
    pub fn read(file: &'a RecordFile, names: Columns) -> Result<Self> {
        let x = names
            .x
            .iter()
            .map(|name| file.finite(name))
            .collect::<flexure_io::Result<_>>()?;
        let y = file.finite(&names.y)?;
        let weights = names.weights.as_ref().map(|name| file.finite(name)).transpose()?;
        if let (Some(weights), Some(name)) = (weights, &names.weights) {
            check_weights(file, name, weights)?;
        }
        let data = RegressionData {
            file: file.name(),
            names,
            x,
            y,
            weights,
            labels: Labels::new(file),
            repeated: false,
            left_out: Vec::new(),
        };
        data.check_variation(file)?;
        data.check_sizes(file)?;
        Ok(data)
    }

    /// Columns that are in memory, and are finite.
    pub fn in_memory(x: Vec<&'a [f64]>, y: &'a [f64], weights: Option<&'a [f64]>) -> Self {
        RegressionData {
            file: String::new(),
            names: Columns {
                x: (1..=x.len()).map(|j| format!("x{j}")).collect(),
                y: "y".to_owned(),
                weights: None,
            },
            x,
            y,
            weights,
            labels: Labels::default(),
            repeated: false,
            left_out: Vec::new(),
        }
    }

    /// The error with the file's column names in place of the library's, and with its place.
    pub fn locate(&self, error: flexure::Error, file: &RecordFile) -> flexure_io::Error {
        let name = |column: &str| match (column, &self.names.x[..]) {
            ("y", _) => Some(self.names.y.clone()),
            ("x", [only]) => Some(only.clone()),
            (_, all) => {
                let number = column.strip_prefix("x[")?.strip_suffix(']')?.parse::<usize>().ok()?;
                all.get(number).cloned()
            }
        };
        file.locate(error.with_columns(name))
    }

    fn check_variation(&self, file: &RecordFile) -> Result<()> {
        let rows = self.rows();
        if rows.len() <= self.x.len() {
            bail!(
                "{}: {} rows{} for {} columns of x; a regression needs more rows than columns: name fewer columns, or take more samples",
                shown_path(&file.path),
                rows.len(),
                self.weights.map_or("", |_| " of positive weight"),
                self.x.len()
            );
        }
        for (name, column) in self.names.x.iter().zip(&self.x).chain([(&self.names.y, &self.y)]) {
            let first = column[rows[0]];
            if rows.iter().all(|&i| column[i] == first) {
                return Err(file.locate(flexure::Error::constant(name.clone(), first)).into());
            }
        }
        Ok(())
    }

    fn check_sizes(&self, file: &RecordFile) -> Result<()> {
        let x = self.names.x.iter().zip(self.x.iter().copied());
        let weights = self.names.weights.iter().zip(self.weights);
        for (name, column) in x.chain([(&self.names.y, self.y)]).chain(weights) {
            let largest = column.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            if !SIZES.contains(&largest) {
                let column = name.clone();
                return Err(file.locate(DataError::Unit { column, largest }.into()).into());
            }
        }
        Ok(())
    }

    /// The rows of positive weight.
    pub fn rows(&self) -> Vec<usize> {
        let counts = |i: &usize| self.weights.is_none_or(|w| w[*i] > 0.0);
        (0..self.y.len()).filter(counts).collect()
    }

    /// The weight of a row.
    pub fn weight(&self, row: usize) -> f64 {
        self.weights.map_or(1.0, |w| w[row])
    }

    /// The columns of x at some rows.
    pub fn x_at(&self, rows: &[usize]) -> Vec<Vec<f64>> {
        let of = |column: &&[f64]| rows.iter().map(|&i| column[i]).collect();
        self.x.iter().map(of).collect()
    }

    /// The range of a column of x over the rows of positive weight.
    pub fn range(&self, column: usize) -> [f64; 2] {
        let rows = self.x[column].iter().enumerate();
        extent(rows.filter(|(row, _)| self.weight(*row) > 0.0).map(|(_, x)| *x))
    }

    /// A grid over the ranges of all columns, the last column fastest; column by column. `points` are those along each column, by
    /// default fewer for more columns.
    pub fn grid(&self, points: Option<usize>) -> Vec<Vec<f64>> {
        let d = self.x.len();
        let n = points.unwrap_or(GRID[(d - 1).min(GRID.len() - 1)]);
        let total = n.pow(d as u32);
        (0..d)
            .map(|j| {
                let along = self.along(j, n);
                let repeat = n.pow((d - 1 - j) as u32);
                (0..total).map(|i| along[i / repeat % n]).collect()
            })
            .collect()
    }

    /// Evenly spaced points over the range of one column.
    pub fn along(&self, column: usize, points: usize) -> Vec<f64> {
        let [low, high] = self.range(column);
        let last = points - 1;
        // The quotient is computed first, so that the edges of cells of dyadic width are among the points.
        let at = |i: usize| match i == last {
            true => high,
            false => low + (high - low) * (i as f64 / last as f64),
        };
        (0..points).map(at).collect()
    }
}

fn check_weights(file: &RecordFile, name: &str, weights: &[f64]) -> Result<()> {
    if let Some(sample) = weights.iter().position(|w| *w < 0.0) {
        let line = file.line(sample).map_or(String::new(), |line| format!(", line {line}"));
        bail!(
            "{}{line}: column '{name}' is {} at sample {sample}, but a weight must be zero or positive",
            shown_path(&file.path),
            weights[sample]
        );
    }
    if weights.iter().all(|w| *w == 0.0) {
        bail!(
            "{}: all weights in column '{name}' are zero; at least some rows must count",
            shown_path(&file.path)
        );
    }
    Ok(())
}
