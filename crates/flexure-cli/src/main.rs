//! The command line of Flexure: `flexure --help`.
//!
//! Exit codes: 0 done, 1 the data or the fit failed, 2 wrong usage.

mod app;
mod applied;
mod arguments;
mod columns;
mod compare;
mod control;
mod demo;
mod excite;
mod experiments;
mod export;
mod files;
mod fleet;
mod help;
mod identify;
mod joint;
mod look;
mod method;
mod output;
mod periods;
mod predict;
mod prepare;
mod progress;
mod python;
mod reading;
mod regress;
mod report;
mod robot;
#[cfg(unix)]
mod signals;
mod simulate;
mod source;
mod steps;
mod streamed;
mod study;
mod tuning;
mod validate;

use std::process::ExitCode;

use anyhow::Result;
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use flexure_io::together;

#[derive(Parser)]
#[command(
    name = "flexure",
    version,
    arg_required_else_help = true,
    after_help = "Completions for a shell: flexure completions --help. Manual pages: flexure man --help."
)]
/// Find the friction, dead zone or saturation inside a system from a log of its input and output. Simulate arms with
/// flexible joints.
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    // In the order in which a user needs them.
    Demo(demo::Arguments),
    Look(look::Arguments),
    Prepare(Box<prepare::Arguments>),
    Identify(Box<identify::Arguments>),
    Validate(validate::Arguments),
    Predict(predict::Arguments),
    Export(export::Arguments),
    Compare(compare::Arguments),
    Report(report::Arguments),
    Joint(Box<joint::Arguments>),
    Regress(Box<regress::Arguments>),
    Fleet(Box<fleet::Arguments>),
    Excite(Box<excite::Arguments>),
    Simulate(simulate::Arguments),
    Control(control::Arguments),
    Study(study::Arguments),
    App(app::Arguments),
    #[command(hide = true)]
    Completions(help::CompletionArguments),
    #[command(hide = true)]
    Man(help::ManualArguments),
}

/// The most threads, even if `RAYON_NUM_THREADS` asks for more.
const MOST_THREADS: usize = 1024;

/// Makes the threads of all computations; where the system allows none, the main thread computes alone.
fn threads() {
    let asked = std::env::var("RAYON_NUM_THREADS")
        .ok()
        .and_then(|count| count.parse().ok());
    // 0 means one thread per core.
    let count: usize = asked.unwrap_or(0);
    let pool = || rayon::ThreadPoolBuilder::new().num_threads(count.min(MOST_THREADS));
    // rayon tries to make the global pool only once, so another pool shows first whether threads can be made.
    let made = match pool().build() {
        Ok(_) => pool().build_global(),
        Err(_) => pool().num_threads(1).use_current_thread().build_global(),
    };
    debug_assert!(made.is_ok(), "{made:?}");
}

/// The commands and their options, in groups.
fn definition() -> clap::Command {
    help::grouped(Cli::command())
}

/// Prints the help, the version or the error in the arguments.
fn said(error: &clap::Error) -> ExitCode {
    match error.print() {
        Err(cause) if cause.kind() != std::io::ErrorKind::BrokenPipe => ExitCode::FAILURE,
        _ => ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2)),
    }
}

fn main() -> ExitCode {
    #[cfg(unix)]
    signals::watch();
    // Where the arguments cannot be read, the process ends here with 2; after `--help`, with 0.
    let given = definition()
        .try_get_matches()
        .and_then(|matches| Cli::from_arg_matches(&matches));
    let given = match given {
        Ok(given) => given,
        Err(error) => return said(&error),
    };
    threads();
    // These commands read their own output files again, or go on from them.
    let one_by_one = matches!(
        given.command,
        Command::App(_) | Command::Demo(_) | Command::Fleet(_) | Command::Study(_)
    );
    let result = match one_by_one {
        true => run(given.command),
        false => together(|| run(given.command)),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            output::print_error(&error);
            match arguments::is_usage(&error) {
                true => ExitCode::from(2),
                false => ExitCode::FAILURE,
            }
        }
    }
}

/// Runs a command.
fn run(command: Command) -> Result<()> {
    match command {
        Command::App(arguments) => app::run(&arguments),
        Command::Demo(arguments) => demo::run(&arguments),
        Command::Excite(arguments) => excite::run(&arguments),
        Command::Simulate(arguments) => simulate::run(&arguments),
        Command::Control(arguments) => control::run(&arguments),
        Command::Study(arguments) => study::run(&arguments),
        Command::Identify(arguments) => identify::run(&arguments),
        Command::Compare(arguments) => compare::run(&arguments),
        Command::Export(arguments) => export::run(&arguments),
        Command::Fleet(arguments) => fleet::run(&arguments),
        Command::Joint(arguments) => joint::run(&arguments),
        Command::Look(arguments) => look::run(&arguments),
        Command::Predict(arguments) => predict::run(&arguments),
        Command::Prepare(arguments) => prepare::run(&arguments),
        Command::Regress(arguments) => regress::run(&arguments),
        Command::Report(arguments) => report::run(&arguments),
        Command::Validate(arguments) => validate::run(&arguments),
        Command::Completions(arguments) => help::completions(&arguments, definition()),
        Command::Man(arguments) => help::manual(&arguments, definition()),
    }
}
