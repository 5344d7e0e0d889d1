//! Static nonlinearities by name.

use std::sync::Arc;

use flexure::nonlinearity::{NamedEstimator, Tuning};
use flexure_workbench::regression::{BandOptions, Regression as Fit, RegressionData};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{Column, array, slices};
use crate::errors::of_library;
use crate::names::{argument, choice, estimator, kernel as named_kernel, rule as named_rule};
use crate::run::{briefly, interruptible};

/// Up to this many values are computed without a separate thread.
const BRIEF: usize = 20_000;

/// A fitted regression of y on the columns of x.
#[pyclass(frozen, module = "flexure._core")]
pub struct Regression(Arc<Fitted>);

struct Fitted {
    fit: Fit,
    columns: Columns,
}

/// The data of the fit.
struct Columns {
    x: Vec<Column>,
    y: Column,
    weights: Option<Column>,
    /// Whether rows are repeated in place of weights.
    repeated: bool,
}

impl Columns {
    fn data(&self) -> RegressionData<'_> {
        let weights = self.weights.as_ref().map(Column::samples);
        RegressionData {
            repeated: self.repeated,
            ..RegressionData::in_memory(slices(&self.x), self.y.samples(), weights)
        }
    }
}

#[pymethods]
impl Regression {
    /// Fits the estimator of this name; `parameter` None chooses it from the data by `rule`. If the parameter was `chosen` before, `rule`
    /// is how. `repeated` rows stand for weights.
    #[staticmethod]
    #[pyo3(signature = (name, x, y, weights=None, *, parameter=None, chosen=false, repeated=false, rule="loo", kernel="epanechnikov", outside="nan", seed=1))]
    #[expect(clippy::too_many_arguments, reason = "keywords on the other side")]
    fn fit(
        py: Python<'_>,
        name: &str,
        x: Vec<Column>,
        y: Column,
        weights: Option<Column>,
        parameter: Option<Vec<f64>>,
        chosen: bool,
        repeated: bool,
        rule: &str,
        kernel: &str,
        outside: &str,
        seed: u64,
    ) -> PyResult<Regression> {
        let estimator = NamedEstimator {
            name: estimator(name)?,
            tuning: match &parameter {
                Some(values) if !chosen => Tuning::Fixed(values.clone()),
                _ => Tuning::FromData(named_rule(rule)?),
            },
            kernel: named_kernel(kernel)?,
            outside: choice("outside", outside)?,
            seed,
        };
        let fitted = interruptible(py, move |_| {
            let columns = Columns {
                x,
                y,
                weights,
                repeated,
            };
            let fit = match parameter.filter(|_| chosen) {
                Some(parameter) => Fit::with_chosen(estimator, parameter, &columns.data())?,
                None => Fit::new(estimator, &columns.data())?,
            };
            Ok(Fitted { fit, columns })
        })?;
        fitted
            .map(|fitted| Regression(Arc::new(fitted)))
            .map_err(|error| of_library(&error))
    }

    /// The estimates at the points with these coordinates.
    fn predict<'py>(&self, py: Python<'py>, x: Vec<Column>) -> PyResult<Bound<'py, PyAny>> {
        let fitted = Arc::clone(&self.0);
        let values = match x.iter().map(Column::len).sum::<usize>() {
            0..BRIEF => briefly(py, || fitted.fit.fit.regression.predict(&slices(&x)))?,
            _ => interruptible(py, move |_| fitted.fit.fit.regression.predict(&slices(&x)))?,
        };
        array(py, &values.map_err(|error| of_library(&error))?)
    }

    /// The band at the points with these coordinates, as a dict; None where there is none.
    #[pyo3(signature = (x, *, level=0.95, simultaneous=false, method="auto", block=None))]
    fn band<'py>(
        &self,
        py: Python<'py>,
        x: Vec<Column>,
        level: f64,
        simultaneous: bool,
        method: &str,
        block: Option<usize>,
    ) -> PyResult<Option<Bound<'py, PyDict>>> {
        let options = BandOptions {
            level,
            simultaneous,
            method: choice("band method", method)?,
            block,
        };
        let fitted = Arc::clone(&self.0);
        let band = interruptible(py, move |interrupt| {
            let at: Vec<Vec<f64>> = x.iter().map(|column| column.samples().to_vec()).collect();
            let data = fitted.columns.data();
            fitted.fit.band(&data, &options, &at, &mut |_, _| interrupt.flow())
        })?;
        let Some(band) = band.map_err(|error| of_library(&error))? else {
            return Ok(None);
        };
        let dict = PyDict::new(py);
        dict.set_item("lower", array(py, &band.lower)?)?;
        dict.set_item("upper", array(py, &band.upper)?)?;
        dict.set_item("centre", array(py, &band.centre)?)?;
        dict.set_item("standard_error", array(py, &band.standard_error)?)?;
        dict.set_item("level", band.level)?;
        dict.set_item("method", band.method)?;
        Ok(Some(dict))
    }

    /// What to know before trusting the fit.
    fn warnings(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        let fitted = Arc::clone(&self.0);
        let warnings = interruptible(py, move |_| fitted.fit.warnings(&fitted.columns.data(), argument))?;
        warnings.map_err(|error| of_library(&error))
    }

    /// The parameter, given or chosen: one value, or one bandwidth a column.
    #[getter]
    fn parameter(&self) -> Vec<f64> {
        self.0.fit.fit.parameter.clone()
    }

    /// The mean squared leave-one-out error, where it is known.
    #[getter]
    fn left_out(&self) -> Option<f64> {
        self.0.fit.fit.left_out
    }

    /// The scores of all values that were tried, as a dict; None where the parameter was given.
    #[getter]
    fn scores<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(scores) = &self.0.fit.fit.scores else {
            return Ok(None);
        };
        let dict = PyDict::new(py);
        dict.set_item("criterion", scores.criterion)?;
        dict.set_item("parameter", array(py, &scores.parameter)?)?;
        dict.set_item("score", array(py, &scores.score)?)?;
        dict.set_item("at_edge", scores.at_edge)?;
        Ok(Some(dict))
    }
}
