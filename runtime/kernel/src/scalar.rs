//! The two precisions an intersector can be built in.
use std::fmt::{Debug, Display};

use crate::lanes::Lanes;

/// `f32` or `f64`: also a [`Lanes`] of width one, so that scalar code is the same code.
pub trait Scalar:
    Lanes<Scalar = Self, Mask = bool> + PartialEq + PartialOrd + Debug + Display + Default
{
    /// Unit roundoff: half the distance from 1 to the next number.
    const EPS: Self;
    /// One.
    const ONE: Self;
    /// Positive infinity.
    const INFINITY: Self;
    /// Least positive normal number.
    const MIN_POSITIVE: Self;

    /// The bits of the exponent.
    const EXPONENT_BITS: u64;
    /// The bits of 2^e from these leave the bits of 2^−e.
    const UNIT_SCALE_BITS: u64;

    /// Nearest value.
    fn from_f64(x: f64) -> Self;
    /// Exact.
    fn to_f64(self) -> f64;
    /// The value whose bits are the low bits of `bits`.
    fn from_bits(bits: u64) -> Self;
    /// The bits, zero extended.
    fn to_bits(self) -> u64;
}

impl Scalar for f32 {
    const EPS: f32 = f32::EPSILON / 2.0;
    const ONE: f32 = 1.0;
    const INFINITY: f32 = f32::INFINITY;
    const MIN_POSITIVE: f32 = f32::MIN_POSITIVE;
    const EXPONENT_BITS: u64 = 0x7f80_0000;
    const UNIT_SCALE_BITS: u64 = 0x7f00_0000;

    #[inline(always)]
    fn from_f64(x: f64) -> f32 {
        x as f32
    }
    #[inline(always)]
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
    #[inline(always)]
    fn from_bits(bits: u64) -> f32 {
        f32::from_bits(bits as u32)
    }
    #[inline(always)]
    fn to_bits(self) -> u64 {
        u64::from(f32::to_bits(self))
    }
}

impl Scalar for f64 {
    const EPS: f64 = f64::EPSILON / 2.0;
    const ONE: f64 = 1.0;
    const INFINITY: f64 = f64::INFINITY;
    const MIN_POSITIVE: f64 = f64::MIN_POSITIVE;
    const EXPONENT_BITS: u64 = 0x7ff0_0000_0000_0000;
    const UNIT_SCALE_BITS: u64 = 0x7fe0_0000_0000_0000;

    #[inline(always)]
    fn from_f64(x: f64) -> f64 {
        x
    }
    #[inline(always)]
    fn to_f64(self) -> f64 {
        self
    }
    #[inline(always)]
    fn from_bits(bits: u64) -> f64 {
        f64::from_bits(bits)
    }
    #[inline(always)]
    fn to_bits(self) -> u64 {
        f64::to_bits(self)
    }
}
