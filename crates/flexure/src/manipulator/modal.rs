//! Modal frequencies of the linearised arm.
//!
//! At rest and without friction, (7)-(8) linearise about a configuration to
//! \\(\mathcal M \delta'' + \mathcal K \delta = 0\\). In the coordinates \\((q, d)\\) the stiffness
//! acts on `d` alone; eliminating `q`, whose modes are those of the free rigid arm, leaves the
//! small generalised eigenproblem
//!
//! \\[K v = \omega^2 \left[J_m - (S + J_m)^T (M + S + S^T + J_m)^{-1} (S + J_m)\right] v\\]
//!
//! with \\(K = \mathrm{diag}\, \kappa'(d_i)\\).

use super::arm::Arm;
use super::parameters::JointKind;

impl Arm {
    /// The circular frequencies in rad/s, increasing, of the small free vibrations without friction
    /// about rest at the elbow angle `q2` with the deflections `d`.
    ///
    /// There is one for each joint that is flexible and free, and none for a rigid arm. NaN if the stiffness is negative.
    pub fn modal_frequencies(&self, q2: f64, d: [f64; 2]) -> Vec<f64> {
        if self.model() == JointKind::Rigid {
            return Vec::new();
        }
        let [first, second] = self.stiffness();
        let k = [first.tangent(d[0]), second.tangent(d[1])];
        let [j1, j2] = self.coefficients.motor;
        let m = self.link_dynamics().inertia(q2);
        match self.free() {
            [false, false] => Vec::new(),
            [true, false] => vec![(k[0] * (1.0 / j1 + 1.0 / m[0][0])).sqrt()],
            [false, true] => vec![(k[1] * (1.0 / j2 + 1.0 / m[1][1])).sqrt()],
            [true, true] => {
                let s = self.coefficients.coupling;
                // a = M + S + S^T + Jm; b = S + Jm = [j1 s; 0 j2].
                let (a11, a12, a22) = (m[0][0] + j1, m[0][1] + s, m[1][1] + j2);
                let determinant = a11 * a22 - a12 * a12;
                // e = Jm - b^T a^-1 b
                let e11 = j1 - j1 * a22 * j1 / determinant;
                let e12 = -(j1 * a22 * s - j1 * a12 * j2) / determinant;
                let e22 = j2 - (s * a22 * s - 2.0 * s * a12 * j2 + j2 * a11 * j2) / determinant;
                // det(K - w e) = 0, both roots without cancellation.
                let (square, middle, last) = (e11 * e22 - e12 * e12, k[0] * e22 + k[1] * e11, k[0] * k[1]);
                let root = ((k[0] * e22 - k[1] * e11).powi(2) + 4.0 * last * e12 * e12).sqrt();
                let largest = 0.5 * (middle + root);
                vec![(last / largest).sqrt(), (largest / square).sqrt()]
            }
        }
    }
}
