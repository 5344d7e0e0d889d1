//! The linear systems of a Newton iteration of [`Radau`](super::radau::Radau).

use super::radau_tableau::{PAIRS, REAL, STAGES};
use crate::linalg::{Complex, Factors, Matrix, Scalar};

/// A vector for each stage.
pub(super) type Stages = [Vec<f64>; STAGES];

/// The factors of the matrices for a step size.
pub(super) struct StepFactors {
    pub h: f64,
    jacobian: Matrix,
    split: Split,
    real: Shifted<f64>,
    pairs: [Shifted<Complex<f64>>; 3],
}

/// The components whose derivatives are other components, as those of positions are rates; and all others.
struct Split {
    /// The component, and the one that is its derivative.
    integrals: Vec<(usize, usize)>,
    others: Vec<usize>,
}

impl Split {
    fn of(jacobian: &Matrix) -> Self {
        let n = jacobian.nrows();
        let integrand = |i: usize| {
            let mut entries = (0..n).filter(|&j| jacobian[(i, j)] != 0.0);
            let first = entries.next().filter(|&j| j != i && jacobian[(i, j)] == 1.0)?;
            entries.next().is_none().then_some(first)
        };
        let integrands: Vec<Option<usize>> = (0..n).map(integrand).collect();
        // The integral of an integral stays: one elimination is enough for mechanics.
        let integral = |i: &usize| integrands[*i].filter(|&j| integrands[j].is_none());
        let integrals: Vec<(usize, usize)> = (0..n).filter_map(|i| Some((i, integral(&i)?))).collect();
        let others = (0..n).filter(|i| integral(i).is_none()).collect();
        Split { integrals, others }
    }
}

/// The factors of `shift I - J` without the integrals.
///
/// From \\(s x_i - x_j = r_i\\) follows \\(x_i = (x_j + r_i) / s\\), which leaves a matrix of half the size, at an eighth of the cost.
struct Shifted<T: Scalar> {
    shift: T,
    factors: Factors<T>,
}

impl<T: Scalar> Shifted<T> {
    fn new(shift: T, jacobian: &Matrix, split: &Split) -> Self {
        let inverse = T::from_real(1.0) / shift;
        let mut matrix = Factors::unfinished(split.others.len(), |i, j| {
            let entry = T::from_real(-jacobian[(split.others[i], split.others[j])]);
            if i == j { entry + shift } else { entry }
        });
        for &(integral, of) in &split.integrals {
            let Ok(column) = split.others.binary_search(&of) else {
                continue;
            };
            for (row, &i) in split.others.iter().enumerate() {
                matrix[(row, column)] -= inverse * T::from_real(jacobian[(i, integral)]);
            }
        }
        Shifted {
            shift,
            factors: Factors::of(matrix),
        }
    }

    /// Replaces a right-hand side by the solution; `false` if the matrix is singular.
    fn solve(&self, jacobian: &Matrix, split: &Split, rhs: &mut [T]) -> bool {
        let inverse = T::from_real(1.0) / self.shift;
        let mut others: Vec<T> = split.others.iter().map(|&i| rhs[i]).collect();
        for &(integral, _) in &split.integrals {
            let share = inverse * rhs[integral];
            for (other, &i) in others.iter_mut().zip(&split.others) {
                *other += T::from_real(jacobian[(i, integral)]) * share;
            }
        }
        let solvable = self.factors.solve(&mut others);
        split.others.iter().zip(others).for_each(|(&i, other)| rhs[i] = other);
        for &(integral, of) in &split.integrals {
            rhs[integral] = (rhs[of] + rhs[integral]) * inverse;
        }
        solvable
    }
}

impl StepFactors {
    pub fn new(h: f64, jacobian: &Matrix) -> Self {
        let split = Split::of(jacobian);
        StepFactors {
            h,
            real: Shifted::new(REAL / h, jacobian, &split),
            pairs: PAIRS.map(|[re, im]| Shifted::new(Complex::new(re, -im) / h, jacobian, &split)),
            jacobian: jacobian.clone(),
            split,
        }
    }

    /// What the factors cost, in evaluations of a chain of links, whose cost grows with the state. Measured with seven flexible joints, 14
    /// components left of 28: 38 us and 1.3 us.
    pub fn cost(&self) -> f64 {
        0.3 * (self.split.others.len() as f64).powi(3) / self.jacobian.nrows() as f64
    }

    /// Solves the real system; `None` where its matrix is singular.
    pub fn filtered(&self, mut rhs: Vec<f64>) -> Option<Vec<f64>> {
        self.real.solve(&self.jacobian, &self.split, &mut rhs).then_some(rhs)
    }

    /// The change of the modes `w` of the increments where the modes of the derivatives are `f`; `None` where a matrix is singular.
    pub fn change(&self, h: f64, f: &Stages, w: &Stages) -> Option<Stages> {
        let mut change: Stages = Default::default();
        change[0] = self.filtered((f[0].iter().zip(&w[0])).map(|(f, w)| f - REAL / h * w).collect())?;
        for (k, (factors, [re, im])) in self.pairs.iter().zip(PAIRS).enumerate() {
            let (first, shift) = (2 * k + 1, Complex::new(re, -im) / h);
            let pair = |of: &Stages, i: usize| Complex::new(of[first][i], of[first + 1][i]);
            let mut both: Vec<Complex<f64>> = (0..f[0].len()).map(|i| pair(f, i) - shift * pair(w, i)).collect();
            if !factors.solve(&self.jacobian, &self.split, &mut both) {
                return None;
            }
            change[first] = both.iter().map(|value| value.re).collect();
            change[first + 1] = both.iter().map(|value| value.im).collect();
        }
        Some(change)
    }
}
