//! Points on surfaces that camera rays see.
use super::frame::Frame;
use super::rays::{RayLists, make_room};
use super::sampler::{PixelKey, points};
use super::samples::Samples;
use super::vector::Vec3;
use crate::lanes::{Isa, Lanes, MAX_WIDTH, take_bit};
use crate::ray::{Hit, Hits, Ray};

/// Where secondary rays start, and what shading needs to know, an array for each number.
///
/// First vertices are pushed, then [`placed`](Vertices::place) all at once. The side that faces the
/// ray is shaded.
#[derive(Default)]
pub struct Vertices {
    /// The slot that sees each.
    pub slots: Vec<u32>,
    /// Index of each one's material: of those of the scene, or beyond them of those that are one
    /// vertex's own.
    pub materials: Vec<u32>,
    /// The part of its light that reaches the camera.
    pub weights: Vec<f64>,
    /// The number of its ray and hit.
    hits: Vec<u32>,
    /// The point, offset to the side that is seen.
    pub origin: [Vec<f64>; 3],
    /// Unit normal to shade with, on that side.
    pub normal: [Vec<f64>; 3],
    /// Unit vector towards the camera, if it is wanted.
    pub view: [Vec<f64>; 3],
}

/// Numbers of a column at W places: those from the first on, or gathered.
#[inline(always)]
fn gather<L: Lanes<Scalar = f64>>(column: &[f64], places: &[u32]) -> L {
    let first = places[0] as usize;
    let last = places[places.len() - 1] as usize;
    if places.len() == L::WIDTH && last - first == L::WIDTH - 1 {
        return L::load(&column[first..]);
    }
    let mut numbers = [0.0; MAX_WIDTH];
    for (number, &place) in numbers.iter_mut().zip(places) {
        *number = column[place as usize];
    }
    L::load(&numbers)
}

/// The same of three columns.
#[inline(always)]
fn gather_vector<L: Lanes<Scalar = f64>>([x, y, z]: &[Vec<f64>; 3], places: &[u32]) -> Vec3<L> {
    Vec3::new(gather(x, places), gather(y, places), gather(z, places))
}

impl Vertices {
    /// How many there are.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.slots.len()
    }

    /// Forgets all.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.slots.clear();
        self.materials.clear();
        self.weights.clear();
        self.hits.clear();
    }

    /// Their material, if all have the same.
    #[inline(always)]
    pub fn only_material(&self) -> Option<u32> {
        let (&first, others) = self.materials[..self.len()].split_first()?;
        let mut different = 0;
        for &other in others {
            different |= first ^ other;
        }
        (different == 0).then_some(first)
    }

    /// Makes them those of all hits, each seen whole by the slot of the same number.
    #[inline(always)]
    pub fn take(&mut self, hits: &Hits) {
        self.clear();
        for first in (0..hits.len()).step_by(MAX_WIDTH) {
            let some = MAX_WIDTH.min(hits.len() - first);
            let mut hit = 0;
            for (lane, &instance) in hits.instance[first..][..MAX_WIDTH].iter().enumerate() {
                hit |= u32::from(instance >= 0) << lane;
            }
            hit &= (1 << some) - 1;
            // Nearly all are of the one or the other kind.
            if hit == (1 << MAX_WIDTH) - 1 {
                let (mut materials, mut numbers) = ([0; MAX_WIDTH], [0; MAX_WIDTH]);
                for lane in 0..MAX_WIDTH {
                    materials[lane] = hits.material[first + lane] as u32;
                    numbers[lane] = (first + lane) as u32;
                }
                self.materials.extend_from_slice(&materials);
                self.hits.extend_from_slice(&numbers);
                continue;
            }
            while let Some(lane) = take_bit(&mut hit) {
                self.materials.push(hits.material[first + lane] as u32);
                self.hits.push((first + lane) as u32);
            }
        }
        self.slots.extend_from_slice(&self.hits);
        self.weights.resize(self.hits.len(), 1.0);
    }

    /// Adds a vertex of a slot where ray number `hit` hits, later than those before.
    #[inline(always)]
    pub fn push(&mut self, slot: usize, hit: usize, material: usize, weight: f64) {
        self.slots.push(slot as u32);
        self.materials.push(material as u32);
        self.weights.push(weight);
        self.hits.push(hit as u32);
    }

    /// Finds points and normals where these rays hit, and views if these are wanted.
    #[inline(always)]
    pub fn place<I: Isa>(&mut self, rays: &RayLists, hits: &Hits, views: bool) {
        let (len, width) = (self.len(), I::F64::WIDTH);
        make_room(&mut self.origin, len);
        make_room(&mut self.normal, len);
        make_room(&mut self.view, len);
        self.weights.resize(len + MAX_WIDTH, 0.0);
        self.materials.resize(len + MAX_WIDTH, 0);
        for first in (0..len).step_by(width) {
            let places = &self.hits[first..len.min(first + width)];
            let direction: Vec3<I::F64> = gather_vector(&rays.direction, places);
            let outward: Vec3<I::F64> = gather_vector(&hits.normal, places);
            let position: Vec3<I::F64> = gather_vector(&hits.position, places);
            let offset: I::F64 = gather(&hits.offset, places);
            let behind = outward.dot(direction).gt(I::F64::zero());
            let normal = Vec3::select(behind, -outward, outward);
            (position + normal * offset).store(&mut self.origin, first);
            normal.store(&mut self.normal, first);
            if views {
                (-direction.normalized()).store(&mut self.view, first);
            }
        }
    }

    /// Of each vertex the leaf that no ray from the side that is seen meets again, or −1.
    #[inline(always)]
    pub fn left_for_good(&self, frame: &Frame, hits: &Hits, left: &mut Vec<f64>) {
        left.resize(self.len(), -1.0);
        for (i, (left, &hit)) in left.iter_mut().zip(&self.hits).enumerate() {
            let hit = hit as usize;
            let outward: Vec3 = Vec3::load(&hits.normal, hit);
            let outwards = outward.dot(Vec3::load(&self.normal, i)) > 0.0;
            let is_left = frame.trace.is_left_for_good(hits, hit, outwards);
            *left = if is_left {
                hits.instance[hit] as f64
            } else {
                -1.0
            };
        }
    }

    /// Shades vertex number `i` with another outward normal; the side that is seen stays that of
    /// the geometric one.
    pub fn shade_with(&mut self, i: usize, outward: Vec3) {
        let normal: Vec3 = Vec3::load(&self.normal, i);
        let seen = Vec3::select(outward.dot(normal) < 0.0, -outward, outward);
        seen.store(&mut self.normal, i);
    }
}

/// The memory to draw sample points for vertices.
#[derive(Default)]
pub struct Draws {
    keys: Vec<PixelKey>,
    indices: Vec<u32>,
    points: [Vec<f64>; 2],
}

impl Draws {
    /// For each vertex the point of a pair of dimensions that is its sample's, by column.
    pub fn points(
        &mut self,
        frame: &Frame,
        samples: &Samples,
        vertices: &Vertices,
        pair: u32,
    ) -> &[Vec<f64>; 2] {
        self.keys.clear();
        self.indices.clear();
        for &slot in &vertices.slots {
            self.keys.push(samples.keys[slot as usize]);
            self.indices.push(samples.indices[slot as usize]);
        }
        points(
            frame.picture.set,
            &self.keys,
            &self.indices,
            pair,
            &mut self.points,
        );
        &self.points
    }
}

/// The rest of `ray` behind the surface it hits.
#[inline(always)]
pub fn beyond(ray: &Ray, hit: &Hit) -> Ray {
    Ray {
        origin: hit.spawn(ray.direction),
        direction: ray.direction,
        t_min: 0.0,
        t_max: ray.t_max - hit.t,
    }
}
