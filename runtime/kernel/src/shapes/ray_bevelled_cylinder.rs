//! A capped cylinder with rounded rims: its core is the cylinder of radius R = r − b between l = y0
//! + b and h = y1 − b.
//!
//! From p the core's nearest point differs radially by e_ρ = max(ρ − R, 0), and along y where p is
//! beyond l or h. δ = |e|, δ' = (e_ρ ρ' + e_y d_y)/|e|, ρ' = (x d_x + z d_z)/ρ. b = r leaves a
//! segment for a core: a capsule.
use crate::lanes::Lanes;
use crate::scalar::Scalar;

use super::dilation::{self, Dilated, Revolved, distance_around_axis, surface_around_axis};
use super::ray_cylinder::Cylinder;
use super::ray_lanes::{Intersect, RayLanes, Span};

/// A capped cylinder about the y axis, both of whose rims are rounded.
#[derive(Clone, Debug)]
pub struct BevelledCylinder<F> {
    plain: Cylinder<F>,
    radius: F,
    y: [F; 2],
    bevel: F,
}

impl<F: Scalar> BevelledCylinder<F> {
    pub(super) fn new(radius: f64, y: [f64; 2], bevel: f64) -> BevelledCylinder<F> {
        BevelledCylinder {
            plain: Cylinder::new(radius, y),
            radius: F::from_f64(radius - bevel),
            y: [y[0] + bevel, y[1] - bevel].map(F::from_f64),
            bevel: F::from_f64(bevel),
        }
    }
}

impl<F: Scalar> Revolved<F> for BevelledCylinder<F> {
    #[inline(always)]
    fn offset<L: Lanes<Scalar = F>>(&self, rho: L, y: L) -> (L, L) {
        let zero = L::zero();
        let [low, high] = L::splats(self.y);
        (
            (rho - L::splat(self.radius)).max(zero),
            (y - high).max(zero) + (y - low).min(zero),
        )
    }
}

impl<F: Scalar> Dilated<F> for BevelledCylinder<F> {
    #[inline(always)]
    fn bevel(&self) -> F {
        self.bevel
    }

    #[inline(always)]
    fn plain<L: Lanes<Scalar = F>>(&self, ray: &RayLanes<L>) -> Span<L> {
        self.plain.span(ray)
    }

    #[inline(always)]
    fn distance<L: Lanes<Scalar = F>>(&self, p: [L; 3], d: [L; 3]) -> (L, L) {
        distance_around_axis(self, p, d)
    }
}

impl<F: Scalar> Intersect<F> for BevelledCylinder<F> {
    #[inline(always)]
    fn intersect<L: Lanes<Scalar = F>>(&self, ray: &RayLanes<L>, active: L::Mask) -> (L::Mask, L) {
        dilation::intersect(self, ray, active)
    }
}

impl BevelledCylinder<f64> {
    #[inline(always)]
    pub(super) fn surface<L: Lanes<Scalar = f64>>(&self, p: [L; 3]) -> ([L; 3], [L; 3]) {
        surface_around_axis(self, self.bevel, p, || self.plain.surface(p, p, L::zero()))
    }
}
