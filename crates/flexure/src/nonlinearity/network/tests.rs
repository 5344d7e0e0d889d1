use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::train::{descend, equations};
use super::*;
use crate::interrupt::Interrupt;
use crate::selection::Criterion;

/// Uniform columns on [-2, 2] and noise of deviation 1.
fn draws(n: usize, d: usize, seed: u64) -> (Vec<Vec<f64>>, Vec<f64>) {
    let mut rng = Pcg64::seed_from_u64(seed);
    let x = (0..d)
        .map(|_| (0..n).map(|_| rng.random_range(-2.0..2.0)).collect())
        .collect();
    (x, (0..n).map(|_| StandardNormal.sample(&mut rng)).collect())
}

fn dead_zone(x: f64) -> f64 {
    x - x.clamp(-0.5, 0.7)
}

fn fixed(units: usize, decay: f64) -> NetworkRegression {
    NetworkRegression {
        units: Choice::Fixed(units),
        decay: Decay::Fixed(decay),
        ..Default::default()
    }
}

fn rms(errors: impl ExactSizeIterator<Item = f64>) -> f64 {
    let n = errors.len() as f64;
    (errors.map(|e| e * e).sum::<f64>() / n).sqrt()
}

#[test]
fn functions_are_recovered_to_a_fraction_of_the_noise() {
    // With about 12 effective parameters, n = 600 and noise 0.1 the error is 0.1 sqrt(12/600) = 0.014.
    let (n, noise) = (600, 0.1);
    let grid: Vec<f64> = (0..300).map(|i| -1.95 + 3.9 * f64::from(i) / 299.0).collect();
    for m in [|x: f64| (3.0 * x).sin(), dead_zone] {
        let (x, e) = draws(n, 1, 11);
        let y: Vec<f64> = x[0].iter().zip(&e).map(|(x, e)| m(*x) + noise * e).collect();
        let fit = NetworkRegression::default().fit(&[&x[0]], &y, None).unwrap();
        let got = fit.predict(&[&grid]).unwrap();
        let error = rms(got.iter().zip(&grid).map(|(g, x)| g - m(*x)));
        assert!(error < 0.3 * noise, "{error} {fit:?}");
        // What LOO says is the noise's variance and that error's.
        let score = fit.search().unwrap().curve.iter().map(|c| c.leave_one_out);
        let best = score.fold(f64::INFINITY, f64::min);
        assert!((best.sqrt() / noise - 1.0).abs() < 0.1, "{best}");
    }
}

#[test]
fn a_product_of_two_variables_is_recovered_and_an_idle_column_ignored() {
    let (x, e) = draws(1000, 3, 5);
    let m = |x: f64, z: f64| 0.25 * x * z;
    let y: Vec<f64> = (0..1000).map(|i| m(x[0][i], x[1][i]) + 0.1 * e[i]).collect();
    let method = NetworkRegression {
        units: Choice::Fixed(5),
        outside: Outside::Nearest,
        ..Default::default()
    };
    let columns: Vec<&[f64]> = x.iter().map(Vec::as_slice).collect();
    let fit = method.fit(&columns, &y, None).unwrap();
    let (q, _) = draws(500, 3, 6);
    let got = fit.predict(&[&q[0], &q[1], &q[2]]).unwrap();
    let error = rms((0..500).map(|i| got[i] - m(q[0][i], q[1][i])));
    assert!(error < 0.3 * 0.1, "{error} {fit:?}");
    let other = fit.predict(&[&q[0], &q[1], &[1.9; 500]]).unwrap();
    let change = rms((0..500).map(|i| got[i] - other[i]));
    assert!(change < 0.3 * 0.1, "{change}");
}

/// Data and a start; also in scripts/reference/network.py.
fn reference(d: usize, units: usize) -> (Sample, Layer, Vec<f64>) {
    let n = 120;
    let i = |k: usize| k as f64;
    let z: Vec<Vec<f64>> = (0..d)
        .map(|j| (0..n).map(|k| ((37 + 16 * j) * k % 101) as f64 / 50.0 - 1.0).collect())
        .collect();
    let u = (0..n)
        .map(|k| (3.0 * z[0][k]).sin() + z[d - 1][k].powi(2) + 0.3 * (12.9898 * i(k)).sin())
        .collect();
    let w: Vec<f64> = (0..n).map(|k| (1 + k % 3) as f64).collect();
    let layer = Layer { inputs: d, units };
    let theta = (0..layer.parameters()).map(|p| (2.3 * i(p) + 1.3).sin()).collect();
    let total = w.iter().sum();
    let sample = Sample {
        z,
        u,
        w,
        total,
        interrupt: Interrupt::default(),
    };
    (sample, layer, theta)
}

#[test]
fn the_sum_of_squares_and_its_gradient() {
    let (sample, layer, theta) = reference(2, 4);
    let decay = 0.3;
    let cost = |theta: &[f64]| equations(&sample, layer, theta, decay).cost;
    let by_hand: f64 = (0..120)
        .map(|i| sample.w[i] * (sample.u[i] - layer.value(&theta, &sample.point(i))).powi(2))
        .sum::<f64>()
        + decay * theta[1..].iter().map(|t| t * t).sum::<f64>();
    assert!((cost(&theta) - by_hand).abs() < 1e-11 * by_hand);
    let descent = equations(&sample, layer, &theta, decay).descent;
    for p in 0..theta.len() {
        let moved = |s: f64| {
            let mut theta = theta.clone();
            theta[p] += s;
            cost(&theta)
        };
        let difference = (moved(1e-5) - moved(-1e-5)) / 2e-5;
        assert!(
            (-2.0 * descent[p] - difference).abs() < 1e-6 * (1.0 + difference.abs()),
            "{p}"
        );
    }
}

#[test]
fn scipy_ends_in_the_same_minima() {
    // scripts/reference/network.py
    for (d, units, decay, want) in REFERENCE {
        let (sample, layer, theta) = reference(d, units);
        let end = descend(&sample, layer, theta, decay, 2000).unwrap();
        let error = end.equations.cost / want - 1.0;
        assert!(error.abs() < 1e-8, "{d} {units} {decay}: {} {want}", end.equations.cost);
        // A minimum: the gradient vanishes.
        let steepest = end.equations.descent.iter().fold(0.0_f64, |m, g| m.max(g.abs()));
        assert!(steepest < 1e-4, "{steepest}");
    }
}

const REFERENCE: [(usize, usize, f64, f64); 4] = [
    (1, 2, 0.01, 10.168966596299285),
    (1, 4, 0.1, 11.745967425551061),
    (2, 3, 0.05, 12.63516133091645),
    (2, 5, 1.0, 30.314929749227655),
];

#[test]
fn units_and_offsets_of_every_column_do_not_matter() {
    let (x, e) = draws(150, 2, 3);
    let y: Vec<f64> = (0..150).map(|i| dead_zone(x[0][i]) * x[1][i] + 0.1 * e[i]).collect();
    let map = |v: &[f64], gain: f64, offset: f64| v.iter().map(|v| gain * v + offset).collect::<Vec<_>>();
    let at = [[0.3, -1.0, 1.2], [0.1, 1.5, -0.4]];
    let want = fixed(4, 0.02).fit(&[&x[0], &x[1]], &y, None).unwrap();
    let want = want.predict(&[&at[0], &at[1]]).unwrap();
    let moved = [map(&x[0], 1e4, -7e5), map(&x[1], 1e-5, 2.0)];
    let fit = fixed(4, 0.02)
        .fit(&[&moved[0], &moved[1]], &map(&y, -30.0, 500.0), None)
        .unwrap();
    let got = fit
        .predict(&[&map(&at[0], 1e4, -7e5), &map(&at[1], 1e-5, 2.0)])
        .unwrap();
    for (g, w) in got.iter().zip(&want) {
        assert!(((g - 500.0) / -30.0 - w).abs() < 1e-5, "{got:?} {want:?}");
    }
}

#[test]
fn a_constant_and_few_points_give_something_finite() {
    let x = [0.0, 1.0, 2.0, 3.0, 4.0];
    for units in [
        Choice::Fixed(7),
        Choice::default(),
        Choice::FromData(Criterion::Generalized),
    ] {
        let method = NetworkRegression {
            units,
            outside: Outside::Linear,
            ..Default::default()
        };
        let constant = method.fit(&[&x], &[0.1; 5], None).unwrap();
        for v in constant.predict(&[&[0.5, 4.0, 900.0]]).unwrap() {
            assert!((v - 0.1).abs() < 1e-12, "{v}");
        }
        for n in 1..=5 {
            let fit = method
                .fit(&[&x[..n], &[3.0; 5][..n]], &[1.0, 5.0, 2.0, 8.0, -1.0][..n], None)
                .unwrap();
            let got = fit.predict(&[&[0.0, 1.5, 4.0, 1e9], &[3.0, 3.0, 3.0, 3.1]]).unwrap();
            assert!(got.iter().all(|v| v.is_finite()), "{n}: {got:?}");
            assert!(
                (1.0 - 1e-9..=1.0 + 7.0 * 4.0).contains(&fit.degrees_of_freedom()),
                "{fit:?}"
            );
        }
    }
}

#[test]
fn the_linearised_leave_one_out_score_is_near_that_of_refits() {
    let (x, e) = draws(60, 1, 9);
    let w: Vec<f64> = (0..60).map(|i| f64::from(1 + i % 2)).collect();
    let y: Vec<f64> = x[0].iter().zip(&e).map(|(x, e)| x.tanh() + 0.1 * e).collect();
    // The scales must not change from refit to refit: the definition with those of all points.
    let points = Points::new("a test", 1, &[&x[0]], &y, Some(&w)).unwrap();
    let Standardised { sample, output, .. } = Sample::standardised(&points);
    let layer = Layer { inputs: 1, units: 2 };
    let all = train(&sample, layer, Decay::Fixed(0.05), 3, 1).unwrap();
    let score = all.score(&sample, output.scale);
    let mut want = 0.0;
    for i in 0..60 {
        let mut others = sample.clone();
        others.w[i] = 0.0;
        let end = descend(&others, layer, all.theta.clone(), 0.05, 500).unwrap();
        let left = sample.u[i] - layer.value(&end.parameters, &sample.point(i));
        want += sample.w[i] * (output.scale * left).powi(2) / sample.total;
    }
    let got = score.leave_one_out;
    assert!((got / want - 1.0).abs() < 0.03, "{got} {want}");
    // Far from the plain residuals, which a wrong leverage would give.
    let plain = score.generalized * (1.0 - score.degrees_of_freedom / 60.0).powi(2);
    assert!(plain < 0.9 * want, "{plain} {want}");
}

#[test]
fn the_evidence_distinguishes_noise_from_signal() {
    let (x, e) = draws(400, 1, 2);
    let method = NetworkRegression {
        units: Choice::Fixed(8),
        ..Default::default()
    };
    let noise = method.fit(&[&x[0]], &e, None).unwrap();
    // Far from the 25 parameters.
    assert!(noise.degrees_of_freedom() < 12.0, "{noise:?}");
    let y: Vec<f64> = x[0].iter().map(|x| (3.0 * x).sin()).collect();
    let signal = method.fit(&[&x[0]], &y, None).unwrap();
    assert!(
        signal.degrees_of_freedom() > 12.0 && signal.decay() < 1e-4,
        "{signal:?}"
    );
}

#[test]
fn neither_threads_nor_order_matter_for_many_points() {
    let (x, e) = draws(9000, 2, 4);
    let y: Vec<f64> = (0..9000)
        .map(|i| dead_zone(x[0][i]) + x[1][i].abs() + 0.1 * e[i])
        .collect();
    let method = NetworkRegression {
        units: Choice::Fixed(4),
        starts: 2,
        ..Default::default()
    };
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let one = pool(1).install(|| method.fit(&[&x[0], &x[1]], &y, None).unwrap());
    assert_eq!(one, pool(2).install(|| method.fit(&[&x[0], &x[1]], &y, None).unwrap()));
    let turned = |v: &[f64]| v.iter().rev().copied().collect::<Vec<_>>();
    assert_eq!(
        one,
        method
            .fit(&[&turned(&x[0]), &turned(&x[1])], &turned(&y), None)
            .unwrap()
    );
    let got = one.predict(&[&[0.0, 1.5], &[1.0, -1.0]]).unwrap();
    assert!((got[0] - 1.0).abs() < 0.15 && (got[1] - 1.8).abs() < 0.15, "{got:?}");
}

#[test]
fn beyond_the_ranges_the_gradient_goes_on() {
    let (x, e) = draws(200, 2, 8);
    let y: Vec<f64> = (0..200).map(|i| x[0][i].sin() + 0.5 * x[1][i] + 0.05 * e[i]).collect();
    let with = |outside| {
        let method = NetworkRegression {
            outside,
            ..fixed(3, 0.01)
        };
        method.fit(&[&x[0], &x[1]], &y, None).unwrap()
    };
    let end = x[0].iter().copied().fold(f64::MIN, f64::max);
    let at = |fit: &NetworkFit, a: f64| fit.predict(&[&[a], &[0.3]]).unwrap()[0];
    let linear = with(Outside::Linear);
    let step = 1e-5;
    let slope = (at(&linear, end) - at(&linear, end - step)) / step;
    assert!((at(&linear, end + 2.0) - at(&linear, end) - 2.0 * slope).abs() < 1e-3);
    assert_eq!(at(&with(Outside::Nearest), end + 2.0), at(&linear, end));
    assert!(at(&with(Outside::Nan), end + 2.0).is_nan());
    assert!(linear.predict(&[&[0.0], &[f64::NAN]]).unwrap()[0].is_nan());
}

#[test]
fn bad_parameters_are_named() {
    let x = [0.0, 1.0, 2.0];
    let says = |method: NetworkRegression, message: &str| {
        let error = method.fit(&[&x], &x, None).unwrap_err().to_string();
        assert!(error.contains(message), "{error}");
    };
    says(fixed(0, 1.0), "the number of units is 0, but must be between 1 and 64");
    says(fixed(65, 1.0), "the number of units is 65");
    says(fixed(2, f64::NAN), "the decay is NaN, but must be positive and finite");
    says(fixed(2, 0.0), "the decay is 0");
    for starts in [0, 101] {
        let method = NetworkRegression {
            starts,
            ..fixed(2, 1.0)
        };
        says(
            method,
            &format!("the number of starts is {starts}, but must be between 1 and 100"),
        );
    }
    let seven = fixed(2, 1.0).fit(&[&x[..]; 7], &x, None).unwrap_err().to_string();
    assert_eq!(seven, "a neural network takes 1 to 6 columns, but 7 were given");
    let huge = fixed(2, 1.0)
        .fit(&[&x], &[1e200, 2e200, 1.0], None)
        .unwrap_err()
        .to_string();
    assert!(huge.contains("column 'y' reach 2e200"), "{huge}");
}
