//! |p| ≤ r.
//!
//! The closest approach to the centre is l = o + t_c d, t_c = −o·d / d·d, taken twice so that l
//! is at right angles to d to working precision however far off o is; t = t_c ± √((r² − l²)/d·d).
//! After Haines, Günther, Akenine-Möller, "Precision improvements for ray/sphere intersection",
//! Ray Tracing Gems ch. 7 (2019); the second pass is ours. r² − l² is formed by fused steps from
//! r², so that next to a grazing ray the decision is right to 2 ulps of r.
use crate::lanes::Lanes;
use crate::scalar::Scalar;

use super::dop::{difference_of_products, dot};
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
        let (o, d) = (ray.o, ray.d);
        let r = L::splat(self.radius);
        let inverse = L::splat(F::ONE) / dot(d, d);
        let first = -(dot(o, d) * inverse);
        let l = ray.at(first);
        let second = -(dot(l, d) * inverse);
        let l = [0, 1, 2].map(|i| second.mul_add(d[i], l[i]));
        let room = l[2].neg_mul_add(
            l[2],
            l[1].neg_mul_add(l[1], difference_of_products(r, r, l[0], l[0])),
        );
        let half = (room * inverse).sqrt();
        let span = Span {
            near: first + (second - half),
            far: first + (second + half),
        };
        span.nearest(ray, active)
    }
}

impl Sphere<f64> {
    pub(super) fn surface(&self, p: [f64; 3]) -> ([f64; 3], [f64; 3]) {
        let length = dot(p, p).sqrt();
        let normal = if length > 0.0 {
            p.map(|x| x / length)
        } else {
            [0.0, 1.0, 0.0]
        };
        (normal.map(|x| self.radius * x), normal)
    }
}
