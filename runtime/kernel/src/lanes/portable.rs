//! Lanes as arrays of scalars: right on every machine, and the model the other sets must match.
use std::array;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

use super::{InstructionSet, Isa, Lanes, Mask, Task};
use crate::scalar::Scalar;

/// N numbers.
#[derive(Clone, Copy)]
pub struct Array<S, const N: usize>([S; N]);

/// N truth values.
#[derive(Clone, Copy)]
pub struct Bools<const N: usize>([bool; N]);

macro_rules! operators {
    ($($trait:ident $method:ident $symbol:tt),*) => {$(
        impl<S: Scalar, const N: usize> $trait for Array<S, N> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(array::from_fn(|i| self.0[i] $symbol other.0[i]))
            }
        }
    )*};
}
operators!(Add add +, Sub sub -, Mul mul *, Div div /);

impl<S: Scalar, const N: usize> Neg for Array<S, N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0.map(|x| -x))
    }
}

impl<S: Scalar, const N: usize> Lanes for Array<S, N> {
    type Scalar = S;
    type Mask = Bools<N>;
    const WIDTH: usize = N;

    #[inline(always)]
    fn splat(x: S) -> Self {
        Self([x; N])
    }
    #[inline(always)]
    fn load(from: &[S]) -> Self {
        let from = &from[..N];
        Self(array::from_fn(|i| from[i]))
    }
    #[inline(always)]
    fn store(self, to: &mut [S]) {
        to[..N].copy_from_slice(&self.0);
    }
    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        Self(array::from_fn(|i| self.0[i].mul_add(a.0[i], b.0[i])))
    }
    #[inline(always)]
    fn neg_mul_add(self, a: Self, b: Self) -> Self {
        Self(array::from_fn(|i| self.0[i].neg_mul_add(a.0[i], b.0[i])))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.map(Lanes::sqrt))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.map(Lanes::abs))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(array::from_fn(|i| self.0[i].min(other.0[i])))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(array::from_fn(|i| self.0[i].max(other.0[i])))
    }
    #[inline(always)]
    fn copy_sign(self, sign: Self) -> Self {
        Self(array::from_fn(|i| self.0[i].copy_sign(sign.0[i])))
    }
    #[inline(always)]
    fn unit_scale(self) -> Self {
        Self(self.0.map(Lanes::unit_scale))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Bools<N> {
        Bools(array::from_fn(|i| self.0[i] < other.0[i]))
    }
    #[inline(always)]
    fn le(self, other: Self) -> Bools<N> {
        Bools(array::from_fn(|i| self.0[i] <= other.0[i]))
    }
    #[inline(always)]
    fn eq(self, other: Self) -> Bools<N> {
        Bools(array::from_fn(|i| self.0[i] == other.0[i]))
    }
    #[inline(always)]
    fn select(mask: Bools<N>, yes: Self, no: Self) -> Self {
        Self(array::from_fn(
            |i| if mask.0[i] { yes.0[i] } else { no.0[i] },
        ))
    }
}

impl<const N: usize> BitAnd for Bools<N> {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(array::from_fn(|i| self.0[i] & other.0[i]))
    }
}

impl<const N: usize> BitOr for Bools<N> {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(array::from_fn(|i| self.0[i] | other.0[i]))
    }
}

impl<const N: usize> Not for Bools<N> {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(self.0.map(|x| !x))
    }
}

impl<const N: usize> Mask for Bools<N> {
    const WIDTH: usize = N;

    #[inline(always)]
    fn from_bits(bits: u32) -> Self {
        Self(array::from_fn(|i| bits >> i & 1 != 0))
    }
    #[inline(always)]
    fn bits(self) -> u32 {
        (0..N).fold(0, |bits, i| bits | u32::from(self.0[i]) << i)
    }
}

/// Whatever the target is compiled for.
#[derive(Clone, Copy)]
pub struct Portable;

impl Isa for Portable {
    const SET: InstructionSet = InstructionSet::Portable;
    type F32 = Array<f32, 4>;
    type F64 = Array<f64, 2>;
    type F32UpTo8 = Array<f32, 4>;
    type F32x4 = Array<f32, 4>;
    type F64UpTo4 = Array<f64, 2>;

    #[inline(always)]
    fn narrow(low: Self::F64, high: Self::F64) -> Self::F32 {
        Array([
            low.0[0] as f32,
            low.0[1] as f32,
            high.0[0] as f32,
            high.0[1] as f32,
        ])
    }
    #[inline(always)]
    fn widen(x: Self::F32) -> (Self::F64, Self::F64) {
        let [a, b, c, d] = x.0.map(f64::from);
        (Array([a, b]), Array([c, d]))
    }
    #[inline(always)]
    fn split(mask: Bools<4>) -> (Bools<2>, Bools<2>) {
        let [a, b, c, d] = mask.0;
        (Bools([a, b]), Bools([c, d]))
    }
    #[inline(always)]
    fn join(low: Bools<2>, high: Bools<2>) -> Bools<4> {
        Bools([low.0[0], low.0[1], high.0[0], high.0[1]])
    }

    #[inline(never)]
    fn call<T: Task>(task: T) -> T::Output {
        task.run::<Portable>()
    }
}
