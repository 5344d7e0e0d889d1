//! A single flexible link on a hub, and its model-reference adaptive control (Sasiadek & Srinivasan 1989, Dynamic modeling and adaptive control
//! of a single-link flexible manipulator, AIAA J. Guidance 12).
//!
//! The link is a uniform beam, described by its first clamped-free modes \\(\phi_i\\) (Meirovitch); its root has the slope of the hub:
//!
//! $$ w(x, t) = x\, \theta + \sum_i \phi_i(x) q_i, \qquad
//!    J \theta'' + \sum_i a_i q_i'' = \tau, \quad a_i \theta'' + q_i'' + 2 \zeta \omega_i q_i' + \omega_i^2 q_i = 0 $$
//!
//! with \\(\omega_i = \beta_i^2 \sqrt{EI / \rho L^4}\\), \\(\int \rho \phi_i^2 = 1\\), \\(a_i = \int \rho x \phi_i = 2 L \sqrt{\rho L} / \beta_i^2\\) and
//! \\(\phi_i(L) = \pm 2 / \sqrt{\rho L}\\). A payload at the tip adds its kinetic energy. Torque and hub rate are collocated, which makes the plant passive.
//!
//! In the loop it is an arm of one link: `qm[0]` is the hub's angle, `q[0]` that of the tip (its arc over the length), `qm[1]` the second
//! mode's part of it, and `q[1]` is constant. The hub follows a reference model, [`ModelResponse`]. With \\(\epsilon = y_m' - \theta' +
//! \lambda (y_m - \theta)\\),
//!
//! $$ y_m'' = \omega^2 (r - y_m) - 2 \omega y_m', \qquad \tau = K^T x, \quad x = (\epsilon, y_m'', y_m'), \qquad K' = \Gamma\, \epsilon\, x $$

use super::{COEFFICIENTS, Controller, Jet, Measured, Plant, Trajectory};
use crate::error::{Error, Result};
use crate::linalg::{Matrix, Vector};
use crate::manipulator::State;

/// `beta L` of a clamped-free beam: roots of `cos b cosh b = -1`.
const BETA: [f64; MODES] = [1.875_104_068_711_961, 4.694_091_132_974_175];
/// The modes that are kept.
const MODES: usize = 2;
/// Hub and modes.
const N: usize = MODES + 1;

/// A flexible link; all in SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlexibleLinkParameters {
    /// The length, m.
    pub length: f64,
    /// EI, N m^2.
    pub stiffness: f64,
    /// The mass per length, kg/m.
    pub density: f64,
    /// The hub's inertia, kg m^2.
    pub hub: f64,
    /// The mass at the tip, kg; not negative.
    pub payload: f64,
    /// The modes' damping ratio; not negative.
    pub damping: f64,
}

impl Default for FlexibleLinkParameters {
    /// A link of the space arm's length and mass; its first mode with a clamped root is at 3.4 Hz.
    fn default() -> Self {
        FlexibleLinkParameters {
            length: 4.5,
            stiffness: 5000.0,
            density: 0.335,
            hub: 1.0,
            payload: 0.0,
            damping: 0.01,
        }
    }
}

/// A flexible link as a plant.
#[derive(Debug, Clone, PartialEq)]
pub struct FlexibleLink {
    inertia: f64,
    /// The accelerations of tip, hub and second mode by these angles, by their rates, and by the torque.
    by_angle: [[f64; N]; N],
    by_rate: [[f64; N]; N],
    by_torque: [f64; N],
}

impl FlexibleLink {
    /// A link of these parameters.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a parameter outside its range.
    pub fn new(parameters: &FlexibleLinkParameters) -> Result<Self> {
        let p = parameters;
        for (name, value) in [
            ("length", p.length),
            ("stiffness", p.stiffness),
            ("density", p.density),
            ("hub", p.hub),
        ] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(Error::parameter(name, value, "positive and finite"));
            }
        }
        for (name, value) in [("payload", p.payload), ("damping", p.damping)] {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(Error::parameter(name, value, "not negative and finite"));
            }
        }
        let beam = p.density * p.length;
        let mut mass = Matrix::identity(N, N);
        mass[(0, 0)] = p.hub + beam * p.length * p.length / 3.0;
        for (i, beta) in BETA.iter().enumerate() {
            let a = 2.0 * p.length * beam.sqrt() / (beta * beta);
            (mass[(0, 1 + i)], mass[(1 + i, 0)]) = (a, a);
        }
        let end = 2.0 / beam.sqrt();
        let tip = Vector::from_column_slice(&[p.length, end, -end]);
        mass += p.payload * &tip * tip.transpose();
        let inertia = mass[(0, 0)];
        let singular = || {
            Error::parameter(
                "the mass matrix's determinant",
                0.0,
                "positive: give the hub more inertia",
            )
        };
        let inverse = mass.cholesky().ok_or_else(singular)?.inverse();
        let frequencies = BETA.map(|beta| beta * beta * (p.stiffness / (beam * p.length.powi(3))).sqrt());
        let modes = |of: fn(f64, f64) -> f64| {
            let [first, second] = frequencies.map(|w| of(w, p.damping));
            Matrix::from_diagonal(&Vector::from_column_slice(&[0.0, first, second]))
        };
        // Hub angle and modes from the angles of tip, hub and second mode, and back.
        let part = p.length / end;
        let from = Matrix::from_row_slice(N, N, &[0.0, 1.0, 0.0, part, -part, part, 0.0, 0.0, part]);
        let to = Matrix::from_row_slice(
            N,
            N,
            &[1.0, 1.0 / part, -1.0 / part, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0 / part],
        );
        let back = |matrix: Matrix| -> [[f64; N]; N] {
            let matrix = -(&to * &inverse * matrix * &from);
            std::array::from_fn(|i| std::array::from_fn(|j| matrix[(i, j)]))
        };
        let by_torque = &to * inverse.column(0);
        Ok(FlexibleLink {
            inertia,
            by_angle: back(modes(|w, _| w * w)),
            by_rate: back(modes(|w, damping| 2.0 * damping * w)),
            by_torque: std::array::from_fn(|i| by_torque[i]),
        })
    }

    /// The circular frequencies of the free vibrations, rad/s, increasing.
    pub fn frequencies(&self) -> Vec<f64> {
        let generator = Matrix::from_fn(2 * N, 2 * N, |i, j| match (i < N, j < N) {
            (true, _) => f64::from(u8::from(j == N + i)),
            (false, true) => self.by_angle[i - N][j],
            (false, false) => self.by_rate[i - N][j - N],
        });
        let all = generator.complex_eigenvalues();
        let mut all: Vec<f64> = all.iter().map(|v| v.im).filter(|w| *w > 1e-6).collect();
        all.sort_unstable_by(f64::total_cmp);
        all
    }

    /// The inertia of the rigid link about the hub, kg m^2.
    pub fn inertia(&self) -> f64 {
        self.inertia
    }
}

impl Plant for FlexibleLink {
    fn derivative(&self, x: &[f64; 8], torque: [f64; 2]) -> [f64; 8] {
        let [q, _, qm, second, dq, _, dqm, dsecond] = *x;
        let (angles, rates) = ([q, qm, second], [dq, dqm, dsecond]);
        let [ddq, ddqm, ddsecond] = std::array::from_fn(|i| {
            let sum = |row: &[f64; N], of: [f64; N]| row.iter().zip(of).map(|(a, b)| a * b).sum::<f64>();
            sum(&self.by_angle[i], angles) + sum(&self.by_rate[i], rates) + self.by_torque[i] * torque[0]
        });
        [dq, 0.0, dqm, dsecond, ddq, 0.0, ddqm, ddsecond]
    }

    fn start(&self, reference: [Jet; 2]) -> State {
        let [angle, rate] = [0, 1].map(|order| [reference[0].derivative(order), 0.0]);
        State {
            q: angle,
            qm: angle,
            dq: rate,
            dqm: rate,
        }
    }
}

/// The answer of the critically damped reference model to commands, one after the other, from rest at 0.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelResponse {
    frequency: f64,
    duration: f64,
    /// For each command: the angle, the model's distance from it at the start, and the slope of `(y - r) exp(w t)`.
    commands: Vec<[f64; 3]>,
}

impl ModelResponse {
    /// The response to these angles, rad, each commanded for `duration` s; `frequency` is the model's circular frequency in rad/s.
    ///
    /// # Errors
    /// [`Error::Parameter`] unless there is an angle, all are finite, and the others positive and finite.
    pub fn new(angles: &[f64], duration: f64, frequency: f64) -> Result<Self> {
        for (name, value, requirement) in [
            ("duration", duration, "positive and finite (in s)"),
            ("frequency", frequency, "positive and finite (in rad/s)"),
        ] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(Error::parameter(name, value, requirement));
            }
        }
        if angles.is_empty() {
            return Err(Error::parameter("the number of angles", 0.0, "at least 1"));
        }
        let decay = (-frequency * duration).exp();
        let (mut y, mut dy) = (0.0, 0.0);
        let mut commands = Vec::with_capacity(angles.len());
        for &angle in angles {
            if !angle.is_finite() {
                return Err(Error::parameter("angles", angle, "finite (in rad)"));
            }
            let off = y - angle;
            let slope = dy + frequency * off;
            commands.push([angle, off, slope]);
            y = angle + decay * (off + slope * duration);
            dy = decay * (slope - frequency * (off + slope * duration));
        }
        Ok(ModelResponse {
            frequency,
            duration,
            commands,
        })
    }
}

impl Trajectory for ModelResponse {
    fn at(&self, t: f64) -> [Jet; 2] {
        let last = self.commands.len() - 1;
        // Times before 0, and NaN, count as 0.
        let k = ((t / self.duration) as usize).min(last);
        let [angle, off, slope] = self.commands[k];
        let s = (t - self.duration * k as f64).max(0.0);
        let w = self.frequency;
        let now = off + slope * s;
        let derivatives: [f64; COEFFICIENTS] = std::array::from_fn(|n| {
            let grown = now * (-w).powi(n as i32) + n as f64 * slope * (-w).powi(n as i32 - 1);
            (-w * s).exp() * grown + if n == 0 { angle } else { 0.0 }
        });
        [Jet::of_derivatives(&derivatives), Jet::default()]
    }

    fn end(&self) -> f64 {
        self.duration * self.commands.len() as f64
    }
}

/// The rates of model-reference adaptive control.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModelReferenceGains {
    /// The surface's slope, 1/s.
    pub surface: f64,
    /// `K` at the start: gains of the error, N m s/rad, of acceleration, kg m^2, and of velocity, N m s/rad.
    pub start: [f64; 3],
    /// The rates at which they follow.
    pub rates: [f64; 3],
}

impl ModelReferenceGains {
    /// Gains that work for a link like the default one at 100 Hz; they start from the inertia of this link.
    pub fn of(link: &FlexibleLink) -> Self {
        ModelReferenceGains {
            surface: 2.0,
            start: [60.0, link.inertia(), 0.0],
            rates: [3.0, 300.0, 3.0],
        }
    }

    /// The same without adaptation.
    #[must_use]
    pub fn fixed(self) -> Self {
        ModelReferenceGains {
            rates: [0.0; 3],
            ..self
        }
    }
}

/// Model-reference adaptive control of a flexible link's hub; the loop's reference is the model's motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModelReference {
    gains: ModelReferenceGains,
    adapted: [f64; 3],
}

impl ModelReference {
    /// A law with these gains.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a gain that is negative or not finite.
    pub fn new(gains: ModelReferenceGains) -> Result<Self> {
        let all = [gains.start, gains.rates, [gains.surface, 0.0, 0.0]].concat();
        if let Some(&gain) = all.iter().find(|v| !(**v >= 0.0 && v.is_finite())) {
            let name = "a gain of the model-reference law";
            return Err(Error::parameter(name, gain, "not negative and finite"));
        }
        Ok(ModelReference {
            gains,
            adapted: gains.start,
        })
    }

    /// The adapted gains.
    pub fn adapted(&self) -> [f64; 3] {
        self.adapted
    }
}

impl Controller for ModelReference {
    fn torque(&mut self, measured: &Measured) -> [f64; 2] {
        let (state, wanted) = (&measured.state, measured.reference[0]);
        let error = wanted.derivative(1) - state.dqm[0] + self.gains.surface * (wanted.value() - state.qm[0]);
        let x = [error, wanted.derivative(2), wanted.derivative(1)];
        let torque = self.adapted.iter().zip(x).map(|(k, x)| k * x).sum();
        for ((k, rate), x) in self.adapted.iter_mut().zip(self.gains.rates).zip(x) {
            *k += measured.sample_time * rate * error * x;
        }
        [torque, 0.0]
    }

    fn reset(&mut self) {
        self.adapted = self.gains.start;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::{Exact, LoopOptions, Run, run_loop};

    fn link(parameters: &FlexibleLinkParameters) -> FlexibleLink {
        FlexibleLink::new(parameters).unwrap()
    }

    /// A heavy hub clamps the root; one without inertia lets it turn: 15.418 and 49.965 are the squared roots of `tan b = tanh b`. Two
    /// modes give the first closely and the second roughly, from above.
    #[test]
    fn frequencies_are_those_of_beams() {
        let p = FlexibleLinkParameters {
            damping: 0.0,
            ..FlexibleLinkParameters::default()
        };
        let unit = (p.stiffness / (p.density * p.length.powi(4))).sqrt();
        let clamped = link(&FlexibleLinkParameters { hub: 1e9, ..p }).frequencies();
        for (got, expected) in clamped.iter().zip([3.516_015_3, 22.034_491_6]) {
            assert!((got / unit / expected - 1.0).abs() < 1e-6, "{clamped:?}");
        }
        let pinned = link(&FlexibleLinkParameters { hub: 1e-9, ..p }).frequencies();
        assert!((1.0..1.02).contains(&(pinned[0] / unit / 15.418)), "{pinned:?}");
        assert!((1.0..1.5).contains(&(pinned[1] / unit / 49.965)), "{pinned:?}");
    }

    /// The model obeys its equation, and a command's end is the start of the next.
    #[test]
    fn the_reference_model_answers_its_commands() {
        let model = ModelResponse::new(&[0.8, -0.4], 6.0, 0.9).unwrap();
        for (t, command) in [
            (0.0, 0.8),
            (2.5, 0.8),
            (5.9, 0.8),
            (6.0, -0.4),
            (7.7, -0.4),
            (40.0, -0.4),
        ] {
            let y = model.at(t)[0];
            let acceleration = 0.81 * (command - y.value()) - 1.8 * y.derivative(1);
            assert!((y.derivative(2) - acceleration).abs() < 1e-12, "{t}");
            // The higher derivatives continue those before.
            let ahead = y.shifted(1e-3);
            let there = model.at(t + 1e-3)[0];
            assert!((ahead.derivative(1) - there.derivative(1)).abs() < 1e-12, "{t}");
        }
        let [before, behind] = [6.0 - 1e-9, 6.0].map(|t| model.at(t)[0]);
        for order in 0..2 {
            assert!(
                (before.derivative(order) - behind.derivative(order)).abs() < 1e-8,
                "{order}"
            );
        }
        assert!((model.at(60.0)[0].value() + 0.4).abs() < 1e-12);
    }

    /// A run under commands that change every six seconds: behind 60 s, the largest distances of hub and tip from the model, rad.
    fn run(plant: &FlexibleLink, gains: ModelReferenceGains) -> ([f64; 2], ModelReference) {
        let commands: Vec<f64> = (0..20).map(|k| if k % 2 == 0 { 0.8 } else { -0.4 }).collect();
        let model = ModelResponse::new(&commands, 6.0, 0.8).unwrap();
        let mut law = ModelReference::new(gains).unwrap();
        let options = LoopOptions::new(model.end(), 0.01).unwrap();
        let Run {
            t, truth, reference, ..
        } = run_loop(plant, &mut law, &mut Exact, &model, &options).unwrap();
        let late = (0..t.len()).filter(|&k| t[k] >= 60.0);
        let off = late.map(|k| [truth[k].qm[0] - reference[k][0], truth[k].q[0] - reference[k][0]]);
        let worst = off.fold([0.0_f64; 2], |worst, off| [0, 1].map(|i| worst[i].max(off[i].abs())));
        (worst, law)
    }

    /// A payload unknown to the law. The law learns its inertia; the same gains without adaptation keep an error.
    #[test]
    fn an_unknown_payload_is_learnt() {
        let loaded = link(&FlexibleLinkParameters {
            payload: 1.0,
            ..FlexibleLinkParameters::default()
        });
        let gains = ModelReferenceGains::of(&link(&FlexibleLinkParameters::default()));
        let (adaptive, law) = run(&loaded, gains);
        let (stays, _) = run(&loaded, gains.fixed());
        assert!((0..2).all(|i| adaptive[i] < stays[i] / 5.0), "{adaptive:?} {stays:?}");
        let share = law.adapted()[1] / loaded.inertia();
        assert!((share - 1.0).abs() < 0.03, "{share}");
    }

    /// Keeps the Lyapunov function `1/2 J e^2` and the squared errors of the gains of acceleration and velocity at every instant.
    struct Watched(ModelReference, f64, Vec<f64>);

    impl Controller for Watched {
        fn torque(&mut self, measured: &Measured) -> [f64; 2] {
            let (state, wanted, gains) = (&measured.state, measured.reference[0], self.0.gains);
            let error = wanted.derivative(1) - state.dqm[0] + gains.surface * (wanted.value() - state.qm[0]);
            let [_, of_acceleration, of_velocity] = self.0.adapted();
            let off = (of_acceleration - self.1).powi(2) / gains.rates[1] + of_velocity.powi(2) / gains.rates[2];
            self.2.push(0.5 * self.1 * error * error + 0.5 * off);
            self.0.torque(measured)
        }

        fn reset(&mut self) {
            self.0.reset();
        }
    }

    /// On a link that hardly bends the function falls, except for the effect of sampling.
    #[test]
    fn the_lyapunov_function_falls_on_a_stiff_link() {
        let stiff = link(&FlexibleLinkParameters {
            stiffness: 1e7,
            payload: 1.5,
            damping: 0.5,
            ..FlexibleLinkParameters::default()
        });
        let gains = ModelReferenceGains::of(&link(&FlexibleLinkParameters::default()));
        let mut law = Watched(ModelReference::new(gains).unwrap(), stiff.inertia(), Vec::new());
        let model = ModelResponse::new(&[0.8, -0.4], 15.0, 0.8).unwrap();
        let options = LoopOptions::new(30.0, 1e-3).unwrap();
        run_loop(&stiff, &mut law, &mut Exact, &model, &options).unwrap();
        let values = law.2;
        let rises = values.windows(2).map(|v| v[1] - v[0]).fold(0.0, f64::max);
        let (first, last) = (values[0], values[values.len() - 1]);
        assert!(last < first && rises < 1e-2 * first, "{first} {last} {rises}");
    }
}
