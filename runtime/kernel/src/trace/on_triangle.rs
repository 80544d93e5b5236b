//! From a hit on a mesh back to its triangle, for those who need what varies over it.
//!
//! The way down is found from the leaf number, as in `surface`, and the point is brought down it.
//! The weights of the corners a, b, c at p are areas of parts over the whole: with edges u = b - a
//! and v = c - a, n = u × v and d = p - a, they are (d × v)·n / n·n of b and (u × d)·n / n·n of c.
use super::level::Target;
use crate::bvh::{exponent, power_of_two};
use crate::lanes::{axes, each};
use crate::ray::{Hit, OnTriangle};
use crate::scalar::Scalar;
use crate::scene::{Affine, Geometry, Group, Scene};

type Vector = [f64; 3];
type Linear = [Vector; 3];

const IDENTITY: Linear = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

impl<F: Scalar> Scene<F> {
    /// The triangle that a hit lies on; None if it is not on a mesh.
    pub(super) fn triangle_of(&self, hit: &Hit) -> Option<OnTriangle> {
        if !(0..self.leaf_count).contains(&hit.instance) {
            return None;
        }
        let mut group: &Group = &self.groups[0];
        let mut leaf = hit.instance;
        let mut point = hit.position;
        let (mut object_from_world, mut world_from_object) = (IDENTITY, IDENTITY);
        let mesh = loop {
            let (offset, before) = group.find_leaf(leaf);
            leaf -= before;
            let row = group.start + offset;
            let inward = &self.object_from_world[row];
            let moved = applied(&linear(inward), point);
            point = axes!(|i| moved[i] + inward[i][3]);
            object_from_world = product(&linear(inward), &object_from_world);
            world_from_object = product(&world_from_object, &linear(&self.world_from_object[row]));
            match self.target(row) {
                Target::Group(inner) => group = inner,
                Target::Prototype(prototype) => match &prototype.geometry {
                    Geometry::Mesh(mesh) => break mesh,
                    Geometry::Shape(_) => return None,
                },
            }
        };
        if hit.primitive as usize >= mesh.triangle_count {
            return None;
        }
        let corners = mesh.corners(hit.primitive);
        let edges = [1, 2].map(|corner| axes!(|i| corners[corner][i] - corners[0][i]));
        Some(OnTriangle {
            points: mesh.corner_points(hit.primitive),
            weights: weights(edges, axes!(|i| point[i] - corners[0][i])),
            edges: edges.map(|edge| applied(&world_from_object, edge)),
            object_from_world,
        })
    }
}

/// The weights of the corners at `d` from the first, to which the edges go to the others.
fn weights(edges: [Vector; 2], d: Vector) -> [f64; 3] {
    let largest = edges
        .as_flattened()
        .iter()
        .fold(0.0, |m: f64, x| m.max(x.abs()));
    let unit = power_of_two(-exponent(largest));
    let [u, v] = edges.map(|edge| each!(edge, |x| x * unit));
    let d = each!(d, |x| x * unit);
    let normal = cross(u, v);
    let whole = dot(normal, normal);
    // Of a triangle without area, which nothing hits, all is the first corner.
    let share = |area: f64| {
        if whole > 0.0 {
            (area / whole).clamp(0.0, 1.0)
        } else {
            0.0
        }
    };
    let second = share(dot(cross(d, v), normal));
    let third = share(dot(cross(u, d), normal)).min(1.0 - second);
    [1.0 - second - third, second, third]
}

// Plain products: these run outside of any instruction set's task, where fma is a call.

fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Vector, b: Vector) -> Vector {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

fn linear(matrix: &Affine) -> Linear {
    each!(*matrix, |row| [row[0], row[1], row[2]])
}

fn applied(matrix: &Linear, v: Vector) -> Vector {
    each!(*matrix, |row| dot(row, v))
}

fn product(a: &Linear, b: &Linear) -> Linear {
    each!(*a, |row| axes!(|j| dot(row, [b[0][j], b[1][j], b[2][j]])))
}
