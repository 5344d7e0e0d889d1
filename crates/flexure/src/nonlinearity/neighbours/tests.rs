//! Both searches against a look at every point.

use proptest::prelude::*;
use rand::{Rng, RngExt, SeedableRng};

use super::super::estimator::{Estimator, Regression};
use super::*;

type Columns = Vec<Vec<f64>>;

fn slices(columns: &[Vec<f64>]) -> Vec<&[f64]> {
    columns.iter().map(Vec::as_slice).collect()
}

/// The definition, by sorting all distances.
fn direct(x: &[Vec<f64>], scales: &[f64], y: &[f64], w: &[f64], q: &[f64], k: f64, skip: Option<usize>) -> f64 {
    let mut all: Vec<(f64, f64, f64)> = (0..y.len())
        .filter(|i| Some(*i) != skip)
        .map(|i| {
            (
                (0..q.len()).map(|j| ((x[j][i] - q[j]) / scales[j]).powi(2)).sum(),
                w[i],
                y[i],
            )
        })
        .collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut weight, mut sum) = (0.0, 0.0);
    for group in all.chunk_by(|a, b| a.0 == b.0) {
        let here: f64 = group.iter().map(|g| g.1).sum();
        let share = ((k - weight) / here).min(1.0);
        sum += share * group.iter().map(|g| g.1 * g.2).sum::<f64>();
        weight += here;
        if weight >= k {
            break;
        }
    }
    sum / k
}

/// Points on a coarse grid, so that ties abound, or continuous ones.
fn sample(seed: u64, n: usize, d: usize, levels: Option<i32>) -> (Columns, Vec<f64>, Vec<f64>) {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
    let draw = |rng: &mut dyn Rng| match levels {
        Some(levels) => f64::from(rng.random_range(0..levels)) * 0.25,
        None => rng.random_range(-2.0..2.0),
    };
    let x: Columns = (0..d).map(|_| (0..n).map(|_| draw(&mut rng)).collect()).collect();
    let y = (0..n).map(|i| x[0][i].sin() + rng.random_range(-0.5..0.5)).collect();
    let w = (0..n).map(|_| f64::from(rng.random_range(1..4))).collect();
    (x, y, w)
}

fn deviation(column: &[f64], w: &[f64]) -> f64 {
    let total: f64 = w.iter().sum();
    let mean = column.iter().zip(w).map(|(x, w)| w * x).sum::<f64>() / total;
    let square: f64 = column.iter().zip(w).map(|(x, w)| w * (x - mean).powi(2)).sum();
    (square / total).sqrt()
}

/// The scales of the columns.
fn scales(fit: &NeighboursFit) -> Vec<f64> {
    match &fit.data {
        Index::Line(_) => vec![1.0],
        Index::Tree(tree) => tree.scales.clone(),
    }
}

#[test]
fn columns_are_divided_by_their_deviations() {
    let (x, y, w) = sample(3, 200, 2, None);
    let wide: Vec<f64> = x[1].iter().map(|v| 1e3 * v + 7.0).collect();
    let fit = NearestNeighbours::default().fit(&[&x[0], &wide], &y, Some(&w)).unwrap();
    let got = scales(&fit);
    assert!((got[0] / deviation(&x[0], &w) - 1.0).abs() < 1e-12);
    assert!((got[1] / (1e3 * deviation(&x[1], &w)) - 1.0).abs() < 1e-12);
}

#[test]
fn estimates_are_those_of_sorting_all_distances() {
    for (d, levels) in [
        (1, None),
        (1, Some(9)),
        (2, None),
        (2, Some(5)),
        (3, Some(3)),
        (6, None),
    ] {
        let (x, y, w) = sample(d as u64, 300, d, levels);
        for k in [1, 2, 7, 40, 250] {
            let method = NearestNeighbours {
                neighbours: Choice::Fixed(k),
                outside: Outside::Nan,
            };
            let fit = method.fit(&slices(&x), &y, Some(&w)).unwrap();
            let got = fit.predict(&slices(&x)).unwrap();
            for i in (0..y.len()).step_by(3) {
                let q: Vec<f64> = x.iter().map(|c| c[i]).collect();
                let want = direct(&x, &scales(&fit), &y, &w, &q, k as f64, None);
                assert!(
                    (got[i] - want).abs() < 1e-12,
                    "d={d} {levels:?} k={k} i={i}: {} {want}",
                    got[i]
                );
            }
        }
    }
}

#[test]
fn leave_one_out_is_leaving_each_point_out() {
    for (d, levels) in [(1, None), (1, Some(9)), (2, None)] {
        let (x, y, w) = sample(10 + d as u64, 120, d, levels);
        let fit = NearestNeighbours::default().fit(&slices(&x), &y, Some(&w)).unwrap();
        let search = fit.search().unwrap();
        assert!(search.curve.windows(2).all(|c| c[0].parameter < c[1].parameter));
        let (total, scales): (f64, _) = (w.iter().sum(), scales(&fit));
        for candidate in &search.curve {
            let k = candidate.parameter as f64;
            let (mut left_out, mut trace) = (0.0, 0.0);
            for i in 0..y.len() {
                let q: Vec<f64> = x.iter().map(|c| c[i]).collect();
                let without = direct(&x, &scales, &y, &w, &q, k, Some(i));
                left_out += w[i] * (y[i] - without).powi(2) / total;
                // The hat matrix's diagonal: the change of the estimate with the ordinate.
                let mut moved = y.clone();
                moved[i] += 1.0;
                trace += direct(&x, &scales, &moved, &w, &q, k, None) - direct(&x, &scales, &y, &w, &q, k, None);
            }
            assert!(
                (candidate.leave_one_out - left_out).abs() < 1e-10,
                "d={d} {levels:?} k={k}"
            );
            assert!(
                (candidate.degrees_of_freedom - trace).abs() < 1e-9,
                "d={d} {levels:?} k={k}"
            );
        }
        let best = search
            .curve
            .iter()
            .map(|c| c.leave_one_out)
            .fold(f64::INFINITY, f64::min);
        let chosen = search.curve.iter().find(|c| c.parameter == fit.neighbours()).unwrap();
        assert_eq!(chosen.leave_one_out, best);
    }
}

#[test]
fn a_large_offset_and_many_points_cost_no_digits() {
    let n = 20_000;
    let x: Vec<f64> = (0..n).map(|i| 1e6 + ((i * 7919) % n) as f64 * 1e-3).collect();
    let y: Vec<f64> = x.iter().map(|x| 1e6 + (x - 1e6).sin()).collect();
    let method = NearestNeighbours {
        neighbours: Choice::Fixed(5),
        ..Default::default()
    };
    let fit = method.fit(&[&x], &y, None).unwrap();
    for q in [1_000_001.234, 1_000_010.0, 1_000_019.5] {
        let want = direct(std::slice::from_ref(&x), &[1.0], &y, &vec![1.0; n], &[q], 5.0, None);
        let got = fit.predict(&[&[q]]).unwrap()[0];
        assert!((got - want).abs() < 1e-9, "{got} {want}");
    }
}

#[test]
fn the_policy_outside_holds_in_every_coordinate() {
    let (x, y, _) = sample(5, 50, 2, None);
    for (outside, known) in [(Outside::Nan, false), (Outside::Nearest, true), (Outside::Linear, true)] {
        let method = NearestNeighbours {
            neighbours: Choice::Fixed(3),
            outside,
        };
        let fit = method.fit(&slices(&x), &y, None).unwrap();
        let got = fit
            .predict(&[&[0.0, 9.0, 0.0, f64::NAN], &[0.0, 0.0, -9.0, 0.0]])
            .unwrap();
        assert!(got[0].is_finite() && got[3].is_nan());
        assert_eq!((got[1].is_finite(), got[2].is_finite()), (known, known));
    }
}

#[test]
fn the_number_of_neighbours_is_checked() {
    let fit = |k| {
        let method = NearestNeighbours {
            neighbours: Choice::Fixed(k),
            ..Default::default()
        };
        method.fit(&[&[1.0, 2.0, 3.0]], &[1.0, 2.0, 3.0], None).map(|_| ())
    };
    assert!(fit(3).is_ok());
    let (few, many) = (fit(0).unwrap_err().to_string(), fit(4).unwrap_err().to_string());
    assert!(
        few.contains("the number of neighbours is 0") && few.contains("at least 1"),
        "{few}"
    );
    assert!(
        many.contains("the number of neighbours is 4") && many.contains("at most 3"),
        "{many}"
    );
    let alone = NearestNeighbours::default().fit(&[&[1.0]], &[1.0], None).unwrap_err();
    assert!(alone.to_string().contains("at least 2"), "{alone}");
    let wide = vec![&[1.0, 2.0][..]; 7];
    let wide = NearestNeighbours::default().fit(&wide, &[1.0, 2.0], None).unwrap_err();
    assert!(wide.to_string().contains("1 to 6 columns, but 7"), "{wide}");
}

proptest! {
    #[test]
    fn ties_and_weights_on_a_grid(
        points in prop::collection::vec((0..6_i32, -5..5_i32, 1..4_i32), 1..40),
        k in 1..20_usize,
        q in -2..8_i32,
    ) {
        let x: Vec<f64> = points.iter().map(|p| f64::from(p.0)).collect();
        let y: Vec<f64> = points.iter().map(|p| f64::from(p.1)).collect();
        let w: Vec<f64> = points.iter().map(|p| f64::from(p.2)).collect();
        prop_assume!(k as f64 <= w.iter().sum());
        let method = NearestNeighbours { neighbours: Choice::Fixed(k), outside: Outside::Nearest };
        let fit = method.fit(&[&x], &y, Some(&w)).unwrap();
        let q = 0.5 * f64::from(q);
        let nearest = q.clamp(x.iter().copied().fold(9.0, f64::min), x.iter().copied().fold(-9.0, f64::max));
        let want = direct(std::slice::from_ref(&x), &[1.0], &y, &w, &[nearest], k as f64, None);
        prop_assert!((fit.predict(&[&[q]]).unwrap()[0] - want).abs() < 1e-12);
    }
}
