//! The speed of kernel regression: `cargo bench -p flexure --bench kernel`.
//!
//! The job is Y = deadzone(X) + N(0, 0.1^2), X uniform on [-2, 2]. Prints, for one and for two threads, wall and
//! processor time, each the least of several runs, and the process's peak memory while it ran (on Linux; with
//! the data themselves, 16 bytes a point). `KERNEL_BENCH_MOST` sets the largest number of points, 1e7;
//! `KERNEL_BENCH_ONLY` leaves only the jobs with this in their names.

use std::hint::black_box;
use std::time::{Duration, Instant};

use flexure::nonlinearity::{Degree, Kernel, KernelRegression};
use flexure::selection::{LeaveOneOut, Scoring};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};

/// The bandwidth of the rows with a fixed one.
const BANDWIDTH: f64 = 0.1;
/// The approximate time of a row, and its fewest runs.
const PATIENCE: Duration = Duration::from_millis(700);
const RUNS: usize = 3;

/// The time that all threads of the process have spent on a processor, s (NaN if the system does not report it).
fn processor_time() -> f64 {
    let spent = |task: std::io::Result<std::fs::DirEntry>| -> Option<f64> {
        let stat = std::fs::read_to_string(task.ok()?.path().join("schedstat")).ok()?;
        stat.split_whitespace().next()?.parse().ok()
    };
    let Ok(tasks) = std::fs::read_dir("/proc/self/task") else {
        return f64::NAN;
    };
    tasks.map(|task| spent(task).unwrap_or(f64::NAN)).sum::<f64>() * 1e-9
}

/// Starts the record of the peak memory anew.
fn forget_peak() {
    // Only Linux has such a record.
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

/// The peak memory, MB.
fn peak_memory() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kilobytes = peak.and_then(|peak| peak.split_whitespace().next()?.parse::<f64>().ok());
    kilobytes.unwrap_or(f64::NAN) * 1024e-6
}

/// Times `run` on one thread and on two, and prints a row.
fn row(pools: &[rayon::ThreadPool], job: &str, n: usize, run: impl Fn() -> bool + Sync) {
    if std::env::var("KERNEL_BENCH_ONLY").is_ok_and(|part| !job.contains(&part)) {
        return;
    }
    print!("| {job:<46} | {n:>8} |");
    for pool in pools {
        forget_peak();
        let (mut wall, mut processor) = (f64::INFINITY, f64::INFINITY);
        let start = Instant::now();
        let mut runs = 0;
        while runs < RUNS || (start.elapsed() < PATIENCE && runs < 2000) {
            let (begin, spent) = (Instant::now(), processor_time());
            assert!(black_box(pool.install(&run)), "{job} failed");
            wall = wall.min(begin.elapsed().as_secs_f64());
            processor = processor.min(processor_time() - spent);
            runs += 1;
        }
        print!(" {:>9.3} | {:>9.3} |", wall * 1e3, processor * 1e3);
    }
    println!(" {:>6.0} |", peak_memory());
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

fn main() -> Result<(), rayon::ThreadPoolBuildError> {
    // The time of a thread that has ended is lost, so all threads stay to the end.
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pools = [pool(1)?, pool(2)?];
    println!("Times in ms: wall and processor on one thread, wall and processor on two; peak memory in MB.");
    println!(
        "| {:<46} | {:>8} | {:>9} | {:>9} | {:>9} | {:>9} | {:>6} |",
        "job", "n", "wall 1", "cpu 1", "wall 2", "cpu 2", "MB"
    );
    let grid: Vec<f64> = (0..1000).map(|i| -2.0 + 4.0 * f64::from(i) / 999.0).collect();
    let twenty: Vec<f64> = (0..20).map(|i| 0.01 * 200f64.powf(f64::from(i) / 19.0)).collect();
    let most = std::env::var("KERNEL_BENCH_MOST").ok().and_then(|v| v.parse().ok());
    let sizes = [1_000, 10_000, 100_000, 1_000_000, 10_000_000];
    for n in sizes.into_iter().filter(|n| *n <= most.unwrap_or(10_000_000)) {
        let (x, y) = dead_zone(n);
        let method = KernelRegression {
            kernel: Kernel::Epanechnikov,
            bandwidth: BANDWIDTH,
        };
        let predicted = |degree, at: &[f64]| {
            let fit = method.fit(&x, &y);
            fit.map(|fit| fit.with_degree(degree).predict(at)).is_ok()
        };
        for (job, degree) in [
            ("fit (sort) and predict at 1000 points", Degree::Constant),
            ("the same, local line", Degree::Linear),
        ] {
            row(&pools, job, n, || predicted(degree, &grid));
        }
        row(&pools, "fit (sort) and predict at the data, local line", n, || {
            predicted(Degree::Linear, &x)
        });
        let search = |kernel, degree, scoring| LeaveOneOut {
            kernel,
            degree,
            scoring,
        };
        let (exact, binned) = (Scoring::Exact, Scoring::Binned);
        row(&pools, "exact leave-one-out, 20 bandwidths", n, || {
            let method = search(Kernel::Epanechnikov, Degree::Constant, exact);
            method.exact_scores(&x, &y, None, &twenty).is_ok()
        });
        for (job, kernel, degree, scoring) in [
            ("search, exact", Kernel::Epanechnikov, Degree::Constant, exact),
            (
                "search, binned, then checked",
                Kernel::Epanechnikov,
                Degree::Constant,
                binned,
            ),
            ("search, exact, local line", Kernel::Epanechnikov, Degree::Linear, exact),
            (
                "search, binned, local line",
                Kernel::Epanechnikov,
                Degree::Linear,
                binned,
            ),
            ("search, exact, triangular", Kernel::Triangular, Degree::Constant, exact),
            ("search, binned, Gaussian", Kernel::Gaussian, Degree::Constant, binned),
        ] {
            row(&pools, job, n, || {
                search(kernel, degree, scoring).search(&x, &y, None).is_ok()
            });
        }
    }
    Ok(())
}
