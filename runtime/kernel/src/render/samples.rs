//! The camera samples of a tile: their rays, what they see first, and their sums.
use super::film::Layers;
use super::frame::Frame;
use super::rays::{RayLists, make_room};
use super::sampler::{PixelKey, points};
use super::tile::Tile;
use super::vector::Vec3;
use crate::lanes::{Isa, axes};
use crate::ray::{Hit, Hits};
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
    pub rays: RayLists,
    /// See `rays`.
    pub hits: Hits,
    /// Of each slot: what is seen, premultiplied, and how much of the ray is covered.
    pub radiance: Vec<Vec3>,
    /// See `radiance`.
    pub alpha: Vec<f64>,
    /// Of each slot: its pixel's key and its sample number, see `super::sampler`.
    pub keys: Vec<PixelKey>,
    /// See `keys`.
    pub indices: Vec<u32>,
    /// Of each slot, where in its pixel the ray goes through, by column.
    points: [Vec<f64>; 2],
    /// The same in the picture.
    window: [Vec<f64>; 2],
    range: Range<u32>,
    tile: Tile,
    /// Of each pixel of the tile: its column and row there.
    places: Vec<[u32; 2]>,
    pixel_keys: Vec<PixelKey>,
    sums: Vec<Sum>,
    first: Vec<First>,
    layers: Layers,
}

/// What the samples of a pixel see, in all.
#[derive(Clone, Copy)]
struct Sum {
    color: Vec3,
    alpha: f64,
    luminance_squared: f64,
}

/// What is seen first by the sample nearest to the centre of a pixel so far.
#[derive(Clone, Copy)]
struct First {
    /// The sample's squared distance from the centre.
    distance: f64,
    /// Its slot if it is one of the present ones.
    nearest: Option<usize>,
    depth: f64,
    normal: [f64; 3],
    instance: i64,
}

impl Samples {
    /// Begins a tile.
    #[inline(always)]
    pub fn start(&mut self, seed: u64, tile: &Tile) {
        if (tile.width, tile.height) != (self.tile.width, self.tile.height) {
            let places = &mut self.places;
            places.clear();
            tile.for_each_pixel(|x, y| places.push([x, y]));
            self.layers = Layers::new(places.len());
        }
        self.tile = *tile;
        let count = self.places.len();
        let seed = PixelKey::seed(seed);
        self.pixel_keys.resize(count, seed);
        for (key, &[x, y]) in self.pixel_keys.iter_mut().zip(&self.places) {
            *key = seed.of_pixel(tile.x + x, tile.y + y);
        }
        let none = Sum {
            color: Vec3::ZERO,
            alpha: 0.0,
            luminance_squared: 0.0,
        };
        self.sums.clear();
        self.sums.resize(count, none);
        let nothing = First {
            distance: f64::INFINITY,
            nearest: None,
            depth: f64::INFINITY,
            normal: [0.0; 3],
            instance: -1,
        };
        self.first.clear();
        self.first.resize(count, nothing);
    }

    /// Takes the samples of `range`, of `per_pixel` in all: nothing seen yet, rays traced.
    ///
    /// A single sample is taken at the pixel's centre.
    #[inline(always)]
    pub fn see<I: Isa>(&mut self, frame: &Frame, range: Range<u32>, per_pixel: u32) {
        let each = range.len();
        let count = each * self.places.len();
        self.keys.resize(count, PixelKey::seed(0));
        self.indices.resize(count, 0);
        let slots = self
            .keys
            .chunks_exact_mut(each)
            .zip(self.indices.chunks_exact_mut(each));
        for (&key, (keys, indices)) in self.pixel_keys.iter().zip(slots) {
            keys.fill(key);
            for (index, sample) in indices.iter_mut().zip(range.clone()) {
                *index = sample;
            }
        }
        if per_pixel == 1 {
            make_room(&mut self.points, count);
            self.points.iter_mut().for_each(|column| column.fill(0.5));
        } else {
            points(
                frame.picture.set,
                &self.keys,
                &self.indices,
                PIXEL,
                &mut self.points,
            );
        }
        self.range = range;
        make_room(&mut self.window, count);
        for (axis, corner) in [self.tile.x, self.tile.y].into_iter().enumerate() {
            let window = self.window[axis].chunks_exact_mut(each);
            let points = self.points[axis].chunks_exact(each);
            for (place, (window, points)) in self.places.iter().zip(window.zip(points)) {
                let pixel = f64::from(corner + place[axis]);
                for (there, point) in window.iter_mut().zip(points) {
                    *there = pixel + point;
                }
            }
        }
        frame.view.aim::<I>(&self.window, count, &mut self.rays);
        self.choose_nearest();
        self.radiance.clear();
        self.radiance.resize(count, Vec3::ZERO);
        self.alpha.clear();
        self.alpha.resize(count, 0.0);
        frame.closest(&self.rays, &mut self.hits);
    }

    /// Forgets the first thing seen of pixels that have a sample nearer to their centre now.
    #[inline(always)]
    fn choose_nearest(&mut self) {
        let each = self.range.len();
        let [u, v] = &self.points;
        let of_pixels = u.chunks_exact(each).zip(v.chunks_exact(each)).enumerate();
        for (first, (pixel, (u, v))) in self.first.iter_mut().zip(of_pixels) {
            let (mut least, mut nearest) = (first.distance, None);
            for (sample, (&u, &v)) in u.iter().zip(v).enumerate() {
                let distance = (u - 0.5) * (u - 0.5) + (v - 0.5) * (v - 0.5);
                if distance < least {
                    (least, nearest) = (distance, Some(pixel * each + sample));
                }
            }
            first.nearest = nearest;
            if nearest.is_some() {
                *first = First {
                    distance: least,
                    nearest,
                    depth: f64::INFINITY,
                    normal: [0.0; 3],
                    instance: -1,
                };
            }
        }
    }

    /// Notes hit number `hit`, at `depth` along the viewing axis, as the first thing that `slot` sees.
    #[inline(always)]
    pub fn note(&mut self, slot: usize, depth: f64, hit: usize) {
        let first = &mut self.first[(slot as u32 / self.range.len() as u32) as usize];
        if first.nearest == Some(slot) {
            first.nearest = None;
            first.depth = depth;
            first.normal = axes!(|axis| self.hits.normal[axis][hit]);
            first.instance = self.hits.instance[hit];
        }
    }

    /// Colours every hit by itself.
    #[inline(always)]
    pub fn show(&mut self, color: impl Fn(&Hit) -> Vec3) {
        for slot in 0..self.hits.len() {
            let hit = self.hits.get(slot);
            if hit.instance >= 0 {
                self.note(slot, hit.t, slot);
                self.radiance[slot] = color(&hit);
                self.alpha[slot] = 1.0;
            }
        }
    }

    /// Adds what the present samples see to their pixels, in order.
    #[inline(always)]
    pub fn accumulate(&mut self) {
        let count = self.range.len();
        let slots = self
            .radiance
            .chunks_exact(count)
            .zip(self.alpha.chunks_exact(count));
        for (pixel, (radiance, alpha)) in self.sums.iter_mut().zip(slots) {
            let mut sum = *pixel;
            for (&radiance, &alpha) in radiance.iter().zip(alpha) {
                // A light or surface at the edge of the number range must not spoil the pixel.
                let color = if radiance.is_finite() {
                    radiance
                } else {
                    Vec3::ZERO
                };
                let luminance = color.luminance();
                sum.color += color;
                sum.alpha += alpha;
                sum.luminance_squared += luminance * luminance;
            }
            *pixel = sum;
        }
    }

    /// The finished tile, row by row.
    #[inline(always)]
    pub fn finish(&mut self, per_pixel: u32) -> &Layers {
        let columns = self.tile.width as usize;
        let layers = &mut self.layers;
        let count = f64::from(per_pixel);
        let of_pixels = self.sums.iter().zip(&self.first);
        for (&[x, y], (sum, first)) in self.places.iter().zip(of_pixels) {
            let place = y as usize * columns + x as usize;
            let color = sum.color * (1.0 / count);
            let alpha = sum.alpha / count;
            let rgba = [color.x, color.y, color.z, alpha].map(|number| number as f32);
            layers.color[4 * place..4 * place + 4].copy_from_slice(&rgba);
            // Unbiased variance of one sample, over the number of samples; 0 / 0 of a single one.
            let mean = color.luminance();
            let variance = (sum.luminance_squared / count - mean * mean).max(0.0);
            layers.error[place] = (variance / (count - 1.0)).sqrt() as f32;
            layers.depth[place] = first.depth as f32;
            let normal = first.normal.map(|number| number as f32);
            layers.normal[3 * place..3 * place + 3].copy_from_slice(&normal);
            layers.instance[place] = first.instance;
        }
        layers
    }
}
