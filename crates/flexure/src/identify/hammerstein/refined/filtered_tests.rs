use rand::{RngExt, SeedableRng};

use super::*;

/// The powers and some breakpoints at 300 points, and an output that depends on a few of them.
fn problem(seed: u64) -> (Vec<Term>, Vec<f64>, Vec<Vec<f64>>) {
    let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
    let s: Vec<f64> = (0..300).map(|_| random.random_range(-1.0..1.0)).collect();
    let places = [-0.6, -0.2, 0.1, 0.5].into_iter();
    let breakpoints = places.flat_map(|at| DEGREES.map(|degree| Term::TruncatedPower { at, degree }));
    let terms: Vec<Term> = powers().chain(breakpoints).collect();
    let columns: Vec<Vec<f64>> = terms.iter().map(|t| s.iter().map(|s| t.value(*s)).collect()).collect();
    let y = (0..s.len())
        .map(|i| 1.0 + 3.0 * columns[5][i] - 2.0 * columns[10][i] + random.random_range(-0.1..0.1))
        .collect();
    (terms, y, columns)
}

/// The sum of squares of the regression on some of the columns, from the samples themselves.
fn squares_on(chosen: &[usize], y: &[f64], columns: &[Vec<f64>]) -> f64 {
    let rows: Vec<f64> = (0..y.len())
        .flat_map(|i| chosen.iter().map(move |k| columns[*k][i]))
        .collect();
    let c = crate::linalg::least_squares(&rows, chosen.len(), y).expect("independent columns");
    let errors = rows.chunks(chosen.len()).zip(y);
    errors
        .map(|(row, y)| (y - row.iter().zip(&c).map(|(x, c)| x * c).sum::<f64>()).powi(2))
        .sum()
}

/// Equal except for rounding. Gains and losses are differences of sums of squares of about this size.
fn close(a: f64, b: f64, squares: f64) -> bool {
    (a - b).abs() < 1e-8 * squares
}

#[test]
fn sweeping_in_and_out_is_regression_on_what_is_inside() {
    for seed in 0..20 {
        let (terms, y, columns) = problem(seed);
        let mut sweep = Sweep::new(terms.clone(), &y, &columns);
        // Powers and jumps, in another order than theirs; one goes again.
        for k in [4, 0, 1, 10, 5, 13, 2] {
            sweep.toggle(k);
        }
        sweep.toggle(13);
        let inside = [0, 1, 2, 4, 5, 10];
        let now = squares_on(&inside, &y, &columns);
        assert!(close(sweep.squares(), now, now), "{seed}: {} {now}", sweep.squares());
        for k in 0..terms.len() {
            if inside.contains(&k) {
                let rest: Vec<usize> = inside.into_iter().filter(|i| *i != k).collect();
                let lost = squares_on(&rest, &y, &columns) - now;
                assert!(
                    close(sweep.loss(k), lost, now + lost),
                    "{seed}, {k}: {} {lost}",
                    sweep.loss(k)
                );
                assert_eq!(sweep.gain(k), f64::NEG_INFINITY);
            } else {
                let all: Vec<usize> = inside.into_iter().chain([k]).collect();
                let gained = now - squares_on(&all, &y, &columns);
                assert!(
                    close(sweep.gain(k), gained, now),
                    "{seed}, {k}: {} {gained}",
                    sweep.gain(k)
                );
            }
        }
    }
}

/// A term that the others span has no gain, and stays outside.
#[test]
fn what_the_others_span_stays_outside() {
    let (mut terms, y, mut columns) = problem(1);
    let sum = columns[5].iter().zip(&columns[1]).map(|(a, b)| a + 3.0 * b).collect();
    terms.push(Term::TruncatedPower { at: 0.3, degree: 1 });
    columns.push(sum);
    let mut sweep = Sweep::new(terms, &y, &columns);
    [0, 1, 5, 16].into_iter().for_each(|k| sweep.add(k));
    assert_eq!(sweep.inside.iter().filter(|inside| **inside).count(), 3);
    let squares = squares_on(&[0, 1, 5], &y, &columns);
    assert!(close(sweep.squares(), squares, squares));
}

/// The search finds the kink and the jump that the output has, whether it begins with a straight line or with a cubic.
#[test]
fn the_search_finds_what_is_there() {
    for seed in 0..20 {
        let (terms, y, columns) = problem(seed);
        for start in [2, 4] {
            let found = Sweep::new(terms.clone(), &y, &columns).chosen_from(start);
            let breakpoints: Vec<Term> = found.chosen().into_iter().filter(Term::is_breakpoint).collect();
            assert_eq!(breakpoints, [terms[5], terms[10]], "{seed}, {start}");
        }
    }
}
