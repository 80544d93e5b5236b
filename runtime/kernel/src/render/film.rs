//! The picture: accumulated pixels and what lies first behind them.
use super::tile::{SIZE, Tile};
use std::sync::Mutex;

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
#[derive(Clone, Debug, Default)]
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
    /// Images of so many pixels, all zero: of what has not been rendered yet.
    pub fn new(count: usize) -> Layers {
        // The system gives zeros away: who renders a pixel is the first to touch it.
        Layers {
            color: vec![0.0; 4 * count],
            error: vec![0.0; count],
            depth: vec![0.0; count],
            normal: vec![0.0; 3 * count],
            instance: vec![0; count],
        }
    }
}

/// The rows of a film that a row of tiles covers.
pub struct Band<'a> {
    width: usize,
    color: &'a mut [f32],
    error: &'a mut [f32],
    depth: &'a mut [f32],
    normal: &'a mut [f32],
    instance: &'a mut [i64],
}

impl Film {
    /// A film that nothing has been put into.
    pub fn new(width: usize, height: usize) -> Film {
        Film {
            width,
            height,
            pixels: Layers::new(width * height),
            rays: 0,
        }
    }

    /// The film in rows of tiles, from the top, for threads to put their tiles into.
    pub fn bands(&mut self) -> Vec<Mutex<Band<'_>>> {
        let (width, count) = (self.width, self.width * SIZE as usize);
        let Layers {
            color,
            error,
            depth,
            normal,
            instance,
        } = &mut self.pixels;
        color
            .chunks_mut(4 * count)
            .zip(error.chunks_mut(count))
            .zip(depth.chunks_mut(count))
            .zip(normal.chunks_mut(3 * count))
            .zip(instance.chunks_mut(count))
            .map(|((((color, error), depth), normal), instance)| {
                Mutex::new(Band {
                    width,
                    color,
                    error,
                    depth,
                    normal,
                    instance,
                })
            })
            .collect()
    }
}

impl Band<'_> {
    /// Puts a finished tile of this band, row by row, in its place.
    pub fn insert(&mut self, tile: &Tile, layers: &Layers) {
        let columns = tile.width as usize;
        for row in 0..tile.height as usize {
            let from = row * columns;
            let to = row * self.width + tile.x as usize;
            copy(self.color, &layers.color, 4, to, from, columns);
            copy(self.error, &layers.error, 1, to, from, columns);
            copy(self.depth, &layers.depth, 1, to, from, columns);
            copy(self.normal, &layers.normal, 3, to, from, columns);
            copy(self.instance, &layers.instance, 1, to, from, columns);
        }
    }
}

/// Copies `count` pixels of `size` numbers.
fn copy<T: Copy>(to: &mut [T], from: &[T], size: usize, at: usize, start: usize, count: usize) {
    to[at * size..(at + count) * size].copy_from_slice(&from[start * size..(start + count) * size]);
}
