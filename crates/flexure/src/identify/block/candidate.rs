//! A system and how well it does.

use super::descent::descend_through;
use super::efficient::efficient;
use super::loss::Loss;
use super::monitor::Monitor;
use super::signals::Signals;
use super::spline::KinkedSpline;
use super::system::{Branch, System};
use crate::identify::result::{Value, Values};

/// A system and its sum of squared errors.
#[derive(Debug, Clone)]
pub(in crate::identify) struct Candidate {
    pub system: System,
    pub squares: f64,
}

impl Candidate {
    /// The system on these samples.
    pub fn new(system: System, data: &Signals) -> Candidate {
        Candidate {
            squares: data.squares(&system.run(&data.u)),
            system,
        }
    }

    /// The same system on other samples.
    pub fn on(&self, data: &Signals) -> Candidate {
        Candidate::new(self.system.clone(), data)
    }

    /// Schwarz's criterion.
    pub fn bic(&self, data: &Signals) -> f64 {
        data.bic(self.squares, self.system.degrees())
    }

    /// Whether Schwarz's criterion is lower.
    pub fn better(&self, than: &Candidate, data: &Signals) -> bool {
        self.bic(data) < than.bic(data)
    }

    /// All free parameters fitted from where they are; unchanged if that fails.
    pub fn fitted(self, data: &Signals, steps: usize, tolerance: f64, monitor: &mut Monitor<'_>) -> Candidate {
        let loss = Loss::new(self.system.clone(), data);
        match descend_through(&data.filter, &loss, loss.start(), steps, tolerance, monitor) {
            Some((p, squares)) => Candidate {
                system: loss.system(&p),
                squares,
            },
            None => self,
        }
    }

    /// The parameters by generalised least squares; `None` unless the error is coloured noise.
    pub fn fitted_efficiently(&self, data: &Signals, monitor: &mut Monitor<'_>) -> Option<Candidate> {
        let loss = Loss::new(self.system.clone(), data);
        let (p, squares) = efficient(&loss, &loss.start(), monitor)?;
        Some(Candidate {
            system: loss.system(&p),
            squares,
        })
    }

    /// The entry in the list of what was tried.
    pub fn tried(&self, data: &Signals) -> Tried {
        Tried {
            branches: self.system.branches.iter().map(TriedBranch::new).collect(),
            output_pieces: self.system.output.as_ref().map_or(0, KinkedSpline::pieces),
            output_kinks: self.system.output.as_ref().map_or(0, |o| o.kinks.len()),
            samples: data.counted(),
            relative_error: (self.squares / data.counted() as f64).sqrt(),
            bic: self.bic(data),
        }
    }
}

/// A system that was tried.
#[derive(Debug, Clone)]
pub(in crate::identify) struct Tried {
    pub branches: Vec<TriedBranch>,
    /// Cubic pieces of the last nonlinearity; zero where there is none.
    pub output_pieces: usize,
    /// Kinks of the last nonlinearity.
    pub output_kinks: usize,
    /// Samples that it was tried on.
    pub samples: usize,
    /// RMS of the simulation error there, relative to the output's standard deviation.
    pub relative_error: f64,
    /// Schwarz's criterion there; smaller is better among those of as many samples.
    pub bic: f64,
}

/// A branch of a system that was tried.
#[derive(Debug, Clone)]
pub(in crate::identify) struct TriedBranch {
    pub delay: usize,
    /// Poles and numerator coefficients of the front.
    pub front_order: usize,
    pub front_numerator: usize,
    /// Poles and numerator coefficients of the back.
    pub back_order: usize,
    pub back_numerator: usize,
    /// Cubic pieces and kinks of the nonlinearity.
    pub pieces: usize,
    pub kinks: usize,
    /// Instants in a sampling interval at which the nonlinearity acts: 1, or 2.
    pub instants: usize,
}

impl TriedBranch {
    fn new(branch: &Branch) -> TriedBranch {
        TriedBranch {
            delay: branch.delay,
            front_order: branch.front.order(),
            front_numerator: branch.front.b.len(),
            back_order: branch.back.order(),
            back_numerator: branch.back.b.len(),
            pieces: branch.spline.pieces(),
            kinks: branch.spline.kinks.len(),
            instants: branch.instants().count(),
        }
    }
}

impl Tried {
    /// The number of parameters that the data determine, of a cascade: all but the blocks' scales.
    pub fn parameters(&self) -> usize {
        let Some(b) = self.branches.first() else { return 1 };
        // A cubic spline has three parameters more than pieces, a kink a place and a bend; both linear blocks' scales are the nonlinearity's.
        let numerators = |instant: usize| match instant {
            0 => b.front_numerator + b.back_numerator,
            _ => b.front_numerator.max(b.front_order + 1) + b.back_numerator.max(b.back_order + 1),
        };
        let linear = b.front_order + b.back_order + (0..b.instants).map(numerators).sum::<usize>();
        linear + b.pieces + 1 + 2 * b.kinks
    }

    /// The entry of a cascade of three blocks; `None` without a branch.
    pub fn cascade(&self) -> Option<Values> {
        let b = self.branches.first()?;
        let blocks = Values::new([
            ("front_order", b.front_order.into()),
            ("front_numerator", b.front_numerator.into()),
            ("back_order", b.back_order.into()),
            ("back_numerator", b.back_numerator.into()),
            ("pieces", b.pieces.into()),
            ("kinks", b.kinks.into()),
            ("instants", b.instants.into()),
        ]);
        Some(self.scored(blocks))
    }

    /// The entry of a system with nonlinearities at its ends.
    pub fn ends(&self) -> Values {
        self.scored(Values::new([
            ("orders", self.each(|b| b.back_order)),
            ("numerators", self.each(|b| b.back_numerator)),
            ("delays", self.each(|b| b.delay)),
            ("input_pieces", self.each(|b| b.pieces)),
            ("output_pieces", self.output_pieces.into()),
            ("input_kinks", self.each(|b| b.kinks)),
            ("output_kinks", self.output_kinks.into()),
        ]))
    }

    /// The entry of a sum of branches.
    pub fn sum(&self) -> Values {
        self.scored(Values::new([
            ("front_orders", self.each(|b| b.front_order)),
            ("back_orders", self.each(|b| b.back_order)),
            ("pieces", self.each(|b| b.pieces)),
        ]))
    }

    fn each(&self, what: fn(&TriedBranch) -> usize) -> Value {
        self.branches.iter().map(what).collect::<Vec<usize>>().into()
    }

    /// The blocks followed by how well they do.
    fn scored(&self, blocks: Values) -> Values {
        blocks.and([
            ("samples", self.samples.into()),
            ("relative_error", self.relative_error.into()),
            ("bic", self.bic.into()),
        ])
    }
}
