//! An estimate as a tabulated curve. It has more points where the data are dense.

use super::{Curve, Outside, Regression};
use crate::error::Result;
use crate::sort::sorted;

/// The number of evenly spaced points over the data's range, and of points at the data's quantiles.
const POINTS: usize = 301;

/// An estimate as a curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Tabulated {
    /// The estimate.
    pub curve: Curve,
    /// Its pointwise standard errors at the curve's points; empty for an estimate that has none.
    pub standard_errors: Vec<f64>,
}

/// An estimate in one variable as a curve over the range of its abscissas `x`.
///
/// Half of the points are evenly spaced, half lie at quantiles of the data. If the data have few distinct abscissas, these are the points.
/// Where no data are within reach there is no point, and the curve is straight.
///
/// # Errors
/// Those of [`Regression::predict`] and of [`Curve::new`].
pub fn tabulate(fit: &dyn Regression, x: &[f64], outside: Outside) -> Result<Tabulated> {
    let kernel = fit.kernel_fit();
    let at = match kernel {
        Some(fit) => abscissas(&fit.data().x),
        None => abscissas(&sorted(x)),
    };
    let errors = kernel.map(|fit| fit.standard_errors(&at));
    let (mut known, mut values, mut known_errors) = (Vec::new(), Vec::new(), Vec::new());
    for (i, (x, y)) in at.iter().zip(fit.predict(&[&at])?).enumerate() {
        let error = errors.as_ref().map(|e| e[i]);
        if y.is_finite() && error.is_none_or(f64::is_finite) {
            known.push(*x);
            values.push(y);
            known_errors.extend(error);
        }
    }
    Ok(Tabulated {
        curve: Curve::new(known, values, outside)?,
        standard_errors: known_errors,
    })
}

fn abscissas(sorted: &[f64]) -> Vec<f64> {
    let n = sorted.len();
    let mut distinct = Vec::new();
    for &x in sorted {
        if distinct.last() != Some(&x) {
            distinct.push(x);
        }
        if distinct.len() > POINTS {
            break;
        }
    }
    if distinct.len() <= POINTS {
        return distinct;
    }
    let (low, high) = (sorted[0], sorted[n - 1]);
    let last = POINTS - 1;
    let even = (0..=last).map(|i| low + (high - low) * (i as f64 / last as f64));
    // Counted from the nearer end, so that mirrored data give the mirrored curve.
    let rank = |i: usize| i * (n - 1) / last;
    let quantiles = (0..=last).map(|i| sorted[if 2 * i <= last { rank(i) } else { n - 1 - rank(last - i) }]);
    let mut at: Vec<f64> = even
        .chain(quantiles)
        .chain([high])
        .filter(|x| (low..=high).contains(x))
        .collect();
    at.sort_unstable_by(f64::total_cmp);
    // Points closer than this add nothing to the curve.
    let closest = 1e-4 * (high - low) / POINTS as f64;
    let mut kept = vec![low];
    for x in at {
        if x - kept[kept.len() - 1] > closest {
            kept.push(x);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::super::{Kernel, KernelRegression, PolynomialRegression};
    use super::*;

    #[test]
    fn few_levels_are_tabulated_at_the_levels() {
        let x: Vec<f64> = (0..500).map(|i| (i % 5) as f64).collect();
        let y: Vec<f64> = x.iter().map(|x| x * x).collect();
        let method = KernelRegression {
            kernel: Kernel::Epanechnikov,
            bandwidth: 0.5,
        };
        let fit = method.fit(&x, &y).unwrap();
        let Tabulated { curve, standard_errors } = tabulate(&fit, &x, Outside::Nan).unwrap();
        assert_eq!(curve.x(), [0.0, 1.0, 2.0, 3.0, 4.0]);
        assert_eq!(curve.y(), [0.0, 1.0, 4.0, 9.0, 16.0]);
        assert!(standard_errors.iter().all(|e| *e == 0.0));
    }

    #[test]
    fn the_curve_is_the_estimate_to_the_accuracy_of_the_table() {
        let x: Vec<f64> = (0..2000)
            .map(|i| ((i * 7919) % 2000) as f64 / 1000.0 - 1.0)
            .map(|t| t * t * t)
            .collect();
        let y: Vec<f64> = x.iter().map(|x| (3.0 * x).sin()).collect();
        let fit = KernelRegression {
            kernel: Kernel::Biweight,
            bandwidth: 0.2,
        }
        .fit(&x, &y)
        .unwrap();
        let curve = tabulate(&fit, &x, Outside::Nan).unwrap().curve;
        for q in [-0.999, -0.4, -0.01, 0.0, 0.3, 0.99] {
            assert!((curve.value(q) - fit.value(q)).abs() < 1e-3);
        }
    }

    #[test]
    fn any_estimate_is_tabulated_but_only_kernels_have_errors() {
        let x: Vec<f64> = (0..400).map(|i| ((i * 7919) % 400) as f64 / 100.0).collect();
        let y: Vec<f64> = x.iter().map(|x| x * x).collect();
        let fit = crate::nonlinearity::Estimator::fit(PolynomialRegression::default(), &[&x], &y, None).unwrap();
        let Tabulated { curve, standard_errors } = tabulate(&fit, &x, Outside::Nearest).unwrap();
        assert!(standard_errors.is_empty());
        assert_eq!((curve.x()[0], curve.x()[curve.x().len() - 1]), (0.0, 3.99));
        assert!((curve.value(1.505) - 1.505 * 1.505).abs() < 1e-4);
    }

    #[test]
    fn gaps_are_bridged() {
        let x: Vec<f64> = (0..800)
            .map(|i| {
                if i < 400 {
                    i as f64 * 1e-3
                } else {
                    100.0 + i as f64 * 1e-3
                }
            })
            .collect();
        let fit = KernelRegression {
            kernel: Kernel::Epanechnikov,
            bandwidth: 0.05,
        }
        .fit(&x, &x)
        .unwrap();
        let curve = tabulate(&fit, &x, Outside::Nan).unwrap().curve;
        assert!((curve.value(50.0) - 50.0).abs() < 1.0);
    }
}
