//! What the threads of a render share, and what each does with a tile.
use super::camera::View;
use super::detail::Detail;
use super::direct::Direct;
use super::film::Band;
use super::light::Lights;
use super::material::Material;
use super::occlusion::Occlusion;
use super::rays::RayLists;
use super::samples::Samples;
use super::tile::Tile;
use super::vector::Vec3;
use super::{Integrator, Picture};
use crate::lanes::{Isa, Task, dispatch};
use crate::ray::{Hit, Hits, Trace};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

/// The task, the same for all threads.
pub struct Frame<'a> {
    pub trace: &'a dyn Trace,
    pub picture: &'a Picture,
    pub view: View,
    pub lights: &'a Lights,
    pub materials: &'a [Material],
    /// What varies over surfaces, if anything does.
    pub detail: Option<&'a Detail>,
    /// Whether any material lets light through: only then rays are continued.
    pub transparent: bool,
    /// Whether all that is seen on surfaces is light that they reflect, all by the scene's materials.
    pub plain: bool,
    /// Whether what surfaces reflect depends on where they are seen from.
    pub views: bool,
    /// Whether anything is drawn at random.
    pub draws: bool,
    pub cancelled: &'a AtomicBool,
    /// Rays traced so far.
    pub rays: &'a AtomicU64,
    /// Camera samples finished so far.
    pub samples: &'a AtomicU64,
}

impl Frame<'_> {
    /// The closest hits of `rays`.
    pub fn closest(&self, rays: &RayLists, hits: &mut Hits) {
        self.rays.fetch_add(rays.len() as u64, Ordering::Relaxed);
        self.trace.closest(rays.as_rays(), hits);
    }

    /// Whether the `rays` are occluded.
    pub fn occluded(&self, rays: &RayLists, occluded: &mut Vec<bool>) {
        occluded.resize(rays.len(), false);
        self.rays.fetch_add(rays.len() as u64, Ordering::Relaxed);
        self.trace.occluded(rays.as_rays(), occluded);
    }

    /// How much of what lies behind a hit is hidden there.
    pub fn opacity(&self, hit: &Hit) -> f64 {
        let varying = self
            .detail
            .and_then(|detail| detail.opacity(self.trace, hit));
        varying.unwrap_or_else(|| self.materials[hit.material as usize].opacity)
    }

    /// Whether the render should end; checked between batches.
    pub fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }
}

/// Samples per pixel and batch: the rays, hits and vertices of a tile fit into a core's cache.
const SAMPLES_PER_BATCH: u32 = 4;

/// The same where several rays leave each vertex, to be ordered: the more, the better.
const OCCLUSION_SAMPLES_PER_BATCH: u32 = 16;

/// One thread: the memory its work needs, kept from tile to tile.
#[derive(Default)]
pub struct Worker {
    samples: Samples,
    direct: Direct,
    occlusion: Occlusion,
}

impl Worker {
    /// Renders a tile into its band; false if the render is cancelled.
    pub fn render(&mut self, frame: &Frame, tile: &Tile, band: &Mutex<Band>) -> bool {
        let task = Render {
            worker: self,
            frame,
            tile,
            band,
        };
        dispatch(frame.picture.set, task)
    }
}

/// [`Worker::render`], compiled for the set.
struct Render<'a, 'b> {
    worker: &'a mut Worker,
    frame: &'a Frame<'a>,
    tile: &'a Tile,
    band: &'a Mutex<Band<'b>>,
}

impl Task for Render<'_, '_> {
    type Output = bool;

    #[inline(always)]
    fn run<I: Isa>(self) -> bool {
        let Render {
            worker,
            frame,
            tile,
            band,
        } = self;
        let picture = frame.picture;
        let samples = &mut worker.samples;
        let (per_pixel, occlusion_rays) = picture.samples_and_occlusion_rays();
        samples.start(frame, tile);
        let at_once = match picture.integrator {
            Integrator::AmbientOcclusion { .. } => OCCLUSION_SAMPLES_PER_BATCH,
            _ => SAMPLES_PER_BATCH,
        };
        for first in (0..per_pixel).step_by(at_once as usize) {
            let last = per_pixel.min(first + at_once);
            samples.see::<I>(frame, first..last, per_pixel);
            match picture.integrator {
                Integrator::Direct => worker.direct.light::<I>(frame, samples),
                Integrator::AmbientOcclusion { distance } => {
                    let occlusion = &mut worker.occlusion;
                    occlusion.light::<I>(frame, samples, distance, occlusion_rays);
                }
                Integrator::Normals => {
                    samples.show(frame, |hit| Vec3::from(hit.normal) * 0.5 + Vec3::ONE * 0.5);
                }
                Integrator::Ids => samples.show(frame, |hit| id_color(hit.instance)),
            }
            if frame.is_cancelled() {
                return false;
            }
            if last < per_pixel {
                samples.accumulate::<I>();
            }
            let seen = samples.len() as u64;
            frame.samples.fetch_add(seen, Ordering::Relaxed);
        }
        let pixels = samples.finish::<I>(per_pixel);
        let mut band = band.lock().unwrap_or_else(PoisonError::into_inner);
        band.insert::<I>(tile, pixels);
        true
    }
}

/// A colour for a leaf number, never dark: always the same, unlike those of its neighbours.
fn id_color(instance: i64) -> Vec3 {
    // The finaliser of SplitMix64 (Steele, Lea, Flood 2014).
    let mut x = (instance as u64).wrapping_add(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^= x >> 31;
    let channel = |shift: u32| 0.15 + 0.85 / 255.0 * f64::from((x >> shift) as u8);
    Vec3::new(channel(0), channel(8), channel(16))
}
