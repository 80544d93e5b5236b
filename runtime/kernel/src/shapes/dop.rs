//! Differences of products without cancellation.
//!
//! w = c·d; e = w − c·d (exact, fused); a·b − w (fused) + e. Kahan 2004; the error is at most 1.5
//! ulp and the sign is right: Jeannerod, Louvet, Muller, "Further analysis of Kahan's algorithm for
//! the accurate computation of 2×2 determinants", Math. Comp. 82 (2013).
use crate::lanes::Lanes;

/// a·b − c·d.
#[inline(always)]
pub fn difference_of_products<L: Lanes>(a: L, b: L, c: L, d: L) -> L {
    let w = c * d;
    let e = c.neg_mul_add(d, w);
    a.mul_add(b, -w) + e
}

/// a·b + c·d.
#[inline(always)]
pub fn sum_of_products<L: Lanes>(a: L, b: L, c: L, d: L) -> L {
    difference_of_products(a, b, -c, d)
}

/// a·b, in three dimensions.
#[inline(always)]
pub fn dot<L: Lanes>(a: [L; 3], b: [L; 3]) -> L {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]))
}
