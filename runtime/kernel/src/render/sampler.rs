//! Low-discrepancy sample points that depend only on pixel, sample, dimension and seed.
//!
//! Each pair of dimensions is the first two dimensions of Sobol's sequence, a (0, 2)-sequence, in
//! an order and with an Owen scrambling of its own, both by hashing (Burley, "Practical
//! hash-based Owen scrambling", JCGT 9(4) 2020; the hash is of Laine and Karras, EGSR 2011, in a
//! variant by Vegdahl). Any aligned power-of-two run of samples is therefore stratified in every
//! elementary interval, and no state is carried from sample to sample.

use super::rays::make_room;
use crate::lanes::{InstructionSet, Isa, Task, dispatch};

/// What tells the sample points of a pixel from those of others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelKey(u32);

impl PixelKey {
    /// The key of the pixel in column `x` and row `y`; `seed` chooses another set of points.
    pub fn new(x: u32, y: u32, seed: u64) -> PixelKey {
        PixelKey::seed(seed).of_pixel(x, y)
    }

    /// What the keys of all pixels are made from.
    pub fn seed(seed: u64) -> PixelKey {
        PixelKey(hash(seed as u32) ^ hash((seed >> 32) as u32).rotate_left(16))
    }

    /// The key of a pixel, from that of the seed.
    #[inline(always)]
    pub fn of_pixel(self, x: u32, y: u32) -> PixelKey {
        let place = hash(x ^ hash(y ^ GOLDEN));
        PixelKey(hash(place ^ self.0))
    }

    /// Point number `index` of a pair of dimensions, in [0, 1)².
    #[inline(always)]
    pub fn point(self, index: u32, pair: u32) -> [f64; 2] {
        let key = hash(self.0.wrapping_add(pair.wrapping_mul(GOLDEN)));
        // The order: scrambling the index permutes samples within every power-of-two block.
        let index = scramble_reversed(index.reverse_bits(), key).reverse_bits();
        // Sobol's first dimension is the reversed index, its second the reversed product with
        // Pascal's matrix; scrambling wants its argument reversed, which undoes the reversal.
        let x = scramble_reversed(index, key ^ 0x68bc_21eb).reverse_bits();
        let y = scramble_reversed(pascal(index), key ^ 0x02e5_be93).reverse_bits();
        [f64::from(x) * SCALE, f64::from(y) * SCALE]
    }
}

/// Points of a pair of dimensions, by coordinate: the i-th becomes number `indices[i]` of the pixel
/// `keys[i]`.
pub fn points(
    set: InstructionSet,
    keys: &[PixelKey],
    indices: &[u32],
    pair: u32,
    points: &mut [Vec<f64>; 2],
) {
    make_room(points, keys.len());
    dispatch(
        set,
        Draw {
            keys,
            indices,
            pair,
            points,
        },
    );
}

/// [`points`], whose loop the compiler turns into vector instructions of the set.
struct Draw<'a> {
    keys: &'a [PixelKey],
    indices: &'a [u32],
    pair: u32,
    points: &'a mut [Vec<f64>; 2],
}

impl Task for Draw<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let [u, v] = self.points;
        let drawn = self.keys.iter().zip(self.indices);
        for ((u, v), (key, &index)) in u.iter_mut().zip(v).zip(drawn) {
            [*u, *v] = key.point(index, self.pair);
        }
    }
}

/// 2³² over the golden ratio.
const GOLDEN: u32 = 0x9e37_79b9;
const SCALE: f64 = 1.0 / (1u64 << 32) as f64;

/// A bijection of 32 bits in which every bit of the argument changes about half of the result
/// (Wellons, "Prospecting for hash functions", 2018: `lowbias32`).
#[inline(always)]
fn hash(mut x: u32) -> u32 {
    x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
    x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// Owen's scrambling of a number whose bits are given in reverse: every bit is flipped or not by
/// a hash of the bits below it.
#[inline(always)]
fn scramble_reversed(mut x: u32, key: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(key);
    x = x.wrapping_mul((key >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// The product of Pascal's triangle modulo 2 with the bits of `x`: bit `i` of the result is the
/// sum of the bits `j ≥ i` of `x` times binomial(j, i). The matrix is the fifth Kronecker power
/// of [[1, 1], [0, 1]], so it is applied one level of bits at a time.
#[inline(always)]
fn pascal(mut x: u32) -> u32 {
    x ^= (x >> 1) & 0x5555_5555;
    x ^= (x >> 2) & 0x3333_3333;
    x ^= (x >> 4) & 0x0f0f_0f0f;
    x ^= (x >> 8) & 0x00ff_00ff;
    x ^ (x >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Every aligned run of 2^m points has one in each elementary interval of area 2^-m.
        #[test]
        fn runs_are_stratified(
            x in 0u32..10_000, y in 0u32..10_000, seed: u64, pair in 0u32..1000,
            m in 0u32..9, run in 0u32..1000, split in 0u32..9,
        ) {
            let key = PixelKey::new(x, y, seed);
            let (columns, rows) = (1u32 << split.min(m), 1u32 << (m - split.min(m)));
            let mut seen = vec![false; 1 << m];
            for index in (run << m)..((run + 1) << m) {
                let [u, v] = key.point(index, pair);
                let cell = (u * f64::from(columns)) as u32 + columns * (v * f64::from(rows)) as u32;
                prop_assert!(!std::mem::replace(&mut seen[cell as usize], true));
            }
        }
    }

    #[test]
    fn pairs_and_pixels_are_uncorrelated() {
        // The means of products of centred numbers, over many pixels at one sample index.
        let (mut pairs, mut neighbours) = (0.0, 0.0);
        let count = 1 << 14;
        for x in 0..count {
            let here = PixelKey::new(x, 7, 0);
            let right = PixelKey::new(x + 1, 7, 0);
            pairs += (here.point(3, 0)[0] - 0.5) * (here.point(3, 1)[0] - 0.5);
            neighbours += (here.point(3, 0)[1] - 0.5) * (right.point(3, 0)[1] - 0.5);
        }
        // Each term has standard deviation 1/12: allow four standard errors.
        let bound = 4.0 / 12.0 * f64::from(count).sqrt();
        assert!(
            pairs.abs() < bound && neighbours.abs() < bound,
            "{pairs} {neighbours}"
        );
    }

    #[test]
    fn the_pairs_of_one_pixel_are_uncorrelated() {
        let key = PixelKey::new(3, 4, 5);
        let count = 1 << 12;
        let sum: f64 = (0..count)
            .map(|i| (key.point(i, 0)[0] - 0.5) * (key.point(i, 1)[0] - 0.5))
            .sum();
        assert!(sum.abs() < 4.0 / 12.0 * f64::from(count).sqrt(), "{sum}");
    }
}
