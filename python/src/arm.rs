//! Two-link arms: from a file or a preset to a record.

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;

use flexure::{Interrupt, Record};
use flexure_io::arm::{
    ArmError, ArmFile, DriveKind, PRESETS, Paths, preset_text, read_arm_record, run_driven, run_driven_batch,
    run_watched, with_changes,
};
use flexure_io::{ReadOptions, read_text};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{Column, columns};
use crate::errors::{FlexureError, of_any, of_library};
use crate::names::known;
use crate::run::interruptible;

/// Torques or deflections of both joints, one sample for each instant.
type Drive = (Column, Column);

/// An arm with its initial state, its run, its excitation and its noise, as in an arm file.
#[pyclass(frozen, module = "flexure._core")]
pub struct Arm(Arc<Source>);

struct Source {
    file: ArmFile,
    text: String,
    name: String,
    /// The folder of the records that the excitation names.
    folder: PathBuf,
    /// Which of them it may name.
    paths: Paths,
}

/// Which records an arm file may name.
fn paths(allow_paths: bool) -> Paths {
    match allow_paths {
        true => Paths::All,
        false => Paths::Below,
    }
}

impl Source {
    fn arm(text: String, name: String, folder: PathBuf, paths: Paths) -> PyResult<Arm> {
        let file = ArmFile::from_toml_str(&text, &name).map_err(|error| of_arm(&error))?;
        Ok(Arm(Arc::new(Source {
            file,
            text,
            name,
            folder,
            paths,
        })))
    }

    /// The file with a run as long as the samples of a drive.
    fn driven(&self, kind: DriveKind, samples: usize) -> ArmFile {
        let mut file = self.file.clone();
        file.excitation.drive = kind;
        file.run.duration = samples.saturating_sub(1) as f64 * file.run.sample_time;
        file
    }

    fn located(&self, error: ArmError) -> PyErr {
        of_arm(&error.located(&self.text, &self.name))
    }
}

/// The exception for an arm's error; if the library's error is the cause, the exception for that.
fn of_arm(error: &ArmError) -> PyErr {
    match error {
        ArmError::Simulation(cause) => of_library(cause),
        _ => FlexureError::new_err(error.to_string()),
    }
}

fn drive_kind(name: &str) -> PyResult<DriveKind> {
    known("drive", name, &["torque", "deflection"], |name| match name {
        "torque" => Some(DriveKind::Torque),
        "deflection" => Some(DriveKind::Deflection),
        _ => None,
    })
}

fn driven(file: &ArmFile, drive: &Drive, interrupt: &Interrupt) -> Result<Record, ArmError> {
    run_driven(file, [drive.0.samples(), drive.1.samples()], &mut |_| interrupt.flow())
}

#[pymethods]
impl Arm {
    /// The names of the presets.
    #[staticmethod]
    fn presets() -> Vec<&'static str> {
        PRESETS.map(|(name, _)| name).to_vec()
    }

    /// A preset.
    #[staticmethod]
    fn preset(name: &str) -> PyResult<Self> {
        let text = preset_text(name).map_err(|error| of_arm(&error))?;
        Source::arm(text.to_owned(), format!("preset {name}"), PathBuf::new(), Paths::Below)
    }

    /// The text of an arm file, its name in messages, the folder of the records that it names, and whether it may name others.
    #[staticmethod]
    #[pyo3(signature = (text, name="the arm", folder="", allow_paths=false))]
    fn from_text(text: String, name: &str, folder: &str, allow_paths: bool) -> PyResult<Self> {
        Source::arm(text, name.to_owned(), PathBuf::from(folder), paths(allow_paths))
    }

    /// Reads an arm file.
    #[staticmethod]
    #[pyo3(signature = (path, allow_paths=false))]
    fn read(path: PathBuf, allow_paths: bool) -> PyResult<Self> {
        let text = read_text(&path).map_err(|error| of_any(&error.into()))?;
        let folder = path.parent().map(PathBuf::from).unwrap_or_default();
        Source::arm(text, path.display().to_string(), folder, paths(allow_paths))
    }

    /// The arm with other values: an object of tables as JSON, merged into the arm file.
    fn changed(&self, changes: &str) -> PyResult<Self> {
        let source = &self.0;
        let text = with_changes(&source.text, changes).map_err(|error| of_arm(&error))?;
        Source::arm(text, source.name.clone(), source.folder.clone(), source.paths)
    }

    /// The text of the arm file, with its comments.
    #[getter]
    fn text(&self) -> &str {
        &self.0.text
    }

    /// What it is called in messages.
    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    /// The folder of the records that its excitation names.
    #[getter]
    fn folder(&self) -> String {
        self.0.folder.display().to_string()
    }

    /// Whether its excitation may name records elsewhere.
    #[getter]
    fn allow_paths(&self) -> bool {
        self.0.paths == Paths::All
    }

    /// The run's sample time, s.
    #[getter]
    fn sample_time(&self) -> f64 {
        self.0.file.run.sample_time
    }

    /// The run's duration, s.
    #[getter]
    fn duration(&self) -> f64 {
        self.0.file.run.duration
    }

    /// Simulates the file's run, or under torques or deflections of both joints in place of its excitation.
    #[pyo3(signature = (drive=None, kind="torque"))]
    fn simulate<'py>(&self, py: Python<'py>, drive: Option<Drive>, kind: &str) -> PyResult<Bound<'py, PyDict>> {
        let (source, kind) = (Arc::clone(&self.0), drive_kind(kind)?);
        let record = interruptible(py, move |interrupt| match drive {
            Some(drive) => driven(&source.driven(kind, drive.0.len()), &drive, interrupt),
            None => {
                // Records are looked for in the folder that the caller names, or in that of the file.
                let load = |name: &str| read_arm_record(&source.folder, name, source.paths, &ReadOptions::default());
                let mut watch = |_| -> ControlFlow<()> { interrupt.flow() };
                run_watched(&source.file, load, &mut watch)
            }
        })?;
        columns(py, &record.map_err(|error| self.0.located(error))?)
    }

    /// Simulates under many drives, over all cores; noise, if any, has a different seed for each drive, by its index among all drives; the
    /// first one here has the index `first`.
    #[pyo3(signature = (drives, kind="torque", first=0))]
    fn simulate_batch<'py>(
        &self,
        py: Python<'py>,
        drives: Vec<Drive>,
        kind: &str,
        first: u64,
    ) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let (source, kind) = (Arc::clone(&self.0), drive_kind(kind)?);
        let records = interruptible(py, move |interrupt| {
            let file = |place: u64, drive: &Drive| {
                let mut file = source.driven(kind, drive.0.len());
                if let Some(noise) = &mut file.noise {
                    noise.seed = noise.seed.wrapping_add(place);
                }
                file
            };
            let runs: Vec<(ArmFile, [&[f64]; 2])> = (first..)
                .zip(&drives)
                .map(|(place, drive)| (file(place, drive), [drive.0.samples(), drive.1.samples()]))
                .collect();
            run_driven_batch(&runs, &|_| interrupt.flow())
        })?;
        let each = records
            .into_iter()
            .map(|record| columns(py, &record.map_err(|error| self.0.located(error))?));
        each.collect()
    }
}
