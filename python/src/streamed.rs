//! Kernel regression of records of any length, from sums that are merged.

use std::sync::{Arc, Mutex, PoisonError};

use flexure::nonlinearity::{Degree, Regression as _, StreamedFit, StreamedRegression};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::arrays::{Column, array};
use crate::errors::of_library;
use crate::names::kernel as named_kernel;
use crate::run::interruptible;

/// Sums over rows.
#[pyclass(frozen, module = "flexure._core")]
pub struct Sums(Arc<Mutex<StreamedRegression>>);

impl Sums {
    fn new(sums: StreamedRegression) -> Self {
        Sums(Arc::new(Mutex::new(sums)))
    }

    /// The sums as they are now.
    fn now(&self) -> StreamedRegression {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

#[pymethods]
impl Sums {
    /// Empty sums.
    #[staticmethod]
    fn empty(most_bins: usize, block: u64) -> PyResult<Sums> {
        let sums = StreamedRegression::new(most_bins, block);
        sums.map(Sums::new).map_err(|error| of_library(&error))
    }

    /// The sums that `to_bytes` has written.
    #[staticmethod]
    fn from_bytes(bytes: &[u8]) -> PyResult<Sums> {
        let sums = StreamedRegression::from_bytes(bytes);
        sums.map(Sums::new).map_err(|error| of_library(&error))
    }

    /// The sums as bytes.
    fn to_bytes<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &self.now().to_bytes())
    }

    /// Takes in rows; `first_row` is the place of the first one in the whole record.
    fn push(&self, py: Python<'_>, first_row: u64, x: Column, y: Column) -> PyResult<()> {
        let sums = Arc::clone(&self.0);
        let pushed = interruptible(py, move |_| {
            let mut sums = sums.lock().unwrap_or_else(PoisonError::into_inner);
            sums.push(first_row, x.samples(), y.samples())
        })?;
        pushed.map_err(|error| of_library(&error))
    }

    /// Takes in what the others have taken in, in this order.
    fn merge(&self, others: Vec<PyRef<'_, Sums>>) -> PyResult<()> {
        for other in others {
            // One lock at a time: sums may be merged with themselves.
            let other = other.now();
            let mut sums = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            sums.merge(&other).map_err(|error| of_library(&error))?;
        }
        Ok(())
    }

    /// The number of rows.
    #[getter]
    fn count(&self) -> u64 {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).count()
    }

    /// The regression; `bandwidth` None chooses it.
    fn fit(&self, py: Python<'_>, kernel: &str, degree: u8, bandwidth: Option<f64>) -> PyResult<Streamed> {
        let kernel = named_kernel(kernel)?;
        let degree = if degree == 0 { Degree::Constant } else { Degree::Linear };
        let sums = self.now();
        let fit = interruptible(py, move |_| sums.fit(kernel, degree, bandwidth))?;
        fit.map(|fit| Streamed(Arc::new(fit)))
            .map_err(|error| of_library(&error))
    }
}

/// A kernel regression from sums.
#[pyclass(frozen, module = "flexure._core")]
pub struct Streamed(Arc<StreamedFit>);

#[pymethods]
impl Streamed {
    /// The estimates at points.
    fn predict<'py>(&self, py: Python<'py>, x: Column) -> PyResult<Bound<'py, PyAny>> {
        let fit = Arc::clone(&self.0);
        let values = interruptible(py, move |_| fit.predict(&[x.samples()]))?;
        array(py, &values.map_err(|error| of_library(&error))?)
    }

    /// The band at points, as a dict.
    fn band<'py>(&self, py: Python<'py>, x: Column, level: f64) -> PyResult<Bound<'py, PyDict>> {
        let fit = Arc::clone(&self.0);
        let band = interruptible(py, move |_| fit.band(x.samples(), level))?;
        let band = band.map_err(|error| of_library(&error))?;
        let dict = PyDict::new(py);
        dict.set_item("lower", array(py, &band.lower)?)?;
        dict.set_item("upper", array(py, &band.upper)?)?;
        dict.set_item("centre", array(py, &band.centre)?)?;
        dict.set_item("standard_error", array(py, &band.standard_error)?)?;
        dict.set_item("level", level)?;
        dict.set_item("method", "scatter of folds of blocks, less the bias")?;
        Ok(dict)
    }

    /// The bandwidth.
    #[getter]
    fn bandwidth(&self) -> f64 {
        self.0.bandwidth()
    }

    /// The width of the bins.
    #[getter]
    fn bin_width(&self) -> f64 {
        self.0.bin_width()
    }

    /// The range of x.
    #[getter]
    fn range(&self) -> (f64, f64) {
        self.0.range()
    }

    /// The scores of all bandwidths that were tried, as a dict; None where it was given.
    #[getter]
    fn scores<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(search) = self.0.search() else {
            return Ok(None);
        };
        let column = |of: fn(&flexure::selection::Score) -> f64| search.curve.iter().map(of).collect::<Vec<f64>>();
        let dict = PyDict::new(py);
        dict.set_item("criterion", "error of folds of blocks left out")?;
        dict.set_item("parameter", array(py, &column(|s| s.bandwidth))?)?;
        dict.set_item("score", array(py, &column(|s| s.error))?)?;
        dict.set_item("at_edge", search.at_edge)?;
        Ok(Some(dict))
    }
}
