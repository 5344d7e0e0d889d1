use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::*;
use crate::linalg::{least_squares, solve_positive_definite};

fn normal(seed: u64) -> impl FnMut() -> f64 {
    let mut rng = Pcg64::seed_from_u64(seed);
    move || StandardNormal.sample(&mut rng)
}

/// A Hammerstein system of the second order driven by white noise.
fn samples(n: usize) -> Vec<(f64, f64)> {
    let mut draw = normal(1);
    let (mut w, mut y) = ([0.0; 2], [0.0; 2]);
    (0..n)
        .map(|_| {
            let u = draw();
            let next = 1.2 * y[0] - 0.5 * y[1] + 0.4 * w[0] + 0.3 * w[1] + 0.1 * draw();
            w = [u + 0.3 * u * u - 0.1 * u.powi(3), w[0]];
            y = [next, y[0]];
            (u, next)
        })
        .collect()
}

/// The same regression in one piece.
fn batch(data: &[(f64, f64)], order: usize, degree: usize, weight: impl Fn(usize) -> f64) -> Vec<f64> {
    let (mut rows, mut rhs, mut columns) = (Vec::new(), Vec::new(), 0);
    for k in order..data.len() {
        let root = weight(k).sqrt();
        let mut row: Vec<f64> = (1..=order).map(|j| -data[k - j].1).collect();
        for j in 0..=order {
            row.extend((1..=degree).map(|m| data[k - j].0.powi(m as i32)));
        }
        row.push(1.0);
        columns = row.len();
        rows.extend(row.iter().map(|v| v * root));
        rhs.push(data[k].1 * root);
    }
    least_squares(&rows, columns, &rhs).unwrap()
}

#[test]
fn without_forgetting_the_estimate_is_the_batch_one() {
    let data = samples(20_000);
    let mut model = RecursiveHammerstein::new(2, 0, 3, Memory::All).unwrap();
    data.iter().for_each(|&(u, y)| model.push(u, y));
    let got = model.coefficients().unwrap();
    for (got, expected) in got.iter().zip(batch(&data, 2, 3, |_| 1.0)) {
        assert!(
            (got - expected).abs() < 1e-9 * (1.0 + expected.abs()),
            "{got} {expected}"
        );
    }
    let HammersteinEstimate { a, b, powers, .. } = model.estimate().unwrap();
    let gain = b[1] / 0.4;
    assert!((a[1] + 1.2).abs() < 5e-3 && (a[2] - 0.5).abs() < 5e-3, "{a:?}");
    assert!((b[2] / gain - 0.3).abs() < 0.01 && b[0].abs() < 0.01, "{b:?}");
    for (got, expected) in powers.iter().zip([1.0, 0.3, -0.1]) {
        assert!((got * gain - expected).abs() < 0.01, "{powers:?}");
    }
}

/// A million samples, against the normal equations of all of them: another way to the batch estimate, and one that needs no memory.
#[test]
fn a_million_samples_give_the_batch_estimate() {
    const PARAMETERS: usize = 2 + 3 * 3 + 1;
    let data = samples(1_000_000);
    let mut model = RecursiveHammerstein::new(2, 0, 3, Memory::All).unwrap();
    data.iter().for_each(|&(u, y)| model.push(u, y));
    let (mut squares, mut products) = ([0.0; PARAMETERS * PARAMETERS], [0.0; PARAMETERS]);
    for k in 2..data.len() {
        let mut row = [1.0; PARAMETERS];
        (row[0], row[1]) = (-data[k - 1].1, -data[k - 2].1);
        for j in 0..3 {
            (0..3).for_each(|m| row[2 + 3 * j + m] = data[k - j].0.powi(1 + m as i32));
        }
        for a in 0..PARAMETERS {
            products[a] += row[a] * data[k].1;
            (0..PARAMETERS).for_each(|b| squares[PARAMETERS * a + b] += row[a] * row[b]);
        }
    }
    let batch = solve_positive_definite(&squares, &products).unwrap();
    for (got, expected) in model.coefficients().unwrap().iter().zip(batch) {
        assert!(
            (got - expected).abs() < 1e-9 * (1.0 + expected.abs()),
            "{got} {expected}"
        );
    }
}

#[test]
fn with_forgetting_the_estimate_is_the_weighted_batch_one() {
    let data = samples(2_000);
    let mut model = RecursiveArx::new(2, 0, Memory::Forgetting(0.99)).unwrap();
    data.iter().for_each(|&(u, y)| model.push(u, y));
    let (b, a, offset) = model.estimate().unwrap();
    let expected = batch(&data, 2, 1, |k| 0.99_f64.powi((1999 - k) as i32));
    let got = [&a[1..], &b, &[offset]].concat();
    for (got, expected) in got.iter().zip(expected) {
        assert!((got - expected).abs() < 1e-9, "{got} {expected}");
    }
}

#[test]
fn a_drifting_parameter_is_followed() {
    for memory in [Memory::Forgetting(0.98), Memory::Drift(1e-3)] {
        let mut draw = normal(3);
        let mut fit = LeastSquares::new(1, memory, 0.0).unwrap();
        for k in 0..5000 {
            let x = draw();
            let slope = if k < 2500 { 1.0 } else { 2.0 };
            fit.push(&[x], slope * x + 0.1 * draw());
        }
        assert!((fit.estimate().unwrap()[0] - 2.0).abs() < 0.05, "{memory:?}");
    }
}

#[test]
fn a_checkpoint_goes_on_as_if_nothing_had_happened() {
    let data = samples(600);
    let mut model = RecursiveHammerstein::new(2, 1, 2, Memory::Forgetting(0.999)).unwrap();
    let (first, second) = data.split_at(300);
    first.iter().for_each(|&(u, y)| model.push(u, y));
    let bytes = model.to_bytes();
    let mut again = RecursiveHammerstein::from_bytes(&bytes).unwrap();
    for &(u, y) in second {
        model.push(u, y);
        again.push(u, y);
    }
    assert_eq!(model.coefficients(), again.coefficients());
    // No other bytes are taken for a checkpoint, and none of them panics.
    for cut in 0..bytes.len() {
        assert!(RecursiveHammerstein::from_bytes(&bytes[..cut]).is_err(), "{cut}");
    }
    for place in 0..32 {
        let mut broken = bytes.clone();
        broken[place] ^= 0x55;
        let _ = RecursiveHammerstein::from_bytes(&broken);
    }
    let mut friction = RecursiveFriction::new(0.01, 0.01, Memory::All).unwrap();
    friction.push(1.0, 0.2);
    assert_eq!(RecursiveFriction::from_bytes(&friction.to_bytes()).unwrap(), friction);
    assert!(RecursiveFriction::from_bytes(&bytes).is_err());
    let mut detector = Cusum::new(0.5, 1.0, 1e4).unwrap();
    detector.push(0.7);
    assert_eq!(Cusum::from_bytes(&detector.to_bytes()).unwrap(), detector);
    assert!(Cusum::from_bytes(&bytes).is_err() && Cusum::from_bytes(&[0; 40]).is_err());
}

/// A joint whose Coulomb friction steps up: the estimate without forgetting, and the alarm of its innovations.
#[test]
fn a_step_of_friction_is_found_within_the_delay_of_theory() {
    let (mut draw, step, deviation) = (normal(5), 0.01, 0.2);
    let mut delays = Vec::new();
    for _ in 0..200 {
        let mut fit = RecursiveFriction::new(step, 0.01, Memory::All).unwrap();
        let mut detector = Cusum::new(deviation, 1.0, 1e6).unwrap();
        let change = 4000;
        for k in 0..5000 {
            // Back and forth, then only forwards.
            let at = |k: f64| (0.02 * k).sin() + 0.3 * (0.053 * k).sin() + if k < 3000.0 { 0.0 } else { 1.5 };
            let (before, velocity) = (at(k as f64 - 1.0), at(k as f64));
            let size = if k < change { 1.0 } else { 1.0 + deviation };
            let dry = 0.5 * size * ((before / 0.01).tanh() + (velocity / 0.01).tanh());
            let torque = 3.0 * (velocity - before) / step + dry + 0.25 * (velocity + before) + deviation * draw();
            let alarm = fit
                .push(torque, velocity)
                .filter(|_| k > 500)
                .and_then(|e| detector.push(e));
            if let Some(side) = alarm {
                assert!(k >= change && side == 1, "a false alarm at {k}");
                delays.push((k - change) as f64);
                break;
            }
        }
    }
    assert_eq!(delays.len(), 200);
    let mean = delays.iter().sum::<f64>() / 200.0;
    let theory = Cusum::new(deviation, 1.0, 1e6).unwrap().mean_delay();
    // The delay's standard deviation is about 11 samples; the estimate follows the change a little.
    assert!((mean - theory).abs() < 3.0, "{mean} {theory}");
}

#[test]
fn false_alarms_are_as_rare_as_theory_says() {
    let mut draw = normal(7);
    let mut detector = Cusum::new(1.0, 1.0, 1000.0).unwrap();
    let alarms = (0..1_000_000).filter(|_| detector.push(draw()).is_some()).count();
    // 1000 expected; Siegmund's approximation is good to a few percent, and the count to 3 %.
    assert!((850..1150).contains(&alarms), "{alarms}");
}

/// In a loop through noisy feedback, the system is estimated without bias.
#[test]
fn closed_loop_data_give_no_bias() {
    let mut draw = normal(9);
    let mut model = RecursiveArx::new(1, 1, Memory::All).unwrap();
    let (mut y, mut u) = (0.0, [0.0; 2]);
    for _ in 0..200_000 {
        y = 0.9 * y + 0.5 * u[0] + 0.1 * draw();
        // The reading and its answer within a sample; the excitation is far smaller than what the noise moves.
        let answer = -0.6 * y + 0.05 * draw();
        model.push(answer, y);
        u = [answer, u[0]];
    }
    let (b, a, _) = model.estimate().unwrap();
    assert!(
        (a[1] + 0.9).abs() < 5e-3 && (b[0] - 0.5).abs() < 5e-3 && b[1].abs() < 8e-3,
        "{a:?} {b:?}"
    );
}
