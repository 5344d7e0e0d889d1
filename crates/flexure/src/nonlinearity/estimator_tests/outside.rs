//! Beyond the data and in empty windows.

use super::*;

/// How an estimator is fitted to x, y and weights, with its policy.
pub type ByPolicy = Box<dyn Fn(&[f64], &[f64], Option<&[f64]>, Outside) -> Fitted>;

#[test]
fn beyond_the_data_the_policy_holds() {
    let (x, y, _) = sample(60);
    let (low, high) = (
        x.iter().copied().fold(1.0, f64::min),
        x.iter().copied().fold(-1.0, f64::max),
    );
    for (name, fit) in FIXED {
        let at = |outside, at: &[f64]| fit(&[&x], &y, None, outside).unwrap().predict(&[at]).unwrap();
        let ends = at(Outside::Nan, &[low, high]);
        assert!(ends.iter().all(|v| v.is_finite()), "{name}");
        assert!(
            at(Outside::Nan, &[low - 0.5, high + 0.5, f64::NAN])
                .iter()
                .all(|v| v.is_nan())
        );
        close(name, &at(Outside::Nearest, &[low - 0.5, high + 0.5]), &ends, 0.0);
        assert!(at(Outside::Nearest, &[f64::NAN])[0].is_nan(), "{name}");
        // The tangent: the step outside is as high as that inside is, for a small step.
        let small = 1e-6;
        let beyond = at(Outside::Linear, &[low - small, low + small, high - small, high + small]);
        close(name, &[beyond[0] - ends[0]], &[ends[0] - beyond[1]], 1e-9);
        close(name, &[beyond[3] - ends[1]], &[ends[1] - beyond[2]], 1e-9);
        let far = at(Outside::Linear, &[high + 1.0, high + 2.0]);
        close(name, &[far[1] - far[0]], &[far[0] - ends[1]], 1e-9);
    }
}

/// Those that keep the points themselves; their windows end 0.3 from the data.
pub fn with_windows() -> Vec<(&'static str, ByPolicy)> {
    let named = |name: EstimatorName, tuning: Tuning| {
        move |x: &[f64], y: &[f64], w: Option<&[f64]>, outside| {
            let method = NamedEstimator {
                name,
                tuning: tuning.clone(),
                outside,
                ..Default::default()
            };
            Ok(method.fit(&[x], y, w)?.regression)
        }
    };
    vec![
        (
            "kernel",
            Box::new(named(EstimatorName::Kernel, Tuning::Fixed(vec![0.3]))),
        ),
        (
            "local-linear",
            Box::new(named(EstimatorName::LocalLinear, Tuning::Fixed(vec![0.3]))),
        ),
        (
            "recursive",
            Box::new(named(EstimatorName::Recursive, Tuning::Fixed(vec![0.3]))),
        ),
        (
            "local-bandwidth",
            Box::new(named(EstimatorName::LocalBandwidth, Tuning::default())),
        ),
        (
            "plug-in",
            Box::new(named(EstimatorName::LocalBandwidth, Tuning::FromData(Rule::PlugIn))),
        ),
    ]
}

#[test]
fn beyond_the_windows_the_policy_holds() {
    let (x, y, w) = sample(60);
    let (low, high) = (
        x.iter().copied().fold(1.0, f64::min),
        x.iter().copied().fold(-1.0, f64::max),
    );
    for (name, fit) in with_windows() {
        let at = |outside, at: &[f64]| fit(&x, &y, Some(&w), outside).unwrap().predict(&[at]).unwrap();
        let ends = at(Outside::Nan, &[low, high]);
        assert!(ends.iter().all(|v| v.is_finite()), "{name}");
        let away = at(Outside::Nan, &[low - 0.5, high + 0.5, f64::NAN, f64::INFINITY]);
        assert!(away.iter().all(|v| v.is_nan()), "{name} {away:?}");
        close(
            name,
            &at(Outside::Nearest, &[low - 0.5, high + 0.5, low - 0.01]),
            &[ends[0], ends[1], ends[0]],
            0.0,
        );
        assert!(at(Outside::Nearest, &[f64::NAN])[0].is_nan(), "{name}");
        let line = at(Outside::Linear, &[low - 2.0, low - 1.0, high + 1.0, high + 2.0]);
        close(name, &[line[1] - line[0]], &[ends[0] - line[1]], 1e-9);
        close(name, &[line[3] - line[2]], &[line[2] - ends[1]], 1e-9);
        // y is x^2 and noise of mean 1/2: it falls at the left end and rises at the right one.
        assert!(ends[0] < line[1] && ends[1] < line[2], "{name} {line:?}");
        let inside = [-0.4, 0.2];
        assert_eq!(at(Outside::Nearest, &inside), at(Outside::Nan, &inside), "{name}");
    }
}
