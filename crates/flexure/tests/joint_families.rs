//! Joints with friction at the motor, late samples, damping and memory: what acts is named, and what does not is not.

#[path = "../examples/joint_families/simulated.rs"]
mod simulated;

use flexure::bands::Band;
use flexure::identify::robot_joint::{Effect, FlexibleAxis, FlexibleJoint, IdentifiedJoint};
use simulated::{FAMILIES, Family, NOISES, recording};

fn family(name: &str) -> &'static Family {
    FAMILIES.iter().find(|family| family.name == name).unwrap()
}

fn identified(family: &Family) -> FlexibleAxis {
    let noise = NOISES.iter().find(|noise| noise.name == "middle").unwrap();
    let log = family.joint.log(&recording(noise), 100).unwrap();
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
        IdentifiedJoint::Rigid(axis) => panic!("{}: {:?}", family.name, axis.findings),
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
