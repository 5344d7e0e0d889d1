//! The structure of `flexure identify`, and what it was found to be.

use anyhow::Result;
use flexure::identify::{
    self, Auto, AutoIdentification, HammersteinWiener, HammersteinWienerIdentification, Identified, JointInputs,
    JointInputsIdentification, MultipleInputs, MultipleInputsIdentification, Parallel, ParallelIdentification,
    RefinedHammerstein,
};
use flexure_io::{ModelFile, RecordFile};
use flexure_report::data::Page;
use serde_json::Value;

use crate::named::Named;
use crate::systems::cascade::{Cascade, CascadeMethod};
use crate::systems::comparison::Comparison;
use crate::systems::estimate::{Estimate, Method};
use crate::systems::joint_inputs;
use crate::systems::nonlinear_ends;
use crate::systems::outcome::{self, Context, Signals};
use crate::systems::page::{self, Decoration};
use crate::systems::parallel;
use crate::systems::references::{Reference, ReferenceMethod};
use crate::systems::several_inputs;

/// A structure by name.
#[derive(Clone, Copy, PartialEq)]
pub enum Structure {
    /// That of the others which the data support; or none of them.
    Auto,
    /// Linear dynamics alone.
    Linear,
    /// A static nonlinearity, then linear dynamics.
    Hammerstein,
    /// Linear dynamics, then a static nonlinearity.
    Wiener,
    /// Linear dynamics, a static nonlinearity, linear dynamics.
    WienerHammerstein,
    /// A static nonlinearity, linear dynamics, a static nonlinearity.
    HammersteinWiener,
    /// A sum of branches from one input.
    Parallel,
    /// Several inputs, each with a static nonlinearity and linear dynamics of its own.
    MultipleInputs,
    /// Two to four inputs: one static nonlinearity of all of them, then linear dynamics.
    JointInputs,
    /// A polynomial of past outputs and inputs: a reference without blocks.
    Narx,
    /// A regularised Volterra series of second order: a reference without blocks.
    Volterra,
}

impl Named for Structure {
    const ALL: &'static [Structure] = &[
        Structure::Auto,
        Structure::Linear,
        Structure::Hammerstein,
        Structure::Wiener,
        Structure::WienerHammerstein,
        Structure::HammersteinWiener,
        Structure::Parallel,
        Structure::MultipleInputs,
        Structure::JointInputs,
        Structure::Narx,
        Structure::Volterra,
    ];

    fn name(self) -> &'static str {
        match self {
            Structure::Auto => "auto",
            Structure::Linear => "linear",
            Structure::Hammerstein => "hammerstein",
            Structure::Wiener => "wiener",
            Structure::WienerHammerstein => "wiener-hammerstein",
            Structure::HammersteinWiener => "hammerstein-wiener",
            Structure::Parallel => "parallel",
            Structure::MultipleInputs => "multiple-inputs",
            Structure::JointInputs => "joint-inputs",
            Structure::Narx => "narx",
            Structure::Volterra => "volterra",
        }
    }

    fn description(self) -> &'static str {
        match self {
            Structure::Auto => "That of the others which the data support; or none of them",
            Structure::Linear => "Linear dynamics alone",
            Structure::Hammerstein => "A static nonlinearity, then linear dynamics",
            Structure::Wiener => "Linear dynamics, then a static nonlinearity",
            Structure::WienerHammerstein => "Linear dynamics, a static nonlinearity, linear dynamics",
            Structure::HammersteinWiener => "A static nonlinearity, linear dynamics, a static nonlinearity",
            Structure::Parallel => {
                "A sum of branches from one input: each a static nonlinearity and linear dynamics, with linear dynamics before it if needed"
            }
            Structure::MultipleInputs => {
                "Several inputs: each through a static nonlinearity and linear dynamics of its own"
            }
            Structure::JointInputs => {
                "Two to four inputs: one static nonlinearity of all of them, then linear dynamics"
            }
            Structure::Narx => "A polynomial of past outputs and inputs: a reference without blocks",
            Structure::Volterra => "A regularised Volterra series of second order: a reference without blocks",
        }
    }
}

impl Structure {
    /// Whether it has a list of inputs.
    pub fn has_several_inputs(self) -> bool {
        matches!(self, Structure::MultipleInputs | Structure::JointInputs)
    }
}

impl From<identify::Structure> for Structure {
    fn from(structure: identify::Structure) -> Self {
        match structure {
            identify::Structure::Linear => Structure::Linear,
            identify::Structure::Hammerstein => Structure::Hammerstein,
            identify::Structure::Wiener => Structure::Wiener,
            identify::Structure::WienerHammerstein => Structure::WienerHammerstein,
        }
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
    /// A sum of branches.
    Parallel(Parallel),
    /// Several inputs.
    MultipleInputs(MultipleInputs),
    /// Several inputs, jointly.
    JointInputs(JointInputs),
    /// A model without blocks.
    Reference(ReferenceMethod),
    /// The structure itself.
    Compare(Auto),
}

/// What was identified.
pub enum Found<'a> {
    /// A Hammerstein model.
    Hammerstein(Context<'a>, Box<Estimate>),
    /// Any other cascade.
    Cascade(Signals<'a>, Box<Cascade>),
    /// Two nonlinearities.
    HammersteinWiener(Signals<'a>, Box<HammersteinWienerIdentification>),
    /// A sum of branches.
    Parallel(Signals<'a>, Box<ParallelIdentification>),
    /// Several inputs.
    MultipleInputs(Signals<'a>, Box<MultipleInputsIdentification>),
    /// Several inputs, jointly.
    JointInputs(Signals<'a>, Box<JointInputsIdentification>),
    /// A model without blocks.
    Reference(Signals<'a>, Box<Reference>),
    /// The best of several structures, and how they compare.
    Compared(Comparison, Box<Found<'a>>),
}

impl<'a> Found<'a> {
    /// The outcome of a comparison of structures by `method`.
    pub fn compared(result: AutoIdentification, signals: Signals<'a>, method: Auto) -> Self {
        let (comparison, chosen) = Comparison::split(result);
        let chosen = match chosen {
            Identified::Linear(result) => Found::Cascade(signals, Box::new(result.into())),
            Identified::Wiener(result) => Found::Cascade(signals, Box::new(result.into())),
            Identified::WienerHammerstein(result) => Found::Cascade(signals, Box::new(result.into())),
            Identified::Hammerstein(result) => {
                let method = RefinedHammerstein {
                    fresh_share: method.fresh_share,
                    ..Default::default()
                };
                let method = Method::Refined { method, form: None };
                let estimate = Estimate::from_refined(result, None);
                Found::Hammerstein(Context { signals, method }, Box::new(estimate))
            }
        };
        Found::Compared(comparison, Box::new(chosen))
    }

    /// The columns.
    fn signals(&self) -> Signals<'a> {
        match self {
            Found::Hammerstein(context, _) => context.signals,
            Found::Cascade(signals, _)
            | Found::HammersteinWiener(signals, _)
            | Found::Parallel(signals, _)
            | Found::MultipleInputs(signals, _)
            | Found::JointInputs(signals, _)
            | Found::Reference(signals, _) => *signals,
            Found::Compared(_, chosen) => chosen.signals(),
        }
    }

    /// The object that `identify --json` prints.
    pub fn json(&self) -> Value {
        match self {
            Found::Hammerstein(context, estimate) => outcome::identification_json(estimate, context),
            Found::Cascade(signals, cascade) => cascade.json(signals),
            Found::HammersteinWiener(signals, result) => nonlinear_ends::json(result, signals),
            Found::Parallel(signals, result) => parallel::json(result, signals),
            Found::MultipleInputs(signals, result) => several_inputs::json(result, signals),
            Found::JointInputs(signals, result) => joint_inputs::json(result, signals),
            Found::Reference(signals, reference) => reference.json(signals),
            Found::Compared(comparison, chosen) => {
                let mut object = chosen.json();
                object["comparison"] = comparison.json();
                object
            }
        }
    }

    /// The file from which `predict` and `validate` work.
    pub fn model_file(&self) -> flexure::Result<ModelFile> {
        Ok(match self {
            Found::Hammerstein(context, estimate) => outcome::model_file(estimate, context),
            Found::Cascade(signals, cascade) => cascade.model_file(signals),
            Found::HammersteinWiener(signals, result) => nonlinear_ends::model_file(result, signals),
            Found::Parallel(signals, result) => parallel::model_file(result, signals),
            Found::MultipleInputs(signals, result) => several_inputs::model_file(result, signals)?,
            Found::JointInputs(signals, result) => joint_inputs::model_file(result, signals),
            Found::Reference(signals, reference) => reference.model_file(signals),
            Found::Compared(comparison, chosen) => {
                let mut file = chosen.model_file()?;
                file.identification["comparison"] = comparison.json();
                file
            }
        })
    }

    /// The free-run output over the record.
    pub fn predicted(&self) -> &[f64] {
        match self {
            Found::Hammerstein(_, estimate) => &estimate.predicted,
            Found::Cascade(_, cascade) => &cascade.predicted,
            Found::HammersteinWiener(_, result) => &result.predicted,
            Found::Parallel(_, result) => &result.predicted,
            Found::MultipleInputs(_, result) => &result.predicted,
            Found::JointInputs(_, result) => &result.predicted,
            Found::Reference(_, reference) => reference.predicted(),
            Found::Compared(_, chosen) => chosen.predicted(),
        }
    }

    /// A short account for a terminal.
    pub fn summary(&self) -> String {
        match self {
            Found::Hammerstein(context, estimate) => outcome::summary(estimate, context),
            Found::Cascade(signals, cascade) => cascade.summary(signals),
            Found::HammersteinWiener(signals, result) => nonlinear_ends::summary(result, signals),
            Found::Parallel(signals, result) => parallel::summary(result, signals),
            Found::MultipleInputs(signals, result) => several_inputs::summary(result, signals),
            Found::JointInputs(signals, result) => joint_inputs::summary(result, signals),
            Found::Reference(signals, reference) => reference.summary(signals),
            Found::Compared(comparison, chosen) => {
                let signals = self.signals();
                let mut lines = comparison.lines(signals.input, signals.output);
                lines.push(chosen.summary());
                lines.join("\n")
            }
        }
    }

    /// The page that shows everything.
    pub fn page(&self, file: &RecordFile, decoration: Decoration) -> Result<Page> {
        match self {
            Found::Hammerstein(context, estimate) => page::hammerstein::page(file, context, estimate, decoration),
            Found::Cascade(signals, cascade) => page::cascade::page(file, signals, cascade, decoration),
            Found::HammersteinWiener(signals, result) => page::nonlinear_ends::page(file, signals, result, decoration),
            Found::Parallel(signals, result) => page::parallel::page(file, signals, result, decoration),
            Found::MultipleInputs(signals, result) => page::several_inputs::page(file, signals, result, decoration),
            Found::JointInputs(signals, result) => page::joint_inputs::page(file, signals, result, decoration),
            Found::Reference(signals, reference) => page::references::page(file, signals, reference, decoration),
            Found::Compared(comparison, chosen) => {
                let mut page = chosen.page(file, decoration)?;
                comparison.show_on(&mut page);
                Ok(page)
            }
        }
    }
}
