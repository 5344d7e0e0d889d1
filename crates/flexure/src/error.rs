//! Everything that can go wrong, in groups, with the facts in the fields.
//!
//! | group | what it is about |
//! |---|---|
//! | [`DataError`] | samples, columns and records that cannot be used |
//! | [`ParameterError`] | a parameter that is out of range, or that these data do not allow |
//! | [`ArmError`] | an arm that is not physical, or a motion that it cannot make |
//! | [`SimulationError`] | a simulation that cannot be continued |
//! | [`Stopped`] | a computation that was asked to stop |
//!
//! Messages say what is wrong, where, and what to do about it; samples are counted from 0.

mod arm;
mod simulation;

use crate::text::{counted, decimal, exact, list, number, short};

/// What to do about a step of time, in s, that is not positive.
fn in_order(sample: usize, step: f64) -> String {
    match step == 0.0 {
        true => "flexure prepare FILE --resample S -o prepared.csv takes the mean of samples at one instant".to_owned(),
        false => format!(
            "if the clock starts again there, the samples before and after are two records: flexure prepare FILE --cut-samples :{sample} or \
             {sample}: -o part.csv takes one of them; otherwise put the samples in order of time, one an instant"
        ),
    }
}

pub use arm::ArmError;
pub use simulation::{IntegrationFailure, SimulationError, Stopped};

/// The result of every fallible function of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// What was wrong with the data, the parameters or the computation.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The data cannot be used.
    #[error(transparent)]
    Data(#[from] DataError),
    /// A parameter cannot be used.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// An arm cannot be used.
    #[error(transparent)]
    Arm(#[from] ArmError),
    /// A simulation could not be continued.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// A computation was asked to stop.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

impl Error {
    /// A parameter is outside its valid range; see [`ParameterError::OutOfRange`].
    pub fn parameter(name: impl Into<String>, value: f64, requirement: &'static str) -> Self {
        Error::Parameter(ParameterError::OutOfRange {
            name: name.into(),
            value,
            requirement,
        })
    }

    /// There are fewer samples than `what` needs; see [`DataError::TooShort`].
    pub fn too_short(what: &'static str, need: usize, got: usize) -> Self {
        Error::Data(DataError::TooShort { what, need, got })
    }

    /// A sample is NaN or infinite; see [`DataError::NonFinite`].
    pub fn not_finite(column: impl Into<String>, sample: usize, value: f64) -> Self {
        let column = column.into();
        Error::Data(DataError::NonFinite { column, sample, value })
    }

    /// Two sequences that belong together differ in length; see [`DataError::LengthMismatch`].
    pub fn length(name: impl Into<String>, got: usize, expected: usize) -> Self {
        let name = name.into();
        Error::Data(DataError::LengthMismatch { name, got, expected })
    }

    /// The error with other names for its columns: those that `name` returns, if it returns one.
    pub fn with_columns(mut self, name: impl Fn(&str) -> Option<String>) -> Self {
        if let Error::Data(
            DataError::NonFinite { column, .. }
            | DataError::Constant { column, .. }
            | DataError::ConstantPart { column, .. }
            | DataError::Outlier { column, .. }
            | DataError::Unit { column, .. }
            | DataError::TooLarge { column, .. }
            | DataError::WrappedAngle { column, .. }
            | DataError::LengthMismatch { name: column, .. },
        ) = &mut self
            && let Some(other) = name(column)
        {
            *column = other;
        }
        self
    }

    /// A signal that must vary does not; see [`DataError::Constant`].
    pub fn constant(column: impl Into<String>, value: f64) -> Self {
        let column = column.into();
        Error::Data(DataError::Constant { column, value })
    }
}

/// What was wrong with the data.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DataError {
    /// A record has no column of this name.
    #[error("no column '{name}'; the columns are: {}", list(.available))]
    MissingColumn {
        /// The name that was asked for.
        name: String,
        /// The names that exist, in order.
        available: Vec<String>,
    },
    /// Two columns of a record have the same name.
    #[error("two columns are named '{name}'; column names must differ")]
    DuplicateColumn {
        /// The name that occurs twice.
        name: String,
    },
    /// Two sequences that belong together differ in length.
    #[error("'{name}' has {got} samples where {expected} were expected; all columns must have the same length")]
    LengthMismatch {
        /// The offending sequence.
        name: String,
        /// Its length.
        got: usize,
        /// The length of the others.
        expected: usize,
    },
    /// A sample is NaN or infinite.
    #[error("column '{column}' is {} at sample {sample}; remove or repair that sample", exact(*.value))]
    NonFinite {
        /// The column's name.
        column: String,
        /// The sample's index, from 0.
        sample: usize,
        /// NaN or an infinity.
        value: f64,
    },
    /// A signal that must vary does not.
    #[error("column '{column}' is constant ({}); nothing can be identified from it", exact(*.value))]
    Constant {
        /// The column's name.
        column: String,
        /// Its one value.
        value: f64,
    },
    /// A signal that must vary does not in a part of the record.
    #[error(
        "column '{column}' is constant ({}) at samples {first} to {last}, which are {purpose}; cut them off, change the fresh share, or leave the column out if it is one of several inputs",
        exact(*.value)
    )]
    ConstantPart {
        /// The column's name.
        column: String,
        /// Its value there.
        value: f64,
        /// The part's first sample.
        first: usize,
        /// The part's last sample.
        last: usize,
        /// What the part is needed for.
        purpose: &'static str,
    },
    /// One sample is so large that the signal hardly varies in comparison.
    #[error(
        "column '{column}' is {} at sample {sample}, so large that all others are constant in comparison; remove or repair that sample",
        exact(*.value)
    )]
    Outlier {
        /// The column's name.
        column: String,
        /// The sample's index, from 0.
        sample: usize,
        /// Its value.
        value: f64,
    },
    /// There are fewer samples than the computation needs.
    #[error("{what} needs at least {need} samples, but there are {got}")]
    TooShort {
        /// What was to be computed.
        what: &'static str,
        /// The smallest number of samples that will do.
        need: usize,
        /// The number there is.
        got: usize,
    },
    /// The values of a signal are so large or so small that their squares overflow or vanish.
    #[error(
        "the values of column '{column}' reach {largest:e} in size; choose a unit in which that is between 1e-100 and 1e100"
    )]
    Unit {
        /// The column's name.
        column: String,
        /// The largest absolute value.
        largest: f64,
    },
    /// A sample, among others of usual size, is too large for any computation.
    #[error(
        "column '{column}' is {value:e} at sample {sample}, too large to compute with; remove or repair that sample"
    )]
    TooLarge {
        /// The column's name.
        column: String,
        /// The sample's index.
        sample: usize,
        /// Its value.
        value: f64,
    },
    /// The time column's steps differ.
    #[error(
        "the sample times are not uniform: the step to sample {sample} is {} s, but the typical step is {} s; --resample {} brings the record to uniform steps",
        decimal(*.step), decimal(*.expected), decimal(*.expected)
    )]
    NonUniformTime {
        /// The sample at the end of the odd step, from 0.
        sample: usize,
        /// The odd step, s.
        step: f64,
        /// The median step, s.
        expected: f64,
    },
    /// The time column repeats an instant or goes back.
    #[error(
        "the sample times do not increase: the step to sample {sample} is {step} s; {}", in_order(*.sample, *.step)
    )]
    TimeNotIncreasing {
        /// The sample at the end of the step, from 0.
        sample: usize,
        /// The step, s, not positive.
        step: f64,
    },
    /// The impulse response is known at fewer lags than a linear part of the given order needs.
    #[error(
        "the impulse response can be estimated at {lags} lags from the delay of {delay} on, but the given order needs {need}; \
         give a lower order or a longer record"
    )]
    ResponseTooShort {
        /// The delay, samples.
        delay: usize,
        /// The lags from there on.
        lags: usize,
        /// The lags that the order needs.
        need: usize,
    },
    /// The points of a regression lie at fewer different places than it needs.
    #[error(
        "{what} in {} needs points of positive weight at {need} or more different places, but there \
         are {got}; take more points, fewer columns or a local constant fit with a given bandwidth",
        counted(*.columns, "column")
    )]
    TooFewDistinct {
        /// The kind of regression.
        what: &'static str,
        /// The number of columns of x.
        columns: usize,
        /// The smallest number of distinct points that will do.
        need: usize,
        /// The number there is.
        got: usize,
    },
    /// Partial sums that do not belong to one computation.
    #[error("these partial sums cannot be merged: their {what} differ; start all parts with the same ones")]
    Unmergeable {
        /// What differs.
        what: &'static str,
    },
    /// Excerpts of a record from which no system in shards can start.
    #[error("the excerpts show no Hammerstein system that can be refined; take more samples for them")]
    NotRefined,
    /// A system whose record cannot be cut into shards.
    #[error(
        "the system's response lasts for more than {most} samples, too many for a record in parts; resample the record more slowly, or \
         identify it in memory"
    )]
    TooSlowForParts {
        /// The most samples that a part is given of those before it.
        most: usize,
    },
    /// Bytes from which partial sums cannot be read.
    #[error("these are no partial sums: {reason}; make them again, with this version")]
    NotSums {
        /// What is wrong with them.
        reason: &'static str,
    },
    /// An angle jumps by a whole turn.
    #[error(
        "column '{column}' jumps by {jump} at sample {sample}, a whole turn{}: the encoder wraps{}; unwrap the angle first (add a \
         turn from that sample on){}",
        if jump.abs() > 100.0 { " in degrees" } else { "" },
        if jump.abs() > 100.0 { "" } else { " at 2 pi" },
        if jump.abs() > 100.0 { ", and give it in rad" } else { "" }
    )]
    WrappedAngle {
        /// The column's name.
        column: String,
        /// The sample after the jump, from 0.
        sample: usize,
        /// The jump, rad or degrees.
        jump: f64,
    },
    /// A record is sampled too slowly for the motion in it.
    #[error(
        "a sample time of {} s is too long: the motion still has power at {} Hz, and what happens between the samples is lost; sample \
         faster, or use torques that change more slowly, such as those of flexure excite", decimal(*step), short(*band)
    )]
    SampledTooSlowly {
        /// The sample time, s.
        step: f64,
        /// The highest frequency at which the motion was seen, Hz.
        band: f64,
    },
    /// A motion does not determine what is to be identified.
    #[error(
        "the motion does not determine {what}: it is too slow, too regular or too short; move at several speeds in both directions"
    )]
    TooLittleMotion {
        /// What it should determine.
        what: &'static str,
    },
    /// A joint of an arm with flexible joints shows no deflection.
    #[error(
        "no flexibility is seen at joint {joint}: of the difference between motor and link the torque explains {} rad \
         (root mean square), less than three times the encoders' noise of {} rad, which determines no stiffness curve; load it more, use \
         an encoder of higher resolution, or lock this joint and identify the other one by itself",
        number(*.deflection),
        number(*.noise)
    )]
    RigidJointInArm {
        /// 1, the shoulder, or 2, the elbow.
        joint: usize,
        /// The root mean square of the deflection that the torque explains, rad.
        deflection: f64,
        /// The root mean square of the encoders' noise in a sample of the deflection, rad.
        noise: f64,
    },
}

impl DataError {
    /// The sample at fault, from 0, if there is one.
    pub fn sample(&self) -> Option<usize> {
        match self {
            DataError::NonFinite { sample, .. }
            | DataError::Outlier { sample, .. }
            | DataError::TooLarge { sample, .. }
            | DataError::NonUniformTime { sample, .. }
            | DataError::TimeNotIncreasing { sample, .. }
            | DataError::WrappedAngle { sample, .. } => Some(*sample),
            _ => None,
        }
    }

    /// Whether there are fewer samples, or fewer different ones, than the computation needs.
    pub fn is_too_short(&self) -> bool {
        matches!(
            self,
            DataError::TooShort { .. } | DataError::ResponseTooShort { .. } | DataError::TooFewDistinct { .. }
        )
    }
}

/// What was wrong with a parameter.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ParameterError {
    /// A parameter is outside its valid range.
    #[error("{name} is {}, but must be {requirement}", exact(*.value))]
    OutOfRange {
        /// The parameter's name.
        name: String,
        /// The value that was given.
        value: f64,
        /// The valid range, for example "positive and finite".
        requirement: &'static str,
    },
    /// An estimator is given more or fewer columns than it can take.
    #[error("{what} takes {expected}, but {got} were given")]
    ColumnCount {
        /// The estimator that takes them.
        what: &'static str,
        /// The number of columns given.
        got: usize,
        /// The number it takes, for example "1 column".
        expected: String,
    },
    /// A parameter asks for more than the data support.
    #[error(
        "{parameter} is {value}, but these data allow at most {most}: {reason}; choose it smaller or take more samples"
    )]
    BeyondData {
        /// The parameter's name.
        parameter: &'static str,
        /// The value that was given.
        value: usize,
        /// The largest that these data allow.
        most: usize,
        /// What limits it.
        reason: &'static str,
    },
    /// A rule cannot choose an estimator's parameter.
    #[error(
        "the rule '{rule}' cannot choose the parameter of a {estimator} in {}; {instead}",
        counted(*.columns, "column")
    )]
    RuleUnsuited {
        /// The rule's name.
        rule: &'static str,
        /// What the estimator is.
        estimator: &'static str,
        /// The number of columns of x.
        columns: usize,
        /// What to do.
        instead: &'static str,
    },
}
