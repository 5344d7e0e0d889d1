//! Names that all formats take.

use std::path::Path;

use crate::error::{Error, Result};

/// The longest name: MATLAB's limit.
const LONGEST: usize = 63;

/// Words that no format takes for a name: those of C, C++, Python and MATLAB, with the functions and headers that the files use, and `fmi`,
/// which is a file of an FMU.
const RESERVED: &str = "abs alignas alignof all and any as asm assert async auto await bool break case catch ceil char class classdef clamp const \
    constexpr continue cos cosh decltype def default del delete do double elif else elseif end enum enumerate eps error except exp \
    explicit export extern false False finally float floor fmi fmod for friend from function global goto hypot if import in inline \
    int is isempty isinf isnan isinstance lambda len length list long main math max min mutable namespace nan NaN new noexcept None \
    nonlocal not nullptr numel ones operator or otherwise parfor pass persistent pow print private protected public raise range register \
    repmat restrict return reversed round self short sign signed sin sinh size sizeof spmd sqrt static stdbool stddef stdint stdlib string struct \
    sum super switch tan tanh template this throw true True try tuple typedef typename union unsigned using virtual void volatile while \
    with xor yield zeros zip";

fn is_reserved(name: &str) -> bool {
    RESERVED.split_whitespace().any(|word| word == name)
}

/// Refuses what is no identifier in one of the formats.
pub fn check(name: &str) -> Result<()> {
    let wrong = |problem| Error::Name {
        name: name.to_owned(),
        problem,
    };
    if !name.starts_with(|c: char| c.is_ascii_alphabetic()) {
        return Err(wrong("it must begin with a letter from a to z"));
    }
    if !name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') {
        return Err(wrong("it may have only letters from a to z, digits and underscores"));
    }
    if name.len() > LONGEST {
        return Err(wrong("it may have at most 63 characters"));
    }
    if is_reserved(name) {
        return Err(wrong("this is a word of C, C++, Python or MATLAB, or a file of theirs"));
    }
    Ok(())
}

/// An identifier like the file's name without its extension.
pub fn of_file(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    let mut name: String = stem.chars().map(plain).take(LONGEST - "model_".len()).collect();
    if !name.starts_with(|c: char| c.is_ascii_alphabetic()) {
        name = format!("model_{}", name.trim_start_matches('_'));
    }
    if is_reserved(&name) {
        name.push_str("_model");
    }
    name
}

/// Signs of units in ASCII.
const SIGNS: [(char, &str); 6] = [
    ('°', "deg"),
    ('²', "2"),
    ('³', "3"),
    ('·', "."),
    ('µ', "u"),
    ('Ω', "Ohm"),
];

/// Text of a file in a comment or a string of any language: printable ASCII alone, and nothing that could end a comment or a string. A
/// slash stays between letters or digits, as in `rad/s`.
pub fn plain(text: &str) -> String {
    let spelt = SIGNS
        .iter()
        .fold(text.to_owned(), |text, (sign, ascii)| text.replace(*sign, ascii));
    let chars: Vec<char> = spelt.chars().collect();
    let is_within = |i: usize| {
        let beside = [i.checked_sub(1), Some(i + 1)].map(|at| at.and_then(|at| chars.get(at)));
        beside.iter().all(|c| c.is_some_and(char::is_ascii_alphanumeric))
    };
    let safe = |(i, c): (usize, &char)| match *c {
        'a'..='z'
        | 'A'..='Z'
        | '0'..='9'
        | ' '
        | '_'
        | '-'
        | '.'
        | ','
        | ':'
        | ';'
        | '('
        | ')'
        | '['
        | ']'
        | '+'
        | '='
        | '^'
        | '~' => *c,
        '/' if is_within(i) => '/',
        '/' => '|',
        _ => '_',
    };
    chars.iter().enumerate().map(safe).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_identifiers_everywhere() {
        for good in ["motor", "Motor_2", "a"] {
            assert!(check(good).is_ok(), "{good}");
        }
        for bad in [
            "",
            "2a",
            "_a",
            "a-b",
            "a b",
            "é",
            "for",
            "class",
            "elseif",
            "a*/b",
            &"a".repeat(64),
        ] {
            let message = check(bad).unwrap_err().to_string();
            assert!(message.contains("give another name"), "{message}");
        }
    }

    #[test]
    fn a_file_gives_a_name_that_passes() {
        let cases = [
            ("out/motor.c", "motor"),
            ("my motor-2.onnx", "my_motor_2"),
            ("2.c", "model_2"),
            ("_x.c", "model_x"),
            ("for.py", "for_model"),
            ("é.c", "model_"),
        ];
        for (path, name) in cases {
            assert_eq!(of_file(Path::new(path)), name);
            assert!(check(name).is_ok());
        }
        assert!(check(&of_file(Path::new(&"x".repeat(200)))).is_ok());
    }

    #[test]
    fn nothing_of_a_name_ends_a_comment_or_a_string() {
        let text = plain("*/ int x; // \" ' \\ \n \r %{ {{ ??/ <a> & \u{202e}é```");
        assert!(
            !text.contains(['*', '/', '"', '\'', '\\', '\n', '\r', '%', '{', '?', '<', '&', '`']),
            "{text}"
        );
        assert!(text.is_ascii());
        assert_eq!(
            plain("u in °/s, y in N·m/rad, //x/ */ 1/²"),
            "u in deg/s, y in N.m/rad, ||x| _| 1/2"
        );
    }
}
