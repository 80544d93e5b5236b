//! Rays as the intersectors take them, and stretches of them.
use crate::lanes::{Lanes, axes};
use crate::scalar::Scalar;

use super::dop::{difference_of_products, dot, sum_of_products};

/// W rays in the space of a shape.
///
/// The caller has scaled `d` by a power of two so that its largest component lies in [1, 2),
/// and slid `o` along the ray to within some hundred sizes of the shape (`t` counts from there).
/// All numbers of active lanes are finite, but `t_min` and `t_max` may be infinite.
#[derive(Clone, Copy)]
pub struct RayLanes<L> {
    /// Origins.
    pub o: [L; 3],
    /// Directions.
    pub d: [L; 3],
    /// Hits have t > t_min.
    pub t_min: L,
    /// Hits have t < t_max.
    pub t_max: L,
}

impl<L: Lanes> RayLanes<L> {
    /// The points at `t`.
    #[inline(always)]
    pub fn at(&self, t: L) -> [L; 3] {
        along(self.o, self.d, t)
    }

    /// Whether t_min < t < t_max.
    #[inline(always)]
    pub fn accepts(&self, t: L) -> L::Mask {
        self.t_min.lt(t) & t.lt(self.t_max)
    }
}

/// A closed stretch of each ray; empty unless near ≤ far. Ends may be infinite.
#[derive(Clone, Copy)]
pub struct Span<L> {
    /// Where the ray enters.
    pub near: L,
    /// Where it leaves.
    pub far: L,
}

impl<L: Lanes> Span<L> {
    /// The whole line.
    #[inline(always)]
    pub fn line() -> Span<L> {
        let far = L::splat(L::Scalar::INFINITY);
        Span { near: -far, far }
    }

    /// This stretch where the mask is set, nothing elsewhere.
    #[inline(always)]
    pub fn only(self, mask: L::Mask) -> Span<L> {
        let infinity = L::splat(L::Scalar::INFINITY);
        Span {
            near: L::select(mask, self.near, infinity),
            far: L::select(mask, self.far, -infinity),
        }
    }

    /// What both have in common; an end that is NaN does not count.
    #[inline(always)]
    pub fn and(self, other: Span<L>) -> Span<L> {
        Span {
            near: other.near.max(self.near),
            far: other.far.min(self.far),
        }
    }

    /// Where there is a stretch at all.
    #[inline(always)]
    pub fn exists(self) -> L::Mask {
        self.near.le(self.far)
    }

    /// Whether t lies strictly within.
    #[inline(always)]
    pub fn contains(self, t: L) -> L::Mask {
        self.near.lt(t) & t.lt(self.far)
    }

    /// q + t·rate ≥ 0.
    #[inline(always)]
    pub fn half_space(q: L, rate: L) -> Span<L> {
        let zero = L::zero();
        let crossing = -q / rate;
        let line = Span::<L>::line();
        Span {
            near: L::select(rate.gt(zero), crossing, line.near),
            far: L::select(rate.lt(zero), crossing, line.far),
        }
        .only(!(rate.eq(zero) & q.lt(zero)))
    }

    /// low ≤ o + t·d ≤ high. One rounding of a difference and one of a quotient at either end.
    ///
    /// A ray within the slab that never leaves it (d = 0) divides by zero: its ends are infinite,
    /// or NaN if it runs in a face, which [`Span::and`] passes over.
    #[inline(always)]
    pub fn slab(o: L, d: L, low: L, high: L) -> Span<L> {
        let rising = L::splat(L::Scalar::ONE).copy_sign(d).gt(L::zero());
        let (near, far) = (L::select(rising, low, high), L::select(rising, high, low));
        Span {
            near: (near - o) / d,
            far: (far - o) / d,
        }
    }

    /// |p|² ≤ r², a ball about the origin. d ≠ 0.
    ///
    /// The ray's closest approach to the center is l = o + t_c d, t_c = −o·d / d·d, taken twice so
    /// that l is at right angles to d to working precision however far off o is; t = t_c ± √((r² −
    /// l²)/d·d). After Haines, Günther, Akenine-Möller, "Precision improvements for ray/sphere
    /// intersection", Ray Tracing Gems ch. 7 (2019); the second pass is ours. r² − l² is formed by
    /// fused steps from r², so that next to a grazing ray the decision is right to 2 ulps of r.
    #[inline(always)]
    pub fn ball(o: [L; 3], d: [L; 3], r: L) -> Span<L> {
        let inverse = L::splat(L::Scalar::ONE) / dot(d, d);
        let first = -(dot(o, d) * inverse);
        let l = along(o, d, first);
        let second = -(dot(l, d) * inverse);
        let l = along(l, d, second);
        let half = (room(r, l) * inverse).sqrt();
        Span {
            near: first + (second - half),
            far: first + (second + half),
        }
    }

    /// The same for d that may vanish: within eps of zero the ray stands still, inside or outside.
    #[inline(always)]
    pub fn ball_or_line(o: [L; 3], d: [L; 3], r: L) -> Span<L> {
        let eps = L::splat(L::Scalar::EPS);
        let still = dot(d, d).le(eps * eps);
        let (ball, line) = (
            Self::ball(o, d, r),
            Self::line().only(room(r, o).ge(L::zero())),
        );
        Span {
            near: L::select(still, line.near, ball.near),
            far: L::select(still, line.far, ball.far),
        }
    }

    /// x² + z² ≤ r², a round bar about the y axis: the ball's method in the plane of x and z.
    ///
    /// A ray within eps of the axis' direction is parallel to it: inside all along, or nowhere.
    #[inline(always)]
    pub fn bar(o: [L; 3], d: [L; 3], r: L) -> Span<L> {
        let eps = L::splat(L::Scalar::EPS);
        let dd = d[0].mul_add(d[0], d[2] * d[2]);
        let parallel = dd.le(eps * eps);
        let inverse = L::splat(L::Scalar::ONE) / dd;
        let first = -(sum_of_products(o[0], d[0], o[2], d[2]) * inverse);
        let (x, z) = (first.mul_add(d[0], o[0]), first.mul_add(d[2], o[2]));
        let second = -(sum_of_products(x, d[0], z, d[2]) * inverse);
        let (x, z) = (second.mul_add(d[0], x), second.mul_add(d[2], z));
        let (x, z) = (L::select(parallel, o[0], x), L::select(parallel, o[2], z));
        let room = room(r, [x, L::zero(), z]);
        let half = (room * inverse).sqrt();
        let line = Span::<L>::line();
        Span {
            near: L::select(parallel, line.near, first + (second - half)),
            far: L::select(parallel, line.far, first + (second + half)),
        }
        .only(room.ge(L::zero()))
    }

    /// The first end that the ray accepts, of a convex solid that the ray is within along this
    /// stretch.
    #[inline(always)]
    pub fn nearest(self, ray: &RayLanes<L>, active: L::Mask) -> (L::Mask, L) {
        let t = L::select(self.near.gt(ray.t_min), self.near, self.far);
        (active & self.exists() & ray.accepts(t), t)
    }
}

/// o + t d.
#[inline(always)]
pub(super) fn along<L: Lanes>(o: [L; 3], d: [L; 3], t: L) -> [L; 3] {
    axes!(|i| t.mul_add(d[i], o[i]))
}

/// How far p is from the y axis.
#[inline(always)]
pub(super) fn distance_to_axis<L: Lanes>([x, _, z]: [L; 3]) -> L {
    x.mul_add(x, z * z).sqrt()
}

/// The number nearest to x that keeps `room` from both ends, or as much as there is; if the ray was
/// beyond the end `before`, on that side of it.
#[inline(always)]
pub(super) fn clamped<L: Lanes<Scalar = f64>>(x: L, before: L, low: L, high: L, room: L) -> L {
    let within = room.min(L::splat(0.5) * (high - low));
    let inside = x.max(low + within).min(high - within);
    let under = before.lt(low) & x.lt(low + within);
    let over = before.gt(high) & x.gt(high - within);
    L::select(under, low - room, L::select(over, high + room, inside))
}

/// r² − p².
#[inline(always)]
fn room<L: Lanes>(r: L, p: [L; 3]) -> L {
    p[2].neg_mul_add(
        p[2],
        p[1].neg_mul_add(p[1], difference_of_products(r, r, p[0], p[0])),
    )
}

/// What rays can be intersected with, in the space of the shape.
pub(super) trait Intersect<F: Scalar> {
    /// For each active lane whether it hits with t_min < t < t_max, and the least such t.
    fn intersect<L: Lanes<Scalar = F>>(&self, ray: &RayLanes<L>, active: L::Mask) -> (L::Mask, L);
}
