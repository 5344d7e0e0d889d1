//! Symmetric positive definite matrices with three diagonals on either side of the main one.

/// The number of entries kept of each row: the main diagonal and three to its right.
pub(crate) const WIDTH: usize = 4;

/// A symmetric matrix: `rows[i][k]` is the entry (i, i + k).
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Banded {
    pub rows: Vec<[f64; WIDTH]>,
}

impl Banded {
    pub fn zeros(n: usize) -> Banded {
        Banded {
            rows: vec![[0.0; WIDTH]; n],
        }
    }

    /// `self + factor * other`
    pub fn plus(&self, factor: f64, other: &Banded) -> Banded {
        let rows = self.rows.iter().zip(&other.rows);
        Banded {
            rows: rows
                .map(|(a, b)| std::array::from_fn(|k| a[k] + factor * b[k]))
                .collect(),
        }
    }

    /// Adds w v v' at the rows and columns from `at` on.
    pub fn add_products(&mut self, at: usize, v: &[f64], w: f64) {
        for i in 0..v.len() {
            for k in 0..v.len() - i {
                self.rows[at + i][k] += w * v[i] * v[i + k];
            }
        }
    }

    /// U'D U with unit upper triangular U; `None` if not safely positive definite.
    pub fn factor(self) -> Option<Factor> {
        let mut rows = self.rows;
        for i in 0..rows.len() {
            let [pivot, ..] = rows[i];
            if !(pivot > 0.0 && pivot.is_finite()) {
                return None;
            }
            let row = rows[i];
            for k in 1..WIDTH.min(rows.len() - i) {
                let share = row[k] / pivot;
                let diagonal = rows[i + k][0];
                for j in k..WIDTH {
                    if i + j < rows.len() {
                        rows[i + k][j - k] -= share * row[j];
                    }
                }
                // The rest of a diagonal entry must exceed its rounding.
                if !(rows[i + k][0] > SINGULAR * diagonal) {
                    return None;
                }
                rows[i][k] = share;
            }
        }
        Some(Factor { rows })
    }
}

/// If elimination leaves at most this share of a diagonal entry, the rest counts as zero.
const SINGULAR: f64 = 1e-14;

/// `rows[i]` holds D's entry, then the three of U to the right of the diagonal.
pub(crate) struct Factor {
    rows: Vec<[f64; WIDTH]>,
}

impl Factor {
    /// The solution of the linear system with this right-hand side.
    pub fn solve(&self, mut b: Vec<f64>) -> Vec<f64> {
        let n = self.rows.len();
        for i in 0..n {
            for k in 1..WIDTH.min(n - i) {
                b[i + k] -= self.rows[i][k] * b[i];
            }
        }
        for i in (0..n).rev() {
            b[i] /= self.rows[i][0];
            for k in 1..WIDTH.min(n - i) {
                b[i] -= self.rows[i][k] * b[i + k];
            }
        }
        b
    }

    /// The entries of the inverse within the band (Takahashi, Fagan, Chin 1973; for splines: Hutchinson and
    /// de Hoog 1985).
    pub fn inverse_band(&self) -> Banded {
        let n = self.rows.len();
        let mut inverse = Banded::zeros(n);
        for i in (0..n).rev() {
            let reach = WIDTH.min(n - i);
            for j in (0..reach).rev() {
                let mut sum = if j == 0 { 1.0 / self.rows[i][0] } else { 0.0 };
                for k in 1..reach {
                    let (row, column) = (i + k.min(j), i + k.max(j));
                    sum -= self.rows[i][k] * inverse.rows[row][column - row];
                }
                inverse.rows[i][j] = sum;
            }
        }
        inverse
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example(n: usize) -> Banded {
        let mut a = Banded::zeros(n);
        for i in 0..n.saturating_sub(3) {
            let v = [1.0, -0.5 + 0.1 * i as f64, 0.3, 0.2 * (i as f64).sin()];
            a.add_products(i, &v, 1.0 + i as f64);
        }
        for i in 0..n {
            a.rows[i][0] += 0.1;
        }
        a
    }

    fn entry(a: &Banded, i: usize, j: usize) -> f64 {
        let (low, high) = (i.min(j), i.max(j));
        if high - low < WIDTH {
            a.rows[low][high - low]
        } else {
            0.0
        }
    }

    #[test]
    fn solutions_solve_and_the_inverse_band_is_the_inverses() {
        for n in [1, 2, 3, 4, 5, 12] {
            let a = example(n);
            let factor = a.clone().factor().unwrap();
            let band = factor.inverse_band();
            for j in 0..n {
                let mut unit = vec![0.0; n];
                unit[j] = 1.0;
                let column = factor.solve(unit.clone());
                for i in 0..n {
                    let product: f64 = (0..n).map(|k| entry(&a, i, k) * column[k]).sum();
                    assert!((product - unit[i]).abs() < 1e-11, "{n} {i} {j}");
                    if i.abs_diff(j) < WIDTH {
                        assert!((entry(&band, i, j) - column[i]).abs() < 1e-11, "{n} {i} {j}");
                    }
                }
            }
        }
    }

    #[test]
    fn an_indefinite_matrix_has_no_factor() {
        let mut a = example(6);
        a.rows[3][0] = -1.0;
        assert!(a.factor().is_none());
        assert!(Banded::zeros(3).factor().is_none());
    }
}
