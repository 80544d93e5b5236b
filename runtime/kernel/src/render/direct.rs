//! Direct light: from suns, points and the sky, with shadows, through what is transparent.
use super::frame::Frame;
use super::samples::Samples;
use super::vector::Vec3;
use super::vertex::{Vertex, beyond};
use crate::ray::{Hit, Ray};

/// The pair of sample dimensions of directions into the hemisphere; the lights' follow.
pub const HEMISPHERE: u32 = 1;

/// Transparent surfaces that a ray passes; the last is taken as opaque.
const LAYERS: u32 = 32;

/// A camera ray on its way.
struct Path {
    slot: usize,
    /// The part of its light that reaches the camera.
    throughput: f64,
    /// Depth of the ray's origin along the viewing axis.
    depth: f64,
}

/// Light that reaches the camera unless a shadow ray is occluded.
struct Contribution {
    slot: usize,
    light: Vec3,
}

/// The memory of the integrator.
#[derive(Default)]
pub struct Direct {
    paths: Vec<Path>,
    vertices: Vec<Vertex>,
    shadow_rays: Vec<Ray>,
    contributions: Vec<Contribution>,
    occluded: Vec<bool>,
    shadow_hits: Vec<Hit>,
}

impl Direct {
    /// Lights what the samples see.
    pub fn light(&mut self, frame: &Frame, samples: &mut Samples) {
        self.paths.clear();
        self.paths.extend((0..samples.rays.len()).map(|slot| Path {
            slot,
            throughput: 1.0,
            depth: 0.0,
        }));
        for layer in 0..LAYERS {
            self.scatter(frame, samples, layer);
            self.light_vertices(frame, samples, layer);
            if self.paths.is_empty() || frame.is_cancelled() {
                return;
            }
            frame.closest(&samples.rays, &mut samples.hits);
        }
    }

    /// Finds the vertices of this layer, and leaves the paths and rays that go on behind it.
    fn scatter(&mut self, frame: &Frame, samples: &mut Samples, layer: u32) {
        self.vertices.clear();
        let mut left = 0;
        for index in 0..self.paths.len() {
            let Path {
                slot,
                throughput,
                depth,
            } = self.paths[index];
            let hit = samples.hits[index];
            if hit.instance < 0 {
                if let Some(background) = frame.lights.background {
                    samples.radiance[slot] += background * throughput;
                    samples.alpha[slot] = 1.0;
                }
                continue;
            }
            let ray = samples.rays[index];
            let material = frame.material(&hit);
            let opacity = if layer + 1 < LAYERS {
                material.opacity
            } else {
                1.0
            };
            if opacity > 0.0 {
                samples.note(slot, depth + hit.t, &hit);
                let weight = throughput * opacity;
                samples.radiance[slot] += material.emission * weight;
                samples.alpha[slot] += weight;
                self.vertices.push(Vertex::new(slot, weight, &ray, &hit));
            }
            if opacity < 1.0 {
                let throughput = throughput * (1.0 - opacity);
                self.paths[left] = Path {
                    slot,
                    throughput,
                    depth: depth + hit.t,
                };
                samples.rays[left] = beyond(&ray, &hit);
                left += 1;
            }
        }
        self.paths.truncate(left);
        samples.rays.truncate(left);
    }

    /// Adds the light that the vertices reflect: one shadow ray per vertex and light.
    fn light_vertices(&mut self, frame: &Frame, samples: &mut Samples, layer: u32) {
        let lights = frame.lights;
        let first_pair = HEMISPHERE + layer * (1 + lights.local.len() as u32);
        for (index, light) in lights.local.iter().enumerate() {
            let pair = first_pair + 1 + index as u32;
            for vertex in &self.vertices {
                let point = if light.is_soft() {
                    let (sampler, sample) = samples.sampler(vertex.slot);
                    sampler.point(sample, pair)
                } else {
                    [0.0, 0.0]
                };
                let Some(illumination) = light.illuminate(vertex.origin, point) else {
                    continue;
                };
                let material = &frame.materials[vertex.material];
                let light = material.reflect_light(vertex.normal, vertex.view, &illumination);
                if light != Vec3::ZERO {
                    let light = light * vertex.weight;
                    self.contributions.push(Contribution {
                        slot: vertex.slot,
                        light,
                    });
                    self.shadow_rays
                        .push(vertex.ray(illumination.towards, illumination.distance));
                }
            }
            self.gather(frame, samples);
        }
        if lights.sky != Vec3::ZERO {
            for vertex in &self.vertices {
                let (sampler, sample) = samples.sampler(vertex.slot);
                let point = sampler.point(sample, first_pair);
                let material = &frame.materials[vertex.material];
                let drawn = material.draw(vertex.normal, vertex.view, point);
                let Some((direction, weight)) = drawn else {
                    continue;
                };
                let light = weight * lights.sky * vertex.weight;
                self.contributions.push(Contribution {
                    slot: vertex.slot,
                    light,
                });
                self.shadow_rays.push(vertex.ray(direction, f64::INFINITY));
            }
            self.gather(frame, samples);
        }
    }

    /// Traces the shadow rays and adds what is not occluded.
    fn gather(&mut self, frame: &Frame, samples: &mut Samples) {
        if frame.transparent {
            self.gather_through(frame, samples);
        } else if !frame.is_cancelled() {
            frame.occluded(&self.shadow_rays, &mut self.occluded);
            for (contribution, &occluded) in self.contributions.iter().zip(&self.occluded) {
                if !occluded {
                    samples.radiance[contribution.slot] += contribution.light;
                }
            }
        }
        self.shadow_rays.clear();
        self.contributions.clear();
    }

    /// The same where surfaces may let a part of the light through.
    fn gather_through(&mut self, frame: &Frame, samples: &mut Samples) {
        for _ in 0..LAYERS {
            if self.shadow_rays.is_empty() || frame.is_cancelled() {
                return;
            }
            frame.closest(&self.shadow_rays, &mut self.shadow_hits);
            let mut left = 0;
            for index in 0..self.shadow_rays.len() {
                let Contribution { slot, light } = self.contributions[index];
                let hit = self.shadow_hits[index];
                if hit.instance < 0 {
                    samples.radiance[slot] += light;
                    continue;
                }
                let opacity = frame.material(&hit).opacity;
                if opacity < 1.0 {
                    let light = light * (1.0 - opacity);
                    self.contributions[left] = Contribution { slot, light };
                    self.shadow_rays[left] = beyond(&self.shadow_rays[index], &hit);
                    left += 1;
                }
            }
            self.contributions.truncate(left);
            self.shadow_rays.truncate(left);
        }
    }
}
