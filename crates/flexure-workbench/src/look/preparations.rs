//! Preparations that a record needs before an identification.

use std::ops::Range;

use flexure::look::{Clock, Column, Look};
use flexure::preparation::LONGEST_GAP;
use flexure::text::counted;
use flexure_io::RecordFile;

use super::suggestion::Suggestion;
use super::text::plain;
use crate::preparation::{Columns, Cut, LONGEST_FILLED, Preparation};

/// A preparation that a record needs, and why.
pub(super) struct Repair {
    /// The steps.
    pub steps: Preparation,
    /// The steps of an identification that does them itself, where they differ: it cuts gaps off by itself.
    pub in_one: Option<Preparation>,
    /// What they are for, in a sentence.
    pub why: String,
    /// What else should be known, one sentence each.
    pub notes: Vec<String>,
}

impl Repair {
    fn new(steps: Preparation, why: String) -> Self {
        Repair {
            steps,
            in_one: None,
            why,
            notes: Vec::new(),
        }
    }

    /// What else should be known where the identification itself does the steps.
    pub fn notes_in_one(&self) -> Vec<String> {
        match self.in_one {
            Some(_) => vec![
                "This interpolates short gaps. Longer gaps stay, and the longest part without one is used.".to_owned(),
            ],
            None => self.notes.clone(),
        }
    }

    /// The command that prepares the record.
    pub fn command(self) -> Suggestion {
        let cut = match self.steps.cut {
            Some(Cut::Samples([from, to])) => {
                let end = |end: Option<usize>| end.map_or_else(String::new, |end| end.to_string());
                Some(("cut-samples", format!("{}:{}", end(from), end(to))))
            }
            _ => None,
        };
        let options = cut.into_iter().chain(self.steps.repeated());
        let options: Vec<String> = options.flat_map(|(name, value)| [format!("--{name}"), value]).collect();
        let typed: Vec<&str> = options.iter().map(String::as_str).chain(["-o", PREPARED]).collect();
        Suggestion {
            notes: self.notes,
            ..Suggestion::new("prepare", &typed, self.why)
        }
    }
}

/// Keeps the samples from the first to the one before the second.
fn only(part: &Range<usize>) -> Option<Cut> {
    Some(Cut::Samples([Some(part.start), Some(part.end)]))
}

/// What stands for a sample time that the record does not tell.
pub(super) const UNKNOWN_TIME: &str = "SECONDS";

/// The largest uncertainty of a sample time that is suggested. Convention: a model's frequencies are then wrong by as much.
const KNOWN: f64 = 0.01;

/// What stands for the output file of a preparation.
pub(super) const PREPARED: &str = "prepared.csv";

/// The fewest samples without any change that are cut off at the start. Convention.
const FEWEST_DEAD: usize = 20;

/// The columns with samples far from their neighbours.
pub(super) fn with_outliers(look: &Look) -> Vec<&Column> {
    let columns = (look.columns.iter().enumerate()).filter(|(i, c)| Some(*i) != look.time && !c.outliers.is_empty());
    columns.map(|(_, column)| column).collect()
}

/// Whether a column's outliers are most of its variance: then they are no signal.
pub(super) fn are_wild(column: &Column, file: &RecordFile) -> bool {
    let samples = file.record.column(&column.name).unwrap_or_default();
    let square = |i: &usize| samples.get(*i).map_or(0.0, |x| (x - column.mean).powi(2));
    let of_outliers: f64 = column.outliers.iter().map(square).sum();
    of_outliers > 0.5 * column.deviation.powi(2) * column.samples as f64
}

/// The columns, as a step takes them.
fn named(columns: &[&Column]) -> Columns {
    Columns::Named(columns.iter().map(|column| column.name.clone()).collect())
}

/// A preparation that interpolates these columns' outliers, since they hide dependences; `None` without outliers.
pub(super) fn without_outliers(columns: &[&Column]) -> Option<Repair> {
    let runs = columns.iter().flat_map(|c| c.outliers.chunk_by(|a, b| a + 1 == *b));
    let longest = runs.map(<[usize]>::len).max()?;
    let count = columns.iter().map(|column| column.outliers.len()).sum();
    let why = match count {
        1 => "An outlier hides what depends on what. It is interpolated.".to_owned(),
        _ => format!("{count} outliers hide what depends on what. They are interpolated."),
    };
    let steps = Preparation {
        outliers: Some(named(columns)),
        fill: Some(longest),
        ..Preparation::default()
    };
    Some(Repair::new(steps, why))
}

/// A preparation that cuts off the rows of a logger which ran before its machine did: no signal changes in them, and then several jump
/// farther than they ever do later.
pub(super) fn without_dead_start(look: &Look, file: &RecordFile) -> Option<Repair> {
    // Both have the columns in the same order; to find each by its name would take long where there are many.
    let columns = look.columns.iter().zip(file.record.columns()).enumerate();
    let signals = columns.filter(|(i, (column, _))| Some(*i) != look.time && column.is_signal());
    let signals: Vec<&[f64]> = signals.map(|(_, (_, (_, samples)))| samples).collect();
    let still = |x: &&[f64]| x.iter().take_while(|v| **v == x[0]).count();
    let dead = signals.iter().map(still).min()?;
    let jumps = |x: &&&[f64]| {
        let steps = x[dead..].windows(2).map(|w| (w[1] - w[0]).abs());
        let largest = steps.fold(0.0, f64::max);
        largest > 0.0 && (x[dead] - x[0]).abs() > largest
    };
    if dead < FEWEST_DEAD || 2 * dead > file.record.len() || signals.iter().filter(jumps).count() < 2 {
        return None;
    }
    let why = format!(
        "In the first {dead} samples no signal changes, and then several jump: the logger ran before the machine did. This cuts them off."
    );
    let steps = Preparation {
        cut: Some(Cut::Samples([Some(dead), None])),
        ..Preparation::default()
    };
    Some(Repair::new(steps, why))
}

/// The command for a record whose samples are evenly spaced behind uneven stamps; `sample_time` is the time between two samples, if it is known.
pub(super) fn even_stamps(sample_time: Option<f64>, rows_fit: f64) -> Suggestion {
    let why = "The stamps jitter, but the samples are evenly spaced. This gives them even stamps.".to_owned();
    let step = sample_time.map_or_else(|| UNKNOWN_TIME.to_owned(), plain);
    let mut suggestion = Suggestion::new("prepare", &["--sample-time", &step, "-o", PREPARED], why);
    if sample_time.is_none() {
        suggestion.notes.push(format!(
            "Put the time between two samples in place of {UNKNOWN_TIME}: the rows fit about {} s.",
            plain(rows_fit)
        ));
    }
    suggestion
}

/// A preparation of a record whose samples are not evenly spaced; inputs that hold their values, or have few, hold them between samples too.
pub(super) fn even_spacing(
    look: &Look,
    file: &RecordFile,
    clock: &Clock,
    sample_time: f64,
    inputs: &[usize],
) -> Repair {
    let samples = (look.time).map_or(0, |i| look.columns[i].samples + look.columns[i].missing);
    let stretch = longest_stretch(clock, samples);
    let instants = look.time.and_then(|i| file.record.column(&look.columns[i].name).ok());
    let repeats = instants.is_some_and(|instants| has_repeated_rows_only(instants, clock));
    let cuts = stretch.len() < samples && !(loses_few(clock) && (clock.backwards.is_empty() || repeats));
    let wild: Vec<&Column> = with_outliers(look).into_iter().filter(|c| are_wild(c, file)).collect();
    let resampling = resampling(look, clock, sample_time, inputs, cuts);
    let steps = Preparation {
        cut: cuts.then(|| only(&stretch)).flatten(),
        outliers: (!wild.is_empty()).then(|| named(&wild)),
        ..resampling
    };
    let why = match clock.jitter > Clock::UNIFORM || !clock.backwards.is_empty() {
        _ if !parts(look, file, clock).is_empty() => {
            "The clock starts again within the log, and every identification needs one part of it."
        }
        true if !clock.backwards.is_empty() && !cuts => {
            "Rows are there twice, and every identification needs evenly spaced samples."
        }
        true => "The samples are not evenly spaced, which every identification needs.",
        false => "Samples are lost, and every identification needs evenly spaced ones.",
    };
    let in_one = (cuts && clock.backwards.is_empty()).then(|| Preparation {
        outliers: steps.outliers.clone(),
        fill: None,
        ..self::resampling(look, clock, sample_time, inputs, false)
    });
    let mut repair = Repair {
        in_one,
        ..Repair::new(steps, why.to_owned())
    };
    let notes = &mut repair.notes;
    if !wild.is_empty() {
        notes.push("Outliers become missing samples.".to_owned());
    }
    match cuts {
        true => notes.push(format!(
            "This keeps the longest part without a gap: {} of {samples} samples.",
            stretch.len()
        )),
        false if clock.gaps.is_empty() && clock.backwards.is_empty() => notes.push(format!(
            "If only the stamps jitter, and the samples are evenly spaced: flexure prepare FILE --sample-time {} -o {PREPARED} gives them even \
             stamps.",
            plain(sample_time)
        )),
        false if !clock.gaps.is_empty() => {
            let lost = clock.gaps.iter().map(|gap| (gap.steps - 1.0).round().max(1.0) as usize);
            notes.push(format!("This interpolates {}.", counted(lost.sum(), "lost sample")));
        }
        false => {}
    }
    repair
}

/// A clock that goes back by more steps than this may have started again. As many samples have instants of others then. Convention: fewer are
/// rows out of order.
const FEWEST_AGAIN: usize = 20;

/// The parts of a log whose clock starts again: sorting would mix them, since instants of one are also those of another. Empty where rows are
/// only out of order.
pub(super) fn parts(look: &Look, file: &RecordFile, clock: &Clock) -> Vec<Range<usize>> {
    let t = look.time.and_then(|i| file.record.column(&look.columns[i].name).ok());
    let t = t.unwrap_or_default();
    let goes_back = |&i: &usize| {
        let before = t[..i].iter().rev().find(|t| t.is_finite());
        before.is_some_and(|before| before - t[i] > FEWEST_AGAIN as f64 * clock.step)
    };
    let starts: Vec<usize> = clock.backwards.iter().copied().filter(goes_back).collect();
    if starts.is_empty() {
        return Vec::new();
    }
    let mut sorted: Vec<f64> = t.iter().copied().filter(|t| t.is_finite()).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let again = sorted.windows(2).filter(|w| w[1] - w[0] < 0.5 * clock.step).count();
    if again < FEWEST_AGAIN {
        return Vec::new();
    }
    let breaks: Vec<usize> = [0].into_iter().chain(starts).chain([t.len()]).collect();
    breaks.windows(2).map(|w| w[0]..w[1]).collect()
}

/// The longest part without a gap and without a step back in time.
fn longest_stretch(clock: &Clock, samples: usize) -> Range<usize> {
    let mut breaks: Vec<usize> = clock.gaps.iter().map(|gap| gap.sample).collect();
    breaks.extend(&clock.backwards);
    breaks.extend([0, samples]);
    breaks.sort_unstable();
    let stretches = breaks.windows(2).map(|w| w[0]..w[1]);
    stretches.rev().max_by_key(Range::len).unwrap_or(0..samples)
}

/// The longest step of stamps that come early or late, in steps.
const LATEST: f64 = 2.5;

/// Fewest samples whose number tells whether samples are lost. Convention.
const FEWEST_COUNTED: usize = 100;

/// The sample time of a record with even samples and uneven stamps, in units of these.
pub(super) struct Even {
    /// The time between two samples.
    pub step: f64,
    /// How far it may be wrong, relative to it.
    pub uncertainty: f64,
}

impl Even {
    /// Whether the sample time is known well enough for a command.
    pub fn is_known(&self) -> bool {
        self.uncertainty <= KNOWN
    }
}

/// The sample time of a record with even samples and uneven stamps in the column `time`, for example stamps in whole seconds that jitter.
///
/// Some stamps repeat and others come late, but no row is there twice. The number of samples is just what the duration needs at a sample
/// time of few digits. A clock that many samples share tells the duration only to a tick.
pub(super) fn even_behind_stamps(file: &RecordFile, time: Option<&str>, clock: &Clock) -> Option<Even> {
    let time = time?;
    if clock.backwards.is_empty() || clock.missing > 0 {
        return None;
    }
    let samples = file.record.len();
    if samples < FEWEST_COUNTED {
        return None;
    }
    let is_twice = |i: usize| {
        let others = file.record.columns().filter(|(name, _)| *name != time);
        let mut columns = others.map(|(_, x)| (x[i - 1], x[i]));
        columns.all(|(before, own)| before == own || (before.is_nan() && own.is_nan()))
    };
    let is_late = |steps: f64| steps <= LATEST;
    let instants = file.record.column(time).ok()?;
    let repeats = has_repeated_rows_only(instants, clock) && !clock.backwards.iter().any(|&i| is_twice(i));
    if !repeats || !clock.gaps.iter().all(|gap| is_late(gap.steps)) {
        return None;
    }
    let mean = clock.duration / (samples - 1) as f64;
    // With more samples, a number of more digits is no coincidence.
    let decimals = samples.ilog10() as usize - 2;
    let step: f64 = format!("{mean:.decimals$e}").parse().ok()?;
    let is_whole = (clock.duration - step * (samples - 1) as f64).abs() < 0.5 * clock.step;
    let is_shared = clock.step > (1.0 + Clock::UNIFORM) * step;
    is_whole.then_some(Even {
        step,
        uncertainty: if is_shared { clock.step / clock.duration } else { 0.0 },
    })
}

/// Whether so few samples are lost in each gap that they are interpolated.
fn loses_few(clock: &Clock) -> bool {
    let is_short = |steps: f64| steps <= LONGEST_FILLED as f64 + 1.0;
    clock.gaps.iter().all(|gap| is_short(gap.steps))
}

/// Whether all samples at which time does not increase have the instant of the sample before: rows that are there twice.
fn has_repeated_rows_only(instants: &[f64], clock: &Clock) -> bool {
    clock.backwards.iter().all(|&i| instants[i] == instants[i - 1])
}

/// The steps that resample; none where the part that is kept is evenly spaced.
fn resampling(look: &Look, clock: &Clock, sample_time: f64, inputs: &[usize], cuts: bool) -> Preparation {
    if clock.jitter <= Clock::UNIFORM && cuts {
        return Preparation::default();
    }
    // A lost sample leaves none on its two sides, at new instants, either.
    let lost = clock.gaps.iter().map(|gap| (gap.steps - 0.5).ceil() as usize + 1).max();
    let held = (inputs.iter().map(|&i| &look.columns[i])).filter(|column| column.held || column.levels.is_some());
    Preparation {
        resample: plain(sample_time).parse().ok(),
        fill: lost.filter(|lost| *lost > LONGEST_GAP && !cuts),
        held: held.map(|column| column.name.clone()).collect(),
        ..Preparation::default()
    }
}

/// A preparation of a record with columns that miss samples which the identification needs: short gaps are interpolated; otherwise the
/// longest part without a gap is kept.
pub(super) fn without_gaps(look: &Look, file: &RecordFile, columns: &[usize]) -> Repair {
    let names: Vec<String> = columns.iter().map(|i| format!("'{}'", look.columns[*i].name)).collect();
    let samples = columns
        .iter()
        .filter_map(|i| file.record.column(&look.columns[*i].name).ok());
    let mut missing = vec![false; file.record.len()];
    samples.for_each(|x| missing.iter_mut().zip(x).for_each(|(m, x)| *m |= !x.is_finite()));
    let longest = |of: bool| {
        let runs = missing.chunk_by(|a, b| a == b).scan(0, |start, run| {
            *start += run.len();
            Some((run[0], *start - run.len()..*start))
        });
        let runs = runs.filter(|(missing, _)| *missing == of).map(|(_, run)| run);
        runs.max_by_key(|run| run.len()).unwrap_or(0..0)
    };
    let (gap, complete) = (longest(true).len(), longest(false));
    let ends = [missing.first(), missing.last()].contains(&Some(&true));
    let fills = gap <= LONGEST_FILLED && !ends;
    let why = format!(
        "{} {} samples, which the identification needs.",
        names.join(", "),
        if names.len() == 1 { "misses" } else { "miss" }
    );
    let steps = Preparation {
        cut: (!fills).then(|| only(&complete)).flatten(),
        fill: fills.then_some(gap),
        ..Preparation::default()
    };
    let note = match fills {
        true => format!(
            "This interpolates the gaps, the longest of which has {}.",
            counted(gap, "sample")
        ),
        false => format!(
            "This keeps the longest part without a gap: {} of {} samples.",
            complete.len(),
            missing.len()
        ),
    };
    // Gaps that are longer stay, and are cut off.
    let in_one = (!fills).then(|| Preparation {
        fill: Some(LONGEST_GAP),
        ..Preparation::default()
    });
    Repair {
        notes: vec![note],
        in_one,
        ..Repair::new(steps, why)
    }
}
