//! Blocks in the record's units and the conventional scale.

use super::super::checks::few_levels;
use super::limits::{CONSTANT_SPREAD, CURVE_POINTS, NEAREST_POINTS, NO_STATIC_GAIN};
use super::prepared::Prepared;
use super::rational::Rational;
use super::spline::KinkedSpline;
use super::system::Branch;
use crate::error::{Error, Result};
use crate::identify::result::{BlockKind, LinearBlock, NamedBlock, StaticBlock};
use crate::linear::TransferFunction;
use crate::linear::correlation::{mean, variance};
use crate::nonlinearity::{Curve, Outside};
use crate::sort;

/// Evenly spaced points: those of a tabulated nonlinearity in addition to its breakpoints.
fn even(low: f64, high: f64) -> impl Iterator<Item = f64> {
    (0..CURVE_POINTS).map(move |i| low + (high - low) * i as f64 / (CURVE_POINTS - 1) as f64)
}

/// The points at which a nonlinearity is tabulated over a range: evenly spaced ones, its breakpoints and its kinks.
fn abscissas(spline: &KinkedSpline, [low, high]: [f64; 2]) -> Vec<f64> {
    let mut at: Vec<f64> = even(low, high).chain(spline.breakpoints().iter().copied()).collect();
    at.extend(spline.kinks_within([low, high]));
    at.sort_unstable_by(f64::total_cmp);
    at.dedup_by(|b, a| *b - *a <= NEAREST_POINTS * (high - low));
    at
}

/// The table of a nonlinearity at these points, with straight lines beyond its ends; both functions are applied to the points.
fn table(
    points: impl Iterator<Item = f64>,
    abscissa: impl Fn(f64) -> f64,
    ordinate: impl Fn(f64) -> f64,
) -> Result<Curve> {
    let mut points: Vec<(f64, f64)> = points.map(|x| (abscissa(x), ordinate(x))).collect();
    sort::by_key(&mut points, |p| p.0);
    points.dedup_by(|b, a| b.0 <= a.0);
    let (x, y) = points.into_iter().unzip();
    Curve::new(x, y, Outside::Linear)
}

/// Breakpoints in another unit, increasing.
fn mapped(breakpoints: &[f64], abscissa: impl Fn(f64) -> f64) -> Vec<f64> {
    let mut mapped: Vec<f64> = breakpoints.iter().map(|x| abscissa(*x)).collect();
    mapped.sort_unstable_by(f64::total_cmp);
    mapped
}

/// Linear, static, linear, in the record's units and the conventional scale.
pub(in crate::identify) struct Blocks {
    pub front: TransferFunction,
    pub nonlinearity: BlockKind,
    pub back: TransferFunction,
    /// Front, nonlinearity and back of a second branch, whose output is added.
    ///
    /// A nonlinearity in continuous time bends the signal between the samples too, and sampling folds this back into the output's band. The
    /// second front has the poles of the first and gives the intermediate signal at an instant between the samples, half-way at the start
    /// of the search; the second back has the poles of the first. The static gains of both backs then sum to one. The nonlinearity is the
    /// same; its abscissas differ if the input has a mean and the fronts' static gains differ.
    pub between_samples: Option<[BlockKind; 3]>,
    pub offset: f64,
}

impl Blocks {
    /// The branch of prepared signals; the delay goes to the front.
    ///
    /// The nonlinearity is tabulated over the range of the fit's samples and its breakpoints.
    pub fn new(s: &Branch, prepared: &Prepared) -> Result<Blocks> {
        let Prepared { output, data, .. } = prepared;
        let delay = prepared.delay + s.delay;
        let input = prepared.inputs[s.input];
        let intermediate: Vec<Vec<f64>> = s.intermediate(&data.u).collect();
        let through: Vec<f64> = intermediate[0].iter().map(|w| s.spline.value(*w)).collect();
        let front_gain = Gain::conventional(&s.front, &data.u[s.input], data.from)?;
        let back_gain = Gain::conventional(&s.whole_back(), &through, data.from)?;
        // The scaled front's output is (gain / spread) times the new one's, minus the contribution of the input's mean.
        let abscissa =
            |x: f64, front: &Rational| x * input.spread / front_gain.value + front.static_gain() * input.mean;
        let offset = output.mean + output.spread * s.offset;
        let (level, offset) = if back_gain.is_static {
            (offset, 0.0)
        } else {
            (0.0, offset)
        };
        let ordinate = |x: f64| level + output.spread * back_gain.value * s.spline.value(x);
        let entering: Vec<f64> = intermediate.iter().flat_map(|w| &w[data.from..]).copied().collect();
        let range = s.spline.range_with(&entering);
        let inner = abscissas(&s.spline, range);
        let kinks = s.spline.clear_kinks_within(range);
        let nonlinearity = |front: &Rational| {
            let curve = table(inner.iter().copied(), |x| abscissa(x, front), ordinate)?;
            let [breakpoints, kinks] = [s.spline.breakpoints(), &kinks].map(|at| mapped(at, |x| abscissa(x, front)));
            Ok::<_, Error>(BlockKind::Static(StaticBlock::spline(curve, breakpoints, kinks)))
        };
        let front = front_gain.divided(&s.front.b, &s.front);
        let between_samples = (s.between.as_ref())
            .map(|between| {
                let front = front_gain.divided(&between.front, &s.front);
                let back = back_gain.divided(&between.back, &s.back);
                Ok::<_, Error>([
                    LinearBlock::of(front.transfer_function(delay)?),
                    nonlinearity(&front)?,
                    LinearBlock::of(back.transfer_function(0)?),
                ])
            })
            .transpose()?;
        Ok(Blocks {
            nonlinearity: nonlinearity(&front)?,
            front: front.transfer_function(delay)?,
            back: back_gain.divided(&s.back.b, &s.back).transfer_function(0)?,
            between_samples,
            offset,
        })
    }

    /// The blocks with their names.
    pub fn named(self) -> Vec<NamedBlock> {
        let mut named = vec![
            NamedBlock::new("front", "Front linear part", LinearBlock::of(self.front)),
            NamedBlock::new("nonlinearity", "Nonlinearity", self.nonlinearity),
            NamedBlock::new("back", "Back linear part", LinearBlock::of(self.back)),
        ];
        if let Some([front, nonlinearity, back]) = self.between_samples {
            let second = [
                NamedBlock::new("intersample_front", "Front, between the samples", front),
                NamedBlock::new(
                    "intersample_nonlinearity",
                    "Nonlinearity, between the samples",
                    nonlinearity,
                ),
                NamedBlock::new("intersample_back", "Back, between the samples", back),
            ];
            named.extend(second.map(|block| NamedBlock {
                between_samples: true,
                ..block
            }));
        }
        named
    }
}

/// The divisor of a linear block in the conventional scale.
struct Gain {
    value: f64,
    is_static: bool,
}

impl Gain {
    /// The static gain, or the gain of the standard deviation from sample `from` of a signal on, if the static gain is nearly zero compared
    /// with that; 1 for a block that passes nothing.
    fn conventional(g: &Rational, entering: &[f64], from: usize) -> Result<Gain> {
        let spread = |signal: &[f64]| variance(&signal[from..]).sqrt();
        // Around its mean, since the filter starts at rest.
        let level = mean(&entering[from..]);
        let around: Vec<f64> = entering.iter().map(|x| x - level).collect();
        // Nothing is known of this gain where the input is constant.
        let is_constant = spread(entering) <= CONSTANT_SPREAD * level.abs();
        let passed = Some(spread(&g.run(&around)) / spread(entering));
        let passed = passed.filter(|gain| !is_constant && gain.is_finite() && *gain > 0.0);
        let fixed = g.static_gain();
        if fixed.is_finite() && fixed != 0.0 && passed.is_none_or(|gain| fixed.abs() >= NO_STATIC_GAIN * gain) {
            return Ok(Gain {
                value: fixed,
                is_static: true,
            });
        }
        // The sign of the largest value of the impulse response.
        let response = (g.transfer_function(0)?).impulse_response(g.settling(0.01).min(10_000));
        let largest = (response.iter()).fold(0.0_f64, |m, v| if v.abs() > m.abs() { *v } else { m });
        Ok(Gain {
            value: passed.map_or(1.0, |gain| gain.copysign(largest)),
            is_static: false,
        })
    }

    /// A transfer function: the numerator divided by the gain, over the poles of a system.
    fn divided(&self, b: &[f64], g: &Rational) -> Rational {
        g.with_numerator(b.iter().map(|b| b / self.value).collect())
    }
}

/// A linear block in the conventional scale, and its divisor.
pub(in crate::identify) struct Normalised {
    pub linear: TransferFunction,
    pub gain: f64,
}

impl Normalised {
    /// The block after a delay; its input, and the first sample of that to look at.
    pub fn new(g: &Rational, delay: usize, entering: &[f64], from: usize) -> Result<Normalised> {
        let gain = Gain::conventional(g, entering, from)?;
        Ok(Normalised {
            linear: gain.divided(&g.b, g).transfer_function(delay)?,
            gain: gain.value,
        })
    }
}

/// A nonlinearity as a table over its input. If the input has few levels, the table has only these, since nothing is known elsewhere. Both
/// functions are applied to the spline's own coordinates.
pub(in crate::identify) fn tabulated(
    spline: &KinkedSpline,
    entering: &[f64],
    abscissa: impl Fn(f64) -> f64,
    ordinate: impl Fn(f64) -> f64,
) -> Result<StaticBlock> {
    let range = spline.range_with(entering);
    let (points, kinks) = match few_levels(entering) {
        Some(levels) if levels.len() > 1 => (levels, Vec::new()),
        _ => (abscissas(spline, range), spline.clear_kinks_within(range)),
    };
    Ok(StaticBlock::spline(
        table(points.into_iter(), &abscissa, |x| ordinate(spline.value(x)))?,
        mapped(spline.breakpoints(), &abscissa),
        mapped(&kinks, abscissa),
    ))
}

#[cfg(test)]
mod tests {
    use super::super::spline::Kink;
    use super::*;

    fn straight(breakpoints: &[f64], kinks: &[(f64, f64)]) -> KinkedSpline {
        let mut spline = KinkedSpline::new(breakpoints);
        spline.straighten();
        spline.kinks = kinks.iter().map(|&(at, bend)| Kink { at, bend }).collect();
        spline
    }

    fn table_of(spline: &KinkedSpline, entering: &[f64]) -> StaticBlock {
        tabulated(spline, entering, |x| 3e-7 * x, |y| 2e6 * y).unwrap()
    }

    #[test]
    fn a_block_has_unit_static_gain_or_the_spread_of_its_input() {
        let slow: Vec<f64> = (0..400).map(|i| 3.0 + (f64::from(i) * 0.05).sin()).collect();
        let spread = |signal: &[f64]| variance(&signal[100..]).sqrt();
        // A difference passes no constant.
        let difference = Rational::pass().with_numerator(vec![-2.0, 2.0]);
        let found = Normalised::new(&difference, 0, &slow, 100).unwrap();
        assert!(found.gain < 0.0);
        assert!((spread(&found.linear.simulate(&slow)) / spread(&slow) - 1.0).abs() < 1e-9);
        // A narrow resonance that the input does not excite: its peak is 500 times its static gain.
        let resonance = Rational::from_polynomials(vec![0.5], &[1.0, 0.0, 0.998]).unwrap();
        let found = Normalised::new(&resonance, 0, &slow, 100).unwrap();
        assert!((found.linear.static_gain() - 1.0).abs() < 1e-12);
        assert!((found.gain - 0.5 / 1.998).abs() < 1e-12);
        // What passes nothing, and what nothing enters, keep their scale or have unit static gain.
        let nothing = Rational::pass().with_numerator(vec![0.0]);
        assert_eq!(Normalised::new(&nothing, 0, &slow, 0).unwrap().gain, 1.0);
        for level in [0.0, 0.1] {
            assert_eq!(
                Normalised::new(&resonance, 0, &[level; 50], 0).unwrap().gain,
                found.gain
            );
        }
    }

    #[test]
    fn a_table_goes_on_as_its_curve_does() {
        let entering: Vec<f64> = (0..=50).map(|i| -1.3 + f64::from(i) * 0.1).collect();
        let last = entering[50];
        // An end that differs from the samples' only by rounding, and kinks beyond the breakpoints, one of them beyond the samples.
        let spline = straight(
            &[-1.3, 0.4, last * (1.0 - 3e-14)],
            &[(3.2, -1.0), (20.0, 5.0), (-9.0, 0.0)],
        );
        let found = table_of(&spline, &entering);
        let x = found.curve.x();
        assert!(x[x.len() - 1] >= 3e-7 * last * (1.0 - 1e-9) && x[x.len() - 1] < 3e-7 * 3.8);
        for at in [-2.0, -1.3, 0.0, 3.1999, 3.3, 3.7, 5.0] {
            let want = 2e6 * (at - (at - 3.2_f64).max(0.0));
            assert!((found.curve.value(3e-7 * at) - want).abs() < 1e-3, "{at}");
        }
        assert_eq!(found.kinks.len(), 1);
        assert!((found.kinks[0] - 3e-7 * 3.2).abs() < 1e-15);
    }

    #[test]
    fn of_few_levels_only_these_are_tabulated() {
        let mut spline = straight(&[-1.0, 1.0], &[]);
        // The coefficients that two levels do not determine.
        (spline.c[1], spline.c[2]) = (1e90, -1e90);
        let found = table_of(&spline, &[1.0, -1.0, -1.0, 1.0]);
        assert_eq!(found.curve.x(), [-3e-7, 3e-7]);
        assert!(found.curve.value(0.0).abs() < 1e-3 && (found.curve.value(3e-7) - 2e6).abs() < 1e-3);
    }
}
