//! The azimuths from φ0 to φ1, without atan2 and without wrapping.
//!
//! Azimuth runs from +z to +x: u(φ) = (sin φ, cos φ) in (x, z), v(φ) = (cos φ, −sin φ) at right
//! angles. q0 = p·v(φ0) and q1 = −p·v(φ1) are the distances to the side planes, positive towards
//! the inside. Up to 180° a point is inside if both are positive: an intersection of two
//! half-spaces. Beyond, it is outside if both are negative: the gap is one.
use crate::lanes::Lanes;
use crate::scalar::Scalar;

use super::angle::sin_cos_degrees;
use super::dop::{difference_of_products, sum_of_products};
use super::ray_lanes::{RayLanes, Span};

/// A sector of azimuths, 0° < span < 360°.
#[derive(Clone, Debug)]
pub struct Sector<F> {
    /// sin and cos of φ0 and of φ1.
    pub ends: [[F; 2]; 2],
    /// Whether the span is beyond 180°.
    pub reflex: bool,
}

/// The stretch of a ray that is in a sector up to 180°, or in the gap that a larger one leaves.
#[derive(Clone, Copy)]
pub enum Sides<L> {
    /// Within.
    In(Span<L>),
    /// Without.
    Out(Span<L>),
}

impl<F: Scalar> Sector<F> {
    /// From φ0 to φ1, in degrees.
    pub(super) fn new(phi: [f64; 2]) -> Sector<F> {
        let ends = phi.map(|phi| {
            let (sin, cos) = sin_cos_degrees(phi);
            [sin, cos].map(F::from_f64)
        });
        Sector {
            ends,
            reflex: phi[1] - phi[0] > 180.0,
        }
    }

    /// From φ0 + α to φ1 − α, where 0 ≤ α < 90° is given by its sine and cosine and 2α ≤ φ1 − φ0.
    pub(super) fn turned(phi: [f64; 2], sin_alpha: f64, cos_alpha: f64) -> Sector<F> {
        let turn = |phi: f64, sin_alpha: f64| {
            let (sin, cos) = sin_cos_degrees(phi);
            [
                sum_of_products(sin, cos_alpha, cos, sin_alpha),
                difference_of_products(cos, cos_alpha, sin, sin_alpha),
            ]
        };
        let ends = [turn(phi[0], sin_alpha), turn(phi[1], -sin_alpha)];
        // The span is still beyond 180° if the half that α is compared to is.
        let half = 0.5 * (phi[1] - phi[0]);
        let (sin_half, cos_half) = sin_cos_degrees(half);
        let cos_left = sum_of_products(cos_half, cos_alpha, sin_half, sin_alpha);
        Sector {
            ends: ends.map(|end| end.map(F::from_f64)),
            reflex: cos_left < 0.0,
        }
    }

    /// Distances to the two sides and how fast they change along the ray.
    #[inline(always)]
    fn depths<L: Lanes<Scalar = F>>(&self, ray: &RayLanes<L>) -> [(L, L); 2] {
        let ([sin0, cos0], [sin1, cos1]) = (L::splats(self.ends[0]), L::splats(self.ends[1]));
        let (o, d) = (ray.o, ray.d);
        [
            (
                difference_of_products(o[0], cos0, o[2], sin0),
                difference_of_products(d[0], cos0, d[2], sin0),
            ),
            (
                difference_of_products(o[2], sin1, o[0], cos1),
                difference_of_products(d[2], sin1, d[0], cos1),
            ),
        ]
    }

    /// Whether p is in the closed sector.
    #[inline(always)]
    pub(super) fn contains<L: Lanes<Scalar = F>>(&self, p: [L; 3]) -> L::Mask {
        let ([sin0, cos0], [sin1, cos1]) = (L::splats(self.ends[0]), L::splats(self.ends[1]));
        let zero = L::zero();
        let in0 = difference_of_products(p[0], cos0, p[2], sin0).ge(zero);
        let in1 = difference_of_products(p[2], sin1, p[0], cos1).ge(zero);
        if self.reflex { in0 | in1 } else { in0 & in1 }
    }

    /// Where rays are in the sector, or in its gap.
    #[inline(always)]
    pub(super) fn sides<L: Lanes<Scalar = F>>(&self, ray: &RayLanes<L>) -> Sides<L> {
        let [(q0, rate0), (q1, rate1)] = self.depths(ray);
        if self.reflex {
            Sides::Out(Span::half_space(-q0, -rate0).and(Span::half_space(-q1, -rate1)))
        } else {
            Sides::In(Span::half_space(q0, rate0).and(Span::half_space(q1, rate1)))
        }
    }
}

impl Sector<f64> {
    /// The side k, 0 or 1, seen from p: how far along it and how deep inside of it p is.
    #[inline(always)]
    pub(super) fn along_and_depth<L: Lanes<Scalar = f64>>(&self, side: usize, p: [L; 3]) -> (L, L) {
        let [sin, cos] = L::splats(self.ends[side]);
        let along = sum_of_products(p[0], sin, p[2], cos);
        let depth = difference_of_products(p[0], cos, p[2], sin);
        (along, if side == 0 { depth } else { -depth })
    }

    /// The outward normal of side k.
    pub(super) fn normal(&self, side: usize) -> [f64; 3] {
        let [sin, cos] = self.ends[side];
        if side == 0 {
            [-cos, 0.0, sin]
        } else {
            [cos, 0.0, -sin]
        }
    }
}
