//! Python code that does what a command does, for the end of a page.

use std::io::Read as _;
use std::path::Path;

use flexure::identify::{Calibration, HammersteinMethod, Options, RegressionLag, Structure};
use flexure::nonlinearity::{EstimatorName, Kernel};
use flexure::text::capitalised;
use flexure_io::RecordFile;
use serde_json::json;

/// The longest header that is looked at, bytes.
const LONGEST_HEADER: u64 = 1 << 16;

/// A call of a function or a class, with the given arguments.
pub struct Call {
    name: String,
    arguments: Vec<String>,
}

impl Call {
    /// A call without arguments.
    pub fn new(name: impl Into<String>) -> Self {
        Call {
            name: name.into(),
            arguments: Vec::new(),
        }
    }

    /// An argument by its place; text and lists are written as in JSON, which is Python too.
    pub fn by_place(mut self, value: impl Into<serde_json::Value>) -> Self {
        self.arguments.push(value.into().to_string());
        self
    }

    /// An argument by name, where it is given.
    pub fn with<T: Into<serde_json::Value>>(mut self, name: &str, value: Option<T>) -> Self {
        if let Some(value) = value {
            self.arguments.push(format!("{name}={}", value.into()));
        }
        self
    }

    /// A flag, where it is set.
    pub fn flag(mut self, name: &str, is_set: bool) -> Self {
        if is_set {
            self.arguments.push(format!("{name}=True"));
        }
        self
    }

    /// An argument that is Python code.
    pub fn code(mut self, code: &str) -> Self {
        self.arguments.push(code.to_owned());
        self
    }

    /// The call as Python code.
    pub fn text(&self) -> String {
        format!("{}({})", self.name, self.arguments.join(", "))
    }
}

/// The lines that import the modules and read the table `record`; `None` if pandas would read another table from the file.
pub fn reading(file: &RecordFile, columns: &[&str]) -> Option<String> {
    let extension = file.path.extension()?.to_str()?.to_ascii_lowercase();
    let reader = match extension.as_str() {
        "csv" if has_plain_header(&file.path, columns) && file.notes.is_empty() => "read_csv",
        "parquet" if columns.iter().all(|name| file.unit(name).is_none()) => "read_parquet",
        _ => return None,
    };
    let path = json!(file.path.to_str()?);
    Some(format!(
        "import flexure\nimport pandas\n\nrecord = pandas.{reader}({path})\n"
    ))
}

/// Whether the first line has these columns' exact names, separated by commas.
fn has_plain_header(path: &Path, columns: &[&str]) -> bool {
    // A pipe can be read only once.
    if !path.is_file() {
        return false;
    }
    let Ok(file) = std::fs::File::open(path) else {
        return false;
    };
    let text = std::io::BufReader::new(file.take(LONGEST_HEADER));
    let first = std::io::BufRead::lines(text).next().and_then(Result::ok);
    first.is_some_and(|line| {
        let names: Vec<&str> = line.trim_end_matches('\r').split(',').collect();
        columns.iter().all(|name| names.contains(name))
    })
}

/// The class of a structure, with the options that differ from its defaults; `None` if Python lacks the structure or an option.
pub fn estimator(structure: &Structure, options: &Options) -> Option<Call> {
    let key = structure.name.key;
    let call = Call::new(format!("flexure.{}", class(key)));
    let defaults = Options::default();
    let fresh = (options.fresh_share != defaults.fresh_share).then_some(options.fresh_share);
    let call = call.with("fresh", fresh).with("branches", options.branches);
    let call = call.flag("robust", options.robust).flag("missing", options.missing);
    match key {
        "hammerstein" => hammerstein(call, &options.hammerstein),
        _ => Some(call),
    }
}

/// The name of a structure's class: that of the structure without its hyphens, each word with a capital.
fn class(key: &str) -> String {
    match key {
        "narx" => "NARX".to_owned(),
        _ => key.split('-').map(capitalised).collect(),
    }
}

fn hammerstein(call: Call, method: &HammersteinMethod) -> Option<Call> {
    match method {
        HammersteinMethod::Refined(own) => {
            if own.start != EstimatorName::Kernel {
                return None;
            }
            let call = call.with("order", own.order).with("delay", own.delay);
            let form = own.form.map(|form| form.to_string());
            Some(calibrated(call, &own.calibration).with("form", form))
        }
        HammersteinMethod::Plain(own) => {
            let lag = match own.regression_lag {
                RegressionLag::Strongest => None,
                RegressionLag::At(lag) => Some(lag),
                RegressionLag::Delay => return None,
            };
            let estimator = (own.estimator != EstimatorName::Kernel).then(|| own.estimator.name());
            let kernel = (own.kernel != Kernel::default()).then(|| own.kernel.name());
            let call = call
                .with("method", Some("plain"))
                .with("order", own.order)
                .with("delay", own.delay);
            let call = calibrated(call, &own.calibration)
                .with("nonlinearity", estimator)
                .with("kernel", kernel)
                .with("parameter", own.parameter)
                .with("lag", lag);
            Some(call.flag("ignore_colour", own.ignore_colour))
        }
    }
}

fn calibrated(call: Call, calibration: &Calibration) -> Call {
    match calibration {
        Calibration::UnitStaticGain => call,
        Calibration::UnitFirstCoefficient => call.with("unit", Some("first-coefficient")),
        Calibration::TwoPoints { x, phi } => call.with("known", Some(json!([[x[0], phi[0]], [x[1], phi[1]]]))),
    }
}

/// One name as text, several as a list.
pub fn names(names: &[&str]) -> serde_json::Value {
    match names {
        [one] => json!(one),
        several => json!(several),
    }
}
