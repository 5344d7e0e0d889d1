//! Values on the command line, checked while they are read, so that wrong ones are wrong usage.

use std::collections::HashSet;
use std::ops::RangeInclusive;

use anyhow::Result;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use flexure::error::ParameterError;
use flexure::identify::hammerstein::MOST_ORDER;
use flexure::identify::{Structure, structures};
use flexure::nonlinearity::{EstimatorName, Kernel, Rule};
use flexure::record::SIZES;
use flexure::text::decimal;
use flexure_workbench::Named;
use flexure_workbench::preparation::conversion;
use flexure_workbench::text::capitalised;

/// The error for an unknown name of a choice; clap refuses such names earlier.
const NO_SUCH_NAME: Usage = Usage(String::new());

/// The options contradict each other: wrong usage, found only after they were read one by one.
#[derive(Debug)]
pub struct Usage(pub String);

impl std::fmt::Display for Usage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}\n\nFor more information, try '--help'.", self.0)
    }
}

impl std::error::Error for Usage {}

/// Whether an error is wrong usage: declared as such, or a parameter (so one from an option) that the library refuses for any data.
pub fn is_usage(error: &anyhow::Error) -> bool {
    let refused =
        |error: &flexure::Error| matches!(error, flexure::Error::Parameter(ParameterError::OutOfRange { .. }));
    // An error that also names a file depends on the data.
    let alone = error.chain().len() == 1;
    let named = |error: &flexure_io::Error| matches!(error, flexure_io::Error::UnknownExtension { .. });
    let export = |error: &flexure_export::Error| {
        matches!(
            error,
            flexure_export::Error::Path { .. } | flexure_export::Error::Name { .. }
        )
    };
    error.is::<Usage>()
        || alone && error.downcast_ref().is_some_and(refused)
        || error.downcast_ref().is_some_and(named)
        || error.downcast_ref().is_some_and(export)
}

/// A parser of the names of choices, whose help lists them.
pub fn named<T: Named>() -> impl TypedValueParser<Value = T> {
    let values = T::ALL
        .iter()
        .map(|choice| PossibleValue::new(choice.name).help(choice.description));
    PossibleValuesParser::new(values.collect::<Vec<_>>()).try_map(|name| T::parse(&name).ok_or(NO_SUCH_NAME))
}

/// A structure by its name.
pub fn structure() -> impl TypedValueParser<Value = &'static Structure> {
    let values = structures().iter().map(|s| {
        let description = capitalised(s.description);
        PossibleValue::new(s.name.key).help(description)
    });
    PossibleValuesParser::new(values.collect::<Vec<_>>()).try_map(|name| Structure::by_name(&name).ok_or(NO_SUCH_NAME))
}

/// How a setting of the workbench is written as an option.
pub fn option(name: &str, value: Option<&str>) -> String {
    match value {
        Some(value) => format!("--{name} {value}"),
        None => format!("--{name}"),
    }
}

/// A given value, or `None` for `auto`: the value is then chosen from the data.
pub type Auto<T> = Option<T>;

/// `auto`, or what `parse` makes of the text.
fn auto<T>(text: &str, parse: impl Fn(&str) -> Option<T>, expected: &str) -> Result<Auto<T>, String> {
    match text {
        "auto" => Ok(None),
        _ => match parse(text) {
            Some(value) => Ok(Some(value)),
            None => Err(format!("expected 'auto' or {expected}")),
        },
    }
}

/// A number of a size with which there is no overflow, and for which `valid` holds.
fn number(text: &str, valid: impl Fn(f64) -> bool) -> Option<f64> {
    let number = text.parse().ok();
    number.filter(|v: &f64| (*v == 0.0 || SIZES.contains(&v.abs())) && valid(*v))
}

/// `auto` or a whole number from 0.
pub fn auto_count(text: &str) -> Result<Auto<usize>, String> {
    auto(text, |text| count(text).ok(), "a whole number from 0")
}

/// `auto` or a positive number.
pub fn auto_positive(text: &str) -> Result<Auto<f64>, String> {
    match text {
        "auto" => Ok(None),
        _ => positive(text).map(Some),
    }
}

/// `auto` or positive numbers separated by commas.
pub fn auto_positives(text: &str) -> Result<Auto<Vec<f64>>, String> {
    let numbers = |text: &str| text.split(',').map(|part| number(part.trim(), |v| v > 0.0)).collect();
    auto(text, numbers, "positive numbers separated by commas")
}

/// `auto` or a number from 0.
pub fn auto_number(text: &str) -> Result<Auto<f64>, String> {
    auto(text, |text| number(text, |v| v >= 0.0), "a number from 0")
}

/// `auto` or an order that the library takes.
pub fn auto_order(text: &str) -> Result<Auto<usize>, String> {
    auto_up_to(text, 0..=MOST_ORDER)
}

/// `auto` or a number of branches.
pub fn auto_branches(text: &str) -> Result<Auto<usize>, String> {
    auto_up_to(text, 1..=5)
}

fn auto_up_to(text: &str, range: RangeInclusive<usize>) -> Result<Auto<usize>, String> {
    let expected = format!("a whole number from {} to {}", range.start(), range.end());
    auto(text, |text| text.parse().ok().filter(|n| range.contains(n)), &expected)
}

/// A level between 0 and 1.
pub fn level(text: &str) -> Result<f64, String> {
    let level = number(text, |v| (0.5..=0.999).contains(&v));
    level.ok_or_else(|| format!("expected a number from 0.5 to 0.999{}", as_share(text)))
}

/// The share of a record that is kept from the fit.
pub fn fresh_share(text: &str) -> Result<f64, String> {
    let share = number(text, |v| (0.05..=0.9).contains(&v));
    share.ok_or_else(|| format!("expected a number from 0.05 to 0.9{}", as_share(text)))
}

/// A positive number.
pub fn positive(text: &str) -> Result<f64, String> {
    let sizes = || match text.parse().is_ok_and(|v: f64| v > 0.0 && v.is_finite()) {
        true => format!(" from {:e} to {:e}", SIZES.start(), SIZES.end()),
        false => without_unit(text),
    };
    number(text, |v| v > 0.0).ok_or_else(|| format!("expected a positive number{}", sizes()))
}

/// What to write in place of a number with a unit of time or frequency.
fn without_unit(text: &str) -> String {
    let end = text.trim_end_matches(|c: char| c.is_alphabetic()).len();
    let (digits, unit) = text.split_at(end);
    let value = number(digits.trim(), |v| v > 0.0);
    let to = |base| conversion(unit, base).ok();
    let converted = value.zip(to("s")).map(|(value, to_s)| to_s(value));
    let converted = converted.or_else(|| value.zip(to("Hz")).map(|(value, to_hz)| to_hz(value)));
    converted.map_or(String::new(), |value| {
        format!(" in s or Hz, without the unit: {}", decimal(value))
    })
}

/// What to write in place of a percentage.
fn as_share(text: &str) -> String {
    let percent = number(text.trim_end_matches('%').trim(), |v| v > 1.0 && v < 100.0);
    percent.map_or(String::new(), |percent| {
        format!("; {percent} % is {}", decimal(percent / 100.0))
    })
}

/// A positive number of a size that a machine has.
pub fn physical(text: &str) -> Result<f64, String> {
    let number = number(text, |v| (1e-9..=1e9).contains(&v));
    number.ok_or_else(|| "expected a positive number from 1e-9 to 1e9".to_owned())
}

/// A whole number from 0 that counts samples. No record has more than [`MOST_SAMPLES`].
pub fn count(text: &str) -> Result<usize, String> {
    whole::<0, MOST_SAMPLES>(text)
}

/// A whole number from 1, of samples.
pub fn count_from_one(text: &str) -> Result<usize, String> {
    whole::<1, MOST_SAMPLES>(text)
}

/// More samples than any record has.
pub const MOST_SAMPLES: usize = 1_000_000_000;

/// A whole number in a range.
pub fn whole<const LEAST: usize, const MOST: usize>(text: &str) -> Result<usize, String> {
    let count = text.parse().ok().filter(|n| (LEAST..=MOST).contains(n));
    // Only a number beyond the limit needs the message about the limit.
    let large = text.bytes().all(|b| b.is_ascii_digit()) && text.len() >= MOST.to_string().len();
    count.ok_or_else(|| match MOST == MOST_SAMPLES && !large {
        true => format!("expected a whole number from {LEAST}"),
        false => format!("expected a whole number from {LEAST} to {MOST}"),
    })
}

/// A size of memory, in bytes.
pub fn memory(text: &str) -> Result<u64, String> {
    let digits = text
        .find(|c: char| !c.is_ascii_digit() && c != '.')
        .unwrap_or(text.len());
    let (number, unit) = text.split_at(digits);
    let factor = match unit.trim().to_ascii_lowercase().as_str() {
        "" | "b" => Some(1.0),
        "k" | "kib" => Some(1024.0),
        "m" | "mib" => Some(f64::from(1 << 20)),
        "g" | "gib" => Some(f64::from(1 << 30)),
        "t" | "tib" => Some(1024.0 * f64::from(1 << 30)),
        "kb" => Some(1e3),
        "mb" => Some(1e6),
        "gb" => Some(1e9),
        "tb" => Some(1e12),
        _ => None,
    };
    let bytes = factor.and_then(|factor| Some(factor * number.parse::<f64>().ok()?));
    match bytes {
        Some(bytes) if (1.0..1e18).contains(&bytes) => Ok(bytes as u64),
        _ => Err("expected a size such as 500MiB or 8GiB".to_owned()),
    }
}

/// A whole even number from 2 to 20.
pub fn even_order(text: &str) -> Result<usize, String> {
    let order = whole::<2, 20>(text).ok().filter(|order| order % 2 == 0);
    order.ok_or_else(|| "expected an even number from 2 to 20".to_owned())
}

/// The choice of this name.
fn one_of<T: Copy>(text: &str, all: &[T], name: fn(T) -> &'static str) -> Result<T, String> {
    let names = || all.iter().map(|&choice| name(choice)).collect::<Vec<_>>().join(", ");
    let choice = all.iter().copied().find(|&choice| name(choice) == text);
    choice.ok_or_else(|| format!("expected one of {}", names()))
}

/// An estimator by name. The help describes each.
pub fn estimator() -> impl TypedValueParser<Value = EstimatorName> {
    let values = EstimatorName::ALL.map(|estimator| {
        let columns = match estimator.most_columns() {
            1 => "",
            _ => ", of several columns too",
        };
        PossibleValue::new(estimator.name()).help(format!("{}{columns}", capitalised(estimator.title())))
    });
    PossibleValuesParser::new(values).try_map(|name| EstimatorName::parse(&name).ok_or(NO_SUCH_NAME))
}

/// A rule that chooses a parameter, by name.
pub fn rule(text: &str) -> Result<Rule, String> {
    one_of(text, &Rule::ALL, Rule::name)
}

/// A kernel by name.
pub fn kernel(text: &str) -> Result<Kernel, String> {
    one_of(text, &Kernel::ALL, Kernel::name)
}

/// A point `X=PHI` at which the nonlinearity is known.
pub fn known_point(text: &str) -> Result<[f64; 2], String> {
    let point = text.split_once('=');
    let point = point.and_then(|(x, phi)| Some([number(x.trim(), |_| true)?, number(phi.trim(), |_| true)?]));
    point.ok_or_else(|| {
        "expected X=PHI, two numbers of a usual size (from 1e-100 to 1e100, or 0), for example 0=0".to_owned()
    })
}

/// Refuses two points that do not fix a scale and an offset.
pub fn distinct_points(points: &[[f64; 2]]) -> Result<(), Usage> {
    match points {
        [p, q] if p[0] == q[0] || p[1] == q[1] => Err(Usage(format!(
            "--known {}={} {}={}: the two points must differ in X and in PHI",
            p[0], p[1], q[0], q[1]
        ))),
        _ => Ok(()),
    }
}

/// Refuses an output that is also an input, and an input that is named twice.
pub fn distinct_inputs(inputs: &[&str], output: Option<&str>) -> Result<(), Usage> {
    if let Some(both) = inputs.iter().find(|input| output == Some(input)) {
        return Err(Usage(format!(
            "--input and --output are both '{both}'; name two different columns"
        )));
    }
    named_once("input", inputs)
}

/// Refuses a list of an option that has a name twice.
pub fn named_once(option: &str, names: &[impl AsRef<str>]) -> Result<(), Usage> {
    let mut seen = HashSet::new();
    match names.iter().map(AsRef::as_ref).find(|&name| !seen.insert(name)) {
        Some(name) => Err(Usage(format!("--{option} names '{name}' twice; name each once"))),
        None => Ok(()),
    }
}

/// The columns of a list, separated by commas.
pub fn columns(list: &str) -> Vec<&str> {
    list.split(',').map(str::trim).collect()
}
