//! Units in the names of columns.

use std::collections::HashMap;

/// A name and the unit after it in brackets: `Speed [rad/s]`, `Torque (N m)`.
pub(crate) fn split_unit(field: &str) -> (String, Option<String>) {
    for (open, close) in [('[', ']'), ('(', ')')] {
        if let Some((name, unit)) = field.strip_suffix(close).and_then(|text| text.rsplit_once(open))
            && !name.trim().is_empty()
            && !unit.trim().is_empty()
        {
            return (name.trim().to_owned(), Some(unit.trim().to_owned()));
        }
    }
    (field.to_owned(), None)
}

/// Splits the units off these names, unless the name would then equal another one.
pub(crate) fn split_units(names: &mut [String]) -> Vec<Option<String>> {
    let split: Vec<(String, Option<String>)> = names.iter().map(|name| split_unit(name)).collect();
    let mut sharing: HashMap<&String, usize> = HashMap::new();
    for (name, _) in &split {
        *sharing.entry(name).or_default() += 1;
    }
    for (name, (base, _)) in names.iter_mut().zip(&split) {
        if sharing[base] == 1 {
            name.clone_from(base);
        }
    }
    split.into_iter().map(|(_, unit)| unit).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_that_differ_in_their_units_alone_keep_them_in_their_names() {
        let mut names = ["Time [s]", "q [deg]", "q [rad]", "u (V)", "y", "[x]"].map(str::to_owned);
        let units = split_units(&mut names);
        assert_eq!(names, ["Time", "q [deg]", "q [rad]", "u", "y", "[x]"]);
        let expected = [Some("s"), Some("deg"), Some("rad"), Some("V"), None, None];
        assert_eq!(units, expected.map(|unit| unit.map(str::to_owned)));
    }
}
