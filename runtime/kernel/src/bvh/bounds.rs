//! Axis-aligned boxes, and the normalised space of a tree.

/// A closed box in f64. Empty when a lower bound exceeds its upper one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Least coordinates.
    pub lower: [f64; 3],
    /// Greatest coordinates.
    pub upper: [f64; 3],
}

impl Bounds {
    /// Holds nothing: the identity of [`Bounds::union`].
    pub const EMPTY: Bounds = Bounds {
        lower: [f64::INFINITY; 3],
        upper: [f64::NEG_INFINITY; 3],
    };

    /// Whether nothing is inside.
    pub fn is_empty(&self) -> bool {
        (0..3).any(|i| self.lower[i] > self.upper[i])
    }

    /// Whether it holds something and all six numbers are finite.
    pub fn is_finite(&self) -> bool {
        !self.is_empty() && (0..3).all(|i| self.lower[i].is_finite() && self.upper[i].is_finite())
    }

    /// The least box around both.
    pub fn union(&self, other: &Bounds) -> Bounds {
        Bounds {
            lower: std::array::from_fn(|i| self.lower[i].min(other.lower[i])),
            upper: std::array::from_fn(|i| self.upper[i].max(other.upper[i])),
        }
    }

    /// The least box around this one and a point.
    pub fn with_point(&self, p: [f64; 3]) -> Bounds {
        self.union(&Bounds { lower: p, upper: p })
    }

    /// The middle; halves are added so that it cannot overflow.
    pub fn center(&self) -> [f64; 3] {
        std::array::from_fn(|i| 0.5 * self.lower[i] + 0.5 * self.upper[i])
    }

    /// Half the size along each axis.
    pub fn half_extent(&self) -> [f64; 3] {
        std::array::from_fn(|i| 0.5 * self.upper[i] - 0.5 * self.lower[i])
    }
}

/// A box in the normalised space of a tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalBounds {
    /// Least coordinates.
    pub lower: [f32; 3],
    /// Greatest coordinates.
    pub upper: [f32; 3],
}

impl NormalBounds {
    /// Holds nothing.
    pub const EMPTY: NormalBounds = NormalBounds {
        lower: [f32::INFINITY; 3],
        upper: [f32::NEG_INFINITY; 3],
    };

    /// The least box around both.
    #[inline]
    pub fn union(&self, other: &NormalBounds) -> NormalBounds {
        NormalBounds {
            lower: std::array::from_fn(|i| self.lower[i].min(other.lower[i])),
            upper: std::array::from_fn(|i| self.upper[i].max(other.upper[i])),
        }
    }

    /// Half of the surface: what the area heuristic needs.
    #[inline]
    pub fn half_area(&self) -> f32 {
        let [x, y, z]: [f32; 3] = std::array::from_fn(|i| self.upper[i] - self.lower[i]);
        x * y + y * z + z * x
    }
}

/// The space in which a tree lives: p_n = scale·(p − center), its content within [−1, 1]³.
///
/// Traversal there needs single precision only, whatever the size and the place of the content.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalSpace {
    /// The middle of the content.
    pub center: [f64; 3],
    /// A power of two: multiplying by it is exact.
    pub scale: f64,
}

impl NormalSpace {
    /// Changes nothing.
    pub const IDENTITY: NormalSpace = NormalSpace {
        center: [0.0; 3],
        scale: 1.0,
    };

    /// The space for content within finite (or empty) bounds.
    pub fn around(bounds: &Bounds) -> NormalSpace {
        if bounds.is_empty() {
            return NormalSpace::IDENTITY;
        }
        let largest = bounds.half_extent().into_iter().fold(0.0, f64::max);
        NormalSpace {
            center: bounds.center(),
            scale: power_of_two(-exponent(largest) - 1),
        }
    }

    /// A point of this space.
    pub fn to_normal(&self, p: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|i| (p[i] - self.center[i]) * self.scale)
    }

    /// A box of this space, rounded outward: subtraction and conversion err by less than the one
    /// f32 step that is taken.
    ///
    /// A step from zero is 2⁻⁶⁰: the next number is subnormal, and CPUs take a hundred cycles for
    /// every operation on such. Whatever is flat, as a ground, has its box there.
    pub fn normalize(&self, bounds: &Bounds) -> NormalBounds {
        const STEP: f32 = 1.0 / (1u64 << 60) as f32;
        let (lower, upper) = (self.to_normal(bounds.lower), self.to_normal(bounds.upper));
        let outward = |stepped: f32, least: f32| if stepped.abs() < STEP { least } else { stepped };
        NormalBounds {
            lower: lower.map(|x| outward((x as f32).next_down(), -STEP)),
            upper: upper.map(|x| outward((x as f32).next_up(), STEP)),
        }
    }
}

/// Exponents beyond which scaling stops: products of three scales still are normal numbers.
const LARGEST_EXPONENT: i32 = 300;

/// e with 2^e ≤ |x| < 2^(e+1), clamped to ±300; 0 for zero.
#[inline(always)]
pub fn exponent(x: f64) -> i32 {
    if x == 0.0 {
        return 0;
    }
    let biased = ((x.to_bits() >> 52) & 0x7ff) as i32;
    (biased - 1023).clamp(-LARGEST_EXPONENT, LARGEST_EXPONENT)
}

/// 2^e exactly, for |e| ≤ 1022.
#[inline(always)]
pub fn power_of_two(e: i32) -> f64 {
    debug_assert!(e.abs() <= 1022);
    f64::from_bits(((e + 1023) as u64) << 52)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn normal_boxes_hold_their_content(
            x in -1e3..1e3f64, size in 0.0..1e3f64, e in -100..100i32, far in -1e12..1e12f64,
        ) {
            let unit = power_of_two(e);
            let bounds = Bounds {
                lower: [(far + x) * unit; 3],
                upper: [(far + x + size) * unit; 3],
            };
            let space = NormalSpace::around(&bounds);
            let normal = space.normalize(&bounds);
            for i in 0..3 {
                let lower = (bounds.lower[i] - space.center[i]) * space.scale;
                let upper = (bounds.upper[i] - space.center[i]) * space.scale;
                prop_assert!(f64::from(normal.lower[i]) <= lower && lower >= -1.001);
                prop_assert!(f64::from(normal.upper[i]) >= upper && upper <= 1.001);
            }
        }
    }

    #[test]
    fn exponents_are_those_of_the_number() {
        assert_eq!([1.0, 0.75, 4.5, -3.0, 0.0].map(exponent), [0, -1, 2, 1, 0]);
        assert_eq!(
            [1e308, f64::INFINITY, 1e-320].map(exponent),
            [300, 300, -300]
        );
        assert_eq!(power_of_two(-3), 0.125);
    }

    #[test]
    fn no_number_of_a_box_is_subnormal() {
        for x in [0.0, 1e-40, -1e-40, 1e-20, -1e-20] {
            let bounds = Bounds {
                lower: [x; 3],
                upper: [x; 3],
            };
            let normal = NormalSpace::IDENTITY.normalize(&bounds);
            for (lower, upper) in normal.lower.into_iter().zip(normal.upper) {
                assert!(lower.is_normal() && upper.is_normal());
                assert!(f64::from(lower) < x && x < f64::from(upper));
            }
        }
    }

    #[test]
    fn a_point_has_a_space() {
        let point = Bounds::EMPTY.with_point([1e12, 0.0, -1e-30]);
        let space = NormalSpace::around(&point);
        assert_eq!(space.scale, 0.5);
        assert!(space.normalize(&point).lower[0] < 0.0);
    }
}
