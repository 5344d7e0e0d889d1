//! The derivatives against differences, and the parts against slower twins.

use rand::{RngExt, SeedableRng};

use super::super::rational::Section;
use super::super::shape::Kink;
use super::*;
use crate::identify::derivative_tests::assert_derivatives;

fn noise(n: usize, seed: u64) -> Vec<f64> {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
    (0..n).map(|_| rng.random_range(-2.0..2.0)).collect()
}

fn cascade(constants: bool) -> Cascade {
    let pair = |a1, a2| Section { a: [a1, a2], order: 2 };
    let single = |a1| Section { a: [a1, 0.0], order: 1 };
    let mut shape = Shape::new(&[-2.0, -0.7, 0.0, 0.4, 1.5]);
    shape.c.copy_from_slice(&[-1.0, -0.9, -0.2, 0.1, 0.6, 0.5, 0.9]);
    shape.kinks = [(-0.31, 0.4), (0.23, -0.7)]
        .map(|(at, bend)| Kink { at, bend })
        .to_vec();
    Cascade {
        front: Rational {
            b: vec![0.3, 0.1, -0.05],
            sections: vec![pair(-1.2, 0.6), single(0.4)],
        },
        shape,
        back: Rational {
            b: if constants { vec![0.4, 1.0] } else { vec![1.0, -1.0] },
            sections: vec![single(-0.7), pair(0.3, 0.2)],
        },
        between: None,
        offset: 0.2,
    }
}

/// The same with an instant between the samples, whose numerators are longer than the others.
fn with_instant(constants: bool) -> Cascade {
    Cascade {
        between: Some(Between {
            front: vec![0.1, 0.2, 0.05, 0.1],
            back: vec![0.3, if constants { 0.2 } else { -0.3 }, 0.0],
        }),
        ..cascade(constants)
    }
}

#[test]
fn every_derivative_agrees_with_a_difference() {
    for (constants, between) in [(true, false), (false, false), (true, true), (false, true)] {
        let data = Data::new(noise(200, 1), noise(200, 2), 20);
        let loss = CascadeLoss::new(
            if between {
                with_instant(constants)
            } else {
                cascade(constants)
            },
            &data,
        );
        let p = loss.start();
        // 3 + 3 of the front, 7 coefficients, two kinks, 2 + 3 of the back less the one that fixes the scale.
        assert_eq!(
            p.len(),
            3 + 3 + 7 + 4 + 2 + 3 - 1 + if between { 4 + 3 } else { 0 } + usize::from(!constants)
        );
        let (residuals, jacobian) = loss.linearise(&p);
        assert_eq!(residuals, loss.residuals(&p).unwrap());
        assert_derivatives(&p, &jacobian, |p| loss.residuals(p).unwrap());
    }
}

#[test]
fn an_unstable_block_is_not_admissible() {
    let data = Data::new(noise(50, 1), noise(50, 2), 0);
    let loss = CascadeLoss::new(cascade(true), &data);
    let mut p = loss.start();
    p[4] = 1.01;
    assert!(loss.residuals(&p).is_none());
}
