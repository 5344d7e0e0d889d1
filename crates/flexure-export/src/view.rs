//! A program as values for the templates: every number is text that reads back as the same `f64`.

use flexure::linear::TransferFunction;
use flexure::model::{FeedbackModel, NarxModel, VolterraModel};
use flexure::nonlinearity::{Curve, Outside, Surface};
use minijinja::{Value, context};

use crate::program::{Kind, Program, Step};

/// The widest line of a table.
const WIDTH: usize = 110;

/// The steps of a program, for templates.
pub fn steps(program: &Program<'_>) -> Vec<Value> {
    let each = program.steps.iter().enumerate();
    each.map(|(k, s)| step(k, s, program.inputs + k)).collect()
}

fn step(k: usize, step: &Step<'_>, to: usize) -> Value {
    let data = match &step.kind {
        Kind::Curve(curve) => context! { kind => "curve", ..curve_data(curve) },
        Kind::Linear(system) => context! { kind => "linear", ..linear_data(system) },
        Kind::Surface(surface) => context! { kind => "surface", ..surface_data(surface) },
        Kind::Sum => context! { kind => "sum" },
        Kind::Offset(offset) => context! { kind => "offset", offset => number(*offset) },
        Kind::Feedback(model) => context! { kind => "feedback", ..feedback_data(model) },
        Kind::Narx(model) => context! { kind => "narx", ..narx_data(model) },
        Kind::Volterra(model) => context! { kind => "volterra", ..volterra_data(model) },
    };
    context! { k, to, from => &step.from, ..data }
}

fn curve_data(curve: &Curve) -> Value {
    let outside = match curve.outside() {
        Outside::Nan => 0,
        Outside::Nearest => 1,
        Outside::Linear => 2,
    };
    context! {
        tables => vec![table("x", curve.x()), table("y", curve.y())],
        points => curve.x().len(),
        outside,
    }
}

/// Numerator and denominator of one length, and the steady state.
pub struct Padded {
    /// The numerator.
    pub b: Vec<f64>,
    /// The denominator.
    pub a: Vec<f64>,
    /// The static gain; 0 where the system has none.
    pub gain: f64,
    /// Whether it has a steady state.
    pub steady: bool,
}

/// A linear system as it is run.
pub fn padded(system: &TransferFunction) -> Padded {
    let pad = |c: &[f64]| [c, &vec![0.0; system.states() + 1 - c.len()]].concat();
    let gain = system.static_gain();
    Padded {
        b: pad(system.b()),
        a: pad(system.a()),
        gain: if gain.is_finite() { gain } else { 0.0 },
        steady: gain.is_finite(),
    }
}

fn linear_data(system: &TransferFunction) -> Value {
    let Padded { b, a, gain, steady } = padded(system);
    context! {
        tables => vec![table("b", &b), table("a", &a)],
        order => system.states(),
        gain => number(gain),
        steady,
    }
}

fn surface_data(surface: &Surface) -> Value {
    let axes = surface.axes().iter();
    let axes = axes.map(
        |a| context! { low => number(a.low), high => number(a.high), pieces => a.pieces, splines => a.pieces + 3 },
    );
    context! {
        tables => vec![table("c", surface.coefficients())],
        axes => axes.collect::<Vec<Value>>(),
    }
}

fn feedback_data(model: &FeedbackModel) -> Value {
    let levels = model.levels;
    context! {
        order => model.order(),
        input => number(levels.input),
        nonlinearity => number(levels.nonlinearity),
        output => number(levels.output),
        entering => number(levels.entering),
        input_to_output => number(model.input_to_output),
        nonlinearity_to_output => number(model.nonlinearity_to_output),
        input_to_nonlinearity => number(model.input_to_nonlinearity),
        limit => number(model.run_away()),
        longest_rest => FeedbackModel::LONGEST_REST,
        at_rest => number(FeedbackModel::AT_REST),
        points => model.nonlinearity.x().len(),
        outside => curve_data(&model.nonlinearity).get_attr("outside").unwrap_or_default(),
        tables => vec![
            table("A", &model.state.concat()),
            table("Bu", &model.input_to_state),
            table("Bw", &model.nonlinearity_to_state),
            table("Cy", &model.state_to_output),
            table("Cz", &model.state_to_nonlinearity),
            table("x", model.nonlinearity.x()),
            table("y", model.nonlinearity.y()),
        ],
    }
}

fn narx_data(model: &NarxModel) -> Value {
    let [(u_mean, u_spread), (y_mean, y_spread)] = model.scales;
    let coefficients: Vec<f64> = model.terms.iter().map(|t| t.coefficient).collect();
    let factors: Vec<usize> = model.terms.iter().flat_map(|t| t.factors.clone()).collect();
    let lengths: Vec<usize> = model.terms.iter().map(|t| t.factors.len()).collect();
    context! {
        outputs => model.outputs,
        inputs => model.inputs,
        delay => model.delay,
        terms => model.terms.len(),
        constant => number(model.constant),
        low => number(model.held.0),
        high => number(model.held.1),
        held_mean => number(0.0_f64.clamp(model.held.0, model.held.1)),
        u_mean => number(u_mean),
        u_spread => number(u_spread),
        y_mean => number(y_mean),
        y_spread => number(y_spread),
        tables => vec![table("c", &coefficients), counts("factors", &factors), counts("lengths", &lengths)],
    }
}

fn volterra_data(model: &VolterraModel) -> Value {
    context! {
        delay => model.delay,
        memory => model.first.len().max(model.second_memory),
        first => model.first.len(),
        second => model.second_memory,
        level => number(model.input_level),
        constant => number(model.constant),
        tables => vec![table("h1", &model.first), table("h2", &model.second)],
    }
}

/// A number that C, Python and MATLAB read back as the same `f64`.
fn number(value: f64) -> String {
    format!("{value:?}")
}

fn table(name: &str, values: &[f64]) -> Value {
    context! { name, length => values.len(), lines => lines(values.iter().map(|v| number(*v))), whole => false }
}

fn counts(name: &str, values: &[usize]) -> Value {
    context! { name, length => values.len(), lines => lines(values.iter().map(usize::to_string)), whole => true }
}

/// The values with commas between them, in lines.
fn lines(values: impl Iterator<Item = String>) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for value in values {
        match lines.last_mut() {
            Some(line) if line.len() + value.len() + 2 <= WIDTH => {
                line.push_str(", ");
                line.push_str(&value);
            }
            _ => lines.push(value),
        }
    }
    lines
}
