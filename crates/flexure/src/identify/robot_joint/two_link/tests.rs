//! A known arm: its constants and curves come back, with bands that cover them.

use super::super::tests::distance;
use super::TwoLinkLog;
use crate::error::DataError;
use crate::identify::robot_joint::{FormName, TwoLinkArm};
use crate::manipulator::{Arm, Drive, JointKind, LinkDynamics, SimulationOptions, add_noise, simulate, space_arm};
use crate::record::Record;
use crate::signal::{Phases, multisine};
use crate::{Error, Result};

const STEP: f64 = 2e-3;

/// The space arm under two multisines, with noise of 1e-5 rad and 1 % of the torques; the elbow is stiffened by `factor`.
fn log(seconds: f64, factor: f64) -> Record {
    log_of(seconds, factor, 0)
}

/// Other multisines with other noise for each `run`.
fn log_of(seconds: f64, factor: f64, run: u64) -> Record {
    let mut parameters = space_arm(JointKind::Nonlinear);
    parameters.joints[1].linear *= factor;
    let arm = Arm::new(parameters).unwrap();
    let options = SimulationOptions::new(seconds, STEP).unwrap();
    let rows = options.sampling.rows();
    let torque = |amplitude, seed| multisine(rows, STEP, amplitude, 0.05, 3.0, Phases::Random { seed }).unwrap();
    let (first, second) = (torque(40.0, 1 + 2 * run), torque(20.0, 2 + 2 * run));
    let record = simulate(&arm, &Drive::Held([&first, &second]), &options).unwrap();
    let angles = ["q1", "q2", "qm1", "qm2"].map(|name| (name, 1e-5));
    let noise: Vec<(&str, f64)> = angles.into_iter().chain([("tau1", 0.4), ("tau2", 0.2)]).collect();
    add_noise(&record, 5 + run, &noise).unwrap()
}

fn identified(log: &Record) -> Result<TwoLinkArm> {
    let columns = |names: [&str; 2]| names.map(|name| log.column(name).unwrap());
    TwoLinkLog {
        motor: columns(["qm1", "qm2"]),
        link: columns(["q1", "q2"]),
        torque: columns(["tau1", "tau2"]),
        sample_time: STEP,
        level: 0.95,
    }
    .identify()
}

#[test]
fn an_arm_is_found_as_a_whole() {
    let arm = identified(&log(40.0, 1.0)).unwrap();
    let parameters = space_arm(JointKind::Nonlinear);
    let truth = LinkDynamics::new(&parameters.links);
    for (name, found, truth) in [
        ("shoulder", arm.shoulder, truth.shoulder),
        ("elbow", arm.elbow, truth.elbow),
        ("coupling", arm.coupling, truth.coupling),
        ("motor 1", arm.joints[0].motor_inertia, 1.0),
        ("motor 2", arm.joints[1].motor_inertia, 1.0),
        ("M11", arm.joints[0].link.inertia, truth.shoulder + 2.0 * truth.coupling),
        ("shoulder beside the forms", arm.model[0], truth.shoulder),
        ("coupling beside the forms", arm.model[2], truth.coupling),
    ] {
        let off = (found.value - truth).abs();
        assert!(off < 0.005 * truth, "{name}: {found:?}, but it is {truth}");
        assert!(off < 5.0 * found.standard_error, "{name}: {found:?}, but it is {truth}");
    }
    let joint = parameters.joints[0];
    let kappa = joint.nonlinear_stiffness();
    let friction = joint.friction.unwrap();
    for (i, axis) in arm.joints.iter().enumerate() {
        for (name, (off, covered)) in [
            ("stiffness", distance(&axis.stiffness.band, |d| kappa.torque(d))),
            ("friction", distance(&axis.link.friction.band, |v| friction.torque(v))),
        ] {
            println!("joint {}: {name} {off:.5} from the truth, covered {covered:.2}", i + 1);
            assert!(off < 0.02, "{name} of joint {} is {off} from the truth", i + 1);
            assert!(covered > 0.8, "the band of {name} of joint {} covers {covered}", i + 1);
        }
        let stiffness = &axis.model.stiffness;
        assert!(
            matches!(stiffness.form, FormName::Windup | FormName::LinearWindup),
            "{:?}",
            stiffness.form
        );
        let ksw = stiffness.parameter("ksw").unwrap();
        let off = (ksw.value - 10.0).abs();
        assert!(off < 2.0 && off < 4.0 * ksw.standard_error, "{ksw:?}");
    }
}

/// Errors at neighbouring points are similar, so single runs differ much. Therefore all curves of four runs count.
#[test]
fn bands_cover_the_truth() {
    let joint = space_arm(JointKind::Nonlinear).joints[0];
    let kappa = joint.nonlinear_stiffness();
    let friction = joint.friction.unwrap();
    let mut covered = [Vec::new(), Vec::new()];
    for run in 0..4 {
        let arm = identified(&log_of(20.0, 1.0, run)).unwrap();
        for axis in &arm.joints {
            covered[0].push(distance(&axis.stiffness.band, |d| kappa.torque(d)).1);
            covered[1].push(distance(&axis.link.friction.band, |v| friction.torque(v)).1);
        }
    }
    for (name, shares) in ["stiffness", "friction"].into_iter().zip(covered) {
        let mean = shares.iter().sum::<f64>() / shares.len() as f64;
        println!("{name}: covered {mean:.3}, run by run {shares:.2?}");
        assert!(mean > 0.9, "95 % bands of the {name} cover {mean} of it: {shares:?}");
    }
}

#[test]
fn a_joint_without_flexibility_is_said() {
    let error = identified(&log(20.0, 1e6)).unwrap_err();
    assert!(
        matches!(error, Error::Data(DataError::RigidJointInArm { joint: 2, .. })),
        "{error}"
    );
    let message = error.to_string();
    assert!(
        message.contains("no flexibility is seen at joint 2") && message.contains("lock this joint"),
        "{message}"
    );
}

#[test]
fn a_column_that_does_not_move_is_named() {
    let log = log(5.0, 1.0);
    let columns = |names: [&str; 2]| names.map(|name| log.column(name).unwrap());
    let still = vec![0.0; log.len()];
    let error = TwoLinkLog {
        motor: columns(["qm1", "qm2"]),
        link: [log.column("q1").unwrap(), &still],
        torque: columns(["tau1", "tau2"]),
        sample_time: STEP,
        level: 0.95,
    }
    .identify()
    .unwrap_err();
    assert!(
        matches!(&error, Error::Data(DataError::Constant { column, .. }) if column == "link 2"),
        "{error}"
    );
}
