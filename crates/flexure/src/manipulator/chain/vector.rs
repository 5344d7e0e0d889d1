//! Vectors and matrices of three dimensions, of fixed size and without allocation.

use std::ops::{Add, Mul, Neg, Sub};

/// A vector in three dimensions.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Vec3 {
    pub x: f64,
    pub y: f64,
    pub z: f64,
}

impl Vec3 {
    pub const ZERO: Vec3 = Vec3::new(0.0, 0.0, 0.0);
    pub const Z: Vec3 = Vec3::new(0.0, 0.0, 1.0);

    pub const fn new(x: f64, y: f64, z: f64) -> Self {
        Vec3 { x, y, z }
    }

    #[inline(always)]
    pub fn from_slice(v: &[f64]) -> Self {
        Vec3::new(v[0], v[1], v[2])
    }

    pub const fn to_array(self) -> [f64; 3] {
        [self.x, self.y, self.z]
    }

    #[inline(always)]
    pub fn dot(self, o: Self) -> f64 {
        self.x * o.x + self.y * o.y + self.z * o.z
    }

    #[inline(always)]
    pub fn cross(self, o: Self) -> Self {
        Vec3::new(
            self.y * o.z - self.z * o.y,
            self.z * o.x - self.x * o.z,
            self.x * o.y - self.y * o.x,
        )
    }
}

impl Add for Vec3 {
    type Output = Vec3;
    #[inline(always)]
    fn add(self, o: Vec3) -> Vec3 {
        Vec3::new(self.x + o.x, self.y + o.y, self.z + o.z)
    }
}

impl Sub for Vec3 {
    type Output = Vec3;
    #[inline(always)]
    fn sub(self, o: Vec3) -> Vec3 {
        Vec3::new(self.x - o.x, self.y - o.y, self.z - o.z)
    }
}

impl Neg for Vec3 {
    type Output = Vec3;
    #[inline(always)]
    fn neg(self) -> Vec3 {
        Vec3::new(-self.x, -self.y, -self.z)
    }
}

impl Mul<f64> for Vec3 {
    type Output = Vec3;
    #[inline(always)]
    fn mul(self, s: f64) -> Vec3 {
        Vec3::new(self.x * s, self.y * s, self.z * s)
    }
}

/// A 3x3 matrix by its columns.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Mat3 {
    pub x: Vec3,
    pub y: Vec3,
    pub z: Vec3,
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

    /// `[c]`, for which `[c] v` is the cross product of c and v.
    #[inline(always)]
    pub fn cross(c: Vec3) -> Self {
        Mat3 {
            x: Vec3::new(0.0, c.z, -c.y),
            y: Vec3::new(-c.z, 0.0, c.x),
            z: Vec3::new(c.y, -c.x, 0.0),
        }
    }

    /// `a b^T`.
    #[inline(always)]
    pub fn outer(a: Vec3, b: Vec3) -> Self {
        Mat3 {
            x: a * b.x,
            y: a * b.y,
            z: a * b.z,
        }
    }

    #[inline(always)]
    pub fn transpose(&self) -> Self {
        Mat3 {
            x: Vec3::new(self.x.x, self.y.x, self.z.x),
            y: Vec3::new(self.x.y, self.y.y, self.z.y),
            z: Vec3::new(self.x.z, self.y.z, self.z.z),
        }
    }

    /// `A^T v`.
    #[inline(always)]
    pub fn transposed_times(&self, v: Vec3) -> Vec3 {
        Vec3::new(self.x.dot(v), self.y.dot(v), self.z.dot(v))
    }

    /// `R A R^T`.
    #[inline(always)]
    pub fn rotated(&self, r: &Mat3) -> Mat3 {
        *r * *self * r.transpose()
    }
}

impl Mul<Vec3> for Mat3 {
    type Output = Vec3;
    #[inline(always)]
    fn mul(self, v: Vec3) -> Vec3 {
        self.x * v.x + self.y * v.y + self.z * v.z
    }
}

impl Mul for Mat3 {
    type Output = Mat3;
    #[inline(always)]
    fn mul(self, o: Mat3) -> Mat3 {
        Mat3 {
            x: self * o.x,
            y: self * o.y,
            z: self * o.z,
        }
    }
}

impl Add for Mat3 {
    type Output = Mat3;
    #[inline(always)]
    fn add(self, o: Mat3) -> Mat3 {
        Mat3 {
            x: self.x + o.x,
            y: self.y + o.y,
            z: self.z + o.z,
        }
    }
}

impl Sub for Mat3 {
    type Output = Mat3;
    #[inline(always)]
    fn sub(self, o: Mat3) -> Mat3 {
        Mat3 {
            x: self.x - o.x,
            y: self.y - o.y,
            z: self.z - o.z,
        }
    }
}
