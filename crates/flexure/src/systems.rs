//! Known systems with their exact truth, for tests, benchmarks, documentation and the convergence study.

use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};

use crate::linear::TransferFunction;
use crate::linear::correlation::variance;
use crate::record::Record;

/// The static nonlinearities on which block-oriented identification is tested.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum KnownNonlinearity {
    /// 0 on [-0.5, 0.7], slope 1 beyond.
    DeadZone,
    /// The sign: -1, 0, 1.
    HardLimiter,
    /// Rounding to multiples of 0.5.
    Quantizer,
    /// x^3.
    Cubic,
    /// x^2 + 0.2 x.
    Parabola,
    /// The joint's torque x^3 + x - 0.9 x exp(-20 x^2): (10) and (11) with a visible dip.
    SoftWindup,
    /// 0.5 (tanh 15 x - tanh 5 x) + 0.8 tanh 10 x + 0.3 x: friction (12).
    Friction,
}

impl KnownNonlinearity {
    /// All seven.
    pub const ALL: [KnownNonlinearity; 7] = [
        KnownNonlinearity::DeadZone,
        KnownNonlinearity::HardLimiter,
        KnownNonlinearity::Quantizer,
        KnownNonlinearity::Cubic,
        KnownNonlinearity::Parabola,
        KnownNonlinearity::SoftWindup,
        KnownNonlinearity::Friction,
    ];

    /// The name in lower case.
    pub fn name(self) -> &'static str {
        match self {
            KnownNonlinearity::DeadZone => "dead zone",
            KnownNonlinearity::HardLimiter => "hard limiter",
            KnownNonlinearity::Quantizer => "quantizer",
            KnownNonlinearity::Cubic => "cubic",
            KnownNonlinearity::Parabola => "x^2 + 0.2 x",
            KnownNonlinearity::SoftWindup => "soft wind-up",
            KnownNonlinearity::Friction => "friction",
        }
    }

    /// phi(x).
    pub fn value(self, x: f64) -> f64 {
        match self {
            KnownNonlinearity::DeadZone => (x - 0.7).max(0.0) + (x + 0.5).min(0.0),
            KnownNonlinearity::HardLimiter => {
                if x == 0.0 {
                    0.0
                } else {
                    x.signum()
                }
            }
            KnownNonlinearity::Quantizer => 0.5 * (2.0 * x).round(),
            KnownNonlinearity::Cubic => x * x * x,
            KnownNonlinearity::Parabola => x * x + 0.2 * x,
            KnownNonlinearity::SoftWindup => x * x * x + x - 0.9 * x * (-20.0 * x * x).exp(),
            KnownNonlinearity::Friction => {
                0.5 * ((15.0 * x).tanh() - (5.0 * x).tanh()) + 0.8 * (10.0 * x).tanh() + 0.3 * x
            }
        }
    }

    /// Whether phi is continuous.
    pub fn is_continuous(self) -> bool {
        !matches!(self, KnownNonlinearity::HardLimiter | KnownNonlinearity::Quantizer)
    }

    /// Whether phi has derivatives of every order.
    pub fn is_smooth(self) -> bool {
        self.is_continuous() && self != KnownNonlinearity::DeadZone
    }
}

/// A Hammerstein system driven by white uniform input: the setting of (14) to (17).
#[derive(Debug, Clone, PartialEq)]
pub struct KnownHammerstein {
    /// phi.
    pub nonlinearity: KnownNonlinearity,
    /// The linear part, with its delay as leading zeros of b.
    pub linear: TransferFunction,
    /// The input is uniform on [-range, range].
    pub input_range: f64,
    /// Standard deviation of the noise xi that enters before the linear part.
    pub process_noise: f64,
    /// Output noise: ratio of the noiseless output's power to the noise's, dB; infinite for no noise.
    pub snr_db: f64,
}

impl KnownHammerstein {
    /// The usual setting: input on [-2, 2], process noise 0.1, 20 dB output noise.
    pub fn usual(nonlinearity: KnownNonlinearity, linear: TransferFunction) -> Self {
        KnownHammerstein {
            nonlinearity,
            linear,
            input_range: 2.0,
            process_noise: 0.1,
            snr_db: 20.0,
        }
    }

    /// `n` samples with the columns `u`, `y` and `y0`, the output without output noise.
    ///
    /// The system starts in its stationary regime.
    pub fn simulate(&self, n: usize, seed: u64) -> Record {
        let mut rng = Pcg64::seed_from_u64(seed);
        let before = self.linear.settling(1e-6);
        let u: Vec<f64> = (0..before + n)
            .map(|_| rng.random_range(-self.input_range..self.input_range))
            .collect();
        let w: Vec<f64> = u
            .iter()
            .map(|&u| {
                let xi: f64 = StandardNormal.sample(&mut rng);
                self.nonlinearity.value(u) + self.process_noise * xi
            })
            .collect();
        let y0 = self.linear.simulate(&w).split_off(before);
        let noise = variance(&y0).sqrt() * 10.0_f64.powf(-self.snr_db / 20.0);
        let y: Vec<f64> = y0
            .iter()
            .map(|y| {
                let e: f64 = StandardNormal.sample(&mut rng);
                y + noise * e
            })
            .collect();
        Record::from_equal([("u", u[before..].to_vec()), ("y", y), ("y0", y0)])
    }

    /// Relative L2 distance of `estimate` from phi over `grid`, after the best affine alignment.
    pub fn nonlinearity_error(&self, grid: &[f64], estimate: impl Fn(f64) -> f64) -> f64 {
        let truth: Vec<f64> = grid.iter().map(|&x| self.nonlinearity.value(x)).collect();
        let values: Vec<f64> = grid.iter().map(|&x| estimate(x)).collect();
        relative_error_after_alignment(&truth, &values)
    }
}

/// |truth - (a estimate + b)| / |truth - mean| with the best a and b.
pub fn relative_error_after_alignment(truth: &[f64], estimate: &[f64]) -> f64 {
    let n = truth.len() as f64;
    let mean = |v: &[f64]| v.iter().sum::<f64>() / n;
    let (mt, me) = (mean(truth), mean(estimate));
    let dot = |a: &[f64], ma: f64, b: &[f64], mb: f64| a.iter().zip(b).map(|(x, y)| (x - ma) * (y - mb)).sum::<f64>();
    let (tt, te, ee) = (
        dot(truth, mt, truth, mt),
        dot(truth, mt, estimate, me),
        dot(estimate, me, estimate, me),
    );
    let explained = if ee > 0.0 { te * te / ee } else { 0.0 };
    ((tt - explained).max(0.0) / tt).sqrt()
}

/// The two linear parts for comparisons of Hammerstein algorithms: a well damped one,
/// (1 + 0.4 z^-1 + 0.1 z^-2) / (1 - 1.2 z^-1 + 0.52 z^-2), and a resonance,
/// (0.05 + 0.08 z^-1 + 0.02 z^-2) / (1 - 1.8 z^-1 + 0.95 z^-2).
pub fn known_linear_parts() -> [TransferFunction; 2] {
    [
        TransferFunction::monic(vec![1.0, 0.4, 0.1], vec![-1.2, 0.52]),
        TransferFunction::monic(vec![0.05, 0.08, 0.02], vec![-1.8, 0.95]),
    ]
}
