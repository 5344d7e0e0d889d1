//! The Wiener-Hammerstein system: linear, static, linear.
//!
//! $$ W_n = G_1(z) U_n, \qquad Y_n = G_2(z) f(W_n) + e_n $$
//! from the record alone:
//!
//! 1. the delay: the number of leading coefficients of a difference equation that are zero together; best linear approximations
//!    of orders 1 to 10, by the output error;
//! 2. their poles and zeros split between $G_1$ and $G_2$ (Sjoberg & Schoukens 2012), every split judged with the best coarse nonlinearity
//!    for it;
//! 3. the best splits refined by Levenberg-Marquardt on the simulation error over all parameters, on more and more samples,
//!    fewer of them from round to round;
//! 4. poles, numerator coefficients, the delay and pieces of the nonlinearity, a cubic spline with breakpoints where it is rough,
//!    added and taken away while Schwarz's criterion falls; kinks, with places of their own, on very strong evidence;
//! 5. a second instant in every sampling interval, at which the nonlinearity acts too, if that lowers Schwarz's criterion: a
//!    continuous-time nonlinearity also bends the signal between the samples;
//! 6. a last refinement on all samples. If the error is coloured noise, step 4 once more with whitened errors, and generalised least
//!    squares.
//!
//! The input need not be white; the step from 1 to 2 is exact for a Gaussian one (Bussgang's theorem), and a good start
//! for others. A nonlinearity that is even about the intermediate signal's mean leaves no linear approximation to start from.
//!
//! Only the product of the blocks' gains and the sum of their delays are determined: both linear blocks are returned with
//! unit static gain. A block that hardly passes a constant is scaled so that its output has the standard deviation of its input over
//! the fit's samples. It hardly passes a constant if its static gain is less than a tenth of the ratio of these two standard deviations.

use super::super::block::{Blocks, FreeParts, Monitor, Tried, add_errors, search, splits, without_start};
use super::super::warning::Warning;
use crate::error::Result;
use crate::identify::request::{Progress, Rank, Request, Structure};
use crate::identify::result::{Detail, Identification, Place, StructureName};
use crate::identify::run::{Run, path, start_details};
/// The identification of a Wiener-Hammerstein system.
///
/// ```
/// use flexure::identify::WIENER_HAMMERSTEIN;
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
/// let result = WIENER_HAMMERSTEIN.identify(&Record::new([("u", u), ("y", y)])?, &["u"], "y")?;
/// assert!(result.verdict.measures.fit_percent > 98.0);
/// # Ok::<(), flexure::Error>(())
/// ```
pub const ROW: Structure = Structure {
    name: StructureName {
        key: "wiener-hammerstein",
        title: "Wiener-Hammerstein",
    },
    description: "linear dynamics, a static nonlinearity, linear dynamics",
    inputs: 1..=1,
    options: &[],
    rank: Some(Rank::ThreeBlocks),
    identify,
};

fn identify(request: &Request<'_>, progress: &mut Progress<'_>) -> Result<Identification> {
    let samples = request.samples("a Wiener-Hammerstein fit (besides the fresh part)")?;
    let monitor = &mut Monitor::new(progress);
    let prepared = request.prepared(&samples, monitor);
    let starts = splits(prepared, monitor);
    let found = search(starts, FreeParts::WIENER_HAMMERSTEIN, &prepared.data, monitor);
    monitor.finished()?;
    let found = found.unwrap_or_else(|| without_start(&prepared.data));
    let blocks = Blocks::new(&found.system.branches[0], prepared)?;
    let acts_between = blocks.between_samples.is_some();
    let output_offset = blocks.offset;
    let mut paths = vec![path(request, blocks.named())];
    add_errors(&mut paths, &found.system, &prepared.data, |system| {
        let blocks = Blocks::new(&system.branches[0], prepared)?;
        Ok(vec![path(request, blocks.named())])
    });
    let mut run = Run::new(&samples, paths[0].model(output_offset), paths, found.system.degrees())?;
    if prepared.is_weak() {
        run.warnings.push(Warning::WeakLinearApproximation {
            percent: 100.0 * prepared.explained(),
        });
    }
    let start = "all divisions of the poles of the best linear model between the two parts";
    let mut details = start_details(start, prepared, &run.paths);
    details.extend(acts_between.then(|| {
        let why = "the blocks 'between the samples' describe what the curve does halfway between two samples. They have the same curve \
                   and the same poles as the others";
        Detail::sentence(Place::ChoiceAndText, "Between the samples", "the curve also acts between the samples", why)
    }));
    Ok(Identification {
        details,
        output_offset,
        tried: found.tried.iter().filter_map(Tried::cascade).collect(),
        ..run.identification(&ROW, request)?
    })
}

#[cfg(test)]
#[path = "wiener_hammerstein_tests.rs"]
mod tests;
