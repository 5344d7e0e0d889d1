//! The requirements on every estimator.

use proptest::prelude::*;

use super::super::*;
use crate::selection::Criterion;

type Fitted = crate::Result<Box<dyn Regression>>;
type ByData = Box<dyn Fn(&[f64], &[f64]) -> Fitted + Sync>;
type Fit = fn(&[&[f64]], &[f64], Option<&[f64]>, Outside) -> Fitted;

/// All estimators with a fixed parameter.
const FIXED: [(&str, Fit); 9] = [
    ("fourier", |x, y, w, o| {
        series(Basis::Fourier, Choice::Fixed(5), o).fit_boxed(x, y, w)
    }),
    ("cosine", |x, y, w, o| {
        series(Basis::Cosine, Choice::Fixed(5), o).fit_boxed(x, y, w)
    }),
    ("legendre", |x, y, w, o| {
        series(Basis::Legendre, Choice::Fixed(5), o).fit_boxed(x, y, w)
    }),
    ("hermite", |x, y, w, o| {
        series(Basis::Hermite, Choice::Fixed(5), o).fit_boxed(x, y, w)
    }),
    ("haar", |x, y, w, outside| {
        let levels = Choice::Fixed(3);
        HaarRegression { levels, outside }.fit_boxed(x, y, w)
    }),
    ("polynomial", |x, y, w, outside| {
        let degree = Choice::Fixed(6);
        PolynomialRegression { degree, outside }.fit_boxed(x, y, w)
    }),
    ("spline", |x, y, w, outside| {
        // The penalty has the unit of x cubed.
        let there = |i: &usize| w.is_none_or(|w| w.get(*i) > Some(&0.0));
        let range = (0..x.first().map_or(0, |x| x.len())).filter(there).map(|i| x[0][i]);
        let (low, high) = range.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        let length = if high > low { high - low } else { 1.0 };
        let penalty = Choice::Fixed(1e-3 * length.powi(3));
        let knots = 12;
        SplineRegression {
            penalty,
            knots,
            outside,
        }
        .fit_boxed(x, y, w)
    }),
    ("neighbours", |x, y, w, outside| {
        let neighbours = Choice::Fixed(4);
        NearestNeighbours { neighbours, outside }.fit_boxed(x, y, w)
    }),
    ("network", |x, y, w, outside| {
        network(Choice::Fixed(3), Decay::Fixed(0.01), outside).fit_boxed(x, y, w)
    }),
];

/// An iteration's end is known to fewer digits than a closed form.
fn digits(name: &str, tolerance: f64) -> f64 {
    if name == "network" { 1e-6 } else { tolerance }
}

/// All estimators with their parameter from the data.
fn chosen(criterion: Criterion) -> Vec<(&'static str, ByData)> {
    let by = Choice::FromData(criterion);
    let mut all: Vec<(&'static str, ByData)> = Vec::new();
    for basis in Basis::ALL {
        let method = series(basis, by, Outside::Nearest);
        all.push((basis.name(), Box::new(move |x, y| method.fit_boxed(&[x], y, None))));
    }
    let outside = Outside::Nearest;
    let haar = HaarRegression { levels: by, outside };
    all.push(("haar", Box::new(move |x, y| haar.fit_boxed(&[x], y, None))));
    let polynomial = PolynomialRegression { degree: by, outside };
    all.push(("polynomial", Box::new(move |x, y| polynomial.fit_boxed(&[x], y, None))));
    let spline = SplineRegression {
        penalty: Choice::FromData(criterion),
        knots: 30,
        outside,
    };
    all.push(("spline", Box::new(move |x, y| spline.fit_boxed(&[x], y, None))));
    let neighbours = NearestNeighbours {
        neighbours: by,
        outside,
    };
    all.push(("neighbours", Box::new(move |x, y| neighbours.fit_boxed(&[x], y, None))));
    let network = network(by, Decay::Evidence, outside);
    all.push(("network", Box::new(move |x, y| network.fit_boxed(&[x], y, None))));
    all
}

fn network(units: Choice<usize>, decay: Decay, outside: Outside) -> NetworkRegression {
    NetworkRegression {
        units,
        decay,
        outside,
        ..Default::default()
    }
}

fn series(basis: Basis, terms: Choice<usize>, outside: Outside) -> SeriesRegression {
    SeriesRegression { basis, terms, outside }
}

/// Scattered abscissas on [-1, 1], noisy ordinates, weights 1 to 3; also in scripts/reference/estimators.py.
fn sample(n: usize) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let x: Vec<f64> = (0..n).map(|i| ((37 * i) % 101) as f64 / 50.0 - 1.0).collect();
    let noise = |i: usize| ((53 * i * i + 7 * i) % 97) as f64 / 97.0;
    let y = x.iter().enumerate().map(|(i, x)| x * x + noise(i)).collect();
    (x, y, (0..n).map(|i| (1 + i % 3) as f64).collect())
}

/// No two data points are equally far from any of these.
const AT: [f64; 5] = [-0.933, -0.411, 0.0743, 0.5527, 0.9017];

fn close(name: &str, got: &[f64], want: &[f64], tolerance: f64) {
    assert_eq!(got.len(), want.len());
    for (g, w) in got.iter().zip(want) {
        assert!(
            (g - w).abs() <= tolerance * w.abs().max(1.0),
            "{name}: {got:?} {want:?}"
        );
    }
}

#[test]
fn units_and_offsets_of_x_and_gain_of_y_do_not_matter() {
    let (x, y, w) = sample(60);
    for (name, fit) in FIXED {
        let want = fit(&[&x], &y, Some(&w), Outside::Nan).unwrap().predict(&[&AT]).unwrap();
        assert!(want.iter().all(|v| v.is_finite()), "{name} {want:?}");
        for (gain, offset) in [(1.0, 1e6), (1e-6, 0.0), (1e9, -4e9), (-1.0, 3.0)] {
            if gain < 0.0 && ["haar", "network"].contains(&name) {
                continue; // cells are half open, and starts are not mirrored
            }
            let map = |v: &[f64]| v.iter().map(|v| gain * v + offset).collect::<Vec<_>>();
            let scaled: Vec<f64> = y.iter().map(|y| -3.0 * y).collect();
            let fitted = fit(&[&map(&x)], &scaled, Some(&w), Outside::Nan).unwrap();
            let got: Vec<f64> = fitted.predict(&[&map(&AT)]).unwrap().iter().map(|v| v / -3.0).collect();
            // The sample at 1e6 itself is only known to 1e-10.
            close(name, &got, &want, digits(name, 1e-8));
        }
    }
}

#[test]
fn an_offset_of_y_comes_out_again() {
    let (x, y, w) = sample(60);
    for (name, fit) in FIXED {
        let fitted = |y: &[f64]| fit(&[&x], y, Some(&w), Outside::Nan).unwrap().predict(&[&AT]).unwrap();
        let want = fitted(&y);
        let raised: Vec<f64> = y.iter().map(|y| y + 1e6).collect();
        // No finite sum of Hermite functions is a constant: what comes out is the fit to the offset.
        let offset = if name == "hermite" {
            fitted(&[1.0; 60])
        } else {
            vec![1.0; 5]
        };
        let got: Vec<f64> = fitted(&raised)
            .iter()
            .zip(offset)
            .map(|(v, one)| v - 1e6 * one)
            .collect();
        close(name, &got, &want, digits(name, 1e-8));
    }
}

#[test]
fn order_repetitions_and_zero_weights() {
    let (x, y, w) = sample(60);
    for (name, fit) in FIXED {
        let fitted = fit(&[&x], &y, Some(&w), Outside::Nan).unwrap();
        let want = fitted.predict(&[&AT]).unwrap();
        let reversed = |v: &[f64]| v.iter().rev().copied().collect::<Vec<_>>();
        let again = fit(&[&reversed(&x)], &reversed(&y), Some(&reversed(&w)), Outside::Nan).unwrap();
        assert_eq!(again.predict(&[&AT]).unwrap(), want, "{name}");
        let repeat = |v: &[f64]| {
            let pairs = v.iter().zip(&w);
            pairs
                .flat_map(|(v, w)| std::iter::repeat_n(*v, *w as usize))
                .collect::<Vec<_>>()
        };
        let repeated = fit(&[&repeat(&x)], &repeat(&y), None, Outside::Nan).unwrap();
        close(name, &repeated.predict(&[&AT]).unwrap(), &want, digits(name, 1e-11));
        let and = |v: &[f64], more: [f64; 2]| v.iter().copied().chain(more).collect::<Vec<_>>();
        let (more_x, more_y) = (and(&x, [7.0, 0.1]), and(&y, [1e3, -1e3]));
        let nothing = fit(&[&more_x], &more_y, Some(&and(&w, [0.0; 2])), Outside::Nan).unwrap();
        assert_eq!(nothing.predict(&[&AT]).unwrap(), want, "{name}");
    }
}

#[test]
fn bad_input_is_named() {
    let (x, y, w) = sample(60);
    for (name, fit) in FIXED {
        let says = |x: &[&[f64]], y: &[f64], w: Option<&[f64]>, message: &str| {
            let error = fit(x, y, w, Outside::Nan).unwrap_err().to_string();
            assert!(error.contains(message), "{name}: {error}");
        };
        says(&[], &y, None, "0 were given");
        says(&[&x[1..]], &y, None, "'y' has 60 samples where 59 were expected");
        says(
            &[&x],
            &y,
            Some(&w[2..]),
            "'weights' has 58 samples where 60 were expected",
        );
        let with = |v: &[f64], bad: f64| {
            let mut v = v.to_vec();
            v[7] = bad;
            v
        };
        says(&[&with(&x, f64::NAN)], &y, None, "column 'x' is NaN at sample 7");
        says(&[&x], &with(&y, f64::INFINITY), None, "column 'y' is inf at sample 7");
        says(&[&x], &y, Some(&with(&w, -1.0)), "weights[7] is -1");
        says(
            &[&x],
            &y,
            Some(&vec![0.0; 60]),
            "needs at least 1 samples, but there are 0",
        );
        if !["neighbours", "network"].contains(&name) {
            says(&[&x, &x], &y, None, "takes 1 column, but 2 were given");
        }
        let fitted = fit(&[&x], &y, None, Outside::Nan).unwrap();
        let error = fitted.predict(&[&x, &x]).unwrap_err().to_string();
        assert!(error.contains("takes 1 column, but 2"), "{name}: {error}");
    }
}

#[test]
fn too_few_distinct_abscissas_are_named() {
    let x = [0.0, 1.0, 2.0, 0.0, 1.0, 2.0];
    for (name, fit) in FIXED
        .iter()
        .filter(|e| !["haar", "spline", "neighbours", "network"].contains(&e.0))
    {
        let error = fit(&[&x], &x, None, Outside::Nan).unwrap_err().to_string();
        assert!(
            error.contains("distinct values of x") && error.contains("at most"),
            "{name}: {error}"
        );
    }
    let error = SplineRegression::default()
        .fit(&[&[1.0; 4]], &[1.0; 4], None)
        .unwrap_err();
    assert!(error.to_string().contains("'x' is constant"), "{error}");
    // Two clusters do not determine a polynomial of degree 3, for any number of points.
    let unpenalised = SplineRegression {
        penalty: Choice::Fixed(0.0),
        ..Default::default()
    };
    let error = unpenalised.fit(&[&x], &x, None).unwrap_err();
    assert!(error.to_string().contains("penalty"), "{error}");
}

#[test]
fn the_choice_comes_near_the_truth_by_either_criterion() {
    let n = 2000;
    let x: Vec<f64> = (0..n).map(|i| ((i * 7919) % n) as f64 / n as f64 * 2.0 - 1.0).collect();
    let m = |x: f64| (-4.0 * x * x).exp() * (1.0 + x);
    let mut rng: rand_pcg::Pcg64 = rand::SeedableRng::seed_from_u64(1);
    let noise: Vec<f64> = (0..n)
        .map(|_| rand::RngExt::random_range(&mut rng, -0.2..0.2))
        .collect();
    let y: Vec<f64> = x.iter().zip(&noise).map(|(x, e)| m(*x) + e).collect();
    for criterion in [Criterion::LeaveOneOut, Criterion::Generalized] {
        for (name, fit) in chosen(criterion) {
            let got = fit(&x, &y).unwrap().predict(&[&x]).unwrap();
            let square: f64 = got.iter().zip(&x).map(|(g, x)| (g - m(*x)).powi(2)).sum();
            let rms = (square / n as f64).sqrt();
            // The noise is 0.115 RMS; step functions pay for the slope.
            let bar = if name == "haar" {
                0.04
            } else if name == "neighbours" {
                0.03
            } else {
                0.02
            };
            assert!(rms < bar, "{name} {criterion:?}: {rms}");
        }
    }
}

#[test]
fn the_choice_does_not_depend_on_threads() {
    let (x, y, _) = sample(90);
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    for (name, fit) in chosen(Criterion::LeaveOneOut) {
        let with = |threads| pool(threads).install(|| fit(&x, &y).unwrap().predict(&[&AT]).unwrap());
        assert_eq!(with(1), with(2), "{name}");
        assert_eq!(with(1), with(5), "{name}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn no_data_make_anything_panic(
        points in prop::collection::vec((prop_oneof![
            (-3..3_i32).prop_map(f64::from),
            any::<f64>(),
            (-1e3..1e3),
        ], prop_oneof![any::<f64>(), (-1.0..1.0)], prop_oneof![Just(0.0), 0.0..2.0]), 0..25),
        q in any::<f64>(),
    ) {
        let x: Vec<f64> = points.iter().map(|p| p.0).collect();
        let y: Vec<f64> = points.iter().map(|p| p.1).collect();
        let w: Vec<f64> = points.iter().map(|p| p.2).collect();
        for (_, fit) in FIXED {
            if x.is_empty() { continue; }
            if let Ok(fit) = fit(&[&x], &y, Some(&w), Outside::Linear) {
                prop_assert_eq!(fit.predict(&[&[q, 0.0, f64::NAN]]).unwrap().len(), 3);
            }
        }
        for (_, fit) in chosen(Criterion::Generalized) {
            if let Ok(fit) = fit(&x, &y) {
                prop_assert_eq!(fit.predict(&[&[q, 0.0]]).unwrap().len(), 2);
            }
        }
        for (_, fit) in outside::with_windows() {
            for outside in [Outside::Nan, Outside::Linear] {
                if let Ok(fit) = fit(&x, &y, Some(&w), outside) {
                    prop_assert_eq!(fit.predict(&[&[q, 0.0, f64::NAN]]).unwrap().len(), 3);
                }
            }
        }
        if let Ok(fit) = NearestNeighbours::default().fit(&[&x, &y], &x, Some(&w)) {
            prop_assert_eq!(fit.predict(&[&[q], &[0.0]]).unwrap().len(), 1);
        }
    }
}

mod oracle;
mod outside;
mod refits;
mod rough;
mod scale;

#[test]
fn kernels_come_through_the_common_interface() {
    use crate::nonlinearity::{Kernel, KernelRegression};
    let method = KernelRegression {
        kernel: Kernel::Biweight,
        bandwidth: 0.4,
    };
    let x = [0.0, 0.1, 0.3, 0.9, 1.0];
    let y = [1.0, 2.0, 0.0, 5.0, 4.0];
    let fit = Estimator::fit(method, &[&x], &y, Some(&[1.0, 0.0, 2.0, 1.0, 1.0])).unwrap();
    let kept = method
        .fit(&[0.0, 0.3, 0.3, 0.9, 1.0], &[1.0, 0.0, 0.0, 5.0, 4.0])
        .unwrap();
    for q in [0.05, 0.2, 0.75, 3.0] {
        let (got, want) = (Regression::predict(&fit, &[&[q]]).unwrap()[0], kept.value(q));
        assert!(
            got == want || (got - want).abs() < 1e-14 || (got.is_nan() && want.is_nan()),
            "{q}: {got} {want}"
        );
    }
    let two = Estimator::fit(method, &[&x, &x], &y, None).unwrap_err().to_string();
    assert_eq!(two, "a kernel regression takes 1 column, but 2 were given");
}

/// The example of CONTRIBUTING.md, as written there.
#[test]
fn the_worked_example_is_an_estimator() {
    use super::super::regressogram::Regressogram;
    let contributing = include_str!("../../../../../CONTRIBUTING.md");
    let example = include_str!("regressogram.rs");
    assert!(
        contributing.contains(&format!("```rust\n{example}```")),
        "CONTRIBUTING.md's example differs from estimator_tests/regressogram.rs"
    );
    let x = [-0.1, 0.1, 0.2, 0.9, 2.5];
    let y = [5.0, 1.0, 2.0, 6.0, 4.0];
    let fit = Regressogram { width: 0.5 }
        .fit(&[&x], &y, Some(&[1.0, 1.0, 3.0, 1.0, 0.0]))
        .unwrap();
    let got = fit.predict(&[&[0.4, -0.3, 0.5, 2.6, f64::NAN]]).unwrap();
    assert_eq!(got[..3], [1.75, 5.0, 6.0]);
    assert!(got[3].is_nan() && got[4].is_nan());
    let refused = Regressogram { width: -1.0 }
        .fit(&[&x], &y, None)
        .unwrap_err()
        .to_string();
    assert_eq!(refused, "the cells' width is -1, but must be positive and finite");
}
