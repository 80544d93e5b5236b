//! AVX-512 F, VL, DQ, BW: 16 or 8 f32 or 8 f64, masks in registers of their own.
use std::arch::x86_64::*;

use super::{InstructionSet, Isa, Lanes, Mask, Task, operators};
use crate::scalar::Scalar;

macro_rules! lanes {
    (
        $name:ident($vector:ident) of $width:literal $scalar:ident, $mask:ident;
        $splat:ident $load:ident $store:ident $mul_add:ident $neg_mul_add:ident $sqrt:ident
        $abs:ident $min:ident $max:ident $and:ident $or:ident $and_not:ident $xor:ident
        $compare:ident $blend:ident $reduce_min:ident $compress:ident;
        $splat_bits:ident $to_bits:ident $from_bits:ident $and_bits:ident $sub_bits:ident
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
                $name(unsafe { $abs(self.0) })
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
                    let exponent = $splat_bits($scalar::EXPONENT_BITS as _);
                    let minuend = $splat_bits($scalar::UNIT_SCALE_BITS as _);
                    $from_bits($sub_bits(minuend, $and_bits($to_bits(self.0), exponent)))
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
                $name(unsafe { $blend(mask.0, no.0, yes.0) })
            }
            #[inline(always)]
            fn horizontal_min(self) -> $scalar {
                // SAFETY: as above.
                let least = unsafe { $reduce_min($min(self.0, $splat($scalar::INFINITY))) };
                least + 0.0
            }
            #[inline(always)]
            fn packed(self, mask: $mask) -> $name {
                // SAFETY: as above.
                $name(unsafe { $compress(mask.0, self.0) })
            }
        }
    };
}

macro_rules! mask {
    ($name:ident($bits:ident)) => {
        #[doc = concat!("One bit for each lane.")]
        #[derive(Clone, Copy)]
        pub struct $name($bits);

        impl std::ops::BitAnd for $name {
            type Output = $name;
            #[inline(always)]
            fn bitand(self, other: $name) -> $name {
                $name(self.0 & other.0)
            }
        }

        impl std::ops::BitOr for $name {
            type Output = $name;
            #[inline(always)]
            fn bitor(self, other: $name) -> $name {
                $name(self.0 | other.0)
            }
        }

        impl std::ops::Not for $name {
            type Output = $name;
            #[inline(always)]
            fn not(self) -> $name {
                $name(!self.0)
            }
        }

        impl Mask for $name {
            const WIDTH: usize = $bits::BITS as usize;

            #[inline(always)]
            fn from_bits(bits: u32) -> $name {
                $name(bits as $bits)
            }
            #[inline(always)]
            fn bits(self) -> u32 {
                u32::from(self.0)
            }
        }
    };
}

mask!(Mask16(u16));
mask!(Mask8(u8));

lanes! {
    F32x16(__m512) of 16 f32, Mask16;
    _mm512_set1_ps _mm512_loadu_ps _mm512_storeu_ps _mm512_fmadd_ps _mm512_fnmadd_ps
    _mm512_sqrt_ps _mm512_abs_ps _mm512_min_ps _mm512_max_ps _mm512_and_ps _mm512_or_ps
    _mm512_andnot_ps _mm512_xor_ps _mm512_cmp_ps_mask _mm512_mask_blend_ps _mm512_reduce_min_ps
    _mm512_maskz_compress_ps;
    _mm512_set1_epi32 _mm512_castps_si512 _mm512_castsi512_ps _mm512_and_si512 _mm512_sub_epi32
}
operators!(F32x16: Add add _mm512_add_ps, Sub sub _mm512_sub_ps, Mul mul _mm512_mul_ps, Div div _mm512_div_ps);

lanes! {
    F64x8(__m512d) of 8 f64, Mask8;
    _mm512_set1_pd _mm512_loadu_pd _mm512_storeu_pd _mm512_fmadd_pd _mm512_fnmadd_pd
    _mm512_sqrt_pd _mm512_abs_pd _mm512_min_pd _mm512_max_pd _mm512_and_pd _mm512_or_pd
    _mm512_andnot_pd _mm512_xor_pd _mm512_cmp_pd_mask _mm512_mask_blend_pd _mm512_reduce_min_pd
    _mm512_maskz_compress_pd;
    _mm512_set1_epi64 _mm512_castpd_si512 _mm512_castsi512_pd _mm512_and_si512 _mm512_sub_epi64
}
operators!(F64x8: Add add _mm512_add_pd, Sub sub _mm512_sub_pd, Mul mul _mm512_mul_pd, Div div _mm512_div_pd);

/// `_mm512_abs_ps` of half the size.
///
/// # Safety
///
/// The CPU has AVX-512 VL.
#[inline(always)]
unsafe fn abs_ps(x: __m256) -> __m256 {
    // SAFETY: as the caller promised.
    unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), x) }
}

/// `_mm512_reduce_min_ps` of half the size.
///
/// # Safety
///
/// The CPU has AVX-512 VL.
#[inline(always)]
unsafe fn reduce_min_ps(x: __m256) -> f32 {
    // SAFETY: as the caller promised.
    unsafe { _mm512_mask_reduce_min_ps(0xff, _mm512_castps256_ps512(x)) }
}

lanes! {
    F32x8(__m256) of 8 f32, Mask8;
    _mm256_set1_ps _mm256_loadu_ps _mm256_storeu_ps _mm256_fmadd_ps _mm256_fnmadd_ps
    _mm256_sqrt_ps abs_ps _mm256_min_ps _mm256_max_ps _mm256_and_ps _mm256_or_ps
    _mm256_andnot_ps _mm256_xor_ps _mm256_cmp_ps_mask _mm256_mask_blend_ps reduce_min_ps _mm256_maskz_compress_ps;
    _mm256_set1_epi32 _mm256_castps_si256 _mm256_castsi256_ps _mm256_and_si256 _mm256_sub_epi32
}
operators!(F32x8: Add add _mm256_add_ps, Sub sub _mm256_sub_ps, Mul mul _mm256_mul_ps, Div div _mm256_div_ps);

/// The set.
#[derive(Clone, Copy)]
pub struct Avx512;

impl Isa for Avx512 {
    const SET: InstructionSet = InstructionSet::Avx512;
    type F32 = F32x16;
    type F64 = F64x8;
    type F32UpTo8 = F32x8;
    type F32x4 = super::avx2::F32x4;
    type F64UpTo4 = super::avx2::F64x4;

    #[inline(always)]
    fn columns(rows: &[[f64; 3]]) -> [F64x8; 3] {
        let rows = rows[..8].as_flattened();
        let [a, b, c] = [0, 8, 16].map(|first| &rows[first..first + 8]);
        // SAFETY: the CPU has the instructions; see the head of `lanes`. The slices have eight
        // numbers each.
        unsafe {
            let (a, b, c) = (
                _mm512_loadu_pd(a.as_ptr()),
                _mm512_loadu_pd(b.as_ptr()),
                _mm512_loadu_pd(c.as_ptr()),
            );
            // Numbers below 8 pick from the first vector, others from the second.
            let x = _mm512_permutex2var_pd(a, _mm512_setr_epi64(0, 3, 6, 9, 12, 15, 0, 0), b);
            let y = _mm512_permutex2var_pd(a, _mm512_setr_epi64(1, 4, 7, 10, 13, 0, 0, 0), b);
            let z = _mm512_permutex2var_pd(a, _mm512_setr_epi64(2, 5, 8, 11, 14, 0, 0, 0), b);
            [
                F64x8(_mm512_permutex2var_pd(
                    x,
                    _mm512_setr_epi64(0, 1, 2, 3, 4, 5, 10, 13),
                    c,
                )),
                F64x8(_mm512_permutex2var_pd(
                    y,
                    _mm512_setr_epi64(0, 1, 2, 3, 4, 8, 11, 14),
                    c,
                )),
                F64x8(_mm512_permutex2var_pd(
                    z,
                    _mm512_setr_epi64(0, 1, 2, 3, 4, 9, 12, 15),
                    c,
                )),
            ]
        }
    }
    #[inline(always)]
    fn transposed(columns: [Self::F32x4; 4]) -> [Self::F32x4; 4] {
        super::avx2::transposed(columns)
    }
    /// Pairs of vectors are folded into one, until one is left that has two lanes for each.
    #[inline(always)]
    fn ranges(x: [F32x16; 8]) -> [[f32; 2]; 8] {
        let mut lanes = [0.0; 16];
        // SAFETY: the CPU has the instructions; see the head of `lanes`. A vector has 16 lanes.
        unsafe {
            let zero = _mm512_setzero_ps();
            let (mut least, mut greatest) = ([zero; 4], [zero; 4]);
            for i in 0..4 {
                let (a, b) = (x[i].0, x[i + 4].0);
                let low = _mm512_shuffle_f32x4::<0b01_00_01_00>(a, b);
                let high = _mm512_shuffle_f32x4::<0b11_10_11_10>(a, b);
                least[i] = _mm512_min_ps(low, high);
                greatest[i] = _mm512_max_ps(low, high);
            }
            // Quarters are of numbers i, i + 4, i + 1 and i + 5.
            let (mut least_of, mut greatest_of) = ([zero; 2], [zero; 2]);
            for i in 0..2 {
                let (a, b) = (least[2 * i], least[2 * i + 1]);
                least_of[i] = _mm512_min_ps(
                    _mm512_shuffle_f32x4::<0b10_00_10_00>(a, b),
                    _mm512_shuffle_f32x4::<0b11_01_11_01>(a, b),
                );
                let (a, b) = (greatest[2 * i], greatest[2 * i + 1]);
                greatest_of[i] = _mm512_max_ps(
                    _mm512_shuffle_f32x4::<0b10_00_10_00>(a, b),
                    _mm512_shuffle_f32x4::<0b11_01_11_01>(a, b),
                );
            }
            let [a, b] = least_of;
            let least = _mm512_min_ps(_mm512_unpacklo_ps(a, b), _mm512_unpackhi_ps(a, b));
            let [a, b] = greatest_of;
            let greatest = _mm512_max_ps(_mm512_unpacklo_ps(a, b), _mm512_unpackhi_ps(a, b));
            let least = _mm512_min_ps(least, _mm512_permute_ps::<0b01_00_11_10>(least));
            let greatest = _mm512_max_ps(greatest, _mm512_permute_ps::<0b01_00_11_10>(greatest));
            _mm512_storeu_ps(lanes.as_mut_ptr(), _mm512_unpacklo_ps(least, greatest));
        }
        const PLACES: [usize; 8] = [0, 8, 2, 10, 4, 12, 6, 14];
        let mut ranges = [[0.0; 2]; 8];
        for i in 0..8 {
            ranges[i] = [lanes[PLACES[i]], lanes[PLACES[i] + 1]];
        }
        ranges
    }
    #[inline(always)]
    fn narrow(low: F64x8, high: F64x8) -> F32x16 {
        // SAFETY: the CPU has the instructions; see the head of `lanes`.
        F32x16(unsafe {
            let low = _mm512_castps256_ps512(_mm512_cvtpd_ps(low.0));
            _mm512_insertf32x8::<1>(low, _mm512_cvtpd_ps(high.0))
        })
    }
    #[inline(always)]
    fn widen(x: F32x16) -> (F64x8, F64x8) {
        // SAFETY: as above.
        unsafe {
            (
                F64x8(_mm512_cvtps_pd(_mm512_castps512_ps256(x.0))),
                F64x8(_mm512_cvtps_pd(_mm512_extractf32x8_ps::<1>(x.0))),
            )
        }
    }
    #[inline(always)]
    fn split(mask: Mask16) -> (Mask8, Mask8) {
        (Mask8(mask.0 as u8), Mask8((mask.0 >> 8) as u8))
    }
    #[inline(always)]
    fn join(low: Mask8, high: Mask8) -> Mask16 {
        Mask16(u16::from(low.0) | u16::from(high.0) << 8)
    }

    #[inline(always)]
    fn without_least(
        set: u32,
        distances: &[f32; 8],
        numbers: &[u32; 8],
        to: &mut [u64],
    ) -> (u64, usize) {
        let to = &mut to[..8];
        let set = set as u8;
        // SAFETY: the CPU has the instructions; see the head of `lanes`. There are eight numbers of
        // either kind, and room for eight pairs.
        unsafe {
            let numbers = _mm512_castsi256_si512(_mm256_loadu_si256(numbers.as_ptr().cast()));
            let distances = _mm512_castsi256_si512(_mm256_loadu_si256(distances.as_ptr().cast()));
            // Numbers below 16 pick from the first vector, others from the second.
            let places = _mm512_setr_epi32(0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
            let pairs = _mm512_permutex2var_epi32(numbers, places, distances);
            let least = _mm512_mask_reduce_min_epu64(set, pairs);
            let others = _mm512_mask_cmpneq_epi64_mask(set, pairs, _mm512_set1_epi64(least as i64));
            let pairs = _mm512_maskz_compress_epi64(others, pairs);
            _mm512_storeu_epi64(to.as_mut_ptr().cast(), pairs);
            (least, others.count_ones() as usize)
        }
    }

    #[inline(always)]
    fn call<T: Task>(task: T) -> T::Output {
        #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,popcnt")]
        #[inline(never)]
        fn enter<T: Task>(task: T) -> T::Output {
            task.run::<Avx512>()
        }
        // SAFETY: the CPU has the features; see the head of `lanes`.
        unsafe { enter(task) }
    }
}
