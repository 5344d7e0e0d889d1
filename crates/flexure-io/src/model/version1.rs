//! Version 1 of model files: input names joined by commas, offsets as straight lines, blocks without names.

use std::collections::BTreeMap;

use flexure::Block;
use flexure::nonlinearity::{Curve, Outside};
use flexure::validation::Estimated;
use serde::Deserialize;
use serde_json::Value;

use super::{BlockLabel, ModelFile, ModelPath};

/// What `version` says.
pub(super) const VERSION: u64 = 1;

#[derive(Deserialize)]
struct Version1 {
    flexure: String,
    structure: String,
    method: String,
    /// The input's name; several names are separated by commas.
    input: String,
    output: String,
    #[serde(default)]
    sample_time: Option<f64>,
    delay: usize,
    order: usize,
    block: Block,
    #[serde(default)]
    settling: Option<usize>,
    #[serde(default)]
    noise_model: Option<Vec<f64>>,
    #[serde(default)]
    estimated: Option<Estimated>,
    #[serde(default)]
    identification: Value,
}

/// Reads version 1 as today's.
pub(super) fn parse(bytes: &[u8]) -> serde_json::Result<ModelFile> {
    let old: Version1 = serde_json::from_slice(bytes)?;
    let inputs: Vec<String> = match old.block.inputs() {
        1 => vec![old.input],
        _ => old.input.split(',').map(|name| name.trim().to_owned()).collect(),
    };
    let block = with_offsets(old.block);
    let paths = paths(&block, &inputs, &old.structure, &old.identification);
    Ok(ModelFile {
        flexure: old.flexure,
        method: old.method,
        inputs,
        output: old.output,
        units: BTreeMap::new(),
        sample_time: old.sample_time,
        delay: old.delay,
        order: old.order,
        block,
        is_sum: paths.len() > 1 || ["parallel", "multiple-inputs"].contains(&old.structure.as_str()),
        paths,
        settling: old.settling,
        noise_model: old.noise_model,
        estimated: old.estimated,
        reading: BTreeMap::new(),
        missing: false,
        robust: false,
        records: Vec::new(),
        structure: old.structure,
        identification: old.identification,
    })
}

/// The number that a line of slope 1 adds.
fn offset(curve: &Curve) -> Option<f64> {
    let (x, y) = (curve.x(), curve.y());
    let first = curve.outside() == Outside::Linear && x.len() == 2 && x[0] == 0.0;
    (first && y[1] == x[1] + y[0]).then(|| y[0])
}

/// The block, with a last straight line of slope 1 replaced by an offset.
fn with_offsets(block: Block) -> Block {
    let Block::Series(mut blocks) = block else {
        return block;
    };
    if blocks.len() > 1
        && let Some(Block::Static(curve)) = blocks.last()
        && let Some(offset) = offset(curve)
    {
        blocks.pop();
        blocks.push(Block::Offset(offset));
    }
    Block::Series(blocks)
}

/// The names of the blocks of every path, with the facts about each from elsewhere in the file.
fn paths(block: &Block, inputs: &[String], structure: &str, identification: &Value) -> Vec<ModelPath> {
    let branches = match block {
        Block::Parallel(branches) | Block::Inputs(branches) => Some(branches),
        Block::Series(blocks) => match blocks.first() {
            Some(Block::Parallel(branches) | Block::Inputs(branches)) => Some(branches),
            _ => None,
        },
        _ => None,
    };
    let Some(branches) = branches else {
        let [breakpoints, kinks] = ["breakpoints", "kinks"].map(|name| curve_lists(identification, name));
        return vec![path(
            block,
            inputs.to_vec(),
            breakpoints,
            kinks,
            identification.get("linear"),
        )];
    };
    let own = |name: &str, i: usize| vec![numbers(identification.get(name).and_then(|list| list.get(i)))];
    if structure == "wiener-hammerstein" {
        // The second branch acts between the samples.
        let [breakpoints, kinks] = ["breakpoints", "kinks"].map(|name| curve_lists(identification, name));
        let mut whole = path(&branches[0], inputs.to_vec(), breakpoints, kinks, None);
        let second = branches
            .get(1)
            .map(|b| path(b, inputs.to_vec(), Vec::new(), Vec::new(), None));
        whole
            .blocks
            .extend(second.into_iter().flat_map(|p| p.blocks).map(|label| BlockLabel {
                role: format!("intersample_{}", label.role),
                ..label
            }));
        return vec![whole];
    }
    let of = |(i, branch): (usize, &Block)| {
        let entering = match inputs.len() {
            1 => inputs.to_vec(),
            _ => inputs.get(i).cloned().into_iter().collect(),
        };
        path(branch, entering, own("breakpoints", i), own("kinks", i), None)
    };
    branches.iter().enumerate().map(of).collect()
}

/// The lists of the first and of the second nonlinearity in series.
fn curve_lists(identification: &Value, name: &str) -> Vec<Vec<f64>> {
    let first = identification.get(format!("input_{name}")).or(identification.get(name));
    vec![numbers(first), numbers(identification.get(format!("output_{name}")))]
}

/// The numbers of a list; empty if a value is no number.
fn numbers(list: Option<&Value>) -> Vec<f64> {
    let list = list.and_then(Value::as_array);
    list.map_or_else(Vec::new, |l| l.iter().filter_map(Value::as_f64).collect())
}

/// The blocks in series, with the breakpoints and kinks of each curve and the standard errors of the only linear block.
fn path(
    block: &Block,
    inputs: Vec<String>,
    breakpoints: Vec<Vec<f64>>,
    kinks: Vec<Vec<f64>>,
    errors: Option<&Value>,
) -> ModelPath {
    let mut kinds = Vec::new();
    collect(block, &mut kinds);
    let linear = kinds.iter().filter(|kind| **kind == "linear").count();
    let (mut curves_before, mut linear_before) = (0, 0);
    let error = |name: &str| errors.and_then(|e| e.get(name)).filter(|e| e.is_array());
    let label = |kind: &str| match kind {
        "linear" => {
            let role = ["front", "back"].get(linear_before).filter(|_| linear > 1);
            linear_before += 1;
            BlockLabel {
                role: (*role.unwrap_or(&"linear")).to_owned(),
                b_errors: error("b_errors").map(|e| numbers(Some(e))),
                a_errors: error("a_errors").map(|e| numbers(Some(e))),
                ..BlockLabel::default()
            }
        }
        "nonlinearity" => {
            let role = ["nonlinearity", "output_nonlinearity"].get(curves_before);
            let of = |lists: &[Vec<f64>]| lists.get(curves_before).cloned().unwrap_or_default();
            let label = BlockLabel {
                role: (*role.unwrap_or(&"nonlinearity")).to_owned(),
                breakpoints: of(&breakpoints),
                kinks: of(&kinks),
                ..BlockLabel::default()
            };
            curves_before += 1;
            label
        }
        kind => BlockLabel {
            role: kind.to_owned(),
            ..BlockLabel::default()
        },
    };
    ModelPath {
        inputs,
        blocks: kinds.iter().copied().map(label).collect(),
    }
}

/// The kinds of the blocks in series.
fn collect(block: &Block, kinds: &mut Vec<&'static str>) {
    match block {
        Block::Series(blocks) | Block::Parallel(blocks) | Block::Inputs(blocks) => {
            blocks.iter().for_each(|b| collect(b, kinds));
        }
        Block::Static(_) | Block::Surface(_) => kinds.push("nonlinearity"),
        Block::Linear(_) => kinds.push("linear"),
        Block::Feedback(_) => kinds.push("nonlinearity"),
        Block::Narx(_) => kinds.push("narx"),
        Block::Volterra(_) => kinds.push("volterra"),
        Block::Offset(_) => {}
    }
}
