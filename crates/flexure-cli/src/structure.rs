//! The structure of `flexure identify`, and what it was found to be.

use anyhow::Result;
use clap::ValueEnum;
use flexure_io::{ModelFile, RecordFile};
use flexure_report::data::Page;
use serde_json::Value;

use crate::arguments::Usage;
use crate::cascade::{Cascade, CascadeMethod};
use crate::estimate::{Estimate, Method};
use crate::outcome::{self, Context, Signals};
use crate::page::{self, Decoration};

/// A structure by name.
#[derive(Clone, Copy, PartialEq, ValueEnum)]
pub enum Structure {
    /// A static nonlinearity, then linear dynamics.
    Hammerstein,
    /// Linear dynamics, a static nonlinearity, linear dynamics.
    WienerHammerstein,
}

impl Structure {
    /// Its name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Structure::Hammerstein => "hammerstein",
            Structure::WienerHammerstein => "wiener-hammerstein",
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
}

/// What is to be identified, with the choices that were given.
pub enum Task {
    /// A Hammerstein model by one of its methods.
    Hammerstein(Method),
    /// Any other cascade.
    Cascade(CascadeMethod),
}

/// What was identified.
pub enum Found<'a> {
    /// A Hammerstein model.
    Hammerstein(Context<'a>, Box<Estimate>),
    /// Any other cascade.
    Cascade(Signals<'a>, Box<Cascade>),
}

impl Found<'_> {
    /// The object that `identify --json` prints.
    pub fn json(&self) -> Value {
        match self {
            Found::Hammerstein(context, estimate) => outcome::identification_json(estimate, context),
            Found::Cascade(signals, cascade) => cascade.json(signals),
        }
    }

    /// The file from which `predict` and `validate` work.
    pub fn model_file(&self) -> ModelFile {
        match self {
            Found::Hammerstein(context, estimate) => outcome::model_file(estimate, context),
            Found::Cascade(signals, cascade) => cascade.model_file(signals),
        }
    }

    /// A short account for a terminal.
    pub fn summary(&self) -> String {
        match self {
            Found::Hammerstein(context, estimate) => outcome::summary(estimate, context),
            Found::Cascade(signals, cascade) => cascade.summary(signals),
        }
    }

    /// The page that shows everything.
    pub fn page(&self, file: &RecordFile, decoration: Decoration) -> Result<Page> {
        match self {
            Found::Hammerstein(context, estimate) => page::hammerstein::page(file, context, estimate, decoration),
            Found::Cascade(signals, cascade) => page::cascade::page(file, signals, cascade, decoration),
        }
    }
}
