//! What a chain and a flexible arm have in common for a run.

use std::ops::ControlFlow;

use flexure::Record;
use flexure::manipulator::chain::{Base, ChainSimulation, DrivenChain, chain_columns, simulate_chain_watched};
use flexure::manipulator::flexible_arm::{flexible_arm_columns, simulate_flexible_arm_watched};
use flexure_io::arm::ChainFile;

use crate::arguments::Usage;

/// A chain or a flexible arm that is run.
pub struct Machine(pub ChainFile);

impl Machine {
    /// The names of the joints that move.
    pub fn joints(&self) -> Vec<String> {
        match &self.0 {
            ChainFile::Chain(chain) => chain.chain().joints().to_vec(),
            ChainFile::FlexibleArm(arm) => arm.joints().into_iter().map(|(name, _)| name.to_owned()).collect(),
        }
    }

    /// Whether each has a motor behind a spring.
    pub fn flexible(&self) -> Vec<bool> {
        match &self.0 {
            ChainFile::Chain(chain) => chain.flexible(),
            ChainFile::FlexibleArm(arm) => arm.joints().into_iter().map(|(_, flexible)| flexible).collect(),
        }
    }

    /// The names of the joints on which torques act.
    pub fn driven(&self) -> Vec<&String> {
        match &self.0 {
            ChainFile::Chain(chain) => chain.driven(),
            ChainFile::FlexibleArm(arm) => arm.driven(),
        }
    }

    /// The columns of its record.
    pub fn columns(&self) -> Vec<String> {
        match &self.0 {
            ChainFile::Chain(chain) => chain_columns(chain),
            ChainFile::FlexibleArm(arm) => flexible_arm_columns(arm),
        }
    }

    /// The chain that a page draws.
    pub fn drawn(&self) -> anyhow::Result<&DrivenChain> {
        match &self.0 {
            ChainFile::Chain(chain) => Ok(chain),
            ChainFile::FlexibleArm(_) => Err(Usage(
                "--report draws chains of rigid links; leave it out, or make the beams segments".to_owned(),
            )
            .into()),
        }
    }

    /// Refuses a base that cannot be moved.
    pub fn movable(&self) -> Result<(), Usage> {
        let why = match &self.0 {
            ChainFile::FlexibleArm(_) => "the base of beams of finite elements or modes; make the beams segments",
            ChainFile::Chain(_) if self.free_base() => "a base that floats, which moves by itself; make it fixed",
            ChainFile::Chain(_) => return Ok(()),
        };
        Err(Usage(format!("--base-motion cannot move {why}")))
    }

    /// Whether its base floats.
    pub fn free_base(&self) -> bool {
        match &self.0 {
            ChainFile::Chain(chain) => chain.chain().base() == Base::Free,
            ChainFile::FlexibleArm(arm) => arm.free_base(),
        }
    }

    /// At which values of a state the joints and the motors begin.
    pub fn places(&self) -> (usize, usize) {
        match &self.0 {
            ChainFile::Chain(chain) => {
                let positions = chain.chain().positions();
                (positions - chain.chain().joints().len(), positions)
            }
            ChainFile::FlexibleArm(arm) => (arm.first(), arm.coordinates()),
        }
    }

    /// A run from rest, with all joints at zero.
    pub fn at_rest(&self, duration: f64, sample_time: f64) -> flexure::Result<ChainSimulation> {
        match &self.0 {
            ChainFile::Chain(chain) => ChainSimulation::new(chain, duration, sample_time),
            ChainFile::FlexibleArm(arm) => {
                ChainSimulation::from_state(vec![0.0; arm.dimension()], duration, sample_time)
            }
        }
    }

    /// Its record.
    pub fn simulate(
        &self,
        torques: &[&[f64]],
        options: &ChainSimulation,
        watch: &mut dyn FnMut(f64) -> ControlFlow<()>,
    ) -> flexure::Result<Record> {
        match &self.0 {
            ChainFile::Chain(chain) => simulate_chain_watched(chain, torques, options, watch),
            ChainFile::FlexibleArm(arm) => simulate_flexible_arm_watched(arm, torques, options, watch),
        }
    }
}
