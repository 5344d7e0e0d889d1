//! The inertia matrix by composite bodies (Featherstone 2008, tables 6.2 and 9.5).

use super::data::{ChainData, length};
use super::model::{Base, Chain};
use super::spatial::Spatial;
use crate::error::Result;
use crate::number::Number;

impl Chain {
    /// The inertia matrix M(q), by rows: [`Chain::velocities`] squared values, symmetric (kg m^2, kg m or kg).
    ///
    /// # Errors
    /// A vector of another length, or a quaternion of length zero.
    pub fn mass_matrix(&self, data: &mut ChainData, q: &[f64], matrix: &mut [f64]) -> Result<()> {
        self.inertias(data, q, matrix)
    }

    /// [`Chain::mass_matrix`] of one position, or of several in lanes.
    #[inline(always)]
    pub(super) fn inertias<T: Number>(&self, data: &mut ChainData<T>, q: &[T], matrix: &mut [T]) -> Result<()> {
        let (n, first) = (self.velocities(), self.first());
        length("matrix", matrix, n * n)?;
        self.place(data, q)?;
        let one = q[0].filled(1.0);
        matrix.fill(q[0].filled(0.0));
        data.base.composite = self.base_inertia.like(one);
        for (state, body) in data.bodies.iter_mut().zip(&self.bodies) {
            state.composite = body.inertia.like(one);
        }
        for (i, body) in self.bodies.iter().enumerate().rev() {
            let state = &data.bodies[i];
            let mut force = state.composite.times(body.motion(one));
            let composite = state.composite.in_parent(&state.placement);
            let total = match body.parent {
                Some(p) => &mut data.bodies[p],
                None => &mut data.base,
            };
            total.composite = total.composite.plus(&composite);

            let row = first + i;
            matrix[row * n + row] = body.along(force);
            let mut at = i;
            // Towards the base: what the motion of joint i asks of the joints that carry it.
            while let Some(carrier) = self.bodies[at].parent {
                force = data.bodies[at].placement.force_to_parent(force);
                at = carrier;
                let value = self.bodies[at].along(force);
                matrix[row * n + first + at] = value;
                matrix[(first + at) * n + row] = value;
            }
            if self.base == Base::Free {
                let force = data.bodies[at].placement.force_to_parent(force);
                for (k, value) in force.to_array().into_iter().enumerate() {
                    matrix[row * n + k] = value;
                    matrix[k * n + row] = value;
                }
            }
        }
        if self.base == Base::Free {
            for k in 0..6 {
                let mut unit = [q[0].filled(0.0); 6];
                unit[k] = one;
                let momentum = data.base.composite.times(Spatial::from_slice(&unit));
                for (j, value) in momentum.to_array().into_iter().enumerate() {
                    matrix[j * n + k] = value;
                }
            }
        }
        Ok(())
    }
}
