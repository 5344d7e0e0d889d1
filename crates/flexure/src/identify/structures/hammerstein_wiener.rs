//! The Hammerstein-Wiener system: static, linear, static.
//!
//! $$ V_n = f(U_n), \qquad X_n = G(z) z^{-s} V_n, \qquad Y_n = g(X_n) + e_n $$
//! from the record alone:
//!
//! 1. the delay, from an equation error with B-splines of the input;
//! 2. starts of orders 0 to 8: f and G by least squares over B-splines of the input with a common denominator and the dominant product of
//!    the numerators (Bai 1998); for systems whose f hardly bends, also the best linear approximation; then g by least squares;
//! 3. the best of them refined by Levenberg-Marquardt on the simulation error over all parameters of the three blocks, f and g
//!    cubic splines with breakpoints where they are rough, and kinks on very strong evidence;
//! 4. pieces of both nonlinearities, poles, numerator coefficients and the delay changed while Schwarz's criterion falls;
//! 5. a last refinement on all samples.
//!
//! The start is exact if the linear part's output is Gaussian (Bussgang's theorem: g is then a gain and noise that is not correlated with
//! it); this is nearly so for a long memory. The input need not be white. If g is even about the mean of its input, there is nothing to
//! start from.
//!
//! Only the product of the blocks' gains is determined, but not the places of the offsets. By convention the linear part has unit
//! static gain (if it hardly passes a constant, its input's standard deviation at its output, as for the
//! [Wiener-Hammerstein system](crate::identify::WIENER_HAMMERSTEIN)), and the least-squares line through f over the fit's inputs is the
//! identity: V is in the input's unit, and an f that is a straight line is V = U. If f has (nearly) no such line, V has the
//! input's mean and standard deviation.

use super::super::block::{
    KinkedSpline, Monitor, Normalised, Prepared, System, Tried, add_errors, hammerstein_branches, tabulated,
};
use super::limits::NO_LINE;
use crate::error::Result;
use crate::identify::request::{Progress, Rank, Request, Structure};
use crate::identify::result::{BlockKind, Detail, Identification, LinearBlock, NamedBlock, Place, StructureName};
use crate::identify::run::{Run, path};
use crate::linear::correlation::{mean, variance};

/// The identification of a Hammerstein-Wiener system.
///
/// ```
/// use flexure::identify::HAMMERSTEIN_WIENER;
/// use flexure::linear::TransferFunction;
/// use flexure::record::Record;
/// use rand::{RngExt, SeedableRng};
///
/// let linear = TransferFunction::new(vec![0.3], vec![1.0, -0.7])?;
/// let mut random = rand_pcg::Pcg64::seed_from_u64(1);
/// let u: Vec<f64> = (0..4000).map(|_| random.random_range(-2.0..2.0)).collect();
/// let v: Vec<f64> = u.iter().map(|u| u + 0.2 * u * u).collect();
/// let y: Vec<f64> = linear.simulate(&v).iter().map(|x| x.tanh()).collect();
/// let result = HAMMERSTEIN_WIENER.identify(&Record::new([("u", u), ("y", y)])?, &["u"], "y")?;
/// assert!(result.verdict.measures.fit_percent > 98.0);
/// # Ok::<(), flexure::Error>(())
/// ```
pub const ROW: Structure = Structure {
    name: StructureName {
        key: "hammerstein-wiener",
        title: "Hammerstein-Wiener",
    },
    description: "a static nonlinearity, linear dynamics, a static nonlinearity",
    inputs: 1..=1,
    options: &[],
    rank: Some(Rank::ThreeBlocks),
    identify,
};

fn identify(request: &Request<'_>, progress: &mut Progress<'_>) -> Result<Identification> {
    let samples = request.samples("a Hammerstein-Wiener fit (besides the fresh part)")?;
    let prepared = samples.prepared();
    let mut monitor = Monitor::new(progress);
    let found = hammerstein_branches::find(&prepared.data, true, &mut monitor);
    monitor.finished()?;
    let found = found.unwrap_or_else(|| hammerstein_branches::without_start(true));
    let paths_of = |system: &System| Ok(vec![path(request, blocks(system, &prepared)?)]);
    let mut paths = paths_of(&found.system)?;
    add_errors(&mut paths, &found.system, &prepared.data, paths_of);
    let run = Run::new(&samples, paths[0].model(0.0), paths, found.system.degrees())?;
    let why = "poles, zeros and delay are added or removed while that improves Schwarz's criterion";
    let order = run.paths[0].order().to_string();
    Ok(Identification {
        tried: found.tried.iter().map(Tried::ends).collect(),
        details: vec![Detail::sentence(Place::Choice, "Poles", order, why)],
        ..run.identification(&ROW, request)?
    })
}

/// The blocks in the record's units and the conventional scale.
fn blocks(system: &System, prepared: &Prepared) -> Result<Vec<NamedBlock>> {
    let (branch, data, scale) = (&system.branches[0], &prepared.data, prepared.inputs[0]);
    let through: Vec<f64> = data.u[0].iter().map(|u| branch.spline.value(*u)).collect();
    let Normalised { linear, gain } = Normalised::new(&branch.back, branch.delay, &through, data.from)?;
    // V = slope v + level for the branch's own v.
    let line = Line::conventional(&branch.spline, &data.u[0]);
    let (slope, level) = (line.slope * scale.spread, scale.back(line.level));
    let entering = &data.u[0][data.from..];
    let input = BlockKind::Static(tabulated(
        &branch.spline,
        entering,
        |u| scale.back(u),
        |v| slope * v + level,
    )?);
    let fixed = linear.static_gain();
    let passed = if fixed.is_finite() { fixed * level } else { 0.0 };
    // The linear part's output is (x - o) slope / gain + passed.
    let offset = branch.offset;
    let abscissa = |x: f64| (x - offset) * slope / gain + passed;
    let identity = || {
        let mut identity = KinkedSpline::new(&[offset - 1.0, offset + 1.0]);
        identity.straighten();
        identity
    };
    let spline = system.output.clone().unwrap_or_else(identity);
    let inner = &system.inner(&data.u)[data.from..];
    let output = BlockKind::Static(tabulated(&spline, inner, abscissa, |y| prepared.output.back(y))?);
    Ok(vec![
        NamedBlock::new("nonlinearity", "Nonlinearity at the input", input),
        NamedBlock::new("linear", "Linear part", LinearBlock::of(linear)),
        NamedBlock::new("output_nonlinearity", "Nonlinearity at the output", output),
    ])
}

/// A straight line.
struct Line {
    slope: f64,
    level: f64,
}

impl Line {
    /// The line from a nonlinearity's values to those whose own least-squares line over `u`, of zero mean
    /// and unit variance, is the identity.
    fn conventional(spline: &KinkedSpline, u: &[f64]) -> Line {
        let v: Vec<f64> = u.iter().map(|u| spline.value(*u)).collect();
        let (centre, spread) = (mean(&v), variance(&v).sqrt());
        let covariance = v.iter().zip(u).map(|(v, u)| (v - centre) * u).sum::<f64>() / u.len() as f64;
        let slope = if !(spread > 0.0 && spread.is_finite()) {
            1.0
        } else if covariance.abs() >= NO_LINE * spread {
            variance(u) / covariance
        } else {
            (1.0 / spread).copysign(covariance)
        };
        Line {
            slope,
            level: mean(u) - slope * centre,
        }
    }
}
