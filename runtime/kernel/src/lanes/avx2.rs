//! AVX2 and FMA: 8 or 4 f32 or 4 f64, masks as vectors of all-ones or all-zeros lanes.
use std::arch::x86_64::*;

use super::{InstructionSet, Isa, Lanes, Mask, Task, operators};
use crate::scalar::Scalar;

macro_rules! lanes {
    (
        $name:ident($vector:ident) of $width:literal $scalar:ident, $mask:ident;
        $splat:ident $load:ident $store:ident $mul_add:ident $neg_mul_add:ident $sqrt:ident
        $min:ident $max:ident $and:ident $or:ident $and_not:ident $xor:ident $compare:ident
        $blend:ident $bits:ident $from_integers:ident;
        $splat_integer:ident $to_integers:ident $and_integers:ident $sub_integers:ident $equal:ident
        $powers:expr
    ) => {
        #[doc = concat!(stringify!($width), " ", stringify!($scalar))]
        #[derive(Clone, Copy)]
        pub struct $name($vector);

        impl std::ops::Neg for $name {
            type Output = $name;
            #[inline(always)]
            fn neg(self) -> $name {
                // SAFETY: the CPU has the instructions; see the head of `lanes`.
                $name(unsafe { $xor(self.0, $splat(-0.0)) })
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
                // SAFETY: as above; the slice has that many numbers, aligned or not.
                $name(unsafe { $load(from.as_ptr()) })
            }
            #[inline(always)]
            fn store(self, to: &mut [$scalar]) {
                let to = &mut to[..$width];
                // SAFETY: as above; the slice has that many numbers, aligned or not.
                unsafe { $store(to.as_mut_ptr(), self.0) }
            }
            #[inline(always)]
            fn mul_add(self, a: $name, b: $name) -> $name {
                // SAFETY: as above.
                $name(unsafe { $mul_add(self.0, a.0, b.0) })
            }
            #[inline(always)]
            fn neg_mul_add(self, a: $name, b: $name) -> $name {
                // SAFETY: as above.
                $name(unsafe { $neg_mul_add(self.0, a.0, b.0) })
            }
            #[inline(always)]
            fn sqrt(self) -> $name {
                // SAFETY: as above.
                $name(unsafe { $sqrt(self.0) })
            }
            #[inline(always)]
            fn abs(self) -> $name {
                // SAFETY: as above.
                $name(unsafe { $and_not($splat(-0.0), self.0) })
            }
            #[inline(always)]
            fn min(self, other: $name) -> $name {
                // SAFETY: as above.
                $name(unsafe { $min(self.0, other.0) })
            }
            #[inline(always)]
            fn max(self, other: $name) -> $name {
                // SAFETY: as above.
                $name(unsafe { $max(self.0, other.0) })
            }
            #[inline(always)]
            fn copy_sign(self, sign: $name) -> $name {
                // SAFETY: as above.
                $name(unsafe {
                    let bit = $splat(-0.0);
                    $or($and_not(bit, self.0), $and(bit, sign.0))
                })
            }
            #[inline(always)]
            fn unit_scale(self) -> $name {
                // SAFETY: as above.
                $name(unsafe {
                    let exponent = $splat_integer($scalar::EXPONENT_BITS as _);
                    let minuend = $splat_integer($scalar::UNIT_SCALE_BITS as _);
                    $from_integers($sub_integers(
                        minuend,
                        $and_integers($to_integers(self.0), exponent),
                    ))
                })
            }
            #[inline(always)]
            fn lt(self, other: $name) -> $mask {
                // SAFETY: as above.
                $mask(unsafe { $compare::<_CMP_LT_OQ>(self.0, other.0) })
            }
            #[inline(always)]
            fn le(self, other: $name) -> $mask {
                // SAFETY: as above.
                $mask(unsafe { $compare::<_CMP_LE_OQ>(self.0, other.0) })
            }
            #[inline(always)]
            fn eq(self, other: $name) -> $mask {
                // SAFETY: as above.
                $mask(unsafe { $compare::<_CMP_EQ_OQ>(self.0, other.0) })
            }
            #[inline(always)]
            fn select(mask: $mask, yes: $name, no: $name) -> $name {
                // SAFETY: as above.
                $name(unsafe { $blend(no.0, yes.0, mask.0) })
            }
        }

        #[doc = concat!("A mask for each of ", stringify!($width), " ", stringify!($scalar))]
        #[derive(Clone, Copy)]
        pub struct $mask($vector);

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
                // SAFETY: as above.
                $mask(unsafe {
                    let powers = $powers;
                    let set = $and_integers($splat_integer(bits as _), powers);
                    $from_integers($equal(set, powers))
                })
            }
            #[inline(always)]
            fn bits(self) -> u32 {
                // SAFETY: as above.
                unsafe { $bits(self.0) as u32 }
            }
            #[inline(always)]
            fn and_not(self, other: $mask) -> $mask {
                // SAFETY: as above.
                $mask(unsafe { $and_not(other.0, self.0) })
            }
        }
    };
}

lanes! {
    F32x8(__m256) of 8 f32, MaskF32;
    _mm256_set1_ps _mm256_loadu_ps _mm256_storeu_ps _mm256_fmadd_ps _mm256_fnmadd_ps _mm256_sqrt_ps
    _mm256_min_ps _mm256_max_ps _mm256_and_ps _mm256_or_ps _mm256_andnot_ps _mm256_xor_ps
    _mm256_cmp_ps _mm256_blendv_ps _mm256_movemask_ps _mm256_castsi256_ps;
    _mm256_set1_epi32 _mm256_castps_si256 _mm256_and_si256 _mm256_sub_epi32 _mm256_cmpeq_epi32
    _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128)
}
operators!(F32x8: Add add _mm256_add_ps, Sub sub _mm256_sub_ps, Mul mul _mm256_mul_ps, Div div _mm256_div_ps);
operators!(MaskF32: BitAnd bitand _mm256_and_ps, BitOr bitor _mm256_or_ps);

lanes! {
    F64x4(__m256d) of 4 f64, MaskF64;
    _mm256_set1_pd _mm256_loadu_pd _mm256_storeu_pd _mm256_fmadd_pd _mm256_fnmadd_pd _mm256_sqrt_pd
    _mm256_min_pd _mm256_max_pd _mm256_and_pd _mm256_or_pd _mm256_andnot_pd _mm256_xor_pd
    _mm256_cmp_pd _mm256_blendv_pd _mm256_movemask_pd _mm256_castsi256_pd;
    _mm256_set1_epi64x _mm256_castpd_si256 _mm256_and_si256 _mm256_sub_epi64 _mm256_cmpeq_epi64
    _mm256_setr_epi64x(1, 2, 4, 8)
}
operators!(F64x4: Add add _mm256_add_pd, Sub sub _mm256_sub_pd, Mul mul _mm256_mul_pd, Div div _mm256_div_pd);
operators!(MaskF64: BitAnd bitand _mm256_and_pd, BitOr bitor _mm256_or_pd);

lanes! {
    F32x4(__m128) of 4 f32, MaskF32x4;
    _mm_set1_ps _mm_loadu_ps _mm_storeu_ps _mm_fmadd_ps _mm_fnmadd_ps _mm_sqrt_ps
    _mm_min_ps _mm_max_ps _mm_and_ps _mm_or_ps _mm_andnot_ps _mm_xor_ps
    _mm_cmp_ps _mm_blendv_ps _mm_movemask_ps _mm_castsi128_ps;
    _mm_set1_epi32 _mm_castps_si128 _mm_and_si128 _mm_sub_epi32 _mm_cmpeq_epi32
    _mm_setr_epi32(1, 2, 4, 8)
}
/// [`Isa::transposed`].
#[inline(always)]
pub fn transposed([a, b, c, d]: [F32x4; 4]) -> [F32x4; 4] {
    // SAFETY: the CPU has the instructions; see the head of `lanes`.
    unsafe {
        let (ab_low, ab_high) = (_mm_unpacklo_ps(a.0, b.0), _mm_unpackhi_ps(a.0, b.0));
        let (cd_low, cd_high) = (_mm_unpacklo_ps(c.0, d.0), _mm_unpackhi_ps(c.0, d.0));
        [
            F32x4(_mm_movelh_ps(ab_low, cd_low)),
            F32x4(_mm_movehl_ps(cd_low, ab_low)),
            F32x4(_mm_movelh_ps(ab_high, cd_high)),
            F32x4(_mm_movehl_ps(cd_high, ab_high)),
        ]
    }
}

operators!(F32x4: Add add _mm_add_ps, Sub sub _mm_sub_ps, Mul mul _mm_mul_ps, Div div _mm_div_ps);
operators!(MaskF32x4: BitAnd bitand _mm_and_ps, BitOr bitor _mm_or_ps);

/// The set.
#[derive(Clone, Copy)]
pub struct Avx2;

impl Isa for Avx2 {
    const SET: InstructionSet = InstructionSet::Avx2;
    type F32 = F32x8;
    type F64 = F64x4;
    type F32UpTo8 = F32x8;
    type F32x4 = F32x4;
    type F64UpTo4 = F64x4;

    #[inline(always)]
    fn transposed(columns: [F32x4; 4]) -> [F32x4; 4] {
        transposed(columns)
    }
    #[inline(always)]
    fn narrow(low: F64x4, high: F64x4) -> F32x8 {
        // SAFETY: the CPU has the instructions; see the head of `lanes`.
        F32x8(unsafe { _mm256_set_m128(_mm256_cvtpd_ps(high.0), _mm256_cvtpd_ps(low.0)) })
    }
    #[inline(always)]
    fn widen(x: F32x8) -> (F64x4, F64x4) {
        // SAFETY: as above.
        unsafe {
            (
                F64x4(_mm256_cvtps_pd(_mm256_castps256_ps128(x.0))),
                F64x4(_mm256_cvtps_pd(_mm256_extractf128_ps::<1>(x.0))),
            )
        }
    }
    #[inline(always)]
    fn split(mask: MaskF32) -> (MaskF64, MaskF64) {
        // SAFETY: as above.
        unsafe {
            let mask = _mm256_castps_si256(mask.0);
            let half = |x| MaskF64(_mm256_castsi256_pd(_mm256_cvtepi32_epi64(x)));
            (
                half(_mm256_castsi256_si128(mask)),
                half(_mm256_extracti128_si256::<1>(mask)),
            )
        }
    }
    #[inline(always)]
    fn join(low: MaskF64, high: MaskF64) -> MaskF32 {
        // SAFETY: as above. The shuffle takes the even 32-bit words of each 128-bit half.
        MaskF32(unsafe {
            let (low, high) = (_mm256_castpd_ps(low.0), _mm256_castpd_ps(high.0));
            let words = _mm256_castps_pd(_mm256_shuffle_ps::<0b10_00_10_00>(low, high));
            _mm256_castpd_ps(_mm256_permute4x64_pd::<0b11_01_10_00>(words))
        })
    }

    #[inline(always)]
    fn call<T: Task>(task: T) -> T::Output {
        #[target_feature(enable = "avx2,fma")]
        #[inline(never)]
        fn enter<T: Task>(task: T) -> T::Output {
            task.run::<Avx2>()
        }
        // SAFETY: the CPU has the features; see the head of `lanes`.
        unsafe { enter(task) }
    }
}
