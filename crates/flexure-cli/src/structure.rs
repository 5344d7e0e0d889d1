//! The structure of `flexure identify`, and what it was found to be.

use anyhow::Result;
use clap::ValueEnum;
use flexure::identify::{
    HammersteinWiener, HammersteinWienerIdentification, MultipleInputs, MultipleInputsIdentification,
};
use flexure_io::{ModelFile, RecordFile};
use flexure_report::data::Page;
use serde_json::Value;

use crate::arguments::Usage;
use crate::cascade::{Cascade, CascadeMethod};
use crate::estimate::{Estimate, Method};
use crate::nonlinear_ends;
use crate::outcome::{self, Context, Signals};
use crate::page::{self, Decoration};
use crate::references::{Reference, ReferenceMethod};
use crate::several_inputs;

/// A structure by name.
#[derive(Clone, Copy, PartialEq, ValueEnum)]
pub enum Structure {
    /// A static nonlinearity, then linear dynamics.
    Hammerstein,
    /// Linear dynamics, a static nonlinearity, linear dynamics.
    WienerHammerstein,
    /// A static nonlinearity, linear dynamics, a static nonlinearity.
    HammersteinWiener,
    /// Several inputs, --input A,B: each through a static nonlinearity and linear dynamics of its own.
    MultipleInputs,
    /// A polynomial of past outputs and inputs: a reference without blocks.
    Narx,
    /// A regularised Volterra series of second order: a reference without blocks.
    Volterra,
}

impl Structure {
    /// Its name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Structure::Hammerstein => "hammerstein",
            Structure::WienerHammerstein => "wiener-hammerstein",
            Structure::HammersteinWiener => "hammerstein-wiener",
            Structure::MultipleInputs => "multiple-inputs",
            Structure::Narx => "narx",
            Structure::Volterra => "volterra",
        }
    }

    /// Refuses the first option that was given of those that only Hammerstein models have.
    pub fn refuse(self, given: Option<&str>) -> Result<(), Usage> {
        given.map_or(Ok(()), |option| {
            Err(Usage(format!(
                "{option} is an option of --structure hammerstein, not of --structure {}; leave it out, or choose --structure \
                 hammerstein",
                self.name()
            )))
        })
    }

    /// Refuses the first output that was asked for of those that only a chain of blocks from one input has.
    pub fn refuse_output(self, asked: Option<&str>) -> Result<(), Usage> {
        asked.map_or(Ok(()), |option| {
            Err(Usage(format!(
                "{option} is for chains of blocks from one input, which --structure {} is not; take its result from the text or \
                 from --json",
                self.name()
            )))
        })
    }
}

/// What is to be identified, with the choices that were given.
pub enum Task {
    /// A Hammerstein model by one of its methods.
    Hammerstein(Method),
    /// Any other cascade.
    Cascade(CascadeMethod),
    /// Two nonlinearities.
    HammersteinWiener(HammersteinWiener),
    /// Several inputs.
    MultipleInputs(MultipleInputs),
    /// A model without blocks.
    Reference(ReferenceMethod),
}

/// What was identified.
pub enum Found<'a> {
    /// A Hammerstein model.
    Hammerstein(Context<'a>, Box<Estimate>),
    /// Any other cascade.
    Cascade(Signals<'a>, Box<Cascade>),
    /// Two nonlinearities.
    HammersteinWiener(Signals<'a>, Box<HammersteinWienerIdentification>),
    /// Several inputs.
    MultipleInputs(Signals<'a>, Box<MultipleInputsIdentification>),
    /// A model without blocks.
    Reference(Signals<'a>, Box<Reference>),
}

impl Found<'_> {
    /// The object that `identify --json` prints.
    pub fn json(&self) -> Value {
        match self {
            Found::Hammerstein(context, estimate) => outcome::identification_json(estimate, context),
            Found::Cascade(signals, cascade) => cascade.json(signals),
            Found::HammersteinWiener(signals, result) => nonlinear_ends::json(result, signals),
            Found::MultipleInputs(signals, result) => several_inputs::json(result, signals),
            Found::Reference(signals, reference) => reference.json(signals),
        }
    }

    /// The file from which `predict` and `validate` work; `None` for what is no chain of blocks from one input.
    pub fn model_file(&self) -> Option<ModelFile> {
        Some(match self {
            Found::Hammerstein(context, estimate) => outcome::model_file(estimate, context),
            Found::Cascade(signals, cascade) => cascade.model_file(signals),
            Found::HammersteinWiener(signals, result) => nonlinear_ends::model_file(result, signals),
            Found::MultipleInputs(..) | Found::Reference(..) => return None,
        })
    }

    /// A short account for a terminal.
    pub fn summary(&self) -> String {
        match self {
            Found::Hammerstein(context, estimate) => outcome::summary(estimate, context),
            Found::Cascade(signals, cascade) => cascade.summary(signals),
            Found::HammersteinWiener(signals, result) => nonlinear_ends::summary(result, signals),
            Found::MultipleInputs(signals, result) => several_inputs::summary(result, signals),
            Found::Reference(signals, reference) => reference.summary(signals),
        }
    }

    /// The page that shows everything; `None` for what is no chain of blocks from one input.
    pub fn page(&self, file: &RecordFile, decoration: Decoration) -> Result<Option<Page>> {
        let page = match self {
            Found::Hammerstein(context, estimate) => page::hammerstein::page(file, context, estimate, decoration),
            Found::Cascade(signals, cascade) => page::cascade::page(file, signals, cascade, decoration),
            Found::HammersteinWiener(signals, result) => page::nonlinear_ends::page(file, signals, result, decoration),
            Found::MultipleInputs(..) | Found::Reference(..) => return Ok(None),
        };
        page.map(Some)
    }
}
