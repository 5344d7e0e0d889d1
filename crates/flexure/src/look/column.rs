//! A column by itself: its range, missing samples, levels, standstill at an extreme, and outliers.

use super::limits::{
    BROKEN, FEWEST_SAMPLES, HELD, MOST_OUTLIERS, OUTLIER, OUTLIER_JUMP, OUTLIER_SIZE, ROUNDING, STOP_HELD, STOP_RATIO,
    STOP_RUN, STOP_SHARE, STOP_STEPS, STOP_VALUES, STOP_VISITS,
};
use super::quantisation::Quantisation;
use super::spectrum::Spectrum;
use crate::identify::few_levels;
use crate::linear::correlation::{mean, variance};
use crate::outliers;
use crate::sort;

/// The properties of a column.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Its name.
    pub name: String,
    /// Samples that are numbers.
    pub samples: usize,
    /// Samples that are NaN.
    pub missing: usize,
    /// Samples that are infinite.
    pub infinite: usize,
    /// The least finite value; without samples it is NaN, and so are the following numbers.
    pub least: f64,
    /// The greatest finite value.
    pub greatest: f64,
    /// The mean.
    pub mean: f64,
    /// The standard deviation.
    pub deviation: f64,
    /// Whether it does not vary by more than rounding.
    pub constant: bool,
    /// Whether it rises by the same amount from sample to sample, like a sample number or an instant.
    pub counts: bool,
    /// Whether it holds its values for some samples each, as commands do.
    pub held: bool,
    /// The values that it takes, in increasing order, if these are few.
    pub levels: Option<Vec<f64>>,
    /// The grid on which its values lie, if there is one.
    pub quantisation: Option<Quantisation>,
    /// Its standstill at its least value.
    pub lower_stop: Option<Stop>,
    /// Its standstill at its greatest value.
    pub upper_stop: Option<Stop>,
    /// Samples far from their neighbours: their distance from the running median of five samples is more than ten times the usual distance
    /// nearby, and more than a quarter of the standard deviation. Empty if many samples are like this. Where a column holds its values for
    /// some samples, as commands do, neighbours are the values held before and after.
    pub outliers: Vec<usize>,
    /// Its power spectrum; `None` if the column does not vary.
    pub spectrum: Option<Spectrum>,
}

/// A column standing still at an extreme: clipped, or held there on purpose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stop {
    /// The extreme.
    pub value: f64,
    /// The number of samples with this value.
    pub samples: usize,
    /// The longest run of such samples.
    pub longest: usize,
}

impl Column {
    /// Looks at a column; `bridged` has its samples with values in place of missing ones.
    pub(super) fn new(name: &str, samples: &[f64], bridged: &[f64]) -> Self {
        let finite: Vec<f64> = samples.iter().copied().filter(|v| v.is_finite()).collect();
        let missing = samples.iter().filter(|v| v.is_nan()).count();
        let (least, greatest) = match finite.is_empty() {
            true => (f64::NAN, f64::NAN),
            false => {
                (finite.iter().copied()).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, g), v| (l.min(v), g.max(v)))
            }
        };
        // Relative to one of the values, since squares of large offsets lose digits.
        let offset = finite.first().copied().unwrap_or(f64::NAN);
        let shifted: Vec<f64> = finite.iter().map(|v| v - offset).collect();
        let deviation = match finite.is_empty() {
            true => f64::NAN,
            false => variance(&shifted).sqrt(),
        };
        let largest = least.abs().max(greatest.abs());
        let constant = !(deviation > ROUNDING * largest);
        let mut column = Column {
            name: name.to_owned(),
            samples: finite.len(),
            missing,
            infinite: samples.len() - missing - finite.len(),
            least,
            greatest,
            mean: offset + mean(&shifted),
            deviation,
            constant,
            counts: !constant && counts(samples),
            held: !constant && bridged.len() > HELD * runs(bridged).count(),
            levels: None,
            quantisation: None,
            lower_stop: None,
            upper_stop: None,
            outliers: Vec::new(),
            spectrum: None,
        };
        if constant || column.counts {
            return column;
        }
        column.levels = few_levels(&finite).map(|levels| sort::sorted(&levels));
        if finite.len() >= FEWEST_SAMPLES && column.levels.is_none() {
            let sorted = sort::sorted(&finite);
            column.quantisation = Quantisation::of_sorted(&sorted);
            let step = column.quantisation.map_or((greatest - least) / STOP_STEPS, |q| q.step);
            column.lower_stop = stop(samples, &sorted, least, step);
            column.upper_stop = stop(samples, &sorted, greatest, step);
            column.outliers = standing_alone(&column, samples, bridged);
        }
        column.spectrum = Spectrum::new(bridged);
        column
    }

    /// Whether it can depend on others, or others on it: it varies, does not count the samples, and is not mostly missing.
    pub fn is_signal(&self) -> bool {
        !self.constant && !self.counts && self.samples >= FEWEST_SAMPLES && self.samples > self.missing + self.infinite
    }
}

/// The runs of equal samples.
fn runs(samples: &[f64]) -> impl Iterator<Item = &[f64]> {
    samples.chunk_by(|a, b| a == b)
}

/// Whether the samples rise by the same step, except for rounding; where rows are lost, by multiples of it.
fn counts(samples: &[f64]) -> bool {
    let mut steps: Vec<f64> = samples.windows(2).map(|w| w[1] - w[0]).collect();
    if steps.is_empty() || !steps.iter().all(|step| *step > 0.0) {
        return false;
    }
    let middle = steps.len() / 2;
    let step = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
    let lost = |s: &&f64| (*s / step).round() != 1.0;
    // Printed instants have few digits.
    let is_multiple = |s: &f64| (s / step - (s / step).round()).abs() < 0.1;
    steps.iter().all(is_multiple) && steps.iter().filter(lost).count() * BROKEN <= steps.len()
}

/// The standstill at an extreme of a column whose values, in increasing order, are `sorted`: a run of such samples, or far more of
/// them than usual.
fn stop(samples: &[f64], sorted: &[f64], extreme: f64, step: f64) -> Option<Stop> {
    let at_extreme = || runs(samples).filter(|run| run[0] == extreme).map(<[f64]>::len);
    let (at, longest) = (at_extreme().sum::<usize>(), at_extreme().max().unwrap_or(0));
    // How long the value of a usual sample is held.
    let mut held: Vec<usize> = runs(samples).flat_map(|run| vec![run.len(); run.len()]).collect();
    held.sort_unstable();
    let usual = held.get(held.len() / 2).copied().unwrap_or(1);
    let within = |low: f64, high: f64| sorted.partition_point(|v| *v < high) - sorted.partition_point(|v| *v < low);
    // The samples as near to the extreme as the next step, without the extreme itself.
    let near = within(extreme - 1.5 * step, extreme + 1.5 * step) - at;
    let values = runs(sorted).count();
    // The extremes are the first and the last value.
    let between = runs(sorted).skip(1).take(values.saturating_sub(2));
    let most = between.map(<[f64]>::len).max().unwrap_or(0);
    let exceeds = |of: usize| at as f64 > STOP_RATIO * of as f64;
    // On a grid, the next step says how often such values are.
    let is_most = near > 0 || exceeds(most);
    let returns = at_extreme().count() >= STOP_VISITS && values >= STOP_VALUES && is_most;
    let stands = (longest >= STOP_RUN.max(STOP_HELD * usual) || returns)
        && at as f64 > STOP_SHARE * sorted.len() as f64
        && exceeds(near);
    stands.then_some(Stop {
        value: extreme,
        samples: at,
        longest,
    })
}

/// Those of these places whose values jump and return: their group is on one side of the values before and after it, and farther from both than
/// [`OUTLIER_JUMP`] of the changes around. A smooth signal follows the median of five, but at the turns; these are farther from it than all else.
fn jumping(values: &[f64], places: &[usize]) -> Vec<usize> {
    let groups = places.chunk_by(|a, b| a + 1 == *b);
    let jump = groups.flat_map(|group| {
        let (first, end) = (group[0], group[group.len() - 1] + 1);
        let (before, after) = (
            &values[first.saturating_sub(3)..first],
            &values[end..(end + 3).min(values.len())],
        );
        let changes = before.windows(2).chain(after.windows(2)).map(|w| (w[1] - w[0]).abs());
        let usual = OUTLIER_JUMP * changes.fold(0.0, f64::max);
        let jumps = move |k: &&usize| {
            let beyond = |sign: f64| {
                let mut borders = before.last().into_iter().chain(after.first());
                borders.all(|border| sign * (values[**k] - border) > usual)
            };
            beyond(1.0) || beyond(-1.0)
        };
        group.iter().filter(jumps)
    });
    jump.copied().collect()
}

/// The outliers (Hampel 1974, about a running median of five, which preserves steps).
fn standing_alone(column: &Column, samples: &[f64], bridged: &[f64]) -> Vec<usize> {
    // Each value that is held counts once.
    let lengths: Vec<usize> = match column.held {
        true => runs(bridged).map(<[f64]>::len).collect(),
        false => vec![1; bridged.len()],
    };
    let starts: Vec<usize> = lengths
        .iter()
        .scan(0, |next, len| Some(std::mem::replace(next, *next + len)))
        .collect();
    let values: Vec<f64> = starts.iter().map(|&start| bridged[start]).collect();
    let distances = outliers::distances(&values);
    let matters = |k: &usize| {
        lengths[*k] == 1 && samples[starts[*k]].is_finite() && distances[*k] > OUTLIER_SIZE * column.deviation
    };
    let step = column.quantisation.map_or(0.0, |q| q.step);
    let found = outliers::far(&distances, OUTLIER, step).into_iter();
    let found: Vec<usize> = found.filter(matters).collect();
    let found: Vec<usize> = jumping(&values, &found).into_iter().map(|k| starts[k]).collect();
    match found.len() as f64 > MOST_OUTLIERS * bridged.len() as f64 {
        true => Vec::new(),
        false => found,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_counter_counts_where_rows_are_lost_and_other_columns_do_not() {
        let counter: Vec<f64> = (0..200).filter(|i| i % 30 != 7).map(f64::from).collect();
        assert!(counts(&counter));
        // Instants that jitter, a counter that starts again, and a ramp whose steps differ.
        let jitter: Vec<f64> = (0..200).map(|i| f64::from(i) + 0.2 * f64::from(i % 3)).collect();
        let again: Vec<f64> = (0..200).map(|i| f64::from(i % 100)).collect();
        let ramp: Vec<f64> = (0..200).map(|i| f64::from(i * (1 + i % 2))).collect();
        for other in [jitter, again, ramp] {
            assert!(!counts(&other));
        }
    }
}
