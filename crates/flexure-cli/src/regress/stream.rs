//! `flexure regress --stream`: a record that is read in parts.

use anyhow::Result;
use flexure::nonlinearity::EstimatorName;
use flexure_io::{ParquetParts, write_record_with_units};
use flexure_workbench::regression::Streamed;

use super::Arguments;
use crate::arguments::Usage;
use crate::files::{name_json, prepare, wrote};
use crate::output::{print, print_result};
use crate::progress::measured;
use crate::streamed;

/// Points of the curve, unless --grid says otherwise.
const POINTS: usize = 301;

/// The fit that the options ask for.
fn asked(arguments: &Arguments) -> Result<Streamed, Usage> {
    let [x] = &arguments.x[..] else {
        return Err(Usage("--stream regresses on one column; name one by --x".to_owned()));
    };
    let estimator = arguments.estimator.unwrap_or(EstimatorName::LocalLinear);
    if !matches!(estimator, EstimatorName::Kernel | EstimatorName::LocalLinear) {
        return Err(Usage(format!(
            "--stream is for the estimators kernel and local-linear, not for {}",
            estimator.name()
        )));
    }
    let bandwidth = match &arguments.bandwidth {
        None => None,
        Some(given) => match given[..] {
            [bandwidth] => Some(bandwidth),
            _ => return Err(Usage("--bandwidth: --stream takes one bandwidth".to_owned())),
        },
    };
    let memory = streamed::memory(&arguments.record, &arguments.reading, &[], Streamed::LEAST_MEMORY)?;
    Ok(Streamed {
        x: x.clone(),
        y: arguments.y.clone(),
        estimator,
        kernel: arguments.kernel.unwrap_or_default(),
        bandwidth,
        level: arguments.band,
        memory,
        points: arguments.grid.map_or(POINTS, |points| points as usize),
    })
}

/// Extends the error of a record that is too large: it names the option that reads the record in parts.
pub fn with_stream(error: anyhow::Error, arguments: &Arguments) -> anyhow::Error {
    streamed::with_stream(error, &arguments.record, arguments.x.len() == 1)
}

/// Runs the command with --stream.
pub fn run(arguments: &Arguments) -> Result<()> {
    let asked = asked(arguments)?;
    prepare([&arguments.record], &arguments.out, &None)?;
    let parts = ParquetParts::open(&arguments.record, &[&asked.x, &asked.y])?;
    let report = measured("reading", |reported| {
        asked.regress(&parts, &|done, all| reported.at(done, all))
    })?;
    if let Some(path) = &arguments.out {
        let [of_x, of_y] = [0, 1].map(|i| parts.units()[i].clone());
        write_record_with_units(path, &report.record()?, &[of_x, of_y.clone(), of_y.clone(), of_y])?;
    }
    if arguments.json {
        let mut object = report.json();
        object["out"] = name_json(&arguments.out);
        return print(&object.to_string());
    }
    print_result(&report.summary(), wrote(&arguments.out))
}
