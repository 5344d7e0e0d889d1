//! What a model from a file says about a record.

use std::borrow::Cow;

use anyhow::{Result, bail};
use clap::ValueEnum;
use flexure::Block;
use flexure::nonlinearity::Curve;
use flexure::validation::{estimate_initial_state, predict_ahead};
use flexure_io::{ModelFile, RecordFile};

/// The state in which a model starts.
#[derive(Debug, Clone, Copy, PartialEq, ValueEnum)]
pub enum Start {
    /// That which fits the record's first outputs best.
    Estimate,
    /// The steady state that belongs to the mean input.
    Steady,
}

impl Start {
    /// Whether a record has enough samples to estimate the states of a model: five a state.
    pub fn enough(block: &Block, samples: usize) -> bool {
        samples >= 5 * block.states()
    }

    /// Its name on the command line and in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Start::Estimate => "estimate",
            Start::Steady => "steady",
        }
    }
}

/// The free run of a model under a record's input.
pub struct FreeRun {
    pub output: Vec<f64>,
    /// The samples that the initial state was estimated from; `None` if it is the steady one.
    pub estimated_from: Option<usize>,
}

impl FreeRun {
    /// From the steady state, or from the one that fits `measured` best.
    ///
    /// # Errors
    /// Those of [`predict`], and of the estimation.
    pub fn new(block: &Block, file: &RecordFile, input: &str, measured: Option<&[f64]>) -> Result<Self> {
        let output = predict(block, file, input)?;
        let Some(measured) = measured else {
            return Ok(FreeRun {
                output,
                estimated_from: None,
            });
        };
        let u = file.finite(input)?;
        let state = estimate_initial_state(block, u, measured).map_err(|error| file.locate(error))?;
        Ok(FreeRun {
            output: state.simulate(block, u),
            estimated_from: Some(state.samples()),
        })
    }

    /// The start's name.
    pub fn start(&self) -> Start {
        match self.estimated_from {
            Some(_) => Start::Estimate,
            None => Start::Steady,
        }
    }

    /// Where it starts, for reading.
    pub fn words(&self) -> String {
        match self.estimated_from {
            Some(samples) => format!("from the state estimated from the first {samples} outputs"),
            None => "from the steady state that belongs to the mean input".to_owned(),
        }
    }
}

/// A prediction some samples ahead, and how it came about.
pub struct Ahead {
    pub output: Vec<f64>,
    /// Whether the model's noise model had a say.
    pub noise: bool,
    words: String,
}

impl Ahead {
    /// Adds to a free run what the model's noise model expects of the error last seen `horizon` samples ago.
    ///
    /// # Errors
    /// Those of [`predict_ahead`].
    pub fn new(model: &ModelFile, run: &FreeRun, measured: &[f64], horizon: usize) -> Result<Self> {
        let noise = model.noise_model.as_deref().unwrap_or_default();
        let samples = if horizon == 1 { "sample" } else { "samples" };
        let (coloured, why) = match (&model.noise_model, noise.len() > 1) {
            (Some(_), true) => (
                true,
                format!("by the noise model, an autoregression of order {}", noise.len() - 1),
            ),
            (Some(_), false) => (false, "the error was found white: the same as the free run".to_owned()),
            (None, _) => (
                false,
                "the model has no noise model: the same as the free run".to_owned(),
            ),
        };
        Ok(Ahead {
            output: predict_ahead(&run.output, measured, noise, horizon)?,
            noise: coloured,
            words: format!("predicted {horizon} {samples} ahead, {why}"),
        })
    }

    /// How it was made, for reading.
    pub fn words(&self) -> &str {
        &self.words
    }
}

/// The free-run output of a model under a column of a record.
///
/// # Errors
/// Those of [`RecordFile::finite`]; names the first sample for which the model has no finite output.
pub fn predict(block: &Block, file: &RecordFile, input: &str) -> Result<Vec<f64>> {
    let u = file.finite(input)?;
    let y = block.simulate(u);
    let Some(first) = y.iter().position(|v| !v.is_finite()) else {
        return Ok(y);
    };
    // A linear part starts from its input's mean, so that one unknown value spoils the output from the start.
    let unknown = entered(block, u).and_then(|(curve, into)| {
        let sample = into.iter().position(|&v| curve.value(v).is_nan())?;
        let what = match &into {
            Cow::Borrowed(_) => format!("column '{input}'"),
            Cow::Owned(_) => format!("column '{input}' behind the first linear part"),
        };
        Some((curve.x(), sample, what, into[sample]))
    });
    let (sample, problem) = match unknown {
        Some((x, sample, what, value)) => (
            sample,
            format!(
                "{what} is {value} at sample {sample}, but the model's nonlinearity is known only from {} to {}; cut such \
                 samples off, or identify the model from a record with a wider range",
                x[0],
                x[x.len() - 1]
            ),
        ),
        None => (
            first,
            format!(
                "the model's output is {} at sample {first}; check that column '{input}' is in the unit in which the model was identified",
                y[first]
            ),
        ),
    };
    let line = file.line(sample).map_or(String::new(), |line| format!(", line {line}"));
    bail!("{}{line}: {problem}", file.path.display());
}

/// The first nonlinearity of a cascade, and what enters it: the input, or what the linear part before it makes of that.
fn entered<'a>(block: &'a Block, input: &'a [f64]) -> Option<(&'a Curve, Cow<'a, [f64]>)> {
    let blocks = match block {
        Block::Static(curve) => return Some((curve, Cow::Borrowed(input))),
        Block::Series(blocks) => blocks,
        Block::Parallel(blocks) => return blocks.first().and_then(|first| entered(first, input)),
        Block::Linear(_) => return None,
    };
    match blocks.as_slice() {
        [Block::Linear(front), Block::Static(curve), ..] => Some((curve, Cow::Owned(front.simulate_from_mean(input)))),
        [first, ..] => entered(first, input),
        [] => None,
    }
}

/// What of an input lies outside the abscissas of the first nonlinearity.
pub struct Outside {
    /// How many samples.
    pub samples: usize,
    /// Whether the nonlinearity has the value of the nearest end at all of them.
    held: bool,
    /// Whether the input itself enters the nonlinearity.
    direct: bool,
}

impl Outside {
    /// Looks through `input`.
    pub fn new(block: &Block, input: &[f64]) -> Self {
        let mut found = Outside {
            samples: 0,
            held: true,
            direct: true,
        };
        let Some((curve, into)) = entered(block, input) else {
            return found;
        };
        found.direct = matches!(into, Cow::Borrowed(_));
        let (x, last) = (curve.x(), curve.x().len() - 1);
        // A line adds what a linear part cannot: an offset.
        for &v in into.iter().filter(|&&v| !curve.covers(v) && !curve.is_line()) {
            let end = if v < x[0] { 0 } else { last };
            found.samples += 1;
            found.held &= curve.value(v) == curve.y()[end];
        }
        found
    }

    /// What the user should know about it.
    pub fn warning(&self) -> Option<String> {
        let there = if self.held {
            "held at its end value"
        } else {
            "continued straight"
        };
        let which = match self.direct {
            true => "input samples",
            false => "samples behind the first linear part",
        };
        (self.samples > 0).then(|| {
            format!(
                "warning: {} {which} lie outside the range in which the nonlinearity was identified; there it is {there}",
                self.samples
            )
        })
    }
}
