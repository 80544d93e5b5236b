//! Pictures: camera rays, light, shade, and the film they make.
//!
//! A picture is rendered tile by tile; a tile's camera rays go to the tracer as one batch, then
//! its shadow rays light by light. Everything random is a hash of pixel,
//! sample, dimension and seed, every pixel is summed by one thread in the order of its samples, and
//! no function of the system's mathematical library is called: the picture is the same, bit for
//! bit, whatever the threads, the batches and the instruction set.
pub mod area;
pub mod attributes;
pub mod camera;
pub mod detail;
mod direct;
pub mod direction;
pub mod dome;
pub mod film;
mod frame;
pub mod light;
mod lobe;
pub mod material;
mod occlusion;
mod order;
mod pixels;
pub(crate) mod rays;
pub mod sampler;
mod samples;
mod shadows;
pub mod shaping;
pub mod texture;
pub mod tile;
pub mod vector;
mod vertex;

use crate::lanes::InstructionSet;
use crate::ray::Trace;
use camera::{Camera, View};
use detail::Detail;
use film::Film;
use frame::{Frame, Worker};
use light::Lights;
use material::Material;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;
use tile::Tile;
use vector::Vec3;

/// How a scene looks: its light and its surfaces.
#[derive(Default)]
pub struct Appearance {
    /// All lights; where nothing shines or glows, [`Integrator::Direct`] takes
    /// [`Lights::headlight`].
    pub lights: Lights,
    /// What `Hit::material` counts.
    pub materials: Vec<Material>,
    /// What varies over surfaces, if anything does.
    pub detail: Option<Detail>,
}

impl Appearance {
    /// Whether nothing can be seen by its own light or that of others.
    fn is_dark(&self) -> bool {
        self.lights.is_dark()
            && self.materials.iter().all(|m| m.emission == Vec3::ZERO)
            && !self.detail.as_ref().is_some_and(Detail::glows)
    }
}

/// What a pixel shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Integrator {
    /// Light that reaches surfaces directly from the lights and the sky, with shadows.
    Direct,
    /// How much of the hemisphere above a surface is open up to `distance`: white is open.
    AmbientOcclusion {
        /// Farther surfaces do not occlude.
        distance: f64,
    },
    /// 0.5 + 0.5 n, n the outward geometric normal.
    Normals,
    /// A colour for each leaf.
    Ids,
}

/// What to render.
#[derive(Clone, Copy, Debug)]
pub struct Picture {
    /// Where it is seen from.
    pub camera: Camera,
    /// Columns, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
    /// Samples per pixel, at least 1.
    pub samples: u32,
    /// What a pixel shows.
    pub integrator: Integrator,
    /// Chooses the sample points.
    pub seed: u64,
    /// Threads; 0 takes one per core.
    pub threads: usize,
    /// Instructions to shade with.
    pub set: InstructionSet,
    /// Whether the film tells what is seen first.
    pub surfaces: bool,
}

/// Camera samples per pixel beyond which ambient occlusion traces several occlusion rays for each
/// instead: edges are smooth by then, occlusion is not.
const OCCLUSION_CAMERA_SAMPLES: u32 = 16;

impl Picture {
    /// Camera samples per pixel, and occlusion rays for each.
    fn samples_and_occlusion_rays(&self) -> (u32, u32) {
        match self.integrator {
            Integrator::AmbientOcclusion { .. } => {
                let rays = self.samples.div_ceil(OCCLUSION_CAMERA_SAMPLES);
                (self.samples.div_ceil(rays), rays)
            }
            _ => (self.samples, 0),
        }
    }
}

/// How often the caller hears of the progress.
const POLL: Duration = Duration::from_millis(50);

/// Renders a picture on `threads` threads while the calling one waits.
///
/// `observe(done, rays)` is called on the calling thread some 20 times a second, and at the end,
/// with the fraction done and the rays traced so far; if it returns false the render ends
/// soon and the result is None.
pub fn render(
    trace: &dyn Trace,
    appearance: &Appearance,
    picture: &Picture,
    observe: &mut dyn FnMut(f64, u64) -> bool,
) -> Option<Film> {
    let &Picture { width, height, .. } = picture;
    let headlight = (picture.integrator == Integrator::Direct && appearance.is_dark())
        .then(|| Lights::headlight(&picture.camera));
    let lights = headlight.as_ref().unwrap_or(&appearance.lights);
    let (per_pixel, _) = picture.samples_and_occlusion_rays();
    let detail = appearance.detail.as_ref();
    let materials = &appearance.materials;
    let transparent = materials.iter().any(|material| material.opacity < 1.0)
        || detail.is_some_and(Detail::is_transparent);
    let glows = (materials.iter()).any(|material| material.emission != Vec3::ZERO);
    let cancelled = AtomicBool::new(false);
    let (rays, samples) = (AtomicU64::new(0), AtomicU64::new(0));
    let frame = Frame {
        trace,
        picture,
        view: View::new(picture.camera, width, height),
        lights,
        materials,
        detail,
        transparent,
        plain: !transparent && !glows && detail.is_none(),
        views: detail.is_some() || materials.iter().any(|material| !material.is_matte()),
        draws: per_pixel > 1 || picture.integrator != Integrator::Direct || lights.draw(),
        cancelled: &cancelled,
        rays: &rays,
        samples: &samples,
    };
    let tiles = Tile::count(width, height);
    let threads = match picture.threads {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        threads => threads,
    };
    let next = AtomicUsize::new(0);
    let all_samples = f64::from(width) * f64::from(height) * f64::from(per_pixel);
    let mut film = Film::new(width as usize, height as usize, picture.surfaces);
    let bands = film.bands();
    std::thread::scope(|scope| {
        // Nothing is ever sent: that nobody is left who could tells of the end.
        let (sender, ended) = channel::<()>();
        for _ in 0..threads.min(tiles) {
            let (sender, next, frame, bands) = (sender.clone(), &next, &frame, &bands);
            scope.spawn(move || {
                let _sender = sender;
                let mut worker = Worker::default();
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    if index >= tiles {
                        break;
                    }
                    let tile = Tile::new(index, width, height);
                    if !worker.render(frame, &tile, &bands[tile.band()]) {
                        break;
                    }
                }
            });
        }
        drop(sender);
        // So it ends as well if a thread has panicked, which the scope passes on.
        while ended.recv_timeout(POLL) == Err(RecvTimeoutError::Timeout) {
            let done = samples.load(Ordering::Relaxed) as f64 / all_samples;
            if !observe(done, rays.load(Ordering::Relaxed)) {
                cancelled.store(true, Ordering::Relaxed);
                break;
            }
        }
    });
    drop(bands);
    film.rays = rays.into_inner();
    (!cancelled.into_inner() && observe(1.0, film.rays)).then_some(film)
}

#[cfg(test)]
mod tests;
