//! Two-link arms with two flexible links beside Exudyn's cables with absolute nodal coordinates: scripts/reference/flexible_arm.py.

use super::tests::{BEAM, beam, load, two_links};
use super::*;
use crate::manipulator::chain::{ChainSimulation, DrivenChain, simulate_chain};

const ELBOW: f64 = 0.8;
const SPEEDS: [f64; 2] = [1.0, -2.5];
const STEP: f64 = 0.2;

/// The places of elbow and tip at 0.2, 0.4, 0.6 and 0.8 s.
const FIXED: [[f64; 4]; 4] = [
    [1.942475, 0.476394, 3.750646, 1.331157],
    [1.736801, 0.991772, 3.736133, 1.043911],
    [1.497217, 1.326041, 3.417874, 0.768283],
    [1.273252, 1.542352, 3.005311, 0.542366],
];
const FREE: [[f64; 4]; 4] = [
    [2.250608, 0.472745, 4.054623, 1.336242],
    [2.085886, 0.989968, 4.084311, 1.069613],
    [1.905754, 1.350051, 3.831456, 0.809971],
    [1.749664, 1.598642, 3.481313, 0.597941],
];

/// The arm, whose shoulder is at the origin of a fixed base, or at the side of one that floats.
fn parameters(base: Base) -> ChainParameters {
    two_links(base, |arm| {
        load(arm, 0.5, 1e-12);
        arm.links[0].translation[0] = if base == Base::Free { 0.3 } else { 0.0 };
        if let Some(base) = &mut arm.base_inertia {
            (base.mass, base.matrix) = (20.0, [[2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]]);
        }
    })
}

/// The largest difference of the arm's places of elbow and tip from those of the reference, m.
fn off(base: Base, functions: ShapeFunctions) -> f64 {
    let beams = [0, 1].map(|link| FlexibleBeam {
        axial_stiffness: Some(1e6),
        ..beam(link, functions)
    });
    let arm = FlexibleArm::new(&parameters(base), &[], &beams).unwrap();
    let (n, first) = (arm.coordinates(), arm.first());
    let mut initial = vec![0.0; 2 * n];
    initial[first + 1] = ELBOW;
    initial[n + first..n + first + 2].copy_from_slice(&SPEEDS);
    let options = ChainSimulation::from_state(initial, 4.0 * STEP, STEP).unwrap();
    let record = simulate_flexible_arm(&arm, &[], &options).unwrap();
    let before = 1 + arm.driven().len();
    let want = if base == Base::Free { FREE } else { FIXED };
    let mut most = 0.0_f64;
    for (k, want) in want.iter().enumerate() {
        let columns = record.columns().skip(before).take(n);
        let q: Vec<f64> = columns.map(|(_, values)| values[k + 1]).collect();
        let places = [0, 1].map(|link| arm.outline(&q, link, 2).unwrap()[1]);
        let places = places.concat();
        most = places
            .iter()
            .zip(want)
            .fold(most, |most, (a, b)| most.max((a - b).abs()));
    }
    most
}

#[test]
fn elements_and_modes_move_as_by_exudyn() {
    for (base, functions) in [
        (Base::Fixed, ShapeFunctions::Modes(3)),
        (Base::Free, ShapeFunctions::Elements(3)),
    ] {
        let off = off(base, functions);
        println!("{base:?} {functions:?}: {off:e} m");
        // Exudyn's own errors are 4e-6; with four modes it is 2.6e-5, with four elements 1e-5.
        assert!(off < 8e-5, "{base:?} {functions:?}: {off:e}");
    }
}

/// The place of the elbow by the angles of the first beam's segments on a fixed base.
#[test]
fn many_segments_move_as_by_exudyn() {
    let parameters = parameters(Base::Fixed);
    let count = 16;
    let beams = [0, 1].map(|link| SegmentedBeam {
        link,
        beam: BEAM,
        along: [1.0, 0.0, 0.0],
        axes: vec![[0.0, 0.0, 1.0]],
        segments: count,
        springs: SpringPlacement::Middle,
    });
    let (parameters, drives) = segmented(&parameters, &[], &beams).unwrap();
    let chain = DrivenChain::new(Chain::new(&parameters).unwrap(), &drives, RotorCoupling::None).unwrap();
    let mut options = ChainSimulation::new(&chain, 4.0 * STEP, STEP).unwrap();
    let (elbow, n) = (1 + count, chain.chain().velocities());
    options.initial[elbow] = ELBOW;
    (options.initial[n], options.initial[n + elbow]) = (SPEEDS[0], SPEEDS[1]);
    let record = simulate_chain(&chain, &[], &options).unwrap();
    let angles: Vec<&[f64]> = record.columns().skip(3).take(n).map(|(_, values)| values).collect();
    let h = BEAM.length / count as f64;
    for (k, want) in FIXED.iter().enumerate() {
        let (mut angle, mut place) = (0.0, [0.0; 2]);
        let mut places = Vec::new();
        for (j, own) in angles.iter().enumerate() {
            angle += own[k + 1];
            // Half a part lies before the first spring and behind the last one.
            let end = j % elbow == 0 || j % elbow == count;
            let length = if end { 0.5 * h } else { h };
            place = [place[0] + length * angle.cos(), place[1] + length * angle.sin()];
            if j % elbow == count {
                places.extend(place);
            }
        }
        let off = places.iter().zip(want).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
        println!("segments: {off:e} m");
        assert!(off < 2e-3, "{k}: {off:e}");
    }
}
