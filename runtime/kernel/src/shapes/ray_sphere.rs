//! |p| ≤ r: a ball about the origin, see [`Span::ball`].
use crate::lanes::{Lanes, axes};
use crate::scalar::Scalar;

use super::dop::dot;
use super::ray_lanes::{Intersect, RayLanes, Span};

/// A ball about the origin.
#[derive(Clone, Debug)]
pub struct Sphere<F> {
    radius: F,
}

impl<F: Scalar> Sphere<F> {
    pub(super) fn new(radius: f64) -> Sphere<F> {
        Sphere {
            radius: F::from_f64(radius),
        }
    }
}

impl<F: Scalar> Intersect<F> for Sphere<F> {
    #[inline(always)]
    fn intersect<L: Lanes<Scalar = F>>(&self, ray: &RayLanes<L>, active: L::Mask) -> (L::Mask, L) {
        Span::ball(ray.o, ray.d, L::splat(self.radius)).nearest(ray, active)
    }
}

impl Sphere<f64> {
    #[inline(always)]
    pub(super) fn surface<L: Lanes<Scalar = f64>>(&self, p: [L; 3]) -> ([L; 3], [L; 3]) {
        let length = dot(p, p).sqrt();
        let off_centre = length.gt(L::zero());
        let unit = L::splat(1.0) / length;
        let up = L::splats([0.0, 1.0, 0.0]);
        let normal = axes!(|i| L::select(off_centre, p[i] * unit, up[i]));
        let radius = L::splat(self.radius);
        (axes!(|i| radius * normal[i]), normal)
    }
}
