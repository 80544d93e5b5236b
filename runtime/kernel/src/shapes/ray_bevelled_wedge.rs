//! An annular wedge with rounded edges.
//!
//! Its core is the ring's core (`ray_bevelled_ring.rs`) less all that is within b of a side plane.
//! In the frame of side k (a along it, q into the solid, `sector.rs`) the core's edge is the
//! segment q = b, s1 ≤ a ≤ s2 with
//!
//!   s1 = √(Ri² − b²) = √(r0 (r0 + 2b)),   s2 = √(Ro² − b²) = √(r1 (r1 − 2b)),
//!
//! whose ends lie on the arcs, at azimuth φ0 + α and φ0 + β, sin α = b/Ri, cos α = s1/Ri, sin β =
//! b/Ro, cos β = s2/Ro: no arc sine is taken. In the plane the cells are the arcs' (within Ri or
//! beyond Ro, in the sectors turned by α and β), the core itself (caps), and for the nearer side
//! the segment's and its two ends', whose offset is (a − s1 or a − s2 or 0, q − b). Above h and
//! below l the offset has a y component besides, and arcs become tubes. Borders: two circles, two
//! levels, and per side q = b, a = s1, a = s2 and the two turned half planes; the bisecting plane
//! between the sides.
//!
//! The inner wall vanishes at the limit of validity, 2α = Φ; it is left out then, since a sector
//! without width would let the opposite azimuth in.
use crate::lanes::{Lanes, Mask, axes};
use crate::scalar::Scalar;

use super::angle::sin_cos_degrees;
use super::cell_walk::{Borders, Cell, Cells, first_crossing};
use super::dilation::with_others;
use super::dop::{difference_of_products, sum_of_products};
use super::ray_bevelled_ring::BevelledRing;
use super::ray_lanes::{Intersect, RayLanes};
use super::sector::{Sector, Sides};

/// An annular wedge about the y axis, all of whose convex edges are rounded.
#[derive(Clone, Debug)]
pub struct BevelledWedge<F> {
    ring: BevelledRing<F>,
    sector: Sector<F>,
    /// The azimuths of the inner wall, none if it has no width, and of the outer wall.
    inner: Option<Sector<F>>,
    outer: Sector<F>,
    /// s1 and s2.
    along: [F; 2],
    /// sin and cos of the middle azimuth.
    middle: [F; 2],
}

/// Along a side, and into the solid from it.
struct SideFrame<L> {
    a: L,
    q: L,
}

impl<F: Scalar> BevelledWedge<F> {
    pub(super) fn new(r: [f64; 2], y: [f64; 2], phi: [f64; 2], bevel: f64) -> BevelledWedge<F> {
        let [inner, outer] = [r[0] + bevel, r[1] - bevel];
        let along = [
            (r[0] * (r[0] + 2.0 * bevel)).sqrt(),
            (r[1] * (r[1] - 2.0 * bevel)).max(0.0).sqrt(),
        ];
        let half = 0.5 * (phi[1] - phi[0]);
        let (sin, cos) = sin_cos_degrees(phi[0] + half);
        // α < Φ/2, unless equal but for rounding.
        let (sin_half, cos_half) = sin_cos_degrees(half.min(90.0));
        let room = difference_of_products(sin_half, along[0], cos_half, bevel) / inner;
        let (sin_alpha, cos_alpha) = (bevel / inner, along[0] / inner);
        BevelledWedge {
            ring: BevelledRing::new(r, y, bevel),
            sector: Sector::new(phi),
            inner: (room > 16.0 * F::EPS.to_f64())
                .then(|| Sector::turned(phi, sin_alpha, cos_alpha)),
            outer: Sector::turned(phi, bevel / outer, along[1] / outer),
            along: along.map(F::from_f64),
            middle: [sin, cos].map(F::from_f64),
        }
    }

    /// A vector in the frame of side 0, or of side 1.
    #[inline(always)]
    fn in_side<L: Lanes<Scalar = F>>(&self, p: [L; 3], second: L::Mask) -> SideFrame<L> {
        let [end0, end1] = self.sector.ends;
        let ([sin0, cos0], [sin1, cos1]) = (L::splats(end0), L::splats(end1));
        let (sin, cos) = (L::select(second, sin1, sin0), L::select(second, cos1, cos0));
        let q = difference_of_products(p[0], cos, p[2], sin);
        SideFrame {
            a: sum_of_products(p[0], sin, p[2], cos),
            q: L::select(second, -q, q),
        }
    }

    /// From the segment that is the core's edge at a side to a point in the side's frame, at height
    /// `y`: along the side, upwards, into the solid.
    #[inline(always)]
    fn side_offset<L: Lanes<Scalar = F>>(&self, at: &SideFrame<L>, y: L) -> [L; 3] {
        let zero = L::zero();
        let [s1, s2] = L::splats(self.along);
        let along = (at.a - s1).min(zero) + (at.a - s2).max(zero);
        [along, self.ring.up(y), at.q - L::splat(self.ring.bevel())]
    }

    /// Whether p is nearer to side 1.
    #[inline(always)]
    fn is_nearer_second<L: Lanes<Scalar = F>>(&self, p: [L; 3]) -> L::Mask {
        let [sin, cos] = L::splats(self.middle);
        (p[0] * cos).gt(p[2] * sin)
    }

    /// Whether p is within the core's sector: at least b inside of the sides.
    #[inline(always)]
    fn is_inset<L: Lanes<Scalar = F>>(&self, p: [L; 3]) -> L::Mask {
        let first = self.in_side(p, L::Mask::none());
        let second = self.in_side(p, L::Mask::full());
        let (b, zero) = (L::splat(self.ring.bevel()), L::zero());
        let (deep0, deep1) = (first.q.ge(b), second.q.ge(b));
        if self.sector.reflex {
            deep0 | deep1 | (first.a.le(zero) & second.a.le(zero))
        } else {
            deep0 & deep1
        }
    }
}

/// When rays cross the plane through the axis at an azimuth of that sine and cosine.
#[inline(always)]
fn half_plane<L: Lanes>(ray: &RayLanes<L>, azimuth: [L::Scalar; 2]) -> L {
    let [sin, cos] = L::splats(azimuth);
    difference_of_products(ray.o[2], sin, ray.o[0], cos)
        / difference_of_products(ray.d[0], cos, ray.d[2], sin)
}

impl<F: Scalar> Cells<F> for BevelledWedge<F> {
    #[inline(always)]
    fn borders<L: Lanes<Scalar = F>>(&self, ray: &RayLanes<L>, borders: &mut Borders<L>) {
        self.ring.borders(ray, borders);
        let b = L::splat(self.ring.bevel());
        for side in [L::Mask::none(), L::Mask::full()] {
            let (o, d) = (self.in_side(ray.o, side), self.in_side(ray.d, side));
            borders.add((b - o.q) / d.q);
            for s in self.along {
                borders.add((L::splat(s) - o.a) / d.a);
            }
        }
        borders.add(half_plane(ray, self.middle));
        for end in self.outer.ends {
            borders.add(half_plane(ray, end));
        }
        if let Some(inner) = &self.inner {
            for end in inner.ends {
                borders.add(half_plane(ray, end));
            }
        }
    }

    #[inline(always)]
    fn cell<L: Lanes<Scalar = F>>(&self, p: [L; 3], d: [L; 3]) -> Cell<L> {
        let zero = L::zero();
        let b = L::splat(self.ring.bevel());
        let square = p[0].mul_add(p[0], p[2] * p[2]);
        let [inner, outer] = L::splats(self.ring.core());
        let (inner, outer) = (inner * inner, outer * outer);
        let (within, beyond) = (square.lt(inner), square.gt(outer));
        let inner_arc = match &self.inner {
            Some(sector) if within.any() => within & sector.contains(p),
            _ => L::Mask::none(),
        };
        let arc = inner_arc | (beyond & self.outer.contains(p));
        let core = self.is_inset(p).and_not(within | beyond);

        // The nearer side: its segment, or one of the segment's ends.
        let second = self.is_nearer_second(p);
        let (at, rate) = (self.in_side(p, second), self.in_side(d, second));
        let side_offset = self.side_offset(&at, p[1]);
        let past_end = !side_offset[0].eq(zero);
        let up = side_offset[1];
        let up_rate = L::select(up.eq(zero), zero, d[1]);
        let side_rate = [L::select(past_end, rate.a, zero), up_rate, rate.q];

        let hull_side = if self.sector.reflex {
            L::Mask::none()
        } else {
            side_offset[0].ge(zero)
        };
        let on_arc = self.ring.arc(p, d, inner_arc);
        let (cap, cap_rate) = ([zero, up, zero], [zero, up_rate, zero]);
        let (offset, rate) = (
            axes!(|i| L::select(core, cap[i], side_offset[i])),
            axes!(|i| L::select(core, cap_rate[i], side_rate[i])),
        );
        Cell {
            offset: axes!(|i| L::select(arc, on_arc.offset[i], offset[i])),
            rate: axes!(|i| L::select(arc, on_arc.rate[i], rate[i])),
            radius: L::select(arc, on_arc.radius, b),
            convex: (core | hull_side | arc).and_not(inner_arc),
            hollow: inner_arc.and_not(on_arc.tube),
            tube: arc & on_arc.tube,
            ..on_arc
        }
    }
}

impl<F: Scalar> Intersect<F> for BevelledWedge<F> {
    #[inline(always)]
    fn intersect<L: Lanes<Scalar = F>>(&self, ray: &RayLanes<L>, active: L::Mask) -> (L::Mask, L) {
        let (outer, bore) = self.ring.plain().spans(ray);
        match self.sector.sides(ray) {
            Sides::In(sector) => first_crossing(self, ray, outer.and(sector), [bore], active),
            Sides::Out(gap) => first_crossing(self, ray, outer, [bore, gap], active),
        }
    }
}

impl BevelledWedge<f64> {
    #[inline(always)]
    pub(super) fn surface<L: Lanes<Scalar = f64>>(&self, p: [L; 3]) -> ([L; 3], [L; 3]) {
        let zero = L::zero();
        let square = p[0].mul_add(p[0], p[2] * p[2]);
        let [inner, outer] = L::splats(self.ring.core());
        let (within, beyond) = (square.lt(inner * inner), square.gt(outer * outer));
        let inner_arc = match &self.inner {
            Some(sector) => within & sector.contains(p),
            None => L::Mask::none(),
        };
        let core = self.is_inset(p).and_not(within | beyond);
        let of_ring = inner_arc | (beyond & self.outer.contains(p)) | core;
        if of_ring.all() {
            return self.ring.surface(p);
        }
        let second = self.is_nearer_second(p);
        let [along, up, deep] = self.side_offset(&self.in_side(p, second), p[1]);
        let square = along.mul_add(along, up.mul_add(up, deep * deep));
        let of_ring = of_ring | square.eq(zero);
        let unit = L::splat(1.0) / square.sqrt();
        let ([sin0, cos0], [sin1, cos1]) = (
            L::splats(self.sector.ends[0]),
            L::splats(self.sector.ends[1]),
        );
        let (sin, cos) = (L::select(second, sin1, sin0), L::select(second, cos1, cos0));
        let deep = L::select(second, -deep, deep);
        let e = [along * sin + deep * cos, up, along * cos - deep * sin];
        let normal = axes!(|i| e[i] * unit);
        let b = L::splat(self.ring.bevel());
        let side = (axes!(|i| b.mul_add(normal[i], p[i] - e[i])), normal);
        with_others(side, of_ring, || self.ring.surface(p))
    }
}
