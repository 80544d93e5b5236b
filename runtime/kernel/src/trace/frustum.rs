//! A packet as one: intervals of its rays against eight boxes at a time.
//!
//! Ray r enters a slab through the plane at b at τ = (b − o_r)·i_r with i = 1/d. If all i_r have
//! one sign, (b − o)·i over all rays is least at the end of the origins that is nearest to b in
//! the sense of i, and there at one of the ends of i: that is the product of interval arithmetic
//! (Boulos, Wald, Shirley, "Geometric and arithmetic culling methods for entire ray packets",
//! 2006). Axes along which the signs differ bound nothing.
//!
//! Nothing is culled here that a ray's own test lets in for a hit: as there, (b − o)·i is computed
//! as fma(b, i, −o·i). To the errors listed in `bvh::ray`, whose sum is 28u, comes the shift of o by
//! the margin, rounded (4u), and the margin is 64u = 2⁻¹⁸.
use super::precision::PacketMask;
use crate::bvh::{Node, Row};
use crate::lanes::{Isa, Lanes, Mask, axes};

const MARGIN: f32 = 1.0 / (1u32 << 18) as f32;

/// Bounds of the rays of a packet in a tree's space.
#[derive(Clone)]
pub struct Frustum {
    pub axes: [Axis; 3],
    /// Whether every axis bounds something.
    pub agree: bool,
    /// Where the first ray begins to look for hits, and where the last one ends.
    pub earliest: f32,
    pub latest: f32,
}

/// Bounds along one axis.
#[derive(Clone, Copy)]
pub struct Axis {
    /// The planes through which the rays enter, and those through which they leave; any if they do
    /// not agree.
    pub rows: [Row; 2],
    /// The least and the greatest i; 0 if the axis bounds nothing.
    inverse: [f32; 2],
    /// Minus the products of these with the end of the origins next to entries, and next to
    /// exits, moved by the margin; infinite if the axis bounds nothing.
    entry: [f32; 2],
    exit: [f32; 2],
}

impl Axis {
    #[inline(always)]
    fn new(rows: [Row; 2], [least, greatest]: [f32; 2], [enter, leave]: [f32; 2]) -> Axis {
        Axis {
            rows,
            inverse: [least, greatest],
            entry: [-(enter * least), -(enter * greatest)],
            exit: [-(leave * least), -(leave * greatest)],
        }
    }

    #[inline(always)]
    fn bounds(&self) -> bool {
        self.inverse[0] != 0.0
    }

    /// The products of b − o and i for planes b of a row, by both ends of i.
    #[inline(always)]
    fn products<L: Lanes<Scalar = f32>>(&self, b: L, [least, greatest]: [f32; 2]) -> (L, L) {
        (
            b.mul_add(L::splat(self.inverse[0]), L::splat(least)),
            b.mul_add(L::splat(self.inverse[1]), L::splat(greatest)),
        )
    }
}

/// The greatest of the lanes that the mask has.
#[inline(always)]
pub fn greatest<P: Lanes<Scalar = f32>>(lanes: P, mask: P::Mask) -> f32 {
    -least(-lanes, mask)
}

/// The least of the lanes that the mask has.
#[inline(always)]
pub fn least<P: Lanes<Scalar = f32>>(lanes: P, mask: P::Mask) -> f32 {
    P::select(mask, lanes, P::splat(f32::INFINITY)).horizontal_min()
}

impl Frustum {
    /// Around the rays in `active` from `origin` along 1/`inverse`, which look for hits in an
    /// interval.
    #[inline(always)]
    pub fn new<I: Isa>(
        origin: [I::F32; 3],
        inverse: [I::F32; 3],
        [after, before]: [I::F32; 2],
        active: PacketMask<I>,
    ) -> Frustum {
        let [[x, y, z], [u, v, w]] = [origin, inverse];
        let mut columns = [x, y, z, after, u, v, w, before];
        // NaN would spread; a ray that has any meets nothing.
        let sum = x + y + z + u + v + w;
        let usable = active & sum.eq(sum) & after.eq(after) & before.eq(before);
        if !usable.all() {
            // Others do as one of these does.
            let one = usable.bits().trailing_zeros() as usize % I::F32::WIDTH;
            for column in &mut columns {
                *column = I::F32::select(usable, *column, I::F32::splat(column.get(one)));
            }
        }
        let ranges = I::ranges(columns);
        let [x, y, z] = axes!(|i| {
            let [first, last] = [ranges[i][0] - MARGIN, ranges[i][1] + MARGIN];
            let [least, greatest] = ranges[i + 4];
            let (lower, upper) = (Row::of(i, false), Row::of(i, true));
            if least > 0.0 {
                Axis::new([lower, upper], [least, greatest], [last, first])
            } else if greatest < 0.0 {
                Axis::new([upper, lower], [least, greatest], [first, last])
            } else {
                Axis {
                    rows: [lower, upper],
                    inverse: [0.0; 2],
                    entry: [f32::NEG_INFINITY; 2],
                    exit: [f32::INFINITY; 2],
                }
            }
        });
        Frustum {
            agree: x.bounds() && y.bounds() && z.bounds(),
            axes: [x, y, z],
            earliest: ranges[3][0],
            latest: if usable.any() {
                ranges[7][1]
            } else {
                f32::NEG_INFINITY
            },
        }
    }

    /// Which of the children from number `first` on any ray may meet, and where none enters
    /// earlier.
    #[inline(always)]
    pub fn meets<L: Lanes<Scalar = f32>>(&self, node: &Node, first: usize) -> (u32, L) {
        let enter: [L; 3] = axes!(|i| {
            let axis = &self.axes[i];
            let (a, b) = axis.products::<L>(node.planes_from(axis.rows[0], first), axis.entry);
            a.min(b)
        });
        let leave: [L; 3] = axes!(|i| {
            let axis = &self.axes[i];
            let (a, b) = axis.products::<L>(node.planes_from(axis.rows[1], first), axis.exit);
            a.max(b)
        });
        // NaN, of an empty box along an axis that bounds nothing, yields to the other operand: where
        // no axis bounds anything, only its being empty tells.
        let holds = L::load(&node.planes[0][first..]).le(L::load(&node.planes[3][first..]));
        let near = enter[0].max(enter[1].max(enter[2].max(L::splat(self.earliest))));
        let far = leave[0].min(leave[1].min(leave[2].min(L::splat(self.latest))));
        ((near.le(far) & holds).bits(), near)
    }
}
