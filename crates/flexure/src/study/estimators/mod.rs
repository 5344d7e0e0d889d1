//! The measured convergence rates of all estimators of a static nonlinearity.
//!
//! Y = m(X) + e is sampled n times. An estimator's parameter follows a schedule c n^gamma. The slope of the log
//! root mean square error over log n is compared with the exponent that theory gives for this estimator, this m, this
//! schedule and this norm. For m of order p (p = 1: Lipschitz; p = 2: twice differentiable) in d variables no estimator
//! is faster than n^(-p/(2p+d)) over the whole class (Stone 1982): -1/3 and -2/5 in one variable, -1/4 and -1/3
//! in two. The error is measured where m is hardest to estimate; elsewhere it may fall faster.
//!
//! # One variable, Lipschitz: |x|
//!
//! - Kernel, local constant or local linear, h ~ n^(-1/3); neighbours, k ~ n^(2/3); recursive kernels, h_i ~ i^(-1/3): at the
//!   kink the bias is exactly of order h or k/n, the variance of order 1/(n h) or 1/k. Sharp: -1/3 (Greblicki and
//!   Pawlak 2008, ch. 3 to 5; Gyorfi, Kohler, Krzyzak and Walk 2002, ch. 5, 6, 24).
//! - Fourier, cosine, Legendre series and polynomials, N ~ n^(1/3) terms: the truncated series of a kink has an error of order 1/N at the
//!   kink, and the variance is of order N/n. Sharp at the kink: -1/3. (Least squares on the Legendre series and on polynomials give the
//!   same estimate.)
//! - Penalised spline, lambda = n f h^4 with h ~ n^(-1/3), the half width of its equivalent kernel (Silverman 1984;
//!   Eubank 1999, ch. 5): as for a kernel, -1/3, sharp.
//! - Haar, 2^L ~ n^(1/3) cells: the bias is of order h wherever m has a slope, so the L2 error shows it. Sharp: -1/3.
//! - Hermite, on |x| exp(-x^2/2), N ~ n^(1/3): N terms resolve waves up to the number (2N)^(1/2). So a kink leaves an L2 bias of order
//!   N^(-3/4), which is more than (N/n)^(1/2) from the variance. Sharp: -1/4. (The class has N^(-1/2): Greblicki and Pawlak 1985; 2008,
//!   ch. 6. A schedule that balances the two, here N ~ n^(2/5), needs functions that reach beyond the points of X, here of Student's t with
//!   5 degrees of freedom. Least squares are not consistent there.)
//!
//! # One variable, smooth
//!
//! - Kernel, neighbours, recursive kernels: at the top of cos x, where the bias is of order h^2, h ~ n^(-1/5),
//!   k ~ n^(4/5); the local linear kernel at the end of the data, where the local constant one would have a bias of
//!   order h (Fan and Gijbels 1996, ch. 3). Sharp: -2/5.
//! - Series, polynomials, splines: |sin(pi x/2)|^(3/2), which has two derivatives in L2 up to a logarithm. Its coefficients fall as
//!   k^(-5/2), so the L2 bias is of order N^(-2), or h^2; N ~ n^(1/5) or h ~ n^(-1/5). Sharp: -2/5 (Eubank 1999, ch. 3 and 5). A smoother m
//!   would be estimated at a faster rate, an analytic one nearly at n^(-1/2).
//! - Haar: sin 2x. A step function cannot use smoothness: sharp, -1/3, as for Lipschitz m.
//! - Hermite, on exp(-x^2/4), N ~ n^(1/3): the coefficients fall geometrically, so only the variance remains. Sharp in the norm of L2(X):
//!   -1/3.
//!
//! - Local bandwidths, from the data, on sin 2x in L2: those of the plug-in rule follow n^(-1/5) at every x (Fan and Gijbels 1996, ch. 4).
//!   Lepski's are used if they are better than one bandwidth by leave-one-out. The rate -2/5 is a bound here: the choice itself costs more
//!   at small n, so the error falls faster at first. On |x|, narrow or one-sided windows are needed only at the kink: the L2 error of
//!   Lipschitz m, -1/3, is a bound.
//!
//! # Two variables
//!
//! Product kernels, h ~ n^(-1/4) and n^(-1/6), and neighbours, k ~ n^(1/2) and n^(2/3): at the tip of the cone |x|, sharp,
//! -1/4; at the top of cos x_1 cos x_2, sharp, -1/3.
//!
//! # Networks
//!
//! With K ~ n^(d/(2p+d)) units a network can approximate m to the order K^(-p/d), with a variance of order K/n (Pinkus 1999, sec. 6 and 7).
//! This gives bounds of -p/(2p+d) for the least-squares network. Only the experiment can show whether training finds that network.

mod run;
mod setting;

use super::plan::Study;
pub use setting::{ErrorNorm, EstimatorSetting, Method, Regressand, Schedule, estimator_settings, network_settings};

/// The convergence study of the static estimators. If the data do not allow a parameter, the run counts as missing.
///
/// | parameter | quick | full |
/// |---|---|---|
/// | `settings` | [`estimator_settings`] | the same |
/// | `lengths` | 256 to 16,384 | 256 to 131,072 |
/// | `runs` | 150 | 400 |
/// | `seed` | 1 | 1 |
///
/// The lengths are powers of 8 apart, so that the cells of the Haar series can follow their schedule.
///
/// ```no_run
/// use std::ops::ControlFlow;
/// use flexure::study::EstimatorStudy;
/// let table = EstimatorStudy::quick().run(&mut |_, _| ControlFlow::Continue(()))?;
/// println!("{table}");
/// # Ok::<(), flexure::Error>(())
/// ```
pub type EstimatorStudy = Study<EstimatorSetting>;

impl EstimatorStudy {
    /// All estimators but the network: about a minute on two cores.
    pub fn quick() -> Self {
        EstimatorStudy {
            settings: estimator_settings(),
            lengths: vec![256, 2048, 16_384],
            runs: 150,
            seed: 1,
        }
    }

    /// The same with more runs, up to 131,072 points: some minutes on two cores.
    pub fn full() -> Self {
        EstimatorStudy {
            lengths: vec![256, 2048, 16_384, 131_072],
            runs: 400,
            ..EstimatorStudy::quick()
        }
    }

    /// The network, whose training is slow: under half a minute.
    pub fn quick_network() -> Self {
        EstimatorStudy {
            settings: network_settings(),
            lengths: vec![256, 2048],
            runs: 30,
            seed: 1,
        }
    }

    /// The same up to 16,384 points.
    pub fn full_network() -> Self {
        EstimatorStudy {
            lengths: vec![256, 2048, 16_384],
            runs: 40,
            ..EstimatorStudy::quick_network()
        }
    }
}

#[cfg(test)]
#[path = "tests.rs"]
mod tests;
