//! The command line of Flexure: `flexure --help`.

use std::process::ExitCode;

fn main() -> ExitCode {
    flexure_cli::run(std::env::args_os())
}
