//! A box with rounded edges: its core is the box inset by b on every side.
//!
//! From p the core's nearest point differs along those axes where p is beyond it: e_i = p_i −
//! high_i or p_i − low_i, else 0. δ = |e|, δ' = e·d/|e|.
use crate::lanes::{Lanes, axes};
use crate::scalar::Scalar;

use super::dilation::{self, Dilated, with_others};
use super::dop::dot;
use super::ray_box::Cuboid;
use super::ray_lanes::{Intersect, RayLanes, Span};

/// A box all of whose edges are rounded.
#[derive(Clone, Debug)]
pub struct BevelledBox<F> {
    plain: Cuboid<F>,
    low: [F; 3],
    high: [F; 3],
    bevel: F,
}

impl<F: Scalar> BevelledBox<F> {
    pub(super) fn new(low: [f64; 3], high: [f64; 3], bevel: f64) -> BevelledBox<F> {
        BevelledBox {
            plain: Cuboid::new(low, high),
            low: low.map(|x| F::from_f64(x + bevel)),
            high: high.map(|x| F::from_f64(x - bevel)),
            bevel: F::from_f64(bevel),
        }
    }

    /// From the core's nearest point to p.
    #[inline(always)]
    fn offset<L: Lanes<Scalar = F>>(&self, p: [L; 3]) -> [L; 3] {
        let zero = L::zero();
        let (low, high) = (L::splats(self.low), L::splats(self.high));
        axes!(|i| (p[i] - high[i]).max(zero) + (p[i] - low[i]).min(zero))
    }
}

impl<F: Scalar> Dilated<F> for BevelledBox<F> {
    #[inline(always)]
    fn bevel(&self) -> F {
        self.bevel
    }

    #[inline(always)]
    fn plain<L: Lanes<Scalar = F>>(&self, ray: &RayLanes<L>) -> Span<L> {
        self.plain.span(ray)
    }

    #[inline(always)]
    fn distance<L: Lanes<Scalar = F>>(&self, p: [L; 3], d: [L; 3]) -> (L, L) {
        let e = self.offset(p);
        let distance = dot(e, e).sqrt();
        (distance, dot(e, d) / distance)
    }
}

impl<F: Scalar> Intersect<F> for BevelledBox<F> {
    #[inline(always)]
    fn intersect<L: Lanes<Scalar = F>>(&self, ray: &RayLanes<L>, active: L::Mask) -> (L::Mask, L) {
        dilation::intersect(self, ray, active)
    }
}

impl BevelledBox<f64> {
    #[inline(always)]
    pub(super) fn surface<L: Lanes<Scalar = f64>>(&self, p: [L; 3]) -> ([L; 3], [L; 3]) {
        let e = self.offset(p);
        let distance = dot(e, e).sqrt();
        let bevel = L::splat(self.bevel);
        let normal = axes!(|i| e[i] / distance);
        let point = axes!(|i| bevel.mul_add(normal[i], p[i] - e[i]));
        with_others((point, normal), distance.eq(L::zero()), || {
            self.plain.surface(p, p, L::zero())
        })
    }
}
