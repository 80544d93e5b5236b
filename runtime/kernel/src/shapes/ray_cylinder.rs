//! ρ ≤ r, y0 ≤ y ≤ y1: what a bar about the y axis and a slab have in common.
//!
//! Both are convex, so the solid is one stretch of the ray and caps and side cannot part.
use crate::lanes::Lanes;
use crate::scalar::Scalar;

use super::ray_lanes::{Intersect, RayLanes, Span, clamped, distance_to_axis};

/// A capped cylinder about the y axis.
#[derive(Clone, Debug)]
pub struct Cylinder<F> {
    radius: F,
    y: [F; 2],
}

impl<F: Scalar> Cylinder<F> {
    pub(super) fn new(radius: f64, y: [f64; 2]) -> Cylinder<F> {
        Cylinder {
            radius: F::from_f64(radius),
            y: y.map(F::from_f64),
        }
    }

    #[inline(always)]
    pub(super) fn span<L: Lanes<Scalar = F>>(&self, ray: &RayLanes<L>) -> Span<L> {
        let [low, high] = L::splats(self.y);
        Span::bar(ray.o, ray.d, L::splat(self.radius))
            .and(Span::slab(ray.o[1], ray.d[1], low, high))
    }
}

impl<F: Scalar> Intersect<F> for Cylinder<F> {
    #[inline(always)]
    fn intersect<L: Lanes<Scalar = F>>(&self, ray: &RayLanes<L>, active: L::Mask) -> (L::Mask, L) {
        self.span(ray).nearest(ray, active)
    }
}

impl Cylinder<f64> {
    pub(super) fn radius(&self) -> f64 {
        self.radius
    }

    pub(super) fn y(&self) -> [f64; 2] {
        self.y
    }

    #[inline(always)]
    pub(super) fn surface<L: Lanes<Scalar = f64>>(
        &self,
        [x, y, z]: [L; 3],
        before: [L; 3],
        room: L,
    ) -> ([L; 3], [L; 3]) {
        let (zero, one) = (L::zero(), L::splat(1.0));
        let rho = distance_to_axis([x, y, z]);
        let (radius, [low, high]) = (L::splat(self.radius), L::splats(self.y));
        let below = (low - y).gt(y - high);
        let cap = (low - y).max(y - high).gt(rho - radius);
        let kept = clamped(rho, distance_to_axis(before), -radius, radius, room);
        let shrink = L::select(cap, kept, radius) / rho.max(L::splat(f64::MIN_POSITIVE));
        let unit = one / rho;
        let level = L::select(below, low, high);
        let point = [
            x * shrink,
            L::select(cap, level, clamped(y, before[1], low, high, room)),
            z * shrink,
        ];
        let normal = [
            L::select(cap, zero, x * unit),
            L::select(cap, L::select(below, -one, one), zero),
            L::select(cap, zero, z * unit),
        ];
        (point, normal)
    }
}
