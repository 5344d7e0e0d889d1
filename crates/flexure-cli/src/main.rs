//! The command line of Flexure: `flexure --help`.
//!
//! Exit codes: 0 done, 1 the data or the fit failed, 2 wrong usage.

mod arguments;
mod demo;
mod excite;
mod experiments;
mod files;
mod identify;
mod joint;
mod method;
mod output;
mod periods;
mod predict;
mod progress;
mod regress;
mod simulate;
mod study;
mod tuning;
mod validate;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

#[derive(Parser)]
#[command(name = "flexure", version, arg_required_else_help = true)]
/// Simulate flexible-joint space manipulators, and identify the nonlinear blocks inside systems from
/// their input-output records.
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Demo(demo::Arguments),
    Excite(Box<excite::Arguments>),
    Simulate(simulate::Arguments),
    Study(study::Arguments),
    Identify(Box<identify::Arguments>),
    Joint(Box<joint::Arguments>),
    Predict(predict::Arguments),
    Regress(Box<regress::Arguments>),
    Validate(validate::Arguments),
}

fn main() -> ExitCode {
    // Where the arguments cannot be read, the process ends here with 2; after `--help`, with 0.
    let result = match Cli::parse().command {
        Command::Demo(arguments) => demo::run(&arguments),
        Command::Excite(arguments) => excite::run(&arguments),
        Command::Simulate(arguments) => simulate::run(&arguments),
        Command::Study(arguments) => study::run(&arguments),
        Command::Identify(arguments) => identify::run(&arguments),
        Command::Joint(arguments) => joint::run(&arguments),
        Command::Predict(arguments) => predict::run(&arguments),
        Command::Regress(arguments) => regress::run(&arguments),
        Command::Validate(arguments) => validate::run(&arguments),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            output::print_error(&error);
            match error.is::<arguments::Usage>() {
                true => ExitCode::from(2),
                false => ExitCode::FAILURE,
            }
        }
    }
}
