//! Bevelled solids that are not convex: a ray is followed from cell to cell.
//!
//! The solid is all points within b of a core. Space falls into cells (Voronoi's) by the feature of
//! the core that is nearest: a face, an edge, a corner, an arc. Within a cell the solid is that
//! feature's dilation: a slab, a round bar, a ball, a tube. The cells' borders are planes, lines
//! and circles that a ray crosses at times known beforehand; between two crossings the cell is that
//! of the middle, and its surface is met in closed form (tubes: by `ray_torus.rs`).
//!
//! No seam can crack: the walk knows whether it is inside or outside, and takes the first time in a
//! stretch at which the stretch's cell says otherwise, be it the stretch's very start, where
//! rounding has let the one before end without a crossing.
//!
//! Most features, all but a hole's, are on the border of the core's convex hull: behind the plane
//! through the feature's nearest point across the offset lies all of the core. A ray that is outside
//! of the solid in such a cell, and does not come nearer to the feature, never meets the solid:
//! rays that leave a surface mostly end with that.
use crate::lanes::{Lanes, Mask};
use crate::scalar::Scalar;

use super::ray_lanes::{RayLanes, Span, distance_to_axis};
use super::ray_ring::first_end;
use super::ray_torus::Tube;

/// The dilated feature that the solid is, in the cell of a point.
#[derive(Clone, Copy)]
pub(super) struct Cell<L: Lanes> {
    /// From the feature to the point, in a frame of the feature; components along the feature are
    /// zero. At a tube, from its circle's centre.
    pub offset: [L; 3],
    /// How fast `offset` changes along the ray.
    pub rate: [L; 3],
    /// Where the feature bounds the convex hull of the core.
    pub convex: L::Mask,
    /// The solid is where |offset| ≤ radius...
    pub radius: L,
    /// ...or, here, where it is greater: a hole's wall.
    pub hollow: L::Mask,
    /// Instead of all that, a tube about a circle around the y axis: where it is so,
    pub tube: L::Mask,
    /// the circle's radius
    pub major: L,
    /// and height. The tube's own radius is `radius`.
    pub level: L,
}

/// A solid made of cells.
pub(super) trait Cells<F: Scalar> {
    /// Adds the times at which rays cross borders of cells, in any order; more do no harm.
    fn borders<L: Lanes<Scalar = F>>(&self, ray: &RayLanes<L>, borders: &mut Borders<L>);
    /// The cells of points p.
    fn cell<L: Lanes<Scalar = F>>(&self, p: [L; 3], d: [L; 3]) -> Cell<L>;
}

/// As many borders as a solid may have.
const MOST_BORDERS: usize = 20;

/// The times at which rays cross borders of cells.
pub(super) struct Borders<L> {
    times: [L; MOST_BORDERS],
    count: usize,
}

impl<L: Lanes> Borders<L> {
    #[inline(always)]
    pub fn add(&mut self, t: L) {
        self.times[self.count] = t;
        self.count += 1;
    }
}

impl<L: Lanes> Cell<L> {
    /// The height of the point above the surface, up to a positive factor.
    #[inline(always)]
    fn height(&self, ray: &RayLanes<L>, t: L) -> L {
        let [x, y, z] = self.offset;
        let r = self.radius;
        let square = x.mul_add(x, y.mul_add(y, z * z));
        let solid = r.neg_mul_add(r, square);
        let solid = L::select(self.hollow, -solid, solid);
        if self.tube.any() {
            return L::select(self.tube, self.as_tube(ray).height(t), solid);
        }
        solid
    }

    /// Where a ray that is outside of the solid never meets it.
    #[inline(always)]
    fn is_left(&self) -> L::Mask {
        let ([x, y, z], [dx, dy, dz]) = (self.offset, self.rate);
        let mut around = x.mul_add(dx, z * dz);
        if self.tube.any() {
            // From the circle: in the plane of the axis the offset is ρ − R instead of ρ.
            let part = L::splat(L::Scalar::ONE) - self.major / distance_to_axis([x, y, z]);
            around = L::select(self.tube, around * part, around);
        }
        self.convex & y.mul_add(dy, around).ge(L::zero())
    }

    #[inline(always)]
    fn as_tube(&self, ray: &RayLanes<L>) -> Tube<L> {
        let [x, y, z] = ray.o;
        Tube {
            major: self.major,
            minor: self.radius,
            o: [x, y - self.level, z],
            d: ray.d,
        }
    }
}

/// The first crossing that the ray accepts of a solid that is, without its bevel, a stretch less
/// some holes. A ray from outside starts its walk where it enters the plain solid, and mostly ends
/// it there: on a face.
#[inline(always)]
pub(super) fn first_crossing<F: Scalar, S: Cells<F>, L: Lanes<Scalar = F>, const N: usize>(
    solid: &S,
    ray: &RayLanes<L>,
    plain: Span<L>,
    holes: [Span<L>; N],
    active: L::Mask,
) -> (L::Mask, L) {
    let (enters, entry) = first_end(ray, plain, holes, active);
    let mut starts_within = active & plain.contains(ray.t_min);
    for hole in &holes {
        starts_within = starts_within.and_not(hole.contains(ray.t_min));
    }
    let active = enters | starts_within;
    if !active.any() {
        return (active, entry);
    }
    let start = L::select(starts_within, ray.t_min, entry);
    let cell = solid.cell(ray.at(start), ray.d);
    let height = cell.height(ray, start);
    // Heights are differences of squares: 2 r times the distance.
    let noise = L::splat(F::from_f64(16.0 * F::EPS.to_f64())) * cell.radius;
    let met = active.and_not(starts_within) & height.le(noise);
    let mut inside = starts_within & height.lt(L::zero());
    let mut open = active.and_not(met | cell.is_left().and_not(inside));
    let mut found = met;
    let mut t = start;
    // Faces of both solids coincide: leave room to leave by one.
    let slack = L::splat(F::from_f64(32.0 * F::EPS.to_f64()));
    let end = plain.far + slack.mul_add(plain.far.abs(), slack);
    let stretch = Span {
        near: start,
        far: end,
    };
    // A ray that starts on the surface may be taken to be on the wrong side of it.
    for _ in 0..2 {
        if !open.any() {
            break;
        }
        let (changes, change) = first_change(solid, ray, stretch, inside, open);
        t = L::select(changes, change, t);
        found = found | changes;
        open = changes & change.le(ray.t_min);
        found = found.and_not(open);
        inside = !inside;
    }
    (found & ray.accepts(t), t)
}

/// Follows rays along `stretch`, which begins inside the solid or outside of it, to where that
/// first changes. A ray that is inside has changed by the end, which is that of the plain solid:
/// one that grazes a wall may find its crossing there too late, the two being rounded apart.
/// Borders beyond the stretch do not matter. t_max only ends the walk, or a change would depend on
/// it in its last digit.
#[inline(always)]
fn first_change<F: Scalar, S: Cells<F>, L: Lanes<Scalar = F>>(
    solid: &S,
    ray: &RayLanes<L>,
    stretch: Span<L>,
    inside: L::Mask,
    active: L::Mask,
) -> (L::Mask, L) {
    let half = L::splat(F::from_f64(0.5));
    let mut borders = Borders {
        times: [stretch.far; MOST_BORDERS],
        count: 0,
    };
    solid.borders(ray, &mut borders);
    let mut running = active & stretch.exists();
    let mut start = stretch.near;
    let mut change = stretch.far;
    let mut found = L::Mask::none();
    for _ in 0..=borders.count {
        if !running.any() {
            break;
        }
        let mut end = stretch.far;
        for &t in &borders.times[..borders.count] {
            end = L::select(start.lt(t) & t.lt(end), t, end);
        }
        let middle = half * (start + end);
        let cell = solid.cell(ray.at(middle), ray.d);

        // The time within the feature's dilation; tubes aside.
        let span = Span::ball_or_line(cell.offset, cell.rate, cell.radius);
        let (near, far) = (middle + span.near, middle + span.far);
        let meets = near.le(end) & far.gt(start) & near.le(far);
        let into = near.max(start);
        let within = meets & near.le(start);
        let out_of = L::select(within, far, start);
        let seeks_within = (inside & cell.hollow) | !(inside | cell.hollow);
        let t = L::select(seeks_within, into, out_of);
        let changes = (seeks_within & meets) | (!seeks_within & t.le(end));
        let plain = running.and_not(cell.tube) & changes;
        change = L::select(plain, t, change);
        found = found | plain;

        let tubes = running & cell.tube;
        if tubes.any() {
            let tube = cell.as_tube(ray);
            let none = Span::line().only(L::Mask::none());
            let stretch = Span {
                near: start,
                far: end,
            };
            let (hit, t) = tube.first_crossing(stretch, none, inside, tubes);
            change = L::select(hit, t, change);
            found = found | hit;
        }
        running = running.and_not(found) & end.lt(stretch.far) & end.lt(ray.t_max);
        start = end;
    }
    (found | (active & stretch.exists() & inside), change)
}
