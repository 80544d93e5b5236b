//! Rays through instance transforms.
//!
//! With object_from_world = [W | w] and T the translation of world_from_object, a ray o + t·d is
//! in object space W·(o − T) + t·W·d: t is the same parameter in every space. Two things would
//! lose digits, and neither is allowed to:
//!
//! * W·o + w cancels when the object is far from the world's origin. So T is subtracted before
//!   anything is rounded, with the rounding error of the subtraction kept (TwoDiff: Knuth; the
//!   low part of T goes with it).
//! * Rounding o' to F (or to f64) loses what a distant origin has too many digits of. So the
//!   origin is first slid along the ray to s, near the object: r = (o − T) + s·d. With fma and
//!   the kept low part, r is within an ulp of its own small size from the exact point *on the
//!   ray*, so any s serves and s may be computed carelessly. Then o' = W·r, and t = s + t'.
//!
//! Everything here is f64, before rounding to F. What follows in F sees only numbers of order one:
//! o' in the object's normalised space, and d' times a power of two that brings its largest
//! component into [1, 2). Powers of two are exact, so t' maps back exactly.
use crate::bvh::NormalSpace;
use crate::lanes::{Lanes, Mask, axes, each};
use crate::scene::{Affine, Anchor};

/// Rays in f64 on their way through levels of instancing.
#[derive(Clone, Copy)]
pub struct LevelRays<L> {
    pub origin: [L; 3],
    /// The largest component is in [1, 2).
    pub direction: [L; 3],
    pub parameter: Parameter<L>,
}

/// How the world's ray parameter t = start + rate·τ depends on τ, that of a level. `rate` is a power
/// of two and `per_rate` its inverse.
#[derive(Clone, Copy)]
pub struct Parameter<L> {
    pub start: L,
    pub rate: L,
    pub per_rate: L,
}

impl<L: Lanes<Scalar = f64>> Parameter<L> {
    /// Of one ray.
    #[inline(always)]
    pub fn get(&self, i: usize) -> Parameter<f64> {
        Parameter {
            start: self.start.get(i),
            rate: self.rate.get(i),
            per_rate: self.per_rate.get(i),
        }
    }

    /// The world's t.
    #[inline(always)]
    pub fn world(&self, tau: L) -> L {
        tau.mul_add(self.rate, self.start)
    }

    /// τ of the world's t.
    #[inline(always)]
    pub fn of_world(&self, t: L) -> L {
        (t - self.start) * self.per_rate
    }
}

/// One instance as rays enter it.
#[derive(Clone, Copy)]
pub(crate) struct Entrance<'a> {
    pub object_from_world: &'a Affine,
    /// Last column of world_from_object, and what rounding cut off from it.
    pub translation: [f64; 3],
    pub translation_low: [f32; 3],
    pub anchor: Anchor,
}

#[inline(always)]
pub fn dot<L: Lanes>(a: [L; 3], b: [L; 3]) -> L {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]))
}

/// a − b and the exact error of that difference.
#[inline(always)]
fn two_diff<L: Lanes>(a: L, b: L) -> (L, L) {
    let difference = a - b;
    let minus_b = difference - a;
    (difference, (a - (difference - minus_b)) - (b + minus_b))
}

/// The linear part of a matrix applied to a vector.
#[inline(always)]
fn linear<L: Lanes<Scalar = f64>>(matrix: &Affine, v: [L; 3]) -> [L; 3] {
    axes!(|row| {
        let [x, y, z, _] = matrix[row];
        dot([L::splat(x), L::splat(y), L::splat(z)], v)
    })
}

impl Entrance<'_> {
    /// Object-space origin, direction, and how far (in τ) the origin was slid.
    #[inline(always)]
    fn enter<L: Lanes<Scalar = f64>>(&self, rays: &LevelRays<L>) -> ([L; 3], [L; 3], L) {
        let differences: [(L, L); 3] =
            axes!(|i| two_diff(rays.origin[i], L::splat(self.translation[i])));
        let relative = each!(differences, |(high, _)| high);
        let low: [L; 3] =
            axes!(|i| differences[i].1 - L::splat(f64::from(self.translation_low[i])));
        let origin = linear(self.object_from_world, relative);
        let direction = linear(self.object_from_world, rays.direction);
        let slide = self.anchor.slide(origin, direction);
        let slid: [L; 3] = axes!(|i| slide.mul_add(rays.direction[i], relative[i]) + low[i]);
        (linear(self.object_from_world, slid), direction, slide)
    }

    /// The rays in the normalised space of a prototype.
    #[inline(always)]
    pub fn enter_prototype<L: Lanes<Scalar = f64>>(
        &self,
        rays: &LevelRays<L>,
        space: &NormalSpace,
    ) -> LevelRays<L> {
        let (origin, direction, slide) = self.enter(rays);
        let scale = L::splat(space.scale);
        let unscale = L::splat(1.0 / space.scale);
        LevelRays {
            origin: axes!(|i| (origin[i] - L::splat(space.center[i])) * scale),
            direction,
            parameter: Parameter {
                start: rays.parameter.world(slide),
                rate: rays.parameter.rate * unscale,
                per_rate: rays.parameter.per_rate * scale,
            },
        }
        .with_unit_direction()
    }

    /// The rays in the space of a group.
    #[inline(always)]
    pub fn enter_group<L: Lanes<Scalar = f64>>(&self, rays: &LevelRays<L>) -> LevelRays<L> {
        self.enter_prototype(rays, &NormalSpace::IDENTITY)
    }
}

impl Anchor {
    /// How far along the ray its origin is to be slid.
    #[inline(always)]
    fn slide<L: Lanes<Scalar = f64>>(&self, origin: [L; 3], direction: [L; 3]) -> L {
        if self.flat {
            let slide = -(origin[1] / direction[1]);
            return L::select(slide.abs().lt(L::splat(f64::INFINITY)), slide, L::zero());
        }
        let center = each!(self.center, |x| L::splat(x));
        slide_to_center(axes!(|i| origin[i] - center[i]), direction, self.reach)
    }
}

/// To where a ray is nearest to 0, if it starts beyond `reach` (a square); else not at all.
#[inline(always)]
pub fn slide_to_center<L: Lanes<Scalar = f64>>(origin: [L; 3], direction: [L; 3], reach: f64) -> L {
    let far = dot(origin, origin).gt(L::splat(reach));
    if !far.any() {
        return L::zero();
    }
    let closest = -(dot(origin, direction) / dot(direction, direction));
    L::select(far, closest, L::zero())
}

impl LevelRays<f64> {
    /// Some ray, where there is none yet.
    pub const SOME: LevelRays<f64> = LevelRays {
        origin: [0.0; 3],
        direction: [1.0; 3],
        parameter: Parameter {
            start: 0.0,
            rate: 1.0,
            per_rate: 1.0,
        },
    };
}

impl<L: Lanes<Scalar = f64>> LevelRays<L> {
    /// The ray in lane `i`.
    #[inline(always)]
    pub fn get(&self, i: usize) -> LevelRays<f64> {
        LevelRays {
            origin: axes!(|axis| self.origin[axis].get(i)),
            direction: axes!(|axis| self.direction[axis].get(i)),
            parameter: self.parameter.get(i),
        }
    }

    /// The same rays with directions scaled by powers of two, the largest component in [1, 2).
    #[inline(always)]
    pub fn with_unit_direction(self) -> LevelRays<L> {
        let [x, y, z] = each!(self.direction, |d| d.abs());
        let largest = x.max(y).max(z);
        let unit = largest.unit_scale();
        LevelRays {
            direction: each!(self.direction, |d| d * unit),
            parameter: Parameter {
                rate: self.parameter.rate * unit,
                per_rate: self.parameter.per_rate * unit.unit_scale(),
                ..self.parameter
            },
            ..self
        }
    }

    /// The origins in the normalised space of a tree, and how far (in τ·scale, the parameter
    /// there) they were slid; directions stay as they are.
    #[inline(always)]
    pub fn in_space(&self, space: &NormalSpace) -> ([L; 3], L) {
        /// Content lies within √3 of the centre: origins up to twice as far may stay.
        const REACH: f64 = 12.0;
        let scale = L::splat(space.scale);
        let differences: [(L, L); 3] = axes!(|i| {
            let (high, low) = two_diff(self.origin[i], L::splat(space.center[i]));
            (high * scale, low * scale)
        });
        let origin = each!(differences, |(high, _)| high);
        let slide = slide_to_center(origin, self.direction, REACH);
        let slid = axes!(|i| slide.mul_add(self.direction[i], origin[i]) + differences[i].1);
        (slid, slide)
    }
}
