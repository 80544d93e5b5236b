//! A ring with rounded rims: its core is the ring of Ri = r0 + b ≤ ρ ≤ Ro = r1 − b, l = y0 + b ≤ y
//! ≤ h = y1 − b.
//!
//! Its cells are bordered by ρ = Ri, ρ = Ro, y = l, y = h: between the radii the caps, y = y0 and
//! y1; between the levels the walls, ρ = r0 and r1; beyond both a tube about each of the core's
//! four circles. The rims of the bore are rounded too: they are convex edges.
use crate::lanes::{Lanes, axes};
use crate::scalar::Scalar;

use super::cell_walk::{Borders, Cell, Cells, first_crossing};
use super::dilation::{Revolved, surface_around_axis};
use super::ray_lanes::{Intersect, RayLanes, Span};
use super::ray_ring::Ring;

/// A hollow cylinder about the y axis, all of whose rims are rounded.
#[derive(Clone, Debug)]
pub struct BevelledRing<F> {
    plain: Ring<F>,
    /// r0 and r1.
    wall: [F; 2],
    /// Ri and Ro.
    core: [F; 2],
    /// l and h.
    level: [F; 2],
    bevel: F,
}

impl<F: Scalar> BevelledRing<F> {
    pub(super) fn new(r: [f64; 2], y: [f64; 2], bevel: f64) -> BevelledRing<F> {
        BevelledRing {
            plain: Ring::new(r, y),
            wall: r.map(F::from_f64),
            core: [r[0] + bevel, r[1] - bevel].map(F::from_f64),
            level: [y[0] + bevel, y[1] - bevel].map(F::from_f64),
            bevel: F::from_f64(bevel),
        }
    }

    pub(super) fn plain(&self) -> &Ring<F> {
        &self.plain
    }

    pub(super) fn bevel(&self) -> F {
        self.bevel
    }

    pub(super) fn core(&self) -> [F; 2] {
        self.core
    }

    /// From the core's levels to y, where it is beyond them.
    #[inline(always)]
    pub(super) fn up<L: Lanes<Scalar = F>>(&self, y: L) -> L {
        let zero = L::zero();
        let [low, high] = L::splats(self.level);
        (y - high).max(zero) + (y - low).min(zero)
    }

    /// The cell of p if its nearest feature of the planar core is an arc: within Ri, or beyond Ro.
    #[inline(always)]
    pub(super) fn arc<L: Lanes<Scalar = F>>(
        &self,
        p: [L; 3],
        d: [L; 3],
        inner: L::Mask,
    ) -> Cell<L> {
        let zero = L::zero();
        let [low, high] = L::splats(self.level);
        let up = self.up(p[1]);
        let tube = !up.eq(zero);
        Cell {
            offset: [p[0], up, p[2]],
            rate: [d[0], L::select(tube, d[1], zero), d[2]],
            convex: !inner,
            radius: L::select(tube, L::splat(self.bevel), pick(inner, self.wall)),
            hollow: inner,
            tube,
            major: pick(inner, self.core),
            level: L::select(p[1].gt(high), high, low),
        }
    }
}

/// One of two numbers: the first where the mask is set.
#[inline(always)]
fn pick<L: Lanes>(mask: L::Mask, [yes, no]: [L::Scalar; 2]) -> L {
    L::select(mask, L::splat(yes), L::splat(no))
}

impl<F: Scalar> Cells<F> for BevelledRing<F> {
    #[inline(always)]
    fn borders<L: Lanes<Scalar = F>>(&self, ray: &RayLanes<L>, borders: &mut Borders<L>) {
        for radius in self.core {
            let bar = Span::bar(ray.o, ray.d, L::splat(radius));
            borders.add(bar.near);
            borders.add(bar.far);
        }
        let slab = Span::slab(
            ray.o[1],
            ray.d[1],
            L::splat(self.level[0]),
            L::splat(self.level[1]),
        );
        borders.add(slab.near);
        borders.add(slab.far);
    }

    #[inline(always)]
    fn cell<L: Lanes<Scalar = F>>(&self, p: [L; 3], d: [L; 3]) -> Cell<L> {
        let zero = L::zero();
        let square = p[0].mul_add(p[0], p[2] * p[2]);
        let [inner, outer] = L::splats(self.core);
        let (inner, outer) = (inner * inner, outer * outer);
        let between = inner.le(square) & square.le(outer);
        let arc = self.arc(p, d, square.lt(inner));
        let up = self.up(p[1]);
        // Between the radii: the caps.
        let cap = [zero, up, zero];
        let cap_rate = [zero, L::select(up.eq(zero), zero, d[1]), zero];
        Cell {
            offset: axes!(|i| L::select(between, cap[i], arc.offset[i])),
            rate: axes!(|i| L::select(between, cap_rate[i], arc.rate[i])),
            radius: L::select(between, L::splat(self.bevel), arc.radius),
            convex: arc.convex | between,
            hollow: arc.hollow & !between,
            tube: arc.tube & !between,
            ..arc
        }
    }
}

impl<F: Scalar> Intersect<F> for BevelledRing<F> {
    #[inline(always)]
    fn intersect<L: Lanes<Scalar = F>>(&self, ray: &RayLanes<L>, active: L::Mask) -> (L::Mask, L) {
        let (outer, bore) = self.plain.spans(ray);
        first_crossing(self, ray, outer, [bore], active)
    }
}

impl<F: Scalar> Revolved<F> for BevelledRing<F> {
    #[inline(always)]
    fn offset<L: Lanes<Scalar = F>>(&self, rho: L, y: L) -> (L, L) {
        let (zero, [inner, outer]) = (L::zero(), L::splats(self.core));
        (
            (rho - outer).max(zero) + (rho - inner).min(zero),
            self.up(y),
        )
    }
}

impl BevelledRing<f64> {
    /// The arc's or cap's point and normal nearest to p.
    #[inline(always)]
    pub(super) fn surface<L: Lanes<Scalar = f64>>(&self, p: [L; 3]) -> ([L; 3], [L; 3]) {
        surface_around_axis(self, self.bevel, p, || self.plain.surface(p, p, L::zero()))
    }
}
