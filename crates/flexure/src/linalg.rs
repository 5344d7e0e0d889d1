//! The only file that names the linear-algebra crate.

/// A complex number.
pub use nalgebra::Complex;
use nalgebra::{ComplexField, DMatrix, DVector, DVectorViewMut, Dyn};

/// Columns of length 1 are dependent if less than this is left of one. Rounding.
const DEPENDENT: f64 = 1e-13;

/// A real matrix.
pub type Matrix = DMatrix<f64>;
/// A real vector.
pub type Vector = DVector<f64>;
/// The factors of a symmetric positive definite matrix.
pub type Cholesky = nalgebra::Cholesky<f64, Dyn>;

/// A real or a complex number.
pub trait Scalar: ComplexField<RealField = f64> + Copy {}

impl<T: ComplexField<RealField = f64> + Copy> Scalar for T {}

/// The factors of a square matrix, real or complex, by elimination with partial pivoting.
pub struct Factors<T: Scalar>(nalgebra::LU<T, Dyn, Dyn>);

impl<T: Scalar> Factors<T> {
    /// The matrix of `n` rows with these entries.
    pub fn unfinished(n: usize, entry: impl FnMut(usize, usize) -> T) -> DMatrix<T> {
        DMatrix::from_fn(n, n, entry)
    }

    /// Those of a matrix.
    pub fn of(matrix: DMatrix<T>) -> Self {
        Factors(matrix.lu())
    }

    /// Replaces a right-hand side by the solution; `false` if the matrix is singular.
    #[must_use]
    pub fn solve(&self, rhs: &mut [T]) -> bool {
        let count = rhs.len();
        self.0.solve_mut(&mut DVectorViewMut::from_slice(rhs, count))
    }
}

/// The product of two matrices, with sums in the order of their terms, so that it does not depend on the processor.
pub fn product(a: &Matrix, b: &Matrix) -> Matrix {
    let mut product = Matrix::zeros(a.nrows(), b.ncols());
    for (mut column, b) in product.column_iter_mut().zip(b.column_iter()) {
        column.gemv(1.0, a, &b, 0.0);
    }
    product
}

/// The minimum-norm solution of `min |rows x - rhs|` for a row-major matrix of `columns` columns.
///
/// Singular values below `1e-12` of the largest count as zero. `None` if the decomposition fails.
pub fn least_squares(rows: &[f64], columns: usize, rhs: &[f64]) -> Option<Vec<f64>> {
    let matrix = DMatrix::from_row_slice(rhs.len(), columns, rows);
    let svd = matrix.try_svd(true, true, f64::EPSILON, 1000)?;
    let largest = svd.singular_values.max();
    let solution = svd.solve(&DVector::from_column_slice(rhs), 1e-12 * largest).ok()?;
    solution
        .iter()
        .all(|v| v.is_finite())
        .then(|| solution.iter().copied().collect())
}

/// The solution of `A x = rhs` for a symmetric positive definite row-major matrix; `None` if it is not.
pub fn solve_positive_definite(rows: &[f64], rhs: &[f64]) -> Option<Vec<f64>> {
    let matrix = DMatrix::from_row_slice(rhs.len(), rhs.len(), rows);
    let solution = matrix.cholesky()?.solve(&DVector::from_column_slice(rhs));
    solution
        .iter()
        .all(|v| v.is_finite())
        .then(|| solution.iter().copied().collect())
}

/// The solution of a system of equations, and the logarithm of its matrix's determinant.
pub struct WithDeterminant {
    pub solution: Vec<f64>,
    pub log_determinant: f64,
}

/// [`solve_positive_definite`], and the logarithm of the matrix's determinant.
pub fn solve_with_determinant(rows: &[f64], rhs: &[f64]) -> Option<WithDeterminant> {
    let cholesky = DMatrix::from_row_slice(rhs.len(), rhs.len(), rows).cholesky()?;
    let solution = cholesky.solve(&DVector::from_column_slice(rhs));
    let log_determinant = 2.0 * cholesky.l_dirty().diagonal().iter().map(|d| d.ln()).sum::<f64>();
    let usable = log_determinant.is_finite() && solution.iter().all(|v| v.is_finite());
    usable.then(|| WithDeterminant {
        solution: solution.iter().copied().collect(),
        log_determinant,
    })
}

/// The eigenvalues of a symmetric matrix, and its eigenvectors one after the other.
pub struct Eigen {
    pub values: Vec<f64>,
    pub vectors: Vec<f64>,
}

/// The eigenvalues and eigenvectors of a symmetric row-major matrix of `n` rows; `None` if the iteration fails.
pub fn symmetric_eigen(rows: &[f64], n: usize) -> Option<Eigen> {
    if n == 0 || rows.iter().any(|v| !v.is_finite()) {
        return None;
    }
    let eigen = nalgebra::SymmetricEigen::try_new(DMatrix::from_row_slice(n, n, rows), f64::EPSILON, 10_000)?;
    Some(Eigen {
        values: eigen.eigenvalues.as_slice().to_vec(),
        vectors: eigen.eigenvectors.as_slice().to_vec(),
    })
}

/// The inverse of a symmetric positive definite row-major matrix of `n` rows; `None` if it is not.
pub fn inverse_positive_definite(rows: &[f64], n: usize) -> Option<Vec<f64>> {
    let inverse = DMatrix::from_row_slice(n, n, rows).cholesky()?.inverse();
    inverse
        .iter()
        .all(|v| v.is_finite())
        .then(|| inverse.as_slice().to_vec())
}

/// A factor F of $(J'J)^{-1} C'C (J'J)^{-1} = F F'$, row-major, for two matrices of equally many rows and of `columns` columns, given column by
/// column.
///
/// It follows from the triangular factor R of J: J'J would square the condition number, and the product of its inverse with C'C could have
/// negative variances. `None` if the columns are dependent to within rounding.
pub fn covariance_factor(j: &[Vec<f64>], c: &[Vec<f64>]) -> Option<Vec<f64>> {
    let (rows, columns) = (j.first()?.len(), j.len());
    if rows < columns {
        return None;
    }
    let norms: Vec<f64> = j.iter().map(|x| x.iter().map(|v| v * v).sum::<f64>().sqrt()).collect();
    let scaled = |m: &[Vec<f64>]| DMatrix::from_fn(rows, columns, |i, k| m[k][i] / norms[k]);
    let r = scaled(j).qr().r();
    let colour = scaled(c).qr().r();
    let largest = r.diagonal().amax();
    if !r.diagonal().iter().all(|d| d.abs() > DEPENDENT * largest) {
        return None;
    }
    // C R^-1 usually has no large condition number: the columns of both are alike.
    let whitened = r.tr_solve_upper_triangular(&colour.transpose())?.transpose().qr().r();
    let factor = r.solve_upper_triangular(&whitened.transpose())?;
    let entries: Vec<f64> = (0..columns * columns)
        .map(|k| factor[(k / columns, k % columns)] / norms[k / columns])
        .collect();
    entries.iter().all(|v| v.is_finite()).then_some(entries)
}

/// The symmetric Toeplitz matrix with this first column.
fn toeplitz(column: &[f64]) -> DMatrix<f64> {
    DMatrix::from_fn(column.len(), column.len(), |i, j| column[i.abs_diff(j)])
}

/// The solution of a system of equations, and the largest diagonal entry of its matrix's inverse.
pub struct WithInverse {
    pub solution: Vec<f64>,
    pub largest_diagonal: f64,
}

/// The solution of `T x = rhs` for the positive definite Toeplitz matrix with the first column `column`; `None` if it is not
/// positive definite.
pub fn solve_toeplitz(column: &[f64], rhs: &[f64]) -> Option<WithInverse> {
    let cholesky = toeplitz(column).cholesky()?;
    let solution = cholesky.solve(&DVector::from_column_slice(rhs));
    let largest_diagonal = cholesky.inverse().diagonal().max();
    solution.iter().all(|v| v.is_finite()).then(|| WithInverse {
        solution: solution.iter().copied().collect(),
        largest_diagonal,
    })
}

/// The upper triangular U with U'U the positive definite Toeplitz matrix of this first column, row-major;
/// `None` if it is not positive definite.
pub fn toeplitz_factor(column: &[f64]) -> Option<Vec<f64>> {
    let lower = toeplitz(column).cholesky()?.unpack();
    // Column-major L is row-major L'.
    Some(lower.as_slice().to_vec())
}

/// The unit vector x that maximises |x'Mx| / x'Tx, for a symmetric row-major M and the positive definite Toeplitz
/// matrix T with the first column `column`; `None` if T is not positive definite or the iteration fails.
pub fn dominant_relative_to_toeplitz(rows: &[f64], column: &[f64]) -> Option<Vec<f64>> {
    let n = column.len();
    let lower = toeplitz(column).cholesky()?.unpack();
    // L^-1 M L^-T, symmetric as M is.
    let half = lower.solve_lower_triangular(&DMatrix::from_row_slice(n, n, rows))?;
    let whitened = lower.solve_lower_triangular(&half.transpose())?;
    let eigen = nalgebra::SymmetricEigen::try_new(whitened, f64::EPSILON, 10_000)?;
    let largest = eigen.eigenvalues.iamax();
    let direction = lower.tr_solve_lower_triangular(&eigen.eigenvectors.column(largest))?;
    let size = direction.norm();
    (size > 0.0 && size.is_finite()).then(|| direction.iter().map(|v| v / size).collect())
}

/// The singular values of a row-major matrix, largest first. `None` if the decomposition fails.
pub fn singular_values(rows: &[f64], columns: usize) -> Option<Vec<f64>> {
    let matrix = DMatrix::from_row_slice(rows.len() / columns, columns, rows);
    let mut values: Vec<f64> = matrix
        .try_svd(false, false, f64::EPSILON, 1000)?
        .singular_values
        .iter()
        .copied()
        .collect();
    values.sort_unstable_by(f64::total_cmp);
    values.reverse();
    Some(values)
}

/// The roots of `c[0] z^n + c[1] z^(n-1) + ... + c[n]`; leading zeros are dropped.
///
/// Eigenvalues of the companion matrix. Empty for a constant; `None` if a coefficient is not finite
/// or the eigenvalue iteration fails.
pub fn roots(c: &[f64]) -> Option<Vec<Complex<f64>>> {
    if c.iter().any(|v| !v.is_finite()) {
        return None;
    }
    let largest = c.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let Some(first) = c.iter().position(|v| v.abs() > f64::EPSILON * 1e-3 * largest) else {
        return Some(Vec::new());
    };
    let last = c.iter().rposition(|&v| v != 0.0)?;
    let at_zero = c.len() - 1 - last;
    let c = &c[first..=last];
    let n = c.len() - 1;
    let mut all = vec![Complex::new(0.0, 0.0); at_zero];
    if n > 0 {
        let mut companion = DMatrix::zeros(n, n);
        for j in 0..n {
            companion[(0, j)] = -c[j + 1] / c[0];
        }
        for i in 1..n {
            companion[(i, i - 1)] = 1.0;
        }
        nalgebra::linalg::balancing::balance_parlett_reinsch(&mut companion);
        let schur = nalgebra::linalg::Schur::try_new(companion, f64::EPSILON, 10_000)?;
        all.extend(schur.complex_eigenvalues().iter().copied());
    }
    Some(all)
}

/// The monic real polynomial with these roots (conjugate pairs complete), highest power first.
pub fn polynomial(roots: &[Complex<f64>]) -> Vec<f64> {
    let mut c = vec![Complex::new(1.0, 0.0)];
    for root in roots {
        c.push(Complex::new(0.0, 0.0));
        for i in (1..c.len()).rev() {
            let previous = c[i - 1];
            c[i] -= root * previous;
        }
    }
    c.iter().map(|v| v.re).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_and_polynomial_are_inverse() {
        // (z - 0.5)(z^2 - 1.8 z + 0.95)
        let c = [1.0, -2.3, 1.85, -0.475];
        let back = polynomial(&roots(&c).unwrap());
        for (a, b) in c.iter().zip(&back) {
            assert!((a - b).abs() < 1e-12, "{back:?}");
        }
    }

    #[test]
    fn roots_at_zero_and_leading_zeros() {
        let r = roots(&[0.0, 2.0, -1.0, 0.0]).unwrap();
        assert_eq!(r.len(), 2);
        assert!(r.iter().any(|z| z.norm() == 0.0) && r.iter().any(|z| (z.re - 0.5).abs() < 1e-15));
        assert!(roots(&[3.0]).unwrap().is_empty());
        assert!(roots(&[f64::NAN, 1.0]).is_none());
    }

    /// Columns that are nearly dependent: the condition number is 1e9, and that of their inner products too large for rounding.
    #[test]
    fn the_covariance_of_nearly_dependent_columns() {
        let rows = 40;
        let x = |i: usize| i as f64 / rows as f64;
        let column = |f: &dyn Fn(f64) -> f64| -> Vec<f64> { (0..rows).map(|i| f(x(i))).collect() };
        let j = [
            column(&|_| 1.0),
            column(&f64::exp),
            column(&|x| 1.0 + x.exp() + 1e-9 * (7.0 * x).sin()),
        ];
        // With C = J, J F has orthonormal columns.
        let factor = covariance_factor(&j, &j).unwrap();
        let product = |k: usize| -> Vec<f64> {
            let entry = |i: usize| (0..3).map(|l| j[l][i] * factor[l * 3 + k]).sum();
            (0..rows).map(entry).collect()
        };
        for a in 0..3 {
            for b in 0..3 {
                let inner: f64 = product(a).iter().zip(product(b)).map(|(p, q)| p * q).sum();
                assert!((inner - f64::from(a == b)).abs() < 1e-5, "{a} {b}: {inner}");
            }
        }
        assert!(covariance_factor(&[j[0].clone(), j[0].clone()], &j[..2]).is_none());
    }

    /// The same as by inner products, for columns that are far from dependent.
    #[test]
    fn the_covariance_of_coloured_columns() {
        let column = |f: &dyn Fn(f64) -> f64| -> Vec<f64> { (0..30).map(|i| f(f64::from(i))).collect() };
        let j = [column(&|_| 1.0), column(&|i| i)];
        let c = [column(&|i| 1.0 + 0.3 * i.sin()), column(&|i| 2.0 * i - 1.0)];
        let inner = |a: &[Vec<f64>; 2]| -> Vec<f64> {
            let sum = |k: usize| a[k / 2].iter().zip(&a[k % 2]).map(|(p, q)| p * q).sum();
            (0..4).map(sum).collect()
        };
        let inverse = Matrix::from_row_slice(2, 2, &inverse_positive_definite(&inner(&j), 2).unwrap());
        let expected = &inverse * Matrix::from_row_slice(2, 2, &inner(&c)) * &inverse;
        let factor = Matrix::from_row_slice(2, 2, &covariance_factor(&j, &c).unwrap());
        let found = &factor * factor.transpose();
        assert!((found - &expected).amax() < 1e-12 * expected.amax());
    }

    #[test]
    fn least_squares_of_a_line() {
        let rows = [1.0, 0.0, 1.0, 1.0, 1.0, 2.0];
        let x = least_squares(&rows, 2, &[1.0, 3.0, 5.0]).unwrap();
        assert!((x[0] - 1.0).abs() < 1e-14 && (x[1] - 2.0).abs() < 1e-14);
    }
}
