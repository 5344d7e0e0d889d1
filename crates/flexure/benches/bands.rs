//! The speed of confidence bands: `cargo bench -p flexure --bench bands`.
//!
//! Y = cos X + N(0, 0.2^2), X uniform on [-2, 2]; bands at 200 points. Prints the least wall time of several runs, at the
//! number of threads that `RAYON_NUM_THREADS` asks for.

use std::hint::black_box;
use std::time::Instant;

use flexure::bands::{BandKind, RobustBand};
use flexure::nonlinearity::{Degree, Kernel, KernelRegression};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};

fn main() -> flexure::Result<()> {
    println!(
        "| {:<12} | h    | {:<12} | {:>9} | {:>8} |",
        "kernel", "band", "n", "ms"
    );
    let at: Vec<f64> = (0..200).map(|i| -2.0 + 4.0 * f64::from(i) / 199.0).collect();
    for n in [10_000, 100_000, 1_000_000] {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(1);
        let point = |_| {
            let (x, e): (f64, f64) = (rng.random_range(-2.0..2.0), StandardNormal.sample(&mut rng));
            (x, x.cos() + 0.2 * e)
        };
        let (x, y): (Vec<f64>, Vec<f64>) = (0..n).map(point).unzip();
        for (kernel, bandwidth) in [
            (Kernel::Epanechnikov, 0.1),
            (Kernel::Epanechnikov, 0.5),
            (Kernel::Gaussian, 0.05),
        ] {
            let fit = KernelRegression { kernel, bandwidth }
                .fit(&x, &y)?
                .with_degree(Degree::Linear);
            for kind in [BandKind::Pointwise, BandKind::Simultaneous] {
                let method = RobustBand {
                    kind,
                    ..RobustBand::default()
                };
                let mut least = f64::INFINITY;
                for _ in 0..5 {
                    let start = Instant::now();
                    black_box(method.for_kernel(&fit, &at)?);
                    least = least.min(start.elapsed().as_secs_f64());
                }
                println!(
                    "| {:<12} | {bandwidth:<4} | {kind:<12?} | {n:>9} | {:>8.1} |",
                    kernel.name(),
                    1e3 * least
                );
            }
        }
    }
    Ok(())
}
