//! Logs that say too little, or something else than they seem to.

use super::*;
use crate::error::ParameterError;
use crate::signal::{Phases, multisine};

#[test]
fn a_torque_clipped_before_its_noise_and_angles_in_degrees_are_said() {
    let (position, torque) = axis(20_000, 0.0);
    let is_clipped = |torque: &[f64]| {
        let found = rigid(&position, torque).identify().unwrap();
        let clipped = found
            .findings
            .iter()
            .any(|f| matches!(f, Finding::ClippedTorque { .. }));
        // A quantity that a clipped torque makes wrong has no standard error.
        assert_eq!(clipped, found.inertia.standard_error.is_nan());
        for form in &found.friction.forms {
            assert!(!clipped || form.parameters.iter().all(|p| !p.identifiable), "{form:?}");
        }
        clipped
    };
    assert!(!is_clipped(&torque));
    for (seed, limit) in [(1, 5.0), (2, 8.0)] {
        let clipped: Vec<f64> = torque.iter().map(|t| t.clamp(-limit, limit)).collect();
        assert!(is_clipped(&noisy(&clipped, 0.05, seed)), "at {limit}");
    }
    // The peaks of a sine are not clipped, and neither are levels.
    let sine: Vec<f64> = (0..20_000).map(|i| 8.0 * (0.002 * f64::from(i)).sin()).collect();
    let levels: Vec<f64> = (0..20_000).map(|i| f64::from((i / 500 * 3) % 7)).collect();
    for torque in [sine, levels] {
        assert_eq!(super::checks::clipped(&noisy(&torque, 0.05, 4)), None);
    }
    // Many peaks of a low-crest multisine are equally high, but they are not clipped. This one was once taken for clipped.
    for seed in 1..=8 {
        let low_crest = Phases::LowCrest { seed };
        let multisine = multisine(60_000, 0.001, 40.0, 0.05, 3.0, low_crest).unwrap();
        assert_eq!(
            super::checks::clipped(&noisy(&multisine, 0.4, seed)),
            None,
            "seed {seed}"
        );
    }
    let degrees: Vec<f64> = position.iter().map(|q| q.to_degrees()).collect();
    let said = rigid(&degrees, &torque).identify().unwrap();
    assert!(
        said.findings
            .iter()
            .any(|f| f.to_string().contains("multiply it by pi / 180")),
        "{:?}",
        said.findings
    );
    let said = rigid(&position, &torque).identify().unwrap();
    assert!(!said.findings.iter().any(|f| matches!(f, Finding::ManyTurns { .. })));
}

#[test]
fn a_torque_that_the_drive_limits_is_not_clipped() {
    let torque: Vec<f64> = torque(20_000, 3.0);
    for limit in [5.0, 8.0] {
        let limited: Vec<f64> = torque.iter().map(|t| t.clamp(-limit, limit)).collect();
        let (position, measured) = driven(&limited);
        // Measured with noise, and as the command that the drive limited.
        for torque in [&measured, &limited] {
            assert!(super::checks::clipped(torque).is_some(), "at {limit}");
            let found = rigid(&position, torque).identify().unwrap();
            let is_clipped = |f: &Finding| matches!(f, Finding::ClippedTorque { .. });
            assert!(
                !found.findings.iter().any(is_clipped),
                "at {limit}: {:?}",
                found.findings
            );
            let Estimated { value, standard_error } = found.inertia;
            assert!(
                (value - 20.0).abs() < 4.0 * standard_error + 0.02,
                "at {limit}: {:?}",
                found.inertia
            );
        }
    }
}

#[test]
fn bad_logs_are_refused_or_remarked_on() {
    let (position, torque) = axis(20_000, 0.0);
    let message = |error: Error| error.to_string();
    // Wrapped in the middle of its way.
    let (low, high) = position
        .iter()
        .fold((f64::MAX, f64::MIN), |(l, h), &q| (l.min(q), h.max(q)));
    let middle = 0.5 * (low + high);
    for (turn, printed) in [
        (std::f64::consts::TAU, "wraps at 2 pi;"),
        (360.0, "a whole turn in degrees:"),
    ] {
        let unit = turn / std::f64::consts::TAU;
        let wrapped: Vec<f64> = position
            .iter()
            .map(|q| ((q - middle) * unit).rem_euclid(turn))
            .collect();
        let said = message(rigid(&wrapped, &torque).identify().unwrap_err());
        assert!(
            said.contains(printed) && said.contains("unwrap the angle first"),
            "{said}"
        );
    }
    // Too short.
    let error = rigid(&position[..150], &torque[..150]).identify().unwrap_err();
    assert_eq!(
        message(error),
        "a joint's friction and inertia needs at least 200 samples, but there are 150"
    );
    // Too slow.
    let every = |x: &[f64]| -> Vec<f64> { x.iter().copied().step_by(80).collect() };
    let (q, t) = (every(&position), every(&torque));
    let slow = RigidJoint {
        sample_time: 0.08,
        ..rigid(&q, &t)
    };
    let said = match slow.identify() {
        Err(error) => message(error),
        Ok(found) => found.findings.iter().map(ToString::to_string).collect(),
    };
    assert!(said.contains("sample faster"), "{said}");
    // Clipped.
    let clipped: Vec<f64> = torque.iter().map(|t| t.clamp(-5.0, 5.0)).collect();
    let found = rigid(&position, &clipped).identify().unwrap();
    assert!(
        matches!(found.findings[0], Finding::ClippedTorque { .. }),
        "{:?}",
        found.findings
    );
    // One way.
    let (position, torque) = axis(30_000, 25.0);
    let found = rigid(&position, &torque).identify().unwrap();
    assert!(
        matches!(found.findings[0], Finding::NeverReverses { .. }),
        "{:?}",
        found.findings
    );
    // Friction and offset cannot be distinguished: no form has a size of either.
    for symbol in ["Fc", "Fs", "F0", "g4"] {
        for p in found.friction.forms.iter().filter_map(|f| f.parameter(symbol)) {
            assert!(!p.identifiable && p.standard_error.is_nan(), "{p:?}");
        }
    }
    // A form that is only a slope has no size.
    let smooth = found
        .friction
        .forms
        .iter()
        .find(|f| f.form == FormName::SmoothDry)
        .unwrap();
    let [g4, g5] = ["g4", "g5"].map(|name| smooth.parameter(name).unwrap());
    assert!(g5.identifiable || !g4.identifiable, "{g4:?} {g5:?}");
    // Nonsense.
    let error = RigidJoint {
        sample_time: f64::NAN,
        ..rigid(&position, &torque)
    };
    assert!(matches!(
        error.identify(),
        Err(Error::Parameter(ParameterError::OutOfRange { .. }))
    ));
}

#[test]
fn a_motor_on_the_other_side_of_its_gear_is_said() {
    let (log, _) = elbow(20.0);
    let geared: Vec<f64> = log[0].iter().map(|q| 100.0 * q).collect();
    let [_, link, torque] = &log;
    let found = FlexibleJoint {
        motor: &geared,
        link,
        torque,
        ..flexible(&log)
    }
    .identify();
    let Ok(IdentifiedJoint::Flexible(axis)) = found else {
        panic!("{found:?}");
    };
    let said: Vec<String> = axis.link.findings.iter().map(ToString::to_string).collect();
    assert!(
        said[0].contains("times as far as the link") && said[0].contains("gear ratio"),
        "{said:?}"
    );
}

/// Stamps that jitter while the samples are evenly spaced: interpolation at even instants puts noise into the position, and the equations
/// take the inertia for a tenth of what it is.
#[test]
fn an_inertia_that_the_simulation_contradicts_is_said() {
    let (position, torque) = axis(20_000, 0.0);
    let says = |position: &[f64]| {
        let found = rigid(position, &torque).identify().unwrap();
        let said = (found.findings.iter()).find(|f| matches!(f, Finding::OtherInertia { .. }));
        (said.and_then(Finding::doubt), found.inertia)
    };
    assert_eq!(says(&position).0, None);
    let late: Vec<f64> = noisy(&vec![0.0; position.len()], 1.0, 9)
        .iter()
        .enumerate()
        .map(|(i, e)| if i % 7 == 0 && *e > 0.0 { 0.9 } else { 0.0 })
        .collect();
    let stamp = |i: usize| i as f64 + late[i];
    let resampled: Vec<f64> = (0..position.len())
        .map(|i| match i {
            0 => position[0],
            // The instant lies between the sample before and this one, which is late.
            _ => {
                position[i - 1]
                    + (position[i] - position[i - 1]) * (i as f64 - stamp(i - 1)) / (stamp(i) - stamp(i - 1))
            }
        })
        .collect();
    let (doubt, inertia) = says(&resampled);
    assert_eq!(
        doubt,
        Some("the motion is simulated with another inertia"),
        "{inertia:?}"
    );
}
