//! r0 ≤ ρ ≤ r1, y0 ≤ y ≤ y1, φ0 ≤ φ ≤ φ1: a ring cut by a sector.
//!
//! Up to 180° the sector shortens the ring's outer stretch; beyond, its gap is one more hole.
use crate::lanes::{Lanes, axes, halves};
use crate::scalar::Scalar;

use super::ray_lanes::{Intersect, RayLanes, clamped};
use super::ray_ring::{Ring, first_end};
use super::sector::{Sector, Sides};

/// An annular wedge about the y axis.
#[derive(Clone, Debug)]
pub struct Wedge<F> {
    ring: Ring<F>,
    sector: Sector<F>,
}

impl<F: Scalar> Wedge<F> {
    pub(super) fn new(r: [f64; 2], y: [f64; 2], phi: [f64; 2]) -> Wedge<F> {
        Wedge {
            ring: Ring::new(r, y),
            sector: Sector::new(phi),
        }
    }
}

impl<F: Scalar> Intersect<F> for Wedge<F> {
    #[inline(always)]
    fn intersect<L: Lanes<Scalar = F>>(&self, ray: &RayLanes<L>, active: L::Mask) -> (L::Mask, L) {
        let (outer, bore) = self.ring.spans(ray);
        match self.sector.sides(ray) {
            Sides::In(sector) => first_end(ray, outer.and(sector), [bore], active),
            Sides::Out(gap) => first_end(ray, outer, [bore, gap], active),
        }
    }
}

impl Wedge<f64> {
    #[inline(always)]
    pub(super) fn surface(&self, p: [f64; 3], room: f64) -> ([f64; 3], [f64; 3]) {
        let (outside, mut point, normal) = self.ring.nearest_face(p, room);
        let [(along0, q0), (along1, q1)] = halves!(|side| self.sector.along_and_depth(side, p));
        // At 180° both sides lie in one plane: only the half that p is along can be near.
        let first = if along0 > 0.0 && along1 > 0.0 {
            (q0 < q1) != self.sector.reflex
        } else {
            along0 > along1
        };
        let (side, along, depth) = if first {
            (0, along0, q0)
        } else {
            (1, along1, q1)
        };
        if -depth <= outside {
            for side in [0, 1] {
                let (along, depth) = self.sector.along_and_depth(side, point);
                // Beyond 180° most of the face is far outside of one side's plane.
                if along > 0.0 && depth < room && -depth <= outside.max(room) {
                    let normal = self.sector.normal(side);
                    point = axes!(|i| (depth - room).mul_add(normal[i], point[i]));
                }
            }
            return (point, normal);
        }
        let ([r0, r1], [y0, y1]) = (self.ring.radii(), self.ring.y());
        let [sin, cos] = self.sector.ends[side];
        let along = clamped(along, r0, r1, room);
        let point = [along * sin, clamped(p[1], y0, y1, room), along * cos];
        (point, self.sector.normal(side))
    }
}
