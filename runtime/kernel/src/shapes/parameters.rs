//! From parameters in object space to solids in shape space.
use crate::scalar::Scalar;

use super::ray_box::Cuboid;
use super::ray_cylinder::Cylinder;
use super::ray_disc::Disc;
use super::ray_rectangle::Rectangle;
use super::ray_sphere::Sphere;
use super::ray_triangle::Triangle;
use super::{Frame, ShapeKind, Solid};

/// Whether the parameters make a solid. Exact, equality allowed where the solid stays one.
pub(super) fn is_valid(kind: ShapeKind, parameters: &[f64]) -> bool {
    match (kind, parameters) {
        (ShapeKind::Sphere | ShapeKind::Disc, &[radius]) => radius > 0.0,
        (ShapeKind::Box, &[x0, y0, z0, x1, y1, z1, bevel]) => {
            bevel >= 0.0
                && [(x0, x1), (y0, y1), (z0, z1)]
                    .iter()
                    .all(|(low, high)| low <= high && 2.0 * bevel <= high - low)
        }
        (ShapeKind::Cylinder, &[radius, y0, y1, bevel]) => {
            radius > 0.0 && y0 <= y1 && bevel >= 0.0 && 2.0 * bevel <= y1 - y0 && bevel <= radius
        }
        (ShapeKind::Rectangle, &[x, z]) => x > 0.0 && z > 0.0,
        (ShapeKind::Plane, &[]) | (ShapeKind::Triangle, _) => true,
        _ => false,
    }
}

/// The least box, or `None` for a plane.
pub(super) fn bounds(kind: ShapeKind, parameters: &[f64]) -> Option<[[f64; 3]; 2]> {
    let round = |r: f64, y0: f64, y1: f64| Some([[-r, y0, -r], [r, y1, r]]);
    match (kind, parameters) {
        (ShapeKind::Sphere, &[r]) => round(r, -r, r),
        (ShapeKind::Disc, &[r]) => round(r, 0.0, 0.0),
        (ShapeKind::Box, &[x0, y0, z0, x1, y1, z1, _]) => Some([[x0, y0, z0], [x1, y1, z1]]),
        (ShapeKind::Cylinder, &[r, y0, y1, _]) => round(r, y0, y1),
        (ShapeKind::Rectangle, &[x, z]) => {
            Some([[-0.5 * x, 0.0, -0.5 * z], [0.5 * x, 0.0, 0.5 * z]])
        }
        (ShapeKind::Triangle, corners) => {
            let end = |pick: fn(f64, f64) -> f64| {
                [0, 1, 2].map(|i| pick(pick(corners[i], corners[3 + i]), corners[6 + i]))
            };
            Some([end(f64::min), end(f64::max)])
        }
        _ => None,
    }
}

impl<F: Scalar> Solid<F> {
    /// The solid in shape space. The parameters are valid.
    pub(super) fn new(kind: ShapeKind, parameters: &[f64], frame: &Frame) -> Solid<F> {
        let length = |x: f64| x * frame.scale;
        let height = |y: f64| (y - frame.center[1]) * frame.scale;
        match (kind, parameters) {
            (ShapeKind::Sphere, &[radius]) => Solid::Sphere(Sphere::new(length(radius))),
            (ShapeKind::Box, &[x0, y0, z0, x1, y1, z1, _]) => Solid::Cuboid(Cuboid::new(
                frame.shape_from_object([x0, y0, z0]),
                frame.shape_from_object([x1, y1, z1]),
            )),
            (ShapeKind::Cylinder, &[radius, y0, y1, _]) => {
                Solid::Cylinder(Cylinder::new(length(radius), [height(y0), height(y1)]))
            }
            (ShapeKind::Disc, &[radius]) => Solid::Disc(Disc::new(length(radius))),
            (ShapeKind::Rectangle, &[x, z]) => {
                Solid::Rectangle(Rectangle::new([length(0.5 * x), length(0.5 * z)]))
            }
            (ShapeKind::Triangle, corners) => {
                Solid::Triangle(Triangle::new([0, 3, 6].map(|i| {
                    frame.shape_from_object([corners[i], corners[i + 1], corners[i + 2]])
                })))
            }
            _ => Solid::Plane,
        }
    }
}
