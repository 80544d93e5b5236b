//! Instances that share a leaf: which of them a ray may hit, eight at a time, in f32.
//!
//! A way into an instance is exact and therefore dear. So each leaf carries, in the normalised
//! space of its tree, a map W' and a centre c for each instance, such that p ↦ W'·(p − c) brings
//! the object's bounds into the cube [−1, 1]³ or, for all instances of a block, into the unit
//! ball. A ray that passes by in that space is not let in. This decides nothing that is close:
//!
//! # Error bound
//!
//! u = 2⁻²⁴, w a row of W' before rounding, |·| Euclidean lengths. As in `bvh::ray`, |o| ≤ 3.5
//! and the content lies within |p| ≤ √3, so |o − c| and |t·d| are at most 5.2 where it is met.
//! q = W'(o − c): rounding o, the difference, w and the sum errs by (3.5 + 5.2 + 5.2 + 16)u·|w|.
//! e = W'd: rounding d, w and the sum errs by 5u·|w||d|, which t makes 26u·|w|.
//!
//! Cube: forming the quotients and what they are compared with err by 30u·|w|, in all 86u·|w|.
//! The half extents grow by 2⁻¹⁷·|w| = 128u·|w|.
//!
//! Ball: the ray passes by 56u·|W'| too near or too far, and its closest approach is misplaced
//! along it by 8u·|q| ≤ 42u·|W'| besides, and by 9u·|W'| for the turn of e; that is a = 56 u·|W'|
//! across and b = 107u·|W'| along. With the radius smaller by f in the unit ball, l' for l and
//! 1 ≥ (1 − f)² the entry is no later than the true one if √(1 − l'²) ≥ √((1 − f)² − l²) + b,
//! for which f ≥ √(a² + b²) = 121u·|W'| suffices up to squares of these. The radius grows by
//! 2⁻¹⁶·|W'| = 256u·|W'|.
//!
//! Before that, packets ask of whole lines: cube, |q_j e_k − q_k e_j| ≤ |e_j| + |e_k|; ball, |q × e|²
//! ≤ |e|². A component of q × e errs by 2u(|q_j e_k| + |q_k e_j|). For the cube that is 2u·|q| ≤
//! 11u·|w| of its half extents, and 2u more for the sums: less than the quotients' 30u·|w|. For the
//! ball it is 7u·|q| ≤ 37u·|W'| of the distance, and 4u for the squares: with the 56u·|W'|, less
//! than its 256u·|W'|.
//!
//! The centre is rounded first, and what that moves it, in object space, is added too.
//!
//! Because all this is relative to the tree, W' has entries below 2¹⁵ for any transform, flat
//! objects included; and because the object lies within the tree, rows are longer than ½.
use super::arrays::Affine;
use crate::bvh::{Bounds, Child, LARGEST_LEAF, NormalSpace};
use crate::instance::dot;
use crate::lanes::{Lanes, Mask, axes};

/// Up to eight instances of a group, by lane.
#[derive(Clone)]
#[repr(C, align(64))]
pub struct InstanceBlock {
    /// `rows[row][column][lane]` of W'; all zero where any ray may hit.
    rows: [[[f32; LARGEST_LEAF]; 3]; 3],
    center: [[f32; LARGEST_LEAF]; 3],
    /// Which instance of the group each lane holds, as an item.
    pub instances: [Child; LARGEST_LEAF],
    /// Lanes in use.
    pub len: u32,
    /// All of them are in unit balls.
    balls: bool,
}

/// Surely around an object, in its space.
#[derive(Clone, Copy)]
pub(super) struct Outline {
    center: [f64; 3],
    half: [f64; 3],
    ball: bool,
}

impl Outline {
    /// A ball.
    pub fn ball(center: [f64; 3], radius: f64) -> Outline {
        Outline {
            center,
            half: [radius; 3],
            ball: true,
        }
    }

    /// Whether it is a box, and still one along the axes if it is moved so: its bounds tell all that
    /// it does.
    pub fn is_upright(&self, world_from_object: &Affine) -> bool {
        let is_one = |[x, y, z, _]: &[f64; 4]| {
            usize::from(*x != 0.0) + usize::from(*y != 0.0) + usize::from(*z != 0.0) <= 1
        };
        !self.ball && world_from_object.iter().all(is_one)
    }

    /// A box.
    pub fn cuboid(bounds: &Bounds) -> Outline {
        Outline {
            center: bounds.center(),
            half: bounds.half_extent(),
            ball: false,
        }
    }
}

/// An instance as the tree sees it.
struct Lane {
    rows: [[f32; 3]; 3],
    center: [f32; 3],
    ball: bool,
}

impl Lane {
    /// Met by every ray that meets the tree.
    const EVERYWHERE: Lane = Lane {
        rows: [[0.0; 3]; 3],
        center: [0.0; 3],
        ball: false,
    };

    fn new(
        outline: &Outline,
        world_from_object: &Affine,
        object_from_world: &Affine,
        space: &NormalSpace,
    ) -> Lane {
        /// Balls of longer maps go as cubes, whose rows do not disturb each other.
        const LONGEST: f64 = (1u64 << 13) as f64;
        const MARGIN: f64 = 1.0 / (1u64 << 17) as f64;
        let [x, y, z] = outline.center;
        let middle = [0, 1, 2].map(|i| {
            let [a, b, c, t] = world_from_object[i];
            a * x + b * y + c * z + (t - space.center[i])
        });
        let center = middle.map(|x| (x * space.scale) as f32);
        let from_translation: [f64; 3] = std::array::from_fn(|i| {
            f64::from(center[i]) / space.scale + (space.center[i] - world_from_object[i][3])
        });
        let linear = object_from_world.map(|[x, y, z, _]| [x, y, z]);
        let length = |row: [f64; 3]| row.iter().map(|x| x * x).sum::<f64>().sqrt();
        let lengths = linear.map(|row| length(row) / space.scale);
        let all = length(lengths);
        let moved: [f64; 3] = std::array::from_fn(|j| {
            let terms: [f64; 3] = std::array::from_fn(|i| linear[j][i] * from_translation[i]);
            let rounding = 8.0 * f64::EPSILON * terms.iter().map(|x| x.abs()).sum::<f64>();
            (terms.iter().sum::<f64>() - outline.center[j]).abs() + rounding
        });
        let ball = outline.ball && all < LONGEST * outline.half[0];
        let grown: [f64; 3] = std::array::from_fn(|j| {
            if ball {
                outline.half[0] + 2.0 * (moved[0] + moved[1] + moved[2]) + 2.0 * MARGIN * all
            } else {
                outline.half[j] + moved[j] + MARGIN * lengths[j]
            }
        });
        let rows: [[f32; 3]; 3] =
            std::array::from_fn(|j| linear[j].map(|x| (x / space.scale / grown[j]) as f32));
        let lane = Lane { rows, center, ball };
        if rows.as_flattened().iter().all(|x| x.is_finite()) && center.iter().all(|x| x.is_finite())
        {
            lane
        } else {
            Lane::EVERYWHERE
        }
    }
}

/// Rays in the spaces that the maps p ↦ rows·(p − center) bring them to.
#[inline(always)]
fn inside<L: Lanes<Scalar = f32>>(
    rows: [[L; 3]; 3],
    center: [L; 3],
    o: [L; 3],
    d: [L; 3],
) -> ([L; 3], [L; 3]) {
    let p = axes!(|i| o[i] - center[i]);
    (axes!(|j| dot(rows[j], p)), axes!(|j| dot(rows[j], d)))
}

impl InstanceBlock {
    /// Of instances whose outlines, if they have any, are given with their transforms.
    pub(super) fn new<'a>(
        instances: &[u32],
        space: &NormalSpace,
        of: impl Fn(u32) -> (Option<Outline>, &'a Affine, &'a Affine),
    ) -> InstanceBlock {
        let mut block = InstanceBlock {
            rows: [[[0.0; LARGEST_LEAF]; 3]; 3],
            center: [[0.0; LARGEST_LEAF]; 3],
            instances: [Child::item(0); LARGEST_LEAF],
            len: instances.len() as u32,
            balls: true,
        };
        for (i, &instance) in instances.iter().enumerate() {
            let lane = match of(instance) {
                (Some(outline), forward, back) => Lane::new(&outline, forward, back, space),
                (None, ..) => Lane::EVERYWHERE,
            };
            for row in 0..3 {
                for column in 0..3 {
                    block.rows[row][column][i] = lane.rows[row][column];
                }
                block.center[row][i] = lane.center[row];
            }
            block.instances[i] = Child::item(instance);
            block.balls &= lane.ball;
        }
        block
    }

    /// One ray against the instances from `first` on: those it may hit, and where at the
    /// earliest. The ray is in the tree's space.
    #[inline(always)]
    pub fn meets<L: Lanes<Scalar = f32>>(
        &self,
        first: usize,
        (o, d): ([f32; 3], [f32; 3]),
        after: f32,
        before: f32,
    ) -> (L::Mask, L) {
        let rows = axes!(|j| axes!(|i| L::load(&self.rows[j][i][first..])));
        let center = axes!(|i| L::load(&self.center[i][first..]));
        let (q, e) = inside(rows, center, L::splats(o), L::splats(d));
        let (near, far) = self.interval(q, e);
        let met = near.le(far) & near.le(L::splat(before)) & L::splat(after).le(far);
        (
            met & L::Mask::first((self.len as usize).saturating_sub(first)),
            near,
        )
    }

    /// Rays, one in every lane, against instance `i` of the block: where they enter and leave; None
    /// if the lines of all in `active` pass by. Most do, and that needs no division.
    #[inline(always)]
    pub fn interval_of<L: Lanes<Scalar = f32>>(
        &self,
        i: usize,
        o: [L; 3],
        d: [L; 3],
        active: L::Mask,
    ) -> Option<(L, L)> {
        let rows = axes!(|j| axes!(|k| L::splat(self.rows[j][k][i])));
        let center = axes!(|k| L::splat(self.center[k][i]));
        let (q, e) = inside(rows, center, o, d);
        // q × e: how far the line is from the middle, times |e|, and a part of that in each plane.
        let across = axes!(|j| {
            let (k, l) = ((j + 1) % 3, (j + 2) % 3);
            q[k].mul_add(e[l], -(q[l] * e[k]))
        });
        let near = if self.balls {
            dot(across, across).le(dot(e, e))
        } else {
            let [x, y, z] = axes!(|j| e[j].abs());
            across[0].abs().le(y + z) & across[1].abs().le(z + x) & across[2].abs().le(x + y)
        };
        if !(near & active).any() {
            return None;
        }
        Some(self.interval(q, e))
    }

    /// Where rays, in the spaces of outlines, enter and leave these; they do not unless
    /// near ≤ far.
    #[inline(always)]
    fn interval<L: Lanes<Scalar = f32>>(&self, q: [L; 3], e: [L; 3]) -> (L, L) {
        let one = L::splat(1.0);
        if self.balls {
            let inverse = one / dot(e, e);
            let closest = -(dot(q, e) * inverse);
            let l = axes!(|j| closest.mul_add(e[j], q[j]));
            // NaN for a ray that passes by.
            let half = ((one - dot(l, l)) * inverse).sqrt();
            return (closest - half, closest + half);
        }
        // 2⁻⁹⁶, as in `bvh::ray`.
        let least = L::splat(1.262_177_4e-29);
        let inverse = axes!(|j| one / least.max(e[j].abs()).copy_sign(e[j]));
        let middle = axes!(|j| -(q[j] * inverse[j]));
        let half = axes!(|j| inverse[j].abs());
        let near = axes!(|j| middle[j] - half[j]);
        let far = axes!(|j| middle[j] + half[j]);
        (
            near[0].max(near[1]).max(near[2]),
            far[0].min(far[1]).min(far[2]),
        )
    }
}
