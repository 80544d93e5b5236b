//! W rays by coordinate, and whether they are worth a packet.
use super::precision::Halves;
use crate::bvh::NormalSpace;
use crate::instance::LevelRays;
use crate::lanes::{Isa, Lanes, MAX_WIDTH, Mask, axes, each, halves};
use crate::ray::Ray;

/// Up to W rays, a column for each coordinate; idle lanes repeat the last ray.
pub struct RayColumns<I: Isa> {
    origin: Halves<[I::F64; 3]>,
    direction: Halves<[I::F64; 3]>,
    pub t_min: Halves<I::F64>,
    pub t_max: Halves<I::F64>,
    /// How many there are.
    pub len: usize,
}

impl<I: Isa> RayColumns<I> {
    /// At least one ray and at most W.
    #[inline(always)]
    pub fn new(rays: &[Ray]) -> RayColumns<I> {
        assert!(!rays.is_empty() && rays.len() <= I::F32::WIDTH);
        let last = &rays[rays.len() - 1];
        let mut columns = [[0.0; MAX_WIDTH]; 8];
        for lane in 0..I::F32::WIDTH {
            let &Ray {
                origin: [x, y, z],
                direction: [u, v, w],
                t_min,
                t_max,
            } = rays.get(lane).unwrap_or(last);
            let row = [x, y, z, u, v, w, t_min, t_max];
            for (column, number) in columns.iter_mut().zip(row) {
                column[lane] = number;
            }
        }
        let half = I::F64::WIDTH;
        RayColumns {
            origin: halves!(|h| axes!(|i| I::F64::load(&columns[i][h * half..]))),
            direction: halves!(|h| axes!(|i| I::F64::load(&columns[i + 3][h * half..]))),
            t_min: halves!(|h| I::F64::load(&columns[6][h * half..])),
            t_max: halves!(|h| I::F64::load(&columns[7][h * half..])),
            len: rays.len(),
        }
    }

    /// The rays in the world.
    #[inline(always)]
    pub fn level_rays(&self) -> Halves<LevelRays<I::F64>> {
        let one = I::F64::splat(1.0);
        halves!(|h| {
            LevelRays {
                origin: self.origin[h],
                direction: self.direction[h],
                start: I::F64::zero(),
                rate: one,
                per_rate: one,
            }
            .with_unit_direction()
        })
    }

    /// Whether all of them can hit anything at all.
    #[inline(always)]
    pub fn are_valid(&self) -> bool {
        let infinity = I::F64::splat(f64::INFINITY);
        let zero = I::F64::zero();
        let [low, high] = halves!(|h| {
            let [x, y, z] = each!(self.origin[h], |x| x.abs().lt(infinity));
            let [u, v, w] = each!(self.direction[h], |x| x.abs());
            let finite = x & y & z & u.lt(infinity) & v.lt(infinity) & w.lt(infinity);
            let directed = u.gt(zero) | v.gt(zero) | w.gt(zero);
            finite & directed & self.t_min[h].lt(self.t_max[h])
        });
        (low & high).all()
    }

    /// Whether they are valid and worth a packet: within a tenth of a turn or so of the first,
    /// and starting close to it in proportion to the scene, whose root has that space.
    #[inline(always)]
    pub fn are_coherent(&self, space: &NormalSpace) -> bool {
        /// Largest difference of a direction's components, the largest component being one.
        const DIRECTION_SPREAD: f32 = 0.1875;
        /// Largest difference of an origin's components in normalised space of the root.
        const ORIGIN_SPREAD: f64 = 0.09375;
        if !self.are_valid() {
            return false;
        }
        let spread = I::F64::splat(ORIGIN_SPREAD / space.scale);
        let first = each!(self.origin[0], |x| I::F64::splat(x.get(0)));
        let [low, high] = halves!(|h| {
            let [x, y, z] = axes!(|i| (self.origin[h][i] - first[i]).abs().le(spread));
            x & y & z
        });
        if !(low & high).all() {
            return false;
        }
        // Powers of two keep any length within single precision.
        let scaled: Halves<[I::F64; 3]> = halves!(|h| {
            let [x, y, z] = each!(self.direction[h], |x| x.abs());
            let unit = x.max(y).max(z).unit_scale();
            each!(self.direction[h], |x| x * unit)
        });
        let direction: [I::F32; 3] = axes!(|i| I::narrow(scaled[0][i], scaled[1][i]));
        let [x, y, z] = each!(direction, |x| x.abs());
        let per_largest = I::F32::splat(1.0) / x.max(y).max(z);
        let spread = I::F32::splat(DIRECTION_SPREAD);
        let [x, y, z] = each!(direction, |x| {
            let x = x * per_largest;
            (x - I::F32::splat(x.get(0))).abs().le(spread)
        });
        (x & y & z).all()
    }
}
