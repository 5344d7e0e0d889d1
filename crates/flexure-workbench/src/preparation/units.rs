//! Units of quantities that are measured at machines, and their conversion.

use std::f64::consts::PI;

use anyhow::{Result, bail};

/// A unit: a value in it, times `numerator` over `denominator`, plus `offset`, is in the base unit of its quantity.
///
/// The numerator and the denominator are kept apart, so that 70 mm are exactly 0.07 m.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Unit {
    /// Its spellings, without spaces, dots and carets; the first one is used in lists.
    names: &'static [&'static str],
    numerator: f64,
    denominator: f64,
    offset: f64,
}

const fn unit(names: &'static [&'static str], numerator: f64, denominator: f64) -> Unit {
    Unit {
        names,
        numerator,
        denominator,
        offset: 0.0,
    }
}

/// Each quantity with its units, the base unit first.
const QUANTITIES: &[&[Unit]] = &[
    &[
        unit(&["rad", "radian", "radians"], 1.0, 1.0),
        unit(&["mrad"], 1.0, 1e3),
        unit(&["deg", "°", "degree", "degrees"], PI, 180.0),
        unit(&["arcmin", "'"], PI, 10_800.0),
        unit(&["arcsec", "\""], PI, 648_000.0),
        unit(&["rev", "turn", "turns", "revolutions"], 2.0 * PI, 1.0),
    ],
    &[
        unit(&["rad/s", "radian/s"], 1.0, 1.0),
        unit(&["deg/s", "°/s", "dps"], PI, 180.0),
        unit(&["rpm", "rev/min", "1/min", "min-1", "r/min"], PI, 30.0),
        unit(&["rev/s", "rps"], 2.0 * PI, 1.0),
    ],
    &[
        unit(&["rad/s2", "rad/s/s"], 1.0, 1.0),
        unit(&["deg/s2", "°/s2"], PI, 180.0),
    ],
    &[
        unit(&["m", "meter", "meters", "metre", "metres"], 1.0, 1.0),
        unit(&["cm"], 1.0, 1e2),
        unit(&["mm"], 1.0, 1e3),
        unit(&["um", "micron", "microns"], 1.0, 1e6),
        unit(&["nm"], 1.0, 1e9),
        unit(&["km"], 1e3, 1.0),
        unit(&["in", "inch", "inches"], 254.0, 1e4),
        unit(&["ft", "feet"], 3048.0, 1e4),
    ],
    &[
        unit(&["m/s"], 1.0, 1.0),
        unit(&["mm/s"], 1.0, 1e3),
        unit(&["m/min"], 1.0, 60.0),
        unit(&["mm/min"], 1.0, 6e4),
        unit(&["km/h", "kph", "kmh"], 5.0, 18.0),
    ],
    &[
        unit(&["m/s2", "m/s/s"], 1.0, 1.0),
        unit(&["mm/s2"], 1.0, 1e3),
        unit(&["gn", "g0"], 980_665.0, 1e5),
    ],
    &[
        unit(&["s", "sec", "second", "seconds"], 1.0, 1.0),
        unit(&["ms", "msec"], 1.0, 1e3),
        unit(&["us", "usec"], 1.0, 1e6),
        unit(&["ns"], 1.0, 1e9),
        unit(&["min"], 60.0, 1.0),
        unit(&["h"], 3600.0, 1.0),
    ],
    &[
        unit(&["Hz", "1/s"], 1.0, 1.0),
        unit(&["kHz"], 1e3, 1.0),
        unit(&["MHz"], 1e6, 1.0),
    ],
    &[
        unit(&["N", "newton"], 1.0, 1.0),
        unit(&["mN"], 1.0, 1e3),
        unit(&["kN"], 1e3, 1.0),
        unit(&["lbf"], 4.448_221_615_260_5, 1.0),
    ],
    &[
        unit(&["Nm"], 1.0, 1.0),
        unit(&["mNm"], 1.0, 1e3),
        unit(&["Ncm"], 1.0, 1e2),
        unit(&["Nmm"], 1.0, 1e3),
        unit(&["kNm"], 1e3, 1.0),
        unit(&["ftlb", "lbft", "ftlbf", "lbfft"], 1.355_817_948_331_400_4, 1.0),
    ],
    &[unit(&["kg"], 1.0, 1.0), unit(&["g"], 1.0, 1e3), unit(&["t"], 1e3, 1.0)],
    &[unit(&["A"], 1.0, 1.0), unit(&["mA"], 1.0, 1e3), unit(&["uA"], 1.0, 1e6)],
    &[
        unit(&["V"], 1.0, 1.0),
        unit(&["mV"], 1.0, 1e3),
        unit(&["uV"], 1.0, 1e6),
        unit(&["kV"], 1e3, 1.0),
    ],
    &[unit(&["W"], 1.0, 1.0), unit(&["mW"], 1.0, 1e3), unit(&["kW"], 1e3, 1.0)],
    &[
        unit(&["Pa"], 1.0, 1.0),
        unit(&["hPa", "mbar"], 1e2, 1.0),
        unit(&["kPa"], 1e3, 1.0),
        unit(&["bar"], 1e5, 1.0),
        unit(&["MPa"], 1e6, 1.0),
        unit(&["psi"], 6_894.757_293_168_36, 1.0),
    ],
    &[
        unit(&["K", "kelvin"], 1.0, 1.0),
        Unit {
            names: &["°C", "degC", "celsius"],
            numerator: 1.0,
            denominator: 1.0,
            offset: 273.15,
        },
        Unit {
            names: &["°F", "degF", "fahrenheit"],
            numerator: 5.0,
            denominator: 9.0,
            offset: 459.67 * 5.0 / 9.0,
        },
    ],
    &[unit(&["1", "-"], 1.0, 1.0), unit(&["%", "percent"], 1.0, 1e2)],
];

/// A name as the table has it: N·m, N m and N*m are Nm, s^2 and s² are s2, µ is u.
fn plain(name: &str) -> String {
    let dropped = |c: &char| !matches!(c, ' ' | '·' | '⋅' | '*' | '^' | '.');
    let changed = |c| match c {
        'µ' | 'μ' => 'u',
        '²' => '2',
        '\u{ba}' => '°',
        other => other,
    };
    name.chars().filter(dropped).map(changed).collect()
}

/// The unit of this name, and the units of the same quantity. A unit may be divided by a number: rev/4096 is a count of an encoder.
fn find(name: &str) -> Option<(Unit, &'static [Unit])> {
    let known = |name: &str| {
        let plain = plain(name);
        let is = |unit: &&Unit| unit.names.contains(&plain.as_str());
        QUANTITIES
            .iter()
            .find_map(|units| Some((*units.iter().find(is)?, *units)))
    };
    let divided = || {
        let (name, divisor) = name.rsplit_once('/')?;
        let divisor: f64 = divisor.trim().parse().ok().filter(|d| *d > 0.0 && f64::is_finite(*d))?;
        let (whole, units) = known(name).filter(|(unit, _)| unit.offset == 0.0)?;
        let denominator = whole.denominator * divisor;
        Some((Unit { denominator, ..whole }, units))
    };
    known(name).or_else(divided)
}

fn names<'a>(units: impl IntoIterator<Item = &'a Unit>) -> String {
    units
        .into_iter()
        .map(|unit| unit.names[0])
        .collect::<Vec<_>>()
        .join(", ")
}

/// Converts a value from one unit to another.
///
/// A unit may be divided by a number: `rev/4096` is a count of an encoder that counts 4096 in a revolution.
///
/// # Errors
/// For a unit that is not known, with the list; for units of different quantities, with those that fit.
pub fn conversion(from: &str, to: &str) -> Result<impl Fn(f64) -> f64> {
    let known = |name: &str| match (find(name), name.rsplit_once('/')) {
        (Some(found), _) => Ok(found),
        (None, Some((whole, counts @ ("N" | "n" | "COUNTS")))) if plain(whole) == "rev" => bail!(
            "the unit {name} needs a number: put the number of counts of a revolution in place of {counts}, as in rev/4096"
        ),
        (None, _) => bail!(
            "the unit {name} is not known; the units are: {}; or one of them divided by a number, such as rev/4096",
            names(QUANTITIES.iter().copied().flatten())
        ),
    };
    let ((from, units), (to, other)) = (known(from)?, known(to)?);
    if units != other {
        bail!(
            "{} cannot be converted to {}; it can be converted to: {}",
            from.names[0],
            to.names[0],
            names(units.iter().filter(|unit| **unit != from))
        );
    }
    let numerator = from.numerator * to.denominator;
    let denominator = from.denominator * to.numerator;
    let offset = (from.offset - to.offset) * to.denominator / to.numerator;
    Ok(move |value: f64| value * numerator / denominator + offset)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn convert(value: f64, from: &str, to: &str) -> f64 {
        conversion(from, to).unwrap()(value)
    }

    #[test]
    fn values_of_everyday_conversions() {
        for (value, from, to, expected) in [
            (180.0, "deg", "rad", PI),
            (90.0, "°", "rad", PI / 2.0),
            (60.0, "rpm", "rad/s", 2.0 * PI),
            (1.0, "rev/s", "rpm", 60.0),
            (70.0, "mm", "m", 0.07),
            (3.0, "ms", "s", 0.003),
            (36.0, "km/h", "m/s", 10.0),
            (2.0, "in", "mm", 50.8),
            (1500.0, "mN m", "N·m", 1.5),
            (1.0, "kN", "N", 1000.0),
            (1.0, "bar", "kPa", 100.0),
            (25.0, "%", "1", 0.25),
            (1.0, "deg/s^2", "rad/s²", PI / 180.0),
            (1.0, "g0", "m/s2", 9.80665),
            (20.0, "°C", "K", 293.15),
            (212.0, "°F", "°C", 100.0),
            (5.0, "µm", "mm", 0.005),
            (1024.0, "rev/4096", "rad", PI / 2.0),
            (30.0, "m/s/10", "m/s", 3.0),
        ] {
            let converted = convert(value, from, to);
            assert!(
                (converted - expected).abs() <= 1e-12 * expected.abs(),
                "{value} {from} = {converted} {to}"
            );
        }
        // To the last digit where the factor is a power of ten.
        assert_eq!(
            (0..1000)
                .map(|i| convert(f64::from(i), "ms", "s").to_string().len())
                .max(),
            Some(5)
        );
    }

    #[test]
    fn there_and_back() {
        for units in QUANTITIES {
            for from in *units {
                for to in *units {
                    let value = convert(convert(7.25, from.names[0], to.names[0]), to.names[0], from.names[0]);
                    assert!((value - 7.25).abs() < 1e-12, "{} to {}", from.names[0], to.names[0]);
                }
            }
        }
    }

    #[test]
    fn no_name_means_two_units() {
        let all: Vec<&str> = QUANTITIES
            .iter()
            .copied()
            .flatten()
            .flat_map(|unit| unit.names)
            .copied()
            .collect();
        for (i, name) in all.iter().enumerate() {
            assert!(!all[..i].contains(name), "{name}");
            assert_eq!(plain(name), *name);
        }
    }

    #[test]
    fn what_cannot_be_converted_says_what_can() {
        let message = |from, to| conversion(from, to).map(|_| ()).unwrap_err().to_string();
        assert_eq!(
            message("deg", "m"),
            "deg cannot be converted to m; it can be converted to: rad, mrad, arcmin, arcsec, rev"
        );
        let unknown = message("furlong", "m");
        assert!(
            unknown.starts_with("the unit furlong is not known; the units are: rad, mrad, deg,"),
            "{unknown}"
        );
        assert_eq!(
            message("rev/N", "rad"),
            "the unit rev/N needs a number: put the number of counts of a revolution in place of N, as in rev/4096"
        );
    }
}
