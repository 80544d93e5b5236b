//! The solid between the disc of radius r in y = 0 and the apex (0, h, 0).
//!
//! Seen from the apex downwards, Y = h − y, the double cone is q(p) = x² + z² − k²Y² ≤ 0, k = r/h.
//! Along a ray q = A t² + 2B t + C with
//!
//!   A = (|d⊥| − k|d_Y|)(|d⊥| + k|d_Y|),  C likewise of o,  B = x d_x + z d_z − k² Y d_Y,
//!   B² − AC = (k|m⊥|)² − m_Y²,  m = o × d in (x, Y, z),
//!
//! the last as a product of sum and difference, its minors each a difference of products: the ray's
//! moment does not change when the ray is slid, so nothing large cancels in it. Beforehand o is
//! moved to the point of the ray nearest the tip, which is the apex unless a bevel has cut it off:
//! where a ray passes it closely both roots are next to that point, and counted from elsewhere they
//! are differences of large numbers, divided by an A that may be small. With Q = B + sign(B)√ the
//! roots are −Q/A and −C/Q; the second stays finite where A → 0, a ray parallel to a generator.
//!
//! The ray is in the lower nappe, Y ≥ 0: between the roots if A ≥ 0, and then they are both below
//! the apex or both above; from the greater root on if A < 0 and the ray goes down; up to the
//! lesser if it goes up. So the solid is one stretch of the ray, cut by y ≥ 0.
use crate::lanes::Lanes;
use crate::scalar::Scalar;

use super::dop::{difference_of_products, dot, sum_of_products};
use super::ray_lanes::{Intersect, RayLanes, Span, clamped, distance_to_axis};

/// x² + z² − k²Y².
#[inline(always)]
fn form<L: Lanes>(k: L, [x, down, z]: [L; 3]) -> L {
    let (around, along) = (distance_to_axis([x, down, z]), k * down.abs());
    (around - along) * (around + along)
}

/// A cone about the y axis.
#[derive(Clone, Debug)]
pub struct Cone<F> {
    radius: F,
    height: F,
    slope: F,
    /// The height of what rays are to be intersected with.
    pub(super) tip: F,
}

impl<F: Scalar> Cone<F> {
    pub(super) fn new(radius: f64, height: f64) -> Cone<F> {
        Cone::below(radius, height, height)
    }

    /// One of which nothing is above `tip`.
    pub(super) fn below(radius: f64, height: f64, tip: f64) -> Cone<F> {
        Cone {
            radius: F::from_f64(radius),
            height: F::from_f64(height),
            slope: F::from_f64(radius / height),
            tip: F::from_f64(tip),
        }
    }

    #[inline(always)]
    pub(super) fn span<L: Lanes<Scalar = F>>(&self, ray: &RayLanes<L>) -> Span<L> {
        let (h, k) = (L::splat(self.height), L::splat(self.slope));
        let (zero, d) = (L::zero(), ray.d);

        // Slide the origin.
        let from_tip = [ray.o[0], ray.o[1] - L::splat(self.tip), ray.o[2]];
        let inverse = L::splat(F::ONE) / dot(d, d);
        let slide = -(dot(from_tip, d) * inverse);
        let [x, y, z] = ray.at(slide);
        let [x, down, z] = [x, h - y, z];
        let [dx, d_down, dz] = [d[0], -d[1], d[2]];

        // The quadratic.
        let a = form(k, [dx, d_down, dz]);
        let c = form(k, [x, down, z]);
        let b = (k * down).neg_mul_add(k * d_down, sum_of_products(x, dx, z, dz));
        let m_x = difference_of_products(down, dz, z, d_down);
        let m_y = difference_of_products(z, dx, x, dz).abs();
        let m_z = difference_of_products(x, d_down, down, dx);
        let m_around = k * m_x.mul_add(m_x, m_z * m_z).sqrt();
        let room = (m_around - m_y) * (m_around + m_y);
        let q = b + room.sqrt().copy_sign(b);
        // Through the apex itself, if the origin is there now, Q = 0 and both roots are one.
        let at_apex = q.eq(zero);
        let t0 = -(q / a);
        let t1 = L::select(at_apex, t0, -(c / q));
        let (least, most) = (t0.min(t1), t0.max(t1));

        // The stretch in the lower nappe.
        let between = a.ge(zero);
        let below = t1.mul_add(d_down, down).ge(zero);
        let sinking = d_down.gt(zero);
        let line = Span::<L>::line();
        let nappe = Span {
            near: L::select(between, least, L::select(sinking, most, line.near)),
            far: L::select(between, most, L::select(sinking, line.far, least)),
        }
        .only(room.ge(zero) & (a.lt(zero) | !at_apex) & (below | !between));
        Span {
            near: nappe.near + slide,
            far: nappe.far + slide,
        }
        .and(Span::half_space(ray.o[1], d[1]))
    }
}

impl<F: Scalar> Intersect<F> for Cone<F> {
    #[inline(always)]
    fn intersect<L: Lanes<Scalar = F>>(&self, ray: &RayLanes<L>, active: L::Mask) -> (L::Mask, L) {
        self.span(ray).nearest(ray, active)
    }
}

impl Cone<f64> {
    #[inline(always)]
    pub(super) fn surface<L: Lanes<Scalar = f64>>(
        &self,
        [x, y, z]: [L; 3],
        before: [L; 3],
        room: L,
    ) -> ([L; 3], [L; 3]) {
        let (r, h) = (self.radius, self.height);
        let side = r.mul_add(r, h * h).sqrt();
        let [radius, height, sin, cos] = L::splats([r, h, r / side, h / side]);
        let (zero, one) = (L::zero(), L::splat(1.0));
        let rho = distance_to_axis([x, y, z]);
        // Rays start up to 4 rooms off a face, towards the other where the rim is acute.
        let room = room * L::splat((side + 4.0 * r).min(16.0 * h) / h);
        let outside = (rho - radius) * cos + y * sin;
        let base = (-y).gt(outside);
        let unit = one / rho.max(L::splat(f64::MIN_POSITIVE));
        let (u, w) = (x * unit, z * unit);
        let up = clamped(y - outside * sin, before[1], zero, height + height, room).min(height);
        let side_around = radius * ((height - up) / height);
        let beyond = (distance_to_axis(before) - radius) * cos + before[1] * sin;
        let kept = clamped(rho, radius + beyond, -radius, radius, room);
        let around = L::select(base, kept, side_around);
        let apex = rho.eq(zero);
        let slope = L::select(base | apex, zero, cos);
        let steepness = L::select(base, -one, L::select(apex, one, sin));
        let level = L::select(base, zero, L::select(apex, height, up));
        (
            [around * u, level, around * w],
            [slope * u, steepness, slope * w],
        )
    }
}
