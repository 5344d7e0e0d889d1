//! Input shaping: a reference convolved with impulses that cancel the vibration of a mode.
//!
//! With the mode's frequency w and damping ratio z, its damped period T and \\(K = e^{-z \pi / \sqrt{1 - z^2}}\\):
//!
//! | shaper | amplitudes | instants | source |
//! |---|---|---|---|
//! | ZV | (1, K) / (1 + K) | 0, T/2 | Smith 1957; Singer & Seering 1990 |
//! | ZVD | (1, 2K, K^2) / (1 + K)^2 | 0, T/2, T | Singer & Seering 1990 |
//! | EI | a residual vibration V = 5 % at w, none at a frequency on either side | 0, about T/2, T | Singhose, Seering & Singer 1994 |
//! | two-hump EI | V at two frequencies, none at w and at two outer frequencies; for small damping | 0, T/2, T, 3T/2 | Singhose, Porter,
//! Tuttle & Singer 1997 |
//!
//! The vibration after a sequence of impulses, relative to that after a single one, is
//! $$ V(w, z) = e^{-z w t_n} \left| \sum_i A_i e^{z w t_i} e^{j w \sqrt{1 - z^2} t_i} \right| $$

use super::{COEFFICIENTS, Jet, Trajectory, held_frequencies};
use crate::error::{Error, Result};
use crate::manipulator::Arm;

/// The residual vibration that EI shapers allow at their mode.
pub const TOLERATED: f64 = 0.05;

/// A kind of shaper.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shaper {
    /// Zero vibration.
    Zv,
    /// Zero vibration, with zero derivative with respect to the frequency.
    Zvd,
    /// Extra insensitive: 5 % at the mode.
    Ei,
    /// Extra insensitive with two humps.
    TwoHump,
}

/// An impulse of a shaper.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Impulse {
    /// Its share; the shares of a shaper sum to 1.
    pub amplitude: f64,
    /// Its instant in damped periods of the mode.
    pub periods: f64,
}

impl Shaper {
    /// All kinds.
    pub const ALL: [Shaper; 4] = [Shaper::Zv, Shaper::Zvd, Shaper::Ei, Shaper::TwoHump];

    /// The impulses for a mode of this damping ratio, 0 to below 1.
    ///
    /// ```
    /// use flexure::control::shaping::Shaper;
    /// let zv = Shaper::Zv.impulses(0.0);
    /// assert_eq!(zv.iter().map(|i| (i.amplitude, i.periods)).collect::<Vec<_>>(), [(0.5, 0.0), (0.5, 0.5)]);
    /// ```
    pub fn impulses(self, damping: f64) -> Vec<Impulse> {
        let z = damping;
        let k = (-z * std::f64::consts::PI / (1.0 - z * z).sqrt()).exp();
        let v = TOLERATED;
        let of = |amplitudes: &[f64], periods: &[f64]| {
            let pairs = amplitudes.iter().zip(periods);
            pairs
                .map(|(&amplitude, &periods)| Impulse { amplitude, periods })
                .collect()
        };
        match self {
            Shaper::Zv => of(&[1.0 / (1.0 + k), k / (1.0 + k)], &[0.0, 0.5]),
            Shaper::Zvd => {
                let d = (1.0 + k) * (1.0 + k);
                of(&[1.0 / d, 2.0 * k / d, k * k / d], &[0.0, 0.5, 1.0])
            }
            Shaper::Ei if z == 0.0 => of(&[0.25 * (1.0 + v), 0.5 * (1.0 - v), 0.25 * (1.0 + v)], &[0.0, 0.5, 1.0]),
            Shaper::Ei => {
                // Fitted to the numerical solution, for damping ratios up to 0.3.
                let first =
                    0.24968 + 0.24961 * v + 0.80008 * z + 1.23328 * v * z + 0.49599 * z * z + 3.17316 * v * z * z;
                let last =
                    0.25149 + 0.21474 * v - 0.83249 * z + 1.41498 * v * z + 0.85181 * z * z - 4.90094 * v * z * z;
                let middle = 0.49990
                    + 0.46159 * v * z
                    + 4.26169 * v * z * z
                    + 1.75601 * v * z.powi(3)
                    + v * v * (8.57843 * z - 108.644 * z * z + 336.989 * z.powi(3));
                of(&[first, 1.0 - first - last, last], &[0.0, middle, 1.0])
            }
            Shaper::TwoHump => {
                let x = (v * v * ((1.0 - v * v).sqrt() + 1.0)).cbrt();
                let outer = (3.0 * x * x + 2.0 * x + 3.0 * v * v) / (16.0 * x);
                let inner = 0.5 - outer;
                // Damping reduces the vibration by the factor K in half a period.
                let shares = [outer, inner * k, inner * k * k, outer * k * k * k];
                let sum: f64 = shares.iter().sum();
                of(&shares.map(|a| a / sum), &[0.0, 0.5, 1.0, 1.5])
            }
        }
    }

    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Shaper::Zv => "zv",
            Shaper::Zvd => "zvd",
            Shaper::Ei => "ei",
            Shaper::TwoHump => "two-hump-ei",
        }
    }
}

/// The residual vibration of a mode of `frequency` and `damping` after impulses designed for the frequency `designed`; 1 for one impulse
/// alone.
pub fn residual_vibration(impulses: &[Impulse], designed: f64, damping: f64, frequency: f64) -> f64 {
    let root = (1.0 - damping * damping).sqrt();
    let instant = |impulse: &Impulse| impulse.periods * std::f64::consts::TAU / (designed * root);
    let last = impulses.iter().map(instant).fold(0.0, f64::max);
    let (mut c, mut s) = (0.0, 0.0);
    for impulse in impulses {
        let t = instant(impulse);
        let size = impulse.amplitude * (damping * frequency * (t - last)).exp();
        let (sin, cos) = (frequency * root * t).sin_cos();
        (c, s) = (c + size * cos, s + size * sin);
    }
    f64::hypot(c, s)
}

/// A mode that a shaper cancels.
#[derive(Debug, Clone, PartialEq)]
pub enum Mode {
    /// One frequency, rad/s, with its damping ratio.
    Fixed {
        /// rad/s, positive.
        frequency: f64,
        /// 0 to below 1.
        damping: f64,
    },
    /// A mode of the arm with motors held by servos, at the present elbow angle of the reference.
    Along {
        /// The arm.
        arm: Box<Arm>,
        /// The servos' stiffness, N m/rad.
        servo: [f64; 2],
        /// 0, the lower mode, or 1.
        mode: usize,
    },
}

impl Mode {
    fn frequency(&self, q2: Jet) -> Jet {
        match self {
            Mode::Fixed { frequency, .. } => Jet::constant(*frequency),
            Mode::Along { arm, servo, mode } => held_frequencies(arm, q2, *servo)[*mode],
        }
    }

    fn damping(&self) -> f64 {
        match self {
            Mode::Fixed { damping, .. } => *damping,
            Mode::Along { .. } => 0.0,
        }
    }
}

/// A trajectory that is shaped against modes, with one shaper for each.
pub struct Shaped<T> {
    inner: T,
    stages: Vec<(Vec<Impulse>, Mode)>,
    lag: f64,
}

impl<T: Trajectory> Shaped<T> {
    /// Shapes a trajectory against all these modes.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a mode whose frequency or damping is outside its range.
    pub fn new(inner: T, shaper: Shaper, modes: Vec<Mode>) -> Result<Self> {
        for mode in &modes {
            if let Mode::Fixed { frequency, damping } = mode {
                if !(*frequency > 0.0 && frequency.is_finite()) {
                    return Err(Error::parameter(
                        "a mode's frequency",
                        *frequency,
                        "positive and finite (in rad/s)",
                    ));
                }
                if !(0.0..0.3).contains(damping) {
                    return Err(Error::parameter(
                        "a mode's damping ratio",
                        *damping,
                        "from 0 to below 0.3",
                    ));
                }
            }
        }
        let stages: Vec<_> = modes
            .into_iter()
            .map(|mode| (shaper.impulses(mode.damping()), mode))
            .collect();
        let mut shaped = Shaped {
            inner,
            stages,
            lag: 0.0,
        };
        let end = shaped.inner.end();
        let last = |(impulses, mode): &(Vec<Impulse>, Mode)| {
            let longest = impulses.last().map_or(0.0, |i| i.periods);
            longest * shaped.period(mode, end).value()
        };
        shaped.lag = shaped.stages.iter().map(last).sum();
        Ok(shaped)
    }

    /// The damped period of a mode at time `t`, s.
    fn period(&self, mode: &Mode, t: f64) -> Jet {
        let z = mode.damping();
        let frequency = mode.frequency(self.inner.at(t)[1]);
        frequency.recip() * (std::f64::consts::TAU / (1.0 - z * z).sqrt())
    }
}

impl<T: Trajectory> Trajectory for Shaped<T> {
    fn at(&self, t: f64) -> [Jet; 2] {
        let mut now = [0.0; COEFFICIENTS];
        (now[0], now[1]) = (t, 1.0);
        let mut sent = vec![(1.0, Jet(now))];
        for (impulses, mode) in &self.stages {
            let period = self.period(mode, t);
            let one = |(share, instant): &(f64, Jet)| {
                let (share, instant) = (*share, *instant);
                impulses
                    .iter()
                    .map(move |i| (share * i.amplitude, instant - period * i.periods))
            };
            sent = sent.iter().flat_map(one).collect();
        }
        let mut q = [Jet::default(); 2];
        for (share, instant) in sent {
            let then = self.inner.at(instant.value());
            q = [0, 1].map(|i| q[i] + then[i].at(instant) * share);
        }
        q
    }

    fn end(&self) -> f64 {
        self.inner.end() + self.lag
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::{Exact, Figures, LoopOptions};
    use crate::control::{JointMoves, controllers, run_loop};
    use crate::manipulator::{JointKind, space_arm};

    /// The residual amplitude of `x'' + 2 z w x' + w^2 x = w^2 u` after a shaped step, by summing step responses.
    fn step_response_left(impulses: &[Impulse], designed: f64, z: f64, w: f64) -> f64 {
        let root = (1.0 - z * z).sqrt();
        let instants = impulses
            .iter()
            .map(|i| i.periods * std::f64::consts::TAU / (designed * root));
        let pairs: Vec<(f64, f64)> = impulses.iter().map(|i| i.amplitude).zip(instants).collect();
        let last = pairs.iter().map(|p| p.1).fold(0.0, f64::max);
        // Position error and velocity just after the last impulse give the amplitude, in units of that of one step.
        let (mut e, mut v) = (0.0, 0.0);
        for (a, t) in pairs {
            let s = last - t;
            let (sin, cos) = (w * root * s).sin_cos();
            let decay = (-z * w * s).exp();
            e -= a * decay * (cos + z / root * sin);
            v += a * decay * w / root * sin;
        }
        f64::hypot(e, (v / w + z * e) / root) * root
    }

    #[test]
    fn residual_vibration_is_that_of_an_oscillator() {
        for shaper in Shaper::ALL {
            for z in [0.0, 0.02, 0.1] {
                let impulses = shaper.impulses(z);
                assert!((impulses.iter().map(|i| i.amplitude).sum::<f64>() - 1.0).abs() < 1e-12);
                for w in [0.7, 0.9, 1.0, 1.15, 1.3] {
                    let theory = residual_vibration(&impulses, 1.0, z, w);
                    let simulated = step_response_left(&impulses, 1.0, z, w);
                    assert!(
                        (theory - simulated).abs() < 1e-12,
                        "{shaper:?} {z} {w}: {theory} {simulated}"
                    );
                }
            }
        }
    }

    /// scripts/reference/arm_control.py: SciPy's oscillator, moved by the published amplitudes.
    #[test]
    fn residual_vibration_is_that_of_scipy() {
        for (shaper, damping, expected) in [
            (
                Shaper::Zv,
                0.0,
                [
                    0.309_016_994_374_947_06,
                    0.156_434_465_040_231_29,
                    0.309_016_994_374_951_34,
                ],
            ),
            (
                Shaper::Zvd,
                0.0,
                [
                    0.095_491_502_812_526_07,
                    0.024_471_741_852_423_33,
                    0.095_491_502_812_528_69,
                ],
            ),
            (
                Shaper::Ei,
                0.0,
                [
                    0.050_266_077_953_152_41,
                    0.024_304_671_054_955_9,
                    0.050_266_077_953_153_79,
                ],
            ),
            (
                Shaper::TwoHump,
                0.0,
                [
                    0.048_300_412_258_820_69,
                    0.038_653_937_955_013_48,
                    0.048_300_412_258_822_73,
                ],
            ),
            (
                Shaper::Zv,
                0.1,
                [
                    0.270_395_025_237_625_54,
                    0.130_534_272_074_659_23,
                    0.253_847_973_390_623_87,
                ],
            ),
            (
                Shaper::Zvd,
                0.1,
                [
                    0.073_113_469_673_256_16,
                    0.017_039_196_186_061_16,
                    0.064_438_793_594_526_9,
                ],
            ),
        ] {
            for (frequency, expected) in [0.8, 1.1, 1.2].into_iter().zip(expected) {
                let got = residual_vibration(&shaper.impulses(damping), 1.0, damping, frequency);
                assert!(
                    (got - expected).abs() < 1e-10,
                    "{shaper:?} {damping} {frequency}: {got} {expected}"
                );
            }
        }
    }

    #[test]
    fn shapers_leave_what_their_designs_say() {
        let left = |shaper: Shaper, z, w| residual_vibration(&shaper.impulses(z), 1.0, z, w);
        for z in [0.0, 0.05, 0.2] {
            assert!(left(Shaper::Zv, z, 1.0) < 1e-12 && left(Shaper::Zvd, z, 1.0) < 1e-12);
            // ZVD is quadratic in the frequency's error, ZV linear.
            assert!(left(Shaper::Zvd, z, 1.01) < 3e-4 && left(Shaper::Zv, z, 1.01) > 1e-2 * (1.0 - z));
            assert!(
                (left(Shaper::Ei, z, 1.0) - TOLERATED).abs() < 3e-3,
                "{z}: {}",
                left(Shaper::Ei, z, 1.0)
            );
        }
        // The published insensitivities at 5 %, undamped: 0.06, 0.29, 0.40 and 0.73 of the frequency.
        for (shaper, width) in [
            (Shaper::Zv, 0.064),
            (Shaper::Zvd, 0.286),
            (Shaper::Ei, 0.399),
            (Shaper::TwoHump, 0.726),
        ] {
            let within = (0..20_000).filter(|&k| left(shaper, 0.0, 0.5 + 5e-5 * k as f64) <= TOLERATED + 1e-12);
            assert!((within.count() as f64 * 5e-5 - width).abs() < 2e-3, "{shaper:?}");
        }
        // So the robust shapers tolerate an error of 20 %.
        for w in [0.8, 0.9, 1.0, 1.1, 1.2] {
            assert!(
                left(Shaper::TwoHump, 0.0, w) <= TOLERATED && left(Shaper::Ei, 0.0, w) <= TOLERATED + 2e-3,
                "{w}"
            );
        }
    }

    /// A move of the arm with frequencies off by 20 % because of its stiffness: the robust shaper reduces the vibration to a twentieth.
    #[test]
    fn the_arm_comes_to_rest_over_20_percent_of_frequency() {
        let nominal = Arm::new(space_arm(JointKind::Linear)).unwrap();
        let links = nominal.parameters().links;
        let servo = [1000.0; 2];
        let gains = controllers::Gains::new(servo, [60.0; 2]).unwrap();
        for factor in [0.8_f64, 1.0, 1.2] {
            let mut parameters = space_arm(JointKind::Linear);
            for joint in &mut parameters.joints {
                // The stiffness of spring and servo in series is off by the square of the factor.
                let held = factor * factor / (1.0 / joint.stiffness + 1.0 / servo[0]);
                joint.stiffness = 1.0 / (1.0 / held - 1.0 / servo[0]);
            }
            let plant = Arm::new(parameters).unwrap();
            let left = |shaped: bool| {
                let moves = JointMoves::new(&[[0.0, 0.6], [0.5, 1.0]], 0.8, 0.0).unwrap();
                let mode = |mode| Mode::Along {
                    arm: Box::new(nominal),
                    servo,
                    mode,
                };
                let modes = if shaped { vec![mode(0), mode(1)] } else { Vec::new() };
                let shaped = Shaped::new(moves, Shaper::TwoHump, modes).unwrap();
                let options = LoopOptions::new(shaped.end() + 4.0, 0.01).unwrap();
                let mut controller = controllers::Feedforward::none(gains);
                let run = run_loop(&plant, &mut controller, &mut Exact, &shaped, &options).unwrap();
                Figures::new(&run, &links, shaped.end()).residual_vibration
            };
            let (shaped, plain) = (left(true), left(false));
            assert!(shaped < 0.05 * plain, "{factor}: {shaped} of {plain}");
        }
    }
}
