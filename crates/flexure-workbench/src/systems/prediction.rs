//! What a model from a file says about a record.

use anyhow::{Result, bail};
use flexure::Block;
use flexure::nonlinearity::{Curve, Surface};
use flexure::validation::{estimate_initial_state_of_inputs, predict_ahead};
use flexure_io::{ModelFile, RecordFile};

use crate::named::Named;

/// The state in which a model starts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Start {
    /// That which fits the record's first outputs best.
    Estimate,
    /// The steady state that belongs to the mean input.
    Steady,
}

impl Start {
    /// Whether a model has states, and a record enough samples to estimate them: five a state.
    pub fn enough(block: &Block, samples: usize) -> bool {
        block.states() > 0 && samples >= 5 * block.states()
    }
}

impl Named for Start {
    const ALL: &'static [Start] = &[Start::Estimate, Start::Steady];

    fn name(self) -> &'static str {
        match self {
            Start::Estimate => "estimate",
            Start::Steady => "steady",
        }
    }

    fn description(self) -> &'static str {
        match self {
            Start::Estimate => "That which fits the record's first outputs best",
            Start::Steady => "The steady state that belongs to the mean input",
        }
    }
}

/// The free run of a model under a record's input.
pub struct FreeRun {
    /// The output.
    pub output: Vec<f64>,
    /// The samples that the initial state was estimated from; `None` if it is the steady one.
    pub estimated_from: Option<usize>,
}

impl FreeRun {
    /// From the steady state, or from the one that fits `measured` best.
    ///
    /// # Errors
    /// Those of `predict`, and of the estimation.
    pub fn new(block: &Block, file: &RecordFile, inputs: &[&str], measured: Option<&[f64]>) -> Result<Self> {
        let output = predict(block, file, inputs)?;
        let Some(measured) = measured else {
            return Ok(FreeRun {
                output,
                estimated_from: None,
            });
        };
        let u = columns(file, inputs)?;
        let state = estimate_initial_state_of_inputs(block, &u, measured).map_err(|error| file.locate(error))?;
        Ok(FreeRun {
            output: state.simulate_inputs(block, &u),
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
    pub fn description(&self) -> String {
        match self.estimated_from {
            Some(samples) => format!("from the state estimated from the first {samples} outputs"),
            None => "from the steady state that belongs to the mean input".to_owned(),
        }
    }
}

/// A prediction some samples ahead, and how it came about.
pub struct Ahead {
    /// The predicted output.
    pub output: Vec<f64>,
    /// Whether the model's noise model had a say.
    pub noise: bool,
    description: String,
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
            description: format!("predicted {horizon} {samples} ahead, {why}"),
        })
    }

    /// How it was made, for reading.
    pub fn description(&self) -> &str {
        &self.description
    }
}

/// The samples of all inputs.
///
/// # Errors
/// Those of [`RecordFile::finite`].
pub fn columns<'a>(file: &'a RecordFile, inputs: &[&str]) -> Result<Vec<&'a [f64]>> {
    inputs.iter().map(|name| Ok(file.finite(name)?)).collect()
}

/// The free-run output of a model under columns of a record.
///
/// # Errors
/// Those of [`RecordFile::finite`]; names the first sample for which the model has no finite output.
pub fn predict(block: &Block, file: &RecordFile, inputs: &[&str]) -> Result<Vec<f64>> {
    let u = columns(file, inputs)?;
    let y = block.simulate_inputs(&u)?;
    let Some(first) = y.iter().position(|v| !v.is_finite()) else {
        return Ok(y);
    };
    // A linear part starts from its input's mean, so that one unknown value spoils the output from the start.
    let mut unknown = None;
    entered(block, &u, &mut |entry| {
        let Entry::Curve {
            curve,
            into,
            input,
            direct,
        } = entry
        else {
            return;
        };
        let Some(sample) = into.iter().position(|&v| curve.value(v).is_nan()) else {
            return;
        };
        let behind = if direct { "" } else { " behind the first linear part" };
        let (x, name) = (curve.x(), inputs[input]);
        let problem = format!(
            "column '{name}'{behind} is {} at sample {sample}, but the model's nonlinearity is known only from {} to {}; cut such \
             samples off, or identify the model from a record with a wider range",
            into[sample],
            x[0],
            x[x.len() - 1]
        );
        unknown.get_or_insert((sample, problem));
    });
    let (sample, problem) = unknown.unwrap_or_else(|| {
        let names: Vec<String> = inputs.iter().map(|name| format!("column '{name}'")).collect();
        let problem = format!(
            "the model's output is {} at sample {first}; check that {} is in the unit in which the model was identified",
            y[first],
            names.join(" and ")
        );
        (first, problem)
    });
    let line = file.line(sample).map_or(String::new(), |line| format!(", line {line}"));
    bail!("{}{line}: {problem}", file.path.display());
}

/// A nonlinearity that comes first in a model, and what enters it.
enum Entry<'a> {
    /// A curve; `input` is the index of what enters it, by itself or behind a linear part.
    Curve {
        curve: &'a Curve,
        into: &'a [f64],
        input: usize,
        direct: bool,
    },
    /// A surface, which all inputs enter.
    Surface(&'a Surface),
}

/// Visits the first nonlinearity of every input: of the first branch, where there are several.
fn entered(block: &Block, inputs: &[&[f64]], visit: &mut impl FnMut(Entry<'_>)) {
    fn of_one(block: &Block, into: &[f64], input: usize, direct: bool, visit: &mut impl FnMut(Entry<'_>)) {
        match block {
            Block::Static(curve) => visit(Entry::Curve {
                curve,
                into,
                input,
                direct,
            }),
            Block::Series(blocks) => match blocks.as_slice() {
                [Block::Linear(front), next @ Block::Static(_), ..] => {
                    of_one(next, &front.simulate_from_mean(into), input, false, visit);
                }
                [first, ..] => of_one(first, into, input, direct, visit),
                [] => {}
            },
            Block::Parallel(blocks) => {
                if let Some(first) = blocks.first() {
                    of_one(first, into, input, direct, visit);
                }
            }
            Block::Linear(_)
            | Block::Offset(_)
            | Block::Inputs(_)
            | Block::Surface(_)
            | Block::Narx(_)
            | Block::Volterra(_) => {}
        }
    }
    match block {
        Block::Inputs(blocks) => {
            let each = blocks.iter().zip(inputs).enumerate();
            each.for_each(|(i, (b, u))| of_one(b, u, i, true, visit));
        }
        Block::Surface(surface) => visit(Entry::Surface(surface)),
        Block::Series(blocks) if block.inputs() > 1 => {
            if let Some(first) = blocks.first() {
                entered(first, inputs, visit);
            }
        }
        _ => of_one(block, inputs.first().copied().unwrap_or_default(), 0, true, visit),
    }
}

/// What of the inputs lies outside the abscissas of the first nonlinearity.
pub struct Outside {
    /// How many samples.
    pub samples: usize,
    /// Whether the nonlinearity has the value of the nearest end at all of them.
    held: bool,
    /// Whether the input itself enters the nonlinearity.
    direct: bool,
}

impl Outside {
    /// Looks through the inputs.
    pub fn new(block: &Block, inputs: &[&[f64]]) -> Self {
        let mut found = Outside {
            samples: 0,
            held: true,
            direct: true,
        };
        entered(block, inputs, &mut |entry| match entry {
            Entry::Curve {
                curve, into, direct, ..
            } => found.look(curve, into, direct),
            Entry::Surface(surface) => {
                let samples = inputs.first().map_or(0, |u| u.len());
                let at = |n: usize| inputs.iter().map(|u| u[n]).collect::<Vec<f64>>();
                found.samples += (0..samples).filter(|n| !surface.covers(&at(*n))).count();
            }
        });
        found
    }

    /// Looks through what enters a curve.
    fn look(&mut self, curve: &Curve, into: &[f64], direct: bool) {
        self.direct &= direct;
        let (x, last) = (curve.x(), curve.x().len() - 1);
        for &v in into.iter().filter(|&&v| !curve.covers(v)) {
            let end = if v < x[0] { 0 } else { last };
            self.samples += 1;
            self.held &= curve.value(v) == curve.y()[end];
        }
    }

    /// What the user should know about it.
    pub fn warning(&self) -> Option<String> {
        let there = if self.held {
            "held at its end value"
        } else {
            "continued straight"
        };
        let which = match (self.direct, self.samples) {
            (true, 1) => "input sample lies",
            (true, _) => "input samples lie",
            (false, 1) => "sample behind the first linear part lies",
            (false, _) => "samples behind the first linear part lie",
        };
        (self.samples > 0).then(|| {
            format!(
                "warning: {} {which} outside the range in which the nonlinearity was identified; there it is {there}",
                self.samples
            )
        })
    }
}
