//! The page of any other cascade than a Hammerstein model.

use anyhow::Result;
use flexure::identify::TriedStructure;
use flexure_io::RecordFile;
use flexure_report::data::{Choice, Fact, LinearPart, Nonlinearity, Page, ScoreCurve, Table};

use super::{
    Decoration, Judged, Parts, assembled, density, fact, fit_facts, labelled, linear_part, samples, samples_fact,
};
use crate::systems::cascade::{Cascade, INTERSAMPLE};
use crate::systems::nonlinear_ends::PIECES_WHY;
use crate::systems::outcome::Signals;
use crate::text::{self, number};

/// Most structures that the table shows.
const MOST_STRUCTURES: usize = 15;

/// Fills in the page.
pub fn page(file: &RecordFile, signals: &Signals, result: &Cascade, decoration: Decoration) -> Result<Page> {
    let u = file.record.finite(signals.input)?;
    let parts = Parts {
        facts: facts(signals, result),
        nonlinearity: nonlinearity(u, signals, result),
        linear: (result.all_linear())
            .map(|block| LinearPart {
                words: format!("{}.", text::capitalised(&block.words())),
                ..linear_part(block.title, &block.system, None, signals.sample_time)
            })
            .collect(),
        choices: choices(result),
        candidates: structures(result).into_iter().collect(),
        ..Parts::default()
    };
    let judged = Judged {
        signals: *signals,
        model: format!("A {} model ({})", result.title, result.words),
        fitted: result.fitted,
        predicted: &result.predicted,
        verdict: &result.verdict,
        warnings: &result.warnings,
    };
    assembled(file, &judged, parts, decoration)
}

fn facts(signals: &Signals, result: &Cascade) -> Vec<Fact> {
    let orders: Vec<String> = result.linear().map(|block| block.order().to_string()).collect();
    let mut facts = fit_facts(&result.verdict, signals.output).to_vec();
    facts.extend([
        fact(
            "Poles",
            orders.join(" + "),
            match result.back {
                Some(_) => "of the linear parts, by Schwarz's criterion",
                None => "of the linear part, by Schwarz's criterion",
            },
        ),
        fact(
            "Delay",
            samples(result.delay()),
            match result.back {
                Some(_) => "of all linear parts together",
                None => "leading zeros of the linear part's numerator",
            },
        ),
    ]);
    if result.nonlinearity.is_some() {
        let pieces = pieces_and_kinks(result.pieces(), result.kinks.len());
        facts.push(fact("Pieces", pieces, "cubic ones, of the nonlinearity"));
    }
    facts.push(samples_fact(result.predicted.len(), result.fitted, ""));
    facts
}

/// None of its points for a linear model.
fn nonlinearity(u: &[f64], signals: &Signals, result: &Cascade) -> Nonlinearity {
    let (x, y) = match &result.nonlinearity {
        Some(curve) => (curve.x().to_vec(), curve.y().to_vec()),
        None => Default::default(),
    };
    Nonlinearity {
        x_label: match &result.front {
            Some(_) if result.back.is_some() => "intermediate signal, behind the first linear part".to_owned(),
            Some(_) => "intermediate signal, behind the linear part".to_owned(),
            None => labelled(signals.input),
        },
        y_label: "nonlinearity's output".to_owned(),
        y,
        lower: Vec::new(),
        upper: Vec::new(),
        band_label: String::new(),
        density: match x.is_empty() {
            true => Vec::new(),
            false => density(&result.intermediate(u)[..result.fitted], &x),
        },
        truth: Vec::new(),
        truth_label: String::new(),
        x,
    }
}

fn choices(result: &Cascade) -> Vec<Choice> {
    let orders: Vec<String> = (result.linear())
        .map(|block| format!("{} in the {}", block.order(), block.name()))
        .collect();
    let approximations = ScoreCurve {
        x_label: "order of the linear approximation".to_owned(),
        y_label: "relative error".to_owned(),
        log_x: false,
        x: result.approximations.iter().map(|a| a.order as f64).collect(),
        y: result.approximations.iter().map(|a| a.relative_error).collect(),
        chosen: result.order() as f64,
    };
    let shown = approximations.x.contains(&approximations.chosen);
    let by_pieces = by_pieces(result);
    let intersample = (!result.intersample.is_empty()).then(|| Choice {
        name: "Between the samples".to_owned(),
        value: "2 instants".to_owned(),
        why: format!("{INTERSAMPLE}; chosen by Schwarz's criterion"),
        curve: None,
    });
    let poles = Choice {
        name: "Poles".to_owned(),
        value: orders.join(", "),
        why: format!(
            "{}; then poles and numerator coefficients added and taken away while Schwarz's criterion of the free-run error falls",
            result.start
        ),
        curve: shown.then_some(approximations),
    };
    let pieces = result.nonlinearity.is_some().then(|| Choice {
        name: "Pieces of the nonlinearity".to_owned(),
        value: pieces_and_kinks(result.pieces(), result.kinks.len()),
        why: PIECES_WHY.to_owned(),
        curve: (by_pieces.len() > 1).then(|| ScoreCurve {
            x_label: "pieces".to_owned(),
            y_label: "Schwarz's criterion".to_owned(),
            log_x: false,
            x: by_pieces.iter().map(|p| p.pieces as f64).collect(),
            y: by_pieces.iter().map(|p| p.bic).collect(),
            chosen: result.pieces() as f64,
        }),
    });
    [Some(poles), pieces, intersample].into_iter().flatten().collect()
}

/// The structures that were tried on all samples, best first, each once, and the last, which was chosen.
fn compared(result: &Cascade) -> Option<(Vec<&TriedStructure>, &TriedStructure)> {
    let chosen = result.tried.last()?;
    let mut all: Vec<&TriedStructure> = result.tried.iter().filter(|t| t.samples == chosen.samples).collect();
    // Of a structure that was tried several times, the best try counts.
    all.sort_by(|a, b| a.bic.total_cmp(&b.bic));
    let mut kept: Vec<&TriedStructure> = Vec::new();
    for t in all {
        if kept.iter().all(|k| shape(k) != shape(t)) {
            kept.push(t);
        }
    }
    Some((kept, chosen))
}

/// The number of pieces, and of kinks where there are any.
fn pieces_and_kinks(pieces: usize, kinks: usize) -> String {
    match kinks {
        0 => pieces.to_string(),
        1 => format!("{pieces}, 1 kink"),
        _ => format!("{pieces}, {kinks} kinks"),
    }
}

/// Poles, numerator coefficients, instants, kinks and pieces.
fn shape(t: &TriedStructure) -> [usize; 7] {
    [
        t.front_order,
        t.front_numerator,
        t.back_order,
        t.back_numerator,
        t.instants,
        t.kinks,
        t.pieces,
    ]
}

/// The compared structures that differ from the chosen one in the number of pieces alone, by that number.
fn by_pieces(result: &Cascade) -> Vec<&TriedStructure> {
    let Some((all, chosen)) = compared(result) else {
        return Vec::new();
    };
    let mut same: Vec<&TriedStructure> = all
        .into_iter()
        .filter(|t| shape(t)[..6] == shape(chosen)[..6])
        .collect();
    same.sort_by_key(|t| t.pieces);
    same
}

fn structures(result: &Cascade) -> Option<Table> {
    let (all, chosen) = compared(result)?;
    let columns = [
        "front: poles / numerator coefficients",
        "back: poles / numerator coefficients",
        "instants a sample",
        "pieces",
        "error / output's spread",
        "Schwarz's criterion",
    ];
    let rows = all.iter().take(MOST_STRUCTURES).map(|t| {
        [
            format!("{} / {}", t.front_order, t.front_numerator),
            format!("{} / {}", t.back_order, t.back_numerator),
            t.instants.to_string(),
            pieces_and_kinks(t.pieces, t.kinks),
            number(t.relative_error),
            format!("{:.0}", t.bic),
        ]
    });
    let mut rows: Vec<Vec<String>> = rows.map(Vec::from).collect();
    let mut columns: Vec<String> = columns.map(String::from).to_vec();
    if result.back.is_none() {
        // Neither a back nor, without one, instants to choose.
        for row in rows.iter_mut().chain([&mut columns]) {
            row.drain(1..3);
        }
        columns[0] = "poles / numerator coefficients".to_owned();
    }
    Some(Table {
        title: "Structures that were tried".to_owned(),
        words: format!(
            "{} fits were made in all, most of them on the beginning of the record; these are the best {} of {} structures that were \
             fitted to all {} samples that count. The one of smallest Schwarz criterion was chosen.",
            result.tried.len(),
            rows.len(),
            all.len(),
            chosen.samples
        ),
        columns,
        chosen: all.iter().take(rows.len()).position(|t| shape(t) == shape(chosen)),
        rows,
        ends_in_words: false,
    })
}
