//! The options of the best linear approximation.

use anyhow::{Result, bail};
use flexure::text::shown_path;
use flexure_io::RecordFile;
use flexure_workbench::systems::{Periodic, SystemColumns, period};

use crate::arguments::{self, Auto, Usage};

/// How the record repeats itself.
#[derive(clap::Args)]
pub struct PeriodOptions {
    /// The period of the input, in samples, for the best linear approximation. With auto, Flexure finds out whether the
    /// input repeats itself.
    #[arg(long, value_name = "auto|N", default_value = "auto", allow_hyphen_values = true, value_parser = arguments::auto_count)]
    period: Auto<usize>,
    /// The number of parts of equal length in the record. Each part is another realisation of a periodic input. Several
    /// realisations show what is noise and what is nonlinear distortion.
    #[arg(long, value_name = "N", default_value = "1", allow_hyphen_values = true, value_parser = arguments::count_from_one)]
    realisations: usize,
}

impl PeriodOptions {
    /// The first option that was given.
    pub fn first_given(&self) -> Option<&'static str> {
        match (self.period, self.realisations) {
            (Some(_), _) => Some("--period"),
            (None, 2..) => Some("--realisations"),
            _ => None,
        }
    }

    /// The approximation of a record; `None` if its input does not repeat itself and no option says that it does.
    ///
    /// # Errors
    /// Wrong usage where an option contradicts the record, and those of [`Periodic::new`].
    pub fn approximate(
        &self,
        file: &RecordFile,
        SystemColumns { inputs, output }: SystemColumns,
        sample_time: Option<f64>,
    ) -> Result<Option<Periodic>> {
        let &[input] = inputs else {
            let given = self.first_given().map(|option| {
                Usage(format!(
                    "{option} is for a single input; leave it out, or name one column by --input"
                ))
            });
            return given.map_or(Ok(None), |usage| Err(usage.into()));
        };
        // With missing outputs there is no spectrum.
        let samples = match (file.finite(input), file.finite(output)) {
            (Ok(samples), Ok(_)) => samples,
            (_, Err(error)) if self.first_given().is_some() => return Err(error.into()),
            _ => return Ok(None),
        };
        let Some(period) = self.period.or_else(|| period(samples, self.realisations)) else {
            return match self.realisations {
                1 => Ok(None),
                _ => bail!(
                    "{}: the input does not repeat itself within the first of --realisations; name its period by --period",
                    shown_path(&file.path)
                ),
            };
        };
        let part = samples.len() / self.realisations;
        if period < 2 || period > part {
            bail!(
                "{}: --period {period} must be at least 2 and fit into the {part} samples of a realisation",
                shown_path(&file.path)
            );
        }
        Periodic::new(file, input, output, sample_time, period, self.realisations).map(Some)
    }
}
