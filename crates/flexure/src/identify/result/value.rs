//! Values of any shape, for JSON, model files and Python.

use serde::ser::{Serialize, SerializeMap, Serializer};

use crate::nonlinearity::Scores;

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
    /// Text.
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

    /// One more, if it is a count.
    fn raise(&mut self) {
        if let Value::Count(count) = self {
            *count += 1;
        }
    }

    /// [`Values::raise_counts`] of all values within.
    pub(in crate::identify) fn raise_counts(&mut self, name: &str) {
        match self {
            Value::List(values) => values.iter_mut().for_each(|value| value.raise_counts(name)),
            Value::Named(values) => values.raise_counts(name),
            _ => {}
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

    /// Raises all counts in the lists of this name by one, here and within.
    pub(in crate::identify) fn raise_counts(&mut self, name: &str) {
        for (own, value) in &mut self.0 {
            match value {
                Value::List(values) if *own == name => values.iter_mut().for_each(Value::raise),
                other => other.raise_counts(name),
            }
        }
    }

    /// The number of this name; NaN if there is none.
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

/// Conversions from the types in a detail.
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
