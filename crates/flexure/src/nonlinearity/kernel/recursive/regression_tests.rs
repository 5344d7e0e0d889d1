use proptest::prelude::*;
use rand::{RngExt, SeedableRng};

use super::*;

/// Heavy tails, a cluster, ties, and an offset of y.
fn rough(n: usize) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(4);
    let mut x: Vec<f64> = (0..n)
        .map(|i| match i % 5 {
            0 => 3.0 + 1e-7 * rng.random_range(-1.0..1.0),
            1 => f64::from(rng.random_range(-3..3_i32)) / 4.0,
            2 => (std::f64::consts::PI * rng.random_range(-0.5..0.5_f64)).tan(),
            _ => rng.random_range(-1.0..1.0),
        })
        .collect();
    x[n / 2] = 1e9;
    let y = x.iter().map(|x| 1e6 + x.sin() + rng.random_range(-0.3..0.3)).collect();
    let w = (0..n).map(|i| [1.0, 0.25, 0.0, 3.5][i % 4]).collect();
    (x, y, w)
}

fn method(kernel: Kernel, form: RecursiveForm, bandwidth: Choice<f64>) -> RecursiveRegression {
    RecursiveRegression {
        kernel,
        form,
        bandwidth,
        exponent: 0.3,
        outside: Outside::Nan,
    }
}

/// The estimate at `q` as it is written, of observations that come one after the other; without the observation `skip`.
fn direct(m: &RecursiveRegression, c: f64, [x, y]: [&[f64]; 2], q: f64, skip: Option<usize>) -> f64 {
    let (mut s, mut t) = (0.0, 0.0);
    for i in (0..x.len()).filter(|&i| Some(i) != skip) {
        let h = c * 2.0_f64.powf(-m.exponent * ((i + 1) as f64).log2().floor());
        let r = if m.form == RecursiveForm::WolvertonWagner { 1 } else { 0 };
        let k = h.powi(-r) * m.kernel.weight((q - x[i]) / h);
        s += k;
        t += k * (y[i] - 1e6);
    }
    1e6 + t / s
}

const FORMS: [RecursiveForm; 2] = [RecursiveForm::WolvertonWagner, RecursiveForm::DevroyeWagner];

#[test]
fn the_estimate_is_the_sum_as_it_is_written_anywhere() {
    let (x, y, _) = rough(700);
    let mut at = vec![-0.99, 0.1003, 0.75, 3.0 + 3e-8, 1e9, 1e9 - 0.2, 40.0, 5e5, -1e4];
    at.extend(&x[..60]);
    for kernel in Kernel::ALL {
        for form in FORMS {
            for c in [0.05, 0.7, 30.0] {
                let m = method(kernel, form, Choice::Fixed(c));
                let got = m.fit(&[&x], &y, None).unwrap().predict(&[&at]).unwrap();
                for (q, got) in at.iter().zip(got) {
                    let want = direct(&m, c, [&x, &y], *q, None);
                    assert!(
                        got.is_nan() && want.is_nan() || (got / want - 1.0).abs() < 1e-12,
                        "{kernel:?} {form:?} {c} at {q}: {got} {want}"
                    );
                }
            }
        }
    }
    let alone = method(Kernel::Epanechnikov, RecursiveForm::default(), Choice::Fixed(0.7));
    let got = alone
        .fit(&[&x], &y, None)
        .unwrap()
        .predict(&[&[5e5, f64::NAN]])
        .unwrap();
    assert!(got.iter().all(|m| m.is_nan()), "nothing is in reach: {got:?}");
}

#[test]
fn a_record_gives_what_the_stream_gives() {
    let (x, y, _) = rough(3000);
    let at = [-0.9, 0.0, 0.31, 0.75, 3.0, 11.0, 1e9];
    for form in FORMS {
        let fit = method(Kernel::Biweight, form, Choice::default())
            .fit(&[&x], &y, None)
            .unwrap();
        let mut sums = fit.method().start(&at).unwrap();
        x.iter().zip(&y).for_each(|(x, y)| sums.push(*x, *y).unwrap());
        for (a, b) in sums.finish().into_iter().zip(fit.predict(&[&at]).unwrap()) {
            assert!(a.is_nan() && b.is_nan() || (a / b - 1.0).abs() < 1e-12, "{a} {b}");
        }
    }
}

#[test]
fn a_weight_is_that_many_observations() {
    let (x, y, _) = rough(120);
    let w: Vec<f64> = (0..120).map(|i| [2.0, 0.0, 1.0, 5.0][i % 4]).collect();
    let repeat = |v: &[f64]| -> Vec<f64> {
        let pairs = v.iter().zip(&w);
        pairs.flat_map(|(v, w)| std::iter::repeat_n(*v, *w as usize)).collect()
    };
    let m = method(Kernel::Epanechnikov, RecursiveForm::WolvertonWagner, Choice::Fixed(1.5));
    let at: Vec<f64> = (0..40).map(|i| -1.0 + 0.1 * f64::from(i)).collect();
    let weighted = m.fit(&[&x], &y, Some(&w)).unwrap().predict(&[&at]).unwrap();
    let repeated = m
        .fit(&[&repeat(&x)], &repeat(&y), None)
        .unwrap()
        .predict(&[&at])
        .unwrap();
    for (a, b) in weighted.iter().zip(repeated) {
        assert!((a / b - 1.0).abs() < 1e-13, "{a} {b}");
    }
}

#[test]
fn scores_are_those_of_every_point_left_out() {
    let (mut x, y, _) = rough(90);
    // One point alone, and one twice.
    (x[30], x[7], x[8]) = (-50.0, 0.4, 0.4);
    for kernel in [Kernel::Uniform, Kernel::Triangular, Kernel::Gaussian] {
        for form in FORMS {
            let m = method(kernel, form, Choice::FromData(Criterion::LeaveOneOut));
            let fit = m.fit(&[&x], &y, None).unwrap();
            for candidate in fit.search().unwrap().curve.iter().step_by(4) {
                let c = candidate.parameter;
                let error = |i: usize| {
                    let mut m = direct(&m, c, [&x, &y], x[i], Some(i));
                    if m.is_nan() {
                        let others = (0..90).filter(|&j| j != i);
                        let near = others
                            .clone()
                            .map(|j| (x[j] - x[i]).abs())
                            .fold(f64::INFINITY, f64::min);
                        let ties: Vec<f64> = others.filter(|&j| (x[j] - x[i]).abs() == near).map(|j| y[j]).collect();
                        m = ties.iter().sum::<f64>() / ties.len() as f64;
                    }
                    (y[i] - m).powi(2)
                };
                let want = (0..90).map(error).sum::<f64>() / 90.0;
                assert!(
                    (candidate.leave_one_out / want - 1.0).abs() < 1e-8,
                    "{kernel:?} {form:?} {c}: {} {want}",
                    candidate.leave_one_out
                );
                // The trace of the hat matrix, by the derivative of every fitted value in its own ordinate.
                let lifted = |i: usize| {
                    let mut more = y.clone();
                    more[i] += 1e3;
                    (direct(&m, c, [&x, &more], x[i], None) - direct(&m, c, [&x, &y], x[i], None)) / 1e3
                };
                let trace: f64 = (0..90).map(lifted).sum();
                assert!(
                    (candidate.degrees_of_freedom / trace - 1.0).abs() < 1e-6,
                    "{kernel:?} {c}"
                );
            }
        }
    }
}

#[test]
fn with_many_points_some_are_scored_and_the_score_is_nearly_that_of_all() {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(9);
    let n = 2 * SCORED + 10;
    let x: Vec<f64> = (0..n).map(|_| rng.random_range(-1.0..1.0)).collect();
    let y: Vec<f64> = x
        .iter()
        .map(|x| (3.0 * x).sin() + rng.random_range(-0.2..0.2))
        .collect();
    let columns = [x.as_slice()];
    let data = Checked::new(WHAT, 1, &columns, &y, None).unwrap();
    let levels = Levels::new(&data);
    let m = method(Kernel::Epanechnikov, RecursiveForm::WolvertonWagner, Choice::Fixed(0.5));
    let of = |stride| {
        let points = levels.own(&data, stride);
        (
            levels
                .candidate(&m.fit(&[&x], &y, None).unwrap().method(), &points)
                .leave_one_out,
            points.len(),
        )
    };
    let ((all, count), (some, fewer)) = (of(1), of(n.div_ceil(SCORED)));
    assert_eq!((count, fewer), (n, n.div_ceil(3)));
    assert!((some / all - 1.0).abs() < 0.02 && some != all, "{some} {all}");
}

#[test]
fn the_choice_comes_near_the_truth_whatever_the_tails() {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(5);
    let cauchy: Vec<f64> = (0..4000)
        .map(|_| (std::f64::consts::PI * rng.random_range(-0.5..0.5_f64)).tan())
        .collect();
    let y: Vec<f64> = cauchy.iter().map(|x| x.sin() + rng.random_range(-0.2..0.2)).collect();
    let at: Vec<f64> = (0..41).map(|i| -2.0 + 0.1 * f64::from(i)).collect();
    for criterion in [Criterion::LeaveOneOut, Criterion::Generalized] {
        let m = RecursiveRegression {
            bandwidth: Choice::FromData(criterion),
            ..Default::default()
        };
        let fit = m.fit(&[&cauchy], &y, None).unwrap();
        let got = fit.predict(&[&at]).unwrap();
        let squares: f64 = at.iter().zip(&got).map(|(x, m)| (m - x.sin()).powi(2)).sum();
        assert!(
            (squares / 41.0).sqrt() < 0.06,
            "{criterion:?} {} {squares}",
            fit.bandwidth()
        );
        let search = fit.search().unwrap();
        assert!(!search.at_edge && search.curve.windows(2).all(|w| w[0].parameter < w[1].parameter));
        let chosen = search.curve.iter().find(|c| c.parameter == fit.bandwidth()).unwrap();
        assert!(
            search
                .curve
                .iter()
                .all(|c| c.score(criterion) >= chosen.score(criterion))
        );
    }
}

#[test]
fn outside_and_in_gaps_the_policy_holds() {
    let x = [0.0, 0.1, 0.2, 0.3, 5.0, 5.1, 5.2, 5.3];
    let y = [0.0, 0.1, 0.2, 0.3, 9.0, 9.1, 9.2, 9.3];
    let fit = |outside| {
        let m = RecursiveRegression {
            bandwidth: Choice::Fixed(0.3),
            outside,
            ..Default::default()
        };
        m.fit(&[&x], &y, None).unwrap()
    };
    let of = |outside, at: &[f64]| fit(outside).predict(&[at]).unwrap();
    let ends = of(Outside::Nan, &[0.0, 0.3, 5.0, 5.3]);
    assert!(of(Outside::Nan, &[-0.5, 2.0, 2.9, 6.0]).iter().all(|m| m.is_nan()));
    assert!(of(Outside::Nan, &[-0.05])[0].is_finite(), "data are in reach there");
    let near = of(Outside::Nearest, &[-0.5, 2.0, 2.65, 3.0, 6.0]);
    assert_eq!(
        [near[0], near[1], near[3], near[4]],
        [ends[0], ends[1], ends[2], ends[3]]
    );
    assert!((near[2] - 0.5 * (ends[1] + ends[2])).abs() < 1e-12);
    let far = of(Outside::Linear, &[0.3 + 0.47, 2.65, 6.3, 7.3]);
    assert!(
        (far[0] - ends[1] - 0.1 * (ends[2] - ends[1])).abs() < 1e-12,
        "straight across"
    );
    assert!((far[1] - 0.5 * (ends[1] + ends[2])).abs() < 1e-12);
    // A weighted line through points on a line is that line.
    assert!((far[3] - far[2] - 1.0).abs() < 1e-12 && (far[2] - ends[3] - 1.0).abs() < 1e-12);
}

#[test]
fn threads_do_not_matter_and_bad_parameters_are_refused() {
    let (x, y, w) = rough(5000);
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let fit = || RecursiveRegression::default().fit(&[&x], &y, Some(&w)).unwrap();
    let one = pool(1).install(fit);
    assert_eq!(one, pool(2).install(fit));
    assert_eq!(one, pool(5).install(fit));
    let said = |m: RecursiveRegression, n: usize| m.fit(&[&x[..n]], &y[..n], None).unwrap_err().to_string();
    let good = RecursiveRegression::default();
    assert!(said(RecursiveRegression { exponent: 0.0, ..good }, 9).contains("exponent is 0"));
    let negative = Choice::Fixed(-1.0);
    assert!(
        said(
            RecursiveRegression {
                bandwidth: negative,
                ..good
            },
            9
        )
        .contains("the bandwidth is -1")
    );
    assert!(said(good, 2).contains("needs at least 3"));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn no_data_make_it_panic(
        points in prop::collection::vec((any::<f64>(), any::<f64>(), prop_oneof![Just(0.0), 0.0..3.0, 0.0..1e300]), 1..20),
        c in prop_oneof![Just(1e-310), 1e-3..1e3, Just(1e300)],
        q in any::<f64>(),
    ) {
        let [x, y, w]: [Vec<f64>; 3] =
            [points.iter().map(|p| p.0).collect(), points.iter().map(|p| p.1).collect(), points.iter().map(|p| p.2).collect()];
        for bandwidth in [Choice::Fixed(c), Choice::default()] {
            for outside in [Outside::Nan, Outside::Nearest, Outside::Linear] {
                let m = RecursiveRegression { bandwidth, outside, ..Default::default() };
                if let Ok(fit) = m.fit(&[&x], &y, Some(&w)) {
                    prop_assert_eq!(fit.predict(&[&[q, 0.0, f64::NAN]]).unwrap().len(), 3);
                }
            }
        }
    }
}
