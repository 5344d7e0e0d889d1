//! A flexible arm near rest: the matrices of its small motions.

use super::FlexibleArm;
use crate::error::Result;
use crate::manipulator::chain::{LinearisedChain, check_rest};
use crate::vectors::dot;

impl FlexibleArm {
    /// The arm near rest at the position `q`, held there by its motors. Gravity's torques load the springs of flexible joints; beams and the
    /// springs of passive joints have the stiffness that they have at `q`, whether or not they hold gravity there.
    ///
    /// # Errors
    /// A vector of another length; [`Error::Parameter`](crate::Error::Parameter) for a free base under gravity, which falls, and where
    /// gravity's torque is more than a spring, as it softens, can hold.
    pub fn linearised(&self, q: &[f64]) -> Result<LinearisedChain> {
        self.check_position(q)?;
        check_rest(self.free_base(), &self.gravity)?;
        let (n, motors) = (self.coordinates, self.motors());
        let (all, rest) = (n + motors, vec![0.0; n]);
        let still = self.assemble(q, &rest, self.gravity);
        let mut mass = vec![0.0; all * all];
        for (row, values) in still.mass.chunks(n).enumerate() {
            mass[row * all..row * all + n].copy_from_slice(values);
        }
        let flexible = self.drives.iter().filter(|drive| drive.flexible);
        (flexible.enumerate()).for_each(|(k, drive)| mass[(n + k) * (all + 1)] = drive.motor);
        let first = self.joints.first().map_or("", |joint| joint.name.as_str());
        let mut linearised = LinearisedChain::of(mass, n, self.first(), first);
        self.add_gravity(q, &mut linearised);
        for link in &self.links {
            let Some(beam) = &link.beam else { continue };
            for (i, row) in beam.stiffness.chunks(beam.coordinates()).enumerate() {
                for (j, value) in row.iter().enumerate() {
                    let at = (link.first + i) * all + link.first + j;
                    linearised.stiffness[at] += value;
                    linearised.damping[at] += beam.damping_time * value;
                }
                linearised.release(link.first + i);
            }
        }
        let mut motor = n;
        for (joint, drive) in self.joints.iter().zip(&self.drives) {
            if drive.flexible {
                let spring = drive.loaded(still.bias[joint.at], &joint.name)?;
                linearised.add_spring(joint.at, Some(motor), spring);
                motor += 1;
            } else if drive.passive {
                linearised.add_spring(joint.at, None, drive.tangent(-q[joint.at]));
            }
        }
        Ok(linearised)
    }

    /// The second derivatives of gravity's energy, from those along all pairs of coordinates.
    fn add_gravity(&self, q: &[f64], linearised: &mut LinearisedChain) {
        if self.gravity == [0.0; 2] {
            return;
        }
        let n = q.len();
        let along = |i: usize, j: usize| {
            let mut v = vec![0.0; n];
            v[i] += 0.5;
            v[j] += 0.5;
            -dot(&self.gravity, &self.curved_mass(q, &v))
        };
        let single: Vec<f64> = (0..n).map(|i| along(i, i)).collect();
        for i in 0..n {
            for j in 0..n {
                let mixed = 2.0 * along(i, j) - 0.5 * (single[i] + single[j]);
                linearised.stiffness[i * linearised.dimension + j] += mixed;
            }
        }
    }
}
