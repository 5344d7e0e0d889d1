//! Where the links of a chain are: points and lines by which it can be drawn.

use super::data::{ChainData, free_placement};
use super::model::{Base, Chain};
use super::spatial::Placement;
use crate::error::Result;

impl Chain {
    /// The lines between the points of [`Chain::points`], by their numbers.
    pub fn lines(&self) -> Vec<[usize; 2]> {
        let joints = self.bodies.iter().enumerate();
        let to_joints = joints.map(|(i, body)| [body.parent.map_or(0, |parent| parent + 1), i + 1]);
        let ends = self.ends().enumerate();
        let to_ends = ends.map(|(k, i)| [i + 1, self.bodies.len() + 1 + k]);
        to_joints.chain(to_ends).collect()
    }

    /// Points of the chain in the world at the position `q`, m: the base's origin, the joints in their order, and the centre of mass of
    /// every link that carries no other, since nothing says where such a link ends. For a base that is moved, its pose stands before `q`, as that
    /// of a free base does.
    ///
    /// # Errors
    /// A vector of another length, or a quaternion of length zero.
    ///
    /// ```
    /// use flexure::manipulator::chain::{Chain, ChainPreset};
    ///
    /// let arm = Chain::new(&ChainPreset::SixJointArm.parameters())?;
    /// let points = arm.points(&mut arm.data(), &arm.neutral())?;
    /// assert_eq!(points[0], [0.0; 3]);
    /// assert_eq!(points.len(), 1 + 6 + 1);
    /// # Ok::<(), flexure::Error>(())
    /// ```
    pub fn points(&self, data: &mut ChainData, q: &[f64]) -> Result<Vec<[f64; 3]>> {
        data.base.placement = Placement::default();
        let joints = match self.base {
            Base::Fixed if q.len() == self.positions() + 7 => {
                data.base.placement = free_placement(q)?;
                &q[7..]
            }
            _ => q,
        };
        self.place(data, joints)?;
        let mut places: Vec<Placement> = Vec::with_capacity(self.bodies.len());
        for (body, state) in self.bodies.iter().zip(&data.bodies) {
            let parent = body.parent.map_or(&data.base.placement, |parent| &places[parent]);
            places.push(parent.then(&state.placement));
        }
        let joints = places.iter().map(|place| place.translation);
        let ends = self.ends().map(|i| {
            let inertia = &self.bodies[i].inertia;
            places[i].rotation * (inertia.first * (1.0 / inertia.mass)) + places[i].translation
        });
        let base = data.base.placement.translation;
        Ok(std::iter::once(base)
            .chain(joints)
            .chain(ends)
            .map(|point| point.to_array())
            .collect())
    }

    /// The links that carry no other.
    fn ends(&self) -> impl Iterator<Item = usize> + '_ {
        let carries = |i: usize| self.bodies.iter().any(|body| body.parent == Some(i));
        (0..self.bodies.len()).filter(move |&i| !carries(i))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::manipulator::chain::{ChainLink, ChainParameters, JointMotion, LinkInertia};

    /// Two links of 2 m and 1 m in a plane, each with its centre of mass in its middle.
    fn planar(base: Base) -> Chain {
        let inertia = |com: f64| {
            Some(LinkInertia {
                mass: 3.0,
                com: [com, 0.0, 0.0],
                matrix: [[0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]],
            })
        };
        let link = |name: &str, parent, at: f64, com| ChainLink {
            name: name.to_owned(),
            joint: format!("{name}-joint"),
            parent,
            motion: JointMotion::Revolute,
            axis: [0.0, 0.0, 1.0],
            rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            translation: [at, 0.0, 0.0],
            inertia: inertia(com),
            limits: [f64::NEG_INFINITY, f64::INFINITY],
        };
        Chain::new(&ChainParameters {
            base_name: "base".to_owned(),
            base,
            base_inertia: inertia(0.0),
            links: vec![link("upper", None, 0.5, 1.0), link("fore", Some(0), 2.0, 0.5)],
            gravity: [0.0; 3],
        })
        .unwrap()
    }

    fn assert_close(found: &[[f64; 3]], expected: &[[f64; 3]]) {
        assert_eq!(found.len(), expected.len());
        let pairs = found.iter().flatten().zip(expected.iter().flatten());
        assert!(
            pairs.clone().all(|(a, b)| (a - b).abs() < 1e-12),
            "{found:?} {expected:?}"
        );
    }

    #[test]
    fn the_points_of_two_links_are_those_of_trigonometry() {
        let (a, b) = (0.7_f64, -1.9_f64);
        let elbow = [0.5 + 2.0 * a.cos(), 2.0 * a.sin(), 0.0];
        let end = [elbow[0] + 0.5 * (a + b).cos(), elbow[1] + 0.5 * (a + b).sin(), 0.0];
        let fixed = planar(Base::Fixed);
        assert_eq!(fixed.lines(), [[0, 1], [1, 2], [2, 3]]);
        let found = fixed.points(&mut fixed.data(), &[a, b]).unwrap();
        assert_close(&found, &[[0.0; 3], [0.5, 0.0, 0.0], elbow, end]);
        // A free base that stands at (1, 2, 3), turned by a right angle about x: y becomes z.
        let free = planar(Base::Free);
        let half = std::f64::consts::FRAC_PI_4;
        let q = [1.0, 2.0, 3.0, half.sin(), 0.0, 0.0, half.cos(), a, b];
        let turned = |[x, y, _]: [f64; 3]| [1.0 + x, 2.0, 3.0 + y];
        let found = free.points(&mut free.data(), &q).unwrap();
        assert_close(
            &found,
            &[[1.0, 2.0, 3.0], turned([0.5, 0.0, 0.0]), turned(elbow), turned(end)],
        );
        // So does a base that is moved there.
        assert_eq!(fixed.points(&mut fixed.data(), &q).unwrap(), found);
        assert!(free.points(&mut free.data(), &[0.0; 3]).is_err());
    }
}
