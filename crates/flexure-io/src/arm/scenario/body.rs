//! What moves in a scenario, and what its controllers know of it: the tables `[plant]` and `[model]`.

use std::path::Path;

use flexure::control::flexible_link::{FlexibleLink, FlexibleLinkParameters};
use flexure::manipulator::{Arm, ArmParameters, JointKind, Link};
use flexure::text::exact;
use serde::Deserialize;

use super::super::error::ArmError;
use super::super::file::{ArmFile, Source};
use super::super::presets::{PRESETS, preset};
use super::super::record::is_below;
use super::at;
use crate::text::read_text;

/// What moves, and what the controllers know of it.
#[derive(Debug, Clone, PartialEq)]
pub enum Body {
    /// Two links with flexible joints.
    Arm {
        /// What moves.
        plant: Box<ArmParameters>,
        /// What the controllers know.
        model: Box<ArmParameters>,
    },
    /// A flexible link on a hub.
    Link {
        /// What moves.
        plant: FlexibleLinkParameters,
        /// What the controllers know.
        model: FlexibleLinkParameters,
    },
}

#[derive(Deserialize, Clone)]
#[serde(deny_unknown_fields)]
pub(super) struct BodyTable {
    pub arm: Option<String>,
    stiffness: Option<f64>,
    friction: Option<bool>,
    cubic: Option<bool>,
    windup: Option<bool>,
    link: Option<LinkTable>,
}

#[derive(Deserialize, Clone, Copy)]
#[serde(deny_unknown_fields)]
struct LinkTable {
    length: Option<f64>,
    stiffness: Option<f64>,
    density: Option<f64>,
    hub: Option<f64>,
    payload: Option<f64>,
    damping: Option<f64>,
}

impl Body {
    pub(super) fn new(
        source: &Source,
        plant: &BodyTable,
        model: Option<&BodyTable>,
        folder: &Path,
    ) -> Result<Self, ArmError> {
        let Some(known) = &plant.link else {
            if model.is_some_and(|model| model.link.is_some()) {
                return Err(source.value("model.link", "the plant is an arm; its model is one, too"));
            }
            let nominal = || BodyTable {
                stiffness: None,
                ..plant.clone()
            };
            let of_model = match model {
                Some(model) => arm(source, "model", model, folder),
                None => arm(source, "plant", &nominal(), folder),
            };
            return Ok(Body::Arm {
                plant: Box::new(arm(source, "plant", plant, folder)?),
                model: Box::new(of_model?),
            });
        };
        for (table, body) in [("plant", Some(plant)), ("model", model)] {
            let Some(body) = body else { continue };
            let of_arms = [
                ("arm", body.arm.is_some()),
                ("stiffness", body.stiffness.is_some()),
                ("friction", body.friction.is_some()),
                ("cubic", body.cubic.is_some()),
                ("windup", body.windup.is_some()),
            ];
            if let Some((name, _)) = of_arms.iter().find(|(_, given)| *given) {
                let reason = "is only for arms; leave it out for a flexible link";
                return Err(source.value(format!("{table}.{name}"), reason));
            }
        }
        let plant = link(source, "plant.link", known, None)?;
        let model = match model.and_then(|model| model.link.as_ref()) {
            Some(model) => link(source, "model.link", model, Some(plant))?,
            None => plant,
        };
        Ok(Body::Link { plant, model })
    }

    /// The links from the base to the tip.
    pub(super) fn links(&self) -> [Link; 2] {
        match self {
            Body::Arm { plant, .. } => plant.links,
            Body::Link { plant, .. } => [plant.length, 0.0].map(|length| Link {
                mass: plant.density * length,
                length,
                com: 0.5 * length,
                inertia: plant.density * length.powi(3) / 12.0,
            }),
        }
    }
}

/// The flexible link of a table. Missing values are taken from `known`; without it, they are refused.
fn link(
    source: &Source,
    table: &str,
    given: &LinkTable,
    known: Option<FlexibleLinkParameters>,
) -> Result<FlexibleLinkParameters, ArmError> {
    let value = |name: &str, unit: &str, given: Option<f64>, of: fn(&FlexibleLinkParameters) -> f64| {
        given
            .or(known.as_ref().map(of))
            .ok_or_else(|| source.value(format!("{table}.{name}"), format!("missing; give it in {unit}")))
    };
    let parameters = FlexibleLinkParameters {
        length: value("length", "m", given.length, |p| p.length)?,
        stiffness: value("stiffness", "N m^2 (EI)", given.stiffness, |p| p.stiffness)?,
        density: value("density", "kg/m", given.density, |p| p.density)?,
        hub: value("hub", "kg m^2", given.hub, |p| p.hub)?,
        payload: value("payload", "kg", given.payload, |p| p.payload)?,
        damping: value("damping", "parts of the critical damping", given.damping, |p| p.damping)?,
    };
    at(source, table, FlexibleLink::new(&parameters)).map(|_| parameters)
}

/// The arm that a table names, with the changes in that table.
fn arm(source: &Source, table: &str, choice: &BodyTable, folder: &Path) -> Result<ArmParameters, ArmError> {
    let key = |name: &str| format!("{table}.{name}");
    let Some(name) = &choice.arm else {
        return Err(source.value(
            key("arm"),
            "missing; name an arm, or describe a flexible link under [plant.link]",
        ));
    };
    let known = PRESETS.iter().any(|(preset, _)| preset == name);
    let mut arm = match known {
        true => preset(name)?.arm,
        false => {
            if !name.ends_with(".toml") || !is_below(folder, Path::new(name)) {
                let names: Vec<&str> = PRESETS.iter().map(|(name, _)| *name).collect();
                let reason = format!(
                    "'{}' is neither a preset ({}) nor an arm file (.toml) in the scenario's folder or below",
                    name,
                    names.join(", ")
                );
                return Err(source.value(key("arm"), reason));
            }
            let path = folder.join(name);
            let text = read_text(&path).map_err(|error| source.value(key("arm"), error.to_string()))?;
            ArmFile::from_toml_str(&text, name)?.arm
        }
    };
    if arm.model == JointKind::Rigid {
        return Err(source.value(key("arm"), "an arm with rigid joints, but control is of flexible ones"));
    }
    if let Some(joint) = arm.joints.iter().position(|joint| joint.locked) {
        let reason = format!("its joint {} is locked, but control moves both", joint + 1);
        return Err(source.value(key("arm"), reason));
    }
    if let Some(factor) = choice.stiffness {
        if !(1e-3..=1e3).contains(&factor) {
            return Err(source.value(
                key("stiffness"),
                format!("{}, but must be a factor from 0.001 to 1000", exact(factor)),
            ));
        }
        for joint in &mut arm.joints {
            for value in [
                &mut joint.stiffness,
                &mut joint.cubic,
                &mut joint.linear,
                &mut joint.windup,
            ] {
                *value *= factor;
            }
        }
    }
    for (part, value) in [
        (&mut arm.parts.friction, choice.friction),
        (&mut arm.parts.cubic, choice.cubic),
        (&mut arm.parts.windup, choice.windup),
    ] {
        *part = value.unwrap_or(*part);
    }
    Arm::new(arm).map_err(|error| source.value(table, error.to_string()))?;
    Ok(arm)
}
