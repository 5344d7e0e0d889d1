//! From the starts to the system: screening, structure, and the last fit on all samples.

use super::super::{
    Data, Monitor, Rational, Residuals, Stage, approximate, changes, descend_through, efficient, groups,
    whitening_filter,
};
use super::kinks::kinked;
use super::loss::Loss;
use super::pieces::{MOST_PIECES, with_output, with_pieces};
use super::start::{branches, coarse, delays};
use super::system::{Branch, Signals, System};
use crate::linear::Complex;

/// Largest order of the starts.
const LARGEST_ORDER: usize = 8;
/// Orders in a row that are tried although Schwarz's criterion rises.
const WORSE_ORDERS: usize = 2;
/// Samples that the starts, and the choice of structure, are made on.
const START_SAMPLES: usize = 5_000;
const STRUCTURE_SAMPLES: usize = 15_000;
/// Starts that are refined further.
const SURVIVORS: usize = 3;
/// Pieces of the last nonlinearity at the start, and of all in the second round.
const FIRST_PIECES: usize = 5;
const SCREENING_PIECES: usize = 10;
/// Pieces that are tried, relative to the present number.
const PIECES: [f64; 6] = [0.4, 0.7, 1.0, 1.5, 2.2, 3.5];
/// Of those with more pieces, so many in a row are tried although Schwarz's criterion rises.
const WORSE_PIECES: usize = 2;
/// Rounds of structural change.
const ROUNDS: usize = 12;
/// Steps that judge a structural change, and those of the last fit.
pub(super) const TRIAL_STEPS: usize = 12;
const LAST_STEPS: usize = 80;

/// A structure that was tried.
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

/// A system and its sum of squared errors.
#[derive(Debug, Clone)]
pub(in crate::identify) struct Candidate {
    pub system: System,
    pub squares: f64,
}

impl Candidate {
    fn new(system: System, data: &Signals) -> Candidate {
        Candidate {
            squares: data.squares(&system.run(&data.u)),
            system,
        }
    }

    pub(super) fn bic(&self, data: &Signals) -> f64 {
        data.bic(self.squares, self.system.degrees())
    }

    fn better(&self, than: &Candidate, data: &Signals) -> bool {
        self.bic(data) < than.bic(data)
    }

    pub(super) fn tried(&self, data: &Signals) -> TriedBranches {
        let branches = &self.system.branches;
        let pieces = |s: &super::super::Shape| s.breakpoints().len() - 1;
        TriedBranches {
            orders: branches.iter().map(|b| b.linear.order()).collect(),
            numerators: branches.iter().map(|b| b.linear.b.len()).collect(),
            delays: branches.iter().map(|b| b.delay).collect(),
            input_pieces: branches.iter().map(|b| pieces(&b.shape)).collect(),
            output_pieces: self.system.output.as_ref().map_or(0, pieces),
            input_kinks: branches.iter().map(|b| b.shape.kinks.len()).collect(),
            output_kinks: self.system.output.as_ref().map_or(0, |o| o.kinks.len()),
            samples: data.counted(),
            relative_error: (self.squares / data.counted() as f64).sqrt(),
            bic: self.bic(data),
        }
    }
}

/// What the search found.
#[derive(Debug, Clone)]
pub(in crate::identify) struct SearchResult {
    pub system: System,
    pub tried: Vec<TriedBranches>,
}

/// The search, on signals of unit variance and zero mean; `None` if there is nothing to start from.
pub(in crate::identify) fn find(data: &Signals, last: bool, monitor: &mut Monitor<'_>) -> Option<SearchResult> {
    monitor.stage = Stage::Approximation;
    let small = data.head(START_SAMPLES);
    let delays = delays(&small);
    let mut tried = Vec::new();
    let mut round = starts(&small, last, &delays, monitor, &mut tried);
    let settling = round.first()?.system.settling(1e-4);
    let mut data = data.clone();
    data.from = settling.clamp(data.y.len() / 100, data.y.len() / 10);
    let mut medium = data.head(STRUCTURE_SAMPLES);
    monitor.stage = Stage::Screening;
    round.truncate(SURVIVORS);
    for c in &mut round {
        *c = fitted(
            Candidate::new(c.system.clone(), &medium),
            &medium,
            TRIAL_STEPS,
            1e-3,
            monitor,
        );
        for part in c.system.parts() {
            let pieces = SCREENING_PIECES.max(c.system.pieces(part));
            if let Some(finer) = with_pieces(&c.system, part, pieces, &medium) {
                let finer = fitted(finer, &medium, TRIAL_STEPS, 1e-4, monitor);
                if finer.squares < c.squares {
                    *c = finer;
                }
            }
        }
        tried.push(c.tried(&medium));
    }
    let best = round
        .into_iter()
        .min_by(|a, b| a.bic(&medium).total_cmp(&b.bic(&medium)))?;
    monitor.stage = Stage::Structure;
    medium.dependence = medium.dependence_of(&best.system.run(&medium.u));
    let best = pieces(best, &medium, monitor, &mut tried);
    let best = restructure(best, &medium, monitor, &mut tried);
    let best = pieces(best, &medium, monitor, &mut tried);
    let best = kinked(best, &medium, monitor, &mut tried);
    monitor.stage = Stage::Refinement;
    let mut best = fitted(Candidate::new(best.system, &data), &data, TRIAL_STEPS, 1e-4, monitor);
    data.dependence = data.dependence_of(&best.system.run(&data.u));
    if data.counted() > medium.counted() {
        best = pieces(best, &data, monitor, &mut tried);
    }
    let best = fitted(best, &data, LAST_STEPS, 1e-6, monitor);
    let efficient =
        restructured_efficiently(&best, &data, monitor).or_else(|| fitted_efficiently(&best, &data, monitor));
    let best = efficient.unwrap_or(best);
    tried.push(best.tried(&data));
    Some(SearchResult {
        system: best.system,
        tried,
    })
}

/// Systems of rising orders after short fits, best first.
fn starts(
    data: &Signals,
    last: bool,
    delays: &[usize],
    monitor: &mut Monitor<'_>,
    tried: &mut Vec<TriedBranches>,
) -> Vec<Candidate> {
    let mut all: Vec<Candidate> = Vec::new();
    let (mut least, mut worse) = (f64::INFINITY, 0);
    for order in 0..=LARGEST_ORDER.min(data.counted() / 30) {
        if !monitor.keep_on() || worse > WORSE_ORDERS {
            break;
        }
        let mut of_order = Vec::new();
        if let Some(system) = branches(data, order, delays, 1) {
            of_order.push(fitted(Candidate::new(system, data), data, TRIAL_STEPS, 1e-3, monitor));
        }
        if last {
            of_order.extend(linear(data, order, delays, monitor));
            of_order = of_order
                .into_iter()
                .filter_map(|c| with_output(&c.system, FIRST_PIECES, data))
                .map(|c| fitted(c, data, 2 * TRIAL_STEPS, 1e-3, monitor))
                .collect();
        }
        tried.extend(of_order.iter().map(|c| c.tried(data)));
        let best = of_order.iter().map(|c| c.bic(data)).fold(f64::INFINITY, f64::min);
        if best < least {
            (least, worse) = (best, 0);
        } else {
            worse += 1;
        }
        all.extend(of_order);
    }
    all.sort_by(|a, b| a.bic(data).total_cmp(&b.bic(data)));
    all
}

/// A straight line, then the best linear approximation: where a Wiener system lies. Only for one input.
fn linear(data: &Signals, order: usize, delays: &[usize], monitor: &mut Monitor<'_>) -> Option<Candidate> {
    let ([u], [delay]) = (&data.u[..], delays) else {
        return None;
    };
    let mut shape = coarse(&u[data.from..], FIRST_PIECES)?;
    let mut branch = Branch {
        delay: *delay,
        shape: shape.clone(),
        linear: Rational {
            b: vec![1.0],
            sections: Vec::new(),
        },
    };
    let approximated = Data::new(branch.delayed(u), data.y.clone(), data.from);
    branch.linear = approximate(&approximated, order.max(1), monitor)?.system;
    shape.straighten();
    branch.shape = shape;
    let system = System {
        branches: vec![branch],
        offset: 0.0,
        output: None,
    };
    Some(Candidate::new(system, data))
}

/// All parameters fitted from where they are; what was, if that fails.
pub(super) fn fitted(
    c: Candidate,
    data: &Signals,
    steps: usize,
    tolerance: f64,
    monitor: &mut Monitor<'_>,
) -> Candidate {
    let loss = Loss::new(c.system.clone(), data);
    match descend_through(&data.filter, &loss, loss.start(), steps, tolerance, monitor) {
        Some((p, squares)) => Candidate {
            system: loss.system(&p),
            squares,
        },
        None => c,
    }
}

/// The parameters by generalised least squares; `None` unless the error is coloured noise.
fn fitted_efficiently(c: &Candidate, data: &Signals, monitor: &mut Monitor<'_>) -> Option<Candidate> {
    let loss = Loss::new(c.system.clone(), data);
    let (p, squares) = efficient(&loss, &loss.start(), monitor)?;
    Some(Candidate {
        system: loss.system(&p),
        squares,
    })
}

/// The structure chosen anew, by errors made white, for one that generalised least squares fits, as for
/// [cascades](crate::identify::WienerHammerstein); `None` where there is no better one, or its error is not coloured noise.
fn restructured_efficiently(c: &Candidate, data: &Signals, monitor: &mut Monitor<'_>) -> Option<Candidate> {
    let loss = Loss::new(c.system.clone(), data);
    let all = data.through(whitening_filter(&loss, &loss.residuals(&loss.start())?)?);
    let white = all.head(STRUCTURE_SAMPLES);
    // Their errors are not those of simulation, which is what the structures that were tried are listed by.
    let unlisted = &mut Vec::new();
    let found = restructure(Candidate::new(c.system.clone(), &white), &white, monitor, unlisted);
    let found = pieces(found, &white, monitor, unlisted);
    let found = kinked(found, &white, monitor, unlisted);
    let found = fitted(Candidate::new(found.system, &all), &all, TRIAL_STEPS, 1e-4, monitor);
    if !found.better(&Candidate::new(c.system.clone(), &all), &all) {
        return None;
    }
    let found = fitted(Candidate::new(found.system, data), data, LAST_STEPS, 1e-6, monitor);
    fitted_efficiently(&found, data, monitor)
}

/// Fewer and more pieces of every nonlinearity, one after the other, while Schwarz's criterion falls.
fn pieces(mut best: Candidate, data: &Signals, monitor: &mut Monitor<'_>, tried: &mut Vec<TriedBranches>) -> Candidate {
    for part in best.system.parts() {
        let present = best.system.pieces(part) as f64;
        let mut worse = 0;
        for factor in PIECES {
            if monitor.stopped().is_some() || worse > WORSE_PIECES {
                break;
            }
            let pieces = ((present * factor).round() as usize).clamp(1, MOST_PIECES);
            let Some(next) = with_pieces(&best.system, part, pieces, data) else {
                continue;
            };
            let next = fitted(next, data, TRIAL_STEPS, 1e-4, monitor);
            tried.push(next.tried(data));
            if next.better(&best, data) {
                (best, worse) = (next, 0);
            } else if factor > 1.0 {
                worse += 1;
            }
        }
    }
    best
}

/// The structural change of a linear part that lowers Schwarz's criterion most, over and over.
fn restructure(
    mut best: Candidate,
    data: &Signals,
    monitor: &mut Monitor<'_>,
    tried: &mut Vec<TriedBranches>,
) -> Candidate {
    for _ in 0..ROUNDS {
        let mut next: Option<Candidate> = None;
        for system in neighbours(&best.system) {
            if monitor.stopped().is_some() {
                return best;
            }
            let c = fitted(Candidate::new(system, data), data, TRIAL_STEPS, 1e-4, monitor);
            tried.push(c.tried(data));
            if next.as_ref().is_none_or(|n| c.better(n, data)) {
                next = Some(c);
            }
        }
        match next.filter(|n| n.better(&best, data)) {
            Some(n) => best = n,
            None => break,
        }
    }
    best
}

/// Without its fastest real pole, whose response goes on in the numerator, as far as that reaches.
///
/// A pole near the origin imitates a numerator coefficient; taken away together with a zero, as poles otherwise are, it takes one with
/// it that the system needs.
fn without_fastest(g: &Rational) -> Option<Rational> {
    let all = groups(&g.poles());
    let real = all.iter().enumerate().filter(|(_, p)| !p.1);
    let (fastest, pole) = real.min_by(|a, b| a.1.0.norm().total_cmp(&b.1.0.norm()))?;
    let rest = all.iter().enumerate().filter(|(i, _)| *i != fastest);
    let rest: Vec<Complex<f64>> = rest
        .flat_map(|(_, &(p, pair))| std::iter::once(p).chain(pair.then(|| p.conj())))
        .collect();
    let mut b = g.b.clone();
    for i in 1..b.len() {
        b[i] += pole.0.re * b[i - 1];
    }
    Some(Rational {
        b,
        ..Rational::from_roots(&[], &rest)
    })
}

/// Systems with one change of a linear part or of a delay.
fn neighbours(system: &System) -> Vec<System> {
    let mut all = Vec::new();
    for (i, branch) in system.branches.iter().enumerate() {
        let mut push = |linear: Rational, delay: usize| {
            let mut next = system.clone();
            next.branches[i].linear = linear;
            next.branches[i].delay = delay;
            all.push(next);
        };
        let (g, delay) = (&branch.linear, branch.delay);
        changes(g).into_iter().for_each(|g| push(g, delay));
        without_fastest(g).into_iter().for_each(|g| push(g, delay));
        let with = |b: Vec<f64>| Rational { b, ..g.clone() };
        if g.b.len() > 1 {
            push(with(g.b[1..].to_vec()), delay + 1);
        }
        if delay > 0 {
            push(
                with(std::iter::once(0.0).chain(g.b.iter().copied()).collect()),
                delay - 1,
            );
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fast_pole_goes_on_in_the_numerator() {
        let pair = [Complex::new(0.9, 0.3), Complex::new(0.9, -0.3)];
        let g = Rational {
            b: vec![0.5, 0.8, 0.0, 0.0],
            ..Rational::from_roots(
                &[],
                &[pair[0], pair[1], Complex::new(0.1, 0.0), Complex::new(-0.6, 0.0)],
            )
        };
        let less = without_fastest(&g).unwrap();
        assert_eq!((less.order(), less.b.len()), (3, 4));
        let impulse: Vec<f64> = std::iter::once(1.0).chain([0.0; 39]).collect();
        for (a, b) in g.run(&impulse).iter().zip(less.run(&impulse)) {
            assert!((a - b).abs() < 1e-2, "{a} {b}");
        }
        assert!(without_fastest(&Rational::from_roots(&[], &pair)).is_none());
    }
}
