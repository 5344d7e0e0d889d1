//! What chains and flexible arms share: their runs in time and their modes.

use std::ops::ControlFlow;

use flexure::Record;
use flexure::manipulator::chain::{ChainMode, ChainSimulation, LinearisedChain, Motors};
use flexure::simulation::{Integrator, Sampling, Tolerances, batch};
use flexure_io::check_computed;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{Column, array, slices};
use crate::errors::{ParameterError, of_any, of_library};
use crate::run::interruptible;

/// Called with the simulated time; it can stop a run.
type Watch<'a> = dyn FnMut(f64) -> ControlFlow<()> + 'a;

/// The number of instants of a simulation.
///
/// # Errors
/// If there is no memory for the records of so many runs, which have this number of columns.
pub fn instants(duration: f64, dt: f64, columns: usize, runs: usize) -> PyResult<usize> {
    let rows = Sampling::new(duration, dt).map_err(|error| of_library(&error))?.rows();
    check_computed(rows.saturating_mul(runs), columns).map_err(|error| of_any(&error.into()))?;
    Ok(rows)
}

/// The method of this name.
pub fn integrator(name: &str) -> PyResult<Integrator> {
    match name {
        "auto" => Ok(Integrator::Automatic),
        "dop853" => Ok(Integrator::Dop853),
        "radau" => Ok(Integrator::Radau),
        _ => Err(ParameterError::new_err(format!(
            "integrator is '{name}', but must be 'auto', 'dop853' or 'radau'"
        ))),
    }
}

/// The columns of runs from `initial`, one state a run, over `span` (duration and time step), with a relative and an absolute tolerance. The
/// runs lie one after the other in each column of the torques and of the results.
///
/// # Errors
/// The first that a run has; of several runs a note names it.
pub fn run<'py>(
    py: Python<'py>,
    torques: Vec<Column>,
    initial: Vec<Vec<f64>>,
    span: [f64; 2],
    tolerances: [f64; 2],
    integrator: Integrator,
    simulate: impl Fn(&[&[f64]], &ChainSimulation, &mut Watch<'_>) -> flexure::Result<Record> + Send + Sync + 'static,
) -> PyResult<Bound<'py, PyDict>> {
    let runs: Vec<(usize, Vec<f64>)> = initial.into_iter().enumerate().collect();
    let count = runs.len();
    let records = interruptible(py, move |interrupt| {
        batch(&runs, |(run, initial)| {
            let options = ChainSimulation {
                initial: initial.clone(),
                tolerances: Tolerances {
                    rtol: tolerances[0],
                    atol: tolerances[1],
                    ..Tolerances::default()
                },
                sampling: Sampling::new(span[0], span[1])?,
                integrator,
                base_motion: None,
            };
            let torques: Vec<&[f64]> = slices(&torques)
                .into_iter()
                .map(|column| &column[run * (column.len() / count)..(run + 1) * (column.len() / count)])
                .collect();
            simulate(&torques, &options, &mut |_| interrupt.flow())
        })
    })?;
    let mut found: Vec<Record> = Vec::with_capacity(count);
    for (run, record) in records.into_iter().enumerate() {
        found.push(record.map_err(|error| {
            let error = of_library(&error);
            if count > 1 {
                let _ = error
                    .value(py)
                    .call_method1("add_note", (format!("in run {run}, counted from 0"),));
            }
            error
        })?);
    }
    joined(py, &found)
}

/// The columns of records of the same names, one record after the other.
fn joined<'py>(py: Python<'py>, records: &[Record]) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    let first = records.first();
    for (i, name) in first.iter().flat_map(|record| record.names()).enumerate() {
        let all = records.iter().filter_map(|record| record.columns().nth(i));
        let values: Vec<f64> = all.flat_map(|(_, samples)| samples.iter().copied()).collect();
        dict.set_item(name, array(py, &values)?)?;
    }
    Ok(dict)
}

/// Squared frequency, damping ratio and shape of each mode, the lowest first; `held` is whether brakes hold the motors.
pub fn modes(near: flexure::Result<LinearisedChain>, held: bool) -> PyResult<Vec<(f64, f64, Vec<f64>)>> {
    let motors = if held { Motors::Held } else { Motors::Free };
    let modes = near.and_then(|near| near.modes(motors));
    let parts = |mode: ChainMode| (mode.square, mode.damping_ratio, mode.shape);
    Ok(modes
        .map_err(|error| of_library(&error))?
        .into_iter()
        .map(parts)
        .collect())
}
