//! A joint as a row of a table: the quantities that all kinds of axes have in common.

use flexure::identify::robot_joint::{
    Effect, Estimated, FlexibleAxis, FormName, IdentifiedCurve, Parameter, RigidAxis, StiffJoint,
};
use serde_json::{Value, json};

use super::outcome::Outcome;
use super::text::{Units, estimate, with_error};

/// What is known of a quantity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Quantity {
    /// The axis does not have this quantity, as a rigid one has no stiffness.
    Absent,
    /// The data do not determine it.
    NotIdentifiable,
    /// A value with its error.
    Estimate(Estimated),
}

/// A column of the table.
pub struct Column {
    pub name: &'static str,
    key: &'static str,
    kind: Kind,
}

#[derive(Clone, Copy)]
enum Kind {
    Inertia,
    /// The powers of torque and position or velocity in the unit; whether the curve is a stiffness.
    Curve([i32; 2], bool),
    Milliseconds,
}

const fn column(name: &'static str, key: &'static str, kind: Kind) -> Column {
    Column { name, key, kind }
}

/// The number of the drive's inertia among the columns: only joints of a chain have it.
pub const DRIVE: usize = 1;

/// The columns between the axis's name and its verdict.
pub const COLUMNS: [Column; 7] = [
    column("inertia", "inertia", Kind::Inertia),
    column("of the drive", "drive_inertia", Kind::Inertia),
    column("viscous", "viscous", Kind::Curve([1, -1], false)),
    column("Coulomb", "coulomb", Kind::Curve([1, 0], false)),
    column("offset", "offset", Kind::Curve([1, 0], false)),
    column("stiffness", "stiffness", Kind::Curve([1, -1], true)),
    column("skew", "encoder_skew", Kind::Milliseconds),
];

impl Column {
    /// Its unit.
    pub fn unit(&self, units: &Units) -> String {
        match self.kind {
            Kind::Inertia => units.inertia().to_owned(),
            Kind::Curve(powers, stiffness) => units.of_curve(powers, stiffness),
            Kind::Milliseconds => "ms".to_owned(),
        }
    }
}

/// A joint as a row.
pub struct Row {
    /// In the order of [`COLUMNS`]; the skew in ms.
    pub quantities: [Quantity; COLUMNS.len()],
    /// What is wrong with it, in a word or two.
    pub verdict: &'static str,
    /// Whether nothing is wrong.
    pub holds: bool,
    /// What is wrong with it, in a sentence.
    pub why: String,
}

impl Quantity {
    /// For reading.
    pub fn text(self) -> String {
        match self {
            Quantity::Absent => "-".to_owned(),
            Quantity::NotIdentifiable => "cannot tell".to_owned(),
            Quantity::Estimate(estimated) => with_error(estimated),
        }
    }

    /// A quantity that must be positive: not identifiable if its value is not.
    fn positive(estimated: Estimated) -> Quantity {
        match estimated.is_positive() {
            true => Quantity::Estimate(estimated),
            false => Quantity::NotIdentifiable,
        }
    }

    fn of_parameter(parameter: Option<&Parameter>) -> Quantity {
        match parameter.filter(|p| p.identifiable) {
            Some(parameter) => Quantity::Estimate(estimate(parameter)),
            None => Quantity::NotIdentifiable,
        }
    }
}

impl Row {
    /// The row of a rigid axis.
    pub fn of_rigid(axis: &RigidAxis, outcome: &Outcome) -> Row {
        let of_joint = match &axis.stiff {
            None => [Quantity::Absent; 2],
            Some(stiff) => [stiffness_of(stiff), milliseconds(stiff.clock_offset)],
        };
        let drive = axis
            .chain
            .map_or(Quantity::Absent, |chain| Quantity::positive(chain.beside_links));
        Row::new(
            [Quantity::positive(axis.inertia), drive],
            &axis.friction,
            of_joint,
            outcome,
        )
    }

    /// The row of a flexible joint, with the values of its link.
    pub fn of_flexible(axis: &FlexibleAxis, outcome: &Outcome) -> Row {
        let skew = match axis.competing.contains(&Effect::EncoderSkew) {
            true => Quantity::NotIdentifiable,
            false => milliseconds(axis.clock_offset),
        };
        let linear = form(&axis.stiffness, FormName::LinearStiffness, "a2");
        let of_joint = [Quantity::of_parameter(linear), skew];
        let drive = axis
            .link
            .chain
            .map_or(Quantity::Absent, |_| Quantity::positive(axis.motor_inertia));
        Row::new(
            [Quantity::positive(axis.link.inertia), drive],
            &axis.link.friction,
            of_joint,
            outcome,
        )
    }

    fn new(inertias: [Quantity; 2], friction: &IdentifiedCurve, of_joint: [Quantity; 2], outcome: &Outcome) -> Row {
        let of_friction = |symbol| Quantity::of_parameter(form(friction, FormName::CoulombViscous, symbol));
        let [viscous, coulomb, offset] = ["Fv", "Fc", "F0"].map(of_friction);
        let ([inertia, drive], [stiffness, skew]) = (inertias, of_joint);
        let (verdict, holds) = outcome.word();
        Row {
            quantities: [inertia, drive, viscous, coulomb, offset, stiffness, skew],
            verdict,
            holds,
            why: outcome.verdict().headline,
        }
    }

    /// The row as JSON: `null` for quantities that the axis does not have, no value for those that the data do not determine.
    pub fn json(&self) -> Value {
        let cells = COLUMNS.iter().zip(&self.quantities);
        let is_alone = self.quantities[DRIVE] == Quantity::Absent;
        let mut object: serde_json::Map<String, Value> = cells
            .filter(|(column, _)| !(is_alone && column.key == COLUMNS[DRIVE].key))
            .map(|(column, quantity)| (column.key.to_owned(), quantity_json(*quantity, column.kind)))
            .collect();
        object.insert("verdict".to_owned(), json!(self.verdict));
        object.insert("holds".to_owned(), json!(self.holds));
        object.into()
    }
}

/// A quantity as JSON; times in s.
fn quantity_json(quantity: Quantity, kind: Kind) -> Value {
    let unit = if matches!(kind, Kind::Milliseconds) { 1e-3 } else { 1.0 };
    match quantity {
        Quantity::Absent => Value::Null,
        Quantity::NotIdentifiable => json!({ "value": null, "standard_error": null }),
        Quantity::Estimate(found) => {
            json!({ "value": found.value * unit, "standard_error": found.standard_error * unit })
        }
    }
}

/// The parameter of a form of a curve.
fn form<'a>(curve: &'a IdentifiedCurve, name: FormName, symbol: &str) -> Option<&'a Parameter> {
    curve.forms.iter().find(|form| form.form == name)?.parameter(symbol)
}

fn milliseconds(time: Estimated) -> Quantity {
    Quantity::Estimate(Estimated {
        value: 1e3 * time.value,
        standard_error: 1e3 * time.standard_error,
    })
}

/// The stiffness of a joint whose compliance is known, to first order.
fn stiffness_of(stiff: &StiffJoint) -> Quantity {
    let Estimated { value, standard_error } = stiff.compliance;
    match stiff.compliance.is_positive() {
        true => Quantity::Estimate(Estimated {
            value: 1.0 / value,
            standard_error: standard_error / value.powi(2),
        }),
        false => Quantity::NotIdentifiable,
    }
}
