//! Chains of links: dynamics of many states at once, and runs in time.

use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

use flexure::manipulator::chain::{
    Base, BaseMotion, ChainData, ChainPreset, ChainSimulation, DrivenChain, RotorCoupling, chain_columns,
    simulate_chain_watched,
};
use flexure_io::arm::chain_of_toml;
use flexure_io::read_text;
use flexure_io::urdf::{UrdfOptions, parse_urdf, read_urdf};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;

use crate::arrays::{Column, array};
use crate::errors::{of_any, of_library};
use crate::names::known;
use crate::run::briefly;
use crate::runs;

/// States between two looks for signals: some hundredths of a second.
const STATES: usize = 1 << 15;

/// The states that a thread takes at a time: it is worth some hundred.
const PIECE: usize = 256;

/// A chain or tree of rigid links.
#[pyclass(frozen, module = "flexure._core")]
pub struct Chain(Arc<DrivenChain>);

fn options(base: &str, gravity: [f64; 3]) -> PyResult<UrdfOptions> {
    let base = known("base", base, &["fixed", "free"], |name| match name {
        "fixed" => Some(Base::Fixed),
        "free" => Some(Base::Free),
        _ => None,
    })?;
    Ok(UrdfOptions { base, gravity })
}

impl Chain {
    /// With rigid joints.
    fn of_links(chain: flexure::manipulator::chain::Chain) -> PyResult<Self> {
        let chain = DrivenChain::new(chain, &[], RotorCoupling::None).map_err(|error| of_library(&error))?;
        Ok(Chain(Arc::new(chain)))
    }

    /// The chain without its motors.
    pub fn links(&self) -> &flexure::manipulator::chain::Chain {
        self.0.chain()
    }

    /// The results of states that lie one after the other, `width` values a state.
    fn each<'py>(
        &self,
        py: Python<'py>,
        count: usize,
        width: usize,
        of: impl Fn(&mut ChainData, usize, &mut [f64]) -> flexure::Result<()> + Sync,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.pieces(py, count, width, |places, results| {
            let mut data = self.links().data();
            let mut each = places.zip(results.chunks_exact_mut(width));
            each.try_for_each(|(i, result)| of(&mut data, i, result))
        })
    }

    /// The same, where `of` gives the results of states that follow each other.
    fn pieces<'py>(
        &self,
        py: Python<'py>,
        count: usize,
        width: usize,
        of: impl Fn(Range<usize>, &mut [f64]) -> flexure::Result<()> + Sync,
    ) -> PyResult<Bound<'py, PyAny>> {
        let mut results = vec![0.0; count * width];
        for (block, results) in results.chunks_mut((STATES * width).max(1)).enumerate() {
            briefly(py, || {
                let pieces = results.par_chunks_mut((PIECE * width).max(1)).enumerate();
                pieces.try_for_each(|(piece, results)| {
                    let first = block * STATES + piece * PIECE;
                    of(first..first + results.len() / width, results)
                })
            })?
            .map_err(|error| of_library(&error))?;
            py.check_signals()?;
        }
        array(py, &results)
    }
}

/// State number `i` of states that lie one after the other.
fn state(values: &[f64], i: usize, width: usize) -> &[f64] {
    &values[i * width..(i + 1) * width]
}

/// States that follow each other.
fn states<'a>(values: &'a [f64], places: &Range<usize>, width: usize) -> &'a [f64] {
    &values[places.start * width..places.end * width]
}

#[pymethods]
impl Chain {
    /// Reads a URDF file.
    #[staticmethod]
    fn read_urdf(path: PathBuf, base: &str, gravity: [f64; 3]) -> PyResult<Self> {
        let chain = read_urdf(&path, &options(base, gravity)?).map_err(|error| of_any(&error.into()))?;
        Chain::of_links(chain)
    }

    /// The text of a URDF.
    #[staticmethod]
    fn parse_urdf(text: &str, base: &str, gravity: [f64; 3]) -> PyResult<Self> {
        let options = options(base, gravity)?;
        let chain = parse_urdf(text, "the robot".as_ref(), &options).map_err(|error| of_any(&error.into()))?;
        Chain::of_links(chain)
    }

    /// Reads a chain file.
    #[staticmethod]
    fn read_toml(path: PathBuf) -> PyResult<Self> {
        let text = read_text(&path).map_err(|error| of_any(&error.into()))?;
        let chain = chain_of_toml(&text, &path.display().to_string()).map_err(|error| of_any(&error.into()))?;
        Ok(Chain(Arc::new(chain)))
    }

    /// A preset's chain.
    #[staticmethod]
    fn preset(name: &str) -> PyResult<Self> {
        let names: Vec<&str> = ChainPreset::ALL.iter().map(|preset| preset.name()).collect();
        let find = |name: &str| ChainPreset::ALL.into_iter().find(|preset| preset.name() == name);
        let parameters = known("preset", name, &names, find)?.parameters();
        let chain = flexure::manipulator::chain::Chain::new(&parameters).map_err(|error| of_library(&error))?;
        Chain::of_links(chain)
    }

    /// The names of the joints on which torques act.
    #[getter]
    fn driven(&self) -> Vec<String> {
        self.0.driven().into_iter().cloned().collect()
    }

    /// Which joints are flexible.
    #[getter]
    fn flexible(&self) -> Vec<bool> {
        self.0.flexible()
    }

    /// The number of instants of a simulation, for so many of whose records there is memory.
    fn instants(&self, duration: f64, dt: f64, runs: usize) -> PyResult<usize> {
        runs::instants(duration, dt, chain_columns(&self.0).len(), runs)
    }

    /// The columns of simulations under torques, one column a joint and one run after the other, from states `[q, qm, v, vm]`. `base` has the poses of a base that is
    /// moved, one after the other; without any, it stays where it is.
    #[expect(clippy::too_many_arguments, reason = "those of the Python function")]
    fn simulate<'py>(
        &self,
        py: Python<'py>,
        torques: Vec<Column>,
        base: Option<Column>,
        initial: Vec<Vec<f64>>,
        span: [f64; 2],
        tolerances: [f64; 2],
        integrator: &str,
    ) -> PyResult<Bound<'py, PyDict>> {
        let chain = Arc::clone(&self.0);
        let integrator = runs::integrator(integrator)?;
        runs::run(
            py,
            torques,
            initial,
            span,
            tolerances,
            integrator,
            move |torques, options, watch| {
                let poses = base.as_ref().map(|base| base.samples().as_chunks().0);
                let motion = poses.map(|poses| BaseMotion::new(poses, options.sampling.sample_time()));
                let options = ChainSimulation {
                    base_motion: motion.transpose()?,
                    ..options.clone()
                };
                simulate_chain_watched(&chain, torques, &options, watch)
            },
        )
    }

    /// The names of the joints that move.
    #[getter]
    fn joints(&self) -> Vec<String> {
        self.links().joints().to_vec()
    }

    /// The least and the largest position of every joint.
    #[getter]
    fn limits(&self) -> Vec<[f64; 2]> {
        self.links().limits().to_vec()
    }

    /// The position in which every joint is at zero.
    #[getter]
    fn neutral(&self) -> Vec<f64> {
        self.links().neutral()
    }

    /// The number of values of a velocity.
    #[getter]
    fn velocities(&self) -> usize {
        self.links().velocities()
    }

    /// Accelerations of states one after the other.
    fn forward_dynamics<'py>(&self, py: Python<'py>, q: Column, v: Column, tau: Column) -> PyResult<Bound<'py, PyAny>> {
        let (chain, n, p) = (self.links(), self.links().velocities(), self.links().positions());
        let (q, v, tau) = (q.samples(), v.samples(), tau.samples());
        self.pieces(py, v.len() / n, n, |places, a| {
            let (q, v, tau) = (states(q, &places, p), states(v, &places, n), states(tau, &places, n));
            chain.forward_dynamics_batch(q, v, tau, a)
        })
    }

    /// Torques of states one after the other.
    fn inverse_dynamics<'py>(&self, py: Python<'py>, q: Column, v: Column, a: Column) -> PyResult<Bound<'py, PyAny>> {
        let (chain, n, p) = (self.links(), self.links().velocities(), self.links().positions());
        let (q, v, a) = (q.samples(), v.samples(), a.samples());
        self.pieces(py, v.len() / n, n, |places, tau| {
            let (q, v, a) = (states(q, &places, p), states(v, &places, n), states(a, &places, n));
            chain.inverse_dynamics_batch(q, v, a, tau)
        })
    }

    /// Inertia matrices, by rows, of positions one after the other.
    fn mass_matrix<'py>(&self, py: Python<'py>, q: Column) -> PyResult<Bound<'py, PyAny>> {
        let (chain, n, p) = (self.links(), self.links().velocities(), self.links().positions());
        let q = q.samples();
        self.pieces(py, q.len() / p, n * n, |places, m| {
            chain.mass_matrix_batch(states(q, &places, p), m)
        })
    }

    /// The inertial parameters.
    #[getter]
    fn inertial_parameters(&self) -> Vec<f64> {
        self.links().inertial_parameters()
    }

    /// Regressors, by rows, of states one after the other.
    fn regressor<'py>(&self, py: Python<'py>, q: Column, v: Column, a: Column) -> PyResult<Bound<'py, PyAny>> {
        let (chain, n, p) = (self.links(), self.links().velocities(), self.links().positions());
        let (q, v, a) = (q.samples(), v.samples(), a.samples());
        let width = n * chain.inertial_parameters().len();
        self.each(py, v.len() / n, width, |data, i, matrix| {
            chain.regressor(data, state(q, i, p), state(v, i, n), state(a, i, n), matrix)
        })
    }

    /// How torques change with position and velocity: two matrices by rows, of states one after the other.
    fn inverse_dynamics_derivatives<'py>(
        &self,
        py: Python<'py>,
        q: Column,
        v: Column,
        a: Column,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (chain, n, p) = (self.links(), self.links().velocities(), self.links().positions());
        let (q, v, a) = (q.samples(), v.samples(), a.samples());
        self.each(py, v.len() / n, 2 * n * n, |data, i, found| {
            let (by_q, by_v) = found.split_at_mut(n * n);
            chain.inverse_dynamics_derivatives(data, state(q, i, p), state(v, i, n), state(a, i, n), by_q, by_v)
        })
    }

    /// How accelerations change with position, velocity and torques: three matrices by rows, of states one after the other.
    fn forward_dynamics_derivatives<'py>(
        &self,
        py: Python<'py>,
        q: Column,
        v: Column,
        tau: Column,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (chain, n, p) = (self.links(), self.links().velocities(), self.links().positions());
        let (q, v, tau) = (q.samples(), v.samples(), tau.samples());
        self.each(py, v.len() / n, 3 * n * n, |data, i, found| {
            let of = chain.forward_dynamics_derivatives(data, state(q, i, p), state(v, i, n), state(tau, i, n))?;
            found.copy_from_slice(&[of.by_position, of.by_velocity, of.by_torque].concat());
            Ok(())
        })
    }

    /// The modes near rest at a position, the lowest first: squared frequency, damping ratio and shape of each.
    fn modes(&self, q: Vec<f64>, held: bool) -> PyResult<Vec<(f64, f64, Vec<f64>)>> {
        runs::modes(self.0.linearised(&mut self.0.data(), &q), held)
    }

    /// Kinetic and potential energy of states one after the other.
    fn energy<'py>(&self, py: Python<'py>, q: Column, v: Column) -> PyResult<Bound<'py, PyAny>> {
        let (chain, n, p) = (self.links(), self.links().velocities(), self.links().positions());
        let (q, v) = (q.samples(), v.samples());
        self.each(py, v.len() / n, 2, |data, i, result| {
            let energy = chain.energy(data, state(q, i, p), state(v, i, n))?;
            result.copy_from_slice(&[energy.kinetic, energy.potential]);
            Ok(())
        })
    }

    /// Linear and angular momentum about the centre of mass, and its place, of states one after the other.
    fn centroidal_momentum<'py>(&self, py: Python<'py>, q: Column, v: Column) -> PyResult<Bound<'py, PyAny>> {
        let (chain, n, p) = (self.links(), self.links().velocities(), self.links().positions());
        let (q, v) = (q.samples(), v.samples());
        self.each(py, v.len() / n, 9, |data, i, result| {
            let momentum = chain.centroidal_momentum(data, state(q, i, p), state(v, i, n))?;
            result.copy_from_slice([momentum.linear, momentum.angular, momentum.com].as_flattened());
            Ok(())
        })
    }
}
