//! What a packet has still to visit.
use crate::bvh::{Child, WIDTH};

/// A child to be visited, and where the first ray enters its box; −∞ if it is to be the first.
#[derive(Clone, Copy)]
pub struct Entry {
    pub near: f32,
    pub child: Child,
    /// Its node and its place there, for the rays to be tested with its box; or [`Entry::UNTESTED`].
    pub place: u32,
    /// The rays that may meet it, as bits.
    pub rays: u32,
}

impl Entry {
    pub const UNTESTED: u32 = u32::MAX;

    /// To be visited before others, by all of these rays that still look for something.
    #[inline(always)]
    pub fn first(child: Child, rays: u32) -> Entry {
        Entry {
            near: f32::NEG_INFINITY,
            child,
            place: Entry::UNTESTED,
            rays,
        }
    }
}

/// Entries, the next one on top.
pub struct Entries {
    /// Those from `len` on are room.
    entries: Vec<Entry>,
    len: usize,
}

impl Entries {
    pub fn new() -> Entries {
        Entries {
            entries: vec![Entry::first(Child::ROOT, 0); 64],
            len: 0,
        }
    }

    #[inline(always)]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Forgets those from number `len` on.
    #[inline(always)]
    pub fn truncate(&mut self, len: usize) {
        self.len = len;
    }

    /// The places after the last one, eight of them.
    #[inline(always)]
    pub fn room(&mut self) -> &mut [Entry; WIDTH] {
        #[cold]
        #[inline(never)]
        fn grow(entries: &mut Vec<Entry>) {
            entries.resize(2 * entries.len(), entries[0]);
        }
        if self.len + WIDTH > self.entries.len() {
            grow(&mut self.entries);
        }
        let room = self.entries[self.len..].first_chunk_mut();
        room.unwrap_or_else(|| unreachable!("there is room"))
    }

    /// Takes in the first places after the last one.
    #[inline(always)]
    pub fn extend(&mut self, count: usize) {
        self.len += count;
    }

    #[inline(always)]
    pub fn push(&mut self, entry: Entry) {
        self.room()[0] = entry;
        self.len += 1;
    }

    /// The top, if there is any above `base`.
    #[inline(always)]
    pub fn pop(&mut self, base: usize) -> Option<Entry> {
        if self.len <= base {
            return None;
        }
        self.len -= 1;
        Some(self.entries[self.len])
    }
}

/// Puts an entry among the first ones, `count` of them, the nearest of which is the last.
#[inline(always)]
pub fn insert(room: &mut [Entry; WIDTH], count: usize, entry: Entry) {
    let mut place = count % WIDTH;
    while place > 0 && entry.near > room[place - 1].near {
        room[place] = room[place - 1];
        place -= 1;
    }
    room[place] = entry;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_is_on_top_however_many_there_are() {
        let mut entries = Entries::new();
        entries.push(Entry::first(Child::ROOT, 0));
        let nears = [3.0, 1.0, 4.0, 1.5, 9.0, 2.5, f32::NEG_INFINITY, 5.0];
        for round in 0..20 {
            let room = entries.room();
            for (count, near) in nears.into_iter().enumerate() {
                let child = Child::item(round);
                insert(
                    room,
                    count,
                    Entry {
                        near,
                        ..Entry::first(child, 1)
                    },
                );
            }
            entries.extend(nears.len());
        }
        assert_eq!(entries.len(), 161);
        for round in (0..20).rev() {
            let popped = nears.map(|_| entries.pop(1).unwrap());
            assert!(popped.iter().all(|entry| entry.child == Child::item(round)));
            assert!(popped.is_sorted_by(|a, b| a.near <= b.near));
        }
        assert!(entries.pop(1).is_none());
        assert_eq!(entries.len(), 1);
    }
}
