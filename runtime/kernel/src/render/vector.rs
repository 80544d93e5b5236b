//! Three-component vectors: points, directions and linear RGB colours.
use std::ops::{Add, AddAssign, Mul, Neg, Sub};

/// A point, direction or linear colour; `a * b` is component by component.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Vec3 {
    /// First component, or red.
    pub x: f64,
    /// Second component, or green.
    pub y: f64,
    /// Third component, or blue.
    pub z: f64,
}

impl Vec3 {
    /// The zero vector; black.
    pub const ZERO: Vec3 = Vec3::new(0.0, 0.0, 0.0);
    /// All ones; white.
    pub const ONE: Vec3 = Vec3::new(1.0, 1.0, 1.0);

    /// The vector of these components.
    #[inline(always)]
    pub const fn new(x: f64, y: f64, z: f64) -> Vec3 {
        Vec3 { x, y, z }
    }

    /// The scalar product.
    #[inline(always)]
    pub fn dot(self, other: Vec3) -> f64 {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    /// The vector product.
    #[inline(always)]
    pub fn cross(self, other: Vec3) -> Vec3 {
        Vec3::new(
            self.y * other.z - self.z * other.y,
            self.z * other.x - self.x * other.z,
            self.x * other.y - self.y * other.x,
        )
    }

    /// The vector of length 1 in the same direction; NaN for the zero vector.
    #[inline(always)]
    pub fn normalized(self) -> Vec3 {
        self * (1.0 / self.dot(self).sqrt())
    }

    /// The components as an array.
    #[inline(always)]
    pub fn to_array(self) -> [f64; 3] {
        [self.x, self.y, self.z]
    }

    /// The relative luminance of a linear Rec. 709 colour.
    #[inline(always)]
    pub fn luminance(self) -> f64 {
        0.2126 * self.x + 0.7152 * self.y + 0.0722 * self.z
    }

    /// Whether no component is NaN or infinite.
    #[inline(always)]
    pub fn is_finite(self) -> bool {
        // Summing turns any infinity or NaN into a non-finite product with zero.
        ((self.x + self.y + self.z) * 0.0) == 0.0
    }
}

impl From<[f64; 3]> for Vec3 {
    #[inline(always)]
    fn from([x, y, z]: [f64; 3]) -> Vec3 {
        Vec3 { x, y, z }
    }
}

impl Add for Vec3 {
    type Output = Vec3;
    #[inline(always)]
    fn add(self, other: Vec3) -> Vec3 {
        Vec3::new(self.x + other.x, self.y + other.y, self.z + other.z)
    }
}

impl AddAssign for Vec3 {
    #[inline(always)]
    fn add_assign(&mut self, other: Vec3) {
        *self = *self + other;
    }
}

impl Sub for Vec3 {
    type Output = Vec3;
    #[inline(always)]
    fn sub(self, other: Vec3) -> Vec3 {
        Vec3::new(self.x - other.x, self.y - other.y, self.z - other.z)
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
    fn mul(self, factor: f64) -> Vec3 {
        Vec3::new(self.x * factor, self.y * factor, self.z * factor)
    }
}

impl Mul for Vec3 {
    type Output = Vec3;
    #[inline(always)]
    fn mul(self, other: Vec3) -> Vec3 {
        Vec3::new(self.x * other.x, self.y * other.y, self.z * other.z)
    }
}
