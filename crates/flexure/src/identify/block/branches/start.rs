//! Where the search starts: least squares over B-splines of the inputs, each with a numerator of its own.
//!
//! With coarse splines the sum of Hammerstein branches is linear in its (too many) parameters: a system from the splines of
//! all inputs to the output with one denominator, found by the Steiglitz-McBride iteration; the numerators of an input's splines
//! are then one polynomial times the spline's coefficient, of which the dominant singular vectors are taken (Bai 1998). A last
//! nonlinearity only turns up as a gain and as noise that is uncorrelated with the sum, exactly so where the sum is Gaussian
//! (Bussgang's theorem).

use super::super::{Rational, Shape, delayed, normal_equations, solve, thinned};
use super::system::{Branch, Signals, System};

/// Pieces of the coarse nonlinearities.
const PIECES: usize = 5;
/// Pieces when delays are looked for.
const DELAY_PIECES: usize = 3;
/// The fewest samples in a piece.
const FEWEST_IN_PIECE: usize = 12;
/// Passes of the Steiglitz-McBride iteration.
const PASSES: usize = 8;
/// Power iterations for the dominant singular vectors.
const POWER_ITERATIONS: usize = 60;
/// The longest delay that is looked for, the samples and the order of the search, and what is left to the numerators.
const LONGEST_DELAY: usize = 100;
const DELAY_SAMPLES: usize = 4_000;
const DELAY_ORDER: usize = 2;
const DELAY_SLACK: usize = 1;

/// A spline that is zero, with its breakpoints at quantiles of a signal; `None` if the signal has too few values.
pub(in crate::identify) fn coarse(signal: &[f64], pieces: usize) -> Option<Shape> {
    let mut sorted = signal.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let last = sorted.len().checked_sub(1)?;
    let (low, high) = (sorted[0], sorted[last]);
    if !((high - low).is_finite() && high - low > 1e-9 * low.abs().max(high.abs())) {
        return None;
    }
    let inner = (1..pieces).map(|i| sorted[i * last / pieces]);
    let mut at: Vec<f64> = std::iter::once(low).chain(inner).chain([high]).collect();
    at.dedup_by(|b, a| *b - *a <= 1e-6 * (high - low));
    if let Some(end) = at.last_mut() {
        *end = high;
    }
    (at.len() > 1).then(|| Shape::new(&thinned(&at, &sorted, FEWEST_IN_PIECE, FEWEST_IN_PIECE)))
}

/// The B-splines of a signal but for the middle one, which a constant takes the place of; and the middle one's index.
pub(in crate::identify) fn splines(signal: &[f64], shape: &Shape) -> (Vec<Vec<f64>>, usize) {
    let local: Vec<_> = signal.iter().map(|u| shape.local(*u)).collect();
    let (n, middle) = (shape.c.len(), shape.c.len() / 2);
    let columns = (0..n)
        .filter(|j| *j != middle)
        .map(|j| shape.by_parameter(j, signal, &local));
    (columns.collect(), middle)
}

/// The delay of every input: that at which an equation error of low order with its splines is least, less some slack.
pub(in crate::identify) fn delays(data: &Signals) -> Vec<usize> {
    let data = data.head(DELAY_SAMPLES);
    let longest = LONGEST_DELAY.min(data.counted() / 10);
    let minus: Vec<f64> = data.y.iter().map(|y| -y).collect();
    let past = (1..=DELAY_ORDER).map(|i| delayed(&data.y, i, -1.0));
    let always: Vec<Vec<f64>> = past.chain([vec![1.0; data.y.len()]]).collect();
    let of = |u: &Vec<f64>| {
        let Some(shape) = coarse(&u[data.from..], DELAY_PIECES) else {
            return 0;
        };
        let (basis, _) = splines(u, &shape);
        let squares = |delay: usize| {
            let lags = (delay..=delay + DELAY_ORDER).flat_map(|d| basis.iter().map(move |c| delayed(c, d, 1.0)));
            let columns: Vec<Vec<f64>> = lags.chain(always.iter().cloned()).collect();
            let equations = normal_equations(&minus, &columns, data.from);
            let explained = |p: Vec<f64>| p.iter().zip(&equations.descent).map(|(p, d)| p * d).sum::<f64>();
            solve(&equations).map_or(f64::INFINITY, |p| equations.cost - explained(p))
        };
        let least = (0..=longest)
            .map(|d| (d, squares(d)))
            .fold((0, f64::INFINITY), |a, b| if b.1 < a.1 { b } else { a });
        least.0.saturating_sub(DELAY_SLACK)
    };
    data.u.iter().map(of).collect()
}

/// Branches of the given order with these delays, so many an input, and no last nonlinearity; `None` if none were found.
///
/// The branches stand input by input; those of one input have the same denominator.
pub(in crate::identify) fn branches(data: &Signals, order: usize, delays: &[usize], each: usize) -> Option<System> {
    let inputs: Option<Vec<Input>> = data
        .u
        .iter()
        .zip(delays)
        .map(|(u, delay)| Input::new(u, *delay, data.from))
        .collect();
    let inputs = inputs?;
    let repeated = data.u.iter().flat_map(|u| std::iter::repeat_n(u.clone(), each));
    let repeated: Vec<Vec<f64>> = repeated.collect();
    let mut filter = Rational {
        b: vec![1.0],
        sections: Vec::new(),
    };
    let mut best: Option<(System, f64)> = None;
    for _ in 0..PASSES {
        let y = filter.all_pole(&data.y);
        let minus: Vec<f64> = y.iter().map(|y| -y).collect();
        let mut columns = Vec::new();
        for input in &inputs {
            for spline in &input.splines {
                let filtered = filter.all_pole(spline);
                columns.extend((0..=order).map(|k| delayed(&filtered, k, 1.0)));
            }
        }
        columns.extend((1..=order).map(|k| delayed(&y, k, -1.0)));
        columns.push(filter.all_pole(&vec![1.0; y.len()]));
        let Some(p) = solve(&normal_equations(&minus, &columns, data.from)) else {
            break;
        };
        let first = p.len() - 1 - order;
        let a: Vec<f64> = std::iter::once(1.0)
            .chain(p[first..first + order].iter().copied())
            .collect();
        let Some(linear) = Rational::from_polynomials(vec![1.0], &a) else {
            break;
        };
        let Some(system) = assembled(&inputs, &p[..first], order, &linear, each) else {
            break;
        };
        let system = with_offset(system, &repeated, data);
        let squares = data.squares(&system.run(&repeated));
        filter = linear;
        if squares.is_finite() && best.as_ref().is_none_or(|b| squares < b.1) {
            best = Some((system, squares));
        }
    }
    best.map(|b| b.0)
}

/// A delayed input's coarse nonlinearity and its splines.
struct Input {
    delay: usize,
    shape: Shape,
    middle: usize,
    splines: Vec<Vec<f64>>,
}

impl Input {
    fn new(u: &[f64], delay: usize, from: usize) -> Option<Input> {
        let shape = coarse(&u[from..], PIECES)?;
        let (splines, middle) = splines(&delayed(u, delay, 1.0), &shape);
        Some(Input {
            delay,
            shape,
            middle,
            splines,
        })
    }
}

/// The branches whose numerators are the dominant parts of these, `each` of every input.
fn assembled(
    inputs: &[Input],
    numerators: &[f64],
    order: usize,
    denominator: &Rational,
    each: usize,
) -> Option<System> {
    let mut rest = numerators;
    let mut all = Vec::new();
    for input in inputs {
        let (mine, others) = rest.split_at(input.splines.len() * (order + 1));
        rest = others;
        for (mut c, b) in dominant_products(mine, order + 1, each)? {
            c.insert(input.middle, 0.0);
            let mut shape = input.shape.clone();
            shape.c = c;
            all.push(Branch {
                delay: input.delay,
                shape,
                linear: Rational {
                    b,
                    ..denominator.clone()
                },
            });
        }
    }
    Some(System {
        branches: all,
        offset: 0.0,
        output: None,
    })
}

/// The first products of a column and a row that are nearest to a row-major matrix, each to what those before leave.
pub(in crate::identify) fn dominant_products(
    matrix: &[f64],
    columns: usize,
    count: usize,
) -> Option<Vec<(Vec<f64>, Vec<f64>)>> {
    let mut left = matrix.to_vec();
    let mut products = Vec::new();
    for _ in 0..count {
        let (column, row) = dominant(&left, columns)?;
        for (entries, c) in left.chunks_exact_mut(columns).zip(&column) {
            entries.iter_mut().zip(&row).for_each(|(e, r)| *e -= c * r);
        }
        products.push((column, row));
    }
    Some(products)
}

/// The column and the row whose product is nearest to a row-major matrix; the row's largest entry is 1.
fn dominant(matrix: &[f64], columns: usize) -> Option<(Vec<f64>, Vec<f64>)> {
    let rows = || matrix.chunks_exact(columns);
    let size = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>();
    let largest = rows().max_by(|a, b| size(a).total_cmp(&size(b)))?;
    let mut row = largest.to_vec();
    let mut column = Vec::new();
    for _ in 0..POWER_ITERATIONS {
        let norm = size(&row).sqrt();
        if !(norm > 0.0 && norm.is_finite()) {
            return None;
        }
        row.iter_mut().for_each(|r| *r /= norm);
        column = rows().map(|m| m.iter().zip(&row).map(|(m, r)| m * r).sum()).collect();
        row.fill(0.0);
        for (m, c) in rows().zip(&column) {
            row.iter_mut().zip(m).for_each(|(r, m)| *r += c * m);
        }
    }
    let squares = size(&column);
    let scale = row.iter().fold(0.0_f64, |m, v| if v.abs() > m.abs() { *v } else { m });
    if !(squares > 0.0 && scale != 0.0 && scale.is_finite()) {
        return None;
    }
    column.iter_mut().for_each(|c| *c *= scale / squares);
    row.iter_mut().for_each(|r| *r /= scale);
    Some((column, row))
}

/// The system with the offset that leaves no mean error.
fn with_offset(mut system: System, u: &[Vec<f64>], data: &Signals) -> System {
    let output = system.run(u);
    let errors = data.y.iter().zip(&output).skip(data.from).map(|(y, p)| y - p);
    system.offset += errors.sum::<f64>() / data.counted() as f64;
    system
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_dominant_product_of_a_matrix_of_rank_one_is_the_matrix() {
        let (c, b) = ([0.3, -1.0, 2.0, 0.0], [0.5, -0.25, 0.1]);
        let matrix: Vec<f64> = c.iter().flat_map(|c| b.iter().map(move |b| c * b)).collect();
        let (column, row) = dominant(&matrix, 3).unwrap();
        assert!((row[0].abs() - 1.0).abs() < 1e-12, "{row:?}");
        for (i, c) in column.iter().enumerate() {
            for (j, b) in row.iter().enumerate() {
                assert!((c * b - matrix[3 * i + j]).abs() < 1e-12);
            }
        }
        assert!(dominant(&[0.0; 6], 3).is_none());
    }

    #[test]
    fn two_products_of_a_matrix_of_rank_two_are_the_matrix() {
        let entry = |i: usize, j: usize| (i as f64 - 1.5) * (j as f64 + 1.0) + (i * i) as f64 * [0.3, -1.0, 0.2][j];
        let matrix: Vec<f64> = (0..12).map(|k| entry(k / 3, k % 3)).collect();
        let products = dominant_products(&matrix, 3, 2).unwrap();
        for (k, want) in matrix.iter().enumerate() {
            let got: f64 = products.iter().map(|(c, r)| c[k / 3] * r[k % 3]).sum();
            assert!((got - want).abs() < 1e-9, "{k}: {got} {want}");
        }
    }

    #[test]
    fn coarse_breakpoints_are_distinct_even_for_few_levels() {
        let levels: Vec<f64> = (0..300).map(|i| f64::from(i % 3)).collect();
        let shape = coarse(&levels, 5).unwrap();
        assert!(shape.breakpoints().windows(2).all(|w| w[1] > w[0]), "{shape:?}");
        assert!(coarse(&[2.0; 50], 5).is_none());
    }
}
