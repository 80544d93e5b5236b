//! Ambient occlusion: surfaces as they would look, all white, below a white sky.
use super::direct::HEMISPHERE;
use super::direction::{Basis, cosine_hemisphere};
use super::frame::Frame;
use super::order::{Order, cell};
use super::rays::{RayLists, make_room};
use super::sampler::{PixelKey, points};
use super::samples::Samples;
use super::vector::Vec3;
use super::vertex::Vertices;
use crate::lanes::{Isa, Lanes, MAX_WIDTH};
use std::ops::Range;

/// Rays that are ordered by direction and traced at once: so many that packets of them are narrow.
const RAYS: usize = 1 << 14;

/// The memory of the integrator.
#[derive(Default)]
pub struct Occlusion {
    vertices: Vertices,
    /// Of each vertex, how many of its rays hit nothing.
    open: Vec<u32>,
    keys: Vec<PixelKey>,
    indices: Vec<u32>,
    points: [Vec<f64>; 2],
    directions: [Vec<f64>; 3],
    cells: Vec<u16>,
    order: Order,
    /// The vertex of each ray, counted from the first of the batch.
    owners: Vec<u32>,
    rays: RayLists,
    /// Of each vertex, the leaf that its rays leave for good.
    left: Vec<f64>,
    occluded: Vec<bool>,
}

impl Occlusion {
    /// Traces `count` rays for each sample, distributed with the cosine and `distance` long.
    /// What hits nothing sees the sky.
    #[inline(always)]
    pub fn light<I: Isa>(
        &mut self,
        frame: &Frame,
        samples: &mut Samples,
        distance: f64,
        count: u32,
    ) {
        self.vertices.clear();
        for slot in 0..samples.hits.len() {
            samples.alpha[slot] = 1.0;
            if samples.hits.instance[slot] < 0 {
                samples.add(slot, Vec3::ONE);
            } else {
                samples.note(frame, slot, samples.hits.t[slot], slot);
                self.vertices.push(slot, slot, 0, 1.0);
            }
        }
        self.vertices
            .place::<I>(&samples.rays, &samples.hits, false);
        self.vertices
            .left_for_good(frame, &samples.hits, &mut self.left);
        self.open.clear();
        self.open.resize(self.vertices.len(), 0);
        let at_once = (RAYS / count as usize).max(1);
        for first in (0..self.vertices.len()).step_by(at_once) {
            let vertices = first..self.vertices.len().min(first + at_once);
            for index in (0..count).step_by(RAYS) {
                if frame.is_cancelled() {
                    return;
                }
                let rays = index..count.min(index + RAYS as u32);
                self.draw::<I>(frame, samples, vertices.clone(), rays, count);
                self.trace(frame, vertices.clone(), distance);
            }
        }
        for (&slot, &open) in self.vertices.slots.iter().zip(&self.open) {
            let open = f64::from(open) / f64::from(count);
            samples.add(slot as usize, Vec3::ONE * open);
        }
    }

    /// Draws directions: those rays, of `count`, of the first vertex, of the second, and so on.
    #[inline(always)]
    fn draw<I: Isa>(
        &mut self,
        frame: &Frame,
        samples: &Samples,
        vertices: Range<usize>,
        rays: Range<u32>,
        count: u32,
    ) {
        // Loops over slices are compiled for the set, closures that fill vectors are not.
        let drawn = vertices.len() * rays.len();
        self.keys.resize(drawn, PixelKey::seed(0));
        self.indices.resize(drawn, 0);
        let slots = &self.vertices.slots[vertices.clone()];
        let of_vertices = (self.keys.chunks_exact_mut(rays.len()))
            .zip(self.indices.chunks_exact_mut(rays.len()))
            .zip(slots);
        for ((keys, indices), &slot) in of_vertices {
            keys.fill(samples.keys[slot as usize]);
            let sample = samples.indices[slot as usize];
            for (index, ray) in indices.iter_mut().zip(rays.clone()) {
                *index = sample * count + ray;
            }
        }
        let set = frame.picture.set;
        points(set, &self.keys, &self.indices, HEMISPHERE, &mut self.points);
        make_room(&mut self.directions, drawn);
        let [u, v] = &self.points;
        let (mut vertex, mut ray) = (vertices.start, 0);
        for first in (0..drawn).step_by(I::F64::WIDTH) {
            let mut normals = [[0.0; MAX_WIDTH]; 3];
            let [x, y, z] = &mut normals;
            let lanes = x.iter_mut().zip(y).zip(z).take(drawn - first);
            for ((x, y), z) in lanes.take(I::F64::WIDTH) {
                [*x, *y, *z] = Vec3::load(&self.vertices.normal, vertex).to_array();
                ray += 1;
                if ray == rays.len() {
                    (vertex, ray) = (vertex + 1, 0);
                }
            }
            let [x, y, z] = &normals;
            let normal = Vec3::new(I::F64::load(x), I::F64::load(y), I::F64::load(z));
            let local = cosine_hemisphere([I::F64::load(&u[first..]), I::F64::load(&v[first..])]);
            let direction = Basis::new(normal).world(local);
            direction.store(&mut self.directions, first);
        }
        self.cells.resize(drawn, 0);
        let [x, y, z] = &self.directions;
        let directions = x.iter().zip(y).zip(z);
        for (to, ((&x, &y), &z)) in self.cells.iter_mut().zip(directions) {
            *to = cell([x, y, z]);
        }
    }

    /// Traces the rays that were drawn for these vertices, and counts those that hit nothing.
    #[inline(always)]
    fn trace(&mut self, frame: &Frame, vertices: Range<usize>, distance: f64) {
        let each = (self.cells.len() / vertices.len()) as u32;
        let order = self.order.of(&self.cells);
        self.rays.resize(order.len());
        self.rays.t_min.fill(0.0);
        self.rays.t_max.fill(distance);
        self.owners.resize(order.len(), 0);
        for (owner, &ray) in self.owners.iter_mut().zip(order) {
            *owner = ray / each;
        }
        self.rays.left.resize(order.len() + MAX_WIDTH, -1.0);
        let left = &self.left[vertices.clone()];
        for (to, &owner) in self.rays.left.iter_mut().zip(&self.owners) {
            *to = left[owner as usize];
        }
        for axis in 0..3 {
            let origins = &self.vertices.origin[axis][vertices.clone()];
            for (origin, &owner) in self.rays.origin[axis].iter_mut().zip(&self.owners) {
                *origin = origins[owner as usize];
            }
            let directions = &self.directions[axis];
            for (direction, &ray) in self.rays.direction[axis].iter_mut().zip(order) {
                *direction = directions[ray as usize];
            }
        }
        frame.occluded(&self.rays, &mut self.occluded);
        let open = &mut self.open[vertices];
        for (&owner, &occluded) in self.owners.iter().zip(&self.occluded) {
            open[owner as usize] += u32::from(!occluded);
        }
    }
}
