//! Rays against the boxes of a tree.
//!
//! In the normalised space of a tree the content lies in [−1, 1]³ and a ray is o + τ·d with
//! ½ ≤ max|d| < 2 (less only if a transform squeezed it; then τ grows in proportion).
//! The slab test for a plane at b is τ = (b − o)/d, computed as fma(b, i, −o·i) with i = 1/d.
//!
//! # Error bound
//!
//! u = 2⁻²⁴; |b| ≤ 1 + u, and |o| ≤ 4, since the origin was slid along the ray if it was farther.
//! A ray that meets the content meets it at |τ·d| ≤ |b| + |o| ≤ 5 on each axis. In units of
//! distance along one axis (that is, τ-errors times |d|), the errors are: o rounded, 4u; d
//! rounded, 5u; i rounded, 5u; o·i rounded, 4u; the fma rounded, 5u; and as much as 5u for the
//! other side of the comparison, or for τ of the nearest hit rounded to f32. The sum is 28u < 2⁻¹⁹.
//! Each slab is therefore widened by m = 2⁻¹⁹: the near plane by τ −= m·|i|, the far plane by
//! τ += m·|i|, folded into the constant of the fma, which costs nothing per box (in the manner of
//! Ize, "Robust BVH ray traversal", JCGT 2(2), 2013, but absolute, because the space is
//! normalised).
//!
//! Components of d below 2⁻⁹⁶ are raised to it: τ ≤ 5/max|d|, so that moves the ray by less than
//! the bound unless max|d| < 2⁻⁷⁴, and no inverse is infinite, so no product is NaN for
//! finite rays. Rays that are not finite give NaN, which no comparison lets in.
use crate::lanes::{Lanes, axes};

/// A ray, or a ray in every lane, made ready for boxes.
#[derive(Clone, Copy)]
pub struct NodeRay<L: Lanes> {
    inverse: [L; 3],
    near: [L; 3],
    far: [L; 3],
}

const MARGIN: f32 = 1.0 / (1u32 << 19) as f32;
/// 2⁻⁹⁶.
const LEAST_DIRECTION: f32 = 1.262_177_4e-29;

impl NodeRay<f32> {
    /// The same ray in every lane.
    #[inline(always)]
    pub fn in_lanes<L: Lanes<Scalar = f32>>(&self) -> NodeRay<L> {
        NodeRay {
            inverse: L::splats(self.inverse),
            near: L::splats(self.near),
            far: L::splats(self.far),
        }
    }
}

impl<L: Lanes<Scalar = f32>> NodeRay<L> {
    /// The ray in lane `i`.
    #[inline(always)]
    pub fn get(&self, i: usize) -> NodeRay<f32> {
        NodeRay {
            inverse: axes!(|axis| self.inverse[axis].get(i)),
            near: axes!(|axis| self.near[axis].get(i)),
            far: axes!(|axis| self.far[axis].get(i)),
        }
    }

    /// From the origin and the direction in the tree's space.
    #[inline(always)]
    pub fn new(o: [L; 3], d: [L; 3]) -> NodeRay<L> {
        let one = L::splat(1.0);
        let margin = L::splat(MARGIN);
        let least = L::splat(LEAST_DIRECTION);
        let inverse: [L; 3] = axes!(|i| one / least.max(d[i].abs()).copy_sign(d[i]));
        let widening: [L; 3] = axes!(|i| margin * inverse[i].abs());
        NodeRay {
            inverse,
            near: axes!(|i| -(o[i].mul_add(inverse[i], widening[i]))),
            far: axes!(|i| o[i].neg_mul_add(inverse[i], widening[i])),
        }
    }

    /// Where the ray enters and leaves the box whose six planes are given with those first met
    /// first: x, y, z where it enters, x, y, z where it leaves. Empty if entry > exit.
    #[inline(always)]
    pub fn interval(&self, entry: [L; 3], exit: [L; 3], after: L, before: L) -> (L, L) {
        let enter: [L; 3] = axes!(|i| entry[i].mul_add(self.inverse[i], self.near[i]));
        let leave: [L; 3] = axes!(|i| exit[i].mul_add(self.inverse[i], self.far[i]));
        (
            enter[0].max(enter[1]).max(enter[2].max(after)),
            leave[0].min(leave[1]).min(leave[2].min(before)),
        )
    }

    /// One over the components of the direction.
    #[inline(always)]
    pub fn inverse(&self) -> [L; 3] {
        self.inverse
    }

    /// The lanes whose direction decreases along each axis: they enter through upper planes.
    #[inline(always)]
    pub fn descending(&self) -> [L::Mask; 3] {
        axes!(|i| self.inverse[i].lt(L::zero()))
    }
}
