//! A cone with rounded rim and tip: its core is the similar cone whose faces lie b deep.
//!
//! With γ the half angle, sin γ = r/L, cos γ = h/L, L = √(h² + r²): base y = b of radius R = r − b
//! (1 + sin γ)/cos γ, apex h − b/sin γ. In the half-plane of ρ and y, seen from the rim, w = (ρ −
//! R, y − b); along the slant s = −w_ρ sin γ + w_y cos γ, away from it n = w_ρ cos γ + w_y sin γ.
//! The core's nearest point to p is
//!
//!   on the slant, e = n (cos γ, sin γ), if 0 ≤ s ≤ S; the apex, e = (ρ, y − apex), if s > S;
//!   below the slant (s < 0) the rim, e = w, or, where ρ ≤ R, the base, e = (0, w_y).
//!
//! δ = |e|, δ' = (e_ρ ρ' + e_y d_y)/|e|.
use crate::lanes::{Lanes, Mask};
use crate::scalar::Scalar;

use super::dilation::{self, Dilated, Revolved, distance_around_axis, surface_around_axis};
use super::dop::difference_of_products;
use super::ray_cone::Cone;
use super::ray_lanes::{Intersect, RayLanes, Span};

/// R = (r h − b (L + r))/h. A needle's is a small difference, and its apex h/r times that: so L has
/// a second part, (r² + h² − L²)/2L.
pub(super) fn core_radius(radius: f64, height: f64, bevel: f64) -> f64 {
    let length = radius.hypot(height);
    let beyond = difference_of_products(length, length, height, height);
    let length_low = radius.mul_add(radius, -beyond) / (length + length);
    let sum = length + radius;
    let sum_low = (length - sum + radius) + length_low;
    let room = difference_of_products(radius, height, bevel, sum);
    (bevel.mul_add(-sum_low, room) / height).max(0.0)
}

/// A cone about the y axis with rounded rim and tip.
#[derive(Clone, Debug)]
pub struct BevelledCone<F> {
    plain: Cone<F>,
    radius: F,
    base: F,
    apex: F,
    slant: F,
    sin: F,
    cos: F,
    bevel: F,
}

impl<F: Scalar> BevelledCone<F> {
    pub(super) fn new(radius: f64, height: f64, bevel: f64) -> BevelledCone<F> {
        let length = radius.hypot(height);
        let (sin, cos) = (radius / length, height / length);
        let core = core_radius(radius, height, bevel);
        let apex = bevel + core * height / radius;
        BevelledCone {
            plain: Cone::below(radius, height, apex + bevel),
            radius: F::from_f64(core),
            base: F::from_f64(bevel),
            apex: F::from_f64(apex),
            slant: F::from_f64(core / sin),
            sin: F::from_f64(sin),
            cos: F::from_f64(cos),
            bevel: F::from_f64(bevel),
        }
    }
}

impl<F: Scalar> Revolved<F> for BevelledCone<F> {
    #[inline(always)]
    fn offset<L: Lanes<Scalar = F>>(&self, rho: L, y: L) -> (L, L) {
        let zero = L::zero();
        let (sin, cos) = (L::splat(self.sin), L::splat(self.cos));
        let (out, up) = (rho - L::splat(self.radius), y - L::splat(self.base));
        let along = cos * up - sin * out;
        let away = cos.mul_add(out, sin * up).max(zero);
        let below = along.lt(zero) | (up.lt(zero) & out.le(zero));
        let above = along.gt(L::splat(self.slant)).and_not(below);
        let e_out = L::select(below, out.max(zero), L::select(above, rho, away * cos));
        let beside = L::select(above, y - L::splat(self.apex), away * sin);
        (e_out, L::select(below, up, beside))
    }
}

impl<F: Scalar> Dilated<F> for BevelledCone<F> {
    #[inline(always)]
    fn bevel(&self) -> F {
        self.bevel
    }

    #[inline(always)]
    fn plain<L: Lanes<Scalar = F>>(&self, ray: &RayLanes<L>) -> Span<L> {
        // A flat cone and a needle reach far beyond their bevelled forms: begin near those.
        let [rim, top] = L::splats([self.radius + self.bevel, self.plain.tip]);
        self.plain
            .span(ray)
            .and(Span::bar(ray.o, ray.d, rim))
            .and(Span::half_space(top - ray.o[1], -ray.d[1]))
    }

    #[inline(always)]
    fn distance<L: Lanes<Scalar = F>>(&self, p: [L; 3], d: [L; 3]) -> (L, L) {
        distance_around_axis(self, p, d)
    }
}

impl<F: Scalar> Intersect<F> for BevelledCone<F> {
    #[inline(always)]
    fn intersect<L: Lanes<Scalar = F>>(&self, ray: &RayLanes<L>, active: L::Mask) -> (L::Mask, L) {
        dilation::intersect(self, ray, active)
    }
}

impl BevelledCone<f64> {
    #[inline(always)]
    pub(super) fn surface<L: Lanes<Scalar = f64>>(&self, p: [L; 3]) -> ([L; 3], [L; 3]) {
        surface_around_axis(self, self.bevel, p, || self.plain.surface(p, p, L::zero()))
    }
}
