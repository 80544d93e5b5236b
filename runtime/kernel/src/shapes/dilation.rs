//! Bevelled convex solids: all points within b of a convex core.
//!
//! Along a ray the distance δ(t) to a convex core is a convex function, so the solid is one stretch
//! of the ray. The plain solid contains the bevelled one; from where the ray enters the plain one,
//! δ ≥ b, Newton's method on δ − b goes up to the entry without passing it, or finds δ rising, and
//! then there is none. On a face of the core δ is linear: the plain solid's entry is the answer and
//! the first look confirms it. Faces, rounded edges and corners are one function: there are no
//! seams to crack, and no trims. The exit is the entry of the reversed ray.
//!
//! Each step is as exact as δ. A grazing ray halves its distance to the tangent point with each
//! step.
use crate::lanes::{Lanes, Mask, axes};
use crate::scalar::Scalar;

use super::ray_lanes::{RayLanes, Span, along, distance_to_axis};

/// Newton steps after which a lane is taken as it is; four to six do unless the ray grazes.
const STEPS: usize = 64;

/// A convex solid that is its core, dilated.
pub(super) trait Dilated<F: Scalar> {
    /// The radius of the dilation.
    fn bevel(&self) -> F;
    /// Where rays are in the plain solid.
    fn plain<L: Lanes<Scalar = F>>(&self, ray: &RayLanes<L>) -> Span<L>;
    /// The distance from p, which is outside of the core, to the core, and how fast it changes
    /// along d.
    fn distance<L: Lanes<Scalar = F>>(&self, p: [L; 3], d: [L; 3]) -> (L, L);
}

/// A solid of revolution about the y axis, by its meridian.
pub(super) trait Revolved<F: Scalar> {
    /// From the core's nearest point to (ρ, y), away from the axis and upwards; zero in the core.
    fn offset<L: Lanes<Scalar = F>>(&self, rho: L, y: L) -> (L, L);
}

/// Where rays enter a solid that they are in the plain form of along a stretch.
#[inline(always)]
fn entry<F: Scalar, S: Dilated<F>, L: Lanes<Scalar = F>>(
    solid: &S,
    o: [L; 3],
    d: [L; 3],
    plain: Span<L>,
    active: L::Mask,
) -> (L::Mask, L) {
    let zero = L::zero();
    let b = L::splat(solid.bevel());
    let noise = L::splat(F::from_f64(8.0 * F::EPS.to_f64()));
    let start = along(o, d, plain.near);
    let length = plain.far - plain.near;
    let mut t = zero;
    let mut running = active;
    let mut entered = L::Mask::none();
    // No step may be longer than the one before: a root so flat is as good as met.
    let mut last = zero;
    for _ in 0..STEPS {
        let p = along(start, d, t);
        let (distance, slope) = solid.distance(p, d);
        let height = distance - b;
        let falling = slope.lt(zero);
        let arrived = running & height.le(noise);
        let step = -(height / slope);
        // An arrival is one step better yet, but for the first: where the plain solid was entered
        // through a face, that is the entry to an ulp.
        let better = arrived & falling & step.abs().le(last);
        t = L::select(better | running.and_not(arrived), t + step, t);
        last = step;
        entered = entered | arrived;
        running = running.and_not(arrived) & falling & t.le(length);
        if !running.any() {
            break;
        }
    }
    (entered | running, plain.near + t)
}

/// δ and δ' of a convex solid of revolution.
#[inline(always)]
pub(super) fn distance_around_axis<F: Scalar, L: Lanes<Scalar = F>>(
    solid: &impl Revolved<F>,
    [x, y, z]: [L; 3],
    d: [L; 3],
) -> (L, L) {
    let rho = distance_to_axis([x, y, z]);
    let (out, up) = solid.offset(rho, y);
    let radial = L::select(
        out.gt(L::zero()),
        x.mul_add(d[0], z * d[2]) / rho,
        L::zero(),
    );
    let distance = out.mul_add(out, up * up).sqrt();
    (distance, out.mul_add(radial, up * d[1]) / distance)
}

/// The point at distance b from the core and the normal, of a solid of revolution; where p is in its
/// core, those of the `plain` solid.
#[inline(always)]
pub(super) fn surface_around_axis<L: Lanes<Scalar = f64>>(
    solid: &impl Revolved<f64>,
    bevel: f64,
    [x, y, z]: [L; 3],
    plain: impl FnOnce() -> ([L; 3], [L; 3]),
) -> ([L; 3], [L; 3]) {
    let zero = L::zero();
    let bevel = L::splat(bevel);
    let rho = distance_to_axis([x, y, z]);
    let (out, up) = solid.offset(rho, y);
    let distance = out.mul_add(out, up * up).sqrt();
    let off_axis = rho.gt(zero);
    let (u, w) = (
        L::select(off_axis, x / rho, zero),
        L::select(off_axis, z / rho, zero),
    );
    let (out_normal, up_normal) = (out / distance, up / distance);
    let around = bevel.mul_add(out_normal, rho - out);
    let point = [around * u, bevel.mul_add(up_normal, y - up), around * w];
    let normal = [out_normal * u, up_normal, out_normal * w];
    with_others((point, normal), distance.le(zero), plain)
}

/// Points and normals, or `others` where the mask is set.
#[inline(always)]
pub(super) fn with_others<L: Lanes>(
    (point, normal): ([L; 3], [L; 3]),
    mask: L::Mask,
    others: impl FnOnce() -> ([L; 3], [L; 3]),
) -> ([L; 3], [L; 3]) {
    if !mask.any() {
        return (point, normal);
    }
    let (other_point, other_normal) = others();
    (
        axes!(|i| L::select(mask, other_point[i], point[i])),
        axes!(|i| L::select(mask, other_normal[i], normal[i])),
    )
}

/// The first crossing that the ray accepts.
#[inline(always)]
pub(super) fn intersect<F: Scalar, S: Dilated<F>, L: Lanes<Scalar = F>>(
    solid: &S,
    ray: &RayLanes<L>,
    active: L::Mask,
) -> (L::Mask, L) {
    let plain = solid.plain(ray);
    let active = active & plain.exists() & plain.far.gt(ray.t_min) & plain.near.lt(ray.t_max);
    if !active.any() {
        return (active, plain.near);
    }
    let (entered, near) = entry(solid, ray.o, ray.d, plain, active);
    let behind = entered & near.le(ray.t_min);
    if !behind.any() {
        return (entered & ray.accepts(near), near);
    }
    let reversed = Span {
        near: -plain.far,
        far: -plain.near,
    };
    let (left, far) = entry(solid, ray.o, axes!(|i| -ray.d[i]), reversed, behind);
    let t = L::select(behind, -far, near);
    (entered.and_not(behind.and_not(left)) & ray.accepts(t), t)
}
