//! What the user should know before trusting a regression.

use std::collections::HashSet;

use flexure::nonlinearity::{EstimatorName, Tuning};

use super::band::{BandMethod, Banding, FEWEST};
use super::data::Data;
use super::estimate::{Estimate, Evaluated};
use super::{Arguments, Outside};
use flexure_workbench::text::list;

/// With a larger share of rows alone in their windows the user is warned.
const MANY_ALONE: f64 = 0.05;

/// About so many rows are compared to find copies.
const COMPARED: usize = 100_000;
/// With a larger share of copies the user is warned, where the abscissas are at least this share of the distinct rows.
const MANY_COPIES: f64 = 0.1;
const MANY_ABSCISSAS: f64 = 0.9;

/// Columns whose extent is this share of the bandwidth have no slope in a local fit.
const FLAT: f64 = 1e-8;

/// The warnings, one a line.
pub fn warnings(estimate: &Estimate, data: &Data, curve: &Evaluated, arguments: &Arguments) -> Vec<String> {
    let mut warnings = Vec::new();
    let (name, parameter) = (estimate.fit.name, estimate.fit.name.parameter());
    if estimate.fit.scores.as_ref().is_some_and(|scores| scores.at_edge) {
        let what = match (&estimate.fit.local, &curve.band) {
            (None, _) => "the regression",
            (Some(_), None) => "the line with one bandwidth, but not the one shown,",
            (Some(_), Some(_)) => "the line with one bandwidth, whose band is shown,",
        };
        warnings.push(format!(
            "the score is smallest at the edge of the values tried ({parameter} {}): {what} is {}",
            list(&estimate.fit.parameter),
            if name.has_bandwidth() {
                "nearly straight or constant, or rougher than the data resolve"
            } else {
                "rougher than the values tried resolve"
            },
        ));
    }
    if name == EstimatorName::LocalLinear && (0..data.x.len()).all(|j| fit_is_constant(estimate, data, j)) {
        warnings.push(
            "the bandwidth is so much wider than the data that no slope can be told: the fit is constant; take a bandwidth of the data's size"
                .to_owned(),
        );
    }
    let blocks = matches!(estimate.method.tuning, Tuning::FromData(rule) if rule.in_time());
    if estimate.dependent && !blocks {
        warnings.push(
            "neighbouring rows are correlated beyond what is estimated, as in a record in order of time: leave-one-out may then follow the \
             noise (undersmooth), and a band for independent rows is too narrow; --select block allows for it"
                .to_owned(),
        );
    }
    if estimate.dependent
        && blocks
        && estimate
            .banding
            .is_some_and(|banding| banding.is_for_independent_rows())
    {
        warnings.push(
            "neighbouring rows are correlated beyond what is estimated, and the band is one for independent rows: it is too narrow; --band-method \
             block allows for it"
                .to_owned(),
        );
    }
    if let (Some(local), Some(Banding::Robust(_))) = (&estimate.fit.local, estimate.banding)
        && !local.jumps.is_empty()
    {
        warnings.push(
            "the band is that of the line with one bandwidth, which jumps make narrow, and so it says little of the estimate shown, whose error is \
             smaller; --estimator local-bandwidth --band-method bootstrap makes a band of its own"
                .to_owned(),
        );
    }
    let (alone, rows) = (estimate.validation.alone, estimate.rows.len());
    if alone as f64 > MANY_ALONE * rows as f64 {
        warnings.push(format!(
            "no other row is within reach of {alone} of the {rows} rows: R squared counts them as predicted by their nearest rows, and the \
             curve is not known between them; take a wider bandwidth"
        ));
    }
    let unknown = curve.y.iter().filter(|v| v.is_nan()).count();
    if unknown > 0 {
        let where_to = match (arguments.outside, &arguments.at) {
            (Outside::Nan, Some(_)) => "; --outside nearest or --outside linear continues the estimate beyond the data",
            _ => "",
        };
        warnings.push(format!(
            "at {unknown} of the {} points of the result there are no data within reach: the estimate there is NaN{where_to}",
            curve.y.len()
        ));
    }
    let bare = curve
        .y
        .iter()
        .zip(&curve.lower)
        .filter(|(y, l)| y.is_finite() && l.is_nan())
        .count();
    if bare > 0 && curve.band.is_some() {
        warnings.push(format!(
            "at {bare} of the {} points of the result the band is NaN: the estimate is continued there, or too few data are within reach",
            curve.y.len()
        ));
    }
    if let Some(wide) = wider_than_the_data(estimate, data, curve) {
        warnings.push(format!(
            "at {wide} of the {} points of the result the band is wider than all values of '{}' together: too few rows are within reach to tell \
             anything there",
            curve.y.len(),
            data.y_name
        ));
    }
    if let Some(copies) = copies(data) {
        warnings.push(format!(
            "about {:.0} % of the rows are copies of others: a row is then predicted from itself, and the parameter that is chosen follows the \
             noise; leave the copies out, or count them by --weights",
            100.0 * copies
        ));
    }
    if curve.band.is_none() && arguments.band_method == BandMethod::Auto && rows < FEWEST {
        warnings.push(format!("no band was made, as it needs {FEWEST} rows or more"));
    } else if curve.band.is_none() && arguments.band_method == BandMethod::Auto {
        warnings.push(format!(
            "no band was made, as --estimator {name} would have to be fitted to these {} rows many times over; --band-method bootstrap does",
            estimate.rows.len()
        ));
    }
    if data.x.len() == 1 {
        let levels = distinct(data, 10);
        if levels < 10 && estimate.rows.len() > 10 * levels {
            warnings.push(format!(
                "column '{}' has only {levels} levels: between them the estimate rests on the estimator's shape, not on data",
                data.names[0]
            ));
        }
    }
    warnings
}

/// Whether the bandwidth of a local line is out of all proportion to the values of column `j`.
fn fit_is_constant(estimate: &Estimate, data: &Data, j: usize) -> bool {
    let parameter = &estimate.fit.parameter;
    let Some(h) = parameter.get(j).or(parameter.first()) else {
        return false;
    };
    let (low, high) = (estimate.rows.iter().map(|&i| data.x[j][i]))
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
            (x.min(low), x.max(high))
        });
    high > low && h * FLAT > high - low
}

/// The number of distinct values of the first column, counted up to `most`.
fn distinct(data: &Data, most: usize) -> usize {
    let mut found: Vec<f64> = Vec::new();
    for i in data.rows() {
        let value = data.x[0][i];
        if !found.contains(&value) {
            found.push(value);
        }
        if found.len() == most {
            break;
        }
    }
    found.len()
}

/// At how many points the band is wider than the range of the measured ordinates; none if nowhere.
fn wider_than_the_data(estimate: &Estimate, data: &Data, curve: &Evaluated) -> Option<usize> {
    let y = || estimate.rows.iter().map(|&i| data.y[i]);
    let range = y().fold(f64::NEG_INFINITY, f64::max) - y().fold(f64::INFINITY, f64::min);
    let edges = curve.lower.iter().zip(&curve.upper);
    let wide = edges
        .filter(|(lower, upper)| range > 0.0 && *upper - *lower > range)
        .count();
    (wide > 0).then_some(wide)
}

/// The share of rows that repeat another one, where it is large among values of which there are many: rounded values
/// repeat of themselves.
fn copies(data: &Data) -> Option<f64> {
    let rows = data.rows();
    // Copies are looked at together or not at all: whether a row is, hangs on its values.
    let one_in = (rows.len() / COMPARED).max(1) as u64;
    let (mut seen, mut abscissas, mut count) = (HashSet::new(), HashSet::new(), 0_usize);
    for i in rows {
        let x = (data.x.iter()).fold(0, |hash: u64, column| mixed(hash ^ column[i].to_bits()));
        if x % one_in == 0 {
            count += 1;
            abscissas.insert(x);
            seen.insert(mixed(x ^ data.y[i].to_bits()));
        }
    }
    let copies = 1.0 - seen.len() as f64 / count.max(1) as f64;
    // Distinct abscissas nearly as many as distinct rows: these are no levels.
    (copies > MANY_COPIES && abscissas.len() as f64 > MANY_ABSCISSAS * seen.len() as f64).then_some(copies)
}

/// A number as good as random (the finaliser of SplitMix64).
fn mixed(value: u64) -> u64 {
    let value = (value ^ (value >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let value = (value ^ (value >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    value ^ (value >> 31)
}
