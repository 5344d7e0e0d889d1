//! ONNX in float64: one Scan over the samples, whose body is one step of the model.
//!
//! The input `u` has the shape [n, inputs], the output `y` has [n].

mod blocks;
mod proto;

use flexure_io::ModelFile;

use crate::Described;
use crate::program::{Kind, Program};
use proto::{Dimension, Message, Type, node, tensor, value};

/// The versions of the intermediate representation and of the operations.
const IR_VERSION: i64 = 8;
const OPERATIONS: i64 = 17;

/// A state that goes from sample to sample.
struct Carried {
    before: String,
    after: String,
    start: String,
    kind: Type,
    length: Option<usize>,
}

/// Operations, constants and states as they are added.
#[derive(Default)]
struct Graph {
    nodes: Vec<Message>,
    constants: Vec<Message>,
    carried: Vec<Carried>,
    names: usize,
}

impl Graph {
    fn name(&mut self) -> String {
        self.names += 1;
        format!("v{}", self.names)
    }

    /// Adds an operation with one output; returns its name.
    fn op(&mut self, operation: &str, inputs: &[&str]) -> String {
        self.op_with(operation, inputs, &[])
    }

    fn op_with(&mut self, operation: &str, inputs: &[&str], attributes: &[Message]) -> String {
        let output = self.name();
        self.nodes.push(node(operation, inputs, &[&output], attributes));
        output
    }

    fn constant(&mut self, kind: Type, dimensions: &[usize], raw: &[u8]) -> String {
        let name = self.name();
        self.constants.push(tensor(&name, kind, dimensions, raw));
        name
    }

    fn scalar(&mut self, value: f64) -> String {
        self.constant(Type::Double, &[], &value.to_le_bytes())
    }

    fn vector(&mut self, values: &[f64]) -> String {
        self.array(values, &[values.len()])
    }

    fn array(&mut self, values: &[f64], dimensions: &[usize]) -> String {
        let raw: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.constant(Type::Double, dimensions, &raw)
    }

    fn index(&mut self, value: usize) -> String {
        self.constant(Type::Int64, &[], &(value as i64).to_le_bytes())
    }

    fn indices(&mut self, values: &[usize], dimensions: &[usize]) -> String {
        let raw: Vec<u8> = values.iter().flat_map(|v| (*v as i64).to_le_bytes()).collect();
        self.constant(Type::Int64, dimensions, &raw)
    }

    /// The elements from `start` to before `end`.
    fn slice(&mut self, of: &str, start: usize, end: usize) -> String {
        let (start, end) = (self.indices(&[start], &[1]), self.indices(&[end], &[1]));
        self.op("Slice", &[of, &start, &end])
    }

    fn gather(&mut self, of: &str, at: usize) -> String {
        let at = self.index(at);
        self.op("Gather", &[of, &at])
    }

    fn concat(&mut self, parts: &[&str]) -> String {
        self.op_with("Concat", parts, &[proto::whole("axis", 0)])
    }

    /// All elements under an operation such as `ReduceSum`, as a scalar.
    fn reduce(&mut self, operation: &str, of: &str) -> String {
        self.op_with(operation, &[of], &[proto::whole("keepdims", 0)])
    }

    /// The scalar product, summed from the first element on, as in Rust. A sum in another order differs in the last digit, and a model that
    /// amplifies its feedback makes that difference large.
    fn dot(&mut self, a: &str, b: &str) -> String {
        let products = self.op("Mul", &[a, b]);
        let axis = self.index(0);
        let sums = self.op("CumSum", &[&products, &axis]);
        let last = self.constant(Type::Int64, &[], &(-1_i64).to_le_bytes());
        self.op("Gather", &[&sums, &last])
    }

    fn cast(&mut self, of: &str, kind: Type) -> String {
        self.op_with("Cast", &[of], &[proto::whole("to", kind as i64)])
    }

    /// A scalar as a vector of one.
    fn lifted(&mut self, scalar: &str) -> String {
        let axis = self.indices(&[0], &[1]);
        self.op("Unsqueeze", &[scalar, &axis])
    }

    /// `value` held between two numbers.
    fn held(&mut self, value: &str, low: f64, high: f64) -> String {
        let (low, high) = (self.scalar(low), self.scalar(high));
        let above = self.op("Max", &[value, &low]);
        self.op("Min", &[&above, &high])
    }

    /// A state: a vector of doubles that starts at zero, or at `false` for truth values; without a length, a scalar.
    fn state(&mut self, kind: Type, length: Option<usize>) -> (String, usize) {
        let bytes = if kind == Type::Bool { 1 } else { 8 } * length.unwrap_or(1);
        let dimensions: Vec<usize> = length.into_iter().collect();
        let start = self.constant(kind, &dimensions, &vec![0; bytes]);
        let before = self.name();
        self.carried.push(Carried {
            before: before.clone(),
            after: String::new(),
            start,
            kind,
            length,
        });
        (before, self.carried.len() - 1)
    }

    /// The state of the next sample.
    fn carry(&mut self, state: usize, after: String) {
        self.carried[state].after = after;
    }
}

/// The model as an ONNX file.
pub fn graph(program: &Program<'_>, described: &Described<'_>) -> Vec<u8> {
    let mut g = Graph::default();
    let (started, slot) = g.state(Type::Bool, None);
    let yes = g.constant(Type::Bool, &[], &[1]);
    let now = g.op("Identity", &[&yes]);
    g.carry(slot, now);
    let mut registers: Vec<String> = (0..program.inputs).map(|i| g.gather("sample", i)).collect();
    for step in &program.steps {
        let from: Vec<&str> = step.from.iter().map(|r| registers[*r].as_str()).collect();
        let to = match &step.kind {
            Kind::Curve(curve) => g.curve(curve, from[0]),
            Kind::Linear(system) => g.linear(system, from[0], &started),
            Kind::Surface(surface) => g.surface(surface, &from),
            Kind::Sum => from[1..]
                .iter()
                .fold(from[0].to_owned(), |sum, r| g.op("Add", &[&sum, r])),
            Kind::Offset(offset) => {
                let offset = g.scalar(*offset);
                g.op("Add", &[from[0], &offset])
            }
            Kind::Feedback(model) => g.feedback(model, from[0], &started),
            Kind::Narx(model) => g.narx(model, from[0]),
            Kind::Volterra(model) => g.volterra(model, from[0]),
        };
        registers.push(to);
    }
    let last = g.op("Identity", &[&registers[program.output]]);
    model(&g, &last, program, described)
}

fn model(g: &Graph, last: &str, program: &Program<'_>, described: &Described<'_>) -> Vec<u8> {
    let fixed = |length: Option<usize>| length.map(Dimension::Fixed).into_iter().collect::<Vec<_>>();
    let before = g.carried.iter().map(|c| value(&c.before, c.kind, &fixed(c.length)));
    let after = g.carried.iter().map(|c| value(&c.after, c.kind, &fixed(c.length)));
    let body = Message::default()
        .all(1, &g.nodes)
        .bytes(2, "step")
        .all(11, before)
        .bytes(11, value("sample", Type::Double, &[Dimension::Fixed(program.inputs)]))
        .all(12, after)
        .bytes(12, value(last, Type::Double, &[]));
    let starts = g.carried.iter().map(|c| c.start.as_str());
    let inputs: Vec<&str> = starts.chain(["u"]).collect();
    let ends: Vec<String> = (0..g.carried.len()).map(|k| format!("end{k}")).collect();
    let outputs: Vec<&str> = ends.iter().map(String::as_str).chain(["y"]).collect();
    let attributes = [proto::body(&body), proto::whole("num_scan_inputs", 1)];
    let scan = node("Scan", &inputs, &outputs, &attributes);
    let text = described.about.join("\n");
    let graph = Message::default()
        .bytes(1, scan)
        .bytes(2, described.name)
        .all(5, &g.constants)
        .bytes(10, &text)
        .bytes(
            11,
            value(
                "u",
                Type::Double,
                &[Dimension::Named("n"), Dimension::Fixed(program.inputs)],
            ),
        )
        .bytes(12, value("y", Type::Double, &[Dimension::Named("n")]));
    let rate = described.model.sample_time.map(|h| format!("{h:?}"));
    let entry = |(key, text): (&str, String)| Message::default().bytes(1, key).bytes(2, text);
    let model = Message::default()
        .number(1, IR_VERSION)
        .bytes(2, "Flexure")
        .bytes(3, ModelFile::CURRENT)
        .bytes(6, &text)
        .bytes(7, graph)
        .bytes(8, Message::default().number(2, OPERATIONS))
        .all(14, rate.map(|h| entry(("sample_time", h))));
    model.0
}
