//! y = 0, x² + z² ≤ r²: the plane's hit, trimmed.
use crate::lanes::Lanes;
use crate::scalar::Scalar;

use super::dop::difference_of_products;
use super::ray_lanes::{Intersect, RayLanes, distance_to_axis};
use super::ray_plane;

/// A disc about the origin.
#[derive(Clone, Debug)]
pub struct Disc<F> {
    radius: F,
}

impl<F: Scalar> Disc<F> {
    pub(super) fn new(radius: f64) -> Disc<F> {
        Disc {
            radius: F::from_f64(radius),
        }
    }
}

impl<F: Scalar> Intersect<F> for Disc<F> {
    #[inline(always)]
    fn intersect<L: Lanes<Scalar = F>>(&self, ray: &RayLanes<L>, active: L::Mask) -> (L::Mask, L) {
        let (crossing, t) = ray_plane::intersect(ray, active);
        let [x, _, z] = ray.at(t);
        let r = L::splat(self.radius);
        let room = z.neg_mul_add(z, difference_of_products(r, r, x, x));
        (crossing & room.ge(L::zero()), t)
    }
}

impl Disc<f64> {
    #[inline(always)]
    pub(super) fn surface<L: Lanes<Scalar = f64>>(&self, p: [L; 3]) -> ([L; 3], [L; 3]) {
        let rho = distance_to_axis(p);
        let shrink = (L::splat(self.radius) / rho).min(L::splat(1.0));
        (
            [p[0] * shrink, L::zero(), p[2] * shrink],
            L::splats([0.0, 1.0, 0.0]),
        )
    }
}
