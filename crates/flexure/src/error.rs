//! Everything that can go wrong, with the facts in the fields.
//!
//! Messages say what is wrong, where, and what to do about it; samples are counted from 0.

/// The result of every fallible function of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// What was wrong with the data, the parameters or the computation.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A record has no column of this name.
    #[error("no column '{name}'; the columns are: {}", .available.join(", "))]
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
    #[error("column '{column}' is {value} at sample {sample}; remove or repair that sample")]
    NonFinite {
        /// The column's name.
        column: String,
        /// The sample's index, from 0.
        sample: usize,
        /// NaN or an infinity.
        value: f64,
    },
    /// A signal that must vary does not.
    #[error("column '{column}' is constant ({value}); nothing can be identified from it")]
    Constant {
        /// The column's name.
        column: String,
        /// Its one value.
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
    /// The time column's steps differ.
    #[error(
        "the sample times are not uniform: the step to sample {sample} is {step} s, but the typical step is {expected} s; resample the record to a uniform time"
    )]
    NonUniformTime {
        /// The sample at the end of the odd step, from 0.
        sample: usize,
        /// The odd step, s.
        step: f64,
        /// The median step, s.
        expected: f64,
    },
    /// A parameter is outside its valid range.
    #[error("{name} is {value}, but must be {requirement}")]
    InvalidParameter {
        /// The parameter's name.
        name: String,
        /// The value that was given.
        value: f64,
        /// The valid range in words, for example "positive and finite".
        requirement: &'static str,
    },
    /// A part of an arm is not physical.
    #[error("{quantity} of {part} {number} is {value} {unit}, but must be {requirement}")]
    UnphysicalArm {
        /// "link" or "joint".
        part: &'static str,
        /// Which of the two, 1 (shoulder side) or 2 (elbow side).
        number: usize,
        /// The quantity, named as in an arm file.
        quantity: &'static str,
        /// The value that was given.
        value: f64,
        /// Its unit.
        unit: &'static str,
        /// The valid range in words.
        requirement: &'static str,
    },
    /// An arm's inertia matrix is singular or indefinite in some configuration.
    #[error(
        "the {matrix} of the arm is not positive definite at q2 = {q2} rad (its determinant is {determinant}); \
         check the links' masses, lengths and inertias{hint}"
    )]
    SingularInertia {
        /// Which matrix.
        matrix: &'static str,
        /// The elbow's angle, rad.
        q2: f64,
        /// The determinant of the 2x2 matrix left when the motors are eliminated.
        determinant: f64,
        /// A further thing to check, or nothing.
        hint: &'static str,
    },
    /// Deflections were commanded of an arm without flexible joints.
    #[error(
        "a rigid arm has no joint deflections to command; choose the linear or nonlinear model, or drive it by torque"
    )]
    RigidDeflection,
    /// A simulation could not be carried on.
    #[error("the simulation stopped at t = {time} s: {reason}")]
    Integration {
        /// The time reached, s.
        time: f64,
        /// Why it could not go on.
        reason: IntegrationFailure,
    },
    /// A computation was stopped from outside.
    #[error("stopped at t = {time} s, as asked")]
    Cancelled {
        /// The simulated time reached, s.
        time: f64,
    },
    /// A study was stopped from outside.
    #[error("stopped after {done} of {total} samples, as asked")]
    Stopped {
        /// The samples simulated so far.
        done: usize,
        /// Those of the whole study.
        total: usize,
    },
    /// A signal that must vary does not in a part of the record.
    #[error(
        "column '{column}' is constant ({value}) at samples {first} to {last}, which are {purpose}; cut them off, or change the fresh share"
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
    /// The time column repeats an instant or goes back.
    #[error(
        "the sample times do not increase: the step to sample {sample} is {step} s; put the samples in order of time, one an instant"
    )]
    TimeNotIncreasing {
        /// The sample at the end of the step, from 0.
        sample: usize,
        /// The step, s, not positive.
        step: f64,
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
    /// An estimator is given more or fewer columns than it can take.
    #[error("{what} takes {expected}, but {got} were given")]
    ColumnCount {
        /// What takes them.
        what: &'static str,
        /// The number of columns given.
        got: usize,
        /// The number it takes, in words, for example "1 column".
        expected: String,
    },
    /// A parameter asks for more than the data can tell.
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
    /// Partial sums that do not belong to one computation.
    #[error("these partial sums cannot be merged: their {what} differ; start all parts with the same ones")]
    Unmergeable {
        /// What differs.
        what: &'static str,
    },
    /// A rule cannot choose an estimator's parameter.
    #[error(
        "the rule '{rule}' cannot choose the parameter of a {estimator} in {columns} column{}; {instead}",
        if *.columns == 1 { "" } else { "s" }
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
    /// The points of a regression lie at fewer different places than it needs.
    #[error(
        "{what} in {columns} column{} needs points of positive weight at {need} or more different places, but there \
         are {got}; take more points, fewer columns or a local constant fit with a given bandwidth",
        if *.columns == 1 { "" } else { "s" }
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
    /// An identification was stopped from outside.
    #[error("stopped while {stage}, as asked")]
    IdentificationStopped {
        /// What it was doing.
        stage: &'static str,
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
        "a sample time of {step} s is too long: the motion still stands out at {band:.4} Hz, and what happens between the \
         samples is lost; sample faster, or excite more slowly"
    )]
    SampledTooSlowly {
        /// The sample time, s.
        step: f64,
        /// The highest frequency at which the motion was seen, Hz.
        band: f64,
    },
    /// A motion does not tell what is asked of it.
    #[error(
        "the motion does not tell {what}: it is too slow, too regular or too short; move at several speeds in both directions"
    )]
    TooLittleMotion {
        /// What it should tell.
        what: &'static str,
    },
    /// A joint of an arm with flexible joints shows no deflection.
    #[error(
        "no flexibility is seen at joint {joint}: of the difference between motor and link the torque explains {deflection:.2e} rad \
         (root mean square), less than three times the encoders' noise of {noise:.2e} rad, which tells no stiffness curve; load it more, measure finer, or lock this joint and identify the \
         other one by itself"
    )]
    RigidJointInArm {
        /// 1, the shoulder, or 2, the elbow.
        joint: usize,
        /// The root mean square of the deflection that the torque explains, rad.
        deflection: f64,
        /// That of the encoders' noise in a sample of the deflection, rad.
        noise: f64,
    },
    /// A computation was stopped by an [`Interrupt`](crate::Interrupt).
    #[error("stopped, as asked")]
    Interrupted,
}

/// The largest absolute value of finite samples, if squares of such values neither overflow nor vanish.
pub(crate) fn check_size(column: &str, samples: &[f64]) -> Result<f64> {
    let largest = samples.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    if largest == 0.0 || (1e-100..=1e100).contains(&largest) {
        return Ok(largest);
    }
    Err(Error::Unit {
        column: column.to_owned(),
        largest,
    })
}

/// Why an integration could not be carried on.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum IntegrationFailure {
    /// The permitted number of steps is used up.
    #[error(
        "{limit} steps were not enough{}; raise max_steps, loosen rtol and atol, or shorten the run",
        if *.stiff { " (the equations are stiff: a joint is very stiff or its friction very steep)" } else { "" }
    )]
    TooManySteps {
        /// The permitted number.
        limit: u64,
        /// Whether the step size was dictated by stability rather than by accuracy.
        stiff: bool,
    },
    /// No step is short enough for the tolerances.
    #[error(
        "a step of {step} s is still too long for the tolerances; the motion grows without bound or the input is \
         not smooth"
    )]
    StepTooSmall {
        /// The step that would have come next, s.
        step: f64,
    },
    /// The state or its derivative has overflowed.
    #[error("the motion is no longer finite; it grows without bound")]
    NotFinite,
}
