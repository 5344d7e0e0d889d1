//! Random models over all structures, and inputs that leave the tables' ranges.

use std::collections::BTreeMap;

use flexure::Block;
use flexure::linear::TransferFunction;
use flexure::model::{FeedbackLevels, FeedbackModel, NarxModel, NarxTerm, VolterraModel};
use flexure::nonlinearity::{Curve, Outside, Surface, SurfaceAxis};
use flexure_io::ModelFile;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

/// Draws of models.
pub struct Draw(Pcg64);

impl Draw {
    pub fn new(seed: u64) -> Self {
        Draw(Pcg64::seed_from_u64(seed))
    }

    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.random::<f64>()
    }

    fn count(&mut self, low: usize, high: usize) -> usize {
        self.uniform(low as f64, high as f64 + 1.0) as usize
    }

    fn numbers(&mut self, n: usize, size: f64) -> Vec<f64> {
        (0..n).map(|_| self.uniform(-size, size)).collect()
    }

    /// A curve of 1 to 40 points around ±1.5, straight or held outside.
    fn curve(&mut self) -> Block {
        Block::Static(self.bare_curve())
    }

    fn bare_curve(&mut self) -> Curve {
        let points = self.count(1, 40);
        let mut at = -1.5;
        let x = (0..points).map(|_| {
            at += self.uniform(0.01, 6.0 / points as f64);
            at
        });
        let x: Vec<f64> = x.collect();
        let y = x
            .iter()
            .map(|x| x.tanh() + 0.3 * x * x + self.uniform(-0.05, 0.05))
            .collect();
        let outside = [Outside::Nearest, Outside::Linear][self.count(0, 1)];
        Curve::new(x, y, outside).unwrap()
    }

    /// A stable system of order 0 to 4 with a delay of 0 to 3 samples.
    fn linear(&mut self) -> Block {
        let mut a = vec![1.0];
        for _ in 0..self.count(0, 4) {
            let pole = self.uniform(-0.5, 0.97);
            let longer: Vec<f64> = a.iter().copied().chain([0.0]).collect();
            a = longer
                .iter()
                .zip([0.0].iter().chain(&a))
                .map(|(own, before)| own - pole * before)
                .collect();
        }
        let (delay, zeros) = (self.count(0, 3), self.count(1, 4));
        let b = [vec![0.0; delay], self.numbers(zeros, 1.0)].concat();
        Block::Linear(TransferFunction::new(b, a).unwrap())
    }

    /// One or two integrators before a lag, around a level of the input.
    fn integrating(&mut self) -> Block {
        let pole = self.uniform(-0.5, 0.97);
        let a = match self.count(1, 2) {
            1 => vec![1.0, -1.0 - pole, pole],
            _ => vec![1.0, -2.0 - pole, 1.0 + 2.0 * pole, -pole],
        };
        let system = TransferFunction::new([vec![0.0], self.numbers(2, 1.0)].concat(), a).unwrap();
        Block::Series(vec![Block::Offset(self.uniform(-0.2, 0.2)), Block::Linear(system)])
    }

    fn surface(&mut self, inputs: usize) -> Block {
        let axes: Vec<SurfaceAxis> = (0..inputs)
            .map(|_| SurfaceAxis {
                low: self.uniform(-2.0, -1.0),
                high: self.uniform(1.0, 2.0),
                pieces: self.count(1, 4),
            })
            .collect();
        let coefficients = axes.iter().map(|a| a.pieces + 3).product();
        let coefficients = self.numbers(coefficients, 2.0);
        Block::Surface(Surface::new(axes, coefficients).unwrap())
    }

    fn feedback(&mut self) -> Block {
        let n = self.count(1, 4);
        let state = (0..n).map(|i| {
            (0..n)
                .map(|j| {
                    if i == j {
                        self.uniform(0.3, 0.9)
                    } else {
                        self.uniform(-0.05, 0.05)
                    }
                })
                .collect()
        });
        Block::Feedback(Box::new(FeedbackModel {
            state: state.collect(),
            input_to_state: self.numbers(n, 0.3),
            nonlinearity_to_state: self.numbers(n, 0.05),
            state_to_output: self.numbers(n, 1.0),
            state_to_nonlinearity: self.numbers(n, 1.0),
            input_to_output: self.uniform(-0.2, 0.2),
            nonlinearity_to_output: self.uniform(-0.2, 0.2),
            input_to_nonlinearity: self.uniform(-0.2, 0.2),
            levels: FeedbackLevels {
                input: self.uniform(-0.2, 0.2),
                nonlinearity: self.uniform(-0.2, 0.2),
                output: self.uniform(-0.2, 0.2),
                entering: self.uniform(-0.2, 0.2),
            },
            nonlinearity: Curve::new(vec![-1.0, -0.2, 0.3, 1.2], self.numbers(4, 1.0), Outside::Nearest).unwrap(),
        }))
    }

    fn narx(&mut self) -> Block {
        let (outputs, inputs) = (self.count(0, 3), self.count(1, 3));
        let term = |draw: &mut Draw| NarxTerm {
            factors: (0..draw.count(0, 3))
                .map(|_| draw.count(0, outputs + inputs - 1))
                .collect(),
            coefficient: draw.uniform(-0.3, 0.3),
        };
        Block::Narx(NarxModel {
            outputs,
            inputs,
            delay: self.count(0, 3),
            constant: self.uniform(-0.1, 0.1),
            terms: (0..self.count(0, 6)).map(|_| term(self)).collect(),
            scales: [
                (self.uniform(-0.2, 0.2), self.uniform(0.5, 2.0)),
                (self.uniform(-3.0, 3.0), self.uniform(0.5, 2.0)),
            ],
            held: (-2.0, 1.5),
        })
    }

    fn volterra(&mut self) -> Block {
        let (first, second_memory) = (self.count(1, 12), self.count(0, 9));
        Block::Volterra(VolterraModel {
            delay: self.count(0, 3),
            input_level: self.uniform(-0.2, 0.2),
            constant: self.uniform(-1.0, 1.0),
            first: self.numbers(first, 1.0),
            second: self.numbers(second_memory * second_memory, 0.3),
            second_memory,
        })
    }
}

/// How many forms the models have.
pub const FORMS: usize = 14;

/// Three models of each form, with its name.
pub fn models() -> Vec<(&'static str, ModelFile)> {
    let mut draw = Draw::new(5);
    let mut all = Vec::new();
    for _ in 0..3 {
        let offset = Block::Offset(draw.uniform(-1.0, 1.0));
        let d = &mut draw;
        let hammerstein = |d: &mut Draw| Block::Series(vec![d.curve(), d.linear()]);
        all.extend([
            ("linear", Block::Series(vec![d.linear(), offset])),
            ("static", Block::Series(vec![d.linear(), d.curve()])),
            ("hammerstein", hammerstein(d)),
            (
                "wiener-hammerstein",
                Block::Series(vec![d.linear(), d.curve(), d.linear()]),
            ),
            (
                "hammerstein-wiener",
                Block::Series(vec![d.curve(), d.linear(), d.curve()]),
            ),
            (
                "parallel",
                Block::Parallel(vec![
                    hammerstein(d),
                    Block::Series(vec![d.linear(), d.curve(), d.linear()]),
                ]),
            ),
            (
                "multiple-inputs",
                Block::Inputs(vec![hammerstein(d), hammerstein(d), hammerstein(d)]),
            ),
            ("joint-inputs-2", Block::Series(vec![d.surface(2), d.linear()])),
            ("joint-inputs-3", Block::Series(vec![d.surface(3), d.linear()])),
            ("feedback", d.feedback()),
            ("narx", d.narx()),
            ("volterra", d.volterra()),
            ("integrating", d.integrating()),
            ("curve", d.curve()),
        ]);
    }
    assert_eq!(all.len(), 3 * FORMS);
    all.into_iter().map(|(name, block)| (name, file(name, block))).collect()
}

/// A model file of a block.
pub fn file(structure: &str, block: Block) -> ModelFile {
    ModelFile {
        flexure: ModelFile::CURRENT.to_owned(),
        structure: structure.to_owned(),
        method: "test".to_owned(),
        inputs: (0..block.inputs()).map(|i| format!("u{i}")).collect(),
        output: "y".to_owned(),
        units: BTreeMap::new(),
        sample_time: Some(0.01),
        delay: 0,
        order: 0,
        block,
        paths: Vec::new(),
        is_sum: false,
        settling: None,
        noise_model: None,
        estimated: None,
        reading: BTreeMap::new(),
        missing: false,
        robust: false,
        records: Vec::new(),
        identification: Default::default(),
    }
}

/// Inputs that start away from zero and leave the tables' ranges now and then, one list an input.
pub fn inputs(model: &ModelFile, samples: usize, seed: u64) -> Vec<Vec<f64>> {
    let mut draw = Draw::new(seed);
    let signal = |_| {
        let mut level = draw.uniform(-1.0, 1.0);
        let next = |_| {
            level = 0.8 * level + draw.uniform(-0.9, 0.9);
            level
        };
        (0..samples).map(next).collect()
    };
    (0..model.block.inputs()).map(signal).collect()
}

/// The reference.
pub fn predicted(model: &ModelFile, inputs: &[Vec<f64>]) -> Vec<f64> {
    let inputs: Vec<&[f64]> = inputs.iter().map(Vec::as_slice).collect();
    model.block.simulate_from_first(&inputs).unwrap()
}

/// The largest difference, relative to the largest value; where one is NaN, the other must be.
pub fn difference(found: &[f64], expected: &[f64]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let size = expected
        .iter()
        .filter(|v| v.is_finite())
        .fold(0.0_f64, |m, v| m.max(v.abs()));
    let each = found.iter().zip(expected);
    let apart = each.map(|(f, e)| match (f.is_nan(), e.is_nan()) {
        (true, true) => 0.0,
        (false, false) if f == e => 0.0,
        (false, false) => (f - e).abs() / size.max(f64::MIN_POSITIVE),
        _ => f64::INFINITY,
    });
    apart.fold(0.0, f64::max)
}
