//! The command to type after a look.

use std::collections::BTreeSet;
use std::path::Path;

use flexure::look::{Column, Dependence, Direction, Kind, Look, Relation};
use flexure::text::exact;
use flexure_io::RecordFile;

use super::Request;
use super::joint;
use super::joint_trial::Failure;
use super::preparations::{are_wild, even_spacing, repair, with_outliers, without_dead_start, without_outliers};
use super::roles::{Role, is_setpoint, role};
use crate::text::quoted;

/// With only this number of input levels, a nonlinearity cannot be distinguished from a straight line.
const TWO: usize = 2;
/// Fewest samples for which an identification is suggested: what block structures need.
const FEWEST: usize = 200;

/// A column that follows another one with more than this coherent share is an output, or lies between that column and an output.
/// Convention.
const BETWEEN: f64 = 0.2;

/// What stands for a sample time that the record does not tell.
const UNKNOWN_TIME: &str = "SECONDS";

/// What stands for the output file of a preparation, and the end of its name, after that of the log.
const PREPARED: &str = "prepared.csv";
const OF_PREPARED: &str = "-prepared";

/// A command that fits the record.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Suggestion {
    /// The subcommand, for example "identify".
    pub command: &'static str,
    /// The arguments after the file: options with their values, one per entry.
    pub options: Vec<String>,
    /// Why this command, in a sentence.
    pub why: String,
    /// What else should be known before it is typed, one sentence each.
    pub notes: Vec<String>,
}

/// Options whose value is the name of a column, or names.
const OF_COLUMNS: [&str; 7] = [
    "--input",
    "--output",
    "--torque",
    "--position",
    "--motor",
    "--link",
    "--outliers",
];

impl Suggestion {
    pub(super) fn new(command: &'static str, options: &[&str], why: String) -> Self {
        let mut typed: Vec<String> = Vec::new();
        for &option in options {
            match typed.last_mut() {
                // As a separate argument, the name would be taken for an option.
                Some(last) if option.starts_with('-') && OF_COLUMNS.contains(&last.as_str()) => {
                    last.push('=');
                    last.push_str(option);
                }
                _ => typed.push(option.to_owned()),
            }
        }
        Suggestion {
            command,
            options: typed,
            why,
            notes: Vec::new(),
        }
    }

    /// Writes the prepared record to a file with a name of its own: a second log must not overwrite the first one's.
    fn into_another(mut self, file: &RecordFile) -> Self {
        let name = file.name();
        let stem = Path::new(&name)
            .file_stem()
            .map_or_else(|| name.clone(), |stem| stem.to_string_lossy().into_owned());
        let out = match stem.ends_with(OF_PREPARED) {
            true => format!("{stem}-2.csv"),
            false => format!("{stem}{OF_PREPARED}.csv"),
        };
        let texts = self.options.iter_mut().chain(&mut self.notes);
        texts.for_each(|text| *text = text.replace(PREPARED, &out));
        self
    }
}

/// Numbers that instruments write for a missing sample; Campbell's loggers have -6999 and -7999 for numbers of two bytes.
const SENTINELS: [f64; 11] = [
    99.0, 999.0, 9999.0, 99_999.0, 999.9, 9999.9, 6999.0, 7999.0, 32_767.0, 32_768.0, 65_535.0,
];

/// The number that a column seems to have in place of missing samples: one of those that instruments write, repeated, far from all others and
/// not seen as an outlier.
fn sentinel(samples: &[f64], column: &Column) -> Option<f64> {
    [column.least, column.greatest].into_iter().find(|end| {
        let others = samples.iter().copied().filter(|v| v.is_finite() && v != end);
        let (least, greatest) = others.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, g), v| (l.min(v), g.max(v)));
        let distance = (end - least).abs().min((end - greatest).abs());
        let count = samples.iter().filter(|v| *v == end).count();
        let is_far = greatest > least && distance > greatest - least;
        SENTINELS.contains(&end.abs()) && count > 1 && column.outliers.len() < count && is_far
    })
}

/// A second look, with the texts among the numbers, and numbers that seem to stand for missing samples, taken for these.
fn reading_again(file: &RecordFile, look: &Look) -> Option<Suggestion> {
    let mut texts = file.unread_texts().to_vec();
    // Both have the columns in the same order; to find each by its name would take long where there are many.
    let columns = look.columns.iter().zip(file.record.columns()).enumerate();
    let signals = columns.filter(|(i, _)| Some(*i) != look.time && file.is_text());
    let numbers = signals.filter_map(|(_, (column, (_, samples)))| sentinel(samples, column));
    let numbers: BTreeSet<String> = numbers.map(exact).collect();
    texts.extend(numbers);
    if texts.is_empty() || texts.iter().any(|text| text.contains(',')) {
        return None;
    }
    let (joined, named) = (texts.join(","), quoted(texts.iter().map(String::as_str)));
    let why = format!("Columns of numbers have {named} in some rows. This takes that for missing samples.");
    Some(Suggestion::new("look", &["--missing-text", &joined], why))
}

/// The inputs and the output that an identification would take.
pub(super) struct Signals {
    pub inputs: Vec<usize>,
    pub output: usize,
    /// Other columns that depend on the inputs.
    pub others: Vec<usize>,
    /// How they were chosen, in a sentence.
    pub why: String,
}

/// The command that fits a record, or why there is none; `None` if there is nothing to identify.
pub(super) fn suggestion(
    file: &RecordFile,
    request: &Request,
    look: &Look,
    sample_time: Option<f64>,
) -> (Option<Suggestion>, Option<Failure>) {
    if let Some(again) = reading_again(file, look) {
        return (Some(again), None);
    }
    if let (None, None, Some(name)) = (look.time, request.sample_time, file.unread_instants()) {
        let text = format!(
            "Column '{name}' should have the instants, but its texts are not read as time stamps: say by --time-format how they are written. \
             --sample-time S takes the rows as evenly spaced, even where some are lost."
        );
        return (
            None,
            Some(Failure {
                text,
                ..Failure::default()
            }),
        );
    }
    if look.clock.as_ref().is_none_or(|clock| clock.is_uniform)
        && let Some(cut) = without_dead_start(look, file)
    {
        return (Some(cut.into_another(file)), None);
    }
    let signals = signals(request, look);
    let held = signals.as_ref().map(|s| s.inputs.clone()).unwrap_or_default();
    let suggestion = match joint::suggestion(file, request, look, sample_time) {
        joint::Outcome::Fits(joint) => Some(joint),
        joint::Outcome::Fails(failure) => return (None, Some(failure)),
        joint::Outcome::None => match signals {
            Some(signals) => identification(look, request, &signals, file),
            None => without_outliers(&with_outliers(look)),
        },
    };
    let suggestion = suggestion.map(|suggestion| match (&look.clock, sample_time) {
        (Some(clock), Some(step)) if !clock.is_uniform => even_spacing(look, file, clock, step, &held),
        _ => suggestion,
    });
    (suggestion.map(|suggestion| suggestion.into_another(file)), None)
}

/// The signals: the given columns, otherwise by their names, otherwise by their dependences.
pub(super) fn signals(request: &Request, look: &Look) -> Option<Signals> {
    let index = |name: &str| look.columns.iter().position(|c| c.name == name);
    let usable: Vec<usize> = (0..look.columns.len())
        .filter(|i| Some(*i) != look.time && look.columns[*i].is_signal())
        .collect();
    let given: Vec<usize> = request.inputs.iter().filter_map(|name| index(name)).collect();
    let output = request.output.and_then(index);
    if let (false, Some(output)) = (given.is_empty(), output) {
        return Some(Signals {
            inputs: given,
            output,
            others: Vec::new(),
            why: "You named the columns.".to_owned(),
        });
    }
    let named = |wanted: Role| -> Vec<usize> {
        // A second output with another number, such as y0 in addition to y, may be the output without noise.
        let of = |number: &dyn Fn(&str) -> bool| -> Vec<usize> {
            let says = |i: &&usize| role(&look.columns[**i].name).is_some_and(|(r, n)| r == wanted && number(n));
            usable.iter().filter(says).copied().collect()
        };
        match of(&|n| n.is_empty()) {
            plain if !plain.is_empty() => plain,
            _ => of(&|n| !n.is_empty()),
        }
    };
    let (inputs, outputs) = (named(Role::Input), named(Role::Output));
    let inputs = if given.is_empty() { inputs } else { given.clone() };
    let outputs = output.map_or(outputs, |o| vec![o]);
    if let (false, [output, others @ ..]) = (inputs.is_empty(), &outputs[..]) {
        return Some(Signals {
            inputs,
            output: *output,
            others: others.to_vec(),
            why: match given.is_empty() && request.output.is_none() {
                true => "The columns' names say which is the input and which the output.".to_owned(),
                false => "You named a column; the other one is named as its counterpart.".to_owned(),
            },
        });
    }
    // A setpoint acts through what its controller does.
    let is_target = |i: &usize| is_setpoint(&look.columns[*i].name) && !given.contains(i) && output != Some(*i);
    let (targets, others): (Vec<usize>, Vec<usize>) = usable.iter().partition(|i| is_target(i));
    let without = (!targets.is_empty())
        .then(|| by_dependence(look, &others, &given, output))
        .flatten();
    let left_out = |signals: Signals| {
        let names = quoted(targets.iter().map(|i| look.columns[*i].name.as_str()));
        let why = format!("{} Left out: {names}, by name what a controller aims at.", signals.why);
        Signals { why, ..signals }
    };
    without
        .map(left_out)
        .or_else(|| by_dependence(look, &usable, &given, output))
}

/// Inputs and output by their dependences: the output follows others most, and others follow it least.
fn by_dependence(look: &Look, usable: &[usize], given: &[usize], output: Option<usize>) -> Option<Signals> {
    let order = Order { look, usable, given };
    let best = output.or_else(|| order.last())?;
    let inputs = order.inputs(best);
    if inputs.is_empty() {
        return None;
    }
    let is_ordered = (order.dependences()).any(|d| d.effect == best && d.direction == Direction::Forward);
    let is_named = output.is_some() || !given.is_empty();
    let names: Vec<&str> = inputs.iter().map(|i| look.columns[*i].name.as_str()).collect();
    let is_other = |i: usize| order.is_output(i, best) || (i != best && order.lies_between(i, best));
    Some(Signals {
        others: (usable.iter().copied())
            .filter(|&i| is_other(i) && !inputs.contains(&i))
            .collect(),
        why: why(&look.columns[best].name, &names, is_ordered, is_named),
        inputs,
        output: best,
    })
}

/// Which columns follow which, of those that are `usable`; the user named the inputs `given`.
struct Order<'a> {
    look: &'a Look,
    usable: &'a [usize],
    given: &'a [usize],
}

impl<'a> Order<'a> {
    /// The dependences, without those of columns that are multiples of others.
    fn dependences(&self) -> impl Iterator<Item = &'a Dependence> + use<'a> {
        let look = self.look;
        let is_multiple = move |i: usize| {
            (look.relations.iter()).any(|k| k.column == i && matches!(k.relation, Relation::Multiple { .. }))
        };
        (look.dependences.iter()).filter(move |d| !is_multiple(d.cause) && !is_multiple(d.effect))
    }

    /// How strongly a column follows others, and how strongly others follow it.
    fn follows(&self, i: usize) -> (f64, f64) {
        let strength = |d: &Dependence| match d.kind {
            Kind::Linear => d.coherent.max(f64::MIN_POSITIVE),
            Kind::Square => d.correlation.powi(2),
        };
        let towards = (self.dependences())
            .filter(|d| d.effect == i && !self.given.contains(&i))
            .filter(|d| d.kind == Kind::Square || d.direction != Direction::AtOnce || self.usable.len() == 2)
            .map(strength);
        let away = (self.dependences())
            .filter(|d| d.cause == i && d.direction == Direction::Forward)
            .map(strength);
        (towards.fold(0.0, f64::max), away.fold(0.0, f64::max))
    }

    /// The column that follows others most, after the named inputs if there are any; among equals, the last one.
    fn last(&self) -> Option<usize> {
        let leads = |i: usize, to: usize| self.dependences().any(|d| d.cause == i && d.effect == to);
        let is_behind = |i: usize| self.given.is_empty() || self.given.iter().any(|g| leads(*g, i));
        let candidates = self.usable.iter().copied().filter(|i| !self.given.contains(i));
        let scored = candidates.filter(|i| is_behind(*i)).filter_map(|i| {
            let (towards, away) = self.follows(i);
            (towards > 0.0).then_some((towards - away, i))
        });
        scored.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, i)| i)
    }

    /// The named inputs; otherwise all columns that lead to others and have no other role. A missing input does more harm than one without
    /// effect.
    fn inputs(&self, output: usize) -> Vec<usize> {
        if !self.given.is_empty() {
            return self.given.to_vec();
        }
        let leads = |i: usize| self.dependences().any(|d| d.cause == i);
        let is_derivative = |i: usize| self.look.relations.iter().any(|k| k.column == i);
        let is_input = |&i: &usize| {
            i != output && leads(i) && !self.is_output(i, output) && !self.lies_between(i, output) && !is_derivative(i)
        };
        let inputs: Vec<usize> = self.usable.iter().copied().filter(is_input).collect();
        if inputs.is_empty() {
            let causes = self.dependences().filter(|d| d.effect == output).map(|d| d.cause);
            return causes.filter(|cause| self.usable.contains(cause)).take(1).collect();
        }
        inputs
    }

    /// Whether a column follows others and leads none: it is another output.
    fn is_output(&self, i: usize, best: usize) -> bool {
        let (towards, away) = self.follows(i);
        i != best && towards > BETWEEN && away == 0.0
    }

    /// Whether a column follows another one with a delay: it lies between that and the output.
    fn lies_between(&self, i: usize, output: usize) -> bool {
        self.dependences().any(|d| {
            let is_later = d.block == 1 && d.delay > 0 && d.direction == Direction::Forward;
            d.effect == i && d.cause != output && is_later && d.coherent > BETWEEN
        })
    }
}

/// Why this column is the output: whether the lags show an order, and whether the user named a column.
fn why(output: &str, inputs: &[&str], is_ordered: bool, is_named: bool) -> String {
    match (is_ordered, is_named) {
        (_, true) => "You named a column; the data show what it belongs to.".to_owned(),
        (true, _) => format!(
            "'{output}' follows {} and leads none: it is taken as the output.",
            quoted(inputs.iter().copied())
        ),
        (false, _) => {
            "The lags do not tell which column is the cause: the order of the columns was taken. Swap --input and --output if that is wrong."
                .to_owned()
        }
    }
}

/// An identification of a block model.
fn identification(look: &Look, request: &Request, signals: &Signals, file: &RecordFile) -> Option<Suggestion> {
    let name = |i: &usize| look.columns[*i].name.as_str();
    let output = &look.columns[signals.output];
    if output.samples < FEWEST {
        return None;
    }
    let several = signals.inputs.len() > 1;
    let incomplete = |i: usize| look.columns[i].samples < file.record.len();
    let gaps: Vec<usize> = signals.inputs.iter().copied().filter(|i| incomplete(*i)).collect();
    if !gaps.is_empty() {
        return Some(repair(look, file, &gaps));
    }
    if are_wild(output, file) {
        return without_outliers(&[output]);
    }
    let inputs: Vec<&str> = signals.inputs.iter().map(name).collect();
    let joined = inputs.join(",");
    let mut options = vec!["--input", &joined, "--output", &output.name];
    let mut why = signals.why.clone();
    let levels = signals
        .inputs
        .iter()
        .map(|&i| look.columns[i].levels.as_ref().map(Vec::len));
    let few = levels.flatten().any(|levels| levels <= TWO);
    let (structure, because) = structure(several, few);
    options.extend(structure.into_iter().flatten());
    why.push_str(because);
    if incomplete(signals.output) {
        options.push("--missing");
        why.push_str(" The output misses samples, which --missing leaves out of the fit.");
    }
    if !output.outliers.is_empty() {
        options.push("--robust");
        why.push_str(" The output has outliers, which --robust leaves out of the fit.");
    }
    let stands_still = look.time.is_some() && look.clock.is_none();
    let unknown = || stands_still.then(|| UNKNOWN_TIME.to_owned());
    let step = request.sample_time.map(exact).or_else(unknown);
    options.extend(step.iter().flat_map(|step| ["--sample-time", step.as_str()]));
    options.extend(["-o", "model.json", "--report", "report.html"]);
    let mut suggestion = Suggestion::new("identify", &options, why);
    let notes = &mut suggestion.notes;
    if request.sample_time.is_none() && stands_still {
        notes.push(format!("Put the time between two samples in place of {UNKNOWN_TIME}."));
    }
    if several && inputs.iter().any(|name| name.contains(',')) {
        notes.push("The commands separate names by commas: rename a column whose name has one.".to_owned());
    }
    if !signals.others.is_empty() {
        let others: Vec<String> = signals.others.iter().map(|i| format!("'{}'", name(i))).collect();
        let are = if others.len() == 1 { "an output" } else { "outputs" };
        let others = others.join(", ");
        notes.push(format!("{others} may be {are} too: --output takes one at a time."));
    }
    Some(suggestion)
}

/// The options for the structure, and why; `few` says whether an input has two levels at most.
fn structure(several: bool, few: bool) -> (Option<[&'static str; 2]>, &'static str) {
    match (several, few) {
        (true, _) => (
            None,
            " Linear dynamics are compared with a nonlinearity for every input.",
        ),
        (false, true) => (
            Some(["--structure", "linear"]),
            " The input has two levels, at which no curve can be told from a straight line: the dynamics are what there is to find.",
        ),
        (false, false) => (Some(["--structure", "auto"]), " The structure is chosen by the data."),
    }
}
