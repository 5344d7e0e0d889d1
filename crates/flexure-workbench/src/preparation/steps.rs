//! The steps, each with a sentence about what it did.

use anyhow::{Context as _, Result, bail};
use flexure::Record;
use flexure::preparation::{Between, Grid, LowPass, Outliers, Resampling, Trend, mean};
use flexure::text::{counted, short};
use flexure_io::{check_computed, unit_at_end};

use super::table::Table;
use super::{Column, Columns, Conversion, Cut, Done, Preparation, units};
use crate::text::{decimal, grouped, quoted};

/// The share of a step by which an instant may lie outside of a cut: rounding of printed digits.
const ROUNDING: f64 = 1e-6;
/// Most outliers whose places are listed.
const LISTED: usize = 5;

fn say(done: &mut Vec<Done>, step: &'static str, text: String) {
    done.push(Done { step, text });
}

/// "1 sample", "12,000 samples".
fn samples(count: usize) -> String {
    format!("{} sample{}", grouped(count), if count == 1 { "" } else { "s" })
}

/// A value with its unit, if known.
fn with_unit(value: f64, unit: Option<&str>) -> String {
    unit.map_or_else(|| short(value), |unit| format!("{} {unit}", short(value)))
}

/// Columns of a table that a step is for.
fn chosen<'a>(table: &'a mut Table, columns: &'a Columns) -> impl Iterator<Item = &'a mut Column> {
    table.columns.iter_mut().filter(|column| columns.has(&column.name))
}

pub(super) fn keep(table: &mut Table, columns: &Columns, done: &mut Vec<Done>) {
    if *columns == Columns::All {
        return;
    }
    let before = table.columns.len();
    table.columns.retain(|column| columns.has(&column.name));
    let text = match table.columns.len() {
        0 => format!("none of the columns of {} is kept", table.name),
        kept => {
            let names = quoted(table.columns.iter().map(|column| &*column.name));
            format!("{names} {} kept, of {before} columns", is_or_are(kept))
        }
    };
    say(done, "keep", text);
}

/// Whether a cut by time leaves a table as it is, since no end that is given lies within.
fn cuts_nothing(table: &Table, cut: Cut) -> bool {
    let (Cut::Time([from, to]), Ok(step), Some(t)) = (cut, table.step(""), &table.instants) else {
        return false;
    };
    let [Some(first), Some(last)] = [t.first(), t.last()] else {
        return false;
    };
    let near = ROUNDING * step;
    let is_given = from.is_some() || to.is_some();
    is_given && from.is_none_or(|from| from < first - near) && to.is_none_or(|to| to > last + near)
}

/// Refuses a cut by time that leaves all tables as they are: its instants are not those of the record.
pub(super) fn check_cut(tables: &[Table], cut: Cut) -> Result<()> {
    match tables.first() {
        Some(table) if tables.iter().all(|table| cuts_nothing(table, cut)) => bail!(
            "the cut keeps all of the record, which goes from {} to {}{}",
            table.place(0),
            table.place(table.len() - 1),
            from_start(table, cut)
        ),
        _ => Ok(()),
    }
}

/// The end of a message on a cut whose instants may count from the start of the record: what they then are on its own clock.
fn from_start(table: &Table, cut: Cut) -> String {
    let (Cut::Time(ends), Some([first, .., last])) = (cut, table.instants.as_deref()) else {
        return String::new();
    };
    let is_within = |end: f64| (0.0..=last - first).contains(&end);
    let given = || ends.into_iter().flatten();
    if given().count() == 0 || !given().all(is_within) {
        return String::new();
    }
    let places: Vec<String> = given()
        .map(|end| format!("{} s after its start is {}", decimal(end), table.instant(first + end)))
        .collect();
    format!("; {}", places.join(", "))
}

pub(super) fn cut(table: &mut Table, cut: Cut, done: &mut Vec<Done>) -> Result<()> {
    let before = table.len();
    let last = before.saturating_sub(1);
    let range = match cut {
        Cut::Samples([from, to]) => from.unwrap_or(0)..to.unwrap_or(before).min(before),
        Cut::Time([from, to]) => {
            let near = ROUNDING * table.step("a cut by time")?;
            let t = table.instants.as_deref().unwrap_or_default();
            let first = from.map_or(0, |from| t.partition_point(|&t| t < from - near));
            first..to.map_or(before, |to| t.partition_point(|&t| t <= to + near))
        }
    };
    if range.is_empty() {
        bail!(
            "nothing is left after the cut; the record goes from {} to {}{}",
            table.place(0),
            table.place(last),
            from_start(table, cut)
        );
    }
    let text = format!(
        "{} of {} are kept, from {} to {}",
        grouped(range.len()),
        samples(before),
        table.place(range.start),
        table.place(range.end - 1)
    );
    table.keep(range);
    say(done, "cut", text);
    Ok(())
}

pub(super) fn convert(table: &mut Table, conversions: &[Conversion], done: &mut Vec<Done>) -> Result<()> {
    for Conversion { column, from, to } in conversions {
        let Some(column) = table.column(column) else { continue };
        let name = &column.name;
        let own = || column.unit.clone().or_else(|| Some(unit_at_end(name)?.1.to_owned()));
        let Some(from) = from.clone().or_else(own) else {
            bail!("the record does not say the unit of column '{name}'; give both: {name}=UNIT:{to}")
        };
        let conversion = units::conversion(&from, to).with_context(|| format!("column '{name}'"))?;
        say(done, "convert", format!("'{name}' is converted from {from} to {to}"));
        for value in &mut column.samples {
            *value = conversion(*value);
        }
        column.unit = Some(to.clone());
    }
    Ok(())
}

pub(super) fn outliers(table: &mut Table, columns: &Columns, rule: Outliers, done: &mut Vec<Done>) -> Result<()> {
    for i in 0..table.columns.len() {
        let column = &table.columns[i];
        if !columns.has(&column.name) {
            continue;
        }
        let found = rule.find(&column.samples)?;
        let text = match found.len() {
            0 => format!("'{}' has no outliers", column.name),
            count => {
                let places: Vec<String> = found.iter().take(LISTED).map(|&sample| table.place(sample)).collect();
                format!(
                    "{} of {} of '{}' {} (more than {} robust deviations from {} neighbours), at {}{}; {} missing now",
                    grouped(count),
                    samples(column.samples.len()),
                    column.name,
                    if count == 1 { "is an outlier" } else { "are outliers" },
                    short(rule.threshold),
                    2 * rule.neighbours,
                    places.join(", "),
                    if count > LISTED { ", ..." } else { "" },
                    if count == 1 { "it is" } else { "they are" },
                )
            }
        };
        for sample in found {
            table.columns[i].samples[sample] = f64::NAN;
        }
        say(done, "outliers", text);
    }
    Ok(())
}

/// What is said of a column's missing samples in gaps of at most this length: they are interpolated.
fn bridged(column: &Column, longest_gap: usize) -> Option<String> {
    let [first, last] = [
        column.samples.iter().position(|x| x.is_finite())?,
        column.samples.iter().rposition(|x| x.is_finite())?,
    ];
    let gaps = column.samples[first..=last].chunk_by(|a, b| a.is_finite() == b.is_finite());
    let missing: usize = gaps
        .filter(|gap| !gap[0].is_finite() && gap.len() <= longest_gap)
        .map(<[f64]>::len)
        .sum();
    let are = is_or_are(missing);
    (missing > 0).then(|| format!("{} missing of '{}' {are} interpolated", samples(missing), column.name))
}

/// Brings all columns to a grid; `old` is the step before.
pub(super) fn resample(
    table: &mut Table,
    grid: Grid,
    old: f64,
    preparation: &Preparation,
    done: &mut Vec<Done>,
) -> Result<()> {
    let before = table.len();
    check_computed(grid.samples, table.columns.len() + 1)?;
    let Some(t) = table.instants.take() else { return Ok(()) };
    let longest_gap = |column: &Column| match preparation.unfilled.contains(&column.name) {
        true => 0,
        false => preparation.longest_gap,
    };
    let bridged: Vec<String> = (table.columns.iter())
        .filter_map(|column| bridged(column, longest_gap(column)))
        .collect();
    for column in &mut table.columns {
        let resampling = Resampling {
            between: match preparation.held.contains(&column.name) {
                true => Between::Held,
                false => Between::Smooth,
            },
            longest_gap: longest_gap(column),
        };
        column.samples = resampling.resample(&t, &column.samples, &grid)?;
    }
    table.instants = Some(grid.instants().collect());
    let mut remarks = vec![format!(
        "{}, about {} s apart, are now {} every {} s",
        samples(before),
        decimal(old),
        grouped(grid.samples),
        decimal(grid.step)
    )];
    if Resampling::slows(old, &grid) {
        let cutoff = short(Resampling::cutoff(&grid));
        remarks.push(format!("what is faster than {cutoff} Hz is taken out first"));
    }
    remarks.extend(averaged(&t));
    remarks.extend(gaps_filled(&t, old, preparation));
    remarks.extend(bridged);
    remarks.extend(held(table, preparation));
    remarks.extend(table.columns.iter().filter_map(still_missing));
    say(done, "resample", remarks.join("; "));
    Ok(())
}

/// What is said of rows with the same instant.
fn averaged(instants: &[f64]) -> Option<String> {
    let repeated = instants.windows(2).filter(|w| w[0] == w[1]).count();
    let [has, are] = if repeated == 1 { ["has", "is"] } else { ["have", "are"] };
    let rows = counted(repeated, "row");
    (repeated > 0).then(|| format!("{rows} {has} the same instant as the row before, and {are} averaged with it"))
}

/// What is said of gaps in time that are short enough.
fn gaps_filled(instants: &[f64], step: f64, preparation: &Preparation) -> Option<String> {
    let longest_gap = preparation.longest_gap;
    let is_filled = |w: &&[f64]| (1.5..=longest_gap as f64 + 1.5).contains(&((w[1] - w[0]) / step));
    let filled = instants.windows(2).filter(is_filled).count();
    let gaps = counted(filled, "gap");
    let but = match &preparation.unfilled[..] {
        [] => String::new(),
        unfilled => format!(", but not in {}", quoted(unfilled.iter().map(String::as_str))),
    };
    (filled > 0).then(|| format!("{gaps} in time {} interpolated{but}", is_or_are(filled)))
}

/// What is said of the columns that keep their values between samples.
fn held(table: &Table, preparation: &Preparation) -> Option<String> {
    let names = table.columns.iter().map(|c| &c.name);
    let held: Vec<&str> = names
        .filter(|name| preparation.held.contains(name))
        .map(String::as_str)
        .collect();
    Some(match held[..] {
        [] => return None,
        [name] => format!("'{name}' keeps its value between samples"),
        _ => format!("{} keep their values between samples", quoted(held.into_iter())),
    })
}

/// What is said of a column that still misses samples.
fn still_missing(column: &Column) -> Option<String> {
    let missing = column.samples.iter().filter(|x| !x.is_finite()).count();
    let are = is_or_are(missing);
    (missing > 0).then(|| format!("{} of '{}' {are} missing, in gaps", samples(missing), column.name))
}

fn is_or_are(count: usize) -> &'static str {
    if count == 1 { "is" } else { "are" }
}

pub(super) fn fill(table: &mut Table, longest_gap: usize, unfilled: &[String], done: &mut Vec<Done>) {
    let filled = table.fill(longest_gap, unfilled);
    for (column, [filled, missing]) in table.columns.iter().zip(filled) {
        if filled + missing == 0 {
            continue;
        }
        if unfilled.contains(&column.name) {
            done.extend(still_missing(column).map(|text| Done { step: "fill", text }));
            continue;
        }
        let mut text = format!(
            "{} of '{}' {} interpolated, in gaps of at most {longest_gap}",
            samples(filled),
            column.name,
            is_or_are(filled)
        );
        if missing > 0 {
            text.push_str(&format!(
                "; {} in longer gaps, or at the ends, {} missing",
                grouped(missing),
                if missing == 1 { "stays" } else { "stay" }
            ));
        }
        say(done, "fill", text);
    }
}

pub(super) fn low_pass(table: &mut Table, filter: LowPass, done: &mut Vec<Done>) -> Result<()> {
    table.step("a low-pass")?;
    let t = table.instants.clone().unwrap_or_default();
    let clock = Record::new([("t", t)])?.sample_clock("t")?;
    for column in &mut table.columns {
        column.samples = filter.filter(&column.samples, clock.step)?;
    }
    let text = format!(
        "{} went through a low-pass of {} Hz (Butterworth of order {}, forward and backward, so without delay)",
        quoted(table.columns.iter().map(|column| &*column.name)),
        short(filter.cutoff),
        filter.order
    );
    say(done, "low-pass", text);
    Ok(())
}

pub(super) fn remove_mean(table: &mut Table, columns: &Columns, done: &mut Vec<Done>) {
    for column in chosen(table, columns) {
        let Some(mean) = mean(&column.samples) else { continue };
        for value in &mut column.samples {
            *value -= mean;
        }
        let mean = with_unit(mean, column.unit.as_deref());
        say(
            done,
            "mean",
            format!("the mean of '{}', {mean}, is taken off", column.name),
        );
    }
}

pub(super) fn detrend(table: &mut Table, columns: &Columns, done: &mut Vec<Done>) -> Result<()> {
    let samples = |n: usize| (0..n).map(|i| i as f64).collect();
    let t = table.instants.clone().unwrap_or_else(|| samples(table.len()));
    let ends = [table.place(0), table.place(t.len() - 1)];
    for column in chosen(table, columns) {
        let trend = Trend::of(&t, &column.samples).with_context(|| format!("column '{}'", column.name))?;
        for (value, t) in column.samples.iter_mut().zip(&t) {
            *value -= trend.value(*t);
        }
        let [first, last] = [t[0], t[t.len() - 1]].map(|t| with_unit(trend.value(t), column.unit.as_deref()));
        let text = format!(
            "the straight line through '{}', {first} at {} to {last} at {}, is taken off",
            column.name, ends[0], ends[1]
        );
        say(done, "trend", text);
    }
    Ok(())
}
