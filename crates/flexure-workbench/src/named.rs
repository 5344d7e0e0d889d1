//! Choices and settings with names, used as options of the command line and as arguments in other languages.

/// A choice with its name.
pub struct NamedValue<T> {
    /// The choice.
    pub value: T,
    /// Its name.
    pub name: &'static str,
    /// What it is, for help texts: without a full stop at the end.
    pub description: &'static str,
}

impl<T> NamedValue<T> {
    /// A choice with its name and what it is.
    pub const fn new(value: T, name: &'static str, description: &'static str) -> Self {
        NamedValue {
            value,
            name,
            description,
        }
    }
}

/// One of several choices, each with a name.
pub trait Named: Copy + PartialEq + Send + Sync + 'static {
    /// All of them, in the order of help texts.
    const ALL: &'static [NamedValue<Self>];

    /// Its name.
    fn name(self) -> &'static str {
        let own = Self::ALL.iter().find(|choice| choice.value == self);
        own.map_or("", |choice| choice.name)
    }

    /// The choice of this name.
    fn parse(name: &str) -> Option<Self> {
        let named = Self::ALL.iter().find(|choice| choice.name == name);
        named.map(|choice| choice.value)
    }
}

/// How a user writes a setting with a value in this interface, for example "--select block". Messages name settings as remedies.
///
/// The settings are "band-method", "estimator", "outside", "position" (of a rigid axis), "select" (the rule that chooses a parameter), "torque-constant" and "weights".
pub type Spelling = fn(name: &str, value: Option<&str>) -> String;
