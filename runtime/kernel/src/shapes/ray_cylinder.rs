//! ρ ≤ r, y0 ≤ y ≤ y1: what a bar about the y axis and a slab have in common.
//!
//! Both are convex, so the solid is one stretch of the ray and caps and side cannot part.
use crate::lanes::Lanes;
use crate::scalar::Scalar;

use super::ray_lanes::{Intersect, RayLanes, Span, clamped};

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
    pub(super) fn surface(&self, p: [f64; 3], room: f64) -> ([f64; 3], [f64; 3]) {
        let [x, y, z] = p;
        let rho = x.hypot(z);
        let [low, high] = self.y;
        let above = if low - y > y - high { -1.0 } else { 1.0 };
        if (low - y).max(y - high) > rho - self.radius {
            let shrink = clamped(rho, -self.radius, self.radius, room) / rho.max(f64::MIN_POSITIVE);
            let cap = if above < 0.0 { low } else { high };
            ([x * shrink, cap, z * shrink], [0.0, above, 0.0])
        } else {
            let (x, z) = (x / rho, z / rho);
            (
                [
                    self.radius * x,
                    clamped(y, low, high, room),
                    self.radius * z,
                ],
                [x, 0.0, z],
            )
        }
    }
}
