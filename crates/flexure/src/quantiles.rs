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
    use crate::distributions::{chi_squared_quantile, normal_quantile};

    #[test]
    fn they_are_those_of_the_distributions() {
        for (quantile, probability) in [
            (super::NORMAL_95, 0.975),
            (super::NORMAL_99, 0.995),
            (super::NORMAL_MAD, 0.75),
        ] {
            assert!((normal_quantile(probability) - quantile).abs() < 1e-9, "{probability}");
        }
        assert!((chi_squared_quantile(0.95, 1.0) - super::CHI_SQUARED_95).abs() < 1e-9);
    }
}
