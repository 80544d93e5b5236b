//! The picture: accumulated pixels and what lies first behind them.
use super::tile::{BLOCK, SIZE, Tile};
use crate::huge_pages;
use crate::lanes::{Isa, Lanes};
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

/// The images of a film.
#[derive(Clone, Debug, Default)]
pub struct Layers {
    /// Linear red, green, blue, premultiplied by the fourth, the coverage: 4 per pixel.
    pub color: Vec<f32>,
    /// Standard error of the mean luminance of the samples; NaN of a single sample.
    pub error: Vec<f32>,
    /// What is seen first, if that was asked for.
    pub surfaces: Option<SurfaceLayers>,
}

/// The images of what the sample nearest to a pixel's centre sees first.
#[derive(Clone, Debug, Default)]
pub struct SurfaceLayers {
    /// Distance along the viewing axis; inf: nothing.
    pub depth: Vec<f32>,
    /// World-space outward geometric normal; 3 per pixel, 0 where nothing is.
    pub normal: Vec<f32>,
    /// Leaf number, or -1.
    pub instance: Vec<i64>,
}

impl Layers {
    /// Images of so many pixels, all zero: of what has not been rendered yet.
    pub fn new(count: usize, surfaces: bool) -> Layers {
        // The system gives zeros away: who renders a pixel is the first to touch it.
        Layers {
            color: huge_pages::zeros(4 * count),
            error: huge_pages::zeros(count),
            surfaces: surfaces.then(|| SurfaceLayers {
                depth: huge_pages::zeros(count),
                normal: huge_pages::zeros(3 * count),
                instance: huge_pages::zeros(count),
            }),
        }
    }
}

/// The rows of a film that a row of tiles covers.
pub struct Band<'a> {
    width: usize,
    color: &'a mut [f32],
    error: &'a mut [f32],
    surfaces: Option<SurfaceBand<'a>>,
}

struct SurfaceBand<'a> {
    depth: &'a mut [f32],
    normal: &'a mut [f32],
    instance: &'a mut [i64],
}

impl Film {
    /// A film that nothing has been put into.
    pub fn new(width: usize, height: usize, surfaces: bool) -> Film {
        Film {
            width,
            height,
            pixels: Layers::new(width * height, surfaces),
            rays: 0,
        }
    }

    /// The film in rows of tiles, from the top, for threads to put their tiles into.
    pub fn bands(&mut self) -> Vec<Mutex<Band<'_>>> {
        let (width, count) = (self.width, self.width * SIZE as usize);
        let Layers {
            color,
            error,
            surfaces,
        } = &mut self.pixels;
        let mut surfaces = surfaces.as_mut().map(|of| {
            (of.depth.chunks_mut(count))
                .zip(of.normal.chunks_mut(3 * count))
                .zip(of.instance.chunks_mut(count))
        });
        color
            .chunks_mut(4 * count)
            .zip(error.chunks_mut(count))
            .map(|(color, error)| {
                let of_surfaces = surfaces.as_mut().and_then(Iterator::next);
                Mutex::new(Band {
                    width,
                    color,
                    error,
                    surfaces: of_surfaces.map(|((depth, normal), instance)| SurfaceBand {
                        depth,
                        normal,
                        instance,
                    }),
                })
            })
            .collect()
    }
}

/// Pixels of a tile in its order, an array for each number; see [`Layers`].
#[derive(Default)]
pub struct Columns {
    /// [`Layers::color`], by component.
    pub color: [Vec<f32>; 4],
    /// [`Layers::error`].
    pub error: Vec<f32>,
    /// [`SurfaceLayers::depth`].
    pub depth: Vec<f32>,
    /// [`SurfaceLayers::normal`], by coordinate.
    pub normal: [Vec<f32>; 3],
    /// [`SurfaceLayers::instance`].
    pub instance: Vec<i64>,
}

impl Columns {
    /// Makes the arrays at least that long.
    pub fn make_room(&mut self, len: usize) {
        if self.instance.len() < len {
            for column in self.color.iter_mut().chain(&mut self.normal) {
                column.resize(len, 0.0);
            }
            self.error.resize(len, 0.0);
            self.depth.resize(len, 0.0);
            self.instance.resize(len, -1);
        }
    }
}

/// Writes N rows of columns, from row number `from` on.
#[inline(always)]
fn interleave<T: Copy + Default, const C: usize, const N: usize>(
    to: &mut [T],
    columns: &[Vec<T>; C],
    from: usize,
) {
    let mut rows = [[T::default(); C]; N];
    for (c, column) in columns.iter().enumerate() {
        let column = &column[from..from + N];
        for (row, &number) in rows.iter_mut().zip(column) {
            row[c] = number;
        }
    }
    to[..C * N].copy_from_slice(rows.as_flattened());
}

impl Band<'_> {
    /// Puts a finished tile of this band, whose pixels are in the tile's order, in its place.
    #[inline(always)]
    pub fn insert<I: Isa>(&mut self, tile: &Tile, pixels: &Columns) {
        const RUN: usize = BLOCK as usize;
        let mut from = 0;
        for run in tile.runs() {
            let to = run.y as usize * self.width + (tile.x + run.x) as usize;
            let len = run.len as usize;
            if len == RUN {
                let mut columns = [I::F32x4::zero(); 4];
                for (column, numbers) in columns.iter_mut().zip(&pixels.color) {
                    *column = I::F32x4::load(&numbers[from..]);
                }
                let to_color = &mut self.color[4 * to..4 * (to + RUN)];
                for (row, color) in I::transposed(columns).into_iter().enumerate() {
                    color.store(&mut to_color[4 * row..]);
                }
                self.put::<RUN>(to, pixels, from);
            } else {
                for i in 0..len {
                    interleave::<_, 4, 1>(&mut self.color[4 * (to + i)..], &pixels.color, from + i);
                    self.put::<1>(to + i, pixels, from + i);
                }
            }
            from += len;
        }
    }

    /// Puts what goes with the colours of N pixels from number `from` on in its place.
    #[inline(always)]
    fn put<const N: usize>(&mut self, to: usize, pixels: &Columns, from: usize) {
        self.error[to..to + N].copy_from_slice(&pixels.error[from..from + N]);
        if let Some(of) = &mut self.surfaces {
            interleave::<_, 3, N>(&mut of.normal[3 * to..], &pixels.normal, from);
            of.depth[to..to + N].copy_from_slice(&pixels.depth[from..from + N]);
            of.instance[to..to + N].copy_from_slice(&pixels.instance[from..from + N]);
        }
    }
}
