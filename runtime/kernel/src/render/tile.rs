//! The parts of a picture that threads render, and the order of their pixels.

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tile {
    /// First column.
    pub x: u32,
    /// First row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

/// Columns and rows of a tile: its rays and hits stay in a core's cache.
pub const SIZE: u32 = 16;

/// Columns and rows of the blocks whose rays follow each other: as many as the widest packet.
pub const BLOCK: u32 = 4;

impl Tile {
    /// How many tiles a picture has.
    pub fn count(width: u32, height: u32) -> usize {
        width.div_ceil(SIZE) as usize * height.div_ceil(SIZE) as usize
    }

    /// Tile number `index` of a picture, row by row from the top.
    pub fn new(index: usize, width: u32, height: u32) -> Tile {
        let columns = width.div_ceil(SIZE) as usize;
        let (x, y) = (
            (index % columns) as u32 * SIZE,
            (index / columns) as u32 * SIZE,
        );
        Tile {
            x,
            y,
            width: SIZE.min(width - x),
            height: SIZE.min(height - y),
        }
    }

    /// The number of its row of tiles, from the top.
    pub fn band(&self) -> usize {
        (self.y / SIZE) as usize
    }

    /// The rows of its blocks, block by block. Pixels are numbered in this order.
    #[inline(always)]
    pub fn runs(&self) -> Runs {
        Runs {
            width: self.width,
            height: self.height,
            next: Run::default(),
        }
    }
}

/// Neighbours in a row of a block.
#[derive(Clone, Copy, Debug, Default)]
pub struct Run {
    /// The first one's column within the tile.
    pub x: u32,
    /// Their row within the tile.
    pub y: u32,
    /// How many they are: [`BLOCK`], or fewer at the right edge.
    pub len: u32,
}

/// See [`Tile::runs`].
pub struct Runs {
    width: u32,
    height: u32,
    /// Without its length.
    next: Run,
}

impl Iterator for Runs {
    type Item = Run;

    #[inline(always)]
    fn next(&mut self) -> Option<Run> {
        let Run { x, y, .. } = self.next;
        if y >= self.height {
            return None;
        }
        let next = &mut self.next;
        next.y += 1;
        if next.y.is_multiple_of(BLOCK) || next.y == self.height {
            next.x += BLOCK;
            if next.x < self.width {
                next.y = y / BLOCK * BLOCK;
            } else {
                next.x = 0;
            }
        }
        let len = BLOCK.min(self.width - x);
        Some(Run { x, y, len })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_cover_every_pixel_once() {
        for (width, height) in [(1, 1), (16, 16), (33, 17), (7, 50)] {
            let mut seen = vec![0; (width * height) as usize];
            for index in 0..Tile::count(width, height) {
                let tile = Tile::new(index, width, height);
                for run in tile.runs() {
                    for x in run.x..run.x + run.len {
                        seen[((tile.y + run.y) * width + tile.x + x) as usize] += 1;
                    }
                }
            }
            assert!(seen.iter().all(|&count| count == 1), "{width} × {height}");
        }
    }
}
