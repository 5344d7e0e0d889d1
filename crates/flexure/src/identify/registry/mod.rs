//! The block structures that can be identified, one row a structure.
//!
//! The command line, its help, the model files, the pages and the Python package take the structures from [`structures`]: a
//! structure made of existing blocks needs its own file and one row there.

mod auto;
mod delayed_static;
mod hammerstein;

use std::cell::OnceCell;
use std::ops::{ControlFlow, RangeInclusive};

use super::block::{ApproximationScore, Monitor, Prepared, TriedBranches, TriedStructure};
use super::hammerstein::{PhysicalForm, PlainHammerstein, RefinedHammerstein};
use super::outcome::{Verdict, Warning};
use super::reference;
use super::result::{Detail, Identification, NamedBlock, Path, Place, Score, StructureName, Values};
use super::samples::Samples;
use super::structures::{hammerstein_wiener, linear, multiple_inputs, parallel, wiener, wiener_hammerstein};
use super::surface;
use crate::error::{Error, Result, Stopped};
use crate::model::Block;
use crate::record::Record;

/// What all prediction-error methods are called.
pub(super) const PREDICTION_ERROR: &str = "prediction-error";

/// A block structure and its identification.
#[derive(Debug)]
pub struct Structure {
    /// Its name.
    pub name: StructureName,
    /// What its blocks are, for lists of structures, without a full stop.
    pub description: &'static str,
    /// The numbers of inputs that it takes.
    pub inputs: RangeInclusive<usize>,
    /// The options that it knows beside the share of fresh samples, by their names in Python and, with hyphens, on the command line.
    pub options: &'static [&'static str],
    /// The number of blocks, where [`Auto`](super::Auto) compares the structure with others: simple structures come first.
    pub complexity: Option<usize>,
    /// The identification.
    pub identify: fn(&Request<'_>, &mut Progress<'_>) -> Result<Identification>,
}

/// Called before every step with its name; stops the identification by returning [`ControlFlow::Break`].
pub type Progress<'a> = dyn FnMut(&str) -> ControlFlow<()> + 'a;

/// All structures, in the order of lists.
pub fn structures() -> &'static [Structure] {
    &STRUCTURES
}

static STRUCTURES: [Structure; 12] = [
    auto::ROW,
    linear::ROW,
    hammerstein::ROW,
    wiener::ROW,
    wiener_hammerstein::ROW,
    hammerstein_wiener::ROW,
    parallel::ROW,
    multiple_inputs::ROW,
    surface::ROW,
    delayed_static::ROW,
    reference::narx::ROW,
    reference::volterra::ROW,
];

impl Structure {
    /// The structure of this name.
    pub fn by_name(key: &str) -> Option<&'static Structure> {
        structures().iter().find(|s| s.name.key == key)
    }

    /// Whether it takes more than one input.
    pub fn has_several_inputs(&self) -> bool {
        *self.inputs.end() > 1
    }

    /// Identifies a system of this structure from one record.
    pub(super) fn run(
        &self,
        (record, inputs, output): (&Record, &[&str], &str),
        options: Options,
        progress: &mut Progress<'_>,
    ) -> Result<Identification> {
        self.identify(&Request::new(&[record], inputs, output, options), progress)
    }

    /// Identifies a system of this structure.
    ///
    /// # Errors
    /// Those of the method; [`Error::Parameter`] for a number of inputs that the structure does not take, and for several
    /// experiments where its method takes one; [`Error::Stopped`] if `progress` stopped it.
    pub fn identify(&self, request: &Request<'_>, progress: &mut Progress<'_>) -> Result<Identification> {
        (self.identify)(request, progress)
    }
}

/// What is to be identified from what.
pub struct Request<'a> {
    /// The record; several are so many experiments of one system.
    pub records: &'a [&'a Record],
    /// The inputs' columns.
    pub inputs: &'a [&'a str],
    /// The output's column.
    pub output: &'a str,
    /// What there is to choose.
    pub options: Options,
    prepared: OnceCell<Prepared>,
}

impl<'a> Request<'a> {
    /// A request for the identification from these columns.
    pub fn new(records: &'a [&'a Record], inputs: &'a [&'a str], output: &'a str, options: Options) -> Self {
        Request {
            records,
            inputs,
            output,
            options,
            prepared: OnceCell::new(),
        }
    }

    /// The only record.
    pub(super) fn record(&self) -> Result<&'a Record> {
        match self.records {
            [record] => Ok(record),
            several => Err(Error::parameter(
                "the number of experiments",
                several.len() as f64,
                "one for this structure and method",
            )),
        }
    }

    /// The only input.
    pub(super) fn input(&self) -> Result<&'a str> {
        match self.inputs {
            [input] => Ok(input),
            several => Err(Error::parameter(
                "the number of inputs",
                several.len() as f64,
                "one for this structure",
            )),
        }
    }
}

/// What there is to choose.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// The share of the record, at its end, kept for the verdict; 0.05 to 0.9.
    pub fresh_share: f64,
    /// The number of branches of [`Parallel`](super::Parallel).
    pub branches: Option<usize>,
    /// The method for a Hammerstein system.
    pub hammerstein: HammersteinMethod,
}

impl Options {
    /// The defaults with this share of fresh samples, for all methods.
    pub fn with_fresh_share(fresh_share: f64) -> Self {
        let method = RefinedHammerstein {
            fresh_share,
            ..Default::default()
        };
        Options {
            fresh_share,
            branches: None,
            hammerstein: HammersteinMethod::Refined { method, form: None },
        }
    }
}

impl Default for Options {
    fn default() -> Self {
        Options::with_fresh_share(0.25)
    }
}

/// A method for a Hammerstein system with the choices that were given; the others are made from data.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum HammersteinMethod {
    /// Prediction error over both blocks.
    Refined {
        /// The method.
        method: RefinedHammerstein,
        /// The form to fit to the nonlinearity and to test, if one was asked for.
        form: Option<PhysicalForm>,
    },
    /// The paper's.
    Plain(PlainHammerstein),
}

impl Request<'_> {
    /// The checked samples of the only record and the only input; `what` names the fit in the error about too few samples.
    pub(super) fn samples(&self, what: &'static str) -> Result<Samples<'_>> {
        Samples::new(
            self.record()?,
            self.input()?,
            self.output,
            self.options.fresh_share,
            what,
        )
    }

    /// The linear approximations that several structures start from, made once for all of them.
    pub(super) fn prepared(&self, samples: &Samples<'_>, monitor: &mut Monitor<'_>) -> &Prepared {
        self.prepared.get_or_init(|| samples.prepared(monitor))
    }
}

/// Reports a step of a method that has no others, and stops where that is asked for.
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
    /// The free run of a model of the first input, of so many parameters.
    pub(super) fn new(samples: &Samples<'_>, model: Block, paths: Vec<Path>, parameters: usize) -> Result<Self> {
        let (predicted, verdict, warnings) = samples.judged(&model, parameters)?;
        Ok(Run {
            model,
            paths,
            output_offset: 0.0,
            fitted: samples.fitted,
            predicted,
            verdicts: vec![verdict],
            warnings,
        })
    }

    /// The result by prediction error, without what was tried and without details.
    pub(super) fn identification(self, row: &Structure, request: &Request<'_>) -> Result<Identification> {
        let verdict = Verdict::worst(&self.verdicts).cloned();
        let verdict = verdict.ok_or_else(|| Error::too_short("a verdict on the inputs", 1, 0))?;
        Ok(Identification {
            structure: row.name,
            description: row.description.to_owned(),
            method: PREDICTION_ERROR,
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

/// One path from all inputs of a request.
pub(super) fn path(request: &Request<'_>, blocks: Vec<NamedBlock>) -> Path {
    Path {
        inputs: request.inputs.iter().map(|i| (*i).to_owned()).collect(),
        blocks,
    }
}

/// What the search for poles and zeros started from, and the approximations by their orders.
pub(super) fn start_details(start: &str, approximations: &[ApproximationScore], paths: &[Path]) -> Vec<Detail> {
    let chosen: usize = paths.iter().map(Path::order).sum();
    let orders: Vec<usize> = approximations.iter().map(|a| a.order).collect();
    let errors: Vec<f64> = approximations.iter().map(|a| a.relative_error).collect();
    let list: Vec<Values> = (approximations.iter())
        .map(|a| Values::new([("order", a.order.into()), ("relative_error", a.relative_error.into())]))
        .collect();
    let each: Vec<String> = (paths.iter().flat_map(Path::main))
        .filter_map(|b| {
            b.linear()
                .map(|g| format!("{} in the {}", g.order(), b.title.to_lowercase()))
        })
        .collect();
    let note = format!(
        "{start}; then poles and numerator coefficients added and taken away while Schwarz's criterion of the free-run error falls"
    );
    let scores = orders.contains(&chosen).then(|| Score {
        x_label: "order of the linear approximation".to_owned(),
        y_label: "relative error".to_owned(),
        logarithmic: false,
        x: orders.iter().map(|o| *o as f64).collect(),
        y: errors,
        chosen: chosen as f64,
    });
    vec![
        Detail::new("start", start),
        Detail::new("approximations", list)
            .shown(Place::Choice, "Poles", each.join(", "), &note)
            .scored(scores),
    ]
}

/// A structure of three blocks that was tried.
pub(super) fn tried_cascade(t: &TriedStructure) -> Values {
    Values::new([
        ("front_order", t.front_order.into()),
        ("front_numerator", t.front_numerator.into()),
        ("back_order", t.back_order.into()),
        ("back_numerator", t.back_numerator.into()),
        ("pieces", t.pieces.into()),
        ("kinks", t.kinks.into()),
        ("instants", t.instants.into()),
        ("samples", t.samples.into()),
        ("relative_error", t.relative_error.into()),
        ("bic", t.bic.into()),
    ])
}

/// A sum of branches that was tried.
pub(super) fn tried_branches(t: &TriedBranches) -> Values {
    Values::new([
        ("orders", t.orders.as_slice().into()),
        ("numerators", t.numerators.as_slice().into()),
        ("delays", t.delays.as_slice().into()),
        ("input_pieces", t.input_pieces.as_slice().into()),
        ("output_pieces", t.output_pieces.into()),
        ("input_kinks", t.input_kinks.as_slice().into()),
        ("output_kinks", t.output_kinks.into()),
        ("samples", t.samples.into()),
        ("relative_error", t.relative_error.into()),
        ("bic", t.bic.into()),
    ])
}

#[cfg(test)]
mod tests {
    /// The structure of CONTRIBUTING.md's recipe, as it stands there.
    #[test]
    fn the_worked_example_is_a_structure() {
        let contributing = include_str!("../../../../../CONTRIBUTING.md");
        let example = include_str!("delayed_static.rs");
        assert!(
            contributing.contains(&format!("```rust\n{example}```")),
            "CONTRIBUTING.md's example differs from delayed_static.rs"
        );
    }

    #[test]
    fn names_are_unique_and_complexities_start_at_one() {
        let keys: Vec<&str> = super::structures().iter().map(|s| s.name.key).collect();
        assert!((0..keys.len()).all(|i| !keys[..i].contains(&keys[i])), "{keys:?}");
        let simplest = super::structures().iter().filter_map(|s| s.complexity).min();
        assert_eq!(simplest, Some(1));
        assert!(super::Structure::by_name("none").is_none());
    }
}
