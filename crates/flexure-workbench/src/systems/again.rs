//! A model file applied to another record, for the page of an identification.

use anyhow::{Context as _, Result};
use flexure::Block;
use flexure::identify::Structure;
use flexure::identify::result::{
    BlockKind, CoefficientErrors, FeedbackBlock, Identification, LinearBlock, NamedBlock, Path, StaticBlock,
};
use flexure::nonlinearity::Curve;
use flexure::text::capitalised;
use flexure_io::{BlockLabel, ModelFile, RecordFile, RecordMark};
use serde_json::Value;

use super::columns::SystemColumns;
use super::task::Identified;
use super::validation::{Judged, Judging};
use crate::labels::Labels;

impl Identified {
    /// The model of a file, judged on a record: the result of [`Judged::new`], with the model's blocks. On the record that the model
    /// was identified from, the samples that were fitted are left out, unless `judging` says how many to skip.
    ///
    /// # Errors
    /// As [`Judged::new`]; for a model file of a structure that this version does not know.
    pub fn again(model: &ModelFile, file: &RecordFile, columns: SystemColumns, judging: Judging) -> Result<Self> {
        let structure = Structure::by_name(&model.structure).with_context(|| {
            format!(
                "the model's structure '{}' is not known to this version",
                model.structure
            )
        })?;
        let fitted = samples_fitted(model, file, columns)?;
        let judging = Judging {
            skip: judging.skip.or(fitted),
            ..judging
        };
        let judged = Judged::new(model, file, columns, judging)?;
        let judged_skip = judged.skip;
        let warnings = judged.outlier_warning().into_iter().collect();
        let inputs: Vec<String> = columns.inputs.iter().map(|&name| name.to_owned()).collect();
        let (paths, output_offset) = named(model, &inputs);
        Ok(Identified {
            result: Identification {
                structure: structure.name,
                description: structure.description.to_owned(),
                method: model.method.clone().into(),
                inputs,
                output: columns.output.to_owned(),
                model: model.block.clone(),
                paths,
                is_sum: model.is_sum,
                output_offset,
                order: model.order,
                delay: model.delay,
                parameters: model.estimated.map_or(0, |e| e.parameters),
                tried: Vec::new(),
                details: Vec::new(),
                noise_model: model.noise_model.clone(),
                comparison: None,
                fitted: judged.skip,
                predicted: judged.free.output,
                verdicts: vec![judged.verdict.clone()],
                verdict: judged.verdict,
                warnings,
            },
            sample_time: model.sample_time,
            records: model.records.clone(),
            missing: judging.missing,
            robust: judging.robust,
            is_other_record: fitted != Some(judged_skip),
            labels: Labels::new(file),
            periodic: None,
            in_parts: None,
        })
    }
}

/// The samples of a record that a model was fitted to, if it was identified from this record alone.
fn samples_fitted(model: &ModelFile, file: &RecordFile, columns: SystemColumns) -> Result<Option<usize>> {
    let connected = [columns.inputs, &[columns.output]].concat();
    let mark = RecordMark::new(&file.name(), &file.record, &connected)?;
    match model.records.as_slice() {
        [own] if own.same_samples(&mark) => {
            let fitted = model.identification.get("samples_fitted").and_then(Value::as_u64);
            Ok(fitted.map(|fitted| fitted as usize))
        }
        _ => Ok(None),
    }
}

/// The paths of a model with their names, and what is added to their sum.
fn named(model: &ModelFile, inputs: &[String]) -> (Vec<Path>, f64) {
    let mut labels = model.paths.iter().flat_map(|path| &path.blocks);
    let mut blocks = Vec::new();
    let output_offset = collect(&model.block, &mut labels, &mut blocks);
    let mut blocks = blocks.into_iter();
    let paths = model.paths.iter().map(|path| Path {
        // The record may have other names for the inputs than the model.
        inputs: path
            .inputs
            .iter()
            .map(|name| renamed(name, &model.inputs, inputs))
            .collect(),
        blocks: blocks.by_ref().take(path.blocks.len()).collect(),
    });
    (paths.collect(), output_offset)
}

fn renamed(name: &str, own: &[String], inputs: &[String]) -> String {
    let place = own.iter().position(|own| own == name);
    place
        .and_then(|i| inputs.get(i))
        .map_or(name, String::as_str)
        .to_owned()
}

/// Appends the blocks that are neither compounds nor offsets, in order, each with its label. Returns the sum of the offsets after them.
fn collect<'a>(block: &Block, labels: &mut impl Iterator<Item = &'a BlockLabel>, named: &mut Vec<NamedBlock>) -> f64 {
    match block {
        Block::Series(blocks) => blocks.iter().fold(0.0, |before, block| match block {
            Block::Offset(offset) => before + offset,
            // An offset before a block is no offset of the output.
            block => collect(block, labels, named),
        }),
        Block::Parallel(blocks) | Block::Inputs(blocks) => {
            blocks.iter().map(|block| collect(block, labels, named)).sum()
        }
        Block::Offset(offset) => *offset,
        block => {
            let label = labels.next().cloned().unwrap_or_default();
            named.extend(kind(block, &label).map(|kind| NamedBlock {
                between_samples: label.role.starts_with("intersample_"),
                ..NamedBlock::new(label.role.clone(), title(&label), kind)
            }));
            0.0
        }
    }
}

/// The standard errors of a linear block, where the file has them.
fn errors(label: &BlockLabel) -> Option<CoefficientErrors> {
    let (b, a) = (label.b_errors.clone()?, label.a_errors.clone()?);
    Some(CoefficientErrors {
        b,
        a,
        covariance: label.covariance.clone(),
    })
}

/// The heading of a block; files of earlier versions have only its role.
fn title(label: &BlockLabel) -> String {
    match label.title.is_empty() {
        true => capitalised(&label.role.replace('_', " ")),
        false => label.title.clone(),
    }
}

/// A curve with the facts of its label.
fn nonlinearity(curve: &Curve, label: &BlockLabel) -> StaticBlock {
    match label.breakpoints.is_empty() {
        true => StaticBlock::new(curve.clone(), "curve"),
        false => StaticBlock::spline(curve.clone(), label.breakpoints.clone(), label.kinks.clone()),
    }
}

/// A block that is neither a compound nor an offset, with the facts of its label.
fn kind(block: &Block, label: &BlockLabel) -> Option<BlockKind> {
    Some(match block {
        Block::Static(curve) => BlockKind::Static(nonlinearity(curve, label)),
        Block::Feedback(model) => BlockKind::Feedback(Box::new(FeedbackBlock {
            model: (**model).clone(),
            nonlinearity: nonlinearity(&model.nonlinearity, label),
        })),
        Block::Linear(system) => BlockKind::Linear(LinearBlock {
            system: system.clone(),
            errors: errors(label),
            impulse: None,
        }),
        Block::Surface(surface) => BlockKind::Surface(surface.clone()),
        Block::Narx(model) => BlockKind::Narx(model.clone()),
        Block::Volterra(model) => BlockKind::Volterra(model.clone()),
        Block::Series(_) | Block::Parallel(_) | Block::Inputs(_) | Block::Offset(_) => return None,
    })
}
