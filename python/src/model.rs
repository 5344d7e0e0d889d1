//! Models as kept in files.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::Result;
use flexure::Record;
use flexure_export::Options;
use flexure_io::{ModelFile, RecordFile, model_text, parse_model, read_model, write_atomically, write_model};
use flexure_workbench::systems::{Judged, Judging, SystemColumns, predict, simulate};
use pyo3::prelude::*;

use crate::arrays::{Column, array};
use crate::errors::of_any;
use crate::identification::RECORD;
use crate::names::choice;
use crate::run::interruptible;

/// What stands for a file's name in messages.
const MODEL: &str = "the model";

/// A model of one output.
#[pyclass(frozen, name = "Model", module = "flexure._core")]
pub struct PyModel(Arc<ModelFile>);

impl PyModel {
    /// The model of a file's content.
    pub fn new(file: ModelFile) -> Self {
        PyModel(Arc::new(file))
    }

    /// What a model file has.
    pub fn file(&self) -> &ModelFile {
        &self.0
    }

    /// Runs `work` with the columns as a record whose names are the model's.
    fn with_record<T: Send + 'static>(
        &self,
        py: Python<'_>,
        inputs: Vec<Column>,
        output: Option<Column>,
        work: impl FnOnce(&ModelFile, &RecordFile, SystemColumns) -> Result<T> + Send + 'static,
    ) -> PyResult<T> {
        let (model, names) = (Arc::clone(&self.0), self.0.inputs.clone());
        let result = interruptible(py, move |_| {
            let columns = names.iter().zip(&inputs);
            let mut record = Record::new(columns.map(|(name, column)| (name.clone(), column.samples().to_vec())))?;
            if let Some(output) = output {
                record.push(model.output.clone(), output.samples().to_vec())?;
            }
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            let file = RecordFile::in_memory(record, RECORD);
            let columns = SystemColumns {
                inputs: &names,
                output: &model.output,
            };
            work(&model, &file, columns)
        })?;
        result.map_err(|error| of_any(&error))
    }
}

#[pymethods]
impl PyModel {
    /// Reads the text of a model file.
    #[staticmethod]
    fn from_json(text: &str) -> PyResult<Self> {
        parse_model(text.as_bytes(), Path::new(MODEL))
            .map(PyModel::new)
            .map_err(|error| of_any(&error.into()))
    }

    /// Reads a model file.
    #[staticmethod]
    fn read(path: std::path::PathBuf) -> PyResult<Self> {
        read_model(path)
            .map(PyModel::new)
            .map_err(|error| of_any(&error.into()))
    }

    /// The text of a model file.
    fn json(&self) -> PyResult<String> {
        model_text(&self.0, Path::new(MODEL)).map_err(|error| of_any(&error.into()))
    }

    /// Writes a model file, whole or not at all.
    fn write(&self, path: std::path::PathBuf) -> PyResult<()> {
        write_model(path, &self.0).map_err(|error| of_any(&error.into()))
    }

    /// Writes what `flexure export` writes; returns the files.
    #[pyo3(signature = (to, path, name=None, fmi="2", compile=false))]
    fn export(&self, to: &str, path: PathBuf, name: Option<&str>, fmi: &str, compile: bool) -> PyResult<Vec<PathBuf>> {
        let options = Options {
            format: choice("format", to)?,
            name,
            fmi: choice("version of FMI", fmi)?,
            compile,
        };
        let write = || -> Result<Vec<PathBuf>> {
            let artefacts = flexure_export::export(&self.0, &path, options)?;
            for artefact in &artefacts {
                write_atomically(&artefact.path, |out| out.write_all(&artefact.bytes))?;
            }
            Ok(artefacts.into_iter().map(|artefact| artefact.path).collect())
        };
        write().map_err(|error| of_any(&error))
    }

    /// The names of the inputs, in the order in which they are given to the other methods.
    #[getter]
    fn inputs(&self) -> Vec<String> {
        self.0.inputs.clone()
    }

    /// The free run from the steady state of the mean inputs.
    fn simulate<'py>(&self, py: Python<'py>, inputs: Vec<Column>) -> PyResult<Bound<'py, PyAny>> {
        let values = self.with_record(py, inputs, None, |model, file, columns| {
            simulate(&model.block, file, columns.inputs)
        })?;
        array(py, &values)
    }

    /// The prediction `horizon` samples ahead; the free run without a horizon. Both start from the state that fits best.
    #[pyo3(signature = (inputs, output, horizon=None))]
    fn predict<'py>(
        &self,
        py: Python<'py>,
        inputs: Vec<Column>,
        output: Column,
        horizon: Option<usize>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let values = self.with_record(py, inputs, Some(output), move |model, file, columns| {
            predict(model, file, columns, horizon)
        })?;
        array(py, &values)
    }

    /// The object that `flexure validate --json` prints, as text.
    #[pyo3(signature = (inputs, output, skip=None))]
    fn validate(&self, py: Python<'_>, inputs: Vec<Column>, output: Column, skip: Option<usize>) -> PyResult<String> {
        self.with_record(py, inputs, Some(output), move |model, file, columns| {
            let judging = Judging {
                skip,
                missing: model.missing,
                robust: model.robust,
                ..Judging::default()
            };
            Ok(Judged::new(model, file, columns, judging)?.json().to_string())
        })
    }
}
