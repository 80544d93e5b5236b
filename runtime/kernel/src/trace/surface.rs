//! From a leaf number and t to the surface there.
//!
//! The way down through the levels is found again from the leaf number, so traversal carries no
//! path. The point is computed where it is small: in object space, moved onto the surface, and
//! only then transformed, translations last.
//!
//! # Offset
//!
//! A ray that starts at the point is traced like any other: its origin is rounded to F in the
//! normalised space of the object, and intersectors err by some units of F there. Together that
//! stays below δ = 32·ε_F·size along the object's normal n_o. Displacing the start by h along the
//! world normal n = Wᵀn_o/|Wᵀn_o| moves it by n_o·W·n·h = |Wᵀn_o|·h along n_o in object space, so
//! h = δ/|Wᵀn_o| clears the surface under any affine map (after Wächter & Binder's and NVIDIA's
//! self-intersection-avoidance bounds for instances). Each transform adds its own rounding,
//! γ·(|M||p| + |T|) in f64, likewise divided by the normal's length there. Flat shapes meet rays
//! in f64 (see `instance`), so their δ is of f64.
//!
//! # Edges
//!
//! Within an edge two faces meet, and a start that is clear of one may have been rounded beyond the
//! other: a ray would leave a closed box next to its edge, once in some million. So points keep
//! [`EDGE_ROOM`] units and the rounding of world coordinates away from the edges of their face.
use super::level::Target;
use crate::bvh::{NormalSpace, exponent, power_of_two};
use crate::instance::{LevelRays, dot};
use crate::lanes::{axes, each};
use crate::ray::{Found, Hit, Ray};
use crate::scalar::Scalar;
use crate::scene::{Geometry, Group, Prototype, Scene};
use crate::shapes::triangle_surface;

/// Rounding errors of one transform of a point, in units of the magnitudes of its terms.
const TRANSFORM_ERROR: f64 = 8.0 * f64::EPSILON;

/// Rounding error of a coordinate, and of the start that is computed from it, in units of itself.
const COORDINATE_ERROR: f64 = 2.0 * f64::EPSILON;

/// How far points stay from edges, in ε_F of the object's size.
const EDGE_ROOM: f64 = 8.0;

impl<F: Scalar> Scene<F> {
    /// The surface at a hit. `path` is scratch.
    #[inline(always)]
    pub(super) fn surface(&self, ray: &Ray, found: &Found, path: &mut Vec<usize>) -> Hit {
        if !(0..self.leaf_count).contains(&found.instance) {
            return Hit::MISS;
        }
        path.clear();
        let mut rays = LevelRays::from_ray(ray);
        let mut group: &Group = &self.groups[0];
        let mut leaf = found.instance;
        let mut bound = 0;
        let mut forced = None;
        // How far from its space's origin the object lies, in units of the ray's direction.
        let mut reach = 0.0;
        let (prototype, index) = loop {
            let (offset, before) = group.find_leaf(leaf);
            let row = group.start + offset;
            path.push(row);
            leaf -= before;
            match self.instance_material[row] {
                -1 => {}
                material if material >= 0 => bound = material,
                forces => forced = forced.or(Some(-2 - forces)),
            }
            let target = self.target(row);
            let entrance = self.entrance(row, &target);
            match target {
                Target::Group(inner) => {
                    rays = entrance.enter_group(&rays);
                    reach += self.distance(row) * rays.rate;
                    group = inner;
                }
                Target::Prototype(prototype) => {
                    rays = entrance.enter_prototype(&rays, &prototype.space);
                    reach += self.distance(row) * prototype.space.scale * rays.rate;
                    break (prototype, self.instance_target[row]);
                }
            }
        };
        let tau = (found.t - rays.start) * rays.per_rate;
        let local: [f64; 3] = axes!(|i| tau.mul_add(rays.direction[i], rays.origin[i]));
        let rounding = COORDINATE_ERROR * reach * rays.per_rate;
        let surface = prototype.surface(local, found.primitive, rounding);
        let Some((mut point, mut normal, error)) = surface else {
            return Hit::MISS;
        };
        let mut offset = error;
        for &row in path.iter().rev() {
            let matrix = &self.world_from_object[row];
            let low = self.translation_low.get(row).copied().unwrap_or_default();
            let inverse = &self.object_from_world[row];
            let turned: [f64; 3] =
                axes!(|i| dot([inverse[0][i], inverse[1][i], inverse[2][i]], normal));
            let magnitude: [f64; 3] = axes!(|i| {
                let [x, y, z, w] = matrix[i];
                dot([x.abs(), y.abs(), z.abs()], each!(point, |x| x.abs())) + w.abs()
            });
            offset += TRANSFORM_ERROR * dot(each!(turned, |x| x.abs()), magnitude);
            point = axes!(|i| {
                let [x, y, z, w] = matrix[i];
                dot([x, y, z], point) + f64::from(low[i]) + w
            });
            let unit = unit_of(turned);
            normal = each!(turned, |x| x * unit);
            offset *= unit;
        }
        let length = dot(normal, normal).sqrt();
        Hit {
            t: found.t,
            position: point,
            normal: each!(normal, |x| x / length),
            offset: offset / length,
            instance: found.instance,
            prototype: index,
            material: forced.unwrap_or(bound),
            primitive: found.primitive,
        }
    }
}

impl<F: Scalar> Scene<F> {
    /// How far instance `row` lies from its space's origin, in its own units.
    #[inline(always)]
    fn distance(&self, row: usize) -> f64 {
        let [x, y, z] = self.object_from_world[row].map(|r| r[3].abs());
        x.max(y).max(z)
    }
}

/// The power of two that brings the largest component to order one.
#[inline(always)]
fn unit_of(v: [f64; 3]) -> f64 {
    power_of_two(-exponent(v[0].abs().max(v[1].abs()).max(v[2].abs())))
}

impl<F: Scalar> Prototype<F> {
    /// Point, normal and δ in object space, from a point near the surface in normalised space,
    /// where world coordinates are off by `rounding`; None if there is no such triangle.
    #[inline(always)]
    fn surface(
        &self,
        local: [f64; 3],
        triangle: u32,
        rounding: f64,
    ) -> Option<([f64; 3], [f64; 3], f64)> {
        let NormalSpace { center, scale } = self.space;
        let unit = 1.0 / scale;
        let error = F::EPS.to_f64() * 32.0 * unit;
        let room = EDGE_ROOM.mul_add(F::EPS.to_f64(), rounding);
        match &self.geometry {
            Geometry::Shape(shape) => {
                let (point, normal) = shape.surface(local, room);
                let point = axes!(|i| point[i].mul_add(unit, center[i]));
                if self.anchor.flat {
                    let magnitude = point.iter().fold(0.0, |sum, x| sum + x.abs());
                    return Some((point, normal, TRANSFORM_ERROR * magnitude));
                }
                Some((point, normal, error))
            }
            Geometry::Mesh(mesh) if triangle as usize >= mesh.triangle_count => None,
            Geometry::Mesh(mesh) => {
                let near = axes!(|i| local[i].mul_add(unit, center[i]));
                let (point, normal) = triangle_surface(mesh.corners(triangle), near, room * unit);
                Some((point, normal, error))
            }
        }
    }
}
