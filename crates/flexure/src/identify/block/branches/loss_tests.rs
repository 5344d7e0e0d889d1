use rand::{RngExt, SeedableRng};

use super::super::super::{Kink, Rational, Shape};
use super::*;
use crate::identify::derivative_tests::assert_derivatives;
use crate::linear::Complex;

fn noise(n: usize, seed: u64) -> Vec<f64> {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
    (0..n).map(|_| rng.random_range(-1.5..1.5)).collect()
}

fn shape(breakpoints: &[f64], c: &[f64], kinks: &[(f64, f64)]) -> Shape {
    let mut shape = Shape::new(breakpoints);
    shape.c.copy_from_slice(c);
    shape.kinks = kinks.iter().map(|&(at, bend)| Kink { at, bend }).collect();
    shape
}

fn system(last: bool) -> System {
    let pole = |re, im| Complex::new(re, im);
    let linear = |zeros: &[Complex<f64>], poles: &[Complex<f64>]| Rational::from_roots(zeros, poles);
    System {
        branches: vec![
            Branch {
                delay: 0,
                shape: shape(&[-1.0, 0.2, 1.0], &[0.1, -0.5, 0.3, 0.8, 0.2], &[(0.31, -0.6)]),
                linear: linear(&[pole(0.4, 0.0)], &[pole(0.5, 0.3), pole(0.5, -0.3), pole(0.2, 0.0)]),
            },
            Branch {
                delay: 3,
                shape: shape(&[-1.2, 1.2], &[0.4, 0.1, -0.3, 1.0], &[]),
                linear: linear(&[], &[pole(0.6, 0.0)]),
            },
        ],
        offset: 0.2,
        output: last.then(|| {
            let kinks = [(-0.4, 0.5), (0.21, 0.3)];
            shape(&[-1.0, 0.0, 0.5, 2.0], &[-1.0, -0.8, 0.1, 0.9, 1.0, 0.7], &kinks)
        }),
    }
}

#[test]
fn every_derivative_agrees_with_a_difference() {
    let data = Signals::new(vec![noise(200, 1), noise(200, 2)], noise(200, 3), 20);
    for last in [false, true] {
        let loss = Loss::new(system(last), &data);
        let p = loss.start();
        assert_eq!(
            p.len(),
            (5 + 2 + 2 + 3 - 2) + (4 + 1 + 1 - 2) + 1 + if last { 6 + 4 } else { 0 }
        );
        let (residuals, jacobian) = loss.linearise(&p);
        assert_eq!(residuals, loss.residuals(&p).unwrap());
        assert_derivatives(&p, &jacobian, |p| loss.residuals(p).unwrap());
    }
}

#[test]
fn parameters_come_back_and_an_unstable_system_is_not_admissible() {
    for last in [false, true] {
        let s = system(last);
        assert_eq!(s.with(&s.parameters()), s);
    }
    let data = Signals::new(vec![noise(50, 1), noise(50, 2)], noise(50, 3), 0);
    let mut s = system(true);
    s.branches[1].linear.sections[0].a[0] = -1.01;
    let loss = Loss::new(s, &data);
    assert!(loss.residuals(&loss.start()).is_none());
}
