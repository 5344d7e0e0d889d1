//! Spatial vectors, placements and inertias (Featherstone 2008, chapter 2), of fixed size and without allocation.
//!
//! A motion is (linear, angular) velocity of a frame in its own axes, a force is (force, moment about its origin).

use std::ops::{Add, AddAssign, Mul, Sub};

use super::vector::{Mat3, Vec3};
use crate::number::Number;

/// A motion or a force: (linear, angular), or (force, moment).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Spatial<T = f64> {
    pub linear: Vec3<T>,
    pub angular: Vec3<T>,
}

impl Spatial {
    pub const ZERO: Spatial = Spatial {
        linear: Vec3::ZERO,
        angular: Vec3::ZERO,
    };

    /// The same one in every lane of a number.
    #[inline(always)]
    pub fn like<T: Number>(self, number: T) -> Spatial<T> {
        Spatial {
            linear: self.linear.like(number),
            angular: self.angular.like(number),
        }
    }
}

impl<T: Number> Spatial<T> {
    #[inline(always)]
    pub fn from_slice(v: &[T]) -> Self {
        Spatial {
            linear: Vec3::from_slice(v),
            angular: Vec3::from_slice(&v[3..]),
        }
    }

    #[inline(always)]
    pub fn to_array(self) -> [T; 6] {
        let (l, a) = (self.linear, self.angular);
        [l.x, l.y, l.z, a.x, a.y, a.z]
    }

    /// The power of a force on a motion, or of a motion on a force.
    #[inline(always)]
    pub fn dot(self, o: Spatial<T>) -> T {
        self.linear.dot(o.linear) + self.angular.dot(o.angular)
    }

    /// The same motion or force in axes turned by r.
    #[inline(always)]
    pub fn turned(self, r: &Mat3<T>) -> Spatial<T> {
        Spatial {
            linear: *r * self.linear,
            angular: *r * self.angular,
        }
    }

    /// `v x m`: how a motion m fixed in a frame that moves with v changes (2.31).
    #[inline(always)]
    pub fn cross_motion(self, m: Spatial<T>) -> Spatial<T> {
        Spatial {
            linear: self.angular.cross(m.linear) + self.linear.cross(m.angular),
            angular: self.angular.cross(m.angular),
        }
    }

    /// `v x* f`: how a force f fixed in a frame that moves with v changes (2.32).
    #[inline(always)]
    pub fn cross_force(self, f: Spatial<T>) -> Spatial<T> {
        Spatial {
            linear: self.angular.cross(f.linear),
            angular: self.angular.cross(f.angular) + self.linear.cross(f.linear),
        }
    }
}

impl<T: Number> Add for Spatial<T> {
    type Output = Spatial<T>;
    #[inline(always)]
    fn add(self, o: Spatial<T>) -> Spatial<T> {
        Spatial {
            linear: self.linear + o.linear,
            angular: self.angular + o.angular,
        }
    }
}

impl<T: Number> AddAssign for Spatial<T> {
    #[inline(always)]
    fn add_assign(&mut self, o: Spatial<T>) {
        *self = *self + o;
    }
}

impl<T: Number> Sub for Spatial<T> {
    type Output = Spatial<T>;
    #[inline(always)]
    fn sub(self, o: Spatial<T>) -> Spatial<T> {
        Spatial {
            linear: self.linear - o.linear,
            angular: self.angular - o.angular,
        }
    }
}

impl<T: Number> Mul<T> for Spatial<T> {
    type Output = Spatial<T>;
    #[inline(always)]
    fn mul(self, s: T) -> Spatial<T> {
        Spatial {
            linear: self.linear * s,
            angular: self.angular * s,
        }
    }
}

/// Where a frame lies in its parent: `x_parent = rotation x + translation`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Placement<T = f64> {
    pub rotation: Mat3<T>,
    pub translation: Vec3<T>,
}

impl Default for Placement {
    fn default() -> Self {
        Placement {
            rotation: Mat3::IDENTITY,
            translation: Vec3::ZERO,
        }
    }
}

impl Placement {
    /// A frame at the parent's origin, turned.
    pub fn turned(rotation: Mat3) -> Placement {
        Placement {
            rotation,
            translation: Vec3::ZERO,
        }
    }

    /// The same placement in every lane of a number.
    #[inline(always)]
    pub fn like<T: Number>(&self, number: T) -> Placement<T> {
        Placement {
            rotation: self.rotation.like(number),
            translation: self.translation.like(number),
        }
    }
}

impl<T: Number> Placement<T> {
    /// A frame in this one, in this one's parent.
    #[inline(always)]
    pub fn then(&self, inner: &Placement<T>) -> Placement<T> {
        Placement {
            rotation: self.rotation * inner.rotation,
            translation: self.rotation * inner.translation + self.translation,
        }
    }

    /// A motion of the parent's frame, in this frame.
    #[inline(always)]
    pub fn motion_from_parent(&self, m: Spatial<T>) -> Spatial<T> {
        Spatial {
            linear: (self.rotation).transposed_times(m.linear - self.translation.cross(m.angular)),
            angular: self.rotation.transposed_times(m.angular),
        }
    }

    /// A force in this frame, in the parent's.
    #[inline(always)]
    pub fn force_to_parent(&self, f: Spatial<T>) -> Spatial<T> {
        let linear = self.rotation * f.linear;
        Spatial {
            linear,
            angular: self.rotation * f.angular + self.translation.cross(linear),
        }
    }
}

/// The inertia of a body about the origin of its frame (2.63): mass, first moment `m c`, second moments.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Inertia<T = f64> {
    pub mass: T,
    pub first: Vec3<T>,
    pub second: Mat3<T>,
}

impl Inertia {
    /// The inertia of a body with its centre of mass at c and the moments `central` about it.
    pub fn new(mass: f64, c: Vec3, central: Mat3) -> Self {
        let s = Mat3::cross(c);
        let Mat3 { x, y, z } = s * s.transpose();
        Inertia {
            mass,
            first: c * mass,
            second: Mat3 {
                x: central.x + x * mass,
                y: central.y + y * mass,
                z: central.z + z * mass,
            },
        }
    }

    /// The same inertia in every lane of a number.
    #[inline(always)]
    pub fn like<T: Number>(&self, number: T) -> Inertia<T> {
        Inertia {
            mass: number.filled(self.mass),
            first: self.first.like(number),
            second: self.second.like(number),
        }
    }
}

impl<T: Number> Inertia<T> {
    /// The momentum of a body that moves with v.
    #[inline(always)]
    pub fn times(&self, v: Spatial<T>) -> Spatial<T> {
        Spatial {
            linear: v.linear * self.mass - self.first.cross(v.angular),
            angular: self.first.cross(v.linear) + self.second * v.angular,
        }
    }

    /// The same inertia in the frame in which this one lies at `p`.
    #[inline(always)]
    pub fn in_parent(&self, p: &Placement<T>) -> Inertia<T> {
        let (t, h) = (p.translation, p.rotation * self.first);
        let s = Mat3::cross(t);
        let shift = Mat3::cross(h) * s;
        // About the new origin: I - [h][t] - [t][h] - m [t][t].
        let full = s * (Mat3::cross(h) + Mat3::cross(t * self.mass));
        Inertia {
            mass: self.mass,
            first: h + t * self.mass,
            second: self.second.rotated(&p.rotation) - shift - full,
        }
    }

    #[inline(always)]
    pub fn plus(&self, o: &Inertia<T>) -> Inertia<T> {
        Inertia {
            mass: self.mass + o.mass,
            first: self.first + o.first,
            second: self.second + o.second,
        }
    }
}

/// An articulated-body inertia (7.1): `[[linear, mixed], [mixed^T, angular]]`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Articulated<T = f64> {
    pub linear: Mat3<T>,
    pub mixed: Mat3<T>,
    pub angular: Mat3<T>,
}

impl<T: Number> Articulated<T> {
    #[inline(always)]
    pub fn of(body: &Inertia<T>) -> Self {
        Articulated {
            linear: Mat3::scaled(body.mass),
            mixed: Mat3::cross(-body.first),
            angular: body.second,
        }
    }

    #[inline(always)]
    pub fn times(&self, v: Spatial<T>) -> Spatial<T> {
        Spatial {
            linear: self.linear * v.linear + self.mixed * v.angular,
            angular: self.mixed.transposed_times(v.linear) + self.angular * v.angular,
        }
    }

    /// `I S` for a joint that slides along z, or turns about it.
    #[inline(always)]
    pub fn column(&self, prismatic: bool) -> Spatial<T> {
        if prismatic {
            let m = self.mixed;
            return Spatial {
                linear: self.linear.z,
                angular: Vec3::from_slice(&[m.x.z, m.y.z, m.z.z]),
            };
        }
        Spatial {
            linear: self.mixed.z,
            angular: self.angular.z,
        }
    }

    /// `I - u u^T s`: what is left of it beyond a joint that is free to move, where `1/s` is the joint's own mass.
    #[inline(always)]
    pub fn without(&self, u: Spatial<T>, s: T) -> Self {
        let w = u * s;
        Articulated {
            linear: self.linear - Mat3::outer(u.linear, w.linear),
            mixed: self.mixed - Mat3::outer(u.linear, w.angular),
            angular: self.angular - Mat3::outer(u.angular, w.angular),
        }
    }

    /// The same inertia in the frame in which this one lies at `p`, added to `total`.
    #[inline(always)]
    pub fn add_to_parent(&self, p: &Placement<T>, total: &mut Articulated<T>) {
        let s = Mat3::cross(p.translation);
        let linear = self.linear.rotated(&p.rotation);
        let turned = self.mixed.rotated(&p.rotation);
        let mixed = turned - linear * s;
        total.linear = total.linear + linear;
        total.mixed = total.mixed + mixed;
        total.angular = total.angular + self.angular.rotated(&p.rotation) - turned.transpose() * s + s * mixed;
    }

    /// The motion a with `I a = f`, by Cholesky's factor; `None` where the inertia is not positive definite.
    #[inline(always)]
    pub fn solve(&self, f: Spatial<T>) -> Option<Spatial<T>> {
        let (m, h, i) = (self.linear, self.mixed, self.angular);
        let t = h.transpose();
        let mut a = [[m.x.x; 6]; 6];
        for (row, (u, v)) in a
            .iter_mut()
            .zip([(m.x, t.x), (m.y, t.y), (m.z, t.z), (h.x, i.x), (h.y, i.y), (h.z, i.z)])
        {
            *row = Spatial { linear: u, angular: v }.to_array();
        }
        let zero = m.x.x.filled(0.0);
        let (mut l, mut x) = ([[zero; 6]; 6], f.to_array());
        for j in 0..6 {
            for k in j..6 {
                let mut rest = zero;
                for n in 0..j {
                    rest = rest + l[k][n] * l[j][n];
                }
                let value = a[j][k] - rest;
                if k > j {
                    l[k][j] = value / l[j][j];
                } else if value.is_positive() {
                    l[j][j] = value.sqrt();
                } else {
                    return None;
                }
            }
        }
        for k in 0..6 {
            let mut rest = zero;
            for n in 0..k {
                rest = rest + l[k][n] * x[n];
            }
            x[k] = (x[k] - rest) / l[k][k];
        }
        for k in (0..6).rev() {
            let mut rest = zero;
            for n in k + 1..6 {
                rest = rest + l[n][k] * x[n];
            }
            x[k] = (x[k] - rest) / l[k][k];
        }
        Some(Spatial::from_slice(&x))
    }
}
