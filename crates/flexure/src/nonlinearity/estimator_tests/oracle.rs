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
            1.313005999721653e+00,
            5.738833912587521e-01,
            4.424493255540100e-01,
            6.923977127439462e-01,
            1.380783016332097e+00,
        ],
        [9.921634498609530e-02, 9.410469257865196e-02],
    );
    check_series(
        Basis::Fourier,
        7,
        Some(&w),
        [
            1.406928626357241e+00,
            5.942198767999106e-01,
            3.458734376496782e-01,
            7.171438678111156e-01,
            1.315019427136432e+00,
        ],
        [1.028372395781840e-01, 9.778999495915962e-02],
    );
    check_series(
        Basis::Hermite,
        7,
        None,
        [
            1.198316028646827e+00,
            6.847247394666993e-01,
            4.023379983762281e-01,
            6.939200239470589e-01,
            1.359568125780434e+00,
        ],
        [9.700760938323720e-02, 9.359675308544051e-02],
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
        1.336455996413472e+00,
        5.860229152948593e-01,
        4.105891853822373e-01,
        7.415743143536377e-01,
        1.335022032923400e+00,
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
        1.304385129309417e+00,
        5.906744487488765e-01,
        4.019211828504537e-01,
        7.257585743226991e-01,
        1.355766523191855e+00,
    ];
    close("smoothing", &fit(200).predict(&[&AT]).unwrap(), &smoothing, 1e-10);
    let fewer = [
        1.304502778079585e+00,
        5.923274339639516e-01,
        4.048305694010785e-01,
        7.290073486639321e-01,
        1.354720375711260e+00,
    ];
    close("fewer knots", &fit(9).predict(&[&AT]).unwrap(), &fewer, 1e-10);
    close(
        "freedom",
        &[fit(9).degrees_of_freedom()],
        &[5.915226797856103e+00],
        1e-10,
    );
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
        6.994727540500737e-01,
        6.096123711340206e-01,
        5.487752577319587e-01,
        1.093062739322533e+00,
        8.805808541973489e-01,
    ];
    let got = fit.predict(&[&AT, &[0.2, 0.4, 0.5, 0.7, 0.31]]).unwrap();
    close("neighbours", &got, &want, 1e-13);
}
