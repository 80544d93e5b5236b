//! A packet as one: intervals of its rays against eight boxes at a time.
//!
//! Ray r enters a slab through the plane at b at τ = (b − o_r)·i_r with i = 1/d. If all i_r have
//! one sign, (b − o)·i over all rays is least at the end of the origins that is nearest to b in
//! the sense of i, and there at one of the ends of i: that is the product of interval arithmetic
//! (Boulos, Wald, Shirley, "Geometric and arithmetic culling methods for entire ray packets",
//! 2006). Axes along which the signs differ bound nothing.
//!
//! Nothing is culled here that a ray's own test lets in for a hit: by the errors listed in
//! `bvh::ray`, with b − o rounded (5u) instead of the fma's constant and the shift of o by the
//! margin rounded (4u), the sum is 33u, and the margin is 64u = 2⁻¹⁸.
use super::precision::PacketMask;
use crate::bvh::Node;
use crate::lanes::{Isa, Lanes, Mask, axes};

const MARGIN: f32 = 1.0 / (1u32 << 18) as f32;

/// Bounds of the rays of a packet in a tree's space, a copy in every lane.
#[derive(Clone)]
pub struct Frustum<L> {
    /// Rows of the planes through which the rays enter; any if they do not agree.
    enters: [usize; 3],
    /// The end of the origins next to entries, and next to exits, moved by the margin.
    entry_origin: [L; 3],
    exit_origin: [L; 3],
    least: [L; 3],
    greatest: [L; 3],
    /// 0, or infinity along axes that bound nothing.
    slack: [L; 3],
    /// Whether every axis bounds something.
    agree: bool,
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

impl<L: Lanes<Scalar = f32>> Frustum<L> {
    /// Around the rays in `active` from `origin` along 1/`inverse`.
    #[inline(always)]
    pub fn new<I: Isa>(
        origin: [I::F32; 3],
        inverse: [I::F32; 3],
        active: PacketMask<I>,
    ) -> Frustum<L> {
        let infinity = I::F32::splat(f32::INFINITY);
        let mut ends = [infinity; 12];
        for i in 0..3 {
            ends[i] = I::F32::select(active, origin[i], infinity);
            ends[i + 3] = I::F32::select(active, -origin[i], infinity);
            ends[i + 6] = I::F32::select(active, inverse[i], infinity);
            ends[i + 9] = I::F32::select(active, -inverse[i], infinity);
        }
        let ends = I::horizontal_minima(ends);
        let [x, y, z] = axes!(|i| {
            let [o_least, o_greatest] = [ends[i], -ends[i + 3]];
            let [least, greatest] = [ends[i + 6], -ends[i + 9]];
            let [first, last] = [o_least - MARGIN, o_greatest + MARGIN];
            if least > 0.0 {
                (i, last, first, least, greatest, 0.0)
            } else if greatest < 0.0 {
                (i + 3, first, last, least, greatest, 0.0)
            } else {
                (i, last, first, 0.0, 0.0, f32::INFINITY)
            }
        });
        let all = [x, y, z];
        Frustum {
            enters: axes!(|i| all[i].0),
            entry_origin: axes!(|i| L::splat(all[i].1)),
            exit_origin: axes!(|i| L::splat(all[i].2)),
            least: axes!(|i| L::splat(all[i].3)),
            greatest: axes!(|i| L::splat(all[i].4)),
            slack: axes!(|i| L::splat(all[i].5)),
            agree: x.5 + y.5 + z.5 == 0.0,
        }
    }

    /// Rows of the planes through which all rays enter; None if they do not agree.
    #[inline(always)]
    pub fn agreed(&self) -> Option<[usize; 3]> {
        self.agree.then_some(self.enters)
    }

    /// Which of the children from number `first` on any ray may meet in [after, before], and
    /// where none enters earlier.
    #[inline(always)]
    pub fn meets(&self, node: &Node, first: usize, after: f32, before: f32) -> (u32, L) {
        let enter: [L; 3] = axes!(|i| {
            let from = L::load(&node.planes[self.enters[i]][first..]) - self.entry_origin[i];
            (from * self.least[i]).min(from * self.greatest[i]) - self.slack[i]
        });
        let leave: [L; 3] = axes!(|i| {
            let from = L::load(&node.planes[2 * i + 3 - self.enters[i]][first..]);
            let from = from - self.exit_origin[i];
            (from * self.least[i]).max(from * self.greatest[i]) + self.slack[i]
        });
        // NaN, of an empty box along an axis that bounds nothing, yields to the other operand: where
        // no axis bounds anything, only its being empty tells.
        let holds = L::load(&node.planes[0][first..]).le(L::load(&node.planes[3][first..]));
        let near = enter[0].max(enter[1].max(enter[2].max(L::splat(after))));
        let far = leave[0].min(leave[1].min(leave[2].min(L::splat(before))));
        ((near.le(far) & holds).bits(), near)
    }
}
