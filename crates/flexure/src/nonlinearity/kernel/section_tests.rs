use rand::{RngExt, SeedableRng};

use super::super::{Pyramid, Sorted, leave_one_out};
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

/// Two points a bin, about which the second moments say all that there is, beside the sums over the points.
#[test]
fn estimates_are_those_of_the_points_themselves() {
    let (bins, width) = (700, 0.01);
    let mut rng = rand_pcg::Pcg64::seed_from_u64(13);
    // The first bin's middle is the first point.
    let places = (0..bins).flat_map(|k| [f64::from(k), f64::from(k)]);
    let x = places.map(|k| k + rng.random_range(-0.49..0.49) * f64::from(u8::from(k > 0.0)));
    let [x, y] = noisy(x.map(|k| k * width).collect());
    let lattice = Lattice::new(&x, &y, width).unwrap();
    let mean = y.iter().sum::<f64>() / y.len() as f64;
    for h in [0.3, 0.307, 0.452, 0.5999] {
        let window = Window::new(Kernel::Epanechnikov, h, width);
        let section = Section::<3>::new(&lattice, SECTION);
        let (mut values, mut factors) = ([0.0; MIDDLES], [0.0; MIDDLES]);
        let parabola = |t: f64| [1.0 - t * t, 2.0 * t, -1.0];
        dispatch!(Level::new(), simd => section.constants(simd, window, parabola, (&mut values, &mut factors)));
        for (k, (value, factor)) in values.into_iter().zip(factors).enumerate() {
            let middle = (SECTION + k) as f64 - 1.0;
            let (mut s, mut t) = (0.0, 0.0);
            for (x, y) in x.iter().zip(&y) {
                let distance = ((x / width).round() - middle).abs();
                let u = (x - middle * width) / h;
                let reach = h / width;
                let weight = if distance <= reach - 0.5 {
                    1.0 - u * u
                } else if distance <= reach + 0.5 {
                    // The integral of K over the part in reach.
                    let of = |v: f64| v - v.powi(3) / (3.0 * reach * reach);
                    of(reach) - of(distance - 0.5)
                } else {
                    0.0
                };
                s += weight;
                // Of the bins at the ends the mean is taken.
                t += weight * (y - mean);
            }
            assert!((value - t / s).abs() < 1e-10, "{h} {k}: {value}, {}", t / s);
            assert!((factor - s / (s - 1.0)).abs() < 1e-10, "{h} {k}");
        }
    }
}

#[test]
fn scores_are_near_the_exact_ones() {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(14);
    let even: Vec<f64> = (0..40_000).map(|_| rng.random_range(-2.0..2.0)).collect();
    // Dense in the middle, then fewer and fewer, and far from one another in the end.
    let tails: Vec<f64> = (even.iter()).map(|u| (0.5 * u).atanh().clamp(-6.0, 6.0)).collect();
    // Nothing in the middle, and a few alone there.
    let gap: Vec<f64> = (even.iter().enumerate())
        .map(|(i, u)| if i % 10_000 == 7 { 0.3 * u } else { u + 0.7 * u.signum() })
        .collect();
    let rounded = |step: f64| -> Vec<f64> { even.iter().map(|u| (u / step).round() * step).collect() };
    let steps = [0.05, 0.0133, 0.003, 0.001].map(|step| (rounded(step), "rounded"));
    let others = [(even.clone(), "even"), (tails, "tails"), (gap, "gap")];
    for (x, name) in steps.into_iter().chain(others) {
        let [x, y] = noisy(x);
        let data = Sorted::new(&x, &y);
        let bandwidths = [0.02, 0.05, 0.08, 0.2, 0.45, 1.1];
        // With few values to a bin it matters for the uniform kernel in which a window ends.
        for kernel in KERNELS
            .into_iter()
            .filter(|kernel| name != "rounded" || *kernel != Kernel::Uniform)
        {
            let exact = leave_one_out(&data, kernel, Degree::Constant, &bandwidths);
            let pyramids = [
                Pyramid::scattered(&x, &y, 0.02, 1.1, 30.0),
                Pyramid::new(&data, 0.02, 1.1, 30.0),
            ];
            for pyramid in pyramids {
                let binned = pyramid.scores(kernel, Degree::Constant, &bandwidths);
                for ((binned, exact), h) in binned.iter().zip(&exact).zip(bandwidths) {
                    let most = if kernel == Kernel::Uniform { 1e-3 } else { 1e-4 };
                    let error = (binned / exact - 1.0).abs();
                    assert!(error < most, "{name} {kernel:?} {h}: {error}");
                }
            }
        }
    }
}

/// Of as many bins as fill a section, and of one more or less.
#[test]
fn sections_meet() {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(17);
    for bins in [255, 256, 257, 512, 513] {
        let x = (0..20_000).map(|_| rng.random_range(0.0..f64::from(bins) - 1.0));
        let [x, y] = noisy(x.map(|x| 0.01 * x).collect());
        let lattice = Lattice::new(&x, &y, 0.01).unwrap();
        assert!(lattice.len == bins as usize || lattice.len == bins as usize + 1);
        let bandwidths = [0.3, 0.42, 0.59];
        let exact = leave_one_out(
            &Sorted::new(&x, &y),
            Kernel::Epanechnikov,
            Degree::Constant,
            &bandwidths,
        );
        let binned = lattice.scores(Kernel::Epanechnikov, &bandwidths).unwrap();
        for (binned, exact) in binned.iter().zip(&exact) {
            assert!((binned / exact - 1.0).abs() < 1e-4, "{bins}: {binned} {exact}");
        }
    }
}

/// Single points among gaps, summed directly: whom nobody is in reach of is predicted by the nearest.
#[test]
fn points_alone_are_predicted_by_their_nearest() {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(18);
    let mut x: Vec<f64> = (0..5000).map(|_| rng.random_range(0.0..1.0)).collect();
    // Two by two nearest to one another, and two that see one another.
    x.extend([2.0, 2.2, 3.0, 3.3, 2.6, 2.604]);
    let [x, mut y] = noisy(x);
    y[5000..].copy_from_slice(&[9.0, -7.0, 4.0, 8.0, -6.0, 5.0]);
    let lattice = Lattice::new(&x, &y, 1e-3).unwrap();
    for kernel in KERNELS {
        for h in [0.03, 0.05] {
            let exact = leave_one_out(&Sorted::new(&x, &y), kernel, Degree::Constant, &[h])[0];
            let binned = lattice.scores(kernel, &[h]).unwrap()[0];
            let most = if kernel == Kernel::Uniform { 1e-3 } else { 1e-4 };
            assert!((binned / exact - 1.0).abs() < most, "{kernel:?} {h}: {binned} {exact}");
        }
    }
}

/// The bins are as good as exact in the second order of their width: four times better where half as wide, at least.
#[test]
fn errors_fall_with_the_square_of_the_width() {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(15);
    let [x, y] = noisy((0..100_000).map(|_| rng.random_range(-2.0..2.0)).collect());
    let bandwidths: Vec<f64> = (0..12).map(|k| 0.3 * 1.1_f64.powi(k)).collect();
    let exact = leave_one_out(&Sorted::new(&x, &y), Kernel::Biweight, Degree::Constant, &bandwidths);
    let error = |per_bandwidth: f64| {
        let pyramid = Pyramid::scattered(&x, &y, 0.3, 0.9, per_bandwidth);
        let binned = pyramid.scores(Kernel::Biweight, Degree::Constant, &bandwidths);
        let errors = binned
            .iter()
            .zip(&exact)
            .map(|(binned, exact)| (binned / exact - 1.0).powi(2));
        errors.sum::<f64>().sqrt()
    };
    let errors = [5.0, 10.0, 20.0].map(error);
    assert!(errors[0] > 4.0 * errors[1] && errors[1] > 4.0 * errors[2], "{errors:?}");
}

#[test]
fn threads_and_registers_change_no_bit() {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(16);
    let [x, y] = noisy((0..20_000).map(|_| rng.random_range(-2.0..2.0)).collect());
    let lattice = Lattice::new(&x, &y, 1e-3).unwrap();
    let bandwidths = [0.03, 0.04, 0.05];
    let scores = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| lattice.scores(Kernel::Epanechnikov, &bandwidths).unwrap())
    };
    assert_eq!(scores(1), scores(2));
    let section = Section::<3>::new(&lattice, 2 * SECTION);
    let parabola = |t: f64| [1.0 - t * t, 2.0 * t, -1.0];
    for h in bandwidths {
        let window = Window::new(Kernel::Epanechnikov, h, lattice.width);
        let squares = |level: Level| dispatch!(level, simd => section.squares(simd, window, parabola));
        assert_eq!(squares(Level::new()), squares(Level::baseline()));
    }
}

#[test]
fn what_has_other_sums_is_left_to_others() {
    let [x, y] = noisy((0..5000).map(|i| f64::from(i) * 1e-3).collect());
    let lattice = Lattice::new(&x, &y, 2e-3).unwrap();
    for kernel in Kernel::ALL {
        let scores = lattice.scores(kernel, &[0.1]);
        assert_eq!(scores.is_some(), KERNELS.contains(&kernel), "{kernel:?}");
    }
    // More bins in a window than there is room for.
    assert!(lattice.scores(Kernel::Epanechnikov, &[0.13]).is_none());
}
