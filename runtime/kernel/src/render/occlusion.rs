//! Ambient occlusion: surfaces as they would look, all white, below a white sky.
use super::direct::HEMISPHERE;
use super::direction::{Basis, cosine_hemisphere};
use super::frame::Frame;
use super::samples::Samples;
use super::vector::Vec3;
use super::vertex::{Draws, Vertex};
use crate::ray::Ray;

/// The memory of the integrator.
#[derive(Default)]
pub struct Occlusion {
    vertices: Vec<Vertex>,
    draws: Draws,
    rays: Vec<Ray>,
    occluded: Vec<bool>,
}

impl Occlusion {
    /// Traces `count` rays for each sample, distributed with the cosine and `distance` long.
    /// What hits nothing sees the sky.
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
        let share = Vec3::ONE * (1.0 / f64::from(count));
        for index in 0..count {
            if frame.is_cancelled() {
                return;
            }
            let points = self
                .draws
                .points(frame, samples, &self.vertices, HEMISPHERE, |sample| {
                    sample * count + index
                });
            self.rays.clear();
            self.rays
                .extend(self.vertices.iter().zip(points).map(|(vertex, &point)| {
                    let direction = Basis::new(vertex.normal).world(cosine_hemisphere(point));
                    vertex.ray(direction, distance)
                }));
            frame.occluded(&self.rays, &mut self.occluded);
            for (vertex, &occluded) in self.vertices.iter().zip(&self.occluded) {
                if !occluded {
                    samples.radiance[vertex.slot] += share;
                }
            }
        }
    }
}
