//! Models as kept in files.

use std::path::Path;
use std::sync::Arc;

use anyhow::Result;
use flexure::Record;
use flexure_cli::session::{Judged, predict, simulate};
use flexure_io::{ModelFile, RecordFile, model_text, parse_model, read_model, write_model};
use pyo3::prelude::*;

use crate::arrays::{Column, array};
use crate::errors::of_any;
use crate::identification::RECORD;
use crate::run::interruptible;

/// What stands for a file's name in messages.
const MODEL: &str = "the model";

/// A model of one input and one output.
#[pyclass(frozen, module = "flexure._core")]
pub struct Model(Arc<ModelFile>);

impl Model {
    /// Of what a file holds.
    pub fn new(file: ModelFile) -> Self {
        Model(Arc::new(file))
    }

    /// Runs `work` with the columns as a record whose names are the model's.
    fn with_record<T: Send + 'static>(
        &self,
        py: Python<'_>,
        input: Column,
        output: Option<Column>,
        work: impl FnOnce(&ModelFile, &RecordFile, [&str; 2]) -> Result<T> + Send + 'static,
    ) -> PyResult<T> {
        let model = Arc::clone(&self.0);
        let result = interruptible(py, move |_| {
            let mut record = Record::new([(model.input.clone(), input.samples().to_vec())])?;
            if let Some(output) = output {
                record.push(model.output.clone(), output.samples().to_vec())?;
            }
            work(
                &model,
                &RecordFile::in_memory(record, RECORD),
                [&model.input, &model.output],
            )
        })?;
        result.map_err(|error| of_any(&error))
    }
}

#[pymethods]
impl Model {
    /// Reads the text of a model file.
    #[staticmethod]
    fn from_json(text: &str) -> PyResult<Self> {
        parse_model(text.as_bytes(), Path::new(MODEL))
            .map(Model::new)
            .map_err(|error| of_any(&error.into()))
    }

    /// Reads a model file.
    #[staticmethod]
    fn read(path: std::path::PathBuf) -> PyResult<Self> {
        read_model(path).map(Model::new).map_err(|error| of_any(&error.into()))
    }

    /// The text of a model file.
    fn json(&self) -> PyResult<String> {
        model_text(&self.0, Path::new(MODEL)).map_err(|error| of_any(&error.into()))
    }

    /// Writes a model file, whole or not at all.
    fn write(&self, path: std::path::PathBuf) -> PyResult<()> {
        write_model(path, &self.0).map_err(|error| of_any(&error.into()))
    }

    /// The free run from the steady state of the mean input.
    fn simulate<'py>(&self, py: Python<'py>, input: Column) -> PyResult<Bound<'py, PyAny>> {
        let values = self.with_record(py, input, None, |model, file, [input, _]| {
            simulate(model, file, &[input])
        })?;
        array(py, &values)
    }

    /// The prediction so many samples ahead; the free run without a horizon. Both start from the state that fits best.
    #[pyo3(signature = (input, output, horizon=None))]
    fn predict<'py>(
        &self,
        py: Python<'py>,
        input: Column,
        output: Column,
        horizon: Option<usize>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let values = self.with_record(py, input, Some(output), move |model, file, [input, output]| {
            predict(model, file, (&[input], output), horizon)
        })?;
        array(py, &values)
    }

    /// The object that `flexure validate --json` prints, as text.
    #[pyo3(signature = (input, output, skip=None))]
    fn validate(&self, py: Python<'_>, input: Column, output: Column, skip: Option<usize>) -> PyResult<String> {
        self.with_record(py, input, Some(output), move |model, file, [input, output]| {
            Ok(Judged::new(model, file, (&[input], output), skip, None)?
                .json()
                .to_string())
        })
    }
}
