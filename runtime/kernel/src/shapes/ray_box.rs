//! low ≤ p ≤ high: what the slabs of the three axes have in common.
//!
//! The ends are (face − o)/d, not (face − o)·(1/d): within an ulp (Kay and Kajiya 1986; the
//! divisions by zero of axis-parallel rays fall through as in Ize, JCGT 2(2) 2013).
use crate::lanes::{Lanes, Mask, axes};
use crate::scalar::Scalar;

use super::ray_lanes::{Intersect, RayLanes, Span, clamped};

/// A box with its faces at right angles to the axes.
#[derive(Clone, Debug)]
pub struct Cuboid<F> {
    low: [F; 3],
    high: [F; 3],
}

impl<F: Scalar> Cuboid<F> {
    pub(super) fn new(low: [f64; 3], high: [f64; 3]) -> Cuboid<F> {
        Cuboid {
            low: low.map(F::from_f64),
            high: high.map(F::from_f64),
        }
    }

    #[inline(always)]
    pub(super) fn span<L: Lanes<Scalar = F>>(&self, ray: &RayLanes<L>) -> Span<L> {
        let (low, high) = (L::splats(self.low), L::splats(self.high));
        let [x, y, z] = axes!(|i| Span::slab(ray.o[i], ray.d[i], low[i], high[i]));
        Span::line().and(x).and(y).and(z)
    }
}

impl<F: Scalar> Intersect<F> for Cuboid<F> {
    #[inline(always)]
    fn intersect<L: Lanes<Scalar = F>>(&self, ray: &RayLanes<L>, active: L::Mask) -> (L::Mask, L) {
        self.span(ray).nearest(ray, active)
    }
}

impl Cuboid<f64> {
    #[inline(always)]
    pub(super) fn surface<L: Lanes<Scalar = f64>>(
        &self,
        p: [L; 3],
        before: [L; 3],
        room: L,
    ) -> ([L; 3], [L; 3]) {
        let (low, high) = (L::splats(self.low), L::splats(self.high));
        let below: [L::Mask; 3] = axes!(|i| (low[i] - p[i]).gt(p[i] - high[i]));
        let outside: [L; 3] = axes!(|i| (low[i] - p[i]).max(p[i] - high[i]));
        let first = outside[0].ge(outside[1]) & outside[0].ge(outside[2]);
        let second = outside[1].ge(outside[2]).and_not(first);
        let nearest = [first, second, !(first | second)];
        let (zero, one) = (L::zero(), L::splat(1.0));
        let point = axes!(|i| {
            let face = L::select(below[i], low[i], high[i]);
            L::select(
                nearest[i],
                face,
                clamped(p[i], before[i], low[i], high[i], room),
            )
        });
        let normal = axes!(|i| L::select(nearest[i], L::select(below[i], -one, one), zero));
        (point, normal)
    }
}
