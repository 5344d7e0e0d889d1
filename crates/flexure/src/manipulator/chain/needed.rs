//! What the motors of a chain do for a given motion of its links.
//!
//! The torque that a link needs beside the friction at its joint, by Newton and Euler's recursion, is that of the motor of a rigid joint. Of a
//! flexible joint it is the elastic torque: the spring's law gives the deflection, and the motor's own equation its torque. So the links' motion
//! determines everything without an integration (De Luca & Book, *Robots with Flexible Elements*, Springer Handbook of Robotics).

use super::drive::Drive;
use super::drives::DrivenChain;
use super::model::Base;
use crate::error::{ArmError, Error, Result};
use crate::manipulator::Stiffness;
use crate::record::check_values;

/// The sampled motion of a joint.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct JointPath {
    /// rad (m).
    pub position: Vec<f64>,
    /// rad/s (m/s).
    pub velocity: Vec<f64>,
    /// rad/s^2 (m/s^2).
    pub acceleration: Vec<f64>,
}

/// What the motor of a joint does, one value a sample.
#[derive(Debug, Clone, PartialEq)]
pub struct NeededDrive {
    /// The motor's position seen from the link's side, rad (m); `None` for a rigid joint.
    pub motor: Option<Vec<f64>>,
    /// The motor's torque, N m (N).
    pub torque: Vec<f64>,
}

impl DrivenChain {
    /// What every motor does while the links move along these paths, one a joint, `sample_time` s apart. The base does not move.
    ///
    /// The motors' velocities and accelerations are central differences of the deflections, so samples are to be close.
    ///
    /// # Errors
    /// [`Error::Data`] for paths that are not those of all joints, not equally long, or not finite; [`Error::Arm`] for a free base, a passive joint,
    /// and rotors that act on their carriers; [`Error::Parameter`] for a torque that a softening spring cannot hold.
    ///
    /// ```
    /// use flexure::manipulator::chain::{Chain, ChainPreset, DrivenChain, JointPath, RotorCoupling};
    ///
    /// let arm = Chain::new(&ChainPreset::SixJointArm.parameters())?;
    /// let arm = DrivenChain::new(arm, &[], RotorCoupling::None)?;
    /// let rest = JointPath { position: vec![0.0; 10], velocity: vec![0.0; 10], acceleration: vec![0.0; 10] };
    /// let needed = arm.needed_drives(&vec![rest; 6], 0.01)?;
    /// // The shoulder holds the arm.
    /// assert!(needed[1].torque[5].abs() > 10.0 && needed[0].torque[5].abs() < 1e-9);
    /// # Ok::<(), flexure::Error>(())
    /// ```
    pub fn needed_drives(&self, paths: &[JointPath], sample_time: f64) -> Result<Vec<NeededDrive>> {
        self.check_paths(paths)?;
        let (chain, samples) = (self.chain(), paths.first().map_or(0, |path| path.position.len()));
        let mut data = chain.data();
        let mut tau = vec![0.0; paths.len()];
        let mut on_links = vec![Vec::with_capacity(samples); paths.len()];
        for k in 0..samples {
            let at = |of: fn(&JointPath) -> &Vec<f64>| paths.iter().map(|path| of(path)[k]).collect::<Vec<f64>>();
            let (q, v, a) = (at(|p| &p.position), at(|p| &p.velocity), at(|p| &p.acceleration));
            chain.inverse_dynamics(&mut data, &q, &v, &a, &mut tau)?;
            on_links
                .iter_mut()
                .zip(&tau)
                .for_each(|(torque, tau)| torque.push(*tau));
        }
        let joints = self.drives.iter().zip(chain.joints()).zip(paths.iter().zip(on_links));
        joints
            .map(|((drive, name), (path, on_link))| match drive.flexible {
                true => drive.behind_spring(name, path, &on_link, sample_time),
                false => Ok(drive.of_rigid(path, on_link)),
            })
            .collect()
    }

    fn check_paths(&self, paths: &[JointPath]) -> Result<()> {
        let joints = self.chain().joints();
        let passive = self.passive().iter().position(|passive| *passive);
        let unsuited = if self.chain().base() == Base::Free {
            let why = "the motion of the joints does not determine that of the base; give a chain on a fixed base";
            Some(("a floating base".to_owned(), why))
        } else if self.drives.iter().any(|drive| drive.spin != 0.0) {
            let why = "the torques here leave that out; choose no coupling of the rotors";
            Some(("rotors that act on their carriers".to_owned(), why))
        } else {
            passive.map(|i| {
                (
                    format!("the passive joint '{}'", joints[i]),
                    "it has no motor that could make it move so; give it one",
                )
            })
        };
        if let Some((part, why)) = unsuited {
            return Err(Error::Arm(ArmError::Unsuited { part, why }));
        }
        if paths.len() != joints.len() {
            return Err(Error::length("the paths of the joints", paths.len(), joints.len()));
        }
        let samples = paths.first().map_or(0, |path| path.position.len());
        for (
            joint,
            JointPath {
                position,
                velocity,
                acceleration,
            },
        ) in joints.iter().zip(paths)
        {
            for column in [position, velocity, acceleration] {
                if column.len() != samples {
                    return Err(Error::length(joint, column.len(), samples));
                }
                check_values(joint, column)?;
            }
        }
        Ok(())
    }
}

impl Drive {
    /// What a rigid joint's motor does, for the torque on its link without friction.
    fn of_rigid(&self, path: &JointPath, mut torque: Vec<f64>) -> NeededDrive {
        for (k, torque) in torque.iter_mut().enumerate() {
            let (left, _) = self.torques(path.position[k], path.velocity[k], None, 0.0);
            *torque += self.motor * path.acceleration[k] - left;
        }
        NeededDrive { motor: None, torque }
    }

    /// What the motor behind a spring does.
    fn behind_spring(&self, joint: &str, path: &JointPath, on_link: &[f64], step: f64) -> Result<NeededDrive> {
        let at_rest = |x: f64, v: f64| self.torques(x, v, Some((x, v)), 0.0);
        let both = path.position.iter().zip(&path.velocity).zip(on_link);
        let elastic: Vec<f64> = both.map(|((q, v), torque)| torque - at_rest(*q, *v).0).collect();
        let deflection = self.deflections(&elastic, step, joint)?;
        let motor: Vec<f64> = path.position.iter().zip(&deflection).map(|(q, d)| q + d).collect();
        let rate = differences(&deflection, step);
        let bend = differences(&rate, step);
        let torque = (0..motor.len()).map(|k| {
            let friction = -at_rest(motor[k], path.velocity[k] + rate[k]).1;
            elastic[k] + self.motor * (path.acceleration[k] + bend[k]) + friction
        });
        Ok(NeededDrive {
            torque: torque.collect(),
            motor: Some(motor),
        })
    }

    /// The deflections under these torques of spring and damper, $\\kappa(d) + c\\,\\dot d$, by backward differences of order 2; the first one is at
    /// rest.
    fn deflections(&self, torques: &[f64], step: f64, joint: &str) -> Result<Vec<f64>> {
        let mut deflections: Vec<f64> = Vec::with_capacity(torques.len());
        for &torque in torques {
            // The present deflection and the known ones in the difference quotient.
            let (present, before) = match deflections[..] {
                [] => (0.0, 0.0),
                [only] => (1.0, only),
                [.., earlier, last] => (1.5, 2.0 * last - 0.5 * earlier),
            };
            let damping = self.damping / step;
            let stiffness = Stiffness {
                linear: self.stiffness.linear + present * damping,
                ..self.stiffness
            };
            let known = torque + damping * before;
            let deflection = stiffness.deflection(known).ok_or_else(|| {
                let name = format!("the torque on the spring of joint '{joint}'");
                Error::parameter(name, torque, "one that the spring can hold")
            })?;
            deflections.push(deflection);
        }
        Ok(deflections)
    }
}

/// Central differences; one-sided at both ends.
fn differences(x: &[f64], step: f64) -> Vec<f64> {
    let last = x.len().saturating_sub(1);
    let between = |k: usize| {
        let (from, to) = (k.saturating_sub(1), (k + 1).min(last));
        (x[to] - x[from]) / ((to - from).max(1) as f64 * step)
    };
    (0..x.len()).map(between).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::manipulator::chain::{Chain, ChainDrive, ChainPreset, DrivenState, RotorCoupling};
    use crate::manipulator::{JointKind, JointParameters, space_arm};

    const STEP: f64 = 1e-4;

    fn paths(joints: usize) -> Vec<JointPath> {
        let path = |joint: usize| {
            let (w, phase) = (2.0 + 0.7 * joint as f64, joint as f64);
            let at = |of: &dyn Fn(f64) -> f64| (0..400).map(|k| of(w * k as f64 * STEP + phase)).collect();
            JointPath {
                position: at(&|x| 0.4 * x.sin()),
                velocity: at(&|x| 0.4 * w * x.cos()),
                acceleration: at(&|x| -0.4 * w * w * x.sin()),
            }
        };
        (0..joints).map(path).collect()
    }

    /// The damping is light, or more than critical; then without friction, whose steep change near zero the differences of the test blur.
    #[test]
    fn the_torques_of_motors_give_the_motion_of_links_and_motors_back() {
        gives_back(0.3, true);
        gives_back(100.0, false);
    }

    fn gives_back(damping: f64, rubs: bool) {
        let [nonlinear, _] = space_arm(JointKind::Nonlinear).joints;
        let flexible = ChainDrive {
            kind: JointKind::Nonlinear,
            joint: JointParameters {
                damping,
                friction: nonlinear.friction.filter(|_| rubs),
                motor_friction: nonlinear.friction.filter(|_| rubs),
                ..nonlinear
            },
            ..ChainDrive::default()
        };
        let rigid = ChainDrive {
            joint: JointParameters {
                motor_inertia: 0.2,
                friction: nonlinear.friction,
                ..JointParameters::default()
            },
            ..ChainDrive::default()
        };
        let drives = [rigid, flexible, rigid, flexible, rigid, rigid];
        let arm = Chain::new(&ChainPreset::SixJointArm.parameters()).unwrap();
        let arm = DrivenChain::new(arm, &drives, RotorCoupling::None).unwrap();
        let paths = paths(6);
        let needed = arm.needed_drives(&paths, STEP).unwrap();
        let (k, mut data) = (200, arm.data());
        let tau: Vec<f64> = needed.iter().map(|n| n.torque[k]).collect();
        let of = |of: fn(&JointPath) -> &Vec<f64>| paths.iter().map(|p| of(p)[k]).collect::<Vec<f64>>();
        let motors: Vec<&Vec<f64>> = needed.iter().filter_map(|n| n.motor.as_ref()).collect();
        let motor_q: Vec<f64> = motors.iter().map(|m| m[k]).collect();
        // The rate with which the damper's torque was taken.
        let rate = |m: &[f64]| (3.0 * m[k] - 4.0 * m[k - 1] + m[k - 2]) / (2.0 * STEP);
        let link_rate = |path: &JointPath| rate(&path.position) - path.velocity[k];
        let flexible_paths = paths.iter().zip(&needed).filter(|(_, needed)| needed.motor.is_some());
        let motor_v: Vec<f64> = motors
            .iter()
            .zip(flexible_paths)
            .map(|(m, (path, _))| rate(m) - link_rate(path))
            .collect();
        let motor_a: Vec<f64> = motors
            .iter()
            .map(|m| (m[k + 1] - 2.0 * m[k] + m[k - 1]) / (STEP * STEP))
            .collect();
        let (q, v) = (of(|p| &p.position), of(|p| &p.velocity));
        let state = DrivenState {
            q: &q,
            v: &v,
            motor_q: &motor_q,
            motor_v: &motor_v,
        };
        let (mut a, mut am) = (vec![0.0; 6], vec![0.0; 2]);
        arm.accelerations(&mut data, &state, &tau, &mut a, &mut am).unwrap();
        for (found, path) in a.iter().zip(&paths) {
            assert!((found - path.acceleration[k]).abs() < 1e-4, "{a:?}");
        }
        for (found, motor) in am.iter().zip(&motor_a) {
            assert!(
                (found - motor).abs() < 1e-3 * motor.abs().max(1.0),
                "{am:?} {motor_a:?}"
            );
        }
    }

    #[test]
    fn paths_and_joints_that_do_not_fit_are_refused() {
        let six = Chain::new(&ChainPreset::SixJointArm.parameters()).unwrap();
        let passive = ChainDrive {
            passive: true,
            ..ChainDrive::default()
        };
        let drives = [vec![passive], vec![ChainDrive::default(); 5]].concat();
        let rigid = DrivenChain::new(six.clone(), &[], RotorCoupling::None).unwrap();
        assert!(matches!(rigid.needed_drives(&paths(5), STEP), Err(Error::Data(_))));
        let hanging = DrivenChain::new(six, &drives, RotorCoupling::None).unwrap();
        assert!(
            hanging
                .needed_drives(&paths(6), STEP)
                .unwrap_err()
                .to_string()
                .contains("passive")
        );
        let rotor = ChainDrive {
            joint: JointParameters {
                motor_inertia: 1.0,
                ..JointParameters::default()
            },
            ..ChainDrive::default()
        };
        let arm = Chain::new(&ChainPreset::SixJointArm.parameters()).unwrap();
        let coupled = DrivenChain::new(arm, &[rotor; 6], RotorCoupling::Complete).unwrap();
        let error = coupled.needed_drives(&paths(6), STEP).unwrap_err().to_string();
        assert!(error.contains("carriers"), "{error}");
        let free = Chain::new(&ChainPreset::SpaceManipulator.parameters()).unwrap();
        let free = DrivenChain::new(free, &[], RotorCoupling::None).unwrap();
        assert!(
            free.needed_drives(&paths(7), STEP)
                .unwrap_err()
                .to_string()
                .contains("base")
        );
    }
}
