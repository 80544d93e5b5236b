//! Sizes, distances, angles and bevels at their limits.
use proptest::prelude::*;

use super::harness::{Precision, Ray, ball_around, flat, solid, trace_everywhere, unit_point};
use crate::shapes::signed_distance::signed_distance;
use crate::shapes::{Shape, ShapeKind};

/// Lengths of a shape times a factor; angles stay.
fn scaled(kind: ShapeKind, parameters: &[f64], factor: f64) -> Vec<f64> {
    let angle = |i: usize| kind == ShapeKind::Wedge && (i == 4 || i == 5);
    parameters
        .iter()
        .enumerate()
        .map(|(i, &x)| if angle(i) { x } else { x * factor })
        .collect()
}

fn rays_around<F: Precision>(shape: &Shape<F>, ends: &[([f64; 3], [f64; 3])]) -> Vec<Ray> {
    let (middle, radius) = ball_around(shape);
    ends.iter()
        .map(|(from, to)| {
            let o = [0, 1, 2].map(|i| middle[i] + 3.0 * radius * from[i]);
            Ray::new(o, [0, 1, 2].map(|i| middle[i] + radius * to[i] - o[i]))
        })
        .filter(|ray| ray.d != [0.0; 3])
        .collect()
}

fn same_at_any_scale<F: Precision>(
    kind: ShapeKind,
    parameters: &[f64],
    ends: &[([f64; 3], [f64; 3])],
) {
    let shape = Shape::<F>::new(kind, parameters).unwrap();
    let rays = rays_around(&shape, ends);
    let hits = trace_everywhere(&shape, &rays);
    for exponent in [-330, -50, 50, 330] {
        let factor = libm::scalbn(1.0, exponent);
        let shape = Shape::<F>::new(kind, &scaled(kind, parameters, factor)).unwrap();
        let rays: Vec<Ray> = rays
            .iter()
            .map(|ray| Ray::new(ray.o.map(|x| x * factor), ray.d.map(|x| x * factor)))
            .collect();
        assert_eq!(
            hits,
            trace_everywhere(&shape, &rays),
            "{kind:?} {parameters:?} times {factor:e}"
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, max_shrink_iters: 0, ..ProptestConfig::default() })]

    #[test]
    fn size_does_not_matter(
        (kind, parameters) in prop_oneof![3 => solid(), 1 => flat().prop_filter("bounded", |shape| shape.0 != ShapeKind::Plane)],
        ends in prop::collection::vec((unit_point(), unit_point()), 20),
    ) {
        same_at_any_scale::<f32>(kind, &parameters, &ends);
        same_at_any_scale::<f64>(kind, &parameters, &ends);
    }

    #[test]
    fn rays_from_afar_hit(
        (kind, parameters) in solid(), ends in prop::collection::vec((unit_point(), unit_point()), 20),
    ) {
        let shape = Shape::<f64>::new(kind, &parameters).unwrap();
        let (middle, radius) = ball_around(&shape);
        let size = 1.0 / shape.frame().scale;
        let rays: Vec<Ray> = ends.iter().filter_map(|(from, to)| {
            let o = [0, 1, 2].map(|i| middle[i] + 1e6 * radius * from[i]);
            let d = [0, 1, 2].map(|i| middle[i] + 0.5 * radius * to[i] - o[i]);
            (d != [0.0; 3]).then_some(Ray::new(o, d))
        }).collect();
        for (ray, hit) in rays.iter().zip(trace_everywhere(&shape, &rays)) {
            if let Some(t) = hit {
                let off = signed_distance(kind, &parameters, ray.at(t)).abs();
                prop_assert!(off < 1e-9 * size, "{:?} {:?} {:?}: off by {:e}", kind, parameters, ray, off);
            }
        }
    }

    #[test]
    fn hits_lie_within_the_bounds(
        (kind, parameters) in solid(), ends in prop::collection::vec((unit_point(), unit_point()), 60),
    ) {
        let shape = Shape::<f64>::new(kind, &parameters).unwrap();
        let [low, high] = shape.bounds().unwrap();
        let slack = 1e-12 / shape.frame().scale;
        let rays = rays_around(&shape, &ends);
        for (ray, hit) in rays.iter().zip(trace_everywhere(&shape, &rays)) {
            if let Some(t) = hit {
                let p = ray.at(t);
                prop_assert!((0..3).all(|i| low[i] - slack <= p[i] && p[i] <= high[i] + slack), "{:?} {:?} {:?}: {:?}", kind, parameters, ray, p);
            }
        }
    }

    #[test]
    fn bounds_touch_the_solid((kind, parameters) in solid()) {
        let shape = Shape::<f64>::new(kind, &parameters).unwrap();
        let [low, high] = shape.bounds().unwrap();
        for axis in 0..3 {
            let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
            let extent = (high[j] - low[j]).max(high[k] - low[k]);
            for face in [low[axis], high[axis]] {
                let mut nearest = f64::INFINITY;
                for a in 0..=60 {
                    for b in 0..=60 {
                        let mut p = [0.0; 3];
                        p[axis] = face;
                        p[j] = low[j] + (high[j] - low[j]) * f64::from(a) / 60.0;
                        p[k] = low[k] + (high[k] - low[k]) * f64::from(b) / 60.0;
                        nearest = nearest.min(signed_distance(kind, &parameters, p));
                    }
                }
                prop_assert!(nearest < extent / 50.0, "{:?} {:?}: bounds off by {} on axis {}", kind, parameters, nearest, axis);
            }
        }
    }

    #[test]
    fn largest_bevels_are_rounder_shapes(ends in prop::collection::vec((unit_point(), unit_point()), 60)) {
        let pairs: [(ShapeKind, &[f64], ShapeKind, &[f64]); 4] = [
            (ShapeKind::Box, &[-1.5, -1.5, -1.5, 1.5, 1.5, 1.5, 1.5], ShapeKind::Sphere, &[1.5]),
            (ShapeKind::Cylinder, &[1.5, -1.5, 1.5, 1.5], ShapeKind::Sphere, &[1.5]),
            (ShapeKind::Ring, &[0.75, 1.75, -0.5, 0.5, 0.5], ShapeKind::Torus, &[1.25, 0.5]),
            (ShapeKind::Torus, &[0.0, 1.5], ShapeKind::Sphere, &[1.5]),
        ];
        for (kind, parameters, rounder, its_parameters) in pairs {
            let shape = Shape::<f64>::new(kind, parameters).unwrap();
            let other = Shape::<f64>::new(rounder, its_parameters).unwrap();
            let rays = rays_around(&other, &ends);
            for (ray, (a, b)) in rays.iter().zip(trace_everywhere(&shape, &rays).into_iter().zip(trace_everywhere(&other, &rays))) {
                match (a, b) {
                    (Some(a), Some(b)) => {
                        let [p, q] = [a, b].map(|t| signed_distance(rounder, its_parameters, ray.at(t)).abs());
                        prop_assert!(p < 1e-14 && q < 1e-14 && (a - b).abs() < 1e-6, "{:?} {:?}: {} {}", kind, ray, a, b);
                    }
                    (None, None) => {}
                    _ => {
                        let graze = signed_distance(rounder, its_parameters, ray.at(a.or(b).unwrap() + 1e-7)).abs();
                        prop_assert!(graze < 1e-9, "{:?} {:?}: {:?} {:?}", kind, ray, a, b);
                    }
                }
            }
        }
    }
}

#[test]
fn the_interval_is_open() {
    for (kind, parameters, t) in [
        (ShapeKind::Sphere, &[1.0][..], [4.0, 6.0]),
        (
            ShapeKind::Box,
            &[-1.0, -1.0, -1.0, 1.0, 1.0, 1.0, 0.25],
            [4.0, 6.0],
        ),
        (ShapeKind::Torus, &[0.0, 1.0], [4.0, 6.0]),
        (ShapeKind::Cone, &[1.0, 1.0, 0.0], [4.0, 5.0]),
    ] {
        let shape = Shape::<f64>::new(kind, parameters).unwrap();
        let ray = Ray::new([0.0, 5.0, 0.0], [0.0, -1.0, 0.0]);
        let within = |t_min: f64, t_max: f64| {
            trace_everywhere(
                &shape,
                &[Ray {
                    t_min,
                    t_max,
                    ..ray
                }],
            )[0]
        };
        let [near, far] =
            [within(0.0, f64::INFINITY), within(4.5, f64::INFINITY)].map(Option::unwrap);
        assert!(
            (near - t[0]).abs() < 1e-15 * 8.0 && (far - t[1]).abs() < 1e-15 * 8.0,
            "{kind:?} {near} {far}"
        );
        assert_eq!(within(0.0, near), None, "{kind:?}");
        assert_eq!(within(0.0, near + 1e-14), Some(near), "{kind:?}");
        assert_eq!(within(far + 1e-14, f64::INFINITY), None, "{kind:?}");
    }
}

#[test]
fn parameters_that_make_no_solid_are_refused() {
    let wrong: [(ShapeKind, &[f64]); 14] = [
        (ShapeKind::Sphere, &[]),
        (ShapeKind::Sphere, &[f64::NAN]),
        (ShapeKind::Sphere, &[-1.0]),
        (ShapeKind::Sphere, &[0.0]),
        (ShapeKind::Sphere, &[1e200]),
        (ShapeKind::Box, &[0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 0.6]),
        (
            ShapeKind::Box,
            &[0.0, 0.0, 0.0, 1.0, 1.0, f64::INFINITY, 0.0],
        ),
        (ShapeKind::Cylinder, &[1.0, 0.0, 1.0, 0.6]),
        (ShapeKind::Cone, &[1.0, 1.0, 0.5]),
        (ShapeKind::Torus, &[1.0, 0.0]),
        (ShapeKind::Ring, &[1.0, 0.5, 0.0, 1.0, 0.0]),
        (ShapeKind::Wedge, &[1.0, 2.0, 0.0, 1.0, 0.0, 360.0, 0.0]),
        (ShapeKind::Wedge, &[1.0, 2.0, 0.0, 1.0, 10.0, 10.0, 0.0]),
        (ShapeKind::Wedge, &[0.1, 2.0, 0.0, 1.0, 0.0, 20.0, 0.4]),
    ];
    for (kind, parameters) in wrong {
        assert!(
            Shape::<f32>::new(kind, parameters).is_err(),
            "{kind:?} {parameters:?}"
        );
        assert!(
            Shape::<f64>::new(kind, parameters).is_err(),
            "{kind:?} {parameters:?}"
        );
    }
}
