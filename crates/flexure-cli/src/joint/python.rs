//! Python code that identifies the same joint or arm.

use flexure_io::RecordFile;
use flexure_workbench::joints::in_unit;
use serde_json::{Value, json};

use super::Arguments;
use super::log::{Number, Quantity};
use crate::python::{self, Call};

impl Arguments {
    /// Python code that identifies the same joint or arm and writes its page; `None` where Python works differently.
    pub(super) fn python(&self, file: &RecordFile, joints: usize, sample_time: f64) -> Option<String> {
        if self.source.prepares()
            || !self.convert.is_empty()
            || !self.source.reading.given().is_empty()
            || self.validate.is_some()
        {
            return None;
        }
        let named = |text: &str| -> Value {
            let names: Vec<&str> = if joints == 2 {
                text.split(',').collect()
            } else {
                vec![text]
            };
            python::names(&names)
        };
        let columns = [&self.position, &self.motor, &self.link, &self.velocity, &self.reference];
        let columns = columns.into_iter().flatten().map(String::as_str).chain([self.torque()]);
        let columns = columns.flat_map(|text| match joints {
            2 => text.split(',').collect(),
            _ => vec![text],
        });
        let columns: Vec<&str> = columns.collect();
        let reading = python::reading(file, &columns)?;
        let converted = self.conversion(file, &columns);
        let number = |number: &Number| match number {
            Number::Given(value) => Some(*value),
            Number::Named(_) => None,
        };
        let gain = |gain: &Option<Number>| gain.as_ref().map_or(Some(None), |g| number(g).map(Some));
        let constant = number(&self.torque_constant)?;
        let of = |column: &Option<String>| column.as_deref().map(named);
        let call = Call::new("flexure.identify_joint")
            .by_place(named(self.torque()))
            .with("position", of(&self.position))
            .with("motor", of(&self.motor))
            .with("link", of(&self.link))
            .with("velocity", of(&self.velocity))
            .with("motor_inertia", self.motor_inertia)
            .flag("gravity", self.gravity)
            .flag("spring", self.spring)
            .flag("prismatic", self.prismatic)
            .with("level", (self.band != 0.95).then_some(self.band))
            .with("torque_constant", (constant != 1.0).then_some(constant))
            .with("gear_ratio", (self.gear_ratio != 1.0).then_some(self.gear_ratio))
            .with("reference", of(&self.reference))
            .with("kp", gain(&self.kp)?)
            .with("kv", gain(&self.kv)?)
            .with("dt", Some(sample_time))
            .code("data=record");
        let report = Call::new("joint.report").by_place(self.report.as_ref()?.to_str()?);
        Some(format!(
            "{reading}{converted}joint = {}\n{}",
            call.text(),
            report.text()
        ))
    }

    /// The line that converts the units of columns, where the command does.
    fn conversion(&self, file: &RecordFile, columns: &[&str]) -> String {
        if self.reference.is_some() {
            return String::new();
        }
        let torques: Vec<&str> = self.torque().split(',').collect();
        let pairs: serde_json::Map<String, Value> = columns
            .iter()
            .filter_map(|column| {
                let quantity = if torques.contains(column) {
                    Quantity::Effort
                } else if self.velocity.as_deref() == Some(column) {
                    Quantity::Rate
                } else {
                    Quantity::Angle
                };
                let unit = quantity.unit(self.prismatic);
                let (_, own) = in_unit(file, column, unit).ok()?;
                Some(((*column).to_owned(), json!([own?, unit])))
            })
            .collect();
        match pairs.is_empty() {
            true => String::new(),
            false => format!("record = flexure.prepare.convert(record, {})\n", Value::from(pairs)),
        }
    }
}
