//! What a single ray has still to visit.
use crate::bvh::{Child, WIDTH};
use crate::lanes::take_bit;

/// A node, leaf or item, and where the ray enters its box.
#[derive(Clone, Copy)]
struct Entry {
    near: f32,
    child: Child,
}

/// Nodes, leaves and items, the next one on top.
pub struct Stack {
    /// Those from `len` on are room.
    entries: Vec<Entry>,
    len: usize,
}

impl Stack {
    pub fn new() -> Stack {
        let room = Entry {
            near: 0.0,
            child: Child::ROOT,
        };
        Stack {
            entries: vec![room; 128],
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
        fn grow(entries: &mut Vec<Entry>) {
            entries.resize(2 * entries.len(), entries[0]);
        }
        if self.len + WIDTH > self.entries.len() {
            grow(&mut self.entries);
        }
    }

    /// One that is to be visited in any case.
    #[inline(always)]
    pub fn push(&mut self, child: Child) {
        self.reserve();
        self.entries[self.len] = Entry {
            near: f32::NEG_INFINITY,
            child,
        };
        self.len += 1;
    }

    /// The nearest of up to eight whose bit is set, and onto the stack the others, the nearer ones
    /// on top; with ANY in no order. Those that may have to wait are shown to `seen`.
    ///
    /// One by one, each inserted among the few before it. Compressing them onto the stack
    /// without a branch is slower: what comes next then waits for the mask, where a
    /// predicted branch lets the next node be fetched before that is known. What comes next is
    /// not pushed, since it would have to be read back.
    ///
    /// Unused children, which come last, are passed over: infinite numbers of a ray very far away
    /// make NaN with those of their empty boxes, and NaN yields to what else bounds the interval.
    #[inline(always)]
    pub fn nearest<const ANY: bool>(
        &mut self,
        mut met: u32,
        near: impl Fn(usize) -> f32,
        children: &[Child],
        seen: impl Fn(Child),
    ) -> Option<Child> {
        let lane = take_bit(&mut met)?;
        let mut nearest = Entry {
            near: near(lane),
            child: children[lane],
        };
        if nearest.child.is_unused() {
            return None;
        }
        if met == 0 {
            return Some(nearest.child);
        }
        seen(nearest.child);
        self.reserve();
        let base = self.len;
        while let Some(lane) = take_bit(&mut met) {
            let mut other = Entry {
                near: near(lane),
                child: children[lane],
            };
            if other.child.is_unused() {
                break;
            }
            seen(other.child);
            if !ANY && other.near < nearest.near {
                std::mem::swap(&mut other, &mut nearest);
            }
            let mut place = self.len;
            while !ANY && place > base && other.near > self.entries[place - 1].near {
                self.entries[place] = self.entries[place - 1];
                place -= 1;
            }
            self.entries[place] = other;
            self.len += 1;
        }
        Some(nearest.child)
    }

    /// The top, if there is any above `base`.
    #[inline(always)]
    pub fn pop(&mut self, base: usize) -> Option<(f32, Child)> {
        if self.len <= base {
            return None;
        }
        self.len -= 1;
        let Entry { near, child } = self.entries[self.len];
        Some((near, child))
    }
}
