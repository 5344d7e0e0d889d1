//! Quantiles that several methods have in common.

/// Half the width of a two-sided 95 % interval of a normal variable, in standard deviations.
pub const NORMAL_95: f64 = 1.959_963_984_540_054;
/// The same for 99 %.
pub const NORMAL_99: f64 = 2.575_829_303_548_901;
/// The median absolute deviation of a normal variable of unit variance.
pub const NORMAL_MAD: f64 = 0.674_489_750_196_082;
/// The 95 % quantile of chi squared with one degree of freedom, the square of [`NORMAL_95`].
pub const CHI_SQUARED_95: f64 = 3.841_458_820_694_124;

#[cfg(test)]
mod tests {
    use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};

    #[test]
    fn they_are_those_of_the_distributions() {
        let normal = Normal::standard();
        for (quantile, probability) in [
            (super::NORMAL_95, 0.975),
            (super::NORMAL_99, 0.995),
            (super::NORMAL_MAD, 0.75),
        ] {
            assert!(
                (normal.inverse_cdf(probability) - quantile).abs() < 1e-9,
                "{probability}"
            );
        }
        let chi = ChiSquared::new(1.0).unwrap();
        assert!((chi.cdf(super::CHI_SQUARED_95) - 0.95).abs() < 1e-9);
    }
}
