//! D(p) ≤ r, D the distance to the circle ρ = R in y = 0.
//!
//! No quartic is formed: its coefficients lose (R/r)² ulps, and thin tori drown in them. With
//!
//!   g(t) = D² − r² = (ρ − R)² + y² − r²,   g'/2 = (ρ − R)(x d_x + z d_z)/ρ + y d_y,
//!   g''/2 = d·d − R m²/ρ³,                 m = x d_z − z d_x  (constant along the ray),
//!
//! g is convex where ρ³ > R m²/d·d and concave where ρ is less; ρ² is a parabola about the closest
//! approach to the axis, t_ρ: three pieces at most, convex, concave, convex, that meet at t_ρ ± w.
//! On a piece of one convexity, made convex by its sign σ, h = σg is positive at the start and then
//! Newton from there goes up to the first root without passing it, or past the minimum if there is
//! none (Fourier's condition); or it is not, and Newton from the end comes down to the only root,
//! if h is positive there. So the first root after t_min costs one Newton run on the piece it is
//! in, each step as exact as D. A spindle (r > R) is the same solid.
//!
//! (Bracketing by inflections is Yuksel's, HPG 2022, there for polynomials; here it is done to the
//! distance itself.) The cube root of the pieces' ends need not be exact.
use crate::lanes::{Lanes, Mask};
use crate::scalar::Scalar;

use super::dop::{difference_of_products, dot, sum_of_products};
use super::ray_lanes::{Intersect, RayLanes, Span, along, distance_to_axis};

/// Newton steps after which a lane is taken as it is. Six do where a ray crosses; each halves the
/// distance to a double root, where it grazes.
const STEPS: usize = 64;

/// A ring-shaped tube about the y axis.
#[derive(Clone, Debug)]
pub struct Torus<F> {
    major: F,
    minor: F,
}

/// A tube of radius r about the circle of radius R about the y axis in y = 0, and rays to cross it.
#[derive(Clone, Copy)]
pub(super) struct Tube<L> {
    pub major: L,
    pub minor: L,
    pub o: [L; 3],
    pub d: [L; 3],
}

/// A piece of the ray on which g is convex, concave, convex.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Piece {
    Before,
    Between,
    Behind,
}

const PIECES: [Piece; 3] = [Piece::Before, Piece::Between, Piece::Behind];

impl<L: Lanes> Tube<L> {
    /// g and g'. Before and behind the closest approach to the axis ρ falls and rises, which its
    /// derivative is told where rounding would lose it: on the axis.
    #[inline(always)]
    fn value_and_slope(&self, t: L, piece: Piece) -> (L, L) {
        let ([x, y, z], d) = (along(self.o, self.d, t), self.d);
        let around = distance_to_axis([x, y, z]);
        let across = around - self.major;
        let radial = x.mul_add(d[0], z * d[2]) / around;
        let radial = L::select(
            around.gt(L::zero()),
            radial,
            d[0].mul_add(d[0], d[2] * d[2]).sqrt(),
        );
        let radial = match piece {
            Piece::Before => -radial.abs(),
            Piece::Between => radial,
            Piece::Behind => radial.abs(),
        };
        let slope = across.mul_add(radial, y * d[1]);
        let value = y.mul_add(y, (across - self.minor) * (across + self.minor));
        (value, slope + slope)
    }

    /// g: positive outside of the tube.
    #[inline(always)]
    pub fn height(&self, t: L) -> L {
        self.value_and_slope(t, Piece::Between).0
    }

    /// Where pieces of one convexity meet, t_ρ − w and t_ρ + w; NaN for rays parallel to the axis.
    #[inline(always)]
    fn inflections(&self) -> (L, L) {
        let [o, d] = [self.o, self.d];
        let dd = d[0].mul_add(d[0], d[2] * d[2]);
        let m = difference_of_products(o[0], d[2], o[2], d[0]);
        let middle = -(sum_of_products(o[0], d[0], o[2], d[2]) / dd);
        let least = m * m / dd;
        let share = m * m / (self.major * self.major * dot(d, d));
        let inflection = self.major * cube_root(share);
        let width = (inflection.mul_add(inflection, -least).max(L::zero()) / dd).sqrt();
        (middle - width, middle + width)
    }

    /// The first time in a stretch, its ends included, at which rays that come to it `inside` of the
    /// tube or outside are on the other side. The stretch is finite in active lanes; `hole` is
    /// known to lie outside of the tube.
    ///
    /// What rays are told goes from piece to piece; g does not overrule it where one ends and the
    /// next begins, so no root is lost between two of them.
    #[inline(always)]
    pub fn first_crossing(
        &self,
        stretch: Span<L>,
        hole: Span<L>,
        inside: L::Mask,
        active: L::Mask,
    ) -> (L::Mask, L) {
        let (first, second) = self.inflections();
        let ends = [first.min(stretch.far), second.min(stretch.far), stretch.far];
        let mut start = stretch.near;
        let mut open = active & stretch.near.lt(stretch.far);
        let mut crossing = stretch.far;
        let mut found = L::Mask::none();
        for i in 0..3 {
            let (piece, end) = (PIECES[i], ends[i]);
            let near = L::select(hole.contains(start), hole.far, start);
            let far = L::select(hole.contains(end), hole.near, end);
            let here = open & near.lt(far);
            if here.any() {
                let (hit, t) = self.newton(piece, near, far, inside, here);
                crossing = L::select(hit, t, crossing);
                found = found | hit;
                open = open.and_not(hit);
            }
            start = end.max(start);
        }
        (found, crossing)
    }

    /// The first root on a piece, for rays that come to it `inside` or outside.
    #[inline(always)]
    fn newton(
        &self,
        piece: Piece,
        near: L,
        far: L,
        inside: L::Mask,
        active: L::Mask,
    ) -> (L::Mask, L) {
        let zero = L::zero();
        let two_eps = L::splat(L::Scalar::from_f64(2.0 * L::Scalar::EPS.to_f64()));
        let concave = piece == Piece::Between;
        let sign = L::splat(L::Scalar::from_f64(if concave { -1.0 } else { 1.0 }));
        let (at_near, slope_at_near) = self.value_and_slope(near, piece);
        let (at_far, _) = self.value_and_slope(far, piece);
        // Where h is held to be positive at the start, the first root is on its way down, and at the
        // start if h is less by rounding. Where it is held to be negative, it can only rise.
        let falling =
            active & (sign * slope_at_near).lt(zero) & if concave { inside } else { !inside };
        let met = falling & (sign * at_near).le(zero);
        let forward = falling.and_not(met);
        let rising = active & if concave { !inside } else { inside };
        let backward = rising & (sign * at_far).gt(zero);
        // A root is certain where the sign of h differs between low and high.
        let mut certain = backward | (forward & (sign * at_far).le(zero));
        let (mut low, mut high) = (near, far);
        let reach = self.major + self.minor;
        let mut t = L::select(backward, far, near);
        let mut running = forward | backward;
        let mut found = met;
        let mut last = L::splat(L::Scalar::INFINITY);
        for _ in 0..STEPS {
            let (value, slope) = self.value_and_slope(t, piece);
            let positive = (sign * value).gt(zero);
            let root_is_higher = (forward & positive) | (backward.and_not(positive));
            low = L::select(root_is_higher, t, low);
            high = L::select(root_is_higher, high, t);
            certain = certain | (running & !positive);
            let step = value / slope;
            let next = t - step;
            let within = low.lt(next) & next.lt(high);
            // As near as t and the points can tell.
            let close = two_eps * (reach + t.abs());
            let noise = (close + close) * self.minor;
            let landed = running
                & (step.abs().le(close)
                    | value.abs().le(noise)
                    | (certain & (high - low).le(close)));
            let middle = L::splat(L::Scalar::from_f64(0.5)) * (low + high);
            // A landing is one step better yet, unless g is so flat there that the step would grow.
            let better = running & within & (step.abs().le(last) | !landed);
            t = L::select(
                better,
                next,
                L::select((running & certain).and_not(landed), middle, t),
            );
            last = step.abs();
            found = found | landed;
            // Newton from a positive h leaves the piece, or turns back past the minimum: no root.
            running = running.and_not(landed) & (within | certain);
            if !running.any() {
                break;
            }
        }
        (found | (running & certain), t)
    }
}

/// The cube root of 0 ≤ x ≤ 1 to a few digits: x^(1/4 + 1/16), then two steps of Halley's.
#[inline(always)]
fn cube_root<L: Lanes>(x: L) -> L {
    let fourth = x.sqrt().sqrt();
    let mut y = fourth * fourth.sqrt().sqrt();
    for _ in 0..2 {
        let cube = y * y * y;
        y = y * ((cube + (x + x)) / (cube + cube + x));
    }
    L::select(x.gt(L::zero()), y, L::zero())
}

impl<F: Scalar> Torus<F> {
    pub(super) fn new(major: f64, minor: f64) -> Torus<F> {
        Torus {
            major: F::from_f64(major),
            minor: F::from_f64(minor),
        }
    }
}

impl<F: Scalar> Intersect<F> for Torus<F> {
    #[inline(always)]
    fn intersect<L: Lanes<Scalar = F>>(&self, ray: &RayLanes<L>, active: L::Mask) -> (L::Mask, L) {
        let (major, minor, d) = (L::splat(self.major), L::splat(self.minor), ray.d);
        // Count t from the closest approach to the center.
        let inverse = L::splat(F::ONE) / dot(d, d);
        let slide = -(dot(ray.o, d) * inverse);
        let o = ray.at(slide);
        let again = -(dot(o, d) * inverse);
        let o = along(o, d, again);
        let slide = slide + again;

        // What the torus is cut out of is wider than it, lest rounding put an end of the stretch
        // inside.
        let slack = L::splat(F::from_f64(16.0 * F::EPS.to_f64())) * (major + minor);
        let wide = minor + slack;
        // t_max may only end the search, or t would depend on it in its last digit.
        let stretch = Span {
            near: ray.t_min - slide,
            far: L::splat(F::INFINITY),
        }
        .and(Span::slab(o[1], d[1], -wide, wide))
        .and(Span::bar(o, d, major + wide));
        let t_max = ray.t_max - slide;
        let active = active & stretch.exists() & stretch.near.lt(t_max);
        if !active.any() {
            return (active, slide);
        }
        let hole = Span::bar(o, d, major - wide).only(wide.lt(major));
        let tube = Tube { major, minor, o, d };
        let mut inside = tube.height(stretch.near).le(L::zero());
        let mut open = active;
        let mut found = L::Mask::none();
        let mut t = stretch.near;
        // A ray that starts on the surface may be taken to be on the wrong side of it.
        for _ in 0..2 {
            let (crosses, crossing) = tube.first_crossing(stretch, hole, inside, open);
            t = L::select(crosses, crossing, t);
            open = crosses & crossing.le(stretch.near);
            found = found | crosses.and_not(open);
            if !open.any() {
                break;
            }
            inside = !inside;
        }
        let t = t + slide;
        (found & ray.accepts(t), t)
    }
}

impl Torus<f64> {
    #[inline(always)]
    pub(super) fn surface<L: Lanes<Scalar = f64>>(&self, [x, y, z]: [L; 3]) -> ([L; 3], [L; 3]) {
        let (zero, one) = (L::zero(), L::splat(1.0));
        let (major, minor) = (L::splat(self.major), L::splat(self.minor));
        let rho = distance_to_axis([x, y, z]);
        let off_axis = rho.gt(zero);
        let (u, w) = (
            L::select(off_axis, x / rho, zero),
            L::select(off_axis, z / rho, one),
        );
        let across = rho - major;
        let length = across.mul_add(across, y * y).sqrt();
        let off_circle = length.gt(zero);
        let across = L::select(off_circle, across / length, one);
        let up = L::select(off_circle, y / length, zero);
        let around = minor.mul_add(across, major);
        (
            [around * u, minor * up, around * w],
            [across * u, up, across * w],
        )
    }
}
