use super::controllers::{AdaptiveGains, Composite, CompositeGains, DirectAdaptive, Feedforward, Gains, Linearising};
use super::*;
use crate::manipulator::{Arm, JointKind, space_arm};

/// The time for the square, s.
const DURATION: f64 = 80.0;

fn arm() -> Arm {
    Arm::new(space_arm(JointKind::Nonlinear)).unwrap()
}

fn gains() -> Gains {
    Gains::new([1000.0; 2], [50.0; 2]).unwrap()
}

/// The figures of a controller on the square of 12.6 m in a minute.
fn on_the_square(plant: &Arm, controller: &mut dyn Controller, options: &LoopOptions) -> Figures {
    let links = plant.parameters().links;
    let path = TurnCounted::new(TipPath::new(&links, &square(12.6), DURATION, 5.0, false).unwrap());
    let run = run_loop(plant, controller, &mut Exact, &path, options).unwrap();
    Figures::new(&run, &links, DURATION)
}

#[test]
fn the_tip_stays_on_the_square_within_a_millimetre_at_100_hz() {
    let options = LoopOptions::new(DURATION + 2.0, 0.01).unwrap();
    let mut inverse = Linearising::new(arm(), 6.0).unwrap();
    let figures = on_the_square(&arm(), &mut inverse, &options);
    assert!(figures.tip_error_max < 1e-3, "{figures:?}");
    let figures = on_the_square(&arm(), &mut Feedforward::new(arm(), gains()), &options);
    assert!(figures.tip_error_max < 1e-3, "{figures:?}");
    // Without a model the tip is off by decimetres.
    let figures = on_the_square(&arm(), &mut Feedforward::none(gains()), &options);
    assert!(figures.tip_error_max > 0.1, "{figures:?}");
}
/// Half of the stiffness and no friction in the models.
#[test]
fn direct_adaptive_control_has_a_tenth_of_the_error_where_stiffness_and_friction_are_unknown() {
    let mut soft = space_arm(JointKind::Nonlinear);
    for joint in &mut soft.joints {
        joint.linear *= 0.5;
        joint.cubic *= 0.5;
        joint.windup *= 0.5;
    }
    let plant = Arm::new(soft).unwrap();
    let mut believed = space_arm(JointKind::Nonlinear);
    believed.parts.friction = false;
    let model = Arm::new(believed).unwrap();
    let options = LoopOptions {
        torque_limit: [60.0; 2],
        ..LoopOptions::new(DURATION + 2.0, 0.01).unwrap()
    };
    let servo = on_the_square(&plant, &mut Feedforward::new(model, gains()), &options);
    let mut direct = DirectAdaptive::new(&model, AdaptiveGains::space_arm()).unwrap();
    let direct = on_the_square(&plant, &mut direct, &options);
    assert!(direct.tip_error_max < 0.1 * servo.tip_error_max, "{direct:?} {servo:?}");
    assert!(direct.tip_error_rms < 0.1 * servo.tip_error_rms, "{direct:?} {servo:?}");
    let mut composite = Composite::new(&model, CompositeGains::space_arm()).unwrap();
    let composite = on_the_square(&plant, &mut composite, &options);
    assert!(
        direct.tip_error_max < composite.tip_error_max,
        "{direct:?} {composite:?}"
    );
    assert!(
        direct.tip_error_rms < composite.tip_error_rms,
        "{direct:?} {composite:?}"
    );
}

#[test]
fn delay_counts_and_limits_are_what_they_say() {
    let moves = JointMoves::new(&[[0.0, 1.0], [0.5, 1.5]], 2.0, 0.0).unwrap();
    let run = |delay, quantum, limit| {
        let options = LoopOptions {
            delay,
            quantum,
            torque_limit: [limit; 2],
            ..LoopOptions::new(3.0, 0.01).unwrap()
        };
        run_loop(
            &arm(),
            &mut Feedforward::new(arm(), gains()),
            &mut Exact,
            &moves,
            &options,
        )
        .unwrap()
    };
    let late = run(3, 0.0, f64::INFINITY);
    assert_eq!(&late.torque[..3], &[[0.0; 2]; 3]);
    let limited = run(0, 1e-3, 5.0);
    assert!(limited.torque.iter().flatten().all(|torque| torque.abs() <= 5.0));
    assert!(limited.torque.iter().flatten().any(|torque| torque.abs() == 5.0));
    for reading in &limited.readings {
        let counts = reading.qm[0] / 1e-3;
        assert!((counts - counts.round()).abs() < 1e-9);
    }
    // The record is one that can be identified from.
    let record = limited.record().unwrap();
    assert_eq!(record.column("tau1").unwrap().len(), 301);
    assert!(record.names().iter().any(|name| name == "true_dqm2"));
}

#[test]
fn a_run_repeats_from_its_seed() {
    let moves = JointMoves::new(&[[0.0, 1.0], [0.5, 1.5]], 1.0, 0.0).unwrap();
    let run = |seed| {
        let options = LoopOptions {
            encoder_noise: 1e-4,
            torque_noise: 0.1,
            seed,
            ..LoopOptions::new(1.0, 0.01).unwrap()
        };
        let mut estimator = Differences::new(10.0, false).unwrap();
        run_loop(
            &arm(),
            &mut Feedforward::new(arm(), gains()),
            &mut estimator,
            &moves,
            &options,
        )
        .unwrap()
    };
    assert_eq!(run(7), run(7));
    assert_ne!(run(7).truth.last(), run(8).truth.last());
}
