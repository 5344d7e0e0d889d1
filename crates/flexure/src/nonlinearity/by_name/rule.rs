//! The rules that choose a tuning parameter from the data.

use super::EstimatorName;
use crate::selection::BandwidthRule;

/// How the tuning parameter is chosen from the data.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Rule {
    /// Leave-one-out cross-validation.
    #[default]
    LeaveOneOut,
    /// Generalised cross-validation (Craven and Wahba 1979).
    Generalized,
    /// Cross-validation that leaves neighbours in time out together: for rows in order of time whose errors depend on
    /// each other.
    Block,
    /// The direct plug-in rule of Ruppert, Sheather and Wand (1995).
    PlugIn,
    /// The wild bootstrap (Haerdle and Marron 1991).
    Bootstrap,
}

impl Rule {
    /// All rules.
    pub const ALL: [Rule; 5] = [
        Rule::LeaveOneOut,
        Rule::Generalized,
        Rule::Block,
        Rule::PlugIn,
        Rule::Bootstrap,
    ];

    /// The name in lower case, as it is written on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Rule::LeaveOneOut => "loo",
            Rule::Generalized => "gcv",
            Rule::Block => "block",
            Rule::PlugIn => "plugin",
            Rule::Bootstrap => "bootstrap",
        }
    }

    /// The rule of this name.
    pub fn parse(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|rule| rule.name() == name)
    }

    /// Whether it can choose the parameter of this estimator in so many columns.
    pub fn suits(self, estimator: EstimatorName, columns: usize) -> bool {
        match (self, estimator) {
            (Rule::LeaveOneOut, _) => true,
            (_, EstimatorName::LocalBandwidth) => false,
            (Rule::Generalized | Rule::Block, _) => true,
            (Rule::PlugIn | Rule::Bootstrap, _) => estimator.has_bandwidth() && columns == 1,
        }
    }

    /// The same for the bandwidth of a kernel in one column.
    pub(super) fn for_bandwidth(self) -> BandwidthRule {
        match self {
            Rule::LeaveOneOut => BandwidthRule::LeaveOneOut,
            Rule::Generalized => BandwidthRule::Generalized,
            Rule::Block => BandwidthRule::HBlock { gap: None },
            Rule::PlugIn => BandwidthRule::PlugIn,
            Rule::Bootstrap => BandwidthRule::WildBootstrap,
        }
    }
}
