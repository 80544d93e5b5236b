//! The shapes by their signed distance: the definition that tests hold the intersectors to.
//!
//! A bevelled solid is its core (all points whose ball of radius b is in the plain solid) dilated
//! by b: sdf = sdf_core − b. Written for clarity in f64, with atan2 and asin, and independent of
//! the intersectors.
use std::f64::consts::PI;

use super::ShapeKind;

/// Negative inside; exact outside, and inside for solids. Flat shapes: the distance.
pub(super) fn signed_distance(kind: ShapeKind, parameters: &[f64], p: [f64; 3]) -> f64 {
    let [x, y, z] = p;
    let rho = x.hypot(z);
    match (kind, parameters) {
        (ShapeKind::Sphere, &[r]) => norm(p) - r,
        (ShapeKind::Box, &[x0, y0, z0, x1, y1, z1, b]) => {
            let w = [(x0, x1, x), (y0, y1, y), (z0, z1, z)]
                .map(|(low, high, x)| (low + b - x).max(x - high + b));
            w[0].max(w[1]).max(w[2]).min(0.0) + norm(w.map(|w| w.max(0.0))) - b
        }
        (ShapeKind::Cylinder, &[r, y0, y1, b]) => extruded(rho - (r - b), y, y0, y1, b),
        (ShapeKind::Ring, &[r0, r1, y0, y1, b]) => {
            extruded((r0 + b - rho).max(rho - (r1 - b)), y, y0, y1, b)
        }
        (ShapeKind::Wedge, &[r0, r1, y0, y1, phi0, phi1, b]) => extruded(
            annular_sector(x, z, [r0 + b, r1 - b], phi0, phi1 - phi0, b),
            y,
            y0,
            y1,
            b,
        ),
        (ShapeKind::Cone, &[r, h, b]) => {
            let side = r.hypot(h);
            let (sin, cos) = (r / side, h / side);
            let (base, apex) = (
                [(r - b * (1.0 + sin) / cos).max(0.0), b],
                [0.0, h - b / sin],
            );
            let slant = (rho - base[0]) * cos + (y - b) * sin;
            let inside = slant.max(b - y);
            if inside <= 0.0 {
                return inside - b;
            }
            to_segment([rho, y], base, apex).min(to_segment([rho, y], [0.0, b], base)) - b
        }
        (ShapeKind::Torus, &[major, minor]) => (rho - major).hypot(y) - minor,
        (ShapeKind::Disc, &[r]) => (rho - r).max(0.0).hypot(y),
        (ShapeKind::Rectangle, &[a, b]) => norm([
            (x.abs() - a / 2.0).max(0.0),
            y,
            (z.abs() - b / 2.0).max(0.0),
        ]),
        (ShapeKind::Plane, _) => y.abs(),
        (ShapeKind::Triangle, c) => to_triangle(
            p,
            [[c[0], c[1], c[2]], [c[3], c[4], c[5]], [c[6], c[7], c[8]]],
        ),
        _ => panic!("wrong number of parameters"),
    }
}

fn extruded(planar: f64, y: f64, y0: f64, y1: f64, b: f64) -> f64 {
    let along = (y0 + b - y).max(y - y1 + b);
    planar.max(along).min(0.0) + planar.max(0.0).hypot(along.max(0.0)) - b
}

/// The planar core of a wedge: Ri ≤ ρ ≤ Ro, at least b inside of both side planes.
fn annular_sector(x: f64, z: f64, [inner, outer]: [f64; 2], phi0: f64, span: f64, b: f64) -> f64 {
    let rho = x.hypot(z);
    let span = span * PI / 180.0;
    // Azimuth within the wedge, from side 0.
    let mut phi = (x.atan2(z) - phi0 * PI / 180.0).rem_euclid(2.0 * PI);
    if phi - span > (2.0 * PI - span) / 2.0 {
        phi -= 2.0 * PI;
    }
    let within = |r: f64| phi >= (b / r).asin() && phi <= span - (b / r).asin();
    // In the frame of either side: along it, and away from it.
    let to_side = |turn: f64| {
        let (u, q) = (rho * turn.cos(), rho * turn.sin());
        let [s1, s2] = [inner, outer].map(|r| (r * r - b * b).max(0.0).sqrt());
        to_segment([u, q], [s1, b], [s2, b])
    };
    let mut distance = to_side(phi).min(to_side(span - phi));
    for r in [inner, outer] {
        if within(r) {
            distance = distance.min((rho - r).abs());
        }
    }
    let inside = rho >= inner && rho <= outer && b <= rho && within(rho);
    if inside { -distance } else { distance }
}

fn to_segment(p: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    let (e, f) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let length = e[0] * e[0] + e[1] * e[1];
    let s = if length > 0.0 {
        ((e[0] * f[0] + e[1] * f[1]) / length).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (f[0] - s * e[0]).hypot(f[1] - s * e[1])
}

fn to_triangle(p: [f64; 3], [a, b, c]: [[f64; 3]; 3]) -> f64 {
    let minus = |p: [f64; 3], q: [f64; 3]| [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
    let cross = |p: [f64; 3], q: [f64; 3]| {
        [
            p[1] * q[2] - p[2] * q[1],
            p[2] * q[0] - p[0] * q[2],
            p[0] * q[1] - p[1] * q[0],
        ]
    };
    let dot = |p: [f64; 3], q: [f64; 3]| p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
    let normal = cross(minus(b, a), minus(c, a));
    let within = [(a, b), (b, c), (c, a)]
        .iter()
        .all(|&(from, to)| dot(cross(minus(to, from), minus(p, from)), normal) >= 0.0);
    if within {
        return (dot(minus(p, a), normal) / norm(normal)).abs();
    }
    [(a, b), (b, c), (c, a)]
        .iter()
        .fold(f64::INFINITY, |least, &(from, to)| {
            let (e, f) = (minus(to, from), minus(p, from));
            let s = (dot(e, f) / dot(e, e)).clamp(0.0, 1.0);
            least.min(norm([f[0] - s * e[0], f[1] - s * e[1], f[2] - s * e[2]]))
        })
}

fn norm(p: [f64; 3]) -> f64 {
    p[0].hypot(p[1]).hypot(p[2])
}

/// Where a ray first changes sides of a shape, by sphere tracing its signed distance, and the least
/// distance it kept from the surface before; `None` beyond `t_max`. Solids only.
pub(super) fn sphere_trace(
    distance: impl Fn([f64; 3]) -> f64,
    o: [f64; 3],
    d: [f64; 3],
    t_max: f64,
    size: f64,
) -> (Option<f64>, f64) {
    let length = norm(d);
    let at = |t: f64| distance([0, 1, 2].map(|i| o[i] + t * d[i]));
    let side = at(0.0).signum();
    let (mut t, mut clearance, mut approaching) = (0.0, f64::INFINITY, at(0.0).abs());
    for _ in 0..100_000 {
        let room = at(t) * side;
        if room < 1e-9 * size {
            // Bisect over the rest, if the ray does cross.
            let mut far = t + 4e-9 * size / length;
            for _ in 0..30 {
                if at(far) * side < 0.0 {
                    break;
                }
                far += (far - t).max(at(far).abs() / length);
                if far - t > 1e-3 * size / length {
                    return (None, 0.0);
                }
            }
            for _ in 0..80 {
                let middle = 0.5 * (t + far);
                if at(middle) * side > 0.0 {
                    t = middle
                } else {
                    far = middle
                }
            }
            return (Some(t), clearance);
        }
        // A local minimum of the distance before the crossing is a near miss.
        if room > approaching {
            clearance = clearance.min(approaching);
        }
        approaching = room;
        t += room / length;
        if t > t_max {
            return (None, clearance.min(approaching));
        }
    }
    (None, 0.0)
}
