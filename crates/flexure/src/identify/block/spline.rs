//! The static nonlinearity: a cubic spline, straight on beyond its ends, and kinks.

use super::limits::{CONSTANT_RANGE, NEAREST_QUANTILES, SAMPLES_IN_COARSE_PIECE, SLIGHT_KINK};
use crate::nonlinearity::spline::basis::{CubicSplines, LocalCubics};

/// A cubic spline in B-splines, and changes of its slope at points.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::identify) struct KinkedSpline {
    /// The breakpoints with the ends four times.
    knots: Vec<f64>,
    /// One coefficient a B-spline.
    pub c: Vec<f64>,
    /// Added to the spline.
    pub kinks: Vec<Kink>,
}

/// `bend` times the positive part of x - `at`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::identify) struct Kink {
    pub at: f64,
    /// The increase of the slope at the kink.
    pub bend: f64,
}

/// The derivative that decides the density of breakpoints.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::identify) enum Roughness {
    Second,
    Fourth,
}

/// A curve's value and slope at a point.
#[derive(Debug, Clone, Copy)]
pub(in crate::identify) struct Tangent {
    pub value: f64,
    pub slope: f64,
}

impl KinkedSpline {
    /// The spline with these breakpoints, at least two, strictly increasing; all coefficients zero.
    pub fn new(breakpoints: &[f64]) -> KinkedSpline {
        let CubicSplines { knots } = CubicSplines::new(breakpoints);
        let c = vec![0.0; knots.len() - 4];
        KinkedSpline {
            knots,
            c,
            kinks: Vec::new(),
        }
    }

    /// The breakpoints.
    pub fn breakpoints(&self) -> &[f64] {
        &self.knots[3..self.knots.len() - 3]
    }

    /// A spline that is zero, with its breakpoints at quantiles of a signal; `None` if the signal has too few values.
    pub fn coarse(signal: &[f64], pieces: usize) -> Option<KinkedSpline> {
        let mut sorted = signal.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        let last = sorted.len().checked_sub(1)?;
        let (low, high) = (sorted[0], sorted[last]);
        if !((high - low).is_finite() && high - low > CONSTANT_RANGE * low.abs().max(high.abs())) {
            return None;
        }
        let inner = (1..pieces).map(|i| sorted[i * last / pieces]);
        let mut at: Vec<f64> = std::iter::once(low).chain(inner).chain([high]).collect();
        at.dedup_by(|b, a| *b - *a <= NEAREST_QUANTILES * (high - low));
        if let Some(end) = at.last_mut() {
            *end = high;
        }
        let fewest = SAMPLES_IN_COARSE_PIECE;
        (at.len() > 1).then(|| KinkedSpline::new(&thinned(&at, &sorted, fewest, fewest)))
    }

    /// The number of cubic pieces.
    pub fn pieces(&self) -> usize {
        self.breakpoints().len() - 1
    }

    /// The range of the breakpoints and of these points.
    pub fn range_with(&self, points: &[f64]) -> [f64; 2] {
        let all = self.breakpoints().iter().chain(points);
        let start = [f64::INFINITY, f64::NEG_INFINITY];
        all.fold(start, |[low, high], x| [low.min(*x), high.max(*x)])
    }

    /// The kinks' places within a range, increasing: kinks outside do not affect a signal that stays inside.
    pub fn kinks_within(&self, [low, high]: [f64; 2]) -> Vec<f64> {
        let places = self.kinks.iter().map(|k| k.at);
        let mut within: Vec<f64> = places.filter(|at| (low..=high).contains(at)).collect();
        within.sort_unstable_by(f64::total_cmp);
        within
    }

    /// The same without slight kinks, which are part of the approximation of a smooth curve.
    pub fn clear_kinks_within(&self, range: [f64; 2]) -> Vec<f64> {
        let slope = |x: &f64| self.tangent(*x, &self.local(*x)).slope.abs();
        let at = self.breakpoints().iter().chain(self.kinks.iter().map(|k| &k.at));
        let steepest = at.map(slope).fold(0.0, f64::max);
        let is_clear = |at: &f64| {
            let mut kinks = self.kinks.iter();
            kinks.any(|k| k.at == *at && k.bend.abs() >= SLIGHT_KINK * steepest)
        };
        let mut clear = self.kinks_within(range);
        clear.retain(is_clear);
        clear
    }

    /// Becomes the identity.
    pub fn straighten(&mut self) {
        self.c = self.line();
    }

    /// The coefficients of the identity: Greville's abscissas.
    pub fn line(&self) -> Vec<f64> {
        let abscissa = |j: usize| self.knots[j + 1..j + 4].iter().sum::<f64>() / 3.0;
        (0..self.c.len()).map(abscissa).collect()
    }

    /// The same curve in other units: abscissas and values times these factors. The first factor is positive.
    pub fn rescaled(&self, abscissa: f64, value: f64) -> KinkedSpline {
        let kink = |k: &Kink| Kink {
            at: k.at * abscissa,
            bend: k.bend * value / abscissa,
        };
        KinkedSpline {
            knots: self.knots.iter().map(|x| x * abscissa).collect(),
            c: self.c.iter().map(|c| c * value).collect(),
            kinks: self.kinks.iter().map(kink).collect(),
        }
    }

    /// The largest size of a breakpoint.
    pub fn span(&self) -> f64 {
        self.breakpoints().iter().fold(0.0, |m, x| x.abs().max(m))
    }

    /// The B-splines at `x`; beyond the ends, their tangents at the ends.
    pub fn local(&self, x: f64) -> LocalCubics {
        let end = x.clamp(self.knots[0], self.knots[self.knots.len() - 1]);
        let mut local = LocalCubics::new(&self.knots, end);
        for (v, d) in local.at.values.iter_mut().zip(&local.slopes) {
            *v += (x - end) * d;
        }
        local
    }

    /// The spline without kinks from the B-splines at a point.
    fn combine(&self, local: &LocalCubics) -> Tangent {
        let c = &self.c[local.at.first..local.at.first + 4];
        let dot = |v: &[f64; 4]| c.iter().zip(v).map(|(c, v)| c * v).sum::<f64>();
        Tangent {
            value: dot(&local.at.values),
            slope: dot(&local.slopes),
        }
    }

    pub fn value(&self, x: f64) -> f64 {
        self.tangent(x, &self.local(x)).value
    }

    /// Value and slope at `x` from the B-splines there.
    pub fn tangent(&self, x: f64, local: &LocalCubics) -> Tangent {
        let mut tangent = self.combine(local);
        for kink in self.kinks.iter().filter(|k| x > k.at) {
            tangent.value += kink.bend * (x - kink.at);
            tangent.slope += kink.bend;
        }
        tangent
    }

    /// The number of parameters.
    pub fn count(&self) -> usize {
        self.c.len() + 2 * self.kinks.len()
    }

    /// The coefficients, then every kink's place and bend.
    pub fn parameters(&self) -> impl Iterator<Item = f64> {
        let kinks = self.kinks.iter().flat_map(|k| [k.at, k.bend]);
        self.c.iter().copied().chain(kinks)
    }

    /// Takes other [`parameters`](Self::parameters).
    pub fn set(&mut self, p: &[f64]) {
        let (c, kinks) = p.split_at(self.c.len());
        self.c.copy_from_slice(c);
        for (kink, p) in self.kinks.iter_mut().zip(kinks.chunks_exact(2)) {
            (kink.at, kink.bend) = (p[0], p[1]);
        }
    }

    /// The derivative of the values at `x`, where the B-splines are `local`, by parameter `j`.
    pub fn by_parameter(&self, j: usize, x: &[f64], local: &[LocalCubics]) -> Vec<f64> {
        let Some(of_kinks) = j.checked_sub(self.c.len()) else {
            let value = |l: &LocalCubics| match j.checked_sub(l.at.first) {
                Some(k) if k < 4 => l.at.values[k],
                _ => 0.0,
            };
            return local.iter().map(value).collect();
        };
        let Kink { at, bend } = self.kinks[of_kinks / 2];
        match of_kinks % 2 {
            0 => x.iter().map(|x| if *x > at { -bend } else { 0.0 }).collect(),
            _ => x.iter().map(|x| (x - at).max(0.0)).collect(),
        }
    }

    /// The index of the middle B-spline; in sums with their own level, a constant replaces it.
    pub fn middle(&self) -> usize {
        self.c.len() / 2
    }

    /// All B-splines except the middle one at the values of a signal.
    pub fn others_at(&self, signal: &[f64]) -> Vec<Vec<f64>> {
        let local: Vec<LocalCubics> = signal.iter().map(|x| self.local(*x)).collect();
        let others = (0..self.c.len()).filter(|j| *j != self.middle());
        others.map(|j| self.by_parameter(j, signal, &local)).collect()
    }

    /// Takes the coefficients of all B-splines except the middle one, whose coefficient becomes zero.
    pub fn set_others(&mut self, mut c: Vec<f64>) {
        c.insert(self.middle(), 0.0);
        self.c = c;
    }

    /// The parameters that the values are linear in: all except the kinks' places.
    pub fn linear_parameters(&self) -> impl Iterator<Item = usize> {
        let splines = self.c.len();
        (0..splines).chain((0..self.kinks.len()).map(move |k| splines + 2 * k + 1))
    }

    /// Takes other values of the parameters that the values are linear in.
    pub fn set_linear(&mut self, mut p: Vec<f64>) {
        let bends = p.split_off(self.c.len());
        self.c = p;
        self.kinks
            .iter_mut()
            .zip(bends)
            .for_each(|(kink, bend)| kink.bend = bend);
    }

    /// `intervals + 1` breakpoints that divide the curve's own roughness evenly (de Boor 2001, chapter XII), dense where the derivative of
    /// the given order is large. A share `even` of them is spread evenly over the range.
    ///
    /// The density is the root, of the given order, of the derivative's size: with fourth derivatives it is the best one for a smooth
    /// curve, with second derivatives it finds kinks.
    pub fn denser(&self, intervals: usize, order: Roughness, even: f64) -> Vec<f64> {
        let t = self.breakpoints();
        let n = t.len() - 1;
        let mut density: Vec<f64> = match order {
            Roughness::Second => (0..n)
                .map(|i| (0.5 * (self.second(t[i]).abs() + self.second(t[i + 1]).abs())).sqrt())
                .collect(),
            Roughness::Fourth => self.fourth().into_iter().map(|d| d.sqrt().sqrt()).collect(),
        };
        let widths: Vec<f64> = t.windows(2).map(|w| w[1] - w[0]).collect();
        let total: f64 = density.iter().zip(&widths).map(|(d, h)| d * h).sum();
        let length = t[n] - t[0];
        let usable = total > 0.0 && total.is_finite();
        for d in &mut density {
            *d = if usable {
                (1.0 - even) * *d / total + even / length
            } else {
                1.0 / length
            };
        }
        let (mut at, mut sum, mut i) = (vec![t[0]], 0.0, 0);
        for k in 1..intervals {
            let goal = k as f64 / intervals as f64;
            while i + 1 < n && sum + density[i] * widths[i] < goal {
                sum += density[i] * widths[i];
                i += 1;
            }
            at.push(t[i] + ((goal - sum) / density[i]).clamp(0.0, widths[i]));
        }
        at.push(t[n]);
        at
    }

    /// The size of the fourth derivative in every interval: the third one's jumps, spread over the neighbours.
    fn fourth(&self) -> Vec<f64> {
        let t = self.breakpoints();
        let n = t.len() - 1;
        let third: Vec<f64> = (0..n).map(|i| self.third(i)).collect();
        let jump = |k: usize| {
            if k == 0 || k == n {
                0.0
            } else {
                2.0 * (third[k] - third[k - 1]).abs() / (t[k + 1] - t[k - 1])
            }
        };
        (0..n).map(|i| jump(i).max(jump(i + 1))).collect()
    }

    /// The second derivative at a breakpoint `x`.
    fn second(&self, x: f64) -> f64 {
        let t = &self.knots;
        let i = t[4..self.c.len()].partition_point(|&k| k <= x);
        let d = |j: usize| 3.0 * (self.c[j] - self.c[j - 1]) / (t[j + 3] - t[j]);
        let dd = |j: usize| 2.0 * (d(j) - d(j - 1)) / (t[j + 2] - t[j]);
        // It is linear in the interval: the two coefficients are its values at the ends.
        let share = (x - t[i + 3]) / (t[i + 4] - t[i + 3]);
        (1.0 - share) * dd(i + 2) + share * dd(i + 3)
    }

    /// The third derivative in interval `i`.
    fn third(&self, i: usize) -> f64 {
        let t = &self.knots;
        let mut d: Vec<f64> = self.c[i..i + 4].to_vec();
        for degree in (1..4).rev() {
            // Coefficients i + 4 - len .. of the derivative's B-splines of one degree less.
            let first = i + 4 - d.len() + 1;
            d = d
                .windows(2)
                .enumerate()
                .map(|(k, w)| {
                    let j = first + k;
                    degree as f64 * (w[1] - w[0]) / (t[j + degree] - t[j])
                })
                .collect();
        }
        d[0]
    }
}

/// Breakpoints such that every interval has at least `fewest` of the sorted samples. The outermost intervals have at least
/// `fewest_outside`, since their slope continues beyond the data.
pub(in crate::identify) fn thinned(
    breakpoints: &[f64],
    sorted: &[f64],
    fewest: usize,
    fewest_outside: usize,
) -> Vec<f64> {
    let last = breakpoints.len() - 1;
    let total = sorted.len();
    let mut kept = vec![breakpoints[0]];
    let mut count = None;
    for &x in &breakpoints[1..last] {
        let here = sorted.partition_point(|&v| v < x);
        let need = count.map_or(fewest_outside, |c: usize| c + fewest);
        if here >= need && total >= here + fewest_outside {
            kept.push(x);
            count = Some(here);
        }
    }
    kept.push(breakpoints[last]);
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wavy() -> KinkedSpline {
        let mut spline = KinkedSpline::new(&[-1.0, -0.2, 0.1, 2.0]);
        spline.c.copy_from_slice(&[0.3, -1.0, 2.0, 0.5, 0.1, -0.7]);
        spline
    }

    #[test]
    fn b_splines_sum_to_one_and_slopes_are_derivatives_inside_and_beyond() {
        let spline = wavy();
        let bends = [(-0.3, 0.7), (0.2, -1.1)];
        let kinked = KinkedSpline {
            kinks: bends.map(|(at, bend)| Kink { at, bend }).to_vec(),
            ..spline.clone()
        };
        for x in [-1.5, -0.999, -0.5, -0.1, 0.05, 1.0, 1.999, 3.0] {
            let local = spline.local(x);
            assert!((local.at.values.iter().sum::<f64>() - 1.0).abs() < 1e-12, "{x}");
            let slope = spline.combine(&local).slope;
            let more = kinked.value(x) - spline.value(x);
            let by_hand: f64 = bends.iter().map(|(at, bend)| bend * (x - at).max(0.0)).sum();
            let steeper: f64 = bends.iter().map(|(at, bend)| if x > *at { *bend } else { 0.0 }).sum();
            assert!((more - by_hand).abs() < 1e-12, "{x}");
            let whole = kinked.tangent(x, &local).slope;
            assert!((whole - slope - steeper).abs() < 1e-12, "{x}");
            let difference = (spline.value(x + 1e-6) - spline.value(x - 1e-6)) / 2e-6;
            assert!((slope - difference).abs() < 1e-6, "{x}: {slope} {difference}");
        }
        assert!((spline.value(3.0) + spline.value(2.2) - 2.0 * spline.value(2.6)).abs() < 1e-12);
    }

    #[test]
    fn second_and_third_derivatives() {
        let spline = wavy();
        let (x, h) = (0.1, 1e-4);
        let d2 = (spline.value(x + h) - 2.0 * spline.value(x) + spline.value(x - h)) / (h * h);
        assert!(
            (spline.second(x) - d2).abs() < 1e-2 * d2.abs(),
            "{} {d2}",
            spline.second(x)
        );
        let value = |k: f64| spline.value(0.5 + 0.1 * k);
        let d3 = (value(3.0) - 3.0 * value(2.0) + 3.0 * value(1.0) - value(0.0)) / 1e-3;
        assert!(
            (spline.third(2) - d3).abs() < 1e-6 * d3.abs().max(1.0),
            "{} {d3}",
            spline.third(2)
        );
    }

    #[test]
    fn breakpoints_gather_where_it_bends() {
        // max(x, 0) at Greville's abscissas.
        let at: Vec<f64> = (0..=20).map(|i| -1.0 + 0.1 * f64::from(i)).collect();
        let mut spline = KinkedSpline::new(&at);
        for j in 0..spline.c.len() {
            spline.c[j] = (spline.knots[j + 1..j + 4].iter().sum::<f64>() / 3.0).max(0.0);
        }
        for order in [Roughness::Second, Roughness::Fourth] {
            let next = spline.denser(10, order, 0.3);
            assert_eq!(next.len(), 11);
            assert!(next.windows(2).all(|w| w[1] > w[0]), "{next:?}");
            let near = next.iter().filter(|x| x.abs() < 0.35).count();
            assert!(near >= 6, "{order:?} {next:?}");
        }
        let even = KinkedSpline::new(&at).denser(4, Roughness::Second, 0.3);
        assert!(
            (even[1] + 0.5).abs() < 1e-12 && (even[3] - 0.5).abs() < 1e-12,
            "{even:?}"
        );
    }

    #[test]
    fn coarse_breakpoints_are_distinct_even_for_few_levels() {
        let levels: Vec<f64> = (0..300).map(|i| f64::from(i % 3)).collect();
        let spline = KinkedSpline::coarse(&levels, 5).unwrap();
        assert!(spline.breakpoints().windows(2).all(|w| w[1] > w[0]), "{spline:?}");
        assert!(KinkedSpline::coarse(&[2.0; 50], 5).is_none());
    }

    #[test]
    fn thin_pieces_are_merged() {
        let sorted: Vec<f64> = (0..100).map(|i| f64::from(i) / 100.0).collect();
        let at = [0.0, 0.05, 0.12, 0.2, 0.5, 0.52, 0.6, 0.97, 0.99];
        let kept = thinned(&at, &sorted, 8, 10);
        assert_eq!(kept, [0.0, 0.12, 0.2, 0.5, 0.6, 0.99]);
    }
}
