//! The Wiener-Hammerstein system or sandwich: linear, static, linear.
//!
//! $$ W_n = G_1(z) U_n, \qquad Y_n = G_2(z) f(W_n) + e_n $$
//! with nothing given but the record:
//!
//! 1. best linear approximations of orders 1 to 10, by the output error;
//! 2. their poles and zeros shared out between $G_1$ and $G_2$ (Sjoberg & Schoukens 2012), every split judged with the best
//!    coarse nonlinearity for it;
//! 3. the best splits refined by Levenberg-Marquardt on the simulation error over all parameters, on more and more samples,
//!    fewer of them from round to round;
//! 4. poles, numerator coefficients and pieces of the nonlinearity, a cubic spline with breakpoints where it is rough,
//!    added and taken away while Schwarz's criterion falls;
//! 5. a second instant in every sampling interval, at which the nonlinearity acts too, if Schwarz's criterion asks for it: a
//!    continuous-time nonlinearity bends the signal between the samples as well;
//! 6. a last refinement on all samples.
//!
//! The input need not be white; the step from 1 to 2 is exact for a Gaussian one (Bussgang's theorem), and a good start
//! for others. A nonlinearity that is even about the intermediate signal's mean leaves no linear approximation to start from.
//!
//! Only the product of the blocks' gains and the sum of their delays are determined: both linear blocks are returned with
//! unit static gain (or unit peak gain, where the static gain is less than a tenth of that).

mod approximation;
mod descent;
mod intersample;
mod loss;
mod monitor;
mod outcome;
mod products;
mod rational;
mod refine;
mod shape;
mod split;
mod structure;
#[cfg(test)]
mod tests;

use std::ops::ControlFlow;

use super::checks::{must_vary, warn_of_levels};
use super::outcome::{Verdict, Warning};
use crate::error::{Error, Result};
use crate::linear::correlation::{mean, variance};
use crate::record::Record;
use approximation::pure_delay;
pub use monitor::Stage;
use outcome::Blocks;
pub use outcome::{ApproximationScore, Intersample, SandwichIdentification};
pub use refine::TriedStructure;
use refine::{Found, find};
pub(super) use {
    approximation::{approximate, solve},
    descent::{Residuals, descend},
    loss::{Data, delayed},
    monitor::Monitor,
    outcome::conventional_gain,
    products::normal_equations,
    rational::Rational,
    shape::{Local, Roughness, Shape, thinned},
    structure::changes,
};

/// The fewest samples that are worth a fit.
const FEWEST: usize = 200;
/// At most so many samples, the last ones, are fitted; more would only cost memory.
const MOST_SAMPLES: usize = 200_000;
/// Samples that do not count while the settling time is not known.
const FIRST_LEFT_OUT: usize = 500;
/// A linear approximation that explains less than this share of the output's variance is a weak start.
const WEAK: f64 = 0.1;

/// The identification of a sandwich.
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

impl WienerHammerstein {
    /// Identifies the system from `input` to `output`.
    ///
    /// # Errors
    /// [`Error::MissingColumn`], [`Error::NonFinite`], [`Error::Constant`], [`Error::ConstantPart`], [`Error::TooShort`] (fewer
    /// than 200 samples for the fit), [`Error::Unit`], [`Error::InvalidParameter`] for a parameter outside its range.
    pub fn identify(&self, record: &Record, input: &str, output: &str) -> Result<SandwichIdentification> {
        self.identify_with(record, input, output, &mut |_| ControlFlow::Continue(()))
    }

    /// [`identify`](Self::identify), with `progress` called before every step; it stops the identification by returning
    /// [`ControlFlow::Break`].
    ///
    /// The result depends neither on `progress` nor on the number of threads.
    ///
    /// # Errors
    /// Those of [`identify`](Self::identify), and [`Error::IdentificationStopped`] if `progress` stopped it.
    pub fn identify_with(
        &self,
        record: &Record,
        input: &str,
        output: &str,
        progress: &mut dyn FnMut(Stage) -> ControlFlow<()>,
    ) -> Result<SandwichIdentification> {
        if !(0.05..=0.9).contains(&self.fresh_share) {
            return Err(Error::InvalidParameter {
                name: "the fresh share".to_owned(),
                value: self.fresh_share,
                requirement: "between 0.05 and 0.9",
            });
        }
        let (u, y) = (record.finite(input)?, record.finite(output)?);
        let fitted = u.len() - (self.fresh_share * u.len() as f64).round() as usize;
        if fitted < FEWEST {
            return Err(Error::TooShort {
                what: "a Wiener-Hammerstein fit (besides the fresh part)",
                need: FEWEST,
                got: fitted,
            });
        }
        for (column, samples) in [(input, u), (output, y)] {
            must_vary(column, samples, 0..fitted, "used for the fit")?;
            must_vary(column, samples, fitted..samples.len(), "kept for the verdict")?;
        }
        let mut warnings = Vec::new();
        warn_of_levels(&u[..fitted], &mut warnings);
        let scales = Scales::new(&u[..fitted], &y[..fitted]);
        let first = fitted.saturating_sub(MOST_SAMPLES);
        let mut data = scales.data(&u[first..fitted], &y[first..fitted]);
        let delay = pure_delay(&data);
        data.u.rotate_right(delay);
        data.u[..delay].fill(0.0);
        let mut monitor = Monitor::new(progress);
        let found = find(&data, &mut monitor);
        if let Some(stage) = monitor.stopped() {
            return Err(Error::IdentificationStopped { stage: stage.name() });
        }
        let found = found.unwrap_or_else(|| Found::nothing(&data));
        let blocks = outcome::blocks(&found.sandwich, &scales, delay)?;
        judged(u, y, fitted, found, blocks, warnings)
    }
}

/// The free run over the whole record and the verdict on its fresh part.
fn judged(
    u: &[f64],
    y: &[f64],
    fitted: usize,
    found: Found,
    blocks: Blocks,
    mut warnings: Vec<Warning>,
) -> Result<SandwichIdentification> {
    let model = blocks.model()?;
    let predicted = model.simulate(u);
    let verdict = Verdict::new(&u[fitted..], &y[fitted..], &predicted[fitted..])?;
    let errors = found.approximations.iter().map(|a| a.relative_error);
    let explained = 1.0 - errors.fold(1.0, f64::min).powi(2);
    if !(explained >= WEAK) {
        warnings.push(Warning::WeakLinearApproximation {
            percent: 100.0 * explained,
        });
    }
    if verdict.measures.fit_percent <= 0.0 {
        warnings.push(Warning::Useless {
            fit_percent: verdict.measures.fit_percent,
        });
    }
    Ok(SandwichIdentification {
        model,
        front: blocks.front,
        nonlinearity: blocks.curve,
        back: blocks.back,
        intersample: blocks.intersample,
        output_offset: blocks.offset,
        front_order: found.sandwich.front.order(),
        back_order: found.sandwich.back.order(),
        breakpoints: blocks.breakpoints,
        approximations: found.approximations,
        tried: found.tried,
        fitted,
        predicted,
        verdict,
        warnings,
    })
}

/// Means and standard deviations of input and output.
struct Scales {
    input: (f64, f64),
    output: (f64, f64),
}

impl Scales {
    fn new(u: &[f64], y: &[f64]) -> Scales {
        let of = |v: &[f64]| (mean(v), variance(v).sqrt());
        Scales {
            input: of(u),
            output: of(y),
        }
    }

    /// The record at zero mean and unit variance.
    fn data(&self, u: &[f64], y: &[f64]) -> Data {
        let scaled = |v: &[f64], (mean, spread): (f64, f64)| v.iter().map(|x| (x - mean) / spread).collect();
        Data {
            u: scaled(u, self.input),
            y: scaled(y, self.output),
            from: (u.len() / 10).min(FIRST_LEFT_OUT),
            dependence: 1.0,
        }
    }
}
