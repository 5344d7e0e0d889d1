//! What is kept of an output: every number of short lists, and length, ends and sums of long ones.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde_json::{Map, Value, json};

/// A list that is longer is kept as its length, ends and sums.
const LONGEST: usize = 8;
/// Numbers are equal if they differ by less than this share, or by less than the second number; other processors round
/// elementary functions differently. `FLEXURE_SNAPSHOTS=exact` asks for equal numbers.
const TOLERANCE: [f64; 2] = [1e-6, 1e-9];

/// The numbers of a JSON value by their place in it; of sentences only the numbers in them.
pub fn digest(value: &Value) -> Value {
    match value {
        // A checksum changes with the last digit of any number.
        Value::Object(fields) => (fields.iter().filter(|(name, _)| *name != "crc32"))
            .map(|(name, v)| (name.clone(), digest(v)))
            .collect(),
        Value::Array(items) if items.len() > LONGEST => match items.iter().map(number).collect::<Option<Vec<f64>>>() {
            Some(numbers) => sums(&numbers),
            None if items.iter().all(Value::is_object) => digest(&columns(items)),
            None => sampled(items),
        },
        Value::Array(items) => items.iter().map(digest).collect(),
        Value::String(text) if text.contains(char::is_whitespace) => json!(numbers_in(text)),
        other => other.clone(),
    }
}

/// A number; NaN for null.
fn number(value: &Value) -> Option<f64> {
    if value.is_null() {
        Some(f64::NAN)
    } else {
        value.as_f64()
    }
}

/// Length, missing values, ends, sum, and sum weighted by the place.
fn sums(numbers: &[f64]) -> Value {
    let n = numbers.len();
    let finite = || numbers.iter().enumerate().filter(|(_, x)| x.is_finite());
    let weight = |i: usize| (i + 1) as f64 / n as f64;
    json!({
        "length": n,
        "missing": n - finite().count(),
        "ends": [numbers[0], numbers[n - 1]],
        "sum": finite().map(|(_, x)| x).sum::<f64>(),
        "weighted_sum": finite().map(|(i, x)| weight(i) * x).sum::<f64>(),
        "size": finite().map(|(_, x)| x.abs()).sum::<f64>(),
    })
}

/// The fields of many objects as lists.
fn columns(items: &[Value]) -> Value {
    let mut fields: BTreeMap<&String, Vec<Value>> = BTreeMap::new();
    for (name, value) in items.iter().filter_map(Value::as_object).flatten() {
        fields.entry(name).or_default().push(value.clone());
    }
    fields
        .into_iter()
        .map(|(name, values)| (name.clone(), Value::Array(values)))
        .collect()
}

/// Length, first and last of a list of mixed values.
fn sampled(items: &[Value]) -> Value {
    json!({ "length": items.len(), "first": digest(&items[0]), "last": digest(&items[items.len() - 1]) })
}

/// The numbers in a text, as written there.
pub fn numbers_in(text: &str) -> String {
    let parts = text.split(|c: char| !(c.is_ascii_alphanumeric() || "+-.".contains(c)));
    let numbers = parts
        .map(|part| part.trim_matches(['.', '+']))
        .filter(|part| part.parse::<f64>().is_ok());
    let numbers = numbers.filter(|part| part.contains(|c: char| c.is_ascii_digit()));
    numbers.collect::<Vec<_>>().join(" ")
}

/// The lines of a text that have numbers, as these numbers.
pub fn text(text: &str) -> Value {
    text.lines().map(numbers_in).filter(|line| !line.is_empty()).collect()
}

/// The columns of a CSV file with a header.
pub fn csv(text: &str) -> Value {
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let rows: Vec<Vec<f64>> = lines
        .map(|l| l.split(',').map(|x| x.parse().unwrap_or(f64::NAN)).collect())
        .collect();
    let column = |i: usize| Value::from(rows.iter().map(|row| row[i]).collect::<Vec<f64>>());
    names
        .iter()
        .enumerate()
        .map(|(i, name)| ((*name).to_owned(), digest(&column(i))))
        .collect()
}

/// The data of a page.
pub fn page(html: &str) -> Value {
    let data = html.split_once("id=\"page-data\">").map_or("null", |(_, rest)| rest);
    let data = data.split_once("</script>").map_or(data, |(data, _)| data);
    digest(&serde_json::from_str(data).unwrap())
}

/// Compares with what is stored; `FLEXURE_SNAPSHOTS=write` stores it instead, and keeps the numbers that agree with the stored ones, so
/// that only what changed shows as changed.
pub fn compare(name: &str, now: &Map<String, Value>) {
    let mode = std::env::var("FLEXURE_SNAPSHOTS").unwrap_or_default();
    let stored = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(format!("tests/snapshots/stored/{name}.json"));
    if mode == "write" {
        std::fs::create_dir_all(stored.parent().unwrap()).unwrap();
        let before = std::fs::read_to_string(&stored).ok();
        let before = before.map_or(Value::Null, |text| serde_json::from_str(&text).unwrap());
        let now = renewed(&before, &Value::Object(now.clone()));
        std::fs::write(stored, written(&now, "") + "\n").unwrap();
        return;
    }
    let before: Value = serde_json::from_str(&std::fs::read_to_string(&stored).unwrap()).unwrap();
    // Through text, as the stored one went.
    let now: Value = serde_json::from_str(&serde_json::to_string(now).unwrap()).unwrap();
    let (mut one, mut other) = (BTreeMap::new(), BTreeMap::new());
    flatten("", &before, &mut one);
    flatten("", &now, &mut other);
    let mut differences = Vec::new();
    for place in one.keys().chain(other.keys().filter(|k| !one.contains_key(*k))) {
        match (one.get(place), other.get(place)) {
            (Some(a), Some(b)) if equal(a, b, mode == "exact") => {}
            (a, b) => differences.push(format!("{place}: {a:?} became {b:?}")),
        }
    }
    assert!(
        differences.is_empty(),
        "{name}: {} differences\n{}",
        differences.len(),
        differences.join("\n")
    );
}

/// What is now, with the numbers of before where both agree.
fn renewed(before: &Value, now: &Value) -> Value {
    match (before, now) {
        (Value::Object(old), Value::Object(new)) => {
            let field = |(name, value): (&String, &Value)| {
                (name.clone(), renewed(old.get(name).unwrap_or(&Value::Null), value))
            };
            new.iter().map(field).collect()
        }
        (Value::Array(old), Value::Array(new)) if old.len() == new.len() => {
            old.iter().zip(new).map(|(old, new)| renewed(old, new)).collect()
        }
        (old, new) if equal(old, new, false) => old.clone(),
        (_, new) => new.clone(),
    }
}

/// JSON with a line for every value that fits into one.
fn written(value: &Value, indent: &str) -> String {
    let inline = value.to_string();
    let inner = format!("{indent} ");
    let (open, close, items) = match value {
        _ if inline.len() <= 160 => return inline,
        Value::Object(fields) => {
            let field = |(name, v): (&String, &Value)| format!("{}: {}", json!(name), written(v, &inner));
            ('{', '}', fields.iter().map(field).collect::<Vec<_>>())
        }
        Value::Array(items) => ('[', ']', items.iter().map(|v| written(v, &inner)).collect()),
        _ => return inline,
    };
    format!("{open}\n{inner}{}\n{indent}{close}", items.join(&format!(",\n{inner}")))
}

fn flatten(place: &str, value: &Value, into: &mut BTreeMap<String, Value>) {
    match value {
        Value::Object(fields) => fields
            .iter()
            .for_each(|(name, v)| flatten(&format!("{place}/{name}"), v, into)),
        Value::Array(items) => items
            .iter()
            .enumerate()
            .for_each(|(i, v)| flatten(&format!("{place}/{i}"), v, into)),
        other => drop(into.insert(place.to_owned(), other.clone())),
    }
}

fn equal(a: &Value, b: &Value, exactly: bool) -> bool {
    match (a.as_f64(), b.as_f64()) {
        (Some(a), Some(b)) if !exactly => {
            let [relative, absolute] = TOLERANCE;
            (a - b).abs() <= absolute.max(relative * a.abs().max(b.abs()))
        }
        _ => a == b,
    }
}
