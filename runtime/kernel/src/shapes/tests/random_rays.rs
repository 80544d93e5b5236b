//! Random rays against sphere tracing of the signed distance.
use proptest::prelude::*;

use super::harness::{Precision, Ray, ball_around, flat, solid, trace_everywhere, unit_point};
use crate::shapes::signed_distance::{signed_distance, sphere_trace};
use crate::shapes::{Shape, ShapeKind};

fn norm(d: [f64; 3]) -> f64 {
    d[0].hypot(d[1]).hypot(d[2])
}

/// Rays through the bounds of a shape from far or from within.
fn rays(middle: [f64; 3], radius: f64, ends: &[([f64; 3], [f64; 3], f64)]) -> Vec<Ray> {
    ends.iter()
        .filter_map(|&(from, to, distance)| {
            let [from, to] = [from, to].map(|p| [0, 1, 2].map(|i| middle[i] + radius * p[i]));
            let d = [0, 1, 2].map(|i| to[i] - from[i]);
            let o = [0, 1, 2].map(|i| from[i] - distance * d[i]);
            (norm(d) > 1e-3 * radius).then_some(Ray::new(o, d))
        })
        .collect()
}

fn check<F: Precision>(kind: ShapeKind, parameters: &[f64], ends: &[([f64; 3], [f64; 3], f64)]) {
    let shape = Shape::<F>::new(kind, parameters).unwrap();
    let (middle, radius) = ball_around(&shape);
    let eps = F::EPS.to_f64();
    let rays = rays(middle, radius, ends);
    let solid = !matches!(
        kind,
        ShapeKind::Disc | ShapeKind::Rectangle | ShapeKind::Plane | ShapeKind::Triangle
    );
    let distance = |p: [f64; 3]| signed_distance(kind, parameters, p);
    // A bevel that is traced as none; a cone's takes more than itself off the tip.
    let has_bevel = !matches!(kind, ShapeKind::Sphere | ShapeKind::Torus) && solid;
    let dropped = parameters
        .last()
        .filter(|&&b| has_bevel && b < 16.0 * eps / shape.frame().scale)
        .map_or(0.0, |b| match (kind, parameters) {
            (ShapeKind::Cone, &[radius, height, _]) => b * radius.hypot(height) / radius,
            _ => *b,
        });
    let size = 1.0 / shape.frame().scale;
    // The definition takes a needle's or flat cone's core from the whole, and loses ulps of that.
    let defined = match (kind, parameters) {
        (ShapeKind::Cone, &[radius, height, _]) => 8.0 * f64::EPSILON * radius.max(height),
        _ => 0.0,
    };
    let hits = trace_everywhere(&shape, &rays);
    // A hit is the same wherever the search ends behind it.
    let nearer: Vec<Ray> = rays
        .iter()
        .zip(&hits)
        .map(|(ray, hit)| Ray {
            t_max: hit.map_or(f64::INFINITY, |t| t * 1.001 + 1e-6),
            ..*ray
        })
        .collect();
    assert_eq!(
        hits,
        trace_everywhere(&shape, &nearer),
        "{kind:?} {parameters:?}"
    );
    for (ray, hit) in rays.iter().zip(hits) {
        let reach = norm([0, 1, 2].map(|i| ray.o[i] - middle[i])) + 2.0 * radius;
        let tolerance = 16.0 * eps * size + 16.0 * f64::EPSILON * reach + dropped + defined;
        // Origins within a few sizes are not slid: o and t d are rounded as they are.
        let path = hit.map_or(0.0, |t| (t * norm(ray.d)).min(8.0 * size));
        let tolerance = tolerance + 2.0 * eps * path;
        if let Some(t) = hit {
            let off = distance(ray.at(t)).abs();
            assert!(
                off <= tolerance,
                "{kind:?} {parameters:?} {ray:?}: hit at {t} is off by {off:e}, {tolerance:e} allowed"
            );
            let local = shape.frame().shape_from_object(ray.at(t));
            let (point, normal) = shape.surface(local, local, 0.0);
            let moved = norm([0, 1, 2].map(|i| point[i] - local[i])) / shape.frame().scale;
            assert!(
                moved <= 2.0 * tolerance,
                "{kind:?} {parameters:?} {ray:?}: reprojected by {moved:e}"
            );
            assert!(
                (norm(normal) - 1.0).abs() < 1e-14,
                "{kind:?} {parameters:?} {ray:?}: normal {normal:?}"
            );
            let off = distance(shape.frame().object_from_shape(point)).abs();
            let rounding = if matches!(kind, ShapeKind::Triangle | ShapeKind::Torus) {
                tolerance
            } else {
                64.0 * f64::EPSILON * size + dropped + defined
            };
            assert!(
                off <= rounding,
                "{kind:?} {parameters:?} {ray:?}: surface is off by {off:e}"
            );
        }
        if !solid {
            continue;
        }
        let (expected, clearance) =
            sphere_trace(distance, ray.o, ray.d, 2.0 * reach / norm(ray.d), size);
        if clearance < 1e-5 * size || distance(ray.o).abs() < 1e-5 * size {
            continue;
        }
        // A ray that runs in a face crosses it anywhere.
        let first = hit
            .into_iter()
            .chain(expected)
            .fold(f64::INFINITY, f64::min);
        if distance(ray.at(first + 1e-3 * size / norm(ray.d))).abs() < 1e-12 * size {
            continue;
        }
        match (hit, expected) {
            (None, None) => {}
            (Some(t), Some(expected)) => {
                // The slope of the distance there: how squarely the ray meets the surface.
                let step = 1e-6 * size / norm(ray.d);
                let slope = (distance(ray.at(expected + step)) - distance(ray.at(expected - step)))
                    .abs()
                    / (2.0 * step * norm(ray.d));
                let off = (t - expected).abs() * norm(ray.d) * slope;
                assert!(
                    slope < 1e-3 || off <= 2.0 * tolerance + 1e-11 * size,
                    "{kind:?} {parameters:?} {ray:?}: {t} is not {expected}: off by {off:e}"
                );
            }
            _ => {
                // Only an entry that barely dips below the surface may be disputed.
                let at = hit.or(expected).unwrap();
                let dip = (1..100)
                    .map(|i| {
                        distance(ray.at(at + i as f64 * 1e-4 * size / norm(ray.d)))
                            * distance(ray.o).signum()
                    })
                    .fold(f64::INFINITY, f64::min);
                assert!(
                    dip > -1e-5 * size,
                    "{kind:?} {parameters:?} {ray:?}: {hit:?} is not {expected:?}"
                );
            }
        }
    }
}

fn ends() -> impl Strategy<Value = Vec<([f64; 3], [f64; 3], f64)>> {
    let distance = prop_oneof![3 => Just(0.0), 3 => 1.0..4.0, 1 => 10.0..200.0];
    prop::collection::vec((unit_point(), unit_point(), distance), 40)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, max_shrink_iters: 0, ..ProptestConfig::default() })]

    #[test]
    fn solids_are_hit_where_their_distance_vanishes((kind, parameters) in solid(), ends in ends()) {
        check::<f32>(kind, &parameters, &ends);
        check::<f64>(kind, &parameters, &ends);
    }

    #[test]
    fn flat_shapes_are_hit_where_their_distance_vanishes((kind, parameters) in flat(), ends in ends()) {
        check::<f32>(kind, &parameters, &ends);
        check::<f64>(kind, &parameters, &ends);
    }
}
