//! Theorems 1 and 2 as an experiment.
//!
//! Both say that the kernel estimate (13) has the error O(n^(-p/(2p+d))) in probability where m is Lipschitz of order p:
//! Theorem 1 for independent pairs, Theorem 2 for the correlated ones of a Hammerstein system. The bandwidth
//! h_n ~ n^(-1/(2p+d)) balances bias and variance. Beyond the paper, the error is O(n^(-2/(4+d))) where m is twice
//! differentiable and the kernel is symmetric. Here d = 1, and the error over n is measured by Monte Carlo.
//!
//! # Which error
//!
//! The theorems bound the error at (almost) every point from above, over a whole class of functions. A function or a point that is better
//! than the class shows a faster rate. So the error is measured at the worst case of the class:
//!
//! - p = 1/2: at the cusp of |x|^(1/2), where the bias is exactly of order h^(1/2);
//! - p = 1: at the kink of |x|, where it is exactly of order h. In L2 a kink is harmless: the bias is of order h
//!   only on an interval of width h, so that its L2 norm is h^(3/2);
//! - smooth: at a point of non-zero curvature, the top of cos x, where it is of order h^2.
//!
//! The variance is of order 1/(n h) at every point. The bandwidth's constant minimises the root mean square error
//! ([`Setting::at_worst_point`]). It follows from the setting and is not fitted. Both theorems are about convergence in probability; the
//! root mean square over runs is of the same order here.
//!
//! # Correlated observations
//!
//! In the Hammerstein system the memory sum_{j>=1} k_j W_{n-j} acts as noise that is correlated from sample to
//! sample. To the variance of order 1/(n h) the correlation adds
//! ((sum k_j)^2 - sum k_j^2) Var(W) / n, j >= 1: a share of order h. It vanishes, but for smooth m only as n^(-1/5). It changes a slope
//! measured at n = 1e3 to 1e5 by some hundredths. The settings at a worst point therefore use a linear part with a strongly correlated
//! memory in which those two sums nearly balance, 1 / (1 - 1.1 z^-1 + 0.56 z^-2); any other linear part has the same exponents, but only at
//! larger n.
//!
//! # The seven nonlinearities
//!
//! For these the error is the L2 norm over the inside of a uniform input's range
//! ([`Setting::over_the_interior`]):
//!
//! - cubic, x^2 + 0.2 x, soft wind-up and friction are smooth: -2/5;
//! - the dead zone is Lipschitz with p = 1: with the theorem's h ~ n^(-1/3) the variance gives -1/3, and the bias
//!   (h^(3/2), see above) falls faster: a bound;
//! - limiter and quantizer jump, so no p > 0 applies near a jump. There the bias is of order 1 on an interval of width
//!   h, so its L2 norm is h^(1/2), as if p were 1/2: h ~ n^(-1/2) balances it with the variance, and the L2 error is
//!   of order n^(-1/4).

use super::plan::{Experiment, OneRun, Study};
use super::sample::Sampler;
use super::setting::{DataSource, Input, Setting, Target};
use crate::error::Result;
use crate::linear::TransferFunction;
use crate::systems::{KnownNonlinearity, known_linear_parts};

/// The convergence study of the plain estimator.
///
/// | parameter | quick | full |
/// |---|---|---|
/// | `settings` | 18 points + 7 nonlinearities | the same |
/// | `lengths` | 1,000 to 64,000 | 1,000 to 1,000,000 |
/// | `runs` | 200 | 400 |
/// | `seed` | 1 | 1 |
///
/// ```no_run
/// use std::ops::ControlFlow;
/// use flexure::study::RateStudy;
/// let table = RateStudy::quick().run(&mut |_, _| ControlFlow::Continue(()))?;
/// println!("{table}");
/// # Ok::<(), flexure::Error>(())
/// ```
pub type RateStudy = Study<Setting>;

impl RateStudy {
    /// The settings of Theorems 1 and 2 and the seven nonlinearities: well under a minute on two cores.
    pub fn quick() -> Self {
        RateStudy {
            settings: theorem_settings().into_iter().chain(known_settings()).collect(),
            lengths: vec![1000, 4000, 16_000, 64_000],
            runs: 200,
            seed: 1,
        }
    }

    /// The same settings up to a million samples: about a quarter of an hour on two cores.
    pub fn full() -> Self {
        RateStudy {
            lengths: vec![1000, 3000, 10_000, 30_000, 100_000, 300_000, 1_000_000],
            runs: 400,
            ..RateStudy::quick()
        }
    }
}

impl Experiment for Setting {
    fn name(&self) -> String {
        Setting::name(self)
    }

    fn exponent(&self) -> f64 {
        self.exponent
    }

    fn sharp(&self) -> bool {
        self.sharp
    }

    fn check(&self) -> Result<()> {
        self.problems()
    }

    fn prepared(&self) -> OneRun<'_> {
        let sampler = Sampler::new(self);
        Box::new(move |n, seed| sampler.squared_error(n, seed))
    }
}

/// The three classes at their worst point, from static and Hammerstein data, for the three inputs.
pub fn theorem_settings() -> Vec<Setting> {
    let linear = TransferFunction::monic(vec![1.0], vec![-1.1, 0.56]);
    let data = [
        DataSource::Static { noise: 0.5 },
        DataSource::Hammerstein {
            linear,
            lag: 0,
            process_noise: 0.1,
            noise: 0.1,
        },
    ];
    let inputs = [Input::Uniform { range: 2.0 }, Input::Gaussian, Input::StudentT];
    let mut settings = Vec::new();
    for target in [Target::Cusp, Target::Kink, Target::Cosine] {
        for data in &data {
            for input in inputs {
                settings.push(Setting::at_worst_point(target, input, data.clone()));
            }
        }
    }
    settings
}

/// The seven nonlinearities in front of the well damped linear part, regressed at its strongest lag.
pub fn known_settings() -> Vec<Setting> {
    let [linear, _] = known_linear_parts();
    KnownNonlinearity::ALL
        .into_iter()
        .map(|phi| Setting::over_the_interior(phi, linear.clone(), 1))
        .collect()
}

#[cfg(test)]
#[path = "rates_tests.rs"]
mod tests;
