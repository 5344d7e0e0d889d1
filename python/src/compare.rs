//! Several models on one record.

use std::sync::Arc;

use flexure::Record;
use flexure_io::RecordFile;
use flexure_workbench::systems::{Compared, ComparedModel, Judging};
use pyo3::prelude::*;

use crate::arrays::Column;
use crate::errors::of_any;
use crate::identification::RECORD;
use crate::model::PyModel;
use crate::run::interruptible;

/// Models on one record, the best fit first.
#[pyclass(frozen, module = "flexure._core", name = "Compared")]
pub struct PyCompared {
    compared: Arc<Compared>,
    file: Arc<RecordFile>,
}

#[pymethods]
impl PyCompared {
    /// Compares named models on the columns of a record; each has the names of its inputs and of its output.
    #[new]
    #[pyo3(signature = (columns, models, skip=None))]
    fn new(
        py: Python<'_>,
        columns: Vec<(String, Column)>,
        models: Vec<(String, PyRef<'_, PyModel>, Vec<String>, String)>,
        skip: Option<usize>,
    ) -> PyResult<Self> {
        let models: Vec<ComparedModel> = models
            .into_iter()
            .map(|(name, model, inputs, output)| ComparedModel {
                name,
                model: model.file().clone(),
                inputs,
                output,
            })
            .collect();
        let judging = Judging {
            skip,
            missing: models.iter().any(|c| c.model.missing),
            robust: models.iter().any(|c| c.model.robust),
            ..Judging::default()
        };
        let compared = interruptible(py, move |_| {
            let columns = columns
                .iter()
                .map(|(name, column)| (name.clone(), column.samples().to_vec()));
            let file = RecordFile::in_memory(Record::new(columns)?, RECORD);
            let compared = Compared::new(models, &file, judging)?;
            Ok(PyCompared {
                compared: Arc::new(compared),
                file: Arc::new(file),
            })
        })?;
        compared.map_err(|error: anyhow::Error| of_any(&error))
    }

    /// The object that `flexure compare --json` prints, as text.
    fn json(&self) -> String {
        self.compared.json().to_string()
    }

    /// The text that `flexure compare` prints.
    fn summary(&self) -> String {
        self.compared.summary().to_string()
    }

    /// The page that `flexure compare --report` writes.
    fn page(&self) -> PyResult<String> {
        self.compared.html(&self.file, None).map_err(|error| of_any(&error))
    }
}
