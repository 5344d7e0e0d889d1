//! What the equations of motion know of an arm.

use super::joint::{Friction, Stiffness};
use super::links::LinkDynamics;
use super::parameters::{ArmParameters, JointKind};
use crate::number::Number;

/// The form of the equations of an arm; in lanes, all arms have the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Form {
    /// Whether the joints are rigid.
    pub rigid: bool,
    /// Whether a rigid arm has rotors.
    pub rotors: bool,
    /// Whether a friction or wind-up term needs elementary functions.
    pub smooth_terms: bool,
    /// Whether a motor has friction.
    pub motor_friction: bool,
    /// Whether the coupling S acts on the links.
    pub coupled: bool,
    /// Whether each joint moves.
    pub free: [bool; 2],
}

/// The elastic torque of a joint, as in [`Stiffness`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Spring<T> {
    pub cubic: T,
    pub linear: T,
    pub windup: T,
    pub windup_sharpness: T,
}

/// The coefficients of the equations: of one arm, or of several in lanes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Coefficients<T> {
    pub form: Form,
    /// The links' inertia, as in [`LinkDynamics`], with rotor 2 in `M11` if that is switched on.
    pub shoulder: T,
    pub elbow: T,
    pub swing: T,
    /// The rotors' inertia.
    pub motor: [T; 2],
    /// The stiffness in effect: switched-off terms are zero.
    pub springs: [Spring<T>; 2],
    /// The damping of each joint.
    pub damping: [T; 2],
    /// The friction in effect; all zero where there is none.
    pub friction: [[T; 6]; 2],
    /// The same for the motors.
    pub motor_friction: [[T; 6]; 2],
    /// `S12`, the only element of S in (9): the inertia of rotor 2 in kg m^2; zero without coupling.
    pub coupling: T,
}

impl Coefficients<f64> {
    /// Those of an arm with checked parameters.
    pub fn new(parameters: &ArmParameters) -> Self {
        let ArmParameters {
            model, joints, parts, ..
        } = *parameters;
        let motor = joints.map(|j| j.motor_inertia);
        let mut links = LinkDynamics::new(&parameters.links);
        if parts.rotor_in_link_inertia {
            links.shoulder += motor[1];
        }
        let on = |part: bool, value: f64| if part { value } else { 0.0 };
        let springs = joints.map(|j| match model {
            JointKind::Rigid => Spring::of(Stiffness::default()),
            JointKind::Linear => Spring::of(Stiffness {
                linear: j.stiffness,
                ..Stiffness::default()
            }),
            JointKind::Nonlinear => Spring::of(Stiffness {
                cubic: on(parts.cubic, j.cubic),
                linear: j.linear,
                windup: on(parts.windup, j.windup),
                windup_sharpness: on(parts.windup && j.windup > 0.0, j.windup_sharpness),
            }),
        });
        let in_effect = |friction: Option<Friction>| friction.filter(|_| parts.friction).unwrap_or_default().0;
        let friction = joints.map(|j| in_effect(j.friction));
        let motor_friction = joints.map(|j| in_effect(j.motor_friction));
        let coupling = on(parts.coupling, motor[1]);
        let rubs = |friction: [[f64; 6]; 2]| friction.iter().any(|f| *f != [0.0; 6]);
        let free = joints.map(|j| !j.locked);
        Coefficients {
            form: Form {
                rigid: model == JointKind::Rigid,
                rotors: parts.rotors,
                smooth_terms: rubs(friction) || springs.iter().any(|s| s.windup != 0.0),
                motor_friction: rubs(motor_friction),
                coupled: free[1] && coupling != 0.0,
                free,
            },
            shoulder: links.shoulder,
            elbow: links.elbow,
            swing: links.coupling,
            motor,
            springs,
            damping: joints.map(|j| j.damping),
            friction,
            motor_friction,
            coupling,
        }
    }
}

impl Spring<f64> {
    fn of(stiffness: Stiffness) -> Self {
        let Stiffness {
            cubic,
            linear,
            windup,
            windup_sharpness,
        } = stiffness;
        Spring {
            cubic,
            linear,
            windup,
            windup_sharpness,
        }
    }

    pub fn stiffness(&self) -> Stiffness {
        let Spring {
            cubic,
            linear,
            windup,
            windup_sharpness,
        } = *self;
        Stiffness {
            cubic,
            linear,
            windup,
            windup_sharpness,
        }
    }
}

impl<T: Number> Coefficients<T> {
    /// Those of several arms of one form; `gather` makes a number of what it takes from each.
    pub fn gathered(form: Form, gather: impl Fn(&dyn Fn(&Coefficients<f64>) -> f64) -> T) -> Self {
        let six = |of: &dyn Fn(&Coefficients<f64>) -> [f64; 6]| std::array::from_fn(|k| gather(&|c| of(c)[k]));
        Coefficients {
            form,
            shoulder: gather(&|c| c.shoulder),
            elbow: gather(&|c| c.elbow),
            swing: gather(&|c| c.swing),
            motor: [0, 1].map(|i| gather(&|c| c.motor[i])),
            springs: [0, 1].map(|i| Spring {
                cubic: gather(&|c| c.springs[i].cubic),
                linear: gather(&|c| c.springs[i].linear),
                windup: gather(&|c| c.springs[i].windup),
                windup_sharpness: gather(&|c| c.springs[i].windup_sharpness),
            }),
            damping: [0, 1].map(|i| gather(&|c| c.damping[i])),
            friction: [0, 1].map(|i| six(&|c| c.friction[i])),
            motor_friction: [0, 1].map(|i| six(&|c| c.motor_friction[i])),
            coupling: gather(&|c| c.coupling),
        }
    }
}
