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

/// Ends of names that can only be a unit, and the unit. Shorter ones, such as `_m` or `_s`, may be an index.
const ENDS: [(&str, &str); 31] = [
    ("_rad_s", "rad/s"),
    ("_radps", "rad/s"),
    ("_rads", "rad/s"),
    ("_deg_s", "deg/s"),
    ("_degps", "deg/s"),
    ("_dps", "deg/s"),
    ("_rad", "rad"),
    ("_mrad", "mrad"),
    ("_deg", "deg"),
    ("_rpm", "rpm"),
    ("_Nm", "Nm"),
    ("_mNm", "mNm"),
    ("_mm", "mm"),
    ("_kN", "kN"),
    ("_mA", "mA"),
    ("_mV", "mV"),
    ("_kW", "kW"),
    ("_kPa", "kPa"),
    ("_MPa", "MPa"),
    ("_mbar", "mbar"),
    ("_Hz", "Hz"),
    ("_kg", "kg"),
    ("_degC", "°C"),
    ("_pct", "%"),
    ("/rad", "rad"),
    ("/deg", "deg"),
    ("/rpm", "rpm"),
    ("/Nm", "Nm"),
    ("/mm", "mm"),
    ("/A", "A"),
    ("/V", "V"),
];

/// Short ends that are units after the words before them, in lower case, and the unit: `Iq_A` is in A, `motor_A` may be that of axis A.
const ENDS_AFTER: [(&str, &[&str]); 3] = [
    ("A", &["current", "i", "iq", "id", "im", "strom", "amps"]),
    ("V", &["voltage", "volt", "volts", "spannung"]),
    ("N", &["force", "kraft", "load", "thrust"]),
];

/// Prefixes of units, and their factors.
const PREFIXES: [(&str, f64); 7] = [
    ("", 1.0),
    ("n", 1e-9),
    ("µ", 1e-6),
    ("u", 1e-6),
    ("m", 1e-3),
    ("k", 1e3),
    ("M", 1e6),
];
/// Units that have such prefixes.
const PREFIXED: [&str; 14] = [
    "V", "A", "W", "N", "Nm", "N m", "Hz", "rad", "rad/s", "m", "m/s", "s", "Pa", "bar",
];

/// What a number in `unit` is multiplied by for one in the unit `other`, where both are the same but for a prefix, such as mV and V.
pub(crate) fn factor(unit: &str, other: &str) -> Option<f64> {
    // The micro sign and the Greek letter look the same.
    let [unit, other] = [unit, other].map(|unit| unit.replace('\u{3bc}', "µ"));
    let factor = |unit: &str, base: &str| {
        let prefix = unit.strip_suffix(base)?;
        PREFIXES
            .iter()
            .find(|(own, _)| *own == prefix)
            .map(|(_, factor)| *factor)
    };
    let ratio = |base: &&str| Some((factor(&unit, base)?, factor(&other, base)?));
    PREFIXED.iter().find_map(ratio).map(|(unit, other)| unit / other)
}

/// A name without the unit at its end, and that unit: `q` and `deg` of `q_deg`. `None` if the name does not end in a unit that can be
/// nothing else.
pub fn unit_at_end(name: &str) -> Option<(&str, &'static str)> {
    let found = |(end, unit): &(&str, &'static str)| Some((name.strip_suffix(end)?, *unit));
    let after = |(unit, words): &(&'static str, &[&str])| {
        let base = name.strip_suffix(unit)?.strip_suffix('_')?;
        let word = base.rsplit(|c: char| !c.is_alphanumeric()).next()?.to_lowercase();
        let word = word.trim_end_matches(|c: char| c.is_ascii_digit());
        words.contains(&word).then_some((base, *unit))
    };
    let ends = ENDS.iter().find_map(found).filter(|(base, _)| !base.is_empty());
    ends.or_else(|| ENDS_AFTER.iter().find_map(after))
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

    #[test]
    fn units_that_differ_in_their_prefixes() {
        for (unit, other, expected) in [
            ("V", "mV", Some(1e3)),
            ("mV", "V", Some(1e-3)),
            ("kV", "mV", Some(1e6)),
            ("\u{3bc}V", "V", Some(1e-6)),
            ("mNm", "Nm", Some(1e-3)),
            ("mm", "m", Some(1e-3)),
            ("V", "A", None),
            ("psi", "bar", None),
            ("min", "m", None),
        ] {
            let found = factor(unit, other);
            assert!(
                found == expected || (found.unwrap() / expected.unwrap() - 1.0).abs() < 1e-15,
                "{unit} {other}"
            );
        }
    }

    #[test]
    fn a_unit_at_the_end_of_a_name_counts_where_it_can_be_nothing_else() {
        assert_eq!(unit_at_end("q_deg"), Some(("q", "deg")));
        assert_eq!(unit_at_end("motor_speed_rad_s"), Some(("motor_speed", "rad/s")));
        assert_eq!(unit_at_end("tau_Nm"), Some(("tau", "Nm")));
        assert_eq!(unit_at_end("i_q/A"), Some(("i_q", "A")));
        assert_eq!(unit_at_end("Iq_A"), Some(("Iq", "A")));
        assert_eq!(unit_at_end("motor_current2_A"), Some(("motor_current2", "A")));
        assert_eq!(unit_at_end("heater_kW"), Some(("heater", "kW")));
        for name in [
            "motor_A", "axis_V", "drive_N", "_A", "q_m", "u_s", "x_n", "_deg", "deg", "tau_nm",
        ] {
            assert_eq!(unit_at_end(name), None, "{name}");
        }
    }
}
