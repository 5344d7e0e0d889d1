//! The derivatives against differences.

use rand::{RngExt, SeedableRng};

use super::super::rational::Section;
use super::super::spline::Kink;
use super::super::system::Between;
use super::*;
use crate::identify::derivative_tests::assert_derivatives;
use crate::linear::Complex;

fn noise(n: usize, seed: u64) -> Vec<f64> {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
    (0..n).map(|_| rng.random_range(-2.0..2.0)).collect()
}

fn spline(breakpoints: &[f64], c: &[f64], kinks: &[(f64, f64)]) -> KinkedSpline {
    let mut spline = KinkedSpline::new(breakpoints);
    spline.c.copy_from_slice(c);
    spline.kinks = kinks.iter().map(|&(at, bend)| Kink { at, bend }).collect();
    spline
}

fn cascade(constants: bool) -> Branch {
    let pair = |a1, a2| Section { a: [a1, a2], order: 2 };
    let single = |a1| Section { a: [a1, 0.0], order: 1 };
    let front = Rational {
        b: vec![0.3, 0.1, -0.05],
        sections: vec![pair(-1.2, 0.6), single(0.4)],
    };
    let back = Rational {
        b: if constants { vec![0.4, 1.0] } else { vec![1.0, -1.0] },
        sections: vec![single(-0.7), pair(0.3, 0.2)],
    };
    let spline = spline(
        &[-2.0, -0.7, 0.0, 0.4, 1.5],
        &[-1.0, -0.9, -0.2, 0.1, 0.6, 0.5, 0.9],
        &[(-0.31, 0.4), (0.23, -0.7)],
    );
    Branch {
        offset: 0.2,
        ..Branch::new(front, spline, back)
    }
}

/// The same with an instant between the samples, whose numerators are longer than the others.
fn with_instant(constants: bool) -> Branch {
    Branch {
        between: Some(Between {
            front: vec![0.1, 0.2, 0.05, 0.1],
            back: vec![0.3, if constants { 0.2 } else { -0.3 }, 0.0],
        }),
        ..cascade(constants)
    }
}

/// Asserts the number of free parameters, that all parameters come back, and every derivative.
fn check(system: System, data: &Signals, free: usize) {
    assert_eq!(system.with(&system.parameters()), system);
    let loss = Loss::new(system.clone(), data);
    let p = loss.start();
    assert_eq!(p.len(), free);
    assert_eq!(loss.system(&p), system);
    let Linearisation { residuals, jacobian } = loss.linearise(&p);
    assert_eq!(residuals, loss.residuals(&p).unwrap());
    assert_derivatives(&p, &jacobian, |p| loss.residuals(p).unwrap());
}

#[test]
fn every_derivative_of_a_cascade_agrees_with_a_difference() {
    let data = Signals::of_input(noise(200, 1), noise(200, 2), 20);
    for (constants, between) in [(true, false), (false, false), (true, true), (false, true)] {
        let branch = if between {
            with_instant(constants)
        } else {
            cascade(constants)
        };
        // 3 + 3 of the front, 7 coefficients, two kinks, 2 + 3 of the back minus the one that fixes the scale.
        let free = 3 + 3 + 7 + 4 + 2 + 3 - 1 + if between { 4 + 3 } else { 0 } + usize::from(!constants);
        check(System::sum(vec![branch]), &data, free);
    }
}

#[test]
fn every_derivative_of_a_sum_agrees_and_a_gain_in_front_is_not_free() {
    let data = Signals::of_input(noise(200, 1), noise(200, 2), 20);
    let branch = |front: &[f64], back: &[f64], c: &[f64]| {
        let linear = |poles: &[f64]| {
            let poles: Vec<Complex<f64>> = poles.iter().map(|p| Complex::new(*p, 0.0)).collect();
            Rational::from_roots(&[], &poles)
        };
        Branch::new(linear(front), spline(&[-1.0, 0.1, 1.2], c, &[]), linear(back))
    };
    let branches = vec![
        branch(&[0.6], &[0.3, -0.4], &[0.1, -0.5, 0.3, 0.8, 0.2]),
        branch(&[], &[0.7], &[0.4, 0.1, -0.3, 1.0, 0.5]),
    ];
    // Front, nonlinearity, back; the second branch without a front and a level. The backs' numerators are only scales.
    check(System::sum(branches), &data, (2 + 5 + 2) + (4 + 1));
}

/// Two inputs, with or without a last nonlinearity.
fn of_two_inputs(last: bool) -> System {
    let pole = |re, im| Complex::new(re, im);
    let [zeros, poles] = [
        [pole(0.4, 0.0)].to_vec(),
        [pole(0.5, 0.3), pole(0.5, -0.3), pole(0.2, 0.0)].to_vec(),
    ];
    let first = spline(&[-1.0, 0.2, 1.0], &[0.1, -0.5, 0.3, 0.8, 0.2], &[(0.31, -0.6)]);
    let second = spline(&[-1.2, 1.2], &[0.4, 0.1, -0.3, 1.0], &[]);
    let output = spline(
        &[-1.0, 0.0, 0.5, 2.0],
        &[-1.0, -0.8, 0.1, 0.9, 1.0, 0.7],
        &[(-0.4, 0.5), (0.21, 0.3)],
    );
    System {
        branches: vec![
            Branch {
                offset: 0.2,
                ..Branch::new(Rational::pass(), first, Rational::from_roots(&zeros, &poles))
            },
            Branch {
                input: 1,
                delay: 3,
                ..Branch::new(Rational::pass(), second, Rational::from_roots(&[], &[pole(0.6, 0.0)]))
            },
        ],
        output: last.then_some(output),
        level: Level::Offset,
    }
}

#[test]
fn every_derivative_of_a_system_of_two_inputs_agrees_with_a_difference() {
    let data = Signals::new(vec![noise(200, 1), noise(200, 2)], noise(200, 3), 20);
    for last in [false, true] {
        let free = (5 + 2 + 2 + 3 - 2) + (4 + 1 + 1 - 2) + 1 + if last { 6 + 4 } else { 0 };
        check(of_two_inputs(last), &data, free);
    }
}

#[test]
fn an_unstable_block_is_not_admissible() {
    let data = Signals::new(vec![noise(50, 1), noise(50, 2)], noise(50, 3), 0);
    let mut back = of_two_inputs(true);
    back.branches[1].back.sections[0].a[0] = -1.01;
    let mut front = System::sum(vec![cascade(true)]);
    front.branches[0].front.sections[0].a[1] = 1.01;
    for system in [back, front] {
        let loss = Loss::new(system, &data);
        assert!(loss.residuals(&loss.start()).is_none());
    }
}
