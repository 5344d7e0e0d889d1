//! The error of the refined identification over n, in comparison with the plain estimator.
//!
//! Theorems 1 and 2 are about the plain estimate. It knows nothing about the nonlinearity's shape and treats the linear part's memory as
//! noise. [`RefinedHammerstein`] removes the memory and fits cubic pieces, with jumps and kinks where the data show them. Theory says about
//! such a fit:
//!
//! - dead zone, hard limiter, quantizer, cubic and x^2 + 0.2 x are cubic pieces. Once the pieces are found there are only finitely many
//!   parameters. The place of a jump is found to the order 1/n (Chan 1993, for threshold models), which adds an L2 error of order n^(-1/2).
//!   So the rate is -1/2, and faster before, while more samples still find more of the pieces;
//! - soft wind-up and friction are smooth, with pieces for an approximation: with the best number of pieces, least squares on cubic
//!   splines have an error of order n^(-4/9) over the functions with four derivatives (Stone 1982). These two are analytic, so it may fall
//!   faster.
//!
//! Both exponents are bounds.
//!
//! The error is the relative L2 error over the middle three quarters of the input's range, after the best affine alignment, as
//! scale and offset are not determined. The linear part is that of the plain estimator's settings. The delay and the order
//! are chosen from the data in every run.

use serde::{Deserialize, Serialize};

use super::plan::{Experiment, OneRun, Study};
use crate::error::{Error, Result};
use crate::identify::RefinedHammerstein;
use crate::linear::TransferFunction;
use crate::systems::{KnownHammerstein, KnownNonlinearity, known_linear_parts, relative_error_after_alignment};

/// Points at which the error is averaged.
const GRID: usize = 4000;
/// The share of the input's range over which the error is averaged.
const INTERIOR: f64 = 0.75;

/// One experiment: the refined identification of one of the seven nonlinearities.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RefinedSetting {
    /// The nonlinearity.
    pub nonlinearity: KnownNonlinearity,
    /// The linear part.
    pub linear: TransferFunction,
}

/// The convergence study of the refined identification.
///
/// | parameter | quick | full |
/// |---|---|---|
/// | `settings` | 7 nonlinearities | the same |
/// | `lengths` | 1,000 to 16,000 | 1,000 to 256,000 |
/// | `runs` | 20 | 40 |
/// | `seed` | 1 | 1 |
pub type RefinedStudy = Study<RefinedSetting>;

impl RefinedStudy {
    /// The smallest number of samples. Without the fresh quarter, the 100 samples that a fit needs remain.
    pub const SHORTEST: usize = 134;

    /// The seven nonlinearities up to 16,000 samples: some ten seconds on two cores.
    pub fn quick() -> Self {
        let [linear, _] = known_linear_parts();
        let setting = |nonlinearity| RefinedSetting {
            nonlinearity,
            linear: linear.clone(),
        };
        RefinedStudy {
            settings: KnownNonlinearity::ALL.map(setting).to_vec(),
            lengths: vec![1000, 4000, 16_000],
            runs: 20,
            seed: 1,
        }
    }

    /// The same up to 256,000 samples: some minutes on two cores.
    pub fn full() -> Self {
        RefinedStudy {
            lengths: vec![1000, 4000, 16_000, 64_000, 256_000],
            runs: 40,
            ..RefinedStudy::quick()
        }
    }
}

impl Experiment for RefinedSetting {
    fn name(&self) -> String {
        format!("{}, refined, relative L2", self.nonlinearity.name())
    }

    fn exponent(&self) -> f64 {
        match self.nonlinearity {
            KnownNonlinearity::SoftWindup | KnownNonlinearity::Friction => -4.0 / 9.0,
            _ => -0.5,
        }
    }

    fn sharp(&self) -> bool {
        false
    }

    fn check(&self) -> Result<()> {
        if self.linear.is_stable() {
            return Ok(());
        }
        Err(Error::parameter(
            "the linear part's stability margin",
            0.0,
            "positive: all poles inside the unit circle",
        ))
    }

    fn prepared(&self) -> OneRun<'_> {
        let system = KnownHammerstein::usual(self.nonlinearity, self.linear.clone());
        let range = INTERIOR * system.input_range;
        let grid: Vec<f64> = (0..GRID)
            .map(|i| range * ((2 * i + 1) as f64 / GRID as f64 - 1.0))
            .collect();
        let truth: Vec<f64> = grid.iter().map(|&x| self.nonlinearity.value(x)).collect();
        Box::new(move |n, seed| {
            let record = system.simulate(n, seed);
            let result = RefinedHammerstein::default().identify(&record, "u", "y")?;
            let estimate: Vec<f64> = result
                .curve("nonlinearity")
                .map_or_else(Vec::new, |phi| grid.iter().map(|&x| phi.value(x)).collect());
            let error = relative_error_after_alignment(&truth, &estimate);
            Ok(error.is_finite().then_some(error * error))
        })
    }
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use super::*;

    fn study(which: &[KnownNonlinearity], lengths: &[usize]) -> RefinedStudy {
        let mut study = RefinedStudy::quick();
        study.settings.retain(|s| which.contains(&s.nonlinearity));
        study.lengths = lengths.to_vec();
        study
    }

    #[test]
    fn refined_errors_fall_faster_than_any_plain_estimate_s() {
        let which = [KnownNonlinearity::DeadZone, KnownNonlinearity::HardLimiter];
        let table = study(&which, &[1000, 4000, 16_000])
            .run(&mut |_, _| ControlFlow::Continue(()))
            .unwrap();
        for r in &table.results {
            assert!(r.agrees, "{table}");
            // The plain estimate's exponents here are -1/3 and -1/4.
            assert!(r.interval[1] < -1.0 / 3.0, "{table}");
        }
    }

    #[test]
    fn an_unstable_linear_part_is_refused() {
        let mut study = study(&[KnownNonlinearity::Cubic], &[100, 200]);
        study.settings[0].linear = TransferFunction::new(vec![1.0], vec![1.0, -1.5]).unwrap();
        let error = study.run(&mut |_, _| ControlFlow::Continue(())).unwrap_err();
        assert!(error.to_string().contains("stability margin"), "{error}");
    }
}
