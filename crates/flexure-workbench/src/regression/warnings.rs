//! What to know before trusting a regression.

use std::collections::HashSet;

use flexure::nonlinearity::{EstimatorName, Outside, Tuning};

use super::band::{BandMaker, FEWEST_ROWS};
use super::{BandMethod, BandOptions, Diagnosis, Evaluation, Regression, RegressionData};
use crate::Spelling;
use crate::plots::extent;
use crate::text::list;

/// A larger share of rows that are alone in their windows causes a warning.
const MANY_ALONE: f64 = 0.05;

/// The most outliers that are named by their row.
const NAMED_ROWS: usize = 5;

/// About this many rows are compared to find copies.
const COMPARED: usize = 10_000;
/// A larger share of copies causes a warning, if the distinct abscissas are at least the share [`MANY_ABSCISSAS`] of the distinct rows.
const MANY_COPIES: f64 = 0.1;
/// See [`MANY_COPIES`].
const MANY_ABSCISSAS: f64 = 0.9;

/// Columns whose extent is this share of the bandwidth have no slope in a local fit.
const FLAT: f64 = 1e-8;

/// A column with this many levels or more is not called discrete.
const MANY_LEVELS: usize = 10;

/// What the warnings are about.
pub struct Subject<'a> {
    pub regression: &'a Regression,
    pub data: &'a RegressionData<'a>,
    pub diagnosis: &'a Diagnosis,
    /// The evaluation with the band that was asked for, if there is one.
    pub evaluation: Option<(&'a Evaluation, &'a BandOptions)>,
    pub spelling: Spelling,
}

impl Subject<'_> {
    /// The warnings, one sentence each.
    pub fn warnings(&self) -> Vec<String> {
        let all = [
            self.outliers(),
            self.edge(),
            self.no_slope(),
            self.dependent_rows(),
            self.dependent_band(),
            self.band_beside_jumps(),
            self.alone(),
            self.unknown_points(),
            self.points_without_band(),
            self.wide_band(),
            self.copies(),
            self.no_band(),
            self.levels(),
        ];
        all.into_iter().flatten().collect()
    }

    fn setting(&self, name: &str, value: &str) -> String {
        (self.spelling)(name, Some(value))
    }

    /// How the band was made, if there is one.
    fn band_maker(&self) -> Option<BandMaker> {
        let (_, options) = self.evaluation?;
        BandMaker::new(options, self.regression, self.data)
    }

    /// Whether the parameter was chosen by a rule for rows in order of time.
    fn by_blocks(&self) -> bool {
        matches!(self.regression.estimator.tuning, Tuning::FromData(rule) if rule.in_time())
    }

    fn edge(&self) -> Option<String> {
        let fit = &self.regression.fit;
        if !fit.scores.as_ref().is_some_and(|scores| scores.at_edge) {
            return None;
        }
        let band = self.evaluation.and_then(|(evaluation, _)| evaluation.band.as_ref());
        let what = match (&fit.local, band) {
            (None, _) => "the regression",
            (Some(_), None) => "the line with one bandwidth, but not the one shown,",
            (Some(_), Some(_)) => "the line with one bandwidth, whose band is shown,",
        };
        Some(format!(
            "the score is smallest at the edge of the values tried ({} {}): {what} is {}",
            fit.name.parameter(),
            list(&fit.parameter),
            match fit.name.has_bandwidth() {
                true => "nearly straight or constant, or rougher than the data resolve",
                false => "rougher than the values tried resolve",
            },
        ))
    }

    /// The bandwidth of a local line is far too large for the values of every column.
    fn no_slope(&self) -> Option<String> {
        let fit = &self.regression.fit;
        let flat = |j: usize| {
            let [low, high] = self.data.range(j);
            let bandwidth = fit.parameter.get(j).or(fit.parameter.first());
            bandwidth.is_some_and(|h| high > low && h * FLAT > high - low)
        };
        (fit.name == EstimatorName::LocalLinear && (0..self.data.x.len()).all(flat)).then(|| {
            "the bandwidth is so much wider than the data that no slope can be determined: the fit is constant; take a bandwidth of the data's size"
                .to_owned()
        })
    }

    fn outliers(&self) -> Option<String> {
        let (left_out, found) = (&self.data.left_out, &self.diagnosis.outliers);
        let (rows, remedy) = match left_out.is_empty() {
            true => (
                found,
                format!("they pull the fit; {} leaves them out", (self.spelling)("robust", None)),
            ),
            false => (left_out, "they were left out of the fit".to_owned()),
        };
        let mut at: Vec<String> = rows.iter().take(NAMED_ROWS).map(usize::to_string).collect();
        if rows.len() > at.len() {
            at.push(format!("{} more", rows.len() - at.len()));
        }
        (!rows.is_empty()).then(|| {
            format!(
                "outliers far from the curve, {} of the {} rows (rows {}): {remedy}",
                rows.len(),
                self.data.y.len(),
                at.join(", ")
            )
        })
    }

    fn dependent_rows(&self) -> Option<String> {
        (self.diagnosis.dependent && !self.by_blocks()).then(|| {
            format!(
                "neighbouring rows are correlated beyond what is estimated, as in a record in order of time: leave-one-out may then follow the \
                 noise (undersmooth), and a band for independent rows is too narrow; {} allows for it",
                self.setting("select", "block")
            )
        })
    }

    fn dependent_band(&self) -> Option<String> {
        let independent = self.band_maker().is_some_and(|maker| maker.is_for_independent_rows());
        (self.diagnosis.dependent && self.by_blocks() && independent).then(|| {
            format!(
                "neighbouring rows are correlated beyond what is estimated, and the band is one for independent rows: it is too narrow; \
                 {} allows for it",
                self.setting("band-method", "block")
            )
        })
    }

    fn band_beside_jumps(&self) -> Option<String> {
        let jumps = (self.regression.fit.local.as_ref()).is_some_and(|local| !local.jumps.is_empty());
        (jumps && matches!(self.band_maker(), Some(BandMaker::Robust(_)))).then(|| {
            format!(
                "the band is that of the line with one bandwidth, which jumps make narrow, and so it says little of the estimate shown, whose \
                 error is smaller; {} {} makes a band of its own",
                self.setting("estimator", "local-bandwidth"),
                self.setting("band-method", "bootstrap")
            )
        })
    }

    fn alone(&self) -> Option<String> {
        let (alone, rows) = (self.diagnosis.alone, self.diagnosis.rows.len());
        (alone as f64 > MANY_ALONE * rows as f64).then(|| {
            format!(
                "no other row is within reach of {alone} of the {rows} rows: R squared counts them as predicted by their nearest rows, and \
                 the curve is not known between them; take a wider bandwidth"
            )
        })
    }

    fn unknown_points(&self) -> Option<String> {
        let (evaluation, _) = self.evaluation?;
        let points = evaluation.y.len();
        let unknown: Vec<usize> = (0..points).filter(|&i| evaluation.y[i].is_nan()).collect();
        let beyond = |(j, column): (usize, &Vec<f64>)| {
            let [low, high] = self.data.range(j);
            unknown.iter().any(|&i| column[i] < low || column[i] > high)
        };
        let nan = self.regression.estimator.outside == Outside::Nan;
        let remedy = match nan && evaluation.x.iter().enumerate().any(beyond) {
            true => {
                let [nearest, linear] = ["nearest", "linear"].map(|value| self.setting("outside", value));
                format!("; {nearest} or {linear} continues the estimate beyond the data")
            }
            false => String::new(),
        };
        let count = unknown.len();
        (count > 0).then(|| {
            format!(
                "at {count} of the {points} points of the result there are no data within reach: the estimate there is NaN{remedy}"
            )
        })
    }

    fn points_without_band(&self) -> Option<String> {
        let (evaluation, _) = self.evaluation?;
        let points = evaluation.y.iter().zip(&evaluation.lower);
        let bare = points.filter(|(y, lower)| y.is_finite() && lower.is_nan()).count();
        (bare > 0 && evaluation.band.is_some()).then(|| {
            format!(
                "at {bare} of the {} points of the result the band is NaN: the estimate is continued there, or too few data are within reach",
                evaluation.y.len()
            )
        })
    }

    /// The band is wider than the range of the measured ordinates at some points.
    fn wide_band(&self) -> Option<String> {
        let (evaluation, _) = self.evaluation?;
        let [least, greatest] = extent(self.diagnosis.rows.iter().map(|&i| self.data.y[i]));
        let is_wide = |(lower, upper): &(&f64, &f64)| greatest > least && *upper - *lower > greatest - least;
        let wide = evaluation.lower.iter().zip(&evaluation.upper).filter(is_wide).count();
        (wide > 0).then(|| {
            format!(
                "at {wide} of the {} points of the result the band is wider than all values of '{}' together: too few rows are within reach \
                 to determine anything there",
                evaluation.y.len(),
                self.data.names.y
            )
        })
    }

    fn copies(&self) -> Option<String> {
        share_of_copies(self.data).map(|copies| {
            format!(
                "about {:.0} % of the rows are copies of others: a row is then predicted from itself, and the parameter that is chosen \
                 follows the noise; leave the copies out, or count them by {}",
                100.0 * copies,
                (self.spelling)("weights", None)
            )
        })
    }

    fn no_band(&self) -> Option<String> {
        let (evaluation, options) = self.evaluation?;
        if evaluation.band.is_some() || options.method != BandMethod::Auto {
            return None;
        }
        let rows = self.diagnosis.rows.len();
        Some(match rows < FEWEST_ROWS {
            true => format!("no band was made, as it needs {FEWEST_ROWS} rows or more"),
            false => format!(
                "no band was made, as {} would have to be fitted to these {rows} rows many times over; {} does",
                self.setting("estimator", self.regression.fit.name.name()),
                self.setting("band-method", "bootstrap")
            ),
        })
    }

    fn levels(&self) -> Option<String> {
        let ([column], [name]) = (&self.data.x[..], &self.data.names.x[..]) else {
            return None;
        };
        let rows = &self.diagnosis.rows;
        let mut levels = HashSet::new();
        let few = rows.iter().all(|&i| {
            levels.insert((column[i] + 0.0).to_bits());
            levels.len() < MANY_LEVELS
        });
        let levels = levels.len();
        (few && rows.len() > MANY_LEVELS * levels).then(|| {
            format!(
                "column '{name}' has only {levels} levels: between them the estimate rests on the estimator's shape, not on data"
            )
        })
    }
}

/// The share of rows that repeat another one, if it is large and the abscissas have many values: rounded values repeat anyway.
fn share_of_copies(data: &RegressionData) -> Option<f64> {
    if data.repeated {
        return None;
    }
    let rows = data.rows();
    // Whether a row is looked at depends on its values, so that copies are looked at together or not at all.
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
    // Distinct abscissas nearly as many as distinct rows: so these are not levels.
    (copies > MANY_COPIES && abscissas.len() as f64 > MANY_ABSCISSAS * seen.len() as f64).then_some(copies)
}

/// A pseudo-random number (the finaliser of SplitMix64).
fn mixed(value: u64) -> u64 {
    let value = (value ^ (value >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let value = (value ^ (value >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    value ^ (value >> 31)
}
