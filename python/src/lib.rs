//! Flexure for Python: conversions, and nothing else.

mod arm;
mod arrays;
mod chain;
mod compare;
mod control;
mod errors;
mod flexible_arm;
mod identification;
mod joint;
mod model;
mod names;
mod prepare;
mod record;
mod regression;
mod run;
mod runs;
mod sharded;
mod streamed;

use pyo3::prelude::*;

/// The compiled part of Flexure: conversions around the Rust library.
#[pymodule]
mod _core {
    use flexure::Record;
    use pyo3::prelude::*;

    use crate::arrays::Column;
    use crate::errors::of_library;

    #[pymodule_export]
    use crate::arm::Arm;
    #[pymodule_export]
    use crate::chain::Chain;
    #[pymodule_export]
    use crate::compare::PyCompared;
    #[pymodule_export]
    use crate::control::{Controlled, Cusum, RecursiveFriction, RecursiveHammerstein, Scenario};
    #[pymodule_export]
    use crate::errors::{DataError, FileError, FlexureError, ParameterError, SimulationError, TooShortError};
    #[pymodule_export]
    use crate::flexible_arm::FlexibleArm;
    #[pymodule_export]
    use crate::identification::{Identification, StructureRow, structures};
    #[pymodule_export]
    use crate::joint::{Axes, Joint, identify_axes, identify_joint};
    #[pymodule_export]
    use crate::model::PyModel;
    #[pymodule_export]
    use crate::prepare::prepare;
    #[pymodule_export]
    use crate::record::read_record;
    #[pymodule_export]
    use crate::regression::Regression;
    #[pymodule_export]
    use crate::sharded::{Sharded, merged_sums, shard_sums};
    #[pymodule_export]
    use crate::streamed::{Streamed, Sums};

    /// The sample time of uniform, increasing instants.
    #[pyfunction]
    fn sample_time(times: Column) -> PyResult<f64> {
        let step = Record::new([("t", times.samples().to_vec())]).and_then(|record| record.sample_time("t"));
        step.map_err(|error| of_library(&error))
    }

    /// The version.
    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
