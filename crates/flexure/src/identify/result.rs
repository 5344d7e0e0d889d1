//! The one result of all identifications: what each input passes block by block, the model, and whether it holds.
//!
//! Text, JSON, model file and page are each one walk over an [`Identification`]. What only one structure has is a
//! [`Detail`]: a named value, which the same walks print, save and show.

use serde::ser::{Serialize, SerializeMap, Serializer};

use super::auto::StructureComparison;
use super::outcome::{Verdict, Warning};
use super::reference::{NarxModel, VolterraModel};
use crate::linear::TransferFunction;
use crate::model::Block;
use crate::nonlinearity::{Curve, EstimatorName, Scores, Surface};
use crate::text::{counted, number};

/// The name of a block structure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct StructureName {
    /// On the command line and in files, for example "wiener-hammerstein".
    pub key: &'static str,
    /// For reading, within a sentence, for example "Wiener-Hammerstein".
    pub title: &'static str,
}

impl std::fmt::Display for StructureName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.title)
    }
}

/// An identified system with all that was chosen on the way.
#[derive(Debug, Clone, PartialEq)]
pub struct Identification {
    /// The structure.
    pub structure: StructureName,
    /// What its blocks are, for example "linear dynamics, then a static nonlinearity".
    pub description: String,
    /// The method's name, for example "prediction-error".
    pub method: &'static str,
    /// The inputs' columns.
    pub inputs: Vec<String>,
    /// The output's column.
    pub output: String,
    /// The model, ready to simulate.
    pub model: Block,
    /// What the inputs pass; the paths' outputs add up.
    pub paths: Vec<Path>,
    /// Whether the structure is a sum of paths, even where it has only one.
    pub is_sum: bool,
    /// Added to the sum of the paths.
    pub output_offset: f64,
    /// The number of poles of all linear blocks.
    pub order: usize,
    /// The samples by which the output is delayed; of several paths, the smallest.
    pub delay: usize,
    /// The number of parameters that the data determine.
    pub parameters: usize,
    /// What was tried, in order; the last one was chosen.
    pub tried: Vec<Values>,
    /// What only this structure has.
    pub details: Vec<Detail>,
    /// The autoregression 1, r_1, r_2, ... that whitens the output error; `None` without a model of the noise.
    pub noise_model: Option<Vec<f64>>,
    /// What speaks for this structure and against others, where several were compared.
    pub comparison: Option<StructureComparison>,
    /// Samples `0..fitted` (of all experiments, one after the other) were used for the fit, the rest for the verdict.
    pub fitted: usize,
    /// The free-run output over all samples.
    pub predicted: Vec<f64>,
    /// The verdict on the samples from `fitted` on; of several verdicts, the one that says most against the model.
    pub verdict: Verdict,
    /// Of several inputs, one verdict an input and then one a pair of inputs. The fit is the same in all; the residual tests look for
    /// this input, or the product of these inputs' deviations, in the error.
    pub verdicts: Vec<Verdict>,
    /// What the user should know.
    pub warnings: Vec<Warning>,
}

impl Identification {
    /// The free-run fit on fresh data, percent.
    pub fn fit_percent(&self) -> f64 {
        self.verdict.measures.fit_percent
    }

    /// Whether the model holds; of several inputs, for each and for every pair of them.
    pub fn holds(&self) -> bool {
        self.verdict.holds() && self.verdicts.iter().all(Verdict::holds)
    }

    /// All blocks with their roles, path by path.
    pub fn blocks(&self) -> impl Iterator<Item = &NamedBlock> {
        self.paths.iter().flat_map(|path| &path.blocks)
    }

    /// The first block of this role.
    pub fn block(&self, role: &str) -> Option<&NamedBlock> {
        self.blocks().find(|b| b.role == role)
    }

    /// The heading of the path of this index: by its input, where the paths have inputs of their own.
    pub fn path_title(&self, index: usize) -> String {
        match &self.paths[index].inputs[..] {
            [input] if self.inputs.len() > 1 => format!("from '{input}'"),
            _ => format!("branch {}", index + 1),
        }
    }

    /// The first linear block of this role, for example "linear", "front" or "back".
    pub fn linear(&self, role: &str) -> Option<&TransferFunction> {
        self.block(role).and_then(NamedBlock::linear).map(|g| &g.system)
    }

    /// The first static nonlinearity of this role, for example "nonlinearity".
    pub fn curve(&self, role: &str) -> Option<&Curve> {
        self.block(role).and_then(NamedBlock::curve).map(|c| &c.curve)
    }

    /// The value of the detail of this name.
    pub fn detail(&self, key: &str) -> Option<&Value> {
        self.details.iter().find(|d| d.key == key).map(|d| &d.value)
    }
}

/// Blocks in series.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    /// The columns that enter the first block.
    pub inputs: Vec<String>,
    /// The blocks in the signal's order.
    pub blocks: Vec<NamedBlock>,
}

impl Path {
    /// The number of poles of all linear blocks.
    pub fn order(&self) -> usize {
        self.linear().map(LinearBlock::order).sum()
    }

    /// The samples by which all linear blocks together delay.
    pub fn delay(&self) -> usize {
        self.linear().map(LinearBlock::delay).sum()
    }

    /// The linear blocks that act at the samples.
    pub fn linear(&self) -> impl Iterator<Item = &LinearBlock> {
        self.main().filter_map(NamedBlock::linear)
    }

    /// The static nonlinearities that act at the samples.
    pub fn curves(&self) -> impl Iterator<Item = &StaticBlock> {
        self.main().filter_map(NamedBlock::curve)
    }

    /// The blocks that act at the samples.
    pub fn main(&self) -> impl Iterator<Item = &NamedBlock> {
        self.blocks.iter().filter(|b| !b.between_samples)
    }
}

/// A block and its role in the structure.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedBlock {
    /// Its name in JSON and in files, for example "front"; unique within a path.
    pub role: &'static str,
    /// Its heading, for example "Front linear part".
    pub title: &'static str,
    /// Whether it belongs to the second way through the blocks, which acts at an instant between the samples.
    pub between_samples: bool,
    /// What was found.
    pub found: BlockKind,
}

/// A block of one kind with what is known of it.
#[derive(Debug, Clone, PartialEq)]
pub enum BlockKind {
    /// A static nonlinearity of one input.
    Static(StaticBlock),
    /// Linear dynamics.
    Linear(LinearBlock),
    /// A static nonlinearity of several inputs.
    Surface(Surface),
    /// A polynomial of past outputs and inputs.
    Narx(NarxModel),
    /// A Volterra series.
    Volterra(VolterraModel),
}

impl NamedBlock {
    /// A block that acts at the samples.
    pub fn new(role: &'static str, title: &'static str, found: BlockKind) -> Self {
        NamedBlock {
            role,
            title,
            between_samples: false,
            found,
        }
    }

    /// The static nonlinearity of one input, if it is one.
    pub fn curve(&self) -> Option<&StaticBlock> {
        match &self.found {
            BlockKind::Static(block) => Some(block),
            _ => None,
        }
    }

    /// The linear dynamics, if it is one.
    pub fn linear(&self) -> Option<&LinearBlock> {
        match &self.found {
            BlockKind::Linear(block) => Some(block),
            _ => None,
        }
    }
}

/// A static nonlinearity.
#[derive(Debug, Clone, PartialEq)]
pub struct StaticBlock {
    /// Its table.
    pub curve: Curve,
    /// Half width of the pointwise 95 % band at the curve's points; empty where there is none.
    pub band: Vec<f64>,
    /// What the band is, for example "95 % pointwise, variance only"; empty where there is none.
    pub band_label: &'static str,
    /// The ends of the cubic pieces of a spline, increasing, in the unit of what enters it; else empty.
    pub breakpoints: Vec<f64>,
    /// Points at which the slope of a spline changes at once, increasing, in the same unit.
    pub kinks: Vec<f64>,
    /// How it was estimated, for reading.
    pub description: String,
}

impl StaticBlock {
    /// A cubic spline with kinks.
    pub fn spline(curve: Curve, breakpoints: Vec<f64>, kinks: Vec<f64>) -> BlockKind {
        let end = |x: Option<&f64>| x.map_or_else(String::new, |x| number(*x));
        let description = format!(
            "cubic spline of {} on [{}, {}]{}",
            counted(breakpoints.len().saturating_sub(1), "piece"),
            end(breakpoints.first()),
            end(breakpoints.last()),
            places(&kinks)
        );
        BlockKind::Static(StaticBlock {
            curve,
            band: Vec::new(),
            band_label: "",
            breakpoints,
            kinks,
            description,
        })
    }

    /// A curve by an estimator of this name.
    pub fn new(curve: Curve, estimator: &str) -> Self {
        let x = curve.x();
        let description = format!("{estimator} on [{}, {}]", number(x[0]), number(x[x.len() - 1]));
        StaticBlock {
            curve,
            band: Vec::new(),
            band_label: "",
            breakpoints: Vec::new(),
            kinks: Vec::new(),
            description,
        }
    }

    /// The number of cubic pieces of a spline.
    pub fn pieces(&self) -> usize {
        self.breakpoints.len().saturating_sub(1)
    }

    /// The lower (`sign` -1) or upper (1) edge of the band; empty where there is none.
    pub fn band_edge(&self, sign: f64) -> Vec<f64> {
        let points = self.curve.y().iter().zip(&self.band);
        points.map(|(y, b)| y + sign * b).collect()
    }
}

/// Where the kinks are, to follow the description of a spline.
fn places(kinks: &[f64]) -> String {
    let places: Vec<String> = kinks.iter().map(|at| number(*at)).collect();
    match places.as_slice() {
        [] => String::new(),
        [one] => format!(", kink at {one}"),
        [first @ .., last] => format!(", kinks at {} and {last}", first.join(", ")),
    }
}

/// Linear dynamics.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearBlock {
    /// The transfer function; the delay is leading zeros of its numerator. Always stable.
    pub system: TransferFunction,
    /// Standard errors of its coefficients, where there are some.
    pub errors: Option<CoefficientErrors>,
    /// The estimate of the impulse response from lag 0 that it was fitted to, where there is one.
    pub impulse: Option<ImpulseEstimate>,
}

/// An estimated impulse response.
#[derive(Debug, Clone, PartialEq)]
pub struct ImpulseEstimate {
    /// From lag 0.
    pub values: Vec<f64>,
    /// A value within this of zero is noise with 99 %.
    pub limit: f64,
}

/// Standard errors of a transfer function's coefficients.
#[derive(Debug, Clone, PartialEq)]
pub struct CoefficientErrors {
    /// Of [`TransferFunction::b`], zero for the delay's zeros and for what the calibration fixes.
    pub b: Vec<f64>,
    /// Of [`TransferFunction::a`], zero for the leading 1.
    pub a: Vec<f64>,
}

impl LinearBlock {
    /// A transfer function without standard errors.
    pub fn of(system: TransferFunction) -> BlockKind {
        BlockKind::Linear(LinearBlock {
            system,
            errors: None,
            impulse: None,
        })
    }

    /// The samples by which it delays.
    pub fn delay(&self) -> usize {
        self.system.delay()
    }

    /// Its number of poles.
    pub fn order(&self) -> usize {
        self.system.a().len() - 1
    }
}

/// Something that only one structure has, under its name.
#[derive(Debug, Clone, PartialEq)]
pub struct Detail {
    /// Its name in JSON and in files; empty for what is only for reading.
    pub key: &'static str,
    /// Its value.
    pub value: Value,
    /// How a reader sees it; `None` for what is only in JSON and in files.
    pub shown: Option<Shown>,
    /// Whether model files have it.
    pub saved: bool,
}

/// How a reader sees a detail: a line of text, and a fact or a choice on the page.
#[derive(Debug, Clone, PartialEq)]
pub struct Shown {
    /// Its name for reading.
    pub title: String,
    /// Its value for reading.
    pub text: String,
    /// What it is, or why it was chosen.
    pub note: String,
    /// Where the page shows it.
    pub place: Place,
    /// The scores by which it was chosen.
    pub scores: Option<Score>,
}

/// Where a page shows a detail.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// Among the headline numbers.
    Fact,
    /// Among what was chosen from data; not in the text for a terminal.
    Choice,
    /// Among what was chosen from data, and a line of the text.
    ChoiceAndText,
}

/// A score over candidates.
#[derive(Debug, Clone, PartialEq)]
pub struct Score {
    /// The candidates' name.
    pub x_label: String,
    /// The score's name.
    pub y_label: String,
    /// Whether the candidates are spread logarithmically.
    pub logarithmic: bool,
    /// The candidates, increasing.
    pub x: Vec<f64>,
    /// Their scores.
    pub y: Vec<f64>,
    /// The chosen candidate.
    pub chosen: f64,
}

impl Score {
    /// The scores of an estimator's parameter; `x` names the column of x, and `chosen` has the chosen value of every column.
    pub fn of_parameter(name: EstimatorName, scores: &Scores, chosen: &[f64], x: &str) -> Self {
        let unit = match (name.has_bandwidth(), chosen.len()) {
            (true, 1) => format!(", in the unit of {x}"),
            (true, _) => ", geometric mean over the columns".to_owned(),
            (false, _) => String::new(),
        };
        let logarithmic = !name.counts() || name == EstimatorName::Neighbours;
        // Zero has no place on a logarithmic axis.
        let kept = || (scores.parameter.iter().zip(&scores.score)).filter(|(p, _)| !logarithmic || **p > 0.0);
        Score {
            x_label: format!("{}{unit}", name.parameter()),
            y_label: scores.criterion.to_owned(),
            logarithmic,
            x: kept().map(|(p, _)| *p).collect(),
            y: kept().map(|(_, s)| *s).collect(),
            chosen: match chosen {
                [one] => *one,
                several => (several.iter().map(|h| h.ln()).sum::<f64>() / several.len() as f64).exp(),
            },
        }
    }
}

impl Detail {
    /// A value in JSON and in files.
    pub fn new(key: &'static str, value: impl Into<Value>) -> Self {
        Detail {
            key,
            value: value.into(),
            shown: None,
            saved: true,
        }
    }

    /// Something for reading alone.
    pub fn sentence(place: Place, title: &str, text: impl Into<String>, note: &str) -> Self {
        Detail::new("", Value::None).shown(place, title, text, note)
    }

    /// The same, left out of model files for its size.
    pub fn unsaved(mut self) -> Self {
        self.saved = false;
        self
    }

    /// The same, shown to readers.
    pub fn shown(mut self, place: Place, title: &str, text: impl Into<String>, note: &str) -> Self {
        self.shown = Some(Shown {
            title: title.to_owned(),
            text: text.into(),
            note: note.to_owned(),
            place,
            scores: None,
        });
        self
    }

    /// The same, with the scores by which it was chosen.
    pub fn scored(mut self, scores: Option<Score>) -> Self {
        if let Some(shown) = &mut self.shown {
            shown.scores = scores;
        }
        self
    }
}

/// A value by itself, in a list or under a name.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// Nothing.
    None,
    /// Yes or no.
    Flag(bool),
    /// A whole number.
    Count(usize),
    /// A number.
    Number(f64),
    /// Words.
    Text(String),
    /// Several values.
    List(Vec<Value>),
    /// Values with names.
    Named(Values),
}

impl Value {
    /// The number, if it is one.
    pub fn number(&self) -> Option<f64> {
        match self {
            Value::Count(count) => Some(*count as f64),
            Value::Number(number) => Some(*number),
            _ => None,
        }
    }

    /// The values, if it is a list.
    pub fn list(&self) -> &[Value] {
        match self {
            Value::List(values) => values,
            _ => &[],
        }
    }
}

impl Serialize for Value {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Value::None => serializer.serialize_none(),
            Value::Flag(flag) => flag.serialize(serializer),
            Value::Count(count) => count.serialize(serializer),
            Value::Number(number) => number.serialize(serializer),
            Value::Text(text) => text.serialize(serializer),
            Value::List(list) => list.serialize(serializer),
            Value::Named(values) => values.serialize(serializer),
        }
    }
}

/// Values with names, in order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Values(Vec<(&'static str, Value)>);

impl Values {
    /// Values with these names.
    pub fn new<const N: usize>(values: [(&'static str, Value); N]) -> Self {
        Values(values.into())
    }

    /// The same with further values at the end.
    pub fn and<const N: usize>(mut self, values: [(&'static str, Value); N]) -> Self {
        self.0.extend(values);
        self
    }

    /// Names and values in order.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, &Value)> {
        self.0.iter().map(|(name, value)| (*name, value))
    }

    /// The value of this name.
    pub fn get(&self, name: &str) -> Option<&Value> {
        self.0.iter().find(|(n, _)| *n == name).map(|(_, value)| value)
    }

    /// The number of this name; NaN where there is none.
    pub fn number(&self, name: &str) -> f64 {
        self.get(name).and_then(Value::number).unwrap_or(f64::NAN)
    }
}

impl From<&Scores> for Values {
    fn from(scores: &Scores) -> Self {
        Values::new([
            ("criterion", scores.criterion.into()),
            ("parameter", scores.parameter.as_slice().into()),
            ("score", scores.score.as_slice().into()),
            ("at_edge", scores.at_edge.into()),
            ("binning_error", scores.binning_error.into()),
        ])
    }
}

impl Serialize for Values {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.0.len()))?;
        for (name, value) in &self.0 {
            map.serialize_entry(name, value)?;
        }
        map.end()
    }
}

/// Conversions of what a detail consists of.
macro_rules! value_from {
    ($($from:ty => $to:expr),* $(,)?) => {
        $(impl From<$from> for Value {
            fn from(value: $from) -> Self {
                $to(value)
            }
        })*
    };
}

value_from! {
    bool => Value::Flag,
    usize => Value::Count,
    f64 => Value::Number,
    String => Value::Text,
    &str => |text: &str| Value::Text(text.to_owned()),
    Values => Value::Named,
}

impl<T: Into<Value>> From<Vec<T>> for Value {
    fn from(values: Vec<T>) -> Self {
        Value::List(values.into_iter().map(Into::into).collect())
    }
}

impl<T: Clone + Into<Value>> From<&[T]> for Value {
    fn from(values: &[T]) -> Self {
        values.to_vec().into()
    }
}

impl<T: Into<Value>> From<Option<T>> for Value {
    fn from(value: Option<T>) -> Self {
        value.map_or(Value::None, Into::into)
    }
}
