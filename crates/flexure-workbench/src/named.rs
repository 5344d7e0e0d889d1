//! Choices and settings that have a name, for options of a command line and for arguments of other languages alike.

/// One of several choices, each with a name.
pub trait Named: Copy + Send + Sync + 'static {
    /// All of them, in the order of help texts.
    const ALL: &'static [Self];

    /// Its name.
    fn name(self) -> &'static str;

    /// What it is, for help texts: without a full stop at the end.
    fn description(self) -> &'static str;

    /// The choice of this name.
    fn parse(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|choice| choice.name() == name)
    }
}

/// How the user of a caller writes a setting with a value, for example "--select block": the messages name settings as remedies.
///
/// The settings are "band-method", "estimator", "outside", "select" (the rule that chooses a parameter), "torque-constant" and "weights".
pub type Spelling = fn(name: &str, value: Option<&str>) -> String;
