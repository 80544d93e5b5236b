//! What the rays of a packet have found so far.
use super::Nearest;
use super::precision::{Halves, PacketMask};
use crate::lanes::{Isa, Lanes};

type F64Mask<I> = <<I as Isa>::F64 as Lanes>::Mask;

/// The nearest hits so far.
pub struct Best<I: Isa> {
    pub t: Halves<I::F64>,
    /// Leaf numbers, which are exact in f64; −1 where nothing was hit.
    pub leaf: Halves<I::F64>,
    pub triangle: Halves<I::F64>,
}

impl<I: Isa> Best<I> {
    /// Of one ray.
    #[inline(always)]
    pub fn get(&self, lane: usize) -> Nearest {
        let (half, place) = (lane / I::F64::WIDTH, lane % I::F64::WIDTH);
        Nearest {
            t: self.t[half].get(place),
            leaf: self.leaf[half].get(place) as i64,
            triangle: self.triangle[half].get(place) as u32,
        }
    }

    /// Replaces that of one ray.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, nearest: Nearest) {
        let (half, place) = (lane / I::F64::WIDTH, lane % I::F64::WIDTH);
        self.t[half] = self.t[half].with(place, nearest.t);
        self.leaf[half] = self.leaf[half].with(place, nearest.leaf as f64);
        self.triangle[half] = self.triangle[half].with(place, f64::from(nearest.triangle));
    }

    /// Takes the hits that are nearer, or as near and of a lower leaf or triangle; which these
    /// were. With ANY only tells which are near enough.
    #[inline(always)]
    pub fn offer<const ANY: bool>(
        &mut self,
        hit: PacketMask<I>,
        t: &Halves<I::F64>,
        leaf: i64,
        triangle: u32,
    ) -> PacketMask<I> {
        let hit = I::split(hit);
        if ANY {
            return I::join(hit.0 & t[0].lt(self.t[0]), hit.1 & t[1].lt(self.t[1]));
        }
        let leaf = I::F64::splat(leaf as f64);
        let triangle = I::F64::splat(f64::from(triangle));
        let low = self.offer_half(0, hit.0, t[0], leaf, triangle);
        let high = self.offer_half(1, hit.1, t[1], leaf, triangle);
        I::join(low, high)
    }

    #[inline(always)]
    fn offer_half(
        &mut self,
        h: usize,
        hit: F64Mask<I>,
        t: I::F64,
        leaf: I::F64,
        triangle: I::F64,
    ) -> F64Mask<I> {
        let lower = leaf.lt(self.leaf[h]) | (leaf.eq(self.leaf[h]) & triangle.lt(self.triangle[h]));
        let taken = hit & (t.lt(self.t[h]) | (t.eq(self.t[h]) & lower));
        self.t[h] = I::F64::select(taken, t, self.t[h]);
        self.leaf[h] = I::F64::select(taken, leaf, self.leaf[h]);
        self.triangle[h] = I::F64::select(taken, triangle, self.triangle[h]);
        taken
    }
}
