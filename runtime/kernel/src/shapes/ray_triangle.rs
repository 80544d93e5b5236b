//! Triangles, without cracks between neighbours of one mesh.
//!
//! Woop, Benthin, Wald, "Watertight ray/triangle intersection", JCGT 2(1) 2013. The corners are
//! moved so that the ray starts at the origin and sheared so that it runs along the axis k of its
//! largest |d|: (i, j, k) → (i − k d_i/d_k, j − k d_j/d_k, k/d_k). Then the ray passes to one side
//! or the other of an edge by the sign of a 2×2 determinant of its ends, and t is the mean of the
//! corners' k weighted with the three determinants U, V, W. The paper computes a determinant again
//! in double where it is 0 in single; here each is a difference of products by Kahan's method
//! (`dop.rs`), whose sign is right at once and which lanes can do in step. The corners of a shared
//! edge round alike, so no ray slips between.
use crate::lanes::{Lanes, Mask, axes, each};
use crate::scalar::Scalar;

use super::dop::{difference_of_products, dot};
use super::ray_lanes::{Intersect, RayLanes};

/// Rays made ready for triangles.
///
/// The axis k belongs to the ray. What has one axis is done at once: rays that differ in it take
/// turns, each axis for itself.
#[derive(Clone, Copy)]
pub struct TriangleRays<L: Lanes> {
    origin: [L; 3],
    along: [L::Mask; 3],
    slope: [L; 2],
    inverse: L,
    t_min: L,
    t_max: L,
}

/// The axes after `axis` and itself, in the order that keeps handedness.
#[inline(always)]
pub fn turned(axis: usize) -> [usize; 3] {
    [(axis + 1) % 3, (axis + 2) % 3, axis % 3]
}

impl<L: Lanes> TriangleRays<L> {
    /// Rays with hits at t_min < t < t_max.
    #[inline(always)]
    pub fn new(ray: &RayLanes<L>) -> TriangleRays<L> {
        let d = ray.d;
        let [x, y, z] = axes!(|i| d[i].abs());
        let along_x = x.ge(y) & x.ge(z);
        let along_y = y.ge(z) & !along_x;
        let [i, j, k] = axes!(|i| {
            let (if_x, if_y, if_z) = (d[(i + 1) % 3], d[(i + 2) % 3], d[i]);
            L::select(along_x, if_x, L::select(along_y, if_y, if_z))
        });
        TriangleRays {
            origin: ray.o,
            along: [along_x, along_y, !(along_x | along_y)],
            slope: [i / k, j / k],
            inverse: L::splat(L::Scalar::ONE) / k,
            t_min: ray.t_min,
            t_max: ray.t_max,
        }
    }

    /// Looks for hits in another interval.
    #[inline(always)]
    pub fn look_within(&mut self, t_min: L, t_max: L) {
        self.t_min = t_min;
        self.t_max = t_max;
    }

    /// Rays with this axis.
    #[inline(always)]
    pub fn along(&self, axis: usize) -> L::Mask {
        self.along[axis]
    }

    /// The axis of the first ray.
    #[inline(always)]
    pub fn axis(&self) -> usize {
        let [x, y, _] = axes!(|i| self.along[i].bits() & 1 != 0);
        if x {
            0
        } else if y {
            1
        } else {
            2
        }
    }

    /// The ray in lane `i`, and its axes in their order.
    #[inline(always)]
    pub fn get(&self, i: usize) -> (TurnedRays<L::Scalar>, [usize; 3]) {
        let axis = if self.along[0].bits() >> i & 1 != 0 {
            0
        } else {
            1 + usize::from(self.along[1].bits() >> i & 1 == 0)
        };
        let origin: [L::Scalar; 3] = axes!(|axis| self.origin[axis].get(i));
        let turned = turned(axis);
        let ray = TurnedRays {
            origin: axes!(|axis| origin[turned[axis]]),
            slope: [self.slope[0].get(i), self.slope[1].get(i)],
            inverse: self.inverse.get(i),
            t_min: self.t_min.get(i),
            t_max: self.t_max.get(i),
        };
        (ray, turned)
    }

    /// Rays of any axes against one triangle.
    #[inline(always)]
    pub fn intersect_any_axis(
        &self,
        triangle: &[[L::Scalar; 3]; 3],
        active: L::Mask,
    ) -> (L::Mask, L) {
        let mut found = (L::Mask::none(), L::zero());
        for axis in 0..3 {
            let along = active & self.along(axis);
            if along.any() {
                let [i, j, k] = turned(axis);
                let corners = each!(triangle, |corner| L::splats([
                    corner[i], corner[j], corner[k]
                ]));
                let (hit, t) = self.intersect(axis, corners, along);
                found = (found.0 | hit, L::select(hit, t, found.1));
            }
        }
        found
    }

    /// The rays in what they need against triangles if they have that axis.
    #[inline(always)]
    pub fn turned(&self, axis: usize) -> TurnedRays<L> {
        let turned = turned(axis);
        TurnedRays {
            origin: axes!(|i| self.origin[turned[i]]),
            slope: self.slope,
            inverse: self.inverse,
            t_min: self.t_min,
            t_max: self.t_max,
        }
    }

    /// As [`TurnedRays::intersect`], of rays that have that axis.
    #[inline(always)]
    pub fn intersect(&self, axis: usize, corners: [[L; 3]; 3], active: L::Mask) -> (L::Mask, L) {
        self.turned(axis).intersect(corners, active)
    }
}

/// Rays along one axis, their coordinates [`turned`] to it.
#[derive(Clone, Copy)]
pub struct TurnedRays<L: Lanes> {
    origin: [L; 3],
    slope: [L; 2],
    inverse: L,
    t_min: L,
    t_max: L,
}

impl<S: Scalar> TurnedRays<S> {
    /// One ray in every lane.
    #[inline(always)]
    pub fn in_lanes<L: Lanes<Scalar = S>>(&self) -> TurnedRays<L> {
        TurnedRays {
            origin: L::splats(self.origin),
            slope: L::splats(self.slope),
            inverse: L::splat(self.inverse),
            t_min: L::splat(self.t_min),
            t_max: L::splat(self.t_max),
        }
    }
}

impl<L: Lanes> TurnedRays<L> {
    /// Looks for hits in another interval.
    #[inline(always)]
    pub fn look_within(&mut self, t_min: L, t_max: L) {
        self.t_min = t_min;
        self.t_max = t_max;
    }

    /// W rays against W triangles, lane by lane: splat a ray, or a triangle, to meet many of the
    /// other. The coordinates of the corners are turned too. Both sides are hit, edges belong to
    /// the triangle.
    #[inline(always)]
    pub fn intersect(&self, corners: [[L; 3]; 3], active: L::Mask) -> (L::Mask, L) {
        let [a, b, c] = axes!(|corner| {
            let [i, j, k] = axes!(|i| corners[corner][i] - self.origin[i]);
            [
                self.slope[0].neg_mul_add(k, i),
                self.slope[1].neg_mul_add(k, j),
                k * self.inverse,
            ]
        });
        let zero = L::zero();
        let u = difference_of_products(c[0], b[1], c[1], b[0]);
        let v = difference_of_products(a[0], c[1], a[1], c[0]);
        let w = difference_of_products(b[0], a[1], b[1], a[0]);
        let one_side =
            (u.ge(zero) & v.ge(zero) & w.ge(zero)) | (u.le(zero) & v.le(zero) & w.le(zero));
        let inside = active & one_side;
        if !inside.any() {
            return (inside, zero);
        }
        let sum = u + v + w;
        let t = dot([u, v, w], [a[2], b[2], c[2]]) / sum;
        let accepted = self.t_min.lt(t) & t.lt(self.t_max);
        (inside & !sum.eq(zero) & accepted, t)
    }
}

/// The point of the plane of a triangle nearest to `p`, and the unit normal (b − a) × (c − a).
///
/// The point keeps `room` from the edges, lest a ray that leaves it start beyond the neighbour
/// across an edge: with u, v, w the doubled areas that it makes with the edges, its distance from
/// an edge is u over the edge's length. If one is too near it moves towards the centroid.
#[inline(always)]
pub fn surface<L: Lanes<Scalar = f64>>(
    [a, b, c]: [[L; 3]; 3],
    p: [L; 3],
    room: L,
) -> ([L; 3], [L; 3]) {
    let (e, f) = (axes!(|i| b[i] - a[i]), axes!(|i| c[i] - a[i]));
    let cross = cross_product(e, f);
    let length = dot(cross, cross).sqrt();
    let unit = L::splat(1.0) / length;
    let normal = axes!(|i| cross[i] * unit);
    let height = dot(axes!(|i| p[i] - a[i]), normal);
    let point: [L; 3] = axes!(|i| height.neg_mul_add(normal[i], p[i]));
    let (zero, one) = (L::zero(), L::splat(1.0));
    let mut share = zero;
    // At the centroid the areas are a third of the triangle's.
    let third = length * L::splat(1.0 / 3.0);
    for (from, to) in [(a, b), (b, c), (c, a)] {
        let edge = axes!(|i| to[i] - from[i]);
        let arm = axes!(|i| point[i] - from[i]);
        let area = dot(cross_product(edge, arm), normal);
        let least = room * dot(edge, edge).sqrt();
        let near = area.lt(least);
        if near.any() {
            let wanted = ((least - area) / (third - area)).max(zero).min(one);
            share = L::select(near, share.max(wanted), share);
        }
    }
    if !share.gt(zero).any() {
        return (point, normal);
    }
    let point = axes!(|i| {
        let centroid = (a[i] + b[i] + c[i]) / L::splat(3.0);
        share.mul_add(centroid - point[i], point[i])
    });
    (point, normal)
}

#[inline(always)]
fn cross_product<L: Lanes>(u: [L; 3], v: [L; 3]) -> [L; 3] {
    [
        difference_of_products(u[1], v[2], u[2], v[1]),
        difference_of_products(u[2], v[0], u[0], v[2]),
        difference_of_products(u[0], v[1], u[1], v[0]),
    ]
}

/// One triangle.
#[derive(Clone, Debug)]
pub struct Triangle<F> {
    corners: [[F; 3]; 3],
}

impl<F: Scalar> Triangle<F> {
    pub(super) fn new(corners: [[f64; 3]; 3]) -> Triangle<F> {
        Triangle {
            corners: corners.map(|p| p.map(F::from_f64)),
        }
    }
}

impl<F: Scalar> Intersect<F> for Triangle<F> {
    #[inline(always)]
    fn intersect<L: Lanes<Scalar = F>>(&self, ray: &RayLanes<L>, active: L::Mask) -> (L::Mask, L) {
        TriangleRays::new(ray).intersect_any_axis(&self.corners, active)
    }
}

impl Triangle<f64> {
    #[inline(always)]
    pub(super) fn surface<L: Lanes<Scalar = f64>>(&self, p: [L; 3]) -> ([L; 3], [L; 3]) {
        let corners = axes!(|corner| L::splats(self.corners[corner]));
        surface(corners, p, L::zero())
    }
}
