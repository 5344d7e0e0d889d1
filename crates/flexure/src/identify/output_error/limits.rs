//! Every threshold of the search for a linear system. A convention is a choice that no reference or measurement decided.

use super::super::block::StopRule;

/// Samples for the choice of orders and delays; the last fit takes all. They bound the time.
pub const SEARCH_SAMPLES: usize = 5_000;
/// The largest number of poles that is always tried, and the largest of all: more are tried if the former is chosen, as for a machine with
/// many resonances.
pub const USUAL_POLES: usize = 10;
pub const MOST_POLES: usize = 20;
/// Samples for each parameter in the shortest fitted part. Convention.
pub const SAMPLES_A_PARAMETER: usize = 4;
/// The shares of the record that are fitted; the fit then predicts the rest.
pub const HELD_BACK: [f64; 5] = [0.4, 0.5, 0.6, 0.7, 0.8];
/// A squared error below this share of the output's variance is negligible: such models are equally good. Convention.
pub const NEGLIGIBLE_ERROR: f64 = 1e-10;
/// The held-back squared error of a simpler system may be larger by this factor. This was better than 1.05, 1.1 and no factor on the real
/// records of `bench/records`.
pub const TOLERATED_RATIO: f64 = 1.03;
/// The same for the free run where the choice is by errors through the polynomial that whitens the noise. On 120 simulated systems, three
/// quarters of them with coloured noise, the error of the dynamics was 1.9 % in the median with 1.25, 2.3 with 1.1, 3.0 with 1.03, and 4.3
/// by the free run alone. On the real records of `bench/records`, the fit was the same on average.
pub const TOLERATED_IN_NOISE: f64 = 1.25;
/// Blocks for the comparison of two systems' held-back errors, and the standard errors from which one is worse: 1 % of the t distribution
/// with that many degrees of freedom.
pub const COMPARED_BLOCKS: usize = 20;
pub const WORSE_T: f64 = 2.54;
/// A system does not decay within the record if its slowest pole takes more than this many times its length. Convention.
pub const LONGEST_DECAY: f64 = 5.0;
/// The most integrators: a position has two between a force and itself.
pub const MOST_INTEGRATORS: usize = 2;
/// Integrators are tried if a system without them has a pole this near to 1. Convention: it bounds the time.
pub const NEARLY_INTEGRATES: f64 = 0.05;
/// The samples over which a power of time rises to 1. Any number works: the columns are scaled.
pub const TREND_SAMPLES: f64 = 1_000.0;
/// Rounds of changes. They bound the time.
pub const ROUNDS: usize = 3;

/// The most poles of the system of high order, and the samples for each of its parameters: shorter records and more inputs have fewer poles.
/// Conventions.
pub const HIGH_ORDER: usize = 30;
pub const SAMPLES_OF_HIGH_ORDER: usize = 10;
/// The fewest samples for such a system. Convention: of fewer, the colour of noise is hardly known.
pub const FEWEST_OF_HIGH_ORDER: usize = 400;
/// Noise is coloured if its variance is at least this many times that of its innovations. Convention: it bounds the time.
pub const COLOUR_RATIO: f64 = 2.0;
/// Passes of the Steiglitz-McBride iteration.
pub const PASSES: usize = 12;
/// The last pass lowers the sum of squares by less than this share. Convention.
pub const PASSES_SETTLED: f64 = 1e-4;
/// The fit of the output error to the first samples, and to all.
pub const FIT: StopRule = StopRule::new(20, 1e-4);
pub const LAST: StopRule = StopRule::new(80, 1e-8);
/// The fit to a part of the record, which starts from that to the whole.
pub const PART: StopRule = StopRule::new(6, 1e-4);
