//! The help texts' groups of options, completions for shells, and manual pages: all from the definition of the options.

use std::path::PathBuf;

use anyhow::{Context as _, Result};
use clap::{Arg, Command};
use clap_complete::Shell;
use flexure::text::shown_path;
use flexure_io::make_folder;

use crate::arguments::Usage;
use crate::files::wrote;
use crate::output::print;
use crate::reading::HEADING;

/// The groups of options by their long names, which mean the same in all commands. Options of one structure or method, and those for
/// reading a record, have their own headings, next to their definitions.
const GROUPS: [(&str, &[&str]); 8] = [
    (
        "Columns and time",
        &[
            "input",
            "output",
            "x",
            "y",
            "weights",
            "torque",
            "position",
            "motor",
            "link",
            "velocity",
            "reference",
            "axis",
            "sample-time",
            "by",
        ],
    ),
    (
        "Model",
        &[
            "structure",
            "method",
            "order",
            "delay",
            "branches",
            "unit",
            "known",
            "estimator",
            "kernel",
            "robust",
            "missing",
            "period",
            "realisations",
        ],
    ),
    (
        "Joint",
        &[
            "torque-constant",
            "gear-ratio",
            "prismatic",
            "gravity",
            "spring",
            "motor-inertia",
            "kp",
            "kv",
            "arm-joint",
            "template",
        ],
    ),
    (
        "Experiment",
        &[
            "kind",
            "max-torque",
            "max-position",
            "max-velocity",
            "duration",
            "f-min",
            "f-max",
            "hold",
            "levels",
            "encoder-noise",
            "torque-noise",
            "parts",
            "full",
            "lengths",
            "runs",
            "seeds",
        ],
    ),
    (
        "Tuning",
        &[
            "fresh",
            "bandwidth",
            "parameter",
            "select",
            "block",
            "band",
            "band-method",
            "simultaneous",
            "seed",
        ],
    ),
    ("Limits", &["memory", "stream"]),
    (
        "Evaluation",
        &["grid", "at", "outside", "validate", "skip", "initial-state", "horizon"],
    ),
    (
        "Output",
        &[
            "model",
            "to",
            "out",
            "name",
            "fmi",
            "compile",
            "report",
            "arm",
            "friction",
            "motor-friction",
            "stiffness",
            "resume",
            "json",
            "joint-views",
            "no-open",
            "port",
            "largest-file",
            "write-arm",
            "allow-paths",
            "table",
            "of",
            "write-scenario",
            "dry-run",
        ],
    ),
];

/// The group of an option.
fn group(option: &Arg) -> Option<&'static str> {
    let name = option.get_long()?;
    let holds = |(_, names): &&(&str, &[&str])| names.contains(&name);
    GROUPS.iter().find(holds).map(|(group, _)| *group)
}

/// The command with its subcommands' options in groups, each group at the place of its first option.
pub fn grouped(command: Command) -> Command {
    command.mut_subcommands(|subcommand| {
        subcommand.mut_args(|option| match (option.get_help_heading(), group(&option)) {
            (None | Some(HEADING), Some(group)) => option.help_heading(group),
            _ => option,
        })
    })
}

/// Print the completions for a shell.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  \
    flexure completions bash > ~/.local/share/bash-completion/completions/flexure\n  \
    flexure completions zsh > ~/.zfunc/_flexure\n  \
    flexure completions fish > ~/.config/fish/completions/flexure.fish")]
pub struct CompletionArguments {
    /// The shell.
    shell: Shell,
}

/// Prints completions.
pub fn completions(arguments: &CompletionArguments, mut command: Command) -> Result<()> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut command, "flexure", &mut script);
    print(String::from_utf8(script)?.trim_end())
}

/// Print a manual page, or write all of them.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  \
    flexure man identify | man -l -\n  \
    flexure man --out ~/.local/share/man/man1")]
pub struct ManualArguments {
    /// The command whose manual page is printed. By default, it is the page of flexure itself.
    #[arg(value_name = "COMMAND", conflicts_with = "out")]
    command: Option<String>,
    /// Write the manual pages of all commands to this folder.
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
}

/// Prints or writes manual pages.
pub fn manual(arguments: &ManualArguments, mut command: Command) -> Result<()> {
    // Its pages would repeat all others.
    command = command.disable_help_subcommand(true);
    // Gives the subcommands their full names.
    command.build();
    if let Some(folder) = &arguments.out {
        make_folder(folder)?;
        clap_mangen::generate_to(command, folder).with_context(|| shown_path(folder))?;
        let lines: Vec<String> = wrote([folder]).collect();
        return print(&lines.join("\n"));
    }
    let page = match &arguments.command {
        None => command,
        Some(name) => {
            let found = command.find_subcommand(name).cloned();
            found.ok_or_else(|| Usage(format!("there is no command '{name}'; see flexure --help")))?
        }
    };
    let mut text = Vec::new();
    clap_mangen::Man::new(page).render(&mut text)?;
    print(String::from_utf8(text)?.trim_end())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Cli;
    use clap::CommandFactory;

    fn command() -> Command {
        let mut command = grouped(Cli::command());
        command.build();
        command
    }

    fn options(command: &Command) -> impl Iterator<Item = &Arg> {
        command.get_opts().chain(
            command
                .get_arguments()
                .filter(|a| a.get_long().is_some() && !a.get_action().takes_values()),
        )
    }

    #[test]
    fn every_option_has_a_group() {
        let mut missing = Vec::new();
        for subcommand in command().get_subcommands().filter(|c| !c.is_hide_set()) {
            for option in options(subcommand) {
                let name = option.get_long().unwrap_or_default();
                let own = ["help", "version", "preset"].contains(&name) || subcommand.get_name() == "help";
                if !own && option.get_help_heading().is_none() {
                    missing.push(format!("--{name} of {}", subcommand.get_name()));
                }
            }
        }
        assert!(missing.is_empty(), "{missing:?}");
    }

    #[test]
    fn what_reads_a_record_has_nothing_else_in_its_group() {
        let reading = [
            "separator",
            "decimal",
            "header",
            "skip-lines",
            "time",
            "time-format",
            "missing-text",
            "topic",
            "joint",
            "memory",
        ];
        for subcommand in command().get_subcommands() {
            for option in options(subcommand).filter(|o| o.get_help_heading() == Some(HEADING)) {
                let name = option.get_long().unwrap_or_default();
                assert!(reading.contains(&name), "--{name} of {}", subcommand.get_name());
            }
        }
    }

    #[test]
    fn no_group_names_an_option_that_is_not_there() {
        let command = command();
        for name in GROUPS.iter().flat_map(|(_, names)| *names) {
            let has = |c: &Command| options(c).any(|o| o.get_long() == Some(name));
            assert!(command.get_subcommands().any(has), "--{name}");
        }
    }

    #[test]
    fn completions_have_every_command_and_option() {
        for shell in [Shell::Bash, Shell::Zsh, Shell::Fish, Shell::PowerShell] {
            let mut text = Vec::new();
            clap_complete::generate(shell, &mut command(), "flexure", &mut text);
            let text = String::from_utf8(text).unwrap();
            for subcommand in command().get_subcommands() {
                assert!(
                    text.contains(subcommand.get_name()),
                    "{shell}: {}",
                    subcommand.get_name()
                );
                for option in options(subcommand).filter_map(Arg::get_long) {
                    assert!(text.contains(option), "{shell}: {} --{option}", subcommand.get_name());
                }
            }
        }
    }

    #[test]
    fn manual_pages_have_every_option() {
        for subcommand in command().get_subcommands().filter(|c| c.get_name() != "help") {
            let mut text = Vec::new();
            clap_mangen::Man::new(subcommand.clone()).render(&mut text).unwrap();
            let text = String::from_utf8(text).unwrap().replace('\\', "");
            assert!(text.contains(&format!("flexure-{}", subcommand.get_name())), "{text}");
            for option in options(subcommand).filter_map(Arg::get_long) {
                assert!(
                    text.contains(&format!("--{option}")),
                    "{} --{option}",
                    subcommand.get_name()
                );
            }
        }
    }
}
