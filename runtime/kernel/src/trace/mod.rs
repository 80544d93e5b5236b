//! Batches of rays through a scene.
//!
//! Consecutive rays that point and start alike go as packets of W, others one at a time. Either
//! way each ray sees the same arithmetic from f64 on, ties go to the lowest leaf, and boxes are
//! conservative: so answers do not depend on the batch, the instruction set or the order.
mod columns;
mod frustum;
mod level;
mod packet;
mod precision;
mod single;
mod surface;
#[cfg(test)]
mod tests;

pub use precision::Precision;

use self::columns::RayColumns;
use self::packet::Packet;
use self::single::Single;
use crate::instance::LevelRays;
use crate::lanes::{Isa, Task, dispatch};
use crate::ray::{Find, Found, Hit, Ray, Trace};
use crate::scene::Scene;

/// What traversal finds.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Nearest {
    /// World ray parameter, or the ray's t_max.
    t: f64,
    /// Leaf number, or −1.
    leaf: i64,
    /// Triangle of a mesh.
    triangle: u32,
}

impl Nearest {
    fn none(t_max: f64) -> Nearest {
        Nearest {
            t: t_max,
            leaf: -1,
            triangle: 0,
        }
    }

    /// What a user is told: t, which rounding may have brought to t_min, is beyond that.
    #[inline(always)]
    fn found(&self, ray: &Ray) -> Found {
        if self.leaf < 0 {
            return Found::NOTHING;
        }
        Found {
            t: self.t.max(ray.t_min.next_up()),
            instance: self.leaf,
            primitive: self.triangle,
        }
    }

    /// Takes a hit if it is nearer, or as near and of a lower leaf or triangle.
    #[inline(always)]
    fn offer(&mut self, t: f64, leaf: i64, triangle: u32) -> bool {
        let lower = (leaf, triangle) < (self.leaf, self.triangle);
        let taken = t < self.t || (t == self.t && lower);
        if taken {
            *self = Nearest { t, leaf, triangle };
        }
        taken
    }
}

/// Whether a ray can hit anything at all.
#[inline(always)]
fn is_valid(ray: &Ray) -> bool {
    let finite = |v: &[f64; 3]| v.iter().all(|x| x.is_finite());
    finite(&ray.origin)
        && finite(&ray.direction)
        && ray.direction.iter().any(|&x| x != 0.0)
        && ray.t_min < ray.t_max
}

/// Which rays go as packets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Bundling {
    /// Those that are coherent.
    Coherent,
    /// None.
    #[cfg(test)]
    Never,
    /// All valid ones.
    #[cfg(test)]
    Always,
}

/// A batch, and where the answers go.
struct Batch<'s, F: Precision, A, const ANY: bool> {
    scene: &'s Scene<F>,
    rays: &'s [Ray],
    bundling: Bundling,
    answers: A,
}

impl<F: Precision, A: Answers<F>, const ANY: bool> Task for Batch<'_, F, A, ANY> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(mut self) {
        let width = Packet::<I, F>::WIDTH;
        let mut packet = Packet::<I, F>::new(self.scene);
        let mut single = Single::<I, F>::new(self.scene);
        let mut nearest = [Nearest::none(0.0); crate::lanes::MAX_WIDTH];
        let space = self.scene.groups[0].tree.space;
        for (chunk, rays) in self.rays.chunks(width).enumerate() {
            let lanes = RayColumns::<I>::new(rays);
            let bundled = match self.bundling {
                Bundling::Coherent => rays.len() > 2 && lanes.are_coherent(&space),
                #[cfg(test)]
                Bundling::Never => false,
                #[cfg(test)]
                Bundling::Always => lanes.are_valid(),
            };
            let nearest = &mut nearest[..rays.len()];
            if bundled {
                packet.trace::<ANY>(&lanes, nearest);
            } else {
                for (ray, nearest) in rays.iter().zip(nearest.iter_mut()) {
                    *nearest = if is_valid(ray) {
                        single.trace::<ANY>(ray)
                    } else {
                        Nearest::none(ray.t_max)
                    };
                }
            }
            for (i, &nearest) in nearest.iter().enumerate() {
                self.answers
                    .set(self.scene, chunk * width + i, &rays[i], nearest);
            }
        }
    }
}

/// Takes what traversal found for each ray.
trait Answers<F: Precision> {
    fn set(&mut self, scene: &Scene<F>, i: usize, ray: &Ray, nearest: Nearest);
}

/// Closest hits.
impl<F: Precision> Answers<F> for &mut [Found] {
    #[inline(always)]
    fn set(&mut self, _: &Scene<F>, i: usize, ray: &Ray, nearest: Nearest) {
        self[i] = nearest.found(ray);
    }
}

/// Closest hits and the surfaces there.
struct Surfaces<'h> {
    hits: &'h mut [Hit],
    path: Vec<usize>,
}

impl<F: Precision> Answers<F> for Surfaces<'_> {
    #[inline(always)]
    fn set(&mut self, scene: &Scene<F>, i: usize, ray: &Ray, nearest: Nearest) {
        self.hits[i] = scene.surface(ray, &nearest.found(ray), &mut self.path);
    }
}

/// Whether anything was found.
impl<F: Precision> Answers<F> for &mut [bool] {
    #[inline(always)]
    fn set(&mut self, _: &Scene<F>, i: usize, _: &Ray, nearest: Nearest) {
        self[i] = nearest.leaf >= 0;
    }
}

/// Surfaces of hits that were found before.
struct SurfacesOf<'a, F: Precision> {
    scene: &'a Scene<F>,
    rays: &'a [Ray],
    found: &'a [Found],
    hits: &'a mut [Hit],
}

impl<F: Precision> Task for SurfacesOf<'_, F> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let mut path = Vec::new();
        for i in 0..self.hits.len() {
            self.hits[i] = self.scene.surface(&self.rays[i], &self.found[i], &mut path);
        }
    }
}

impl<F: Precision> Scene<F> {
    fn batch<const ANY: bool>(&self, rays: &[Ray], bundling: Bundling, answers: impl Answers<F>) {
        let batch = Batch::<_, _, ANY> {
            scene: self,
            rays,
            bundling,
            answers,
        };
        dispatch(self.set, batch);
    }
}

impl<F: Precision> Trace for Scene<F> {
    fn closest(&self, rays: &[Ray], hits: &mut [Hit]) {
        assert_eq!(rays.len(), hits.len());
        let path = Vec::new();
        self.batch::<false>(rays, Bundling::Coherent, Surfaces { hits, path });
    }

    fn occluded(&self, rays: &[Ray], occluded: &mut [bool]) {
        assert_eq!(rays.len(), occluded.len());
        self.batch::<true>(rays, Bundling::Coherent, occluded);
    }
}

impl<F: Precision> Find for Scene<F> {
    fn find(&self, rays: &[Ray], found: &mut [Found]) {
        assert_eq!(rays.len(), found.len());
        self.batch::<false>(rays, Bundling::Coherent, found);
    }

    fn surfaces(&self, rays: &[Ray], found: &[Found], hits: &mut [Hit]) {
        assert!(rays.len() == found.len() && rays.len() == hits.len());
        let scene = self;
        dispatch(
            self.set,
            SurfacesOf {
                scene,
                rays,
                found,
                hits,
            },
        );
    }
}

impl LevelRays<f64> {
    /// A ray in the world.
    #[inline(always)]
    fn from_ray(ray: &Ray) -> LevelRays<f64> {
        LevelRays {
            origin: ray.origin,
            direction: ray.direction,
            start: 0.0,
            rate: 1.0,
            per_rate: 1.0,
        }
        .with_unit_direction()
    }
}
