//! The Wiener system: linear, static.
//!
//! $$ W_n = G(z) U_n, \qquad Y_n = f(W_n) + e_n $$
//! from the record alone; f may be invertible or not, even or not:
//!
//! 1. best linear approximations of orders 1 to 10; for a Gaussian input they are G up to scale (Bussgang's theorem);
//! 2. impulse responses from conditional moments of the input: the dominant directions of its covariance weighted by the output
//!    and by the output's square (Li 1992), and of its mean given the output (Greblicki 1992; Li 1991). The best of them, if it is better
//!    than the linear approximations, is refined as a finite impulse response, then imitated by rational blocks;
//! 3. the best starts refined by Levenberg-Marquardt on the simulation error over all parameters of both blocks, f a cubic spline
//!    with breakpoints where it is rough;
//! 4. poles, numerator coefficients and pieces added and taken away while Schwarz's criterion falls; kinks, with places of their
//!    own, on very strong evidence;
//! 5. a last refinement on all samples; step 4 once more with whitened errors, and generalised least squares, if the error is coloured
//!    noise.
//!
//! Steps 3 to 5 are those of the [Wiener-Hammerstein system](crate::identify::WIENER_HAMMERSTEIN); the input need be neither white nor
//! Gaussian. Steps 1 and 2 are exact for Gaussian inputs of any colour and good starts for others.
//!
//! The linear block is returned with unit static gain; if it hardly passes a constant, with the input's standard deviation at its output,
//! as for the [Wiener-Hammerstein system](crate::identify::WIENER_HAMMERSTEIN). The nonlinearity has the rest. If f is even, the linear
//! block's sign is a convention too.

mod directions;
mod starts;
#[cfg(test)]
mod tests;

use super::super::block::{Blocks, FreeParts, Monitor, System, Tried, add_errors, search, without_start};
use crate::error::Result;
use crate::identify::request::{Progress, Rank, Request, Structure};
use crate::identify::result::{Identification, LinearBlock, NamedBlock, StructureName};
use crate::identify::run::{Run, path, start_details};
use starts::{WienerStarts, delay_of_any_dependence, starts};

/// The start of the search for a Wiener system.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum WienerStart {
    /// The best linear approximations.
    LinearApproximation,
    /// Higher moments; they were better than the best linear approximations.
    HigherMoments,
}

/// The identification of a Wiener system.
///
/// ```
/// use flexure::identify::WIENER;
/// use flexure::linear::TransferFunction;
/// use flexure::record::Record;
/// use rand::SeedableRng;
/// use rand_distr::{Distribution, StandardNormal};
///
/// // |x| is even about the mean of a zero-mean signal: no linear correlation at all.
/// let linear = TransferFunction::new(vec![1.0, 0.5], vec![1.0, -0.7])?;
/// let mut random = rand_pcg::Pcg64::seed_from_u64(1);
/// let u: Vec<f64> = (0..4000).map(|_| StandardNormal.sample(&mut random)).collect();
/// let y: Vec<f64> = linear.simulate(&u).iter().map(|w| w.abs()).collect();
/// let result = WIENER.identify(&Record::new([("u", u), ("y", y)])?, &["u"], "y")?;
/// assert!(result.verdict.measures.fit_percent > 98.0);
/// # Ok::<(), flexure::Error>(())
/// ```
pub const ROW: Structure = Structure {
    name: StructureName {
        key: "wiener",
        title: "Wiener",
    },
    description: "linear dynamics, then a static nonlinearity",
    inputs: 1..=1,
    options: &[],
    rank: Some(Rank::TwoBlocks),
    identify,
};

fn identify(request: &Request<'_>, progress: &mut Progress<'_>) -> Result<Identification> {
    let samples = request.samples("a Wiener fit (besides the fresh part)")?;
    let monitor = &mut Monitor::new(progress);
    let linear = request.prepared(&samples, monitor);
    let mut again = None;
    if linear.is_weak() {
        let (u, y) = (&samples.input()[..samples.fitted], &samples.y[..samples.fitted]);
        again = Some(samples.prepared().delayed_by(delay_of_any_dependence(u, y)));
    }
    let prepared = again.as_ref().unwrap_or(linear);
    let WienerStarts { candidates, from } = starts(prepared, monitor);
    let found = search(candidates, FreeParts::WIENER, &prepared.data, monitor);
    monitor.finished()?;
    let found = found.unwrap_or_else(|| without_start(&prepared.data));
    let paths_of = |system: &System| {
        let blocks = Blocks::new(&system.branches[0], prepared)?;
        let named = vec![
            NamedBlock::new("linear", "Linear part", LinearBlock::of(blocks.front)),
            NamedBlock::new("nonlinearity", "Nonlinearity", blocks.nonlinearity),
        ];
        Ok(vec![path(request, named)])
    };
    let mut paths = paths_of(&found.system)?;
    add_errors(&mut paths, &found.system, &prepared.data, paths_of);
    let start = match from {
        WienerStart::LinearApproximation => "the poles of the best linear model",
        WienerStart::HigherMoments => {
            "the poles of an impulse response from higher moments of input and output, which fit better than linear models"
        }
    };
    let run = Run::new(&samples, paths[0].model(0.0), paths, found.system.degrees())?;
    Ok(Identification {
        details: start_details(start, linear, &run.paths),
        tried: found.tried.iter().filter_map(Tried::cascade).collect(),
        ..run.identification(&ROW, request)?
    })
}
