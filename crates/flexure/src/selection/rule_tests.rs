use super::*;
use crate::selection::test_data::{noisy, slow};

fn chosen(rule: BandwidthRule, degree: Degree, x: &[f64], y: &[f64]) -> BandwidthChoice {
    choose_bandwidth(rule, Kernel::Epanechnikov, degree, x, y, None).unwrap()
}

#[test]
fn names_lead_back_to_the_rules() {
    for rule in BandwidthRule::ALL {
        assert_eq!(BandwidthRule::from_name(rule.name()), Some(rule));
    }
    assert_eq!(BandwidthRule::from_name("guess"), None);
}

/// The mean squared error of the estimate, by every rule, over that with the best bandwidth.
#[test]
fn every_rule_comes_near_the_best_bandwidth_in_hindsight() {
    let m = |x: f64| (3.0 * x).sin();
    let grid: Vec<f64> = (0..200).map(|i| -1.95 + 3.9 * f64::from(i) / 199.0).collect();
    let seeds = 10;
    let mut ratios = [0.0; BandwidthRule::ALL.len()];
    for seed in 0..seeds {
        let (x, y) = noisy(seed, 1000, m);
        let error = |h: f64| {
            let method = crate::nonlinearity::KernelRegression {
                kernel: Kernel::Epanechnikov,
                bandwidth: h,
            };
            let values = method.fit(&x, &y).unwrap().with_degree(Degree::Linear).predict(&grid);
            values.iter().zip(&grid).map(|(v, &q)| (v - m(q)).powi(2)).sum::<f64>()
        };
        let best = (1..100)
            .map(|i| error(0.01 * f64::from(i)))
            .filter(|e| e.is_finite())
            .fold(f64::INFINITY, f64::min);
        for (ratio, rule) in ratios.iter_mut().zip(BandwidthRule::ALL) {
            *ratio += error(chosen(rule, Degree::Linear, &x, &y).bandwidth()) / best / seeds as f64;
        }
    }
    for (ratio, rule) in ratios.iter().zip(BandwidthRule::ALL) {
        eprintln!("{:16} mean squared error over the best: {ratio:.3}", rule.name());
        assert!(*ratio < 1.25, "{} {ratio}", rule.name());
    }
}

#[test]
fn units_and_threads_do_not_matter_and_scores_scale() {
    let (x, y) = slow(3, 400, 0.5, |x| x * x);
    // Unevenly, so that rounding decides no ties.
    let x: Vec<f64> = x.iter().map(|x| x + 0.01 * (37.0 * x).sin()).collect();
    let map = |v: &[f64], gain: f64, offset: f64| v.iter().map(|v| gain * v + offset).collect::<Vec<_>>();
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    for rule in BandwidthRule::ALL {
        for degree in [Degree::Constant, Degree::Linear] {
            if rule == BandwidthRule::PlugIn && degree == Degree::Constant {
                let refused = choose_bandwidth(rule, Kernel::Epanechnikov, degree, &x, &y, None).unwrap_err();
                assert!(refused.to_string().contains("made for the local line"), "{refused}");
                continue;
            }
            let one = pool(1).install(|| chosen(rule, degree, &x, &y));
            assert_eq!(one, pool(2).install(|| chosen(rule, degree, &x, &y)));
            let other = chosen(rule, degree, &map(&x, 1e-3, 5.0), &map(&y, -1e4, 1e6));
            let what = format!("{} {degree:?}", rule.name());
            assert!(
                (other.bandwidth() / one.bandwidth() / 1e-3 - 1.0).abs() < 1e-6,
                "{what}"
            );
            for (a, b) in one.search.curve.iter().zip(&other.search.curve) {
                assert!((b.error / a.error / 1e8 - 1.0).abs() < 1e-5, "{what} {a:?} {b:?}");
            }
        }
    }
}

#[test]
fn what_a_rule_takes_from_the_data_is_reported() {
    let (x, y) = slow(1, 500, 0.8, |x| x);
    let blocks = chosen(BandwidthRule::HBlock { gap: None }, Degree::Linear, &x, &y);
    let BandwidthRule::HBlock { gap: Some(gap) } = blocks.rule else {
        panic!("{:?}", blocks.rule)
    };
    assert!(
        gap > 0 && blocks.details.contains(&format!("more than {gap} samples")),
        "{}",
        blocks.details
    );
    let given = chosen(blocks.rule, Degree::Linear, &x, &y);
    assert_eq!(given.search, blocks.search);
    assert!(given.details.contains("as given"));
    let resampled = chosen(
        BandwidthRule::from_name("block-bootstrap").unwrap(),
        Degree::Linear,
        &x,
        &y,
    );
    assert!(matches!(
        resampled.rule,
        BandwidthRule::BlockBootstrap {
            block: Some(_),
            replicates: Some(40),
            seed: 1
        }
    ));
    assert_eq!(chosen(resampled.rule, Degree::Linear, &x, &y), resampled);
}

#[test]
fn bad_data_and_parameters_are_refused_by_every_rule() {
    let (x, y) = noisy(1, 30, |x| x);
    let said = |rule, x: &[f64], y: &[f64], w: Option<&[f64]>| {
        choose_bandwidth(rule, Kernel::Biweight, Degree::Linear, x, y, w)
            .unwrap_err()
            .to_string()
    };
    for rule in BandwidthRule::ALL {
        assert!(said(rule, &x, &y[..9], None).contains("'y' has 9 samples"));
        assert!(said(rule, &x[..2], &y[..2], None).contains("at least 3 samples"));
        let mut broken = y.clone();
        broken[4] = f64::INFINITY;
        assert!(said(rule, &x, &broken, None).contains("'y' is inf at sample 4"));
        let mut w = vec![1.0; 30];
        w[5] = -1.0;
        assert!(said(rule, &x, &y, Some(&w)).contains("the weight of sample 5"));
    }
    let block = |block, replicates| BandwidthRule::BlockBootstrap {
        block,
        replicates,
        seed: 1,
    };
    assert!(said(block(Some(31), None), &x, &y, None).contains("residuals in a block is 31"));
    assert!(said(block(None, Some(0)), &x, &y, None).contains("the number of replicates is 0"));
    assert!(said(BandwidthRule::HBlock { gap: Some(14) }, &x, &y, None).contains("the gap is 14"));
    assert!(said(BandwidthRule::PlugIn, &x[..9], &y[..9], None).contains("at least 10 samples"));
    let levels: Vec<f64> = (0..30).map(|i| f64::from(i % 4)).collect();
    assert!(said(BandwidthRule::PlugIn, &levels, &y, None).contains("distinct abscissas"));
}

#[test]
fn degenerate_data_break_no_rule() {
    let constant = [1.0; 40];
    let ramp: Vec<f64> = (0..40).map(f64::from).collect();
    let levels: Vec<f64> = (0..40).map(|i| f64::from(i % 6)).collect();
    let mut outlier = ramp.clone();
    outlier[7] = 1e9;
    for rule in BandwidthRule::ALL {
        for kernel in Kernel::ALL {
            for (x, y) in [
                (&ramp, &constant[..]),
                (&ramp, &ramp),
                (&levels, &ramp),
                (&outlier, &ramp),
                (&ramp, &outlier),
            ] {
                let choice = choose_bandwidth(rule, kernel, Degree::Linear, x, y, None).unwrap();
                assert!(
                    choice.bandwidth() > 0.0 && choice.bandwidth().is_finite(),
                    "{rule:?} {kernel:?}"
                );
            }
        }
    }
}
