//! What `flexure look` does between reading and writing: the properties of a record, and the command that fits it.

mod findings;
mod joint;
mod joint_columns;
mod joint_trial;
mod page;
mod preparations;
mod roles;
mod signals;
mod suggestion;
mod text;

use anyhow::Result;
use flexure::look::{Clock, Dependence, Direction, Kind, Look, Relation, look};
use flexure_io::RecordFile;
use serde_json::{Value, json};

use crate::labels::Labels;
use preparations::even_behind_stamps;

pub use findings::{Finding, NOTED_JITTER};
pub use roles::is_current;
pub use suggestion::Suggestion;

/// What is asked of a record.
#[derive(Debug, Clone, Copy, Default)]
pub struct Request<'a> {
    /// The column of the instants, and the seconds that a unit of it lasts.
    pub time: Option<(&'a str, f64)>,
    /// The sample time in s, where it is given.
    pub sample_time: Option<f64>,
    /// The inputs, where they are given.
    pub inputs: &'a [&'a str],
    /// The output, where it is given.
    pub output: Option<&'a str>,
}

/// A record that was looked at.
pub struct Inspection<'a> {
    file: &'a RecordFile,
    /// What was seen.
    pub look: Look,
    /// The sample time in s; `None` if it is not known.
    pub sample_time: Option<f64>,
    /// Whether the samples are evenly spaced behind stamps that are not.
    is_even: bool,
    /// What is worth knowing, in sentences.
    pub findings: Vec<Finding>,
    /// The command to type next.
    pub suggestion: Option<Suggestion>,
    /// What to type or to say where nothing is suggested.
    pub remedy: &'static str,
    /// Two commands, of which one is to type next, and when each is.
    pub either: Option<[(&'static str, Suggestion); 2]>,
}

impl<'a> Inspection<'a> {
    /// Looks at a record.
    ///
    /// # Errors
    /// For columns that the record lacks or that are no signals.
    pub fn new(file: &'a RecordFile, request: &Request) -> Result<Self> {
        for name in request.inputs.iter().copied().chain(request.output) {
            file.column(name)?;
        }
        let nameless = nameless_instants(file, request);
        let request = &Request {
            time: request.time.or(nameless.map(|name| (name, 1.0))),
            ..*request
        };
        let time = request.time.map(|(name, _)| name);
        let seconds = request.time.map_or(1.0, |(_, seconds)| seconds);
        let instants = match time {
            Some(name) => Clock::new(file.column(name)?),
            None => None,
        };
        let is_even = instants
            .as_ref()
            .is_some_and(|clock| even_behind_stamps(file, time, clock).is_some());
        let measured = instants
            .zip(time)
            .map(|(clock, name)| usual_step(file, name, seconds, &clock));
        let sample_time = request.sample_time.or(measured);
        let look = look(&file.record, time, sample_time).map_err(|error| file.locate(error))?;
        let (mut suggestion, failure) = suggestion::suggestion(file, request, &look, sample_time);
        let unnamed = suggestion
            .iter_mut()
            .flat_map(|suggestion| nameless.map(|name| (suggestion, name)));
        unnamed.for_each(|(suggestion, name)| suggestion.options.extend(["--time", name].map(str::to_owned)));
        let remedy = match &failure {
            Some(failure) if failure.is_too_fast => "flexure excite ARM.toml --max-torque TAU -o torques.csv",
            Some(_) if file.unread_instants().is_some() && look.time.is_none() => {
                "the same with --time-format FORMAT, as the stamps are written"
            }
            _ => "the same with --input A --output Y, where you expect column Y to follow column A",
        };
        let mut findings = findings::findings(file, &look, seconds, sample_time);
        let taken = nameless.map(|name| Finding {
            text: match file.is_nameless() {
                true => format!("'{name}' has no name and rises evenly: it is taken as the sample instants in s (--time {name})."),
                false => format!(
                    "'{name}' rises evenly, and no column is named as the time: it is taken as the sample instants in s (--time {name})."
                ),
            },
            warning: false,
        });
        findings.splice(0..0, taken);
        findings.extend(failure.map(|failure| Finding {
            text: failure.text,
            warning: true,
        }));
        Ok(Inspection {
            findings,
            remedy,
            either: suggestion::of_dates(file, request, &look),
            suggestion,
            file,
            look,
            sample_time,
            is_even,
        })
    }

    /// The name of a column.
    fn name(&self, column: usize) -> &str {
        &self.look.columns[column].name
    }

    /// A column's name with its unit.
    fn labelled(&self, column: usize) -> String {
        Labels::new(self.file).of(self.name(column))
    }

    /// The dependences that say something new: dependences of derivatives, and those between nearly equal columns, are left out.
    fn dependences(&self) -> Vec<&Dependence> {
        let is_derivative = |i: usize| {
            (self.look.relations.iter()).any(|k| k.column == i && matches!(k.relation, Relation::Derivative { .. }))
        };
        let are_kin = |d: &Dependence| {
            let both = [d.cause, d.effect];
            self.look
                .relations
                .iter()
                .any(|k| both.contains(&k.column) && both.contains(&k.of))
        };
        let new = |d: &&Dependence| !is_derivative(d.cause) && !is_derivative(d.effect) && !are_kin(d);
        self.look.dependences.iter().filter(new).collect()
    }

    /// Whether a column is a signal, and not the instants.
    fn is_signal(&self, column: usize) -> bool {
        Some(column) != self.look.time && self.look.columns[column].is_signal()
    }

    /// The object that `flexure look --json` prints; `next` is the command as it is typed.
    pub fn json(&self, next: Option<String>) -> Value {
        let columns = self.look.columns.iter().enumerate().map(|(i, c)| {
            let stop = |stop: Option<flexure::look::Stop>| {
                stop.map(|s| json!({ "value": s.value, "samples": s.samples, "longest": s.longest }))
            };
            json!({
                "name": c.name,
                "unit": self.file.units.get(i).cloned().flatten(),
                "signal": self.is_signal(i),
                "samples": c.samples,
                "missing": c.missing,
                "infinite": c.infinite,
                "least": c.least,
                "greatest": c.greatest,
                "mean": c.mean,
                "deviation": c.deviation,
                "constant": c.constant,
                "counts": c.counts,
                "levels": c.levels,
                "quantisation": c.quantisation.map(|q| json!({ "step": q.step, "share": q.share })),
                "lower_stop": stop(c.lower_stop),
                "upper_stop": stop(c.upper_stop),
                "outliers": c.outliers,
                "power_below": self.power_below(i),
            })
        });
        let pair = |i: usize, j: usize| json!({ "input": self.name(i), "output": self.name(j) });
        json!({
            "file": self.file.name(),
            "samples": self.file.record.len(),
            "sample_time": self.sample_time,
            "time": self.look.time.map(|i| self.name(i)),
            "clock": self.look.clock.as_ref().map(|c| json!({
                "jitter": c.jitter,
                "gaps": c.gaps.iter().map(|g| json!({ "sample": g.sample, "steps": g.steps })).collect::<Vec<_>>(),
                "backwards": c.backwards,
                "missing": c.missing,
            })),
            "columns": columns.collect::<Vec<_>>(),
            "dependences": self.look.dependences.iter().map(|d| self.dependence_json(d)).collect::<Vec<_>>(),
            "integrations": self.look.integrations.iter().map(|i| pair(i.input, i.output)).collect::<Vec<_>>(),
            "findings": self.findings.iter().map(|f| f.text.as_str()).collect::<Vec<_>>(),
            "next": self.suggestion.as_ref().map(|s| json!({
                "command": next,
                "why": s.why,
                "notes": s.notes,
            })),
        })
    }

    fn dependence_json(&self, d: &Dependence) -> Value {
        json!({
            "cause": self.name(d.cause),
            "effect": self.name(d.effect),
            "kind": match d.kind { Kind::Linear => "linear", Kind::Square => "square" },
            "direction": match d.direction {
                Direction::Forward => "forward",
                Direction::AtOnce => "at-once",
                Direction::Both => "both",
            },
            "delay": d.delay,
            "delay_within": d.block,
            "correlation": d.correlation,
            "coherent_share": d.coherent,
            "p_value": d.p_value,
        })
    }

    /// The frequency below which 95 % of a column's power lies: Hz, or cycles a sample.
    fn power_below(&self, column: usize) -> Option<f64> {
        let spectrum = self.look.columns[column].spectrum.as_ref()?;
        Some(spectrum.below(MOST_POWER) / self.sample_time.unwrap_or(1.0))
    }

    fn frequency_unit(&self) -> &'static str {
        match self.sample_time {
            Some(_) => "Hz",
            None => "cycles/sample",
        }
    }
}

/// The column that is taken as the instants, where no name says which one has them: of a file without names, or with a name that says nothing
/// else.
fn nameless_instants<'a>(file: &'a RecordFile, request: &Request) -> Option<&'a str> {
    let is_used = |name: &str| request.inputs.contains(&name) || request.output == Some(name);
    let is_open = request.time.is_none() && request.sample_time.is_none();
    let says_nothing = |name: &str| file.is_nameless() || roles::role(name).is_none();
    file.nameless_instants()
        .filter(|name| is_open && !is_used(name) && says_nothing(name))
}

/// The time between two samples in s.
fn usual_step(file: &RecordFile, time: &str, seconds: f64, clock: &Clock) -> f64 {
    let even = even_behind_stamps(file, Some(time), clock);
    let step = even.map_or_else(|| clock.usual_step(file.record.len()), |even| even.step);
    tidy(seconds * step)
}

/// A number without the rounding error of printed instants.
fn tidy(value: f64) -> f64 {
    format!("{value:.8e}").parse().unwrap_or(value)
}

/// The share of a column's power that counts as nearly all.
const MOST_POWER: f64 = 0.95;
