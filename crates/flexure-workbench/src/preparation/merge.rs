//! Several records as one, at common instants.

use std::collections::HashSet;
use std::path::Path;

use anyhow::{Result, bail};
use flexure::preparation::Grid;

use super::table::Table;
use super::{Done, Preparation, steps};
use crate::text::{decimal, grouped};

/// Two instants that differ by less than this, in steps, are the same: rounding of printed digits.
const SAME_INSTANT: f64 = 1e-3;

/// If an earlier table has a column of the same name, puts the file's name in front: `motor.u` of `motor.csv`.
pub(super) fn rename(tables: &mut [Table], done: &mut Vec<Done>) {
    let mut taken: HashSet<String> = HashSet::new();
    for table in tables {
        let stem = Path::new(&table.name)
            .file_stem()
            .map(|stem| stem.to_string_lossy().into_owned());
        let stem = stem.unwrap_or_default();
        for column in &mut table.columns {
            if taken.contains(&column.name) {
                let mut name = format!("{stem}.{}", column.name);
                while taken.contains(&name) {
                    name.push('\'');
                }
                let text = format!(
                    "'{}' of {} is called '{name}', as another file has a column of this name",
                    column.name, table.name
                );
                done.push(Done { step: "rename", text });
                column.name = name;
            }
            taken.insert(column.name.clone());
        }
    }
}

/// One table of several.
///
/// Tables with the same instants are put side by side. Otherwise all are resampled: at the first one's instants that all of them cover, or
/// at a given step.
pub(super) fn merge(mut tables: Vec<Table>, preparation: &Preparation, done: &mut Vec<Done>) -> Result<Table> {
    let Some(first) = tables.first() else {
        bail!("there is no file")
    };
    let (name, length) = (first.name.clone(), first.len());
    if tables.iter().all(|table| table.instants.is_none()) {
        if let Some(other) = tables.iter().find(|table| table.len() != length) {
            bail!(
                "{name} has {} samples and {} has {}, and none has a time column; give the files such columns, or equal lengths",
                grouped(length),
                other.name,
                grouped(other.len())
            );
        }
        return Ok(side_by_side(tables, done, "which have no time column"));
    }
    common_clock(&mut tables)?;
    let step = tables[0].step("a merge")?;
    let same = |table: &Table| {
        let (a, b) = (tables[0].instants.as_deref(), table.instants.as_deref());
        let (a, b) = (a.unwrap_or_default(), b.unwrap_or_default());
        a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= SAME_INSTANT * step)
    };
    if tables.iter().all(same) {
        return Ok(side_by_side(tables, done, "which have the same instants"));
    }
    let grid = common_grid(&tables, preparation.resample.unwrap_or(step))?;
    for table in &mut tables {
        let old = table.step("a merge")?;
        let from = done.len();
        steps::resample(table, grid, old, preparation, done)?;
        for done in &mut done[from..] {
            done.text = format!("{}: {}", table.name, done.text);
        }
    }
    Ok(side_by_side(tables, done, "at common instants"))
}

/// Refuses a table without instants if others have them. Shifts the other tables to the clock of the first.
fn common_clock(tables: &mut [Table]) -> Result<()> {
    if let Some(without) = tables.iter().find(|table| table.instants.is_none()) {
        bail!(
            "{} has no time column, and another file has; name its column, or merge files without",
            without.name
        );
    }
    let (first, origin) = (tables[0].name.clone(), tables[0].origin);
    for table in &mut tables[1..] {
        match (origin, table.origin) {
            (None, None) => {}
            (Some(origin), Some(own)) => {
                let later = (own - origin) as f64 / 1e9;
                table.instants.iter_mut().flatten().for_each(|t| *t += later);
            }
            _ => bail!(
                "{first} and {} have no common clock: the time of one is a time stamp, that of the other a number",
                table.name
            ),
        }
    }
    Ok(())
}

/// The instants that all tables cover, beginning at one of the first table's.
fn common_grid(tables: &[Table], step: f64) -> Result<Grid> {
    let ends = |table: &Table| match table.instants.as_deref() {
        Some([first, .., last]) => [*first, *last],
        _ => [f64::NAN; 2],
    };
    let [from, to] = tables
        .iter()
        .map(ends)
        .fold([f64::NEG_INFINITY, f64::INFINITY], |[from, to], [first, last]| {
            [from.max(first), to.min(last)]
        });
    let first = tables[0].instants.as_deref().unwrap_or_default();
    match first.iter().find(|&&t| t >= from - SAME_INSTANT * step) {
        Some(&start) if start <= to => Ok(Grid::over([start, to], step)?),
        _ => {
            let span = |table: &Table| {
                let [first, last] = ends(table);
                format!("{} goes from {} s to {} s", table.name, decimal(first), decimal(last))
            };
            bail!(
                "the files have no time in common: {}",
                tables.iter().map(span).collect::<Vec<_>>().join(", ")
            )
        }
    }
}

fn side_by_side(mut tables: Vec<Table>, done: &mut Vec<Done>, how: &str) -> Table {
    let counts: Vec<String> = tables
        .iter()
        .map(|t| format!("{} of {}", t.columns.len(), t.name))
        .collect();
    let others = tables.split_off(1);
    let mut merged = tables.remove(0);
    merged
        .columns
        .extend(others.into_iter().flat_map(|table| table.columns));
    let text = format!(
        "the columns are side by side, {}, {how}: {} samples",
        counts.join(", "),
        grouped(merged.len())
    );
    done.push(Done { step: "merge", text });
    merged
}
