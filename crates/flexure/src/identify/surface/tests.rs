use std::ops::ControlFlow;

use rand::{RngExt, SeedableRng};

use super::fit::{Fit, refined};
use super::*;
use crate::identify::MULTIPLE_INPUTS;
use crate::identify::Verdict;
use crate::identify::block::{Rational, standardised};
use crate::identify::request::{Options, Request};
use crate::linear::correlation::variance;
use crate::record::Record;
use crate::validation::FitMeasures;

/// phi of two inputs by name.
type Phi = fn(f64, f64) -> f64;

fn product(a: f64, b: f64) -> f64 {
    a * b
}

/// Friction of the first, stiffened by the second.
fn friction_times_stiffness(a: f64, b: f64) -> f64 {
    (0.4 * a + (4.0 * a).tanh()) * (1.0 + 0.6 * b * b + 0.3 * b)
}

/// Columns p, q, y: `phi` through the poles 0.75 +- 0.35i and a delay of one, with noise of 20 dB; inputs white, or filtered.
fn record(phi: Phi, n: usize, seed: u64, colour: f64) -> Record {
    let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
    let mut input = || -> Vec<f64> {
        let mut last = 0.0;
        (0..n)
            .map(|_| {
                last = colour * last + (1.0 - colour) * random.random_range(-2.0..2.0);
                last
            })
            .collect()
    };
    let (p, q) = (input(), input());
    let v: Vec<f64> = p.iter().zip(&q).map(|(a, b)| phi(*a, *b)).collect();
    let clean = linear().simulate(&v);
    let noise = 0.1 * variance(&clean).sqrt() * 12_f64.sqrt();
    let y = clean
        .iter()
        .map(|y| y + noise * random.random_range(-0.5..0.5))
        .collect();
    Record::new([("p", p), ("q", q), ("y", y)]).unwrap()
}

fn linear() -> TransferFunction {
    TransferFunction::new(vec![0.0, 1.0, 0.3], vec![1.0, -1.5, 0.685]).unwrap()
}

/// Relative error of a surface against phi over the box [-1.9, 1.9]^2 (scaled by `reach`), after the best affine alignment.
fn error(surface: &Surface, phi: Phi, reach: f64) -> f64 {
    let grid: Vec<f64> = (0..41).map(|i| reach * 1.9 * (f64::from(i) / 20.0 - 1.0)).collect();
    let points = || grid.iter().flat_map(|a| grid.iter().map(move |b| (*a, *b)));
    let truth = standardised(&points().map(|(a, b)| phi(a, b)).collect::<Vec<_>>());
    let found = points().map(|(a, b)| surface.value(&[a, b])).collect::<Vec<_>>();
    let found = standardised(&found);
    let cosine = truth.iter().zip(&found).map(|(t, f)| t * f).sum::<f64>() / truth.len() as f64;
    (1.0 - cosine * cosine).max(0.0).sqrt()
}

/// The same estimator of the surface where the linear part is known.
fn oracle(record: &Record, pieces: usize) -> Surface {
    let records = [record];
    let request = Request::new(&records, &["p", "q"], "y", Options::default());
    let samples = request.samples_at_least("a test", 0).unwrap();
    let prepared = samples.prepared();
    let data = &prepared.data;
    let g = linear();
    let known = Rational::from_polynomials(g.b().to_vec(), g.a()).unwrap();
    let fit = Fit::flat(data, known, 0, pieces).unwrap();
    let fit = refined(
        fit,
        data,
        0,
        &mut Monitor::new(&mut |_: &str| ControlFlow::Continue(())),
    )
    .unwrap();
    InUnits::new(&fit, &prepared).unwrap().surface
}

/// The joint nonlinearity.
fn surface_of(result: &Identification) -> &Surface {
    match &result.block("nonlinearity").unwrap().kind {
        BlockKind::Surface(surface) => surface,
        other => panic!("{other:?} is no surface"),
    }
}

#[test]
fn nonadditive_surfaces_are_recovered_as_by_one_who_knows_the_linear_part() {
    for (name, phi, colour) in [
        ("product", product as Phi, 0.0),
        ("friction times stiffness", friction_times_stiffness, 0.0),
        (
            "friction times stiffness, coloured inputs",
            friction_times_stiffness,
            0.6,
        ),
    ] {
        let reach = if colour > 0.0 { 0.4 } else { 1.0 };
        let mut ratios = Vec::new();
        for seed in 0..2 {
            let record = record(phi, 3000, seed, colour);
            let result = JOINT_INPUTS.identify(&record, &["p", "q"], "y").unwrap();
            let surface = surface_of(&result);
            let pieces = surface.axes()[0].pieces;
            let best = [4, 6, 9, 13].map(|k| error(&oracle(&record, k), phi, reach));
            let best = best.into_iter().fold(f64::INFINITY, f64::min);
            let own = error(surface, phi, reach);
            println!(
                "{name}, seed {seed}: error {own:.4}, oracle {best:.4}, pieces {pieces}, order {}, delay {}, fit {:.2}, holds {}",
                result.order,
                result.delay,
                result.fit_percent(),
                result.holds()
            );
            assert_eq!((result.order, result.delay), (2, 1), "{name}, seed {seed}");
            ratios.push(own / best);
        }
        assert!(ratios.iter().all(|r| *r < 1.5), "{name}: {ratios:?}");
    }
}

#[test]
fn an_additive_model_is_refuted_where_inputs_act_jointly() {
    let record = record(friction_times_stiffness, 3000, 7, 0.0);
    let additive = MULTIPLE_INPUTS.identify(&record, &["p", "q"], "y").unwrap();
    let joint = JOINT_INPUTS.identify(&record, &["p", "q"], "y").unwrap();
    println!(
        "additive {:.2}, joint {:.2}",
        additive.fit_percent(),
        joint.fit_percent()
    );
    let refuted = Verdict::worst(&additive.verdicts).and_then(Verdict::refutation);
    assert!(refuted.is_some() && joint.holds());
    assert!(joint.fit_percent() > additive.fit_percent() + 10.0);
}

#[test]
fn three_inputs_and_the_scales_of_the_record() {
    let mut random = rand_pcg::Pcg64::seed_from_u64(5);
    let n = 2500;
    let mut input = || -> Vec<f64> { (0..n).map(|_| random.random_range(-1.0..1.0)).collect() };
    let (p, q, r) = (input(), input(), input());
    let v: Vec<f64> = (0..n).map(|i| p[i] * q[i] + r[i].powi(2) * p[i]).collect();
    let clean = TransferFunction::new(vec![1.0], vec![1.0, -0.7]).unwrap().simulate(&v);
    let noise = input();
    let y: Vec<f64> = clean.iter().zip(noise).map(|(y, e)| y + 0.03 * e).collect();
    let of = |gain: f64, offset: f64| {
        let p = p.iter().map(|p| gain * p + offset).collect();
        let y = y.iter().map(|y| 1e-6 * y + gain).collect();
        let columns = [("p", p), ("q", q.clone()), ("r", r.clone()), ("y", y)];
        let record = Record::new(columns).unwrap();
        JOINT_INPUTS.identify(&record, &["p", "q", "r"], "y").unwrap()
    };
    let (one, other) = (of(1.0, 0.0), of(1e3, 5e3));
    assert!(one.fit_percent() > 90.0, "{}", one.fit_percent());
    assert_eq!((one.order, one.delay), (1, 0));
    assert!((one.fit_percent() - other.fit_percent()).abs() < 0.01);
    assert_eq!(one.verdicts.len(), 6);
    let again = FitMeasures::new(
        &y[one.fitted..],
        &one.predicted[one.fitted..]
            .iter()
            .map(|p| 1e6 * (p - 1.0))
            .collect::<Vec<_>>(),
    );
    assert!((again.unwrap().fit_percent - one.fit_percent()).abs() < 1e-3);
}

#[test]
fn noise_is_answered_and_wrong_inputs_are_refused() {
    let mut random = rand_pcg::Pcg64::seed_from_u64(9);
    let mut noise = || -> Vec<f64> { (0..800).map(|_| random.random_range(-1.0..1.0)).collect() };
    let record = Record::new([("p", noise()), ("q", noise()), ("y", noise())]).unwrap();
    let result = JOINT_INPUTS.identify(&record, &["p", "q"], "y").unwrap();
    assert!(result.fit_percent() < 15.0 && result.linear("linear").unwrap().is_stable());
    assert!(result.predicted.iter().all(|p| p.is_finite()));
    let text = |inputs: &[&str]| JOINT_INPUTS.identify(&record, inputs, "y").unwrap_err().to_string();
    assert!(text(&["p"]).contains("2 to 4"));
    assert!(text(&["p", "p"]).contains("'p'"));
    assert!(text(&["p", "q", "r", "s", "t"]).contains("2 to 4"));
    assert!(text(&["p", "missing"]).contains("missing"));
}
