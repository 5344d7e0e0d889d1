//! A first look at a record: the properties of its columns, and which depends on which.
//!
//! | file | what |
//! |---|---|
//! | `column.rs` | range, missing samples, levels, standstill at an extreme, outliers |
//! | `quantisation.rs` | the grid on which a column's values lie |
//! | `spectrum.rs` | the power spectrum, and the band that has most of the power |
//! | `clock.rs` | the step of the instants, its jitter, gaps |
//! | `dependence.rs`, `coherence.rs` | which column follows which, with what delay, and how much of its power |
//! | `integration.rs` | whether a column integrates another, as a position integrates a force |
//! | `relations.rs` | derivatives and multiples of other columns |
//! | `limits.rs` | every threshold |
//!
//! ```
//! use flexure::systems::{KnownHammerstein, KnownNonlinearity, known_linear_parts};
//!
//! let [linear, _] = known_linear_parts();
//! let record = KnownHammerstein::usual(KnownNonlinearity::DeadZone, linear).simulate(4000, 1); // columns u, y, y0
//! let look = flexure::look::look(&record, None, None)?;
//! let [u, y] = ["u", "y"].map(|name| look.columns.iter().position(|c| c.name == name).unwrap());
//! let found = look.dependences.iter().find(|d| (d.cause, d.effect) == (u, y)).unwrap();
//! assert_eq!(found.delay, 0);
//! assert!(found.coherent > 0.5);
//! # Ok::<(), flexure::Error>(())
//! ```

mod beside;
mod clock;
mod coherence;
mod column;
mod dependence;
mod integration;
mod limits;
mod quantisation;
mod relations;
mod spectrum;
#[cfg(test)]
mod tests;

pub use beside::{Beside, beside};
pub use clock::{Clock, Gap};
pub use column::{Column, Stop};
pub use dependence::{Correlations, Dependence, Direction, Kind};
pub use integration::{IntegratedOutput, integrated_output};
pub use quantisation::Quantisation;
pub use relations::{ColumnRelation, Relation};
pub use spectrum::Spectrum;

use crate::error::Result;
use crate::parallel;
use crate::record::{Record, bridged};

/// The properties of a record.
#[derive(Debug, Clone, PartialEq)]
pub struct Look {
    /// Its columns, in order.
    pub columns: Vec<Column>,
    /// The column of the instants, as an index of the columns.
    pub time: Option<usize>,
    /// Its instants, in its own unit; `None` without them.
    pub clock: Option<Clock>,
    /// The dependences among the signals, those that explain most first. If no column depends on another, the probability of any false one
    /// is at most 1 %.
    pub dependences: Vec<Dependence>,
    /// The pairs of columns whose second one integrates the first, with the evidence.
    pub integrations: Vec<Integration>,
    /// Columns that are computed from others.
    pub relations: Vec<ColumnRelation>,
}

/// A column that integrates another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Integration {
    /// The column that is integrated, as an index of the record's columns.
    pub input: usize,
    /// The one that integrates it.
    pub output: usize,
    /// The evidence for it.
    pub found: IntegratedOutput,
}

/// Looks at a record. `time` is the name of the column of the instants, `sample_time` the time between two samples in s.
///
/// If a test needs all samples, missing or infinite ones are interpolated linearly; for the tests of dependence, outliers are too. Columns that do not vary, count the samples or are
/// mostly missing take no part in the tests of dependence.
///
/// # Errors
/// [`Error::Data`](crate::Error::Data): `MissingColumn`; [`Error::Stopped`](crate::Error::Stopped).
pub fn look(record: &Record, time: Option<&str>, sample_time: Option<f64>) -> Result<Look> {
    let clock = match time {
        Some(name) => Clock::new(record.column(name)?),
        None => None,
    };
    let time = record.names().iter().position(|name| Some(name.as_str()) == time);
    let all: Vec<(&str, &[f64])> = record.columns().collect();
    let finite = |v: &f64| if v.is_finite() { *v } else { f64::NAN };
    let whole = |samples: &[f64]| bridged(&samples.iter().map(finite).collect::<Vec<f64>>());
    let whole: Vec<Vec<f64>> = all.iter().map(|(_, samples)| whole(samples)).collect();
    let columns = parallel::map(all.len(), |i| Column::new(all[i].0, all[i].1, &whole[i]));
    crate::interrupt::check()?;
    let is_signal = |i: &usize| Some(*i) != time && columns[*i].is_signal();
    let usual: Vec<(usize, Vec<f64>)> = (0..all.len())
        .filter(is_signal)
        .map(|i| (i, without(&whole[i], &columns[i].outliers)))
        .collect();
    let signals: Vec<(usize, &[f64])> = usual.iter().map(|(i, samples)| (*i, samples.as_slice())).collect();
    let dependences = dependence::dependences(&signals);
    crate::interrupt::check()?;
    let part = dependence::stretch(record.len(), signals.len());
    let parts: Vec<(usize, &[f64])> = signals.iter().map(|(i, s)| (*i, &s[part.clone()])).collect();
    let relations = relations::relations(&parts, sample_time);
    crate::interrupt::check()?;
    let pairs: Vec<(usize, usize)> = (0..signals.len())
        .flat_map(|i| (0..signals.len()).filter(move |j| *j != i).map(move |j| (i, j)))
        .collect();
    let integrations = parallel::map(pairs.len(), |p| {
        let ((input, u), (output, y)) = (signals[pairs[p].0], signals[pairs[p].1]);
        let found = integrated_output(u, y)?;
        Some(Integration { input, output, found })
    });
    Ok(Look {
        columns,
        time,
        clock,
        dependences,
        integrations: integrations.into_iter().flatten().collect(),
        relations,
    })
}

/// The samples, with those at some places interpolated.
fn without(samples: &[f64], at: &[usize]) -> Vec<f64> {
    let mut known = samples.to_vec();
    at.iter().for_each(|&t| known[t] = f64::NAN);
    if at.is_empty() { known } else { bridged(&known) }
}
