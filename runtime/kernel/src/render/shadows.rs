//! Light on its way to a vertex, and the shadow rays that decide whether it arrives.
use super::direct::LAYERS;
use super::frame::Frame;
use super::light::Light;
use super::material::Material;
use super::samples::Samples;
use super::vector::Vec3;
use super::vertex::{Vertex, beyond};
use crate::ray::{Hit, Ray};

/// A batch of shadow rays, and what each adds to its slot unless it is occluded.
#[derive(Default)]
pub struct Shadows {
    rays: Vec<Ray>,
    contributions: Vec<Contribution>,
    occluded: Vec<bool>,
    hits: Vec<Hit>,
}

struct Contribution {
    slot: usize,
    light: Vec3,
}

impl Shadows {
    /// Adds what `vertex`, of that material, reflects of a light at that sample point.
    #[inline(always)]
    pub fn light(&mut self, vertex: &Vertex, material: &Material, light: &Light, point: [f64; 2]) {
        if let Some(light) = light.illuminate(vertex.origin, point) {
            let reflected = material.reflect_light(vertex.normal, vertex.view, &light);
            self.push(vertex, reflected, light.towards, light.distance);
        }
    }

    /// Adds light that `vertex` reflects and that comes along `direction` from `distance` away.
    #[inline(always)]
    pub fn push(&mut self, vertex: &Vertex, light: Vec3, direction: Vec3, distance: f64) {
        if light != Vec3::ZERO {
            let light = light * vertex.weight;
            self.contributions.push(Contribution {
                slot: vertex.slot,
                light,
            });
            self.rays.push(vertex.ray(direction, distance));
        }
    }

    /// Traces the rays, adds what arrives to the samples, and empties the batch.
    #[inline(always)]
    pub fn gather(&mut self, frame: &Frame, samples: &mut Samples) {
        if frame.transparent {
            self.gather_through(frame, samples);
        } else if !frame.is_cancelled() {
            frame.occluded(&self.rays, &mut self.occluded);
            for (contribution, &occluded) in self.contributions.iter().zip(&self.occluded) {
                if !occluded {
                    samples.radiance[contribution.slot] += contribution.light;
                }
            }
        }
        self.rays.clear();
        self.contributions.clear();
    }

    /// The same where surfaces may let a part of the light through.
    fn gather_through(&mut self, frame: &Frame, samples: &mut Samples) {
        for _ in 0..LAYERS {
            if self.rays.is_empty() || frame.is_cancelled() {
                return;
            }
            frame.closest(&self.rays, &mut self.hits);
            let mut left = 0;
            for index in 0..self.rays.len() {
                let Contribution { slot, light } = self.contributions[index];
                let hit = self.hits[index];
                if hit.instance < 0 {
                    samples.radiance[slot] += light;
                    continue;
                }
                let opacity = frame.opacity(&hit);
                if opacity < 1.0 {
                    let light = light * (1.0 - opacity);
                    self.contributions[left] = Contribution { slot, light };
                    self.rays[left] = beyond(&self.rays[index], &hit);
                    left += 1;
                }
            }
            self.contributions.truncate(left);
            self.rays.truncate(left);
        }
    }
}
