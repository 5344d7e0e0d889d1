//! Simulated joints with known losses, springs and clocks, in a sampled position loop.
//!
//! Motor and link as two inertias; friction, springs and hysteresis between them can be switched on one by one:
//!
//! | effect | equation |
//! |---|---|
//! | friction at motor and link | $g_4 \tanh(g_5 v) + g_6 v$ and the Stribeck part, (12) |
//! | damping of the joint | $c\, \dot d$ |
//! | LuGre friction at the link | $\dot z = v - \sigma_0 \lvert v \rvert z / g(v)$, $f = \sigma_0 z + \sigma_1 \dot z$ (Canudas de Wit et al. 1995) |
//! | hysteretic spring | $\dot z = \dot d - \lvert \dot d \rvert z / z_0$, torque $h z$ (Dahl 1968) |
//! | gravity | $g \sin q$ |
//! | late samples of the link | in s |
//!
//! Runge-Kutta's method of order 4 with ten steps a sample; the torque is held from sample to sample.

use flexure::identify::robot_joint::Effect;
use flexure::identify::robot_joint::Effect::{
    Damping, EncoderSkew, Gravity, HystereticSpring, MotorFriction, Presliding,
};
use flexure::manipulator::{Friction, Stiffness};
use flexure::signal::{Phases, multisine};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

/// A friction with memory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LuGre {
    /// The stiffness sigma0, N m/rad, and the damping sigma1, N m s/rad, of the bristles.
    pub bristles: [f64; 2],
    /// Coulomb and static friction, N m.
    pub levels: [f64; 2],
    /// The Stribeck velocity, rad/s.
    pub velocity: f64,
}

impl LuGre {
    /// The friction of steady motion without its sign, N m.
    fn level(&self, v: f64) -> f64 {
        let [coulomb, fixed] = self.levels;
        coulomb + (fixed - coulomb) * (-(v / self.velocity).powi(2)).exp()
    }
}

/// A spring with memory, parallel to the other one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hysteresis {
    /// Its stiffness h where it turns, N m/rad.
    pub stiffness: f64,
    /// The deflection z0 at which it yields, rad.
    pub yields: f64,
}

/// A joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Joint {
    /// kg m^2.
    pub motor_inertia: f64,
    /// kg m^2.
    pub link_inertia: f64,
    pub stiffness: Stiffness,
    /// N m s/rad.
    pub damping: f64,
    pub motor_friction: Friction,
    pub link_friction: Friction,
    pub lugre: Option<LuGre>,
    pub hysteresis: Option<Hysteresis>,
    /// The largest torque of gravity, N m.
    pub gravity: f64,
    /// The delay of the link's samples, s; a whole number of steps of the integration.
    pub late: f64,
}

/// The angles of motor and link in rad and the torque in N m.
pub struct JointLog {
    pub motor: Vec<f64>,
    pub link: Vec<f64>,
    pub torque: Vec<f64>,
    pub sample_time: f64,
}

/// How a log is recorded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Recording {
    /// s.
    pub seconds: f64,
    /// s.
    pub sample_time: f64,
    /// The largest angle of the reference, rad.
    pub amplitude: f64,
    /// The frequencies of the reference, Hz.
    pub band: [f64; 2],
    /// How often the reference stops for a moment, Hz; 0 for never.
    pub stops: f64,
    /// The largest torque of a multisine from 3 to 25 Hz that is added to the loop's, N m.
    pub dither: f64,
    /// The standard deviation of the encoders' noise, rad.
    pub encoders: f64,
    /// The standard deviation of the torque's noise, N m.
    pub torque: f64,
}

/// Steps of the integration a sample.
const STEPS: usize = 10;

/// Positions, velocities of motor and link, bristles, and the spring's memory.
type State = [f64; 6];

impl Joint {
    /// The link's friction in steady motion, N m.
    pub fn steady_friction(&self, v: f64) -> f64 {
        let lugre = self.lugre.map_or(0.0, |lugre| lugre.level(v) * v.signum());
        self.link_friction.torque(v) + lugre
    }

    fn slope(&self, [qm, q, vm, v, bristle, memory]: State, torque: f64) -> State {
        let rate = vm - v;
        let (bristle_rate, lugre) = match self.lugre {
            None => (0.0, 0.0),
            Some(lugre) => {
                let [s0, s1] = lugre.bristles;
                let rate = v - s0 * v.abs() * bristle / lugre.level(v);
                (rate, s0 * bristle + s1 * rate)
            }
        };
        let (memory_rate, hysteretic) = match self.hysteresis {
            None => (0.0, 0.0),
            Some(Hysteresis { stiffness, yields }) => (rate - rate.abs() * memory / yields, stiffness * memory),
        };
        let elastic = self.stiffness.torque(qm - q) + self.damping * rate + hysteretic;
        [
            vm,
            v,
            (torque - elastic - self.motor_friction.torque(vm)) / self.motor_inertia,
            (elastic - self.link_friction.torque(v) - lugre - self.gravity * q.sin()) / self.link_inertia,
            bristle_rate,
            memory_rate,
        ]
    }

    fn step(&self, x: State, torque: f64, h: f64) -> State {
        let ahead = |k: &State, h: f64| -> State { std::array::from_fn(|i| x[i] + h * k[i]) };
        let k1 = self.slope(x, torque);
        let k2 = self.slope(ahead(&k1, 0.5 * h), torque);
        let k3 = self.slope(ahead(&k2, 0.5 * h), torque);
        let k4 = self.slope(ahead(&k3, h), torque);
        std::array::from_fn(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]))
    }

    /// The log of a motion that follows a random-phase multisine of the motor's angle; seed and recording determine it.
    ///
    /// # Errors
    /// For a recording with which no multisine can be made.
    pub fn log(&self, recording: &Recording, seed: u64) -> flexure::Result<JointLog> {
        let Recording {
            seconds,
            sample_time,
            amplitude,
            band: [low, high],
            stops,
            dither,
            ..
        } = *recording;
        let samples = (seconds / sample_time).round() as usize;
        let random = |seed| Phases::Random { seed };
        let even = multisine(samples, sample_time, amplitude, low, high, random(seed))?;
        let reference = stopping(&even, stops * sample_time);
        let dithered = match dither > 0.0 {
            true => multisine(samples, sample_time, dither, 3.0, 25.0, random(seed ^ 0xd17))?,
            false => vec![0.0; samples],
        };
        let h = sample_time / STEPS as f64;
        let behind = (self.late / h).round() as usize;
        let mut past = std::collections::VecDeque::from(vec![0.0; behind + 1]);
        let mut x = State::default();
        let mut log = JointLog {
            motor: Vec::new(),
            link: Vec::new(),
            torque: Vec::new(),
            sample_time,
        };
        let mut rng = Pcg64::seed_from_u64(seed ^ 0x5eed);
        let mut noise = |sd: f64| -> f64 {
            let e: f64 = StandardNormal.sample(&mut rng);
            sd * e
        };
        for (i, r) in reference.iter().enumerate() {
            let before = reference[i.saturating_sub(1)];
            // A position loop with gains proportional to the motor's inertia.
            let torque =
                self.motor_inertia * (400.0 * (r - x[0]) + 40.0 * ((r - before) / sample_time - x[2])) + dithered[i];
            log.motor.push(x[0] + noise(recording.encoders));
            log.link.push(past[0] + noise(recording.encoders));
            log.torque.push(torque + noise(recording.torque));
            for _ in 0..STEPS {
                x = self.step(x, torque, h);
                past.push_back(x[1]);
                past.pop_front();
            }
        }
        Ok(log)
    }
}

/// The reference with momentary stops, this many a sample: its time runs as $t - \sin(2 \pi f t) / (2 \pi f)$.
fn stopping(reference: &[f64], frequency: f64) -> Vec<f64> {
    let omega = std::f64::consts::TAU * frequency;
    let at = |i: usize| {
        let t = if omega > 0.0 {
            i as f64 - (omega * i as f64).sin() / omega
        } else {
            i as f64
        };
        let t = t.clamp(0.0, (reference.len() - 1) as f64);
        let before = (t as usize).min(reference.len().saturating_sub(2));
        let share = t - before as f64;
        (1.0 - share) * reference[before] + share * reference[before + 1]
    };
    (0..reference.len()).map(at).collect()
}

/// A kind of joint, with its effects in addition to inertias, a spring and friction at the link.
pub struct Family {
    pub name: &'static str,
    pub joint: Joint,
    pub effects: &'static [Effect],
}

/// The noise of a log.
pub struct Noise {
    pub name: &'static str,
    /// The encoders' noise, rad.
    pub encoders: f64,
    /// The torque's noise, N m.
    pub torque: f64,
}

pub const NOISES: [Noise; 3] = [
    Noise {
        name: "low",
        encoders: 3e-6,
        torque: 0.02,
    },
    Noise {
        name: "middle",
        encoders: 1e-5,
        torque: 0.1,
    },
    Noise {
        name: "high",
        encoders: 5e-5,
        torque: 0.5,
    },
];

/// A minute at 500 Hz.
pub fn recording(noise: &Noise) -> Recording {
    Recording {
        seconds: 60.0,
        sample_time: 0.002,
        amplitude: 0.5,
        band: [0.05, 1.5],
        stops: 0.0,
        dither: 0.0,
        encoders: noise.encoders,
        torque: noise.torque,
    }
}

/// Friction at the link alone.
const PLAIN: Joint = Joint {
    motor_inertia: 1.0,
    link_inertia: 10.0,
    stiffness: Stiffness {
        cubic: 500.0,
        linear: 500.0,
        windup: 0.0,
        windup_sharpness: 0.0,
    },
    damping: 0.0,
    motor_friction: Friction([0.0; 6]),
    link_friction: Friction([0.0, 0.0, 0.0, 0.6, 60.0, 0.5]),
    lugre: None,
    hysteresis: None,
    gravity: 0.0,
    late: 0.0,
};

const RUBBING: Joint = Joint {
    motor_friction: Friction([0.0, 0.0, 0.0, 2.0, 60.0, 1.5]),
    ..PLAIN
};

const LUGRE: Option<LuGre> = Some(LuGre {
    bristles: [1000.0, 10.0],
    levels: [0.6, 0.9],
    velocity: 0.02,
});

const HYSTERESIS: Option<Hysteresis> = Some(Hysteresis {
    stiffness: 100.0,
    yields: 0.005,
});

const VISCOUS: Friction = Friction([0.0, 0.0, 0.0, 0.0, 0.0, 0.5]);

const fn family(name: &'static str, joint: Joint, effects: &'static [Effect]) -> Family {
    Family { name, joint, effects }
}

/// Each effect alone, and in pairs.
pub const FAMILIES: [Family; 13] = [
    family("plain", PLAIN, &[]),
    family("late", Joint { late: 0.004, ..PLAIN }, &[EncoderSkew]),
    family("damped", Joint { damping: 2.0, ..PLAIN }, &[Damping]),
    family("motor friction", RUBBING, &[MotorFriction]),
    family("gravity", Joint { gravity: 5.0, ..PLAIN }, &[Gravity]),
    family(
        "hysteretic",
        Joint {
            hysteresis: HYSTERESIS,
            ..PLAIN
        },
        &[HystereticSpring],
    ),
    family(
        "LuGre",
        Joint {
            lugre: LUGRE,
            link_friction: VISCOUS,
            ..PLAIN
        },
        &[Presliding],
    ),
    family(
        "motor friction, late",
        Joint { late: 0.004, ..RUBBING },
        &[EncoderSkew, MotorFriction],
    ),
    family(
        "motor friction, damped",
        Joint {
            damping: 2.0,
            ..RUBBING
        },
        &[Damping, MotorFriction],
    ),
    family(
        "late, damped",
        Joint {
            damping: 2.0,
            late: 0.004,
            ..PLAIN
        },
        &[EncoderSkew, Damping],
    ),
    family(
        "motor friction, gravity",
        Joint {
            gravity: 5.0,
            ..RUBBING
        },
        &[MotorFriction, Gravity],
    ),
    family(
        "motor friction, hysteretic",
        Joint {
            hysteresis: HYSTERESIS,
            ..RUBBING
        },
        &[MotorFriction, HystereticSpring],
    ),
    family(
        "motor friction, LuGre",
        Joint {
            lugre: LUGRE,
            link_friction: VISCOUS,
            ..RUBBING
        },
        &[MotorFriction, Presliding],
    ),
];
