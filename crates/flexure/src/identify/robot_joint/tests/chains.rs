//! Joints of a chain: gravity and the other joints come from the chain's inertias.
//!
//! The motions are sums of sines, so that velocities and accelerations are exact, and the torques follow from the chain's inverse dynamics
//! (which is tested against Pinocchio).

use super::*;
use crate::manipulator::chain::{Chain, ChainParameters, ChainPreset};
use std::f64::consts::TAU;

const SAMPLE: f64 = 0.002;
const SAMPLES: usize = 10_000;
/// Coulomb and viscous friction, and the inertia of the drive, of every joint.
const COULOMB: f64 = 1.5;
const VISCOUS: f64 = 2.0;
const DRIVE: f64 = 0.4;

/// The position, velocity and acceleration of a joint.
fn motion(joint: usize, t: f64) -> [f64; 3] {
    let lines = [(0.11, 0.5), (0.37, 0.2), (0.83, 0.1)].map(|(f, size)| (TAU * f * (1.0 + 0.13 * joint as f64), size));
    let mut sum = [0.3, 0.0, 0.0];
    for (i, (w, size)) in lines.into_iter().enumerate() {
        let phase = w * t + (i + joint) as f64;
        sum[0] += size * phase.sin();
        sum[1] += size * w * phase.cos();
        sum[2] -= size * w * w * phase.sin();
    }
    sum
}

/// The torques on the links without friction.
fn inverse_dynamics(chain: &Chain, t: f64) -> Vec<f64> {
    let n = chain.joints().len();
    let [q, v, a] = [0, 1, 2].map(|order| (0..n).map(|joint| motion(joint, t)[order]).collect::<Vec<_>>());
    let mut tau = vec![0.0; n];
    chain.inverse_dynamics(&mut chain.data(), &q, &v, &a, &mut tau).unwrap();
    tau
}

struct ChainLog {
    positions: Vec<Vec<f64>>,
    torques: Vec<Vec<f64>>,
}

/// A log of a chain with rigid joints, whose friction jumps at zero.
fn log(chain: &Chain) -> ChainLog {
    let n = chain.joints().len();
    let (mut positions, mut torques) = (vec![Vec::new(); n], vec![Vec::new(); n]);
    for i in 0..SAMPLES {
        let t = i as f64 * SAMPLE;
        for (joint, load) in inverse_dynamics(chain, t).into_iter().enumerate() {
            let [q, v, a] = motion(joint, t);
            positions[joint].push(q);
            torques[joint].push(load + DRIVE * a + VISCOUS * v + COULOMB * v.signum());
        }
    }
    let noisy_all = |columns: Vec<Vec<f64>>, sd: f64, seed: u64| -> Vec<Vec<f64>> {
        let each = columns.iter().enumerate();
        each.map(|(i, x)| noisy(x, sd, seed + i as u64)).collect()
    };
    ChainLog {
        positions: noisy_all(positions, 2e-5, 10),
        torques: noisy_all(torques, 0.1, 30),
    }
}

impl ChainLog {
    fn loads(&self, chain: &Chain) -> Vec<JointLoad> {
        let positions: Vec<&[f64]> = self.positions.iter().map(Vec::as_slice).collect();
        JointLoad::of_chain(chain, &positions, SAMPLE).unwrap()
    }

    fn axis(&self, joint: usize, load: Option<&JointLoad>) -> RigidAxis {
        let joint = RigidJoint {
            position: &self.positions[joint],
            torque: &self.torques[joint],
            velocity: None,
            load,
            sample_time: SAMPLE,
            extras: &[],
            level: 0.95,
        };
        joint.identify().unwrap()
    }
}

fn six_joints() -> ChainParameters {
    ChainPreset::SixJointArm.parameters()
}

fn near(estimated: Estimated, truth: f64, share: f64) -> bool {
    let off = (estimated.value - truth).abs();
    off < 4.0 * estimated.standard_error && off < share * truth
}

#[test]
fn every_joint_of_a_chain_has_its_drive_and_its_friction() {
    let chain = Chain::new(&six_joints()).unwrap();
    let log = log(&chain);
    for (joint, load) in log.loads(&chain).iter().enumerate() {
        let axis = log.axis(joint, Some(load));
        let fit = axis.chain.unwrap();
        let form = axis
            .friction
            .forms
            .iter()
            .find(|f| f.form == FormName::CoulombViscous)
            .unwrap();
        for (symbol, truth) in [("Fc", COULOMB), ("Fv", VISCOUS)] {
            let p = form.parameter(symbol).unwrap();
            let estimated = Estimated {
                value: p.value,
                standard_error: p.standard_error,
            };
            assert!(near(estimated, truth, 0.03), "joint {joint}: {p:?}");
        }
        assert!(near(fit.beside_links, DRIVE, 0.05), "joint {joint}: {fit:?}");
        assert!(
            !axis.findings.iter().any(|f| f.doubt().is_some()),
            "{:?}",
            axis.findings
        );
        assert!(axis.friction.best().lack_of_fit.p_value > REFUTED, "joint {joint}");
    }
}

#[test]
fn without_the_chain_gravity_is_taken_for_friction_that_does_not_fit() {
    let chain = Chain::new(&six_joints()).unwrap();
    let log = log(&chain);
    let load = &log.loads(&chain)[1];
    let (alone, in_chain) = (log.axis(1, None), log.axis(1, Some(load)));
    let error = |axis: &RigidAxis| axis.inertia.standard_error;
    assert!(
        error(&alone) > 30.0 * error(&in_chain),
        "{} {}",
        error(&alone),
        error(&in_chain)
    );
    let offset = |axis: &RigidAxis| {
        let form = axis.friction.forms.iter().find(|f| f.form == FormName::CoulombViscous);
        form.unwrap().parameter("F0").unwrap().value
    };
    assert!(offset(&alone).abs() > 10.0 && offset(&in_chain).abs() < 0.1);
}

#[test]
fn a_chain_with_wrong_masses_is_contradicted() {
    let log = log(&Chain::new(&six_joints()).unwrap());
    let mut light = six_joints();
    light.links.iter_mut().for_each(|link| {
        if let Some(inertia) = &mut link.inertia {
            inertia.mass /= 1.2;
            inertia.matrix.iter_mut().flatten().for_each(|value| *value /= 1.2);
        }
    });
    let loads = log.loads(&Chain::new(&light).unwrap());
    // The shoulder and the elbow carry masses.
    for joint in [1, 2] {
        let axis = log.axis(joint, Some(&loads[joint]));
        let factor = axis.chain.unwrap().factor.unwrap();
        assert!(near(factor, 1.2, 0.03), "joint {joint}: {factor:?}");
        assert!(axis.findings.iter().any(|f| matches!(f, Finding::LoadFactor { .. })));
    }
}

#[test]
fn the_torque_of_another_motion_includes_the_load() {
    let chain = Chain::new(&six_joints()).unwrap();
    let log = log(&chain);
    let load = &log.loads(&chain)[1];
    let axis = log.axis(1, Some(load));
    let motion = JointMotion {
        position: &log.positions[1],
        motor: None,
        velocity: None,
        load: Some(load),
        sample_time: SAMPLE,
    };
    let needed = axis.needed_torque(&motion).unwrap();
    let (torque, measured) = (needed.in_band(&needed.torque), needed.in_band(&log.torques[1]));
    let off: f64 = torque.iter().zip(&measured).map(|(a, b)| (a - b).powi(2)).sum();
    assert!((off / torque.len() as f64).sqrt() < 0.2);
}

#[test]
fn a_flexible_joint_of_a_chain_has_the_inertia_of_its_links() {
    const STIFFNESS: f64 = 4000.0;
    const JOINT: usize = 1;
    let chain = Chain::new(&six_joints()).unwrap();
    let elastic = |t: f64| {
        let v = motion(JOINT, t)[1];
        inverse_dynamics(&chain, t)[JOINT] + VISCOUS * v + COULOMB * (v / 0.05).tanh()
    };
    let (mut motor, mut torque) = (Vec::new(), Vec::new());
    for i in 0..SAMPLES {
        let (t, h) = (i as f64 * SAMPLE, 1e-3);
        let [before, now, after] = [t - h, t, t + h].map(elastic);
        let [q, _, a] = motion(JOINT, t);
        motor.push(q + now / STIFFNESS);
        torque.push(now + DRIVE * (a + (before - 2.0 * now + after) / (h * h * STIFFNESS)));
    }
    let positions: Vec<Vec<f64>> = (0..6)
        .map(|joint| {
            noisy(
                &(0..SAMPLES)
                    .map(|i| motion(joint, i as f64 * SAMPLE)[0])
                    .collect::<Vec<_>>(),
                1e-5,
                joint as u64,
            )
        })
        .collect();
    let columns: Vec<&[f64]> = positions.iter().map(Vec::as_slice).collect();
    let load = &JointLoad::of_chain(&chain, &columns, SAMPLE).unwrap()[JOINT];
    let axis = found(FlexibleJoint {
        motor: &noisy(&motor, 1e-5, 50),
        link: &positions[JOINT],
        torque: &noisy(&torque, 0.1, 51),
        load: Some(load),
        sample_time: SAMPLE,
        motor_inertia: None,
        level: 0.95,
    });
    let fit = axis.link.chain.unwrap();
    assert!(
        (axis.link.inertia.value / load.inertia - 1.0).abs() < 0.03,
        "{:?} {fit:?}",
        axis.link.inertia
    );
    assert!(near(axis.motor_inertia, DRIVE, 0.2), "{:?}", axis.motor_inertia);
    assert!((fit.factor.unwrap().value - 1.0).abs() < 0.01, "{fit:?}");
    let linear = axis
        .stiffness
        .forms
        .iter()
        .find(|f| f.form == FormName::LinearStiffness)
        .unwrap();
    let stiffness = linear.parameter("a2").unwrap();
    assert!((stiffness.value / STIFFNESS - 1.0).abs() < 0.02, "{stiffness:?}");
    assert!(
        !axis.link.findings.iter().any(|f| f.doubt().is_some()),
        "{:?}",
        axis.link.findings
    );
}

#[test]
fn positions_that_are_not_those_of_the_chain_are_refused() {
    let chain = Chain::new(&six_joints()).unwrap();
    let log = log(&chain);
    let mut positions: Vec<&[f64]> = log.positions.iter().map(Vec::as_slice).collect();
    assert!(matches!(
        JointLoad::of_chain(&chain, &positions[..5], SAMPLE),
        Err(Error::Data(_))
    ));
    let short = &log.positions[2][..500];
    positions[2] = short;
    let error = JointLoad::of_chain(&chain, &positions, SAMPLE).unwrap_err().to_string();
    assert!(error.contains(&chain.joints()[2]) && error.contains("500"), "{error}");
    let free = Chain::new(&ChainPreset::SpaceManipulator.parameters()).unwrap();
    let positions = vec![&log.positions[0][..]; 7];
    let error = JointLoad::of_chain(&free, &positions, SAMPLE).unwrap_err().to_string();
    assert!(error.contains("floating base"), "{error}");
}
