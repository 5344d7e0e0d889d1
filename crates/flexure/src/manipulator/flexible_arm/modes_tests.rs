//! The frequencies of flexible arms: against exact ones, and against many segments.

use super::tests::{BEAM, beam, load, two_links};
use super::*;
use crate::manipulator::chain::{DrivenChain, LinearisedChain, Motors};

/// `beta L` of the first two modes of a clamped-free beam: roots of `cos b cosh b = -1`.
const CLAMPED: [f64; 2] = [1.875_104_068_711_961, 4.694_091_132_974_175];

fn squares(near: &LinearisedChain, motors: Motors) -> Vec<f64> {
    near.modes(motors).unwrap().iter().map(|mode| mode.square).collect()
}

/// `beta L` of the first two modes of the arm, whose motors are held.
fn betas(arm: &FlexibleArm) -> Vec<f64> {
    let near = arm.linearised(&vec![0.0; arm.coordinates()]).unwrap();
    let scale = (BEAM.density * BEAM.length.powi(4) / BEAM.stiffness).sqrt();
    squares(&near, Motors::Held)
        .iter()
        .take(2)
        .map(|w2| (w2.sqrt() * scale).sqrt())
        .collect()
}

/// The errors of the first two frequencies of a clamped beam.
fn clamped_errors(functions: ShapeFunctions) -> Vec<f64> {
    // A joint that is held clamps as a fixed one does, and a chain needs one that moves.
    let parameters = two_links(Base::Fixed, |arm| arm.links.truncate(1));
    let arm = FlexibleArm::new(&parameters, &[], &[beam(0, functions)]).unwrap();
    betas(&arm)
        .iter()
        .zip(CLAMPED)
        .map(|(b, exact)| (b / exact).powi(2) - 1.0)
        .collect()
}

#[test]
fn the_frequencies_of_a_clamped_beam_are_those_of_the_table() {
    let two = clamped_errors(ShapeFunctions::Elements(2));
    assert!(
        (two[0] - 4.8e-4).abs() < 5e-5 && (two[1] - 8.5e-3).abs() < 1e-4,
        "{two:?}"
    );
    for (functions, within) in [(ShapeFunctions::default(), 1e-3), (ShapeFunctions::Modes(3), 1e-10)] {
        let errors = clamped_errors(functions);
        assert!(errors.iter().all(|e| e.abs() < within), "{functions:?}: {errors:?}");
    }
}

#[test]
fn the_errors_of_elements_fall_with_the_fourth_power_of_their_number() {
    let errors = [4, 8].map(|n| clamped_errors(ShapeFunctions::Elements(n)));
    for (coarse, fine) in errors[0].iter().zip(&errors[1]) {
        let rate = (coarse / fine).log2();
        assert!((rate - 4.0).abs() < 0.15, "{rate}: {errors:?}");
    }
}

/// A mass m at the tip: `1 + cos b cosh b + mu b (cos b sinh b - sin b cosh b) = 0` with mu = m / (rho L).
#[test]
fn a_mass_at_the_tip_lowers_the_frequencies_as_it_must() {
    let mu = 1.3;
    let characteristic = |b: f64| 1.0 + b.cos() * b.cosh() + mu * b * (b.cos() * b.sinh() - b.sin() * b.cosh());
    let root = |mut low: f64, mut high: f64| {
        let sign = characteristic(low);
        for _ in 0..80 {
            let middle = 0.5 * (low + high);
            if characteristic(middle) * sign > 0.0 {
                low = middle
            } else {
                high = middle
            }
        }
        low
    };
    let exact = [root(0.5, 1.8), root(3.0, 4.6)];
    for (functions, within) in [
        (ShapeFunctions::Elements(8), [1e-5, 1e-4]),
        (ShapeFunctions::default(), [1e-5, 5e-4]),
        (ShapeFunctions::Modes(5), [2e-4, 4e-3]),
    ] {
        let parameters = two_links(Base::Fixed, |arm| {
            arm.links.truncate(1);
            load(arm, mu * BEAM.density * BEAM.length, 1e-12);
        });
        let found = betas(&FlexibleArm::new(&parameters, &[], &[beam(0, functions)]).unwrap());
        for k in 0..2 {
            let off = (found[k] / exact[k]).powi(2) - 1.0;
            assert!(
                off > -1e-9 && off < within[k],
                "{functions:?}: {off:e} in mode {}",
                k + 1
            );
        }
    }
}

/// Small motions of finite elements, of modes, and of many segments are the same.
#[test]
fn elements_modes_and_many_segments_agree() {
    let parameters = two_links(Base::Free, |arm| load(arm, 0.5, 0.01));
    let q = [0.0, 0.0, 0.0, 0.3, 1.1];
    let of = |functions: ShapeFunctions| {
        let arm = FlexibleArm::new(&parameters, &[], &[0, 1].map(|link| beam(link, functions))).unwrap();
        let mut place = q.to_vec();
        place.resize(arm.coordinates(), 0.0);
        squares(&arm.linearised(&place).unwrap(), Motors::Free)
    };
    let beams = [0, 1].map(|link| SegmentedBeam {
        link,
        beam: BEAM,
        along: [1.0, 0.0, 0.0],
        axes: vec![[0.0, 0.0, 1.0]],
        segments: 40,
        springs: SpringPlacement::Middle,
    });
    let (segments, drives) = segmented(&parameters, &[], &beams).unwrap();
    let chain = DrivenChain::new(Chain::new(&segments).unwrap(), &drives, RotorCoupling::None).unwrap();
    let mut place = chain.chain().neutral();
    place[7] = q[3];
    let elbow = chain
        .chain()
        .joints()
        .iter()
        .position(|joint| joint == "joint2")
        .unwrap();
    place[7 + elbow] = q[4];
    // Of the chain, motion out of the plane of the base is left out: it has no frequency.
    let want = squares(&chain.linearised(&mut chain.data(), &place).unwrap(), Motors::Free);
    let want: Vec<f64> = want.into_iter().filter(|w2| *w2 > 1.0).take(3).map(f64::sqrt).collect();
    for (functions, within) in [(ShapeFunctions::Elements(6), 2e-3), (ShapeFunctions::Modes(10), 2e-2)] {
        let found: Vec<f64> = of(functions)
            .into_iter()
            .filter(|w2| *w2 > 1.0)
            .take(3)
            .map(f64::sqrt)
            .collect();
        for (found, want) in found.iter().zip(&want) {
            assert!((found / want - 1.0).abs() < within, "{functions:?}: {found} {want}");
        }
    }
}

#[test]
fn the_first_mode_has_the_beams_damping_and_the_second_in_proportion() {
    let parameters = two_links(Base::Fixed, |arm| arm.links.truncate(1));
    let mut damped = beam(0, ShapeFunctions::Modes(3));
    damped.beam.damping = 0.02;
    let arm = FlexibleArm::new(&parameters, &[], &[damped]).unwrap();
    let modes = arm
        .linearised(&vec![0.0; arm.coordinates()])
        .unwrap()
        .modes(Motors::Held)
        .unwrap();
    assert!((modes[0].damping_ratio - 0.02).abs() < 1e-9);
    assert!((modes[1].damping_ratio - 0.02 * (CLAMPED[1] / CLAMPED[0]).powi(2)).abs() < 1e-9);
}
