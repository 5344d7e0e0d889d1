//! Derivatives in comparison with central differences.

/// Asserts that every column of a Jacobian is the derivative of the residuals with respect to its parameter.
pub fn assert_derivatives(p: &[f64], jacobian: &[Vec<f64>], residuals: impl Fn(&[f64]) -> Vec<f64>) {
    assert_eq!(jacobian.len(), p.len());
    let h = 1e-6;
    for (i, column) in jacobian.iter().enumerate() {
        let at = |step: f64| {
            let mut p = p.to_vec();
            p[i] += step;
            residuals(&p)
        };
        let (above, below) = (at(h), at(-h));
        assert_eq!(above.len(), column.len());
        for ((a, b), c) in above.iter().zip(&below).zip(column) {
            let difference = (a - b) / (2.0 * h);
            assert!(
                (difference - c).abs() < 1e-6 * (1.0 + c.abs()),
                "parameter {i}: {difference} {c}"
            );
        }
    }
}
