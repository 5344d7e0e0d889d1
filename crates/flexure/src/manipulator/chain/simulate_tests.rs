//! Chains in time: against the two-link arm's own simulation, and what must not change.

use super::drives_tests::of_arm;
use super::*;
use crate::Error;
use crate::manipulator::{Arm, ArmParameters, Drive, JointKind, Parts, SimulationOptions, simulate, space_arm};
use crate::simulation::Tolerances;

fn torques(rows: usize) -> [Vec<f64>; 2] {
    [0.3, 0.7].map(|rate| (0..rows).map(|k| 8.0 * (rate * 0.2 * k as f64).sin()).collect())
}

#[test]
fn the_two_link_arm_moves_as_by_its_own_simulation() {
    for kind in [JointKind::Rigid, JointKind::Linear, JointKind::Nonlinear] {
        let mut parameters = space_arm(kind);
        parameters.parts = Parts {
            friction: true,
            coupling: false,
            rotor_in_link_inertia: false,
            ..parameters.parts
        };
        let arm = Arm::new(parameters).unwrap();
        let chain = of_arm(&rotorless(parameters), RotorCoupling::None);
        let options = SimulationOptions::new(10.0, 0.2).unwrap();
        let tau = torques(options.sampling.rows());
        let own = simulate(&arm, &Drive::Held([&tau[0], &tau[1]]), &options).unwrap();
        let all = ChainSimulation::new(&chain, 10.0, 0.2).unwrap();
        let found = simulate_chain(&chain, &[&tau[0], &tau[1]], &all).unwrap();
        for (column, other) in [
            ("q1", "q_joint0"),
            ("q2", "q_joint1"),
            ("dq2", "dq_joint1"),
            ("qm2", "qm_joint1"),
            ("dqm1", "dqm_joint0"),
        ] {
            if kind == JointKind::Rigid && column.contains("qm") {
                assert!(found.column(other).is_err());
                continue;
            }
            let both = own.column(column).unwrap().iter().zip(found.column(other).unwrap());
            let off = both.fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
            assert!(off < 1e-7, "{kind:?} {column}: {off:e}");
        }
    }
}

/// A rigid arm has no motors unless it says so.
fn rotorless(mut parameters: ArmParameters) -> ArmParameters {
    if parameters.model == JointKind::Rigid && !parameters.parts.rotors {
        parameters.joints.iter_mut().for_each(|joint| joint.motor_inertia = 0.0);
    }
    parameters
}

#[test]
fn a_free_base_keeps_its_momentum_and_without_friction_its_energy() {
    let chain = Chain::new(&ChainPreset::SpaceManipulator.parameters()).unwrap();
    let joint = crate::manipulator::JointParameters {
        motor_inertia: 300.0,
        linear: 40_000.0,
        cubic: 1e6,
        ..Default::default()
    };
    let drives = vec![
        ChainDrive {
            kind: JointKind::Nonlinear,
            joint,
            gear_ratio: 100.0,
            passive: false,
        };
        7
    ];
    let chain = DrivenChain::new(chain, &drives, RotorCoupling::Complete).unwrap();
    let mut options = ChainSimulation::new(&chain, 60.0, 1.0).unwrap();
    options.tolerances = Tolerances {
        rtol: 1e-12,
        ..Tolerances::default()
    };
    // Turning joints, the motors with them.
    let n = chain.dimension();
    for i in 0..7 {
        let speed = 0.02 * (1.0 + i as f64).cos();
        options.initial[n - 7 + i] = speed;
        options.initial[n - 14 + i] = speed;
    }
    let drift = Drift::of(&chain, &options);
    assert!(drift.momentum < 1e-10 && drift.energy < 1e-9, "{drift:?}");
}

#[test]
fn over_a_thousand_seconds_momentum_and_energy_hardly_drift() {
    let chain = Chain::new(&ChainPreset::SpaceManipulator.parameters()).unwrap();
    let chain = DrivenChain::new(chain, &[], RotorCoupling::None).unwrap();
    let mut options = ChainSimulation::new(&chain, 1000.0, 10.0).unwrap();
    options.tolerances = Tolerances {
        rtol: 1e-13,
        atol: 1e-15,
        ..Tolerances::default()
    };
    let n = chain.dimension();
    options.initial[n - 13..n - 10].copy_from_slice(&[0.01, 0.02, -0.01]);
    for i in 0..7 {
        options.initial[n - 7 + i] = 0.1 * (1.0 + i as f64).cos();
    }
    let drift = Drift::of(&chain, &options);
    println!("over 1000 s: {drift:?}");
    assert!(drift.momentum < 1e-12 && drift.energy < 1e-12, "{drift:?}");
}

/// The largest change of momentum and of energy in a run without torques, relative to their sizes.
#[derive(Debug)]
struct Drift {
    momentum: f64,
    energy: f64,
}

impl Drift {
    fn of(chain: &DrivenChain, options: &ChainSimulation) -> Drift {
        let record = simulate_chain(chain, &[], options).unwrap();
        let first = record.names().iter().position(|name| name == "base_x").unwrap();
        let states = &record.names()[first..];
        let at = |k: usize| -> Vec<f64> { states.iter().map(|name| record.column(name).unwrap()[k]).collect() };
        let mut data = chain.data();
        let mut kept = |x: &[f64]| {
            let state = chain.state(x).unwrap();
            let energy = chain.energy(&mut data, &state).unwrap();
            let momentum = chain.centroidal_momentum(&mut data, &state).unwrap();
            (
                [momentum.linear, momentum.angular].concat(),
                energy.kinetic + energy.potential,
            )
        };
        let largest = |x: &mut dyn Iterator<Item = f64>| x.fold(0.0_f64, |m, p| m.max(p.abs()));
        let (momentum, energy) = kept(&at(0));
        let size = largest(&mut momentum.iter().copied());
        let mut drift = Drift {
            momentum: 0.0,
            energy: 0.0,
        };
        for k in 1..record.len() {
            let (now, left) = kept(&at(k));
            let off = largest(&mut now.iter().zip(&momentum).map(|(a, b)| a - b));
            drift.momentum = drift.momentum.max(off / size);
            drift.energy = drift.energy.max((left / energy - 1.0).abs());
        }
        // The base does move.
        assert!(record.column("base_qz").unwrap()[record.len() - 1].abs() > 1e-3);
        drift
    }
}

#[test]
fn what_does_not_fit_is_refused_by_name() {
    let chain = Chain::new(&ChainPreset::SixJointArm.parameters()).unwrap();
    let chain = DrivenChain::new(chain, &[], RotorCoupling::None).unwrap();
    let options = ChainSimulation::new(&chain, 1.0, 0.1).unwrap();
    let message = |torques: &[&[f64]], options: &ChainSimulation| match simulate_chain(&chain, torques, options) {
        Err(Error::Data(error)) => error.to_string(),
        other => panic!("{other:?}"),
    };
    let short = [0.0; 10];
    let mut bad = [0.0; 11];
    bad[3] = f64::NAN;
    assert!(message(&[&short[..]; 6], &options).contains("tau_joint1"));
    assert!(message(&[&bad[..]; 6], &options).contains("tau_joint1"));
    assert!(message(&[&bad[..]; 2], &options).contains("the torques"));
    let shorter = ChainSimulation {
        initial: vec![0.0; 3],
        ..options
    };
    assert!(message(&[], &shorter).contains("state"));
}
