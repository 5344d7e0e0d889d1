//! Every threshold of the method, in the order of its steps.
//!
//! Values without a source are conventions. `examples/joint_bands.rs` and the tests measure their joint effect on simulated joints and
//! arms: how often the bands cover the truth, and how often true forms are refuted.

// The log.

/// The fewest samples of a log.
pub const FEWEST_SAMPLES: usize = 200;
/// A jump by a turn may be off by this share of it.
pub const TURN_WITHIN: f64 = 0.2;
/// If the motor moves this many times as far as the link, its angle is not on the link's side of the gear.
pub const MOST_DIFFERENT: f64 = 4.0;
/// The least squared correlation of motor and link at which the ratio of their motions is known.
pub const TOGETHER: f64 = 0.5;
/// A torque is clipped from this many consecutive samples at its extreme on; all such samples as a share of the record.
pub const CLIPPED_RUN: usize = 5;
pub const CLIPPED_SHARE: f64 = 0.002;
/// Torques this close to the extreme, as a share of it, stand at it.
pub const CLIPPED_NEAR: f64 = 0.03;
/// If the motion needs less than this share of the extreme in addition, the torque did act as it was measured. Simulated drives with limits
/// had 0.008 at most, torques that the measurement clipped at nine tenths 0.027 at least.
pub const CLIPPED_EXCESS: f64 = 0.015;
/// A link that turns farther than this may be logged in degrees.
pub const MOST_TURNS: f64 = 3.0;
/// A share of the time in one direction below this counts as none.
pub const ONE_WAY: f64 = 0.02;
/// Fewer reversals than this do not determine friction.
pub const FEWEST_REVERSALS: usize = 6;
/// A spectrum that still falls by this factor where only noise is expected belongs to the motion.
pub const STEEP_NOISE: f64 = 3.0;
/// Samples of a running mean in which plateaus are looked for.
pub const PLATEAU_WINDOW: usize = 8;
/// How far below the top a plateau reaches, and the largest difference of neighbouring windows' means at standstill, in standard deviations
/// of a mean.
pub const PLATEAU_DEPTH: f64 = 8.0;
pub const PLATEAU_STILL: f64 = 4.0;
/// Fewer plateaus than this may be peaks that happen to be flat.
pub const FEWEST_PLATEAUS: usize = 3;
/// A peak's outer thirds lie 5 standard deviations below the middle one; a plateau's lie less than this below it.
pub const PLATEAU_FLAT: f64 = 0.6;
/// Plateaus must bend less than half as much as peaks, by this many standard errors: low-crest multisines have many peaks of one height.
/// Among 600 such unclipped torques, one was taken for clipped; without this rule, six were.
pub const PLATEAU_SURE: f64 = 3.0;
/// There is no plateau if its depth is above this share of the torque's range, or if the torque stands still for this share of the time.
pub const PLATEAU_TOO_DEEP: f64 = 0.05;
pub const STANDS_STILL: f64 = 0.85;

// The encoders' noise, and smoothing.

/// Half the order of the smoothing filter's squared gain, 1 / (1 + (f / fc)^16): flat, with little ringing.
pub const STEEPNESS: i32 = 16;
/// The cut-off in units of the frequency up to which the signal stands out of the noise.
pub const CUT_OFF_MARGIN: f64 = 1.5;
/// Samples of a segment of the averaged periodogram, at most.
pub const SEGMENT: usize = 16_384;
/// From this share of the sampling rate on, the periodogram is taken for noise.
pub const NOISE_FROM: f64 = 0.35;
/// A line this many times the noise holds more motion than noise.
pub const STANDS_OUT: f64 = 2.0;
/// The spectrum of white noise does not fall by more than this factor from the lower to the upper half of the range where it is estimated.
pub const FLAT_NOISE: f64 = 1.5;

// Fourier transforms, and their frequencies.

/// The longest rise and fall of the window, as a share of the record.
pub const RAMP: f64 = 0.02;

/// The fewest frequencies that make equations.
pub const FEWEST_LINES: usize = 60;
/// The least band of the equations, relative to a band that just has these frequencies.
pub const BAND_MARGIN: f64 = 1.2;
/// The highest frequency of the equations of flexible joints as a share of the sampling rate, and in bands of the motion.
pub const HIGHEST_FLEXIBLE: f64 = 0.1;
pub const BANDS: f64 = 3.0;
/// Velocities within this many standard deviations of their noise cannot be distinguished.
pub const RESOLVED: f64 = 3.0;

/// The highest frequency of the equations of rigid axes as a share of the sampling rate.
pub const HIGHEST_RIGID: f64 = 0.2;
/// An axis may rest below this many times the smallest velocity that is resolved: ripple of the smoothing does not end a rest. Convention.
pub const SLOW: f64 = 3.0;
/// Steps of a sample and rounds of the search for the initial velocity, where the motion near rest is simulated; and rounds of doing so with better values. Conventions.
pub const PASSAGE_SUBSTEPS: usize = 8;
pub const PASSAGE_ROUNDS: usize = 5;
pub const PASSAGES_AGAIN: usize = 3;
/// A torque counts as logged a sample too early or too late only if twice the logarithm of the likelihood grows by this. In a simulated log with
/// such a torque it grew by 445. In logs with a noisy torque that acts at its samples, it grew by up to 12, by chance.
pub const LOGGED_ELSEWHERE: f64 = 30.0;
/// Ratios between the smallest and the largest velocity, at which a Stribeck effect is tried for the motion near rest. Convention.
pub const STRIBECK_VELOCITIES: usize = 16;
/// The width of the jump of friction at zero where the motion is known within samples, as a share of the smallest velocity that is resolved. Convention.
pub const JUMP_WIDTH: f64 = 1e-3;
/// Fewer samples than this within the mechanical time constant do not separate inertia from friction.
pub const SAMPLES_A_CONSTANT: f64 = 5.0;

// Whether the joint is flexible.

/// The least deflection that determines a stiffness, in standard deviations of the encoders' noise.
pub const FLEXIBLE: f64 = 3.0;
/// A joint counts as stiff if the clocks explain at least this share of its deflection's mean square.
pub const MOSTLY_CLOCKS: f64 = 0.9;
/// The degree of the part of a stiff joint's deflection that depends on the angle.
pub const ANGLE_DEGREE: usize = 5;
/// The remainder of a stiff joint's deflection is averaged over lines on either side: at least this many, and this share of the frequency.
pub const NEIGHBOURS_AROUND: usize = 3;
pub const NEIGHBOURS_SHARE: f64 = 0.25;
/// A deflection of more standard deviations than this needs no smoothing.
pub const PLAIN: f64 = 100.0;
/// The probability that chance alone looks like a spring.
pub const CHANCE_OF_SPRING: f64 = 1e-3;
/// The most passes that shift the link's angle, and the change in samples that ends them.
pub const COMPLIANCE_PASSES: usize = 5;
pub const COMPLIANCE_SETTLED: f64 = 1e-3;

/// Rounds of estimating the noise and solving again.
pub const NOISE_ROUNDS: usize = 4;
/// Rounds for the motor's equation.
pub const MOTOR_ROUNDS: usize = 2;
/// The smallest difference of deflections that the data resolve, as a share of the largest one.
pub const RESOLVED_DEFLECTION: f64 = 1e-3;

// The clocks.

/// An offset of less than this many standard errors is taken as zero.
pub const SIGNIFICANT: f64 = 4.0;
/// An offset below this share of a sample is taken as zero.
pub const NEGLIGIBLE_OFFSET: f64 = 0.03;
/// A torque held from sample to sample is late by half a sample, within this share of one: nearer to it than to none or to a whole one.
pub const HELD_WITHIN: f64 = 0.25;

/// The most passes with the motor's equation, and with both.
pub const CLOCK_PASSES_BY_MOTOR: usize = 8;
pub const CLOCK_PASSES: usize = 6;
/// The change of an offset that ends the passes, in standard errors.
pub const CLOCKS_SETTLED: f64 = 0.05;
/// Intervals on either side of zero of the stiffness curve while the clocks are estimated.
pub const CLOCK_PIECES: usize = 8;
/// The longest step of the link's offset in samples: a longer one leaves the linear range.
pub const LONGEST_CLOCK_STEP: f64 = 20.0;
/// Half the distance of the points between which a slope of the stiffness curve is taken, as a share of the largest deflection.
pub const STIFFNESS_SLOPE_STEP: f64 = 1e-4;

// Other effects on a joint.

/// Radii of the stop operators of a spring with memory and of friction with memory, as shares of half the range of deflection or angle.
pub const STOP_RADII_OF_DEFLECTION: [f64; 5] = [0.01, 0.03, 0.08, 0.2, 0.5];
pub const STOP_RADII_OF_ANGLE: [f64; 4] = [0.0003, 0.001, 0.003, 0.01];
/// The velocity at which a motion is steady, as a share of the largest one.
pub const STEADY_WITHIN: f64 = 0.01;
/// A friction drives a joint if its power is negative by more than this share of the other friction's. Convention.
pub const DRIVES: f64 = 0.1;
/// The least share of the time that a body rests for which its equation is left out. Of rarer rests the factors of torque and spring are hardly determined: one simulated
/// motor's inertia was then 11 % too large.
pub const LEAST_REST: f64 = 0.02;
/// The cut-off of the torque's rate in time, as a share of the sampling rate: far above the frequencies of the equations. Convention.
pub const TORQUE_RATE: f64 = 0.25;
/// The smallest radius, in standard deviations of the signal's noise.
pub const STOPS_ABOVE_NOISE: f64 = 5.0;

// Least squares.

/// Added to the diagonal of the scaled normal equations: directions that the data do not determine stay finite.
pub const RIDGE: f64 = 1e-10;

/// The largest share of the square of any sum of columns that may be noise.
pub const MOSTLY_NOISE: f64 = 0.5;
/// How often the subtracted part is halved at most, if it would be larger.
pub const NOISE_HALVINGS: usize = 12;

/// The smallest share of a line that is assumed to remain in the residual.
pub const LEAST_REMAINDER: f64 = 0.05;
/// Residual powers are averaged over one hundredth of the lines on either side, and over at least the second number.
pub const SMOOTHED_SHARE: usize = 100;
pub const FEWEST_SMOOTHED: usize = 6;
/// The least power of a line, as a share of the mean of all: rounding.
pub const LEAST_POWER: f64 = 1e-12;
/// The white part of the noise: its least share of the mean power, and the rounds and the relative change with which it has settled.
pub const LEAST_WHITE: f64 = 1e-9;
pub const WHITE_ROUNDS: usize = 100;
pub const WHITE_SETTLED: f64 = 1e-6;

/// Stretches of time, and the fewest points of one.
pub const STRETCHES: usize = 64;
pub const FEWEST_IN_STRETCH: usize = 8;

// The free curves.

/// The fewest points of an interval between breakpoints.
pub const POINTS_IN_INTERVAL: usize = 20;
/// The least share of all points that an interval must hold.
pub const SHARE_IN_INTERVAL: f64 = 1e-3;
/// How much denser the breakpoints are at zero than at the ends: for friction, which changes fastest where the velocity changes sign, and
/// for stiffness, which the torque determines less well near zero.
pub const FRICTION_DENSER: f64 = 100.0;
pub const STIFFNESS_DENSER: f64 = 10.0;
/// How much denser at zero are the points at which a curve is reported.
pub const GRID_DENSER: f64 = 10.0;
/// Half the distance of the points between which a slope is taken, as a share of the range.
pub const SPLINE_SLOPE_STEP: f64 = 1e-6;

/// Above this standard error, as a share of the curve's root mean square, and this many times the median, a form is not compared with the curve.
/// Conventions: half of its band is then a quarter of the curve, and the data say more of it elsewhere.
pub const HARDLY_DETERMINED: f64 = 0.125;
pub const LESS_DETERMINED: f64 = 5.0;

/// The most changes of division in a round, for each curve.
pub const DIVISION_MOVES: usize = 12;

/// How often the divisions of all curves and the noise are estimated again.
pub const DIVISION_ROUNDS: usize = 2;

/// Points at which a curve is reported.
pub const CURVE_POINTS: usize = 201;

// The physical forms.

/// Starting slopes of tanh in the search for minima, in units of one over the largest velocity.
pub const START_SLOPES: [f64; 4] = [5.0, 20.0, 60.0, 180.0];
/// Starting widths of a wind-up, as shares of the largest deflection.
pub const START_WINDUP_WIDTHS: [f64; 4] = [0.02, 0.06, 0.2, 0.5];
/// Starting Stribeck velocities, as shares of the largest velocity.
pub const START_STRIBECK_VELOCITIES: [f64; 3] = [0.005, 0.03, 0.2];
/// A form is refuted if its lack of fit is less probable than this. The level is smaller than usual: errors in bursts, where friction is
/// steep, make small probabilities too frequent on short logs (on ten simulated logs of 20 s, three of the 20 tests gave the true friction
/// less than 0.01, none less than 1e-4).
pub const REFUTED: f64 = 1e-4;

/// Knots of the hat functions on either side of zero.
pub const KNOTS: usize = 70;
/// How much denser the knots are at zero than at the ends.
pub const KNOTS_DENSER: f64 = 100.0;
/// Iterations of a minimisation.
pub const ITERATIONS: usize = 60;
/// The largest logarithm of a shape parameter.
pub const LARGEST_LOG: f64 = 40.0;

/// The largest step of a logarithm that finishes a minimum of the condensed equations.
pub const LONGEST_LOG_STEP: f64 = 0.5;
/// The largest Stribeck factor g1 of friction as a multiple of the Coulomb friction g4.
pub const LARGEST_STRIBECK: f64 = 5.0;
/// Stribeck factors g1, as shares of g4, that are tried if the lowest minimum has one that no arm can have.
pub const STRIBECK_SHARES: [f64; 5] = [0.1, 0.25, 0.5, 1.0, 2.0];
/// The quantile of 95 % of chi squared with four degrees of freedom: the decrease by g1, g2, g3 and g5 due to chance.
pub const AS_WELL: f64 = 9.49;
/// Half the distance of the points between which a slope is taken, as a share of the largest abscissa.
pub const TERM_SLOPE_STEP: f64 = 1e-6;

/// Sums of splines that the form's columns explain up to this share belong to the form.
pub const OF_THE_FORM: f64 = 1e-7;

/// Distances from the minimum: of logarithms, and of factors as shares of them. A parameter that is not refuted at the last distance has no
/// limit.
pub const PROFILE_STEPS: [f64; 9] = [0.02, 0.05, 0.12, 0.3, 0.6, 1.0, 1.8, 3.0, 4.6];
/// The unit of a factor's distances is at least this many of its standard errors.
pub const LEAST_UNIT: f64 = 4.0;

/// The data do not determine a parameter whose standard error is this share of it.
pub const LARGEST_ERROR: f64 = 0.5;
/// They do not determine it either if values farther away than this, relatively or in its logarithm, fit as well.
pub const FAR: f64 = 1.2;
/// Logarithms of shape parameters farther than this from the estimate are no limits.
pub const FARTHEST: f64 = 6.0;
/// Terms are similar if the logarithms of their slopes are nearer than this.
pub const ALIKE: f64 = 0.3;
/// Terms can be distinguished if the standard error of their factor is at most this share of it.
pub const COLLINEAR: f64 = 0.15;

// The simulated motion of stretches of a flexible joint.

/// Periods of the joint's resonance in a stretch, and its fewest samples.
pub const PERIODS_OF_RUN: f64 = 4.0;
pub const FEWEST_IN_RUN: usize = 60;
/// Samples of all stretches, at most about.
pub const SIMULATED_SAMPLES: usize = 20_000;
/// Rounds for friction that turns at once, and for that which turns over a distance. Convention.
pub const PRESLIDING_ROUNDS: usize = 6;
/// Friction turns over a distance if that lowers the logarithm of a stretch's mean square error by this many standard errors: a chance of 5 %, beside the test of the
/// equations. On eleven simulated joints whose friction turns over a distance, it was 1.9 to 25. On 26 whose friction turns at once, the equations showed a distance in
/// five logs, and the simulation agreed in three. In two of these, the simulation starts from inertias that are more than 20 % off.
pub const PRESLIDING_SURE: f64 = 1.645;
/// Rounds that move the initial states alone.
pub const START_ROUNDS: usize = 2;
/// The search ends after this many rounds that do not make the errors smaller.
pub const IDLE_ROUNDS: usize = 4;
/// The width within which dry friction is softened, as a share of the smallest velocity that is resolved.
pub const SOFTENED: f64 = 0.2;
/// The fewest and the most steps of a sample, and the longest step in time constants of the steepest friction, whose slope is taken over this share
/// of the largest velocity.
pub const LEAST_SUBSTEPS: usize = 8;
pub const MOST_SUBSTEPS: usize = 64;
pub const SLOPE_STEP: f64 = 1e-3;
pub const STEEPEST_STEP: f64 = 0.5;
/// Inertias of simulation and equations that differ by more than this many standard errors disagree.
pub const DISAGREE: f64 = 3.0;

// The free run.

/// The number of samples for minimising the error of a free run.
pub const POLISHED_SAMPLES: usize = 2000;
/// Integration steps a sample, while searching and for the motion itself.
pub const POLISH_SUBSTEPS: usize = 2;
pub const REPLAY_SUBSTEPS: usize = 8;
/// The first velocity of a simulated motion is fitted over this many periods of the smoothing's cut-off, and at least this many samples.
/// Conventions.
pub const START_PERIODS: f64 = 2.0;
pub const FEWEST_AT_START: usize = 10;
/// The step of difference quotients, as a share of a parameter's scale.
pub const POLISH_DIFFERENCE: f64 = 1e-3;
/// The most Gauss-Newton steps, and the share of the mean square by which the last one lowers it.
pub const POLISH_ROUNDS: usize = 20;
pub const POLISH_SETTLED: f64 = 1e-3;
/// Inertias of equations and simulation that differ by more than this share cannot both be right. Convention.
pub const OTHER_INERTIA: f64 = 0.1;
/// A polished form is used if it lowers the error of held-back halves by this share.
pub const BETTER_BY: f64 = 0.05;
/// A polished parameter differs by more than chance beyond this many standard errors.
pub const POLISH_DIFFERS: f64 = 3.0;

// The torque that a motion needs.

/// Periods of the cut-off at both ends of a motion in which its acceleration is not known, but at most one sample in so many.
pub const ENDS: f64 = 2.0;
pub const LONGEST_ENDS: usize = 10;

// The load of a chain.

/// A chain is contradicted by this many standard errors, and if the load's factor is off by this, or the links' inertia by this share of it.
/// Conventions: inertias of CAD files are known to some percent.
pub const CHAIN_ERRORS: f64 = 4.0;
pub const LOAD_OFF: f64 = 0.03;
pub const LINKS_OFF: f64 = 0.05;
