//! The columns of a record that a regression uses, checked with the lines of the file.

use std::path::Path;

use anyhow::{Result, bail};
use flexure::error::DataError;
use flexure_io::{RecordFile, read_record};

use super::Arguments;

/// Points of the curve along each column, by the number of columns.
const GRID: [usize; 6] = [301, 41, 15, 9, 6, 5];
/// The sizes of a column's largest value that all estimators can compute with.
const SIZES: std::ops::RangeInclusive<f64> = 1e-100..=1e100;
/// Most points of a grid over all columns.
const MOST_POINTS: usize = 1_000_000;

/// What a regression is made from.
pub struct Data<'a> {
    /// The file's name without its folder.
    pub file: String,
    /// The names of the columns of x.
    pub names: Vec<String>,
    /// The name of the column of y.
    pub y_name: String,
    /// The columns of x.
    pub x: Vec<&'a [f64]>,
    /// y.
    pub y: &'a [f64],
    /// The weights, if there are any.
    pub weights: Option<&'a [f64]>,
}

impl<'a> Data<'a> {
    /// The columns that the options name; they must be finite, and x and y must vary.
    pub fn read(file: &'a RecordFile, arguments: &Arguments) -> Result<Self> {
        let mut x = Vec::with_capacity(arguments.x.len());
        for name in &arguments.x {
            x.push(file.finite(name)?);
        }
        let y = file.finite(&arguments.y)?;
        let weights = arguments.weights.as_ref().map(|name| file.finite(name)).transpose()?;
        if let (Some(weights), Some(name)) = (weights, &arguments.weights) {
            check_weights(file, name, weights)?;
        }
        let data = Data {
            file: file
                .path
                .file_name()
                .map(|n| n.to_string_lossy().into_owned())
                .unwrap_or_default(),
            names: arguments.x.clone(),
            y_name: arguments.y.clone(),
            x,
            y,
            weights,
        };
        let rows = data.rows();
        if rows.len() <= data.x.len() {
            bail!(
                "{}: {} rows{} for {} columns of x; a regression needs more rows than columns: name fewer columns, or take more samples",
                file.path.display(),
                rows.len(),
                if weights.is_some() { " of positive weight" } else { "" },
                data.x.len()
            );
        }
        for (name, column) in data.names.iter().zip(&data.x).chain([(&data.y_name, &data.y)]) {
            let first = column[rows[0]];
            if rows.iter().all(|&i| column[i] == first) {
                let (column, value) = (name.clone(), first);
                return Err(file.locate(flexure::Error::constant(column, value)).into());
            }
        }
        let weights = arguments.weights.iter().zip(data.weights);
        for (name, column) in data
            .names
            .iter()
            .zip(data.x.iter().copied())
            .chain([(&data.y_name, data.y)])
            .chain(weights)
        {
            let largest = column.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            if !SIZES.contains(&largest) {
                let column = name.clone();
                return Err(file.locate(DataError::Unit { column, largest }.into()).into());
            }
        }
        if let Some(n) = arguments.grid {
            let points = (n as f64).powi(data.x.len() as i32);
            if points > MOST_POINTS as f64 {
                return Err(crate::arguments::Usage(format!(
                    "--grid {n} along {} columns makes {points} points, and at most {MOST_POINTS} are allowed; take a coarser grid, or --at",
                    data.x.len()
                ))
                .into());
            }
        }
        Ok(data)
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

    /// The range of a column of x over the rows of positive weight.
    pub fn range(&self, column: usize) -> [f64; 2] {
        let values = self.rows().into_iter().map(|i| self.x[column][i]);
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| {
            [low.min(v), high.max(v)]
        })
    }

    /// A grid over the ranges of all columns, the last column fastest; column by column.
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
        let at = |i: usize| {
            if i == last {
                high
            } else {
                low + (high - low) * (i as f64 / last as f64)
            }
        };
        (0..points).map(at).collect()
    }
}

fn check_weights(file: &RecordFile, name: &str, weights: &[f64]) -> Result<()> {
    if let Some(sample) = weights.iter().position(|w| *w < 0.0) {
        let line = file.line(sample).map_or(String::new(), |line| format!(", line {line}"));
        bail!(
            "{}{line}: column '{name}' is {} at sample {sample}, but a weight must be zero or positive",
            file.path.display(),
            weights[sample]
        );
    }
    if weights.iter().all(|w| *w == 0.0) {
        bail!(
            "{}: all weights in column '{name}' are zero; at least some rows must count",
            file.path.display()
        );
    }
    Ok(())
}

/// The points of a file at which to evaluate, column by column.
pub fn points(path: &Path, names: &[String]) -> Result<Vec<Vec<f64>>> {
    let file = read_record(path)?;
    let columns = names.iter().map(|name| Ok(file.finite(name)?.to_vec()));
    columns.collect()
}
