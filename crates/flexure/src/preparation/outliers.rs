//! Outliers by Hampel's rule: samples far from the median of their neighbours.
//!
//! A sample is an outlier if its distance from the median of the 2k + 1 samples around it exceeds
//! $$ c \cdot \max(\mathrm{MAD}_{2k+1} / 0.6745,\ \mathrm{med}\,|\Delta x \neq 0| / 0.6745) $$
//! The first term is the rule of Hampel (1974) as a moving filter (Pearson 2002): the median absolute deviation within the window, scaled
//! to the standard deviation of a normal variable. Alone, it would also flag the changes of a quantised signal, or of one that stands still
//! for a while: their windows have no deviation at all. The second term prevents this: the distance must also be large in comparison with
//! the usual nonzero change from sample to sample.

use crate::error::{Error, Result};
use crate::quantiles::NORMAL_MAD;
use crate::sort::median;

/// The rule by which a sample is an outlier.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outliers {
    /// How many samples on either side are a sample's neighbours; at least 1.
    pub neighbours: usize,
    /// How many robust standard deviations a sample may be away from its neighbours; positive.
    pub threshold: f64,
}

impl Default for Outliers {
    /// Seven neighbours on either side find groups of up to seven outliers. The threshold is five deviations. Both are conventions. They
    /// flag none of a million samples of normal noise (measured in the tests).
    fn default() -> Self {
        Outliers {
            neighbours: 7,
            threshold: 5.0,
        }
    }
}

impl Outliers {
    /// The outliers' places, in increasing order.
    ///
    /// Missing samples are skipped: the next samples that exist are the neighbours. At the ends the first or the last complete window
    /// serves. A signal shorter than a window has no outliers.
    ///
    /// A short and strong event, such as an impact, is an outlier by this rule. Check the samples that are found.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a rule out of range.
    pub fn find(&self, x: &[f64]) -> Result<Vec<usize>> {
        if self.neighbours == 0 {
            return Err(Error::parameter(
                "the number of neighbours of an outlier",
                0.0,
                "at least 1",
            ));
        }
        if !(self.threshold > 0.0 && self.threshold.is_finite()) {
            return Err(Error::parameter(
                "the threshold of outliers",
                self.threshold,
                "positive and finite",
            ));
        }
        let places: Vec<usize> = (0..x.len()).filter(|&i| x[i].is_finite()).collect();
        let x: Vec<f64> = places.iter().map(|&i| x[i]).collect();
        let window = 2 * self.neighbours + 1;
        let changes = x.windows(2).map(|x| (x[1] - x[0]).abs()).filter(|&change| change > 0.0);
        let changes: Vec<f64> = changes.collect();
        if x.len() < window || changes.is_empty() {
            return Ok(Vec::new());
        }
        let usual = median(changes);
        let is_outlier = |&i: &usize| {
            let start = i.saturating_sub(self.neighbours).min(x.len() - window);
            let around = &x[start..start + window];
            let middle = median(around.to_vec());
            let distance = (x[i] - middle).abs();
            let limit = |deviation: f64| self.threshold * deviation / NORMAL_MAD;
            // The cheaper criterion comes first: it decides nearly all samples.
            distance > limit(usual) && distance > limit(median(around.iter().map(|x| (x - middle).abs()).collect()))
        };
        Ok((0..x.len()).filter(is_outlier).map(|i| places[i]).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::gaussian;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    /// The rule as it is written above, by sorting.
    fn by_definition(x: &[f64], rule: Outliers) -> Vec<usize> {
        let middle = |mut x: Vec<f64>| {
            x.sort_by(f64::total_cmp);
            x[x.len() / 2]
        };
        let present: Vec<(usize, f64)> = x.iter().copied().enumerate().filter(|(_, x)| x.is_finite()).collect();
        let (n, k) = (present.len(), rule.neighbours);
        let mut changes = Vec::new();
        for pair in present.windows(2) {
            if pair[0].1 != pair[1].1 {
                changes.push((pair[0].1 - pair[1].1).abs());
            }
        }
        let mut found = Vec::new();
        for i in 0..n {
            let first = if i < k {
                0
            } else if i + k >= n {
                n - 2 * k - 1
            } else {
                i - k
            };
            let window: Vec<f64> = present[first..=first + 2 * k].iter().map(|p| p.1).collect();
            let centre = middle(window.clone());
            let deviation = middle(window.iter().map(|x| (x - centre).abs()).collect());
            let scale = deviation.max(middle(changes.clone())) / 0.674_489_750_196_082;
            if (present[i].1 - centre).abs() > rule.threshold * scale {
                found.push(present[i].0);
            }
        }
        found
    }

    #[test]
    fn the_rule_is_the_definition() {
        let mut rng = Pcg64::seed_from_u64(3);
        let rules = [(7, 5.0), (1, 2.0), (3, 3.0)].map(|(neighbours, threshold)| Outliers { neighbours, threshold });
        for rule in rules {
            let mut found = 0;
            for seed in 0..20 {
                let heavy = |x: &f64| x * x * x; // many outliers
                let mut x: Vec<f64> = gaussian(300, seed).iter().map(heavy).collect();
                for _ in 0..20 {
                    x[rng.random_range(0..300)] = f64::NAN;
                }
                let places = rule.find(&x).unwrap();
                assert_eq!(places, by_definition(&x, rule), "{rule:?}, seed {seed}");
                found += places.len();
            }
            assert!(found > 50, "{rule:?}: {found}");
        }
    }

    #[test]
    fn spikes_in_a_noisy_motion_are_found_and_nothing_else() {
        let spikes = [0, 1, 500, 501, 502, 1200, 1999];
        let mut x: Vec<f64> = gaussian(2000, 1)
            .iter()
            .zip(0..)
            .map(|(e, i)| 0.01 * e + (0.02 * f64::from(i)).sin())
            .collect();
        for spike in spikes {
            x[spike] += 1.0;
        }
        assert_eq!(Outliers::default().find(&x).unwrap(), spikes);
    }

    /// A signal without outliers loses no samples.
    #[test]
    fn honest_signals_lose_nothing() {
        let n = 100_000;
        let noise = gaussian(n, 2);
        let held = |every: usize| (0..n).map(|i| noise[i / every]).collect::<Vec<f64>>();
        let signals: [(&str, Vec<f64>); 8] = [
            ("noise", noise.clone()),
            ("steps", held(30)),
            ("short steps", held(2)),
            ("two levels", held(3).iter().map(|x| x.signum()).collect()),
            ("rare pulses", (0..n).map(|i| f64::from(u8::from(i % 40 < 3))).collect()),
            (
                "coarse sine",
                (0..n).map(|i| (4.0 * (0.01 * i as f64).sin()).round()).collect(),
            ),
            ("fast sine", (0..n).map(|i| (2.0 * i as f64).sin()).collect()),
            ("constant", vec![3.0; n]),
        ];
        for (name, signal) in signals {
            assert_eq!(Outliers::default().find(&signal).unwrap(), [0_usize; 0], "{name}");
        }
    }

    #[test]
    fn a_million_samples_of_noise_lose_none() {
        assert_eq!(Outliers::default().find(&gaussian(1_000_000, 5)).unwrap(), [0_usize; 0]);
    }

    #[test]
    fn scale_and_offset_change_nothing() {
        let x: Vec<f64> = gaussian(500, 9).iter().map(|x| x.powi(5)).collect();
        let rule = Outliers::default();
        let places = rule.find(&x).unwrap();
        assert!(!places.is_empty());
        let changed: Vec<f64> = x.iter().map(|x| 1024.0 - 0.25 * x).collect();
        assert_eq!(rule.find(&changed).unwrap(), places);
    }

    #[test]
    fn too_few_samples_and_bad_rules() {
        assert_eq!(Outliers::default().find(&[1.0, 90.0, 1.0]).unwrap(), [0_usize; 0]);
        assert_eq!(Outliers::default().find(&[]).unwrap(), [0_usize; 0]);
        for (neighbours, threshold) in [(0, 5.0), (3, 0.0), (3, f64::NAN)] {
            assert!(Outliers { neighbours, threshold }.find(&[1.0; 30]).is_err());
        }
    }
}
