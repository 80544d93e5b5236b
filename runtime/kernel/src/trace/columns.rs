//! W rays by coordinate, and whether they are worth a packet.
use super::precision::{Halves, PacketMask};
use crate::bvh::NormalSpace;
use crate::instance::{LevelRays, Parameter};
use crate::lanes::{Isa, Lanes, MAX_WIDTH, Mask, axes, each, halves};
use crate::ray::{Ray, Rays};

/// Up to W rays in the world, a column for each coordinate; idle lanes repeat the last ray.
#[derive(Clone)]
pub struct RayColumns<I: Isa> {
    pub level: Halves<LevelRays<I::F64>>,
    pub t_min: Halves<I::F64>,
    pub t_max: Halves<I::F64>,
    /// The leaves that they leave for good, or −1.
    pub left: Halves<I::F64>,
    /// How many there are.
    pub len: usize,
}

/// The columns of W records.
#[inline(always)]
fn transposed<I: Isa>(rows: &[[f64; 8]]) -> Halves<[I::F64; 8]> {
    let mut columns = [[0.0; MAX_WIDTH]; 8];
    let rows = &rows[..I::F32::WIDTH];
    for lane in 0..I::F32::WIDTH {
        for i in 0..8 {
            columns[i][lane] = rows[lane][i];
        }
    }
    halves!(|h| {
        let mut half = [I::F64::zero(); 8];
        for i in 0..8 {
            half[i] = I::F64::load(&columns[i][h * I::F64::WIDTH..]);
        }
        half
    })
}

/// W numbers, or one for all.
#[inline(always)]
fn column<I: Isa>(numbers: &[f64], first: usize) -> Halves<I::F64> {
    if let [all] = numbers {
        return [I::F64::splat(*all); 2];
    }
    halves!(|h| I::F64::load(&numbers[first + h * I::F64::WIDTH..]))
}

impl<I: Isa> RayColumns<I> {
    /// The W rays from number `first` on, or those that are left; at least one.
    #[inline(always)]
    pub fn new(rays: Rays, first: usize) -> RayColumns<I> {
        const WIDE: usize = MAX_WIDTH;
        let len = (rays.len() - first).min(I::F32::WIDTH);
        match rays {
            Rays::Columns {
                origins,
                directions,
                t_min,
                t_max,
            } if len == I::F32::WIDTH => RayColumns::of(
                halves!(|h| I::columns(&origins[first + h * I::F64::WIDTH..])),
                halves!(|h| I::columns(&directions[first + h * I::F64::WIDTH..])),
                column::<I>(t_min, first),
                column::<I>(t_max, first),
                column::<I>(rays.left(), first),
                len,
            ),
            Rays::Axes {
                origin,
                direction,
                t_min,
                t_max,
                left,
                ..
            } if len == I::F32::WIDTH => {
                let origin = axes!(|i| column::<I>(origin[i], first));
                let direction = axes!(|i| column::<I>(direction[i], first));
                RayColumns::of(
                    halves!(|h| axes!(|i| origin[i][h])),
                    halves!(|h| axes!(|i| direction[i][h])),
                    column::<I>(t_min, first),
                    column::<I>(t_max, first),
                    column::<I>(left, first),
                    len,
                )
            }
            _ => {
                let mut some = [rays.get(first + len - 1); WIDE];
                for (i, ray) in some[..len].iter_mut().enumerate() {
                    *ray = rays.get(first + i);
                }
                let mut left = [-1.0; WIDE];
                match rays.left() {
                    [all] => left = [*all; WIDE],
                    each => left[..len].copy_from_slice(&each[first..first + len]),
                }
                RayColumns::of_records(Ray::as_rows(&some), column::<I>(&left, 0), len)
            }
        }
    }

    #[inline(always)]
    fn of_records(rows: &[[f64; 8]], left: Halves<I::F64>, len: usize) -> RayColumns<I> {
        let columns = transposed::<I>(rows);
        RayColumns::of(
            halves!(|h| axes!(|i| columns[h][i])),
            halves!(|h| axes!(|i| columns[h][i + 3])),
            halves!(|h| columns[h][6]),
            halves!(|h| columns[h][7]),
            left,
            len,
        )
    }

    #[inline(always)]
    fn of(
        origin: Halves<[I::F64; 3]>,
        direction: Halves<[I::F64; 3]>,
        t_min: Halves<I::F64>,
        t_max: Halves<I::F64>,
        left: Halves<I::F64>,
        len: usize,
    ) -> RayColumns<I> {
        let one = I::F64::splat(1.0);
        let level = halves!(|h| {
            LevelRays {
                origin: origin[h],
                direction: direction[h],
                parameter: Parameter {
                    start: I::F64::zero(),
                    rate: one,
                    per_rate: one,
                },
            }
            .with_unit_direction()
        });
        RayColumns {
            level,
            t_min,
            t_max,
            left,
            len,
        }
    }

    /// Those that can hit anything at all.
    #[inline(always)]
    pub fn valid(&self) -> PacketMask<I> {
        let infinity = I::F64::splat(f64::INFINITY);
        let zero = I::F64::zero();
        let [low, high] = halves!(|h| {
            let rays = &self.level[h];
            let [x, y, z] = each!(rays.origin, |x| x.abs().lt(infinity));
            let [u, v, w] = each!(rays.direction, |x| x.abs());
            let finite = x & y & z & u.lt(infinity) & v.lt(infinity) & w.lt(infinity);
            let directed = u.gt(zero) | v.gt(zero) | w.gt(zero);
            finite & directed & self.t_min[h].lt(self.t_max[h])
        });
        I::join(low, high)
    }

    /// Whether they can hit anything, and start within half of the scene, whose root has that space,
    /// of where the first does.
    #[inline(always)]
    pub fn start_together(&self, space: &NormalSpace) -> bool {
        /// Largest difference of an origin's components in normalised space of the root.
        const ORIGIN_SPREAD: f64 = 1.0;
        let spread = I::F64::splat(ORIGIN_SPREAD / space.scale);
        let first = each!(self.level[0].origin, |x| I::F64::splat(x.get(0)));
        let [low, high] = halves!(|h| {
            let [x, y, z] = axes!(|i| (self.level[h].origin[i] - first[i]).abs().le(spread));
            x & y & z & self.t_min[h].lt(self.t_max[h])
        });
        (low & high).all()
    }

    /// Whether they are worth a packet: within a tenth of a turn or so of the first, and starting
    /// within half of the scene, whose root has that space, of where it does. Rays that can hit
    /// nothing at all are not: where any number is not finite or the direction is zero, a
    /// difference is NaN.
    #[inline(always)]
    pub fn are_coherent(&self, space: &NormalSpace) -> bool {
        /// Largest difference of a direction's components, the largest component being one.
        const DIRECTION_SPREAD: f32 = 0.5;
        if !self.start_together(space) {
            return false;
        }
        let [low, high] = &self.level;
        let direction: [I::F32; 3] = axes!(|i| I::narrow(low.direction[i], high.direction[i]));
        let [x, y, z] = each!(direction, |x| x.abs());
        let largest = x.max(y).max(z);
        // Differences of quotients, multiplied by both divisors.
        let first_largest = I::F32::splat(largest.get(0));
        let spread = I::F32::splat(DIRECTION_SPREAD) * largest * first_largest;
        let [x, y, z] = each!(direction, |x| {
            let first = I::F32::splat(x.get(0)) * largest;
            x.mul_add(first_largest, -first).abs().le(spread)
        });
        (x & y & z).all()
    }
}
