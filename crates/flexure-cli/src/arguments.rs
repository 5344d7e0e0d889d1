//! Values on the command line, checked while they are read, so that wrong ones are wrong usage.

use std::str::FromStr;

use anyhow::{Result, bail};
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use flexure::identify::hammerstein::MOST_ORDER;
use flexure::identify::{Structure, structures};
use flexure::nonlinearity::{EstimatorName, Kernel, Rule};
use flexure_io::{ModelFile, RecordFile};
use flexure_workbench::Named;
use flexure_workbench::text::capitalised;

/// The column of sample instants in records that Flexure writes, and looks for in others.
pub const TIME: &str = "t";
/// Relative difference of two sample times that still counts as none (printed digits).
pub const SAME_SAMPLE_TIME: f64 = 1e-3;

/// The options contradict each other: wrong usage, found only after they were read one by one.
#[derive(Debug)]
pub struct Usage(pub String);

impl std::fmt::Display for Usage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}\n\nFor more information, try '--help'.", self.0)
    }
}

impl std::error::Error for Usage {}

/// A parser of the names of choices, whose help lists them.
pub fn named<T: Named>() -> impl TypedValueParser<Value = T> {
    let values = T::ALL
        .iter()
        .map(|choice| PossibleValue::new(choice.name()).help(choice.description()));
    PossibleValuesParser::new(values.collect::<Vec<_>>()).try_map(|name| T::parse(&name).ok_or(Unknown))
}

/// A structure by its name.
pub fn structure() -> impl TypedValueParser<Value = &'static Structure> {
    let values = structures().iter().map(|s| {
        let description = capitalised(s.description);
        PossibleValue::new(s.name.key).help(description)
    });
    PossibleValuesParser::new(values.collect::<Vec<_>>()).try_map(|name| Structure::by_name(&name).ok_or(Unknown))
}

/// A name that no choice has; the parser of the names finds it first.
#[derive(Debug)]
pub struct Unknown;

impl std::fmt::Display for Unknown {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("there is no such name")
    }
}

impl std::error::Error for Unknown {}

/// How a setting of the workbench is written as an option.
pub fn option(name: &str, value: Option<&str>) -> String {
    match value {
        Some(value) => format!("--{name} {value}"),
        None => format!("--{name}"),
    }
}

/// `auto` or a value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Auto<T> {
    /// Choose it from data.
    Auto,
    /// Take this.
    Given(T),
}

impl<T> Auto<T> {
    /// The value, if one was given.
    pub fn given(self) -> Option<T> {
        match self {
            Auto::Auto => None,
            Auto::Given(value) => Some(value),
        }
    }
}

/// `auto` or a whole number from 0.
pub fn auto_count(text: &str) -> Result<Auto<usize>, String> {
    if text == "auto" {
        return Ok(Auto::Auto);
    }
    text.parse()
        .map(Auto::Given)
        .map_err(|_| "expected 'auto' or a whole number from 0".to_owned())
}

/// `auto` or a positive number.
pub fn auto_positive(text: &str) -> Result<Auto<f64>, String> {
    if text == "auto" {
        Ok(Auto::Auto)
    } else {
        positive(text).map(Auto::Given)
    }
}

/// `auto` or positive numbers separated by commas.
pub fn auto_positives(text: &str) -> Result<Auto<Vec<f64>>, String> {
    if text == "auto" {
        return Ok(Auto::Auto);
    }
    let numbers: Result<Vec<f64>, String> = text.split(',').map(|part| positive(part.trim())).collect();
    numbers
        .map(Auto::Given)
        .map_err(|_| "expected 'auto' or positive numbers separated by commas".to_owned())
}

/// `auto` or a number from 0.
pub fn auto_number(text: &str) -> Result<Auto<f64>, String> {
    if text == "auto" {
        return Ok(Auto::Auto);
    }
    match f64::from_str(text) {
        Ok(value) if value >= 0.0 && value.is_finite() => Ok(Auto::Given(value)),
        _ => Err("expected 'auto' or a number from 0".to_owned()),
    }
}

/// A level between 0 and 1.
pub fn level(text: &str) -> Result<f64, String> {
    match f64::from_str(text) {
        Ok(value) if (0.5..=0.999).contains(&value) => Ok(value),
        _ => Err("expected a number from 0.5 to 0.999".to_owned()),
    }
}

/// An estimator by name.
pub fn estimator(text: &str) -> Result<EstimatorName, String> {
    EstimatorName::parse(text).ok_or_else(|| {
        let names: Vec<&str> = EstimatorName::ALL.iter().map(|e| e.name()).collect();
        format!("expected one of {}", names.join(", "))
    })
}

/// A rule that chooses a parameter, by name.
pub fn rule(text: &str) -> Result<Rule, String> {
    Rule::parse(text).ok_or_else(|| {
        let names: Vec<&str> = Rule::ALL.iter().map(|r| r.name()).collect();
        format!("expected one of {}", names.join(", "))
    })
}

/// A positive, finite number.
pub fn positive(text: &str) -> Result<f64, String> {
    match f64::from_str(text) {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("expected a positive number".to_owned()),
    }
}

/// A whole number from 0.
pub fn count(text: &str) -> Result<usize, String> {
    text.parse().map_err(|_| "expected a whole number from 0".to_owned())
}

/// A whole number from 1.
pub fn count_from_one(text: &str) -> Result<usize, String> {
    let count = text.parse().ok().filter(|n| *n >= 1);
    count.ok_or_else(|| "expected a whole number from 1".to_owned())
}

/// The share of a record that is kept from the fit.
pub fn fresh_share(text: &str) -> Result<f64, String> {
    match f64::from_str(text) {
        Ok(share) if (0.05..=0.9).contains(&share) => Ok(share),
        _ => Err("expected a number from 0.05 to 0.9".to_owned()),
    }
}

/// `auto` or an order that the library takes.
pub fn auto_order(text: &str) -> Result<Auto<usize>, String> {
    match auto_count(text) {
        Ok(order) if order.given().is_none_or(|n| n <= MOST_ORDER) => Ok(order),
        _ => Err(format!("expected 'auto' or a whole number from 0 to {MOST_ORDER}")),
    }
}

/// `auto` or a number of branches.
pub fn auto_branches(text: &str) -> Result<Auto<usize>, String> {
    match auto_count(text) {
        Ok(branches) if branches.given().is_none_or(|n| (1..=5).contains(&n)) => Ok(branches),
        _ => Err("expected 'auto' or a whole number from 1 to 5".to_owned()),
    }
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
    for (i, input) in inputs.iter().enumerate() {
        if output == Some(input) {
            return Err(Usage(format!(
                "--input and --output are both '{input}'; name two different columns"
            )));
        }
        if inputs[..i].contains(input) {
            return Err(Usage(format!("--input names '{input}' twice; name every column once")));
        }
    }
    Ok(())
}

/// A kernel by name.
pub fn kernel(text: &str) -> Result<Kernel, String> {
    Kernel::ALL.into_iter().find(|k| k.name() == text).ok_or_else(|| {
        let names: Vec<&str> = Kernel::ALL.iter().map(|k| k.name()).collect();
        format!("expected one of {}", names.join(", "))
    })
}

/// A point `X=PHI` at which the nonlinearity is known.
pub fn known_point(text: &str) -> Result<[f64; 2], String> {
    let number = |t: &str| f64::from_str(t.trim()).ok().filter(|v| v.is_finite());
    match text.split_once('=').map(|(x, phi)| (number(x), number(phi))) {
        Some((Some(x), Some(phi))) => Ok([x, phi]),
        _ => Err("expected X=PHI, two numbers, for example 0=0".to_owned()),
    }
}

/// Whether a record has a column of sample instants: one named `t` that is none of the `signals` in use.
pub fn has_time(file: &RecordFile, signals: &[&str]) -> bool {
    !signals.contains(&TIME) && file.record.names().iter().any(|n| n == TIME)
}

/// The sample time of a record in s: as given, or from its column `t`, unless that is one of the `signals`; `None` if
/// neither tells.
pub fn sample_time(file: &RecordFile, given: Option<f64>, signals: &[&str]) -> Result<Option<f64>> {
    let recorded = match has_time(file, signals) {
        true => Some(file.sample_time(TIME)?),
        false => None,
    };
    if let (Some(given), Some(recorded)) = (given, recorded)
        && (given - recorded).abs() > SAME_SAMPLE_TIME * recorded
    {
        bail!(
            "{}: column '{TIME}' has a sample time of {recorded} s, but --sample-time says {given} s; leave the option out or correct the column",
            file.path.display()
        );
    }
    Ok(given.or(recorded))
}

/// Refuses a record whose sample time is not the model's; `signals` are the columns in use.
pub fn same_sample_time(file: &RecordFile, model: Option<f64>, signals: &[&str]) -> Result<()> {
    if let (Some(model), Some(recorded)) = (model, sample_time(file, None, signals)?)
        && (model - recorded).abs() > SAME_SAMPLE_TIME * model
    {
        bail!(
            "{}: the sample time is {recorded} s, but the model was identified at {model} s; resample the record",
            file.path.display()
        );
    }
    Ok(())
}

/// The columns of a list, separated by commas.
pub fn columns(list: &str) -> Vec<&str> {
    list.split(',').map(str::trim).collect()
}

/// The columns that enter a model: a list in `given` for a model of several inputs.
pub fn model_inputs<'a>(model: &ModelFile, given: &'a str) -> Result<Vec<&'a str>, Usage> {
    let needed = model.block.inputs();
    let names = match needed {
        1 => vec![given],
        _ => columns(given),
    };
    if names.len() != needed {
        return Err(Usage(format!(
            "--input names {} of the model's {needed} inputs; give them all, separated by commas, in the model's order: {}",
            names.len(),
            model.inputs.join(",")
        )));
    }
    Ok(names)
}
