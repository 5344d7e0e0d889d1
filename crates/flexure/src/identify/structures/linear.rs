//! The linear reference: how far a linear model gets.
//!
//! $$ Y_n = o + \frac{B(z)}{A(z)} z^{-s} U_n + e_n $$
//! by the output error (Ljung 1999, section 4.2), started by the Steiglitz-McBride iteration at orders 1 to 10; poles and
//! numerator coefficients are then added and taken away while Schwarz's criterion falls, and generalised least squares makes the
//! estimate efficient where the error is coloured noise. For a nonlinear system this is the best linear approximation under this input.

use std::ops::ControlFlow;

use super::super::block::{ApproximationScore, Monitor, Prepared, Rational, Stage, restructured};
use super::super::outcome::{Verdict, Warning};
use super::super::samples::Samples;
use crate::error::Result;
use crate::linear::TransferFunction;
use crate::model::Block;
use crate::record::Record;

/// The identification of a linear system by its output error.
///
/// | parameter | purpose | valid range | default |
/// |---|---|---|---|
/// | `fresh_share` | share at the end kept for the verdict | 0.05 to 0.9 | 0.25 |
///
/// ```
/// use flexure::identify::Linear;
/// use flexure::linear::TransferFunction;
/// use flexure::record::Record;
/// use rand::{RngExt, SeedableRng};
///
/// let system = TransferFunction::new(vec![0.0, 1.0, 0.5], vec![1.0, -1.2, 0.6])?;
/// let mut random = rand_pcg::Pcg64::seed_from_u64(1);
/// let u: Vec<f64> = (0..2000).map(|_| random.random_range(-1.0..1.0)).collect();
/// let y: Vec<f64> = system.simulate(&u).iter().map(|y| y + 0.1 * random.random_range(-1.0..1.0)).collect();
/// let result = Linear::default().identify(&Record::new([("u", u), ("y", y)])?, "u", "y")?;
/// assert_eq!(result.order, 2);
/// assert!(result.verdict.holds());
/// # Ok::<(), flexure::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Linear {
    /// The share of the record that the verdict is made on.
    pub fresh_share: f64,
}

impl Default for Linear {
    fn default() -> Self {
        Linear { fresh_share: 0.25 }
    }
}

/// An identified linear model with all that was chosen on the way.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearIdentification {
    /// The model, ready to simulate: `Series([Linear, Offset])`, the latter adding the offset.
    pub model: Block,
    /// The transfer function, in the units of output over input; a long delay is leading zeros of its numerator. Always stable.
    pub linear: TransferFunction,
    /// Added to its output.
    pub output_offset: f64,
    /// The number of poles.
    pub order: usize,
    /// The orders that were tried first, with as many zeros as poles.
    pub approximations: Vec<ApproximationScore>,
    /// Samples `0..fitted` were used for the fit, the rest for the verdict.
    pub fitted: usize,
    /// The free-run output over all samples.
    pub predicted: Vec<f64>,
    /// The verdict on the samples from `fitted` on.
    pub verdict: Verdict,
    /// What the user should know.
    pub warnings: Vec<Warning>,
}

impl Linear {
    /// Identifies the system from `input` to `output`.
    ///
    /// # Errors
    /// Those of [`Wiener::identify`](crate::identify::Wiener::identify).
    pub fn identify(&self, record: &Record, input: &str, output: &str) -> Result<LinearIdentification> {
        self.identify_with(record, input, output, &mut |_| ControlFlow::Continue(()))
    }

    /// [`identify`](Self::identify), with `progress` called before every step; it stops the identification by returning
    /// [`ControlFlow::Break`].
    ///
    /// # Errors
    /// Those of [`identify`](Self::identify), and [`Error::Stopped`](crate::Error::Stopped) if
    /// `progress` stopped it.
    pub fn identify_with(
        &self,
        record: &Record,
        input: &str,
        output: &str,
        progress: &mut dyn FnMut(Stage) -> ControlFlow<()>,
    ) -> Result<LinearIdentification> {
        let what = "a linear fit (besides the fresh part)";
        let samples = Samples::new(record, input, output, self.fresh_share, what)?;
        let mut monitor = Monitor::new(progress);
        let prepared = samples.prepared(&mut monitor);
        fit(&samples, &prepared, &mut monitor)
    }
}

/// The identification from linear approximations on.
pub(in crate::identify) fn fit(
    samples: &Samples<'_>,
    prepared: &Prepared,
    monitor: &mut Monitor<'_>,
) -> Result<LinearIdentification> {
    monitor.stage = Stage::Structure;
    let nothing = Rational {
        b: vec![0.0],
        ..Rational::pass()
    };
    let best = prepared.best().map(|i| &prepared.approximations[i].system);
    let system = best.map_or(nothing, |g| {
        let found = restructured(&prepared.data, g, monitor);
        found.efficient(&prepared.data, monitor).system
    });
    monitor.finished()?;
    let (input, output) = (prepared.scales.input, prepared.scales.output);
    let order = system.order();
    // One more for the offset.
    let parameters = system.parameters().len() + 1;
    let gain = output.spread / input.spread;
    let scaled = Rational {
        b: system.b.iter().map(|b| gain * b).collect(),
        ..system
    };
    let linear = scaled.transfer_function(prepared.delay)?;
    let output_offset = output.mean - scaled.static_gain() * input.mean;
    let model = Block::Series(vec![Block::Linear(linear.clone()), Block::Offset(output_offset)]);
    let (predicted, verdict, warnings) = samples.judged(&model, parameters)?;
    Ok(LinearIdentification {
        model,
        linear,
        output_offset,
        order,
        approximations: prepared.scores(),
        fitted: samples.fitted,
        predicted,
        verdict,
        warnings,
    })
}
