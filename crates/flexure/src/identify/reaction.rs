//! An input that reacts to the output's noise at the same sample, as that of a controller does.
//!
//! A controller reads the sample $y_n = x_n + e_n$ and sets $u_n$ at once; the log has both in one row. The plant answers later, but $u_n$
//! shows the noise $e_n$, so a model without delay lowers its error by a first coefficient that is the inverse of the controller's gain, not
//! the plant's (Ljung 1999, section 13.4: a loop needs a delay in the model or in the controller).
//!
//! The two are told apart by the large moves of the input, which follow the reference and not the noise. With the innovations w of the input
//! and v of the output, both by a regression on past inputs and outputs, the slope of v over w is
//!
//! | | at small w | at large w |
//! |---|---|---|
//! | the output follows the input at once | the first coefficient | the first coefficient |
//! | the input reacts to noise | against the sign of the plant's gain | nearly 0 |
//!
//! If the slopes say so, the system is identified with the input one sample later. That result counts if its error on fresh data is hardly
//! larger; its linear part then has at least one sample of delay.

use super::block::delayed;
use super::request::{Progress, Request, Structure};
use super::result::{BlockKind, Identification, LinearBlock, Path};
use super::warning::Warning;
use crate::error::{Error, Result};
use crate::linear::TransferFunction;
use crate::linear::least_squares::least_squares;
use crate::model::Block;
use crate::record::{Record, bridged};

/// Past samples of each signal in the regressions, and the least number of samples. Conventions.
const LAGS: usize = 10;
const FEWEST: usize = 400;
/// The shares of all samples whose input moves little. Convention: moves of the reference are rarer than a quarter of the samples.
const SMALL: [f64; 4] = [0.75, 0.9, 0.95, 0.98];
/// The small moves' largest share of the energy of all moves. Convention: the rest are then large.
const LARGEST_ENERGY: f64 = 0.5;
/// The least slope at small moves, in standard errors. Convention.
const CLEAR: f64 = 8.0;
/// The largest slope at large moves, as a share of that at small moves. Of 3072 simulated systems without a controller (8 nonlinearities, 8
/// inputs, 4 first coefficients, 3 noises), 2 have a smaller one, both with nonlinearities that rise and fall.
const LARGEST_SHARE: f64 = 0.05;
/// The largest error on fresh data with the input one sample later, relative to the one without. Convention.
const LARGEST_RISE: f64 = 1.1;

/// The result, or that with the input one sample later if the input reacts to the output.
pub(super) fn after_reaction(
    structure: &Structure,
    request: &Request<'_>,
    found: Identification,
    progress: &mut Progress<'_>,
) -> Result<Identification> {
    let [input] = request.inputs else { return Ok(found) };
    let has_delay = |of: &Identification| of.order > 0 && of.paths.iter().all(|path| path.linear().next().is_some());
    // The structures of a comparison have been through this one by one.
    let is_open = found.delay == 0 && found.comparison.is_none() && has_delay(&found);
    if !is_open || !request.options.chooses_delay() || !reacts(request, input)? {
        return Ok(found);
    }
    let records: Vec<Record> = request.records.iter().map(|r| later(r, input)).collect::<Result<_>>()?;
    let records: Vec<&Record> = records.iter().collect();
    let again = Request::new(&records, request.inputs, request.output, request.options.clone());
    let mut other = match structure.identify_robustly(&again, progress) {
        Err(Error::Stopped(why)) => return Err(Error::Stopped(why)),
        Err(_) => return Ok(found),
        Ok(other) => other,
    };
    let is_as_good = other.verdict.measures.rms <= LARGEST_RISE * found.verdict.measures.rms;
    if !(is_as_good && has_delay(&other)) {
        return Ok(found);
    }
    other.delay_by_one()?;
    other.warnings.push(Warning::InputReacts {
        input: (*input).to_owned(),
        output: request.output.to_owned(),
    });
    Ok(other)
}

/// The record with an input one sample later; its first sample is there twice.
fn later(record: &Record, input: &str) -> Result<Record> {
    let moved = |(name, samples): (&str, &[f64])| {
        let samples = match samples {
            [first, before @ .., _] if name == input => [&[*first, *first], before].concat(),
            _ => samples.to_vec(),
        };
        (name.to_owned(), samples)
    };
    Record::new(record.columns().map(moved))
}

/// Whether the input of the longest record reacts to the output's noise.
fn reacts(request: &Request<'_>, input: &str) -> Result<bool> {
    let Some(record) = request.records.iter().max_by_key(|r| r.len()) else {
        return Ok(false);
    };
    let (u, y) = (record.column(input)?, bridged(record.column(request.output)?));
    Ok(u.len() >= FEWEST && Innovations::of(u, &y).is_some_and(|i| i.show_a_reaction()))
}

/// What past inputs and outputs do not explain.
struct Innovations {
    /// Of the input, by rising size, each with that of the output at the same sample.
    moves: Vec<Move>,
    /// Whether the output rises with past inputs.
    rises: bool,
}

#[derive(Clone, Copy)]
struct Move {
    input: f64,
    output: f64,
}

/// The slope of the output's innovation over the input's.
struct Slope {
    value: f64,
    error: f64,
    energy: f64,
}

impl Innovations {
    fn of(u: &[f64], y: &[f64]) -> Option<Innovations> {
        let lags = |of: &[f64]| (1..=LAGS).map(|k| delayed(of, k, 1.0)).collect::<Vec<_>>();
        let columns = [lags(u), lags(y), vec![vec![1.0; u.len()]]].concat();
        let output = least_squares(y, &columns, LAGS)?.coefficients;
        let input = least_squares(u, &columns, LAGS)?.coefficients;
        let explained = |c: &[f64], n: usize| -> f64 { c.iter().zip(&columns).map(|(c, column)| c * column[n]).sum() };
        let innovation = |n: usize| Move {
            input: u[n] - explained(&input, n),
            output: y[n] - explained(&output, n),
        };
        let mut moves: Vec<Move> = (LAGS..u.len()).map(innovation).collect();
        moves.sort_by(|a, b| a.input.abs().total_cmp(&b.input.abs()));
        Some(Innovations {
            moves,
            rises: output[..LAGS].iter().sum::<f64>() > 0.0,
        })
    }

    fn show_a_reaction(&self) -> bool {
        SMALL.iter().any(|share| {
            let (small, large) = self.moves.split_at((share * self.moves.len() as f64) as usize);
            let (small, large) = (Slope::of(small), Slope::of(large));
            small.value.abs() > CLEAR * small.error
                && (small.value < 0.0) == self.rises
                && large.value.abs() < LARGEST_SHARE * small.value.abs()
                && small.energy < LARGEST_ENERGY * (small.energy + large.energy)
        })
    }
}

impl Slope {
    fn of(moves: &[Move]) -> Slope {
        let energy: f64 = moves.iter().map(|m| m.input * m.input).sum();
        let value = moves.iter().map(|m| m.input * m.output).sum::<f64>() / energy;
        let rest = |m: &Move| (m.output - value * m.input) * m.input;
        let error = moves.iter().map(|m| rest(m).powi(2)).sum::<f64>().sqrt() / energy;
        Slope { value, error, energy }
    }
}

impl Identification {
    /// Gives every path one more sample of delay.
    fn delay_by_one(&mut self) -> Result<()> {
        self.delay += 1;
        self.model = with_delay(std::mem::replace(&mut self.model, Block::Offset(0.0)))?;
        for block in self.paths.iter_mut().flat_map(Path::first_linear) {
            block.delay_by_one()?;
        }
        self.tried.iter_mut().for_each(|tried| tried.raise_counts("delays"));
        for detail in &mut self.details {
            detail.value.raise_counts("delays");
            let shown = detail.shown.iter_mut().filter(|shown| shown.title == "Delay");
            for shown in shown {
                if let Ok(delay) = shown.text.parse::<usize>() {
                    shown.text = (delay + 1).to_string();
                }
            }
        }
        Ok(())
    }
}

impl Path {
    /// The first linear block at the samples, and the first between them.
    fn first_linear(&mut self) -> impl Iterator<Item = &mut LinearBlock> {
        let mut seen = [false; 2];
        self.blocks.iter_mut().filter_map(move |block| match &mut block.kind {
            BlockKind::Linear(linear) if !seen[usize::from(block.between_samples)] => {
                seen[usize::from(block.between_samples)] = true;
                Some(linear)
            }
            _ => None,
        })
    }
}

impl LinearBlock {
    fn delay_by_one(&mut self) -> Result<()> {
        self.system = later_system(&self.system)?;
        if let Some(errors) = &mut self.errors {
            errors.b.insert(0, 0.0);
        }
        if let Some(impulse) = &mut self.impulse {
            impulse.values.insert(0, 0.0);
        }
        Ok(())
    }
}

fn later_system(system: &TransferFunction) -> Result<TransferFunction> {
    TransferFunction::new([&[0.0], system.b()].concat(), system.a().to_vec())
}

/// The model with one more sample of delay in its first linear block.
fn with_delay(model: Block) -> Result<Block> {
    Ok(match model {
        Block::Linear(system) => Block::Linear(later_system(&system)?),
        Block::Parallel(ways) => Block::Parallel(ways.into_iter().map(with_delay).collect::<Result<_>>()?),
        Block::Series(mut blocks) => {
            let is_dynamic = |b: &Block| matches!(b, Block::Linear(_) | Block::Parallel(_) | Block::Series(_));
            if let Some(i) = blocks.iter().position(is_dynamic) {
                blocks[i] = with_delay(blocks[i].clone())?;
            }
            Block::Series(blocks)
        }
        other => other,
    })
}
