//! Several inputs, each through its own nonlinearity and linear part.
//!
//! $$ Y_n = o + \sum_i G_i(z) z^{-s_i} f_i(U^{(i)}_n) + e_n $$
//! from the record alone. The search is that of the [Hammerstein-Wiener](crate::identify::HAMMERSTEIN_WIENER) system without its
//! last nonlinearity: all inputs at once, from least squares over B-splines of all of them with one common denominator; then every branch
//! has its own poles, and Schwarz's criterion removes those that are not needed. The inputs need not be white or independent, but they must
//! not determine one another.
//!
//! By convention every linear part has unit static gain (if it hardly passes a constant, its input's standard deviation at its output, as
//! for the [Wiener-Hammerstein system](crate::identify::WIENER_HAMMERSTEIN)) and every nonlinearity zero mean over the fit's inputs; the
//! offset has the rest.

use super::super::block::{
    Monitor, Normalised, Prepared, SearchResult, System, Tried, add_errors, hammerstein_branches, tabulated,
};
use crate::error::{Error, Result};
use crate::identify::request::{Progress, Rank, Request, Structure};
use crate::identify::result::{BlockKind, Detail, Identification, LinearBlock, NamedBlock, Path, Place, StructureName};
use crate::identify::run::Run;
use crate::linear::correlation::mean;
use crate::model::Block;

/// The identification of a sum of Hammerstein branches, one per input.
///
/// ```
/// use flexure::identify::MULTIPLE_INPUTS;
/// use flexure::record::Record;
/// use rand::{RngExt, SeedableRng};
///
/// let mut random = rand_pcg::Pcg64::seed_from_u64(1);
/// let mut input = || -> Vec<f64> { (0..3000).map(|_| random.random_range(-1.0..1.0)).collect() };
/// let (p, q) = (input(), input());
/// let mut y = vec![0.0; 3000];
/// for n in 1..3000 {
///     y[n] = 0.6 * y[n - 1] + p[n].powi(2) + q[n - 1].tanh();
/// }
/// let record = Record::new([("p", p), ("q", q), ("y", y)])?;
/// let result = MULTIPLE_INPUTS.identify(&record, &["p", "q"], "y")?;
/// assert_eq!(result.paths[1].delay(), 1);
/// assert!(result.fit_percent() > 98.0);
/// # Ok::<(), flexure::Error>(())
/// ```
pub const ROW: Structure = Structure {
    name: StructureName {
        key: "multiple-inputs",
        title: "multiple-input Hammerstein",
    },
    description: "several inputs, each through a static nonlinearity and linear dynamics of its own",
    inputs: 1..=usize::MAX,
    options: &[],
    rank: Some(Rank::TwoBlocks),
    identify,
};

fn identify(request: &Request<'_>, progress: &mut Progress<'_>) -> Result<Identification> {
    let inputs = request.inputs;
    let what = "a fit with several inputs (besides the fresh part)";
    if inputs.is_empty() {
        return Err(Error::too_short(what, 1, 0));
    }
    let samples = request.samples_of_inputs(what)?;
    let prepared = samples.prepared();
    let mut monitor = Monitor::new(progress);
    let found = hammerstein_branches::find(&prepared.data, false, &mut monitor);
    monitor.finished()?;
    let SearchResult { system, tried } = found.unwrap_or_else(|| hammerstein_branches::without_start(false));
    let Branches { mut paths, offset } = in_units(&system, &prepared, inputs)?;
    add_errors(&mut paths, &system, &prepared.data, |system| {
        Ok(in_units(system, &prepared, inputs)?.paths)
    });
    let blocks = paths.iter().flat_map(Path::series).map(Block::Series).collect();
    let model = Block::Series(vec![Block::Inputs(blocks), Block::Offset(offset)]);
    let run = Run::new(&samples, model, paths, system.degrees())?;
    let count = run.paths.len().to_string();
    let inputs = Detail::sentence(Place::Fact, "Inputs", count, "each with blocks of its own");
    Ok(Identification {
        is_sum: true,
        output_offset: offset,
        tried: tried.iter().map(Tried::ends).collect(),
        details: vec![inputs],
        ..run.identification(&ROW, request)?
    })
}

/// The paths of the inputs, in the record's units.
struct Branches {
    paths: Vec<Path>,
    offset: f64,
}

/// The branches in the record's units and the conventional scale, and the offset.
fn in_units(system: &System, prepared: &Prepared, names: &[&str]) -> Result<Branches> {
    let data = &prepared.data;
    let mut offset = prepared.output.back(system.offset());
    let mut paths = Vec::new();
    for (i, branch) in system.branches.iter().enumerate() {
        let through: Vec<f64> = data.u[i].iter().map(|u| branch.spline.value(*u)).collect();
        let Normalised { linear, gain } = Normalised::new(&branch.back, branch.delay, &through, data.from)?;
        let level = mean(&through);
        let scale = prepared.output.spread * gain;
        let abscissa = |u: f64| prepared.inputs[i].back(u);
        let ordinate = |v: f64| scale * (v - level);
        let nonlinearity = tabulated(&branch.spline, &data.u[i][data.from..], abscissa, ordinate)?;
        let fixed = linear.static_gain();
        if fixed.is_finite() {
            offset += fixed * scale * level;
        }
        paths.push(Path {
            inputs: vec![names[i].to_owned()],
            blocks: vec![
                NamedBlock::new("nonlinearity", "Nonlinearity", BlockKind::Static(nonlinearity)),
                NamedBlock::new("linear", "Linear part", LinearBlock::of(linear)),
            ],
        });
    }
    Ok(Branches { paths, offset })
}
