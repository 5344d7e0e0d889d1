//! The tables of a chain file.

use serde::Deserialize;

use super::beam_table::BeamTable;
use super::values::list;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    pub chain: ChainTable,
    pub load: Option<Load>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ChainTable {
    #[serde(default)]
    pub base: BaseName,
    #[serde(default, deserialize_with = "list::<_, _, 3>")]
    pub gravity: Option<[f64; 3]>,
    #[serde(default)]
    pub rotors: Rotors,
    pub body: Option<Body>,
    pub link: Vec<LinkTable>,
}

#[derive(Deserialize, Default, Clone, Copy)]
#[serde(rename_all = "lowercase")]
pub(super) enum BaseName {
    #[default]
    Fixed,
    Free,
}

#[derive(Deserialize, Default, Clone, Copy)]
#[serde(rename_all = "lowercase")]
pub(super) enum Rotors {
    #[default]
    None,
    Inertial,
    Complete,
}

#[derive(Deserialize, Default, Clone, Copy)]
#[serde(rename_all = "lowercase")]
pub(super) enum Motion {
    #[default]
    Revolute,
    Prismatic,
    Fixed,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Body {
    pub mass: f64,
    #[serde(default, deserialize_with = "list::<_, _, 3>")]
    pub com: [f64; 3],
    #[serde(deserialize_with = "list::<_, _, 6>")]
    pub inertia: [f64; 6],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Load {
    pub link: Option<String>,
    pub mass: f64,
    #[serde(default, deserialize_with = "list::<_, _, 3>")]
    pub com: Option<[f64; 3]>,
    #[serde(default, deserialize_with = "list::<_, _, 6>")]
    pub inertia: Option<[f64; 6]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LinkTable {
    pub name: String,
    pub parent: Option<String>,
    pub joint: String,
    #[serde(rename = "type", default)]
    pub motion: Motion,
    #[serde(default, deserialize_with = "list::<_, _, 3>")]
    pub axis: Option<[f64; 3]>,
    #[serde(default, deserialize_with = "list::<_, _, 3>")]
    pub origin: Option<[f64; 3]>,
    #[serde(default, deserialize_with = "list::<_, _, 3>")]
    pub rpy: [f64; 3],
    #[serde(default, deserialize_with = "list::<_, _, 2>")]
    pub limits: Option<[f64; 2]>,
    pub mass: Option<f64>,
    #[serde(default, deserialize_with = "list::<_, _, 3>")]
    pub com: Option<[f64; 3]>,
    #[serde(default, deserialize_with = "list::<_, _, 6>")]
    pub inertia: Option<[f64; 6]>,
    pub drive: Option<toml::Table>,
    pub beam: Option<BeamTable>,
}

impl LinkTable {
    pub fn moves(&self) -> bool {
        !matches!(self.motion, Motion::Fixed)
    }

    pub fn axis(&self) -> [f64; 3] {
        self.axis.unwrap_or([0.0, 0.0, 1.0])
    }

    /// Where what the link carries sits without saying so.
    pub fn end(&self) -> [f64; 3] {
        self.beam.as_ref().map_or([0.0; 3], BeamTable::tip)
    }
}
