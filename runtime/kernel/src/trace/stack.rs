//! What a single ray has still to visit.
use crate::bvh::{Child, WIDTH};
use crate::lanes::{Lanes, Mask};

/// Nodes, leaves and items, and where the ray enters their boxes.
pub struct Stack {
    nears: Vec<f32>,
    /// Bits of [`Child`].
    children: Vec<f32>,
    len: usize,
}

impl Stack {
    pub fn new() -> Stack {
        Stack {
            nears: vec![0.0; 128],
            children: vec![0.0; 128],
            len: 0,
        }
    }

    #[inline(always)]
    pub fn len(&self) -> usize {
        self.len
    }

    #[inline(always)]
    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// Room for eight more.
    #[inline(always)]
    fn reserve(&mut self) {
        #[cold]
        #[inline(never)]
        fn grow(numbers: &mut Vec<f32>) {
            numbers.resize(2 * numbers.len(), 0.0);
        }
        if self.len + WIDTH > self.nears.len() {
            grow(&mut self.nears);
            grow(&mut self.children);
        }
    }

    /// One that is to be visited in any case.
    #[inline(always)]
    pub fn push(&mut self, child: Child) {
        self.reserve();
        self.nears[self.len] = f32::NEG_INFINITY;
        self.children[self.len] = child.to_lane();
        self.len += 1;
    }

    /// Those of up to eight that are met, the nearest on top unless any hit will do.
    ///
    /// Mostly there is none or one: that is done without a branch, which could not be predicted.
    #[inline(always)]
    pub fn push_met<L: Lanes<Scalar = f32>, const ANY: bool>(
        &mut self,
        near: L,
        children: &[Child],
        met: L::Mask,
    ) {
        self.reserve();
        let (nears, places) = (
            &mut self.nears[self.len..][..WIDTH],
            &mut self.children[self.len..][..WIDTH],
        );
        near.compress(met, nears);
        L::load(Child::as_lanes(children)).compress(met, places);
        let count = met.bits().count_ones() as usize;
        self.len += count;
        if !ANY && count > 1 {
            // By insertion, for there seldom are more than three.
            for i in 1..count.min(WIDTH) {
                let (x, child) = (nears[i], places[i]);
                let mut j = i;
                while j > 0 && x > nears[j - 1] {
                    nears[j] = nears[j - 1];
                    places[j] = places[j - 1];
                    j -= 1;
                }
                nears[j] = x;
                places[j] = child;
            }
        }
    }

    /// The top, if there is any above `base`.
    #[inline(always)]
    pub fn pop(&mut self, base: usize) -> Option<(f32, Child)> {
        if self.len <= base {
            return None;
        }
        self.len -= 1;
        Some((
            self.nears[self.len],
            Child::from_lane(self.children[self.len]),
        ))
    }
}
