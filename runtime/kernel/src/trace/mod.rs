//! Batches of rays through a scene.
//!
//! Consecutive rays that point and start alike go as packets of W, until few of them are left
//! together; others meet what is large together, then go one at a time. Either way each ray sees
//! the same arithmetic from f64 on, ties go to the lowest leaf, and boxes are conservative: so
//! answers do not depend on the batch, the instruction set or the order.
mod best;
mod bundle;
mod columns;
mod entries;
mod frustum;
mod level;
mod mesh_ray;
mod on_triangle;
mod packet;
mod parting;
mod precision;
mod roots;
mod single;
mod singles;
mod stack;
mod surface;
#[cfg(test)]
mod tests;
mod tree_rays;

pub use precision::Precision;

use self::columns::RayColumns;
use self::packet::Packet;
use self::singles::Singles;
use self::surface::Surfaces;
use crate::lanes::{Isa, Lanes, MAX_WIDTH, Mask, Task, dispatch, halves, take_bit};
use crate::ray::{Find, Found, FoundColumns, Hit, Hits, OnTriangle, Rays, Trace};
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
    fn found(&self, t_min: f64) -> Found {
        if self.leaf < 0 {
            return Found::NOTHING;
        }
        Found {
            t: self.t.max(t_min.next_up()),
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
struct Batch<'s, F: Precision, A> {
    scene: &'s Scene<F>,
    rays: Rays<'s>,
    bundling: Bundling,
    answers: A,
}

impl<F: Precision, A: Answers> Task for Batch<'_, F, A> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(mut self) {
        let width = Packet::<I, F>::WIDTH;
        let mut packet = Packet::<I, F>::new(self.scene);
        let mut singles = Singles::<I, F>::new(self.scene);
        let space = self.scene.groups[0].tree.space;
        for first in (0..self.rays.len()).step_by(width) {
            let lanes = RayColumns::<I>::new(self.rays, first);
            let bundled = match self.bundling {
                Bundling::Coherent => lanes.len > 2 && lanes.are_coherent(&space),
                #[cfg(test)]
                Bundling::Never => false,
                #[cfg(test)]
                Bundling::Always => lanes.valid().all(),
            };
            if bundled {
                if A::ANY {
                    packet.trace::<true>(&lanes, &mut singles);
                } else {
                    packet.trace::<false>(&lanes, &mut singles);
                }
                self.answers.set_packet(first, &lanes, &packet);
                continue;
            }
            singles.roots.take(&lanes, &self.scene.groups[0]);
            let has_begun = if A::ANY {
                packet.begin::<true>(&lanes, &mut singles)
            } else {
                packet.begin::<false>(&lanes, &mut singles)
            };
            self.answers.set_packet(first, &lanes, &packet);
            let waiting = singles.roots.waiting() & packet.alive.bits();
            let mut left = waiting;
            while let Some(lane) = take_bit(&mut left) {
                let nearest = if has_begun {
                    packet.best.get(lane)
                } else {
                    Nearest::none(singles.roots.interval(lane)[1])
                };
                if A::ANY {
                    singles.start::<true>(lane, nearest);
                } else {
                    singles.start::<false>(lane, nearest);
                }
            }
            if A::ANY {
                singles.finish::<true>();
            } else {
                singles.finish::<false>();
            }
            let mut left = waiting;
            while let Some(lane) = take_bit(&mut left) {
                let t_min = self.rays.t_min(first + lane);
                self.answers.set(first + lane, t_min, singles.found[lane]);
            }
        }
    }
}

/// Takes what traversal found.
trait Answers {
    /// Whether any hit does.
    const ANY: bool;

    /// For ray number `i`, which looks for hits beyond `t_min`.
    fn set(&mut self, i: usize, t_min: f64, nearest: Nearest);

    /// For the rays from number `first` on.
    fn set_packet<I: Isa, F: Precision>(
        &mut self,
        first: usize,
        rays: &RayColumns<I>,
        packet: &Packet<I, F>,
    );
}

/// Closest hits.
impl Answers for FoundColumns<'_> {
    const ANY: bool = false;

    #[inline(always)]
    fn set(&mut self, i: usize, t_min: f64, nearest: Nearest) {
        let found = nearest.found(t_min);
        self.t[i] = found.t;
        self.instance[i] = found.instance;
        self.primitive[i] = found.primitive;
    }

    #[inline(always)]
    fn set_packet<I: Isa, F: Precision>(
        &mut self,
        first: usize,
        rays: &RayColumns<I>,
        packet: &Packet<I, F>,
    ) {
        let best = &packet.best;
        let mut numbers = [[0.0; MAX_WIDTH]; 4];
        for h in 0..2 {
            let half = h * I::F64::WIDTH;
            let missed = best.leaf[h].lt(I::F64::zero());
            let t = I::F64::select(missed, I::F64::splat(f64::INFINITY), best.t[h]);
            t.store(&mut numbers[0][half..]);
            best.leaf[h].store(&mut numbers[1][half..]);
            best.triangle[h].store(&mut numbers[2][half..]);
            rays.t_min[h].store(&mut numbers[3][half..]);
        }
        let [t, leaf, triangle, t_min] = &numbers;
        let range = first..first + rays.len;
        self.t[range.clone()].copy_from_slice(&t[..rays.len]);
        for (to, &leaf) in self.instance[range.clone()].iter_mut().zip(leaf) {
            *to = integer(leaf);
        }
        for (to, &triangle) in self.primitive[range.clone()].iter_mut().zip(triangle) {
            *to = integer(triangle) as u32;
        }
        // Rounding may have brought t to t_min, beyond which it is.
        let [low, high] = halves!(|h| best.t[h].le(rays.t_min[h]));
        if (low | high).any() {
            for (t, &t_min) in self.t[range].iter_mut().zip(t_min) {
                *t = t.max(t_min.next_up());
            }
        }
    }
}

/// A whole number below 2⁵¹, by its bits: a cast would ask first whether it is one.
#[inline(always)]
fn integer(x: f64) -> i64 {
    const SHIFT: f64 = (3u64 << 51) as f64;
    (x + SHIFT).to_bits() as i64 - SHIFT.to_bits() as i64
}

/// Whether anything was found.
impl Answers for &mut [bool] {
    const ANY: bool = true;

    #[inline(always)]
    fn set(&mut self, i: usize, _: f64, nearest: Nearest) {
        self[i] = nearest.leaf >= 0;
    }

    #[inline(always)]
    fn set_packet<I: Isa, F: Precision>(
        &mut self,
        first: usize,
        rays: &RayColumns<I>,
        packet: &Packet<I, F>,
    ) {
        let alive = packet.alive.bits();
        for (i, occluded) in self[first..first + rays.len].iter_mut().enumerate() {
            *occluded = alive >> i & 1 == 0;
        }
    }
}

impl<F: Precision> Scene<F> {
    fn batch(&self, rays: Rays, bundling: Bundling, answers: impl Answers) {
        let batch = Batch {
            scene: self,
            rays,
            bundling,
            answers,
        };
        dispatch(self.set, batch);
    }
}

impl<F: Precision> Trace for Scene<F> {
    fn closest(&self, rays: Rays, hits: &mut Hits) {
        let n = rays.len();
        hits.resize(n);
        let found = FoundColumns {
            t: &mut hits.t[..n],
            instance: &mut hits.instance[..n],
            primitive: &mut hits.primitive[..n],
        };
        self.find(rays, found);
        self.surfaces(rays, hits);
    }

    fn occluded(&self, rays: Rays, occluded: &mut [bool]) {
        self.find_any(rays, occluded);
    }

    fn is_left_for_good(&self, hits: &Hits, i: usize, outwards: bool) -> bool {
        let prototype = usize::try_from(hits.prototype[i]).ok();
        let prototype = prototype.and_then(|number| self.prototypes.get(number));
        prototype.is_some_and(|of| of.is_left_for_good(hits.primitive[i], outwards))
    }

    fn on_triangle(&self, hit: &Hit) -> Option<OnTriangle> {
        self.triangle_of(hit)
    }
}

impl<F: Precision> Find for Scene<F> {
    fn find(&self, rays: Rays, found: FoundColumns) {
        let n = rays.len();
        assert!(found.t.len() == n && found.instance.len() == n && found.primitive.len() == n);
        self.batch(rays, Bundling::Coherent, found);
    }

    fn find_any(&self, rays: Rays, occluded: &mut [bool]) {
        assert_eq!(rays.len(), occluded.len());
        self.batch(rays, Bundling::Coherent, occluded);
    }

    fn surfaces(&self, rays: Rays, hits: &mut Hits) {
        assert_eq!(rays.len(), hits.len());
        let scene = self;
        dispatch(self.set, Surfaces { scene, rays, hits });
    }
}
