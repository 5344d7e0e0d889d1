//! Flexible arms in a plane: their modes, their shape and runs in time.

use std::path::PathBuf;
use std::sync::Arc;

use flexure::manipulator::flexible_arm::{flexible_arm_columns, simulate_flexible_arm_watched};
use flexure_io::arm::{ChainFile, chain_file_of_toml};
use flexure_io::read_text;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::Column;
use crate::errors::{ParameterError, of_any, of_library};
use crate::runs;

/// An arm of flexible links in a plane.
#[pyclass(frozen, module = "flexure._core")]
pub struct FlexibleArm(Arc<flexure::manipulator::flexible_arm::FlexibleArm>);

#[pymethods]
impl FlexibleArm {
    /// Reads a chain file.
    #[staticmethod]
    fn read_toml(path: PathBuf) -> PyResult<Self> {
        let text = read_text(&path).map_err(|error| of_any(&error.into()))?;
        match chain_file_of_toml(&text, &path.display().to_string()).map_err(|error| of_any(&error.into()))? {
            ChainFile::FlexibleArm(arm) => Ok(FlexibleArm(Arc::new(arm))),
            ChainFile::Chain(_) => Err(ParameterError::new_err(format!(
                "{}: no link is a beam of finite elements or modes; flexure.Chain takes this file",
                path.display()
            ))),
        }
    }

    /// The names of the joints that move, and which are flexible.
    #[getter]
    fn joints(&self) -> Vec<(String, bool)> {
        let joints = self.0.joints().into_iter();
        joints.map(|(name, flexible)| (name.to_owned(), flexible)).collect()
    }

    /// The names of the joints on which torques act.
    #[getter]
    fn driven(&self) -> Vec<String> {
        self.0.driven().into_iter().cloned().collect()
    }

    /// The number of coordinates.
    #[getter]
    fn coordinates(&self) -> usize {
        self.0.coordinates()
    }

    /// Where those of the joints begin.
    #[getter]
    fn first(&self) -> usize {
        self.0.first()
    }

    /// The number of instants of a simulation, for whose record there is memory.
    fn instants(&self, duration: f64, dt: f64) -> PyResult<usize> {
        runs::instants(duration, dt, flexible_arm_columns(&self.0).len(), 1)
    }

    /// The columns of a simulation under torques, one column a driven joint, from a state `[q, qm, v, vm]`.
    fn simulate<'py>(
        &self,
        py: Python<'py>,
        torques: Vec<Column>,
        initial: Vec<f64>,
        span: [f64; 2],
        tolerances: [f64; 2],
        integrator: &str,
    ) -> PyResult<Bound<'py, PyDict>> {
        let arm = Arc::clone(&self.0);
        let integrator = runs::integrator(integrator)?;
        runs::run(
            py,
            torques,
            vec![initial],
            span,
            tolerances,
            integrator,
            move |torques, options, watch| simulate_flexible_arm_watched(&arm, torques, options, watch),
        )
    }

    /// The modes near rest at a position, the lowest first: squared frequency, damping ratio and shape of each.
    fn modes(&self, q: Vec<f64>, held: bool) -> PyResult<Vec<(f64, f64, Vec<f64>)>> {
        runs::modes(self.0.linearised(&q), held)
    }

    /// Places along the axis of a link at a position.
    fn outline(&self, q: Vec<f64>, link: usize, count: usize) -> PyResult<Vec<[f64; 2]>> {
        self.0.outline(&q, link, count).map_err(|error| of_library(&error))
    }
}
