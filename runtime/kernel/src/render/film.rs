//! The picture: accumulated pixels and what lies first behind them.
use super::tile::Tile;

/// A finished picture; row 0 is the top, arrays are row by row.
#[derive(Clone, Debug)]
pub struct Film {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// What is seen in each pixel.
    pub pixels: Layers,
    /// Rays traced.
    pub rays: u64,
}

/// The images of a film, or of a part of it.
#[derive(Clone, Debug)]
pub struct Layers {
    /// Linear red, green, blue, premultiplied by the fourth, the coverage: 4 per pixel.
    pub color: Vec<f32>,
    /// Standard error of the mean luminance of the samples; NaN of a single sample.
    pub error: Vec<f32>,
    /// Distance along the viewing axis at the sample nearest the pixel's centre; inf: nothing.
    pub depth: Vec<f32>,
    /// World-space outward geometric normal there; 3 per pixel, 0 where nothing is.
    pub normal: Vec<f32>,
    /// Leaf number there, or -1.
    pub instance: Vec<i64>,
}

impl Layers {
    /// Images of so many pixels that show nothing.
    pub fn new(count: usize) -> Layers {
        Layers {
            color: vec![0.0; 4 * count],
            error: vec![0.0; count],
            depth: vec![f32::INFINITY; count],
            normal: vec![0.0; 3 * count],
            instance: vec![-1; count],
        }
    }
}

impl Film {
    /// A film that shows nothing.
    pub fn new(width: usize, height: usize) -> Film {
        Film {
            width,
            height,
            pixels: Layers::new(width * height),
            rays: 0,
        }
    }

    /// Puts a finished tile, row by row, in its place.
    pub fn insert(&mut self, tile: &Tile, layers: &Layers) {
        let columns = tile.width as usize;
        for row in 0..tile.height as usize {
            let from = row * columns;
            let to = (tile.y as usize + row) * self.width + tile.x as usize;
            let film = &mut self.pixels;
            copy(&mut film.color, &layers.color, 4, to, from, columns);
            copy(&mut film.error, &layers.error, 1, to, from, columns);
            copy(&mut film.depth, &layers.depth, 1, to, from, columns);
            copy(&mut film.normal, &layers.normal, 3, to, from, columns);
            copy(&mut film.instance, &layers.instance, 1, to, from, columns);
        }
    }
}

/// Copies `count` pixels of `size` numbers.
fn copy<T: Copy>(to: &mut [T], from: &[T], size: usize, at: usize, start: usize, count: usize) {
    to[at * size..(at + count) * size].copy_from_slice(&from[start * size..(start + count) * size]);
}
