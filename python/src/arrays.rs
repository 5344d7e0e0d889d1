//! NumPy arrays as slices, without copies, and back.

use flexure::Record;
use pyo3::buffer::PyBuffer;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyByteArray, PyDict};

/// Bytes of a sample.
const SIZE: usize = size_of::<f64>();

/// A contiguous array of `f64` that a worker may read without the interpreter's lock.
///
/// The array is kept alive and in its place (an exported buffer cannot be resized), not copied. If the array is changed while a computation
/// runs, the results mix old and new values, as with any library that releases the lock.
pub struct Column(PyBuffer<f64>);

impl Column {
    /// The samples.
    pub fn samples(&self) -> &[f64] {
        match self.0.as_slice_ptr() {
            // SAFETY: a contiguous buffer of aligned `f64`, which is not freed before it is released.
            Some(samples) => unsafe { samples.as_ref() },
            None => &[],
        }
    }

    /// The number of samples.
    pub fn len(&self) -> usize {
        self.0.item_count()
    }
}

impl<'a, 'py> FromPyObject<'a, 'py> for Column {
    type Error = PyErr;

    /// Takes a one-dimensional, contiguous array of `f64`; the Python side makes one of whatever it was given.
    fn extract(object: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        let buffer = PyBuffer::<f64>::get(&object).ok();
        let fits = |b: &PyBuffer<f64>| b.dimensions() == 1 && b.is_c_contiguous();
        (buffer.filter(fits).map(Column))
            .ok_or_else(|| PyTypeError::new_err("expected a one-dimensional, contiguous array of float64"))
    }
}

/// Columns as slices.
pub fn slices(columns: &[Column]) -> Vec<&[f64]> {
    columns.iter().map(Column::samples).collect()
}

/// Values as a new array: `numpy.frombuffer` of a `bytearray`.
pub fn array<'py>(py: Python<'py>, values: &[f64]) -> PyResult<Bound<'py, PyAny>> {
    let bytes = PyByteArray::new_with(py, SIZE * values.len(), |bytes| {
        for (place, value) in bytes.chunks_exact_mut(SIZE).zip(values) {
            place.copy_from_slice(&value.to_ne_bytes());
        }
        Ok(())
    })?;
    py.import("numpy")?.call_method1("frombuffer", (bytes,))
}

/// A record's columns by name.
pub fn columns<'py>(py: Python<'py>, record: &Record) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for (name, samples) in record.columns() {
        dict.set_item(name, array(py, samples)?)?;
    }
    Ok(dict)
}
