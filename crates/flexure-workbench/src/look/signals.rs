//! Which columns are inputs and which is the output: by their names, or by their dependences.

use flexure::Record;
use flexure::look::{Dependence, Direction, Kind, Look, Relation, beside};
use flexure::preparation::fill;
use flexure::text::percent;

use super::Request;
use super::roles::{Role, is_setpoint, role};
use crate::text::quoted;

/// A column that follows another one with more than this coherent share is an output, or lies between that column and an output.
/// Convention.
const BETWEEN: f64 = 0.2;

/// The most columns that are tested for an effect beside the inputs. Convention.
const MOST_CANDIDATES: usize = 50;

/// The inputs and the output that an identification would take.
pub(super) struct Signals {
    pub inputs: Vec<usize>,
    pub output: usize,
    /// Other columns that depend on the inputs.
    pub others: Vec<usize>,
    /// How they were chosen, in a sentence.
    pub why: String,
}

/// The signals: the given columns, otherwise by their names, otherwise by their dependences.
pub(super) fn signals(request: &Request, look: &Look) -> Option<Signals> {
    let index = |name: &str| look.columns.iter().position(|c| c.name == name);
    let usable: Vec<usize> = (0..look.columns.len())
        .filter(|i| Some(*i) != look.time && look.columns[*i].is_signal())
        .collect();
    let given: Vec<usize> = request.inputs.iter().filter_map(|name| index(name)).collect();
    let output = request.output.and_then(index);
    if let (false, Some(output)) = (given.is_empty(), output) {
        return Some(Signals {
            inputs: given,
            output,
            others: Vec::new(),
            why: "You named the columns.".to_owned(),
        });
    }
    let named = |wanted: Role| -> Vec<usize> {
        // A second output with another number, such as y0 in addition to y, may be the output without noise.
        let of = |number: &dyn Fn(&str) -> bool| -> Vec<usize> {
            let says = |i: &&usize| role(&look.columns[**i].name).is_some_and(|(r, n)| r == wanted && number(n));
            usable.iter().filter(says).copied().collect()
        };
        match of(&|n| n.is_empty()) {
            plain if !plain.is_empty() => plain,
            _ => of(&|n| !n.is_empty()),
        }
    };
    let (inputs, outputs) = (named(Role::Input), named(Role::Output));
    let inputs = if given.is_empty() { inputs } else { given.clone() };
    let outputs = output.map_or(outputs, |o| vec![o]);
    if let (false, [output, others @ ..]) = (inputs.is_empty(), &outputs[..]) {
        return Some(Signals {
            inputs,
            output: *output,
            others: others.to_vec(),
            why: match given.is_empty() && request.output.is_none() {
                true => "The columns' names say which is the input and which the output.".to_owned(),
                false => "You named a column; the other one is named as its counterpart.".to_owned(),
            },
        });
    }
    // A setpoint acts through what its controller does.
    let is_target = |i: &usize| is_setpoint(&look.columns[*i].name) && !given.contains(i) && output != Some(*i);
    let (targets, others): (Vec<usize>, Vec<usize>) = usable.iter().partition(|i| is_target(i));
    let without = (!targets.is_empty())
        .then(|| by_dependence(look, &others, &given, output))
        .flatten();
    let left_out = |signals: Signals| {
        let names = quoted(targets.iter().map(|i| look.columns[*i].name.as_str()));
        let why = format!("{} Left out: {names}.", signals.why);
        Signals { why, ..signals }
    };
    without
        .map(left_out)
        .or_else(|| by_dependence(look, &usable, &given, output))
}

impl Signals {
    /// With columns that no pair shows to matter, but that explain more of the output beside the inputs.
    pub fn with_weak_inputs(mut self, look: &Look, record: &Record) -> Self {
        // Gaps at the ends stay.
        let samples = |i: usize| {
            let filled = fill(record.column(&look.columns[i].name).unwrap_or_default(), usize::MAX);
            filled.iter().all(|v| v.is_finite()).then_some(filled)
        };
        let is_alone = |i: &usize| {
            let is_of = |of: [usize; 2]| of.contains(i);
            let relations = look.relations.iter().map(|r| [r.column, r.of]);
            let dependences = look.dependences.iter().map(|d| [d.cause, d.effect]);
            !relations.chain(dependences).any(is_of)
        };
        let is_candidate = |i: &usize| {
            let column = &look.columns[*i];
            let is_used = *i == self.output || self.inputs.contains(i);
            Some(*i) != look.time && !is_used && column.is_signal() && !is_setpoint(&column.name) && is_alone(i)
        };
        let candidates = (0..look.columns.len()).filter(is_candidate).take(MOST_CANDIDATES);
        let candidates: Vec<(usize, Vec<f64>)> = candidates.filter_map(|i| Some((i, samples(i)?))).collect();
        if candidates.is_empty() {
            return self;
        }
        let delay = |input: usize| {
            let of = |d: &&Dependence| d.cause == input && d.effect == self.output;
            look.dependences
                .iter()
                .find(of)
                .map_or(0, |d| d.delay.saturating_sub(d.block - 1))
        };
        let known = self.inputs.iter().map(|&i| Some((samples(i)?, delay(i))));
        let (Some(known), Some(output)) = (known.collect::<Option<Vec<_>>>(), samples(self.output)) else {
            return self;
        };
        let inputs: Vec<(&[f64], usize)> = known.iter().map(|(u, delay)| (u.as_slice(), *delay)).collect();
        let others: Vec<&[f64]> = candidates.iter().map(|(_, u)| u.as_slice()).collect();
        let strong = inputs.len();
        for found in beside(&output, &inputs, &others) {
            let column = candidates[found.column].0;
            self.why.push_str(&format!(
                " '{}' explains more: {} of what {} {} is coherent with it.",
                look.columns[column].name,
                percent(found.coherent),
                quoted(self.inputs.iter().take(strong).map(|&i| look.columns[i].name.as_str())),
                if strong == 1 { "leaves" } else { "leave" }
            ));
            self.inputs.push(column);
        }
        self
    }
}

/// Inputs and output by their dependences: the output follows others most, and others follow it least.
fn by_dependence(look: &Look, usable: &[usize], given: &[usize], output: Option<usize>) -> Option<Signals> {
    let order = Order { look, usable, given };
    let best = output.or_else(|| order.last())?;
    let inputs = order.inputs(best);
    if inputs.is_empty() {
        return None;
    }
    let is_ordered = (order.dependences()).any(|d| d.effect == best && d.direction == Direction::Forward);
    let (_, away) = order.follows(best);
    let is_last = away == 0.0;
    let is_named = output.is_some() || !given.is_empty();
    let names: Vec<&str> = inputs.iter().map(|i| look.columns[*i].name.as_str()).collect();
    let is_other = |i: usize| order.is_output(i, best) || (i != best && order.lies_between(i, best));
    Some(Signals {
        others: (usable.iter().copied())
            .filter(|&i| is_other(i) && !inputs.contains(&i))
            .collect(),
        why: why(&look.columns[best].name, &names, [is_ordered, is_last], is_named),
        inputs,
        output: best,
    })
}

/// Which columns follow which, of those that are `usable`; the user named the inputs `given`.
struct Order<'a> {
    look: &'a Look,
    usable: &'a [usize],
    given: &'a [usize],
}

impl<'a> Order<'a> {
    /// The dependences, without those of columns that are multiples of others.
    fn dependences(&self) -> impl Iterator<Item = &'a Dependence> + use<'a> {
        let look = self.look;
        let is_multiple = move |i: usize| {
            (look.relations.iter()).any(|k| k.column == i && matches!(k.relation, Relation::Multiple { .. }))
        };
        (look.dependences.iter()).filter(move |d| !is_multiple(d.cause) && !is_multiple(d.effect))
    }

    /// How strongly a column follows others, and how strongly others follow it.
    fn follows(&self, i: usize) -> (f64, f64) {
        let strength = |d: &Dependence| match d.kind {
            Kind::Linear => d.coherent.max(f64::MIN_POSITIVE),
            Kind::Square => d.correlation.powi(2),
        };
        let towards = (self.dependences())
            .filter(|d| d.effect == i && !self.given.contains(&i))
            .filter(|d| d.kind == Kind::Square || d.direction != Direction::AtOnce || self.usable.len() == 2)
            .map(strength);
        let away = (self.dependences())
            .filter(|d| d.cause == i && d.direction == Direction::Forward)
            .map(strength);
        (towards.fold(0.0, f64::max), away.fold(0.0, f64::max))
    }

    /// The column that follows others most, after the named inputs if there are any; among equals, the last one.
    fn last(&self) -> Option<usize> {
        let leads = |i: usize, to: usize| self.dependences().any(|d| d.cause == i && d.effect == to);
        let is_behind = |i: usize| self.given.is_empty() || self.given.iter().any(|g| leads(*g, i));
        let candidates = self.usable.iter().copied().filter(|i| !self.given.contains(i));
        let scored = candidates.filter(|i| is_behind(*i)).filter_map(|i| {
            let (towards, away) = self.follows(i);
            (towards > 0.0).then_some((towards - away, i))
        });
        scored.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, i)| i)
    }

    /// The named inputs; otherwise all columns that lead to others and have no other role. A missing input does more harm than one without
    /// effect.
    fn inputs(&self, output: usize) -> Vec<usize> {
        if !self.given.is_empty() {
            return self.given.to_vec();
        }
        let leads = |i: usize| self.dependences().any(|d| d.cause == i);
        let is_derivative = |i: usize| self.look.relations.iter().any(|k| k.column == i);
        let is_input = |&i: &usize| {
            i != output && leads(i) && !self.is_output(i, output) && !self.lies_between(i, output) && !is_derivative(i)
        };
        let inputs: Vec<usize> = self.usable.iter().copied().filter(is_input).collect();
        if inputs.is_empty() {
            let causes = self.dependences().filter(|d| d.effect == output).map(|d| d.cause);
            return causes.filter(|cause| self.usable.contains(cause)).take(1).collect();
        }
        inputs
    }

    /// Whether a column follows others and leads none: it is another output.
    fn is_output(&self, i: usize, best: usize) -> bool {
        let (towards, away) = self.follows(i);
        i != best && towards > BETWEEN && away == 0.0
    }

    /// Whether a column follows another one with a delay: it lies between that and the output.
    fn lies_between(&self, i: usize, output: usize) -> bool {
        self.dependences().any(|d| {
            let is_later = d.block == 1 && d.delay > 0 && d.direction == Direction::Forward;
            d.effect == i && d.cause != output && is_later && d.coherent > BETWEEN
        })
    }
}

/// Why this column is the output: whether the lags show an order, whether no column follows this one, and whether the user named a column.
fn why(output: &str, inputs: &[&str], [is_ordered, is_last]: [bool; 2], is_named: bool) -> String {
    match (is_ordered, is_named) {
        (_, true) => "You named a column; the data show what it belongs to.".to_owned(),
        (true, _) => format!(
            "'{output}' follows {}{}: it is taken as the output.",
            quoted(inputs.iter().copied()),
            match is_last {
                true => format!(", and no other column follows '{output}'"),
                false => String::new(),
            }
        ),
        (false, _) => {
            "The lags do not tell which column is the cause, so the first column is taken as the input. Swap --input and --output if that is wrong."
                .to_owned()
        }
    }
}
