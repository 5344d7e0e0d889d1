//! Flexure simulates flexible-joint space manipulators and identifies, from input-output
//! records, the nonlinear blocks inside them.
//!
//! The Hammerstein system, a static nonlinearity phi followed by linear dynamics k,
//! $$ Y_n = \sum_{j \ge 0} k_j\, \varphi(X_{n-j}) + \text{noise}, $$
//! is identified from its input X and its output Y alone:
//!
//! ```
//! use flexure::identify::PlainHammerstein;
//! use flexure::systems::{KnownHammerstein, KnownNonlinearity, known_linear_parts};
//!
//! let [linear, _] = known_linear_parts();
//! let system = KnownHammerstein::usual(KnownNonlinearity::DeadZone, linear);
//! let record = system.simulate(20_000, 1); // columns u, y
//!
//! let result = PlainHammerstein::default().identify(&record, "u", "y")?;
//! assert_eq!((result.delay, result.order), (0, 2));
//! assert!(result.verdict.measures.fit_percent > 75.0); // on the last quarter, not used for the fit
//! # Ok::<(), flexure::Error>(())
//! ```
//!
//! # Map
//!
//! [`identify::hammerstein`] has a table of every equation and theorem of the paper, with the file that has it.
//!
//! | module | what |
//! |---|---|
//! | [`record`] | named, sampled signals |
//! | [`signal`] | excitation signals |
//! | [`preparation`] | outliers, resampling, filters and trends of a measured record |
//! | [`simulation`] | the integrator, zero-order hold, batches |
//! | [`manipulator`] | the two-link arm: rigid, and with linear or nonlinear flexible joints |
//! | [`nonlinearity`] | estimators of a static nonlinearity |
//! | [`selection`] | their parameters from data |
//! | [`bands`] | pointwise and simultaneous confidence bands around them |
//! | [`linear`] | transfer functions |
//! | [`control`] | trajectories, controllers and filters of the arm in a loop; models that learn sample by sample |
//! | [`model`] | static nonlinearities and linear systems in series and in parallel |
//! | [`look`] | a first look at a record: its columns, and which depends on which |
//! | [`identify`] | from a record to a model, with a verdict |
//! | [`validation`] | fit measures and residual tests |
//! | [`systems`] | known systems with their exact truth |
//! | [`text`] | numbers and text for readers |
//! | [`study`] | convergence rates by Monte Carlo, compared with the theorems |
//! | [`interrupt`] | stopping a computation from another thread |
//! | [`error`] | everything that can go wrong, with the facts in the fields |

pub mod bands;
pub mod control;
mod distributions;
pub mod error;
pub mod identify;
pub mod interrupt;
pub mod linear;
pub mod look;
pub mod manipulator;
pub mod model;
pub mod nonlinearity;
mod number;
pub mod outliers;
mod parallel;
pub mod preparation;
pub mod quantiles;
pub mod record;
pub mod selection;
pub mod signal;
pub mod simulation;
mod sort;
pub mod study;
pub mod systems;
pub mod text;
pub mod validation;
mod vectors;
mod wide;

pub(crate) mod linalg;

pub use error::{Error, Result};
pub use interrupt::Interrupt;
pub use model::Block;
pub use record::Record;
