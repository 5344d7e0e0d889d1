//! Chains of links that commands are given: URDF, chain files and presets.

use std::path::Path;

use anyhow::{Result, bail};
use flexure::manipulator::chain::{Base, Chain, ChainPreset, DrivenChain, RotorCoupling};
use flexure::text::{list, shown_path};
use flexure_io::arm::{ChainFile, chain_file_of_toml, is_chain};
use flexure_io::read_text;
use flexure_io::urdf::{UrdfOptions, parse_urdf};

use crate::arguments::Usage;

/// A preset by its name.
pub fn preset(name: &str) -> Option<ChainPreset> {
    ChainPreset::ALL.into_iter().find(|preset| preset.name() == name)
}

/// A chain with rigid joints.
pub fn rigid(chain: Chain) -> Result<ChainFile> {
    Ok(ChainFile::Chain(DrivenChain::new(chain, &[], RotorCoupling::None)?))
}

/// Whether a file is a URDF, by its name.
pub fn is_urdf(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("urdf"))
}

/// How a URDF stands: its base, and the gravity of the ground or none.
pub fn urdf_options(free_base: bool, no_gravity: bool) -> UrdfOptions {
    let ground = UrdfOptions::default();
    UrdfOptions {
        base: if free_base { Base::Free } else { ground.base },
        gravity: if no_gravity { [0.0; 3] } else { ground.gravity },
    }
}

/// A chain of rigid links on a base that does not move, with its name.
pub struct Robot {
    pub chain: DrivenChain,
    pub name: String,
}

impl Robot {
    /// Whether a file is that of a chain; others are two-link arms'.
    ///
    /// # Errors
    /// For a file that cannot be read.
    pub fn is_chain(path: &Path) -> Result<bool> {
        let is_preset = path.to_str().and_then(preset).is_some();
        Ok(is_preset || is_urdf(path) || is_chain(&read_text(path)?))
    }

    /// From a URDF, a chain file, or a preset's name.
    ///
    /// # Errors
    /// Those of the file; for a free base, and for links that are no segments but finite elements or modes.
    pub fn read(path: &Path, no_gravity: bool) -> Result<Robot> {
        let preset = path.to_str().and_then(preset);
        if no_gravity && !is_urdf(path) {
            let what = if preset.is_some() { "preset" } else { "chain file" };
            return Err(Usage(format!("--no-gravity is for URDF; a {what} says its gravity itself")).into());
        }
        let file = match preset {
            Some(preset) => rigid(Chain::new(&preset.parameters())?)?,
            None => chain_file(path, no_gravity)?,
        };
        let name = path
            .file_name()
            .map_or_else(|| shown_path(path), |name| name.to_string_lossy().into_owned());
        match file {
            ChainFile::Chain(chain) if chain.coupling() != RotorCoupling::None => bail!(
                "{}: its rotors act on the links that carry them, which the equation of a single joint leaves out; set rotors = \"none\". With high \
                 gear ratios, the difference is small",
                shown_path(path)
            ),
            ChainFile::Chain(chain) if chain.chain().base() == Base::Fixed => Ok(Robot { chain, name }),
            ChainFile::Chain(_) => bail!(
                "{}: its base floats, and the log of its joints does not have its motion; give a chain on a fixed base",
                shown_path(path)
            ),
            ChainFile::FlexibleArm(_) => bail!(
                "{}: its beams are finite elements or modes; give links that are rigid, or make the beams segments",
                shown_path(path)
            ),
        }
    }

    /// The joint that an axis is: by its number, counted from 1, or its name.
    ///
    /// # Errors
    /// Names the joints.
    pub fn joint(&self, axis: &str) -> Result<usize, Usage> {
        let joints = self.chain.chain().joints();
        let by_name = joints.iter().position(|joint| joint == axis);
        let number = axis.parse::<usize>().ok().and_then(|number| number.checked_sub(1));
        let by_number = number.filter(|&i| i < joints.len());
        by_name.or(by_number).ok_or_else(|| {
            Usage(format!(
                "axis {axis} is no joint of {}: give numbers from 1 to {}, or the names {}",
                self.name,
                joints.len(),
                list(joints)
            ))
        })
    }
}

/// The chain or flexible arm of a file.
fn chain_file(path: &Path, no_gravity: bool) -> Result<ChainFile> {
    let text = read_text(path)?;
    if is_urdf(path) {
        return rigid(parse_urdf(&text, path, &urdf_options(false, no_gravity))?);
    }
    match is_chain(&text) {
        true => Ok(chain_file_of_toml(&text, &shown_path(path))?),
        false => bail!(
            "{}: this is no chain: give a URDF (its name ends in .urdf), a chain file, or a preset; --motor, --link and --torque with two \
             columns each take a two-link arm",
            shown_path(path)
        ),
    }
}
