//! The joints of a chain: gravity and the other joints are those of the chain.
//!
//! The links move along sums of sines, and the drives do what that needs.

use std::f64::consts::TAU;
use std::fmt::Write as _;

use flexure::manipulator::chain::{Chain, ChainDrive, ChainPreset, DrivenChain, JointPath, NeededDrive, RotorCoupling};
use flexure::manipulator::{Friction, JointKind, JointParameters};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use serde_json::Value;

use super::common::Folder;

const STEP: f64 = 0.002;
const ROWS: usize = 8000;
/// The drives' inertia, their Coulomb and their viscous friction.
const DRIVE: f64 = 0.5;
const COULOMB: f64 = 3.0;
const VISCOUS: f64 = 4.0;
const STIFFNESS: f64 = 4000.0;

fn drives() -> JointParameters {
    JointParameters {
        motor_inertia: DRIVE,
        friction: Some(Friction([0.0, 0.0, 0.0, COULOMB, 200.0, VISCOUS])),
        stiffness: STIFFNESS,
        ..JointParameters::default()
    }
}

/// The joint's path, later by `later` s.
fn path(joint: usize, later: f64) -> JointPath {
    let lines = [(0.13, 0.5), (0.41, 0.2), (0.97, 0.08)].map(|(f, size)| (TAU * f * (1.0 + 0.11 * joint as f64), size));
    let sum = |of: &dyn Fn(f64, f64, f64) -> f64| -> Vec<f64> {
        let at = |t: f64| {
            let each = lines.iter().enumerate();
            each.map(|(i, &(w, size))| of(size, w, w * t + (2 * i + joint) as f64))
                .sum()
        };
        (0..ROWS).map(|k| at(k as f64 * STEP + later)).collect()
    };
    JointPath {
        position: sum(&|size, _, phase| size * phase.sin()),
        velocity: sum(&|size, w, phase| size * w * phase.cos()),
        acceleration: sum(&|size, w, phase| -size * w * w * phase.sin()),
    }
}

fn noisy(x: &[f64], sd: f64, seed: u64) -> Vec<f64> {
    let mut random = Pcg64::seed_from_u64(seed);
    let noise = |value: &f64| value + sd * random.sample::<f64, _>(StandardNormal);
    x.iter().map(noise).collect()
}

/// The log of a six-joint arm, whose torques are multiplied by a factor; `named` are its columns: by the joints' names, or numbers.
fn log(kind: JointKind, later: f64, factor: f64, named: bool) -> String {
    let arm = Chain::new(&ChainPreset::SixJointArm.parameters()).unwrap();
    let names: Vec<String> = match named {
        true => arm.joints().iter().map(|joint| format!("_{joint}")).collect(),
        false => (1..=6).map(|i| i.to_string()).collect(),
    };
    let drive = ChainDrive {
        kind,
        joint: drives(),
        ..ChainDrive::default()
    };
    let arm = DrivenChain::new(arm, &[drive; 6], RotorCoupling::None).unwrap();
    let paths: Vec<JointPath> = (0..6).map(|joint| path(joint, later)).collect();
    let needed = arm.needed_drives(&paths, STEP).unwrap();
    let mut columns = vec![("t".to_owned(), (0..ROWS).map(|k| k as f64 * STEP).collect())];
    for (i, (path, NeededDrive { motor, torque })) in paths.iter().zip(&needed).enumerate() {
        let torque: Vec<f64> = torque.iter().map(|torque| factor * torque).collect();
        columns.push((format!("q{}", names[i]), noisy(&path.position, 1e-5, i as u64)));
        columns.push((format!("tau{}", names[i]), noisy(&torque, 0.05, 10 + i as u64)));
        if let Some(motor) = motor {
            columns.push((format!("qm{}", names[i]), noisy(motor, 1e-5, 20 + i as u64)));
        }
    }
    let mut text = columns
        .iter()
        .map(|(name, _)| name.as_str())
        .collect::<Vec<_>>()
        .join(",");
    for k in 0..ROWS {
        text.push('\n');
        for (i, (_, values)) in columns.iter().enumerate() {
            let comma = if i > 0 { "," } else { "" };
            write!(text, "{comma}{:.9}", values[k]).unwrap();
        }
    }
    text + "\n"
}

fn close(found: &Value, truth: f64, share: f64) {
    let value = found["value"].as_f64().unwrap();
    assert!((value - truth).abs() < share * truth, "{found} {truth}");
}

#[test]
fn the_joints_of_a_chain_have_their_drives_and_frictions() {
    let folder = Folder::new();
    folder.write("log.csv", log(JointKind::Rigid, 0.0, 1.0, false));
    folder.write("later.csv", log(JointKind::Rigid, 31.0, 1.0, false));
    let command =
        "joint log.csv --chain six-joint-arm --position q{} --torque tau{} --validate later.csv --report page.html";
    let found = folder.json(command);
    let axes = found["axes"].as_array().unwrap();
    assert_eq!(axes.len(), 6);
    for axis in axes {
        close(&axis["row"]["coulomb"], COULOMB, 0.02);
        close(&axis["row"]["viscous"], VISCOUS, 0.02);
        close(&axis["row"]["drive_inertia"], DRIVE, 0.02);
        close(&axis["chain"]["drive_inertia"], DRIVE, 0.02);
        assert_eq!(axis["later"]["holds"], true, "{}", axis["later"]);
    }
    assert_eq!(axes[1]["chain"]["joint"], "joint2");
    assert!(
        axes[1]["chain"]["load_share"].as_f64().unwrap() > 0.8,
        "{}",
        axes[1]["chain"]
    );
    let page = folder.read("page.html");
    assert!(page.contains("as a joint of six-joint-arm") && page.contains("Gravity and the other joints"));
}

#[test]
fn columns_may_have_the_names_of_the_joints_and_wrong_torques_are_said() {
    let folder = Folder::new();
    folder.write("log.csv", log(JointKind::Rigid, 0.0, 1.25, true));
    let said = folder.said("joint log.csv --chain six-joint-arm --axis joint2 --position q_{} --torque tau_{}");
    assert!(
        said.starts_with("1 of 1 axes identified, each as a joint of six-joint-arm"),
        "{said}"
    );
    let counts = said.split("the other joints fit best with ").nth(1).unwrap();
    let factor: f64 = counts.split(' ').next().unwrap().parse().unwrap();
    assert!((factor - 1.25).abs() < 0.05, "{said}");
    assert!(!said.contains(" holds"), "{said}");
    // All joints, by the names that their columns have.
    let all = folder.json("joint log.csv --chain six-joint-arm --position q_{} --torque tau_{}");
    assert_eq!(all["axes"][5]["axis"], "joint6");
}

#[test]
fn a_flexible_joint_of_a_chain_is_identified_and_moves_in_simulation() {
    let folder = Folder::new();
    folder.write("log.csv", log(JointKind::Linear, 0.0, 1.0, false));
    let found = folder.json("joint log.csv --chain six-joint-arm --axis 2 --motor qm{} --link q{} --torque tau{}");
    let axis = &found["axes"][0];
    close(&axis["row"]["stiffness"], STIFFNESS, 0.02);
    close(&axis["row"]["coulomb"], COULOMB, 0.05);
    close(&axis["motor_inertia"], DRIVE, 0.1);
    let links = axis["chain"]["links_inertia"].as_f64().unwrap();
    close(&axis["link_inertia"], links, 0.03);
    let fit = axis["replay"]["fit_percent"].as_f64().unwrap();
    assert!(fit > 90.0, "{}", axis["replay"]);
}

#[test]
fn what_no_chain_can_be_is_refused_with_what_to_do() {
    let folder = Folder::new();
    let whole = log(JointKind::Rigid, 0.0, 1.0, false);
    folder.write("log.csv", &whole);
    folder.write("short.csv", whole.replace("q5", "p5"));
    folder.done("simulate --preset space-arm --write-arm arm.toml");
    let columns = "--position q{} --torque tau{}";
    let joints = "joint1, joint2, joint3, joint4, joint5, joint6";
    for (options, message) in [
        (
            "--axis 7 --chain six-joint-arm --position q{} --torque tau{}",
            &*format!("axis 7 is no joint of six-joint-arm: give numbers from 1 to 6, or the names {joints}"),
        ),
        (
            "--chain six-joint-arm --position q1 --torque tau{}",
            "--position q1: with --axis or --chain, write {} where the name has the axis, as in --position q1{}",
        ),
        (
            "--chain six-joint-arm --no-gravity --position q{} --torque tau{}",
            "--no-gravity is for URDF; a preset says its gravity itself",
        ),
    ] {
        folder.misused(&format!("joint log.csv {options}"), message);
    }
    for (options, message) in [
        (
            "log.csv --chain space-manipulator",
            "space-manipulator: its base floats, and the log of its joints does not have its motion; give a chain on a fixed base",
        ),
        (
            "log.csv --chain arm.toml",
            "arm.toml: this is no chain: give a URDF (its name ends in .urdf), a chain file, or a preset; --motor, --link and --torque with \
             two columns each take a two-link arm",
        ),
        (
            "log.csv --chain none.urdf",
            "cannot read none.urdf: there is no such file or directory",
        ),
        (
            "short.csv --chain six-joint-arm",
            "short.csv: there is no column 'q5' of the joint 'joint5': the load of a joint depends on the positions of all joints of \
             six-joint-arm",
        ),
    ] {
        folder.failed(&format!("joint {options} {columns}"), message);
    }
}

#[test]
fn references_for_a_chain_keep_its_limits_and_are_rehearsed() {
    let folder = Folder::new();
    let command = "excite --preset six-joint-arm --max-torque 120,150,90,12,10,8 --max-velocity 1 --f-max 1 --duration 20 \
                   --sample-time 0.004 -o reference.csv";
    let found = folder.json(command);
    let all = |key: &str| -> Vec<f64> {
        found[key]
            .as_array()
            .unwrap()
            .iter()
            .map(|v| v.as_f64().unwrap())
            .collect()
    };
    let (torques, velocities) = (all("largest_torque"), all("largest_velocity"));
    for (torque, limit) in torques.iter().zip([120.0, 150.0, 90.0, 12.0, 10.0, 8.0]) {
        assert!(*torque <= limit, "{found}");
    }
    assert!(velocities.iter().all(|v| (0.5..=1.0 + 1e-9).contains(v)), "{found}");
    let can = found["can"].to_string();
    assert!(can.contains("\"joint2: the drive's inertia to within"), "{found}");
    // From rest to rest.
    let reference = folder.read("reference.csv");
    let rows: Vec<&str> = reference.lines().collect();
    assert_eq!(rows[0], "t,r_joint1,r_joint2,r_joint3,r_joint4,r_joint5,r_joint6");
    let last: Vec<f64> = rows[rows.len() - 1]
        .split(',')
        .skip(1)
        .map(|v| v.parse().unwrap())
        .collect();
    assert!(last.iter().all(|r| r.abs() < 1e-9), "{last:?}");

    let weak = folder.run("excite --preset six-joint-arm --max-torque 20 --duration 20 --sample-time 0.01 -o weak.csv");
    assert_eq!(weak.code, Some(1));
    let heavy = weak.stderr.starts_with("error: six-joint-arm: joint 'joint2' needs ");
    assert!(
        heavy
            && weak
                .stderr
                .trim_end()
                .ends_with("to hold the arm at rest; raise --max-torque"),
        "{}",
        weak.stderr
    );
    folder.misused(
        "excite --preset six-joint-arm --kind multilevel --max-torque 120 -o levels.csv",
        "--kind multilevel jumps, which no joint of a chain can follow; take multisine or chirp",
    );
    folder.failed(
        "excite --preset space-manipulator --max-torque 120 -o free.csv",
        "space-manipulator: its base floats, and the log of its joints does not have its motion; give a chain on a fixed base",
    );
}
