//! NEON: 4 f32 or 2 f64, masks as vectors of all-ones or all-zeros lanes.
use std::arch::aarch64::*;

use super::{InstructionSet, Isa, Lanes, Mask, Task, operators};
use crate::scalar::Scalar;

macro_rules! lanes {
    (
        $name:ident($vector:ident) of $width:literal $scalar:ident, $mask:ident($integers:ident);
        $splat:ident $load:ident $store:ident $mul_add:ident $neg_mul_add:ident $sqrt:ident
        $abs:ident $neg:ident $less:ident $less_equal:ident $equal:ident $select:ident;
        $integer:ident $splat_integer:ident $load_integer:ident $test:ident $and:ident $and_not:ident
        $sum:ident $to_integers:ident $from_integers:ident $sub_integers:ident $powers:expr
    ) => {
        #[doc = concat!(stringify!($width), " ", stringify!($scalar))]
        #[derive(Clone, Copy)]
        pub struct $name($vector);

        impl std::ops::Neg for $name {
            type Output = $name;
            #[inline(always)]
            fn neg(self) -> $name {
                // SAFETY: the CPU has the instructions; see the head of `lanes`.
                $name(unsafe { $neg(self.0) })
            }
        }

        impl Lanes for $name {
            type Scalar = $scalar;
            type Mask = $mask;
            const WIDTH: usize = $width;

            #[inline(always)]
            fn splat(x: $scalar) -> $name {
                // SAFETY: as above.
                $name(unsafe { $splat(x) })
            }
            #[inline(always)]
            fn load(from: &[$scalar]) -> $name {
                let from = &from[..$width];
                // SAFETY: as above; the slice has that many numbers.
                $name(unsafe { $load(from.as_ptr()) })
            }
            #[inline(always)]
            fn store(self, to: &mut [$scalar]) {
                let to = &mut to[..$width];
                // SAFETY: as above; the slice has that many numbers.
                unsafe { $store(to.as_mut_ptr(), self.0) }
            }
            #[inline(always)]
            fn mul_add(self, a: $name, b: $name) -> $name {
                // SAFETY: as above. NEON names the addend first.
                $name(unsafe { $mul_add(b.0, self.0, a.0) })
            }
            #[inline(always)]
            fn neg_mul_add(self, a: $name, b: $name) -> $name {
                // SAFETY: as above.
                $name(unsafe { $neg_mul_add(b.0, self.0, a.0) })
            }
            #[inline(always)]
            fn sqrt(self) -> $name {
                // SAFETY: as above.
                $name(unsafe { $sqrt(self.0) })
            }
            #[inline(always)]
            fn abs(self) -> $name {
                // SAFETY: as above.
                $name(unsafe { $abs(self.0) })
            }
            #[inline(always)]
            fn min(self, other: $name) -> $name {
                $name::select(self.lt(other), self, other)
            }
            #[inline(always)]
            fn max(self, other: $name) -> $name {
                $name::select(other.lt(self), self, other)
            }
            #[inline(always)]
            fn copy_sign(self, sign: $name) -> $name {
                // SAFETY: as above.
                $name(unsafe {
                    let bit = $splat_integer(1 << ($integer::BITS - 1));
                    $select(bit, sign.0, self.0)
                })
            }
            #[inline(always)]
            fn unit_scale(self) -> $name {
                // SAFETY: as above.
                $name(unsafe {
                    let exponent = $splat_integer($scalar::EXPONENT_BITS as _);
                    let minuend = $splat_integer($scalar::UNIT_SCALE_BITS as _);
                    $from_integers($sub_integers(minuend, $and($to_integers(self.0), exponent)))
                })
            }
            #[inline(always)]
            fn lt(self, other: $name) -> $mask {
                // SAFETY: as above.
                $mask(unsafe { $less(self.0, other.0) })
            }
            #[inline(always)]
            fn le(self, other: $name) -> $mask {
                // SAFETY: as above.
                $mask(unsafe { $less_equal(self.0, other.0) })
            }
            #[inline(always)]
            fn eq(self, other: $name) -> $mask {
                // SAFETY: as above.
                $mask(unsafe { $equal(self.0, other.0) })
            }
            #[inline(always)]
            fn select(mask: $mask, yes: $name, no: $name) -> $name {
                // SAFETY: as above.
                $name(unsafe { $select(mask.0, yes.0, no.0) })
            }
        }

        #[doc = concat!("A mask for each of ", stringify!($width), " ", stringify!($scalar))]
        #[derive(Clone, Copy)]
        pub struct $mask($integers);

        impl std::ops::Not for $mask {
            type Output = $mask;
            #[inline(always)]
            fn not(self) -> $mask {
                $mask::full().and_not(self)
            }
        }

        impl Mask for $mask {
            const WIDTH: usize = $width;

            #[inline(always)]
            fn from_bits(bits: u32) -> $mask {
                let powers: [$integer; $width] = $powers;
                // SAFETY: as above; the array has that many numbers.
                $mask(unsafe { $test($splat_integer(bits.into()), $load_integer(powers.as_ptr())) })
            }
            #[inline(always)]
            fn bits(self) -> u32 {
                let powers: [$integer; $width] = $powers;
                // SAFETY: as above; the array has that many numbers.
                unsafe { $sum($and(self.0, $load_integer(powers.as_ptr()))) as u32 }
            }
            #[inline(always)]
            fn and_not(self, other: $mask) -> $mask {
                // SAFETY: as above.
                $mask(unsafe { $and_not(self.0, other.0) })
            }
        }
    };
}

lanes! {
    F32x4(float32x4_t) of 4 f32, MaskF32(uint32x4_t);
    vdupq_n_f32 vld1q_f32 vst1q_f32 vfmaq_f32 vfmsq_f32 vsqrtq_f32
    vabsq_f32 vnegq_f32 vcltq_f32 vcleq_f32 vceqq_f32 vbslq_f32;
    u32 vdupq_n_u32 vld1q_u32 vtstq_u32 vandq_u32 vbicq_u32 vaddvq_u32
    vreinterpretq_u32_f32 vreinterpretq_f32_u32 vsubq_u32 [1, 2, 4, 8]
}
operators!(F32x4: Add add vaddq_f32, Sub sub vsubq_f32, Mul mul vmulq_f32, Div div vdivq_f32);
operators!(MaskF32: BitAnd bitand vandq_u32, BitOr bitor vorrq_u32);

lanes! {
    F64x2(float64x2_t) of 2 f64, MaskF64(uint64x2_t);
    vdupq_n_f64 vld1q_f64 vst1q_f64 vfmaq_f64 vfmsq_f64 vsqrtq_f64
    vabsq_f64 vnegq_f64 vcltq_f64 vcleq_f64 vceqq_f64 vbslq_f64;
    u64 vdupq_n_u64 vld1q_u64 vtstq_u64 vandq_u64 vbicq_u64 vaddvq_u64
    vreinterpretq_u64_f64 vreinterpretq_f64_u64 vsubq_u64 [1, 2]
}
operators!(F64x2: Add add vaddq_f64, Sub sub vsubq_f64, Mul mul vmulq_f64, Div div vdivq_f64);
operators!(MaskF64: BitAnd bitand vandq_u64, BitOr bitor vorrq_u64);

/// The set.
#[derive(Clone, Copy)]
pub struct Neon;

impl Isa for Neon {
    const SET: InstructionSet = InstructionSet::Neon;
    type F32 = F32x4;
    type F64 = F64x2;
    type F32UpTo8 = F32x4;
    type F32x4 = F32x4;
    type F64UpTo4 = F64x2;

    #[inline(always)]
    fn narrow(low: F64x2, high: F64x2) -> F32x4 {
        // SAFETY: the CPU has the instructions; see the head of `lanes`.
        F32x4(unsafe { vcvt_high_f32_f64(vcvt_f32_f64(low.0), high.0) })
    }
    #[inline(always)]
    fn widen(x: F32x4) -> (F64x2, F64x2) {
        // SAFETY: as above.
        unsafe {
            (
                F64x2(vcvt_f64_f32(vget_low_f32(x.0))),
                F64x2(vcvt_high_f64_f32(x.0)),
            )
        }
    }
    #[inline(always)]
    fn split(mask: MaskF32) -> (MaskF64, MaskF64) {
        // SAFETY: as above. A word is doubled by interleaving the mask with itself.
        unsafe {
            (
                MaskF64(vreinterpretq_u64_u32(vzip1q_u32(mask.0, mask.0))),
                MaskF64(vreinterpretq_u64_u32(vzip2q_u32(mask.0, mask.0))),
            )
        }
    }
    #[inline(always)]
    fn join(low: MaskF64, high: MaskF64) -> MaskF32 {
        // SAFETY: as above.
        MaskF32(unsafe { vuzp1q_u32(vreinterpretq_u32_u64(low.0), vreinterpretq_u32_u64(high.0)) })
    }

    #[inline(always)]
    fn call<T: Task>(task: T) -> T::Output {
        #[target_feature(enable = "neon")]
        #[inline(never)]
        fn enter<T: Task>(task: T) -> T::Output {
            task.run::<Neon>()
        }
        // SAFETY: the CPU has the feature; see the head of `lanes`.
        unsafe { enter(task) }
    }
}
