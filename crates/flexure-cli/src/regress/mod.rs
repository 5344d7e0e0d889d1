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
/// The tuning parameter is chosen from the data unless it is given. The result has the columns of x by their names, then y
/// (the estimate), lower and upper (the band; NaN where there is none). A record is text in columns (named c0, c1, ... without a
/// header), Parquet, MAT, HDF5, or a topic of a ROS 2 bag.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  flexure regress record.csv --x u --y y -o curve.csv --report report.html")]
pub struct Arguments {
    /// The record.
    record: PathBuf,
    /// The columns to regress on, separated by commas.
    #[arg(long, value_name = "COLUMN[,COLUMN...]", required = true, value_delimiter = ',')]
    x: Vec<String>,
    /// The column to estimate.
    #[arg(long, value_name = "COLUMN")]
    y: String,
    /// Estimator, by default local-linear. With one column its bandwidth may vary along x if that predicts clearly better
    /// (local-bandwidth), unless --bandwidth, --select or another option asks for one bandwidth.
    #[arg(long, value_name = "NAME", value_parser = arguments::estimator())]
    estimator: Option<EstimatorName>,
    /// Bandwidth of an estimator with a kernel, in the unit of x: one, or one per column.
    #[arg(long, value_name = "auto|H[,H...]", default_value = "auto", allow_hyphen_values = true, value_parser = arguments::auto_positives)]
    bandwidth: Auto<Vec<f64>>,
    /// Tuning parameter of the other estimators: neighbours, terms, levels, degree, penalty or units.
    #[arg(long, value_name = "auto|P", default_value = "auto", allow_hyphen_values = true, value_parser = arguments::auto_number)]
    parameter: Auto<f64>,
    /// How the tuning parameter is chosen: loo (leave-one-out, the default), gcv (generalised cross-validation) or block
    /// (cross-validation over blocks, for rows in order of time whose errors depend on each other). One bandwidth can also be chosen by
    /// bootstrap, block-bootstrap (rows in order of time) or, for local lines, plugin. A rule makes local-linear the default estimator.
    /// For local-bandwidth, loo is Lepski's rule, and plugin is possible.
    #[arg(long, value_name = "RULE", value_parser = arguments::rule)]
    select: Option<Rule>,
    /// Rows in a block, for --select block-bootstrap and for --band-method block; from the data by default.
    #[arg(long, value_name = "ROWS", value_parser = arguments::count_from_one)]
    block: Option<usize>,
    /// Kernel: uniform, triangular, epanechnikov, biweight, triweight or gaussian.
    #[arg(long, value_name = "NAME", value_parser = arguments::kernel)]
    kernel: Option<Kernel>,
    /// Column of weights: in the estimate a row of weight 2 counts as two rows, one of weight 0 as none; scores and bands
    /// count every row once.
    #[arg(long, value_name = "COLUMN")]
    weights: Option<String>,
    /// Leave out rows that are far from the curve; else they are only named.
    #[arg(long)]
    robust: bool,
    /// Level of the confidence band.
    #[arg(long, value_name = "LEVEL", default_value = "0.95", allow_hyphen_values = true, value_parser = arguments::level)]
    band: f64,
    /// How the band is made.
    #[arg(long, default_value = "auto", value_parser = arguments::named::<BandMethod>())]
    band_method: BandMethod,
    /// A band that holds at all points of the curve at once.
    #[arg(long)]
    simultaneous: bool,
    /// Seed of all random numbers: bands and networks.
    #[arg(long, value_name = "N", default_value = "1")]
    seed: u64,
    /// Points of the curve along each column of x, evenly over the data's range; by default 301 for one column, fewer for
    /// several.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=100_000))]
    grid: Option<u32>,
    /// Evaluate at the rows of this record instead, which has the same columns of x.
    #[arg(long, value_name = "FILE", conflicts_with = "grid")]
    at: Option<PathBuf>,
    /// The estimate beyond the data's range.
    #[arg(long, default_value = "nan", value_parser = arguments::named::<Outside>())]
    outside: Outside,
    /// Write the curve here: .csv or .parquet.
    #[arg(short = 'o', long = "out", value_name = "CURVE.csv")]
    out: Option<PathBuf>,
    /// Read the record in parts and keep sums in bins, not rows: for a Parquet file that is larger than memory. The bandwidth and the band
    /// come from 20 folds of blocks of rows, so that rows may depend on their neighbours.
    #[arg(
        long,
        conflicts_with_all = ["parameter", "select", "block", "weights", "robust", "band_method", "simultaneous", "seed", "at", "outside", "report"]
    )]
    stream: bool,
    /// Write a page that shows everything here.
    #[arg(long, value_name = "REPORT.html")]
    report: Option<PathBuf>,
    #[command(flatten)]
    reading: Reading,
    /// Print one JSON object.
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
