//! Prints how often confidence bands cover the truth, by Monte Carlo, and their nominal level.
//!
//! ```text
//! cargo run --release -p flexure --example coverage                  # some minutes on two cores
//! cargo run --release -p flexure --example coverage -- full          # an hour or two
//! cargo run --release -p flexure --example coverage -- full kernel   # one table: kernel, bootstrap or block
//! ```
//!
//! Every replication chooses the parameter from its own data by leave-one-out. "mean" is the coverage averaged over
//! the interior points; "least" and "most" are that of the worst and the best of them: extremes of 31 numbers, which would
//! be about two Monte Carlo standard errors of one point (1.1 % for 400 runs, 0.5 % for 2000) from the mean even if all were equal. "ends" is the lower
//! coverage of the two ends of the range.

use std::ops::ControlFlow;

use flexure::bands::{Band, BandKind, BootstrapBand, RobustBand, Scheme};
use flexure::nonlinearity::{
    Basis, Choice, Degree, Estimator, Kernel, KernelFit, KernelRegression, NearestNeighbours, PolynomialRegression,
    Regression, SeriesRegression, SplineRegression,
};
use flexure::selection::BandwidthSearch;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use rayon::prelude::*;

const LEVEL: f64 = 0.95;
/// Half the width of the support of the uniform x, and of the interior.
const RANGE: f64 = 2.0;
const INTERIOR: f64 = 1.5;
/// Points in the interior.
const POINTS: usize = 31;

/// The regression m and its name.
type Truth = (&'static str, fn(f64) -> f64);

const TRUTHS: [Truth; 4] = [
    ("sin 3x", |x| (3.0 * x).sin()),
    ("cos x", f64::cos),
    ("x^2 + 0.2x", |x| x * x + 0.2 * x),
    ("logistic 4x", |x| 1.0 / (1.0 + (-4.0 * x).exp())),
];

/// How x and the errors are drawn.
#[derive(Clone, Copy)]
struct Law {
    name: &'static str,
    gaussian: bool,
    /// Standard deviation of the error at x.
    noise: fn(f64) -> f64,
    /// Autoregression of (the normal scores of) x and of the errors.
    memory: [f64; 2],
}

const EVEN: fn(f64) -> f64 = |_| 0.2;
const UNEVEN: fn(f64) -> f64 = |x| 0.05 + 0.1 * x.abs();

const LAWS: [Law; 4] = [
    Law {
        name: "uniform, even",
        gaussian: false,
        noise: EVEN,
        memory: [0.0; 2],
    },
    Law {
        name: "uniform, uneven",
        gaussian: false,
        noise: UNEVEN,
        memory: [0.0; 2],
    },
    Law {
        name: "Gaussian, even",
        gaussian: true,
        noise: EVEN,
        memory: [0.0; 2],
    },
    Law {
        name: "Gaussian, uneven",
        gaussian: true,
        noise: UNEVEN,
        memory: [0.0; 2],
    },
];

/// Errors with an autoregression of 0.7, and x that is white or has one of 0.9.
const DEPENDENT: [Law; 2] = [
    Law {
        name: "white x, AR(0.7)",
        gaussian: true,
        noise: EVEN,
        memory: [0.0, 0.7],
    },
    Law {
        name: "AR(0.9) x, AR(0.7)",
        gaussian: true,
        noise: EVEN,
        memory: [0.9, 0.7],
    },
];

impl Law {
    fn draw(&self, m: fn(f64) -> f64, n: usize, seed: u64) -> (Vec<f64>, Vec<f64>) {
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut state: [f64; 2] = std::array::from_fn(|_| StandardNormal.sample(&mut rng));
        (0..n)
            .map(|_| {
                for (s, a) in state.iter_mut().zip(self.memory) {
                    let z: f64 = StandardNormal.sample(&mut rng);
                    *s = a * *s + (1.0 - a * a).sqrt() * z;
                }
                let x = if self.gaussian {
                    state[0]
                } else {
                    rng.random_range(-RANGE..RANGE)
                };
                (x, m(x) + (self.noise)(x) * state[1])
            })
            .unzip()
    }
}

/// Which points of which bands covered the truth.
struct Covered {
    /// Each interior point, by the pointwise band.
    points: Vec<bool>,
    /// The same for the other band of a comparison.
    plain: Vec<bool>,
    /// The ends of the range.
    ends: Vec<bool>,
    /// All points at once, by the simultaneous band.
    all: bool,
}

fn interior() -> Vec<f64> {
    (0..POINTS)
        .map(|i| INTERIOR * (2.0 * i as f64 / (POINTS - 1) as f64 - 1.0))
        .collect()
}

fn inside(band: &Band, m: fn(f64) -> f64) -> Vec<bool> {
    let limits = band.lower.iter().zip(&band.upper);
    band.x[0]
        .iter()
        .zip(limits)
        .map(|(&x, (low, high))| *low <= m(x) && m(x) <= *high)
        .collect()
}

fn share(of: impl Iterator<Item = bool>) -> f64 {
    let (hits, count) = of.fold((0_usize, 0_usize), |(h, c), b| (h + usize::from(b), c + 1));
    100.0 * hits as f64 / count.max(1) as f64
}

/// One line of a table.
fn report(name: &str, law: &Law, truth: &str, n: usize, results: &[Covered]) {
    let by_point = |of: fn(&Covered) -> &Vec<bool>| -> Vec<f64> {
        (0..of(&results[0]).len())
            .map(|j| share(results.iter().map(|r| of(r)[j])))
            .collect()
    };
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let least = |v: &[f64]| v.iter().copied().fold(f64::INFINITY, f64::min);
    let most = |v: &[f64]| v.iter().copied().fold(0.0, f64::max);
    let (points, plain, ends) = (by_point(|r| &r.points), by_point(|r| &r.plain), by_point(|r| &r.ends));
    let all = share(results.iter().map(|r| r.all));
    let error = (all * (100.0 - all) / results.len() as f64).sqrt();
    println!(
        "{name:22} {:19} {truth:12} {n:6} {:5}  {:5.1} {:5.1} {:5.1}   {:5.1} +-{error:3.1}  {:5.1}   {:5.1} {:5.1}",
        law.name,
        results.len(),
        mean(&points),
        least(&points),
        most(&points),
        all,
        least(&ends),
        mean(&plain),
        least(&plain),
    );
}

fn heading(what: &str, plain: &str) {
    println!("\n{what}\n");
    println!("{:89} coverage, % (nominal 95)", "");
    println!(
        "{:22} {:19} {:12} {:>6} {:>5}  {:>5} {:>5} {:>5}   {:>11}  {:>5}   {plain}",
        "estimator", "x, errors", "m", "n", "runs", "mean", "least", "most", "simultan.", "ends"
    );
}

fn kernel_fit(degree: Degree, x: &[f64], y: &[f64]) -> flexure::Result<KernelFit> {
    let kernel = Kernel::default();
    let bandwidth = BandwidthSearch::search(kernel, degree, x, y, None)?.bandwidth;
    Ok(KernelRegression { kernel, bandwidth }.fit(x, y)?.with_degree(degree))
}

const KINDS: [BandKind; 2] = [BandKind::Pointwise, BandKind::Simultaneous];

fn robust(fit: &KernelFit, seed: u64, m: fn(f64) -> f64) -> flexure::Result<Covered> {
    let at = interior();
    let band = |kind, at: &[f64]| {
        RobustBand {
            level: LEVEL,
            kind,
            draws: 1000,
            seed,
            ..RobustBand::default()
        }
        .for_kernel(fit, at)
    };
    let [points, all] = KINDS.map(|kind| band(kind, &at));
    let errors = fit.standard_errors(&at);
    let limits = fit.predict(&at).into_iter().zip(errors);
    Ok(Covered {
        points: inside(&points?, m),
        plain: at
            .iter()
            .zip(limits)
            .map(|(&x, (v, e))| (v - m(x)).abs() <= 1.96 * e)
            .collect(),
        ends: inside(&band(BandKind::Pointwise, &[-RANGE, RANGE])?, m),
        all: inside(&all?, m).into_iter().all(|b| b),
    })
}

/// The replications of one line, in parallel; no two lines have a seed in common.
fn replicate(
    line: &mut u64,
    runs: usize,
    one: impl Fn(u64) -> flexure::Result<Covered> + Sync,
) -> flexure::Result<Vec<Covered>> {
    *line += 1;
    let first = *line << 32;
    (0..runs as u64).into_par_iter().map(|run| one(first + run)).collect()
}

fn kernel_table(sizes: &[(usize, usize)]) -> flexure::Result<()> {
    heading(
        "Kernel, robust bias correction; plain: estimate +- 1.96 standard errors",
        "plain: mean, least",
    );
    let mut line = 0;
    for degree in [Degree::Linear, Degree::Constant] {
        for &(n, runs) in sizes {
            for law in &LAWS {
                for (name, m) in TRUTHS {
                    let results = replicate(&mut line, runs, |seed| {
                        let (x, y) = law.draw(m, n, seed);
                        robust(&kernel_fit(degree, &x, &y)?, seed, m)
                    })?;
                    report(&format!("kernel {degree:?}"), law, name, n, &results);
                }
            }
        }
    }
    Ok(())
}

/// An estimator whose parameter is fixed to the one that was chosen.
type Chosen = Box<dyn Fn(&[&[f64]], &[f64], Option<&[f64]>) -> flexure::Result<Box<dyn Regression>> + Sync>;

/// How to choose.
type Choose = fn(&[f64], &[f64]) -> flexure::Result<Chosen>;

/// The closure of an estimator.
fn fixed<E: Estimator + Clone + Send + Sync + 'static>(estimator: E) -> Chosen {
    Box::new(move |x, y, w| estimator.clone().fit_boxed(x, y, w))
}

const CHOICES: [(&str, Choose); 8] = [
    ("kernel Linear", |x, y| {
        let method = kernel_fit(Degree::Linear, x, y)?.method();
        Ok(Box::new(move |x, y, w| {
            let fit = match w {
                None => method.fit(x[0], y)?,
                Some(w) => method.fit_weighted(x[0], y, w)?,
            };
            Ok(Box::new(fit.with_degree(Degree::Linear)))
        }))
    }),
    ("kernel Constant", |x, y| {
        Ok(fixed(kernel_fit(Degree::Constant, x, y)?.method()))
    }),
    ("nearest neighbours", |x, y| {
        let chosen = NearestNeighbours::default().fit(&[x], y, None)?.neighbours();
        let neighbours = Choice::Fixed(chosen);
        Ok(fixed(NearestNeighbours {
            neighbours,
            ..NearestNeighbours::default()
        }))
    }),
    ("penalised spline", |x, y| {
        let penalty = Choice::Fixed(SplineRegression::default().fit(&[x], y, None)?.penalty());
        Ok(fixed(SplineRegression {
            penalty,
            ..SplineRegression::default()
        }))
    }),
    ("polynomial", |x, y| polynomial(x, y, 0)),
    ("polynomial, degree + 2", |x, y| polynomial(x, y, 2)),
    ("cosine series", |x, y| cosines(x, y, 1.0)),
    ("cosine series, 2 terms", |x, y| cosines(x, y, 2.0)),
];

fn polynomial(x: &[f64], y: &[f64], more: usize) -> flexure::Result<Chosen> {
    let degree = PolynomialRegression::default().fit(&[x], y, None)?.terms() - 1;
    Ok(fixed(PolynomialRegression {
        degree: Choice::Fixed(degree + more),
        ..PolynomialRegression::default()
    }))
}

fn cosines(x: &[f64], y: &[f64], factor: f64) -> flexure::Result<Chosen> {
    let series = SeriesRegression {
        basis: Basis::Cosine,
        ..SeriesRegression::default()
    };
    let terms = (series.fit(&[x], y, None)?.terms() as f64 * factor) as usize;
    Ok(fixed(SeriesRegression {
        terms: Choice::Fixed(terms),
        ..series
    }))
}

/// A bootstrap band of each kind, and for comparison the wild bootstrap's.
fn bootstrap(
    (choose, scheme, resamples): (Choose, Scheme, usize),
    (x, y): (&[f64], &[f64]),
    seed: u64,
    m: fn(f64) -> f64,
) -> flexure::Result<Covered> {
    let refit = choose(x, y)?;
    let band = |scheme, kind, at: &[f64]| {
        let method = BootstrapBand {
            level: LEVEL,
            kind,
            scheme,
            resamples,
            seed,
            ..BootstrapBand::default()
        };
        method.run(&*refit, &[x], y, None, &[at], &mut |_, _| ControlFlow::Continue(()))
    };
    // Near the ends of the range, evaluated together with the interior: some estimators are not defined beyond the data.
    let near = 0.98 * RANGE;
    let at: Vec<f64> = interior().into_iter().chain([-near, near]).collect();
    let mut points = inside(&band(scheme, BandKind::Pointwise, &at)?, m);
    let ends = points.split_off(POINTS);
    let all = inside(&band(scheme, BandKind::Simultaneous, &at[..POINTS])?, m)
        .into_iter()
        .all(|b| b);
    Ok(Covered {
        points,
        plain: inside(&band(Scheme::Wild, BandKind::Pointwise, &at[..POINTS])?, m),
        ends,
        all,
    })
}

/// Independent errors: static data of two laws.
fn bootstrap_table(n: usize, runs: usize, resamples: usize, settings: &[(Law, Truth)]) -> flexure::Result<()> {
    heading(
        &format!("Bootstrap of pairs, {resamples} resamples; plain: wild bootstrap"),
        "plain: mean, least",
    );
    let mut line = 1000;
    for (name, choose) in CHOICES {
        for &(law, (truth, m)) in settings {
            let results = replicate(&mut line, runs, |seed| {
                let (x, y) = law.draw(m, n, seed);
                bootstrap((choose, Scheme::Pairs, resamples), (&x, &y), seed, m)
            })?;
            report(name, &law, truth, n, &results);
        }
    }
    Ok(())
}

fn block_table(n: usize, runs: usize, resamples: usize) -> flexure::Result<()> {
    heading(
        &format!(
            "Moving block bootstrap, {resamples} resamples; plain: the wild bootstrap, which takes errors for independent"
        ),
        "plain: mean, least",
    );
    let mut line = 2000;
    let scheme = Scheme::MovingBlock { length: None };
    for (name, choose) in &CHOICES[..4] {
        for law in &DEPENDENT {
            let (truth, m) = TRUTHS[0];
            let results = replicate(&mut line, runs, |seed| {
                let (x, y) = law.draw(m, n, seed);
                bootstrap((*choose, scheme, resamples), (&x, &y), seed, m)
            })?;
            report(name, law, truth, n, &results);
        }
    }
    Ok(())
}

fn main() -> flexure::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let full = arguments.iter().any(|a| a == "full");
    let parts: Vec<&String> = arguments.iter().filter(|a| *a != "full").collect();
    let wanted = |name: &str| parts.is_empty() || parts.iter().any(|w| *w == name);
    if wanted("kernel") {
        kernel_table(if full {
            &[(1000, 2000), (10_000, 600)]
        } else {
            &[(1000, 400)]
        })?;
    }
    let settings = [(LAWS[1], TRUTHS[0]), (LAWS[2], TRUTHS[3])];
    if wanted("bootstrap") {
        if full {
            bootstrap_table(1000, 500, 199, &settings)?;
        } else {
            bootstrap_table(500, 200, 99, &settings[..1])?;
        }
    }
    if wanted("block") {
        if full {
            block_table(1000, 500, 199)?;
        } else {
            block_table(500, 200, 99)?;
        }
    }
    Ok(())
}
