//! A study of convergence rates as the page that shows it.

use flexure::study::{
    DataSource, EstimatorSetting, Experiment, Input, RatePoint, RateResult, RateTable, Setting, Target,
};
use flexure::systems::KnownNonlinearity;
use flexure_report::data::{Fact, RateLine, RatePlot, RateRow, StudyPage, StudySection, Verdict};

use super::Outcome;
use crate::text::capitalised;

/// Fills in the page.
pub fn page(outcome: &Outcome, command: String) -> StudyPage {
    let sections = [
        outcome.plain.as_ref().map(theorems),
        known(outcome),
        (outcome.estimators.as_ref()).map(|table| estimators(table, "Every static estimator", "Estimators")),
        (outcome.networks.as_ref()).map(|table| estimators(table, "Networks with one hidden layer", "Networks")),
    ];
    let verdicts: Vec<bool> = outcome.titled().flat_map(|(_, table)| table.verdicts()).collect();
    let agreeing = verdicts.iter().filter(|agrees| **agrees).count();
    let lengths: Vec<usize> = outcome.titled().flat_map(|(_, table)| table.lengths()).collect();
    let samples = match (lengths.iter().min(), lengths.iter().max()) {
        (Some(least), Some(most)) => format!("{least} to {most}"),
        _ => String::new(),
    };
    let headline = match outcome.agrees {
        true => "Theory and measurement agree",
        false => "Some slopes differ from theory",
    };
    StudyPage {
        title: "Convergence rates".to_owned(),
        subtitle: "The slope of log error over log n, measured by Monte Carlo, beside the exponent that theory gives."
            .to_owned(),
        verdict: Verdict {
            headline: headline.to_owned(),
            holds: outcome.agrees,
            text: outcome.sentence(),
            details: Vec::new(),
        },
        facts: vec![
            Fact::new(
                "Slopes that agree",
                format!("{agreeing} of {}", verdicts.len()),
                "jointly, at 95 %",
            ),
            Fact::new("Samples", samples, "smallest to largest n"),
        ],
        warnings: Vec::new(),
        sections: sections.into_iter().flatten().collect(),
        command: Some(command),
    }
}

/// The worst points of the three classes.
fn theorems(table: &RateTable<Setting>) -> StudySection {
    let is_worst = |r: &&RateResult<Setting>| !matches!(r.setting.target, Target::Known(_));
    let worst: Vec<&RateResult<Setting>> = table.results.iter().filter(is_worst).collect();
    let classes = [
        (Target::Cusp, "|x|^(1/2): Lipschitz of order 1/2, at its cusp"),
        (Target::Kink, "|x|: Lipschitz of order 1, at its kink"),
        (Target::Cosine, "cos x: smooth, at its top"),
    ];
    let plots = classes.into_iter().filter_map(|(target, title)| {
        let of_class = worst.iter().filter(|r| r.setting.target == target);
        let lines: Vec<Line> = of_class.map(|r| Line::new(data_name(&r.setting), r)).collect();
        plot(title, "RMS error at 0", &lines, Guides::Common)
    });
    StudySection {
        heading: "Theorems 1 and 2, at the worst points".to_owned(),
        short: "Theorems".to_owned(),
        lead: "The kernel estimate with the bandwidth h ~ n^(-1/(2p+1)): theory gives the error n^(-p/(2p+1)) for m Lipschitz of order p, \
               and n^(-2/5) for smooth m, from independent pairs (Theorem 1) and from a Hammerstein system's (Theorem 2)."
            .to_owned(),
        plots: plots.collect(),
        rows: worst.iter().map(|r| row(r)).collect(),
    }
}

/// The data of a setting, for a legend.
fn data_name(setting: &Setting) -> String {
    let input = match setting.input {
        Input::Uniform { .. } => "uniform",
        Input::Gaussian => "Gaussian",
        Input::StudentT => "Student t",
    };
    match setting.data {
        DataSource::Static { .. } => format!("static, {input}"),
        DataSource::Hammerstein { .. } => format!("Hammerstein, {input}"),
    }
}

/// The seven nonlinearities: the plain estimate and the refined identification.
fn known(outcome: &Outcome) -> Option<StudySection> {
    let plain = || {
        let results = outcome.plain.iter().flat_map(|t| &t.results);
        results.filter(|r| matches!(r.setting.target, Target::Known(_)))
    };
    let refined = || outcome.refined.iter().flat_map(|t| &t.results);
    let plots = KnownNonlinearity::ALL.into_iter().filter_map(|phi| {
        let plain = plain().filter(|r| r.setting.target == Target::Known(phi));
        // The plain estimate's error is absolute.
        let plain = plain.map(|r| Line {
            size: deviation(phi),
            ..Line::new("plain".to_owned(), r)
        });
        let refined = refined().filter(|r| r.setting.nonlinearity == phi);
        let refined = refined.map(|r| Line::new("refined".to_owned(), r));
        let lines: Vec<Line> = plain.take(1).chain(refined.take(1)).collect();
        let title = match phi {
            KnownNonlinearity::Parabola => phi.name().to_owned(),
            _ => capitalised(phi.name()),
        };
        plot(&title, "relative L2 error", &lines, Guides::Each)
    });
    let plots: Vec<RatePlot> = plots.collect();
    (!plots.is_empty()).then(|| StudySection {
        heading: "Seven nonlinearities: the plain estimate and the refined identification".to_owned(),
        short: "Plain and refined".to_owned(),
        lead: "A Hammerstein system with a damped second-order linear part. The plain estimate takes the linear part's memory for noise; the \
               refined identification takes it out and fits cubic pieces with jumps and kinks, whose error falls as n^(-1/2) where the \
               truth is made of such pieces, and at least as n^(-4/9) where it is smooth."
            .to_owned(),
        plots,
        rows: plain().map(row).chain(refined().map(row)).collect(),
    })
}

/// The standard deviation of phi over the inside of the input's range, the divisor of relative errors.
fn deviation(phi: KnownNonlinearity) -> f64 {
    let values: Vec<f64> = (0..2000)
        .map(|i| phi.value(1.5 * (f64::from(i) / 999.5 - 1.0)))
        .collect();
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
}

/// Estimators of a static nonlinearity.
fn estimators(table: &RateTable<EstimatorSetting>, heading: &str, short: &str) -> StudySection {
    let groups = [
        (1, true, "One variable, order -1/3"),
        (1, false, "One variable, other orders"),
        (2, true, "Two variables"),
    ];
    let third = |r: &RateResult<EstimatorSetting>| (r.setting.exponent + 1.0 / 3.0).abs() < 1e-9;
    let plots = groups.into_iter().flat_map(|(columns, of_third, title)| {
        let of_group =
            (table.results.iter()).filter(|r| r.setting.columns == columns && (columns == 2 || third(r) == of_third));
        let lines: Vec<Line> = of_group.map(|r| Line::new(r.setting.name(), r)).collect();
        let plots = lines
            .chunks(8)
            .filter_map(|lines| plot(title, "root mean square error", lines, Guides::Common));
        plots.collect::<Vec<_>>()
    });
    StudySection {
        heading: heading.to_owned(),
        short: short.to_owned(),
        lead: "An estimator's parameter follows the schedule in the table's names; the error is measured where m is at its worst for it."
            .to_owned(),
        plots: plots.collect(),
        rows: table.results.iter().map(row).collect(),
    }
}

/// The errors of a setting in a plot.
struct Line<'a> {
    name: String,
    points: &'a [RatePoint],
    /// The divisor of the errors.
    size: f64,
    /// The exponent that theory gives.
    exponent: f64,
}

impl<'a> Line<'a> {
    fn new<S: Experiment>(name: String, result: &'a RateResult<S>) -> Self {
        Line {
            name,
            points: &result.points,
            size: 1.0,
            exponent: result.setting.exponent(),
        }
    }

    /// The errors at these n; NaN where nothing was measured.
    fn drawn(&self, n: &[f64]) -> RateLine {
        let point = |n: &f64| self.points.iter().find(|p| p.n as f64 == *n);
        RateLine {
            name: self.name.clone(),
            error: n
                .iter()
                .map(|n| point(n).map_or(f64::NAN, |p| p.rms / self.size))
                .collect(),
        }
    }
}

/// Which slopes of theory a plot shows.
enum Guides {
    /// One that all lines have in common, if there is one.
    Common,
    /// One for every line.
    Each,
}

/// The errors of several settings with theory's slopes; nothing without a setting.
fn plot(title: &str, y_label: &str, lines: &[Line], guides: Guides) -> Option<RatePlot> {
    let exponent = lines.first()?.exponent;
    let mut n: Vec<f64> = lines.iter().flat_map(|l| l.points).map(|p| p.n as f64).collect();
    n.sort_unstable_by(f64::total_cmp);
    n.dedup();
    let drawn: Vec<RateLine> = lines.iter().map(|line| line.drawn(&n)).collect();
    let guides = match guides {
        Guides::Common if lines.iter().all(|l| l.exponent == exponent) => {
            vec![guide(&n, &drawn[0].error, exponent, format!("theory: n^{exponent:.3}"))]
        }
        Guides::Common => Vec::new(),
        Guides::Each => (lines.iter().zip(&drawn))
            .map(|(l, d)| guide(&n, &d.error, l.exponent, format!("{}: n^{:.2}", l.name, l.exponent)))
            .collect(),
    };
    Some(RatePlot {
        title: title.to_owned(),
        y_label: y_label.to_owned(),
        n,
        lines: drawn,
        guides,
    })
}

/// A power of n somewhat below the measured errors, starting at the first of them.
fn guide(n: &[f64], error: &[f64], exponent: f64, name: String) -> RateLine {
    let start = n.iter().zip(error).find(|(_, e)| e.is_finite());
    let (n0, e0) = start.map_or((f64::NAN, f64::NAN), |(n, e)| (*n, 0.7 * e));
    let power = |n: &f64| match *n >= n0 {
        true => e0 * (n / n0).powf(exponent),
        false => f64::NAN,
    };
    RateLine {
        name,
        error: n.iter().map(power).collect(),
    }
}

fn row<S: Experiment>(result: &RateResult<S>) -> RateRow {
    // With typographic minus signs.
    let minus = |number: String| number.replace('-', "\u{2212}");
    let bound = if result.setting.sharp() { "" } else { "at most " };
    let ends = match (result.points.first(), result.points.last()) {
        (Some(a), Some(b)) => format!("{:.2e} to {:.2e}", a.rms, b.rms),
        _ => String::new(),
    };
    RateRow {
        name: result.setting.name(),
        slope: minus(format!("{:.3}", result.slope)),
        interval: minus(format!("{:.3} to {:.3}", result.interval[0], result.interval[1])),
        theory: minus(format!("{bound}{:.3}", result.setting.exponent())),
        agrees: result.agrees,
        errors: minus(ends),
    }
}
