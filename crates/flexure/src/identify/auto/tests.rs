//! Structures named from small records, and the rules of the judgement on errors made up for them.

use crate::error::{DataError, ParameterError, Stopped};
use std::ops::ControlFlow;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::judge::{Judged, judge};
use super::*;
use crate::Error;
use crate::identify::{Verdict, WIENER_HAMMERSTEIN};
use crate::linear::TransferFunction;
use crate::linear::correlation::variance;
use crate::record::Record;
use crate::signal::gaussian;

/// A record with white noise of 30 dB.
fn record(u: Vec<f64>, y: &[f64]) -> Record {
    let size = 0.03 * variance(y).sqrt();
    let noise = gaussian(u.len(), 77);
    let y = y.iter().zip(noise).map(|(y, e)| y + size * e).collect();
    Record::new([("u", u), ("y", y)]).unwrap()
}

fn filtered(b: &[f64], a: &[f64], u: &[f64]) -> Vec<f64> {
    TransferFunction::new(b.to_vec(), a.to_vec()).unwrap().simulate(u)
}

fn bent(w: &[f64]) -> Vec<f64> {
    w.iter().map(|w| w.clamp(-0.7, 1.0)).collect()
}

/// A record of every structure.
fn of(structure: StructureName) -> Record {
    let u = gaussian(3000, 1 + rank(structure).unwrap() as u64);
    let front = |u: &[f64]| filtered(&[0.5, 0.2], &[1.0, -1.0, 0.5], u);
    let back = |z: &[f64]| filtered(&[1.0, 0.5], &[1.0, -0.7], z);
    let y = match structure.key {
        "linear" => front(&u),
        "hammerstein" => back(&bent(&u)),
        "wiener" => bent(&front(&u)),
        "wiener-hammerstein" => back(&bent(&front(&u))),
        "hammerstein-wiener" => bent(&front(&bent(&u)).iter().map(|x| 1.5 * x).collect::<Vec<_>>()),
        "feedback" => return spring(),
        _ => {
            let square: Vec<f64> = u.iter().map(|u| u * u).collect();
            back(&bent(&u)).iter().zip(front(&square)).map(|(p, q)| p + q).collect()
        }
    };
    record(u, &y)
}

fn identify(record: &Record) -> Identification {
    AUTO.identify(record, &["u"], "y").unwrap()
}

fn compare(record: &Record) -> StructureComparison {
    identify(record).comparison.unwrap()
}

fn compared_names() -> Vec<StructureName> {
    compared_structures(1).iter().map(|s| s.name).collect()
}

fn name(key: &str) -> StructureName {
    Structure::by_name(key).unwrap().name
}

#[test]
fn every_structure_is_named_and_the_others_are_refuted() {
    for structure in compared_names() {
        let identified = identify(&of(structure));
        let result = identified.comparison.unwrap();
        assert_eq!(result.supported, Some(structure), "{:?}", result.reasons);
        assert_eq!((result.chosen, identified.structure), (structure, structure));
        assert!(result.as_good.is_empty() && result.not_noise < 0.1);
        for c in &result.candidates {
            let poorer = c.structure != structure && rank(c.structure) <= rank(structure);
            let compared = |r: &Refutation| matches!(r, Refutation::Comparison { ratio, .. } if *ratio > 1.02);
            assert_eq!(c.refuted_by.first().is_some_and(compared), poorer, "{c:?}");
            assert!(c.parameters > 0 && c.rms > 0.0);
        }
        assert!(
            result.reasons[0].contains(&format!("support {structure}")),
            "{:?}",
            result.reasons
        );
        let chosen = result.candidates.iter().find(|c| c.structure == structure).unwrap();
        assert!(chosen.fit_percent > 96.0, "{}", chosen.fit_percent);
        let verdict = identified.verdict;
        assert_eq!(
            (chosen.fit_percent, chosen.rms),
            (verdict.measures.fit_percent, verdict.measures.rms)
        );
    }
}

/// A mass on a hardening spring, by small explicit steps: the nonlinearity is in the feedback path.
fn spring() -> Record {
    let mut rng = Pcg64::seed_from_u64(3);
    let u: Vec<f64> = (0..2500).map(|_| rng.random_range(-1.7..1.7)).collect();
    let (mut x, mut v) = (0.0_f64, 0.0);
    let y: Vec<f64> = u
        .iter()
        .map(|u| {
            let now = x;
            for _ in 0..100 {
                v += 0.007 * (u - 0.6 * v - x - 0.8 * x * x * x);
                x += 0.007 * v;
            }
            now
        })
        .collect();
    record(u, &y)
}

#[test]
fn a_spring_is_a_loop_and_none_of_the_chains() {
    let result = compare(&spring());
    assert_eq!(result.supported, Some(name("feedback")), "{:?}", result.reasons);
    assert!(result.looks_like.is_empty());
    let loops = |c: &StructureCandidate| c.structure == name("feedback");
    assert!(result.candidates.iter().all(|c| c.refuted_by.is_empty() == loops(c)));
    // Parallel branches have more blocks, and are not asked.
    assert!(result.candidates.iter().all(|c| c.structure != name("parallel")));
    assert!(result.reasons.iter().any(|r| r.contains("holds: parallel")));
}

/// A Hammerstein system whose gain doubles over the record.
fn drifting(n: usize) -> Record {
    let u = gaussian(n, 21);
    let y = filtered(&[1.0, 0.5], &[1.0, -0.7], &bent(&u));
    let gain = |k: usize| 1.0 + k as f64 / n as f64;
    record(u, &y.iter().enumerate().map(|(k, y)| gain(k) * y).collect::<Vec<_>>())
}

#[test]
fn a_drift_is_none_of_them_and_is_called_one() {
    let result = compare(&drifting(2000));
    assert_eq!(result.supported, None, "{:?}", result.reasons);
    assert!(result.reasons[0].contains("none of these"));
    assert_eq!(result.looks_like[0].0, Symptom::Drift, "{:?}", result.looks_like);
    assert!(
        result.reasons[1].contains("Its error looks like"),
        "{:?}",
        result.reasons
    );
    let share = result.looks_like[0].1;
    assert!(share > 0.3 && result.not_noise >= share, "{share} {}", result.not_noise);
}

#[test]
fn a_static_system_is_as_much_hammerstein_as_wiener() {
    let u = gaussian(2000, 4);
    let y = bent(&u);
    let result = compare(&record(u, &y));
    assert!(
        result.supported.is_some_and(|s| rank(s) == Some(Rank::TwoBlocks)),
        "{:?}",
        result.reasons
    );
    assert_eq!(result.as_good.len(), 1);
    assert!(result.reasons.iter().any(|r| r.contains("do not distinguish them")));
}

#[test]
fn it_can_be_stopped_in_every_structure_says_what_it_does_and_repeats_itself() {
    let record = drifting(700);
    for stop in compared_names() {
        let mut seen = Vec::new();
        let progress = &mut |stage: &str| {
            let structure = stage.split(", ").next().unwrap().to_owned();
            seen.push(structure.clone());
            if structure == stop.title {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        };
        let error = identify_with(&record, Options::default(), progress).unwrap_err();
        assert!(matches!(error, Error::Stopped(Stopped::Identifying { .. })), "{error}");
        assert_eq!(seen.last().map(String::as_str), Some(stop.title));
    }
    assert_eq!(identify(&record), identify(&record));
}

#[test]
fn structures_that_are_not_fitted_are_named() {
    let u = gaussian(1500, 6);
    let y = filtered(&[0.5, 0.2], &[1.0, -1.0, 0.5], &u);
    let record = record(u, &y);
    let short = compare(&record);
    assert_eq!(short.candidates.len(), 1);
    assert!(
        short
            .reasons
            .iter()
            .any(|r| r.contains("Not fitted") && r.contains("Wiener-Hammerstein"))
    );
    assert_eq!(short.supported, Some(name("linear")));
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let short = Record::new([("u", gaussian(250, 7)), ("y", gaussian(250, 8))]).unwrap();
    let error = identify_error(&short, Options::default());
    assert!(
        matches!(
            error,
            Error::Data(DataError::TooShort {
                need: 200,
                got: 187,
                ..
            })
        ),
        "{error}"
    );
    let error = identify_error(&short, Options::with_fresh_share(f64::NAN));
    assert!(
        matches!(error, Error::Parameter(ParameterError::OutOfRange { .. })),
        "{error}"
    );
}

fn identify_with(record: &Record, options: Options, progress: &mut Progress<'_>) -> Result<Identification> {
    AUTO.identify_with(&Request::new(&[record], &["u"], "y", options), progress)
}

fn identify_error(record: &Record, options: Options) -> Error {
    identify_with(record, options, &mut |_| ControlFlow::Continue(())).unwrap_err()
}

/// Candidates that all predict the same of outputs with these errors.
fn judged_with(errors: &[(StructureName, Vec<f64>)], u: &[f64]) -> (usize, Vec<usize>, bool, f64) {
    judged_at(10.0, errors, u)
}

/// The same, with predictions of this size.
fn judged_at(size: f64, errors: &[(StructureName, Vec<f64>)], u: &[f64]) -> (usize, Vec<usize>, bool, f64) {
    with_judged(size, errors, u, |candidates| {
        let j = judge(candidates, &[u]);
        (j.chosen, j.ties, j.supported, j.not_noise)
    })
}

/// The same candidates, before they are judged.
fn with_judged<T>(
    size: f64,
    errors: &[(StructureName, Vec<f64>)],
    u: &[f64],
    then: impl FnOnce(&[Judged<'_>]) -> T,
) -> T {
    let predicted: Vec<f64> = u.iter().map(|u| size * u).collect();
    let with = |e: &[f64]| predicted.iter().zip(e).map(|(p, e)| p + e).collect();
    let outputs: Vec<Vec<f64>> = errors.iter().map(|(_, e)| with(e)).collect();
    let verdicts: Vec<Verdict> = outputs
        .iter()
        .map(|y| Verdict::new(u, y, &predicted).unwrap())
        .collect();
    let candidates: Vec<Judged<'_>> = (0..errors.len())
        .map(|i| Judged::new(errors[i].0, &verdicts[i], &outputs[i], predicted.clone()))
        .collect();
    then(&candidates)
}

/// The structures that need not be fitted after a candidate of this name with these errors, where the least error so far is this
/// share of its own.
fn superfluous_after(candidate: &str, size: f64, errors: &[f64], u: &[f64], least: f64) -> Vec<&'static str> {
    with_judged(size, &[(name(candidate), errors.to_vec())], u, |judged| {
        let least = least * judged[0].error();
        let not_needed = compared_structures(1)
            .into_iter()
            .filter(|s| judged[0].suffices(s, least));
        not_needed.map(|s| s.name.key).collect()
    })
}

#[test]
fn a_general_structure_is_superfluous_only_where_a_simpler_one_holds_and_has_the_least_error() {
    let (u, white) = (gaussian(2500, 10), gaussian(2500, 11));
    let chains = ["wiener-hammerstein", "hammerstein-wiener"];
    let general = ["feedback", "parallel"];
    let after = |size: f64, errors: &[f64], least: f64| superfluous_after("hammerstein", size, errors, &u, least);
    // Only white noise can be left: everything more complex is superfluous, no matter what else was fitted.
    assert_eq!(after(10.0, &white, 0.5), [chains, general].concat());
    // A chain may explain more of a small coloured error. A loop need not be fitted, unless something already explained more.
    let coloured = filtered(&[1.0], &[1.0, -0.8], &white);
    assert_eq!(after(100.0, &coloured, 1.0), general);
    assert!(after(100.0, &coloured, 0.99).is_empty());
    // A larger error that is mostly coloured may be that of a loop; one that is less so is noise.
    assert_eq!(after(20.0, &coloured, 1.0), ["parallel"]);
    assert_eq!(after(20.0, &filtered(&[1.0], &[1.0, -0.5], &white), 1.0), general);
    // What is large and coloured does not hold.
    assert!(after(2.0, &coloured, 1.0).is_empty());
    // A small misfit that a test sees may be that of a loop, but not one below a thousandth; after a loop it is enough.
    let missed: Vec<f64> = u.iter().zip(&white).map(|(u, e)| e + 0.15 * (u * u - 1.0)).collect();
    assert!(after(40.0, &missed, 1.0).is_empty());
    assert_eq!(after(400.0, &missed, 1.0), general);
    assert_eq!(superfluous_after("feedback", 40.0, &missed, &u, 1.0), ["parallel"]);
    assert!(superfluous_after("feedback", 40.0, &missed, &u, 0.99).is_empty());
    assert!(superfluous_after("parallel", 10.0, &white, &u, 1.0).is_empty());
}

#[test]
fn the_simplest_that_is_not_significantly_worse_wins() {
    let (u, e) = (gaussian(2500, 10), gaussian(2500, 11));
    let scaled = |by: f64| -> Vec<f64> { e.iter().map(|e| by * e).collect() };
    let with = |by: f64| [(name("linear"), scaled(by)), (name("wiener-hammerstein"), scaled(1.0))];
    // If the errors differ only by a factor, half a percent is significant, yet the two are equally good. Five percent is no longer equally
    // good.
    assert_eq!(judged_with(&with(1.0025), &u).0, 0);
    assert_eq!(judged_with(&with(1.025), &u).0, 1);
    // Independent errors that differ by chance.
    let chance = [
        (name("linear"), gaussian(2500, 12)),
        (name("hammerstein"), gaussian(2500, 13)),
    ];
    assert_eq!(judged_with(&chance, &u).0, 0);
    let (chosen, ties, supported, _) = judged_with(
        &[(name("hammerstein"), scaled(1.001)), (name("wiener"), scaled(1.0))],
        &u,
    );
    assert_eq!((chosen, ties, supported), (1, vec![0], true));
}

#[test]
fn a_few_wild_samples_decide_nothing_and_what_the_input_explains_does() {
    let (u, e) = (gaussian(2500, 14), gaussian(2500, 15));
    let mut wild = e.clone();
    (wild[100], wild[2000]) = (60.0, -80.0);
    let (chosen, _, supported, _) = judged_with(&[(name("linear"), wild), (name("hammerstein"), e.clone())], &u);
    assert_eq!((chosen, supported), (0, true));
    // Small errors elsewhere do not make the best of a candidate that runs away in places.
    let small: Vec<f64> = e.iter().map(|e| 0.3 * e).collect();
    let mut runaway: Vec<f64> = e.iter().map(|e| 0.2 * e).collect();
    runaway[300..310].fill(60.0);
    let candidates = [
        (name("linear"), e.clone()),
        (name("hammerstein"), small),
        (name("parallel"), runaway),
    ];
    assert_eq!(judged_with(&candidates, &u).0, 1);
    let missed = |share: f64| -> Vec<f64> { u.iter().zip(&e).map(|(u, e)| e + share * (u * u - 1.0)).collect() };
    // A misfit of 0.5 % of the output's deviation is negligible, one of 2 % is not.
    let (_, _, supported, not_noise) = judged_at(40.0, &[(name("linear"), missed(0.15))], &u);
    assert!(supported && not_noise > 0.01 && not_noise < 0.1, "{not_noise}");
    let (_, _, supported, not_noise) = judged_at(10.0, &[(name("linear"), missed(0.15))], &u);
    assert!(!supported && not_noise < 0.1, "{not_noise}");
    let (_, _, supported, not_noise) = judged_with(&[(name("linear"), missed(1.0))], &u);
    assert!(!supported && (not_noise - 2.0 / 3.0).abs() < 0.08, "{not_noise}");
}

/// A candidate that is far off for a short time has a large error, but no test can be sure that it is worse.
#[test]
fn a_larger_error_than_that_of_a_refuted_simpler_one_refutes_too() {
    let (u, e) = (gaussian(2500, 16), gaussian(2500, 17));
    let scaled = |by: f64| -> Vec<f64> { e.iter().map(|e| by * e).collect() };
    let mut off_for_a_while = e.clone();
    off_for_a_while[700..715].fill(5.0);
    let general = (name("feedback"), off_for_a_while);
    let parallel = (name("parallel"), scaled(0.97));
    // Alone, the two are not told apart, and the simpler one is chosen.
    assert_eq!(judged_with(&[general.clone(), parallel.clone()], &u).0, 0);
    let with_linear = [(name("linear"), scaled(1.03)), general, parallel];
    assert_eq!(judged_with(&with_linear, &u).0, 2);
}

/// Without a given structure, a Hammerstein model that holds stays, and one that does not gives way to the structure of the record.
#[test]
fn another_structure_is_looked_for_where_a_hammerstein_model_does_not_hold() {
    for structure in ["hammerstein", "wiener"].map(name) {
        let record = of(structure);
        let records = [&record];
        let request = Request::new(&records, &["u"], "y", Options::default());
        let go_on = &mut |_: &str| ControlFlow::Continue(());
        let hammerstein = crate::identify::HAMMERSTEIN.identify_with(&request, go_on).unwrap();
        let found = or_another(hammerstein.clone(), &request, go_on).unwrap();
        match structure.key {
            "hammerstein" => assert_eq!(found, hammerstein),
            _ => assert_eq!(found, identify(&record)),
        }
        assert_eq!(found.structure, structure);
    }
}

/// A Wiener-Hammerstein fit of a simpler system, one of whose linear parts is a mere delay.
#[test]
fn a_linear_part_that_is_a_mere_delay_is_none() {
    let u = gaussian(3000, 9);
    let slow = filtered(&[0.3], &[1.0, -0.95], &u);
    let late: Vec<f64> = std::iter::repeat_n(0.0, 4)
        .chain(slow.iter().copied())
        .take(3000)
        .collect();
    let last = |z: &[f64]| filtered(&[1.0, 0.5], &[1.0, -0.7], z);
    let hammerstein = WIENER_HAMMERSTEIN
        .identify(&record(slow.clone(), &last(&bent(&late))), &["u"], "y")
        .unwrap();
    let mut wiener = hammerstein.clone();
    wiener.paths[0].blocks.reverse();
    wiener.model = wiener.paths[0].model(wiener.output_offset);
    for (key, fitted) in [("hammerstein", hammerstein), ("wiener", wiener)] {
        let found = simpler::simpler(fitted.clone());
        assert_eq!((found.structure, found.delay), (name(key), 4), "{key}");
        assert_eq!(found.paths[0].delay(), 4);
        let [one, other] = [&fitted, &found].map(|i| i.model.run(&[&slow]));
        let mut settled = one.iter().zip(&other).skip(100);
        assert!(settled.all(|(a, b)| (a - b).abs() < 1e-9), "{key}");
    }
    // Two linear parts with memory stay.
    let fitted = WIENER_HAMMERSTEIN
        .identify(&of(WIENER_HAMMERSTEIN.name), &["u"], "y")
        .unwrap();
    assert_eq!(simpler::simpler(fitted.clone()), fitted);
}

/// A valve that sticks: it moves only if the command is more than 6 away, and then stops 2.5 before it. Linear dynamics leave an error that no test
/// sees to depend on the input, but most of it follows from its own past.
#[test]
fn a_valve_that_sticks_is_no_linear_system() {
    let n = 4000;
    let noise = gaussian(n, 5);
    let smooth = filtered(&[0.0045, 0.0045], &[1.0, -0.91], &noise);
    let size = variance(&smooth).sqrt();
    let command: Vec<f64> = smooth.iter().map(|x| 14.0 * x / size).collect();
    let mut at = 0.0;
    let valve: Vec<f64> = command
        .iter()
        .map(|u| {
            let away: f64 = u - at;
            if away.abs() > 6.0 {
                at = u - away.signum() * 2.5;
            }
            at
        })
        .collect();
    let flow = filtered(&[0.0, 0.077], &[1.0, -0.846], &valve);
    let noise = gaussian(n, 6);
    let y = flow.iter().zip(noise).map(|(y, e)| y + 0.1 * e).collect();
    let found = compare(&Record::new([("u", command), ("y", y)]).unwrap());
    let error = |key: &str| found.candidates.iter().find(|c| c.structure.key == key).map(|c| c.rms);
    assert!(error("feedback").unwrap() < 0.7 * error("linear").unwrap(), "{found:?}");
    assert_ne!(found.supported.map(|s| s.key), Some("linear"), "{found:?}");
}
