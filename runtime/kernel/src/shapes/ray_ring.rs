//! r0 ≤ ρ ≤ r1, y0 ≤ y ≤ y1: a cylinder less the bar within it.
//!
//! Along a ray the cylinder is one stretch and the bar another; a ray crosses the surface at an end
//! of either that the other does not rule out.
use crate::lanes::{Lanes, Mask};
use crate::scalar::Scalar;

use super::ray_cylinder::Cylinder;
use super::ray_lanes::{Intersect, RayLanes, Span, clamped, distance_to_axis};

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
    let exists = solid.exists();
    let mut first = L::splat(L::Scalar::INFINITY);
    first = earlier(
        ray,
        first,
        solid.near,
        exists & is_free(solid.near, &holes, N),
    );
    first = earlier(
        ray,
        first,
        solid.far,
        exists & is_free(solid.far, &holes, N),
    );
    for (i, &hole) in holes.iter().enumerate() {
        let real = exists & hole.near.lt(hole.far);
        let near = real & solid.contains(hole.near) & is_free(hole.near, &holes, i);
        let far = real & solid.contains(hole.far) & is_free(hole.far, &holes, i);
        first = earlier(ray, first, hole.near, near);
        first = earlier(ray, first, hole.far, far);
    }
    (active & first.lt(L::splat(L::Scalar::INFINITY)), first)
}

/// The lesser of `first` and t where that is valid and the ray accepts it.
#[inline(always)]
fn earlier<L: Lanes>(ray: &RayLanes<L>, first: L, t: L, valid: L::Mask) -> L {
    L::select(valid & ray.accepts(t) & t.lt(first), t, first)
}

/// Whether t is in none of the holes but perhaps in its own.
#[inline(always)]
fn is_free<L: Lanes, const N: usize>(t: L, holes: &[Span<L>; N], own: usize) -> L::Mask {
    let mut free = L::Mask::full();
    for (i, hole) in holes.iter().enumerate() {
        if i != own {
            free = free.and_not(hole.contains(t));
        }
    }
    free
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
    /// The point keeps `room` from the edges.
    #[inline(always)]
    pub(super) fn nearest_face<L: Lanes<Scalar = f64>>(
        &self,
        p: [L; 3],
        before: [L; 3],
        room: L,
    ) -> (L, [L; 3], [L; 3]) {
        let rho = distance_to_axis(p);
        let (bore, radius) = (L::splat(self.bore), L::splat(self.outer.radius()));
        let [low, high] = L::splats(self.outer.y());
        let unit = L::splat(1.0) / rho;
        let (u, w) = (p[0] * unit, p[2] * unit);
        let outside = (rho - radius).max(low - p[1]).max(p[1] - high);
        let inner = (bore - rho).gt(outside);
        let (point, normal) = self.outer.surface(p, before, room);
        let cap = !normal[1].eq(L::zero());
        let around = L::select(
            inner,
            bore,
            clamped(rho, distance_to_axis(before), bore, radius, room),
        );
        let turned = inner | cap;
        let wall = clamped(p[1], before[1], low, high, room);
        (
            L::select(inner, bore - rho, outside),
            [
                L::select(turned, around * u, point[0]),
                L::select(inner, wall, point[1]),
                L::select(turned, around * w, point[2]),
            ],
            [
                L::select(inner, -u, normal[0]),
                L::select(inner, L::zero(), normal[1]),
                L::select(inner, -w, normal[2]),
            ],
        )
    }

    pub(super) fn radii(&self) -> [f64; 2] {
        [self.bore, self.outer.radius()]
    }

    pub(super) fn y(&self) -> [f64; 2] {
        self.outer.y()
    }

    #[inline(always)]
    pub(super) fn surface<L: Lanes<Scalar = f64>>(
        &self,
        p: [L; 3],
        before: [L; 3],
        room: L,
    ) -> ([L; 3], [L; 3]) {
        let (_, point, normal) = self.nearest_face(p, before, room);
        (point, normal)
    }
}
