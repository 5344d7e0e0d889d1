//! The refined identification, compared with an estimator that knows the linear part:
//! `cargo bench -p flexure --bench refined [-- SEEDS [ROWS]]`, only the rows whose name contains ROWS.
//!
//! First the common job of `identify.rs` with times; then, for many systems and inputs, the relative L2 error of the
//! nonlinearity on the middle 95 % of the input's range after affine alignment, n = 20,000, process noise 0.1: median and worst over the
//! seeds. "Known" is the least-squares fit of cubic B-splines through the true linear part, with the number of knots that is best in
//! hindsight. The refined identification has no such knowledge, and does not fit a quarter of the record; "known" fits all of it.

use flexure::Record;
use flexure::identify::RefinedHammerstein;
use flexure::linear::TransferFunction;
use flexure::signal::{Phases, multisine};
use flexure::systems::{KnownHammerstein, KnownNonlinearity, known_linear_parts, relative_error_after_alignment};
use flexure::validation::FitMeasures;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

/// Samples of every record of the table.
const SAMPLES: usize = 20_000;
/// The start of a record, in which the state still settles.
const SKIP: usize = 300;

type Failure = Box<dyn std::error::Error>;

#[derive(Clone, Copy, PartialEq)]
enum Input {
    Uniform,
    Gaussian,
    Filtered,
    Multisine,
}

impl Input {
    fn name(self) -> &'static str {
        match self {
            Input::Uniform => "uniform",
            Input::Gaussian => "Gaussian",
            Input::Filtered => "filtered",
            Input::Multisine => "multisine",
        }
    }

    fn samples(self, n: usize, seed: u64) -> Result<Vec<f64>, Failure> {
        let mut rng = Pcg64::seed_from_u64(1000 + seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        Ok(match self {
            Input::Uniform => (0..n).map(|_| rng.random_range(-2.0..2.0)).collect(),
            Input::Gaussian => (0..n).map(|_| normal()).collect(),
            Input::Filtered => {
                let white: Vec<f64> = (0..n).map(|_| 0.6 * normal()).collect();
                TransferFunction::new(vec![1.0], vec![1.0, -0.8])?.simulate(&white)
            }
            Input::Multisine => multisine_input(n, seed)?,
        })
    }
}

struct Row {
    nonlinearity: KnownNonlinearity,
    linear: TransferFunction,
    label: &'static str,
    input: Input,
    snr_db: f64,
}

impl Row {
    fn record(&self, seed: u64) -> Result<Record, Failure> {
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let before = self.linear.settling(1e-6);
        let u = self.input.samples(before + SAMPLES, seed)?;
        let w: Vec<f64> = u.iter().map(|u| self.nonlinearity.value(*u) + 0.1 * normal()).collect();
        let y0 = self.linear.simulate(&w).split_off(before);
        let mean = y0.iter().sum::<f64>() / y0.len() as f64;
        let power = y0.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / y0.len() as f64;
        let noise = power.sqrt() * 10.0_f64.powf(-self.snr_db / 20.0);
        let y = y0.iter().map(|y| y + noise * normal()).collect();
        Ok(Record::new([("u", u[before..].to_vec()), ("y", y)])?)
    }

    /// The middle 95 % of the input's range.
    fn grid(&self, u: &[f64]) -> Vec<f64> {
        let mut sorted = u.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        let (low, high) = (sorted[u.len() / 40], sorted[u.len() - 1 - u.len() / 40]);
        (0..4000)
            .map(|i| low + (high - low) * (f64::from(i) + 0.5) / 4000.0)
            .collect()
    }

    fn error(&self, grid: &[f64], estimate: impl Fn(f64) -> f64) -> f64 {
        let truth: Vec<f64> = grid.iter().map(|x| self.nonlinearity.value(*x)).collect();
        let values: Vec<f64> = grid.iter().map(|x| estimate(*x)).collect();
        relative_error_after_alignment(&truth, &values)
    }
}

/// The fit of uniform cubic B-splines that knows the linear part; the number of knots best in hindsight.
fn known(row: &Row, u: &[f64], y: &[f64], grid: &[f64]) -> f64 {
    let (low, high) = u
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), u| (a.min(*u), b.max(*u)));
    let error = |pieces: usize| {
        let step = (high - low) / pieces as f64;
        let basis = |x: f64| {
            let t = ((x - low) / step).clamp(0.0, pieces as f64 - 1e-9);
            let s = t.fract();
            let mut v = vec![0.0; pieces + 3];
            v[t as usize..][..4].copy_from_slice(&[
                (1.0 - s).powi(3) / 6.0,
                (3.0 * s.powi(3) - 6.0 * s * s + 4.0) / 6.0,
                (-3.0 * s.powi(3) + 3.0 * s * s + 3.0 * s + 1.0) / 6.0,
                s.powi(3) / 6.0,
            ]);
            v
        };
        let rows: Vec<Vec<f64>> = u.iter().map(|u| basis(*u)).collect();
        let mut columns: Vec<Vec<f64>> = (0..pieces + 3)
            .map(|j| {
                row.linear
                    .simulate_from_mean(&rows.iter().map(|r| r[j]).collect::<Vec<_>>())
            })
            .collect();
        columns.push(vec![1.0; u.len()]);
        let c = least_squares(&columns, y);
        row.error(grid, |x| basis(x).iter().zip(&c).map(|(v, c)| v * c).sum())
    };
    [4, 6, 9, 13, 19, 27, 38, 54]
        .into_iter()
        .map(error)
        .fold(f64::INFINITY, f64::min)
}

/// Normal equations and elimination.
fn least_squares(columns: &[Vec<f64>], y: &[f64]) -> Vec<f64> {
    let n = columns.len();
    let dot = |a: &[f64], b: &[f64]| a[SKIP..].iter().zip(&b[SKIP..]).map(|(a, b)| a * b).sum::<f64>();
    let mut g = vec![vec![0.0; n + 1]; n];
    for i in 0..n {
        for j in 0..=i {
            g[i][j] = dot(&columns[i], &columns[j]);
            g[j][i] = g[i][j];
        }
        g[i][n] = dot(&columns[i], y);
    }
    for i in 0..n {
        g[i][i] *= 1.0 + 1e-9;
    }
    for i in 0..n {
        let pivot = g[i].clone();
        for row in &mut g[i + 1..] {
            let share = row[i] / pivot[i];
            for j in i..=n {
                row[j] -= share * pivot[j];
            }
        }
    }
    let mut c = vec![0.0; n];
    for i in (0..n).rev() {
        c[i] = (g[i][n] - (i + 1..n).map(|j| g[i][j] * c[j]).sum::<f64>()) / g[i][i];
    }
    c
}

fn multisine_input(n: usize, seed: u64) -> Result<Vec<f64>, Failure> {
    let mut u = multisine(4096, 1.0, 2.5, 0.001, 0.35, Phases::Random { seed })?;
    let period = u.clone();
    while u.len() < n {
        u.extend(&period);
    }
    u.truncate(n);
    Ok(u)
}

/// The CPU time of all threads so far, by Linux's scheduler statistics; zero elsewhere.
fn cpu_seconds() -> f64 {
    let of_task = |task: std::fs::DirEntry| -> Option<f64> {
        let text = std::fs::read_to_string(task.path().join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse().ok()
    };
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    tasks.filter_map(of_task).sum::<f64>() * 1e-9
}

fn median(v: &[f64]) -> f64 {
    let mut v = v.to_vec();
    v.sort_by(f64::total_cmp);
    v[v.len() / 2]
}

fn worst(v: &[f64]) -> f64 {
    v.iter().copied().fold(0.0, f64::max)
}

fn common_job(n: usize, seeds: u64) -> Result<(), Failure> {
    let linear = TransferFunction::new(vec![0.0, 1.0, 0.5], vec![1.0, -1.5, 0.7])?;
    let mut system = KnownHammerstein::usual(KnownNonlinearity::DeadZone, linear);
    system.process_noise = 0.0;
    let fresh = system.simulate(10_000, 999);
    let grid: Vec<f64> = (0..=400).map(|i| -2.0 + 0.01 * f64::from(i)).collect();
    let (mut errors, mut missing, mut least) = (vec![], vec![], f64::INFINITY);
    for seed in 1..=seeds {
        let record = system.simulate(n, seed);
        let start = cpu_seconds();
        let result = RefinedHammerstein::default().identify(&record, "u", "y")?;
        least = least.min(cpu_seconds() - start);
        errors.push(system.nonlinearity_error(&grid, |x| {
            result.curve("nonlinearity").map_or(f64::NAN, |phi| phi.value(x))
        }));
        let predicted = result.model.simulate(fresh.column("u")?);
        let fit = FitMeasures::new(&fresh.column("y0")?[SKIP..], &predicted[SKIP..])?.fit_percent;
        missing.push(100.0 - fit);
    }
    println!(
        "{n:>9} {:>9.1} {:>8.4} {:>8.4} {:>9.2} {:>8.2}",
        least * 1e3,
        median(&errors),
        worst(&errors),
        100.0 - median(&missing),
        100.0 - worst(&missing)
    );
    Ok(())
}

fn rows() -> Result<Vec<Row>, Failure> {
    use KnownNonlinearity::{Cubic, DeadZone, Friction, HardLimiter, Parabola, Quantizer, SoftWindup};
    let [damped, resonance] = known_linear_parts();
    let late = TransferFunction::new(vec![0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.4, 0.1], vec![1.0, -1.2, 0.52])?;
    // (1 - 1.2 z^-1 + 0.52 z^-2)(1 - 1.4 z^-1 + 0.85 z^-2) below.
    let fourth = TransferFunction::new(vec![1.0, -0.6, 0.5, 0.2], vec![1.0, -2.6, 3.05, -1.748, 0.442])?;
    let mut rows = Vec::new();
    let mut add = |nonlinearity, linear: &TransferFunction, label, input, snr_db| {
        rows.push(Row {
            nonlinearity,
            linear: linear.clone(),
            label,
            input,
            snr_db,
        });
    };
    for snr in [20.0, 40.0, 10.0] {
        for (phi, linear, label) in [
            (DeadZone, &damped, "damped"),
            (DeadZone, &resonance, "resonance"),
            (Quantizer, &damped, "damped"),
            (Parabola, &resonance, "resonance"),
            (SoftWindup, &resonance, "resonance"),
            (Friction, &resonance, "resonance"),
            (HardLimiter, &damped, "damped"),
            (HardLimiter, &resonance, "resonance"),
            (Cubic, &damped, "damped"),
            (Friction, &damped, "damped"),
            (DeadZone, &late, "delay 5"),
            (DeadZone, &fourth, "order 4"),
        ] {
            add(phi, linear, label, Input::Uniform, snr);
        }
    }
    for input in [Input::Gaussian, Input::Filtered, Input::Multisine] {
        for phi in [DeadZone, Quantizer, Friction, Parabola] {
            add(phi, &damped, "damped", input, 20.0);
        }
    }
    Ok(rows)
}

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let seeds = arguments.first().and_then(|a| a.parse().ok()).unwrap_or(20);
    let only = arguments.get(1).map_or("", String::as_str);
    println!(
        "{:>9} {:>9} {:>8} {:>8} {:>9} {:>8}",
        "samples", "CPU ms", "NL", "worst", "fit %", "worst"
    );
    for n in [10_000, 100_000, 1_000_000] {
        common_job(n, if n > 100_000 { 1 } else { seeds })?;
    }
    println!(
        "\n{:<44} {:>8} {:>8} {:>8} {:>8} {:>7}  delay, order; other in",
        "", "refined", "worst", "known", "worst", "ratio"
    );
    for row in rows()? {
        let name = format!(
            "{}, {}, {}, {} dB",
            row.nonlinearity.name(),
            row.label,
            row.input.name(),
            row.snr_db
        );
        if !name.contains(only) {
            continue;
        }
        let (mut refined, mut knows) = (vec![], vec![]);
        let mut orders = vec![];
        for seed in 1..=seeds {
            let record = row.record(seed)?;
            let (u, y) = (record.column("u")?, record.column("y")?);
            let grid = row.grid(u);
            let result = RefinedHammerstein::default().identify(&record, "u", "y")?;
            orders.push((result.delay, result.order));
            refined.push(row.error(&grid, |x| {
                result.curve("nonlinearity").map_or(f64::NAN, |phi| phi.value(x))
            }));
            knows.push(known(&row, u, y, &grid));
        }
        let (a, b) = (median(&refined), median(&knows));
        let odd = orders.iter().filter(|o| **o != orders[0]).count();
        println!(
            "{name:<44} {a:>8.4} {:>8.4} {b:>8.4} {:>8.4} {:>7.2} {:?} {odd}",
            worst(&refined),
            worst(&knows),
            a / b,
            orders[0]
        );
    }
    Ok(())
}
