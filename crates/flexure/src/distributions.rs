//! Distributions of test statistics.
//!
//! This is the only file that names the crate which computes them. That crate panics on arguments without a value or outside a range. Here
//! the result is then NaN, so that no comparison takes it for a finding.

use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor, Normal, StudentsT};
pub(crate) use statrs::function::erf::erfc;
use statrs::function::{erf, gamma};

/// A statistic beyond this is infinite to every distribution, and its products overflow.
const LARGEST: f64 = 1e300;

/// The quantile of the standard normal distribution at `probability`.
pub(crate) fn normal_quantile(probability: f64) -> f64 {
    at(probability, |p| Normal::standard().inverse_cdf(p))
}

/// The probability of a standard normal variable below `x`.
pub(crate) fn normal_below(x: f64) -> f64 {
    Normal::standard().cdf(x)
}

/// The probability of a standard normal variable above `x`.
pub(crate) fn normal_above(x: f64) -> f64 {
    Normal::standard().sf(x)
}

/// The quantile of Student's distribution at `probability`.
pub(crate) fn student_quantile(probability: f64, freedom: f64) -> f64 {
    match StudentsT::new(0.0, 1.0, freedom) {
        Ok(t) if is_searched(probability, [freedom; 2]) => t.inverse_cdf(probability),
        _ => f64::NAN,
    }
}

/// The quantile of the chi-squared distribution at `probability`.
pub(crate) fn chi_squared_quantile(probability: f64, degrees: f64) -> f64 {
    match ChiSquared::new(degrees) {
        Ok(chi) if is_freedom(degrees) => at(probability, |p| chi.inverse_cdf(p)),
        _ => f64::NAN,
    }
}

/// The probability of a chi-squared variable above `x`.
pub(crate) fn chi_squared_above(x: f64, degrees: f64) -> f64 {
    match ChiSquared::new(degrees) {
        Ok(chi) if is_freedom(degrees) && !x.is_nan() => match x > 1.0 / LARGEST {
            true => chi.sf(x.min(LARGEST)).clamp(0.0, 1.0),
            false => 1.0,
        },
        _ => f64::NAN,
    }
}

/// The quantile of Fisher's F distribution at `probability`.
pub(crate) fn fisher_quantile(probability: f64, freedom: [f64; 2]) -> f64 {
    match fisher(freedom) {
        Some(f) if is_searched(probability, freedom) => f.inverse_cdf(probability),
        _ => f64::NAN,
    }
}

/// The probability of an F statistic below `x`.
pub(crate) fn fisher_below(x: f64, freedom: [f64; 2]) -> f64 {
    fisher_at(x, freedom, |f, x| f.cdf(x))
}

/// The probability of an F statistic above `x`, accurate even if it is tiny.
pub(crate) fn fisher_above(x: f64, freedom: [f64; 2]) -> f64 {
    fisher_at(x, freedom, |f, x| f.sf(x))
}

/// The inverse of the complementary error function.
pub(crate) fn erfc_inverse(x: f64) -> f64 {
    match (0.0..=2.0).contains(&x) {
        true => erf::erfc_inv(x),
        false => f64::NAN,
    }
}

/// Euler's gamma function.
pub(crate) fn gamma(x: f64) -> f64 {
    gamma::gamma(x)
}

fn fisher(freedom: [f64; 2]) -> Option<FisherSnedecor> {
    let f = FisherSnedecor::new(freedom[0], freedom[1]).ok()?;
    freedom.iter().all(|f| is_freedom(*f)).then_some(f)
}

fn fisher_at(x: f64, freedom: [f64; 2], of: impl Fn(FisherSnedecor, f64) -> f64) -> f64 {
    match fisher(freedom) {
        Some(f) if !x.is_nan() => {
            let x = if freedom[0] * x < LARGEST { x } else { f64::INFINITY };
            of(f, x).clamp(0.0, 1.0)
        }
        _ => f64::NAN,
    }
}

/// Whether the search for a quantile of the beta distribution ends; for extreme arguments it does not. Student's and Fisher's quantiles use
/// it.
fn is_searched(probability: f64, freedom: [f64; 2]) -> bool {
    (1e-12..1.0 - 1e-12).contains(&probability) && freedom.iter().all(|f| (0.5..1e6).contains(f))
}

/// Whether the sums stay within their range with these degrees of freedom.
fn is_freedom(degrees: f64) -> bool {
    (1e-3..1e9).contains(&degrees)
}

/// The quantile if `probability` is a probability; NaN otherwise.
fn at(probability: f64, quantile: impl Fn(f64) -> f64) -> f64 {
    match (0.0..=1.0).contains(&probability) {
        true => quantile(probability),
        false => f64::NAN,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NASTY: [f64; 15] = [
        f64::NAN,
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::MAX,
        f64::MIN_POSITIVE,
        5e-324,
        -1.0,
        -0.0,
        0.0,
        0.5,
        1.0,
        1e17,
        1e-2,
        3.5,
        9e8,
    ];

    /// The result is NaN or a value, never a panic.
    #[test]
    fn no_argument_panics() {
        let probability = |p: f64| assert!(p.is_nan() || (-1e-9..=1.0 + 1e-9).contains(&p), "{p}");
        for a in NASTY {
            normal_quantile(a);
            erfc_inverse(a);
            for p in [normal_below(a), normal_above(a)] {
                probability(p);
            }
            for b in NASTY {
                student_quantile(a, b);
                chi_squared_quantile(a, b);
                probability(chi_squared_above(a, b));
                for c in NASTY {
                    fisher_quantile(a, [b, c]);
                    for p in [fisher_below(a, [b, c]), fisher_above(a, [b, c])] {
                        probability(p);
                    }
                }
            }
        }
    }

    /// Within the searched range, every quantile is found.
    #[test]
    fn searches_end() {
        let freedoms = [0.5, 0.7, 1.0, 2.0, 3.5, 30.0, 1e4, 9e5];
        for p in [1e-12, 1e-9, 0.01, 0.5, 0.975, 1.0 - 1e-9, 1.0 - 1.1e-12] {
            for f in freedoms {
                assert!(student_quantile(p, f).is_finite(), "{p} {f}");
                for g in freedoms {
                    assert!(!fisher_quantile(p, [f, g]).is_nan(), "{p} {f} {g}");
                }
            }
        }
    }

    #[test]
    fn what_has_no_value_is_no_finding() {
        assert!(fisher_below(f64::NAN, [2.0, 10.0]).is_nan());
        assert!(chi_squared_above(f64::NAN, 3.0).is_nan());
        assert!(normal_quantile(1.5).is_nan());
        assert_eq!(fisher_below(f64::INFINITY, [2.0, 10.0]), 1.0);
        assert_eq!(fisher_above(f64::MAX, [2.0, 10.0]), 0.0);
    }

    /// No other file calls that crate, so no call can bypass the guards.
    #[test]
    fn this_is_the_only_file_that_names_the_crate() {
        fn naming(folder: &std::path::Path, found: &mut Vec<String>) {
            for entry in std::fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    naming(&path, found);
                } else if std::fs::read_to_string(&path).unwrap().contains("use statrs") {
                    found.push(path.file_name().unwrap().to_string_lossy().into_owned());
                }
            }
        }
        let mut found = Vec::new();
        naming(
            &std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src"),
            &mut found,
        );
        assert_eq!(found, ["distributions.rs"]);
    }
}
