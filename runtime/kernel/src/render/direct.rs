//! Direct light: from suns, points, surfaces and the sky, with shadows, through what is transparent.
use super::frame::Frame;
use super::material::{Material, Materials};
use super::rays::RayLists;
use super::samples::Samples;
use super::shadows::Shadows;
use super::vector::Vec3;
use super::vertex::{Draws, Vertices, beyond};
use crate::lanes::Isa;

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

/// Adds what a slot sees where its ray, of that number, hits nothing.
#[inline(always)]
fn show_background(frame: &Frame, samples: &mut Samples, ray: usize, slot: usize, throughput: f64) {
    let direction = || Vec3::load(&samples.rays.direction, ray);
    if let Some(background) = frame.lights.behind_all(direction) {
        samples.add(slot, background * throughput);
        samples.alpha[slot] = 1.0;
    }
}

/// The memory of the integrator.
#[derive(Default)]
pub struct Direct {
    /// Of the rays after the first layer.
    paths: Vec<Path>,
    /// The rays that go on behind what they hit, and their paths.
    behind: RayLists,
    paths_behind: Vec<Path>,
    vertices: Vertices,
    /// Materials of the vertices that have one of their own.
    varied: Vec<Material>,
    /// Shading normals, and whose they are.
    normals: Vec<(usize, Vec3)>,
    draws: Draws,
    shadows: Shadows,
}

impl Direct {
    /// Lights what the samples see.
    #[inline(always)]
    pub fn light<I: Isa>(&mut self, frame: &Frame, samples: &mut Samples) {
        for layer in 0..LAYERS {
            self.scatter::<I>(frame, samples, layer);
            self.light_vertices::<I>(frame, samples, layer);
            if self.paths_behind.is_empty() || frame.is_cancelled() {
                return;
            }
            std::mem::swap(&mut self.paths, &mut self.paths_behind);
            std::mem::swap(&mut samples.rays, &mut self.behind);
            frame.closest(&samples.rays, &mut samples.hits);
        }
    }

    /// Finds the vertices of this layer, and leaves the paths and rays that go on behind it.
    #[inline(always)]
    fn scatter<I: Isa>(&mut self, frame: &Frame, samples: &mut Samples, layer: u32) {
        self.vertices.clear();
        self.varied.clear();
        self.normals.clear();
        self.paths_behind.clear();
        if frame.plain {
            self.scatter_plain::<I>(frame, samples);
            return;
        }
        for index in 0..samples.rays.len() {
            let (slot, throughput, depth) = if layer == 0 {
                (index, 1.0, 0.0)
            } else {
                let path = &self.paths[index];
                (path.slot, path.throughput, path.depth)
            };
            if samples.hits.instance[index] < 0 {
                show_background(frame, samples, index, slot, throughput);
                continue;
            }
            let number = samples.hits.material[index] as usize;
            let constant = &frame.materials[number];
            let shading = frame
                .detail
                .and_then(|detail| detail.shading(frame.trace, &samples.hits.get(index), constant));
            let material = shading.as_ref().map_or(constant, |own| &own.material);
            let opacity = if layer + 1 < LAYERS {
                material.opacity
            } else {
                1.0
            };
            let depth = depth + samples.hits.t[index];
            if opacity > 0.0 {
                samples.note(frame, slot, depth, index);
                let weight = throughput * opacity;
                if material.emission != Vec3::ZERO {
                    samples.add(slot, material.emission * weight);
                }
                samples.alpha[slot] += weight;
                let mut number = number;
                if let Some(own) = &shading {
                    number = frame.materials.len() + self.varied.len();
                    self.varied.push(own.material);
                    let vertex = self.vertices.len();
                    self.normals.extend(own.normal.map(|n| (vertex, n)));
                }
                self.vertices.push(slot, index, number, weight);
            }
            if opacity < 1.0 {
                let left = self.paths_behind.len();
                if left == 0 {
                    self.behind.resize(samples.rays.len());
                }
                self.paths_behind.push(Path {
                    slot,
                    throughput: throughput * (1.0 - opacity),
                    depth,
                });
                let behind = beyond(&samples.rays.get(index), &samples.hits.get(index));
                self.behind.set(left, &behind);
            }
        }
        self.behind.truncate(self.paths_behind.len());
        (self.vertices).place::<I>(&samples.rays, &samples.hits, frame.views);
        for &(vertex, normal) in &self.normals {
            self.vertices.shade_with(vertex, normal);
        }
    }

    /// The same where surfaces only reflect, and nothing varies over them.
    #[inline(always)]
    fn scatter_plain<I: Isa>(&mut self, frame: &Frame, samples: &mut Samples) {
        let hits = &samples.hits;
        self.vertices.take(hits);
        for (alpha, &instance) in samples.alpha.iter_mut().zip(&hits.instance[..hits.len()]) {
            *alpha = f64::from(u8::from(instance >= 0));
        }
        (self.vertices).place::<I>(&samples.rays, hits, frame.views);
        if frame.lights.background.is_some() {
            for slot in 0..samples.hits.len() {
                if samples.hits.instance[slot] < 0 {
                    show_background(frame, samples, slot, slot, 1.0);
                }
            }
        }
        if frame.picture.surfaces {
            for slot in 0..samples.hits.len() {
                if samples.hits.instance[slot] >= 0 {
                    samples.note(frame, slot, samples.hits.t[slot], slot);
                }
            }
        }
    }

    /// Adds the light that the vertices reflect: one shadow ray per vertex and light.
    #[inline(always)]
    fn light_vertices<I: Isa>(&mut self, frame: &Frame, samples: &mut Samples, layer: u32) {
        let lights = frame.lights;
        let vertices = &self.vertices;
        let materials = Materials {
            scene: frame.materials,
            own: &self.varied,
        };
        let pairs = 1 + (lights.local.len() + lights.domes.len()) as u32;
        let first_pair = HEMISPHERE + layer * pairs;
        for (index, light) in lights.local.iter().enumerate() {
            let pair = first_pair + 1 + index as u32;
            let points = light
                .is_soft()
                .then(|| self.draws.points(frame, samples, vertices, pair));
            self.shadows
                .light::<I::F64>(vertices, materials, light, points);
            self.shadows.gather(frame, samples);
        }
        for (index, dome) in lights.domes.iter().enumerate() {
            let pair = first_pair + 1 + (lights.local.len() + index) as u32;
            let points = self.draws.points(frame, samples, vertices, pair);
            self.shadows.dome(vertices, materials, dome, points);
            self.shadows.gather(frame, samples);
        }
        if lights.sky != Vec3::ZERO {
            let points = self.draws.points(frame, samples, vertices, first_pair);
            self.shadows.sky(vertices, materials, lights.sky, points);
            self.shadows.gather(frame, samples);
        }
    }
}
