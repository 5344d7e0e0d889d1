//! A system and its error.

use super::descent::{Minimum, descend_through};
use super::efficient::efficient;
use super::limits::StopRule;
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

    /// The candidate after a fit of all free parameters from their present values; unchanged if the fit fails.
    pub fn fitted(self, data: &Signals, rule: StopRule, monitor: &mut Monitor<'_>) -> Candidate {
        let loss = Loss::new(self.system.clone(), data);
        let minimum = descend_through(&data.filter, &loss, loss.start(), rule, monitor);
        minimum.map_or(self, |minimum| Candidate::at(&loss, &minimum))
    }

    /// The candidate fitted by generalised least squares; `None` unless the error is coloured noise.
    pub fn fitted_efficiently(&self, data: &Signals, monitor: &mut Monitor<'_>) -> Option<Candidate> {
        let loss = Loss::new(self.system.clone(), data);
        Some(Candidate::at(&loss, &efficient(&loss, &loss.start(), monitor)?))
    }

    /// The system at a minimum of the loss.
    fn at(loss: &Loss<'_>, minimum: &Minimum) -> Candidate {
        Candidate {
            system: loss.system(&minimum.parameters),
            squares: minimum.squares,
        }
    }

    /// The entry in the list of what was tried.
    pub fn tried(&self, data: &Signals) -> Tried {
        Tried {
            system: self.system.clone(),
            samples: data.counted(),
            relative_error: (self.squares / data.counted() as f64).sqrt(),
            bic: self.bic(data),
        }
    }
}

/// A system that was tried.
#[derive(Debug, Clone)]
pub(in crate::identify) struct Tried {
    system: System,
    /// Samples that it was tried on.
    samples: usize,
    /// RMS of the simulation error there, relative to the output's standard deviation.
    relative_error: f64,
    /// Schwarz's criterion there; smaller is better, compared with systems on equally many samples.
    bic: f64,
}

impl Tried {
    /// The system, if it was tried on equally many samples.
    pub fn on(&self, data: &Signals) -> Option<Candidate> {
        (self.samples == data.counted()).then(|| Candidate::new(self.system.clone(), data))
    }

    /// The entry of a cascade of three blocks; `None` without a branch.
    pub fn cascade(&self) -> Option<Values> {
        let b = self.system.branches.first()?;
        let blocks = Values::new([
            ("front_order", b.front.order().into()),
            ("front_numerator", b.front.b.len().into()),
            ("back_order", b.back.order().into()),
            ("back_numerator", b.back.b.len().into()),
            ("pieces", b.spline.pieces().into()),
            ("kinks", b.spline.kinks.len().into()),
            ("instants", b.instants().count().into()),
        ]);
        Some(self.scored(blocks))
    }

    /// The entry of a system with nonlinearities at its ends.
    pub fn ends(&self) -> Values {
        let output = self.system.output.as_ref();
        self.scored(Values::new([
            ("orders", self.each(|b| b.back.order())),
            ("numerators", self.each(|b| b.back.b.len())),
            ("delays", self.each(|b| b.delay)),
            ("input_pieces", self.each(|b| b.spline.pieces())),
            ("output_pieces", output.map_or(0, KinkedSpline::pieces).into()),
            ("input_kinks", self.each(|b| b.spline.kinks.len())),
            ("output_kinks", output.map_or(0, |o| o.kinks.len()).into()),
        ]))
    }

    /// The entry of a sum of branches.
    pub fn sum(&self) -> Values {
        self.scored(Values::new([
            ("front_orders", self.each(|b| b.front.order())),
            ("back_orders", self.each(|b| b.back.order())),
            ("pieces", self.each(|b| b.spline.pieces())),
        ]))
    }

    fn each(&self, what: fn(&Branch) -> usize) -> Value {
        self.system.branches.iter().map(what).collect::<Vec<usize>>().into()
    }

    /// The blocks, followed by their scores.
    fn scored(&self, blocks: Values) -> Values {
        blocks.and([
            ("samples", self.samples.into()),
            ("relative_error", self.relative_error.into()),
            ("bic", self.bic.into()),
        ])
    }
}
