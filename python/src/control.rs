//! Control scenarios, and models that learn sample by sample.

use std::path::PathBuf;
use std::sync::Arc;

use flexure::control::Controller;
use flexure::control::controllers::LinearSystem;
use flexure::control::recursive::{
    Cusum as Detector, Memory, RecursiveFriction as Friction, RecursiveHammerstein as Hammerstein,
};
use flexure::manipulator::Arm;
use flexure_io::arm::{ArmError, Body, SCENARIOS, Scenario as Checked, scenario_preset_text};
use flexure_io::read_text;
use flexure_workbench::control::{Outcome, OwnController, compare};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::arrays::{Column, columns};
use crate::errors::{FlexureError, of_any, of_library};
use crate::run::interruptible;

/// A scenario as its file has it.
#[pyclass(frozen, module = "flexure._core")]
pub struct Scenario {
    checked: Arc<Checked>,
    text: String,
    name: String,
}

/// A linear system: its name, A, B, C and D row by row, whether it is in continuous time, and whether the model's feedforward is added.
type System = (String, Column, Column, Column, Column, bool, bool);

/// Denominator, numerator, powers of the input, and offset.
type Estimate = (Vec<f64>, Vec<f64>, Vec<f64>, f64);

/// Samples between two looks for signals: some hundredths of a second of the largest model.
const SAMPLES: usize = 64;

/// Two signals of one length.
fn paired<'a>([a, b]: [(&str, &'a Column); 2]) -> PyResult<[&'a [f64]; 2]> {
    let (first, second) = (a.1.samples(), b.1.samples());
    match first.len() == second.len() {
        true => Ok([first, second]),
        false => Err(of_library(&flexure::Error::length(b.0, second.len(), first.len()))),
    }
}

/// A state takes `count` samples: all of them or, if a signal interrupts, none.
fn taken<S: Clone>(py: Python<'_>, state: &mut S, count: usize, mut take: impl FnMut(&mut S, usize)) -> PyResult<()> {
    let before = (count > SAMPLES).then(|| state.clone());
    for k in 0..count {
        if k % SAMPLES == SAMPLES - 1
            && let Err(raised) = py.check_signals()
        {
            before.into_iter().for_each(|before| *state = before);
            return Err(raised);
        }
        take(state, k);
    }
    Ok(())
}

fn of_arm(error: &ArmError) -> PyErr {
    match error {
        ArmError::Simulation(cause) => of_library(cause),
        _ => FlexureError::new_err(error.to_string()),
    }
}

impl Scenario {
    fn new(text: String, name: String, folder: &std::path::Path) -> PyResult<Self> {
        let checked = Checked::from_toml_str(&text, &name, folder).map_err(|error| of_arm(&error))?;
        Ok(Scenario {
            checked: Arc::new(checked),
            text,
            name,
        })
    }
}

#[pymethods]
impl Scenario {
    /// The names of the presets.
    #[staticmethod]
    fn presets() -> Vec<&'static str> {
        SCENARIOS.map(|(name, _)| name).to_vec()
    }

    /// A preset.
    #[staticmethod]
    fn preset(name: &str) -> PyResult<Self> {
        let text = scenario_preset_text(name).map_err(|error| of_arm(&error))?;
        Scenario::new(text.to_owned(), name.to_owned(), "".as_ref())
    }

    /// The text of a scenario, and the folder of the arm files that it names.
    #[staticmethod]
    fn from_text(text: String, folder: PathBuf) -> PyResult<Self> {
        Scenario::new(text, "the scenario".to_owned(), &folder)
    }

    /// Reads a scenario.
    #[staticmethod]
    fn read(path: PathBuf) -> PyResult<Self> {
        let text = read_text(&path).map_err(|error| of_any(&error.into()))?;
        let folder = path.parent().map(PathBuf::from).unwrap_or_default();
        Scenario::new(text, path.display().to_string(), &folder)
    }

    /// The text, with its comments.
    #[getter]
    fn text(&self) -> &str {
        &self.text
    }

    /// The loop's sample time, s.
    #[getter]
    fn sample_time(&self) -> f64 {
        self.checked.options.sampling.sample_time()
    }

    /// Runs all controllers, and these linear systems.
    fn compare(&self, py: Python<'_>, systems: Vec<System>, seeds: Option<usize>) -> PyResult<Controlled> {
        let mut own = Vec::with_capacity(systems.len());
        for (name, a, b, c, d, continuous, feedforward) in systems {
            let model = match &self.checked.body {
                Body::Arm { model, .. } if feedforward => Some(Arm::new(**model).map_err(|error| of_library(&error))?),
                _ => None,
            };
            let system = LinearSystem::new(model, a.samples(), b.samples(), c.samples(), d.samples());
            let system = match continuous {
                true => system.and_then(|system| system.sampled(self.sample_time())),
                false => system,
            };
            own.push((name, system.map_err(|error| of_library(&error))?));
        }
        let scenario = Arc::clone(&self.checked);
        let outcome = interruptible(py, move |interrupt| {
            let own: Vec<(String, OwnController)> = own
                .into_iter()
                .map(|(name, system)| {
                    let make: OwnController = Box::new(move || Box::new(system.clone()) as Box<dyn Controller>);
                    (name, make)
                })
                .collect();
            compare(&scenario, &own, seeds, &|_| interrupt.flow())
        })?;
        Ok(Controlled {
            outcome: outcome.map_err(|error| of_any(&error))?,
            name: self.name.clone(),
        })
    }
}

/// The results of a scenario.
#[pyclass(frozen, module = "flexure._core")]
pub struct Controlled {
    outcome: Outcome,
    name: String,
}

#[pymethods]
impl Controlled {
    /// One object per controller, as the command prints it.
    fn json(&self) -> String {
        self.outcome.json().to_string()
    }

    /// The text, as the command prints it.
    fn summary(&self) -> String {
        self.outcome.lines().to_string()
    }

    /// The page.
    fn page(&self) -> PyResult<String> {
        let html = self.outcome.html(&self.name, None);
        html.map_err(|error| FlexureError::new_err(error.to_string()))
    }

    /// The record of a controller's first run; `None` if the run failed.
    fn record<'py>(&self, py: Python<'py>, row: usize) -> PyResult<Option<Bound<'py, PyDict>>> {
        let run = self.outcome.rows.get(row).and_then(|row| row.run.as_ref());
        let record = run.map(|run| run.record().map_err(|error| of_library(&error)));
        record.transpose()?.map(|record| columns(py, &record)).transpose()
    }
}

fn memory(forgetting: Option<f64>, drift: Option<f64>) -> Memory {
    match (forgetting, drift) {
        (Some(factor), _) => Memory::Forgetting(factor),
        (None, Some(variance)) => Memory::Drift(variance),
        (None, None) => Memory::All,
    }
}

/// A Hammerstein system that learns; of degree 1, a linear one.
#[pyclass(module = "flexure._core")]
pub struct RecursiveHammerstein(Hammerstein);

#[pymethods]
impl RecursiveHammerstein {
    #[new]
    fn new(order: usize, delay: usize, degree: usize, forgetting: Option<f64>, drift: Option<f64>) -> PyResult<Self> {
        let model = Hammerstein::new(order, delay, degree, memory(forgetting, drift));
        model.map(Self).map_err(|error| of_library(&error))
    }

    /// Takes samples.
    fn push(&mut self, py: Python<'_>, u: Column, y: Column) -> PyResult<()> {
        let [u, y] = paired([("u", &u), ("y", &y)])?;
        taken(py, &mut self.0, u.len(), |model, k| model.push(u[k], y[k]))
    }

    /// Denominator, numerator, powers and offset; `None` as long as the samples do not determine them.
    fn estimate(&self) -> Option<Estimate> {
        self.0.estimate().map(|e| (e.a, e.b, e.powers, e.offset))
    }

    /// A checkpoint.
    fn to_bytes<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &self.0.to_bytes())
    }

    /// The state of a checkpoint.
    #[staticmethod]
    fn from_bytes(bytes: &[u8]) -> PyResult<Self> {
        Hammerstein::from_bytes(bytes)
            .map(Self)
            .map_err(|error| of_library(&error))
    }
}

/// Inertia and friction of a joint that learn.
#[pyclass(module = "flexure._core")]
pub struct RecursiveFriction(Friction);

#[pymethods]
impl RecursiveFriction {
    #[new]
    fn new(sample_time: f64, reversal: f64, forgetting: Option<f64>, drift: Option<f64>) -> PyResult<Self> {
        let model = Friction::new(sample_time, reversal, memory(forgetting, drift));
        model.map(Self).map_err(|error| of_library(&error))
    }

    /// Takes samples, and returns the prediction error of each torque; NaN where there is no prediction.
    fn push(&mut self, py: Python<'_>, torque: Column, velocity: Column) -> PyResult<Vec<f64>> {
        let [torque, velocity] = paired([("torque", &torque), ("velocity", &velocity)])?;
        let mut missed = Vec::with_capacity(torque.len());
        taken(py, &mut self.0, torque.len(), |model, k| {
            missed.push(model.push(torque[k], velocity[k]).unwrap_or(f64::NAN));
        })?;
        Ok(missed)
    }

    /// Inertia, Coulomb friction, viscous friction and offset; `None` as long as the samples do not determine them.
    fn estimate(&self) -> Option<[f64; 4]> {
        self.0.estimate()
    }

    /// A checkpoint.
    fn to_bytes<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &self.0.to_bytes())
    }

    /// The state of a checkpoint.
    #[staticmethod]
    fn from_bytes(bytes: &[u8]) -> PyResult<Self> {
        Friction::from_bytes(bytes)
            .map(Self)
            .map_err(|error| of_library(&error))
    }
}

/// A detector of changes of a mean.
#[pyclass(module = "flexure._core")]
pub struct Cusum(Detector);

#[pymethods]
impl Cusum {
    #[new]
    fn new(deviation: f64, change: f64, quiet: f64) -> PyResult<Self> {
        Detector::new(deviation, change, quiet)
            .map(Self)
            .map_err(|error| of_library(&error))
    }

    /// Takes values; returns the places of alarms among them, and whether each is upwards.
    fn push(&mut self, py: Python<'_>, x: Column) -> PyResult<Vec<(usize, bool)>> {
        let (x, mut alarms) = (x.samples(), Vec::new());
        taken(py, &mut self.0, x.len(), |detector, k| {
            alarms.extend(detector.push(x[k]).map(|side| (k, side > 0)));
        })?;
        Ok(alarms)
    }

    /// A checkpoint.
    fn to_bytes<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &self.0.to_bytes())
    }

    /// The state of a checkpoint.
    #[staticmethod]
    fn from_bytes(bytes: &[u8]) -> PyResult<Self> {
        Detector::from_bytes(bytes)
            .map(Self)
            .map_err(|error| of_library(&error))
    }

    /// The samples from a change to its alarm, on average.
    #[getter]
    fn mean_delay(&self) -> f64 {
        self.0.mean_delay()
    }
}
