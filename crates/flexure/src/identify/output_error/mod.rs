//! Linear systems of several inputs, chosen by their free run on samples that were not fitted.
//!
//! $$ Y_n = o + \sum_i \frac{B_i(z)}{A(z)} z^{-s_i} U^{(i)}_n + \frac{C(z)}{A(z)} \delta_n + e_n $$
//! with one denominator for all inputs. The last term is the initial state, so that no samples are lost while it decays.
//!
//! | step | file |
//! |---|---|
//! | the system, its output and the columns of its derivatives | `system` |
//! | poles at 1 | `integrators` |
//! | its fit by the output error or by the equation error | `fit` |
//! | the colour of the noise | `high_order` |
//! | how well a fit to the first part of the record predicts the rest | `held_back` |
//! | the choice of poles, delays and numerators by this | `search` |
//! | standard errors of the coefficients | `errors` |
//!
//! If the output integrates, poles at 1 and a polynomial of time replace the slowest poles.
//!
//! The output error (Ljung 1999, section 4.2) is best if the free run explains nearly all of the output. If slow disturbances are large, or
//! the output controls an input, the equation error (ARX) often predicts better, since it does not follow the disturbances. Both are tried.

mod errors;
mod fit;
mod held_back;
mod high_order;
mod integrators;
mod limits;
mod search;
mod system;
#[cfg(test)]
mod tests;

pub(super) use errors::covariance;
pub(super) use integrators::bias;
pub(super) use search::{LinearCandidate, Search, search};
pub(super) use system::LinearSystem;
