//! Three-component vectors: points, directions and linear RGB colours.
use crate::lanes::Lanes;
use std::ops::{Add, AddAssign, Mul, Neg, Sub};

/// A point, direction or linear colour, or one for each lane; `a * b` is component by component.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Vec3<L = f64> {
    /// First component, or red.
    pub x: L,
    /// Second component, or green.
    pub y: L,
    /// Third component, or blue.
    pub z: L,
}

impl Vec3 {
    /// The zero vector; black.
    pub const ZERO: Vec3 = Vec3::new(0.0, 0.0, 0.0);
    /// All ones; white.
    pub const ONE: Vec3 = Vec3::new(1.0, 1.0, 1.0);
}

impl<L: Lanes<Scalar = f64>> Vec3<L> {
    /// The vector of these components.
    #[inline(always)]
    pub const fn new(x: L, y: L, z: L) -> Vec3<L> {
        Vec3 { x, y, z }
    }

    /// The same vector in all lanes.
    #[inline(always)]
    pub fn splat(v: Vec3) -> Vec3<L> {
        Vec3::new(L::splat(v.x), L::splat(v.y), L::splat(v.z))
    }

    /// The relative luminance of linear Rec. 709 colours.
    #[inline(always)]
    pub fn luminance(self) -> L {
        L::splat(0.2126) * self.x + L::splat(0.7152) * self.y + L::splat(0.0722) * self.z
    }

    /// Whether no component is NaN or infinite.
    #[inline(always)]
    pub fn is_finite(self) -> L::Mask {
        // Summing turns any infinity or NaN into a non-finite product with zero.
        ((self.x + self.y + self.z) * L::zero()).eq(L::zero())
    }

    /// The scalar product.
    #[inline(always)]
    pub fn dot(self, other: Vec3<L>) -> L {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    /// The vector product.
    #[inline(always)]
    pub fn cross(self, other: Vec3<L>) -> Vec3<L> {
        Vec3::new(
            self.y * other.z - self.z * other.y,
            self.z * other.x - self.x * other.z,
            self.x * other.y - self.y * other.x,
        )
    }

    /// The vector of length 1 in the same direction; NaN for the zero vector.
    #[inline(always)]
    pub fn normalized(self) -> Vec3<L> {
        self * (L::splat(1.0) / self.dot(self).sqrt())
    }

    /// Those from number `first` on of columns of components.
    #[inline(always)]
    pub fn load([x, y, z]: &[Vec<f64>; 3], first: usize) -> Vec3<L> {
        Vec3::new(
            L::load(&x[first..]),
            L::load(&y[first..]),
            L::load(&z[first..]),
        )
    }

    /// Writes the components to columns, from number `first` on.
    #[inline(always)]
    pub fn store(self, [x, y, z]: &mut [Vec<f64>; 3], first: usize) {
        self.x.store(&mut x[first..]);
        self.y.store(&mut y[first..]);
        self.z.store(&mut z[first..]);
    }

    /// The vector of lane `i`.
    #[inline(always)]
    pub fn get(self, i: usize) -> Vec3 {
        Vec3::new(self.x.get(i), self.y.get(i), self.z.get(i))
    }

    /// `yes` where the mask is set, `no` elsewhere.
    #[inline(always)]
    pub fn select(mask: L::Mask, yes: Vec3<L>, no: Vec3<L>) -> Vec3<L> {
        Vec3::new(
            L::select(mask, yes.x, no.x),
            L::select(mask, yes.y, no.y),
            L::select(mask, yes.z, no.z),
        )
    }

    /// The lanes that the mask has, in order, and after them what has no meaning.
    #[inline(always)]
    pub fn packed(self, mask: L::Mask) -> Vec3<L> {
        Vec3::new(
            self.x.packed(mask),
            self.y.packed(mask),
            self.z.packed(mask),
        )
    }

    /// The components as an array.
    #[inline(always)]
    pub fn to_array(self) -> [L; 3] {
        [self.x, self.y, self.z]
    }
}

impl<L> From<[L; 3]> for Vec3<L> {
    #[inline(always)]
    fn from([x, y, z]: [L; 3]) -> Vec3<L> {
        Vec3 { x, y, z }
    }
}

impl<L: Lanes<Scalar = f64>> Add for Vec3<L> {
    type Output = Vec3<L>;
    #[inline(always)]
    fn add(self, other: Vec3<L>) -> Vec3<L> {
        Vec3::new(self.x + other.x, self.y + other.y, self.z + other.z)
    }
}

impl<L: Lanes<Scalar = f64>> AddAssign for Vec3<L> {
    #[inline(always)]
    fn add_assign(&mut self, other: Vec3<L>) {
        *self = *self + other;
    }
}

impl<L: Lanes<Scalar = f64>> Sub for Vec3<L> {
    type Output = Vec3<L>;
    #[inline(always)]
    fn sub(self, other: Vec3<L>) -> Vec3<L> {
        Vec3::new(self.x - other.x, self.y - other.y, self.z - other.z)
    }
}

impl<L: Lanes<Scalar = f64>> Neg for Vec3<L> {
    type Output = Vec3<L>;
    #[inline(always)]
    fn neg(self) -> Vec3<L> {
        Vec3::new(-self.x, -self.y, -self.z)
    }
}

impl<L: Lanes<Scalar = f64>> Mul<L> for Vec3<L> {
    type Output = Vec3<L>;
    #[inline(always)]
    fn mul(self, factor: L) -> Vec3<L> {
        Vec3::new(self.x * factor, self.y * factor, self.z * factor)
    }
}

impl<L: Lanes<Scalar = f64>> Mul for Vec3<L> {
    type Output = Vec3<L>;
    #[inline(always)]
    fn mul(self, other: Vec3<L>) -> Vec3<L> {
        Vec3::new(self.x * other.x, self.y * other.y, self.z * other.z)
    }
}
