//! A point on a surface that a camera ray sees.
use super::frame::Frame;
use super::material::Material;
use super::sampler::{PixelKey, points};
use super::samples::Samples;
use super::vector::Vec3;
use crate::ray::{Hit, Ray};

/// Where secondary rays start, and what shading needs to know.
#[derive(Clone, Copy, Debug)]
pub struct Vertex {
    /// The slot that sees it.
    pub slot: usize,
    /// Index of its material: of those of the scene, or beyond them, see [`Vertex::material`].
    pub material: usize,
    /// The part of its light that reaches the camera.
    pub weight: f64,
    /// The point, offset to the side that is seen.
    pub origin: Vec3,
    /// Unit normal to shade with, on that side.
    pub normal: Vec3,
    /// Unit vector towards the camera.
    pub view: Vec3,
}

impl Vertex {
    /// The vertex where `ray` hits. The side that faces the ray is shaded.
    #[inline(always)]
    pub fn new(slot: usize, weight: f64, ray: &Ray, hit: &Hit) -> Vertex {
        let view = -Vec3::from(ray.direction).normalized();
        let outward = Vec3::from(hit.normal);
        let normal = if outward.dot(view) < 0.0 {
            -outward
        } else {
            outward
        };
        Vertex {
            slot,
            material: hit.material as usize,
            weight,
            origin: hit.spawn(view.to_array()).into(),
            normal,
            view,
        }
    }

    /// Shades with another outward normal; the side that is seen stays that of the geometric one.
    #[inline]
    pub fn shade_with(&mut self, outward: Vec3) {
        self.normal = if outward.dot(self.normal) < 0.0 {
            -outward
        } else {
            outward
        };
    }

    /// Its material: one of the scene's, or one made for this vertex alone.
    #[inline(always)]
    pub fn material<'a>(&self, scene: &'a [Material], own: &'a [Material]) -> &'a Material {
        let of_scene = scene.get(self.material);
        of_scene.unwrap_or_else(|| &own[self.material - scene.len()])
    }

    /// The ray from here in a direction on the normal's side.
    #[inline(always)]
    pub fn ray(&self, direction: Vec3, t_max: f64) -> Ray {
        Ray {
            origin: self.origin.to_array(),
            direction: direction.to_array(),
            t_min: 0.0,
            t_max,
        }
    }
}

/// The memory to draw sample points for vertices.
#[derive(Default)]
pub struct Draws {
    keys: Vec<PixelKey>,
    indices: Vec<u32>,
    points: Vec<[f64; 2]>,
}

impl Draws {
    /// For each vertex a point of a pair of dimensions, number `index(sample)`.
    pub fn points(
        &mut self,
        frame: &Frame,
        samples: &Samples,
        vertices: &[Vertex],
        pair: u32,
        index: impl Fn(u32) -> u32,
    ) -> &[[f64; 2]] {
        self.keys.clear();
        self.keys
            .extend(vertices.iter().map(|vertex| samples.keys[vertex.slot]));
        self.indices.clear();
        self.indices.extend(
            vertices
                .iter()
                .map(|vertex| index(samples.indices[vertex.slot])),
        );
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
