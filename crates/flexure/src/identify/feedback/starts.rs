//! The starts of the search for a loop.
//!
//! With a guess of the signal $z_k$ that enters the nonlinearity the equation error
//! $$ A(q)\, y_k = B(q)\, u_k + \sum_j C_j(q)\, \varphi_j(z_k) + c $$
//! is linear in its unknowns; the $\varphi_j$ are B-splines less their lines over the data, since A and B already contain lines. Filtering
//! by 1/A (Steiglitz and McBride 1965) makes it a simulation error, except for z. The dominant product of the $C_j$ gives the one numerator
//! and the spline (Bai 1998). Guesses of z are the measured output, its difference, the input, and directions in the state space of the
//! best linear approximation (the latent route of Floren, Noel & Swevers 2025, with a few fixed directions instead of a smoother).

use super::limits::{CORRECTIONS, MOST_DIRECTIONS, PASSES, START_PIECES};
use super::system::{Entering, Loop, Observed};
use crate::identify::block::{KinkedSpline, Rational, delayed, dominant_products};
use crate::linear::correlation::about_mean;
use crate::linear::least_squares::least_squares;
use crate::vectors::dot;

/// A guess of the nonlinearity's input.
pub(super) struct Guess {
    pub name: &'static str,
    pub z: Vec<f64>,
    pub entering: Entering,
}

/// All guesses, with the linear approximation of an order.
pub(super) fn guesses(data: &Observed, linear: &Rational) -> Vec<Guess> {
    let hidden = |name, z| Guess {
        name,
        z,
        entering: Entering::Hidden,
    };
    let difference = (0..data.y.len()).map(|k| if k == 0 { 0.0 } else { data.y[k] - data.y[k - 1] });
    let mut all = vec![
        Guess {
            name: "the output",
            z: data.y.clone(),
            entering: Entering::Output,
        },
        hidden("the output's difference", difference.collect()),
        hidden("the input", data.u.clone()),
    ];
    let states = linear_states(data, linear);
    all.extend(directions(states.len()).into_iter().take(MOST_DIRECTIONS).map(|d| {
        let at = |k: usize| d.iter().zip(&states).map(|(d, x)| d * x[k]).sum();
        hidden("a hidden signal", (0..data.u.len()).map(at).collect())
    }));
    all
}

/// Unit vectors, and the sums and differences of two.
fn directions(n: usize) -> Vec<Vec<f64>> {
    let unit = |i: usize| -> Vec<f64> { (0..n).map(|j| if i == j { 1.0 } else { 0.0 }).collect() };
    let mut all: Vec<Vec<f64>> = (0..n).map(unit).collect();
    for i in 0..n {
        for j in i + 1..n {
            for sign in [1.0, -1.0] {
                let mut d = unit(i);
                d[j] = sign;
                all.push(d);
            }
        }
    }
    all
}

/// The states of a linear system under the input, uncorrelated and of unit variance.
fn linear_states(data: &Observed, linear: &Rational) -> Vec<Vec<f64>> {
    let spline = KinkedSpline::new(&[-1.0, 1.0]);
    let Some(system) = realised(linear, &[0.0], spline, 0.0) else {
        return Vec::new();
    };
    let balanced = system.corrected(0.0).balanced(data);
    let mut states = vec![Vec::with_capacity(data.u.len()); balanced.order()];
    // A system that runs away has no states at the end of the record.
    match balanced.run(data, |s| states.iter_mut().zip(s.x).for_each(|(own, x)| own.push(*x))) {
        true => states,
        false => Vec::new(),
    }
}

/// The loop in observer form with the numerator `c` from the nonlinearity, over the denominator of `linear`; z is the output.
fn realised(linear: &Rational, c: &[f64], spline: KinkedSpline, offset: f64) -> Option<Loop> {
    let g = linear.transfer_function(0).ok()?;
    let n = (g.a().len() - 1).max(g.b().len() - 1).max(c.len() - 1).max(1);
    let padded = |p: &[f64]| -> Vec<f64> { (0..=n).map(|i| p.get(i).copied().unwrap_or(0.0)).collect() };
    let (a, b, c) = (padded(g.a()), padded(g.b()), padded(c));
    let mut state = vec![0.0; n * n];
    for i in 0..n {
        state[i * n] = -a[i + 1];
        if i + 1 < n {
            state[i * n + i + 1] = 1.0;
        }
    }
    let first: Vec<f64> = (0..n).map(|i| if i == 0 { 1.0 } else { 0.0 }).collect();
    Some(Loop {
        a: state,
        bu: (1..=n).map(|i| b[i] - a[i] * b[0]).collect(),
        bw: (1..=n).map(|i| c[i] - a[i] * c[0]).collect(),
        cy: first.clone(),
        cz: first,
        dyu: b[0],
        dyw: c[0],
        dzu: b[0],
        offset,
        spline,
        correction: (1..=n).map(|i| -a[i]).collect(),
        initial: vec![vec![0.0; n]],
        entering: Entering::Output,
    })
}

/// A loop and its sum of squared prediction errors.
pub(super) struct Start {
    pub system: Loop,
    pub squares: f64,
}

/// The best pass of the iteration for one guess; `None` if there is none.
pub(super) fn start(data: &Observed, guess: &Guess, order: usize) -> Option<Start> {
    let spline = KinkedSpline::coarse(&guess.z, START_PIECES)?;
    let bends = Bends::new(&spline, &guess.z)?;
    // The output cannot enter the loop without a delay.
    let first = if guess.entering == Entering::Output { 1 } else { 0 };
    let mut filter = Rational::pass();
    let mut best: Option<Start> = None;
    for _ in 0..PASSES {
        let Some(pass) = pass(data, &bends, order, first, &filter) else {
            break;
        };
        if let Some(found) = closed(data, guess, &spline, &bends, &pass)
            && best.as_ref().is_none_or(|b| found.squares < b.squares)
        {
            best = Some(found);
        }
        filter = pass.linear.with_numerator(vec![1.0]);
    }
    best
}

/// B-splines of a signal less their lines.
struct Bends {
    columns: Vec<Vec<f64>>,
    /// The B-spline of every column, and its line.
    lines: Vec<Line>,
}

struct Line {
    spline: usize,
    level: f64,
    slope: f64,
}

impl Bends {
    fn new(spline: &KinkedSpline, z: &[f64]) -> Option<Bends> {
        let local: Vec<_> = z.iter().map(|z| spline.local(*z)).collect();
        let ones = vec![1.0; z.len()];
        let base = [ones, z.to_vec()];
        let middle = spline.middle();
        let mut bends = Bends {
            columns: Vec::new(),
            lines: Vec::new(),
        };
        // The sum of all B-splines is a constant, and with their abscissas as weights it is a line: so two of them are left out.
        for j in (0..spline.c.len()).filter(|j| *j != middle && *j + 1 != middle) {
            let values = spline.by_parameter(j, z, &local);
            let found = least_squares(&values, &base, 0)?.coefficients;
            let line = Line {
                spline: j,
                level: found[0],
                slope: found[1],
            };
            let left = values.iter().zip(z).map(|(v, z)| v - line.level - line.slope * z);
            bends.columns.push(left.collect());
            bends.lines.push(line);
        }
        Some(bends)
    }

    /// The spline with these weights of the columns.
    fn combined(&self, spline: &KinkedSpline, weights: &[f64]) -> KinkedSpline {
        let mut combined = spline.clone();
        let abscissas = spline.line();
        combined.c.fill(0.0);
        for (line, weight) in self.lines.iter().zip(weights) {
            combined.c[line.spline] += weight;
            let each = combined.c.iter_mut().zip(&abscissas);
            each.for_each(|(c, x)| *c -= weight * (line.level + line.slope * x));
        }
        combined
    }
}

/// The result of one pass.
struct Pass {
    linear: Rational,
    /// The numerator from the nonlinearity, from lag 0 on, and the columns' weights.
    numerator: Vec<f64>,
    weights: Vec<f64>,
    constant: f64,
}

fn pass(data: &Observed, bends: &Bends, order: usize, first: usize, filter: &Rational) -> Option<Pass> {
    let through = |signal: &[f64]| filter.all_pole(signal);
    let (u, y) = (through(&data.u), through(&data.y));
    let mut columns: Vec<Vec<f64>> = (0..=order).map(|k| delayed(&u, k, 1.0)).collect();
    columns.extend((1..=order).map(|k| delayed(&y, k, -1.0)));
    columns.push(through(&vec![1.0; data.y.len()]));
    for bend in &bends.columns {
        let bend = through(bend);
        columns.extend((first..=order).map(|k| delayed(&bend, k, 1.0)));
    }
    let found = least_squares(&y, &columns, order)?.coefficients;
    let (b, others) = found.split_at(order + 1);
    let (a, others) = others.split_at(order);
    let (constant, others) = others.split_at(1);
    let a: Vec<f64> = std::iter::once(1.0).chain(a.iter().copied()).collect();
    let products = dominant_products(others, order + 1 - first, 1)?;
    let product = products.into_iter().next()?;
    let linear = Rational::from_polynomials(b.to_vec(), &a)?;
    Some(Pass {
        constant: constant[0] / linear.transfer_function(0).ok()?.a().iter().sum::<f64>(),
        linear,
        numerator: std::iter::repeat_n(0.0, first).chain(product.row).collect(),
        weights: product.column,
    })
}

/// The loop that a pass has found, judged by its predictions with a part of the correction, so that it rarely runs away.
fn closed(data: &Observed, guess: &Guess, spline: &KinkedSpline, bends: &Bends, pass: &Pass) -> Option<Start> {
    let spline = bends.combined(spline, &pass.weights);
    let offset = if pass.constant.is_finite() { pass.constant } else { 0.0 };
    let mut system = realised(&pass.linear, &pass.numerator, spline, offset)?;
    if guess.entering == Entering::Hidden {
        system.entering = Entering::Hidden;
        (system.cz, system.dzu) = seen(data, guess, &system)?;
    }
    system.initial = vec![vec![0.0; system.order()]; data.starts.len()];
    let squares = system.corrected(CORRECTIONS[0]).squares(data);
    squares.is_finite().then_some(Start { system, squares })
}

/// The least-squares weights of a guess on the states and the input of the open loop.
fn seen(data: &Observed, guess: &Guess, system: &Loop) -> Option<(Vec<f64>, f64)> {
    let n = system.order();
    let mut columns = vec![Vec::with_capacity(data.u.len()); n];
    let mut x = vec![0.0; n];
    for (u, z) in data.u.iter().zip(&guess.z) {
        columns.iter_mut().zip(&x).for_each(|(c, x)| c.push(*x));
        let w = system.spline.value(*z);
        let next = |i: usize| dot(&system.a[i * n..(i + 1) * n], &x) + system.bu[i] * u + system.bw[i] * w;
        x = (0..n).map(next).collect();
    }
    columns.push(data.u.clone());
    let centred: Vec<Vec<f64>> = columns.iter().map(|c| about_mean(c)).collect();
    let mut found = least_squares(&about_mean(&guess.z), &centred, 0)?.coefficients;
    let direct = found.pop()?;
    found.iter().all(|c| c.is_finite()).then_some((found, direct))
}
