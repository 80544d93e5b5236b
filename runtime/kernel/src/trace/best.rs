//! What the rays of a packet have found so far.
use super::Nearest;
use super::precision::{Halves, PacketMask};
use crate::lanes::{Isa, Lanes, MAX_WIDTH, halves, take_bit};

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

    /// Replaces those of some rays, given as bits, by what these have found by now; which of these
    /// found anything, as bits.
    #[inline(always)]
    pub fn replace(&mut self, mut rays: u32, found: &[Nearest; MAX_WIDTH]) -> u32 {
        let mut hit = 0;
        // All at once: a vector that a number was just written into is slow to load.
        let mut columns = [[0.0; MAX_WIDTH]; 3];
        for (column, halves) in columns.iter_mut().zip([self.t, self.leaf, self.triangle]) {
            halves[0].store(column);
            halves[1].store(&mut column[I::F64::WIDTH..]);
        }
        let [t, leaf, triangle] = &mut columns;
        while let Some(lane) = take_bit(&mut rays) {
            let nearest = found[lane];
            let (new_leaf, new_triangle) = (nearest.leaf as f64, f64::from(nearest.triangle));
            if (nearest.t, new_leaf, new_triangle) != (t[lane], leaf[lane], triangle[lane]) {
                hit |= 1 << lane;
                (t[lane], leaf[lane], triangle[lane]) = (nearest.t, new_leaf, new_triangle);
            }
        }
        if hit != 0 {
            self.t = halves!(|h| I::F64::load(&t[h * I::F64::WIDTH..]));
            self.leaf = halves!(|h| I::F64::load(&leaf[h * I::F64::WIDTH..]));
            self.triangle = halves!(|h| I::F64::load(&triangle[h * I::F64::WIDTH..]));
        }
        hit
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
