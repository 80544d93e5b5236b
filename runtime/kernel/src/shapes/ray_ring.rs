//! r0 ≤ ρ ≤ r1, y0 ≤ y ≤ y1: a cylinder less the bar within it.
//!
//! Along a ray the cylinder is one stretch and the bar another; a ray crosses the surface at an end of
//! either that the other does not rule out.
use crate::lanes::{Lanes, Mask};
use crate::scalar::Scalar;

use super::ray_cylinder::Cylinder;
use super::ray_lanes::{Intersect, RayLanes, Span};

/// A hollow cylinder about the y axis.
#[derive(Clone, Debug)]
pub struct Ring<F> {
    outer: Cylinder<F>,
    bore: F,
}

/// The first end that the ray accepts of what is left of a stretch when others are taken out.
#[inline(always)]
pub(super) fn first_end<L: Lanes, const N: usize>(
    ray: &RayLanes<L>,
    solid: Span<L>,
    holes: [Span<L>; N],
    active: L::Mask,
) -> (L::Mask, L) {
    let infinity = L::splat(L::Scalar::INFINITY);
    let mut first = infinity;
    let mut consider = |t: L, valid: L::Mask| {
        first = L::select(valid & ray.accepts(t), t, first).min(first);
    };
    let free = |t: L, own: usize| {
        (0..N).fold(L::Mask::full(), |free, i| {
            if i == own {
                free
            } else {
                free.and_not(holes[i].contains(t))
            }
        })
    };
    let exists = solid.exists();
    consider(solid.near, exists & free(solid.near, N));
    consider(solid.far, exists & free(solid.far, N));
    for (i, hole) in holes.into_iter().enumerate() {
        let real = exists & hole.near.lt(hole.far);
        consider(
            hole.near,
            real & solid.contains(hole.near) & free(hole.near, i),
        );
        consider(
            hole.far,
            real & solid.contains(hole.far) & free(hole.far, i),
        );
    }
    (active & first.lt(infinity), first)
}

impl<F: Scalar> Ring<F> {
    pub(super) fn new(r: [f64; 2], y: [f64; 2]) -> Ring<F> {
        Ring {
            outer: Cylinder::new(r[1], y),
            bore: F::from_f64(r[0]),
        }
    }

    /// The stretches of the whole cylinder, and of the bar within.
    #[inline(always)]
    pub(super) fn spans<L: Lanes<Scalar = F>>(&self, ray: &RayLanes<L>) -> (Span<L>, Span<L>) {
        (
            self.outer.span(ray),
            Span::bar(ray.o, ray.d, L::splat(self.bore)),
        )
    }
}

impl<F: Scalar> Intersect<F> for Ring<F> {
    #[inline(always)]
    fn intersect<L: Lanes<Scalar = F>>(&self, ray: &RayLanes<L>, active: L::Mask) -> (L::Mask, L) {
        let (outer, bore) = self.spans(ray);
        first_end(ray, outer, [bore], active)
    }
}

impl Ring<f64> {
    /// How far outside the nearest face p is (negative inside), and that face's point and normal.
    pub(super) fn nearest_face(&self, p: [f64; 3]) -> (f64, [f64; 3], [f64; 3]) {
        let rho = p[0].hypot(p[2]);
        let (u, w) = (p[0] / rho, p[2] / rho);
        let [low, high] = self.outer.y();
        if self.bore - rho > (rho - self.outer.radius()).max(low - p[1]).max(p[1] - high) {
            let point = [self.bore * u, p[1].clamp(low, high), self.bore * w];
            return (self.bore - rho, point, [-u, 0.0, -w]);
        }
        let outside = (rho - self.outer.radius()).max(low - p[1]).max(p[1] - high);
        let (point, normal) = self.outer.surface(p);
        (outside, point, normal)
    }

    pub(super) fn surface(&self, p: [f64; 3]) -> ([f64; 3], [f64; 3]) {
        let (_, point, normal) = self.nearest_face(p);
        (point, normal)
    }
}
