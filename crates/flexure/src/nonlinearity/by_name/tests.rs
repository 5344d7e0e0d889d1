use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};

use super::*;
use crate::nonlinearity::{Basis, Estimator, KernelRegression, SeriesRegression};
use crate::selection::BandwidthSearch;

/// y = sin(2 x) + noise of 0.1 on [-2, 2].
fn wave(n: usize) -> (Vec<f64>, Vec<f64>) {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(5);
    let x: Vec<f64> = (0..n).map(|_| rng.random_range(-2.0..2.0)).collect();
    let noise = |rng: &mut rand_pcg::Pcg64| -> f64 { StandardNormal.sample(rng) };
    let y = x.iter().map(|x| (2.0 * x).sin() + 0.1 * noise(&mut rng)).collect();
    (x, y)
}

fn named(name: EstimatorName, tuning: Tuning) -> NamedEstimator {
    NamedEstimator {
        name,
        tuning,
        ..NamedEstimator::default()
    }
}

#[test]
fn every_name_is_found_again_and_finds_the_truth() {
    let (x, y) = wave(1500);
    let at: Vec<f64> = (0..31).map(|i| -1.5 + 0.1 * i as f64).collect();
    for name in EstimatorName::ALL {
        assert_eq!(EstimatorName::parse(name.name()), Some(name));
        let fit = named(name, Tuning::default()).fit(&[&x], &y, None).unwrap();
        // A sine does not need local bandwidths.
        let fitted = match name {
            EstimatorName::LocalBandwidth => EstimatorName::LocalLinear,
            name => name,
        };
        assert_eq!(
            (fit.name, fit.regression.dimension(), fit.parameter.len()),
            (fitted, 1, 1)
        );
        let estimates = fit.regression.predict(&[&at]).unwrap();
        let squares: f64 = at
            .iter()
            .zip(&estimates)
            .map(|(x, m)| (m - (2.0 * x).sin()).powi(2))
            .sum();
        let error = (squares / at.len() as f64).sqrt();
        // Step functions and early windows cost more than smooth estimates.
        let rough = matches!(name, EstimatorName::Haar | EstimatorName::Recursive);
        assert!(error < if rough { 0.1 } else { 0.05 }, "{name}: {error}");
        let again = named(name, Tuning::default()).fixed(&fit).fit(&[&x], &y, None).unwrap();
        assert_eq!(again.parameter, fit.parameter, "{name}");
        let again = again.regression.predict(&[&at]).unwrap();
        assert!(
            again.iter().zip(&estimates).all(|(a, b)| (a - b).abs() < 1e-9),
            "{name}"
        );
        if let Some(scores) = &fit.scores {
            let best = scores.score.iter().copied().fold(f64::INFINITY, f64::min);
            let chosen = scores.parameter.iter().position(|p| *p == fit.parameter[0]).unwrap();
            assert!(scores.score[chosen] <= best * (1.0 + 1e-9), "{name}");
            assert!(scores.parameter.windows(2).all(|w| w[0] < w[1]), "{name}");
            assert_eq!(fit.left_out, Some(scores.score[chosen]), "{name}");
            assert!((0.009..0.02).contains(&scores.score[chosen]), "{name}");
        }
        assert!(fit.scores.is_some(), "{name}");
    }
    assert_eq!(EstimatorName::parse("Kernel"), None);
}

#[test]
fn a_name_gives_what_the_estimator_itself_gives() {
    let (x, y) = wave(300);
    let w: Vec<f64> = (0..300).map(|i| (i % 3) as f64).collect();
    let search = BandwidthSearch::search(
        Kernel::Epanechnikov,
        crate::nonlinearity::Degree::Constant,
        &x,
        &y,
        Some(&w),
    );
    let bandwidth = search.unwrap().bandwidth;
    let fit = named(EstimatorName::Kernel, Tuning::default())
        .fit(&[&x], &y, Some(&w))
        .unwrap();
    assert_eq!(fit.parameter, [bandwidth]);
    let kernel = Kernel::Epanechnikov;
    let own = KernelRegression { kernel, bandwidth }.fit_weighted(&x, &y, &w).unwrap();
    assert_eq!(fit.regression.predict(&[&x]).unwrap(), own.predict(&x));
    let legendre = SeriesRegression {
        basis: Basis::Legendre,
        ..SeriesRegression::default()
    };
    let own = legendre.fit(&[&x], &y, None).unwrap();
    let fit = named(EstimatorName::Series(Basis::Legendre), Tuning::default())
        .fit(&[&x], &y, None)
        .unwrap();
    assert_eq!(fit.parameter, [own.terms() as f64]);
    assert_eq!(
        fit.regression.predict(&[&x]).unwrap(),
        crate::nonlinearity::Regression::predict(&own, &[&x]).unwrap()
    );
}

#[test]
fn a_given_parameter_is_kept_under_its_public_name() {
    let (x, y) = wave(200);
    for (name, value) in [
        (EstimatorName::Kernel, 0.3),
        (EstimatorName::LocalLinear, 0.3),
        (EstimatorName::Neighbours, 7.0),
        (EstimatorName::Series(Basis::Fourier), 5.0),
        (EstimatorName::Haar, 3.0),
        (EstimatorName::Polynomial, 4.0),
        (EstimatorName::Spline, 0.01),
        (EstimatorName::Recursive, 1.5),
    ] {
        let fit = named(name, Tuning::Fixed(vec![value])).fit(&[&x], &y, None).unwrap();
        assert_eq!(fit.parameter, [value], "{name}");
        assert!(fit.scores.is_none(), "{name}");
    }
}

#[test]
fn wrong_parameters_are_refused_under_their_own_names() {
    let (x, y) = wave(50);
    let message = |name, values: &[f64]| {
        let fit = named(name, Tuning::Fixed(values.to_vec())).fit(&[&x], &y, None);
        fit.unwrap_err().to_string()
    };
    assert_eq!(
        message(EstimatorName::Neighbours, &[2.5]),
        "the parameter 'neighbours' is 2.5, but must be a whole number from 0 to 1e15"
    );
    assert!(message(EstimatorName::Polynomial, &[f64::NAN]).contains("'degree' is NaN"));
    assert!(message(EstimatorName::Kernel, &[-1.0]).contains("the bandwidth is -1"));
    assert!(message(EstimatorName::Recursive, &[0.0]).contains("the bandwidth is 0"));
    assert!(message(EstimatorName::Kernel, &[0.1, 0.2]).contains("'bandwidth' has 2"));
    let two = named(EstimatorName::Spline, Tuning::default()).fit(&[&x, &x], &y, None);
    assert!(two.unwrap_err().to_string().contains("takes 1 column, but 2"));
}

#[test]
fn the_recursive_estimate_follows_the_order_of_the_points_alone_in_its_early_windows() {
    let (x, y) = wave(400);
    let reversed = |v: &[f64]| v.iter().rev().copied().collect::<Vec<_>>();
    let method = named(EstimatorName::Recursive, Tuning::Fixed(vec![2.0]));
    let one = method.fit(&[&x], &y, None).unwrap();
    let other = method.fit(&[&reversed(&x)], &reversed(&y), None).unwrap();
    let at = [-1.0, 0.0, 0.7];
    let (one, other) = (
        one.regression.predict(&[&at]).unwrap(),
        other.regression.predict(&[&at]).unwrap(),
    );
    assert!(
        one.iter().zip(&other).all(|(a, b)| a != b && (a - b).abs() < 0.1),
        "{one:?} {other:?}"
    );
}

#[test]
fn every_rule_that_suits_finds_the_truth_and_the_others_are_refused() {
    let (x, y) = wave(400);
    let at = [-1.2, -0.3, 0.4, 1.1];
    for rule in Rule::ALL {
        assert_eq!(Rule::parse(rule.name()), Some(rule));
        for name in EstimatorName::ALL {
            let fit = named(name, Tuning::FromData(rule)).fit(&[&x], &y, None);
            if !rule.suits(name, 1) {
                let refused = fit.unwrap_err().to_string();
                assert!(
                    refused.starts_with(&format!("the rule '{}' cannot", rule.name())),
                    "{refused}"
                );
                continue;
            }
            let estimates = fit.unwrap().regression.predict(&[&at]).unwrap();
            for (x, m) in at.iter().zip(estimates) {
                assert!(
                    (m - (2.0 * x).sin()).abs() < 0.25,
                    "{} of {name} at {x}: {m}",
                    rule.name()
                );
            }
        }
    }
}

#[test]
fn the_plug_in_rule_is_for_the_local_line() {
    let (x, y) = wave(300);
    let fit = |name| named(name, Tuning::FromData(Rule::PlugIn)).fit(&[&x], &y, None);
    for name in [EstimatorName::Kernel, EstimatorName::Recursive] {
        let refused = fit(name).unwrap_err().to_string();
        let title = name.title();
        assert_eq!(
            refused,
            format!(
                "the rule 'plugin' cannot choose the parameter of a {title} in 1 column; it is made for the local line; take \
                 that, or another rule"
            )
        );
    }
    // The local bandwidths' global one is that of the rule itself.
    let (one, local) = (
        fit(EstimatorName::LocalLinear).unwrap(),
        fit(EstimatorName::LocalBandwidth).unwrap(),
    );
    assert_eq!(one.parameter, local.parameter);
    assert!(local.scores.is_none() && local.left_out.is_none());
}

#[test]
fn blocks_of_the_bootstrap_can_be_given() {
    let (x, y) = wave(300);
    let fit = |rule| named(EstimatorName::LocalLinear, Tuning::FromData(rule)).fit(&[&x], &y, None);
    let own = |block| {
        let rule = crate::selection::BandwidthRule::BlockBootstrap {
            block,
            replicates: None,
            seed: 1,
        };
        let degree = crate::nonlinearity::Degree::Linear;
        crate::selection::choose_bandwidth(rule, Kernel::Epanechnikov, degree, &x, &y, None).unwrap()
    };
    for block in [None, Some(40)] {
        let found = fit(Rule::BlockBootstrap { block }).unwrap();
        assert_eq!(found.parameter, [own(block).bandwidth()]);
        assert_eq!(found.scores.unwrap().criterion, own(block).score);
    }
    let refused = fit(Rule::BlockBootstrap { block: Some(301) }).unwrap_err().to_string();
    assert!(refused.contains("residuals in a block is 301"), "{refused}");
}

#[test]
fn the_recursive_estimate_has_weights_bands_of_time_and_a_score() {
    let (x, y) = wave(500);
    let ones = vec![1.0; 500];
    for rule in [Rule::LeaveOneOut, Rule::Generalized, Rule::Block, Rule::Bootstrap] {
        let method = named(EstimatorName::Recursive, Tuning::FromData(rule));
        let (plain, weighted) = (
            method.fit(&[&x], &y, None).unwrap(),
            method.fit(&[&x], &y, Some(&ones)).unwrap(),
        );
        assert!(
            (plain.parameter[0] / weighted.parameter[0] - 1.0).abs() < 1e-9,
            "{}",
            rule.name()
        );
        let scores = plain.scores.unwrap();
        let best = (0..scores.score.len())
            .min_by(|&i, &j| scores.score[i].total_cmp(&scores.score[j]))
            .unwrap();
        assert!(
            (scores.parameter[best] / plain.parameter[0] - 1.0).abs() < 1e-9,
            "{}",
            rule.name()
        );
    }
}

#[test]
fn several_columns_have_a_bandwidth_each() {
    let (a, noise) = wave(600);
    let b: Vec<f64> = (0..600).map(|i| ((i * 7919) % 600) as f64 / 300.0 - 1.0).collect();
    // Bends along a, straight along b.
    let y: Vec<f64> = (0..600).map(|i| noise[i] + b[i]).collect();
    for rule in [Rule::LeaveOneOut, Rule::Generalized, Rule::Block] {
        let fit = named(EstimatorName::LocalLinear, Tuning::FromData(rule))
            .fit(&[&a, &b], &y, None)
            .unwrap();
        let [along_a, along_b] = fit.parameter[..] else {
            panic!("{:?}", fit.parameter)
        };
        assert!(along_b > along_a, "{along_a} {along_b}");
        let found = fit.regression.predict(&[&[0.5], &[0.25]]).unwrap()[0];
        assert!((found - 1.0_f64.sin() - 0.25).abs() < 0.15, "{}: {found}", rule.name());
        let scores = fit.scores.unwrap();
        assert!(
            scores.parameter.windows(2).all(|w| w[0] < w[1]),
            "{:?}",
            scores.parameter
        );
        let best = scores.score.iter().copied().fold(f64::INFINITY, f64::min);
        let place = scores.score.iter().position(|s| *s == best).unwrap();
        let mean = kernels::geometric_mean(&[along_a, along_b]);
        assert!(
            (scores.parameter[place] / mean - 1.0).abs() < 1e-9,
            "the chosen one is the best of the profile"
        );
    }
    let refused = named(EstimatorName::Kernel, Tuning::FromData(Rule::PlugIn)).fit(&[&a, &b], &y, None);
    assert!(
        refused
            .unwrap_err()
            .to_string()
            .contains("in 2 columns; choose it by another rule")
    );
    for name in [EstimatorName::Neighbours, EstimatorName::Network] {
        let fit = named(name, Tuning::default()).fit(&[&a, &b], &y, None).unwrap();
        let found = fit.regression.predict(&[&[0.5], &[0.25]]).unwrap()[0];
        assert!((found - 1.0_f64.sin() - 0.25).abs() < 0.3, "{name}: {found}");
    }
}
