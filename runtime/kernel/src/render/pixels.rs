//! What the pixels of a tile show: sums of their samples, and what is seen first.
use super::film::Columns;
use super::rays::make_room;
use super::vector::Vec3;
use crate::lanes::{Isa, Lanes, MAX_WIDTH, Mask, halves, take_bit};
use crate::ray::Hits;

/// Neighbouring pixels whose samples are interleaved, see [`Stretch`]: as many as the widest f64
/// lanes, and a multiple of all others.
pub const GROUP: usize = MAX_WIDTH / 2;

/// The numbers of lanes.
const LANES: [f64; GROUP] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

/// Some pixels of a group, as many as lanes, and where their samples are.
///
/// A *slot* is one sample of one pixel. Slots follow each other group by group, in a group sample
/// by sample, of a sample pixel by pixel: so a vector has the same sample of neighbours, and a packet
/// of rays is narrow.
#[derive(Clone, Copy)]
pub struct Stretch {
    /// The first pixel.
    pub pixel: usize,
    /// The slot of its first sample.
    pub slot: usize,
    /// From each sample of a pixel to the next.
    pub step: usize,
}

impl Stretch {
    /// The one from some pixel on, of so many with `each` samples.
    #[inline(always)]
    fn of(pixel: usize, pixels: usize, each: usize) -> Stretch {
        let within = pixel % GROUP;
        let group = pixel - within;
        Stretch {
            pixel,
            slot: group * each + within,
            step: GROUP.min(pixels - group),
        }
    }

    /// All stretches of `width` of so many pixels with `each` samples.
    #[inline(always)]
    pub fn all(pixels: usize, each: usize, width: usize) -> impl Iterator<Item = Stretch> {
        (0..pixels)
            .step_by(width)
            .map(move |pixel| Stretch::of(pixel, pixels, each))
    }
}

/// The sums of what the samples of W pixels see.
#[derive(Clone, Copy)]
struct Sums<L> {
    color: Vec3<L>,
    alpha: L,
    luminance_squared: L,
}

/// The pixels of a tile, an array for each number.
#[derive(Default)]
pub struct Pixels {
    len: usize,
    /// Whether there are sums, of earlier samples.
    begun: bool,
    color: [Vec<f64>; 3],
    alpha: Vec<f64>,
    luminance_squared: Vec<f64>,
    /// Whether what is seen first is wanted: the next ones are kept for it.
    surfaces: bool,
    /// Squared distance from the centre of the sample nearest to it.
    distance: Vec<f64>,
    /// That sample's slot if it is one of the present ones and has seen nothing yet, else -1.
    nearest: Vec<f64>,
    /// What that sample sees first.
    depth: Vec<f64>,
    normal: [Vec<f64>; 3],
    instance: Vec<i64>,
    finished: Columns,
}

/// Makes a column of so many equal numbers, with room for what lanes write beyond them.
#[inline(always)]
pub fn refill<T: Copy>(column: &mut Vec<T>, len: usize, number: T) {
    column.clear();
    column.resize(len + MAX_WIDTH, number);
}

impl Pixels {
    /// Begins so many pixels: nothing seen.
    #[inline(always)]
    pub fn start(&mut self, len: usize, surfaces: bool) {
        self.len = len;
        self.begun = false;
        self.surfaces = surfaces;
        if surfaces {
            refill(&mut self.distance, len, f64::INFINITY);
            refill(&mut self.depth, len, f64::INFINITY);
            refill(&mut self.instance, len, -1);
            for column in &mut self.normal {
                refill(column, len, 0.0);
            }
            refill(&mut self.nearest, len, -1.0);
        }
    }

    /// Forgets what is seen first by pixels that have a sample nearer to their centre now: `each` new
    /// ones, whose slots' rays go through these `points` of their pixels.
    #[inline(always)]
    pub fn choose_nearest<I: Isa>(&mut self, [u, v]: &[Vec<f64>; 2], each: usize) {
        let half = I::F64::splat(0.5);
        for Stretch { pixel, slot, step } in Stretch::all(self.len, each, I::F64::WIDTH) {
            let mut least = I::F64::load(&self.distance[pixel..]);
            let mut nearest = I::F64::splat(-1.0);
            for slot in (slot..).step_by(step).take(each) {
                let x = I::F64::load(&u[slot..]) - half;
                let y = I::F64::load(&v[slot..]) - half;
                let distance = x * x + y * y;
                let slots = I::F64::splat(slot as i64 as f64) + I::F64::load(&LANES);
                nearest = I::F64::select(distance.lt(least), slots, nearest);
                least = distance.min(least);
            }
            least.store(&mut self.distance[pixel..]);
            nearest.store(&mut self.nearest[pixel..]);
            let mut left = nearest.ge(I::F64::zero()).bits();
            while let Some(lane) = take_bit(&mut left) {
                let pixel = pixel + lane;
                if self.instance[pixel] >= 0 {
                    self.depth[pixel] = f64::INFINITY;
                    self.instance[pixel] = -1;
                    for column in &mut self.normal {
                        column[pixel] = 0.0;
                    }
                }
            }
        }
    }

    /// Notes hit number `hit`, at `depth` along the viewing axis, as the first thing that a slot of a
    /// pixel sees.
    #[inline(always)]
    pub fn note(&mut self, pixel: usize, slot: usize, depth: f64, hits: &Hits, hit: usize) {
        if self.nearest[pixel] == slot as i64 as f64 {
            self.nearest[pixel] = -1.0;
            self.depth[pixel] = depth;
            self.instance[pixel] = hits.instance[hit];
            for (to, from) in self.normal.iter_mut().zip(&hits.normal) {
                to[pixel] = from[hit];
            }
        }
    }

    /// The sums of a stretch, with what the slots of `each` samples see added in order.
    #[inline(always)]
    fn sums<L: Lanes<Scalar = f64>>(
        &self,
        Stretch { pixel, slot, step }: Stretch,
        radiance: &[Vec<f64>; 3],
        alpha: &[f64],
        each: usize,
    ) -> Sums<L> {
        let mut sums = if self.begun {
            Sums {
                color: Vec3::load(&self.color, pixel),
                alpha: L::load(&self.alpha[pixel..]),
                luminance_squared: L::load(&self.luminance_squared[pixel..]),
            }
        } else {
            Sums {
                color: Vec3::splat(Vec3::ZERO),
                alpha: L::zero(),
                luminance_squared: L::zero(),
            }
        };
        for sample in 0..each {
            let slot = slot + sample * step;
            // A light or surface at the edge of the number range must not spoil the pixel.
            let seen = Vec3::load(radiance, slot);
            let seen = Vec3::select(seen.is_finite(), seen, Vec3::splat(Vec3::ZERO));
            let luminance = seen.luminance();
            sums.color += seen;
            sums.alpha = sums.alpha + L::load(&alpha[slot..]);
            sums.luminance_squared = sums.luminance_squared + luminance * luminance;
        }
        sums
    }

    /// Adds what the slots of `each` samples see, in order; these are not the last.
    #[inline(always)]
    pub fn add<I: Isa>(&mut self, radiance: &[Vec<f64>; 3], alpha: &[f64], each: usize) {
        make_room(&mut self.color, self.len);
        make_room(std::slice::from_mut(&mut self.alpha), self.len);
        make_room(std::slice::from_mut(&mut self.luminance_squared), self.len);
        for stretch in Stretch::all(self.len, each, I::F64::WIDTH) {
            let sums: Sums<I::F64> = self.sums(stretch, radiance, alpha, each);
            let pixel = stretch.pixel;
            sums.color.store(&mut self.color, pixel);
            sums.alpha.store(&mut self.alpha[pixel..]);
            (sums.luminance_squared).store(&mut self.luminance_squared[pixel..]);
        }
        self.begun = true;
    }

    /// Adds what the slots of the last `each` samples see: the pixels as a film has them, of so many
    /// samples in all.
    #[inline(always)]
    pub fn finish<I: Isa>(
        &mut self,
        radiance: &[Vec<f64>; 3],
        alpha: &[f64],
        each: usize,
        samples: u32,
    ) -> &Columns {
        let mut to = std::mem::take(&mut self.finished);
        to.make_room(self.len + MAX_WIDTH);
        let width = I::F64::WIDTH;
        let count = f64::from(samples);
        let part = I::F64::splat(1.0 / count);
        let (others, count) = (I::F64::splat(count - 1.0), I::F64::splat(count));
        for first in (0..self.len).step_by(I::F32::WIDTH) {
            let [low, high] = halves!(|h| {
                // Where there is no second half, the first one will do.
                let pixel = first + h * width;
                let pixel = if pixel < self.len { pixel } else { first };
                let stretch = Stretch::of(pixel, self.len, each);
                let sums: Sums<I::F64> = self.sums(stretch, radiance, alpha, each);
                let color = sums.color * part;
                let alpha = sums.alpha / count;
                let error = if samples == 1 {
                    I::F64::splat(f64::NAN)
                } else {
                    // Unbiased variance of one sample, over the number of samples.
                    let mean = color.luminance();
                    let squared = sums.luminance_squared / count;
                    let variance = (squared - mean * mean).max(I::F64::zero());
                    (variance / others).sqrt()
                };
                (color, alpha, error)
            });
            let color = [
                I::narrow(low.0.x, high.0.x),
                I::narrow(low.0.y, high.0.y),
                I::narrow(low.0.z, high.0.z),
                I::narrow(low.1, high.1),
            ];
            for (to, numbers) in to.color.iter_mut().zip(color) {
                numbers.store(&mut to[first..]);
            }
            I::narrow(low.2, high.2).store(&mut to.error[first..]);
        }
        if self.surfaces {
            self.finish_surfaces::<I>(&mut to);
        }
        self.finished = to;
        &self.finished
    }

    /// What is seen first, as a film has it.
    #[inline(always)]
    fn finish_surfaces<I: Isa>(&self, to: &mut Columns) {
        let [nx, ny, nz] = &self.normal;
        let [x, y, z] = &mut to.normal;
        for (to, from) in [(&mut to.depth, &self.depth), (x, nx), (y, ny), (z, nz)] {
            for first in (0..self.len).step_by(I::F32::WIDTH) {
                let [low, high] = halves!(|h| I::F64::load(&from[first + h * I::F64::WIDTH..]));
                I::narrow(low, high).store(&mut to[first..]);
            }
        }
        to.instance[..self.len].copy_from_slice(&self.instance[..self.len]);
    }
}
