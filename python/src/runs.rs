//! What chains and flexible arms share: their runs in time and their modes.

use std::ops::ControlFlow;

use flexure::manipulator::chain::{ChainMode, ChainSimulation, LinearisedChain, Motors};
use flexure::simulation::{Integrator, Sampling, Tolerances};
use flexure_io::check_computed;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{Column, columns, slices};
use crate::errors::{ParameterError, of_any, of_library};
use crate::run::interruptible;

/// Called with the simulated time; it can stop a run.
type Watch<'a> = dyn FnMut(f64) -> ControlFlow<()> + 'a;

/// The number of instants of a simulation.
///
/// # Errors
/// If there is no memory for its record, which has this number of columns.
pub fn instants(duration: f64, dt: f64, columns: usize) -> PyResult<usize> {
    let rows = Sampling::new(duration, dt).map_err(|error| of_library(&error))?.rows();
    check_computed(rows, columns).map_err(|error| of_any(&error.into()))?;
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

/// The columns of a run from `initial` over `span` (duration and time step), with a relative and an absolute tolerance.
pub fn run<'py>(
    py: Python<'py>,
    torques: Vec<Column>,
    initial: Vec<f64>,
    span: [f64; 2],
    tolerances: [f64; 2],
    integrator: Integrator,
    simulate: impl FnOnce(&[&[f64]], &ChainSimulation, &mut Watch<'_>) -> flexure::Result<flexure::Record> + Send + 'static,
) -> PyResult<Bound<'py, PyDict>> {
    let record = interruptible(py, move |interrupt| {
        let options = ChainSimulation {
            initial,
            tolerances: Tolerances {
                rtol: tolerances[0],
                atol: tolerances[1],
                ..Tolerances::default()
            },
            sampling: Sampling::new(span[0], span[1])?,
            integrator,
            base_motion: None,
        };
        simulate(&slices(&torques), &options, &mut |_| interrupt.flow())
    })?;
    columns(py, &record.map_err(|error| of_library(&error))?)
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
