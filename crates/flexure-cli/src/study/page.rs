//! A study of convergence rates as the page that shows it.

use flexure::study::{
    DataSource, EstimatorSetting, Experiment, Input, RatePoint, RateResult, RateTable, RefinedSetting, Setting, Target,
};
use flexure::systems::KnownNonlinearity;
use flexure_report::data::{Fact, RateLine, RatePlot, RateRow, StudyPage, StudySection, Verdict};

use super::parts::Outcome;
use flexure_workbench::text::capitalised;

/// Fills in the page.
pub fn page(outcome: &Outcome, command: String) -> StudyPage {
    let sections = [
        outcome.plain.as_ref().map(theorems),
        known(outcome),
        (outcome.estimators.as_ref()).map(|table| estimators(table, "Every static estimator", "Estimators")),
        (outcome.networks.as_ref()).map(|table| estimators(table, "Networks with one hidden layer", "Networks")),
    ];
    let rows: Vec<bool> = verdicts(&outcome.plain)
        .chain(verdicts(&outcome.refined))
        .chain(verdicts(&outcome.estimators))
        .chain(verdicts(&outcome.networks))
        .collect();
    let agreeing = rows.iter().filter(|agrees| **agrees).count();
    StudyPage {
        title: "Convergence rates".to_owned(),
        subtitle: "The slope of log error over log n, measured by Monte Carlo, beside the exponent that theory gives."
            .to_owned(),
        verdict: Verdict {
            headline: match outcome.agrees {
                true => "Theory and measurement agree".to_owned(),
                false => "Some slopes differ from theory".to_owned(),
            },
            holds: outcome.agrees,
            words: outcome.sentence(),
        },
        facts: vec![
            fact(
                "Slopes that agree",
                format!("{agreeing} of {}", rows.len()),
                "jointly, at 95 %",
            ),
            fact("Samples", samples(outcome), "smallest to largest n"),
        ],
        warnings: Vec::new(),
        sections: sections.into_iter().flatten().collect(),
        command: Some(command),
    }
}

fn fact(name: &str, value: String, note: &str) -> Fact {
    Fact {
        name: name.to_owned(),
        value,
        note: note.to_owned(),
    }
}

fn verdicts<S>(table: &Option<RateTable<S>>) -> impl Iterator<Item = bool> {
    table.iter().flat_map(|t| &t.results).map(|r| r.agrees)
}

fn samples(outcome: &Outcome) -> String {
    fn all<S>(table: &Option<RateTable<S>>) -> impl Iterator<Item = usize> {
        table
            .iter()
            .flat_map(|t| &t.results)
            .flat_map(|r| &r.points)
            .map(|p| p.n)
    }
    let every: Vec<usize> = all(&outcome.plain)
        .chain(all(&outcome.refined))
        .chain(all(&outcome.estimators))
        .chain(all(&outcome.networks))
        .collect();
    let (least, most) = (every.iter().min(), every.iter().max());
    match (least, most) {
        (Some(least), Some(most)) => format!("{least} to {most}"),
        _ => String::new(),
    }
}

/// The worst points of the three classes.
fn theorems(table: &RateTable<Setting>) -> StudySection {
    let worst: Vec<&RateResult<Setting>> = (table.results.iter())
        .filter(|r| !matches!(r.setting.target, Target::Known(_)))
        .collect();
    let classes = [
        (Target::Cusp, "|x|^(1/2): Lipschitz of order 1/2, at its cusp"),
        (Target::Kink, "|x|: Lipschitz of order 1, at its kink"),
        (Target::Cosine, "cos x: smooth, at its top"),
    ];
    let plots = classes.into_iter().filter_map(|(target, title)| {
        let of_class: Vec<&RateResult<Setting>> =
            worst.iter().copied().filter(|r| r.setting.target == target).collect();
        let name = |setting: &Setting| {
            let input = match setting.input {
                Input::Uniform { .. } => "uniform",
                Input::Gaussian => "Gaussian",
                Input::StudentT => "Student t",
            };
            match setting.data {
                DataSource::Static { .. } => format!("static, {input}"),
                DataSource::Hammerstein { .. } => format!("Hammerstein, {input}"),
            }
        };
        plot(title, "RMS error at 0", &of_class, name)
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

/// The seven nonlinearities: the plain estimate beside the refined identification.
fn known(outcome: &Outcome) -> Option<StudySection> {
    let plain: Vec<&RateResult<Setting>> = (outcome.plain.iter().flat_map(|t| &t.results))
        .filter(|r| matches!(r.setting.target, Target::Known(_)))
        .collect();
    let refined: Vec<&RateResult<RefinedSetting>> = outcome.refined.iter().flat_map(|t| &t.results).collect();
    let plots = KnownNonlinearity::ALL.into_iter().filter_map(|phi| {
        let of = |r: &&&RateResult<Setting>| r.setting.target == Target::Known(phi);
        let plain = plain.iter().find(of).map(|r| (&r.points, r.setting.exponent()));
        let refined = refined.iter().find(|r| r.setting.nonlinearity == phi);
        let refined = refined.map(|r| (&r.points, r.setting.exponent()));
        let size = deviation(phi);
        // The plain estimate's error is absolute.
        let lines = [("plain", plain, size), ("refined", refined, 1.0)];
        let n = union(lines.iter().filter_map(|l| l.1).map(|(points, _)| points.as_slice()));
        let shown: Vec<(&str, Vec<f64>, f64)> = (lines.into_iter())
            .filter_map(|(name, points, size)| {
                points.map(|(points, exponent)| (name, errors(points, &n, size), exponent))
            })
            .collect();
        (!shown.is_empty()).then(|| RatePlot {
            title: match phi {
                KnownNonlinearity::Parabola => phi.name().to_owned(),
                _ => capitalised(phi.name()),
            },
            y_label: "relative L2 error".to_owned(),
            lines: (shown.iter())
                .map(|(name, error, _)| RateLine {
                    name: (*name).to_owned(),
                    error: error.clone(),
                })
                .collect(),
            guides: (shown.iter())
                .map(|(name, error, exponent)| guide(&n, error, *exponent, &format!("{name}: n^{exponent:.2}")))
                .collect(),
            n,
        })
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
        rows: plain.iter().map(|r| row(r)).chain(refined.iter().map(|r| row(r))).collect(),
    })
}

/// The standard deviation of phi over the inside of the input's range, by which relative errors are made.
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
        let of_group: Vec<&RateResult<EstimatorSetting>> = (table.results.iter())
            .filter(|r| r.setting.columns == columns && (columns == 2 || third(r) == of_third))
            .collect();
        let chunks: Vec<RatePlot> = (of_group.chunks(8))
            .filter_map(|chunk| plot(title, "root mean square error", chunk, |s| s.name()))
            .collect();
        chunks
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

/// The errors of several settings with one guide for each exponent; nothing without a setting.
fn plot<S: Experiment>(
    title: &str,
    y_label: &str,
    results: &[&RateResult<S>],
    name: impl Fn(&S) -> String,
) -> Option<RatePlot> {
    let n = union(results.iter().map(|r| r.points.as_slice()));
    let lines: Vec<RateLine> = (results.iter())
        .map(|r| RateLine {
            name: name(&r.setting),
            error: errors(&r.points, &n, 1.0),
        })
        .collect();
    let exponent = results.first()?.setting.exponent();
    let same = results.iter().all(|r| r.setting.exponent() == exponent);
    let guides = match same {
        true => vec![guide(
            &n,
            &lines[0].error,
            exponent,
            &format!("theory: n^{exponent:.3}"),
        )],
        false => Vec::new(),
    };
    Some(RatePlot {
        title: title.to_owned(),
        y_label: y_label.to_owned(),
        n,
        lines,
        guides,
    })
}

/// All numbers of samples, increasing.
fn union<'a>(points: impl Iterator<Item = &'a [RatePoint]>) -> Vec<f64> {
    let mut all: Vec<usize> = points.flatten().map(|p| p.n).collect();
    all.sort_unstable();
    all.dedup();
    all.into_iter().map(|n| n as f64).collect()
}

/// The errors at these n over `size`; NaN where nothing was measured.
fn errors(points: &[RatePoint], n: &[f64], size: f64) -> Vec<f64> {
    let at = |n: &f64| {
        points
            .iter()
            .find(|p| p.n as f64 == *n)
            .map_or(f64::NAN, |p| p.rms / size)
    };
    n.iter().map(at).collect()
}

/// A power of n somewhat below the measured errors, from the first of them on.
fn guide(n: &[f64], error: &[f64], exponent: f64, name: &str) -> RateLine {
    let start = n.iter().zip(error).find(|(_, e)| e.is_finite());
    let (n0, e0) = start.map_or((f64::NAN, f64::NAN), |(n, e)| (*n, 0.7 * e));
    RateLine {
        name: name.to_owned(),
        error: n
            .iter()
            .map(|n| {
                if *n >= n0 {
                    e0 * (n / n0).powf(exponent)
                } else {
                    f64::NAN
                }
            })
            .collect(),
    }
}

fn row<S: Experiment>(result: &RateResult<S>) -> RateRow {
    let bound = if result.setting.sharp() { "" } else { "at most " };
    let ends = match (result.points.first(), result.points.last()) {
        (Some(a), Some(b)) => format!("{:.2e} to {:.2e}", a.rms, b.rms),
        _ => String::new(),
    };
    RateRow {
        name: result.setting.name(),
        slope: minus(&format!("{:.3}", result.slope)),
        interval: minus(&format!("{:.3} to {:.3}", result.interval[0], result.interval[1])),
        theory: minus(&format!("{bound}{:.3}", result.setting.exponent())),
        agrees: result.agrees,
        errors: minus(&ends),
    }
}

/// With typographic minus signs.
fn minus(number: &str) -> String {
    number.replace('-', "\u{2212}")
}
