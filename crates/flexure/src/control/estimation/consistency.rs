//! Whether a filter's errors are as large as it says.
//!
//! The normalised square of the error (NEES) has as many degrees of freedom as the state, that of the innovation (NIS) as many as there are
//! readings: each is chi-squared distributed if the filter is consistent (Bar-Shalom, Li & Kirubarajan 2001, Estimation with Applications
//! to Tracking and Navigation, section 5.4). Then 95 % of the values lie within the two-sided 95 % band.

use crate::distributions::chi_squared_quantile;

/// The share of values within the band of a distribution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Share {
    /// The band of 95 %.
    pub band: [f64; 2],
    /// The share of the values within it.
    pub within: f64,
    /// Their mean; that of a consistent filter is the degrees of freedom.
    pub mean: f64,
}

impl Share {
    /// The share of these values, for a chi-squared distribution of `degrees` degrees of freedom; values that are not finite are outside.
    fn new(values: impl Iterator<Item = f64> + Clone, degrees: f64) -> Self {
        let band = [0.025, 0.975].map(|p| chi_squared_quantile(p, degrees));
        let n = values.clone().count() as f64;
        let within = values.clone().filter(|v| (band[0]..=band[1]).contains(v)).count() as f64;
        Share {
            band,
            within: within / n,
            mean: values.sum::<f64>() / n,
        }
    }

    /// The share over several runs of one length.
    fn over(runs: impl Iterator<Item = Share> + Clone) -> Option<Self> {
        let n = runs.clone().count() as f64;
        Some(Share {
            band: runs.clone().next()?.band,
            within: runs.clone().map(|share| share.within).sum::<f64>() / n,
            mean: runs.map(|share| share.mean).sum::<f64>() / n,
        })
    }
}

/// The consistency of a filter over runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Consistency {
    /// The share for the errors.
    pub nees: Share,
    /// The share for the innovations.
    pub nis: Share,
}

impl Consistency {
    /// The consistency from `[NEES, NIS]` at instants of one or several runs, for the arm's eight states and two encoders.
    pub fn new(kept: &[[f64; 2]]) -> Self {
        Consistency {
            nees: Share::new(kept.iter().map(|v| v[0]), 8.0),
            nis: Share::new(kept.iter().map(|v| v[1]), 2.0),
        }
    }

    /// The consistency over several runs of one length; `None` without runs.
    pub fn over(runs: &[Consistency]) -> Option<Self> {
        Some(Consistency {
            nees: Share::over(runs.iter().map(|run| run.nees))?,
            nis: Share::over(runs.iter().map(|run| run.nis))?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bands_are_those_of_chi_squared_distributions() {
        // scipy.stats.chi2.ppf([0.025, 0.975], [8, 2])
        let consistency = Consistency::new(&[[8.0, 2.0], [18.0, 0.01], [f64::NAN, 7.0], [3.0, 7.5]]);
        for (got, expected) in [
            (consistency.nees.band, [2.179_730_747_252_65, 17.534_546_139_484_65]),
            (consistency.nis.band, [0.050_635_615_968_579_8, 7.377_758_908_227_87]),
        ] {
            assert!(
                (got[0] - expected[0]).abs() < 1e-8 && (got[1] - expected[1]).abs() < 1e-8,
                "{got:?}"
            );
        }
        assert_eq!((consistency.nees.within, consistency.nis.within), (0.5, 0.5));
        assert_eq!(Consistency::over(&[]), None);
    }

    #[test]
    fn two_runs_are_judged_as_one_of_both() {
        let values = [[8.0, 2.0], [18.0, 0.01], [4.0, 7.0], [3.0, 7.5]];
        let parts: Vec<Consistency> = values.chunks(2).map(Consistency::new).collect();
        assert_eq!(Consistency::over(&parts), Some(Consistency::new(&values)));
    }
}
