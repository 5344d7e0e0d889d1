//! A result as lines for reading: they can be wrapped to any width, and coloured where that is wanted.
//!
//! ```text
//! Hammerstein model from 'u' to 'y', fit 96.7 %: the model holds on fresh data      <- a headline
//!   On fresh data the model explains 99.9 % of the output's variance ...            <- a sentence
//!   linear part         order 2, delay 1, static gain 1.000                         <- an item: label and text
//!     coefficients      b1 = 0.1198 ± 0.0003, b2 = 0.0803 ± 0.0006,                 <- an item of a deeper level
//!                       a1 = -1.5000 ± 0.0006                                       <- its continuation
//! ```

use std::fmt;

use anstyle::{AnsiColor, Style};
use flexure::text::{readable, shortened};
use textwrap::{Options, WordSplitter};

/// The default width to which text is wrapped: few screens are narrower, and longer lines are hard to read.
pub const WIDTH: usize = 100;
/// Columns of a label.
const LABEL: usize = 20;
/// Columns by which a level is indented.
const INDENT: usize = 2;
/// A mark that keeps two words on one line; it is printed as a blank.
const UNBROKEN: char = '\u{a0}';

/// The colour of a line: its meaning at a glance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Tone {
    /// Nothing in particular.
    #[default]
    Plain,
    /// All is well.
    Good,
    /// Something has to be known.
    Caution,
    /// Something is wrong.
    Bad,
}

impl Tone {
    fn style(self) -> Style {
        let colour = match self {
            Tone::Plain => return Style::new(),
            Tone::Good => AnsiColor::Green,
            Tone::Caution => AnsiColor::Yellow,
            Tone::Bad => AnsiColor::Red,
        };
        Style::new().fg_color(Some(colour.into()))
    }
}

/// What a line is.
#[derive(Debug, Clone, PartialEq)]
enum Kind {
    /// The result, in bold.
    Headline,
    /// Text that may be wrapped.
    Sentence,
    /// A label and what belongs to it. The label has the line's tone.
    Item(String),
    /// A row of a table, which stays as it is.
    Row,
}

#[derive(Debug, Clone, PartialEq)]
struct Line {
    level: usize,
    kind: Kind,
    tone: Tone,
    text: String,
}

/// Lines of text.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Lines {
    lines: Vec<Line>,
    level: usize,
}

impl Lines {
    /// No lines yet.
    pub fn new() -> Lines {
        Lines::default()
    }

    /// The result in a line. Later lines are indented.
    pub fn headline(&mut self, tone: Tone, text: impl Into<String>) {
        self.level = 0;
        self.push(Kind::Headline, tone, text.into());
        self.level = 1;
    }

    /// A sentence, or several.
    pub fn sentence(&mut self, text: impl Into<String>) {
        self.push(Kind::Sentence, Tone::Plain, text.into());
    }

    /// A label, and what belongs to it.
    pub fn item(&mut self, label: &str, text: impl Into<String>) {
        self.marked(Tone::Plain, label, text);
    }

    /// A label in a colour, and what belongs to it.
    pub fn marked(&mut self, tone: Tone, label: &str, text: impl Into<String>) {
        self.push(Kind::Item(readable(label)), tone, text.into());
    }

    /// What to know before trusting a result.
    pub fn warning(&mut self, text: impl fmt::Display) {
        self.marked(Tone::Caution, "warning:", text.to_string());
    }

    /// A note on a result.
    pub fn note(&mut self, text: impl fmt::Display) {
        self.marked(Tone::Caution, "note:", text.to_string());
    }

    /// A row of a table, which is not wrapped.
    pub fn row(&mut self, text: impl Into<String>) {
        self.push(Kind::Row, Tone::Plain, text.into());
    }

    /// A table, its header first, which is not wrapped. Columns in `texts` are aligned left; the others have numbers and are aligned right.
    /// Long texts are shortened.
    pub fn table<R: AsRef<[String]>>(&mut self, rows: &[R], texts: &[usize]) {
        let short = |row: &R| row.as_ref().iter().map(|cell| shortened(cell)).collect::<Vec<_>>();
        let rows: Vec<Vec<String>> = rows.iter().map(short).collect();
        let columns = rows.first().map_or(0, Vec::len);
        let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max();
        let widths: Vec<usize> = (0..columns).map(|column| width(column).unwrap_or(0)).collect();
        for row in &rows {
            let cells = row.iter().zip(&widths).enumerate();
            let padded = cells.map(|(i, (cell, &width))| match texts.contains(&i) {
                true => format!("{cell:<width$}"),
                false => format!("{cell:>width$}"),
            });
            self.row(padded.collect::<Vec<_>>().join("  ").trim_end());
        }
    }

    /// An empty line.
    pub fn space(&mut self) {
        self.row("");
    }

    /// Lines of a deeper level.
    pub fn deeper(&mut self, write: impl FnOnce(&mut Lines)) {
        self.level += 1;
        write(self);
        self.level -= 1;
    }

    fn push(&mut self, kind: Kind, tone: Tone, text: String) {
        self.lines.push(Line {
            level: self.level,
            kind,
            tone,
            text: with_kept_pairs(&readable(&text)),
        });
    }

    /// The text, wrapped to this number of columns, without colours.
    pub fn wrapped(&self, columns: usize) -> String {
        self.rendered(columns, |_, text| text.to_owned())
    }

    /// The text, wrapped to this number of columns, with the codes of colours.
    pub fn coloured(&self, columns: usize) -> String {
        self.rendered(columns, |style, text| match style.is_plain() {
            true => text.to_owned(),
            false => format!("{style}{text}{style:#}"),
        })
    }

    fn rendered(&self, columns: usize, paint: impl Fn(Style, &str) -> String) -> String {
        let each = self.lines.iter().map(|line| line.rendered(columns, &paint));
        each.collect::<Vec<_>>().join("\n").replace(UNBROKEN, " ")
    }
}

impl fmt::Display for Lines {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.wrapped(WIDTH))
    }
}

impl Line {
    fn rendered(&self, columns: usize, paint: &impl Fn(Style, &str) -> String) -> String {
        let indent = " ".repeat(INDENT * self.level);
        match &self.kind {
            Kind::Row if self.text.is_empty() => String::new(),
            Kind::Row => format!("{indent}{}", self.text),
            Kind::Sentence => filled(&self.text, columns, &indent, &indent),
            Kind::Headline => {
                let text = filled(&self.text, columns, &indent, &" ".repeat(INDENT));
                let style = self.tone.style().bold();
                let painted = text.lines().map(|line| paint(style, line));
                painted.collect::<Vec<_>>().join("\n")
            }
            Kind::Item(label) => {
                // Labels of all levels end in the same column.
                let width = (LABEL + INDENT).saturating_sub(indent.len());
                let padded = format!("{label:<width$}");
                let first = format!(
                    "{indent}{padded}{}",
                    if label.chars().count() < width { "" } else { ": " }
                );
                let text = filled(&self.text, columns, &first, &" ".repeat(indent.len() + width));
                let after = text.get(indent.len() + label.len()..).unwrap_or_default();
                format!("{indent}{}{after}", paint(self.tone.style(), label))
            }
        }
    }
}

/// Text wrapped to this number of columns, without hyphens. A word is not broken.
fn filled(text: &str, columns: usize, first: &str, next: &str) -> String {
    // With fewer columns, half of the width would be indentation.
    let options = Options::new(columns.max(2 * LABEL))
        .initial_indent(first)
        .subsequent_indent(next)
        .word_splitter(WordSplitter::NoHyphenation)
        .break_words(false);
    textwrap::fill(text, options)
}

/// Units that stay with their numbers; also in quotients and powers of them.
const UNITS: [&str; 20] = [
    "%", "Hz", "kHz", "s", "ms", "us", "min", "h", "rad", "deg", "m", "mm", "kg", "N", "Nm", "V", "A", "W", "K",
    "samples",
];

/// The text with marks in place of the blanks of "96.9 %", "0.5321 ± 0.0012 N m" and "slope = 4.004".
fn with_kept_pairs(text: &str) -> String {
    let mut joined = String::with_capacity(text.len());
    let (mut before, mut follows_number) = ("", false);
    for (i, word) in text.split(' ').enumerate() {
        if i > 0 {
            let sign = |word| word == "±" || word == "=";
            let unit = follows_number && is_unit(word);
            joined.push(if sign(word) || sign(before) || unit {
                UNBROKEN
            } else {
                ' '
            });
            follows_number = unit;
        }
        // Several units may follow a number: N m.
        follows_number |= is_number(word);
        joined.push_str(word);
        before = word;
    }
    joined
}

fn is_number(word: &str) -> bool {
    let word = word.trim_start_matches(['(', '-', '<', '±']);
    word.starts_with(|c: char| c.is_ascii_digit()) && word.ends_with(|c: char| c.is_ascii_digit())
}

fn is_unit(word: &str) -> bool {
    let word = word.trim_end_matches([',', ';', ':', '.', ')']);
    let mut parts = word.split(['/', '^']);
    parts.next().is_some_and(|first| UNITS.contains(&first))
        && parts.all(|part| UNITS.contains(&part) || part.chars().all(|c| c.is_ascii_digit()))
}

/// A text that stays on one line, as a number with its unit.
pub fn unbroken(text: &str) -> String {
    text.replace(' ', &UNBROKEN.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> Lines {
        let mut lines = Lines::new();
        lines.headline(
            Tone::Good,
            "A result that is rather long for so narrow a screen as this one",
        );
        lines.sentence("A sentence of some words that do not fit into a line of fifty columns.");
        lines.item("linear part", "order 2");
        lines.deeper(|lines| lines.item("poles", format!("1.5 Hz, {}", unbroken("2.5 Hz with a small damping"))));
        lines.item("a label that is too long for its column", "text");
        lines.warning("beware");
        lines.row("a row of a table that is not wrapped, however long it may be");
        lines
    }

    #[test]
    fn lines_are_wrapped_with_hanging_indents() {
        assert_eq!(
            example().wrapped(50),
            "A result that is rather long for so narrow a\n  screen as this one\n  \
             A sentence of some words that do not fit into a\n  line of fifty columns.\n  \
             linear part         order 2\n    \
             poles             1.5 Hz,\n                      2.5 Hz with a small damping\n  \
             a label that is too long for its column: text\n  \
             warning:            beware\n  \
             a row of a table that is not wrapped, however long it may be"
        );
    }

    #[test]
    fn numbers_keep_their_errors_names_and_units() {
        let mut lines = Lines::new();
        lines.sentence("fit 96.9 %, slope = 4.0040 ± 0.0037 N m/rad; after 2 s it holds, up to 3 times");
        let kept = ["96.9 %,", "slope = 4.0040 ± 0.0037 N m/rad;", "2 s"];
        for columns in 40..80 {
            let text = lines.wrapped(columns);
            for kept in kept {
                assert!(text.contains(kept), "{columns} columns:\n{text}");
            }
        }
        let unjoined = lines.wrapped(40);
        assert!(unjoined.lines().all(|line| line.chars().count() <= 40), "{unjoined}");
    }

    #[test]
    fn tables_are_aligned() {
        let mut lines = Lines::new();
        let rows = [["name", "value"], ["größe", "1.5"], ["b", "-120"]].map(|row| row.map(str::to_owned));
        lines.table(&rows, &[0]);
        lines.space();
        assert_eq!(lines.wrapped(20), "name   value\ngröße    1.5\nb       -120\n");
    }

    #[test]
    fn no_line_but_a_row_or_a_word_is_wider_than_the_screen() {
        for columns in [40, 50, 72, 100, 200] {
            for line in example()
                .wrapped(columns)
                .lines()
                .filter(|l| !l.contains("a row") && !l.contains("small damping"))
            {
                let parts = line.split_whitespace().count();
                assert!(
                    line.chars().count() <= columns || parts == 1 || line.contains("too long"),
                    "{line}"
                );
            }
        }
    }

    #[test]
    fn colours_change_nothing_but_codes() {
        let (plain, coloured) = (example().wrapped(60), example().coloured(60));
        let codes = coloured.split('\u{1b}').skip(1);
        let stripped: String = std::iter::once(coloured.split('\u{1b}').next().unwrap())
            .chain(codes.map(|part| part.split_once('m').unwrap().1))
            .collect();
        assert_eq!(plain, stripped);
        assert!(coloured.contains("\u{1b}[33mwarning:\u{1b}[0m"), "{coloured:?}");
    }
}
