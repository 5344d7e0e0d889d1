//! Joints with friction at the motor, late samples, damping and memory: what acts is named, and what does not is not.

#[path = "../examples/joint_families/simulated.rs"]
mod simulated;

use flexure::bands::Band;
use flexure::identify::robot_joint::{Effect, FlexibleAxis, FlexibleJoint, FormName, IdentifiedJoint};
use flexure::manipulator::{Friction, Stiffness};
use simulated::{FAMILIES, Family, Joint, JointLog, NOISES, Recording, recording};

fn family(name: &str) -> &'static Family {
    FAMILIES.iter().find(|family| family.name == name).unwrap()
}

fn identified(family: &Family) -> FlexibleAxis {
    let noise = NOISES.iter().find(|noise| noise.name == "middle").unwrap();
    let log = family.joint.log(&recording(noise), 100).unwrap();
    identified_log(&log, family.name)
}

fn identified_log(log: &JointLog, name: &str) -> FlexibleAxis {
    let joint = FlexibleJoint {
        motor: &log.motor,
        link: &log.link,
        torque: &log.torque,
        load: None,
        sample_time: log.sample_time,
        motor_inertia: None,
        level: 0.95,
    };
    match joint.identify().unwrap() {
        IdentifiedJoint::Flexible(axis) => *axis,
        IdentifiedJoint::Rigid(axis) => panic!("{name}: {:?}", axis.findings),
    }
}

/// The relative L2 distance of a band's estimate from a curve.
fn distance(band: &Band, truth: impl Fn(f64) -> f64) -> f64 {
    let (mut off, mut size) = (0.0, 0.0);
    for (x, y) in band.x[0].iter().zip(&band.estimate) {
        off += (y - truth(*x)).powi(2);
        size += truth(*x).powi(2);
    }
    (off / size).sqrt()
}

#[test]
fn friction_at_the_motor_is_no_skew_of_the_encoders() {
    for name in ["motor friction", "motor friction, late", "motor friction, damped"] {
        let family = family(name);
        let axis = identified(family);
        assert_eq!(
            (&axis.effects[..], &axis.competing[..]),
            (family.effects, &[][..]),
            "{name}"
        );
        for (found, truth) in [
            (axis.motor_inertia, family.joint.motor_inertia),
            (axis.link.inertia, family.joint.link_inertia),
        ] {
            assert!((found.value / truth - 1.0).abs() < 0.01, "{name}: {found:?}");
        }
        let motor = axis.motor_friction.unwrap();
        let off = [
            distance(&motor.band, |v| family.joint.motor_friction.torque(v)),
            distance(&axis.link.friction.band, |v| family.joint.steady_friction(v)),
        ];
        assert!(off.iter().all(|off| *off < 0.03), "{name}: {off:?}");
        assert!(
            (axis.clock_offset.value - family.joint.late).abs() < 1e-5,
            "{name}: {:?}",
            axis.clock_offset
        );
    }
}

#[test]
fn what_does_not_act_is_not_named() {
    for name in ["plain", "late", "damped", "gravity", "LuGre"] {
        let family = family(name);
        let axis = identified(family);
        assert_eq!(
            (&axis.effects[..], &axis.competing[..]),
            (family.effects, &[][..]),
            "{name}"
        );
        assert!(axis.motor_friction.is_none());
        if let Some(damping) = axis.damping {
            assert!(
                (damping.value - family.joint.damping).abs() < 4.0 * damping.standard_error,
                "{damping:?}"
            );
        }
    }
}

/// A spring with memory costs the inertias nothing.
#[test]
fn hysteresis_is_named_and_does_not_move_the_inertias() {
    let family = family("hysteretic");
    let axis = identified(family);
    assert!(axis.effects.contains(&Effect::HystereticSpring), "{:?}", axis.effects);
    let link = axis.link.inertia;
    assert!(
        (link.value - family.joint.link_inertia).abs() < 4.0 * link.standard_error,
        "{link:?}"
    );
    assert!(axis.link.findings.iter().any(|f| f.to_string().contains("hysteresis")));
}

/// Frictions that turn within 2 mrad/s hold the link against the spring whenever it stops. With free frictions the linear spring got a wind-up,
/// whose BIC was smaller by 312.
#[test]
fn a_linear_spring_beside_steep_frictions_has_no_wind_up() {
    let steep = |coulomb, viscous| Friction([0.0, 0.0, 0.0, coulomb, 500.0, viscous]);
    let joint = Joint {
        link_inertia: 2.0,
        damping: 3.0,
        stiffness: Stiffness {
            linear: 4200.0,
            cubic: 0.0,
            ..family("plain").joint.stiffness
        },
        motor_friction: steep(9.0, 14.0),
        link_friction: steep(2.0, 1.0),
        ..family("plain").joint
    };
    let recording = Recording {
        seconds: 10.0,
        sample_time: 0.001,
        amplitude: 1.0,
        band: [0.05, 0.8],
        stops: 1.0,
        dither: 10.0,
        encoders: 3e-6,
        torque: 0.2,
    };
    let axis = identified_log(&joint.log(&recording, 1).unwrap(), "steep");
    let best = axis.stiffness.best();
    assert_eq!(best.form, FormName::LinearStiffness);
    assert!(best.stands(), "{:?}", best.lack_of_fit);
    let a2 = best.parameter("a2").unwrap();
    assert!((a2.value - 4200.0).abs() < 3.0 * a2.standard_error, "{a2:?}");
    assert_eq!(axis.model.stiffness.form, FormName::LinearStiffness);
}
