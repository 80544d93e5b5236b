//! The camera samples of a tile: their rays, what they see first, and their sums.
use super::film::Layers;
use super::frame::Frame;
use super::sampler::{PixelKey, points};
use super::tile::Tile;
use super::vector::Vec3;
use crate::ray::{Hit, Ray};
use std::ops::Range;

/// The pair of sample dimensions of the place in the pixel.
const PIXEL: u32 = 0;

/// Some samples of each pixel of a tile.
///
/// A *slot* is one sample of one pixel. The slots of a pixel follow each other, so that a packet
/// of rays is narrow.
#[derive(Default)]
pub struct Samples {
    /// Of each slot: the camera ray and its closest hit.
    pub rays: Vec<Ray>,
    /// See `rays`.
    pub hits: Vec<Hit>,
    /// Of each slot: what is seen, premultiplied, and how much of the ray is covered.
    pub radiance: Vec<Vec3>,
    /// See `radiance`.
    pub alpha: Vec<f64>,
    /// Of each slot: its pixel's key and its sample number, see `super::sampler`.
    pub keys: Vec<PixelKey>,
    /// See `keys`.
    pub indices: Vec<u32>,
    points: Vec<[f64; 2]>,
    range: Range<u32>,
    tile: Tile,
    pixels: Vec<Pixel>,
}

/// One pixel of the tile.
struct Pixel {
    x: u32,
    y: u32,
    key: PixelKey,
    color: Vec3,
    alpha: f64,
    luminance_squared: f64,
    /// Squared distance from the centre of the sample nearest to it so far.
    distance: f64,
    /// The slot of that sample if it is one of the present ones.
    nearest: Option<usize>,
    depth: f64,
    normal: [f64; 3],
    instance: i64,
}

impl Samples {
    /// Begins a tile.
    pub fn start(&mut self, seed: u64, tile: &Tile) {
        self.tile = *tile;
        self.pixels.clear();
        tile.for_each_pixel(|x, y| {
            self.pixels.push(Pixel {
                x,
                y,
                key: PixelKey::new(tile.x + x, tile.y + y, seed),
                color: Vec3::ZERO,
                alpha: 0.0,
                luminance_squared: 0.0,
                distance: f64::INFINITY,
                nearest: None,
                depth: f64::INFINITY,
                normal: [0.0; 3],
                instance: -1,
            });
        });
    }

    /// Takes the samples of `range`, of `per_pixel` in all: nothing seen yet, rays traced.
    ///
    /// A single sample is taken at the pixel's centre.
    pub fn see(&mut self, frame: &Frame, range: Range<u32>, per_pixel: u32) {
        self.keys.clear();
        self.indices.clear();
        for pixel in &self.pixels {
            self.keys.extend(range.clone().map(|_| pixel.key));
            self.indices.extend(range.clone());
        }
        if per_pixel == 1 {
            self.points.clear();
            self.points.resize(self.keys.len(), [0.5, 0.5]);
        } else {
            points(
                frame.picture.set,
                &self.keys,
                &self.indices,
                PIXEL,
                &mut self.points,
            );
        }
        self.rays.clear();
        for (pixel, points) in self
            .pixels
            .iter_mut()
            .zip(self.points.chunks_exact(range.len()))
        {
            pixel.nearest = None;
            for &[u, v] in points {
                let distance = (u - 0.5) * (u - 0.5) + (v - 0.5) * (v - 0.5);
                if distance < pixel.distance {
                    pixel.distance = distance;
                    pixel.nearest = Some(self.rays.len());
                    pixel.depth = f64::INFINITY;
                    pixel.normal = [0.0; 3];
                    pixel.instance = -1;
                }
                let x = f64::from(self.tile.x + pixel.x) + u;
                let y = f64::from(self.tile.y + pixel.y) + v;
                self.rays.push(frame.view.ray(x, y));
            }
        }
        self.range = range;
        self.radiance.clear();
        self.radiance.resize(self.rays.len(), Vec3::ZERO);
        self.alpha.clear();
        self.alpha.resize(self.rays.len(), 0.0);
        frame.closest(&self.rays, &mut self.hits);
    }

    /// Notes `hit`, at `depth` along the viewing axis, as the first thing that `slot` sees.
    #[inline]
    pub fn note(&mut self, slot: usize, depth: f64, hit: &Hit) {
        let pixel = &mut self.pixels[slot / self.range.len()];
        if pixel.nearest == Some(slot) {
            pixel.nearest = None;
            pixel.depth = depth;
            pixel.normal = hit.normal;
            pixel.instance = hit.instance;
        }
    }

    /// Colours every hit by itself.
    pub fn show(&mut self, color: impl Fn(&Hit) -> Vec3) {
        for slot in 0..self.hits.len() {
            let hit = self.hits[slot];
            if hit.instance >= 0 {
                self.note(slot, hit.t, &hit);
                self.radiance[slot] = color(&hit);
                self.alpha[slot] = 1.0;
            }
        }
    }

    /// Adds what the present samples see to their pixels, in order.
    pub fn accumulate(&mut self) {
        let count = self.range.len();
        let slots = self
            .radiance
            .chunks_exact(count)
            .zip(self.alpha.chunks_exact(count));
        for (pixel, (radiance, alpha)) in self.pixels.iter_mut().zip(slots) {
            for (&radiance, &alpha) in radiance.iter().zip(alpha) {
                // A light or surface at the edge of the number range must not spoil the pixel.
                let color = if radiance.is_finite() {
                    radiance
                } else {
                    Vec3::ZERO
                };
                let luminance = color.luminance();
                pixel.color += color;
                pixel.alpha += alpha;
                pixel.luminance_squared += luminance * luminance;
            }
        }
    }

    /// The finished tile, row by row.
    pub fn finish(&self, per_pixel: u32) -> Layers {
        let columns = self.tile.width as usize;
        let mut layers = Layers::new(self.pixels.len());
        let count = f64::from(per_pixel);
        for pixel in &self.pixels {
            let place = pixel.y as usize * columns + pixel.x as usize;
            let color = pixel.color * (1.0 / count);
            let alpha = pixel.alpha / count;
            let to = &mut layers.color[4 * place..4 * place + 4];
            to[0] = color.x as f32;
            to[1] = color.y as f32;
            to[2] = color.z as f32;
            to[3] = alpha as f32;
            // Unbiased variance of one sample, over the number of samples; 0 / 0 of a single one.
            let mean = color.luminance();
            let variance = (pixel.luminance_squared / count - mean * mean).max(0.0);
            layers.error[place] = (variance / (count - 1.0)).sqrt() as f32;
            layers.depth[place] = pixel.depth as f32;
            for (to, from) in layers.normal[3 * place..3 * place + 3]
                .iter_mut()
                .zip(pixel.normal)
            {
                *to = from as f32;
            }
            layers.instance[place] = pixel.instance;
        }
        layers
    }
}
