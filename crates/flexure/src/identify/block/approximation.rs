//! The best linear approximation as a rational transfer function, its order chosen from the data.
//!
//! Started by the Steiglitz-McBride iteration, finished by Levenberg-Marquardt on the output error. For a Gaussian
//! input its poles and zeros are those of both linear blocks together (Bussgang's theorem).

use super::descent::{Residuals, descend};
use super::efficient::efficient;
use super::loss::{Data, delayed};
use super::monitor::Monitor;
use super::products::normal_equations;
use super::rational::Rational;
use super::refine::{bic, dependence};
use super::structure::changes;
use crate::linalg;
use crate::linear::levenberg_marquardt::NormalEquations;

/// Passes of the Steiglitz-McBride iteration.
const PASSES: usize = 12;
const ITERATIONS: usize = 40;
/// Rounds of structural change.
const ROUNDS: usize = 16;
const TOLERANCE: f64 = 1e-7;

/// The longest pure delay that is looked for, the samples and the order of the search, and what is left to the numerators.
const LONGEST_DELAY: usize = 100;
const DELAY_SAMPLES: usize = 5_000;
const DELAY_ORDER: usize = 3;
const DELAY_SLACK: usize = 6;

/// A linear model and its sum of squared errors.
#[derive(Debug, Clone)]
pub(in crate::identify) struct Approximation {
    pub system: Rational,
    pub squares: f64,
}

struct OutputError<'a> {
    data: &'a Data,
    structure: Rational,
}

impl Residuals for OutputError<'_> {
    fn from(&self) -> usize {
        self.data.from
    }

    fn residuals(&self, parameters: &[f64]) -> Option<Vec<f64>> {
        let g = self.structure.with(parameters);
        let error = |p: Vec<f64>| p.iter().zip(&self.data.y).map(|(p, y)| p - y).collect();
        g.is_stable().then(|| error(g.run(&self.data.u)))
    }

    fn linearise(&self, parameters: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
        let g = self.structure.with(parameters);
        let all_pole = g.all_pole(&self.data.u);
        let response = g.numerator(&all_pole);
        let mut jacobian: Vec<Vec<f64>> = (0..g.b.len()).map(|i| delayed(&all_pole, i, 1.0)).collect();
        for section in &g.sections {
            let by = section.run(&response);
            jacobian.extend((1..=section.order).map(|i| delayed(&by, i, -1.0)));
        }
        let residuals = response.iter().zip(&self.data.y).map(|(p, y)| p - y).collect();
        (residuals, jacobian)
    }
}

/// The approximation of the given order; `None` if none was found.
pub(in crate::identify) fn approximate(data: &Data, order: usize, monitor: &mut Monitor<'_>) -> Option<Approximation> {
    refitted(data, steiglitz_mcbride(data, order)?.system, monitor)
}

/// The approximation with poles and numerator coefficients added and taken away while Schwarz's criterion falls.
pub(in crate::identify) fn restructured(data: &Data, start: &Rational, monitor: &mut Monitor<'_>) -> Approximation {
    let mut data = data.clone();
    let mut best = Approximation {
        squares: data.squares(&start.run(&data.u)),
        system: start.clone(),
    };
    best = refitted(&data, best.system.clone(), monitor).unwrap_or(best);
    data.dependence = dependence(&best.system.run(&data.u), &data);
    let score = |a: &Approximation| bic(a.squares, a.system.parameters().len(), &data);
    for _ in 0..ROUNDS {
        let near = changes(&best.system).into_iter();
        let fits: Vec<Approximation> = near.filter_map(|g| refitted(&data, g, monitor)).collect();
        let next = fits.into_iter().min_by(|a, b| score(a).total_cmp(&score(b)));
        match next.filter(|n| score(n) < score(&best)) {
            Some(n) => best = n,
            None => break,
        }
    }
    best
}

/// The output error minimised from this system on.
fn refitted(data: &Data, structure: Rational, monitor: &mut Monitor<'_>) -> Option<Approximation> {
    let start = structure.parameters();
    let problem = OutputError { data, structure };
    let (p, squares) = descend(&problem, start, ITERATIONS, TOLERANCE, monitor)?;
    Some(Approximation {
        system: problem.structure.with(&p),
        squares,
    })
}

impl Approximation {
    /// By generalised least squares, if the error is coloured noise.
    pub fn efficient(self, data: &Data, monitor: &mut Monitor<'_>) -> Approximation {
        let problem = OutputError {
            data,
            structure: self.system.clone(),
        };
        match efficient(&problem, &self.system.parameters(), monitor) {
            Some((p, squares)) => Approximation {
                system: self.system.with(&p),
                squares,
            },
            None => self,
        }
    }
}

/// Equation error of the signals filtered by the last denominator, over and over; the best output error counts.
fn steiglitz_mcbride(data: &Data, order: usize) -> Option<Approximation> {
    let mut best: Option<Approximation> = None;
    let mut filter = Rational {
        b: vec![1.0],
        sections: Vec::new(),
    };
    for _ in 0..PASSES {
        let (u, y) = (filter.all_pole(&data.u), filter.all_pole(&data.y));
        let mut columns: Vec<Vec<f64>> = (0..=order).map(|i| delayed(&u, i, 1.0)).collect();
        columns.extend((1..=order).map(|i| delayed(&y, i, -1.0)));
        let minus: Vec<f64> = y.iter().map(|y| -y).collect();
        let equations = normal_equations(&minus, &columns, data.from);
        let Some(p) = solve(&equations) else { break };
        let a: Vec<f64> = std::iter::once(1.0).chain(p[order + 1..].iter().copied()).collect();
        let Some(system) = Rational::from_polynomials(p[..=order].to_vec(), &a) else {
            break;
        };
        let squares = data.squares(&system.run(&data.u));
        filter = Rational {
            b: vec![1.0],
            sections: system.sections.clone(),
        };
        if squares.is_finite() && best.as_ref().is_none_or(|b| squares < b.squares) {
            best = Some(Approximation { system, squares });
        }
    }
    best
}

/// The least-squares solution, slightly damped where the columns nearly depend on one another.
pub(in crate::identify) fn solve(equations: &NormalEquations) -> Option<Vec<f64>> {
    let n = equations.descent.len();
    let scale: Vec<f64> = (0..n)
        .map(|i| equations.normal[i * n + i].sqrt())
        .map(|d| if d > 0.0 { d } else { 1.0 })
        .collect();
    let rhs: Vec<f64> = equations.descent.iter().zip(&scale).map(|(d, s)| d / s).collect();
    let mut ridge = 1e-13;
    while ridge < 1e-3 {
        let mut matrix: Vec<f64> = (0..n * n)
            .map(|k| equations.normal[k] / (scale[k / n] * scale[k % n]))
            .collect();
        (0..n).for_each(|i| matrix[i * n + i] += ridge);
        if let Some(x) = linalg::solve_positive_definite(&matrix, &rhs) {
            return Some(x.iter().zip(&scale).map(|(x, s)| x / s).collect());
        }
        ridge *= 100.0;
    }
    None
}

/// A delay too long for numerators to imitate, less some slack; zero if there is none.
///
/// The delay at which a low-order equation error is least (Ljung 1999, section 14.5).
pub(super) fn pure_delay(data: &Data) -> usize {
    let data = data.head(DELAY_SAMPLES);
    let longest = LONGEST_DELAY.min(data.counted() / 10);
    let squares = |delay: usize| {
        let mut columns: Vec<Vec<f64>> = (0..=DELAY_ORDER).map(|i| delayed(&data.u, delay + i, 1.0)).collect();
        columns.extend((1..=DELAY_ORDER).map(|i| delayed(&data.y, i, -1.0)));
        let minus: Vec<f64> = data.y.iter().map(|y| -y).collect();
        let equations = normal_equations(&minus, &columns, data.from);
        let explained = |p: Vec<f64>| p.iter().zip(&equations.descent).map(|(p, d)| p * d).sum::<f64>();
        solve(&equations).map_or(f64::INFINITY, |p| equations.cost - explained(p))
    };
    let least = (0..=longest)
        .map(|d| (d, squares(d)))
        .fold((0, f64::INFINITY), |a, b| if b.1 < a.1 { b } else { a });
    least.0.saturating_sub(DELAY_SLACK)
}
