//! Ambient occlusion: surfaces as they would look, all white, below a white sky.
use super::direct::HEMISPHERE;
use super::direction::{Basis, cosine_hemisphere};
use super::frame::Frame;
use super::order::{Order, cell};
use super::sampler::{PixelKey, points};
use super::samples::Samples;
use super::vector::Vec3;
use super::vertex::Vertex;
use crate::lanes::{Isa, Lanes, MAX_WIDTH, Task, dispatch};
use crate::ray::Ray;
use std::ops::Range;

/// Rays that are ordered by direction and traced at once: so many that packets of them are narrow.
const RAYS: usize = 1 << 14;

/// The memory of the integrator.
#[derive(Default)]
pub struct Occlusion {
    vertices: Vec<Vertex>,
    /// Of each vertex, how many of its rays hit nothing.
    open: Vec<u32>,
    keys: Vec<PixelKey>,
    indices: Vec<u32>,
    points: Vec<[f64; 2]>,
    directions: Vec<[f64; 3]>,
    cells: Vec<u16>,
    order: Order,
    rays: Vec<Ray>,
    occluded: Vec<bool>,
}

impl Occlusion {
    /// Traces `count` rays for each sample, distributed with the cosine and `distance` long.
    /// What hits nothing sees the sky.
    #[inline(always)]
    pub fn light(&mut self, frame: &Frame, samples: &mut Samples, distance: f64, count: u32) {
        self.vertices.clear();
        for slot in 0..samples.hits.len() {
            let hit = samples.hits[slot];
            samples.alpha[slot] = 1.0;
            if hit.instance < 0 {
                samples.radiance[slot] = Vec3::ONE;
            } else {
                samples.note(slot, hit.t, &hit);
                self.vertices
                    .push(Vertex::new(slot, 1.0, &samples.rays[slot], &hit));
            }
        }
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
                self.draw(frame, samples, vertices.clone(), rays, count);
                self.trace(frame, vertices.clone(), distance);
            }
        }
        for (vertex, &open) in self.vertices.iter().zip(&self.open) {
            samples.radiance[vertex.slot] = Vec3::ONE * (f64::from(open) / f64::from(count));
        }
    }

    /// Draws directions: those rays, of `count`, of the first vertex, of the second, and so on.
    #[inline(always)]
    fn draw(
        &mut self,
        frame: &Frame,
        samples: &Samples,
        vertices: Range<usize>,
        rays: Range<u32>,
        count: u32,
    ) {
        let vertices = &self.vertices[vertices];
        self.keys.clear();
        self.indices.clear();
        for vertex in vertices {
            let (key, sample) = (samples.keys[vertex.slot], samples.indices[vertex.slot]);
            self.keys.extend(rays.clone().map(|_| key));
            self.indices
                .extend(rays.clone().map(|ray| sample * count + ray));
        }
        let set = frame.picture.set;
        points(set, &self.keys, &self.indices, HEMISPHERE, &mut self.points);
        self.directions.resize(self.points.len(), [0.0; 3]);
        self.cells.resize(self.points.len(), 0);
        dispatch(
            set,
            Draw {
                vertices,
                each: rays.len(),
                points: &self.points,
                directions: &mut self.directions,
                cells: &mut self.cells,
            },
        );
    }

    /// Traces the rays that were drawn for these vertices, and counts those that hit nothing.
    #[inline(always)]
    fn trace(&mut self, frame: &Frame, vertices: Range<usize>, distance: f64) {
        let each = self.directions.len() / vertices.len();
        let order = self.order.of(&self.cells);
        let open = &mut self.open[vertices.clone()];
        let vertices = &self.vertices[vertices];
        let directions = &self.directions;
        self.rays.clear();
        self.rays.extend(order.iter().map(|&ray| {
            let direction = directions[ray as usize].into();
            vertices[ray as usize / each].ray(direction, distance)
        }));
        frame.occluded(&self.rays, &mut self.occluded);
        for (&ray, &occluded) in order.iter().zip(&self.occluded) {
            open[ray as usize / each] += u32::from(!occluded);
        }
    }
}

/// Directions around the normals of vertices, `each` for every one, and their cells.
struct Draw<'a> {
    vertices: &'a [Vertex],
    each: usize,
    points: &'a [[f64; 2]],
    directions: &'a mut [[f64; 3]],
    cells: &'a mut [u16],
}

impl Task for Draw<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let width = I::F64::WIDTH;
        for first in (0..self.points.len()).step_by(width) {
            let len = width.min(self.points.len() - first);
            let mut columns = [[0.0; MAX_WIDTH]; 5];
            for lane in 0..len {
                let [u, v] = self.points[first + lane];
                let Vec3 { x, y, z } = self.vertices[(first + lane) / self.each].normal;
                for (column, number) in columns.iter_mut().zip([u, v, x, y, z]) {
                    column[lane] = number;
                }
            }
            let [u, v, x, y, z] = &columns;
            let normal = Vec3::new(I::F64::load(x), I::F64::load(y), I::F64::load(z));
            let local = cosine_hemisphere([I::F64::load(u), I::F64::load(v)]);
            let Vec3 { x, y, z } = Basis::new(normal).world(local);
            x.store(&mut columns[0]);
            y.store(&mut columns[1]);
            z.store(&mut columns[2]);
            for lane in 0..len {
                let [x, y, z, ..] = &columns;
                self.directions[first + lane] = [x[lane], y[lane], z[lane]];
            }
        }
        for (cell_of, &direction) in self.cells.iter_mut().zip(&*self.directions) {
            *cell_of = cell(direction);
        }
    }
}
