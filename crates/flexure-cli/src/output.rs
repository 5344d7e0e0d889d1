//! What a command says: its results on the standard output, what went wrong on the error stream.

use std::ffi::OsString;
use std::io::{self, Write};

use anyhow::Result;
use flexure::text::{readable, visible};
use flexure_workbench::lines::{Lines, WIDTH};

/// Prints the lines of a result.
///
/// A reader that has gone (`flexure ... | head -1`) has read all that it wanted: this is no error.
///
/// # Errors
/// [`flexure_io::Error::Write`] where the output cannot be written for any other reason.
pub fn print(lines: &str) -> Result<()> {
    write_all(&mut io::stdout().lock(), &visible(lines))
}

/// Prints a result, and then further lines as they are: wrapped to the terminal's width, and coloured where the output is a terminal.
/// The variables `NO_COLOR` and `CLICOLOR_FORCE` are obeyed.
///
/// # Errors
/// Those of [`print`].
pub fn print_result(result: &Lines, further: impl IntoIterator<Item = String>) -> Result<()> {
    let columns = terminal_size::terminal_size_of(io::stdout()).map(|(width, _)| usize::from(width.0));
    let text = result.coloured(columns.map_or(WIDTH, |columns| columns.min(WIDEST)));
    let further = further.into_iter().map(|line| visible(&line).into_owned());
    let lines: Vec<String> = std::iter::once(text).chain(further).collect();
    // Where colours are not wanted, this leaves them out.
    write_all(&mut anstream::stdout().lock(), &lines.join("\n"))
}

/// The widest text that is easily read.
const WIDEST: usize = 120;

fn write_all(out: &mut impl Write, lines: &str) -> Result<()> {
    match writeln!(out, "{lines}").and_then(|()| out.flush()) {
        Err(cause) if cause.kind() != io::ErrorKind::BrokenPipe => Err(flexure_io::Error::Write {
            path: "the standard output".into(),
            cause,
        }
        .into()),
        _ => Ok(()),
    }
}

/// The longest message, characters.
const LONGEST: usize = 4000;

/// A message that is safe for a terminal: short and without control codes, even if a file contains such codes.
fn message(text: &str) -> String {
    let text = readable(text);
    match text.char_indices().nth(LONGEST) {
        None => text,
        Some((end, _)) => format!("{} ...", &text[..end]),
    }
}

/// Prints an error. If that fails, nothing can report it.
pub fn print_error(error: &anyhow::Error) {
    let _ = writeln!(io::stderr(), "error: {}", message(&format!("{error:#}")));
}

/// Prints a note for the user to the error stream, so that it does not mix with the result.
pub fn print_note(note: &str) {
    let _ = writeln!(io::stderr(), "{}", message(note));
}

/// `flexure` with `arguments`, as they can be typed into a shell. Characters that are not Unicode are replaced.
pub fn command_line(arguments: impl IntoIterator<Item = OsString>) -> String {
    let mut line = "flexure".to_owned();
    for argument in arguments {
        line.push(' ');
        line.push_str(&quoted(&argument.to_string_lossy()));
    }
    line
}

/// The command line of this process.
pub fn this_command() -> String {
    command_line(std::env::args_os().skip(1))
}

/// An argument as a shell takes it: in quotation marks if it has characters with a special meaning.
pub fn quoted(argument: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "_-+=.,:/@%".contains(c);
    if !argument.is_empty() && argument.chars().all(plain) {
        return argument.to_owned();
    }
    format!("'{}'", argument.replace('\'', r"'\''"))
}

#[cfg(test)]
mod tests {
    use super::command_line;

    #[test]
    fn arguments_are_quoted_where_a_shell_would_change_them() {
        let line = |parts: &[&str]| command_line(parts.iter().map(|&w| w.into()));
        assert_eq!(line(&[]), "flexure");
        let plain = ["identify", "a/b-1.csv", "--input=u", "--known", "-1.5=1e+3", "größe"];
        assert_eq!(line(&plain), format!("flexure {}", plain.join(" ")));
        for (word, quoted) in [
            ("", "''"),
            ("my record.csv", "'my record.csv'"),
            ("$HOME", "'$HOME'"),
            ("*.csv", "'*.csv'"),
            ("it's", r"'it'\''s'"),
            ("a;b", "'a;b'"),
            ("~", "'~'"),
            ("a\\b", r"'a\b'"),
        ] {
            assert_eq!(line(&[word]), format!("flexure {quoted}"));
        }
    }
}
