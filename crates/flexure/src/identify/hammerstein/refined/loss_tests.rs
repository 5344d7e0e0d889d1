use super::super::pieces::{Term, Unit};
use super::*;

fn wave(n: usize, rate: f64) -> Vec<f64> {
    (0..n).map(|i| ((i * i) as f64 * rate).sin()).collect()
}

fn example() -> Model {
    let terms = [
        Term::Power(0),
        Term::Power(1),
        Term::From { at: 0.1, degree: 1 },
        Term::From { at: -0.4, degree: 0 },
    ];
    let mix: Vec<f64> = (0..16)
        .map(|i| f64::from(i / 4 == i % 4) + 0.1 * f64::from(i).cos())
        .collect();
    Model {
        basis: Pieces::new(Unit::new(-1.0, 1.0), &terms, &mix),
        c: vec![0.7, -1.3, 0.4],
        dynamics: Dynamics {
            b: vec![0.5, -0.3, 0.2],
            a: vec![1.0, -1.1, 0.4],
            delay: 2,
        },
        offset: 0.3,
    }
}

#[test]
fn the_backward_filter_is_the_adjoint() {
    let (x, y) = (wave(300, 0.013), wave(300, 0.029));
    let parts = [0..120, 120..121, 121..300];
    let g = example().dynamics;
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let (left, right) = (dot(&filter(&g, &parts, &x), &y), dot(&x, &filter_back(&g, &parts, &y)));
    assert!((left - right).abs() < 1e-10 * left.abs().max(1.0), "{left} {right}");
}

#[test]
fn the_equations_are_those_of_numerical_derivatives() {
    let n = 700;
    let u = wave(n, 0.0171);
    let data = Data {
        u: &u,
        y: wave(n, 0.007),
        parts: vec![0..301, 301..n],
        counts: (0..n).map(|i| i % 7 != 3 && (i > 20 && i < 301 || i > 330)).collect(),
        missing: Vec::new(),
    };
    let whitening = [1.0, -0.6, 0.2, 0.1];
    let model = example();
    let normal = model.normal(&data, &whitening);
    let white = |m: &Model| -> Vec<f64> {
        let simulated = filter(&m.dynamics, &data.parts, &m.signal(data.u));
        let e: Vec<f64> = data.y.iter().zip(simulated).map(|(y, s)| y - m.offset - s).collect();
        let e = filter(&Dynamics::moving_average(&whitening), &data.parts, &e);
        e.iter()
            .zip(&data.counts)
            .filter(|(_, c)| **c)
            .map(|(e, _)| *e)
            .collect()
    };
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let e = white(&model);
    assert_eq!(normal.count, e.len());
    assert!((normal.squares - dot(&e, &e)).abs() < 1e-9 * normal.squares);
    assert_eq!(model.squares(&data, &whitening).1, e.len());
    assert!((model.squares(&data, &whitening).0 - normal.squares).abs() < 1e-9 * normal.squares);
    let p = model.parameters();
    let columns: Vec<Vec<f64>> = (0..p.len())
        .map(|i| {
            let shifted = |h: f64| {
                let mut q = p.clone();
                q[i] += h;
                white(&model.with(&q))
            };
            // Of the prediction, not of the error.
            let (up, down) = (shifted(1e-5), shifted(-1e-5));
            up.iter().zip(&down).map(|(u, d)| -(u - d) / 2e-5).collect()
        })
        .collect();
    for i in 0..p.len() {
        let want = dot(&columns[i], &e);
        assert!((normal.gradient[i] - want).abs() < 1e-5 * (1.0 + want.abs()), "{i}");
        for j in 0..p.len() {
            let want = dot(&columns[i], &columns[j]);
            let got = normal.matrix[i * p.len() + j];
            assert!((got - want).abs() < 1e-5 * (1.0 + want.abs()), "{i} {j}: {got} {want}");
        }
    }
}
