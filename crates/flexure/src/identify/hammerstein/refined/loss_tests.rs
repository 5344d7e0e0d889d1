use super::super::piecewise::{PiecewiseCubics, Term, UnitCoordinate};
use super::*;

fn wave(n: usize, rate: f64) -> Vec<f64> {
    (0..n).map(|i| ((i * i) as f64 * rate).sin()).collect()
}

fn example() -> Blocks {
    let terms = [
        Term::Power(0),
        Term::Power(1),
        Term::TruncatedPower { at: 0.1, degree: 1 },
        Term::TruncatedPower { at: -0.4, degree: 0 },
    ];
    let mix: Vec<f64> = (0..16)
        .map(|i| f64::from(i / 4 == i % 4) + 0.1 * f64::from(i).cos())
        .collect();
    Blocks {
        basis: PiecewiseCubics::new(UnitCoordinate::new(-1.0, 1.0), &terms, &mix),
        c: vec![0.7, -1.3, 0.4],
        linear: LinearPart::new(&[0.5, -0.3, 0.2], &[-1.1, 0.4], 2),
        offset: 0.3,
    }
}

#[test]
fn the_equations_are_those_of_numerical_derivatives() {
    let n = 700;
    let u = wave(n, 0.0171);
    let observed = Observed {
        u: &u,
        y: wave(n, 0.007),
        output_mean: 0.0,
        experiments: vec![0..301, 301..n],
        counts: (0..n).map(|i| i % 7 != 3 && (i > 20 && i < 301 || i > 330)).collect(),
        missing: Vec::new(),
        memory: 0,
    };
    let whitening = [1.0, -0.6, 0.2, 0.1];
    let model = example();
    let Equations { normal, count } = model.equations(&observed, &whitening);
    let white = |m: &Blocks| -> Vec<f64> {
        let e: Vec<f64> = (observed.y.iter().zip(m.simulated(&observed)))
            .map(|(y, s)| y - m.offset - s)
            .collect();
        let e = LinearPart::moving_average(&whitening).filter(&observed.experiments, &e);
        e.iter()
            .zip(&observed.counts)
            .filter(|(_, c)| **c)
            .map(|(e, _)| *e)
            .collect()
    };
    let e = white(&model);
    assert_eq!(count, e.len());
    assert!((normal.cost - dot(&e, &e)).abs() < 1e-9 * normal.cost);
    assert!((model.squares(&observed, &whitening) - normal.cost).abs() < 1e-9 * normal.cost);
    let p = model.parameters();
    let columns: Vec<Vec<f64>> = (0..p.len())
        .map(|i| {
            let shifted = |h: f64| {
                let mut q = p.clone();
                q[i] += h;
                white(&model.with(&q))
            };
            // The derivative of the prediction, not of the error.
            let (up, down) = (shifted(1e-5), shifted(-1e-5));
            up.iter().zip(&down).map(|(u, d)| -(u - d) / 2e-5).collect()
        })
        .collect();
    for i in 0..p.len() {
        let want = dot(&columns[i], &e);
        assert!((normal.descent[i] - want).abs() < 1e-5 * (1.0 + want.abs()), "{i}");
        for j in 0..p.len() {
            let want = dot(&columns[i], &columns[j]);
            let got = normal.normal[i * p.len() + j];
            assert!((got - want).abs() < 1e-5 * (1.0 + want.abs()), "{i} {j}: {got} {want}");
        }
    }
}

#[test]
fn the_equations_of_pieces_are_those_of_the_whole() {
    let n = 200_000;
    let u = wave(n, 0.0171);
    let observed = Observed {
        u: &u,
        y: wave(n, 0.007),
        output_mean: 0.0,
        experiments: vec![0..1000, 1000..n],
        counts: (0..n).map(|i| i % 7 != 3).collect(),
        missing: Vec::new(),
        memory: 0,
    };
    let whitening = [1.0, -0.6, 0.2, 0.1];
    let model = example();
    let mut whole = Batch::new(model.layout().len());
    for experiment in observed.experiments.clone() {
        let piece = Piece {
            begin: 0,
            from: 0,
            end: experiment.len(),
        };
        model.add_piece(&observed, experiment, &piece, &whitening, &mut whole);
    }
    let (whole, found) = (whole.sums, model.equations(&observed, &whitening));
    assert!(model.linear.transfer.pieces(n - 1000).len() > 1);
    assert_eq!(found.count, whole.count);
    let close = |a: f64, b: f64| (a - b).abs() <= 1e-12 * whole.normal.cost;
    assert!(close(found.normal.cost, whole.normal.cost));
    let parameters = found.parameters();
    for i in 0..parameters {
        assert!(close(found.normal.descent[i], whole.normal.descent[i]));
        for j in 0..=i {
            let at = i * parameters + j;
            assert!(close(found.normal.normal[at], whole.normal.normal[at]), "{i} {j}");
        }
    }
}
