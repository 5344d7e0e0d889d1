//! Hammerstein branches, one an input, whose sum passes a last nonlinearity or none.
//!
//! $$ X_n = o + \sum_i G_i(z) f_i(U^{(i)}_{n - s_i}), \qquad Y_n = g(X_n) + e_n $$
//!
//! This is what the [Hammerstein-Wiener](crate::identify::HammersteinWiener) system (one branch) and the
//! [one with several inputs](crate::identify::MultipleInputs) (g the identity) have in common: the start, the simulation error with its
//! derivatives, and the search for delays, orders and pieces.

mod columns;
mod kinks;
mod loss;
mod pieces;
mod search;
mod start;
mod system;

pub(in crate::identify) use columns::{Columns, Tabulated, normalised, tabulated};
pub use search::TriedBranches;
pub(in crate::identify) use search::{SearchResult, find};
pub(in crate::identify) use start::{branches, coarse, delays, dominant_products, splines};
pub(in crate::identify) use system::{Branch, Signals, System};
