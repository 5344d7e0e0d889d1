//! How a filter carries its state and covariance through the equations of motion.

use super::matrix::{Matrix8, cholesky, identity, product, product_transposed};
use crate::manipulator::Arm;

/// A state and its covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gaussian {
    pub x: [f64; 8],
    pub p: Matrix8,
}

/// One step of the classical Runge-Kutta method of order 4.
#[inline]
pub fn moved(arm: &Arm, x: &[f64; 8], torque: [f64; 2], h: f64) -> [f64; 8] {
    let along = |k: &[f64; 8], s: f64| -> [f64; 8] { std::array::from_fn(|i| x[i] + s * k[i]) };
    let k1 = arm.derivative(x, torque);
    let k2 = arm.derivative(&along(&k1, 0.5 * h), torque);
    let k3 = arm.derivative(&along(&k2, 0.5 * h), torque);
    let k4 = arm.derivative(&along(&k3, h), torque);
    std::array::from_fn(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]))
}

/// Steps of the differences that linearise the equations of motion.
const STEP: f64 = 1e-6;

/// The linearisation at the middle of a step, and its exponential to the fourth order.
///
/// The upper half of `A` has the rows of the velocities. In the lower half, the shoulder's angle has no column, and a deflection gives two
/// columns of opposite sign, except for the effect of the elbow angle on the inertia.
fn transition(arm: &Arm, middle: &[f64; 8], torque: [f64; 2], h: f64) -> (Matrix8, [[f64; 2]; 8]) {
    let base = arm.derivative(middle, torque);
    let mut a = [[0.0; 8]; 8];
    for i in 0..4 {
        a[i][4 + i] = 1.0;
    }
    let mut column = |j: usize| {
        let mut x = *middle;
        x[j] += STEP;
        let ahead = arm.derivative(&x, torque);
        for i in 4..8 {
            a[i][j] = (ahead[i] - base[i]) / STEP;
        }
    };
    for j in [1, 2, 3, 4, 5, 6, 7] {
        column(j);
    }
    for i in 4..8 {
        a[i][0] = -a[i][2];
    }
    // B: the torques enter linearly.
    let mut b = [[0.0; 2]; 8];
    for j in 0..2 {
        let mut more = torque;
        more[j] += 1.0;
        let ahead = arm.derivative(middle, more);
        for i in 4..8 {
            b[i][j] = ahead[i] - base[i];
        }
    }
    // F = I + h A (I + h A/2 (I + h A/3 (I + h A/4))), and the integral of F times B.
    let mut inner = identity();
    for order in [4.0, 3.0, 2.0] {
        let mut next = product(&a, &inner);
        for i in 0..8 {
            for j in 0..8 {
                next[i][j] *= h / order;
            }
            next[i][i] += 1.0;
        }
        inner = next;
    }
    let mut f = product(&a, &inner);
    for i in 0..8 {
        for j in 0..8 {
            f[i][j] *= h;
        }
        f[i][i] += 1.0;
    }
    let held = std::array::from_fn(|i| std::array::from_fn(|j| h * (0..8).map(|k| inner[i][k] * b[k][j]).sum::<f64>()));
    (f, held)
}

/// Adds the noise of the torques, of this standard deviation, and a drift of each velocity to a covariance.
fn add_noise(p: &mut Matrix8, held: &[[f64; 2]; 8], torque: f64, drift: f64, h: f64) {
    let variance = torque * torque;
    for i in 0..8 {
        for j in 0..8 {
            p[i][j] += variance * (held[i][0] * held[j][0] + held[i][1] * held[j][1]);
        }
        if i >= 4 {
            p[i][i] += drift * drift * h;
        }
    }
}

/// The extended filter's prediction.
pub fn extended(arm: &Arm, before: &Gaussian, torque: [f64; 2], h: f64, noise: [f64; 2]) -> Gaussian {
    let x = moved(arm, &before.x, torque, h);
    let middle: [f64; 8] = std::array::from_fn(|i| 0.5 * (x[i] + before.x[i]));
    let (f, held) = transition(arm, &middle, torque, h);
    let mut p = product_transposed(&product(&f, &before.p), &f);
    add_noise(&mut p, &held, noise[0], noise[1], h);
    Gaussian { x, p }
}

/// The unscented filter's prediction through the sixteen points at \\(x \pm \sqrt{8}\, L_i\\), all of the same weight.
///
/// `None` if the covariance is not positive definite.
pub fn unscented(arm: &Arm, before: &Gaussian, torque: [f64; 2], h: f64, noise: [f64; 2]) -> Option<Gaussian> {
    let l = cholesky(&before.p)?;
    let scale = 8.0_f64.sqrt();
    let mut points = [[0.0; 8]; 16];
    let mut x = [0.0; 8];
    for k in 0..16 {
        let sign = if k < 8 { scale } else { -scale };
        let start: [f64; 8] = std::array::from_fn(|i| before.x[i] + sign * l[i][k % 8]);
        points[k] = moved(arm, &start, torque, h);
        for i in 0..8 {
            x[i] += points[k][i] / 16.0;
        }
    }
    let mut p = [[0.0; 8]; 8];
    for point in &points {
        let e: [f64; 8] = std::array::from_fn(|i| point[i] - x[i]);
        for i in 0..8 {
            for j in 0..8 {
                p[i][j] += e[i] * e[j] / 16.0;
            }
        }
    }
    let more = [0, 1].map(|j| {
        let mut more = torque;
        more[j] += 1.0;
        moved(arm, &before.x, more, h)
    });
    let base = moved(arm, &before.x, torque, h);
    let held = std::array::from_fn(|i| std::array::from_fn(|j| more[j][i] - base[i]));
    add_noise(&mut p, &held, noise[0], noise[1], h);
    Some(Gaussian { x, p })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::manipulator::{JointKind, space_arm};

    fn start() -> Gaussian {
        let mut p = identity();
        for i in 0..8 {
            p[i][i] = 1e-8 * (1.0 + i as f64);
        }
        Gaussian {
            x: [0.3, 1.0, 0.32, 0.97, 0.4, -0.3, 0.35, -0.2],
            p,
        }
    }

    /// Both predictions are that of the flow's derivative, by differences of the flow itself.
    #[test]
    fn predictions_carry_a_small_covariance_through_the_flow() {
        let arm = Arm::new(space_arm(JointKind::Nonlinear)).unwrap();
        let (before, torque, h) = (start(), [3.0, -2.0], 0.01);
        // The derivative by a state (0 to 7) or a torque (8 and 9).
        let difference = |by: usize, d: f64| -> [f64; 8] {
            let at = |d: f64| {
                let (mut x, mut torque) = (before.x, torque);
                match by {
                    0..8 => x[by] += d,
                    _ => torque[by - 8] += d,
                }
                moved(&arm, &x, torque, h)
            };
            let (ahead, behind) = (at(d), at(-d));
            std::array::from_fn(|i| (ahead[i] - behind[i]) / (2.0 * d))
        };
        let columns: Vec<[f64; 8]> = (0..8).map(|j| difference(j, 1e-6)).collect();
        let held: Vec<[f64; 8]> = (8..10).map(|j| difference(j, 1e-3)).collect();
        let mut expected = [[0.0; 8]; 8];
        for i in 0..8 {
            for j in 0..8 {
                expected[i][j] = (0..8)
                    .map(|k| columns[k][i] * before.p[k][k] * columns[k][j])
                    .sum::<f64>();
                expected[i][j] += 1e-4 * (0..2).map(|k| held[k][i] * held[k][j]).sum::<f64>();
            }
            if i >= 4 {
                expected[i][i] += 1e-10;
            }
        }
        let noise = [1e-2, 1e-4];
        let both = [
            extended(&arm, &before, torque, h, noise),
            unscented(&arm, &before, torque, h, noise).unwrap(),
        ];
        for got in both {
            for i in 0..8 {
                for j in 0..8 {
                    let scale = (expected[i][i] * expected[j][j]).sqrt();
                    assert!((got.p[i][j] - expected[i][j]).abs() < 3e-3 * scale, "{i} {j}");
                }
            }
        }
    }
}
