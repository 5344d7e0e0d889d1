//! What a model from a file says about a record.

use std::borrow::Cow;

use anyhow::{Result, bail};
use flexure::Block;
use flexure::nonlinearity::Curve;
use flexure_io::RecordFile;

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
        for &v in into.iter().filter(|&&v| !curve.covers(v)) {
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
