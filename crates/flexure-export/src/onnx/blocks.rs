//! The blocks of a model as operations of one sample.

use flexure::linear::TransferFunction;
use flexure::model::{FeedbackModel, NarxModel, VolterraModel};
use flexure::nonlinearity::{Curve, Outside, Surface};

use super::Graph;
use super::proto::{Dimension, Message, Type, body, node, value};
use crate::view::{Padded, padded};

/// What one sample of a loop gives.
struct LoopStep {
    output: String,
    entering: String,
    state: String,
}

/// The constants of a loop.
struct LoopData {
    a: String,
    bu: String,
    bw: String,
    cy: String,
    cz: String,
}

impl Graph {
    pub(super) fn curve(&mut self, curve: &Curve, u: &str) -> String {
        let (x, y) = (curve.x(), curve.y());
        let last = x.len() - 1;
        let inside = match last {
            0 => {
                let (only, unknown) = (self.scalar(y[0]), self.op("IsNaN", &[u]));
                let nan = self.scalar(f64::NAN);
                self.op("Where", &[&unknown, &nan, &only])
            }
            _ => self.on_segment(x, y, u),
        };
        if curve.outside() == Outside::Linear {
            return inside;
        }
        let (first, end) = (self.scalar(x[0]), self.scalar(x[last]));
        let (below, above) = (self.op("Less", &[u, &first]), self.op("Greater", &[u, &end]));
        let (low, high) = match curve.outside() {
            Outside::Nearest => (y[0], y[last]),
            _ => (f64::NAN, f64::NAN),
        };
        let (low, high) = (self.scalar(low), self.scalar(high));
        let held = self.op("Where", &[&above, &high, &inside]);
        self.op("Where", &[&below, &low, &held])
    }

    /// The straight line through the two points around `u`, or through the two nearest.
    fn on_segment(&mut self, x: &[f64], y: &[f64], u: &str) -> String {
        let (xs, ys) = (self.vector(x), self.vector(y));
        let left_of = self.op("LessOrEqual", &[&xs, u]);
        let left_of = self.cast(&left_of, Type::Int64);
        let count = self.reduce("ReduceSum", &left_of);
        let (zero, one, most) = (self.index(0), self.index(1), self.index(x.len() - 2));
        let i = self.op("Sub", &[&count, &one]);
        let i = self.op("Max", &[&i, &zero]);
        let i = self.op("Min", &[&i, &most]);
        let next = self.op("Add", &[&i, &one]);
        let [x0, x1] = [&i, &next].map(|k| self.op("Gather", &[&xs, k]));
        let [y0, y1] = [&i, &next].map(|k| self.op("Gather", &[&ys, k]));
        let (run, rise, along) = (
            self.op("Sub", &[&x1, &x0]),
            self.op("Sub", &[&y1, &y0]),
            self.op("Sub", &[u, &x0]),
        );
        let share = self.op("Div", &[&along, &run]);
        let climbed = self.op("Mul", &[&share, &rise]);
        self.op("Add", &[&y0, &climbed])
    }

    pub(super) fn linear(&mut self, system: &TransferFunction, u: &str, started: &str) -> String {
        let Padded { b, a, gain, steady } = padded(system);
        let order = system.states();
        let level = if steady {
            let (before, slot) = self.state(Type::Double, None);
            let level = self.op("Where", &[started, &before, u]);
            self.carry(slot, level.clone());
            level
        } else {
            self.scalar(0.0)
        };
        let v = self.op("Sub", &[u, &level]);
        let b0 = self.scalar(b[0]);
        let mut y = self.op("Mul", &[&b0, &v]);
        if order > 0 {
            let (s, slot) = self.state(Type::Double, Some(order + 1));
            let front = self.gather(&s, 0);
            y = self.op("Add", &[&y, &front]);
            let (b, a, zero) = (self.vector(&b[1..]), self.vector(&a[1..]), self.vector(&[0.0]));
            let (bu, ay) = (self.op("Mul", &[&b, &v]), self.op("Mul", &[&a, &y]));
            let next = self.slice(&s, 1, order + 1);
            let next = self.op("Add", &[&next, &bu]);
            let next = self.op("Sub", &[&next, &ay]);
            let next = self.concat(&[&next, &zero]);
            self.carry(slot, next);
        }
        let gain = self.scalar(gain);
        let steady_output = self.op("Mul", &[&gain, &level]);
        self.op("Add", &[&y, &steady_output])
    }

    pub(super) fn surface(&mut self, surface: &Surface, at: &[&str]) -> String {
        let (mut weights, mut indices) = (self.vector(&[1.0]), self.indices(&[0], &[1]));
        let mut unknown = self.op("IsNaN", &[at[0]]);
        let flat = self.constant(Type::Int64, &[1], &(-1_i64).to_le_bytes());
        let column = self.indices(&[1], &[1]);
        let four = self.indices(&[0, 1, 2, 3], &[4]);
        for (axis, x) in surface.axes().iter().zip(at) {
            let nan = self.op("IsNaN", &[x]);
            unknown = self.op("Or", &[&unknown, &nan]);
            let low = self.scalar(axis.low);
            let x = self.op("Where", &[&nan, &low, x]);
            let (width, pieces) = (self.scalar(axis.high - axis.low), self.scalar(axis.pieces as f64));
            let place = self.op("Sub", &[&x, &low]);
            let place = self.op("Div", &[&place, &width]);
            let place = self.op("Mul", &[&place, &pieces]);
            let place = self.held(&place, 0.0, axis.pieces as f64);
            let first = self.cast(&place, Type::Int64);
            let most = self.index(axis.pieces - 1);
            let first = self.op("Min", &[&first, &most]);
            let left = self.cast(&first, Type::Double);
            let t = self.op("Sub", &[&place, &left]);
            let values = self.splines(&t);
            let along = self.op("Add", &[&four, &first]);
            let splines = self.index(axis.pieces + 3);
            let (w, j) = (
                self.op("Unsqueeze", &[&weights, &column]),
                self.op("Mul", &[&indices, &splines]),
            );
            let j = self.op("Unsqueeze", &[&j, &column]);
            let (w, j) = (self.op("Mul", &[&w, &values]), self.op("Add", &[&j, &along]));
            weights = self.op("Reshape", &[&w, &flat]);
            indices = self.op("Reshape", &[&j, &flat]);
        }
        let coefficients = self.vector(surface.coefficients());
        let coefficients = self.op("Gather", &[&coefficients, &indices]);
        let sum = self.dot(&weights, &coefficients);
        let nan = self.scalar(f64::NAN);
        self.op("Where", &[&unknown, &nan, &sum])
    }

    /// The four cubic B-splines at `t` within a piece: the powers of t times a matrix.
    fn splines(&mut self, t: &str) -> String {
        let one = self.scalar(1.0);
        let t2 = self.op("Mul", &[t, t]);
        let t3 = self.op("Mul", &[&t2, t]);
        let powers: Vec<String> = [&one, t, &t2, &t3].map(|p| self.lifted(p)).into();
        let powers = self.concat(&powers.iter().map(String::as_str).collect::<Vec<_>>());
        let matrix = [
            [1.0, 4.0, 1.0, 0.0],
            [-3.0, 0.0, 3.0, 0.0],
            [3.0, -6.0, 3.0, 0.0],
            [-1.0, 3.0, -3.0, 1.0],
        ];
        let matrix = self.array(&matrix.concat(), &[4, 4]);
        let (product, six) = (self.op("MatMul", &[&powers, &matrix]), self.scalar(6.0));
        self.op("Div", &[&product, &six])
    }

    pub(super) fn feedback(&mut self, model: &FeedbackModel, u: &str, started: &str) -> String {
        let n = model.order();
        let data = LoopData {
            a: self.array(&model.state.concat(), &[n, n]),
            bu: self.vector(&model.input_to_state),
            bw: self.vector(&model.nonlinearity_to_state),
            cy: self.vector(&model.state_to_output),
            cz: self.vector(&model.state_to_nonlinearity),
        };
        let (state, slot) = self.state(Type::Double, Some(n));
        let (away, away_slot) = self.state(Type::Bool, None);
        let rest = self.rest(model, &data, u, started);
        let from = self.op("Where", &[started, &state, &rest]);
        let step = self.loop_step(model, &data, &from, u);
        self.carry(slot, step.state);
        let within = self.within(model, &step.output);
        let entering = self.within(model, &step.entering);
        let within = self.op("And", &[&within, &entering]);
        let out = self.op("Not", &[&within]);
        let away = self.op("Or", &[&away, &out]);
        self.carry(away_slot, away.clone());
        let nan = self.scalar(f64::NAN);
        self.op("Where", &[&away, &nan, &step.output])
    }

    fn within(&mut self, model: &FeedbackModel, signal: &str) -> String {
        let (size, limit) = (self.op("Abs", &[signal]), self.scalar(model.run_away()));
        self.op("LessOrEqual", &[&size, &limit])
    }

    fn loop_step(&mut self, model: &FeedbackModel, data: &LoopData, x: &str, input: &str) -> LoopStep {
        let levels = model.levels;
        let level = self.scalar(levels.input);
        let u = self.op("Sub", &[input, &level]);
        let z = self.weighted(levels.entering, &data.cz, x, &[(model.input_to_nonlinearity, &u)]);
        let w = self.curve(&model.nonlinearity, &z);
        let level = self.scalar(levels.nonlinearity);
        let w = self.op("Sub", &[&w, &level]);
        let direct = [(model.input_to_output, u.as_str()), (model.nonlinearity_to_output, &w)];
        let y = self.weighted(levels.output, &data.cy, x, &direct);
        let next = self.op("MatMul", &[&data.a, x]);
        let (bu, bw) = (self.op("Mul", &[&data.bu, &u]), self.op("Mul", &[&data.bw, &w]));
        let next = self.op("Add", &[&next, &bu]);
        LoopStep {
            output: y,
            entering: z,
            state: self.op("Add", &[&next, &bw]),
        }
    }

    /// level + c x + the sum of gains times signals.
    fn weighted(&mut self, level: f64, c: &str, x: &str, direct: &[(f64, &str)]) -> String {
        let (level, own) = (self.scalar(level), self.dot(c, x));
        let start = self.op("Add", &[&level, &own]);
        direct.iter().fold(start, |sum, (gain, signal)| {
            let gain = self.scalar(*gain);
            let product = self.op("Mul", &[&gain, signal]);
            self.op("Add", &[&sum, &product])
        })
    }

    /// The state in which the loop rests under a constant input, at the first sample; zero if it does not come to rest.
    fn rest(&mut self, model: &FeedbackModel, data: &LoopData, u: &str, started: &str) -> String {
        let n = model.order();
        // The body of a Loop has its own operations.
        let outer = std::mem::take(&mut self.nodes);
        let [x, going, settled] = ["x", "going", "settled"].map(|role| format!("{role}{}", self.names));
        let step = self.loop_step(model, data, &x, u);
        let bounded = self.within(model, &step.output);
        let change = self.op("Sub", &[&step.state, &x]);
        let (change, size) = (self.op("Abs", &[&change]), self.op("Abs", &[&step.state]));
        let (size, share) = (self.reduce("ReduceMax", &size), self.scalar(FeedbackModel::AT_REST));
        let small = self.op("Mul", &[&share, &size]);
        let at_rest = self.op("LessOrEqual", &[&change, &small]);
        let at_rest = self.cast(&at_rest, Type::Int64);
        let at_rest = self.reduce("ReduceMin", &at_rest);
        let at_rest = self.cast(&at_rest, Type::Bool);
        let at_rest = self.op("And", &[&at_rest, &bounded]);
        let moving = self.op("Not", &[&at_rest]);
        let go_on = self.op("And", &[&moving, &bounded]);
        let nodes = std::mem::replace(&mut self.nodes, outer);
        let graph = Message::default()
            .all(1, nodes)
            .bytes(2, "rest")
            .bytes(11, value(&format!("turn{x}"), Type::Int64, &[]))
            .bytes(11, value(&going, Type::Bool, &[]))
            .bytes(11, value(&x, Type::Double, &[Dimension::Fixed(n)]))
            .bytes(11, value(&settled, Type::Bool, &[]))
            .bytes(12, value(&go_on, Type::Bool, &[]))
            .bytes(12, value(&step.state, Type::Double, &[Dimension::Fixed(n)]))
            .bytes(12, value(&at_rest, Type::Bool, &[]));
        let (zeros, no) = (self.vector(&vec![0.0; n]), self.constant(Type::Bool, &[], &[0]));
        let (turns, first) = (self.index(FeedbackModel::LONGEST_REST), self.op("Not", &[started]));
        let (found, is_rest) = (self.name(), self.name());
        let inputs = [turns.as_str(), &first, &zeros, &no];
        self.nodes
            .push(node("Loop", &inputs, &[&found, &is_rest], &[body(&graph)]));
        self.op("Where", &[&is_rest, &found, &zeros])
    }

    /// The latest values of a signal, the newest first: a state of this length; `None` for none.
    fn latest(&mut self, newest: &str, length: usize) -> Option<String> {
        let newest = (length > 0).then(|| self.lifted(newest))?;
        let (before, slot) = self.state(Type::Double, Some(length));
        let kept = self.slice(&before, 0, length - 1);
        let after = self.concat(&[&newest, &kept]);
        self.carry(slot, after.clone());
        Some(after)
    }

    pub(super) fn narx(&mut self, model: &NarxModel, u: &str) -> String {
        let [(u_mean, u_spread), (y_mean, y_spread)] = model.scales;
        let (mean, spread) = (self.scalar(u_mean), self.scalar(u_spread));
        let u = self.op("Sub", &[u, &mean]);
        let u = self.op("Div", &[&u, &spread]);
        let recent = self.latest(&u, model.delay + model.inputs);
        let past = (model.outputs > 0).then(|| self.state(Type::Double, Some(model.outputs)));
        // The variables, and a one for terms that have fewer factors than others.
        let mut variables: Vec<String> = past.iter().map(|p| p.0.clone()).collect();
        if let Some(recent) = recent.filter(|_| model.inputs > 0) {
            variables.push(self.slice(&recent, model.delay, model.delay + model.inputs));
        }
        variables.push(self.vector(&[1.0]));
        let variables = self.concat(&variables.iter().map(String::as_str).collect::<Vec<_>>());
        let mut value = self.scalar(model.constant);
        if !model.terms.is_empty() {
            let most = model.terms.iter().map(|t| t.factors.len()).max().unwrap_or(0);
            let coefficients: Vec<f64> = model.terms.iter().map(|t| t.coefficient).collect();
            let one = model.outputs + model.inputs;
            let mut products = self.vector(&vec![1.0; coefficients.len()]);
            for k in 0..most {
                let factor = model.terms.iter().map(|t| t.factors.get(k).copied().unwrap_or(one));
                let factor = self.indices(&factor.collect::<Vec<_>>(), &[coefficients.len()]);
                let factor = self.op("Gather", &[&variables, &factor]);
                products = self.op("Mul", &[&products, &factor]);
            }
            let coefficients = self.vector(&coefficients);
            let sum = self.dot(&coefficients, &products);
            value = self.op("Add", &[&value, &sum]);
        }
        let (low, high) = model.held;
        let unknown = self.op("IsNaN", &[&value]);
        let mean = self.scalar(0.0);
        let known = self.op("Where", &[&unknown, &mean, &value]);
        let value = self.held(&known, low, high);
        if let Some((before, slot)) = past {
            let (newest, kept) = (self.lifted(&value), self.slice(&before, 0, model.outputs - 1));
            let after = self.concat(&[&newest, &kept]);
            self.carry(slot, after);
        }
        let (mean, spread) = (self.scalar(y_mean), self.scalar(y_spread));
        let value = self.op("Mul", &[&spread, &value]);
        self.op("Add", &[&mean, &value])
    }

    pub(super) fn volterra(&mut self, model: &VolterraModel, u: &str) -> String {
        let (first, second) = (model.first.len(), model.second_memory);
        let level = self.scalar(model.input_level);
        let u = self.op("Sub", &[u, &level]);
        let mut y = self.scalar(model.constant);
        let Some(latest) = self.latest(&u, model.delay + first.max(second)) else {
            return self.op("Identity", &[&y]);
        };
        if first > 0 {
            let (recent, kernel) = (
                self.slice(&latest, model.delay, model.delay + first),
                self.vector(&model.first),
            );
            let sum = self.dot(&kernel, &recent);
            y = self.op("Add", &[&y, &sum]);
        }
        if second > 0 {
            let recent = self.slice(&latest, model.delay, model.delay + second);
            let kernel = self.array(&model.second, &[second, second]);
            let rows = self.op("MatMul", &[&kernel, &recent]);
            let sum = self.dot(&recent, &rows);
            y = self.op("Add", &[&y, &sum]);
        }
        y
    }
}
