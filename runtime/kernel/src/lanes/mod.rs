//! Vectors of W numbers, written once for every instruction set.
//!
//! Algorithms are generic functions over [`Lanes`] (or over [`Isa`] where they need both
//! precisions), all `#[inline(always)]`. A [`Task`] is the entry: [`dispatch`] picks the
//! instruction set at run time and calls the task from one function with the right
//! `#[target_feature]`, so that everything inlined into it is compiled for that set.
//! Dispatch per batch, not per ray.
//!
//! What is not inlined is not compiled for the set, and ten times slower. Closures are not sure to
//! be: neither `array::map` nor a named closure may compute with lanes; functions and `axes!` and
//! its kin may.
//!
//! Every operation here is an IEEE 754 operation, correctly rounded, or moves bits: all sets give
//! the same bits for the same input (which NaN a NaN is excepted).
//!
//! # Safety
//!
//! The types of an instruction set are private to this module; other code meets them only as
//! `I` in `Task::run::<I>`, which [`dispatch`] enters after asking the CPU. So whoever holds
//! such a value runs on a CPU that has the instructions: that is why their methods can be safe.
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

use crate::scalar::Scalar;

mod instruction_set;
mod portable;
mod scalar;
#[cfg(test)]
mod tests;
mod unrolled;

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
#[cfg(target_arch = "aarch64")]
mod neon;

pub use instruction_set::{InstructionSet, Task, dispatch};
pub(crate) use unrolled::{axes, each, halves};

/// The largest [`Lanes::WIDTH`] there is.
pub const MAX_WIDTH: usize = 16;

/// Takes the lowest of the bits that are set.
#[inline(always)]
pub(crate) fn take_bit(bits: &mut u32) -> Option<usize> {
    if *bits == 0 {
        return None;
    }
    let lowest = bits.trailing_zeros() as usize;
    *bits &= *bits - 1;
    Some(lowest)
}

/// W numbers, computed with in step. f32 and f64 are themselves lanes of width one.
pub trait Lanes:
    Copy
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// What one lane holds.
    type Scalar: Scalar;
    /// A truth value for each lane.
    type Mask: Mask;
    /// How many lanes.
    const WIDTH: usize;

    /// The same number in all lanes.
    fn splat(x: Self::Scalar) -> Self;
    /// Several numbers, each in all lanes of its own.
    #[inline(always)]
    fn splats<const N: usize>(x: [Self::Scalar; N]) -> [Self; N] {
        let mut lanes = [Self::zero(); N];
        for i in 0..N {
            lanes[i] = Self::splat(x[i]);
        }
        lanes
    }
    /// The first `WIDTH` numbers of a slice. Panics if it is shorter.
    fn load(from: &[Self::Scalar]) -> Self;
    /// Writes the first `WIDTH` numbers of a slice. Panics if it is shorter.
    fn store(self, to: &mut [Self::Scalar]);
    /// self·a + b, rounded once.
    fn mul_add(self, a: Self, b: Self) -> Self;
    /// b − self·a, rounded once.
    fn neg_mul_add(self, a: Self, b: Self) -> Self;
    /// Square root; NaN of negative numbers.
    fn sqrt(self) -> Self;
    /// Clears the sign bit.
    fn abs(self) -> Self;
    /// `if self < other { self } else { other }`: the second if either is NaN or both are zero.
    fn min(self, other: Self) -> Self;
    /// `if self > other { self } else { other }`: the second if either is NaN or both are zero.
    fn max(self, other: Self) -> Self;
    /// The magnitude of `self` with the sign bit of `sign`.
    fn copy_sign(self, sign: Self) -> Self;
    /// 2^−e where 2^e ≤ |self| < 2^(e+1): brings normal numbers into [1, 2). Meaningless for
    /// others.
    fn unit_scale(self) -> Self;

    /// self < other; false for NaN, as every comparison here.
    fn lt(self, other: Self) -> Self::Mask;
    /// self ≤ other.
    fn le(self, other: Self) -> Self::Mask;
    /// self = other.
    fn eq(self, other: Self) -> Self::Mask;
    /// self > other.
    #[inline(always)]
    fn gt(self, other: Self) -> Self::Mask {
        other.lt(self)
    }
    /// self ≥ other.
    #[inline(always)]
    fn ge(self, other: Self) -> Self::Mask {
        other.le(self)
    }
    /// `yes` where the mask is set, `no` elsewhere.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;

    /// The least lane, passing over NaN; infinity if all are NaN; never −0.
    #[inline(always)]
    fn horizontal_min(self) -> Self::Scalar {
        let mut lanes = [Self::Scalar::default(); MAX_WIDTH];
        self.store(&mut lanes);
        let mut least = Self::Scalar::INFINITY;
        for &lane in &lanes[..Self::WIDTH] {
            least = Lanes::min(lane, least);
        }
        least + Self::Scalar::default()
    }
    /// The lanes that the mask has, in order, and after them what has no meaning.
    #[inline(always)]
    fn packed(self, mask: Self::Mask) -> Self {
        let mut lanes = [Self::Scalar::default(); MAX_WIDTH];
        self.store(&mut lanes);
        let (mut left, mut count) = (mask.bits(), 0);
        while let Some(lane) = take_bit(&mut left) {
            lanes[count] = lanes[lane];
            count += 1;
        }
        Self::load(&lanes)
    }
    /// Lane i is `f(i)`.
    #[inline(always)]
    fn from_fn(mut f: impl FnMut(usize) -> Self::Scalar) -> Self {
        let mut lanes = [Self::Scalar::default(); MAX_WIDTH];
        for (i, lane) in lanes[..Self::WIDTH].iter_mut().enumerate() {
            *lane = f(i);
        }
        Self::load(&lanes)
    }
    /// Lane `i`. Panics if there is no such lane.
    #[inline(always)]
    fn get(self, i: usize) -> Self::Scalar {
        let mut lanes = [Self::Scalar::default(); MAX_WIDTH];
        self.store(&mut lanes);
        lanes[..Self::WIDTH][i]
    }
    /// With lane `i` replaced. Panics if there is no such lane.
    #[inline(always)]
    fn with(self, i: usize, x: Self::Scalar) -> Self {
        let mut lanes = [Self::Scalar::default(); MAX_WIDTH];
        self.store(&mut lanes);
        lanes[..Self::WIDTH][i] = x;
        Self::load(&lanes)
    }
    /// All lanes zero.
    #[inline(always)]
    fn zero() -> Self {
        Self::splat(Self::Scalar::default())
    }
}

/// A truth value for each lane.
pub trait Mask:
    Copy + Send + Sync + 'static + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self>
{
    /// How many lanes.
    const WIDTH: usize;

    /// Lane i is bit i; higher bits are not looked at.
    fn from_bits(bits: u32) -> Self;
    /// Bit i is lane i; higher bits are zero.
    fn bits(self) -> u32;

    /// No lane.
    #[inline(always)]
    fn none() -> Self {
        Self::from_bits(0)
    }
    /// Every lane.
    #[inline(always)]
    fn full() -> Self {
        Self::from_bits(u32::MAX)
    }
    /// The first `n` lanes; all if there are no more.
    #[inline(always)]
    fn first(n: usize) -> Self {
        Self::from_bits(if n < 32 { (1 << n) - 1 } else { u32::MAX })
    }
    /// self and not other.
    #[inline(always)]
    fn and_not(self, other: Self) -> Self {
        self & !other
    }
    /// Whether any lane is set.
    #[inline(always)]
    fn any(self) -> bool {
        self.bits() != 0
    }
    /// Whether every lane is set.
    #[inline(always)]
    fn all(self) -> bool {
        !(!self).any()
    }
}

/// An instruction set: its vectors of either precision, of the same size in bits.
pub trait Isa: Copy + Send + Sync + 'static {
    /// Which one it is.
    const SET: InstructionSet;
    /// Twice as many lanes as `F64`.
    type F32: Lanes<Scalar = f32>;
    /// Half as many lanes as `F32`.
    type F64: Lanes<Scalar = f64>;
    /// Eight lanes, or `F32` where that has fewer: for things that come in eights.
    type F32UpTo8: Lanes<Scalar = f32>;
    /// Four lanes: for things that come in fours.
    type F32x4: Lanes<Scalar = f32>;
    /// Four lanes, or `F64` where that has fewer.
    type F64UpTo4: Lanes<Scalar = f64>;

    /// The columns of the first rows of three. Panics if there are fewer than lanes.
    #[inline(always)]
    fn columns(rows: &[[f64; 3]]) -> [Self::F64; 3] {
        let rows = &rows[..Self::F64::WIDTH];
        axes!(|i| {
            let mut column = [0.0; MAX_WIDTH];
            for (to, row) in column.iter_mut().zip(rows) {
                *to = row[i];
            }
            Self::F64::load(&column)
        })
    }
    /// Four columns as four rows: lane j of number i becomes lane i of number j.
    #[inline(always)]
    fn transposed(columns: [Self::F32x4; 4]) -> [Self::F32x4; 4] {
        let mut rows = [[0.0; 4]; 4];
        for (i, column) in columns.into_iter().enumerate() {
            let mut numbers = [0.0; 4];
            column.store(&mut numbers);
            for (row, number) in rows.iter_mut().zip(numbers) {
                row[i] = number;
            }
        }
        rows.map(|row| Self::F32x4::load(&row))
    }
    /// The least and the greatest lane of each; without meaning if one is NaN.
    #[inline(always)]
    fn ranges(x: [Self::F32; 8]) -> [[f32; 2]; 8] {
        let mut ranges = [[0.0; 2]; 8];
        for i in 0..8 {
            ranges[i] = [x[i].horizontal_min(), -(-x[i]).horizontal_min()];
        }
        ranges
    }
    /// Rounds to nearest; the lanes of `low` come first.
    fn narrow(low: Self::F64, high: Self::F64) -> Self::F32;
    /// Exact; the first half of the lanes, then the second.
    fn widen(x: Self::F32) -> (Self::F64, Self::F64);
    /// The masks of the first and of the second half of the lanes.
    fn split(
        mask: <Self::F32 as Lanes>::Mask,
    ) -> (<Self::F64 as Lanes>::Mask, <Self::F64 as Lanes>::Mask);
    /// The opposite of `split`.
    fn join(
        low: <Self::F64 as Lanes>::Mask,
        high: <Self::F64 as Lanes>::Mask,
    ) -> <Self::F32 as Lanes>::Mask;

    /// Of eight pairs of a distance, not negative, and another number, those whose bit is set
    /// except that of the least distance, in the first places of `to`; that one, which is the largest
    /// number there is if no bit is set, and how many the others are. The distance is the upper half.
    /// Places after them get numbers without meaning. Panics if `to` is shorter than eight.
    #[inline(always)]
    fn without_least(
        set: u32,
        distances: &[f32; 8],
        numbers: &[u32; 8],
        to: &mut [u64],
    ) -> (u64, usize) {
        let to = &mut to[..8];
        let (mut count, mut least) = (0usize, u64::MAX);
        for i in 0..8 {
            let pair = u64::from(distances[i].to_bits()) << 32 | u64::from(numbers[i]);
            let is_set = set >> i & 1 != 0;
            let is_less = is_set && pair < least;
            // Of those so far the least has no place.
            to[count.saturating_sub(1)] = if is_less { least } else { pair };
            least = if is_less { pair } else { least };
            count += usize::from(is_set);
        }
        (least, count.saturating_sub(1))
    }

    /// Runs a task in a function of its own that is compiled for this set: the way into the set
    /// for [`dispatch`], and inside of it the way to keep large code out of line.
    fn call<T: Task>(task: T) -> T::Output;
}

/// The arithmetic operators of a vector type, one intrinsic each.
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
macro_rules! operators {
    ($name:ident: $($trait:ident $method:ident $intrinsic:ident),*) => {$(
        impl std::ops::$trait for $name {
            type Output = $name;
            #[inline(always)]
            fn $method(self, other: $name) -> $name {
                // SAFETY: the CPU has the instruction; see the head of `lanes`.
                $name(unsafe { $intrinsic(self.0, other.0) })
            }
        }
    )*};
}
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
use operators;
