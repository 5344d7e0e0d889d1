//! A single flexible link on a hub, and its model-reference adaptive control (Sasiadek & Srinivasan 1989, Dynamic modeling and adaptive control
//! of a single-link flexible manipulator, AIAA J. Guidance 12).
//!
//! The link is a uniform beam by its first clamped-free modes \\(\phi_i\\) (Meirovitch), of which the root has the slope of the hub:
//!
//! $$ w(x, t) = x\, \theta + \sum_i \phi_i(x) q_i, \qquad
//!    J \theta'' + \sum_i a_i q_i'' = \tau, \quad a_i \theta'' + q_i'' + 2 \zeta \omega_i q_i' + \omega_i^2 q_i = 0 $$
//!
//! with \\(\omega_i = \beta_i^2 \sqrt{EI / \rho L^4}\\), \\(\int \rho \phi_i^2 = 1\\), \\(a_i = \int \rho x \phi_i = 2 L \sqrt{\rho L} / \beta_i^2\\) and
//! \\(\phi_i(L) = \pm 2 / \sqrt{\rho L}\\). A payload at the tip adds its kinetic energy. Torque and hub rate are collocated, which makes the plant passive.
//!
//! The hub is to move as a reference model does, \\(y_m'' = \omega^2 (r - y_m) - 2 \omega y_m'\\). With \\(\epsilon = y_m' - \theta' + \lambda (y_m - \theta)\\),
//!
//! $$ \tau = K^T x, \quad x = (\epsilon, y_m'', y_m'), \qquad K' = \Gamma\, \epsilon\, x $$

use crate::error::{Error, Result};
use crate::linalg::{Matrix, Vector};

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
    /// A link of the space arm's length and mass, whose first mode is at 3.4 Hz where the root is clamped.
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

/// A flexible link under a torque that is held over a sample time: exact, as the equations are linear.
#[derive(Debug, Clone)]
pub struct FlexibleLink {
    inertia: f64,
    /// What the tip moves by hub angle and modes.
    shape: Vector,
    /// The generator of hub angle, modes and their rates.
    generator: Matrix,
    flow: Matrix,
    held: Vector,
    x: Vector,
}

impl FlexibleLink {
    /// A link at rest, sampled at `step` s.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a parameter or a step outside its range.
    pub fn new(parameters: &FlexibleLinkParameters, step: f64) -> Result<Self> {
        let p = parameters;
        for (name, value) in [
            ("length", p.length),
            ("stiffness", p.stiffness),
            ("density", p.density),
            ("hub", p.hub),
            ("sample_time", step),
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
        let mut generator = Matrix::zeros(2 * N + 1, 2 * N + 1);
        for i in 0..N {
            generator[(i, N + i)] = 1.0;
            for (j, beta) in BETA.iter().enumerate() {
                let frequency = beta * beta * (p.stiffness / (beam * p.length.powi(3))).sqrt();
                generator[(N + i, 1 + j)] = -inverse[(i, 1 + j)] * frequency * frequency;
                generator[(N + i, N + 1 + j)] = -inverse[(i, 1 + j)] * 2.0 * p.damping * frequency;
            }
            generator[(N + i, 2 * N)] = inverse[(i, 0)];
        }
        let flow = (&generator * step).exp();
        Ok(FlexibleLink {
            inertia,
            shape: tip,
            generator,
            held: flow.column(2 * N).rows(0, 2 * N).into_owned(),
            flow: flow.view((0, 0), (2 * N, 2 * N)).into_owned(),
            x: Vector::zeros(2 * N),
        })
    }

    /// The circular frequencies of the free vibrations, rad/s, increasing.
    pub fn frequencies(&self) -> Vec<f64> {
        let free = self.generator.view((0, 0), (2 * N, 2 * N)).into_owned();
        let mut all: Vec<f64> = free
            .complex_eigenvalues()
            .iter()
            .map(|v| v.im)
            .filter(|w| *w > 1e-6)
            .collect();
        all.sort_unstable_by(f64::total_cmp);
        all
    }

    /// The inertia of the rigid link about the hub, kg m^2.
    pub fn inertia(&self) -> f64 {
        self.inertia
    }

    /// Hub angle, rad, and rate, rad/s.
    pub fn hub(&self) -> [f64; 2] {
        [self.x[0], self.x[N]]
    }

    /// The tip's place along its arc, m.
    pub fn tip(&self) -> f64 {
        self.shape.dot(&self.x.rows(0, N))
    }

    /// Holds a torque, N m, over a sample time.
    pub fn push(&mut self, torque: f64) {
        self.x = &self.flow * &self.x + &self.held * torque;
    }
}

/// The rates of model-reference adaptive control.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModelReferenceGains {
    /// The reference model's frequency, rad/s.
    pub model: f64,
    /// The surface's slope, 1/s.
    pub surface: f64,
    /// `K` at the start: of the error, N m s/rad, of acceleration, kg m^2, and of velocity, N m s/rad.
    pub start: [f64; 3],
    /// The rates at which they follow.
    pub rates: [f64; 3],
}

impl Default for ModelReferenceGains {
    /// Gains that do for the default link at 100 Hz.
    fn default() -> Self {
        ModelReferenceGains {
            model: 0.8,
            surface: 2.0,
            start: [60.0, 11.2, 0.0],
            rates: [3.0, 300.0, 3.0],
        }
    }
}

/// Model-reference adaptive control of a flexible link's hub.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModelReference {
    gains: ModelReferenceGains,
    /// Angle and rate of the reference model.
    model: [f64; 2],
    adapted: [f64; 3],
}

impl ModelReference {
    /// A law from rest.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a gain that is negative or not finite.
    pub fn new(gains: ModelReferenceGains) -> Result<Self> {
        let all = [gains.start, gains.rates, [gains.model, gains.surface, 0.0]].concat();
        if let Some(&gain) = all.iter().find(|v| !(**v >= 0.0 && v.is_finite())) {
            let name = "a gain of the model-reference law";
            return Err(Error::parameter(name, gain, "not negative and finite"));
        }
        Ok(ModelReference {
            gains,
            model: [0.0; 2],
            adapted: gains.start,
        })
    }

    /// Angle and rate of the reference model.
    pub fn model(&self) -> [f64; 2] {
        self.model
    }

    /// The adapted gains.
    pub fn adapted(&self) -> [f64; 3] {
        self.adapted
    }

    /// The torque to be held over `step` s for this command, rad, with hub angle and rate as they are.
    pub fn torque(&mut self, command: f64, hub: [f64; 2], step: f64) -> f64 {
        let g = &self.gains;
        let [y, dy] = self.model;
        let acceleration = g.model * g.model * (command - y) - 2.0 * g.model * dy;
        let error = dy - hub[1] + g.surface * (y - hub[0]);
        let x = [error, acceleration, dy];
        let torque = self.adapted.iter().zip(x).map(|(k, x)| k * x).sum();
        for ((k, rate), x) in self.adapted.iter_mut().zip(g.rates).zip(x) {
            *k += step * rate * error * x;
        }
        // The critically damped model, exactly.
        let (decay, off) = ((-g.model * step).exp(), y - command);
        let slope = dy + g.model * off;
        self.model = [
            command + decay * (off + slope * step),
            decay * (dy - g.model * slope * step),
        ];
        torque
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP: f64 = 0.01;

    fn link(parameters: &FlexibleLinkParameters) -> FlexibleLink {
        FlexibleLink::new(parameters, STEP).unwrap()
    }

    /// A heavy hub clamps the root; one without inertia lets it turn: 15.418 and 49.965 are the squared roots of `tan b = tanh b`, of which two
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

    /// A run under commands that change every six seconds: behind `after` s, the largest distances of hub, rad, and tip, m, from the model.
    fn run(parameters: &FlexibleLinkParameters, gains: ModelReferenceGains, after: f64) -> ([f64; 2], ModelReference) {
        let mut plant = link(parameters);
        let mut law = ModelReference::new(gains).unwrap();
        let mut worst = [0.0_f64; 2];
        for k in 0..12_000 {
            let t = STEP * f64::from(k);
            if t >= after {
                let [model, _] = law.model();
                let off = [plant.hub()[0] - model, plant.tip() - parameters.length * model];
                worst = [0, 1].map(|i| worst[i].max(off[i].abs()));
            }
            let command = if ((t / 6.0) as u32).is_multiple_of(2) {
                0.8
            } else {
                -0.4
            };
            let torque = law.torque(command, plant.hub(), STEP);
            plant.push(torque);
        }
        (worst, law)
    }

    /// A payload that the law was not told of: it learns its inertia, where the same gains without adaptation stay off.
    #[test]
    fn an_unknown_payload_is_learnt() {
        let loaded = FlexibleLinkParameters {
            payload: 1.0,
            ..FlexibleLinkParameters::default()
        };
        let fixed = ModelReferenceGains {
            rates: [0.0; 3],
            ..ModelReferenceGains::default()
        };
        let (adaptive, law) = run(&loaded, ModelReferenceGains::default(), 60.0);
        let (stays, _) = run(&loaded, fixed, 60.0);
        assert!((0..2).all(|i| adaptive[i] < stays[i] / 5.0), "{adaptive:?} {stays:?}");
        let share = law.adapted()[1] / link(&loaded).inertia();
        assert!((share - 1.0).abs() < 0.03, "{share}");
    }

    /// On a link that hardly bends, `1/2 J e^2` and the squared errors of the gains of acceleration and velocity fall together, but for sampling.
    #[test]
    fn the_lyapunov_function_falls_on_a_stiff_link() {
        let stiff = FlexibleLinkParameters {
            stiffness: 1e7,
            payload: 1.5,
            damping: 0.5,
            ..FlexibleLinkParameters::default()
        };
        let gains = ModelReferenceGains::default();
        let mut plant = FlexibleLink::new(&stiff, 1e-3).unwrap();
        let mut law = ModelReference::new(gains).unwrap();
        let inertia = plant.inertia();
        let mut before = f64::INFINITY;
        let (mut first, mut rises) = (None, 0.0_f64);
        for k in 0..30_000 {
            let error = law.model()[1] - plant.hub()[1] + gains.surface * (law.model()[0] - plant.hub()[0]);
            let [_, of_acceleration, of_velocity] = law.adapted();
            let off = (of_acceleration - inertia).powi(2) / gains.rates[1] + of_velocity.powi(2) / gains.rates[2];
            let value = 0.5 * inertia * error * error + 0.5 * off;
            first.get_or_insert(value);
            rises = rises.max(value - before);
            before = value;
            let torque = law.torque(if k < 15_000 { 0.8 } else { -0.4 }, plant.hub(), 1e-3);
            plant.push(torque);
        }
        let first = first.unwrap();
        assert!(before < first && rises < 1e-2 * first, "{first} {before} {rises}");
    }
}
