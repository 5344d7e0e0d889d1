//! Identification of systems: with the record in memory.

use std::sync::Arc;

use flexure::Record;
use flexure::identify::{
    Calibration, HammersteinMethod, PhysicalForm, PlainHammerstein, RefinedHammerstein, RegressionLag, Structure,
};
use flexure_io::RecordFile;
use flexure_workbench::systems::{Decoration, Identified, SystemColumns, Task, form};
use pyo3::prelude::*;

use crate::arrays::{Column, array};
use crate::errors::{DataError, ParameterError, of_any};
use crate::model::PyModel;
use crate::names::{estimator, kernel, known};
use crate::run::{briefly, interruptible};

/// What stands for a file's name in messages and on pages.
pub const RECORD: &str = "the record";

/// What there is to choose, as the keys of a dict; None leaves the choice to the data.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Options {
    structure: String,
    method: String,
    order: Option<usize>,
    delay: Option<usize>,
    unit: String,
    known: Option<[[f64; 2]; 2]>,
    fresh: f64,
    form: Option<String>,
    missing: bool,
    noise_model: bool,
    nonlinearity: String,
    kernel: String,
    parameter: Option<f64>,
    lag: Option<usize>,
    ignore_colour: bool,
    branches: Option<usize>,
    robust: bool,
}

impl Options {
    fn calibration(&self) -> PyResult<Calibration> {
        if let Some([p, q]) = self.known {
            return Ok(Calibration::TwoPoints {
                x: [p[0], q[0]],
                phi: [p[1], q[1]],
            });
        }
        known(
            "unit",
            &self.unit,
            &["static-gain", "first-coefficient"],
            |name| match name {
                "static-gain" => Some(Calibration::UnitStaticGain),
                "first-coefficient" => Some(Calibration::UnitFirstCoefficient),
                _ => None,
            },
        )
    }

    fn refined(&self) -> PyResult<RefinedHammerstein> {
        Ok(RefinedHammerstein {
            order: self.order,
            delay: self.delay,
            calibration: self.calibration()?,
            start: estimator(&self.nonlinearity)?,
            noise_model: self.noise_model,
            form: self.form()?,
            fresh_share: self.fresh,
        })
    }

    fn plain(&self) -> PyResult<PlainHammerstein> {
        Ok(PlainHammerstein {
            estimator: estimator(&self.nonlinearity)?,
            kernel: kernel(&self.kernel)?,
            parameter: self.parameter,
            order: self.order,
            delay: self.delay,
            regression_lag: self.lag.map_or(RegressionLag::Strongest, RegressionLag::At),
            calibration: self.calibration()?,
            ignore_colour: self.ignore_colour,
            fresh_share: self.fresh,
        })
    }

    fn form(&self) -> PyResult<Option<PhysicalForm>> {
        let named = self.form.as_deref().map(form).transpose();
        named.map_err(|expected| ParameterError::new_err(format!("the form: {expected}")))
    }

    /// The method of a Hammerstein identification.
    pub fn hammerstein(&self) -> PyResult<HammersteinMethod> {
        Ok(match self.method.as_str() {
            "plain" => HammersteinMethod::Plain(self.plain()?),
            "refined" => HammersteinMethod::Refined(self.refined()?),
            other => {
                let text = format!("the method is '{other}', but must be one of refined, plain");
                return Err(ParameterError::new_err(text));
            }
        })
    }

    /// The structure with these choices.
    pub fn task(&self) -> PyResult<Task> {
        let structure = Structure::by_name(&self.structure);
        let structure =
            structure.ok_or_else(|| ParameterError::new_err(format!("there is no structure '{}'", self.structure)))?;
        let options = flexure::identify::Options {
            fresh_share: self.fresh,
            robust: self.robust,
            missing: self.missing,
            branches: self.branches,
            hammerstein: self.hammerstein()?,
        };
        Ok(Task {
            structure,
            options,
            or_another: false,
        })
    }
}

/// An identified system with the record that it came from.
pub struct Session {
    /// The record.
    pub file: RecordFile,
    /// The system.
    pub identified: Identified,
}

/// An identified system with the record that it came from.
#[pyclass(frozen, module = "flexure._core")]
pub struct Identification(Arc<Session>);

impl Identification {
    /// With its record.
    pub fn of(session: Session) -> Identification {
        Identification(Arc::new(session))
    }
}

#[pymethods]
impl Identification {
    /// Identifies from the inputs (names and samples) and the output. Several experiments follow each other; their lengths are given in
    /// samples.
    #[new]
    #[pyo3(signature = (inputs, output, sample_time, options, experiments=None))]
    fn new(
        py: Python<'_>,
        inputs: Vec<(String, Column)>,
        output: (String, Column),
        sample_time: Option<f64>,
        options: Options,
        experiments: Option<Vec<usize>>,
    ) -> PyResult<Self> {
        if sample_time.is_some_and(|h| !(h > 0.0 && h.is_finite())) {
            return Err(ParameterError::new_err("dt must be positive and finite, in s"));
        }
        let task = options.task()?;
        if experiments.is_some() && !task.takes_experiments() {
            return Err(DataError::new_err(
                "several experiments are for Hammerstein(method='refined')",
            ));
        }
        let experiments = experiments.unwrap_or_default();
        let session = interruptible(py, move |interrupt| {
            let names: Vec<String> = inputs.iter().map(|(name, _)| name.clone()).collect();
            let columns = inputs.iter().chain([&output]);
            let columns = columns.map(|(name, samples)| (name.clone(), samples.samples().to_vec()));
            let file = RecordFile::in_memory(Record::new(columns)?, RECORD);
            let output = output.0.clone();
            drop(inputs);
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            let stage = |_: &str| interrupt.flow();
            let columns = SystemColumns {
                inputs: &names,
                output: &output,
            };
            let identified = task.identify(&file, columns, sample_time, &experiments, &stage)?;
            Ok(Session { file, identified })
        })?;
        session
            .map(Identification::of)
            .map_err(|error: anyhow::Error| of_any(&error))
    }

    /// The object that `flexure identify --json` prints, as text.
    fn json(&self) -> String {
        self.0.identified.json().to_string()
    }

    /// The text that `flexure identify` prints.
    fn summary(&self) -> String {
        self.0.identified.summary().to_string()
    }

    /// The model.
    fn model(&self) -> PyModel {
        PyModel::new(self.0.identified.model())
    }

    /// The free-run output over the record.
    fn predicted<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        array(py, &self.0.identified.result.predicted)
    }

    /// The page that `flexure identify --report` writes.
    #[pyo3(signature = (command=None))]
    fn page(&self, py: Python<'_>, command: Option<String>) -> PyResult<String> {
        let session = Arc::clone(&self.0);
        let decoration = Decoration {
            command,
            ..Decoration::default()
        };
        briefly(py, move || session.identified.html(&session.file, decoration))?.map_err(|error| of_any(&error))
    }
}

/// A block structure that can be identified.
#[pyclass(frozen, module = "flexure._core", name = "Structure")]
pub struct StructureRow(&'static Structure);

#[pymethods]
impl StructureRow {
    /// Its name, as `flexure identify --structure` takes it.
    #[getter]
    fn name(&self) -> &'static str {
        self.0.name.key
    }

    /// What its blocks are.
    #[getter]
    fn description(&self) -> &'static str {
        self.0.description
    }

    /// Whether it takes more than one input.
    #[getter]
    fn several_inputs(&self) -> bool {
        self.0.has_several_inputs()
    }

    /// Whether it takes a single input.
    #[getter]
    fn single_input(&self) -> bool {
        self.0.inputs.contains(&1)
    }
}

/// All structures.
#[pyfunction]
pub fn structures() -> Vec<StructureRow> {
    flexure::identify::structures().iter().map(StructureRow).collect()
}
