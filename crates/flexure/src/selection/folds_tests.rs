use super::*;
use crate::nonlinearity::{Basis, Kernel, Outside};
use crate::selection::test_data::{noisy, slow};

fn series(terms: Choice<usize>) -> SeriesRegression {
    SeriesRegression {
        basis: Basis::Cosine,
        terms,
        outside: Outside::Nearest,
    }
}

#[test]
fn the_score_is_that_of_refits_by_hand() {
    let (x, y) = noisy(1, 47, |x| x.sin());
    let w: Vec<f64> = (0..47).map(|i| [1.0, 0.0, 2.0][i % 3]).collect();
    let folds = BlockFolds { folds: 4, gap: 3 };
    let search = folds
        .choose(&[2, 6], |k| series(Choice::Fixed(k)), &[&x], &y, Some(&w))
        .unwrap();
    for score in &search.curve {
        let mut sum = 0.0;
        for (start, end) in [(0, 11), (11, 23), (23, 35), (35, 47)] {
            let kept = |t: &usize| *t + 3 < start || *t >= end + 3;
            let of = |v: &[f64]| (0..47).filter(kept).map(|t| v[t]).collect::<Vec<_>>();
            let fit = series(Choice::Fixed(score.parameter))
                .fit(&[&of(&x)], &of(&y), Some(&of(&w)))
                .unwrap();
            let predicted = fit.predict(&[&x[start..end]]).unwrap();
            sum += (start..end)
                .map(|t| w[t] * (y[t] - predicted[t - start]).powi(2))
                .sum::<f64>();
        }
        let want = sum / w.iter().sum::<f64>();
        assert!((score.error - want).abs() < 1e-12 * want, "{score:?} {want}");
        assert!(score.standard_error > 0.0 && score.standard_error < score.error);
    }
}

#[test]
fn every_estimator_searches_its_own_candidates() {
    let (x, y) = noisy(2, 300, |x| (2.0 * x).sin());
    let folds = BlockFolds { folds: 5, gap: 2 };
    // The noise's variance is 0.01; a straight line leaves 0.4.
    let good = |error: f64| assert!((0.007..0.022).contains(&error), "{error}");
    let lowest = |errors: &mut dyn Iterator<Item = f64>| errors.fold(f64::INFINITY, f64::min);
    macro_rules! check {
        ($method:expr) => {
            let search = folds.search(&$method, &[&x], &y, None).unwrap();
            good(lowest(&mut search.curve.iter().map(|c| c.error)));
            assert!(search.curve.len() > 5);
        };
    }
    check!(series(Choice::default()));
    check!(NearestNeighbours::default());
    check!(PolynomialRegression::default());
    check!(SplineRegression::default());
    check!(KernelRegression {
        kernel: Kernel::Epanechnikov,
        bandwidth: 0.2
    });
    let haar = folds.search(&HaarRegression::default(), &[&x], &y, None).unwrap();
    assert!(haar.curve.len() > 2 && haar.curve[haar.parameter].error < 0.03);
}

#[test]
fn blocks_with_a_gap_do_not_follow_dependent_errors() {
    let m = |x: f64| 0.5 * x;
    let mut chosen = [0, 0];
    for seed in 0..8 {
        let (x, y) = slow(seed, 400, 0.95, m);
        let leave_one_out = series(Choice::default()).fit(&[&x], &y, None).unwrap();
        let blocks = BlockFolds::for_data(&x, &y).unwrap();
        assert!(blocks.gap > 5);
        chosen[0] += leave_one_out.search().unwrap().parameter;
        chosen[1] += blocks
            .search(&series(Choice::default()), &[&x], &y, None)
            .unwrap()
            .parameter;
    }
    eprintln!(
        "mean number of terms: leave-one-out {}, blocks {}",
        chosen[0] / 8,
        chosen[1] / 8
    );
    assert!(chosen[0] > 3 * chosen[1], "{chosen:?}");
}

#[test]
fn threads_do_not_matter() {
    let (x, y) = noisy(5, 200, |x| x.abs());
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            BlockFolds::default()
                .search(&SplineRegression::default(), &[&x], &y, None)
                .unwrap()
        })
    };
    assert_eq!(run(1), run(2));
    assert_eq!(run(1), run(5));
}

#[test]
fn what_cannot_be_done_is_said() {
    let (x, y) = noisy(7, 20, |x| x);
    let said = |folds, gap, candidates: &[usize], y: &[f64]| {
        let blocks = BlockFolds { folds, gap };
        let method = |k| NearestNeighbours {
            neighbours: Choice::Fixed(k),
            ..Default::default()
        };
        blocks
            .choose(candidates, method, &[&x], y, None)
            .map(|s| s.parameter)
            .map_err(|e| e.to_string())
    };
    assert!(said(1, 0, &[3], &y).unwrap_err().contains("the number of folds is 1"));
    assert!(said(21, 0, &[3], &y).unwrap_err().contains("the number of folds is 21"));
    assert!(said(2, 10, &[3], &y).unwrap_err().contains("the gap is 10"));
    assert!(
        said(2, 0, &[], &y)
            .unwrap_err()
            .contains("the number of candidates is 0")
    );
    assert!(said(2, 0, &[3], &y[1..]).unwrap_err().contains("samples where"));
    let mut broken = y.clone();
    broken[7] = f64::NAN;
    assert!(said(2, 0, &[3], &broken).unwrap_err().contains("NaN at sample 7"));
    // 15 neighbours are more than half of the samples.
    assert!(said(2, 0, &[15], &y).unwrap_err().contains("15"));
    assert_eq!(said(2, 0, &[15, 2], &y), Ok(2));
}
