//! The comparison of structures.

use std::fmt;

use super::symptoms::Symptom;
use crate::identify::result::StructureName;
use crate::text::p_value;
use crate::validation::ResidualTest;

/// The evidence against a candidate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Refutation {
    /// A residual test rejects it.
    Test(ResidualTest),
    /// Another candidate predicts significantly better.
    Comparison {
        /// The better one.
        better: StructureName,
        /// The ratio of the mean squared errors, above 1.
        ratio: f64,
        /// The probability of such a difference if both predict equally well. For a candidate whose error is even larger than that of a
        /// refuted one that is no more general: the probability for that one.
        p_value: f64,
    },
}

/// A row of the comparison.
#[derive(Debug, Clone, PartialEq)]
pub struct StructureCandidate {
    /// The structure.
    pub structure: StructureName,
    /// The fit on fresh samples, percent.
    pub fit_percent: f64,
    /// The RMS of the error there, in the unit of y.
    pub rms: f64,
    /// The number of parameters.
    pub parameters: usize,
    /// What refutes it; a comparison first, then the tests.
    pub refuted_by: Vec<Refutation>,
    /// The verdict on this candidate alone, as text.
    pub verdict: String,
}

/// What the data say about all structures that were compared.
#[derive(Debug, Clone, PartialEq)]
pub struct StructureComparison {
    /// The simplest structure that no comparison refutes; if none is supported, the best of these structures.
    pub chosen: StructureName,
    /// The structure that the data support, if any.
    pub supported: Option<StructureName>,
    /// Structures as simple as the chosen one that predict equally well: the data do not distinguish them.
    pub as_good: Vec<StructureName>,
    /// All that were fitted, simplest first.
    pub candidates: Vec<StructureCandidate>,
    /// The share of the chosen one's squared error that is detected not to be noise: by a general function of the input, or by the test
    /// that refutes it; zero if nothing is detected.
    pub not_noise: f64,
    /// If no structure is supported: what the chosen one's error looks like, with shares of its square, largest first.
    pub looks_like: Vec<(Symptom, f64)>,
    /// Why, in sentences.
    pub reasons: Vec<String>,
}

impl fmt::Display for Refutation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Refutation::Test(t) => write!(f, "the test '{}' ({})", t.kind.name(), p_value(t.p_value)),
            Refutation::Comparison {
                better,
                ratio,
                p_value: p,
            } => write!(
                f,
                "{better}, whose squared error is {} times smaller ({})",
                Factor(*ratio),
                p_value(*p)
            ),
        }
    }
}

/// A factor above 1: to three decimals near 1, to whole numbers if it is large, and no number where its size means nothing.
struct Factor(f64);

impl fmt::Display for Factor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            r if r < 10.0 => write!(f, "{r:.3}"),
            r if r < 1e4 => write!(f, "{r:.0}"),
            _ => f.write_str("more than 10,000"),
        }
    }
}
