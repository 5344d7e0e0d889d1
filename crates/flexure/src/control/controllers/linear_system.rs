//! Any linear system as a controller, in discrete time at the loop's sample time.
//!
//! $$ x_{k+1} = A x_k + B u_k, \qquad \tau_k = C x_k + D u_k + \tau_{d,k} $$
//!
//! Its inputs are the errors of both motors' angles; a system of four inputs then has the errors of their velocities. With a model, the
//! reference is the motion of the model's motors, and its torque \\(\tau_d\\) is added.

use super::super::linearised::sampled;
use super::super::{Controller, Measured};
use super::feedforward::wanted;
use crate::error::{Error, Result};
use crate::linalg::{Matrix, Vector};
use crate::manipulator::Arm;

/// A linear system as a controller.
#[derive(Debug, Clone)]
pub struct LinearSystem {
    model: Option<Arm>,
    matrices: [Matrix; 4],
    x: Vector,
}

impl LinearSystem {
    /// From row-major A (n by n), B (n by m), C (2 by n) and D (2 by m), m being 2 or 4.
    ///
    /// # Errors
    /// [`Error::Parameter`] for matrices of other sizes or with elements that are not finite.
    pub fn new(model: Option<Arm>, a: &[f64], b: &[f64], c: &[f64], d: &[f64]) -> Result<Self> {
        let n = c.len() / 2;
        let m = d.len() / 2;
        if !(d.len() == 4 || d.len() == 8) {
            return Err(Error::parameter(
                "the number of elements of D",
                d.len() as f64,
                "2 by 2, or 2 by 4 with velocities",
            ));
        }
        if c.len() != 2 * n || a.len() != n * n || b.len() != n * m {
            return Err(Error::parameter(
                "the number of elements of A",
                a.len() as f64,
                "n by n, with B n by m and C 2 by n",
            ));
        }
        if let Some(&v) = [a, b, c, d].iter().flat_map(|m| m.iter()).find(|v| !v.is_finite()) {
            return Err(Error::parameter("an element of A, B, C or D", v, "finite"));
        }
        Ok(LinearSystem {
            model,
            matrices: [
                Matrix::from_row_slice(n, n, a),
                Matrix::from_row_slice(n, m, b),
                Matrix::from_row_slice(2, n, c),
                Matrix::from_row_slice(2, m, d),
            ],
            x: Vector::zeros(n),
        })
    }

    /// The system of these matrices in continuous time, with its inputs held over `step` s.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a system that grows beyond all numbers within a step.
    pub fn sampled(self, step: f64) -> Result<Self> {
        let [a, b, c, d] = self.matrices;
        let (a, b) = sampled(&a, &b, step);
        match a.iter().chain(b.iter()).find(|v| !v.is_finite()) {
            Some(&v) => Err(Error::parameter("an element of the sampled A or B", v, "finite")),
            None => Ok(LinearSystem {
                matrices: [a, b, c, d],
                ..self
            }),
        }
    }
}

impl Controller for LinearSystem {
    fn torque(&mut self, measured: &Measured) -> [f64; 2] {
        let (qm, held) = match &self.model {
            Some(model) => {
                let [now, held] = wanted(model, measured);
                (now.qm, held.torque)
            }
            None => (measured.reference, [0.0; 2]),
        };
        let state = &measured.state;
        let [a, b, c, d] = &self.matrices;
        let u = Vector::from_fn(d.ncols(), |i, _| match i < 2 {
            true => qm[i].value() - state.qm[i],
            false => qm[i - 2].derivative(1) - state.dqm[i - 2],
        });
        let torque = c * &self.x + d * &u;
        self.x = a * &self.x + b * u;
        [torque[0] + held[0], torque[1] + held[1]]
    }

    fn reset(&mut self) {
        self.x.fill(0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// scripts/reference/arm_control.py: SciPy's `cont2discrete`.
    #[test]
    fn a_sampled_system_is_that_of_scipy() {
        let a = [0.0, 1.0, 0.0, -4.0, -0.4, 2.0, 0.0, 0.0, -3.0];
        let b = [0.0, 0.0, 1.0, 0.5, 0.0, 2.0];
        let system = LinearSystem::new(None, &a, &b, &[0.0; 6], &[0.0; 4]).unwrap();
        let [a, b, ..] = system.sampled(0.1).unwrap().matrices;
        let expected_a = [
            [
                0.980_329_544_459_963_3,
                0.097_374_215_922_855_36,
                0.008_917_173_557_681_455,
            ],
            [
                -0.389_496_863_691_421_45,
                0.941_379_858_090_821_3,
                0.167_996_911_172_666_38,
            ],
            [0.0, 0.0, 0.740_818_220_681_717_8],
        ];
        let expected_b = [
            [0.004_917_613_885_009_153, 0.003_070_843_084_062_476_8],
            [0.097_374_215_922_855_38, 0.066_521_455_076_790_61],
            [0.0, 0.172_787_852_878_854_8],
        ];
        for i in 0..3 {
            (0..3).for_each(|j| assert!((a[(i, j)] - expected_a[i][j]).abs() < 1e-10, "{i} {j}"));
            (0..2).for_each(|j| assert!((b[(i, j)] - expected_b[i][j]).abs() < 1e-10, "{i} {j}"));
        }
    }
}
