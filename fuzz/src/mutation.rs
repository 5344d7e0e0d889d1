//! Changes of bytes and texts that have broken readers before.

use rand::RngExt;
use rand_pcg::Pcg64;

/// Texts to insert: numbers at the ends of their ranges, marks, and codes.
const TEXTS: [&str; 48] = [
    "nan",
    "inf",
    "-inf",
    "1e308",
    "-1e308",
    "1e309",
    "5e-324",
    "1e-300",
    "0",
    "-0",
    "-1",
    "1.7976931348623157e308",
    "9007199254740993",
    "18446744073709551616",
    "99999999999999999999999",
    "1e99999",
    "0x10",
    "1_000",
    "1,5",
    "1.5.5",
    ",",
    ";",
    "\t",
    "\"",
    "'",
    "\n",
    "\r\n",
    "\r",
    "\0",
    "\u{feff}",
    "\u{1b}[2J",
    "[",
    "]",
    "{",
    "}",
    "[[arm.link]]\n",
    "#",
    "=",
    "null",
    "true",
    "<!DOCTYPE r [<!ENTITY a \"&#38;b;&#38;b;\"><!ENTITY b \"xx\">]>",
    "&a;",
    "<link name=\"world\"/>",
    "<!--",
    "é",
    "../",
    "1e-17",
    "6.02e23",
];

/// One of these.
pub fn one<'a, T>(random: &mut Pcg64, of: &'a [T]) -> &'a T {
    &of[random.random_range(0..of.len())]
}

/// One of the seeds, changed at a few places.
pub fn changed(random: &mut Pcg64, seeds: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = one(random, seeds).clone();
    for _ in 0..random.random_range(1..6) {
        change(random, &mut bytes, seeds);
    }
    bytes
}

fn change(random: &mut Pcg64, bytes: &mut Vec<u8>, seeds: &[Vec<u8>]) {
    if bytes.is_empty() {
        bytes.push(random.random());
        return;
    }
    let at = random.random_range(0..bytes.len());
    let end = bytes.len().min(at + random.random_range(1..40));
    match random.random_range(0..10) {
        0 => bytes[at] ^= 1 << random.random_range(0..8),
        1 => bytes[at] = *one(random, &[0, 1, 0x7f, 0x80, 0xff]),
        2 => bytes.truncate(at),
        3 => drop(bytes.drain(at..end)),
        4 => {
            let copy = bytes[at..end].to_vec();
            bytes.splice(at..at, copy);
        }
        // A length or an offset.
        5 => {
            let word: u32 = *one(
                random,
                &[0, 1, 8, 0x7fff_ffff, 0x8000_0000, 0xffff_fff8, 0xffff_ffff, 0x1000_0000],
            );
            let end = bytes.len().min(at + 4);
            bytes[at..end].copy_from_slice(&word.to_le_bytes()[..end - at]);
        }
        6 => {
            let other = one(random, seeds);
            let from = random.random_range(0..other.len().max(1));
            let to = other.len().min(from + random.random_range(1..200));
            bytes.splice(at..end, other[from.min(to)..to].iter().copied());
        }
        // A number in a text.
        7 | 8 => {
            let start = bytes[..at].iter().rposition(|b| !is_number(*b)).map_or(0, |i| i + 1);
            let end = bytes[at..]
                .iter()
                .position(|b| !is_number(*b))
                .map_or(bytes.len(), |i| at + i);
            bytes.splice(start..end.max(start), one(random, &TEXTS).bytes());
        }
        _ => drop(bytes.splice(at..at, one(random, &TEXTS).bytes())),
    }
}

fn is_number(byte: u8) -> bool {
    byte.is_ascii_digit() || b"+-.e".contains(&byte)
}
