//! r0 ≤ ρ ≤ r1, y0 ≤ y ≤ y1, φ0 ≤ φ ≤ φ1: a ring cut by a sector.
//!
//! Up to 180° the sector shortens the ring's outer stretch; beyond, its gap is one more hole.
use crate::lanes::{Lanes, Mask, axes, halves};
use crate::scalar::Scalar;

use super::ray_lanes::{Intersect, RayLanes, clamped, distance_to_axis};
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
    pub(super) fn surface<L: Lanes<Scalar = f64>>(
        &self,
        p: [L; 3],
        before: [L; 3],
        room: L,
    ) -> ([L; 3], [L; 3]) {
        let zero = L::zero();
        let (outside, mut point, normal) = self.ring.nearest_face(p, before, room);
        let [(along0, q0), (along1, q1)] = halves!(|side| self.sector.along_and_depth(side, p));
        // At 180° both sides lie in one plane: only the half that p is along can be near.
        let nearer = if self.sector.reflex {
            q0.ge(q1)
        } else {
            q0.lt(q1)
        };
        let both = along0.gt(zero) & along1.gt(zero);
        let first = (both & nearer) | along0.gt(along1).and_not(both);
        let (along, depth) = (L::select(first, along0, along1), L::select(first, q0, q1));
        let on_side = (-depth).gt(outside);
        let normals: [[L; 3]; 2] = halves!(|side| L::splats(self.sector.normal(side)));
        for side in [0, 1] {
            let (along, depth) = self.sector.along_and_depth(side, point);
            // Beyond 180° most of the face is far outside of one side's plane.
            let near = along.gt(zero) & depth.lt(room) & (-depth).le(outside.max(room));
            let (_, depth_before) = self.sector.along_and_depth(side, before);
            let kept = L::select(depth_before.lt(zero), -room, room);
            let back = L::select(near, depth - kept, zero);
            point = axes!(|i| back.mul_add(normals[side][i], point[i]));
        }
        let ([r0, r1], [y0, y1]) = (L::splats(self.ring.radii()), L::splats(self.ring.y()));
        let ([sin0, cos0], [sin1, cos1]) = (
            L::splats(self.sector.ends[0]),
            L::splats(self.sector.ends[1]),
        );
        let along = clamped(along, distance_to_axis(before), r0, r1, room);
        let side_point = [
            along * L::select(first, sin0, sin1),
            clamped(p[1], before[1], y0, y1, room),
            along * L::select(first, cos0, cos1),
        ];
        let side_normal: [L; 3] = axes!(|i| L::select(first, normals[0][i], normals[1][i]));
        (
            axes!(|i| L::select(on_side, side_point[i], point[i])),
            axes!(|i| L::select(on_side, side_normal[i], normal[i])),
        )
    }
}
