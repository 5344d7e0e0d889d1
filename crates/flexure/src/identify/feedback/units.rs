//! The loop in the record's units, with the freedom in it fixed by convention.
//!
//! Both sides of the nonlinearity have scales and levels that the output does not determine, and a straight line can move between f and
//! the linear part. The conventions:
//!
//! - z is in the unit of the output, or of its difference, where it is (nearly) that signal; else it has unit variance.
//! - **f is the input that holds z**: the constant input under which the loop rests at z. f is in the unit of the input: the friction of
//!   a joint whose velocity z is, the spring of an oscillator whose angle z is; the linear part has a pole at 1 from the input to z. All
//!   ways to write one system have the same such f.
//! - Where a constant does not pass from the input or from w to z, there is no such f. Then its tangent at the median of z is moved into
//!   the linear part, and its scale is that of the output.

use super::limits::{CONTINUED_SHARE, CURVE_SAMPLES, NAMING_SHARE, PASSES_CONSTANT, RESPONSE, SMALLEST_GAIN};
use super::loss::LoopError;
use super::system::{Entering, Loop, Observed};
use crate::error::Result;
use crate::identify::block::{Band, KinkedSpline, Residuals, Scale, Uncertainty, tabulated};
use crate::identify::result::StaticBlock;
use crate::linalg::{Matrix, Vector};
use crate::linear::correlation::{mean, variance};
use crate::linear::least_squares::{least_squares, normal_equations};
use crate::model::{FeedbackLevels, FeedbackModel};
use crate::sort::sorted;
use crate::vectors::dot;

/// What enters the nonlinearity, as far as it has a name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Signal {
    Output,
    Difference,
    Hidden,
}

/// Which f stands for all that give the same output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Convention {
    /// The input that holds z.
    HoldingInput,
    /// No slope at the median of z.
    NoTangent,
}

/// z in its unit: `slope` z + `level`.
#[derive(Debug, Clone, Copy)]
struct Abscissa {
    slope: f64,
    level: f64,
}

/// f in its unit: `scale` f(z) + `slope` z + `level`.
#[derive(Debug, Clone, Copy)]
struct Ordinate {
    scale: f64,
    slope: f64,
    level: f64,
}

/// The loop in the record's units.
pub(super) struct InUnits {
    pub model: FeedbackModel,
    pub nonlinearity: StaticBlock,
    pub signal: Signal,
    pub convention: Convention,
    /// The range of z over the fitted samples.
    pub seen: [f64; 2],
}

impl InUnits {
    /// Of a loop on standardised samples, its nonlinearity continued as a cubic if it is one and `may_continue`; `dependence` samples carry
    /// as much information as one with an independent error.
    pub fn new(
        system: &Loop,
        data: &Observed,
        scales: [Scale; 2],
        dependence: f64,
        may_continue: bool,
    ) -> Result<InUnits> {
        let system = system.balanced(data);
        let (mut z, mut y) = (Vec::new(), Vec::new());
        system.run(data, |s| {
            z.push(s.z);
            y.push(s.y);
        });
        let (signal, abscissa) = named(&system, &z, &y, scales[1]);
        let sorted = sorted(&z);
        let ordinates = Ordinates {
            convention: match equilibrium_scales(&system, scales[0]) {
                Some(_) => Convention::HoldingInput,
                None => Convention::NoTangent,
            },
            median: sorted[sorted.len() / 2],
            scales,
        };
        let own = ordinates.of(&system);
        let to_units = |z: f64| abscissa.slope * z + abscissa.level;
        let continued = may_continue.then(|| continued(&system, &z)).flatten();
        let shown = own.applied(continued.as_ref().unwrap_or(&system.spline));
        let mut nonlinearity = tabulated(&shown, &z, to_units, |v| v)?;
        let ends = [sorted[0], sorted[sorted.len() - 1]];
        let band = band(&system, data, dependence, ends, |system, z| {
            ordinates.of(system).value(&system.spline, z)
        });
        if let Some(band) = band {
            let back = |x: f64| (x - abscissa.level) / abscissa.slope;
            nonlinearity.band = nonlinearity.curve.x().iter().map(|x| band.at(back(*x))).collect();
            nonlinearity.band_label = Band::LABEL;
        }
        let mut seen = ends.map(to_units);
        seen.sort_unstable_by(f64::total_cmp);
        Ok(InUnits {
            model: model(&system, own, abscissa, scales, nonlinearity.curve.clone()),
            nonlinearity,
            signal,
            convention: ordinates.convention,
            seen,
        })
    }
}

impl Ordinate {
    /// f in its unit at a point.
    fn value(self, f: &KinkedSpline, z: f64) -> f64 {
        self.scale * f.value(z) + self.slope * z + self.level
    }

    /// f in its unit.
    fn applied(self, f: &KinkedSpline) -> KinkedSpline {
        let mut f = f.rescaled(1.0, self.scale);
        let line = f.line();
        let each = f.c.iter_mut().zip(line);
        each.for_each(|(c, x)| *c += self.slope * x + self.level);
        f
    }
}

/// The units of f for loops near each other.
struct Ordinates {
    convention: Convention,
    median: f64,
    /// Of input and output.
    scales: [Scale; 2],
}

impl Ordinates {
    fn of(&self, system: &Loop) -> Ordinate {
        let [input, output] = self.scales;
        let held = match self.convention {
            Convention::HoldingInput => equilibrium_scales(system, input),
            Convention::NoTangent => None,
        };
        held.unwrap_or_else(|| tangential(system, self.median, output))
    }
}

/// The name of z, and its unit.
fn named(system: &Loop, z: &[f64], y: &[f64], output: Scale) -> (Signal, Abscissa) {
    if system.entering == Entering::Output {
        let slope = output.spread / system.scale_of_entering();
        let level = output.back(system.offset);
        return (Signal::Output, Abscissa { slope, level });
    }
    let difference: Vec<f64> = (0..y.len()).map(|k| y[k] - y[k.saturating_sub(1)]).collect();
    let candidates = [(Signal::Output, y, output.mean), (Signal::Difference, &difference, 0.0)];
    let fits = candidates.map(|(signal, values, level)| {
        let (centre_z, centre) = (mean(z), mean(values));
        let products = z.iter().zip(values).map(|(z, v)| (z - centre_z) * (v - centre));
        let covariance = products.sum::<f64>() / z.len() as f64;
        let (power_z, power) = (variance(z), variance(values));
        let share = covariance * covariance / (power_z * power);
        let slope = covariance / power_z;
        let abscissa = Abscissa {
            slope: output.spread * slope,
            level: level + output.spread * (centre - slope * centre_z),
        };
        (share, signal, abscissa)
    });
    let best = fits
        .into_iter()
        .filter(|f| f.0 >= NAMING_SHARE && f.2.slope.is_finite() && f.2.slope != 0.0);
    let hidden = (Signal::Hidden, Abscissa { slope: 1.0, level: 0.0 });
    best.max_by(|a, b| a.0.total_cmp(&b.0))
        .map_or(hidden, |(_, signal, abscissa)| (signal, abscissa))
}

/// The scales of f as the input that holds z in equilibrium, if a constant passes from the input and from w to z.
fn equilibrium_scales(system: &Loop, input: Scale) -> Option<Ordinate> {
    let n = system.order();
    let matrix = Matrix::identity(n, n) - Matrix::from_row_slice(n, n, &system.a);
    let inverse = matrix.try_inverse()?;
    let gain = |b: &[f64]| dot(&system.cz, (&inverse * Vector::from_column_slice(b)).as_slice());
    let (of_w, of_u) = (gain(&system.bw), gain(&system.bu) + system.dzu);
    let sizes = [(&system.bw, 0.0), (&system.bu, system.dzu)].map(|(b, d)| response_size(system, b, d));
    let passes = |g: f64, size: f64| g.is_finite() && g.abs() >= SMALLEST_GAIN && g.abs() >= PASSES_CONSTANT * size;
    (passes(of_w, sizes[0]) && passes(of_u, sizes[1])).then(|| Ordinate {
        scale: -input.spread * of_w / of_u,
        slope: input.spread / of_u,
        level: input.mean,
    })
}

/// The root of the sum of squares of the impulse response to z.
fn response_size(system: &Loop, b: &[f64], direct: f64) -> f64 {
    let n = system.order();
    let (mut x, mut sum) = (b.to_vec(), direct * direct);
    for _ in 0..RESPONSE {
        sum += dot(&system.cz, &x).powi(2);
        x = (0..n).map(|i| dot(&system.a[i * n..(i + 1) * n], &x)).collect();
    }
    sum.sqrt()
}

/// No slope and no value at a point, in the output's scale.
fn tangential(system: &Loop, at: f64, output: Scale) -> Ordinate {
    let tangent = system.tangent(at);
    Ordinate {
        scale: output.spread,
        slope: -output.spread * tangent.slope,
        level: output.spread * (tangent.slope * at - tangent.value),
    }
}

/// The curve on longer breakpoints, if it is one cubic.
fn continued(system: &Loop, z: &[f64]) -> Option<KinkedSpline> {
    let spline = &system.spline;
    if spline.pieces() > 1 || !spline.kinks.is_empty() {
        return None;
    }
    let (low, high) = (spline.breakpoints()[0], spline.breakpoints()[1]);
    let more = CONTINUED_SHARE * (high - low);
    on_breakpoints(spline, &[low - more, high + more], z)
}

/// The same curve on other breakpoints, by least squares over the values of a signal; kinks stay.
pub(super) fn on_breakpoints(spline: &KinkedSpline, at: &[f64], z: &[f64]) -> Option<KinkedSpline> {
    let mut next = KinkedSpline::new(at);
    let step = (z.len() / CURVE_SAMPLES).max(1);
    let z: Vec<f64> = z.iter().step_by(step).copied().collect();
    let mut kinkless = spline.clone();
    kinkless.kinks.clear();
    let target: Vec<f64> = z.iter().map(|z| kinkless.value(*z)).collect();
    let local: Vec<_> = z.iter().map(|z| next.local(*z)).collect();
    let columns: Vec<Vec<f64>> = (0..next.c.len()).map(|j| next.by_parameter(j, &z, &local)).collect();
    next.c = least_squares(&target, &columns, 0)?.coefficients;
    next.kinks.clone_from(&spline.kinks);
    next.c.iter().all(|c| c.is_finite()).then_some(next)
}

/// The model with these units.
fn model(
    system: &Loop,
    f: Ordinate,
    z: Abscissa,
    [input, output]: [Scale; 2],
    nonlinearity: crate::nonlinearity::Curve,
) -> FeedbackModel {
    let n = system.order();
    // w = (f - slope z - level) / scale.
    let moved = -f.slope / f.scale;
    let with = |own: f64, w: f64, z: f64| own + moved * w * z;
    FeedbackModel {
        state: (0..n)
            .map(|i| {
                (0..n)
                    .map(|j| with(system.a[i * n + j], system.bw[i], system.cz[j]))
                    .collect()
            })
            .collect(),
        input_to_state: (0..n)
            .map(|i| with(system.bu[i], system.bw[i], system.dzu) / input.spread)
            .collect(),
        nonlinearity_to_state: system.bw.iter().map(|b| b / f.scale).collect(),
        state_to_output: (0..n)
            .map(|j| output.spread * with(system.cy[j], system.dyw, system.cz[j]))
            .collect(),
        state_to_nonlinearity: system.cz.iter().map(|c| z.slope * c).collect(),
        input_to_output: output.spread * with(system.dyu, system.dyw, system.dzu) / input.spread,
        nonlinearity_to_output: output.spread * system.dyw / f.scale,
        input_to_nonlinearity: z.slope * system.dzu / input.spread,
        levels: FeedbackLevels {
            input: input.mean,
            nonlinearity: f.level,
            output: output.back(system.offset),
            entering: z.level,
        },
        nonlinearity,
    }
}

/// The pointwise band of the curve by the parameters' covariance.
fn band(
    system: &Loop,
    data: &Observed,
    dependence: f64,
    [low, high]: [f64; 2],
    curve: impl Fn(&Loop, f64) -> f64 + Sync,
) -> Option<Band> {
    let problem = LoopError::new(system.clone(), data);
    let start = problem.start();
    let at = problem.linearise(&start);
    let equations = normal_equations(&at.residuals, &at.jacobian, 0);
    let uncertainty = Uncertainty::of_independent(start, &equations, data.counted(), dependence)?;
    let z = Band::points([low, high]);
    let derived = uncertainty.of(|parameters| {
        let system = problem.with(parameters);
        Some(z.iter().map(|z| curve(&system, *z)).collect())
    })?;
    Some(Band::new(z.clone(), &derived, 0))
}
