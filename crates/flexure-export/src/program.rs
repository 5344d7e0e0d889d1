//! A model as a list of steps over registers: the one walk over the blocks that every format is written from.
//!
//! The inputs are the first registers. Every step reads registers and writes the next one. A step's tables and numbers are text
//! already, so that all formats have the same digits: those that read back as the same `f64`.

use flexure::Block;
use flexure::linear::TransferFunction;
use flexure::model::{FeedbackModel, NarxModel, VolterraModel};
use flexure::nonlinearity::{Curve, Outside, Surface};

use crate::error::{Error, Result};

/// What a step computes.
pub enum Kind<'a> {
    /// A curve of one register.
    Curve(&'a Curve),
    /// A linear system: transposed direct form II around the level of its first input.
    Linear(&'a TransferFunction),
    /// A surface of several registers.
    Surface(&'a Surface),
    /// The sum of registers.
    Sum,
    /// A number that is added.
    Offset(f64),
    /// A static nonlinearity in a loop.
    Feedback(&'a FeedbackModel),
    /// A polynomial of past outputs and inputs.
    Narx(&'a NarxModel),
    /// A Volterra series.
    Volterra(&'a VolterraModel),
}

/// One step: its result goes to the register after those of the inputs and of the steps before it.
pub struct Step<'a> {
    /// What it computes.
    pub kind: Kind<'a>,
    /// The registers that it reads.
    pub from: Vec<usize>,
}

/// A model as steps.
pub struct Program<'a> {
    /// The number of inputs.
    pub inputs: usize,
    /// The steps.
    pub steps: Vec<Step<'a>>,
    /// The register of the output.
    pub output: usize,
}

impl<'a> Program<'a> {
    /// The steps of a model.
    ///
    /// # Errors
    /// [`Error::Model`] for a model with a number that is not finite, or that cannot be simulated.
    pub fn new(block: &'a Block) -> Result<Self> {
        let inputs = block.inputs();
        let mut program = Program {
            inputs,
            steps: Vec::new(),
            output: 0,
        };
        program.output = program.walk(block, &(0..inputs).collect::<Vec<_>>())?;
        Ok(program)
    }

    /// Whether no step has a state.
    pub fn is_static(&self) -> bool {
        let memoryless =
            |kind: &Kind<'_>| matches!(kind, Kind::Curve(_) | Kind::Surface(_) | Kind::Sum | Kind::Offset(_));
        self.steps.iter().all(|step| memoryless(&step.kind))
    }

    /// Adds the steps of a block that reads these registers; returns the register of its output.
    fn walk(&mut self, block: &'a Block, from: &[usize]) -> Result<usize> {
        let kind = match block {
            Block::Series(blocks) => {
                let Some((front, others)) = blocks.split_first() else {
                    return Err(Error::Model("a series of blocks is empty".to_owned()));
                };
                let entering = self.walk(front, from)?;
                return others
                    .iter()
                    .try_fold(entering, |register, b| self.walk(b, &[register]));
            }
            Block::Parallel(blocks) => {
                let terms: Result<Vec<usize>> = blocks.iter().map(|b| self.walk(b, from)).collect();
                return Ok(self.push(Kind::Sum, terms?));
            }
            Block::Inputs(blocks) => {
                let each = blocks.iter().enumerate();
                let terms: Result<Vec<usize>> = each.map(|(i, b)| self.walk(b, &[nth(from, i)])).collect();
                return Ok(self.push(Kind::Sum, terms?));
            }
            Block::Surface(surface) => {
                let from = (0..surface.inputs()).map(|i| nth(from, i)).collect();
                return Ok(self.push(Kind::Surface(surface), from));
            }
            Block::Static(curve) => Kind::Curve(curve),
            Block::Linear(system) => Kind::Linear(system),
            Block::Offset(offset) => {
                finite("an offset", &[*offset])?;
                Kind::Offset(*offset)
            }
            Block::Feedback(model) => {
                model.problem().map_or(Ok(()), |problem| Err(Error::Model(problem)))?;
                Kind::Feedback(model)
            }
            Block::Narx(model) => {
                model.problem().map_or(Ok(()), |problem| Err(Error::Model(problem)))?;
                let [u, y] = model.scales;
                finite(
                    "a NARX model",
                    &[model.constant, model.held.0, model.held.1, u.0, u.1, y.0, y.1],
                )?;
                finite(
                    "a NARX model",
                    &model.terms.iter().map(|t| t.coefficient).collect::<Vec<_>>(),
                )?;
                Kind::Narx(model)
            }
            Block::Volterra(model) => {
                model.problem().map_or(Ok(()), |problem| Err(Error::Model(problem)))?;
                finite("a Volterra series", &[model.input_level, model.constant])?;
                finite("a Volterra series", &model.first)?;
                finite("a Volterra series", &model.second)?;
                Kind::Volterra(model)
            }
        };
        Ok(self.push(kind, vec![nth(from, 0)]))
    }

    fn push(&mut self, kind: Kind<'a>, from: Vec<usize>) -> usize {
        self.steps.push(Step { kind, from });
        self.inputs + self.steps.len() - 1
    }

    /// Sentences on what happens beyond the ranges of the model's nonlinearities, and to blocks without a steady state.
    pub fn ranges(&self) -> Vec<String> {
        let steps = self.steps.iter().enumerate();
        steps
            .flat_map(|(k, step)| match &step.kind {
                Kind::Curve(curve) => vec![range(k, curve)],
                Kind::Feedback(model) => vec![
                    range(k, &model.nonlinearity),
                    format!(
                        "Block {k} is a loop: once a signal in it exceeds {:?}, its output is NaN until the next reset.",
                        model.run_away()
                    ),
                ],
                Kind::Linear(system) if !system.static_gain().is_finite() => {
                    vec![format!(
                        "Block {k} integrates: it has no steady state, and starts at rest."
                    )]
                }
                Kind::Surface(surface) => vec![format!(
                    "Block {k} is a surface of cubic splines over {}. Outside it has the value of the nearest point of this box.",
                    surface
                        .axes()
                        .iter()
                        .map(|a| format!("{:?} to {:?}", a.low, a.high))
                        .collect::<Vec<_>>()
                        .join(" by ")
                )],
                Kind::Narx(model) => vec![format!(
                    "Block {k} is a polynomial of past outputs and inputs. Its output is held between {:?} and {:?}.",
                    model.scales[1].0 + model.scales[1].1 * model.held.0,
                    model.scales[1].0 + model.scales[1].1 * model.held.1
                )],
                _ => Vec::new(),
            })
            .collect()
    }
}

/// What a curve is beyond its table.
fn range(k: usize, curve: &Curve) -> String {
    let x = curve.x();
    let there = match curve.outside() {
        Outside::Nan => "it is NaN",
        Outside::Nearest => "it is held at its value at the nearest end",
        Outside::Linear => "it goes on along its first or last straight piece",
    };
    format!(
        "Block {k} has a table from {:?} to {:?}. Outside {there}.",
        x[0],
        x[x.len() - 1]
    )
}

/// The register of this index; the last one stands for missing ones.
fn nth(from: &[usize], i: usize) -> usize {
    from.get(i).or(from.last()).copied().unwrap_or_default()
}

fn finite(what: &str, values: &[f64]) -> Result<()> {
    match values.iter().find(|v| !v.is_finite()) {
        Some(v) => Err(Error::Model(format!("{what} has the number {v}, but must be finite"))),
        None => Ok(()),
    }
}
