//! Sums of Wiener-Hammerstein branches or of Hammerstein branches with one input.
//!
//! $$ Y_n = \sum_i H_i(z) f_i(W^{(i)}_n) + e_n, \qquad W^{(i)}_n = G_i(z) U_n $$
//! (Sandberg 1991; Schoukens, Marconato, Pintelon, Vandersteen, Rolain 2015), from the record alone:
//!
//! 1. Hammerstein branches, whose $G_i$ is 1: least squares over all products of B-splines of the input and numerator
//!    coefficients with a common denominator, of orders 0 to 8; the matrix of those products has the number of branches as
//!    its rank, and its dominant parts are the branches;
//! 2. the best of them refined by Levenberg-Marquardt on the simulation error over all parameters of all branches, every branch with its
//!    own denominator;
//! 3. pieces of the nonlinearities, poles and numerator coefficients added and taken away, branch by branch, while Schwarz's
//!    criterion falls;
//! 4. Wiener-Hammerstein branches, if the input explains a part of the error of Hammerstein branches: the poles of the best linear
//!    approximation are assigned to the fronts and the backs of all branches. Assignments start at random, and one pole moves at a
//!    time while the same kind of least squares improves; then steps 2 and 3;
//! 5. the number of branches, unless it is given, and their form by Schwarz's criterion; a last refinement on all samples.
//!
//! Schoukens et al. take the branches' dynamics from linear approximations at several levels of the input. A single record has one level:
//! here the products' dominant parts replace them.
//!
//! The record determines only the sum. Scales and delays can move within a branch. Hammerstein branches can be mixed: the sum is the same
//! with $f = M f'$ and $H' = M^T H$ for any invertible matrix M. Wiener-Hammerstein branches can exchange linear dynamics through a
//! straight part of a nonlinearity. Branches are comparable with physical ones only if the signals that enter their nonlinearities differ.

use super::super::block::{Blocks, Monitor, Prepared, System, Tried, add_errors, delays, find_sum};
use super::super::samples::Samples;
use super::limits::{DELAY_SAMPLES, MOST_BRANCHES, MOST_CHOSEN_BRANCHES};
use crate::error::{Error, Result};
use crate::identify::request::{Progress, Rank, Request, Structure};
use crate::identify::result::{Detail, Identification, LinearBlock, NamedBlock, Path, Place, StructureName};
use crate::identify::run::{Run, path};
use crate::linear::TransferFunction;
use crate::model::Block;

/// The identification of a sum of branches.
///
/// ```
/// use flexure::identify::{Options, PARALLEL, Request};
/// use flexure::linear::TransferFunction;
/// use flexure::record::Record;
/// use std::ops::ControlFlow;
/// use rand::{RngExt, SeedableRng};
///
/// let [slow, fast] = [0.8, -0.5].map(|pole| TransferFunction::new(vec![1.0], vec![1.0, -pole]));
/// let mut random = rand_pcg::Pcg64::seed_from_u64(1);
/// let u: Vec<f64> = (0..3000).map(|_| random.random_range(-1.0..1.0)).collect();
/// let square: Vec<f64> = u.iter().map(|u| u * u).collect();
/// let limited: Vec<f64> = u.iter().map(|u| (3.0 * u).tanh()).collect();
/// let (p, q) = (slow?.simulate(&square), fast?.simulate(&limited));
/// let y: Vec<f64> = p.iter().zip(&q).map(|(p, q)| p + q).collect();
/// let record = Record::new([("u", u), ("y", y)])?;
/// let options = Options { branches: Some(2), ..Options::default() };
/// let records = [&record];
/// let request = Request::new(&records, &["u"], "y", options);
/// let result = PARALLEL.identify_with(&request, &mut |_| ControlFlow::Continue(()))?;
/// assert_eq!(result.paths.len(), 2);
/// assert!(result.verdict.measures.fit_percent > 98.0);
/// # Ok::<(), flexure::Error>(())
/// ```
pub const ROW: Structure = Structure {
    name: StructureName {
        key: "parallel",
        title: "parallel",
    },
    description: "a sum of branches from one input: each a static nonlinearity and linear dynamics, with linear dynamics before it if needed",
    inputs: 1..=1,
    options: &["branches"],
    rank: Some(Rank::Sum),
    identify,
};

/// Why single branches must not be interpreted.
const ONLY_THE_SUM: &str =
    "the record determines the branches' sum; parts of it can be moved from one branch to another";

fn identify(request: &Request<'_>, progress: &mut Progress<'_>) -> Result<Identification> {
    let counts = match request.options.branches {
        None => 1..=MOST_CHOSEN_BRANCHES,
        Some(count) if (1..=MOST_BRANCHES).contains(&count) => count..=count,
        Some(count) => {
            return Err(Error::parameter(
                "the number of branches",
                count as f64,
                "between 1 and 5",
            ));
        }
    };
    let samples = request.samples("a fit of branches in parallel (besides the fresh part)")?;
    let mut monitor = Monitor::new(progress);
    let prepared = samples.prepared().approximated(delay(&samples), &mut monitor);
    let found = find_sum(&prepared, counts, &mut monitor);
    monitor.finished()?;
    let Branches { mut paths, offset } = in_units(&found.system, prepared.clone(), request)?;
    if paths.len() == 1 {
        add_errors(&mut paths, &found.system, &prepared.data, |system| {
            Ok(in_units(system, prepared.clone(), request)?.paths)
        });
    }
    let sum = Block::Parallel(paths.iter().flat_map(Path::series).map(Block::Series).collect());
    let model = match offset == 0.0 {
        true => sum,
        false => Block::Series(vec![sum, Block::Offset(offset)]),
    };
    let run = Run::new(&samples, model, paths, found.system.degrees())?;
    let branch = match run.paths.iter().any(|p| p.blocks[0].role == "front") {
        true => "linear dynamics, a static nonlinearity, linear dynamics",
        false => "a static nonlinearity, then linear dynamics",
    };
    let count = match run.paths.len() {
        1 => "1 branch".to_owned(),
        n => format!("{n} branches"),
    };
    let why = format!("smallest Schwarz criterion, unless given; {ONLY_THE_SUM}");
    Ok(Identification {
        is_sum: true,
        description: format!("a sum of {count}: {branch}"),
        output_offset: offset,
        details: vec![Detail::sentence(Place::ChoiceAndText, "Branches", count, &why)],
        tried: found.tried.iter().map(Tried::sum).collect(),
        ..run.identification(&ROW, request)?
    })
}

/// The delay from functions of the input, less some slack.
fn delay(samples: &Samples<'_>) -> usize {
    let part = samples.fitted.min(DELAY_SAMPLES);
    let prepared = Prepared::new(&[&samples.input()[..part]], &samples.y[..part]);
    delays(&prepared.data).first().copied().unwrap_or(0)
}

/// The paths of the input, in the record's units.
struct Branches {
    paths: Vec<Path>,
    offset: f64,
}

/// The branches of a sum that was fitted to prepared signals; the first branch has the output's mean.
fn in_units(system: &System, mut prepared: Prepared, request: &Request<'_>) -> Result<Branches> {
    let (mut paths, mut offset) = (Vec::new(), 0.0);
    for branch in &system.branches {
        let blocks = Blocks::new(branch, &prepared)?;
        prepared.output.mean = 0.0;
        offset += blocks.offset;
        paths.push(path(request, named(blocks)?));
    }
    Ok(Branches { paths, offset })
}

/// The blocks with their names. If a front is only a delay, the branch is a Hammerstein branch, and the back gets the delay.
fn named(blocks: Blocks) -> Result<Vec<NamedBlock>> {
    let front = &blocks.front;
    let mut passing = front.b().iter().skip_while(|b| **b == 0.0);
    let only_delays = front.a().len() == 1 && passing.next() == Some(&1.0) && passing.all(|b| *b == 0.0);
    if !only_delays || blocks.between_samples.is_some() {
        return Ok(blocks.named());
    }
    let delay = front.b().iter().take_while(|b| **b == 0.0).copied();
    let b = delay.chain(blocks.back.b().iter().copied()).collect();
    let linear = TransferFunction::new(b, blocks.back.a().to_vec())?;
    Ok(vec![
        NamedBlock::new("nonlinearity", "Nonlinearity", blocks.nonlinearity),
        NamedBlock::new("linear", "Linear part", LinearBlock::of(linear)),
    ])
}
