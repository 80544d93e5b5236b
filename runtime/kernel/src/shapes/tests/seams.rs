//! Rays aimed at seams, where patches of a surface meet, to the last bit: none slips through.
use proptest::prelude::*;

use super::harness::{Precision, Ray, bevel, trace_everywhere, wedge_limit};
use crate::lanes::{InstructionSet, Isa, Lanes, Mask, Task, dispatch};
use crate::shapes::signed_distance::signed_distance;
use crate::shapes::{RayLanes, Shape, ShapeKind, TriangleRays};

/// The point of azimuth φ (degrees) and radius ρ.
fn polar(rho: f64, phi: f64, y: f64) -> [f64; 3] {
    let (sin, cos) = phi.to_radians().sin_cos();
    [rho * sin, y, rho * cos]
}

/// Points where three of the wedge's patches meet, on both sides of every seam.
fn wedge_seams(parameters: &[f64]) -> Vec<[f64; 3]> {
    let [r0, r1, y0, y1, phi0, phi1, b] = *parameters else {
        panic!("not a wedge")
    };
    let (inner, outer) = (r0 + b, r1 - b);
    let [alpha, beta] = [inner, outer].map(|r| (b / r).asin().to_degrees());
    let mut points = Vec::new();
    for (phi, sign) in [(phi0, 1.0), (phi1, -1.0)] {
        for share in [0.0, 0.3, 1.0] {
            let y = y0 + b + share * (y1 - y0 - 2.0 * b);
            points.push(polar(r1, phi + sign * beta, y));
            points.push(polar(r0, phi + sign * alpha, y));
            let [s1, s2] = [inner, outer].map(|r| (r * r - b * b).sqrt());
            points.push(polar(s1 + share * (s2 - s1), phi, y0 + b));
            points.push(polar(s1, phi, y));
            points.push(polar(s2, phi, y));
        }
        for y in [y0, y1] {
            points.push(polar(inner, phi + sign * alpha, y));
            points.push(polar(outer, phi + sign * beta, y));
            points.push(polar(outer, 0.5 * (phi0 + phi1), y));
            points.push(polar(inner, 0.5 * (phi0 + phi1), y));
        }
    }
    points
}

/// Points on the circles where the ring's patches meet.
fn ring_seams(parameters: &[f64]) -> Vec<[f64; 3]> {
    let [r0, r1, y0, y1, b] = *parameters else {
        panic!("not a ring")
    };
    let turns = (0..12).map(|i| 29.0 * f64::from(i));
    let circles = [
        (r0, y0 + b),
        (r0 + b, y0),
        (r0 + b, y1),
        (r1, y1 - b),
        (r1 - b, y1),
        (r1 - b, y0),
    ];
    turns
        .flat_map(|phi| circles.map(|(rho, y)| polar(rho, phi, y)))
        .collect()
}

fn box_seams(parameters: &[f64]) -> Vec<[f64; 3]> {
    let [x0, y0, z0, x1, y1, z1, b] = *parameters else {
        panic!("not a box")
    };
    let mut points = Vec::new();
    for x in [x0 + b, 0.5 * (x0 + x1), x1 - b] {
        for y in [y0 + b, y1 - b] {
            points.push([x, y, z0]);
            points.push([x, y, z1]);
            points.push([x, y0, z0 + b]);
            points.push([x, y1, z1 - b]);
        }
    }
    points
}

fn check<F: Precision>(kind: ShapeKind, parameters: &[f64], seams: &[[f64; 3]], from: &[[f64; 3]]) {
    let shape = Shape::<F>::new(kind, parameters).unwrap();
    let size = 1.0 / shape.frame().scale;
    let distance = |p: [f64; 3]| signed_distance(kind, parameters, p);
    let tolerance = 64.0 * F::EPS.to_f64() * size;
    if parameters.last().is_some_and(|&b| b < tolerance) {
        // A ray that misses by rounding misses the edge.
        return;
    }
    let mut rays = Vec::new();
    for &p in seams {
        let local = shape.frame().shape_from_object(p);
        let (_, n) = shape.surface(local, local, 0.0);
        for &direction in from {
            let facing = (0..3).map(|i| n[i] * direction[i]).sum::<f64>();
            let side = if facing < 0.0 { -1.0 } else { 1.0 };
            if facing.abs() > 0.2 {
                let d = direction.map(|x| -side * size * x);
                rays.push(Ray::new([0, 1, 2].map(|i| p[i] - d[i]), d));
            }
        }
    }
    for (ray, hit) in rays.iter().zip(trace_everywhere(&shape, &rays)) {
        // A near miss of the seam's point, itself rounded, still meets the surface nearby.
        let Some(t) = hit else {
            panic!("{kind:?} {parameters:?} {ray:?} slips through")
        };
        assert!(
            t <= 1.0 + 32.0 * tolerance / size,
            "{kind:?} {parameters:?} {ray:?} slips through to {t}"
        );
        let off = distance(ray.at(t)).abs();
        assert!(
            off <= tolerance,
            "{kind:?} {parameters:?} {ray:?}: off by {off:e}"
        );
    }
}

fn directions() -> impl Strategy<Value = Vec<[f64; 3]>> {
    prop::collection::vec([-1.0..1.0, -1.0..1.0, -1.0..1.0], 12)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, max_shrink_iters: 0, ..ProptestConfig::default() })]

    #[test]
    fn wedges_have_no_cracks(
        r0 in 0.2..3.0, wall in 0.1..2.0, height in 0.1..2.0, phi0 in -360.0..360.0, span in 5.0..355.0,
        share in 0.0..1.0, from in directions(),
    ) {
        let b = share * wedge_limit([r0, r0 + wall], height, span);
        let parameters = [r0, r0 + wall, 0.0, height, phi0, phi0 + span, b];
        let seams = wedge_seams(&parameters);
        check::<f32>(ShapeKind::Wedge, &parameters, &seams, &from);
        check::<f64>(ShapeKind::Wedge, &parameters, &seams, &from);
    }

    #[test]
    fn rings_have_no_cracks(
        r0 in 0.2..3.0, wall in 0.1..2.0, height in 0.1..2.0, share in 0.0..1.0, from in directions(),
    ) {
        let (r0, wall, height): (f64, f64, f64) = (r0, wall, height);
        let parameters = [r0, r0 + wall, 0.0, height, 0.5 * share * wall.min(height)];
        let seams = ring_seams(&parameters);
        check::<f32>(ShapeKind::Ring, &parameters, &seams, &from);
        check::<f64>(ShapeKind::Ring, &parameters, &seams, &from);
    }

    #[test]
    fn boxes_have_no_cracks(size in [0.1..2.0f64, 0.1..2.0, 0.1..2.0], share in bevel(1.0), from in directions()) {
        let b = 0.5 * share * size[0].min(size[1]).min(size[2]);
        let parameters = [0.0, 0.0, 0.0, size[0], size[1], size[2], b];
        let seams = box_seams(&parameters);
        check::<f32>(ShapeKind::Box, &parameters, &seams, &from);
        check::<f64>(ShapeKind::Box, &parameters, &seams, &from);
    }

    #[test]
    fn meshes_have_no_cracks(
        apex in [-1.0..1.0f64, -1.0..1.0, 0.5..1.0], from in directions(), share in 0.0..1.0f64,
    ) {
        // A fan about the origin; rays aimed at its edges and at the point where all of them meet.
        let ring: Vec<[f64; 3]> = (0..7)
            .map(|i| {
                let (sin, cos) = (f64::from(i) * std::f64::consts::TAU / 7.0).sin_cos();
                [cos + 0.1 * apex[0], sin, apex[2] * 0.3 * sin]
            })
            .collect();
        let rays: Vec<[[f32; 3]; 2]> = ring
            .iter()
            .flat_map(|p| {
                from.iter().filter(|d| d[2].abs() > 0.3).map(move |d| {
                    [[0, 1, 2].map(|k| (share * p[k] - d[k]) as f32), d.map(|x| x as f32)]
                })
            })
            .collect();
        let fan: Vec<[[f32; 3]; 3]> = (0..7)
            .map(|i| [[0.0; 3], ring[i], ring[(i + 1) % 7]].map(|p| p.map(|x| x as f32)))
            .collect();
        for set in InstructionSet::available() {
            let hits = dispatch(set, Fan { rays: &rays, triangles: &fan });
            prop_assert!(hits.iter().all(|&hit| hit), "{}: {:?}", set.name(), hits);
        }
    }
}

/// Which rays hit any of the triangles.
struct Fan<'a> {
    rays: &'a [[[f32; 3]; 2]],
    triangles: &'a [[[f32; 3]; 3]],
}

impl Task for Fan<'_> {
    type Output = Vec<bool>;

    #[inline(always)]
    fn run<I: Isa>(self) -> Vec<bool> {
        let mut hits = Vec::new();
        for rays in self.rays.chunks(I::F32::WIDTH) {
            let lanes = |part: usize| {
                [0, 1, 2].map(|k| I::F32::from_fn(|i| rays[i.min(rays.len() - 1)][part][k]))
            };
            let (o, d) = (lanes(0), lanes(1));
            let ray = RayLanes {
                o,
                d,
                t_min: I::F32::zero(),
                t_max: I::F32::splat(f32::INFINITY),
            };
            let prepared = TriangleRays::new(&ray);
            let hit = self.triangles.iter().fold(0, |hit, corners| {
                hit | prepared.intersect_any_axis(corners, Mask::full()).0.bits()
            });
            hits.extend((0..rays.len()).map(|i| hit >> i & 1 != 0));
        }
        hits
    }
}
