//! Linear systems of several inputs by what a user wants of them: the free run on samples that were not fitted.
//!
//! $$ Y_n = o + \sum_i \frac{B_i(z)}{A(z)} z^{-s_i} U^{(i)}_n + \frac{C(z)}{A(z)} \delta_n + e_n $$
//! with one denominator for all inputs. The last term is the state in which the record began, so that no samples are
//! lost while it decays.
//!
//! | step | file |
//! |---|---|
//! | the system, its output and the columns of its derivatives | `system` |
//! | poles at 1 | `integrators` |
//! | its fit by the output error or by the equation error | `fit` |
//! | how well a fit to the first part of the record runs on through the rest | `held_back` |
//! | poles, delays and numerators, chosen by that | `search` |
//! | standard errors of the coefficients | `errors` |
//!
//! Where the output integrates, poles at 1 and a polynomial of time take the place of the slowest poles.
//!
//! The output error (Ljung 1999, section 4.2) is best where the free run is nearly all there is. Where slow disturbances are large, or an
//! input is controlled by the output, the equation error (ARX) often runs on better, as it does not follow them. Both are tried.

mod errors;
mod fit;
mod held_back;
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
