//! The one result of all identifications: the path of each input block by block, the model, and whether it holds.
//!
//! Text, JSON, model file and page are each one walk over an [`Identification`]. A result that only one structure has is a [`Detail`]: a
//! named value, which the same walks print, save and show.

mod blocks;
mod detail;
mod flats;
mod regions;
mod value;

use std::borrow::Cow;

use super::auto::StructureComparison;
use super::outcome::Verdict;
use super::warning::Warning;
use crate::linear::TransferFunction;
use crate::model::Block;
use crate::nonlinearity::Curve;
pub use blocks::{
    BlockKind, CoefficientErrors, FeedbackBlock, ImpulseEstimate, LinearBlock, LoopPart, NamedBlock, Path, StaticBlock,
};
pub use detail::{Detail, Place, Score, Shown};
pub use regions::{PoleCovariance, ResponseError};
pub use value::{Value, Values};

/// The name of a block structure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct StructureName {
    /// On the command line and in files, for example "wiener-hammerstein".
    pub key: &'static str,
    /// For reading, within a sentence, for example "Wiener-Hammerstein".
    pub title: &'static str,
}

impl std::fmt::Display for StructureName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.title)
    }
}

/// An identified system, with all choices of its identification.
#[derive(Debug, Clone, PartialEq)]
pub struct Identification {
    /// The structure.
    pub structure: StructureName,
    /// What its blocks are, for example "linear dynamics, then a static nonlinearity".
    pub description: String,
    /// The method's name, for example "prediction-error".
    pub method: Cow<'static, str>,
    /// The inputs' columns.
    pub inputs: Vec<String>,
    /// The output's column.
    pub output: String,
    /// The model, ready to simulate.
    pub model: Block,
    /// The paths of the inputs; the model's output is the sum of the paths' outputs.
    pub paths: Vec<Path>,
    /// Whether the structure is a sum of paths, even if it has only one.
    pub is_sum: bool,
    /// A constant that is added to the sum of the paths.
    pub output_offset: f64,
    /// The number of poles of all linear blocks.
    pub order: usize,
    /// The delay of the output in samples; for several paths, the smallest.
    pub delay: usize,
    /// The number of parameters that the data determine.
    pub parameters: usize,
    /// What was tried, in order; the last one was chosen.
    pub tried: Vec<Values>,
    /// Results that only this structure has.
    pub details: Vec<Detail>,
    /// The autoregression 1, r_1, r_2, ... that whitens the output error; `None` without a model of the noise.
    pub noise_model: Option<Vec<f64>>,
    /// The evidence for this structure and against others, if several were compared.
    pub comparison: Option<StructureComparison>,
    /// Samples `0..fitted` (of all experiments, one after the other) were used for the fit, the rest for the verdict.
    pub fitted: usize,
    /// The free-run output over all samples.
    pub predicted: Vec<f64>,
    /// The verdict on the samples from `fitted` on; for several verdicts, the one with the strongest evidence against the model.
    pub verdict: Verdict,
    /// For several inputs, one verdict for each input and then one for each pair of inputs. The fit is the same in all; the residual tests
    /// look for this input, or the product of these inputs' deviations, in the error.
    pub verdicts: Vec<Verdict>,
    /// What the user should know.
    pub warnings: Vec<Warning>,
}

impl Identification {
    /// The free-run fit on fresh data, percent.
    pub fn fit_percent(&self) -> f64 {
        self.verdict.measures.fit_percent
    }

    /// Whether the model holds; with several inputs, for each of them and for every pair.
    pub fn holds(&self) -> bool {
        self.verdict.holds() && self.verdicts.iter().all(Verdict::holds)
    }

    /// All blocks with their roles, path by path.
    pub fn blocks(&self) -> impl Iterator<Item = &NamedBlock> {
        self.paths.iter().flat_map(|path| &path.blocks)
    }

    /// The first block of this role.
    pub fn block(&self, role: &str) -> Option<&NamedBlock> {
        self.blocks().find(|b| b.role == role)
    }

    /// The heading of the path of this index: by its input, if the paths have different inputs.
    pub fn path_title(&self, index: usize) -> String {
        match &self.paths[index].inputs[..] {
            [input] if self.inputs.len() > 1 => format!("from '{input}'"),
            _ => format!("branch {}", index + 1),
        }
    }

    /// The first linear block of this role, for example "linear", "front" or "back".
    pub fn linear(&self, role: &str) -> Option<&TransferFunction> {
        self.block(role).and_then(NamedBlock::linear).map(|g| &g.system)
    }

    /// The first static nonlinearity of this role, for example "nonlinearity".
    pub fn curve(&self, role: &str) -> Option<&Curve> {
        self.block(role).and_then(NamedBlock::curve).map(|c| &c.curve)
    }

    /// The value of the detail of this name.
    pub fn detail(&self, key: &str) -> Option<&Value> {
        self.details.iter().find(|d| d.key == key).map(|d| &d.value)
    }
}
