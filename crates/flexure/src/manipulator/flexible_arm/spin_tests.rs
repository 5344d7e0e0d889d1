//! Beams that turn: the frequencies of rotating beams, and the spin-up of Kane, Ryan and Banerjee.

use super::tests::{BEAM, beam};
use super::*;
use crate::linalg::{Matrix, symmetric_eigen};
use crate::manipulator::chain::ChainSimulation;
use crate::manipulator::{JointKind, JointParameters};

/// A beam on a hub at the origin, whose motor is as heavy as to turn whatever the beam does.
const MOTOR: f64 = 1e9;
/// The beam of Simo and Vu-Quoc 1986 (On the dynamics of flexible beams under large overall motions, J. Applied Mechanics 53): m, N, N m^2,
/// kg/m and rad/s.
const LENGTH: f64 = 10.0;
const AXIAL: f64 = 2.8e7;
const BENDING: f64 = 1.4e4;
const DENSITY: f64 = 1.2;
const SPEED: f64 = 6.0;
const TIME: f64 = 15.0;

fn turning(beam: FlexibleBeam) -> FlexibleArm {
    let parameters = ChainParameters {
        base_name: "base".to_owned(),
        base: Base::Fixed,
        base_inertia: None,
        links: vec![ChainLink {
            name: "beam".to_owned(),
            joint: "hub".to_owned(),
            parent: None,
            motion: JointMotion::Revolute,
            axis: [0.0, 0.0, 1.0],
            rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            translation: [0.0; 3],
            inertia: None,
            limits: [f64::NEG_INFINITY, f64::INFINITY],
        }],
        gravity: [0.0; 3],
    };
    let drive = ChainDrive {
        kind: JointKind::Rigid,
        joint: JointParameters {
            motor_inertia: MOTOR,
            ..JointParameters::default()
        },
        ..ChainDrive::default()
    };
    FlexibleArm::new(&parameters, &[drive], &[beam]).unwrap()
}

fn spinning(functions: ShapeFunctions, axial_stiffness: Option<f64>) -> FlexibleArm {
    turning(FlexibleBeam {
        axial_stiffness,
        beam: Beam {
            length: LENGTH,
            stiffness: BENDING,
            density: DENSITY,
            damping: 0.0,
        },
        ..beam(0, functions)
    })
}

/// The first frequency of a beam that turns at `speed` in its plane of bending, by the derivative of the forces.
fn lag_frequency(arm: &FlexibleArm, speed: f64) -> f64 {
    let n = arm.coordinates();
    let mut v = vec![0.0; n];
    v[0] = speed;
    let forces = |e: usize, h: f64| {
        let mut q = vec![0.0; n];
        q[e] = h;
        arm.assemble(&q, &v, [0.0; 2]).bias
    };
    let near = arm.linearised(&vec![0.0; n]).unwrap();
    let elastic = n - 1;
    let stiffness = Matrix::from_fn(elastic, elastic, |i, j| {
        let h = 1e-5;
        (forces(j + 1, h)[i + 1] - forces(j + 1, -h)[i + 1]) / (2.0 * h) + near.stiffness[(i + 1) * n + j + 1]
    });
    let mass = Matrix::from_fn(elastic, elastic, |i, j| near.mass[(i + 1) * n + j + 1]);
    let factor = mass.cholesky().unwrap().l();
    let half = factor.solve_lower_triangular(&stiffness).unwrap();
    let whole = factor.solve_lower_triangular(&half.transpose()).unwrap();
    let symmetric = (&whole + whole.transpose()) * 0.5;
    let values = symmetric_eigen(symmetric.as_slice(), elastic).unwrap().values;
    values.into_iter().fold(f64::INFINITY, f64::min).sqrt()
}

/// Hodges and Rutkowski 1981 (Free-vibration analysis of rotating beams by a variable-order finite-element method, AIAA J. 19): the first
/// frequency across the plane of turning; in the plane its square is smaller by that of the speed.
#[test]
fn a_turning_beam_is_stiffer_by_as_much_as_the_literature_says() {
    let scale = (BEAM.stiffness / BEAM.density).sqrt() / BEAM.length.powi(2);
    for functions in [ShapeFunctions::default(), ShapeFunctions::Modes(4)] {
        let arm = turning(beam(0, functions));
        for (speed, across) in [
            (0.0, 3.5160_f64),
            (1.0, 3.6816),
            (2.0, 4.1373),
            (4.0, 5.5850),
            (8.0, 9.2568),
            (12.0, 13.1702),
        ] {
            let found = lag_frequency(&arm, speed * scale) / scale;
            let found = found.hypot(speed);
            assert!(
                (found / across - 1.0).abs() < 1e-3,
                "{functions:?} at {speed}: {found} {across}"
            );
        }
    }
}

/// In equilibrium the stretch is `rho w^2 / EA (L^2 x / 2 - x^3 / 6)`, at the tip `rho w^2 L^3 / (3 EA)`, 5.14e-4 m.
#[test]
fn the_steady_extension_is_an_equilibrium() {
    let arm = spinning(ShapeFunctions::default(), Some(AXIAL));
    let unit = DENSITY * SPEED * SPEED * LENGTH.powi(3) / AXIAL;
    assert!((unit / 3.0 - 5.14e-4).abs() < 5e-7);
    let n = arm.coordinates();
    let (mut q, mut v) = (vec![0.0; n], vec![0.0; n]);
    (q[1], q[2], v[0]) = (unit / 2.0, -unit / 6.0, SPEED);
    let acceleration = |q: &[f64]| {
        let state = DrivenState {
            q,
            v: &v,
            motor_q: &[],
            motor_v: &[],
        };
        arm.accelerations(&state, &[0.0]).unwrap().0
    };
    let (rest, straight) = (acceleration(&q), acceleration(&vec![0.0; n]));
    let size = |a: &[f64]| a.iter().fold(0.0_f64, |m, a| m.max(a.abs()));
    // What is left is the load by the stretch itself, 5e-5 of it.
    assert!(size(&rest) < 1e-4 * size(&straight), "{rest:?} {straight:?}");
}

/// The hub's speed is `W (t / T - sin(2 pi t / T) / (2 pi))` up to T, then W.
fn spin_up(arm: &FlexibleArm, duration: f64, step: f64) -> crate::Record {
    let speed = |t: f64| {
        let s = (t / TIME).min(1.0);
        SPEED * (s - (std::f64::consts::TAU * s).sin() / std::f64::consts::TAU)
    };
    let mut options = ChainSimulation::from_state(vec![0.0; arm.dimension()], duration, step).unwrap();
    options.tolerances.rtol = 1e-8;
    options.tolerances.atol = 1e-10;
    let rows = options.sampling.rows();
    let torque: Vec<f64> = (0..rows)
        .map(|k| MOTOR * (speed((k + 1) as f64 * step) - speed(k as f64 * step)) / step)
        .collect();
    simulate_flexible_arm(arm, &[&torque], &options).unwrap()
}

#[test]
fn the_spin_up_beam_lags_and_comes_back_with_its_steady_extension() {
    let record = spin_up(&spinning(ShapeFunctions::Modes(2), Some(AXIAL)), 17.0, 0.02);
    let tip = record.column("tip_beam").unwrap();
    let most = tip.iter().fold(0.0, |most: f64, w| most.min(*w));
    // Without the stiffening by the speed it would run away.
    assert!((most + 0.576).abs() < 3e-3, "{most}");
    let late = tip.iter().skip(750);
    assert!(late.clone().all(|w| w.abs() < 0.02), "{:?}", late.collect::<Vec<_>>());
    let (one, two) = (record.column("e1_beam").unwrap(), record.column("e2_beam").unwrap());
    let stretch: Vec<f64> = one.iter().zip(two).map(|(a, b)| a + b).skip(750).collect();
    let mean = stretch.iter().sum::<f64>() / stretch.len() as f64;
    assert!((mean / 5.143e-4 - 1.0).abs() < 1e-3, "{mean}");
}

/// Without a stretch, and of elements, the bending is the same.
#[test]
fn a_beam_that_does_not_stretch_lags_as_much() {
    let record = spin_up(&spinning(ShapeFunctions::Elements(2), None), 10.0, 0.02);
    let most = record
        .column("tip_beam")
        .unwrap()
        .iter()
        .fold(0.0, |most: f64, w| most.min(*w));
    assert!((most + 0.576).abs() < 3e-3, "{most}");
}
