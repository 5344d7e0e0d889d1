//! `flexure regress`: the regression of one column on others, with a band and a page.

mod method;
mod stream;

use std::ops::ControlFlow;
use std::path::PathBuf;

use anyhow::Result;
use flexure::error::ParameterError;
use flexure::nonlinearity::{EstimatorName, Kernel, NamedEstimator, Outside, Rule, Tuning};
use flexure_io::{RecordFile, write_record_with_units};
use flexure_workbench::regression::{self, BandMethod, BandOptions, Columns, Regression, RegressionData, Report};

use crate::arguments::{self, Auto, Usage};
use crate::files::{name_json, prepare, write_text, wrote};
use crate::output::{print, print_result, this_command};
use crate::progress::{measured, spinning};
use crate::reading::Reading;

/// Estimate the regression of a column on one or several others, with a confidence band.
///
/// The tuning parameter of the estimator is chosen from the data unless it is given. The result has the columns of x
/// under their own names, then y (the estimate), lower and upper (the band). Where there is no band, lower and upper
/// are NaN. A record is a text file with columns (such as CSV), a Parquet, MAT or HDF5 file, or a topic of a ROS 2 bag.
/// In a text file without a header, the columns are called c0, c1, and so on.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  flexure regress record.csv --x u --y y -o curve.csv --report report.html")]
pub struct Arguments {
    /// The record.
    record: PathBuf,
    /// The columns on which --y is regressed, separated by commas.
    #[arg(long, value_name = "COLUMN[,COLUMN...]", required = true, value_delimiter = ',')]
    x: Vec<String>,
    /// The column to estimate.
    #[arg(long, value_name = "COLUMN")]
    y: String,
    /// The estimator. The default is local-linear. For one column of x, the bandwidth may vary along x if this predicts
    /// clearly better (local-bandwidth). It does not vary if --bandwidth, --select or another option asks for one
    /// bandwidth.
    #[arg(long, value_name = "NAME", value_parser = arguments::estimator())]
    estimator: Option<EstimatorName>,
    /// The bandwidth of an estimator with a kernel, in the unit of x: one for all columns of x, or one for each. With
    /// auto, it is chosen from the data.
    #[arg(long, value_name = "auto|H[,H...]", default_value = "auto", allow_hyphen_values = true, value_parser = arguments::auto_positives)]
    bandwidth: Auto<Vec<f64>>,
    /// The tuning parameter of an estimator without a kernel: its neighbours, terms, levels, degree, penalty or units.
    /// With auto, it is chosen from the data.
    #[arg(long, value_name = "auto|P", default_value = "auto", allow_hyphen_values = true, value_parser = arguments::auto_number)]
    parameter: Auto<f64>,
    /// The rule that chooses the tuning parameter. The default is loo (leave-one-out). Other rules are gcv (generalised
    /// cross-validation) and block (cross-validation over blocks, for rows in order of time whose errors depend on each
    /// other). For one column of x, a bandwidth can also be chosen by bootstrap, block-bootstrap (for rows in order of
    /// time) or, for local-linear only, plugin. If a rule is given, the default estimator is local-linear. For
    /// local-bandwidth, loo is Lepski's rule, and plugin is possible.
    #[arg(long, value_name = "RULE", value_parser = arguments::rule)]
    select: Option<Rule>,
    /// The number of rows in a block, for --select block-bootstrap and --band-method block. By default, it is chosen
    /// from the data.
    #[arg(long, value_name = "ROWS", value_parser = arguments::count_from_one)]
    block: Option<usize>,
    /// The kernel: uniform, triangular, epanechnikov, biweight, triweight or gaussian. The default is epanechnikov.
    #[arg(long, value_name = "NAME", value_parser = arguments::kernel)]
    kernel: Option<Kernel>,
    /// The column of the weights. In the estimate, a row of weight 2 counts as two rows, and a row of weight 0 does not
    /// count. In the scores that choose the tuning parameter and in the bands, every row counts once.
    #[arg(long, value_name = "COLUMN")]
    weights: Option<String>,
    /// Leave out rows that are far from the curve. Without this option, such rows are only reported.
    #[arg(long)]
    robust: bool,
    /// The level of the confidence band.
    #[arg(long, value_name = "LEVEL", default_value = "0.95", allow_hyphen_values = true, value_parser = arguments::level)]
    band: f64,
    /// The method by which the band is made.
    #[arg(long, default_value = "auto", value_parser = arguments::named::<BandMethod>())]
    band_method: BandMethod,
    /// Make a band that holds at all points of the curve at once. Without this option, it holds at each single point.
    #[arg(long)]
    simultaneous: bool,
    /// The seed of all random numbers: those of the bands and of the networks.
    #[arg(long, value_name = "N", default_value = "1")]
    seed: u64,
    /// The number of points of the curve along each column of x, evenly spaced over the range of the data. The default
    /// is 301 for one column, 41 for two, and fewer for more columns.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=100_000))]
    grid: Option<u32>,
    /// Estimate at the rows of this record instead of a grid. The record needs the same columns of x.
    #[arg(long, value_name = "FILE", conflicts_with = "grid")]
    at: Option<PathBuf>,
    /// The estimate beyond the range of the data.
    #[arg(long, default_value = "nan", value_parser = arguments::named::<Outside>())]
    outside: Outside,
    /// Write the curve to this file: .csv or .parquet.
    #[arg(short = 'o', long = "out", value_name = "CURVE.csv")]
    out: Option<PathBuf>,
    /// Read the record in parts, for a Parquet file that is larger than memory. The command keeps sums in bins instead
    /// of rows. It takes one column of x. The bandwidth and the band come from 20 folds of blocks of rows, so rows may
    /// depend on their neighbours.
    #[arg(
        long,
        conflicts_with_all = ["parameter", "select", "block", "weights", "robust", "band_method", "simultaneous", "seed", "at", "outside", "report"]
    )]
    stream: bool,
    /// Write a page with all results to this file.
    #[arg(long, value_name = "REPORT.html")]
    report: Option<PathBuf>,
    #[command(flatten)]
    reading: Reading,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
}

impl Arguments {
    fn columns(&self) -> Columns {
        Columns {
            x: self.x.clone(),
            y: self.y.clone(),
            weights: self.weights.clone(),
        }
    }

    fn band_options(&self) -> BandOptions {
        BandOptions {
            level: self.band,
            simultaneous: self.simultaneous,
            method: self.band_method,
            block: self.block,
        }
    }

    /// The points at which to evaluate, column by column.
    fn points(&self, data: &RegressionData) -> Result<Vec<Vec<f64>>> {
        let Some(path) = &self.at else {
            return Ok(data.grid(self.grid.map(|n| n as usize)));
        };
        let file = self.reading.read(path)?;
        let columns = self.x.iter().map(|name| Ok(file.finite(name)?.to_vec()));
        columns.collect()
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<()> {
    if arguments.stream {
        return stream::run(arguments);
    }
    let estimator = method::estimator(arguments)?;
    let inputs = [&arguments.record].into_iter().chain(&arguments.at);
    prepare(inputs, &arguments.out, &arguments.report)?;
    let file = (arguments.reading.read(&arguments.record)).map_err(|error| stream::with_stream(error, arguments))?;
    let weights;
    let mut data = RegressionData::read(&file, arguments.columns())?;
    if arguments.robust {
        let found = spinning("finding outliers", || regression::without_outliers(&estimator, &data));
        (weights, data.left_out) = found.map_err(|error| data.locate(error, &file))?;
        data.weights = Some(&weights);
    }
    let at = arguments.points(&data)?;
    let report = measured("estimating", |reported| -> Result<Report> {
        let regression = fitted(estimator, &data, &file)?;
        let report = Report::new(
            regression,
            &data,
            arguments.band_options(),
            at,
            arguments::option,
            &mut |done, all| {
                reported.at(done, all);
                ControlFlow::Continue(())
            },
        );
        Ok(report.map_err(|error| data.locate(error, &file))?)
    })?;

    // Everything is made before anything is written.
    let page = match &arguments.report {
        None => None,
        Some(path) => {
            let html = spinning("drawing", || {
                regression::html(&report, arguments.at.is_none(), Some(this_command()))
            })?;
            Some((path, html))
        }
    };
    if let Some(path) = &arguments.out {
        let of_y = [&arguments.y; 3].into_iter();
        let units = arguments
            .x
            .iter()
            .chain(of_y)
            .map(|name| file.unit(name).map(str::to_owned));
        let units: Vec<_> = units.collect();
        write_record_with_units(path, &report.evaluation.record(&data)?, &units)?;
    }
    if let Some((path, html)) = page {
        write_text(path, &html)?;
    }
    if arguments.json {
        let mut object = report.json();
        object["out"] = name_json(&arguments.out);
        object["report"] = name_json(&arguments.report);
        return print(&object.to_string());
    }
    let written = [&arguments.out, &arguments.report].into_iter().flatten();
    print_result(&report.summary(), wrote(written))
}

/// Fits the estimator; a given parameter that is invalid for any data is wrong usage.
fn fitted(estimator: NamedEstimator, data: &RegressionData, file: &RecordFile) -> Result<Regression> {
    let fixed = matches!(estimator.tuning, Tuning::Fixed(_));
    Regression::new(estimator, data).map_err(|error| match error {
        flexure::Error::Parameter(ParameterError::OutOfRange { .. }) if fixed => Usage(error.to_string()).into(),
        error => data.locate(error, file).into(),
    })
}
