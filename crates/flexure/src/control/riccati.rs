//! The discrete algebraic Riccati equation, for the gains of linear-quadratic control and of steady Kalman filters:
//!
//! $$ X = A^T X A - A^T X B (R + B^T X B)^{-1} B^T X A + Q $$
//!
//! by the structure-preserving doubling algorithm (Chu, Fan, Lin & Wang 2004, Structure-preserving algorithms for periodic discrete-time
//! algebraic Riccati equations, Int. J. Control 77), which converges quadratically if (A, B) is stabilisable and (A, Q) detectable.

use crate::error::{Error, Result};
use crate::linalg::Matrix;

/// The most doublings; each squares the closed loop, so 60 are enough for time constants of 2^60 samples.
const MOST_DOUBLINGS: usize = 60;
/// The relative change at which the iteration has converged.
const CONVERGED: f64 = 1e-14;

/// The stabilising solution for row-major matrices: `a` and `q` of n rows and columns, `b` of n rows and m columns, `r` of m rows.
///
/// # Errors
/// [`Error::Parameter`] for matrices that do not fit one another or have no such solution.
///
/// ```
/// use flexure::control::riccati::discrete_riccati;
/// // x = x^2 + ...: a = 1, b = 1, q = 1, r = 1 has the golden ratio.
/// let x = discrete_riccati(&[1.0], &[1.0], &[1.0], &[1.0])?;
/// assert!((x[0] - (1.0 + 5.0_f64.sqrt()) / 2.0).abs() < 1e-12);
/// # Ok::<(), flexure::Error>(())
/// ```
pub fn discrete_riccati(a: &[f64], b: &[f64], q: &[f64], r: &[f64]) -> Result<Vec<f64>> {
    let n = (a.len() as f64).sqrt() as usize;
    let m = (r.len() as f64).sqrt() as usize;
    if n == 0 || m == 0 || a.len() != n * n || q.len() != n * n || r.len() != m * m || b.len() != n * m {
        return Err(Error::parameter(
            "the number of elements of A",
            a.len() as f64,
            "n by n, with B n by m, Q n by n and R m by m",
        ));
    }
    let x = solve(
        &Matrix::from_row_slice(n, n, a),
        &Matrix::from_row_slice(n, m, b),
        &Matrix::from_row_slice(n, n, q),
        &Matrix::from_row_slice(m, m, r),
    )?;
    // The matrix is symmetric, so rows and columns have the same order.
    Ok(x.as_slice().to_vec())
}

/// The stabilising solution.
pub(crate) fn solve(a: &Matrix, b: &Matrix, q: &Matrix, r: &Matrix) -> Result<Matrix> {
    let none = || {
        Error::parameter(
            "the Riccati equation's solution",
            f64::NAN,
            "one that stabilises: weigh every state that is not damped, and R positive definite",
        )
    };
    let n = a.nrows();
    let weight = r.clone().cholesky().ok_or_else(none)?;
    let mut a = a.clone();
    let mut g = b * weight.solve(&b.transpose());
    let mut h = q.clone();
    for _ in 0..MOST_DOUBLINGS {
        let lu = (Matrix::identity(n, n) + &g * &h).lu();
        let (along, across) = (lu.solve(&a).ok_or_else(none)?, lu.solve(&g).ok_or_else(none)?);
        let more = a.transpose() * &h * &along;
        g += &a * across * a.transpose();
        a = &a * along;
        h += &more;
        g = 0.5 * (&g + g.transpose());
        h = 0.5 * (&h + h.transpose());
        if !h.iter().all(|v| v.is_finite()) {
            return Err(none());
        }
        if more.amax() <= CONVERGED * h.amax() {
            return Ok(h);
        }
    }
    Err(none())
}

/// The gain `K = (R + B^T X B)^-1 B^T X A` of `u = -K x`.
pub(crate) fn gain(a: &Matrix, b: &Matrix, q: &Matrix, r: &Matrix) -> Result<Matrix> {
    let x = solve(a, b, q, r)?;
    let weight = r + b.transpose() * &x * b;
    let gain = weight.lu().solve(&(b.transpose() * &x * a));
    gain.ok_or_else(|| Error::parameter("R + B'XB", f64::NAN, "invertible"))
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: [f64; 9] = [1.0, 0.1, 0.0, 0.0, 0.95, 0.2, 0.02, -0.1, 0.9];
    const B: [f64; 6] = [0.0, 0.01, 0.1, 0.0, 0.0, 0.2];
    const Q: [f64; 9] = [2.0, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 1.0];
    const R: [f64; 4] = [1.0, 0.1, 0.1, 0.5];

    /// scripts/reference/arm_control.py: SciPy's solution, python-control's gain.
    #[test]
    fn solution_and_gain_are_those_of_scipy_and_python_control() {
        let expected = [
            24.444_503_758_499_46,
            10.176_148_798_783_487,
            4.023_648_588_862_95,
            10.176_148_798_783_487,
            8.480_514_056_109_25,
            3.264_764_336_989_145_5,
            4.023_648_588_862_95,
            3.264_764_336_989_145_5,
            4.812_154_978_585_765,
        ];
        for (got, expected) in discrete_riccati(&A, &B, &Q, &R).unwrap().iter().zip(expected) {
            assert!((got / expected - 1.0).abs() < 1e-10, "{got} {expected}");
        }
        let [a, b] = [Matrix::from_row_slice(3, 3, &A), Matrix::from_row_slice(3, 2, &B)];
        let got = gain(
            &a,
            &b,
            &Matrix::from_row_slice(3, 3, &Q),
            &Matrix::from_row_slice(2, 2, &R),
        )
        .unwrap();
        let expected = [
            0.729_978_391_867_168_8,
            0.668_913_601_288_758_1,
            0.195_379_603_951_750_14,
            1.323_634_789_009_604_7,
            0.849_834_995_772_115_3,
            1.433_226_279_546_136_6,
        ];
        for (i, expected) in expected.iter().enumerate() {
            assert!((got[(i / 3, i % 3)] / expected - 1.0).abs() < 1e-10, "{got}");
        }
    }

    /// scripts/reference/arm_control.py: the covariance of python-control's steady filter, which is the solution of the transposed system.
    #[test]
    fn the_steady_filters_covariance_is_that_of_python_control() {
        let transposed = [1.0, 0.0, 0.02, 0.1, 0.95, -0.1, 0.0, 0.2, 0.9];
        let read = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        let expected = [
            2.791_200_541_202_437_4,
            0.456_456_175_968_854_24,
            0.009_055_715_814_536_24,
            0.456_456_175_968_854_24,
            3.771_177_938_195_994_5,
            -0.350_302_316_617_419_45,
            0.009_055_715_814_536_24,
            -0.350_302_316_617_419_45,
            1.348_097_586_351_220_3,
        ];
        let got = discrete_riccati(&transposed, &read, &Q, &R).unwrap();
        for (got, expected) in got.iter().zip(expected) {
            assert!((got / expected - 1.0).abs() < 1e-10, "{got} {expected}");
        }
    }

    #[test]
    fn what_has_no_solution_is_refused() {
        assert!(discrete_riccati(&A, &B, &Q, &[-1.0, 0.0, 0.0, 1.0]).is_err());
        assert!(discrete_riccati(&A, &B[..5], &Q, &R).is_err());
        // A growing mode that no input reaches.
        assert!(discrete_riccati(&[2.0], &[0.0], &[1.0], &[1.0]).is_err());
    }
}
