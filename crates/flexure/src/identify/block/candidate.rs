//! A system and how well it does.

use super::descent::descend_through;
use super::efficient::efficient;
use super::loss::Loss;
use super::monitor::Monitor;
use super::signals::Signals;
use super::spline::KinkedSpline;
use super::system::{Branch, System};

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

/// A cascade that was tried.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TriedStructure {
    /// Poles of the front.
    pub front_order: usize,
    /// Numerator coefficients of the front.
    pub front_numerator: usize,
    /// Poles of the back.
    pub back_order: usize,
    /// Numerator coefficients of the back.
    pub back_numerator: usize,
    /// Cubic pieces of the nonlinearity.
    pub pieces: usize,
    /// Points at which its slope changes besides.
    pub kinks: usize,
    /// Instants in a sampling interval at which the nonlinearity acts: 1, or 2.
    pub instants: usize,
    /// Samples that it was tried on.
    pub samples: usize,
    /// RMS of the simulation error there, relative to the output's standard deviation.
    pub relative_error: f64,
    /// Schwarz's criterion there; smaller is better among those of as many samples.
    pub bic: f64,
}

impl TriedStructure {
    /// The number of parameters that the data determine: all but the blocks' scales.
    pub fn parameters(&self) -> usize {
        // A cubic spline has three parameters more than pieces, a kink a place and a bend; both linear blocks' scales are the nonlinearity's.
        let numerators = |instant: usize| match instant {
            0 => self.front_numerator + self.back_numerator,
            _ => self.front_numerator.max(self.front_order + 1) + self.back_numerator.max(self.back_order + 1),
        };
        let linear = self.front_order + self.back_order + (0..self.instants).map(numerators).sum::<usize>();
        linear + self.pieces + 1 + 2 * self.kinks
    }

    /// The entries of systems of one branch.
    pub(in crate::identify) fn of(tried: Vec<Tried>) -> Vec<TriedStructure> {
        let entry = |tried: &Tried| {
            let branch = tried.branches.first()?;
            Some(TriedStructure {
                front_order: branch.front_order,
                front_numerator: branch.front_numerator,
                back_order: branch.back_order,
                back_numerator: branch.back_numerator,
                pieces: branch.pieces,
                kinks: branch.kinks,
                instants: branch.instants,
                samples: tried.samples,
                relative_error: tried.relative_error,
                bic: tried.bic,
            })
        };
        tried.iter().filter_map(entry).collect()
    }
}

/// A system with nonlinearities at its ends that was tried.
#[derive(Debug, Clone, PartialEq)]
pub struct TriedBranches {
    /// Poles of every branch.
    pub orders: Vec<usize>,
    /// Numerator coefficients of every branch.
    pub numerators: Vec<usize>,
    /// Delay before every branch's numerator, in samples.
    pub delays: Vec<usize>,
    /// Cubic pieces of every branch's nonlinearity.
    pub input_pieces: Vec<usize>,
    /// Cubic pieces of the last nonlinearity; zero where there is none.
    pub output_pieces: usize,
    /// Kinks of every branch's nonlinearity.
    pub input_kinks: Vec<usize>,
    /// Kinks of the last nonlinearity.
    pub output_kinks: usize,
    /// Samples that it was tried on.
    pub samples: usize,
    /// RMS of the simulation error there, relative to the output's standard deviation.
    pub relative_error: f64,
    /// Schwarz's criterion there; smaller is better among those of as many samples.
    pub bic: f64,
}

impl From<Tried> for TriedBranches {
    fn from(tried: Tried) -> TriedBranches {
        let each = |what: fn(&TriedBranch) -> usize| tried.branches.iter().map(what).collect();
        TriedBranches {
            orders: each(|b| b.back_order),
            numerators: each(|b| b.back_numerator),
            delays: each(|b| b.delay),
            input_pieces: each(|b| b.pieces),
            output_pieces: tried.output_pieces,
            input_kinks: each(|b| b.kinks),
            output_kinks: tried.output_kinks,
            samples: tried.samples,
            relative_error: tried.relative_error,
            bic: tried.bic,
        }
    }
}

/// A sum of branches that was tried.
#[derive(Debug, Clone, PartialEq)]
pub struct TriedSum {
    /// Poles before every branch's nonlinearity.
    pub front_orders: Vec<usize>,
    /// Poles behind it.
    pub back_orders: Vec<usize>,
    /// Cubic pieces of every branch's nonlinearity.
    pub pieces: Vec<usize>,
    /// Samples that it was tried on.
    pub samples: usize,
    /// RMS of the simulation error there, relative to the output's standard deviation.
    pub relative_error: f64,
    /// Schwarz's criterion there; smaller is better among those of as many samples.
    pub bic: f64,
}

impl From<Tried> for TriedSum {
    fn from(tried: Tried) -> TriedSum {
        let each = |what: fn(&TriedBranch) -> usize| tried.branches.iter().map(what).collect();
        TriedSum {
            front_orders: each(|b| b.front_order),
            back_orders: each(|b| b.back_order),
            pieces: each(|b| b.pieces),
            samples: tried.samples,
            relative_error: tried.relative_error,
            bic: tried.bic,
        }
    }
}
