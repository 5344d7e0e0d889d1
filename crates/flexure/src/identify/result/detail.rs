//! A result that only one structure has: a named value, and how a reader sees it.

use super::value::Value;
use crate::nonlinearity::{EstimatorName, Scores};

/// A result that only one structure has, with its name.
#[derive(Debug, Clone, PartialEq)]
pub struct Detail {
    /// Its name in JSON and in files; empty if it is only for reading.
    pub key: &'static str,
    /// Its value.
    pub value: Value,
    /// How a reader sees it; `None` if it is only in JSON and in files.
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
    /// Among the headline numbers of a page; not in the text for a terminal, which has it elsewhere.
    PageFact,
    /// Among the choices from data; not in the text for a terminal.
    Choice,
    /// Among the choices from data, and as a line of the text.
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
    /// The scores of whole numbers, with the labels of both axes.
    pub fn of_numbers([x, y]: [&str; 2], numbers: &[usize], scores: Vec<f64>, chosen: usize) -> Self {
        Score {
            x_label: x.to_owned(),
            y_label: y.to_owned(),
            logarithmic: false,
            x: numbers.iter().map(|n| *n as f64).collect(),
            y: scores,
            chosen: chosen as f64,
        }
    }

    /// The scores of an estimator's parameter; `x` names the column of x, and `chosen` has the chosen value of every column.
    pub fn of_parameter(name: EstimatorName, scores: &Scores, chosen: &[f64], x: &str) -> Self {
        let unit = match (name.has_bandwidth(), chosen.len()) {
            (true, 1) => format!(", in the unit of {x}"),
            (true, _) => ", geometric mean over the columns".to_owned(),
            (false, _) => String::new(),
        };
        let logarithmic = !name.counts() || name == EstimatorName::Neighbours;
        // A logarithmic axis cannot show zero.
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

    /// A detail only for reading.
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
