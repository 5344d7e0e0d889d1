//! Vectors and matrices of three dimensions, of fixed size and without allocation; of single numbers, or of several in lanes.

use std::ops::{Add, Mul, Neg, Sub};

use crate::number::Number;

/// A vector in three dimensions.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Vec3<T = f64> {
    pub x: T,
    pub y: T,
    pub z: T,
}

impl Vec3 {
    pub const ZERO: Vec3 = Vec3::new(0.0, 0.0, 0.0);
    pub const Z: Vec3 = Vec3::new(0.0, 0.0, 1.0);

    pub const fn new(x: f64, y: f64, z: f64) -> Self {
        Vec3 { x, y, z }
    }

    /// The same vector in every lane of a number.
    #[inline(always)]
    pub fn like<T: Number>(self, number: T) -> Vec3<T> {
        Vec3 {
            x: number.filled(self.x),
            y: number.filled(self.y),
            z: number.filled(self.z),
        }
    }
}

impl<T: Number> Vec3<T> {
    #[inline(always)]
    pub fn from_slice(v: &[T]) -> Self {
        Vec3 {
            x: v[0],
            y: v[1],
            z: v[2],
        }
    }

    #[inline(always)]
    pub fn to_array(self) -> [T; 3] {
        [self.x, self.y, self.z]
    }

    #[inline(always)]
    pub fn dot(self, o: Self) -> T {
        self.x * o.x + self.y * o.y + self.z * o.z
    }

    #[inline(always)]
    pub fn cross(self, o: Self) -> Self {
        Vec3 {
            x: self.y * o.z - self.z * o.y,
            y: self.z * o.x - self.x * o.z,
            z: self.x * o.y - self.y * o.x,
        }
    }
}

impl<T: Number> Add for Vec3<T> {
    type Output = Vec3<T>;
    #[inline(always)]
    fn add(self, o: Vec3<T>) -> Vec3<T> {
        Vec3 {
            x: self.x + o.x,
            y: self.y + o.y,
            z: self.z + o.z,
        }
    }
}

impl<T: Number> Sub for Vec3<T> {
    type Output = Vec3<T>;
    #[inline(always)]
    fn sub(self, o: Vec3<T>) -> Vec3<T> {
        Vec3 {
            x: self.x - o.x,
            y: self.y - o.y,
            z: self.z - o.z,
        }
    }
}

impl<T: Number> Neg for Vec3<T> {
    type Output = Vec3<T>;
    #[inline(always)]
    fn neg(self) -> Vec3<T> {
        Vec3 {
            x: -self.x,
            y: -self.y,
            z: -self.z,
        }
    }
}

impl<T: Number> Mul<T> for Vec3<T> {
    type Output = Vec3<T>;
    #[inline(always)]
    fn mul(self, s: T) -> Vec3<T> {
        Vec3 {
            x: self.x * s,
            y: self.y * s,
            z: self.z * s,
        }
    }
}

/// A 3x3 matrix by its columns.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Mat3<T = f64> {
    pub x: Vec3<T>,
    pub y: Vec3<T>,
    pub z: Vec3<T>,
}

impl Mat3 {
    pub const IDENTITY: Mat3 = Mat3::diagonal(1.0);

    pub const fn diagonal(d: f64) -> Self {
        Mat3 {
            x: Vec3::new(d, 0.0, 0.0),
            y: Vec3::new(0.0, d, 0.0),
            z: Vec3::new(0.0, 0.0, d),
        }
    }

    /// The matrix with these rows.
    pub const fn from_rows(r: &[[f64; 3]; 3]) -> Self {
        Mat3 {
            x: Vec3::new(r[0][0], r[1][0], r[2][0]),
            y: Vec3::new(r[0][1], r[1][1], r[2][1]),
            z: Vec3::new(r[0][2], r[1][2], r[2][2]),
        }
    }

    /// The same matrix in every lane of a number.
    #[inline(always)]
    pub fn like<T: Number>(&self, number: T) -> Mat3<T> {
        Mat3 {
            x: self.x.like(number),
            y: self.y.like(number),
            z: self.z.like(number),
        }
    }
}

impl<T: Number> Mat3<T> {
    /// The matrix of these columns, each of three numbers.
    #[inline(always)]
    pub fn from_columns(c: [[T; 3]; 3]) -> Self {
        let [x, y, z] = c;
        Mat3 {
            x: Vec3::from_slice(&x),
            y: Vec3::from_slice(&y),
            z: Vec3::from_slice(&z),
        }
    }

    /// `d` times the identity.
    #[inline(always)]
    pub fn scaled(d: T) -> Self {
        let zero = d.filled(0.0);
        Mat3::from_columns([[d, zero, zero], [zero, d, zero], [zero, zero, d]])
    }

    /// `[c]`, for which `[c] v` is the cross product of c and v.
    #[inline(always)]
    pub fn cross(c: Vec3<T>) -> Self {
        let zero = c.x.filled(0.0);
        Mat3::from_columns([[zero, c.z, -c.y], [-c.z, zero, c.x], [c.y, -c.x, zero]])
    }

    /// `a b^T`.
    #[inline(always)]
    pub fn outer(a: Vec3<T>, b: Vec3<T>) -> Self {
        Mat3 {
            x: a * b.x,
            y: a * b.y,
            z: a * b.z,
        }
    }

    #[inline(always)]
    pub fn transpose(&self) -> Self {
        let Mat3 { x, y, z } = *self;
        Mat3::from_columns([[x.x, y.x, z.x], [x.y, y.y, z.y], [x.z, y.z, z.z]])
    }

    /// `A^T v`.
    #[inline(always)]
    pub fn transposed_times(&self, v: Vec3<T>) -> Vec3<T> {
        Vec3 {
            x: self.x.dot(v),
            y: self.y.dot(v),
            z: self.z.dot(v),
        }
    }

    /// `R A R^T`.
    #[inline(always)]
    pub fn rotated(&self, r: &Mat3<T>) -> Mat3<T> {
        *r * *self * r.transpose()
    }
}

impl<T: Number> Mul<Vec3<T>> for Mat3<T> {
    type Output = Vec3<T>;
    #[inline(always)]
    fn mul(self, v: Vec3<T>) -> Vec3<T> {
        self.x * v.x + self.y * v.y + self.z * v.z
    }
}

impl<T: Number> Mul for Mat3<T> {
    type Output = Mat3<T>;
    #[inline(always)]
    fn mul(self, o: Mat3<T>) -> Mat3<T> {
        Mat3 {
            x: self * o.x,
            y: self * o.y,
            z: self * o.z,
        }
    }
}

impl<T: Number> Add for Mat3<T> {
    type Output = Mat3<T>;
    #[inline(always)]
    fn add(self, o: Mat3<T>) -> Mat3<T> {
        Mat3 {
            x: self.x + o.x,
            y: self.y + o.y,
            z: self.z + o.z,
        }
    }
}

impl<T: Number> Sub for Mat3<T> {
    type Output = Mat3<T>;
    #[inline(always)]
    fn sub(self, o: Mat3<T>) -> Mat3<T> {
        Mat3 {
            x: self.x - o.x,
            y: self.y - o.y,
            z: self.z - o.z,
        }
    }
}
