use rand::{RngExt, SeedableRng};

use super::super::leave_one_out;
use super::*;

const KERNELS: [Kernel; 3] = [Kernel::Uniform, Kernel::Epanechnikov, Kernel::Biweight];

fn noisy(x: Vec<f64>) -> [Vec<f64>; 2] {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(12);
    let y = x
        .iter()
        .map(|x| (3.0 * x).sin() + rng.random_range(-0.5..0.5))
        .collect();
    [x, y]
}

/// Beside what the points of every bin themselves say, at every level.
#[test]
fn bins_are_those_of_their_points() {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(11);
    let [x, y] = noisy((0..3000).map(|_| 1e3 + rng.random_range(-2.0..2.0)).collect());
    let data = Sorted::new(&x, &y, None);
    let width = 2e-3;
    let scales = BinnedScales::new(&data, width, 4.0, 1.0);
    assert!(scales.levels.len() > 8);
    for (level, bins) in scales.levels.iter().enumerate() {
        let mean = bins.data.mean;
        let mut first = 0;
        for bin in (0..bins.data.len()).map(|b| bins.bin(b)) {
            let count = bin.count as usize;
            let points = first..first + count;
            first += count;
            let means = [&data.x, &data.y].map(|v| v[points.clone()].iter().sum::<f64>() / bin.count);
            let product = |a: &[f64], b: &[f64], [ma, mb]: [f64; 2]| -> f64 {
                points.clone().map(|i| (a[i] - ma) * (b[i] - mb)).sum()
            };
            let width = width * 2f64.powi(level as i32);
            let close = |a: f64, b: f64, scale: f64| assert!((a - b).abs() <= 1e-9 * scale, "{level}: {a} {b}");
            assert!(data.x[points.end - 1] - data.x[points.start] <= 2.0 * width);
            close(bin.x, means[0], width);
            close(bin.y + mean, means[1], 1.0);
            close(
                bin.xx,
                product(&data.x, &data.x, [means[0]; 2]),
                bin.count * width.powi(2),
            );
            close(bin.xy, product(&data.x, &data.y, means), bin.count * width);
            close(bin.yy, product(&data.y, &data.y, [means[1]; 2]), bin.count);
        }
        assert_eq!(first, x.len());
    }
}

/// If columns are rounded to a step, many values lie on the bins' edges.
#[test]
fn rounded_abscissas_have_one_bin_each_at_most() {
    for (values, step, per_bandwidth) in [
        (3001, 0.001, 30.0),
        (1001, 0.01, 12.0),
        (1001, 0.01, 30.0),
        (361, 1.0, 30.0),
        (101, 0.1, 12.0),
    ] {
        let distinct: Vec<f64> = (0..values).map(|k| f64::from(k) * step).collect();
        let x: Vec<f64> = distinct.iter().flat_map(|&x| [x; 20]).collect();
        let data = Sorted::new(&x, &x, None);
        let extent = f64::from(values - 1) * step;
        let scales = BinnedScales::new(&data, 1e-4 * extent, extent, per_bandwidth);
        for bins in &scales.levels {
            // One more where the points' chunks meet.
            assert!(bins.data.len() <= distinct.len() + x.len() / CHUNK);
            let points: f64 = (0..bins.data.len()).map(|b| bins.data.weight(b)).sum();
            assert_eq!(points, x.len() as f64);
        }
    }
}

#[test]
fn scores_are_near_the_exact_ones() {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(14);
    let even: Vec<f64> = (0..40_000).map(|_| rng.random_range(-2.0..2.0)).collect();
    // Dense in the middle, then fewer and fewer, and far from one another in the end.
    let tails: Vec<f64> = (even.iter()).map(|u| (0.5 * u).atanh().clamp(-6.0, 6.0)).collect();
    // A gap in the middle, with a few single points in it.
    let gap: Vec<f64> = (even.iter().enumerate())
        .map(|(i, u)| if i % 10_000 == 7 { 0.3 * u } else { u + 0.7 * u.signum() })
        .collect();
    let rounded = |step: f64| -> Vec<f64> { even.iter().map(|u| (u / step).round() * step).collect() };
    let steps = [0.05, 0.0133, 0.003, 0.001].map(|step| (rounded(step), "rounded"));
    let others = [(even.clone(), "even"), (tails, "tails"), (gap, "gap")];
    for (x, name) in steps.into_iter().chain(others) {
        let [x, y] = noisy(x);
        let data = Sorted::new(&x, &y, None);
        let bandwidths = [0.02, 0.05, 0.08, 0.2, 0.45, 1.1];
        // With few values in a bin, the bin in which a window ends matters for the uniform kernel.
        for kernel in KERNELS
            .into_iter()
            .filter(|kernel| name != "rounded" || *kernel != Kernel::Uniform)
        {
            let exact = leave_one_out(&data, kernel, Degree::Constant, &bandwidths);
            let scales = BinnedScales::new(&data, 0.02, 1.1, 30.0);
            let binned = scales.scores(kernel, Degree::Constant, &bandwidths);
            for ((binned, exact), h) in binned.iter().zip(&exact).zip(bandwidths) {
                // A bin is in the uniform kernel's window as a whole or not at all.
                let most = if kernel == Kernel::Uniform { 3e-2 } else { 1e-3 };
                let error = (binned / exact - 1.0).abs();
                assert!(error < most, "{name} {kernel:?} {h}: {error}");
            }
        }
    }
}

/// Single points among gaps: a point that has no other in reach is predicted by the nearest one.
#[test]
fn points_alone_are_predicted_by_their_nearest() {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(18);
    let mut x: Vec<f64> = (0..5000).map(|_| rng.random_range(0.0..1.0)).collect();
    // Two by two nearest to one another, and two that see one another.
    x.extend([2.0, 2.2, 3.0, 3.3, 2.6, 2.604]);
    let [x, mut y] = noisy(x);
    y[5000..].copy_from_slice(&[9.0, -7.0, 4.0, 8.0, -6.0, 5.0]);
    let data = Sorted::new(&x, &y, None);
    for kernel in KERNELS {
        for h in [0.03, 0.05] {
            let exact = leave_one_out(&data, kernel, Degree::Constant, &[h])[0];
            let binned = BinnedScales::new(&data, h, h, 30.0).scores(kernel, Degree::Constant, &[h])[0];
            let most = if kernel == Kernel::Uniform { 1e-3 } else { 1e-4 };
            assert!((binned / exact - 1.0).abs() < most, "{kernel:?} {h}: {binned} {exact}");
        }
    }
}

/// The error is of second order in the width of the bins: sixteen times smaller with bins a quarter as wide.
#[test]
fn errors_fall_with_the_square_of_the_width() {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(15);
    let [x, y] = noisy((0..100_000).map(|_| rng.random_range(-2.0..2.0)).collect());
    let data = Sorted::new(&x, &y, None);
    let bandwidths: Vec<f64> = (0..12).map(|k| 0.3 * 1.1_f64.powi(k)).collect();
    let exact = leave_one_out(&data, Kernel::Biweight, Degree::Constant, &bandwidths);
    let error = |per_bandwidth: f64| {
        let scales = BinnedScales::new(&data, 0.3, 0.9, per_bandwidth);
        let binned = scales.scores(Kernel::Biweight, Degree::Constant, &bandwidths);
        let errors = binned
            .iter()
            .zip(&exact)
            .map(|(binned, exact)| (binned / exact - 1.0).powi(2));
        errors.sum::<f64>().sqrt()
    };
    let errors = [5.0, 10.0, 20.0].map(error);
    assert!(errors[0] > 2.0 * errors[1] && errors[1] > 2.0 * errors[2], "{errors:?}");
    assert!(errors[0] > 12.0 * errors[2], "{errors:?}");
}
