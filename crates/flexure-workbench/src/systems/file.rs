//! An identified system as a model file.

use std::collections::BTreeMap;

use flexure::identify::result::{NamedBlock, Path};
use flexure_io::{BlockLabel, ModelFile, ModelPath};

use super::SETTLED;
use super::json::findings;
use super::task::Identified;

impl Identified {
    /// The model file that `flexure identify -o` writes, from which `predict` and `validate` work.
    pub fn model(&self) -> ModelFile {
        let result = &self.result;
        ModelFile {
            flexure: ModelFile::CURRENT.to_owned(),
            structure: result.structure.key.to_owned(),
            method: result.method.clone().into_owned(),
            inputs: result.inputs.clone(),
            output: result.output.clone(),
            units: self.labels.units(result.inputs.iter().chain([&result.output])),
            sample_time: self.sample_time,
            delay: result.delay,
            order: result.order,
            block: result.model.clone(),
            paths: result.paths.iter().map(path).collect(),
            is_sum: result.is_sum,
            settling: Some(result.model.settling(SETTLED)),
            noise_model: result.noise_model.clone(),
            estimated: result.verdict.estimated,
            reading: BTreeMap::new(),
            missing: self.missing,
            robust: self.robust,
            records: self.records.clone(),
            identification: findings(self, |detail| detail.saved),
        }
    }
}

/// The names of the blocks of a path, and further facts about each that the block itself does not hold.
fn path(path: &Path) -> ModelPath {
    ModelPath {
        inputs: path.inputs.clone(),
        blocks: path.blocks.iter().map(label).collect(),
    }
}

fn label(block: &NamedBlock) -> BlockLabel {
    let curve = block.curve();
    let errors = block.linear().and_then(|linear| linear.errors.as_ref());
    BlockLabel {
        role: block.role.clone().into_owned(),
        title: block.title.clone().into_owned(),
        breakpoints: curve.map_or_else(Vec::new, |c| c.breakpoints.clone()),
        kinks: curve.map_or_else(Vec::new, |c| c.kinks.clone()),
        b_errors: errors.map(|e| e.b.clone()),
        a_errors: errors.map(|e| e.a.clone()),
        covariance: errors.map_or_else(Vec::new, |e| e.covariance.clone()),
    }
}
