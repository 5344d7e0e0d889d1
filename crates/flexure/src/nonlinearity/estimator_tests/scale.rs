//! Units in which numbers end.

use super::*;

/// Values whose squares overflow or vanish.
#[test]
fn columns_out_of_scale_are_refused() {
    let (x, y, w) = sample(60);
    let refused = |name: EstimatorName, x: &[&[f64]], y: &[f64], w: Option<&[f64]>, message: &str| {
        let method = NamedEstimator {
            name,
            ..Default::default()
        };
        let said = method.fit(x, y, w).unwrap_err().to_string();
        assert!(
            said.contains(message) && said.contains("between 1e-100 and 1e100"),
            "{name}: {said}"
        );
    };
    for name in EstimatorName::ALL {
        for scale in [5e307, 1e120, 1e-120, 1e-310] {
            let of = |v: &[f64]| v.iter().map(|v| scale * v).collect::<Vec<f64>>();
            refused(name, &[&of(&x)], &y, None, "column 'x");
            refused(name, &[&x], &of(&y), None, "column 'y'");
            if scale < 1e300 {
                refused(name, &[&x], &y, Some(&of(&w)), "column 'weights'");
            }
            if name.most_columns() > 1 {
                refused(name, &[&y, &of(&x)], &y, None, "column 'x");
            }
        }
    }
}

/// Units near those that are refused, and spacings at the end of what numbers can tell apart.
#[test]
fn columns_of_extreme_scale_give_finite_estimates() {
    let (x, y, _) = sample(60);
    let map = |v: &[f64], gain: f64, offset: f64| v.iter().map(|v| gain * v + offset).collect::<Vec<_>>();
    for name in EstimatorName::ALL {
        for (gain, offset, scale) in [
            (1e99, 0.0, 1.0),
            (1e-99, 0.0, 1.0),
            (1.0, 0.0, 1e99),
            (1.0, 0.0, 1e-99),
            (1e-9, 1e6, 1.0),
        ] {
            let (x, y) = (map(&x, gain, offset), map(&y, scale, 0.0));
            let fit = NamedEstimator {
                name,
                ..Default::default()
            }
            .fit(&[&x], &y, None)
            .unwrap();
            let fitted = fit.regression.predict(&[&x]).unwrap();
            assert!(
                fitted.iter().all(|m| (-0.6 * scale..2.6 * scale).contains(m)),
                "{name} {gain} {scale}: {fitted:?}"
            );
        }
    }
}
