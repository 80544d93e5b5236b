//! From parameters in object space to solids in shape space.
use crate::scalar::Scalar;

use super::angle::sin_cos_degrees;
use super::ray_bevelled_box::BevelledBox;
use super::ray_bevelled_cone::{BevelledCone, core_radius};
use super::ray_bevelled_cylinder::BevelledCylinder;
use super::ray_bevelled_ring::BevelledRing;
use super::ray_bevelled_wedge::BevelledWedge;
use super::ray_box::Cuboid;
use super::ray_cone::Cone;
use super::ray_cylinder::Cylinder;
use super::ray_disc::Disc;
use super::ray_rectangle::Rectangle;
use super::ray_ring::Ring;
use super::ray_sphere::Sphere;
use super::ray_torus::Torus;
use super::ray_triangle::Triangle;
use super::ray_wedge::Wedge;
use super::sector::Sector;
use super::{Frame, ShapeKind, Solid};

/// The compiler has compared exactly; what is rounded here before it is compared may be off by some
/// ulps.
const ROUNDING: f64 = 1.0 + 16.0 * f64::EPSILON;

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
        (ShapeKind::Cone, &[radius, height, bevel]) => {
            // b ≤ r h / (r + L), the radius of the circle within the section.
            let side = radius.hypot(height);
            radius > 0.0
                && height > 0.0
                && bevel >= 0.0
                && bevel * (radius + side) <= radius * height * ROUNDING
        }
        (ShapeKind::Torus, &[major, minor]) => major >= 0.0 && minor > 0.0,
        (ShapeKind::Rectangle, &[x, z]) => x > 0.0 && z > 0.0,
        (ShapeKind::Ring, &[r0, r1, y0, y1, bevel]) => is_ring(r0, r1, y0, y1, bevel),
        (ShapeKind::Wedge, &[r0, r1, y0, y1, phi0, phi1, bevel]) => {
            let span = phi1 - phi0;
            // The inner wall has not shrunk to nothing: b (1 − s) ≤ r0 s, s = sin(Φ/2).
            let sine = sin_cos_degrees(0.5 * span.min(180.0)).0;
            is_ring(r0, r1, y0, y1, bevel)
                && 0.0 < span
                && span < 360.0
                && bevel * (1.0 - sine) <= r0 * sine * ROUNDING
        }
        (ShapeKind::Plane, &[]) | (ShapeKind::Triangle, _) => true,
        _ => false,
    }
}

fn is_ring(r0: f64, r1: f64, y0: f64, y1: f64, bevel: f64) -> bool {
    0.0 < r0
        && r0 < r1
        && y0 < y1
        && bevel >= 0.0
        && 2.0 * bevel <= r1 - r0
        && 2.0 * bevel <= y1 - y0
}

/// The least box, or `None` for a plane.
pub(super) fn bounds(kind: ShapeKind, parameters: &[f64]) -> Option<[[f64; 3]; 2]> {
    let round = |r: f64, y0: f64, y1: f64| Some([[-r, y0, -r], [r, y1, r]]);
    match (kind, parameters) {
        (ShapeKind::Sphere, &[r]) => round(r, -r, r),
        (ShapeKind::Disc, &[r]) => round(r, 0.0, 0.0),
        (ShapeKind::Box, &[x0, y0, z0, x1, y1, z1, _]) => Some([[x0, y0, z0], [x1, y1, z1]]),
        (ShapeKind::Cylinder, &[r, y0, y1, _]) => round(r, y0, y1),
        (ShapeKind::Cone, &[r, h, bevel]) => {
            // The core's rim and apex, and the bevel around them.
            let core = core_radius(r, h, bevel);
            let shrink = core / r;
            round(
                r.min(core + bevel),
                0.0,
                h.min(shrink.mul_add(h, 2.0 * bevel)),
            )
        }
        (ShapeKind::Torus, &[major, minor]) => round(major + minor, -minor, minor),
        (ShapeKind::Ring, &[_, r, y0, y1, _]) => round(r, y0, y1),
        (ShapeKind::Wedge, &[r0, r1, y0, y1, phi0, phi1, bevel]) => {
            let [low, high] = wedge_bounds([r0, r1], [phi0, phi1], bevel);
            Some([[low[0], y0, low[1]], [high[0], y1, high[1]]])
        }
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

/// Bounds that a frame may be centered in: those of a wedge are widened until they are about its
/// axis.
pub(super) fn around_axis(kind: ShapeKind, [low, high]: [[f64; 3]; 2]) -> [[f64; 3]; 2] {
    if kind != ShapeKind::Wedge {
        return [low, high];
    }
    let reach = [low[0], low[2], high[0], high[2]]
        .iter()
        .fold(0.0, |r: f64, x| r.max(x.abs()));
    [[-reach, low[1], -reach], [reach, high[1], reach]]
}

/// Least and greatest x and z of a wedge: at the edges' centers ± bevel, and where an axis meets
/// the outer wall. A wall's bounds are those of a circle as far as it runs along with one.
fn wedge_bounds([r0, r1]: [f64; 2], [phi0, phi1]: [f64; 2], bevel: f64) -> [[f64; 2]; 2] {
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    let mut include = |p: [f64; 2], margin: f64| {
        for i in 0..2 {
            low[i] = low[i].min(p[i] - margin);
            high[i] = high[i].max(p[i] + margin);
        }
    };
    // √((R)² − b²) with R = r0 + b and r1 − b.
    let along = [
        (r0 * (r0 + 2.0 * bevel)).sqrt(),
        (r1 * (r1 - 2.0 * bevel)).max(0.0).sqrt(),
    ];
    for (phi, inward) in [(phi0, bevel), (phi1, -bevel)] {
        let (sin, cos) = sin_cos_degrees(phi);
        for s in along {
            include([s * sin + inward * cos, s * cos - inward * sin], bevel);
        }
    }
    let outer = Sector::<f64>::turned([phi0, phi1], bevel / (r1 - bevel), along[1] / (r1 - bevel));
    for axis in [[0.0, 1.0], [1.0, 0.0], [0.0, -1.0], [-1.0, 0.0]] {
        if outer.contains([axis[0], 0.0, axis[1]]) {
            include(axis.map(|x| x * r1), 0.0);
        }
    }
    [low, high]
}

impl<F: Scalar> Solid<F> {
    /// The solid in shape space; a bevel less than `least_bevel` there is left out. The parameters
    /// are valid.
    pub(super) fn new(
        kind: ShapeKind,
        parameters: &[f64],
        frame: &Frame,
        least_bevel: f64,
    ) -> Solid<F> {
        let length = |x: f64| x * frame.scale;
        let height = |y: f64| (y - frame.center[1]) * frame.scale;
        let bevel = |b: f64| Some(length(b)).filter(|&b| b >= least_bevel);
        match (kind, parameters) {
            (ShapeKind::Sphere, &[radius]) => Solid::Sphere(Sphere::new(length(radius))),
            (ShapeKind::Box, &[x0, y0, z0, x1, y1, z1, b]) => {
                let low = frame.shape_from_object([x0, y0, z0]);
                let high = frame.shape_from_object([x1, y1, z1]);
                match bevel(b) {
                    None => Solid::Cuboid(Cuboid::new(low, high)),
                    Some(b) => Solid::BevelledBox(Box::new(BevelledBox::new(low, high, b))),
                }
            }
            (ShapeKind::Cylinder, &[radius, y0, y1, b]) => {
                let (radius, y) = (length(radius), [y0, y1].map(height));
                match bevel(b) {
                    None => Solid::Cylinder(Cylinder::new(radius, y)),
                    Some(b) => {
                        Solid::BevelledCylinder(Box::new(BevelledCylinder::new(radius, y, b)))
                    }
                }
            }
            (ShapeKind::Cone, &[radius, tip, b]) => {
                let (radius, tip) = (length(radius), length(tip));
                match bevel(b) {
                    None => Solid::Cone(Cone::new(radius, tip)),
                    Some(b) => Solid::BevelledCone(Box::new(BevelledCone::new(radius, tip, b))),
                }
            }
            (ShapeKind::Torus, &[major, minor]) => {
                Solid::Torus(Torus::new(length(major), length(minor)))
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
            (ShapeKind::Ring, &[r0, r1, y0, y1, b]) => {
                let (r, y) = ([r0, r1].map(length), [y0, y1].map(height));
                match bevel(b) {
                    None => Solid::Ring(Ring::new(r, y)),
                    Some(b) => Solid::BevelledRing(Box::new(BevelledRing::new(r, y, b))),
                }
            }
            (ShapeKind::Wedge, &[r0, r1, y0, y1, phi0, phi1, b]) => {
                let (r, y) = ([r0, r1].map(length), [y0, y1].map(height));
                match bevel(b) {
                    None => Solid::Wedge(Wedge::new(r, y, [phi0, phi1])),
                    Some(b) => {
                        Solid::BevelledWedge(Box::new(BevelledWedge::new(r, y, [phi0, phi1], b)))
                    }
                }
            }
            _ => Solid::Plane,
        }
    }
}
