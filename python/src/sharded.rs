//! A Hammerstein system over shards of a record.

use std::sync::{Arc, Mutex, PoisonError};

use flexure::Record;
use flexure::identify::{HammersteinMethod, Request, ShardPoint, ShardSums, ShardedHammerstein};
use flexure_io::RecordFile;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::arrays::Column;
use crate::errors::{DataError, ParameterError, of_any, of_library};
use crate::identification::{Identification, Options, RECORD, Session};
use crate::run::{briefly, interruptible};

/// A Hammerstein system whose equations are summed over shards.
#[pyclass(frozen, module = "flexure._core")]
pub struct Sharded(Arc<Mutex<ShardedHammerstein>>);

impl Sharded {
    fn with<T>(&self, work: impl FnOnce(&mut ShardedHammerstein) -> T) -> T {
        work(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

#[pymethods]
impl Sharded {
    /// The structure from excerpts: pairs of input and output.
    #[new]
    fn new(py: Python<'_>, excerpts: Vec<(Column, Column)>, options: Options) -> PyResult<Sharded> {
        let HammersteinMethod::Refined(method) = options.hammerstein()? else {
            return Err(ParameterError::new_err(
                "the method is 'plain', but must be 'refined' over shards",
            ));
        };
        let found = interruptible(py, move |_| {
            let record = |(u, y): &(Column, Column)| record(u, y);
            let records: Vec<Record> = excerpts.iter().map(record).collect::<Result<_, _>>()?;
            ShardedHammerstein::new(method, &records.iter().collect::<Vec<_>>(), "u", "y")
        })?;
        found
            .map(|found| Sharded(Arc::new(Mutex::new(found))))
            .map_err(|error| of_library(&error))
    }

    /// Where the sums over all shards are wanted, as text.
    fn point(&self) -> PyResult<String> {
        serde_json::to_string(&self.with(|found| found.point())).map_err(unreadable)
    }

    /// How many samples before a shard it has to be given.
    #[getter]
    fn reach(&self) -> usize {
        self.with(|found| found.point().reach())
    }

    /// Takes the sums over all shards; whether there is another point.
    fn advance(&self, sums: &[u8]) -> PyResult<bool> {
        let sums = ShardSums::from_bytes(sums).map_err(|error| of_library(&error))?;
        self.with(|found| found.advance(sums))
            .map_err(|error| of_library(&error))
    }

    /// The number of errors that the estimate is from.
    #[getter]
    fn count(&self) -> usize {
        self.with(|found| found.count())
    }

    /// The system, judged on the end of this record.
    fn identification(
        &self,
        py: Python<'_>,
        u: Column,
        y: Column,
        sample_time: Option<f64>,
        options: Options,
    ) -> PyResult<Identification> {
        if sample_time.is_some_and(|h| !(h > 0.0 && h.is_finite())) {
            return Err(ParameterError::new_err("dt must be positive and finite, in s"));
        }
        let task = options.task()?;
        let found = Arc::clone(&self.0);
        let session = interruptible(py, move |_| {
            let file = RecordFile::in_memory(record(&u, &y)?, RECORD);
            let records = [&file.record];
            let request = Request::new(&records, &["u"], "y", task.options.clone());
            let result = found
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .identification(&request)?;
            let identified = task.identified(&file, &request, sample_time, result)?;
            Ok(Session { file, identified })
        })?;
        session
            .map(Identification::of)
            .map_err(|error: anyhow::Error| of_any(&error))
    }
}

/// The sums over a shard at a point: `before` of its samples, which begin at sample `first` of a record of `length` ones, are not added.
#[pyfunction]
pub fn shard_sums<'py>(
    py: Python<'py>,
    point: &str,
    u: Column,
    y: Column,
    first: usize,
    before: usize,
    length: usize,
) -> PyResult<Bound<'py, PyBytes>> {
    let point: ShardPoint = serde_json::from_str(point).map_err(unreadable)?;
    let sums = interruptible(py, move |_| point.sums(u.samples(), y.samples(), first, before, length))?;
    let sums = sums.map_err(|error| of_library(&error))?;
    Ok(PyBytes::new(py, &sums.to_bytes()))
}

/// The sums of several shards together, in their order.
#[pyfunction]
pub fn merged_sums<'py>(py: Python<'py>, parts: Vec<Vec<u8>>) -> PyResult<Bound<'py, PyBytes>> {
    let [first, others @ ..] = parts.as_slice() else {
        return Err(DataError::new_err("there are no sums to merge"));
    };
    let merged = briefly(py, || {
        let mut merged = ShardSums::from_bytes(first)?;
        for other in others {
            merged.merge(&ShardSums::from_bytes(other)?)?;
        }
        Ok(merged.to_bytes())
    })?;
    Ok(PyBytes::new(py, &merged.map_err(|error| of_library(&error))?))
}

fn record(u: &Column, y: &Column) -> flexure::Result<Record> {
    Record::new([("u", u.samples().to_vec()), ("y", y.samples().to_vec())])
}

fn unreadable(error: serde_json::Error) -> PyErr {
    DataError::new_err(format!("this is no point of partial sums: {error}"))
}
