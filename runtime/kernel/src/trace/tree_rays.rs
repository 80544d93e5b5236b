//! W rays in the space of a tree.
use super::precision::{Halves, rounded};
use super::single::TreeRay;
use crate::bvh::{NodeRay, NormalSpace};
use crate::instance::LevelRays;
use crate::lanes::{Isa, Lanes, axes};

/// The columns of [`TreeRay`].
#[derive(Clone)]
pub struct TreeRays<I: Isa> {
    pub origin: [I::F32; 3],
    pub direction: [I::F32; 3],
    pub node_ray: NodeRay<I::F32>,
    /// The tree's parameter of world t is (t − start)·per_rate.
    pub start: Halves<I::F64>,
    pub per_rate: Halves<I::F64>,
    pub after: I::F32,
    pub before: I::F32,
}

impl<I: Isa> TreeRays<I> {
    /// With hits in the world's interval.
    #[inline(always)]
    fn new(
        [origin, direction]: [[I::F32; 3]; 2],
        start: Halves<I::F64>,
        per_rate: Halves<I::F64>,
        interval: [&Halves<I::F64>; 2],
    ) -> TreeRays<I> {
        TreeRays {
            origin,
            direction,
            node_ray: NodeRay::new(origin, direction),
            start,
            per_rate,
            after: to_tree::<I>(&start, &per_rate, interval[0]),
            before: to_tree::<I>(&start, &per_rate, interval[1]),
        }
    }

    /// Rays of a group in the space of its tree.
    #[inline(always)]
    pub fn in_group(
        rays: &Halves<LevelRays<I::F64>>,
        space: &NormalSpace,
        interval: [&Halves<I::F64>; 2],
    ) -> TreeRays<I> {
        let [low, high] = rays;
        let [(low_origin, low_slide), (high_origin, high_slide)] =
            [low.in_space(space), high.in_space(space)];
        let scale = I::F64::splat(space.scale);
        let unscale = I::F64::splat(1.0 / space.scale);
        TreeRays::new(
            [
                axes!(|i| I::narrow(low_origin[i], high_origin[i])),
                axes!(|i| I::narrow(low.direction[i], high.direction[i])),
            ],
            [
                low.parameter.world(low_slide * unscale),
                high.parameter.world(high_slide * unscale),
            ],
            [
                low.parameter.per_rate * scale,
                high.parameter.per_rate * scale,
            ],
            interval,
        )
    }

    /// Rays that enter a mesh, whose space is theirs.
    #[inline(always)]
    pub fn in_mesh(
        rays: &Halves<LevelRays<I::F64>>,
        interval: [&Halves<I::F64>; 2],
    ) -> TreeRays<I> {
        let [low, high] = rays;
        TreeRays::new(
            rounded::<I>(rays),
            [low.parameter.start, high.parameter.start],
            [low.parameter.per_rate, high.parameter.per_rate],
            interval,
        )
    }

    /// The ray in lane `i`.
    #[inline(always)]
    pub fn get(&self, i: usize) -> TreeRay {
        let (half, place) = (i / I::F64::WIDTH, i % I::F64::WIDTH);
        TreeRay {
            origin: axes!(|axis| self.origin[axis].get(i)),
            direction: axes!(|axis| self.direction[axis].get(i)),
            node_ray: self.node_ray.get(i),
            start: self.start[half].get(place),
            per_rate: self.per_rate[half].get(place),
            after: self.after.get(i),
            before: self.before.get(i),
        }
    }

    /// Draws in the far end to the world's t.
    #[inline(always)]
    pub fn restrict(&mut self, t_max: &Halves<I::F64>) {
        self.before = to_tree::<I>(&self.start, &self.per_rate, t_max);
    }
}

/// World t in a tree's parameter.
#[inline(always)]
fn to_tree<I: Isa>(
    start: &Halves<I::F64>,
    per_rate: &Halves<I::F64>,
    t: &Halves<I::F64>,
) -> I::F32 {
    I::narrow(
        (t[0] - start[0]) * per_rate[0],
        (t[1] - start[1]) * per_rate[1],
    )
}
