//! low ≤ p ≤ high: what the slabs of the three axes have in common.
//!
//! The ends are (face − o)/d, not (face − o)·(1/d): within an ulp (Kay and Kajiya 1986; the
//! divisions by zero of axis-parallel rays fall through as in Ize, JCGT 2(2) 2013).
use crate::lanes::{Lanes, axes};
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
    pub(super) fn surface(&self, p: [f64; 3], room: f64) -> ([f64; 3], [f64; 3]) {
        let mut axis = 0;
        let mut nearest = f64::NEG_INFINITY;
        let mut point = p;
        for i in 0..3 {
            let outside = (self.low[i] - p[i]).max(p[i] - self.high[i]);
            if outside > nearest {
                (nearest, axis) = (outside, i);
            }
            point[i] = clamped(p[i], self.low[i], self.high[i], room);
        }
        let mut normal = [0.0; 3];
        let below = self.low[axis] - p[axis] > p[axis] - self.high[axis];
        point[axis] = if below {
            self.low[axis]
        } else {
            self.high[axis]
        };
        normal[axis] = if below { -1.0 } else { 1.0 };
        (point, normal)
    }
}
