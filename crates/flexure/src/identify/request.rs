//! What is to be identified, by which structure, from what, and with which choices.

use std::ops::{ControlFlow, RangeInclusive};
use std::sync::OnceLock;

use super::block::{Monitor, Prepared};
use super::hammerstein::options::{HammersteinMethod, RefinedHammerstein};
use super::limits::FEWEST_SAMPLES;
use super::result::{Identification, StructureName};
use super::samples::{Samples, refuse_repeated};
use crate::error::{Error, Result};
use crate::record::Record;

/// A block structure and its identification.
#[derive(Debug)]
pub struct Structure {
    /// Its name.
    pub name: StructureName,
    /// What its blocks are, for lists of structures, without a full stop.
    pub description: &'static str,
    /// The numbers of inputs that it takes.
    pub inputs: RangeInclusive<usize>,
    /// The options that it knows in addition to the share of fresh samples and the treatment of outliers and of missing outputs, by their names in Python; on the
    /// command line they have hyphens.
    pub options: &'static [&'static str],
    /// Its rank, where [`AUTO`](super::AUTO) compares the structure with others.
    pub rank: Option<Rank>,
    /// The identification.
    pub(super) identify: fn(&Request<'_>, &mut Progress<'_>) -> Result<Identification>,
}

/// How much a structure can describe. [`AUTO`](super::AUTO) tries structures in this order. Of structures that fit equally well, it takes one of the
/// lowest rank.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Rank {
    /// Linear dynamics.
    Linear = 1,
    /// Dynamics with a curve at one end of each path.
    TwoBlocks,
    /// A curve between dynamics, or dynamics between curves.
    ThreeBlocks,
    /// A structure that contains most others, such as a loop. It is fitted only where nothing simpler holds.
    General,
    /// A sum of paths from the same input, fitted last.
    Sum,
}

/// Called before every step, and before steps that run side by side, with their name; stops the identification by returning [`ControlFlow::Break`].
pub type Progress<'a> = dyn FnMut(&str) -> ControlFlow<()> + 'a;

impl Structure {
    /// Whether it takes more than one input.
    pub fn has_several_inputs(&self) -> bool {
        *self.inputs.end() > 1
    }

    /// Whether this is the refined method for a Hammerstein system, which takes several experiments, and skips missing outputs by itself.
    pub fn is_refined(&self, options: &Options) -> bool {
        self.options.contains(&"method") && matches!(options.hammerstein, HammersteinMethod::Refined(_))
    }
}

/// What is to be identified from what.
pub struct Request<'a> {
    /// The record; several records are experiments of one system.
    pub records: &'a [&'a Record],
    /// The inputs' columns.
    pub inputs: &'a [&'a str],
    /// The output's column.
    pub output: &'a str,
    /// The choices.
    pub options: Options,
    /// The output without gaps, for structures that need one at every sample of the record.
    outputs: Option<&'a [f64]>,
    prepared: OnceLock<Prepared>,
}

impl<'a> Request<'a> {
    /// A request for the identification from these columns.
    pub fn new(records: &'a [&'a Record], inputs: &'a [&'a str], output: &'a str, options: Options) -> Self {
        Request {
            records,
            inputs,
            output,
            options,
            outputs: None,
            prepared: OnceLock::new(),
        }
    }

    /// The same request, with an output in which no sample of the record is missing.
    pub(super) fn with_outputs<'b>(&'b self, outputs: &'b [f64]) -> Request<'b> {
        Request {
            outputs: Some(outputs),
            ..self.with_options(self.options.clone())
        }
    }

    /// The same request with other choices.
    pub(super) fn with_options(&self, options: Options) -> Request<'_> {
        Request {
            outputs: self.outputs,
            ..Request::new(self.records, self.inputs, self.output, options)
        }
    }

    /// Whether missing outputs have been filled in.
    pub(super) fn is_whole(&self) -> bool {
        self.outputs.is_some()
    }

    /// The outputs of the only record, without gaps.
    pub(super) fn outputs(&self) -> Result<&[f64]> {
        match self.outputs {
            Some(outputs) => Ok(outputs),
            None => self.record()?.finite(self.output),
        }
    }

    /// Where the only record has outputs, if some are missing.
    pub(super) fn present(&self) -> Result<Option<Vec<bool>>> {
        let is_there = |column: &[f64]| column.iter().map(|y| !y.is_nan()).collect();
        self.outputs
            .map(|_| Ok(is_there(self.record()?.column(self.output)?)))
            .transpose()
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

    /// The checked samples of the only record and the only input; `what` names the fit in the error about too few samples.
    pub(super) fn samples(&self, what: &'static str) -> Result<Samples<'_>> {
        self.input()?;
        self.samples_of_inputs(what)
    }

    /// [`samples`](Self::samples) of any number of inputs, none of them given twice.
    pub(super) fn samples_of_inputs(&self, what: &'static str) -> Result<Samples<'_>> {
        self.samples_at_least(what, FEWEST_SAMPLES * self.inputs.len().max(1))
    }

    /// [`samples_of_inputs`](Self::samples_of_inputs), with at least `need` of them for the fit.
    pub(super) fn samples_at_least(&self, what: &'static str, need: usize) -> Result<Samples<'_>> {
        refuse_repeated(self.inputs)?;
        Samples::new(self, what, need)
    }

    /// The linear approximations from which several structures start; they are made once for all.
    pub(super) fn prepared(&self, samples: &Samples<'_>, monitor: &mut Monitor<'_>) -> &Prepared {
        self.prepared
            .get_or_init(|| samples.prepared().approximated(usize::MAX, monitor))
    }
}

/// The choices.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// The share of the record, at its end, kept for the verdict; 0.05 to 0.9.
    pub fresh_share: f64,
    /// Whether outliers of the output are left out of the fit and of the verdict, rather than only named.
    pub robust: bool,
    /// Whether NaN in the output are missing samples; otherwise NaN is refused.
    pub missing: bool,
    /// The number of branches of [`PARALLEL`](super::PARALLEL), 1 to 5; `None`: 1 to 3 by Schwarz's criterion.
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
            robust: false,
            missing: false,
            branches: None,
            hammerstein: HammersteinMethod::Refined(method),
        }
    }

    /// A method for a Hammerstein system.
    pub fn with_method(method: HammersteinMethod) -> Self {
        Options {
            hammerstein: method,
            ..Options::default()
        }
    }
}

impl Options {
    /// Whether the delay is chosen from the data, by a method that may choose any.
    pub(super) fn chooses_delay(&self) -> bool {
        matches!(&self.hammerstein, HammersteinMethod::Refined(method) if method.delay.is_none())
    }
}

impl Default for Options {
    fn default() -> Self {
        Options::with_fresh_share(0.25)
    }
}
