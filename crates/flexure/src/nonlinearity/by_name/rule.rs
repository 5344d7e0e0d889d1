//! The rules that choose a tuning parameter from the data.

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
    /// The moving block bootstrap (Kuensch 1989): for rows in order of time whose errors depend on each other.
    BlockBootstrap {
        /// Rows in a block, from 1 to all; from the data where none is given.
        block: Option<usize>,
    },
}

impl Rule {
    /// All rules.
    pub const ALL: [Rule; 6] = [
        Rule::LeaveOneOut,
        Rule::Generalized,
        Rule::Block,
        Rule::PlugIn,
        Rule::Bootstrap,
        Rule::BlockBootstrap { block: None },
    ];

    /// The name in lower case, as it is written on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Rule::LeaveOneOut => "loo",
            Rule::Generalized => "gcv",
            Rule::Block => "block",
            Rule::PlugIn => "plugin",
            Rule::Bootstrap => "bootstrap",
            Rule::BlockBootstrap { .. } => "block-bootstrap",
        }
    }

    /// The rule of this name.
    pub fn parse(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|rule| rule.name() == name)
    }

    /// Whether it allows for errors that depend on each other, the rows being in order of time.
    pub fn in_time(self) -> bool {
        matches!(self, Rule::Block | Rule::BlockBootstrap { .. })
    }

    /// The same for the bandwidth of a kernel in one column.
    pub(super) fn for_bandwidth(self, seed: u64) -> BandwidthRule {
        match self {
            Rule::LeaveOneOut => BandwidthRule::LeaveOneOut,
            Rule::Generalized => BandwidthRule::Generalized,
            Rule::Block => BandwidthRule::HBlock { gap: None },
            Rule::PlugIn => BandwidthRule::PlugIn,
            Rule::Bootstrap => BandwidthRule::WildBootstrap,
            Rule::BlockBootstrap { block } => BandwidthRule::BlockBootstrap {
                block,
                replicates: None,
                seed,
            },
        }
    }
}
