//! A setting: the estimated function, the data, the bandwidth, and the rate from theory.

use serde::{Deserialize, Serialize};

use crate::distributions::gamma;
use crate::error::{Error, Result};
use crate::linear::TransferFunction;
use crate::parallel;
use crate::systems::{KnownHammerstein, KnownNonlinearity};

/// The distribution of the white input X.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Input {
    /// Uniform on [-range, range].
    Uniform {
        /// Half the width.
        range: f64,
    },
    /// Standard normal.
    Gaussian,
    /// Student's t with 5 degrees of freedom: tails like |x|^-6, no sixth moment.
    StudentT,
}

/// Degrees of freedom of [`Input::StudentT`].
pub(super) const DEGREES: f64 = 5.0;
/// Points of the quadrature for means under an input's density.
const QUADRATURE: usize = 400_000;

impl Input {
    /// The probability density at `x`.
    pub fn density(self, x: f64) -> f64 {
        match self {
            Input::Uniform { range } => f64::from(x.abs() <= range) / (2.0 * range),
            Input::Gaussian => (-0.5 * x * x).exp() / (2.0 * std::f64::consts::PI).sqrt(),
            Input::StudentT => {
                let scale = gamma(0.5 * (DEGREES + 1.0)) / gamma(0.5 * DEGREES);
                let tail = (1.0 + x * x / DEGREES).powf(-0.5 * (DEGREES + 1.0));
                scale * tail / (DEGREES * std::f64::consts::PI).sqrt()
            }
        }
    }

    /// E g(X), by the midpoint rule after mapping the density's support to (-1, 1).
    pub fn expectation(self, g: impl Fn(f64) -> f64 + Sync) -> f64 {
        let step = 2.0 / QUADRATURE as f64;
        let node = |i: usize| -1.0 + (i as f64 + 0.5) * step;
        let values = parallel::numbers(QUADRATURE, |i| match self {
            Input::Uniform { range } => g(range * node(i)) * 0.5,
            _ => {
                let t = node(i);
                let rest = 1.0 - t * t;
                let x = t / rest;
                g(x) * self.density(x) * (1.0 + t * t) / (rest * rest)
            }
        });
        values.iter().sum::<f64>() * step
    }

    fn name(self) -> &'static str {
        match self {
            Input::Uniform { .. } => "uniform",
            Input::Gaussian => "Gaussian",
            Input::StudentT => "Student t(5)",
        }
    }
}

/// The nonlinearity phi.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Target {
    /// |x|^(1/2): Lipschitz of order 1/2, and at 0 of no higher order.
    Cusp,
    /// |x|: Lipschitz of order 1.
    Kink,
    /// cos x: smooth, with curvature -1 at 0.
    Cosine,
    /// One of the seven.
    Known(KnownNonlinearity),
}

impl Target {
    /// phi(x).
    pub fn value(self, x: f64) -> f64 {
        match self {
            Target::Cusp => x.abs().sqrt(),
            Target::Kink => x.abs(),
            Target::Cosine => x.cos(),
            Target::Known(phi) => phi.value(x),
        }
    }

    fn name(self) -> &'static str {
        match self {
            Target::Cusp => "|x|^(1/2)",
            Target::Kink => "|x|",
            Target::Cosine => "cos x",
            Target::Known(phi) => phi.name(),
        }
    }
}

/// The source of the output.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DataSource {
    /// Theorem 1: Y_n = phi(X_n) + e_n.
    Static {
        /// Standard deviation of e.
        noise: f64,
    },
    /// Theorem 2: (14) and (15), Y_{n+lag} regressed on X_n.
    Hammerstein {
        /// The linear part.
        linear: TransferFunction,
        /// The lag of the regression.
        lag: usize,
        /// Standard deviation of xi, before the linear part.
        process_noise: f64,
        /// Standard deviation of the output noise.
        noise: f64,
    },
}

impl DataSource {
    fn name(&self) -> &'static str {
        match self {
            DataSource::Static { .. } => "static",
            DataSource::Hammerstein { .. } => "Hammerstein",
        }
    }
}

/// The error that is measured.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Norm {
    /// m_n(x) - m(x) at one point.
    At(f64),
    /// The root mean square of m_n - m over [low, high].
    Over {
        /// Lower end.
        low: f64,
        /// Upper end.
        high: f64,
    },
}

/// h_n = constant n^exponent.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Bandwidth {
    /// c, positive.
    pub constant: f64,
    /// The exponent, between -1 and 0.
    pub exponent: f64,
}

impl Bandwidth {
    /// h_n.
    pub fn at(self, n: usize) -> f64 {
        self.constant * (n as f64).powf(self.exponent)
    }
}

/// One experiment: the estimate's error over n.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Setting {
    /// The nonlinearity.
    pub target: Target,
    /// The input.
    pub input: Input,
    /// From input to output.
    pub data: DataSource,
    /// The error's norm.
    pub norm: Norm,
    /// The bandwidth's rule. The kernel is Epanechnikov's.
    pub bandwidth: Bandwidth,
    /// The exponent of the error in n that theory gives for this rule.
    pub exponent: f64,
    /// Whether the error is of exactly that order. If not, the exponent is a bound: the error may
    /// fall faster.
    pub sharp: bool,
}

/// A regression as gain phi(x) + offset.
#[derive(Debug, Clone, Copy)]
pub(super) struct OfTarget {
    pub gain: f64,
    pub offset: f64,
}

impl Setting {
    /// The error at 0 of the cusp, the kink or the cosine: the worst point of a class.
    ///
    /// With phi(x) = phi(0) + B' |x|^p near 0 the estimate's bias at 0 is B h^p, B = B' int |u|^p K / int K, and its
    /// variance V/(n h), V = Var(Y | X = 0) int K^2 / f(0): the mean squared error is smallest for h = (V / (2 p B^2 n))^(1/(2p+1)), which
    /// is the rule used here. It is then of the order n^(-2p/(2p+1)). The cosine has p = 2.
    pub fn at_worst_point(target: Target, input: Input, data: DataSource) -> Setting {
        let (order, slope) = match target {
            Target::Cusp => (0.5, 1.0),
            Target::Kink => (1.0, 1.0),
            Target::Cosine | Target::Known(_) => (2.0, 0.5),
        };
        // Epanechnikov's moments: int |u|^p K / int K and int K^2 / (int K)^2.
        let bias: f64 = slope * 3.0 / ((order + 1.0) * (order + 3.0));
        let setting = Setting {
            target,
            input,
            data,
            norm: Norm::At(0.0),
            bandwidth: Bandwidth {
                constant: 1.0,
                exponent: -1.0 / (2.0 * order + 1.0),
            },
            exponent: -order / (2.0 * order + 1.0),
            sharp: true,
        };
        let variance = setting.noise_variance() * 0.6 / input.density(0.0);
        let constant = (variance / (2.0 * order * bias * bias)).powf(1.0 / (2.0 * order + 1.0));
        Setting {
            bandwidth: Bandwidth {
                constant,
                ..setting.bandwidth
            },
            ..setting
        }
    }

    /// The root mean square error of one of the seven, inside a uniform input's range, for the usual
    /// Hammerstein system with the linear part `linear` regressed at `lag`.
    pub fn over_the_interior(phi: KnownNonlinearity, linear: TransferFunction, lag: usize) -> Setting {
        let range = KnownHammerstein::usual(phi, linear.clone()).input_range;
        let (constant, exponent, rate, sharp) = match phi {
            KnownNonlinearity::HardLimiter | KnownNonlinearity::Quantizer => (2.0, -0.5, -0.25, true),
            KnownNonlinearity::DeadZone => (3.0, -1.0 / 3.0, -1.0 / 3.0, false),
            KnownNonlinearity::Cubic | KnownNonlinearity::Parabola => (1.0, -0.2, -0.4, true),
            // Their dip and their step are narrow, and the window must be narrower.
            KnownNonlinearity::SoftWindup => (0.4, -0.2, -0.4, true),
            KnownNonlinearity::Friction => (0.3, -0.2, -0.4, true),
        };
        Setting {
            target: Target::Known(phi),
            input: Input::Uniform { range },
            data: DataSource::Hammerstein {
                linear,
                lag,
                process_noise: 0.1,
                noise: 0.1,
            },
            norm: Norm::Over {
                low: -0.75 * range,
                high: 0.75 * range,
            },
            bandwidth: Bandwidth { constant, exponent },
            exponent: rate,
            sharp,
        }
    }

    /// A name of one line.
    pub fn name(&self) -> String {
        let norm = match self.norm {
            Norm::At(x) => format!("at x = {x}"),
            Norm::Over { low, high } => format!("L2 on [{low}, {high}]"),
        };
        format!(
            "{}, {}, {} X, {norm}",
            self.target.name(),
            self.data.name(),
            self.input.name()
        )
    }

    /// m(x) = k_lag phi(x) + E phi(X) sum of the other k_j, (16).
    pub(super) fn truth(&self) -> OfTarget {
        match &self.data {
            DataSource::Static { .. } => OfTarget { gain: 1.0, offset: 0.0 },
            DataSource::Hammerstein { linear, lag, .. } => {
                let gain = linear.impulse_response(lag + 1)[*lag];
                let mean = self.input.expectation(|x| self.target.value(x));
                OfTarget {
                    gain,
                    offset: mean * (linear.static_gain() - gain),
                }
            }
        }
    }

    /// Var(Y | X), the same for every X: all that the regression sees as noise.
    fn noise_variance(&self) -> f64 {
        match &self.data {
            DataSource::Static { noise } => noise * noise,
            DataSource::Hammerstein {
                linear,
                lag,
                process_noise,
                noise,
            } => {
                let k = linear.impulse_response(linear.settling(1e-6));
                let all: f64 = k.iter().map(|k| k * k).sum();
                let others = all - k.get(*lag).map_or(0.0, |k| k * k);
                let mean = self.input.expectation(|x| self.target.value(x));
                let spread = self.input.expectation(|x| (self.target.value(x) - mean).powi(2));
                spread * others + process_noise * process_noise * all + noise * noise
            }
        }
    }

    /// # Errors
    /// [`Error::Parameter`] for a bandwidth, an interval, a noise or an input range that makes no sense, and
    /// for an unstable linear part.
    pub(super) fn problems(&self) -> Result<()> {
        let require = |name: &str, value: f64, valid: bool, requirement: &'static str| {
            if valid {
                return Ok(());
            }
            Err(Error::parameter(name, value, requirement))
        };
        let positive = |v: f64| v > 0.0 && v.is_finite();
        let Bandwidth { constant, exponent } = self.bandwidth;
        require(
            "the bandwidth's constant",
            constant,
            positive(constant),
            "positive and finite",
        )?;
        let valid = (-1.0..=0.0).contains(&exponent);
        require("the bandwidth's exponent", exponent, valid, "between -1 and 0")?;
        if let Input::Uniform { range } = self.input {
            require("the input's range", range, positive(range), "positive and finite")?;
        }
        match self.norm {
            Norm::At(x) => require("the point", x, x.is_finite(), "finite")?,
            Norm::Over { low, high } => require(
                "the interval's upper end",
                high,
                low.is_finite() && high.is_finite() && low < high,
                "finite and above the lower end",
            )?,
        }
        let deviations = match &self.data {
            DataSource::Static { noise } => vec![*noise],
            DataSource::Hammerstein {
                linear,
                process_noise,
                noise,
                ..
            } => {
                let largest = linear
                    .poles()
                    .map_or(f64::NAN, |p| p.iter().fold(0.0, |m: f64, z| m.max(z.norm())));
                require(
                    "the linear part's largest pole radius",
                    largest,
                    largest < 1.0,
                    "below 1",
                )?;
                vec![*process_noise, *noise]
            }
        };
        for noise in deviations {
            let valid = noise >= 0.0 && noise.is_finite();
            require("a noise's standard deviation", noise, valid, "non-negative and finite")?;
        }
        Ok(())
    }
}
