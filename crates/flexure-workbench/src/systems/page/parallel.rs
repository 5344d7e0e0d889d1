//! The page of a sum of branches.

use anyhow::Result;
use flexure::identify::{ParallelBranch, ParallelIdentification};
use flexure_io::RecordFile;
use flexure_report::data::{Choice, Fact, LinearPart, Nonlinearity, Page, Table};

use super::{
    Decoration, Judged, Parts, assembled, density, fact, fit_facts, labelled, linear_part, samples, samples_fact,
};
use crate::systems::nonlinear_ends::pieces_words;
use crate::systems::outcome::Signals;
use crate::systems::parallel::{ONLY_THE_SUM, count_words, linear_blocks, words};
use crate::text::{self, number};

/// Values of the other branches' nonlinearities that the page shows.
const VALUES: usize = 21;

/// Fills in the page.
pub fn page(
    file: &RecordFile,
    signals: &Signals,
    result: &ParallelIdentification,
    decoration: Decoration,
) -> Result<Page> {
    let u = file.record.finite(signals.input)?;
    let linear = result.branches.iter().enumerate().flat_map(|(i, branch)| {
        let (front, back) = linear_blocks(branch);
        let part = |block: crate::systems::cascade::LinearBlock| LinearPart {
            words: format!("{}.", text::capitalised(&block.words())),
            ..linear_part(
                &format!("Branch {}, {}", i + 1, block.title),
                &block.system,
                None,
                signals.sample_time,
            )
        };
        front.into_iter().chain([back]).map(part).collect::<Vec<_>>()
    });
    let others = result.branches.iter().enumerate().skip(1);
    let parts = Parts {
        facts: facts(signals, result),
        nonlinearity: result
            .branches
            .first()
            .map_or_else(Nonlinearity::default, |b| nonlinearity(&u[..result.fitted], signals, b)),
        linear: linear.collect(),
        choices: choices(result),
        candidates: others.map(|(i, branch)| table(i, signals, branch)).collect(),
        ..Parts::default()
    };
    let judged = Judged {
        signals: *signals,
        model: format!("A sum of {} ({})", count_words(result), words(result)),
        fitted: result.fitted,
        predicted: &result.predicted,
        verdict: &result.verdict,
        warnings: &result.warnings,
    };
    assembled(file, &judged, parts, decoration)
}

fn facts(signals: &Signals, result: &ParallelIdentification) -> Vec<Fact> {
    let each = |of: fn(&ParallelBranch) -> usize| {
        let all: Vec<String> = result.branches.iter().map(|b| of(b).to_string()).collect();
        all.join(" + ")
    };
    let poles = each(|b| {
        let (front, back) = linear_blocks(b);
        front.map_or(0, |f| f.order()) + back.order()
    });
    let mut facts = fit_facts(&result.verdict, signals.output).to_vec();
    facts.extend([
        fact(
            "Branches",
            result.branches.len().to_string(),
            "by Schwarz's criterion unless given",
        ),
        fact("Poles", poles, "of the branches, by Schwarz's criterion"),
        fact("Delay", samples(result.delay()), "of the fastest branch"),
        fact(
            "Pieces",
            each(|b| b.breakpoints.len().saturating_sub(1)),
            "cubic ones, of the branches' nonlinearities",
        ),
        samples_fact(result.predicted.len(), result.fitted, ""),
    ]);
    facts
}

/// What enters a branch's nonlinearity, for the axis.
fn entering(signals: &Signals, branch: &ParallelBranch) -> String {
    match branch.front {
        Some(_) => "behind the branch's front".to_owned(),
        None => labelled(signals.input),
    }
}

/// That of the first branch.
fn nonlinearity(u: &[f64], signals: &Signals, branch: &ParallelBranch) -> Nonlinearity {
    let curve = &branch.nonlinearity;
    let w = match &branch.front {
        Some(front) => front.simulate_from_mean(u),
        None => u.to_vec(),
    };
    Nonlinearity {
        x_label: entering(signals, branch),
        y_label: "output of branch 1's nonlinearity".to_owned(),
        x: curve.x().to_vec(),
        y: curve.y().to_vec(),
        density: density(&w, curve.x()),
        ..Nonlinearity::default()
    }
}

fn choices(result: &ParallelIdentification) -> Vec<Choice> {
    let choice = |name: String, value: String, why: &str| Choice {
        name,
        value,
        why: why.to_owned(),
        curve: None,
    };
    let count = choice(
        "Branches".to_owned(),
        count_words(result),
        &format!("smallest Schwarz criterion, unless given; {ONLY_THE_SUM}"),
    );
    let each = result.branches.iter().enumerate().map(|(i, branch)| {
        choice(
            format!("Nonlinearity of branch {}", i + 1),
            pieces_words(&branch.breakpoints, &[]),
            "smallest Schwarz criterion; breakpoints are dense where the curve bends",
        )
    });
    std::iter::once(count).chain(each).collect()
}

/// The nonlinearity of the branch of this index as a table.
fn table(index: usize, signals: &Signals, branch: &ParallelBranch) -> Table {
    let curve = &branch.nonlinearity;
    let (low, high) = (curve.x()[0], curve.x()[curve.x().len() - 1]);
    let row = |i: usize| {
        let x = low + (high - low) * i as f64 / (VALUES - 1) as f64;
        vec![number(x), number(curve.value(x))]
    };
    Table {
        title: format!("Nonlinearity of branch {}", index + 1),
        words: "What enters it, and what becomes of it; the model's file has the whole curve.".to_owned(),
        columns: vec![entering(signals, branch), "its output".to_owned()],
        rows: (0..VALUES).map(row).collect(),
        chosen: None,
        ends_in_words: false,
    }
}
