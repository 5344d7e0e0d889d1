//! Filters, splines and trends in comparison with SciPy: `scripts/reference/preparation.py` made the values.

use super::{Grid, LowPass, Resampling, Trend};

fn signal() -> Vec<f64> {
    let of = |i: i64| f64::from(((37 * i * i + 11 * i) % 101) as i32) / 64.0 + 0.125 * i as f64;
    (0..60).map(of).collect()
}

fn instants() -> Vec<f64> {
    (0..60)
        .map(|i| 0.5 * f64::from(i) + f64::from((53 * i) % 64) / 256.0)
        .collect()
}

/// Every sixth value is that of the reference.
fn assert_near(values: &[f64], reference: &[f64], what: &str) {
    let every_sixth = values.iter().step_by(6);
    assert_eq!(every_sixth.len(), reference.len(), "{what}");
    for (value, reference) in every_sixth.zip(reference) {
        assert!((value - reference).abs() < 1e-9, "{what}: {value} is not {reference}");
    }
}

#[test]
fn low_passes() {
    let x = signal();
    for (name, order, cutoff, reference) in [
        ("order 4", 4, 2.0, &ORDER_4[..]),
        ("order 8", 8, 4.5, &ORDER_8),
        ("slow", 4, 0.05, &SLOW),
        ("order 2", 2, 3.0, &ORDER_2),
    ] {
        assert_near(&LowPass { cutoff, order }.filter(&x, 0.1).unwrap(), reference, name);
    }
    let short = LowPass { cutoff: 2.0, order: 4 }.filter(&x[..9], 0.1).unwrap();
    for (value, reference) in short.iter().zip(SHORT) {
        assert!((value - reference).abs() < 1e-9, "{value} is not {reference}");
    }
}

#[test]
fn splines() {
    let grid = Grid {
        start: 1.0,
        step: 0.375,
        samples: 74,
    };
    let resampled = Resampling::default().resample(&instants(), &signal(), &grid).unwrap();
    assert_near(&resampled, &SPLINE, "the spline");
}

#[test]
fn trends() {
    let (t, mut x): (Vec<f64>, Vec<f64>) = ((0..60).map(f64::from).collect(), signal());
    let trend = Trend::of(&t, &x).unwrap();
    x.iter_mut().zip(&t).for_each(|(x, t)| *x -= trend.value(*t));
    assert_near(&x, &DETRENDED, "the trend");
}

const ORDER_4: [f64; 10] = [
    0.0006244813298771357,
    1.8130742688883714,
    1.9966631675630169,
    3.1890094908240796,
    3.9275004267149325,
    4.741339876516859,
    5.396418707627764,
    5.899889039405309,
    6.734548343303609,
    7.314185518041396,
];
const ORDER_8: [f64; 10] = [
    -0.0017945346905437198,
    2.1913189541780462,
    1.6446959826389373,
    3.18973766939873,
    3.8287896453700365,
    5.157352793427846,
    5.5566401374347825,
    6.581419364778199,
    6.593215096598794,
    7.096022340368327,
];
const SLOW: [f64; 10] = [
    -0.5758738380530499,
    -0.5037375399997479,
    -0.4432648279530433,
    -0.39452159463214803,
    -0.3570129918478011,
    -0.3297232524180084,
    -0.31120569462505177,
    -0.29972022261232056,
    -0.29340900326002006,
    -0.2904932987051246,
];
const ORDER_2: [f64; 10] = [
    5.558550208972779e-05,
    2.0891918410788506,
    1.8084940339402324,
    3.1852472553029356,
    3.8826740452382267,
    4.852674393227566,
    5.5947519078473125,
    6.026507470473872,
    6.711784291096684,
    7.156378277841412,
];
const SHORT: [f64; 9] = [
    0.004237158983790304,
    0.7976704351348406,
    1.2115315997766882,
    1.2757205746375522,
    1.3490219981789853,
    1.6441696679674922,
    1.954576563225401,
    1.9261964616467995,
    1.5211413716750095,
];
const SPLINE: [f64; 13] = [
    1.1920151736962845,
    2.0790365481972026,
    2.227901193407068,
    2.1588591291298824,
    3.3597563428562216,
    4.0145248609245066,
    4.0113212931790985,
    4.784834980988713,
    5.00979870199953,
    6.466209741255019,
    6.266804220378014,
    6.950112118986097,
    8.325352635366658,
];
const DETRENDED: [f64; 10] = [
    -0.7880208333333326,
    0.5491613700564979,
    -0.6761564265536713,
    0.2704007768361594,
    0.23258298022598956,
    0.7885151836158197,
    0.36007238700565125,
    0.5253795903954819,
    -0.2936882062146875,
    -0.5190060028248569,
];
