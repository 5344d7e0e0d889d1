//! Linear dynamics, of one input or several: how good a linear model can be.
//!
//! $$ Y_n = o + \sum_i \frac{B_i(z)}{A(z)} z^{-s_i} U^{(i)}_n + e_n $$
//! Poles, delays and numerators are those with the best free run on samples that were not fitted; see the module `output_error`. For an
//! output that integrates, the model has poles at 1, and a level of the input at which the output stands still. For a nonlinear system this
//! is the best linear approximation under this input.

use super::super::block::{Monitor, Prepared, Scale, Signals};
use super::super::output_error::{LinearCandidate, LinearSystem, Search, bias, covariance, search};
use super::limits::{FEWEST_SAMPLES, FEWEST_SAMPLES_AN_INPUT};
use crate::error::{Error, Result};
use crate::identify::request::{Progress, Rank, Request, Structure};
use crate::identify::result::{
    BlockKind, CoefficientErrors, Detail, Identification, LinearBlock, NamedBlock, Path, Place, Score, StructureName,
    Value, Values,
};
use crate::identify::run::Run;
use crate::linear::TransferFunction;
use crate::model::Block;
use crate::text::number;

/// The identification of a linear system by the free run.
///
/// ```
/// use flexure::identify::LINEAR;
/// use flexure::linear::TransferFunction;
/// use flexure::record::Record;
/// use rand::{RngExt, SeedableRng};
///
/// let system = TransferFunction::new(vec![0.0, 1.0, 0.5], vec![1.0, -1.2, 0.6])?;
/// let mut random = rand_pcg::Pcg64::seed_from_u64(1);
/// let u: Vec<f64> = (0..2000).map(|_| random.random_range(-1.0..1.0)).collect();
/// let y: Vec<f64> = system.simulate(&u).iter().map(|y| y + 0.1 * random.random_range(-1.0..1.0)).collect();
/// let result = LINEAR.identify(&Record::new([("u", u), ("y", y)])?, &["u"], "y")?;
/// assert_eq!((result.order, result.delay), (2, 1));
/// assert!(result.verdict.holds());
/// # Ok::<(), flexure::Error>(())
/// ```
pub const ROW: Structure = Structure {
    name: StructureName {
        key: "linear",
        title: "linear",
    },
    description: "linear dynamics alone",
    inputs: 1..=usize::MAX,
    options: &[],
    rank: Some(Rank::Linear),
    identify,
};

fn identify(request: &Request<'_>, progress: &mut Progress<'_>) -> Result<Identification> {
    let what = "a linear fit (besides the fresh part)";
    if request.inputs.is_empty() {
        return Err(Error::too_short(what, 1, 0));
    }
    let samples = request.samples_at_least(what, FEWEST_SAMPLES + FEWEST_SAMPLES_AN_INPUT * request.inputs.len())?;
    let Prepared {
        inputs, output, data, ..
    } = samples.prepared();
    let data = Signals { from: 0, ..data };
    let mut monitor = Monitor::new(progress);
    let found = search(&data, &mut monitor);
    monitor.finished()?;
    let found = found.ok_or_else(|| Error::too_short(what, data.y.len() + 1, data.y.len()))?;
    let gains: Vec<f64> = inputs.iter().map(|u| output.spread / u.spread).collect();
    let covariance = covariance(&found.system, &data);
    let blocks = blocks(&found.system, &gains, covariance.as_deref())?;
    let level = output.mean + output.spread * found.system.offset;
    let (offset, levels) = match found.system.orders.integrators {
        0 => {
            let through = inputs.iter().zip(&blocks).map(|(u, g)| g.system.static_gain() * u.mean);
            (level - through.sum::<f64>(), None)
        }
        _ => (level, Some(input_levels(&found.system, &inputs))),
    };
    let of_input = |(name, block): (&&str, LinearBlock)| Path {
        inputs: vec![(*name).to_owned()],
        blocks: vec![NamedBlock::new("linear", "Linear part", BlockKind::Linear(block))],
    };
    let paths: Vec<Path> = request.inputs.iter().zip(blocks).map(of_input).collect();
    let behind = |(i, path): (usize, &Path)| {
        let level = levels.iter().map(|levels| Block::Offset(-levels[i]));
        level.chain(path.series().flatten()).collect()
    };
    let mut each: Vec<Vec<Block>> = paths.iter().enumerate().map(behind).collect();
    let mut series = match each.len() {
        1 => each.remove(0),
        _ => vec![Block::Inputs(each.into_iter().map(Block::Series).collect())],
    };
    series.push(Block::Offset(offset));
    let model = Block::Series(series);
    let orders = &found.system.orders;
    let run = Run::new(&samples, model, paths, orders.parameters())?;
    Ok(Identification {
        order: orders.order(),
        is_sum: request.inputs.len() > 1,
        output_offset: offset,
        details: details(&found, levels),
        ..run.identification(&ROW, request)?
    })
}

/// The level that is subtracted from every input before an integrator: its mean; for the input with the largest gain, the constant that
/// holds the output still.
fn input_levels(system: &LinearSystem, inputs: &[Scale]) -> Vec<f64> {
    let d = system.orders.integrators;
    let denominator = 1.0 / system.denominator.static_gain();
    let gains = system.numerator_polynomials().into_iter();
    let gains: Vec<f64> = gains.map(|b| b.iter().sum::<f64>() / denominator).collect();
    let mut levels: Vec<f64> = inputs.iter().map(|u| u.mean).collect();
    let largest = (0..gains.len()).max_by(|i, j| gains[*i].abs().total_cmp(&gains[*j].abs()));
    if let (Some(i), Some(last)) = (largest, system.trend.last()) {
        levels[i] -= inputs[i].spread * bias(*last, d, gains[i]);
    }
    levels
}

/// The linear part of every input in the record's units: `gains` are those of a system whose signals have unit variance.
fn blocks(system: &LinearSystem, gains: &[f64], covariance: Option<&[f64]>) -> Result<Vec<LinearBlock>> {
    let a = system.polynomial();
    let poles = system.orders.order();
    let size = system.orders.numerators() + poles;
    let mut first = 0;
    let mut blocks = Vec::new();
    for ((numerator, orders), gain) in system
        .numerator_polynomials()
        .iter()
        .zip(&system.orders.inputs)
        .zip(gains)
    {
        let zeros = std::iter::repeat_n(0.0, orders.delay);
        let b = zeros.chain(numerator.iter().map(|b| gain * b)).collect();
        // The coefficients of this numerator, then those of the denominator.
        let mine: Vec<usize> = (first..first + orders.count).chain(size - poles..size).collect();
        let scale = |k: usize| if k < size - poles { *gain } else { 1.0 };
        let pairs = mine.iter().flat_map(|i| mine.iter().map(move |j| (*i, *j)));
        let mine_alone =
            |all: &[f64]| -> Vec<f64> { pairs.map(|(i, j)| scale(i) * scale(j) * all[i * size + j]).collect() };
        blocks.push(LinearBlock {
            system: TransferFunction::new(b, a.clone())?,
            errors: covariance
                .map(mine_alone)
                .map(|own| CoefficientErrors::new(own, orders.delay, orders.count)),
            impulse: None,
        });
        first += orders.count;
    }
    Ok(blocks)
}

/// How the orders were chosen.
fn details(found: &Search, levels: Option<Vec<f64>>) -> Vec<Detail> {
    let orders = &found.system.orders;
    let note = "the smallest order that predicts held-back data as well as the best order";
    let list: Vec<Values> = found.tried.iter().map(entry).collect();
    let others = vec![
        Detail::new("criterion", found.criterion.name()),
        Detail::new("candidates", list)
            .shown(Place::Choice, "Poles", orders.order().to_string(), note)
            .scored(Some(score(found))),
        Detail::new("nonlinearity", Value::None).unsaved(),
    ];
    let integrators = levels.map(|levels| integrators(orders.integrators, levels));
    integrators.into_iter().flatten().chain(others).collect()
}

/// A candidate as values.
fn entry(c: &LinearCandidate) -> Values {
    let inputs = &c.orders.inputs;
    Values::new([
        ("order", c.orders.order().into()),
        ("delays", inputs.iter().map(|i| i.delay).collect::<Vec<_>>().into()),
        (
            "coefficients",
            inputs.iter().map(|i| i.count).collect::<Vec<_>>().into(),
        ),
        ("criterion", c.criterion.name().into()),
        ("held_back_error", c.relative_error().into()),
    ])
}

/// The least error for each number of poles.
fn score(found: &Search) -> Score {
    let best = |count: usize| {
        let of_count = found.tried.iter().filter(|c| c.orders.order() == count);
        let errors = of_count.map(LinearCandidate::relative_error);
        errors.fold(f64::INFINITY, f64::min)
    };
    let most = found.tried.iter().map(|c| c.orders.order()).max();
    let tried: Vec<usize> = (0..=most.unwrap_or(0))
        .filter(|count| best(*count).is_finite())
        .collect();
    let errors = tried.iter().map(|count| best(*count)).collect();
    let labels = ["poles", "relative error, held back"];
    Score::of_numbers(labels, &tried, errors, found.system.orders.order())
}

/// The number of integrators, and the level of each input that counts as zero.
fn integrators(count: usize, levels: Vec<f64>) -> [Detail; 2] {
    let note = "poles at 1, as the free run predicts better with them; the input at which the output would stand still counts as zero";
    let at = levels.iter().map(|l| number(*l)).collect::<Vec<_>>().join(", ");
    let text = format!("{count} (input level {at})");
    [
        Detail::new("integrators", count).shown(Place::Fact, "Integrators", text, note),
        Detail::new("input_levels", levels),
    ]
}
