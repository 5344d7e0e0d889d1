//! Cascades that have more, or other, blocks than a Hammerstein model: what was identified, as JSON, as a model file and in words.

use std::ops::ControlFlow;

use flexure::identify::{
    ApproximationScore, Linear, LinearIdentification, Stage, TriedStructure, Verdict, Warning, Wiener,
    WienerHammerstein, WienerHammersteinIdentification, WienerIdentification, WienerStart,
};
use flexure::linear::{Complex, TransferFunction};
use flexure::nonlinearity::Curve;
use flexure::{Block, Record, Result};
use flexure_io::ModelFile;
use serde_json::{Value, json};

use crate::named::Named;
use crate::systems::nonlinear_ends::pieces_words;
use crate::systems::outcome::{self, SETTLED, Signals};
use crate::systems::structure::Structure;
use crate::text::{self, number};

/// What all methods of this kind do.
const METHOD: &str = "prediction-error";
/// What is said of a second branch.
pub const INTERSAMPLE: &str = "the nonlinearity acts between the samples too: a second branch, with the same nonlinearity and the same \
                               poles, adds to the output";

/// How to identify a cascade; the choices are made from data.
pub enum CascadeMethod {
    /// Linear alone.
    Linear(Linear),
    /// Linear, static.
    Wiener(Wiener),
    /// Linear, static, linear.
    WienerHammerstein(WienerHammerstein),
}

impl CascadeMethod {
    /// Identifies the system from `input` to `output`; `stage` is told what is being done, and may
    /// stop it.
    pub fn identify(
        &self,
        record: &Record,
        input: &str,
        output: &str,
        stage: &dyn Fn(&str) -> ControlFlow<()>,
    ) -> Result<Cascade> {
        let progress = &mut |now: Stage| stage(now.name());
        match self {
            CascadeMethod::Linear(method) => method.identify_with(record, input, output, progress).map(Cascade::from),
            CascadeMethod::Wiener(method) => method.identify_with(record, input, output, progress).map(Cascade::from),
            CascadeMethod::WienerHammerstein(method) => {
                method.identify_with(record, input, output, progress).map(Cascade::from)
            }
        }
    }
}

/// A linear part of a cascade.
pub struct LinearBlock {
    /// Its name in JSON, for example "front".
    pub key: &'static str,
    /// Its heading on a page.
    pub title: &'static str,
    pub system: TransferFunction,
}

impl LinearBlock {
    /// Its name in words.
    pub fn name(&self) -> &'static str {
        match self.key {
            "linear" => "linear part",
            key => key,
        }
    }

    /// Samples by which it delays.
    pub fn delay(&self) -> usize {
        self.system.b().iter().take_while(|b| **b == 0.0).count()
    }

    /// Its number of poles.
    pub fn order(&self) -> usize {
        self.system.a().len() - 1
    }

    /// Order, delay and static gain for reading.
    pub fn words(&self) -> String {
        let gain = number(self.system.static_gain());
        format!("order {}, delay {}, static gain {gain}", self.order(), self.delay())
    }
}

/// An identified cascade with all that was chosen on the way.
pub struct Cascade {
    pub structure: Structure,
    /// For reading, within a sentence; for example "Wiener-Hammerstein".
    pub title: &'static str,
    /// What the structure is, in words.
    pub words: &'static str,
    pub model: Block,
    /// What the search for the poles started from.
    pub start: &'static str,
    /// Before the nonlinearity, if there is a linear part; or the only one.
    pub front: Option<LinearBlock>,
    /// None in a linear model.
    pub nonlinearity: Option<Curve>,
    /// The nonlinearity's breakpoints, increasing.
    pub breakpoints: Vec<f64>,
    /// Points at which its slope changes at once, increasing.
    pub kinks: Vec<f64>,
    /// Behind the nonlinearity, if there is a linear part.
    pub back: Option<LinearBlock>,
    /// Front and back of a second branch, for an instant between the samples; none unless the data ask for it.
    pub intersample: Vec<LinearBlock>,
    pub output_offset: f64,
    pub approximations: Vec<ApproximationScore>,
    pub tried: Vec<TriedStructure>,
    pub fitted: usize,
    pub predicted: Vec<f64>,
    pub verdict: Verdict,
    pub warnings: Vec<Warning>,
}

/// The only linear part of a model.
fn only(system: TransferFunction) -> Option<LinearBlock> {
    Some(LinearBlock {
        key: "linear",
        title: "Linear part",
        system,
    })
}

impl From<LinearIdentification> for Cascade {
    fn from(result: LinearIdentification) -> Self {
        Cascade {
            structure: Structure::Linear,
            title: "linear",
            words: "linear dynamics alone",
            model: result.model,
            start: "the order of the linear approximation with the smallest Schwarz criterion",
            front: only(result.linear),
            nonlinearity: None,
            breakpoints: Vec::new(),
            kinks: Vec::new(),
            back: None,
            intersample: Vec::new(),
            output_offset: result.output_offset,
            approximations: result.approximations,
            tried: Vec::new(),
            fitted: result.fitted,
            predicted: result.predicted,
            verdict: result.verdict,
            warnings: result.warnings,
        }
    }
}

impl From<WienerIdentification> for Cascade {
    fn from(result: WienerIdentification) -> Self {
        Cascade {
            structure: Structure::Wiener,
            title: "Wiener",
            words: "linear dynamics, then a static nonlinearity",
            model: result.model,
            start: match result.start {
                WienerStart::LinearApproximation => "those of the best linear approximation",
                WienerStart::HigherMoments => {
                    "those of an impulse response from higher moments of input and output, which did better than linear approximations"
                }
            },
            front: only(result.linear),
            nonlinearity: Some(result.nonlinearity),
            breakpoints: result.breakpoints,
            kinks: result.kinks,
            back: None,
            intersample: Vec::new(),
            output_offset: 0.0,
            approximations: result.approximations,
            tried: result.tried,
            fitted: result.fitted,
            predicted: result.predicted,
            verdict: result.verdict,
            warnings: result.warnings,
        }
    }
}

impl From<WienerHammersteinIdentification> for Cascade {
    fn from(result: WienerHammersteinIdentification) -> Self {
        let intersample = result.intersample.into_iter().flat_map(|between| {
            [
                LinearBlock {
                    key: "intersample_front",
                    title: "Front, between the samples",
                    system: between.front,
                },
                LinearBlock {
                    key: "intersample_back",
                    title: "Back, between the samples",
                    system: between.back,
                },
            ]
        });
        Cascade {
            structure: Structure::WienerHammerstein,
            title: "Wiener-Hammerstein",
            words: "linear dynamics, a static nonlinearity, linear dynamics",
            model: result.model,
            start: "those of the best linear approximation, shared out in every way",
            front: Some(LinearBlock {
                key: "front",
                title: "Front linear part",
                system: result.front,
            }),
            nonlinearity: Some(result.nonlinearity),
            breakpoints: result.breakpoints,
            kinks: result.kinks,
            back: Some(LinearBlock {
                key: "back",
                title: "Back linear part",
                system: result.back,
            }),
            intersample: intersample.collect(),
            output_offset: result.output_offset,
            approximations: result.approximations,
            tried: result.tried,
            fitted: result.fitted,
            predicted: result.predicted,
            verdict: result.verdict,
            warnings: result.warnings,
        }
    }
}

impl Cascade {
    /// The linear parts in the signal's order, at the samples.
    pub fn linear(&self) -> impl Iterator<Item = &LinearBlock> {
        self.front.iter().chain(&self.back)
    }

    /// All linear parts.
    pub fn all_linear(&self) -> impl Iterator<Item = &LinearBlock> {
        self.linear().chain(&self.intersample)
    }

    /// The number of poles of all linear parts.
    pub fn order(&self) -> usize {
        self.linear().map(LinearBlock::order).sum()
    }

    /// Samples by which the linear parts delay together.
    pub fn delay(&self) -> usize {
        self.linear().map(LinearBlock::delay).sum()
    }

    /// The number of cubic pieces of the nonlinearity.
    pub fn pieces(&self) -> usize {
        self.breakpoints.len().saturating_sub(1)
    }

    /// What enters the nonlinearity under an input.
    pub fn intermediate(&self, input: &[f64]) -> Vec<f64> {
        match &self.front {
            Some(front) => front.system.simulate_from_mean(input),
            None => input.to_vec(),
        }
    }

    /// The object that `identify --json` prints.
    pub fn json(&self, signals: &Signals) -> Value {
        let mut object = json!({
            "structure": self.structure.name(),
            "method": METHOD,
            "start": self.start,
            "order": self.order(),
            "delay": self.delay(),
            "nonlinearity": (self.nonlinearity.as_ref())
                .map(|curve| json!({
                    "x": curve.x(),
                    "y": curve.y(),
                    "breakpoints": self.breakpoints,
                    "kinks": self.kinks,
                })),
            "output_offset": self.output_offset,
            "approximations": (self.approximations.iter())
                .map(|a| json!({ "order": a.order, "relative_error": a.relative_error }))
                .collect::<Vec<_>>(),
            "tried": self.tried.iter().map(tried_json).collect::<Vec<_>>(),
        });
        for block in self.all_linear() {
            let own = json!({ "order": block.order(), "delay": block.delay() });
            object[block.key] = outcome::linear_json(&block.system);
            outcome::extend(&mut object[block.key], own);
        }
        let judged = outcome::judged_json(signals, self.fitted, &self.verdict, &self.warnings);
        outcome::extend(&mut object, judged);
        object
    }

    /// The file from which `predict` and `validate` work.
    pub fn model_file(&self, signals: &Signals) -> ModelFile {
        let mut details = outcome::details(self.json(signals));
        if let Value::Object(fields) = &mut details {
            // What the blocks themselves say already.
            self.all_linear().for_each(|block| drop(fields.remove(block.key)));
            if self.nonlinearity.is_some() {
                fields.insert("breakpoints".to_owned(), json!(self.breakpoints));
                fields.insert("kinks".to_owned(), json!(self.kinks));
            }
        }
        ModelFile {
            flexure: ModelFile::CURRENT.to_owned(),
            structure: self.structure.name().to_owned(),
            method: METHOD.to_owned(),
            input: signals.input.to_owned(),
            output: signals.output.to_owned(),
            sample_time: signals.sample_time,
            delay: self.delay(),
            order: self.order(),
            settling: Some(self.model.settling(SETTLED)),
            noise_model: None,
            estimated: self.verdict.estimated,
            block: self.model.clone(),
            identification: details,
        }
    }

    /// A short account for a terminal.
    pub fn summary(&self, signals: &Signals) -> String {
        let mut lines = vec![
            format!(
                "{} model from '{}' to '{}'",
                text::capitalised(self.title),
                signals.input,
                signals.output
            ),
            outcome::fit_line(&self.verdict),
        ];
        lines.extend(self.front.iter().flat_map(linear_lines));
        let words = |_| format!("  nonlinearity        {}", pieces_words(&self.breakpoints, &self.kinks));
        lines.extend(self.nonlinearity.as_ref().map(words));
        lines.extend(self.back.iter().flat_map(linear_lines));
        if !self.intersample.is_empty() {
            lines.push(format!("  {INTERSAMPLE}:"));
            lines.extend(self.intersample.iter().flat_map(linear_lines));
        }
        if self.output_offset != 0.0 {
            lines.push(format!("  output offset       {}", number(self.output_offset)));
        }
        if !self.tried.is_empty() {
            lines.push(format!("  structures tried    {}", self.tried.len()));
        }
        lines.push(format!("  {}", self.verdict.words()));
        lines.extend(self.warnings.iter().map(|w| format!("  warning: {w}")));
        lines.join("\n")
    }
}

fn tried_json(t: &TriedStructure) -> Value {
    json!({
        "front_order": t.front_order,
        "front_numerator": t.front_numerator,
        "back_order": t.back_order,
        "back_numerator": t.back_numerator,
        "pieces": t.pieces,
        "kinks": t.kinks,
        "instants": t.instants,
        "samples": t.samples,
        "relative_error": t.relative_error,
        "bic": t.bic,
    })
}

/// A linear part with its coefficients, poles and zeros.
pub fn linear_lines(block: &LinearBlock) -> Vec<String> {
    let system = &block.system;
    vec![
        format!("  {:<19} {}", block.name(), block.words()),
        format!("    b = {}", outcome::coefficients(system.b(), None)),
        format!("    a = {}", outcome::coefficients(system.a(), None)),
        format!("    poles {}", roots(system.poles())),
        format!("    zeros {}", roots(system.zeros())),
    ]
}

/// Roots for reading, a conjugate pair once.
fn roots(list: Option<Vec<Complex<f64>>>) -> String {
    let Some(list) = list else {
        return "not found".to_owned();
    };
    let told = list.iter().filter(|z| z.im >= 0.0).map(|z| match z.im {
        im if im > 0.0 => format!("{} ± {}i", number(z.re), number(im)),
        _ => number(z.re),
    });
    let told: Vec<String> = told.collect();
    match told.is_empty() {
        true => "none".to_owned(),
        false => told.join(", "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_are_told_once() {
        let z = |re, im| Complex::new(re, im);
        assert_eq!(roots(None), "not found");
        assert_eq!(roots(Some(Vec::new())), "none");
        let list = vec![z(0.5, 0.25), z(0.5, -0.25), z(-2.0, 0.0)];
        assert_eq!(roots(Some(list)), "0.5000 ± 0.2500i, -2.000");
    }
}
