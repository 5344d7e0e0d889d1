//! Values by NumPy and SciPy: scripts/reference/estimators.py.

use super::*;

fn data() -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    sample(60)
}

/// Estimates, and the two scores of the candidate with this many terms.
fn check_series(basis: Basis, terms: usize, weights: Option<&[f64]>, want: [f64; 5], scores: [f64; 2]) {
    let (x, y, _) = data();
    let fit = |choice| series(basis, choice, Outside::Nan).fit(&[&x], &y, weights).unwrap();
    close(
        basis.name(),
        &fit(Choice::Fixed(terms)).predict(&[&AT]).unwrap(),
        &want,
        1e-11,
    );
    let chosen = fit(Choice::default());
    let curve = &chosen.search().unwrap().curve;
    let candidate = curve.iter().find(|c| c.parameter == terms).unwrap();
    close(
        basis.name(),
        &[candidate.leave_one_out, candidate.generalized],
        &scores,
        1e-12,
    );
}

#[test]
fn series_are_those_of_numpy() {
    let (_, _, w) = data();
    check_series(
        Basis::Legendre,
        6,
        Some(&w),
        [
            1.3130059997216532,
            0.5738833912587521,
            0.44244932555401,
            0.6923977127439462,
            1.380783016332097,
        ],
        [0.0992163449860953, 0.09410469257865196],
    );
    check_series(
        Basis::Fourier,
        7,
        Some(&w),
        [
            1.406928626357241,
            0.5942198767999106,
            0.34587343764967815,
            0.7171438678111156,
            1.3150194271364324,
        ],
        [0.10283723957818398, 0.09778999495915962],
    );
    check_series(
        Basis::Hermite,
        7,
        None,
        [
            1.198316028646827,
            0.6847247394666993,
            0.4023379983762281,
            0.6939200239470589,
            1.3595681257804344,
        ],
        [0.0970076093832372, 0.0935967530854405],
    );
}

#[test]
fn the_polynomial_is_that_of_numpy() {
    let (x, y, w) = data();
    let method = PolynomialRegression {
        degree: Choice::Fixed(7),
        outside: Outside::Nan,
    };
    let fit = method.fit(&[&x], &y, Some(&w)).unwrap();
    let want = [
        1.3364559964134721,
        0.5860229152948593,
        0.4105891853822373,
        0.7415743143536377,
        1.3350220329233997,
    ];
    close("polynomial", &fit.predict(&[&AT]).unwrap(), &want, 1e-11);
}

#[test]
fn splines_are_those_of_scipy() {
    let (x, y, w) = data();
    let fit = |knots| {
        let method = SplineRegression {
            penalty: Choice::Fixed(0.02),
            knots,
            outside: Outside::Nan,
        };
        method.fit(&[&x], &y, Some(&w)).unwrap()
    };
    let smoothing = [
        1.3043851293094166,
        0.5906744487488765,
        0.4019211828504537,
        0.7257585743226991,
        1.3557665231918552,
    ];
    close("smoothing", &fit(200).predict(&[&AT]).unwrap(), &smoothing, 1e-10);
    let fewer = [
        1.3045027780795848,
        0.5923274339639516,
        0.4048305694010785,
        0.7290073486639321,
        1.3547203757112602,
    ];
    close("fewer knots", &fit(9).predict(&[&AT]).unwrap(), &fewer, 1e-10);
    close("freedom", &[fit(9).degrees_of_freedom()], &[5.915226797856103], 1e-10);
}

#[test]
fn neighbours_are_those_of_scipy() {
    let (x, y, _) = data();
    let z: Vec<f64> = (0..60).map(|i| ((53 * i * i + 7 * i) % 97) as f64 / 97.0).collect();
    let method = NearestNeighbours {
        neighbours: Choice::Fixed(7),
        outside: Outside::Nan,
    };
    let fit = method.fit(&[&x, &z], &y, None).unwrap();
    let want = [
        0.6994727540500737,
        0.6096123711340206,
        0.5487752577319587,
        1.0930627393225332,
        0.8805808541973489,
    ];
    let got = fit.predict(&[&AT, &[0.2, 0.4, 0.5, 0.7, 0.31]]).unwrap();
    close("neighbours", &got, &want, 1e-13);
}
