//! Numbers in texts made for a terminal, with the signs of a page: −3.2·10⁻⁴ in place of -3.2e-4, and m² in place of m^2.

/// The text with typographic minus signs and exponents. Signs inside words and names stay as they are.
pub(crate) fn typeset(text: &str) -> String {
    let chars: Vec<char> = text.chars().collect();
    let is_digit = |i: usize| chars.get(i).is_some_and(char::is_ascii_digit);
    let mut out = String::with_capacity(text.len());
    let mut i = 0;
    while i < chars.len() {
        let before = i.checked_sub(1).map(|k| chars[k]);
        match chars[i] {
            '-' if is_digit(i + 1) && before.is_none_or(|c| c.is_whitespace() || "[(".contains(c)) => out.push('−'),
            '^' if is_digit(i + 1) => {
                i += 1;
                out.push(raised(chars[i]));
            }
            'e' if before.is_some_and(|c| c.is_ascii_digit() || c == ')') => match exponent(&chars, i + 1) {
                Some((power, end)) => {
                    if is_one(&chars[..i]) {
                        out.pop();
                    } else {
                        out.push('·');
                    }
                    out.push_str("10");
                    out.extend(power.chars().map(raised));
                    i = end - 1;
                }
                None => out.push('e'),
            },
            c => out.push(c),
        }
        i += 1;
    }
    out
}

/// The exponent that begins at `start`, and where it ends; `None` if letters or digits of a name follow.
fn exponent(chars: &[char], start: usize) -> Option<(String, usize)> {
    let sign = usize::from(chars.get(start) == Some(&'-'));
    let digits = chars[start + sign..].iter().take_while(|c| c.is_ascii_digit()).count();
    let end = start + sign + digits;
    let ends = digits > 0 && chars.get(end).is_none_or(|c| !c.is_alphanumeric());
    ends.then(|| (chars[start..end].iter().collect(), end))
}

/// Whether a text ends in the number 1.
fn is_one(chars: &[char]) -> bool {
    match chars {
        [.., before, '1'] => before.is_whitespace(),
        rest => rest == ['1'],
    }
}

fn raised(c: char) -> char {
    let digits = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    c.to_digit(10).map_or('⁻', |d| digits[d as usize])
}

#[cfg(test)]
mod tests {
    use super::typeset;

    #[test]
    fn numbers_have_the_signs_of_a_page() {
        for (text, expected) in [
            ("-3.19 ± 0.11 N", "−3.19 ± 0.11 N"),
            ("[-4.466e-4, 4.027e-4]", "[−4.466·10⁻⁴, 4.027·10⁻⁴]"),
            ("(1.47 ± 0.32)e6 1/rad^2", "(1.47 ± 0.32)·10⁶ 1/rad²"),
            ("p < 1e-6", "p < 10⁻⁶"),
            ("refuted (p\u{a0}<\u{a0}1e-6)", "refuted (p\u{a0}<\u{a0}10⁻⁶)"),
            ("11e-6", "11·10⁻⁶"),
            (
                "Wiener-Hammerstein, x-1, u[n-1], --hold, 2e3x, a1e",
                "Wiener-Hammerstein, x-1, u[n-1], --hold, 2e3x, a1e",
            ),
        ] {
            assert_eq!(typeset(text), expected);
        }
    }
}
