//! From rays in f64 to intersectors in F, and back to the world's ray parameter.
use crate::instance::{LevelRays, Parameter};
use crate::lanes::{Isa, Lanes, Mask, axes, each, halves, take_bit};
use crate::scalar::Scalar;
use crate::scene::{BLOCK, TriangleBlock};
use crate::shapes::{RayLanes, Shape, TriangleRays, TurnedRays, turned};

/// The lanes of a packet in double precision: the first half, then the second.
pub type Halves<T> = [T; 2];

/// The mask of a whole packet.
pub type PacketMask<I> = <<I as Isa>::F32 as Lanes>::Mask;

/// The world's interval in the parameter of level rays.
///
/// Hits are compared in f64 afterwards, so the upper end may be too large: by what `from_level`
/// and this may round, so that ties are not lost.
#[inline(always)]
fn level_interval<L: Lanes<Scalar = f64>>(parameter: &Parameter<L>, t_min: L, t_max: L) -> (L, L) {
    let above = t_max.abs().mul_add(L::splat(4.0 * f64::EPSILON), t_max);
    (parameter.of_world(t_min), raised(parameter.of_world(above)))
}

/// A little more than t.
///
/// Rounding the lower end of an interval to nearest only misjudges hits closer to it than half
/// an ulp, which are undecidable; the upper end must not cut off a hit at it.
#[inline(always)]
fn raised<L: Lanes>(t: L) -> L {
    let slack = L::splat(L::Scalar::from_f64(L::Scalar::EPS.to_f64() * 4.0));
    t.abs()
        .mul_add(slack, t + L::splat(L::Scalar::MIN_POSITIVE))
}

/// Rays against one triangle of a block.
#[inline(always)]
fn intersect_one<L: Lanes>(
    rays: &TriangleRays<L>,
    axis: usize,
    block: &TriangleBlock<L::Scalar>,
    lane: usize,
    active: L::Mask,
) -> (L::Mask, L) {
    let [i, j, k] = turned(axis);
    let corners = each!(&block.corners, |corner| [
        L::splat(corner[i][lane]),
        L::splat(corner[j][lane]),
        L::splat(corner[k][lane]),
    ]);
    rays.intersect(axis, corners, active)
}

/// What scenes can be traced with.
pub trait Precision: Scalar {
    /// Lanes for the triangles of a block.
    type Block<I: Isa>: Lanes<Scalar = Self>;
    /// A packet made ready for the triangles of a mesh.
    type PacketRays<I: Isa>: Copy;

    /// Nearest crossings of a packet with a shape; world t.
    fn packet_shape<I: Isa>(
        shape: &Shape<Self>,
        rays: &Halves<LevelRays<I::F64>>,
        t_min: &Halves<I::F64>,
        t_max: &Halves<I::F64>,
        active: PacketMask<I>,
    ) -> (PacketMask<I>, Halves<I::F64>);

    /// Makes a packet ready for a mesh, with the interval to look in, the world's.
    fn packet_rays<I: Isa>(
        rays: &Halves<LevelRays<I::F64>>,
        t_min: &Halves<I::F64>,
        t_max: &Halves<I::F64>,
    ) -> Self::PacketRays<I>;

    /// Draws in the far end of the interval.
    fn packet_restrict<I: Isa>(
        prepared: &mut Self::PacketRays<I>,
        rays: &Halves<LevelRays<I::F64>>,
        t_min: &Halves<I::F64>,
        t_max: &Halves<I::F64>,
    );

    /// One ray of a packet, and its axes in their order.
    fn packet_get<I: Isa>(
        prepared: &Self::PacketRays<I>,
        lane: usize,
    ) -> (TurnedRays<Self>, [usize; 3]);

    /// Rays whose largest component is along this axis.
    fn packet_along<I: Isa>(prepared: &Self::PacketRays<I>, axis: usize) -> PacketMask<I>;

    /// Crossings of a packet along one axis with one triangle of a block; world t.
    fn packet_triangle<I: Isa>(
        prepared: &Self::PacketRays<I>,
        axis: usize,
        rays: &Halves<LevelRays<I::F64>>,
        block: &TriangleBlock<Self>,
        lane: usize,
        active: PacketMask<I>,
    ) -> (PacketMask<I>, Halves<I::F64>);
}

/// The interval of a packet in single precision.
#[inline(always)]
fn narrow_interval<I: Isa>(
    rays: &Halves<LevelRays<I::F64>>,
    t_min: &Halves<I::F64>,
    t_max: &Halves<I::F64>,
) -> (I::F32, I::F32) {
    let (low_min, low_max) = level_interval(&rays[0].parameter, t_min[0], t_max[0]);
    let (high_min, high_max) = level_interval(&rays[1].parameter, t_min[1], t_max[1]);
    (
        I::narrow(low_min, high_min),
        raised(I::narrow(low_max, high_max)),
    )
}

/// Origins and directions in single precision.
#[inline(always)]
pub fn rounded<I: Isa>(rays: &Halves<LevelRays<I::F64>>) -> [[I::F32; 3]; 2] {
    [
        axes!(|i| I::narrow(rays[0].origin[i], rays[1].origin[i])),
        axes!(|i| I::narrow(rays[0].direction[i], rays[1].direction[i])),
    ]
}

#[inline(always)]
fn widened<I: Isa>(rays: &Halves<LevelRays<I::F64>>, t: I::F32) -> Halves<I::F64> {
    let (low, high) = I::widen(t);
    [rays[0].parameter.world(low), rays[1].parameter.world(high)]
}

impl Precision for f32 {
    type Block<I: Isa> = I::F32x4;
    type PacketRays<I: Isa> = TriangleRays<I::F32>;

    #[inline(always)]
    fn packet_shape<I: Isa>(
        shape: &Shape<f32>,
        rays: &Halves<LevelRays<I::F64>>,
        t_min: &Halves<I::F64>,
        t_max: &Halves<I::F64>,
        active: PacketMask<I>,
    ) -> (PacketMask<I>, Halves<I::F64>) {
        let [o, d] = rounded::<I>(rays);
        let (t_min, t_max) = narrow_interval::<I>(rays, t_min, t_max);
        let ray = RayLanes { o, d, t_min, t_max };
        let (hit, t) = shape.intersect::<I, _>(&ray, active);
        (hit, widened::<I>(rays, t))
    }

    #[inline(always)]
    fn packet_rays<I: Isa>(
        rays: &Halves<LevelRays<I::F64>>,
        t_min: &Halves<I::F64>,
        t_max: &Halves<I::F64>,
    ) -> TriangleRays<I::F32> {
        let [o, d] = rounded::<I>(rays);
        let (t_min, t_max) = narrow_interval::<I>(rays, t_min, t_max);
        TriangleRays::new(&RayLanes { o, d, t_min, t_max })
    }

    #[inline(always)]
    fn packet_restrict<I: Isa>(
        prepared: &mut TriangleRays<I::F32>,
        rays: &Halves<LevelRays<I::F64>>,
        t_min: &Halves<I::F64>,
        t_max: &Halves<I::F64>,
    ) {
        let (t_min, t_max) = narrow_interval::<I>(rays, t_min, t_max);
        prepared.look_within(t_min, t_max);
    }

    #[inline(always)]
    fn packet_get<I: Isa>(
        prepared: &TriangleRays<I::F32>,
        lane: usize,
    ) -> (TurnedRays<f32>, [usize; 3]) {
        prepared.get(lane)
    }

    #[inline(always)]
    fn packet_along<I: Isa>(prepared: &TriangleRays<I::F32>, axis: usize) -> PacketMask<I> {
        prepared.along(axis)
    }

    #[inline(always)]
    fn packet_triangle<I: Isa>(
        prepared: &TriangleRays<I::F32>,
        axis: usize,
        rays: &Halves<LevelRays<I::F64>>,
        block: &TriangleBlock<f32>,
        lane: usize,
        active: PacketMask<I>,
    ) -> (PacketMask<I>, Halves<I::F64>) {
        let (hit, t) = intersect_one(prepared, axis, block, lane, active);
        (hit, widened::<I>(rays, t))
    }
}

impl Precision for f64 {
    type Block<I: Isa> = I::F64UpTo4;
    type PacketRays<I: Isa> = Halves<TriangleRays<I::F64>>;

    #[inline(always)]
    fn packet_shape<I: Isa>(
        shape: &Shape<f64>,
        rays: &Halves<LevelRays<I::F64>>,
        t_min: &Halves<I::F64>,
        t_max: &Halves<I::F64>,
        active: PacketMask<I>,
    ) -> (PacketMask<I>, Halves<I::F64>) {
        let active = I::split(active);
        let (hit_low, t_low) = half_shape::<I>(shape, &rays[0], t_min[0], t_max[0], active.0);
        let (hit_high, t_high) = half_shape::<I>(shape, &rays[1], t_min[1], t_max[1], active.1);
        (I::join(hit_low, hit_high), [t_low, t_high])
    }

    #[inline(always)]
    fn packet_rays<I: Isa>(
        rays: &Halves<LevelRays<I::F64>>,
        t_min: &Halves<I::F64>,
        t_max: &Halves<I::F64>,
    ) -> Halves<TriangleRays<I::F64>> {
        halves!(|h| {
            let (t_min, t_max) = level_interval(&rays[h].parameter, t_min[h], t_max[h]);
            TriangleRays::new(&RayLanes {
                o: rays[h].origin,
                d: rays[h].direction,
                t_min,
                t_max,
            })
        })
    }

    #[inline(always)]
    fn packet_restrict<I: Isa>(
        prepared: &mut Halves<TriangleRays<I::F64>>,
        rays: &Halves<LevelRays<I::F64>>,
        t_min: &Halves<I::F64>,
        t_max: &Halves<I::F64>,
    ) {
        let [low, high] = halves!(|h| level_interval(&rays[h].parameter, t_min[h], t_max[h]));
        prepared[0].look_within(low.0, low.1);
        prepared[1].look_within(high.0, high.1);
    }

    #[inline(always)]
    fn packet_get<I: Isa>(
        prepared: &Halves<TriangleRays<I::F64>>,
        lane: usize,
    ) -> (TurnedRays<f64>, [usize; 3]) {
        prepared[lane / I::F64::WIDTH].get(lane % I::F64::WIDTH)
    }

    #[inline(always)]
    fn packet_along<I: Isa>(prepared: &Halves<TriangleRays<I::F64>>, axis: usize) -> PacketMask<I> {
        I::join(prepared[0].along(axis), prepared[1].along(axis))
    }

    #[inline(always)]
    fn packet_triangle<I: Isa>(
        prepared: &Halves<TriangleRays<I::F64>>,
        axis: usize,
        rays: &Halves<LevelRays<I::F64>>,
        block: &TriangleBlock<f64>,
        lane: usize,
        active: PacketMask<I>,
    ) -> (PacketMask<I>, Halves<I::F64>) {
        let active = I::split(active);
        let (hit_low, t_low) = intersect_one(&prepared[0], axis, block, lane, active.0);
        let (hit_high, t_high) = intersect_one(&prepared[1], axis, block, lane, active.1);
        (
            I::join(hit_low, hit_high),
            [
                rays[0].parameter.world(t_low),
                rays[1].parameter.world(t_high),
            ],
        )
    }
}

/// Nearest crossings of half a packet with a shape; world t.
#[inline(always)]
fn half_shape<I: Isa>(
    shape: &Shape<f64>,
    rays: &LevelRays<I::F64>,
    t_min: I::F64,
    t_max: I::F64,
    active: <I::F64 as Lanes>::Mask,
) -> (<I::F64 as Lanes>::Mask, I::F64) {
    let (t_min, t_max) = level_interval(&rays.parameter, t_min, t_max);
    let ray = RayLanes {
        o: rays.origin,
        d: rays.direction,
        t_min,
        t_max,
    };
    let (hit, t) = shape.intersect::<I, _>(&ray, active);
    (hit, rays.parameter.world(t))
}

/// The interval of one ray.
#[inline(always)]
fn single_interval<F: Scalar>(parameter: &Parameter<f64>, t_min: f64, t_max: f64) -> (F, F) {
    let (t_min, t_max) = level_interval(parameter, t_min, t_max);
    (F::from_f64(t_min), raised(F::from_f64(t_max)))
}

/// World t of the nearest crossing of one ray with a shape.
#[inline(always)]
pub fn intersect_shape<I: Isa, F: Scalar>(
    shape: &Shape<F>,
    ray: &LevelRays<f64>,
    t_min: f64,
    t_max: f64,
) -> Option<f64> {
    let (t_min, t_max) = single_interval(&ray.parameter, t_min, t_max);
    let lanes = RayLanes {
        o: each!(ray.origin, |x| F::from_f64(x)),
        d: each!(ray.direction, |x| F::from_f64(x)),
        t_min,
        t_max,
    };
    let (hit, t) = shape.intersect::<I, F>(&lanes, true);
    let t = ray.parameter.world(t.to_f64());
    if hit { Some(t) } else { None }
}

/// One ray in every lane, made ready for the triangles of a mesh, and its axes in their order.
#[inline(always)]
pub fn block_ray<L: Lanes>(
    ray: &LevelRays<f64>,
    t_min: f64,
    t_max: f64,
) -> (TurnedRays<L>, [usize; 3]) {
    let (t_min, t_max) = single_interval(&ray.parameter, t_min, t_max);
    let rays = TriangleRays::<L::Scalar>::new(&RayLanes {
        o: each!(ray.origin, |x| L::Scalar::from_f64(x)),
        d: each!(ray.direction, |x| L::Scalar::from_f64(x)),
        t_min,
        t_max,
    });
    let axis = rays.axis();
    (rays.turned(axis).in_lanes(), turned(axis))
}

/// Draws in the far end of the interval of one ray.
#[inline(always)]
pub fn restrict_block_ray<L: Lanes>(
    prepared: &mut TurnedRays<L>,
    parameter: &Parameter<f64>,
    t_min: f64,
    t_max: f64,
) {
    let (t_min, t_max) = single_interval(parameter, t_min, t_max);
    prepared.look_within(L::splat(t_min), L::splat(t_max));
}

/// Crossings of one ray with the triangles of a block, given to `found` with the triangle's
/// lane; world t.
#[inline(always)]
pub fn intersect_block<L: Lanes>(
    prepared: &TurnedRays<L>,
    [i, j, k]: [usize; 3],
    parameter: &Parameter<f64>,
    block: &TriangleBlock<L::Scalar>,
    mut found: impl FnMut(usize, f64),
) {
    for first in (0..BLOCK).step_by(L::WIDTH) {
        let corners = each!(&block.corners, |corner| [
            L::load(&corner[i][first..]),
            L::load(&corner[j][first..]),
            L::load(&corner[k][first..]),
        ]);
        let (hit, t) = prepared.intersect(corners, Mask::full());
        let mut hit = hit.bits();
        if hit == 0 {
            continue;
        }
        let mut lanes = [L::Scalar::default(); BLOCK];
        t.store(&mut lanes);
        while let Some(lane) = take_bit(&mut hit) {
            found(first + lane, parameter.world(lanes[lane].to_f64()));
        }
    }
}
