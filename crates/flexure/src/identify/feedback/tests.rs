use std::ops::ControlFlow;

use super::loss::LoopError;
use super::system::{Entering, Loop, Observed};
use super::units::InUnits;
use super::*;
use crate::identify::block::{Kink, KinkedSpline, Rational, Residuals, Scale};
use crate::model::{Block, LoopInput, LoopOutput};
use crate::record::Record;
use crate::signal::gaussian;

/// A stable loop of order 2 whose spline bends and has a kink.
fn example(entering: Entering) -> Loop {
    let mut spline = KinkedSpline::new(&[-2.0, -0.5, 0.4, 2.0]);
    spline.c = vec![-1.0, -0.9, -0.3, 0.2, 0.8, 1.3];
    spline.kinks = vec![Kink { at: 0.3, bend: 0.2 }];
    let cy = vec![0.7, 0.2];
    Loop {
        a: vec![0.8, 0.3, -0.2, 0.7],
        bu: vec![0.1, 0.4],
        bw: vec![-0.1, -0.2],
        cz: match entering {
            Entering::Output => cy.iter().map(|c| 1.5 * c).collect(),
            Entering::Hidden => vec![0.5, 0.6],
        },
        cy,
        dyu: 0.1,
        dyw: if entering == Entering::Output { 0.0 } else { 0.05 },
        dzu: if entering == Entering::Output { 0.15 } else { 0.2 },
        offset: 0.3,
        spline,
        correction: vec![0.2, -0.1],
        initial: vec![vec![0.3, -0.2], vec![0.0, 0.5]],
        entering,
    }
}

/// Two experiments, the second with missing outputs.
fn observed() -> Observed {
    let mut data = Observed::of(gaussian(120, 1), gaussian(120, 2));
    data.starts = vec![0, 70];
    data.missing[80] = true;
    data.missing[81] = true;
    data
}

#[test]
fn a_linear_part_that_runs_away_has_no_hidden_signals() {
    let data = Observed::of(gaussian(600, 3), gaussian(600, 4));
    let signals = |gain: f64| {
        let linear = Rational::from_polynomials(vec![0.0, gain], &[1.0, -0.5]).unwrap();
        let all = starts::guesses(&data, &linear);
        assert!(all.iter().all(|guess| guess.z.len() == 600));
        all.len()
    };
    assert_eq!((signals(1.0), signals(1e12)), (4, 3));
}

#[test]
fn derivatives_are_differences() {
    let data = observed();
    for entering in [Entering::Output, Entering::Hidden] {
        let problem = LoopError::new(example(entering), &data);
        let start = problem.start();
        let at = problem.linearise(&start);
        assert_eq!(at.jacobian.len(), start.len());
        for (p, column) in at.jacobian.iter().enumerate() {
            let moved = |step: f64| {
                let mut q = start.clone();
                q[p] += step;
                problem.residuals(&q).unwrap()
            };
            let (up, down) = (moved(1e-6), moved(-1e-6));
            for k in 0..data.y.len() {
                let difference = (up[k] - down[k]) / 2e-6;
                assert!(
                    (column[k] - difference).abs() < 1e-5,
                    "{entering:?} {p} {k}: {} {difference}",
                    column[k]
                );
            }
        }
        assert_eq!(at.residuals[80], 0.0);
    }
}

/// All steps that leave the output as it is are left out, and no others: the remaining columns are independent.
#[test]
fn every_direction_changes_the_output() {
    let data = Observed::of(gaussian(600, 3), gaussian(600, 4));
    // Order n has 4 n parameters in addition to those of the spline; z = y removes n + 1.
    for (entering, count) in [(Entering::Output, 4 * 2 - 3), (Entering::Hidden, 4 * 2)] {
        let mut system = example(entering);
        system.correction.fill(0.0);
        system.initial.truncate(1);
        let problem = LoopError::new(system.clone(), &data);
        assert_eq!(problem.directions(), count + system.spline.count());
        let jacobian = problem.linearise(&problem.start()).jacobian;
        let rows: Vec<f64> = (0..600).flat_map(|k| jacobian.iter().map(move |c| c[k])).collect();
        let singular = crate::linalg::singular_values(&rows, jacobian.len()).unwrap();
        let smallest = singular[jacobian.len() - 1];
        assert!(smallest > 1e-5 * singular[0], "{entering:?} {singular:?}");
    }
}

#[test]
fn other_coordinates_are_the_same_system() {
    let data = observed();
    for entering in [Entering::Output, Entering::Hidden] {
        let system = example(entering);
        let balanced = system.balanced(&data);
        let (a, b) = (system.output(&data).unwrap(), balanced.output(&data).unwrap());
        assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-9), "{entering:?}");
    }
}

/// The model in the record's units runs like the loop, for every convention that fixes f.
#[test]
fn the_units_change_nothing() {
    let u = gaussian(400, 5);
    let (input, output) = (
        Scale { mean: 2.0, spread: 3.0 },
        Scale {
            mean: -1.0,
            spread: 0.5,
        },
    );
    for entering in [Entering::Output, Entering::Hidden] {
        for feeds_back in [1.0, 0.0] {
            let mut system = example(entering);
            system.correction.fill(0.0);
            // Without a path from w to the states, no input can hold z.
            system.bw.iter_mut().for_each(|b| *b *= feeds_back);
            system.initial = vec![vec![0.0; 2]];
            let data = Observed::of(u.clone(), gaussian(400, 6));
            let units = InUnits::new(&system, &data, [input, output], 1.0, true).unwrap();
            let convention = if feeds_back > 0.0 {
                Convention::HoldingInput
            } else {
                Convention::NoTangent
            };
            assert_eq!(units.convention, convention);
            let record: Vec<f64> = u.iter().map(|u| input.back(*u)).collect();
            let got = units.model.simulate(&record);
            let want = system.output(&data).unwrap();
            for k in 200..400 {
                // The table is straight between its points.
                assert!(
                    (got[k] - output.back(want[k])).abs() < 1e-4,
                    "{entering:?} {k}: {} {}",
                    got[k],
                    output.back(want[k])
                );
            }
        }
    }
}

#[test]
fn the_holding_input_holds() {
    let mut system = example(Entering::Output);
    system.correction.fill(0.0);
    system.initial.truncate(1);
    let data = Observed::of(gaussian(400, 7), gaussian(400, 8));
    let unit = Scale { mean: 0.0, spread: 1.0 };
    let model = InUnits::new(&system, &data, [unit; 2], 1.0, true).unwrap().model;
    for z in [-0.5, 0.1, 0.6] {
        let held = model.run(&vec![model.nonlinearity.value(z); 400]);
        assert!((held.entering[399] - z).abs() < 1e-6, "{z}: {}", held.entering[399]);
    }
    let integrates = model
        .transfer_function(LoopInput::Input, LoopOutput::Nonlinearity)
        .unwrap();
    assert!(integrates.a().iter().sum::<f64>().abs() < 1e-9);
}

/// A mass on a hardening spring with a damper, in discrete time.
fn spring(samples: usize, noise: f64, seed: u64) -> Record {
    let (u, e) = (gaussian(samples, seed), gaussian(samples, seed + 1));
    let mut y: Vec<f64> = vec![0.0; samples];
    for n in 2..samples {
        let force = 0.3 * y[n - 1] + 0.2 * y[n - 1].powi(3);
        y[n] = 1.5 * y[n - 1] - 0.6 * y[n - 2] + 0.4 * (u[n - 1] - force);
    }
    let y = y.iter().zip(e).map(|(y, e)| y + noise * e).collect();
    Record::from_equal([("u", u), ("y", y)])
}

#[test]
fn a_spring_is_found_with_its_torque() {
    let found = FEEDBACK.identify(&spring(4000, 0.01, 10), &["u"], "y").unwrap();
    assert!(found.fit_percent() > 98.0, "{}", found.verdict.text());
    assert!(found.holds(), "{}", found.verdict.text());
    let curve = found.curve("nonlinearity").unwrap();
    // At rest 0.1 y = 0.4 (u - force).
    for i in -15..=15 {
        let y = 0.1 * f64::from(i);
        let want = 0.25 * y + 0.3 * y + 0.2 * y.powi(3);
        assert!((curve.value(y) - want).abs() < 0.02, "{y}: {} {want}", curve.value(y));
    }
    let band = &found.block("nonlinearity").and_then(NamedBlock::curve).unwrap().band;
    let middle = band[band.len() / 2];
    assert!(middle > 0.0 && middle < 0.02, "{middle}");
}

#[test]
fn units_of_the_record_scale_the_curve() {
    let record = spring(2500, 0.02, 20);
    let scaled = |factor: f64, level: f64, name: &str| -> Vec<f64> {
        record
            .column(name)
            .unwrap()
            .iter()
            .map(|v| factor * v + level)
            .collect()
    };
    let other = Record::from_equal([("u", scaled(1e3, 5.0, "u")), ("y", scaled(1e-2, 3.0, "y"))]);
    let [a, b] = [&record, &other].map(|r| FEEDBACK.identify(r, &["u"], "y").unwrap());
    assert!(
        (a.fit_percent() - b.fit_percent()).abs() < 0.05,
        "{} {}",
        a.fit_percent(),
        b.fit_percent()
    );
    let (a, b) = (a.curve("nonlinearity").unwrap(), b.curve("nonlinearity").unwrap());
    for y in [-1.0, -0.3, 0.2, 0.9] {
        let (want, got) = (1e3 * a.value(y) + 5.0, b.value(1e-2 * y + 3.0));
        assert!((want - got).abs() < 20.0, "{y}: {want} {got}");
    }
}

#[test]
fn a_loop_that_runs_away_says_nothing() {
    let (u, mut y) = (gaussian(600, 30), gaussian(600, 31));
    // Bursts that no stable loop explains.
    y.iter_mut().step_by(97).for_each(|y| *y = 1e3);
    let found = FEEDBACK
        .identify(&Record::from_equal([("u", u), ("y", y)]), &["u"], "y")
        .unwrap();
    assert!(found.predicted.iter().all(|y| y.is_finite()) && !found.holds());
}

#[test]
fn noise_alone_is_useless() {
    let record = Record::from_equal([("u", gaussian(600, 40)), ("y", gaussian(600, 41))]);
    let found = FEEDBACK.identify(&record, &["u"], "y").unwrap();
    assert!(found.fit_percent() < 20.0 && found.predicted.iter().all(|y| y.is_finite()));
}

#[test]
fn it_can_be_stopped() {
    let record = spring(1500, 0.02, 50);
    for stage in [
        "approximating linearly",
        "screening the starts",
        "choosing the structure",
    ] {
        let stop = &mut |name: &str| match name == stage {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        };
        let records = [&record];
        let request = Request::new(&records, &["u"], "y", crate::identify::Options::default());
        let error = FEEDBACK.identify_with(&request, stop).unwrap_err();
        assert!(error.to_string().contains(stage), "{error}");
    }
}

#[test]
fn the_result_does_not_depend_on_threads() {
    let record = spring(1200, 0.05, 60);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| FEEDBACK.identify(&record, &["u"], "y").unwrap().predicted)
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn a_model_that_runs_away_is_not_a_number_from_there_on() {
    let mut model = match FEEDBACK.identify(&spring(1200, 0.02, 70), &["u"], "y").unwrap().model {
        Block::Series(mut blocks) => match blocks.remove(0) {
            Block::Feedback(model) => *model,
            other => panic!("{other:?}"),
        },
        other => panic!("{other:?}"),
    };
    model.state[0][0] += 3.0;
    let output = model.simulate(&gaussian(500, 71));
    let first = output.iter().position(|y| y.is_nan()).unwrap();
    assert!(first > 0 && output[first..].iter().all(|y| y.is_nan()));
}
