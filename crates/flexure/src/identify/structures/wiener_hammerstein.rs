//! The Wiener-Hammerstein system: linear, static, linear.
//!
//! $$ W_n = G_1(z) U_n, \qquad Y_n = G_2(z) f(W_n) + e_n $$
//! from the record alone:
//!
//! 1. best linear approximations of orders 1 to 10, by the output error;
//! 2. their poles and zeros shared out between $G_1$ and $G_2$ (Sjoberg & Schoukens 2012), every split judged with the best
//!    coarse nonlinearity for it;
//! 3. the best splits refined by Levenberg-Marquardt on the simulation error over all parameters, on more and more samples,
//!    fewer of them from round to round;
//! 4. poles, numerator coefficients and pieces of the nonlinearity, a cubic spline with breakpoints where it is rough,
//!    added and taken away while Schwarz's criterion falls; kinks, with places of their own, on very strong evidence;
//! 5. a second instant in every sampling interval, at which the nonlinearity acts too, if Schwarz's criterion asks for it: a
//!    continuous-time nonlinearity bends the signal between the samples as well;
//! 6. a last refinement on all samples. Where the error is coloured noise, step 4 once more by errors made white, and
//!    generalised least squares.
//!
//! The input need not be white; the step from 1 to 2 is exact for a Gaussian one (Bussgang's theorem), and a good start
//! for others. A nonlinearity that is even about the intermediate signal's mean leaves no linear approximation to start from.
//!
//! Only the product of the blocks' gains and the sum of their delays are determined: both linear blocks are returned with
//! unit static gain (or unit peak gain, where the static gain is less than a tenth of that).

use std::ops::ControlFlow;

use super::super::block::{
    ApproximationScore, FreeParts, Intersample, Monitor, Prepared, Stage, TriedStructure, WEAK, blocks, search, splits,
    without_start,
};
use super::super::outcome::{Verdict, Warning};
use super::super::samples::Samples;
use crate::error::Result;
use crate::linear::TransferFunction;
use crate::model::Block;
use crate::nonlinearity::Curve;
use crate::record::Record;
/// The identification of a Wiener-Hammerstein system.
///
/// | parameter | purpose | valid range | default |
/// |---|---|---|---|
/// | `fresh_share` | share at the end kept for the verdict | 0.05 to 0.9 | 0.25 |
///
/// ```
/// use flexure::identify::WienerHammerstein;
/// use flexure::model::Block;
/// use flexure::linear::TransferFunction;
/// use flexure::nonlinearity::{Curve, Outside};
/// use flexure::record::Record;
/// use rand::{RngExt, SeedableRng};
///
/// let system = Block::Series(vec![
///     Block::Linear(TransferFunction::new(vec![1.0], vec![1.0, -0.6])?),
///     Block::Static(Curve::new(vec![-1.0, 1.0], vec![-1.0, 1.0], Outside::Nearest)?),
///     Block::Linear(TransferFunction::new(vec![1.0, 0.5], vec![1.0, -0.3])?),
/// ]);
/// let mut random = rand_pcg::Pcg64::seed_from_u64(1);
/// let u: Vec<f64> = (0..4000).map(|_| random.random_range(-2.0..2.0)).collect();
/// let y = system.simulate(&u);
/// let result = WienerHammerstein::default().identify(&Record::new([("u", u), ("y", y)])?, "u", "y")?;
/// assert!(result.verdict.measures.fit_percent > 98.0);
/// # Ok::<(), flexure::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WienerHammerstein {
    /// The share of the record that the verdict is made on.
    pub fresh_share: f64,
}

impl Default for WienerHammerstein {
    fn default() -> Self {
        WienerHammerstein { fresh_share: 0.25 }
    }
}

/// An identified Wiener-Hammerstein system with all that was chosen on the way.
#[derive(Debug, Clone, PartialEq)]
pub struct WienerHammersteinIdentification {
    /// The model, ready to simulate: `Series([Linear, Static, Linear])`, of which `Parallel` takes two for an instant between
    /// the samples, and the output offset where there is one.
    pub model: Block,
    /// The first linear block, of unit static or peak gain. Always stable.
    pub front: TransferFunction,
    /// The way through an instant between the samples, where the data show that the nonlinearity acts there too.
    pub intersample: Option<Intersample>,
    /// The static nonlinearity, a cubic spline with kinks where the data show them, in tabulated form, straight on beyond the range of
    /// the fit.
    pub nonlinearity: Curve,
    /// The last linear block, of unit static or peak gain. Always stable.
    pub back: TransferFunction,
    /// Added to the output; zero unless the back has (nearly) no static gain.
    pub output_offset: f64,
    /// The number of poles of the front.
    pub front_order: usize,
    /// The number of poles of the back.
    pub back_order: usize,
    /// The nonlinearity's breakpoints, increasing, in the unit of the intermediate signal.
    pub breakpoints: Vec<f64>,
    /// Points at which the nonlinearity's slope changes at once, increasing, in the same unit.
    pub kinks: Vec<f64>,
    /// The linear approximations that were tried.
    pub approximations: Vec<ApproximationScore>,
    /// The structures that were tried, in order.
    pub tried: Vec<TriedStructure>,
    /// Samples `0..fitted` were used for the fit, the rest for the verdict.
    pub fitted: usize,
    /// The free-run output over all samples.
    pub predicted: Vec<f64>,
    /// The verdict on the samples from `fitted` on.
    pub verdict: Verdict,
    /// What the user should know.
    pub warnings: Vec<Warning>,
}

impl WienerHammerstein {
    /// Identifies the system from `input` to `output`.
    ///
    /// # Errors
    /// Those of [`Wiener::identify`](crate::identify::Wiener::identify).
    pub fn identify(&self, record: &Record, input: &str, output: &str) -> Result<WienerHammersteinIdentification> {
        self.identify_with(record, input, output, &mut |_| ControlFlow::Continue(()))
    }

    /// [`identify`](Self::identify), with `progress` called before every step; it stops the identification by returning
    /// [`ControlFlow::Break`].
    ///
    /// The result depends neither on `progress` nor on the number of threads.
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
    ) -> Result<WienerHammersteinIdentification> {
        let samples = Samples::new(
            record,
            input,
            output,
            self.fresh_share,
            "a Wiener-Hammerstein fit (besides the fresh part)",
        )?;
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
) -> Result<WienerHammersteinIdentification> {
    let starts = splits(prepared, monitor);
    let found = search(starts, FreeParts::WIENER_HAMMERSTEIN, &prepared.data, monitor);
    monitor.finished()?;
    let found = found.unwrap_or_else(|| without_start(&prepared.data));
    let branch = &found.system.branches[0];
    let blocks = blocks(branch, prepared)?;
    let model = blocks.model();
    let (predicted, verdict, mut warnings) = samples.judged(&model, found.system.degrees())?;
    if !(prepared.explained() >= WEAK) {
        warnings.push(Warning::WeakLinearApproximation {
            percent: 100.0 * prepared.explained(),
        });
    }
    Ok(WienerHammersteinIdentification {
        model,
        front: blocks.front,
        nonlinearity: blocks.curve,
        back: blocks.back,
        intersample: blocks.intersample,
        output_offset: blocks.offset,
        front_order: branch.front.order(),
        back_order: branch.back.order(),
        breakpoints: blocks.breakpoints,
        kinks: blocks.kinks,
        approximations: prepared.scores(),
        tried: TriedStructure::of(found.tried),
        fitted: samples.fitted,
        predicted,
        verdict,
        warnings,
    })
}

#[cfg(test)]
#[path = "wiener_hammerstein_tests.rs"]
mod tests;
