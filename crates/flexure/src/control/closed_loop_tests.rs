use super::controllers::{Feedforward, Gains, Linearising};
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
