//! `flexure study`: experiments on the algorithms themselves.

use std::path::PathBuf;

use anyhow::{Context as _, Result};
use clap::ValueEnum;
use flexure::study::{FEWEST_RUNS, LONGEST, MOST_RUNS, RefinedStudy, SHORTEST};
use flexure::text::shown_path;
use flexure_io::read_text;
use flexure_workbench::Named as _;
use flexure_workbench::study::{Part, Parts, Plan};
use serde_json::json;

use crate::arguments::{self, Usage};
use crate::files::{prepare, write_text, wrote};
use crate::output::{print, print_note, this_command};
use crate::progress::Progress;

/// Measure how fast the estimators converge, and compare with theory.
///
/// The command simulates every setting many times, at several numbers of samples n. It compares the slope of log error
/// over log n with the exponent from theory. The theory is Theorem 1 (static data), Theorem 2 (Hammerstein data), or
/// the estimator's own theory. By default, the study takes less than a minute. With --full, it goes up to a million
/// samples. With --resume, it can be stopped and continued.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  flexure study rates --report rates.html\n  flexure study rates --full --resume rates-state.json --report rates.html"
)]
pub struct Arguments {
    /// The experiment.
    #[arg(value_enum)]
    what: What,
    /// The parts of the experiment, separated by commas: plain (Theorems 1 and 2), refined, estimators (every static
    /// estimator but the network), networks.
    #[arg(
        long,
        value_name = "PART[,PART...]",
        value_parser = arguments::named::<Part>(),
        value_delimiter = ',',
        default_value = "plain,refined"
    )]
    parts: Vec<Part>,
    /// Use more samples and more runs. This takes about half an hour.
    #[arg(long)]
    full: bool,
    /// The numbers of samples: at least two, in increasing order. By default, each part has its own.
    #[arg(long, value_name = "N,N[,N...]", value_delimiter = ',', value_parser = arguments::whole::<SHORTEST, LONGEST>)]
    lengths: Vec<usize>,
    /// The number of Monte Carlo runs for each setting and each number of samples: at least 20. By default, each part
    /// has its own.
    #[arg(long, value_name = "N", value_parser = arguments::whole::<FEWEST_RUNS, MOST_RUNS>)]
    runs: Option<usize>,
    /// The seed of all random numbers.
    #[arg(long, value_name = "N", default_value = "1")]
    seed: u64,
    /// Keep the measurements in this file. If the file exists, the study goes on from it.
    #[arg(long, value_name = "STATE.json")]
    resume: Option<PathBuf>,
    /// Write a page with the plots to this file.
    #[arg(long, value_name = "REPORT.html")]
    report: Option<PathBuf>,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum What {
    /// Convergence rates.
    Rates,
}

impl Arguments {
    /// Refuses a single number of samples, numbers that do not increase, and one that a part cannot fit.
    fn check_lengths(&self) -> Result<(), Usage> {
        let falling = self.lengths.windows(2).find(|pair| pair[1] <= pair[0]);
        match (falling, &self.lengths[..]) {
            (Some(pair), _) => Err(Usage(format!(
                "--lengths: the numbers of samples must increase, but {} follows {}",
                pair[1], pair[0]
            ))),
            (None, [only]) => Err(Usage(format!(
                "--lengths {only}: a rate needs at least two numbers of samples, such as {only},{}",
                2 * only
            ))),
            (None, [shortest, ..]) if *shortest < RefinedStudy::SHORTEST && self.parts.contains(&Part::Refined) => {
                Err(Usage(format!(
                    "--lengths {shortest}: the part 'refined' needs at least {} samples; give larger numbers, or --parts without it",
                    RefinedStudy::SHORTEST
                )))
            }
            _ => Ok(()),
        }
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<()> {
    let What::Rates = arguments.what;
    arguments.check_lengths()?;
    let parts: Vec<&str> = arguments.parts.iter().map(|part| part.name()).collect();
    arguments::named_once("parts", &parts)?;
    prepare([], [], arguments.report.iter().chain(&arguments.resume))?;
    let plan = Plan {
        parts: arguments.parts.clone(),
        full: arguments.full,
        lengths: arguments.lengths.clone(),
        runs: arguments.runs,
        seed: arguments.seed,
    };
    let mut parts = Parts::new(&plan);
    if let Some(path) = &arguments.resume
        && path.exists()
    {
        let text = read_text(path)?;
        parts = parts.resumed(&text).with_context(|| shown_path(path))?;
        print_note(&format!(
            "going on from {}: {:.0} % done",
            shown_path(path),
            100.0 * parts.done()
        ));
    }
    let progress = Progress::new("measuring", 1.0);
    while parts.step(&|share| progress.at(share))? {
        if let Some(path) = &arguments.resume {
            write_text(path, &serde_json::to_string(&parts)?)?;
        }
    }
    drop(progress);
    let outcome = parts.outcome();
    if let Some(path) = &arguments.report {
        write_text(path, &outcome.html(this_command())?)?;
    }
    if arguments.json {
        return print(&json!(outcome).to_string());
    }
    let mut lines = outcome.lines();
    lines.extend(wrote(&arguments.report));
    print(&lines.join("\n"))
}
