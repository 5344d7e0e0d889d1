//! Identification of systems: with the record in memory.

use std::sync::Arc;

use flexure::Record;
use flexure::identify::{
    Auto, Calibration, HammersteinWiener, JointInputs, Linear, MultipleInputs, Narx, Parallel, PhysicalForm,
    PlainHammerstein, RefinedHammerstein, RegressionLag, Volterra, Wiener, WienerHammerstein,
};
use flexure_io::RecordFile;
use flexure_workbench::systems::{CascadeMethod, Identified, Method, ReferenceMethod, Signals, Task, form};
use pyo3::prelude::*;
use self_cell::self_cell;

use crate::arrays::{Column, array};
use crate::errors::{DataError, ParameterError, of_any};
use crate::model::Model;
use crate::names::{estimator, kernel, known};
use crate::run::{briefly, interruptible};

/// What stands for a file's name in messages and on pages.
pub const RECORD: &str = "the record";

/// What there is to choose, as the keys of a dict; None leaves the choice to the data.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Options {
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
            missing: self.missing,
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

    fn task(&self) -> PyResult<Task> {
        let fresh_share = self.fresh;
        Ok(match self.structure.as_str() {
            "hammerstein" => Task::Hammerstein(match self.method.as_str() {
                "plain" => Method::Plain(self.plain()?),
                "refined" => Method::Refined {
                    method: self.refined()?,
                    form: self.form()?,
                },
                other => {
                    let text = format!("the method is '{other}', but must be one of refined, plain");
                    return Err(ParameterError::new_err(text));
                }
            }),
            "auto" => Task::Compare(Auto {
                fresh_share,
                ..Default::default()
            }),
            "linear" => Task::Cascade(CascadeMethod::Linear(Linear { fresh_share })),
            "wiener" => Task::Cascade(CascadeMethod::Wiener(Wiener { fresh_share })),
            "wiener-hammerstein" => Task::Cascade(CascadeMethod::WienerHammerstein(WienerHammerstein { fresh_share })),
            "hammerstein-wiener" => Task::HammersteinWiener(HammersteinWiener { fresh_share }),
            "parallel" => Task::Parallel(Parallel {
                branches: self.branches,
                fresh_share,
            }),
            "multiple-inputs" => Task::MultipleInputs(MultipleInputs { fresh_share }),
            "joint-inputs" => Task::JointInputs(JointInputs { fresh_share }),
            "narx" => Task::Reference(ReferenceMethod::Narx(Narx { fresh_share })),
            "volterra" => Task::Reference(ReferenceMethod::Volterra(Volterra { fresh_share })),
            other => return Err(ParameterError::new_err(format!("there is no structure '{other}'"))),
        })
    }
}

/// The record, and the names in it.
struct Owner {
    file: RecordFile,
    inputs: Vec<String>,
    /// The same joined by commas.
    input: String,
    output: String,
    sample_time: Option<f64>,
    /// Whether the structure has several inputs.
    several: bool,
}

impl Owner {
    fn signals(&self) -> Signals<'_> {
        Signals {
            input: &self.input,
            output: &self.output,
            sample_time: self.sample_time,
            several: self.several,
        }
    }
}

self_cell!(
    struct Session {
        owner: Owner,
        #[covariant]
        dependent: Identified,
    }
);

/// An identified system with the record that it came from.
#[pyclass(frozen, module = "flexure._core")]
pub struct Identification(Arc<Session>);

#[pymethods]
impl Identification {
    /// Identifies from the inputs (names and samples) and the output; several experiments follow each other, so many samples
    /// each.
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
        let has_several_inputs = matches!(task, Task::MultipleInputs(_) | Task::JointInputs(_));
        let several = match &experiments {
            None => None,
            Some(_) if options.structure == "hammerstein" && options.method == "refined" => {
                Some((options.refined()?, options.form()?))
            }
            Some(_) => {
                return Err(DataError::new_err(
                    "several experiments are for Hammerstein(method='refined')",
                ));
            }
        };
        let session = interruptible(py, move |interrupt| {
            let names: Vec<String> = inputs.iter().map(|(name, _)| name.clone()).collect();
            let columns = inputs.iter().chain([&output]);
            let columns = columns.map(|(name, samples)| (name.clone(), samples.samples().to_vec()));
            let owner = Owner {
                file: RecordFile::in_memory(Record::new(columns)?, RECORD),
                input: names.join(","),
                inputs: names,
                output: output.0.clone(),
                sample_time,
                several: has_several_inputs,
            };
            drop((inputs, output));
            Session::try_new(owner, |owner| match (several, experiments) {
                (Some((method, form)), Some(samples)) => {
                    Identified::of_experiments(method, form, &owner.file, &samples, owner.signals())
                }
                _ => {
                    let inputs: Vec<&str> = owner.inputs.iter().map(String::as_str).collect();
                    Identified::new(task, &owner.file, &inputs, owner.signals(), &|_| interrupt.flow())
                }
            })
        })?;
        session
            .map(|session| Identification(Arc::new(session)))
            .map_err(|error| of_any(&error))
    }

    /// The object that `flexure identify --json` prints, as text.
    fn json(&self) -> String {
        self.0.borrow_dependent().json().to_string()
    }

    /// The text that `flexure identify` prints.
    fn summary(&self) -> String {
        self.0.borrow_dependent().summary()
    }

    /// The model.
    fn model(&self) -> PyResult<Model> {
        let model = self.0.borrow_dependent().model();
        model.map(Model::new).map_err(|error| of_any(&error))
    }

    /// The free-run output over the record.
    fn predicted<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        array(py, self.0.borrow_dependent().predicted())
    }

    /// The page that `flexure identify --report` writes.
    #[pyo3(signature = (command=None))]
    fn page(&self, py: Python<'_>, command: Option<String>) -> PyResult<String> {
        let session = Arc::clone(&self.0);
        briefly(py, move || session.borrow_dependent().page(command))?.map_err(|error| of_any(&error))
    }
}
