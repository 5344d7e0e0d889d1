//! One interface to all rules that choose a kernel's bandwidth from the data.

use super::BandwidthSearch;
use super::bootstrap::{self, BlockResampling, Bootstrapped, InBlocks};
use super::generalized::generalized;
use super::h_block::{InTime, gap_from_data};
use super::plug_in::PlugIn;
use crate::error::{Error, ParameterError, Result};
use crate::nonlinearity::kernel::{Degree, Kernel, Sorted, check_points, check_weights};

/// How the bandwidth of a kernel estimate is chosen from the data. The table of [`crate::selection`] says when to use
/// which.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum BandwidthRule {
    /// Exact leave-one-out cross-validation.
    #[default]
    LeaveOneOut,
    /// Generalised cross-validation (Craven and Wahba 1979).
    Generalized,
    /// h-block cross-validation for dependent errors, with the samples in the order of time. Every point is predicted from the samples more
    /// than `gap` samples away.
    HBlock {
        /// At most half the number of samples minus 2. `None`: from the autocorrelation, at most a tenth of the samples and at most 200
        /// (see [`choose_bandwidth`]).
        gap: Option<usize>,
    },
    /// The direct plug-in rule of Ruppert, Sheather and Wand (1995), made for the local line.
    PlugIn,
    /// The smallest mean integrated squared error that the wild bootstrap predicts (Haerdle and Marron 1991), in closed
    /// form: no random numbers.
    WildBootstrap,
    /// The same by the moving block bootstrap for dependent errors (Kuensch 1989), with the samples in the order of time.
    BlockBootstrap {
        /// Residuals in a block, 1 to the number of samples. `None`: n^(1/3) or twice the default gap of h-block cross-validation,
        /// whichever is larger.
        block: Option<usize>,
        /// Resampled records, at least 1. `None`: 40, and from 25,000 samples on fewer, down to 5.
        replicates: Option<usize>,
        /// The seed of the resampling.
        seed: u64,
    },
}

impl BandwidthRule {
    /// All rules, with their defaults.
    pub const ALL: [BandwidthRule; 6] = [
        BandwidthRule::LeaveOneOut,
        BandwidthRule::Generalized,
        BandwidthRule::HBlock { gap: None },
        BandwidthRule::PlugIn,
        BandwidthRule::WildBootstrap,
        BandwidthRule::BlockBootstrap {
            block: None,
            replicates: None,
            seed: 1,
        },
    ];

    /// The name in lower case, as it is written in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            BandwidthRule::LeaveOneOut => "leave-one-out",
            BandwidthRule::Generalized => "generalized",
            BandwidthRule::HBlock { .. } => "h-block",
            BandwidthRule::PlugIn => "plug-in",
            BandwidthRule::WildBootstrap => "wild-bootstrap",
            BandwidthRule::BlockBootstrap { .. } => "block-bootstrap",
        }
    }

    /// The rule of this name, with its defaults.
    pub fn from_name(name: &str) -> Option<BandwidthRule> {
        Self::ALL.into_iter().find(|rule| rule.name() == name)
    }
}

/// A bandwidth chosen from the data, and why.
#[derive(Debug, Clone, PartialEq)]
pub struct BandwidthChoice {
    /// The rule. The values that it took from the data are filled in.
    pub rule: BandwidthRule,
    /// The kernel whose bandwidth it is.
    pub kernel: Kernel,
    /// The degree of the local polynomial.
    pub degree: Degree,
    /// The bandwidth and the score of every candidate; the plug-in rule has no scores.
    pub search: BandwidthSearch,
    /// The name of the score, for the label of its axis. The score is in the squared unit of y.
    pub score: &'static str,
    /// An explanation of the choice, in a sentence or two.
    pub details: String,
}

impl BandwidthChoice {
    /// The bandwidth, in the unit of x.
    pub fn bandwidth(&self) -> f64 {
        self.search.bandwidth
    }
}

/// Chooses the bandwidth of `kernel` and the local polynomial of this degree over the points `(x[i], y[i])` by `rule`.
///
/// A point of weight w counts as w points of weight one. A point of weight zero does not count. The plug-in and the bootstrap rules take
/// the weights as inversely proportional to the noise's variance; the factor does not matter. The result does not depend on the number of
/// threads. Only the rules for dependent errors depend on the order of the points.
///
/// The default gap of [`BandwidthRule::HBlock`] is one less than the first lag at which the autocorrelation of the ordinates about an
/// oversmoothed local line is within $\pm 1.96/\sqrt n$. The window of that line is a tenth of the data's extent on either side.
///
/// ```
/// use flexure::nonlinearity::{Degree, Kernel};
/// use flexure::selection::{BandwidthRule, choose_bandwidth};
/// let x: Vec<f64> = (0..500).map(|i| i as f64 / 250.0 - 1.0).collect();
/// let y: Vec<f64> = x.iter().enumerate().map(|(i, x)| (3.0 * x).sin() + 0.1 * ((i * i % 7) as f64 - 2.3)).collect();
/// for rule in BandwidthRule::ALL {
///     let choice = choose_bandwidth(rule, Kernel::Epanechnikov, Degree::Linear, &x, &y, None)?;
///     println!("{:16} h = {:.3}: {}", rule.name(), choice.bandwidth(), choice.details);
///     assert!((0.05..1.0).contains(&choice.bandwidth()));
/// }
/// # Ok::<(), flexure::Error>(())
/// ```
///
/// # Errors
/// [`crate::Error::Data`]: `LengthMismatch`, `NonFinite`; [`crate::Error::Parameter`] for a negative
/// weight or a rule's own parameter, and `TooShort` with fewer points of positive weight than the rule
/// needs: 3, for the plug-in rule 10 and 5 distinct abscissas, and [`crate::Error::Parameter`]: `RuleUnsuited` for the plug-in rule with a
/// local constant: its bias has another formula.
pub fn choose_bandwidth(
    rule: BandwidthRule,
    kernel: Kernel,
    degree: Degree,
    x: &[f64],
    y: &[f64],
    weights: Option<&[f64]>,
) -> Result<BandwidthChoice> {
    check_points(x, y, 3)?;
    if let Some(weights) = weights {
        check_weights(weights, x.len(), 3)?;
    }
    let problem = BandwidthProblem {
        kernel,
        degree,
        x,
        y,
        weights,
    };
    match rule {
        BandwidthRule::LeaveOneOut => problem.leave_one_out(),
        BandwidthRule::Generalized => Ok(problem.generalized()),
        BandwidthRule::HBlock { gap } => problem.h_block(gap),
        BandwidthRule::PlugIn => problem.plug_in(),
        BandwidthRule::WildBootstrap => problem.wild_bootstrap(),
        BandwidthRule::BlockBootstrap {
            block,
            replicates,
            seed,
        } => problem.block_bootstrap(BlockResampling {
            block,
            replicates,
            seed,
        }),
    }
}

/// The estimate whose bandwidth is to be chosen, and its points.
struct BandwidthProblem<'a> {
    kernel: Kernel,
    degree: Degree,
    x: &'a [f64],
    y: &'a [f64],
    weights: Option<&'a [f64]>,
}

impl BandwidthProblem<'_> {
    fn leave_one_out(&self) -> Result<BandwidthChoice> {
        Ok(self.made(
            BandwidthRule::LeaveOneOut,
            BandwidthSearch::search(self.kernel, self.degree, self.x, self.y, self.weights)?,
            "leave-one-out error",
            "smallest exact leave-one-out cross-validation error".to_owned(),
        ))
    }

    fn generalized(&self) -> BandwidthChoice {
        self.made(
            BandwidthRule::Generalized,
            generalized(self.kernel, self.degree, &self.sorted()),
            "generalised cross-validation score",
            "smallest generalised cross-validation score".to_owned(),
        )
    }

    fn h_block(&self, gap: Option<usize>) -> Result<BandwidthChoice> {
        let from = if gap.is_some() {
            "as given"
        } else {
            "from the autocorrelation"
        };
        let (x, y) = (self.x, self.y);
        let gap = gap.unwrap_or_else(|| gap_from_data(x, y).min((x.len() / 2).saturating_sub(2)));
        Ok(self.made(
            BandwidthRule::HBlock { gap: Some(gap) },
            InTime::new(x, y, self.weights, gap)?.search(self.kernel, self.degree),
            "h-block cross-validation error",
            format!(
                "smallest cross-validation error when every sample is predicted from those more than {gap} samples \
                 away in time (the gap {from})"
            ),
        ))
    }

    fn plug_in(&self) -> Result<BandwidthChoice> {
        let rule = BandwidthRule::PlugIn;
        if self.degree != Degree::Linear {
            return Err(Error::Parameter(ParameterError::RuleUnsuited {
                rule: rule.name(),
                estimator: "kernel regression",
                columns: 1,
                instead: "it is made for the local line; take that, or another rule",
            }));
        }
        let plug_in = PlugIn::from_data(&self.sorted())?;
        Ok(self.made(rule, plug_in.search(self.kernel), "", plug_in.description()))
    }

    fn wild_bootstrap(&self) -> Result<BandwidthChoice> {
        let Bootstrapped { search, details } = bootstrap::wild(self.kernel, self.degree, self.x, self.y, self.weights)?;
        let score = "wild bootstrap's mean squared error";
        Ok(self.made(BandwidthRule::WildBootstrap, search, score, details))
    }

    fn block_bootstrap(&self, resampling: BlockResampling) -> Result<BandwidthChoice> {
        let seed = resampling.seed;
        let InBlocks {
            block,
            replicates,
            chosen,
        } = bootstrap::moving_block(resampling, self.kernel, self.degree, [self.x, self.y], self.weights)?;
        let rule = BandwidthRule::BlockBootstrap {
            block: Some(block),
            replicates: Some(replicates),
            seed,
        };
        let score = "block bootstrap's mean squared error";
        Ok(self.made(rule, chosen.search, score, chosen.details))
    }

    fn sorted(&self) -> Sorted {
        Sorted::new(self.x, self.y, self.weights)
    }

    /// The choice by a rule. `score` is the name of its score.
    fn made(
        &self,
        rule: BandwidthRule,
        search: BandwidthSearch,
        score: &'static str,
        details: String,
    ) -> BandwidthChoice {
        BandwidthChoice {
            rule,
            kernel: self.kernel,
            degree: self.degree,
            search,
            score,
            details,
        }
    }
}

#[cfg(test)]
#[path = "rule_tests.rs"]
mod tests;
