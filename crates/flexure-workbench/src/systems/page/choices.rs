//! The numbers of a page: the facts, the choices from data with their reasons, and the structures that were tried.

use flexure::identify::Identification;
use flexure::identify::result::{Place, Score, Shown, StaticBlock, Value, Values};
use flexure::text::{self, capitalised, counted, decimal, fit, number, short};
use flexure_report::data::{Choice, Fact, ScoreCurve, Table};

use crate::systems::poles::{NONE, poles_text};
use crate::systems::task::Identified;

/// The most rows in the table of tried structures.
const MOST_TRIED: usize = 15;
/// Values of a try that are no part of its structure.
const SCORES: [&str; 4] = ["samples", "relative_error", "bic", "score"];

/// The headline numbers.
pub(super) fn facts(identified: &Identified) -> Vec<Fact> {
    let result = &identified.result;
    let mut facts = fit_facts(identified);
    facts.extend(linear_facts(identified));
    let curves: Vec<&StaticBlock> = result.paths.iter().flat_map(|p| p.curves()).collect();
    let pieces: Vec<usize> = curves.iter().map(|c| c.pieces()).collect();
    if pieces.iter().any(|p| *p > 0) {
        facts.push(Fact::new(
            "Pieces",
            joined(&pieces),
            "cubic pieces of the nonlinearities",
        ));
    }
    let kinks: Vec<usize> = curves.iter().map(|c| c.kinks.len()).collect();
    if kinks.iter().any(|k| *k > 0) {
        let places: Vec<String> = (curves.iter().flat_map(|c| c.clear_kinks())).map(number).collect();
        let note = match (places.len() == kinks[0], kinks.len()) {
            (true, 1) => format!("where the nonlinearity's slope jumps: at {}", text::joined(&places)),
            _ => "where the nonlinearities' slopes jump, beside the pieces".to_owned(),
        };
        facts.push(Fact::new("Kinks", joined(&kinks), note));
    }
    let shown = result.details.iter().filter_map(|d| d.shown.as_ref());
    let own = shown.filter(|s| matches!(s.place, Place::Fact | Place::PageFact));
    facts.extend(own.map(|s| Fact::new(&s.title, identified.in_unit(s.text.clone()), &s.note)));
    facts.push(samples_fact(identified));
    facts
}

/// How good the prediction is.
fn fit_facts(identified: &Identified) -> Vec<Fact> {
    let result = &identified.result;
    let unit = match identified.labels.unit(&result.output) {
        "" => String::new(),
        unit => format!(" {unit}"),
    };
    let measures = &result.verdict.measures;
    vec![
        Fact::new(
            "Fit on fresh data",
            fit(measures.fit_percent, 1),
            "100 (1 - ‖y - ŷ‖ / ‖y - mean y‖) of the free-run simulation",
        ),
        Fact::new(
            "RMS error",
            format!("{}{unit}", number(measures.rms)),
            "root mean square of measured less simulated output",
        ),
    ]
}

/// The most poles that a tile lists.
const MOST_POLES: usize = 3;

/// Poles and delay of the linear parts.
fn linear_facts(identified: &Identified) -> Vec<Fact> {
    let result = &identified.result;
    let delays: Vec<usize> = result.paths.iter().map(|p| p.delay()).collect();
    let delay = match result.is_sum {
        true => Fact::new("Delays", joined(&delays), "of the branches, samples"),
        false => {
            let seconds = identified.sample_time.map(|step| result.delay as f64 * step);
            let note = seconds.map_or(String::new(), |seconds| format!("{} s, ", decimal(seconds)));
            Fact::new(
                "Delay",
                counted(result.delay, "sample"),
                format!("{note}of all blocks together"),
            )
        }
    };
    let linear = result.paths.iter().flat_map(|p| p.linear());
    let orders: Vec<usize> = match result.is_sum {
        true => result.paths.iter().map(|p| p.order()).collect(),
        false => linear.map(|g| g.order()).collect(),
    };
    let linear = result.paths.iter().flat_map(|p| p.linear());
    let each = linear
        .map(|g| poles_text(g, identified.sample_time))
        .filter(|text| text != NONE);
    let note = match orders.iter().sum::<usize>() {
        n if n > MOST_POLES => "plotted below".to_owned(),
        _ => each.collect::<Vec<String>>().join("; "),
    };
    // A narrow tile has no room for lines that may not be broken.
    let poles = Fact::new("Poles", joined(&orders), note.replace('\u{a0}', " "));
    match orders.is_empty() {
        true => vec![delay],
        false => vec![poles, delay],
    }
}

/// The number of samples, and their use.
fn samples_fact(identified: &Identified) -> Fact {
    let result = &identified.result;
    let (all, fitted) = (result.predicted.len(), result.fitted);
    if identified.is_other_record {
        let note = format!("{fitted} at the start left out of the verdict, for the model to settle");
        return Fact::new("Samples", all.to_string(), note);
    }
    if let Some(in_parts) = identified.in_parts {
        let note = format!("{}; {} kept for the verdict", in_parts.text(), all - fitted);
        return Fact::new("Samples", (in_parts.samples + all - fitted).to_string(), note);
    }
    let missing = match all - fitted - result.verdict.measures.samples {
        0 => String::new(),
        n => format!(" ({n} of those missing)"),
    };
    Fact::new(
        "Samples",
        all.to_string(),
        format!("{fitted} for the fit, {} kept for the verdict{missing}", all - fitted),
    )
}

/// Counts for reading.
fn joined(counts: &[usize]) -> String {
    let each: Vec<String> = counts.iter().map(usize::to_string).collect();
    each.join(" + ")
}

/// What was chosen from data, and why.
pub(super) fn choices(result: &Identification) -> Vec<Choice> {
    let shown = result.details.iter().filter_map(|d| d.shown.as_ref());
    let own = shown
        .filter(|s| !matches!(s.place, Place::Fact | Place::PageFact))
        .map(choice);
    let mut all: Vec<Choice> = own.collect();
    for (i, path) in result.paths.iter().enumerate() {
        for block in path.main() {
            let Some(curve) = block.curve().filter(|c| c.pieces() > 0) else {
                continue;
            };
            let name = match result.is_sum {
                true => format!("{}, {}", block.title, result.path_title(i)),
                false => block.title.clone().into_owned(),
            };
            let why = "Smallest Schwarz criterion. Breakpoints are dense where the curve bends. A kink needs very strong \
                       evidence.";
            all.push(Choice {
                curve: by_pieces(result, curve.pieces()),
                ..Choice::new(name, &curve.description, why)
            });
        }
    }
    all
}

fn choice(shown: &Shown) -> Choice {
    Choice {
        curve: shown.scores.clone().map(score_curve),
        ..Choice::new(&shown.title, &shown.text, sentence(&shown.note))
    }
}

/// A note as a sentence, or several.
fn sentence(note: &str) -> String {
    let end = if note.is_empty() || note.ends_with('.') {
        ""
    } else {
        "."
    };
    format!("{}{end}", capitalised(note))
}

/// Scores as the page draws them.
pub fn score_curve(scores: Score) -> ScoreCurve {
    ScoreCurve {
        x_label: scores.x_label,
        y_label: scores.y_label,
        log_x: scores.logarithmic,
        x: scores.x,
        y: scores.y,
        chosen: scores.chosen,
    }
}

/// The structures that were tried on all samples.
struct Compared<'a> {
    /// Best first, each once.
    all: Vec<&'a Values>,
    /// The last one; it was chosen.
    chosen: &'a Values,
}

fn compared(result: &Identification) -> Option<Compared<'_>> {
    let chosen = result.tried.last()?;
    chosen.get("samples")?;
    let samples = chosen.get("samples");
    let mut all: Vec<&Values> = result.tried.iter().filter(|t| t.get("samples") == samples).collect();
    // If a structure was tried several times, the best try counts.
    all.sort_by(|a, b| a.number("bic").total_cmp(&b.number("bic")));
    let mut kept: Vec<&Values> = Vec::new();
    for t in all {
        if kept.iter().all(|k| !same(k, t, "")) {
            kept.push(t);
        }
    }
    Some(Compared { all: kept, chosen })
}

/// Whether two structures are the same except for the value of the name `but`.
fn same(a: &Values, b: &Values, but: &str) -> bool {
    let counts = |name: &str| name != but && !SCORES.contains(&name);
    a.iter()
        .filter(|(name, _)| counts(name))
        .all(|(name, value)| b.get(name) == Some(value))
}

/// Schwarz's criterion of the structures that differ from the chosen one only in the number of pieces.
fn by_pieces(result: &Identification, chosen_pieces: usize) -> Option<ScoreCurve> {
    let Compared { all, chosen } = compared(result)?;
    chosen.get("pieces").and_then(Value::number)?;
    let mut alike: Vec<&Values> = all.into_iter().filter(|t| same(t, chosen, "pieces")).collect();
    alike.sort_by(|a, b| a.number("pieces").total_cmp(&b.number("pieces")));
    (alike.len() > 1).then(|| ScoreCurve {
        x_label: "pieces".to_owned(),
        y_label: "Schwarz's criterion".to_owned(),
        log_x: false,
        x: alike.iter().map(|t| t.number("pieces")).collect(),
        y: alike.iter().map(|t| t.number("bic")).collect(),
        chosen: chosen_pieces as f64,
    })
}

/// A value for a cell of a table.
fn cell(value: &Value) -> String {
    match value {
        Value::List(values) => values.iter().map(cell).collect::<Vec<_>>().join(" + "),
        value => value.number().map_or_else(String::new, short),
    }
}

/// The best of the structures that were tried on all samples.
pub(super) fn tried(result: &Identification) -> Option<Table> {
    let Compared { all, chosen } = compared(result)?;
    let is_chosen = |t: &&Values| same(t, chosen, "");
    let mut shown = all[..all.len().min(MOST_TRIED)].to_vec();
    if !shown.iter().any(is_chosen) {
        shown.pop();
        shown.push(chosen);
    }
    // At its end, the search takes the dependence of the errors into account.
    let choice = match shown.first().is_some_and(is_chosen) {
        true => "Chosen: the smallest Schwarz criterion.",
        false => {
            "The marked one was chosen at the end of the search, where Schwarz's criterion allows for errors that depend on one another. The \
             criterion in the other rows does not allow for this: do not compare it with that of the marked row."
        }
    };
    // A value that is zero in all of them was no choice.
    let varies = |name: &str| {
        shown
            .iter()
            .any(|t| t.get(name).is_some_and(|v| !["", "0"].contains(&cell(v).as_str())))
    };
    let names: Vec<&str> = (chosen.iter().map(|(name, _)| name))
        .filter(|name| *name != "samples" && varies(name))
        .collect();
    let column = |name: &&str| match *name {
        "relative_error" => "error / output's spread".to_owned(),
        "bic" => "Schwarz's criterion".to_owned(),
        name => name.replace('_', " "),
    };
    let row = |t: &&Values| {
        let value = |name: &&str| match *name {
            "bic" => format!("{:.0}", t.number("bic")),
            name => t.get(name).map_or_else(String::new, cell),
        };
        names.iter().map(value).collect()
    };
    Some(Table {
        title: "Structures that were tried".to_owned(),
        text: format!(
            "The best {1} of {2} structures that were fitted to all {3} samples. {choice} {0} fits were made in all, most of them on \
             the beginning of the record.",
            result.tried.len(),
            shown.len(),
            all.len(),
            chosen.number("samples")
        ),
        columns: names.iter().map(column).collect(),
        rows: shown.iter().map(row).collect(),
        chosen: shown.iter().position(is_chosen),
        ends_in_text: false,
    })
}
