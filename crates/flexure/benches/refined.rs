//! The refined identification beside an estimator that knows the linear part: `cargo bench -p flexure --bench refined`.

use std::time::Instant;

use flexure::identify::RefinedHammerstein;
use flexure::linear::TransferFunction;
use flexure::systems::{KnownHammerstein, KnownNonlinearity, known_linear_parts};
use flexure::validation::FitMeasures;

fn median(v: &[f64]) -> f64 {
    let mut v = v.to_vec();
    v.sort_by(f64::total_cmp);
    v[v.len() / 2]
}
fn worst(v: &[f64]) -> f64 {
    v.iter().copied().fold(0.0, f64::max)
}

fn common(n: usize, seeds: u64, method: &RefinedHammerstein) -> flexure::Result<()> {
    let linear = TransferFunction::new(vec![0.0, 1.0, 0.5], vec![1.0, -1.5, 0.7])?;
    let mut system = KnownHammerstein::usual(KnownNonlinearity::DeadZone, linear);
    system.process_noise = 0.0;
    let fresh = system.simulate(10_000, 999);
    let grid: Vec<f64> = (0..=400).map(|i| -2.0 + 0.01 * f64::from(i)).collect();
    let (mut nl, mut fits, mut times) = (vec![], vec![], vec![]);
    for seed in 1..=seeds {
        let record = system.simulate(n, seed);
        let start = Instant::now();
        let result = method.identify(&record, "u", "y")?;
        times.push(start.elapsed().as_secs_f64());
        nl.push(system.nonlinearity_error(&grid, |x| result.value(x)));
        let predicted = result.simulate(fresh.column("u")?);
        fits.push(100.0 - FitMeasures::new(&fresh.column("y0")?[100..], &predicted[100..])?.fit_percent);
    }
    println!(
        "{n:>9} NL {:.4} ({:.4}) fit {:.3} ({:.3}) ms {:.1}",
        median(&nl), worst(&nl), 100.0 - median(&fits), 100.0 - worst(&fits),
        1e3 * times.iter().copied().fold(f64::INFINITY, f64::min)
    );
    Ok(())
}

/// Best in hindsight of uniform cubic B-splines through the true linear part.
fn oracle(system: &KnownHammerstein, u: &[f64], y: &[f64], grid: &[f64]) -> f64 {
    let mut best = f64::INFINITY;
    for pieces in [4usize, 6, 9, 13, 19, 27, 38, 54] {
        let (low, high) = u.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), u| (a.min(*u), b.max(*u)));
        let step = (high - low) / pieces as f64;
        let size = pieces + 3;
        let row = |x: f64| -> Vec<f64> {
            // Uniform cubic B-splines.
            let t = ((x - low) / step).clamp(0.0, pieces as f64 - 1e-9);
            let (i, s) = (t.floor() as usize, t.fract());
            let mut v = vec![0.0; size];
            v[i] = (1.0 - s).powi(3) / 6.0;
            v[i + 1] = (3.0 * s.powi(3) - 6.0 * s * s + 4.0) / 6.0;
            v[i + 2] = (-3.0 * s.powi(3) + 3.0 * s * s + 3.0 * s + 1.0) / 6.0;
            v[i + 3] = s.powi(3) / 6.0;
            v
        };
        let rows: Vec<Vec<f64>> = u.iter().map(|u| row(*u)).collect();
        let columns: Vec<Vec<f64>> = (0..size)
            .map(|j| system.linear.simulate_from_mean(&rows.iter().map(|r| r[j]).collect::<Vec<_>>()))
            .chain([vec![1.0; u.len()]])
            .collect();
        let dim = columns.len();
        let skip = 300.min(u.len() / 10);
        let dot = |a: &[f64], b: &[f64]| a[skip..].iter().zip(&b[skip..]).map(|(a, b)| a * b).sum::<f64>();
        let mut g = vec![vec![0.0; dim + 1]; dim];
        for i in 0..dim {
            for j in 0..=i {
                g[i][j] = dot(&columns[i], &columns[j]);
                g[j][i] = g[i][j];
            }
            g[i][dim] = dot(&columns[i], y);
        }
        for i in 0..dim {
            g[i][i] *= 1.0 + 1e-9;
        }
        // Gaussian elimination of a positive definite matrix.
        for i in 0..dim {
            let pivot = g[i].clone();
            for k in i + 1..dim {
                let f = g[k][i] / pivot[i];
                for j in i..=dim {
                    g[k][j] -= f * pivot[j];
                }
            }
        }
        let mut c = vec![0.0; dim];
        for i in (0..dim).rev() {
            c[i] = (g[i][dim] - (i + 1..dim).map(|j| g[i][j] * c[j]).sum::<f64>()) / g[i][i];
        }
        let error = system.nonlinearity_error(grid, |x| row(x).iter().zip(&c).map(|(r, c)| r * c).sum());
        best = best.min(error);
    }
    best
}

fn main() -> flexure::Result<()> {
    let arg = |i: usize, d: f64| std::env::args().nth(i).and_then(|s| s.parse().ok()).unwrap_or(d);
    let mut method = RefinedHammerstein::default();
    let which = std::env::args().nth(1).unwrap_or_default();
    method.cost = [arg(3, 20.0), arg(4, 20.0), arg(5, 20.0)];
    method.verbose = std::env::var("VERBOSE").is_ok();
    let seeds = arg(2, 5.0) as u64;
    if which == "common" {
        for n in [10_000, 100_000, 1_000_000] {
            common(n, if n > 100_000 { 1 } else { seeds }, &method)?;
        }
        return Ok(());
    }
    let grid: Vec<f64> = (0..=400).map(|i| -1.9 + 3.8 * f64::from(i) / 400.0).collect();
    let snr = arg(6, 20.0);
    for (which, linear) in known_linear_parts().into_iter().enumerate() {
        for phi in KnownNonlinearity::ALL {
            let mut system = KnownHammerstein::usual(phi, linear.clone());
            system.snr_db = snr;
            let (mut ours, mut known, mut orders) = (vec![], vec![], vec![]);
            for seed in 1..=seeds {
                let record = system.simulate(20_000, seed);
                let result = method.identify(&record, "u", "y")?;
                ours.push(system.nonlinearity_error(&grid, |x| result.value(x)));
                orders.push(result.order);
                known.push(oracle(&system, record.column("u")?, record.column("y")?, &grid));
            }
            println!(
                "{which} {:<14} ours {:.4} ({:.4})  oracle {:.4} ({:.4}) ratio {:.2} ({:.2}) orders {orders:?}",
                phi.name(), median(&ours), worst(&ours), median(&known), worst(&known), median(&ours) / median(&known), worst(&ours)/worst(&known)
            );
        }
    }
    Ok(())
}
