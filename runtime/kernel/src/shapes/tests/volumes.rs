//! Volumes by the chords of parallel rays, against closed forms.
//!
//! A core of volume V, area S, edges of total ℓθ and χ dilated by b has V + S b + ... (Steiner);
//! here in the form for extruded solids: V = H (a0 + a1 b + π χ b²) + 2 a0 b + (π/2) a1 b² + (4π/3)
//! χ b³, with area a0, perimeter a1 of the planar core.
use std::f64::consts::PI;

use super::harness::{Ray, trace};
use crate::lanes::InstructionSet;
use crate::shapes::{Shape, ShapeKind};

fn extruded(a0: f64, a1: f64, chi: f64, height: f64, b: f64) -> f64 {
    height * (a0 + a1 * b + PI * chi * b * b)
        + 2.0 * a0 * b
        + PI / 2.0 * a1 * b * b
        + 4.0 * PI / 3.0 * chi * b.powi(3)
}

fn wedge_core([r0, r1]: [f64; 2], span: f64, b: f64) -> (f64, f64) {
    let (inner, outer, span) = (r0 + b, r1 - b, span.to_radians());
    let part = |r: f64| span * r * r / 2.0 - r * r * (b / r).asin() - b * (r * r - b * b).sqrt();
    let straight = (outer * outer - b * b).sqrt() - (inner * inner - b * b).sqrt();
    let arc = |r: f64| (span - 2.0 * (b / r).asin()) * r;
    (
        part(outer) - part(inner),
        2.0 * straight + arc(outer) + arc(inner),
    )
}

/// Volume by chords of 160² rays in a slanted direction.
fn by_chords<F: super::harness::Precision>(kind: ShapeKind, parameters: &[f64]) -> f64 {
    const N: usize = 160;
    let shape = Shape::<F>::new(kind, parameters).unwrap();
    let (middle, radius) = super::harness::ball_around(&shape);
    let d = [0.48, 0.64, 0.6];
    let (u, v) = ([0.8, -0.6, 0.0], [0.36, 0.48, -0.8]);
    let step = 2.0 * radius / N as f64;
    let mut rays: Vec<Ray> = (0..N * N)
        .map(|i| {
            // Rank-one lattice: evener than a grid for shapes that line up with it.
            let a = (i as f64 + 0.5) / (N * N) as f64 * 2.0 - 1.0;
            let b = ((i as f64) * 0.618_033_988_749_895).fract() * 2.0 - 1.0;
            let o = [0, 1, 2].map(|k| middle[k] + radius * (a * u[k] + b * v[k] - 1.5 * d[k]));
            Ray::new(o, d)
        })
        .collect();
    let mut volume = 0.0;
    let skip = 1e-5 * radius;
    while !rays.is_empty() {
        let entries = trace(InstructionSet::available()[0], &shape, &rays);
        let inside: Vec<Ray> = rays
            .iter()
            .zip(entries)
            .filter_map(|(ray, t)| {
                Some(Ray {
                    t_min: t? + skip,
                    ..*ray
                })
            })
            .collect();
        let exits = trace(InstructionSet::available()[0], &shape, &inside);
        rays = inside
            .iter()
            .zip(exits)
            .filter_map(|(ray, t)| {
                volume += (t? - ray.t_min + skip) * step * step;
                Some(Ray {
                    t_min: t? + skip,
                    ..*ray
                })
            })
            .collect();
    }
    volume
}

#[test]
fn volumes_are_those_of_the_closed_forms() {
    let ring = |b: f64| {
        let (inner, outer) = (0.6 + b, 1.3 - b);
        let (a0, a1) = (
            PI * (outer * outer - inner * inner),
            2.0 * PI * (inner + outer),
        );
        extruded(a0, a1, 0.0, 0.9 - 2.0 * b, b)
    };
    let wedge = |span: f64, b: f64| {
        let (a0, a1) = wedge_core([0.6, 1.3], span, b);
        extruded(a0, a1, 1.0, 0.9 - 2.0 * b, b)
    };
    let cone = |b: f64| {
        let (r, h): (f64, f64) = (0.8, 1.1);
        let side = r.hypot(h);
        let (sin, cos) = (r / side, h / side);
        let core = r - b * (1.0 + sin) / cos;
        let height = h - b / sin - b;
        PI * core * core * height / 3.0
            + PI * core * (core + core.hypot(height)) * b
            + (PI * core * (PI / 2.0 + sin.asin()) + PI * height) * b * b
            + 4.0 * PI * b.powi(3) / 3.0
    };
    let cylinder = |b: f64| {
        extruded(
            PI * (0.7 - b).powi(2),
            2.0 * PI * (0.7 - b),
            1.0,
            0.9 - 2.0 * b,
            b,
        )
    };
    let cuboid = |b: f64| {
        let (x, z) = (1.1 - 2.0 * b, 0.7 - 2.0 * b);
        extruded(x * z, 2.0 * (x + z), 1.0, 0.9 - 2.0 * b, b)
    };
    let mut cases: Vec<(ShapeKind, Vec<f64>, f64)> = vec![
        (
            ShapeKind::Sphere,
            vec![0.7],
            4.0 * PI / 3.0 * 0.7f64.powi(3),
        ),
        (ShapeKind::Torus, vec![0.9, 0.3], 2.0 * PI * PI * 0.9 * 0.09),
    ];
    for b in [0.0, 0.1, 0.35] {
        cases.push((
            ShapeKind::Box,
            vec![0.0, 0.0, 0.0, 1.1, 0.9, 0.7, b],
            cuboid(b),
        ));
        cases.push((ShapeKind::Cylinder, vec![0.7, -0.4, 0.5, b], cylinder(b)));
        cases.push((ShapeKind::Ring, vec![0.6, 1.3, -0.4, 0.5, b], ring(b)));
        for span in [60.0f64, 130.0, 180.0, 250.0, 359.0] {
            if b * (1.0 - (span / 2.0).min(90.0).to_radians().sin())
                <= 0.6 * (span / 2.0).min(90.0).to_radians().sin()
            {
                cases.push((
                    ShapeKind::Wedge,
                    vec![0.6, 1.3, -0.4, 0.5, 25.0, 25.0 + span, b],
                    wedge(span, b),
                ));
            }
        }
        cases.push((ShapeKind::Cone, vec![0.8, 1.1, b], cone(b)));
    }
    for (kind, parameters, expected) in cases {
        let single = by_chords::<f32>(kind, &parameters);
        let double = by_chords::<f64>(kind, &parameters);
        assert!(
            (double / expected - 1.0).abs() < 0.01,
            "{kind:?} {parameters:?}: {double} is not {expected}"
        );
        assert!(
            (single / double - 1.0).abs() < 1e-3,
            "{kind:?} {parameters:?}: {single} is not {double}"
        );
    }
}
