//! The speed of kernel regression: `cargo bench -p flexure --bench kernel`.
//!
//! The job is Y = deadzone(X) + N(0, 0.1^2), X uniform on [-2, 2]. Prints wall and processor time, each the
//! least of several runs, at the number of threads that `RAYON_NUM_THREADS` asks for.

use std::hint::black_box;
use std::time::Instant;

use flexure::nonlinearity::{Degree, Kernel, KernelRegression};
use flexure::selection::BandwidthSearch;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};

/// The process's processor time, s (where the system tells it).
fn processor_time() -> f64 {
    let ticks = |stat: &str| -> Option<f64> {
        // The fields after the command's name, which is in parentheses; the 12th and 13th are the times.
        let fields: Vec<&str> = stat.rsplit(')').next()?.split_whitespace().collect();
        Some(fields.get(11)?.parse::<f64>().ok()? + fields.get(12)?.parse::<f64>().ok()?)
    };
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    ticks(&stat).map_or(f64::NAN, |t| t / 100.0)
}

/// Times `run` for a second or so and prints a row: the least wall time, the mean processor time.
fn row(job: &str, n: usize, mut run: impl FnMut()) {
    let (start, processor) = (Instant::now(), processor_time());
    let (mut least, mut runs) = (f64::INFINITY, 0);
    while runs < 3 || (start.elapsed().as_secs_f64() < 1.0 && runs < 1000) {
        let begin = Instant::now();
        run();
        least = least.min(begin.elapsed().as_secs_f64());
        runs += 1;
    }
    let processor = (processor_time() - processor) / f64::from(runs);
    println!(
        "| {job:<46} | {n:>8} | {:>10.3} | {:>10.2} |",
        least * 1e3,
        processor * 1e3
    );
}

/// The points of the job.
fn dead_zone(n: usize) -> (Vec<f64>, Vec<f64>) {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(1);
    let x: Vec<f64> = (0..n).map(|_| rng.random_range(-2.0..2.0)).collect();
    let y = x
        .iter()
        .map(|&x: &f64| {
            let e: f64 = StandardNormal.sample(&mut rng);
            (x - 0.7).max(0.0) + (x + 0.5).min(0.0) + 0.1 * e
        })
        .collect();
    (x, y)
}

fn main() -> flexure::Result<()> {
    println!("| {:<46} | {:>8} | {:>10} | {:>10} |", "job", "n", "wall ms", "cpu ms");
    let grid: Vec<f64> = (0..1000).map(|i| -2.0 + 4.0 * f64::from(i) / 999.0).collect();
    let most = std::env::var("KERNEL_BENCH_MOST")
        .ok()
        .and_then(|v| v.parse().ok())
        .unwrap_or(1_000_000);
    for n in [10_000, 100_000, 1_000_000, 10_000_000] {
        if n > most {
            break;
        }
        let (x, y) = dead_zone(n);
        let method = KernelRegression {
            kernel: Kernel::Epanechnikov,
            bandwidth: 0.1,
        };
        row("fit (sort) and predict on 1000 points", n, || {
            black_box(method.fit(&x, &y).map(|fit| fit.predict(&grid)).is_ok());
        });
        row("evaluate in one pass at 1000 points", n, || {
            black_box(method.evaluate(Degree::Constant, &x, &y, None, &grid).is_ok());
        });
        row("the same, local line", n, || {
            black_box(method.evaluate(Degree::Linear, &x, &y, None, &grid).is_ok());
        });
        row("bandwidth by leave-one-out, 26 candidates", n, || {
            black_box(BandwidthSearch::leave_one_out(Kernel::Epanechnikov, &x, &y).is_ok());
        });
    }
    Ok(())
}
