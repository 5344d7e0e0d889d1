//! From a model and its free run to the result.

use std::ops::ControlFlow;

use super::block::Prepared;
use super::checks::warn_of_range;
use super::outcome::Verdict;
use super::request::{Progress, Request, Structure};
use super::result::{BlockKind, Detail, Identification, NamedBlock, Path, Place, Score, Values};
use super::samples::Samples;
use super::warning::Warning;
use crate::error::{Error, Result, Stopped};
use crate::model::Block;
use crate::validation::estimate_initial_state_of_inputs;

/// The initial state counts as forgotten when its effect has fallen to this share.
const FORGOTTEN: f64 = 1e-3;
/// The name of all prediction-error methods.
const PREDICTION_ERROR: &str = "prediction-error";

/// Reports the only step of a method, and stops if asked to.
pub(super) fn announce(stage: &'static str, progress: &mut Progress<'_>) -> Result<()> {
    match progress(stage) {
        ControlFlow::Break(()) => Err(Error::Stopped(Stopped::Identifying { stage })),
        ControlFlow::Continue(()) => Ok(()),
    }
}

/// A model with its free run.
pub(super) struct Run {
    pub model: Block,
    pub paths: Vec<Path>,
    pub output_offset: f64,
    pub fitted: usize,
    pub predicted: Vec<f64>,
    pub verdicts: Vec<Verdict>,
    pub warnings: Vec<Warning>,
}

impl Run {
    /// The free run of a model; the number of its parameters may be known.
    pub(super) fn new(
        samples: &Samples<'_>,
        model: Block,
        paths: Vec<Path>,
        parameters: impl Into<Option<usize>>,
    ) -> Result<Self> {
        let predicted = free_run(&model, samples)?;
        let verdicts = samples.verdicts(&predicted, parameters.into())?;
        let mut warnings = samples.warnings(&verdicts);
        for (path, u) in paths.iter().zip(&samples.u) {
            let blocks: Vec<&BlockKind> = path.main().map(|block| &block.kind).collect();
            let first = blocks.iter().position(|kind| matches!(kind, BlockKind::Static(_)));
            if let Some((i, BlockKind::Static(block))) = first.map(|i| (i, blocks[i])) {
                let front: Vec<Block> = blocks[..i].iter().map(|kind| kind.model()).collect();
                let entering = match front.is_empty() {
                    true => u.to_vec(),
                    false => Block::Series(front).run(&[u]),
                };
                warn_of_range(&block.curve, &entering[samples.fitted..], i == 0, &mut warnings);
            }
        }
        Ok(Run {
            model,
            paths,
            output_offset: 0.0,
            fitted: samples.fitted,
            predicted,
            warnings,
            verdicts,
        })
    }

    /// The result by prediction error, without the list of trials and without details.
    pub(super) fn identification(self, row: &Structure, request: &Request<'_>) -> Result<Identification> {
        let verdict = Verdict::worst(&self.verdicts).cloned();
        let verdict = verdict.ok_or_else(|| Error::too_short("a verdict on the inputs", 1, 0))?;
        Ok(Identification {
            structure: row.name,
            description: row.description.to_owned(),
            method: PREDICTION_ERROR.into(),
            inputs: request.inputs.iter().map(|i| (*i).to_owned()).collect(),
            output: request.output.to_owned(),
            order: self.paths.iter().map(Path::order).sum(),
            delay: self.paths.iter().map(Path::delay).min().unwrap_or(0),
            parameters: verdict.estimated.map_or(0, |e| e.parameters),
            model: self.model,
            paths: self.paths,
            is_sum: false,
            output_offset: self.output_offset,
            tried: Vec::new(),
            details: Vec::new(),
            noise_model: None,
            comparison: None,
            fitted: self.fitted,
            predicted: self.predicted,
            verdict,
            verdicts: self.verdicts,
            warnings: self.warnings,
        })
    }
}

/// The free run over all samples. If the initial state still affects the fresh part, it is estimated from the fitted part.
fn free_run(model: &Block, samples: &Samples<'_>) -> Result<Vec<f64>> {
    if model.settling(FORGOTTEN) < samples.fitted {
        return Ok(model.run(&samples.u));
    }
    let mut known = samples.y.to_vec();
    known[samples.fitted..].fill(f64::NAN);
    if let Some(present) = &samples.present {
        known
            .iter_mut()
            .zip(present)
            .filter(|(_, present)| !**present)
            .for_each(|(y, _)| *y = f64::NAN);
    }
    let state = estimate_initial_state_of_inputs(model, &samples.u, &known)?;
    Ok(state.simulate_inputs(model, &samples.u))
}

/// One path from all inputs of a request.
pub(super) fn path(request: &Request<'_>, blocks: Vec<NamedBlock>) -> Path {
    Path {
        inputs: request.inputs.iter().map(|i| (*i).to_owned()).collect(),
        blocks,
    }
}

impl BlockKind {
    fn model(&self) -> Block {
        match self {
            BlockKind::Static(block) => Block::Static(block.curve.clone()),
            BlockKind::Linear(block) => Block::Linear(block.system.clone()),
            BlockKind::Surface(surface) => Block::Surface(surface.clone()),
            BlockKind::Feedback(block) => Block::Feedback(Box::new(block.model.clone())),
            BlockKind::Narx(model) => Block::Narx(model.clone()),
            BlockKind::Volterra(model) => Block::Volterra(model.clone()),
        }
    }
}

impl Path {
    /// The blocks in series: first those that act at the samples, then those that act between them, if there are any.
    pub(super) fn series(&self) -> impl Iterator<Item = Vec<Block>> {
        let of = |between: bool| {
            let blocks = self.blocks.iter().filter(move |b| b.between_samples == between);
            blocks.map(|b| b.kind.model()).collect()
        };
        [false, true]
            .into_iter()
            .map(of)
            .filter(|blocks: &Vec<Block>| !blocks.is_empty())
    }

    /// The path as a model, with an offset of the output.
    pub(super) fn model(&self, output_offset: f64) -> Block {
        let mut series: Vec<Vec<Block>> = self.series().collect();
        let mut blocks = match series.len() {
            1 => series.remove(0),
            _ => vec![Block::Parallel(series.into_iter().map(Block::Series).collect())],
        };
        if output_offset != 0.0 {
            blocks.push(Block::Offset(output_offset));
        }
        Block::Series(blocks)
    }
}

/// The details of the start of the search for poles and zeros, and the approximations by their orders.
pub(super) fn start_details(start: &str, prepared: &Prepared, paths: &[Path]) -> Vec<Detail> {
    let chosen: usize = paths.iter().map(Path::order).sum();
    let approximations = &prepared.approximations;
    let orders: Vec<usize> = approximations.iter().map(|a| a.system.order()).collect();
    let errors: Vec<f64> = approximations.iter().map(|a| a.relative_error).collect();
    let each = orders.iter().zip(&errors);
    let list: Vec<Values> = each
        .map(|(order, error)| Values::new([("order", (*order).into()), ("relative_error", (*error).into())]))
        .collect();
    let each: Vec<String> = (paths.iter().flat_map(Path::main))
        .filter_map(|b| {
            b.linear()
                .map(|g| format!("{} in the {}", g.order(), b.title.to_lowercase()))
        })
        .collect();
    let note = format!("{start}. Then poles and zeros are added or removed while that improves Schwarz's criterion");
    vec![
        Detail::new("start", start),
        Detail::new("approximations", list)
            .shown(Place::Choice, "Poles", each.join(", "), &note)
            .scored(approximation_scores(&orders, errors, chosen)),
    ]
}

/// The errors of linear approximations by their orders, if the chosen order is among them.
pub(super) fn approximation_scores(orders: &[usize], errors: Vec<f64>, chosen: usize) -> Option<Score> {
    let labels = ["order of the linear approximation", "relative error"];
    let is_known = orders.contains(&chosen);
    is_known.then(|| Score::of_numbers(labels, orders, errors, chosen))
}
