//! Values in TOML that serde reads: stricter checks, and clearer messages.

use flexure::manipulator::Friction;
use flexure::text::exact;
use serde::{Deserialize, Deserializer};

/// Serde's message about a value, in plain words and on one line.
pub(super) fn plain(message: &str) -> String {
    let message = message.lines().collect::<Vec<_>>().join("; ");
    let message = message
        .replace("expected f64", "expected a number")
        .replace("expected usize", "expected a whole number that is not negative")
        .replace("expected u64", "expected a whole number that is not negative")
        .replace("` as i128,", "`,");
    // The value is between backquotes, with all of its zeros.
    let words = message.split('`').map(|word| match word.parse::<f64>() {
        Ok(number) if word.len() > 20 => exact(number),
        _ => word.to_owned(),
    });
    words.collect::<Vec<_>>().join("`")
}

/// A list of exactly `N` numbers: serde alone ignores the rest of a longer list.
pub(super) fn list<'de, D: Deserializer<'de>, T: From<[f64; N]>, const N: usize>(values: D) -> Result<T, D::Error> {
    array(Vec::deserialize(values)?).map(T::from)
}

/// A number for each of two joints, or one for both.
pub(super) fn of_joints<'de, D: Deserializer<'de>>(values: D) -> Result<Option<[f64; 2]>, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged, expecting = "expected a number, or a list of two")]
    enum OfJoints {
        Both(f64),
        Each(Vec<f64>),
    }
    match OfJoints::deserialize(values)? {
        OfJoints::Both(number) => Ok(Some([number; 2])),
        OfJoints::Each(numbers) => array(numbers).map(Some),
    }
}

/// A list of pairs of numbers.
pub(super) fn pairs<'de, D: Deserializer<'de>>(values: D) -> Result<Option<Vec<[f64; 2]>>, D::Error> {
    let pairs = Vec::<Vec<f64>>::deserialize(values)?;
    pairs.into_iter().map(array).collect::<Result<_, _>>().map(Some)
}

/// A list of triples of numbers.
pub(super) fn triples<'de, D: Deserializer<'de>>(values: D) -> Result<Option<Vec<[f64; 3]>>, D::Error> {
    let triples = Vec::<Vec<f64>>::deserialize(values)?;
    triples.into_iter().map(array).collect::<Result<_, _>>().map(Some)
}

/// The six numbers of a friction.
pub(super) fn friction<'de, D: Deserializer<'de>>(values: D) -> Result<Option<Friction>, D::Error> {
    list(values).map(|g| Some(Friction(g)))
}

fn array<const N: usize, E: serde::de::Error>(numbers: Vec<f64>) -> Result<[f64; N], E> {
    let count = numbers.len();
    let wrong = |_| E::custom(format!("there must be {N} numbers in this list, but it has {count}"));
    numbers.try_into().map_err(wrong)
}
