//! The best linear approximation as a rational transfer function, its order chosen from the data.
//!
//! Started by the Steiglitz-McBride iteration, finished by Levenberg-Marquardt on the output error. For a Gaussian
//! input its poles and zeros are those of both linear blocks together (Bussgang's theorem).

use super::changes::changes;
use super::descent::{Residuals, descend};
use super::efficient::efficient;
use super::monitor::Monitor;
use super::products::normal_equations;
use super::rational::Rational;
use super::signals::{Signals, delayed};
use crate::linalg;
use crate::linear::levenberg_marquardt::NormalEquations;

/// Passes of the Steiglitz-McBride iteration.
const PASSES: usize = 12;
const ITERATIONS: usize = 40;
/// Rounds of structural change.
const ROUNDS: usize = 16;
const TOLERANCE: f64 = 1e-7;

/// The longest lag that is looked for.
const LONGEST_LAG: usize = 100;
/// Samples and order of the search for the pure delay, and what of it is left to the numerators.
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
    data: &'a Signals,
    structure: Rational,
}

impl Residuals for OutputError<'_> {
    fn from(&self) -> usize {
        self.data.from
    }

    fn residuals(&self, parameters: &[f64]) -> Option<Vec<f64>> {
        let g = self.structure.with(parameters);
        let error = |p: Vec<f64>| p.iter().zip(&self.data.y).map(|(p, y)| p - y).collect();
        g.is_stable().then(|| error(g.run(self.data.input())))
    }

    fn linearise(&self, parameters: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
        let g = self.structure.with(parameters);
        let all_pole = g.all_pole(self.data.input());
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
pub(in crate::identify) fn approximate(
    data: &Signals,
    order: usize,
    monitor: &mut Monitor<'_>,
) -> Option<Approximation> {
    refitted(data, start(data, order)?.system, monitor)
}

/// The approximation with poles and numerator coefficients added and taken away while Schwarz's criterion falls.
pub(in crate::identify) fn restructured(data: &Signals, start: &Rational, monitor: &mut Monitor<'_>) -> Approximation {
    let mut data = data.clone();
    let mut best = Approximation {
        squares: data.squares(&start.run(data.input())),
        system: start.clone(),
    };
    best = refitted(&data, best.system.clone(), monitor).unwrap_or(best);
    data.set_dependence(&best.system.run(data.input()));
    let score = |a: &Approximation| data.bic(a.squares, a.system.count());
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
fn refitted(data: &Signals, structure: Rational, monitor: &mut Monitor<'_>) -> Option<Approximation> {
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
    pub fn efficient(self, data: &Signals, monitor: &mut Monitor<'_>) -> Approximation {
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

/// The system of the best output error among the passes of the Steiglitz-McBride iteration.
fn start(data: &Signals, order: usize) -> Option<Approximation> {
    let mut best: Option<Approximation> = None;
    let problem = EquationError {
        signals: std::slice::from_ref(&data.u[0]),
        y: &data.y,
        constant: false,
        order,
        from: data.from,
    };
    problem.iterate(PASSES, |b, denominator| {
        let system = Rational {
            b: b.to_vec(),
            ..denominator.clone()
        };
        let squares = data.squares(&system.run(data.input()));
        if squares.is_finite() && best.as_ref().is_none_or(|b| squares < b.squares) {
            best = Some(Approximation { system, squares });
        }
        b.iter().all(|b| b.is_finite()).then_some(())
    });
    best
}

/// Linear systems of this order with one denominator from several signals to one output.
pub(in crate::identify) struct EquationError<'a> {
    pub signals: &'a [Vec<f64>],
    pub y: &'a [f64],
    /// Whether a constant is added to the output.
    pub constant: bool,
    pub order: usize,
    /// Samples from here on count.
    pub from: usize,
}

impl EquationError<'_> {
    /// The Steiglitz-McBride iteration: least squares of the equation error of the signals filtered by the last denominator, over
    /// and over. `judge` takes the numerators, one signal after the other, and 1 over the denominator, and ends the iteration by `None`.
    pub fn iterate(&self, passes: usize, mut judge: impl FnMut(&[f64], &Rational) -> Option<()>) {
        let mut filter = Rational::pass();
        for _ in 0..passes {
            let y = filter.all_pole(self.y);
            let minus: Vec<f64> = y.iter().map(|y| -y).collect();
            let filtered = self.signals.iter().map(|signal| filter.all_pole(signal));
            let mut columns: Vec<Vec<f64>> = filtered
                .flat_map(|signal| (0..=self.order).map(move |k| delayed(&signal, k, 1.0)))
                .collect();
            columns.extend((1..=self.order).map(|k| delayed(&y, k, -1.0)));
            if self.constant {
                columns.push(filter.all_pole(&vec![1.0; y.len()]));
            }
            let Some(p) = solve(&normal_equations(&minus, &columns, self.from)) else {
                return;
            };
            let (numerators, rest) = p.split_at(self.signals.len() * (self.order + 1));
            let a: Vec<f64> = std::iter::once(1.0).chain(rest[..self.order].iter().copied()).collect();
            let Some(denominator) = Rational::from_polynomials(vec![1.0], &a) else {
                return;
            };
            if judge(numerators, &denominator).is_none() {
                return;
            }
            filter = denominator;
        }
    }
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
pub(super) fn pure_delay(data: &Signals) -> usize {
    let data = data.head(DELAY_SAMPLES);
    let past: Vec<Vec<f64>> = (1..=DELAY_ORDER).map(|i| delayed(&data.y, i, -1.0)).collect();
    let least = least_lag(&data, |delay| {
        let lags = (0..=DELAY_ORDER).map(|i| delayed(data.input(), delay + i, 1.0));
        lags.chain(past.iter().cloned()).collect()
    });
    least.saturating_sub(DELAY_SLACK)
}

/// The lag, up to 100 samples and a tenth of the record, at which least squares of the output over these columns leave least.
pub(in crate::identify) fn least_lag(data: &Signals, columns: impl Fn(usize) -> Vec<Vec<f64>>) -> usize {
    let minus: Vec<f64> = data.y.iter().map(|y| -y).collect();
    let squares = |lag: usize| {
        let equations = normal_equations(&minus, &columns(lag), data.from);
        let explained = |p: Vec<f64>| p.iter().zip(&equations.descent).map(|(p, d)| p * d).sum::<f64>();
        solve(&equations).map_or(f64::INFINITY, |p| equations.cost - explained(p))
    };
    let mut least = (0, f64::INFINITY);
    for lag in 0..=LONGEST_LAG.min(data.counted() / 10) {
        let squares = squares(lag);
        if squares < least.1 {
            least = (lag, squares);
        }
    }
    least.0
}
