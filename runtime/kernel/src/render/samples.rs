//! The camera samples of a tile: their rays, and what they see.
use super::film::Columns;
use super::frame::Frame;
use super::pixels::{GROUP, Pixels, Stretch, refill};
use super::rays::{RayLists, make_room};
use super::sampler::{PixelKey, points};
use super::tile::Tile;
use super::vector::Vec3;
use crate::lanes::{Isa, Lanes, MAX_WIDTH};
use crate::ray::{Hit, Hits};
use std::ops::Range;

/// The pair of sample dimensions of the place in the pixel.
const PIXEL: u32 = 0;

/// Some samples of each pixel of a tile, in the slots that [`Stretch`] describes; arrays are longer
/// than there are slots, by what lanes may write beyond the last.
#[derive(Default)]
pub struct Samples {
    /// Of each slot: the camera ray and its closest hit.
    pub rays: RayLists,
    /// See `rays`.
    pub hits: Hits,
    /// Of each slot: what is seen, premultiplied, by component, and how much of the ray is covered.
    pub radiance: [Vec<f64>; 3],
    /// See `radiance`.
    pub alpha: Vec<f64>,
    /// Of each slot, where anything is drawn: its pixel's key and its sample number, see
    /// `super::sampler`.
    pub keys: Vec<PixelKey>,
    /// See `keys`.
    pub indices: Vec<u32>,
    /// The pixel of each slot, where it is asked what is seen first.
    owners: Vec<u32>,
    /// Of each slot, where in its pixel the ray goes through, by column.
    points: [Vec<f64>; 2],
    /// The same in the picture.
    window: [Vec<f64>; 2],
    /// Samples of each pixel.
    each: usize,
    tile: Tile,
    /// Of each pixel of the tile: its column and row there.
    places: [Vec<u32>; 2],
    /// Of each pixel: its number, its column and row in the picture, and its key.
    numbers: Vec<u32>,
    corners: [Vec<f64>; 2],
    pixel_keys: Vec<PixelKey>,
    pixels: Pixels,
}

impl Samples {
    /// Begins a tile.
    #[inline(always)]
    pub fn start(&mut self, frame: &Frame, tile: &Tile) {
        let seed = PixelKey::seed(frame.picture.seed);
        let count = tile.width as usize * tile.height as usize;
        if (tile.width, tile.height) != (self.tile.width, self.tile.height) {
            let [columns, rows] = &mut self.places;
            columns.clear();
            rows.clear();
            for run in tile.runs() {
                columns.extend(run.x..run.x + run.len);
                rows.extend((0..run.len).map(|_| run.y));
            }
            self.numbers.clear();
            self.numbers.extend(0..(count + MAX_WIDTH) as u32);
            make_room(&mut self.corners, count);
            refill(&mut self.pixel_keys, count, seed);
        }
        self.tile = *tile;
        let [columns, rows] = &self.places;
        if frame.draws {
            for (key, (x, y)) in self.pixel_keys.iter_mut().zip(columns.iter().zip(rows)) {
                *key = seed.of_pixel(tile.x + x, tile.y + y);
            }
        }
        let first = [tile.x, tile.y];
        for ((corners, places), first) in self.corners.iter_mut().zip(&self.places).zip(first) {
            for (corner, place) in corners.iter_mut().zip(places) {
                *corner = f64::from(first + place);
            }
        }
        self.pixels.start(count, frame.picture.surfaces);
    }

    /// How many slots there are.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.each * self.places[0].len()
    }

    /// Takes the samples of `range`, of `per_pixel` in all: nothing seen yet, rays traced.
    ///
    /// A single sample is taken at the pixel's centre.
    #[inline(always)]
    pub fn see<I: Isa>(&mut self, frame: &Frame, range: Range<u32>, per_pixel: u32) {
        self.each = range.len();
        let (each, pixels, count) = (range.len(), self.places[0].len(), self.len());
        if frame.draws {
            self.keys.resize(count + MAX_WIDTH, PixelKey::seed(0));
            self.indices.resize(count + MAX_WIDTH, 0);
            for Stretch { pixel, slot, step } in Stretch::all(pixels, each, GROUP) {
                // Whole groups are written in order: what is too much is written over.
                for (slot, sample) in (slot..).step_by(step).zip(range.clone()) {
                    let to = slot..slot + GROUP;
                    self.keys[to.clone()].copy_from_slice(&self.pixel_keys[pixel..pixel + GROUP]);
                    self.indices[to].fill(sample);
                }
            }
        }
        if frame.picture.surfaces {
            self.owners.resize(count + MAX_WIDTH, 0);
            for Stretch { pixel, slot, step } in Stretch::all(pixels, each, GROUP) {
                for slot in (slot..).step_by(step).take(each) {
                    let numbers = &self.numbers[pixel..pixel + GROUP];
                    self.owners[slot..slot + GROUP].copy_from_slice(numbers);
                }
            }
        }
        if per_pixel == 1 {
            for column in &mut self.points {
                refill(column, count, 0.5);
            }
        } else {
            let (keys, indices) = (&self.keys[..count], &self.indices[..count]);
            points(frame.picture.set, keys, indices, PIXEL, &mut self.points);
        }
        make_room(&mut self.window, count);
        let of_axes = self.window.iter_mut().zip(&self.corners).zip(&self.points);
        for ((window, corners), points) in of_axes {
            for Stretch { pixel, slot, step } in Stretch::all(pixels, each, GROUP) {
                for slot in (slot..).step_by(step).take(each) {
                    for lane in (0..GROUP).step_by(I::F64::WIDTH) {
                        let corner = I::F64::load(&corners[pixel + lane..]);
                        let point = I::F64::load(&points[slot + lane..]);
                        (corner + point).store(&mut window[slot + lane..]);
                    }
                }
            }
        }
        frame.view.aim::<I>(&self.window, count, &mut self.rays);
        if frame.picture.surfaces {
            self.pixels.choose_nearest::<I>(&self.points, each);
        }
        for column in &mut self.radiance {
            refill(column, count, 0.0);
        }
        refill(&mut self.alpha, count, 0.0);
        frame.closest(&self.rays, &mut self.hits);
    }

    /// Notes hit number `hit`, at `depth` along the viewing axis, as the first thing that `slot`
    /// sees, if that is asked for.
    #[inline(always)]
    pub fn note(&mut self, frame: &Frame, slot: usize, depth: f64, hit: usize) {
        if !frame.picture.surfaces {
            return;
        }
        let pixel = self.owners[slot] as usize;
        self.pixels.note(pixel, slot, depth, &self.hits, hit);
    }

    /// Adds light that a slot sees.
    #[inline(always)]
    pub fn add(&mut self, slot: usize, light: Vec3) {
        for (column, light) in self.radiance.iter_mut().zip(light.to_array()) {
            column[slot] += light;
        }
    }

    /// Colours every hit by itself.
    #[inline(always)]
    pub fn show(&mut self, frame: &Frame, color: impl Fn(&Hit) -> Vec3) {
        for slot in 0..self.hits.len() {
            let hit = self.hits.get(slot);
            if hit.instance >= 0 {
                self.note(frame, slot, hit.t, slot);
                self.add(slot, color(&hit));
                self.alpha[slot] = 1.0;
            }
        }
    }

    /// Adds what the present samples see to their pixels, in order; others follow.
    #[inline(always)]
    pub fn accumulate<I: Isa>(&mut self) {
        (self.pixels).add::<I>(&self.radiance, &self.alpha, self.each);
    }

    /// Adds what the present samples see, the last of `per_pixel`: the finished pixels, in the
    /// tile's order.
    #[inline(always)]
    pub fn finish<I: Isa>(&mut self, per_pixel: u32) -> &Columns {
        (self.pixels).finish::<I>(&self.radiance, &self.alpha, self.each, per_pixel)
    }
}
