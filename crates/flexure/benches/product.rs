//! The speed of kernel regression in two and three dimensions: `cargo bench -p flexure --bench product`.
//!
//! X is uniform on [-2, 2]^d, Y = sin(X_1) + X_2^2 + N(0, 0.1^2), the kernel is Epanechnikov's. Prints the processor
//! time in ms of one thread, the least of several batches of runs. An argument selects the jobs that contain it.

use std::hint::black_box;
use std::time::Instant;

use flexure::nonlinearity::{Bandwidth, Degree, Estimator, Kernel, KernelEstimator, Outside, Regression};
use flexure::selection::Criterion;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};

/// This thread's processor time, s, if the system measures it; otherwise the time of the clock.
fn processor_time(start: Instant) -> f64 {
    let stat = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let nanoseconds = stat.split_whitespace().next().and_then(|t| t.parse::<f64>().ok());
    nanoseconds.map_or_else(|| start.elapsed().as_secs_f64(), |t| t * 1e-9)
}

/// Times `run` and prints a row.
fn row(job: &str, d: usize, n: usize, mut run: impl FnMut()) {
    if std::env::args().nth(1).is_some_and(|part| !job.contains(&part)) {
        return;
    }
    let start = Instant::now();
    let (mut least, mut batches) = (f64::INFINITY, 0);
    // The system counts in ticks, so the batches are long enough for these not to matter.
    while batches < 3 || (start.elapsed().as_secs_f64() < 2.0 && batches < 20) {
        let (begin, mut runs) = (processor_time(start), 0);
        let mut taken = 0.0;
        while taken < 0.1 {
            run();
            runs += 1;
            taken = processor_time(start) - begin;
        }
        least = least.min(taken / f64::from(runs));
        batches += 1;
    }
    println!("| {job:<44} | {d} | {n:>7} | {:>10.2} |", least * 1e3);
}

/// Points of the job, column by column, and their ordinates.
fn points(n: usize, d: usize) -> (Vec<Vec<f64>>, Vec<f64>) {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(1);
    let x: Vec<Vec<f64>> = (0..d)
        .map(|_| (0..n).map(|_| rng.random_range(-2.0..2.0)).collect())
        .collect();
    let y = (0..n)
        .map(|i| {
            let e: f64 = StandardNormal.sample(&mut rng);
            x[0][i].sin() + x[1][i] * x[1][i] + 0.1 * e
        })
        .collect();
    (x, y)
}

fn slices(x: &[Vec<f64>]) -> Vec<&[f64]> {
    x.iter().map(Vec::as_slice).collect()
}

fn main() -> flexure::Result<()> {
    println!("| {:<44} | d | {:>7} | {:>10} |", "job", "n", "cpu ms");
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    match pool {
        Ok(pool) => pool.install(rows),
        Err(_) => rows(),
    }
}

fn rows() -> flexure::Result<()> {
    for (d, h) in [(2, 0.2), (3, 0.3)] {
        let (at, _) = points(1000, d);
        for n in [10_000, 100_000] {
            let (x, y) = points(n, d);
            let x = slices(&x);
            for degree in [Degree::Constant, Degree::Linear] {
                let method = KernelEstimator {
                    kernel: Kernel::Epanechnikov,
                    degree,
                    bandwidth: Bandwidth::Fixed(vec![h]),
                    outside: Outside::Nan,
                };
                row(&format!("fit and predict at 1000 points, {degree:?}"), d, n, || {
                    let fit = method.clone().fit(&x, &y, None);
                    black_box(fit.and_then(|fit| fit.predict(&slices(&at))).is_ok());
                });
                row(&format!("leave-one-out for one bandwidth, {degree:?}"), d, n, || {
                    black_box(method.score(Criterion::LeaveOneOut, &x, &y, None).is_ok());
                });
                let chosen = KernelEstimator {
                    bandwidth: Bandwidth::default(),
                    ..method.clone()
                };
                row(&format!("bandwidths by leave-one-out, {degree:?}"), d, n, || {
                    black_box(chosen.clone().fit(&x, &y, None).is_ok());
                });
            }
        }
    }
    Ok(())
}
