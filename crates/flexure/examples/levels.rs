//! Prints how often the residual tests reject, by Monte Carlo: a true model at their stated level of 1 %, a wrong one as
//! often as possible.
//!
//! The columns of single tests count p-values below 1 %; "any below 1 %" counts runs in which this holds for any of the seven tests that
//! can refute a model. "refuted" counts the library's verdict: the joint level of these seven is 1 %, a seventh for each.
//!
//! ```text
//! cargo run --release -p flexure --example levels                # some minutes on two cores
//! cargo run --release -p flexure --example levels -- full        # ten times as many runs
//! cargo run --release -p flexure --example levels -- known       # one table: known, identified, noise or wrong
//! cargo run --release -p flexure --example levels -- identified --only "n = 2000, linear" --runs 2000
//! ```
//!
//! `--only` prints the rows whose name contains a text, `--runs` sets the number of runs of every row.
//!
//! "known": the error is the noise itself, as if the model were exactly the system; n is the number of samples tested.
//! "identified": the model has the system's structure and is estimated from three quarters of n samples; the tests see the error on the
//! last quarter and allow for the estimation error. With a noise model, this error is first filtered by the autoregression from the fitted
//! part, and then tested for whiteness. "wrong": the model has a different structure from the system.
//!
//! In parentheses the 95 % interval of the rate (Wilson 1927); a star where it excludes 1 %.

#[allow(dead_code)] // What other examples draw.
#[path = "structures/draw.rs"]
mod draw;

use draw::{Kind, draw};
use flexure::Record;
use flexure::identify::{HAMMERSTEIN_WIENER, LINEAR, MULTIPLE_INPUTS, RefinedHammerstein, WIENER, WIENER_HAMMERSTEIN};
use flexure::linear::TransferFunction;
use flexure::validation::{Estimated, LEVEL, ResidualTest, ResidualTests, TestKind};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use rayon::prelude::*;

const KINDS: [(TestKind, &str); 8] = [
    (TestKind::Whiteness, "white"),
    (TestKind::InputIndependence, "u"),
    (TestKind::SquaredInputIndependence, "u^2"),
    (TestKind::CubedInputIndependence, "u^3"),
    (TestKind::SquaredIndependence, "e^2, u^2"),
    (TestKind::SquaredPredictionIndependence, "p^2"),
    (TestKind::CubedPredictionIndependence, "p^3"),
    (TestKind::OutputFunctionIndependence, "f(y)"),
];
/// The tests, any of them that can refute a model, and whether it is refuted.
const COLUMNS: usize = KINDS.len() + 2;
/// The column of the joint verdict.
const REFUTED: usize = KINDS.len() + 1;
/// Samples for transients to decay.
const BEFORE: usize = 300;

/// The tests of one run; `None` if the record is too short.
type Tested = flexure::Result<Option<ResidualTests>>;

fn normal(rng: &mut Pcg64, n: usize) -> Vec<f64> {
    (0..n).map(|_| StandardNormal.sample(rng)).collect()
}

fn filtered(b: &[f64], a: &[f64], v: &[f64]) -> flexure::Result<Vec<f64>> {
    Ok(TransferFunction::new(b.to_vec(), a.to_vec())?.simulate(v))
}

fn saturation(u: f64) -> f64 {
    u.clamp(-0.6, 1.0)
}

/// A Hammerstein system's input, noise-free output, and noise of a tenth of its size, white or ARMA(2, 1).
fn hammerstein(seed: u64, n: usize, coloured_input: bool, coloured_noise: bool) -> flexure::Result<[Vec<f64>; 3]> {
    let mut rng = Pcg64::seed_from_u64(seed);
    let total = n + BEFORE;
    let u = match coloured_input {
        true => filtered(&[0.6], &[1.0, -0.8], &normal(&mut rng, total))?,
        false => (0..total).map(|_| rng.random_range(-1.7..1.7)).collect(),
    };
    let v: Vec<f64> = u.iter().map(|u| saturation(*u)).collect();
    let y = filtered(&[0.5, 0.2], &[1.0, -1.2, 0.52], &v)?;
    let e: Vec<f64> = normal(&mut rng, total).iter().map(|e| 0.1 * e).collect();
    let e = match coloured_noise {
        true => filtered(&[1.0, 0.5], &[1.0, -1.1, 0.4], &e)?,
        false => e,
    };
    Ok([u, y, e].map(|v| v[BEFORE..].to_vec()))
}

/// A coloured input, its saturation after a first-order lag, and noise.
fn behind_linear(seed: u64, n: usize, coloured_noise: bool) -> flexure::Result<(Vec<f64>, Vec<f64>, Vec<f64>)> {
    let [u, _, e] = hammerstein(seed, n, true, coloured_noise)?;
    let w = filtered(&[0.3, 0.1], &[1.0, -0.7], &u)?;
    Ok((u, w.iter().map(|x| saturation(*x)).collect(), e))
}

/// The error as if the model were the system.
fn known(seed: u64, n: usize, coloured: [bool; 2]) -> Tested {
    let [u, y, e] = hammerstein(seed, n, coloured[0], coloured[1])?;
    ResidualTests::with_prediction(&e, &u, &y).map(Some)
}

fn record(u: &[f64], y: &[f64]) -> flexure::Result<Record> {
    Record::new([("u", u.to_vec()), ("y", y.to_vec())])
}

fn sum(y: &[f64], e: &[f64]) -> Vec<f64> {
    y.iter().zip(e).map(|(y, e)| y + e).collect()
}

/// Which rows are printed, and with how many runs.
struct Options {
    scale: u64,
    only: Option<String>,
    runs: Option<u64>,
}

impl Options {
    fn new(arguments: &[String]) -> Options {
        let value = |name: &str| {
            arguments
                .windows(2)
                .find(|pair| pair[0] == name)
                .map(|pair| pair[1].clone())
        };
        Options {
            scale: if arguments.iter().any(|a| a == "full") { 10 } else { 1 },
            only: value("--only"),
            runs: value("--runs").and_then(|runs| runs.parse().ok()),
        }
    }
}

/// A table's row: the tested case, and how its signals are drawn.
struct Row {
    name: String,
    runs: u64,
    draw: Box<dyn Fn(u64) -> Tested + Sync>,
}

impl Row {
    fn new(name: &str, runs: u64, draw: impl Fn(u64) -> Tested + Sync + 'static) -> Row {
        Row {
            name: name.to_owned(),
            runs,
            draw: Box::new(draw),
        }
    }

    /// Counts of runs in which each test alone rejects at 1 %, any test that can refute a model rejects, and the model is refuted; and of
    /// runs that could be tested.
    fn counts(&self, runs: u64) -> ([u64; COLUMNS], u64) {
        let each = (0..runs).into_par_iter().filter_map(|seed| {
            let tests = (self.draw)(seed).ok()??;
            let rejects = |t: &ResidualTest| t.p_value < LEVEL;
            let mut rejected = [0; COLUMNS];
            for (count, (kind, _)) in rejected.iter_mut().zip(KINDS) {
                *count = u64::from(tests.tests.iter().any(|t| t.kind == kind && rejects(t)));
            }
            rejected[KINDS.len()] = u64::from(tests.tests.iter().any(|t| t.kind.refutes() && rejects(t)));
            rejected[REFUTED] = u64::from(tests.refutation().is_some());
            Some((rejected, 1))
        });
        let none = || ([0; COLUMNS], 0);
        each.reduce(none, |mut a, b| {
            a.0.iter_mut().zip(b.0).for_each(|(a, b)| *a += b);
            (a.0, a.1 + b.1)
        })
    }

    fn print(&self, level: bool, options: &Options) {
        if !options.only.as_ref().is_none_or(|text| self.name.contains(text)) {
            return;
        }
        let (counts, runs) = self.counts(options.runs.unwrap_or(options.scale * self.runs));
        let cells = counts.iter().enumerate().map(|(i, &count)| {
            let (rate, [low, high]) = interval(count, runs);
            let stated = i < KINDS.len() || i == REFUTED;
            let off = level && stated && !(low..=high).contains(&LEVEL);
            let star = if off { '*' } else { ' ' };
            format!(
                "{:>6.2} ({:>5.2}-{:>5.2}){star}",
                100.0 * rate,
                100.0 * low,
                100.0 * high
            )
        });
        println!("{:<34}{:>6} {}", self.name, runs, cells.collect::<Vec<_>>().join(""));
    }
}

/// A rate and its 95 % interval.
fn interval(count: u64, runs: u64) -> (f64, [f64; 2]) {
    let (n, rate, z) = (runs as f64, count as f64 / runs as f64, 1.96);
    let centre = (rate + z * z / (2.0 * n)) / (1.0 + z * z / n);
    let half = z / (1.0 + z * z / n) * (rate * (1.0 - rate) / n + z * z / (4.0 * n * n)).sqrt();
    (rate, [centre - half, centre + half])
}

fn head(title: &str) {
    let names = KINDS.iter().map(|k| k.1).chain(["any below 1 %", "refuted"]);
    let cells: Vec<String> = names.map(|name| format!("{name:>21}")).collect();
    println!(
        "\n{title}; rejections in percent\n{:<34}{:>6} {}",
        "",
        "runs",
        cells.join("")
    );
}

fn known_table(options: &Options) {
    head("known: the error is the noise itself");
    for n in [500, 1000, 8000] {
        for (name, coloured) in [
            ("white u, white e", [false, false]),
            ("coloured u, white e", [true, false]),
            ("white u, ARMA e", [false, true]),
            ("coloured u, ARMA e", [true, true]),
        ] {
            let runs = 10_000;
            Row::new(&format!("n = {n}, {name}"), runs, move |seed| known(seed, n, coloured)).print(true, options);
        }
    }
}

fn identified_table(options: &Options) {
    head("identified: of the system's structure, from three quarters of n samples, tested on the last");
    for n in [2000, 32_000] {
        let runs = |each: u64| if n > 10_000 { each / 4 } else { each };
        for coloured in [[false, false], [true, true]] {
            let name = if coloured[0] { "coloured" } else { "white" };
            Row::new(&format!("n = {n}, Hammerstein, {name}"), runs(800), move |seed| {
                let [u, y0, e] = hammerstein(seed, n, coloured[0], coloured[1])?;
                let y = sum(&y0, &e);
                let result = RefinedHammerstein::default().identify(&record(&u, &y)?, "u", "y")?;
                Ok(result.verdict.residuals)
            })
            .print(true, options);
        }
        for coloured in [[false, false], [true, true]] {
            let name = if coloured[0] { "coloured" } else { "white" };
            Row::new(&format!("n = {n}, linear, {name}"), runs(800), move |seed| {
                let [u, _, e] = hammerstein(seed, n, coloured[0], coloured[1])?;
                let y = sum(&filtered(&[0.5, 0.2], &[1.0, -1.2, 0.52], &u)?, &e);
                let result = LINEAR.identify(&record(&u, &y)?, &["u"], "y")?;
                Ok(result.verdict.residuals)
            })
            .print(true, options);
        }
        for coloured in [false, true] {
            let name = if coloured { "ARMA" } else { "white" };
            Row::new(&format!("n = {n}, Wiener, {name} e"), runs(60), move |seed| {
                let (u, w, e) = behind_linear(seed, n, coloured)?;
                let result = WIENER.identify(&record(&u, &sum(&w, &e))?, &["u"], "y")?;
                Ok(result.verdict.residuals)
            })
            .print(true, options);
            Row::new(
                &format!("n = {n}, Wiener-Hammerstein, {name} e"),
                runs(60),
                move |seed| {
                    let (u, w, e) = behind_linear(seed, n, coloured)?;
                    let y = sum(&filtered(&[0.5, 0.2], &[1.0, -1.2, 0.52], &w)?, &e);
                    let result = WIENER_HAMMERSTEIN.identify(&record(&u, &y)?, &["u"], "y")?;
                    Ok(result.verdict.residuals)
                },
            )
            .print(true, options);
            Row::new(&format!("n = {n}, nonlinear ends, {name} e"), runs(60), move |seed| {
                let [u, y0, e] = hammerstein(seed, n, true, coloured)?;
                let y: Vec<f64> = y0.iter().map(|x| x + 0.2 * x * x * x).collect();
                let result = HAMMERSTEIN_WIENER.identify(&record(&u, &sum(&y, &e))?, &["u"], "y")?;
                Ok(result.verdict.residuals)
            })
            .print(true, options);
            Row::new(&format!("n = {n}, two inputs, {name} e"), runs(60), move |seed| {
                let [u, y0, e] = hammerstein(seed, n, true, coloured)?;
                let [v, w, _] = hammerstein(seed + 1_000_000, n, false, false)?;
                let y = sum(&sum(&y0, &w), &e);
                let columns = [("u", u), ("v", v), ("y", y)];
                let result = MULTIPLE_INPUTS.identify(&Record::new(columns)?, &["u", "v"], "y")?;
                Ok(result.verdicts.into_iter().next().and_then(|v| v.residuals))
            })
            .print(true, options);
        }
    }
}

fn noise_table(options: &Options) {
    head("noise: the error of an identified model through its noise model, both from three quarters of n samples");
    for n in [2000, 8000] {
        // No finite autoregression makes the second one white.
        for (name, numerator) in [("AR(2) e", [1.0, 0.0]), ("ARMA(2, 1) e", [1.0, 0.5])] {
            Row::new(&format!("n = {n}, {name}, noise model"), 800, move |seed| {
                let [u, y0, e] = hammerstein(seed, n, false, false)?;
                let y = sum(&y0, &filtered(&numerator, &[1.0, -1.1, 0.4], &e)?);
                let result = RefinedHammerstein::default().identify(&record(&u, &y)?, "u", "y")?;
                let from = result.fitted;
                let e = sum(&y, &result.predicted.iter().map(|p| -p).collect::<Vec<_>>());
                let noise_model = result.noise_model.unwrap_or_else(|| vec![1.0]);
                let e = filtered(&noise_model, &[1.0], &e)?;
                let noise = Estimated {
                    parameters: noise_model.len() - 1,
                    samples: from,
                };
                let model = result.verdict.estimated.unwrap_or(noise);
                ResidualTests::of_whitened(&e[from..], &u[from..], &result.predicted[from..], model, noise).map(Some)
            })
            .print(true, options);
        }
    }
}

fn wrong_table(options: &Options) {
    head("wrong: another structure, from three quarters of n samples, tested on the last");
    for n in [2000, 8000] {
        let runs = 60;
        Row::new(&format!("n = {n}, linear to Hammerstein"), runs, move |seed| {
            let [u, y, e] = hammerstein(seed, n, false, false)?;
            let y = sum(&y, &e);
            let result = LINEAR.identify(&record(&u, &y)?, &["u"], "y")?;
            Ok(result.verdict.residuals)
        })
        .print(false, options);
        for (kind, name) in [(Kind::Wiener, "Wiener"), (Kind::Feedback, "Duffing")] {
            Row::new(&format!("n = {n}, Hammerstein to {name}"), runs, move |seed| {
                let drawn = draw(kind, seed, n, 0.1)?;
                let record = record(&drawn.u, &drawn.y)?;
                let result = RefinedHammerstein::default().identify(&record, "u", "y")?;
                Ok(result.verdict.residuals)
            })
            .print(false, options);
        }
        Row::new(&format!("n = {n}, order 1 to order 2"), runs, move |seed| {
            let [u, y, e] = hammerstein(seed, n, false, false)?;
            let y = sum(&y, &e);
            let method = RefinedHammerstein {
                order: Some(1),
                ..Default::default()
            };
            let result = method.identify(&record(&u, &y)?, "u", "y")?;
            Ok(result.verdict.residuals)
        })
        .print(false, options);
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let options = Options::new(&arguments);
    let tables = ["known", "identified", "noise", "wrong"];
    let all = !arguments.iter().any(|a| tables.contains(&a.as_str()));
    let chosen = |name: &str| all || arguments.iter().any(|a| a == name);
    println!(
        "Residual tests at the level of {} %, each and jointly; a star where the 95 % interval excludes it.",
        100.0 * LEVEL
    );
    if chosen("known") {
        known_table(&options);
    }
    if chosen("identified") {
        identified_table(&options);
    }
    if chosen("noise") {
        noise_table(&options);
    }
    if chosen("wrong") {
        wrong_table(&options);
    }
}
