//! The command to type after a look.

use std::collections::BTreeSet;
use std::path::Path;

use flexure::look::{Column, Look};
use flexure::text::exact;
use flexure_io::RecordFile;

use super::Request;
use super::joint;
use super::joint_columns::joints;
use super::joint_trial::Failure;
use super::preparations::{
    PREPARED, Repair, UNKNOWN_TIME, are_wild, even_behind_stamps, even_spacing, even_stamps, with_outliers,
    without_dead_start, without_gaps, without_outliers,
};
use super::roles::is_setpoint;
use super::signals::{Signals, signals};
use crate::preparation::{Done, Preparation};
use crate::text::{capitalised, quoted};

/// With only this number of input levels, a nonlinearity cannot be distinguished from a straight line.
const TWO: usize = 2;
/// Fewest samples for which an identification is suggested: what block structures need.
const FEWEST: usize = 200;

/// The option that leaves missing outputs out; an identification that prepares its record does so by itself.
const MISSING: &str = "--missing";

/// What is said of missing samples of the output, without and with other steps.
const LEFT_OUT: &str = " The output misses samples, which are left out of the fit.";
const NOT_FILLED: &str = " The output is not filled: its missing samples are left out of the fit.";
/// The end of the name of a prepared file, after that of the log.
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

    /// With these steps before it, which are typed before this option.
    fn with_steps(mut self, steps: &Preparation, before: &str) -> Self {
        let steps = steps.repeated().into_iter();
        let typed: Vec<String> = steps.flat_map(|(name, value)| [format!("--{name}"), value]).collect();
        let end = self.options.iter().position(|option| option == before);
        let end = end.unwrap_or(self.options.len());
        self.options.splice(end..end, typed);
        self
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
    if let (None, None, Some(dates)) = (look.time, request.sample_time, file.unsettled_dates()) {
        let text = format!(
            "{}. --sample-time S takes the rows as evenly spaced, even where some are lost.",
            capitalised(&dates.to_string())
        );
        return (
            None,
            Some(Failure {
                text,
                ..Failure::default()
            }),
        );
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
    if let Some(joint) =
        joint::gaps(file, request, look).and_then(|repair| joint_at_once(&repair, file, request, look, sample_time))
    {
        return (Some(joint.into_another(file)), None);
    }
    let next = match next(file, request, look, sample_time, look) {
        Ok(next) => next,
        Err(failure) => return (None, Some(failure)),
    };
    let suggestion = next.map(|next| match next {
        Next::Identify(suggestion, _) | Next::Joint(suggestion) | Next::Other(suggestion) => suggestion,
        Next::Repair(repair) => at_once(&repair, file, request, look, sample_time).unwrap_or_else(|| repair.command()),
    });
    (suggestion.map(|suggestion| suggestion.into_another(file)), None)
}

/// A look with the day first, and one with the month first, where dates may begin with either.
pub(super) fn of_dates(file: &RecordFile, request: &Request, look: &Look) -> Option<[(&'static str, Suggestion); 2]> {
    let dates = file
        .unsettled_dates()
        .filter(|_| look.time.is_none() && request.sample_time.is_none())?;
    let [month, day] = dates.formats.each_ref();
    let by = |format: &String| Suggestion::new("look", &["--time-format", format], String::new());
    Some([
        ("if the day comes first", by(day)),
        ("if the month comes first", by(month)),
    ])
}

/// What is to be done next.
enum Next {
    /// An identification, and the columns that it connects.
    Identify(Suggestion, Vec<String>),
    /// The identification of a joint.
    Joint(Suggestion),
    /// A preparation.
    Repair(Box<Repair>),
    /// Another command.
    Other(Suggestion),
}

/// Says what is to be done with a record after a look at it. `raw` is the look at it before any preparation, which has the inputs' levels.
fn next(
    file: &RecordFile,
    request: &Request,
    look: &Look,
    sample_time: Option<f64>,
    raw: &Look,
) -> Result<Option<Next>, Failure> {
    if look.clock.as_ref().is_none_or(|clock| clock.is_uniform)
        && let Some(cut) = without_dead_start(look, file)
    {
        return Ok(Some(Next::Repair(cut.into())));
    }
    let signals = signals(request, look).map(|signals| match request.inputs.is_empty() {
        true => signals.with_weak_inputs(look, &file.record),
        false => signals,
    });
    let held = signals.as_ref().map(|s| s.inputs.clone()).unwrap_or_default();
    let next = match joint::suggestion(file, request, look, sample_time) {
        joint::Outcome::Fits(joint) => Some(Next::Joint(joint)),
        joint::Outcome::Fails(failure) => return Err(failure),
        joint::Outcome::None => match signals {
            Some(signals) => identification(look, request, &signals, file, raw),
            None => without_outliers(&with_outliers(look)).map(|repair| Next::Repair(repair.into())),
        },
    };
    Ok(next.map(|next| match (&look.clock, sample_time) {
        (Some(clock), Some(step)) if !clock.is_uniform => {
            match even_behind_stamps(file, request.time.map(|(name, _)| name), clock) {
                Some(even) => Next::Other(even_stamps(
                    request.sample_time.or(even.is_known().then_some(step)),
                    step,
                )),
                None => Next::Repair(even_spacing(look, file, clock, step, &held).into()),
            }
        }
        _ => next,
    }))
}

/// What is to be done after these steps, and what they did. The samples then are `sample_time` apart.
fn after(
    steps: &Preparation,
    file: &RecordFile,
    request: &Request,
    look: &Look,
    sample_time: Option<f64>,
) -> Option<(Next, Vec<Done>)> {
    let time = request.time.map(|(name, _)| name);
    let request = &Request {
        time: time.map(|name| (name, 1.0)),
        ..*request
    };
    let columns: Vec<&str> = (look.columns.iter().enumerate())
        .filter(|(i, column)| Some(*i) != look.time && column.is_signal())
        .map(|(_, column)| column.name.as_str())
        .collect();
    let (prepared, done) = steps.of_file(file, time, &columns).ok()?;
    let after = flexure::look::look(&prepared.record, time, sample_time).ok()?;
    Some((next(&prepared, request, &after, sample_time, look).ok()??, done))
}

/// The identification of a joint with these steps before it, in one command. A joint needs all samples of its columns.
fn joint_at_once(
    repair: &Repair,
    file: &RecordFile,
    request: &Request,
    look: &Look,
    sample_time: Option<f64>,
) -> Option<Suggestion> {
    let steps = repair.in_one.as_ref().unwrap_or(&repair.steps);
    if joints(file, request, look).is_empty() {
        return None;
    }
    let (Next::Joint(joint), _) = after(steps, file, request, look, steps.resample.or(sample_time))? else {
        return None;
    };
    let steps = steps.only_for(&joint.options);
    let reasons = [repair.why.clone()].into_iter().chain(repair.notes_in_one());
    Some(Suggestion {
        notes: reasons.chain(joint.notes.iter().cloned()).collect(),
        ..joint.with_steps(&steps, "--report")
    })
}

/// The identification with these steps before it, in one command, where what the steps leave can be identified: a look at that says how. Later
/// records are then prepared as this one is.
fn at_once(
    repair: &Repair,
    file: &RecordFile,
    request: &Request,
    look: &Look,
    sample_time: Option<f64>,
) -> Option<Suggestion> {
    let steps = repair.in_one.as_ref().unwrap_or(&repair.steps);
    if steps.cut.is_some() || (steps.resample.is_some() && request.sample_time.is_some()) {
        return None;
    }
    if let Some(joint) = joint_at_once(repair, file, request, look, sample_time) {
        return Some(joint);
    }
    let output = signals(request, look).map(|signals| look.columns[signals.output].name.clone());
    let steps = Preparation {
        unfilled: output.into_iter().collect(),
        ..steps.clone()
    };
    let known = steps.resample.or(request.sample_time);
    let (Next::Identify(suggestion, columns), done) = after(&steps, file, request, look, known)? else {
        return None;
    };
    let steps = steps.only_for(&columns);
    let mut suggestion = suggestion.with_steps(&steps, "-o");
    if !steps.repeated().is_empty() {
        suggestion.options.retain(|option| option != MISSING);
    }
    // The notes are on the steps of a command of its own.
    let cut = done.iter().filter(|done| done.step == "cut");
    let notes: Vec<String> = match &repair.in_one {
        Some(_) => cut.map(|cut| format!("{}.", capitalised(&cut.text))).collect(),
        None => repair.notes.iter().map(|note| of_inputs(note)).collect(),
    };
    if notes.iter().any(|note| note.ends_with(NOT_FILLED)) {
        suggestion.why = suggestion.why.replace(LEFT_OUT, "");
    }
    let reasons = [repair.why.clone()].into_iter().chain(notes);
    suggestion.notes = reasons.chain(std::mem::take(&mut suggestion.notes)).collect();
    Some(suggestion)
}

/// The note on a preparation, for an identification: it interpolates the inputs, but leaves gaps of the output as they are.
fn of_inputs(note: &str) -> String {
    match note.starts_with("This interpolates ") {
        true => format!("{note}{NOT_FILLED}"),
        false => note.to_owned(),
    }
}

/// An identification of a block model, or what it needs before.
fn identification(look: &Look, request: &Request, signals: &Signals, file: &RecordFile, raw: &Look) -> Option<Next> {
    let name = |i: &usize| look.columns[*i].name.as_str();
    let output = &look.columns[signals.output];
    if output.samples < FEWEST {
        return None;
    }
    let several = signals.inputs.len() > 1;
    let incomplete = |i: usize| look.columns[i].samples < file.record.len();
    let gaps: Vec<usize> = signals.inputs.iter().copied().filter(|i| incomplete(*i)).collect();
    if !gaps.is_empty() {
        return Some(Next::Repair(without_gaps(look, file, &gaps).into()));
    }
    if are_wild(output, file) {
        return without_outliers(&[output]).map(|repair| Next::Repair(repair.into()));
    }
    let inputs: Vec<&str> = signals.inputs.iter().map(name).collect();
    let joined = inputs.join(",");
    let mut options = vec!["--input", &joined, "--output", &output.name];
    let mut why = signals.why.clone();
    let column = |name: &&str| raw.columns.iter().find(|column| column.name == *name);
    let mut levels = inputs
        .iter()
        .filter_map(column)
        .filter_map(|column| column.levels.as_ref());
    let few = levels.any(|levels| levels.len() <= TWO);
    let (structure, because) = structure(several, few);
    options.extend(structure.into_iter().flatten());
    why.push_str(because);
    if incomplete(signals.output) {
        options.push(MISSING);
        why.push_str(LEFT_OUT);
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
    suggestion.notes.extend(closed_loop(look, signals));
    let connected = signals.inputs.iter().chain([&signals.output]).map(name);
    Some(Next::Identify(suggestion, connected.map(str::to_owned).collect()))
}

/// That a controller may have made the input, where a column is by its name what a controller aims at.
fn closed_loop(look: &Look, signals: &Signals) -> Option<String> {
    let is_used = |i: usize| i == signals.output || signals.inputs.contains(&i);
    let is_target = |(i, column): &(usize, &Column)| !is_used(*i) && is_setpoint(&column.name);
    let (_, target) = look.columns.iter().enumerate().find(is_target)?;
    let inputs: Vec<&str> = signals.inputs.iter().map(|i| look.columns[*i].name.as_str()).collect();
    Some(format!(
        "'{}' is by its name a setpoint, so a controller may make {} from '{}' (closed loop): noise of the output then reaches the input, and the \
         model may be biased where the setpoint hardly moves.",
        target.name,
        quoted(inputs.iter().copied()),
        look.columns[signals.output].name
    ))
}

/// The options for the structure, and why; `few` says whether an input has two levels at most.
fn structure(several: bool, few: bool) -> (Option<[&'static str; 2]>, &'static str) {
    match (several, few) {
        (true, _) => (
            None,
            " The command compares a linear model with one that has a curve for each input.",
        ),
        (false, true) => (
            Some(["--structure", "linear"]),
            " The input has two levels, at which no curve can be distinguished from a straight line. So only linear dynamics can be identified.",
        ),
        (false, false) => (Some(["--structure", "auto"]), " The structure is chosen by the data."),
    }
}
