//! y = 0, |x| ≤ a, |z| ≤ b: the plane's hit, trimmed.
use crate::lanes::Lanes;
use crate::scalar::Scalar;

use super::ray_lanes::{Intersect, RayLanes};
use super::ray_plane;

/// A rectangle about the origin.
#[derive(Clone, Debug)]
pub struct Rectangle<F> {
    /// Half the sizes in x and z.
    half: [F; 2],
}

impl<F: Scalar> Rectangle<F> {
    pub(super) fn new(half: [f64; 2]) -> Rectangle<F> {
        Rectangle {
            half: half.map(F::from_f64),
        }
    }
}

impl<F: Scalar> Intersect<F> for Rectangle<F> {
    #[inline(always)]
    fn intersect<L: Lanes<Scalar = F>>(&self, ray: &RayLanes<L>, active: L::Mask) -> (L::Mask, L) {
        let (crossing, t) = ray_plane::intersect(ray, active);
        let [x, _, z] = ray.at(t);
        let [a, b] = L::splats(self.half);
        (crossing & x.abs().le(a) & z.abs().le(b), t)
    }
}

impl Rectangle<f64> {
    #[inline(always)]
    pub(super) fn surface<L: Lanes<Scalar = f64>>(&self, p: [L; 3]) -> ([L; 3], [L; 3]) {
        let [a, b] = L::splats(self.half);
        (
            [p[0].max(-a).min(a), L::zero(), p[2].max(-b).min(b)],
            L::splats([0.0, 1.0, 0.0]),
        )
    }
}
