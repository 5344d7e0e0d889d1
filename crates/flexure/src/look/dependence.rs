//! Which column depends on which, and with what delay.
//!
//! Both columns of a pair are whitened by separate autoregressions (Haugh 1976), so their correlation at a lag does not depend on that at
//! other lags. For independent columns it has a standard deviation of $1/\sqrt n$. A white column a that acts on b through a system of
//! delay s correlates with b at the lags from s on, and at no negative lag unless b acts back on a (Pierce & Haugh 1977).
//!
//! The statistic at lag j, $z_j = \sum_t a_t b_{t+j} / (\sum_t a_t^2 b_{t+j}^2)^{1/2}$, is self-normalised: it is also normal for columns
//! with bursts or heavy tails, and a single pair of outliers makes it at most 1. The level is divided by the number of tests, over all
//! lags, time scales and pairs of columns (Bonferroni).
//!
//! If a slow system is sampled fast, its output changes little between samples, and noise hides the changes. So means of 4, 16, 64, ...
//! samples are tested too: they show slow systems and long delays.
//!
//! If no linear dependence is seen, the square of the cause's deviation from its mean replaces the cause: an even nonlinearity shows no
//! correlation with the cause itself.

use super::limits::{
    COUNTS, FEEDBACK, FEWEST_BLOCKS, FINER, LAGS, LEVEL, MOST_SAMPLES, MOST_SCALES, MOST_WORK, PASSES,
    SAMPLES_PER_COEFFICIENT, SCALE,
};
use crate::distributions::{erfc, erfc_inverse};
use crate::linear::TransferFunction;
use crate::linear::autoregression::whitening;
use crate::linear::correlation::{about_mean, cross_covariance, mean, variance};
use crate::parallel;

/// A dependence between two columns.
#[derive(Debug, Clone, PartialEq)]
pub struct Dependence {
    /// The column that comes first, as an index of the record's columns.
    pub cause: usize,
    /// The column that follows, as an index of the record's columns.
    pub effect: usize,
    /// Whether the cause itself shows the dependence, or only its square.
    pub kind: Kind,
    /// Which column follows which, according to the lags.
    pub direction: Direction,
    /// The first lag of at least a tenth of the largest correlation, samples; a multiple of `block`.
    pub delay: usize,
    /// The samples that were averaged before the dependence was seen: the delay is known to within this number.
    pub block: usize,
    /// The correlation that is largest in absolute value.
    pub correlation: f64,
    /// The probability of a statistic as large as this one, at any lag of any pair, if columns are independent.
    pub p_value: f64,
    /// The share of the effect's power that is coherent with the cause: the most that any linear system could explain; 0 for a dependence
    /// that only the square shows.
    pub coherent: f64,
    /// The correlations over the lags.
    pub correlations: Correlations,
}

/// How a dependence was seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// In the correlation of the two columns.
    Linear,
    /// Only in the correlation with the square of the cause's deviation from its mean.
    Square,
}

/// Which column follows which.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// The effect follows the cause.
    Forward,
    /// Both change in the same sample: the lags do not show which one is the cause.
    AtOnce,
    /// Each column follows the other: feedback, or both follow a third one. A periodic input, such as a multisine, can look so too: its past
    /// tells its future, and so does the output's past.
    Both,
}

/// Correlations of two whitened columns.
#[derive(Debug, Clone, PartialEq)]
pub struct Correlations {
    /// The lags of the effect after the cause, samples.
    pub lags: Vec<f64>,
    /// The correlation at each.
    pub values: Vec<f64>,
    /// Half the width of the range that contains all correlations of independent columns with a probability of 99 %.
    pub limit: f64,
}

/// A column at one time scale, whitened.
pub(super) struct Whitened {
    pub signal: Option<Vec<f64>>,
    square: Option<Vec<f64>>,
}

/// A time scale: means of this many samples.
pub(super) struct TimeScale {
    pub block: usize,
    /// The samples that are used.
    pub range: std::ops::Range<usize>,
}

/// The dependences among signals without missing samples, named by their indexes; the strongest evidence first.
pub(super) fn dependences(signals: &[(usize, &[f64])]) -> Vec<Dependence> {
    let samples = signals.first().map_or(0, |s| s.1.len());
    let count = signals.len();
    let pairs: Vec<(usize, usize)> = (0..count).flat_map(|i| (0..i).map(move |j| (j, i))).collect();
    let scales = scales(samples, pairs.len());
    // For every pair: all lags of the columns themselves, and the lags from 0 on for the square of either one.
    let tests = (pairs.len() * scales.len() * (4 * LAGS + 3)).max(1) as f64;
    let columns: Vec<Vec<Whitened>> = scales
        .iter()
        .map(|scale| parallel::map(count, |i| whitened(&signals[i].1[scale.range.clone()], scale.block)))
        .collect();
    let found = parallel::map(pairs.len(), |p| {
        let (i, j) = pairs[p];
        let seen = |pick: &dyn Fn(&[Whitened]) -> Option<Statistics>| best(&scales, &columns, tests, pick);
        let linear = seen(&|c| Statistics::two_sided(c[i].signal.as_ref()?, c[j].signal.as_ref()?));
        if let Some((scale, statistics)) = linear {
            return vec![statistics.dependence([signals[i], signals[j]], &scales[scale], Kind::Linear, tests)];
        }
        let squares = [(i, j), (j, i)].into_iter().filter_map(|(a, b)| {
            let (scale, statistics) = seen(&|c| Statistics::from_zero(c[a].square.as_ref()?, c[b].signal.as_ref()?))?;
            Some(statistics.dependence([signals[a], signals[b]], &scales[scale], Kind::Square, tests))
        });
        squares.collect()
    });
    let mut found: Vec<Dependence> = found.into_iter().flatten().collect();
    crate::sort::by_key(&mut found, |d| -d.coherent);
    found
}

/// The time scales of a record. If the record is long or has many pairs, only its middle is used.
pub(super) fn scales(samples: usize, pairs: usize) -> Vec<TimeScale> {
    let most = (MOST_WORK / pairs.max(1)).clamp(16 * FEWEST_BLOCKS, MOST_SAMPLES);
    let scale = |power| {
        let block = SCALE.pow(power);
        let blocks = (samples / block).min(most);
        let start = (samples - blocks * block) / 2;
        (blocks >= FEWEST_BLOCKS || block == 1).then(|| TimeScale {
            block,
            range: start..start + blocks * block,
        })
    };
    (0..MOST_SCALES as u32).map_while(scale).collect()
}

/// The samples on which all pairs of columns are compared: of a long record, the middle.
pub(super) fn stretch(samples: usize, columns: usize) -> std::ops::Range<usize> {
    scales(samples, columns * columns.saturating_sub(1) / 2)[0]
        .range
        .clone()
}

/// A column and its square as whitened means of blocks; `None` for one that does not vary.
pub(super) fn whitened(samples: &[f64], block: usize) -> Whitened {
    let deviations = about_mean(samples);
    let squares: Vec<f64> = deviations.iter().map(|v| v * v).collect();
    Whitened {
        signal: white(&blocks(&deviations, block)),
        square: white(&blocks(&squares, block)),
    }
}

/// Means of `block` samples.
pub(super) fn blocks(samples: &[f64], block: usize) -> Vec<f64> {
    samples.chunks_exact(block).map(mean).collect()
}

/// A signal whitened by several autoregressions in sequence, since the first one leaves much of a smooth signal; `None` if it does not
/// vary.
fn white(signal: &[f64]) -> Option<Vec<f64>> {
    let largest = signal.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    if !(variance(signal).sqrt() > 1e-9 * largest) {
        return None;
    }
    let mut white = about_mean(signal);
    for _ in 0..PASSES {
        let polynomial = whitening(&white, SAMPLES_PER_COEFFICIENT);
        let order = polynomial.len() - 1;
        if order == 0 {
            break;
        }
        white = TransferFunction::monic(polynomial, Vec::new()).simulate(&white);
        // The first samples have no earlier ones.
        white[..order].fill(0.0);
    }
    (variance(&white) > 0.0).then_some(white)
}

/// Correlations with their statistics; the lag of the first one is `first`.
pub(super) struct Statistics {
    first: i64,
    correlation: Vec<f64>,
    z: Vec<f64>,
    samples: usize,
}

impl Statistics {
    /// The statistics at lags from 0 on, with b later.
    pub fn from_zero(a: &[f64], b: &[f64]) -> Option<Self> {
        let lags = LAGS.min(a.len() / 4);
        let covariance = cross_covariance(a, b, lags);
        let square = |v: &[f64]| -> Vec<f64> { v.iter().map(|x| x * x).collect() };
        let (aa, bb) = (square(a), square(b));
        let level = mean(&aa) * mean(&bb);
        let squares = cross_covariance(&aa, &bb, lags);
        let z = |(c, s): (&f64, &f64)| {
            let spread = (s + level).max(0.0).sqrt();
            if spread > 0.0 {
                c * (a.len() as f64).sqrt() / spread
            } else {
                0.0
            }
        };
        (level > 0.0).then(|| Statistics {
            first: 0,
            z: covariance.iter().zip(&squares).map(z).collect(),
            correlation: covariance.iter().map(|c| c / level.sqrt()).collect(),
            samples: a.len(),
        })
    }

    /// The statistics at positive and negative lags.
    fn two_sided(a: &[f64], b: &[f64]) -> Option<Self> {
        let (after, before) = (Statistics::from_zero(a, b)?, Statistics::from_zero(b, a)?);
        let joined = |before: Vec<f64>, after: Vec<f64>| before.into_iter().skip(1).rev().chain(after).collect();
        Some(Statistics {
            first: 1 - before.z.len() as i64,
            correlation: joined(before.correlation, after.correlation),
            z: joined(before.z, after.z),
            samples: a.len(),
        })
    }

    fn largest(&self) -> f64 {
        self.z.iter().fold(0.0, |m, z| m.max(z.abs()))
    }

    /// The dependence that these statistics show: of the second signal on the first, or the other way round.
    fn dependence(mut self, signals: [(usize, &[f64]); 2], scale: &TimeScale, kind: Kind, tests: f64) -> Dependence {
        let p_value = (tests * erfc(self.largest() / std::f64::consts::SQRT_2)).min(1.0);
        let limit = critical(tests) / (self.samples as f64).sqrt();
        let [mut cause, mut effect] = signals;
        let size = |s: &Statistics, of: &dyn Fn(i64) -> bool| {
            let lags = s.correlation.iter().zip(s.first..);
            lags.filter(|(_, lag)| of(*lag))
                .fold(0.0_f64, |m, (r, _)| m.max(r.abs()))
        };
        let (earlier, later) = (size(&self, &|lag| lag < 0), size(&self, &|lag| lag > 0));
        if earlier > later {
            self.correlation.reverse();
            self.first = 1 - self.correlation.len() as i64 - self.first;
            std::mem::swap(&mut cause, &mut effect);
        }
        let all = size(&self, &|_| true);
        let (against, along) = (earlier.min(later), earlier.max(later));
        let counts = |r: f64| r > limit && r > COUNTS * all;
        let direction = match (counts(along), counts(against) && against > FEEDBACK * along) {
            (_, true) => Direction::Both,
            (true, false) => Direction::Forward,
            (false, false) if kind == Kind::Square => Direction::Forward,
            (false, false) => Direction::AtOnce,
        };
        // If the lags show no order, the order of the columns is used.
        if direction != Direction::Forward && cause.0 > effect.0 {
            self.correlation.reverse();
            self.first = 1 - self.correlation.len() as i64 - self.first;
            std::mem::swap(&mut cause, &mut effect);
        }
        let from_zero = &self.correlation[(-self.first) as usize..];
        let delay = from_zero.iter().position(|r| counts(r.abs())).unwrap_or(0);
        let largest = self.correlation.iter().copied();
        Dependence {
            cause: cause.0,
            effect: effect.0,
            kind,
            direction,
            delay: delay * scale.block,
            block: scale.block,
            correlation: largest.fold(0.0, |m: f64, r| if r.abs() > m.abs() { r } else { m }),
            p_value,
            coherent: match kind {
                Kind::Linear => {
                    super::coherence::coherent_share(&cause.1[scale.range.clone()], &effect.1[scale.range.clone()])
                }
                Kind::Square => 0.0,
            },
            correlations: Correlations {
                lags: (self.first..)
                    .take(self.correlation.len())
                    .map(|lag| lag as f64 * scale.block as f64)
                    .collect(),
                values: self.correlation,
                limit,
            },
        }
    }
}

/// The critical value of the statistic.
fn critical(tests: f64) -> f64 {
    std::f64::consts::SQRT_2 * erfc_inverse(LEVEL / tests)
}

/// The finest time scale that shows a dependence nearly as clearly as the best one; `None` if none shows any.
pub(super) fn best(
    scales: &[TimeScale],
    columns: &[Vec<Whitened>],
    tests: f64,
    pick: &dyn Fn(&[Whitened]) -> Option<Statistics>,
) -> Option<(usize, Statistics)> {
    let all: Vec<Option<Statistics>> = (0..scales.len()).map(|k| pick(&columns[k])).collect();
    let largest = |s: &Option<Statistics>| s.as_ref().map_or(0.0, Statistics::largest);
    let most = all.iter().map(largest).fold(0.0, f64::max);
    if !(most > critical(tests)) {
        return None;
    }
    let needed = critical(tests).max(FINER * most);
    let mut all = all.into_iter().enumerate();
    all.find(|(_, s)| largest(s) >= needed).and_then(|(k, s)| Some((k, s?)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The statistic against its definition, summed directly. The mean of the squares is over all samples, not only the overlapping ones.
    #[test]
    fn the_statistic_is_its_definition() {
        let n = 2000;
        let wave = |k: usize| -> Vec<f64> {
            let values: Vec<f64> = (0..n).map(|i| ((i * i * k) as f64 * 0.37).sin()).collect();
            about_mean(&values)
        };
        let (a, b) = (wave(3), wave(5));
        let both = Statistics::two_sided(&a, &b).unwrap();
        assert_eq!((both.first, both.z.len()), (-(LAGS as i64), 2 * LAGS + 1));
        for (lag, (z, r)) in (both.first..).zip(both.z.iter().zip(&both.correlation)) {
            let pairs = (0..n as i64).filter(|t| (0..n as i64).contains(&(t + lag)));
            let products: Vec<f64> = pairs.map(|t| a[t as usize] * b[(t + lag) as usize]).collect();
            let (sum, squares) = (
                products.iter().sum::<f64>(),
                products.iter().map(|p| p * p).sum::<f64>(),
            );
            assert!(
                (z - sum / squares.sqrt()).abs() < 0.03 * (1.0 + z.abs()),
                "lag {lag}: {z}"
            );
            let powers = a.iter().map(|v| v * v).sum::<f64>() * b.iter().map(|v| v * v).sum::<f64>();
            assert!((r - sum / powers.sqrt()).abs() < 1e-9, "lag {lag}: {r}");
        }
    }

    #[test]
    fn time_scales_end_where_blocks_are_few_and_long_records_are_looked_at_in_the_middle() {
        let blocks: Vec<usize> = scales(1000, 1).iter().map(|s| s.block).collect();
        assert_eq!(blocks, [1, 4]);
        assert_eq!(scales(10, 1).len(), 1);
        let long = scales(1_000_000, 1);
        assert_eq!(
            long.iter().map(|s| s.block).collect::<Vec<_>>(),
            [1, 4, 16, 64, 256, 1024]
        );
        assert_eq!(long[0].range.len(), MOST_SAMPLES);
        assert_eq!(long[0].range.start, (1_000_000 - MOST_SAMPLES) / 2);
        assert_eq!(long[1].range.len(), 1_000_000);
        assert!(
            long.iter()
                .all(|s| s.range.len() % s.block == 0 && s.range.end <= 1_000_000)
        );
    }
}
