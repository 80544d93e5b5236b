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

    /// Visits the rows of its blocks, block by block, by column, row and length within the tile.
    /// Pixels are numbered in this order.
    #[inline(always)]
    pub fn for_each_run(&self, mut visit: impl FnMut(u32, u32, u32)) {
        for top in (0..self.height).step_by(BLOCK as usize) {
            for left in (0..self.width).step_by(BLOCK as usize) {
                for y in top..self.height.min(top + BLOCK) {
                    visit(left, y, BLOCK.min(self.width - left));
                }
            }
        }
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
                tile.for_each_run(|left, y, len| {
                    for x in left..left + len {
                        seen[((tile.y + y) * width + tile.x + x) as usize] += 1;
                    }
                });
            }
            assert!(seen.iter().all(|&count| count == 1), "{width} × {height}");
        }
    }
}
