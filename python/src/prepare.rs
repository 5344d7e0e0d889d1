//! Records made ready for identification.

use flexure::preparation::{LowPass, Outliers};
use flexure_workbench::preparation::{self, Columns, Conversion, Cut, Preparation, Table};
use pyo3::prelude::*;

use crate::arrays::{self, Column};
use crate::errors::of_any;
use crate::run::interruptible;

/// What there is to do, as the keys of a dict; None leaves a step out.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Settings {
    cut: Option<[Option<f64>; 2]>,
    convert: Vec<(String, Option<String>, String)>,
    outliers: Option<Vec<String>>,
    threshold: f64,
    neighbours: usize,
    resample: Option<f64>,
    hold: Vec<String>,
    longest_gap: usize,
    fill: Option<usize>,
    low_pass: Option<f64>,
    order: usize,
    remove_mean: Option<Vec<String>>,
    detrend: Option<Vec<String>>,
}

impl From<Settings> for Preparation {
    fn from(settings: Settings) -> Self {
        let convert = settings.convert.into_iter();
        Preparation {
            keep: Columns::All,
            cut: settings.cut.map(Cut::Time),
            convert: convert
                .map(|(column, from, to)| Conversion { column, from, to })
                .collect(),
            outliers: settings.outliers.map(Columns::Named),
            rule: Outliers {
                neighbours: settings.neighbours,
                threshold: settings.threshold,
            },
            resample: settings.resample,
            held: settings.hold,
            longest_gap: settings.longest_gap,
            fill: settings.fill,
            unfilled: Vec::new(),
            low_pass: settings.low_pass.map(|cutoff| LowPass {
                cutoff,
                order: settings.order,
            }),
            remove_mean: settings.remove_mean.map(Columns::Named),
            detrend: settings.detrend.map(Columns::Named),
        }
    }
}

/// Instants, where they are known, and named columns.
type Parts<T> = (Option<T>, Vec<(String, T)>);

/// Prepares one record from one or several: returns its instants, its columns, and what was done.
#[pyfunction]
pub fn prepare<'py>(
    py: Python<'py>,
    tables: Vec<Parts<Column>>,
    settings: Settings,
) -> PyResult<(Parts<Bound<'py, PyAny>>, Vec<String>)> {
    let preparation = Preparation::from(settings);
    let prepared = interruptible(py, move |_| {
        let samples = |column: &Column| column.samples().to_vec();
        let table = |(i, (instants, columns)): (usize, &Parts<Column>)| Table {
            name: match tables.len() {
                1 => "the table".to_owned(),
                _ => format!("table{}", i + 1),
            },
            note: None,
            instants: instants.as_ref().map(samples),
            origin: None,
            columns: (columns.iter())
                .map(|(name, column)| preparation::Column {
                    name: name.clone(),
                    unit: None,
                    samples: samples(column),
                })
                .collect(),
        };
        preparation.run(tables.iter().enumerate().map(table).collect())
    })?;
    let prepared = prepared.map_err(|error: anyhow::Error| of_any(&error))?;
    let instants = prepared.table.instants.as_ref();
    let instants = instants.map(|instants| arrays::array(py, instants)).transpose()?;
    let columns = prepared.table.columns.into_iter();
    let columns = columns.map(|column| Ok((column.name, arrays::array(py, &column.samples)?)));
    let columns = columns.collect::<PyResult<_>>()?;
    let done = prepared.done.into_iter().map(|done| done.text).collect();
    Ok(((instants, columns), done))
}
