//! The equations of motion of a flexible joint.
//!
//! $$ \tau = J_m \ddot q_m + \kappa(d), \qquad L = \kappa(d) - M \ddot q - f(\dot q). $$
//!
//! with a known load L on the link, and the other effects on the joint: columns and a further curve of the [`effects`](super::effects).

use super::column_noise::{AbscissaNoise, Noisy};
use super::compliance::Deflection;
use super::covariance::fitted_noise;
use super::division::{FRICTION, STIFFNESS};
use super::equations::{Column, Lines};
use super::fourier::Modulation;
use super::kinks::{Kinks, with_kinks};
use super::limits::{MOTOR_ROUNDS, NOISE_ROUNDS, RESOLVED_DEFLECTION};
use super::motion::Motion;
use super::outcome::{Effect, Estimated};
use super::rests::Rests;
use super::smooth::{Noise, Reflected};
use super::system::{Curve, CurveKind, FreeCurves, Splines, System, low_frequencies};
use crate::linalg::Complex;

/// The transformed log of a flexible joint.
pub(super) struct JointSignals<'a> {
    pub modulation: &'a Modulation,
    pub deflection: Deflection,
    /// The link's velocity at every sample, and its resolution.
    pub v: Vec<f64>,
    pub resolution: f64,
    /// The motor's velocity at every sample.
    pub v_motor: Vec<f64>,
    /// The torque, minus the part for the motor's inertia if that is known.
    pub torque: Lines,
    /// The motor's acceleration; `None` if its inertia is known.
    pub motor: Option<Lines>,
    /// The motor's inertia, if it is known.
    pub known_inertia: Option<f64>,
    /// The torque for the standard error of a known inertia of the motor, if it has one.
    pub given: Option<Lines>,
    /// The known torque that the link bears besides; zeros if there is none.
    pub load: Lines,
    /// Minus the link's acceleration.
    pub link: Lines,
    /// The spectra of the encoders' noise in the accelerations of motor and link.
    pub encoder: [Vec<f64>; 2],
    /// The spectrum of an angle's noise in the square of a deflection.
    pub squared: Vec<f64>,
    /// The same spectrum in the product of a deflection and minus an acceleration.
    pub shared: Vec<f64>,
    /// The variances of the noise of the motor's and of the link's angle.
    pub variances: [f64; 2],
    /// The other effects, as columns.
    pub acting: Vec<Acting>,
    /// The times at which motor and link rest, and the columns of the torques on them.
    pub rests: Rests,
    pub resting: Vec<Column>,
    /// The motor's velocity, if friction acts there.
    pub motor_velocity: Option<Velocity>,
}

/// The columns of an effect in the equations of motor and link.
pub(super) struct Acting {
    /// The effect; `None` for a delay of the torque.
    pub effect: Option<Effect>,
    pub columns: Vec<Column>,
    /// The torques of the columns at every sample, with factors of 1; empty for late samples, which are no torque.
    pub signals: Vec<Vec<f64>>,
}

/// A velocity as the abscissa of a friction.
pub(super) struct Velocity {
    /// The velocity at every sample, rad/s.
    pub v: Vec<f64>,
    /// The smallest difference that the data resolve.
    pub resolution: f64,
}

/// The stiffness curve by the motor's equation alone.
pub(super) struct MotorStart {
    pub splines: Splines,
    pub noise: Vec<f64>,
    /// The transformed elastic torque.
    pub kappa: Lines,
    /// The motor's inertia.
    pub inertia: f64,
}

/// The friction curve by the link's equation alone.
struct LinkStart {
    splines: Splines,
    noise: Vec<f64>,
}

impl<'a> JointSignals<'a> {
    /// The signals with the transformed torque at the time of its effect, and the link's angle on the motor's clock.
    pub fn new(motion: &Motion, modulation: &'a Modulation, mut torque: Lines, link: &[f64], kinks: &Kinks) -> Self {
        let velocity = |angle: &[f64], noise: Noise| Reflected::new(angle, motion.step).velocity(noise.cut_off());
        let motor = motion.rotor_acceleration(modulation);
        let mut given = None;
        if let Some(known) = motion.motor_inertia {
            torque.iter_mut().zip(&motor).for_each(|(t, m)| *t -= m * known.value);
            given = (known.standard_error > 0.0).then(|| motor.iter().map(|m| m * known.standard_error).collect());
        }
        let encoder = |sd: f64| modulation.omega.iter().map(|w| (sd * w * w).powi(2)).collect();
        JointSignals {
            deflection: motion.deflection(link),
            load: match motion.load {
                Some(load) => modulation.of(&load.torque),
                None => vec![Complex::new(0.0, 0.0); modulation.len()],
            },
            squared: vec![1.0; modulation.len()],
            shared: modulation.omega.iter().map(|w| w * w).collect(),
            variances: [motion.motor_noise.sd, motion.link_noise.sd].map(|sd| sd * sd),
            v: with_kinks(velocity(link, motion.link_noise), &kinks.link),
            v_motor: with_kinks(velocity(motion.motor, motion.motor_noise), &kinks.motor),
            resolution: motion.velocity_resolution(),
            link: modulation.of_acceleration(link).into_iter().map(|v| -v).collect(),
            encoder: [encoder(motion.rotor_sd()), encoder(motion.link_noise.sd)],
            motor: motion.motor_inertia.is_none().then_some(motor),
            torque,
            given,
            known_inertia: motion.motor_inertia.map(|known| known.value),
            modulation,
            acting: Vec::new(),
            rests: Rests::default(),
            resting: Vec::new(),
            motor_velocity: None,
        }
    }

    /// The number of the link's inertia among the factors; it follows the motor's if that is unknown.
    pub fn link_factor(&self) -> usize {
        usize::from(self.motor.is_some())
    }

    /// The motor's inertia: as known, or among these factors.
    fn motor_inertia(&self, factors: &[f64]) -> f64 {
        self.known_inertia.unwrap_or_else(|| factors[0])
    }

    /// The torque of these effects at every sample, for these factors.
    pub fn torque_of(&self, factors: &[f64], effects: [Effect; 2], samples: usize) -> Vec<f64> {
        let mut torque = vec![0.0; samples];
        for acting in &self.acting {
            let wanted = acting.effect.filter(|effect| effects.contains(effect));
            let own = wanted.into_iter().flat_map(|effect| self.factors_of(Some(effect)));
            for (factor, signal) in own.zip(&acting.signals) {
                torque
                    .iter_mut()
                    .zip(signal)
                    .for_each(|(t, s)| *t += factors[factor] * s);
            }
        }
        torque
    }

    /// The stiffness curve with these signs; it comes after the first `after` factors.
    pub fn stiffness<'b>(&'b self, signs: Vec<f64>, noise: Vec<AbscissaNoise<'b>>, after: usize) -> Curve<'b> {
        let d = &self.deflection.d;
        Curve {
            kind: CurveKind::Stiffness,
            x: d,
            signs,
            noise,
            resolution: RESOLVED_DEFLECTION * d.iter().fold(0.0_f64, |m, d| m.max(d.abs())),
            division: &STIFFNESS,
            after,
            passages: &[],
        }
    }

    /// The friction curve with these signs; it comes after the first `after` factors.
    pub fn friction(&self, signs: Vec<f64>, after: usize) -> Curve<'_> {
        Curve {
            kind: CurveKind::Friction,
            x: &self.v,
            signs,
            noise: Vec::new(),
            resolution: self.resolution,
            division: &FRICTION,
            after,
            passages: &[],
        }
    }

    /// The noise of the deflection in these blocks of equations, including the noise that it shares with accelerations. A smoothed
    /// deflection counts as free of noise: subtracting its noise made the inertias of stiff joints worse.
    pub fn deflection_noise<'b>(
        &'b self,
        blocks: &[usize],
        shared: impl IntoIterator<Item = AbscissaNoise<'b>>,
    ) -> Vec<AbscissaNoise<'b>> {
        if self.deflection.smoothed {
            return Vec::new();
        }
        let own = blocks.iter().map(|&block| AbscissaNoise {
            factor: None,
            block,
            spectrum: &self.squared,
            covariance: self.variances[0] + self.variances[1],
        });
        own.chain(shared).collect()
    }

    /// The motor's inertia with an allowance for the noise of the deflection, for a link of this inertia. If both angles accelerate
    /// equally, the motor's inertia replaces the missing part of the elastic torque.
    pub fn motor_inertia_of(&self, estimated: Estimated, link_inertia: f64) -> Estimated {
        estimated
            .or_off_by(link_inertia * self.deflection.attenuation)
            .or_off_by(estimated.value * self.deflection.confusion)
    }

    /// The product of this joint's deflection noise with the noise of the motor's or the link's acceleration, which is a factor's column.
    pub fn shared_noise(&self, factor: usize, block: usize, covariance: f64) -> AbscissaNoise<'_> {
        AbscissaNoise {
            factor: Some(factor),
            block,
            spectrum: &self.shared,
            covariance,
        }
    }

    /// The noise of the accelerations of motor and link in these equations, in a system with the inertias as factors.
    fn noisy(&self, blocks: [usize; 2]) -> Vec<Noisy<'_>> {
        let motor = self
            .motor
            .is_some()
            .then(|| Noisy::square(0, blocks[0], &self.encoder[0]));
        let link = Noisy::square(self.link_factor(), blocks[1], &self.encoder[1]);
        motor.into_iter().chain([link]).collect()
    }

    /// The noise that the deflection shares with the motor's acceleration. The motor's noise has a positive sign in the deflection, and a
    /// positive factor in minus the motor's acceleration.
    fn shared_with_motor(&self) -> Option<AbscissaNoise<'_>> {
        let shared = self.shared_noise(0, 0, -self.variances[0]);
        self.motor.is_some().then_some(shared)
    }

    /// The motor's equation alone.
    pub fn motor_system(&self) -> System<'_> {
        let noise = self.deflection_noise(&[0], self.shared_with_motor());
        let motor = self.motor.as_ref();
        System {
            modulation: self.modulation,
            factors: motor.map(|m| vec![Some(m.clone())]).into_iter().collect(),
            right: vec![self.torque.clone()],
            noisy: motor
                .map(|_| Noisy::square(0, 0, &self.encoder[0]))
                .into_iter()
                .collect(),
            given: Vec::new(),
            encoder_noise: Box::new(|x| vec![of_inertia(&self.encoder[0], self.motor_inertia(x))]),
            curves: vec![self.stiffness(vec![1.0], noise, self.link_factor())],
        }
    }

    /// The sum of both equations, `tau = Jm qm'' + M q'' + f(q')`.
    fn sum_system(&self) -> System<'_> {
        let link = self.link_factor();
        let columns = self.motor.iter().chain([&self.link]);
        System {
            modulation: self.modulation,
            factors: columns.map(|c| vec![Some(c.clone())]).collect(),
            right: vec![difference(&self.torque, &self.load)],
            noisy: self.noisy([0, 0]),
            given: Vec::new(),
            encoder_noise: Box::new(move |x| vec![of_inertia(&self.encoder[1], x[link])]),
            curves: vec![self.friction(vec![-1.0], link + 1)],
        }
    }

    /// The link's equation under this elastic torque.
    fn link_system(&self, kappa: &[Complex<f64>]) -> System<'_> {
        System {
            modulation: self.modulation,
            factors: vec![vec![Some(self.link.clone())]],
            right: vec![difference(&self.load, kappa)],
            noisy: vec![Noisy::square(0, 0, &self.encoder[1])],
            given: Vec::new(),
            encoder_noise: Box::new(|x| vec![of_inertia(&self.encoder[1], x[0])]),
            curves: vec![self.friction(vec![-1.0], 1)],
        }
    }

    /// Both equations.
    pub fn system(&self) -> System<'_> {
        let link = self.link_factor();
        let motor = self.motor.clone().map(|m| vec![Some(m), None]);
        // The link's noise has a negative sign in the deflection, and a positive sign in the link's column, minus its acceleration.
        let with_link = self.shared_noise(link, 1, -self.variances[1]);
        let noise = self.deflection_noise(&[0, 1], self.shared_with_motor().into_iter().chain([with_link]));
        let acting = self.acting.iter().flat_map(|acting| acting.columns.iter().cloned());
        let inertias = motor.into_iter().chain([vec![None, Some(self.link.clone())]]);
        let factors: Vec<Column> = inertias.chain(acting).chain(self.resting.iter().cloned()).collect();
        let mut curves = vec![
            self.stiffness(vec![1.0, 1.0], noise, link),
            self.friction(vec![0.0, -1.0], link + 1),
        ];
        curves.extend(self.motor_velocity.as_ref().map(|velocity| Curve {
            x: &velocity.v,
            resolution: velocity.resolution,
            ..self.friction(vec![1.0, 0.0], factors.len())
        }));
        System {
            modulation: self.modulation,
            factors,
            right: vec![self.torque.clone(), self.load.clone()],
            noisy: self.noisy([0, 1]),
            given: self.given.iter().map(|motor| vec![Some(motor.clone()), None]).collect(),
            encoder_noise: Box::new(move |x| {
                let [motor, of_link] = &self.encoder;
                vec![of_inertia(motor, self.motor_inertia(x)), of_inertia(of_link, x[link])]
            }),
            curves,
        }
    }

    /// The factors of an effect, or of the torque's delay, counted with those of the inertias.
    pub fn factors_of(&self, effect: Option<Effect>) -> std::ops::Range<usize> {
        let mut first = self.link_factor() + 1;
        for acting in &self.acting {
            let next = first + acting.columns.len();
            if acting.effect == effect {
                return first..next;
            }
            first = next;
        }
        first..first
    }

    /// The stiffness curve from the motor's equation alone; Akaike's criterion chooses the number of splines.
    pub fn motor_start(&self) -> Option<MotorStart> {
        let system = self.motor_system();
        let splines = |pieces: usize| system.curves[0].splines(self.modulation, pieces);
        let flat = vec![vec![1.0; self.modulation.len()]];
        let noise = system.reweighted(&[splines(STIFFNESS.coarse)], flat, MOTOR_ROUNDS)?;
        let curves = STIFFNESS.candidates.iter().filter_map(|&pieces| {
            let splines = splines(pieces);
            let solved = system.solve(&[&splines], &noise)?;
            let start = MotorStart {
                kappa: combine(&splines.lines, solved.coefficients(0)),
                noise: system.noise_of(&solved).remove(0),
                inertia: self.motor_inertia(&solved.factors()),
                splines,
            };
            Some((solved.akaike(), start))
        });
        let (_, start) = curves.min_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(start)
    }

    /// The friction curve from the link's equation alone, under this elastic torque.
    fn link_start(&self, motion: &Motion, kappa: &[Complex<f64>]) -> Option<LinkStart> {
        let (sum, link) = (self.sum_system(), self.link_system(kappa));
        let splines = |pieces: usize| link.curves[0].splines(self.modulation, pieces);
        let coarse = splines(FRICTION.coarse);
        let mut noise = vec![low_frequencies(self.modulation, motion.link_noise.band)];
        let mut unknowns = Vec::new();
        for _ in 0..NOISE_ROUNDS {
            let solved = sum.solve(&[&coarse], &noise)?;
            // The columns of the link have the sign of its own equation.
            let of_link = &solved.solution.x[self.link_factor()..];
            unknowns = of_link.iter().map(|x| -x).collect();
            noise = sum.noise_of(&solved);
        }
        let residuals = link.equations(&[&coarse], &noise).residuals(&unknowns);
        noise = vec![fitted_noise(&residuals[0], &of_inertia(&self.encoder[1], unknowns[0]))];
        noise = link.noise_of(&link.solve(&[&coarse], &noise)?);
        let friction =
            splines(FRICTION.undersmoothed(|pieces| Some(link.solve(&[splines(pieces)], &noise)?.akaike()))?);
        noise = link.noise_of(&link.solve(&[&friction], &noise)?);
        Some(LinkStart {
            splines: friction,
            noise: noise.remove(0),
        })
    }

    /// The free curves, and the noise of both equations.
    pub fn free(&self, motion: &Motion) -> Option<FreeCurves> {
        let motor = self.motor_start()?;
        let link = self.link_start(motion, &motor.kappa)?;
        let system = self.system();
        let at_motor = system.curves.get(2).map(|curve| curve.tested(self.modulation));
        let splines = [motor.splines, link.splines].into_iter().chain(at_motor);
        system.refined(splines.collect(), vec![motor.noise, link.noise])
    }
}

/// The spectrum of the torque of an inertia due to an acceleration's noise.
pub(super) fn of_inertia(spectrum: &[f64], inertia: f64) -> Vec<f64> {
    spectrum.iter().map(|e| inertia.powi(2) * e).collect()
}

/// The difference of two columns.
fn difference(of: &Lines, without: &[Complex<f64>]) -> Lines {
    of.iter().zip(without).map(|(a, b)| a - b).collect()
}

/// The sum of columns, each times its factor.
fn combine(columns: &[Lines], factors: &[f64]) -> Lines {
    let mut sum = vec![Complex::new(0.0, 0.0); columns.first().map_or(0, Vec::len)];
    for (column, factor) in columns.iter().zip(factors) {
        sum.iter_mut().zip(column).for_each(|(s, v)| *s += v * *factor);
    }
    sum
}
