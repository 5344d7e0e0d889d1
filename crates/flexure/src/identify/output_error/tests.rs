//! Fits in comparison with the truth, and the search for orders on simulated systems.

use std::ops::ControlFlow;

use super::super::block::{Monitor, Rational, Signals, convolved, linear_delays};

use super::fit::{Criterion, Start};
use super::held_back::{Errors, HeldBack};
use super::high_order::HighOrder;
use super::integrators as polynomials;
use super::limits::{LAST, TOLERATED_RATIO};
use super::search::drifts_alone;
use super::system::{LinearSystem, Numerator, Orders};
use super::{covariance, search};
use crate::linear::TransferFunction;
use crate::linear::correlation::variance;
use crate::signal::gaussian;
use crate::vectors::combined;

fn filtered(b: &[f64], a: &[f64], input: &[f64]) -> Vec<f64> {
    TransferFunction::new(b.to_vec(), a.to_vec()).unwrap().simulate(input)
}

fn orders(poles: usize, inputs: &[(usize, usize)]) -> Orders {
    let numerator = |&(delay, count): &(usize, usize)| Numerator { delay, count };
    Orders {
        poles,
        integrators: 0,
        inputs: inputs.iter().map(numerator).collect(),
    }
}

fn with_integrators(integrators: usize, poles: usize, inputs: &[(usize, usize)]) -> Orders {
    Orders {
        integrators,
        ..orders(poles, inputs)
    }
}

fn with_monitor<T>(run: impl FnOnce(&mut Monitor<'_>) -> T) -> T {
    let mut go_on = |_: &str| ControlFlow::Continue(());
    run(&mut Monitor::new(&mut go_on))
}

fn fitted(criterion: Criterion, orders: &Orders, data: &Signals) -> LinearSystem {
    with_monitor(|monitor| criterion.fitted(orders, data, Start::default(), LAST, monitor)).unwrap()
}

fn close(a: &[f64], b: &[f64], within: f64) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= within)
}

const A: [f64; 3] = [1.0, -1.5, 0.7];

/// Two inputs with delays 2 and 0, an offset, and a record that begins while the system rings.
fn two_inputs(n: usize, level: f64) -> Signals {
    let u = [gaussian(n + 200, 1), gaussian(n + 200, 2)];
    let first = filtered(&[0.0, 0.0, 1.0, 0.5], &A, &u[0]);
    let second = filtered(&[0.3], &A, &u[1]);
    let e = gaussian(n + 200, 3);
    let y: Vec<f64> = (200..n + 200)
        .map(|t| 0.7 + first[t] + second[t] + level * e[t])
        .collect();
    Signals::new(u.iter().map(|u| u[200..].to_vec()).collect(), y, 0)
}

#[test]
fn both_errors_find_an_exact_system_with_its_state_at_the_start() {
    let data = two_inputs(400, 0.0);
    for criterion in [Criterion::FreeRun, Criterion::Equation] {
        let system = fitted(criterion, &orders(2, &[(2, 2), (0, 1)]), &data);
        assert!(close(&system.polynomial(), &A, 1e-5), "{:?}", system.polynomial());
        assert!(
            close(&system.numerators[0], &[1.0, 0.5], 1e-4),
            "{:?}",
            system.numerators
        );
        assert!(close(&system.numerators[1], &[0.3], 1e-4) && (system.offset - 0.7).abs() < 1e-4);
        // From the first sample on, although inputs before it are not known.
        let worst = |skip: usize| {
            let errors = system.run(&data.u).into_iter().zip(&data.y).skip(skip);
            errors.map(|(p, y)| (p - y).abs()).fold(0.0, f64::max)
        };
        assert!(worst(3) < 1e-7, "{}", worst(3));
    }
}

#[test]
fn the_output_of_a_system_is_that_of_its_difference_equation() {
    let data = two_inputs(60, 0.0);
    let system = fitted(Criterion::FreeRun, &orders(2, &[(2, 2), (0, 1)]), &data);
    let (a, [b, c]) = (system.polynomial(), [&system.numerators[0], &system.numerators[1]]);
    let run = system.run(&data.u);
    for t in 4..60 {
        let dynamic = |k: usize| run[t - k] - system.offset;
        let driven = b[0] * data.u[0][t - 2] + b[1] * data.u[0][t - 3] + c[0] * data.u[1][t];
        assert!((dynamic(0) + a[1] * dynamic(1) + a[2] * dynamic(2) - driven).abs() < 1e-9);
    }
}

#[test]
fn orders_and_delays_are_those_of_the_system() {
    let data = two_inputs(1500, 0.3);
    assert_eq!(linear_delays(&data), [2, 0]);
    let found = with_monitor(|monitor| search(&data, monitor)).unwrap();
    let first = found.system.orders.inputs[0];
    assert_eq!(found.system.orders.poles, 2, "{:?}", found.system.orders);
    assert_eq!(first.delay, 2);
    assert_eq!(found.criterion, Criterion::FreeRun);
}

#[test]
fn no_pole_is_taken_for_a_delay_and_a_gain() {
    let u = gaussian(600, 4);
    let e = gaussian(600, 5);
    let y = (0..600)
        .map(|t| if t < 7 { 0.0 } else { 2.0 * u[t - 7] } + 0.2 * e[t])
        .collect();
    let found = with_monitor(|monitor| search(&Signals::of_input(u, y, 0), monitor)).unwrap();
    assert_eq!(found.system.orders, orders(0, &[(7, 1)]));
}

#[test]
fn standard_errors_cover_the_coefficients_under_coloured_noise() {
    let (n, runs) = (600, 100);
    let (mut inside, mut count) = (0, 0);
    for seed in 0..runs {
        let u = gaussian(n, 10 + seed);
        let colour = filtered(&[1.0], &[1.0, -0.9], &gaussian(n, 1000 + seed));
        let clean = filtered(&[1.0, 0.5], &A, &u);
        let y = clean.iter().zip(&colour).map(|(y, e)| y + 0.3 * e).collect();
        let data = Signals::of_input(u, y, 0);
        let system = fitted(Criterion::FreeRun, &orders(2, &[(0, 2)]), &data);
        let covariance = covariance(&system, &data).unwrap();
        let estimate = [&system.numerators[0][..], &system.polynomial()[1..]].concat();
        for (i, (estimate, truth)) in estimate.iter().zip([1.0, 0.5, -1.5, 0.7]).enumerate() {
            inside += usize::from((estimate - truth).abs() < 1.96 * covariance[i * 5].sqrt());
            count += 1;
        }
    }
    let share = inside as f64 / count as f64;
    assert!((0.92..0.98).contains(&share), "{share}");
}

#[test]
fn generalised_least_squares_make_the_first_response_several_times_more_exact() {
    let (b, a) = ([0.5, 0.2], [1.0, -1.2, 0.52]);
    let slow = |seed: u64| filtered(&[1.0], &[1.0, -0.95], &gaussian(1500, seed));
    let mut distance = [0.0; 2];
    for seed in 0..12 {
        let u = slow(2 * seed);
        let e = gaussian(1500, 2 * seed + 1);
        let e = filtered(&[1.0], &[1.0, -0.9], &e);
        let y = filtered(&b, &a, &u).iter().zip(&e).map(|(y, e)| y + e).collect();
        let data = Signals::of_input(u, y, 0);
        let least = fitted(Criterion::FreeRun, &orders(2, &[(0, 2)]), &data);
        let better = fitted(Criterion::Whitened, &orders(2, &[(0, 2)]), &data);
        for (sum, system) in distance.iter_mut().zip([&least, &better]) {
            let [b0, b1] = [system.numerators[0][0], system.numerators[0][1]];
            let second = b1 - system.polynomial()[1] * b0;
            *sum += (b0 - 0.5).powi(2) + (second - 0.8).powi(2);
        }
    }
    assert!(distance[1] < 0.5 * distance[0], "{distance:?}");
}

#[test]
fn a_system_without_enough_poles_is_not_as_good_and_one_with_too_many_is() {
    let data = two_inputs(1500, 0.3);
    let of = |poles: usize| {
        let orders = orders(poles, &[(2, 2), (0, 1)]);
        let system = fitted(Criterion::FreeRun, &orders, &data);
        with_monitor(|monitor| HeldBack::new(&orders, Criterion::FreeRun, &system, Start::default(), &data, monitor))
            .unwrap()
    };
    let [one, two, three] = [of(1), of(2), of(3)].map(|found| found.plain);
    let as_good = |a: &Errors, b: &Errors| a.as_good_as(b, TOLERATED_RATIO);
    assert!(!as_good(&one, &two) && as_good(&three, &two) && as_good(&two, &three));
}

/// Slow noise as large as the output without it: chance would decide between free runs that differ by a tenth of that.
#[test]
fn slow_noise_does_not_choose_the_dynamics() {
    let (b, a) = (&[0.0, 0.0, 1.0, 0.5], &[1.0, -1.1, 0.5]);
    let share = |v: &[f64], of: &[f64]| (variance(v) / variance(of)).sqrt();
    let mut right = 0;
    for seed in 0..4 {
        let u = gaussian(1500, 2 * seed);
        let x = filtered(b, a, &u);
        let noise = filtered(&[1.0], &[1.0, -0.98], &gaussian(1500, 2 * seed + 1));
        let scale = share(&x, &noise);
        let y = x.iter().zip(&noise).map(|(x, e)| x + scale * e).collect();
        let data = Signals::of_input(u, y, 0);
        let found = with_monitor(|monitor| search(&data, monitor)).unwrap();
        let run = found.system.run(&data.u);
        // The noise determines the state at the start, and so the first samples.
        let missed: Vec<f64> = x.iter().zip(&run).skip(100).map(|(x, p)| x - p).collect();
        let missed = share(&missed, &x);
        assert!(missed < 0.2, "seed {seed}: {missed}, {:?}", found.system.orders);
        right += usize::from(found.system.orders == orders(2, &[(2, 2)]) && missed < 0.05);
    }
    assert!(right >= 3, "{right}");
}

#[test]
fn a_system_of_high_order_knows_the_colour_of_the_noise() {
    let white = two_inputs(1500, 0.3);
    assert!(HighOrder::new(&white).is_none());
    let slow = filtered(&[1.0], &[1.0, -0.95], &gaussian(1500, 9));
    let y = white.y.iter().zip(&slow).map(|(y, e)| y + e).collect();
    let HighOrder { whitener, .. } = HighOrder::new(&Signals { y, ..white }).unwrap();
    let whitened = &convolved(&whitener, &slow)[whitener.len()..];
    // The noise at the output is larger: white noise of 0.3 is in it, too.
    assert!(variance(whitened) < 0.25 * variance(&slow), "{}", variance(whitened));
}

#[test]
fn a_slow_pole_whose_zeros_nearly_cancel_it_drifts_alone() {
    let longest = 0.999;
    // The denominator has the poles 0.5 and `slow`; every input's numerator has one zero.
    let of = |slow: f64, zeros: &[f64]| {
        let a = [1.0, -0.5 - slow, 0.5 * slow];
        let denominator = Rational::from_polynomials(vec![1.0], &a).unwrap();
        let numerators = zeros.iter().flat_map(|zero| [1.0, -zero]);
        let coefficients: Vec<f64> = numerators.chain([0.0; 3]).collect();
        LinearSystem::new(&orders(2, &vec![(0, 2); zeros.len()]), denominator, &coefficients)
    };
    assert!(drifts_alone(&of(0.9995, &[0.9992]), longest));
    assert!(drifts_alone(&of(0.9995, &[0.9992, 1.0001]), longest));
    // One input moves the pole; the pole decays within the record; nothing cancels it.
    assert!(!drifts_alone(&of(0.9995, &[0.9992, 0.3]), longest));
    assert!(!drifts_alone(&of(0.99, &[0.9992]), longest));
    assert!(!drifts_alone(&of(0.9995, &[-0.9992]), longest));
}

/// A force with a bias through d integrators and a lag: the output begins at 3 and moves at first.
fn integrating(d: usize, n: usize, level: f64) -> Signals {
    let u = gaussian(n, 21);
    let e = gaussian(n, 22);
    let force: Vec<f64> = u.iter().map(|u| u + 0.2).collect();
    let a = polynomials::with_integrators(&[1.0, -0.7], d);
    let clean = filtered(&[0.0, 0.1, 0.02], &a, &force);
    let y = (0..n).map(|t| 3.0 + 0.01 * t as f64 + clean[t] + level * e[t]);
    Signals::of_input(u, y.collect(), 0)
}

#[test]
fn the_terms_of_a_numerator_are_its_polynomial_behind_the_integrators() {
    let signal = gaussian(50, 30);
    let coefficients = [0.3, -1.2, 0.7, 0.4];
    for d in 0..=2 {
        let sum = combined(&polynomials::terms(&signal, d, 4), &coefficients);
        let b = polynomials::numerator_polynomial(&coefficients, d);
        let direct = filtered(&b, &polynomials::with_integrators(&[1.0], d), &signal);
        assert!(close(&sum, &direct, 1e-10), "{d}");
    }
}

#[test]
fn an_exact_integrating_system_is_found_with_its_bias() {
    for d in 1..=2 {
        let data = integrating(d, 300, 0.0);
        // The free run of a double integrator leaves a pole that is hardly visible among the long swings.
        for &criterion in if d == 1 {
            &[Criterion::FreeRun, Criterion::Equation][..]
        } else {
            &[Criterion::Equation]
        } {
            let system = fitted(criterion, &with_integrators(d, 1, &[(1, 2)]), &data);
            let a = polynomials::with_integrators(&[1.0, -0.7], d);
            assert!(close(&system.polynomial(), &a, 1e-5), "{:?}", system.polynomial());
            let numerator = &system.numerator_polynomials()[0];
            assert!(close(numerator, &[0.1, 0.02], 1e-5), "{numerator:?}");
            let gain = 0.12 / 0.3;
            let bias = polynomials::bias(*system.trend.last().unwrap(), d, gain);
            // With one integrator, the motion of 0.01 per sample is the same as the bias.
            let expected = if d == 1 { 0.2 + 0.01 / gain } else { 0.2 };
            assert!((bias - expected).abs() < 1e-3, "{bias} {expected}");
        }
    }
}

#[test]
fn integrators_are_found() {
    for (d, level) in [(1, 0.5), (2, 50.0)] {
        let found = with_monitor(|monitor| search(&integrating(d, 1200, level), monitor)).unwrap();
        assert_eq!(found.system.orders.integrators, d, "{:?}", found.system.orders);
    }
}

#[test]
fn standard_errors_of_an_integrating_system_cover_its_coefficients() {
    let (n, runs) = (500, 60);
    let truth = [0.1, 0.02, -1.7, 0.7];
    let (mut inside, mut count) = (0, 0);
    for seed in 0..runs {
        let u = gaussian(n, 300 + seed);
        let clean = filtered(&[0.0, 0.1, 0.02], &[1.0, -1.7, 0.7], &u);
        let y = clean
            .iter()
            .zip(gaussian(n, 700 + seed))
            .map(|(y, e)| y + 0.3 * e)
            .collect();
        let data = Signals::of_input(u, y, 0);
        let system = fitted(Criterion::FreeRun, &with_integrators(1, 1, &[(1, 2)]), &data);
        let covariance = covariance(&system, &data).unwrap();
        let estimate = [&system.numerator_polynomials()[0][..], &system.polynomial()[1..]].concat();
        for (i, (estimate, truth)) in estimate.iter().zip(truth).enumerate() {
            inside += usize::from((estimate - truth).abs() < 1.96 * covariance[i * 5].sqrt());
            count += 1;
        }
    }
    let share = f64::from(inside as u32) / f64::from(count as u32);
    assert!((0.91..0.99).contains(&share), "{share}");
}
