//! y = 0, unbounded.
//!
//! t = −o_y/d_y: half an ulp. A ray in the plane divides 0 by 0, and NaN hits nothing.
use crate::lanes::Lanes;

use super::ray_lanes::RayLanes;

/// Where rays cross y = 0, if the ray accepts it.
#[inline(always)]
pub(super) fn intersect<L: Lanes>(ray: &RayLanes<L>, active: L::Mask) -> (L::Mask, L) {
    let t = -(ray.o[1] / ray.d[1]);
    (active & ray.accepts(t), t)
}

#[inline(always)]
pub(super) fn surface<L: Lanes<Scalar = f64>>(p: [L; 3]) -> ([L; 3], [L; 3]) {
    ([p[0], L::zero(), p[2]], L::splats([0.0, 1.0, 0.0]))
}
