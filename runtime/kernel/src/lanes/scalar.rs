//! f32 and f64 as lanes of width one.
use super::{Lanes, Mask};
use crate::scalar::Scalar;

impl Mask for bool {
    const WIDTH: usize = 1;

    #[inline(always)]
    fn from_bits(bits: u32) -> bool {
        bits & 1 != 0
    }
    #[inline(always)]
    fn bits(self) -> u32 {
        u32::from(self)
    }
}

macro_rules! lanes {
    ($scalar:ident) => {
        impl Lanes for $scalar {
            type Scalar = $scalar;
            type Mask = bool;
            const WIDTH: usize = 1;

            #[inline(always)]
            fn splat(x: $scalar) -> $scalar {
                x
            }
            #[inline(always)]
            fn load(from: &[$scalar]) -> $scalar {
                from[0]
            }
            #[inline(always)]
            fn store(self, to: &mut [$scalar]) {
                to[0] = self;
            }
            #[inline(always)]
            fn mul_add(self, a: $scalar, b: $scalar) -> $scalar {
                $scalar::mul_add(self, a, b)
            }
            #[inline(always)]
            fn neg_mul_add(self, a: $scalar, b: $scalar) -> $scalar {
                $scalar::mul_add(-self, a, b)
            }
            #[inline(always)]
            fn sqrt(self) -> $scalar {
                $scalar::sqrt(self)
            }
            #[inline(always)]
            fn abs(self) -> $scalar {
                $scalar::abs(self)
            }
            #[inline(always)]
            fn min(self, other: $scalar) -> $scalar {
                if self < other { self } else { other }
            }
            #[inline(always)]
            fn max(self, other: $scalar) -> $scalar {
                if self > other { self } else { other }
            }
            #[inline(always)]
            fn copy_sign(self, sign: $scalar) -> $scalar {
                $scalar::copysign(self, sign)
            }
            #[inline(always)]
            fn unit_scale(self) -> $scalar {
                let exponent = Scalar::to_bits(self) & <$scalar as Scalar>::EXPONENT_BITS;
                Scalar::from_bits(<$scalar as Scalar>::UNIT_SCALE_BITS.wrapping_sub(exponent))
            }
            #[inline(always)]
            fn lt(self, other: $scalar) -> bool {
                self < other
            }
            #[inline(always)]
            fn le(self, other: $scalar) -> bool {
                self <= other
            }
            #[inline(always)]
            fn eq(self, other: $scalar) -> bool {
                self == other
            }
            #[inline(always)]
            fn packed(self, _: bool) -> $scalar {
                self
            }
            #[inline(always)]
            fn select(mask: bool, yes: $scalar, no: $scalar) -> $scalar {
                if mask { yes } else { no }
            }
        }
    };
}

lanes!(f32);
lanes!(f64);
