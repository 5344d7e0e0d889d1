//! A weighted straight line through log errors over log n.

use super::table::RatePoint;

/// The slope of log rms over log n.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LogSlope {
    pub value: f64,
    pub standard_error: f64,
}

impl LogSlope {
    pub const UNKNOWN: LogSlope = LogSlope {
        value: f64::NAN,
        standard_error: f64::NAN,
    };
}

/// The logarithms of n and of the rms error, and the weight of the rms error.
struct LogPoint {
    n: f64,
    rms: f64,
    weight: f64,
}

/// The slope of log rms over log n.
///
/// Weighted least squares: the Monte Carlo standard error of a mean squared error is known, and that of
/// its logarithm follows. The slope's standard error follows from these errors. `None` with fewer than
/// two usable points.
pub(super) fn slope(points: &[RatePoint]) -> Option<LogSlope> {
    let usable: Vec<LogPoint> = points
        .iter()
        .filter(|p| p.rms > 0.0 && p.standard_error > 0.0 && p.rms.is_finite() && p.standard_error.is_finite())
        .map(|p| {
            let relative = p.standard_error / p.rms;
            LogPoint {
                n: (p.n as f64).ln(),
                rms: p.rms.ln(),
                weight: 1.0 / (relative * relative),
            }
        })
        .collect();
    let total: f64 = usable.iter().map(|p| p.weight).sum();
    let centre = |of: fn(&LogPoint) -> f64| usable.iter().map(|p| p.weight * of(p)).sum::<f64>() / total;
    let (x, y) = (centre(|p| p.n), centre(|p| p.rms));
    let spread: f64 = usable.iter().map(|p| p.weight * (p.n - x).powi(2)).sum();
    let joint: f64 = usable.iter().map(|p| p.weight * (p.n - x) * (p.rms - y)).sum();
    (usable.len() >= 2 && spread > 0.0).then(|| LogSlope {
        value: joint / spread,
        standard_error: spread.sqrt().recip(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_power_law_gives_its_exponent() {
        let points: Vec<RatePoint> = [100, 1000, 10_000, 100_000]
            .map(|n| {
                let rms = 3.0 * (n as f64).powf(-0.37);
                RatePoint {
                    n,
                    rms,
                    standard_error: 0.1 * rms,
                    runs: 50,
                    missing: 0,
                }
            })
            .to_vec();
        let LogSlope { value, standard_error } = slope(&points).unwrap();
        assert!((value + 0.37).abs() < 1e-12);
        // sigma / sqrt(sum (x - mean)^2), x = 1, 2, 3, 4 times ln 10.
        let expected = 0.1 / (5.0_f64.sqrt() * 10.0_f64.ln());
        assert!((standard_error - expected).abs() < 1e-12, "{standard_error}");
    }

    #[test]
    fn one_point_has_no_slope() {
        let point = RatePoint {
            n: 100,
            rms: 1.0,
            standard_error: 0.1,
            runs: 50,
            missing: 0,
        };
        assert_eq!(slope(&[point]), None);
        assert_eq!(slope(&[]), None);
    }
}
