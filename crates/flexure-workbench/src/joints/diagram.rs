//! A joint as a block diagram: inertias that friction brakes, with a spring between them.

use flexure::bands::Band;
use flexure::identify::robot_joint::{Estimated, FlexibleAxis, Parameter, RigidAxis};
use flexure_report::data::{DiagramBlock, Flow, Sketch};

use super::text::{Units, typeset, with_error};
use crate::text::number;

/// A rigid axis: what friction and the position leave of the torque accelerates its inertia. `None` for a joint of a chain, which the other
/// joints move too.
pub fn rigid(axis: &RigidAxis, units: &Units) -> Option<Flow> {
    let inertia = Inertia {
        title: match units.moved() {
            "mass" => "Mass",
            _ => "Inertia",
        },
        symbol: "M",
        value: axis.inertia,
        friction: Some(&axis.friction.band),
        extras: &axis.extras,
    };
    axis.chain.is_none().then(|| {
        between(
            format!("{} ({})", units.effort, units.torque),
            inertia.flow(units),
            format!("position ({})", units.position),
        )
    })
}

/// A flexible joint: the motor and the link, with the spring between them. `None` for a joint of a chain.
pub fn flexible(axis: &FlexibleAxis, units: &Units) -> Option<Flow> {
    let motor = Inertia {
        title: "Motor inertia",
        symbol: "Jₘ",
        value: axis.motor_inertia,
        friction: axis.motor_friction.as_ref().map(|friction| &friction.band),
        extras: &[],
    };
    let link = Inertia {
        title: "Link inertia",
        symbol: "M",
        value: axis.link.inertia,
        friction: Some(&axis.link.friction.band),
        extras: &axis.link.extras,
    };
    let spring = match axis.damping {
        Some(_) => "Spring, damping",
        None => "Spring",
    };
    let joint = Flow::Coupled {
        first: Box::new(motor.flow(units)),
        between: Box::new(curve(spring, &axis.stiffness.band)),
        last: Box::new(link.flow(units)),
    };
    let torque = format!("motor torque ({})", units.torque);
    let angle = format!("link angle ({})", units.position);
    axis.link.chain.is_none().then(|| between(torque, joint, angle))
}

fn between(entering: String, joint: Flow, leaving: String) -> Flow {
    Flow::Series(vec![Flow::Signal(entering), joint, Flow::Signal(leaving)])
}

/// An inertia from the torque on it to its position.
struct Inertia<'a> {
    title: &'static str,
    symbol: &'static str,
    value: Estimated,
    friction: Option<&'a Band>,
    /// Its terms that depend on the position.
    extras: &'a [Parameter],
}

impl Inertia<'_> {
    fn flow(&self, units: &Units) -> Flow {
        let value = match self.value {
            value if !value.is_positive() => None,
            value if value.standard_error > 0.0 && value.standard_error.is_finite() => Some(with_error(value)),
            Estimated { value, .. } => Some(number(value)),
        };
        let note = value.map(|value| typeset(&format!("{value} {}", units.inertia())));
        let note = note.unwrap_or_default();
        let accelerated = |formula: &str| block(self.title, formula, note.clone());
        let symbol = self.symbol;
        let moved = match self.friction {
            Some(friction) => Flow::Series(vec![
                braked(accelerated(&format!("1/({symbol} s)")), curve("Friction", friction)),
                block("Integrator", "1/s", String::new()),
            ]),
            None => accelerated(&format!("1/({symbol} s²)")),
        };
        match self.extras {
            [] => moved,
            extras => {
                let spring = extras.iter().any(|extra| extra.symbol == "spring");
                let gravity = extras.iter().any(|extra| extra.symbol != "spring");
                let title = match (gravity, spring) {
                    (true, true) => "Gravity, spring",
                    (true, false) => "Gravity",
                    (false, _) => "Spring",
                };
                braked(moved, block(title, "g(q)", String::new()))
            }
        }
    }
}

/// A part with a torque that takes from what drives it.
fn braked(forward: Flow, back: Flow) -> Flow {
    Flow::Feedback {
        forward: Box::new(forward),
        back: Box::new(back),
        subtracted: true,
    }
}

fn block(title: &str, formula: &str, note: String) -> Flow {
    Flow::Block(DiagramBlock {
        title: title.to_owned(),
        sketch: Sketch::Formula(formula.to_owned()),
        note,
    })
}

/// A block with its identified curve.
fn curve(title: &str, band: &Band) -> Flow {
    Flow::Block(DiagramBlock {
        title: title.to_owned(),
        sketch: Sketch::Curve {
            x: band.x[0].clone(),
            y: band.estimate.clone(),
        },
        note: String::new(),
    })
}
