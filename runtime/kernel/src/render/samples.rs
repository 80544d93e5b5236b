//! The camera samples of a tile: their rays, what they see first, and their sums.
use super::film::Layers;
use super::frame::Frame;
use super::sampler::PixelSampler;
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
    range: Range<u32>,
    tile: Tile,
    pixels: Vec<Pixel>,
}

/// One pixel of the tile.
struct Pixel {
    x: u32,
    y: u32,
    sampler: PixelSampler,
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
        self.pixels.extend(tile.pixels().map(|(x, y)| Pixel {
            x,
            y,
            sampler: PixelSampler::new(tile.x + x, tile.y + y, seed),
            color: Vec3::ZERO,
            alpha: 0.0,
            luminance_squared: 0.0,
            distance: f64::INFINITY,
            nearest: None,
            depth: f64::INFINITY,
            normal: [0.0; 3],
            instance: -1,
        }));
    }

    /// Takes the samples of `range`, of `per_pixel` in all: nothing seen yet, rays traced.
    ///
    /// A single sample is taken at the pixel's centre.
    pub fn see(&mut self, frame: &Frame, range: Range<u32>, per_pixel: u32) {
        self.rays.clear();
        for pixel in &mut self.pixels {
            pixel.nearest = None;
            for index in range.clone() {
                let [u, v] = match per_pixel {
                    1 => [0.5, 0.5],
                    _ => pixel.sampler.point(index, PIXEL),
                };
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

    /// The sample points of a slot's pixel, and the slot's sample number.
    #[inline]
    pub fn sampler(&self, slot: usize) -> (&PixelSampler, u32) {
        let count = self.range.len();
        (
            &self.pixels[slot / count].sampler,
            self.range.start + (slot % count) as u32,
        )
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
            let rgba = [color.x, color.y, color.z, alpha].map(|value| value as f32);
            layers.color[4 * place..4 * place + 4].copy_from_slice(&rgba);
            // Unbiased variance of one sample, over the number of samples; 0 / 0 of a single one.
            let mean = color.luminance();
            let variance = (pixel.luminance_squared / count - mean * mean).max(0.0);
            layers.error[place] = (variance / (count - 1.0)).sqrt() as f32;
            layers.depth[place] = pixel.depth as f32;
            let normal = pixel.normal.map(|value| value as f32);
            layers.normal[3 * place..3 * place + 3].copy_from_slice(&normal);
            layers.instance[place] = pixel.instance;
        }
        layers
    }
}
