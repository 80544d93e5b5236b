//! Direct light: from suns, points, surfaces and the sky, with shadows, through what is transparent.
use super::frame::Frame;
use super::material::Material;
use super::samples::Samples;
use super::shadows::Shadows;
use super::vector::Vec3;
use super::vertex::{Draws, Vertex, beyond};

/// The pair of sample dimensions of directions into the hemisphere; the lights' follow.
pub const HEMISPHERE: u32 = 1;

/// Transparent surfaces that a ray passes; the last is taken as opaque.
pub const LAYERS: u32 = 32;

/// A camera ray on its way.
struct Path {
    slot: usize,
    /// The part of its light that reaches the camera.
    throughput: f64,
    /// Depth of the ray's origin along the viewing axis.
    depth: f64,
}

/// The memory of the integrator.
#[derive(Default)]
pub struct Direct {
    paths: Vec<Path>,
    vertices: Vec<Vertex>,
    /// Materials of the vertices that have one of their own.
    varied: Vec<Material>,
    draws: Draws,
    shadows: Shadows,
}

impl Direct {
    /// Lights what the samples see.
    #[inline(always)]
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
    #[inline(always)]
    fn scatter(&mut self, frame: &Frame, samples: &mut Samples, layer: u32) {
        self.vertices.clear();
        self.varied.clear();
        let mut left = 0;
        for index in 0..self.paths.len() {
            let Path {
                slot,
                throughput,
                depth,
            } = self.paths[index];
            if samples.hits[index].instance < 0 {
                if let Some(background) = frame.lights.background {
                    samples.radiance[slot] += background * throughput;
                    samples.alpha[slot] = 1.0;
                }
                continue;
            }
            let (ray, hit) = (samples.rays[index], samples.hits[index]);
            let constant = frame.material(&hit);
            let shading = frame
                .detail
                .and_then(|detail| detail.shading(frame.trace, &hit, constant));
            let material = shading.as_ref().map_or(constant, |own| &own.material);
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
                let mut vertex = Vertex::new(slot, weight, &ray, &hit);
                if let Some(own) = &shading {
                    vertex.material = frame.materials.len() + self.varied.len();
                    self.varied.push(own.material);
                    own.normal.into_iter().for_each(|n| vertex.shade_with(n));
                }
                self.vertices.push(vertex);
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
    #[inline(always)]
    fn light_vertices(&mut self, frame: &Frame, samples: &mut Samples, layer: u32) {
        let lights = frame.lights;
        let first_pair = HEMISPHERE + layer * (1 + lights.local.len() as u32);
        for (index, light) in lights.local.iter().enumerate() {
            let pair = first_pair + 1 + index as u32;
            if light.is_soft() {
                let points = self
                    .draws
                    .points(frame, samples, &self.vertices, pair, |n| n);
                for (vertex, &point) in self.vertices.iter().zip(points) {
                    let material = vertex.material(frame.materials, &self.varied);
                    self.shadows.light(vertex, material, light, point);
                }
            } else {
                for vertex in &self.vertices {
                    let material = vertex.material(frame.materials, &self.varied);
                    self.shadows.light(vertex, material, light, [0.0, 0.0]);
                }
            }
            self.shadows.gather(frame, samples);
        }
        if lights.sky != Vec3::ZERO {
            let points = self
                .draws
                .points(frame, samples, &self.vertices, first_pair, |n| n);
            for (vertex, &point) in self.vertices.iter().zip(points) {
                let material = vertex.material(frame.materials, &self.varied);
                let drawn = material.draw(vertex.normal, vertex.view, point);
                if let Some((direction, weight)) = drawn {
                    self.shadows
                        .push(vertex, weight * lights.sky, direction, f64::INFINITY);
                }
            }
            self.shadows.gather(frame, samples);
        }
    }
}
