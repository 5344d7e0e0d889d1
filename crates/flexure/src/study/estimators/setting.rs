//! A setting: the estimator, m, the schedule, the norm, and the exponent from theory.

use std::f64::consts::FRAC_PI_2;

use serde::{Deserialize, Serialize};

use super::super::plan::{Experiment, OneRun};
use super::super::setting::Input;
use super::run::squared_error;
use crate::error::{Error, Result};
use crate::nonlinearity::Basis;

/// An estimator of a static nonlinearity. A schedule gives its one parameter, which is named here after each semicolon.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// The Nadaraya-Watson estimate with products of Epanechnikov's kernel; the bandwidth.
    KernelConstant,
    /// The local linear estimate with the same kernel; the bandwidth.
    KernelLinear,
    /// The local linear kernel with local bandwidths by Lepski's rule. They come from the data, and the schedule is not used.
    LocalLepski,
    /// The local linear kernel with local bandwidths by plug-in. They come from the data, and the schedule is not used.
    LocalPlugIn,
    /// The recursive kernel after Wolverton and Wagner; the n-th point's bandwidth.
    WolvertonWagner,
    /// The recursive kernel of Devroye and Wagner; the n-th point's bandwidth.
    DevroyeWagner,
    /// The mean of the nearest neighbours; their number.
    Neighbours,
    /// The Haar series; the number of cells, rounded to a power of 2.
    Haar,
    /// The polynomial; the degree plus one, rounded to an odd number.
    Polynomial,
    /// The penalised spline; h in lambda = n h^4 / 2, where 1/2 is the density of X uniform on [-1, 1].
    Spline,
    /// The neural network with the decay of largest evidence; the number of units.
    Network,
    /// The series of these functions; the number of terms, rounded to an odd number. In files it has the name of the functions.
    #[serde(untagged)]
    Series(Basis),
}

impl Method {
    fn name(self) -> &'static str {
        match self {
            Method::KernelConstant => "kernel, local constant",
            Method::KernelLinear => "kernel, local linear",
            Method::LocalLepski => "local bandwidths, Lepski",
            Method::LocalPlugIn => "local bandwidths, plug-in",
            Method::WolvertonWagner => "recursive kernel, Wolverton-Wagner",
            Method::DevroyeWagner => "recursive kernel, Devroye-Wagner",
            Method::Neighbours => "nearest neighbours",
            Method::Haar => "Haar series",
            Method::Polynomial => "polynomial",
            Method::Spline => "spline",
            Method::Network => "network",
            Method::Series(basis) => basis.title(),
        }
    }

    /// Whether it chooses its parameter from the data and ignores the schedule.
    fn by_itself(self) -> bool {
        matches!(self, Method::LocalLepski | Method::LocalPlugIn)
    }

    /// The most columns that it takes in this study.
    fn most_columns(self) -> usize {
        match self {
            Method::KernelConstant
            | Method::KernelLinear
            | Method::WolvertonWagner
            | Method::DevroyeWagner
            | Method::Neighbours
            | Method::Network => 2,
            _ => 1,
        }
    }
}

/// The function m that is estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Regressand {
    /// The Euclidean norm of x, |x| in one variable: Lipschitz.
    Cone,
    /// The product of the cosines: smooth.
    Cosine,
    /// The product of |sin(pi x/2)|^(3/2): two derivatives in L2, except for a logarithm.
    ThreeHalves,
    /// The product of sin 2x.
    Sine,
    /// |x| exp(-|x|^2/2): Lipschitz, and small far out.
    KinkedBump,
    /// exp(-|x|^2/4): analytic, and small far out.
    Bump,
}

impl Regressand {
    /// m(x).
    pub fn value(self, x: &[f64]) -> f64 {
        let square: f64 = x.iter().map(|x| x * x).sum();
        let product = |f: fn(f64) -> f64| x.iter().map(|x| f(*x)).product::<f64>();
        match self {
            Regressand::Cone => square.sqrt(),
            Regressand::Cosine => product(f64::cos),
            Regressand::ThreeHalves => product(|x| (FRAC_PI_2 * x).sin().abs().powf(1.5)),
            Regressand::Sine => product(|x| (2.0 * x).sin()),
            Regressand::KinkedBump => square.sqrt() * (-0.5 * square).exp(),
            Regressand::Bump => (-0.25 * square).exp(),
        }
    }

    fn name(self) -> &'static str {
        match self {
            Regressand::Cone => "|x|",
            Regressand::Cosine => "cos",
            Regressand::ThreeHalves => "|sin|^(3/2)",
            Regressand::Sine => "sin 2x",
            Regressand::KinkedBump => "|x| exp(-x^2/2)",
            Regressand::Bump => "exp(-x^2/4)",
        }
    }
}

/// Where the error is measured.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ErrorNorm {
    /// At the point with all coordinates equal to this.
    At(f64),
    /// The root mean square over fresh inputs: L2 by the distribution of X.
    OverInputs,
}

/// A parameter that follows c n^gamma.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Schedule {
    /// c, positive.
    pub constant: f64,
    /// gamma, between -1 and 1.
    pub exponent: f64,
}

impl Schedule {
    /// The parameter for n points.
    pub fn at(self, n: usize) -> f64 {
        self.constant * (n as f64).powf(self.exponent)
    }
}

/// One experiment: an estimator's error over n.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EstimatorSetting {
    /// The estimator.
    pub method: Method,
    /// m.
    pub regressand: Regressand,
    /// The number of columns of X, 1 or 2; they are independent.
    pub columns: usize,
    /// The distribution of each column.
    pub input: Input,
    /// The standard deviation of Y - m(X), which is normal.
    pub noise: f64,
    /// The error's norm.
    pub norm: ErrorNorm,
    /// The parameter's rule.
    pub schedule: Schedule,
    /// The exponent of the error in n that theory gives.
    pub exponent: f64,
    /// Whether the error is of exactly that order. If not, the exponent is a bound: the error may fall faster.
    pub sharp: bool,
}

impl Experiment for EstimatorSetting {
    fn name(&self) -> String {
        let norm = match self.norm {
            ErrorNorm::At(x) => format!("at {x}"),
            ErrorNorm::OverInputs => "L2".to_owned(),
        };
        let (d, m) = (self.columns, self.regressand.name());
        let schedule = match self.method.by_itself() {
            true => "from the data".to_owned(),
            false => format!("~ n^{:.3}", self.schedule.exponent),
        };
        format!("{}, d = {d}, {m} {norm}, {schedule}", self.method.name())
    }

    fn exponent(&self) -> f64 {
        self.exponent
    }

    fn sharp(&self) -> bool {
        self.sharp
    }

    fn prepared(&self) -> OneRun<'_> {
        Box::new(|n, seed| squared_error(self, n, seed))
    }

    fn check(&self) -> Result<()> {
        let require = |name: &str, value: f64, valid: bool, requirement: &'static str| {
            if valid {
                return Ok(());
            }
            Err(Error::parameter(name, value, requirement))
        };
        let Schedule { constant, exponent } = self.schedule;
        let valid = constant > 0.0 && constant.is_finite();
        require("the schedule's constant", constant, valid, "positive and finite")?;
        let valid = (-1.0..=1.0).contains(&exponent);
        require("the schedule's exponent", exponent, valid, "between -1 and 1")?;
        let valid = self.noise >= 0.0 && self.noise.is_finite();
        require(
            "the noise's standard deviation",
            self.noise,
            valid,
            "non-negative and finite",
        )?;
        if let Input::Uniform { range } = self.input {
            let valid = range > 0.0 && range.is_finite();
            require("the input's range", range, valid, "positive and finite")?;
        }
        if let ErrorNorm::At(x) = self.norm {
            require("the point", x, x.is_finite(), "finite")?;
        }
        let (d, name) = (self.columns as f64, "the number of columns");
        match self.method.most_columns() {
            1 => require(name, d, self.columns == 1, "1 for this estimator"),
            _ => require(name, d, (1..=2).contains(&self.columns), "1 or 2"),
        }
    }
}

/// A setting with a sharp exponent, X uniform on [-1, 1] in one variable, and noise of standard deviation 1/2.
fn line(
    method: Method,
    regressand: Regressand,
    norm: ErrorNorm,
    (constant, gamma): (f64, f64),
    exponent: f64,
) -> EstimatorSetting {
    EstimatorSetting {
        method,
        regressand,
        columns: 1,
        input: Input::Uniform { range: 1.0 },
        noise: 0.5,
        norm,
        schedule: Schedule {
            constant,
            exponent: gamma,
        },
        exponent,
        sharp: true,
    }
}

/// All estimators but the network, of Lipschitz and smooth m in one and two variables: see the
/// [module](super) for the theory of each.
pub fn estimator_settings() -> Vec<EstimatorSetting> {
    use Regressand::{Bump, Cone, Cosine, KinkedBump, Sine, ThreeHalves};
    let (third, fifth) = (1.0 / 3.0, 0.2);
    let (origin, l2) = (ErrorNorm::At(0.0), ErrorNorm::OverInputs);
    // The last point's bandwidth of a recursive kernel is smaller than their mean.
    let local = [
        (Method::KernelConstant, (1.0, -third), origin, (1.5, -fifth)),
        (Method::KernelLinear, (1.0, -third), ErrorNorm::At(1.0), (2.0, -fifth)),
        (Method::WolvertonWagner, (0.8, -third), origin, (1.2, -fifth)),
        (Method::DevroyeWagner, (0.8, -third), origin, (1.2, -fifth)),
        (Method::Neighbours, (1.0, 2.0 * third), origin, (1.4, 4.0 * fifth)),
    ];
    let series = [Basis::Fourier, Basis::Cosine, Basis::Legendre].map(Method::Series);
    let mut settings = Vec::new();
    for (method, lipschitz, at, smooth) in local {
        settings.push(line(method, Cone, origin, lipschitz, -third));
        settings.push(line(method, Cosine, at, smooth, -2.0 * fifth));
    }
    for method in series.into_iter().chain([Method::Polynomial]) {
        settings.push(line(method, Cone, origin, (1.102, third), -third));
        settings.push(line(method, ThreeHalves, l2, (4.95, fifth), -2.0 * fifth));
    }
    settings.push(line(Method::Spline, Cone, origin, (0.4, -third), -third));
    settings.push(line(Method::Spline, ThreeHalves, l2, (0.3, -fifth), -2.0 * fifth));
    // The rules that choose at every x. Their schedules are not used.
    for method in [Method::LocalLepski, Method::LocalPlugIn] {
        for (regressand, exponent) in [(Cone, -third), (Sine, -2.0 * fifth)] {
            settings.push(EstimatorSetting {
                sharp: false,
                ..line(method, regressand, l2, (1.0, -fifth), exponent)
            });
        }
    }
    // 256^(1/3) = 2^(8/3), so 8 cells are 2^(1/3) times as many.
    let cells = (third.exp2(), third);
    settings.push(line(Method::Haar, Cone, l2, cells, -third));
    settings.push(line(Method::Haar, Sine, l2, cells, -third));
    // The noise is so small that the bias shows.
    settings.push(EstimatorSetting {
        input: Input::StudentT,
        noise: 0.1,
        ..line(Method::Series(Basis::Hermite), KinkedBump, l2, (1.102, third), -0.25)
    });
    settings.push(EstimatorSetting {
        input: Input::StudentT,
        ..line(Method::Series(Basis::Hermite), Bump, l2, (1.102, third), -third)
    });
    settings.extend(two_column_settings());
    settings
}

/// The local estimators in two variables.
fn two_column_settings() -> Vec<EstimatorSetting> {
    use Regressand::{Cone, Cosine};
    let third = 1.0 / 3.0;
    let mut settings = Vec::new();
    let plane = [
        (Method::KernelConstant, (1.5, -0.25), (1.6, -0.5 * third)),
        (Method::KernelLinear, (1.5, -0.25), (1.6, -0.5 * third)),
        (Method::WolvertonWagner, (1.2, -0.25), (1.3, -0.5 * third)),
        (Method::DevroyeWagner, (1.2, -0.25), (1.3, -0.5 * third)),
        (Method::Neighbours, (2.0, 0.5), (1.5, 2.0 * third)),
    ];
    for (method, lipschitz, smooth) in plane {
        for (regressand, schedule, exponent) in [(Cone, lipschitz, -0.25), (Cosine, smooth, -third)] {
            settings.push(EstimatorSetting {
                columns: 2,
                ..line(method, regressand, ErrorNorm::At(0.0), schedule, exponent)
            });
        }
    }
    settings
}

/// The network, of Lipschitz and smooth m in one and two variables.
pub fn network_settings() -> Vec<EstimatorSetting> {
    use Regressand::{Cone, Cosine};
    let third = 1.0 / 3.0;
    let rules = [
        (1, Cone, (0.5, third), -third),
        (1, Cosine, (1.0, 0.2), -0.4),
        (2, Cone, (0.2, 0.5), -0.25),
        (2, Cosine, (0.5, third), -third),
    ];
    let setting = |(columns, regressand, schedule, exponent)| EstimatorSetting {
        columns,
        sharp: false,
        ..line(Method::Network, regressand, ErrorNorm::OverInputs, schedule, exponent)
    };
    rules.map(setting).to_vec()
}
