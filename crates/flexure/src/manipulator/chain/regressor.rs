//! The inertial regressor: torques are linear in the links' inertias (Atkeson, An & Hollerbach 1986; Khalil & Dombre 2002, chapter 12).

use super::data::{ChainData, length};
use super::model::{Base, Chain};
use super::spatial::{Inertia, Spatial};
use super::vector::{Mat3, Vec3};
use crate::error::Result;

/// The inertial parameters of a body.
pub const INERTIAL_PARAMETERS: usize = 10;

const AXES: [Vec3; 3] = [Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.0), Vec3::Z];
/// Rows and columns of the second moments, in the order of the parameters.
const MOMENTS: [(usize, usize); 6] = [(0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2)];

impl Chain {
    /// The inertial parameters, 10 a body: mass (kg), first moments `m c` (kg m) and second moments about the frame's origin
    /// `[xx, xy, yy, xz, yz, zz]` (kg m^2), in the axes of the link that the body's joint carries, with what is fixed to it. A free base
    /// comes first. [`Chain::regressor`] times these are the torques of [`Chain::inverse_dynamics`].
    pub fn inertial_parameters(&self) -> Vec<f64> {
        let base = (self.base == Base::Free).then(|| parameters(&self.base_inertia));
        let bodies = self.bodies.iter().map(|body| parameters(&body.inertia_in_link()));
        base.into_iter().chain(bodies).flatten().collect()
    }

    /// The matrix by which the [inertial parameters](Chain::inertial_parameters) give the torques that accelerate the chain by `a`: by rows,
    /// [`Chain::velocities`] of them, with 10 columns a body.
    ///
    /// The order of the parameters is that of Pinocchio.
    ///
    /// # Errors
    /// A vector of another length, or a quaternion of length zero.
    pub fn regressor(&self, data: &mut ChainData, q: &[f64], v: &[f64], a: &[f64], matrix: &mut [f64]) -> Result<()> {
        let first = self.first();
        let of_base = if first > 0 { INERTIAL_PARAMETERS } else { 0 };
        let columns = of_base + INERTIAL_PARAMETERS * self.bodies.len();
        length("matrix", matrix, columns * self.velocities())?;
        let (v0, a0) = self.move_outward(data, q, v, a)?;
        matrix.fill(0.0);
        if self.base == Base::Free {
            for (k, force) in columns_of(v0, a0).into_iter().enumerate() {
                for (row, value) in force.to_array().into_iter().enumerate() {
                    matrix[row * columns + k] = value;
                }
            }
        }
        for (i, body) in self.bodies.iter().enumerate() {
            let state = &data.bodies[i];
            let at = of_base + INERTIAL_PARAMETERS * i;
            let [v, a] = [state.velocity, state.acceleration].map(|m| m.turned(&body.turn));
            for (k, force) in columns_of(v, a).into_iter().enumerate() {
                let mut force = force.turned(&body.turn.transpose());
                // Towards the base: what the body asks of every joint that carries it.
                let mut carrier = Some(i);
                while let Some(joint) = carrier {
                    let body = &self.bodies[joint];
                    matrix[(first + joint) * columns + at + k] = body.along(force);
                    force = data.bodies[joint].placement.force_to_parent(force);
                    carrier = body.parent;
                }
                if self.base == Base::Free {
                    for (row, value) in force.to_array().into_iter().enumerate() {
                        matrix[row * columns + at + k] = value;
                    }
                }
            }
        }
        Ok(())
    }
}

fn parameters(inertia: &Inertia) -> [f64; INERTIAL_PARAMETERS] {
    let [x, y, z] = inertia.first.to_array();
    let Mat3 { x: cx, y: cy, z: cz } = inertia.second;
    let columns = [cx, cy, cz].map(Vec3::to_array);
    let [xx, xy, yy, xz, yz, zz] = MOMENTS.map(|(i, j)| columns[j][i]);
    [inertia.mass, x, y, z, xx, xy, yy, xz, yz, zz]
}

/// What each of a body's parameters, being one, adds to the force on it: `I a + v x* I v` by mass, first and second moments.
fn columns_of(v: Spatial, a: Spatial) -> [Spatial; INERTIAL_PARAMETERS] {
    let (w, dw) = (v.angular, a.angular);
    // The acceleration of the frame's origin.
    let origin = a.linear + w.cross(v.linear);
    let mut columns = [Spatial::ZERO; INERTIAL_PARAMETERS];
    columns[0].linear = origin;
    for (axis, column) in AXES.into_iter().zip(&mut columns[1..4]) {
        column.linear = dw.cross(axis) + w.cross(w.cross(axis));
        column.angular = axis.cross(origin);
    }
    for ((i, j), column) in MOMENTS.into_iter().zip(&mut columns[4..]) {
        let times = |u: Vec3| {
            let both = AXES[i] * u.dot(AXES[j]);
            if i == j { both } else { both + AXES[j] * u.dot(AXES[i]) }
        };
        column.angular = times(dw) + w.cross(times(w));
    }
    columns
}
