//! From an arm file to a record.

use std::ops::ControlFlow;

use flexure::Record;
use flexure::manipulator::{
    Arm, ArmRun, Drive, SimulationOptions, add_noise, record_columns, simulate_batch, simulate_watched,
};
use flexure::simulation::{Sampling, batch};

use super::error::ArmError;
use super::excitation::{DriveKind, Kind};
use super::file::ArmFile;
use crate::memory::check_computed;
use crate::record_file::RecordFile;

/// Simulates an arm file; `load` reads the record that an excitation of kind `record` names.
///
/// # Errors
/// [`ArmError::Record`] if that record cannot be loaded or does not fit, [`ArmError::Memory`], [`ArmError::Simulation`].
pub fn run<L, E>(file: &ArmFile, load: L) -> Result<Record, ArmError>
where
    L: FnOnce(&str) -> Result<RecordFile, E>,
    E: std::fmt::Display,
{
    run_watched(file, load, &mut |_| ControlFlow::Continue(()))
}

/// Like [`run`], calling `watch` with the simulated time in s now and then; `Break` stops it.
///
/// # Errors
/// Those of [`run`], and [`flexure::Error::Stopped`].
pub fn run_watched<L, E>(
    file: &ArmFile,
    load: L,
    watch: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<Record, ArmError>
where
    L: FnOnce(&str) -> Result<RecordFile, E>,
    E: std::fmt::Display,
{
    let options = file.options()?;
    check_memory(file, &options.sampling)?;
    let excited = file.excitation.excited(file.locked());
    let inputs = match (&file.excitation.kind, &file.excitation.file) {
        (Kind::Record, Some(name)) => {
            let misfit = |reason: String| ArmError::Record {
                record: name.clone(),
                reason,
            };
            let record = load(name).map_err(|e| misfit(e.to_string()))?;
            let columns = recorded(&record, file.excitation.drive, excited, &options.sampling);
            let columns = columns.map_err(|reason| match record.is_foreign {
                true => "its columns do not fit".to_owned(),
                false => reason,
            });
            columns.map_err(misfit)?
        }
        _ => {
            let samples = |joint: usize| match excited[joint] {
                true => file.excitation.samples(joint, &options.sampling),
                false => Ok(flexure::signal::zero(options.sampling.rows())),
            };
            [samples(0)?, samples(1)?]
        }
    };
    run_driven(file, [&inputs[0], &inputs[1]], watch)
}

/// Simulates an arm file under other inputs than its own excitation: torques or deflections, as the excitation says, one sample for each
/// joint at each instant of the run.
///
/// # Errors
/// [`ArmError::Simulation`], also for samples that do not fit the instants, and [`ArmError::Memory`].
pub fn run_driven(
    file: &ArmFile,
    columns: [&[f64]; 2],
    watch: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<Record, ArmError> {
    let (arm, options) = ready(file)?;
    let record = simulate_watched(&arm, &drive(file, columns), &options, watch)?;
    noisy(file, record)
}

/// [`run_driven`] of many arm files, each with its inputs, over all cores: each with the same result, to the last bit, in their order.
/// `watch` is called for all of them.
pub fn run_driven_batch(
    runs: &[(ArmFile, [&[f64]; 2])],
    watch: &(dyn Fn(f64) -> ControlFlow<()> + Sync),
) -> Vec<Result<Record, ArmError>> {
    let ready: Vec<_> = runs.iter().map(|(file, _)| ready(file)).collect();
    let sound = ready.iter().zip(runs).filter_map(|(ready, (file, columns))| {
        let (arm, options) = ready.as_ref().ok()?;
        Some(ArmRun {
            arm,
            drive: drive(file, *columns),
            options: *options,
        })
    });
    let mut simulated = simulate_batch(&sound.collect::<Vec<_>>(), watch).into_iter();
    let records = ready.into_iter().filter_map(|ready| match ready {
        Ok(_) => simulated.next().map(|record| Ok(record?)),
        Err(error) => Some(Err(error)),
    });
    let jobs: Vec<(&ArmFile, Result<Record, ArmError>)> = runs.iter().map(|(file, _)| file).zip(records).collect();
    if jobs.iter().all(|(file, _)| file.noise.is_none()) {
        return jobs.into_iter().map(|(_, record)| record).collect();
    }
    batch(&jobs, |(file, record)| noisy(file, record.clone()?))
}

/// The arm of a file, and how to simulate it.
fn ready(file: &ArmFile) -> Result<(Arm, SimulationOptions), ArmError> {
    let arm = Arm::new(file.arm)?;
    let options = file.options()?;
    check_memory(file, &options.sampling)?;
    Ok((arm, options))
}

fn drive<'a>(file: &ArmFile, columns: [&'a [f64]; 2]) -> Drive<'a> {
    match file.excitation.drive {
        DriveKind::Torque => Drive::Held(columns),
        DriveKind::Deflection => Drive::Deflection(columns),
    }
}

/// The record with the noise of the file.
fn noisy(file: &ArmFile, record: Record) -> Result<Record, ArmError> {
    match &file.noise {
        None => Ok(record),
        Some(noise) => {
            let std: Vec<(&str, f64)> = noise.std.iter().map(|(name, s)| (name.as_str(), *s)).collect();
            Ok(add_noise(&record, noise.seed, &std)?)
        }
    }
}

fn check_memory(file: &ArmFile, sampling: &Sampling) -> Result<(), ArmError> {
    Ok(check_computed(sampling.rows(), record_columns(file.arm.model).len())?)
}

/// The excitation in a record: a column for each joint that is excited, one row per sample.
fn recorded(
    file: &RecordFile,
    drive: DriveKind,
    excited: [bool; 2],
    sampling: &Sampling,
) -> Result<[Vec<f64>; 2], String> {
    let rows = sampling.rows();
    let names = match drive {
        DriveKind::Torque => ["tau1", "tau2"],
        DriveKind::Deflection => ["d1", "d2"],
    };
    if let Some(time) = file.time(None, &names).map_err(|e| e.to_string())? {
        let step = time.clock.step;
        if (step - sampling.sample_time()).abs() > 1e-3 * sampling.sample_time() {
            return Err(format!(
                "its sample time is {step} s, but the run's is {} s; they must agree",
                sampling.sample_time()
            ));
        }
    }
    let column = |joint: usize| match excited[joint] {
        true => file.finite(names[joint]).map(Some).map_err(|e| e.to_string()),
        false => Ok(None),
    };
    let columns = [column(0)?, column(1)?];
    if file.record.len() < rows {
        return Err(format!(
            "it has {} rows, but the run has {rows} instants; shorten the duration",
            file.record.len()
        ));
    }
    Ok(columns.map(|samples| samples.map_or_else(|| flexure::signal::zero(rows), |samples| samples[..rows].to_vec())))
}
