//! What a model from a file says about a record.

use std::borrow::Cow;

use anyhow::{Result, bail};
use flexure::Block;
use flexure::nonlinearity::Curve;
use flexure::text::{joined, percent, shown_path};
use flexure::validation::{estimate_initial_state_of_inputs, predict_ahead};
use flexure_io::{ModelFile, RecordFile};

use crate::named::{Named, NamedValue};
use crate::systems::columns::SystemColumns;

/// The state in which a model starts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Start {
    /// The state that fits the record's first outputs best.
    Estimate,
    /// The steady state that belongs to the input's first sample: what is predicted does not depend on later inputs.
    Steady,
}

impl Start {
    /// Whether a model has states, and a record enough samples to estimate them: five per state.
    pub fn enough(block: &Block, samples: usize) -> bool {
        block.states() > 0 && samples >= 5 * block.states()
    }
}

impl Named for Start {
    const ALL: &'static [NamedValue<Start>] = &[
        NamedValue::new(
            Start::Estimate,
            "estimate",
            "The state that fits the record's first outputs best",
        ),
        NamedValue::new(
            Start::Steady,
            "steady",
            "The steady state that belongs to the input's first sample, as exported models start",
        ),
    ];
}

/// The free run of a model under a record's input.
pub struct FreeRun {
    /// The output.
    pub output: Vec<f64>,
    /// The samples that the initial state was estimated from; `None` if it is the steady one.
    pub estimated_from: Option<usize>,
}

impl FreeRun {
    /// The run from this start; by default the state is estimated from the measured output where there are enough samples.
    ///
    /// # Errors
    /// As [`simulate`].
    pub fn new(
        block: &Block,
        file: &RecordFile,
        inputs: &[&str],
        measured: Option<&[f64]>,
        start: Option<Start>,
    ) -> Result<Self> {
        let free = FreeRun::that_may_run_away(block, file, inputs, measured, start)?;
        check_finite(block, file, inputs, &free.output)?;
        Ok(free)
    }

    /// The same where a loop may run away: the output then is NaN from there on.
    pub fn that_may_run_away(
        block: &Block,
        file: &RecordFile,
        inputs: &[&str],
        measured: Option<&[f64]>,
        start: Option<Start>,
    ) -> Result<Self> {
        let u = columns(file, inputs)?;
        let output = block.simulate_from_first(&u)?;
        if !feeds_back(block) {
            check_finite(block, file, inputs, &output)?;
        }
        let estimates = |y: &&[f64]| start.map_or(Start::enough(block, y.len()), |start| start == Start::Estimate);
        let Some(measured) = measured.filter(estimates) else {
            let estimated_from = None;
            return Ok(FreeRun { output, estimated_from });
        };
        let state = estimate_initial_state_of_inputs(block, &u, measured).map_err(|error| file.locate(error))?;
        Ok(FreeRun {
            output: state.simulate_inputs(block, &u),
            estimated_from: Some(state.samples()),
        })
    }

    /// Whether the estimation of the state took most of the record, so that little of it shows a prediction.
    pub fn took_most(&self) -> bool {
        self.estimated_from
            .is_some_and(|samples| 2 * samples > self.output.len())
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
            Some(samples) => {
                let all = self.output.len();
                format!(
                    "from the state estimated from the first {samples} of {all} outputs ({})",
                    percent(samples as f64 / all.max(1) as f64)
                )
            }
            None => "from the steady state that belongs to the first input".to_owned(),
        }
    }
}

/// A prediction some samples ahead, and how it was made.
pub struct Ahead {
    /// The predicted output.
    pub output: Vec<f64>,
    /// Whether the model's noise model changes the prediction.
    pub noise: bool,
    /// How it was made, for reading.
    pub description: String,
}

impl Ahead {
    /// Adds to a free run the error that the noise model predicts from the errors up to `horizon` samples ago.
    pub fn new(model: &ModelFile, run: &FreeRun, measured: &[f64], horizon: usize) -> Result<Self> {
        let noise = model.noise_model.as_deref().unwrap_or_default();
        let samples = if horizon == 1 { "sample" } else { "samples" };
        let description = match &model.noise_model {
            Some(_) if noise.len() > 1 => format!(
                "predicted {horizon} {samples} ahead, by the noise model, an autoregression of order {}",
                noise.len() - 1
            ),
            Some(_) => format!("the noise is white, so a {horizon}-sample prediction equals the free run"),
            None => {
                format!("the model says nothing of its noise, so a {horizon}-sample prediction equals the free run")
            }
        };
        Ok(Ahead {
            output: predict_ahead(&run.output, measured, noise, horizon)?,
            noise: noise.len() > 1,
            description,
        })
    }
}

/// The samples of all inputs.
pub fn columns<'a>(file: &'a RecordFile, inputs: &[&str]) -> Result<Vec<&'a [f64]>> {
    inputs.iter().map(|name| Ok(file.finite(name)?)).collect()
}

/// Why the output of a loop is not finite, and what to do.
const UNSTABLE: &str = "its loop is not stable under this input: identify it from a record with such inputs, or take another structure \
     (docs/refused.md)";

/// The free run of a model under the columns `inputs` from the steady state that belongs to the first input.
///
/// # Errors
/// Those of [`RecordFile::finite`]; names the first sample for which the model has no finite output.
pub fn simulate(block: &Block, file: &RecordFile, inputs: &[&str]) -> Result<Vec<f64>> {
    let y = block.simulate_from_first(&columns(file, inputs)?)?;
    check_finite(block, file, inputs, &y)?;
    Ok(y)
}

/// Refuses an output of a model under these inputs that is not finite.
fn check_finite(block: &Block, file: &RecordFile, inputs: &[&str], y: &[f64]) -> Result<()> {
    let u = columns(file, inputs)?;
    let Some(first) = y.iter().position(|v| !v.is_finite()) else {
        return Ok(());
    };
    // A linear part starts from its input's mean, so one unknown value makes the whole output unknown.
    let unknown = |entry: Entry| {
        let sample = entry.into.iter().position(|&v| entry.curve.value(v).is_nan())?;
        let behind = if entry.direct {
            ""
        } else {
            " behind the first linear part"
        };
        let (x, name) = (entry.curve.x(), inputs[entry.input]);
        let problem = format!(
            "column '{name}'{behind} is {} at sample {sample}, but the model's nonlinearity is known only from {} to {}; cut such \
             samples off, or identify the model from a record with a wider range",
            entry.into[sample],
            x[0],
            x[x.len() - 1]
        );
        Some((sample, problem))
    };
    let (sample, problem) = entries(block, &u).into_iter().find_map(unknown).unwrap_or_else(|| {
        let names: Vec<String> = inputs.iter().map(|name| format!("column '{name}'")).collect();
        let units = format!(
            "check that {} is in the unit in which the model was identified",
            joined(&names)
        );
        let is_inside = Outside::new(block, &u).samples == 0;
        let why = match (feeds_back(block), is_inside) {
            (true, true) => format!("; {UNSTABLE}"),
            (true, false) => format!("; {UNSTABLE}. Also {units}"),
            (false, _) => format!("; {units}"),
        };
        let problem = format!("the model's output is {} at sample {first}{why}", y[first]);
        (first, problem)
    });
    let line = file.line(sample).map_or(String::new(), |line| format!(", line {line}"));
    bail!("{}{line}: {problem}", shown_path(&file.path));
}

/// Whether a part of the model feeds its own output back through a nonlinearity.
fn feeds_back(block: &Block) -> bool {
    match block {
        Block::Feedback(_) | Block::Narx(_) => true,
        Block::Series(blocks) => blocks.iter().any(feeds_back),
        _ => false,
    }
}

/// The prediction `horizon` samples ahead, as `flexure predict --horizon` makes it; without a horizon the free run. Both start
/// from the state that fits the column `output` best, where there are enough samples.
pub fn predict(
    model: &ModelFile,
    file: &RecordFile,
    SystemColumns { inputs, output }: SystemColumns,
    horizon: Option<usize>,
) -> Result<Vec<f64>> {
    let measured = file.finite(output)?;
    let free = FreeRun::new(&model.block, file, inputs, Some(measured), None)?;
    match horizon {
        Some(horizon) => Ok(Ahead::new(model, &free, measured, horizon)?.output),
        None => Ok(free.output),
    }
}

/// The first curve of a model, and the signal that enters it.
struct Entry<'a> {
    curve: &'a Curve,
    into: Cow<'a, [f64]>,
    /// The index of the input that enters it.
    input: usize,
    /// Whether the input enters directly, not after a linear part.
    direct: bool,
}

impl<'a> Entry<'a> {
    /// The first curve after an input: that of the first branch, if there are several.
    fn of(block: &'a Block, signal: &'a [f64], input: usize) -> Option<Self> {
        let entry = |curve, into, direct| Entry {
            curve,
            into,
            input,
            direct,
        };
        match block {
            Block::Static(curve) => Some(entry(curve, Cow::Borrowed(signal), true)),
            Block::Series(blocks) => match blocks.as_slice() {
                [Block::Linear(front), Block::Static(curve), ..] => {
                    Some(entry(curve, Cow::Owned(front.simulate_from_mean(signal)), false))
                }
                blocks => Entry::of(blocks.first()?, signal, input),
            },
            Block::Parallel(blocks) => Entry::of(blocks.first()?, signal, input),
            Block::Linear(_)
            | Block::Offset(_)
            | Block::Feedback(_)
            | Block::Inputs(_)
            | Block::Surface(_)
            | Block::Narx(_)
            | Block::Volterra(_) => None,
        }
    }
}

/// The first block of several inputs, or the whole model if it has one input.
fn entrance(block: &Block) -> &Block {
    match block {
        Block::Series(blocks) if block.inputs() > 1 => blocks.first().map_or(block, entrance),
        _ => block,
    }
}

/// The first curve of every input.
fn entries<'a>(block: &'a Block, inputs: &[&'a [f64]]) -> Vec<Entry<'a>> {
    let blocks = match entrance(block) {
        Block::Inputs(blocks) => blocks.as_slice(),
        one => std::slice::from_ref(one),
    };
    let each = blocks.iter().zip(inputs).enumerate();
    each.filter_map(|(i, (block, signal))| Entry::of(block, signal, i))
        .collect()
}

/// The input samples outside the abscissas of the first nonlinearity.
pub struct Outside {
    /// How many samples.
    pub samples: usize,
    /// At which instants.
    pub at: Vec<usize>,
    /// Whether the nonlinearity has the value of the nearest end at all these samples.
    held: bool,
    /// Whether the input itself enters the nonlinearity.
    direct: bool,
}

impl Outside {
    /// Looks through the inputs.
    pub fn new(block: &Block, inputs: &[&[f64]]) -> Self {
        let mut outside = Outside {
            samples: 0,
            at: Vec::new(),
            held: true,
            direct: true,
        };
        if let Block::Surface(surface) = entrance(block) {
            let samples = inputs.first().map_or(0, |u| u.len());
            let at = |n: usize| inputs.iter().map(|u| u[n]).collect::<Vec<f64>>();
            outside.at = (0..samples).filter(|n| !surface.covers(&at(*n))).collect();
            outside.samples = outside.at.len();
        }
        for Entry {
            curve, into, direct, ..
        } in entries(block, inputs)
        {
            outside.direct &= direct;
            let (x, last) = (curve.x(), curve.x().len() - 1);
            for (n, &v) in into.iter().enumerate().filter(|(_, v)| !curve.covers(**v)) {
                let end = if v < x[0] { 0 } else { last };
                outside.samples += 1;
                outside.at.push(n);
                outside.held &= curve.value(v) == curve.y()[end];
            }
        }
        outside.at.sort_unstable();
        outside
    }

    /// Whether each of the samples follows an excursion within the model's settling time.
    pub fn affected(&self, samples: usize, settling: usize) -> Vec<bool> {
        let mut affected = vec![false; samples];
        for &n in &self.at {
            affected[n..samples.min(n + settling + 1)].fill(true);
        }
        affected
    }

    /// What the user should know about it.
    pub fn warning(&self) -> Option<String> {
        self.remark().map(|remark| format!("warning: {remark}"))
    }

    /// How many samples lie outside, and what happens there.
    pub fn remark(&self) -> Option<String> {
        let there = if self.held {
            "is held at its end value"
        } else {
            "continues as a straight line"
        };
        let which = match (self.direct, self.samples) {
            (true, 1) => "input sample lies",
            (true, _) => "input samples lie",
            (false, 1) => "sample of what enters the nonlinearity lies",
            (false, _) => "samples of what enters the nonlinearity lie",
        };
        (self.samples > 0).then(|| {
            format!(
                "{} {which} outside the range in which the nonlinearity was identified; there it {there}",
                self.samples
            )
        })
    }
}
