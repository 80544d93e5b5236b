//! How exact f32 is: against f64 on the same rays, in units of what rounding the inputs costs.
//!
//! One unit is eps (c + |t|), where c is how far t moves when each number of ray and shape moves by
//! its rounding: (Σ |n_i o_i| + |t| Σ |n_i d_i| + size) / |n·d|.
use super::harness::{Ray, trace};
use crate::lanes::InstructionSet;
use crate::shapes::{Shape, ShapeKind};

/// A fixed sequence of numbers in [-1, 1), exact in f32.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        f64::from((self.0 >> 40) as i32 - (1 << 23)) / f64::from(1 << 23)
    }

    fn point(&mut self, scale: f64) -> [f64; 3] {
        [0; 3].map(|_| f64::from((self.next() * scale) as f32))
    }
}

/// What two precisions make of the same rays: units of t in increasing order, and how many rays only
/// one of them says hit.
fn units(single: &Shape<f32>, double: &Shape<f64>, rays: &[Ray]) -> (Vec<f64>, usize) {
    let set = InstructionSet::available()[0];
    let (mut units, mut wrong) = (Vec::new(), 0);
    for ((ray, a), b) in rays
        .iter()
        .zip(trace(set, single, rays))
        .zip(trace(set, double, rays))
    {
        let eps = f64::from(f32::EPSILON) / 2.0;
        let (Some(a), Some(b)) = (a, b) else {
            wrong += usize::from(a.is_some() != b.is_some());
            continue;
        };
        let p = ray.at(b);
        let (_, n) = double.surface(p, p, 0.0);
        let sum = |v: [f64; 3]| (0..3).map(|i| (n[i] * v[i]).abs()).sum::<f64>();
        let facing = (0..3).map(|i| n[i] * ray.d[i]).sum::<f64>().abs();
        let c = (sum(ray.o) + b * sum(ray.d) + 1.0) / facing;
        units.push((a - b).abs() / (eps * (c + b)));
    }
    units.sort_by(f64::total_cmp);
    (units, wrong)
}

/// Rays that meet the surface where others do, but at an angle of 1/100.
fn grazing(double: &Shape<f64>, rays: &[Ray]) -> Vec<Ray> {
    let hits = trace(InstructionSet::available()[0], double, rays);
    let single = |v: [f64; 3]| v.map(|x| f64::from(x as f32));
    rays.iter()
        .zip(hits)
        .filter_map(|(ray, t)| {
            let p = ray.at(t?);
            let (_, n) = double.surface(p, p, 0.0);
            let facing = (0..3).map(|i| n[i] * ray.d[i]).sum::<f64>();
            let d = [0, 1, 2].map(|i| ray.d[i] - facing * n[i]);
            let length = d[0].hypot(d[1]).hypot(d[2]);
            let d = [0, 1, 2].map(|i| d[i] / length - 0.01 * n[i]);
            Some(Ray::new(single([0, 1, 2].map(|i| p[i] - d[i])), single(d)))
        })
        .collect()
}

#[test]
fn single_precision_is_exact_to_a_few_units() {
    let cases: [(ShapeKind, &[f64]); 19] = [
        (ShapeKind::Sphere, &[1.3]),
        (ShapeKind::Box, &[-1.1, -0.7, -1.3, 0.9, 0.3, 1.2, 0.0]),
        (ShapeKind::Cylinder, &[1.1, -0.7, 0.9, 0.0]),
        (ShapeKind::Cone, &[0.9, 1.7, 0.0]),
        (ShapeKind::Torus, &[1.1, 0.4]),
        (ShapeKind::Torus, &[1.1, 0.0275]),
        (ShapeKind::Torus, &[1.1, 1e-3]),
        (ShapeKind::Disc, &[1.1]),
        (ShapeKind::Rectangle, &[2.2, 1.3]),
        (
            ShapeKind::Triangle,
            &[-1.0, 0.3, 0.1, 1.2, -0.4, 0.2, 0.1, 0.3, 1.7],
        ),
        (ShapeKind::Ring, &[0.6, 1.3, -0.5, 0.8, 0.0]),
        (ShapeKind::Wedge, &[0.6, 1.3, -0.5, 0.8, -70.0, 40.0, 0.0]),
        (ShapeKind::Wedge, &[0.6, 1.3, -0.5, 0.8, -70.0, 240.0, 0.0]),
        (ShapeKind::Box, &[-1.1, -0.7, -1.3, 0.9, 0.3, 1.2, 0.2]),
        (ShapeKind::Cylinder, &[1.1, -0.7, 0.9, 0.2]),
        (ShapeKind::Cone, &[0.9, 1.7, 0.2]),
        (ShapeKind::Ring, &[0.6, 1.3, -0.5, 0.8, 0.2]),
        (ShapeKind::Wedge, &[0.6, 1.3, -0.5, 0.8, -70.0, 40.0, 0.2]),
        (ShapeKind::Wedge, &[0.6, 1.3, -0.5, 0.8, -70.0, 240.0, 1e-5]),
    ];
    println!("units of t, f32 against f64: hits, wrong, median, worst; the same at grazing angles");
    let mut failures = Vec::new();
    for (kind, parameters) in cases {
        let single = Shape::<f32>::new(kind, parameters).unwrap();
        let double = Shape::<f64>::new(kind, parameters).unwrap();
        assert_eq!(
            single.frame().scale,
            1.0,
            "{kind:?} {parameters:?} is not of unit size"
        );
        let mut numbers = Numbers(7);
        let rays: Vec<Ray> = (0..20_000)
            .map(|_| Ray::new(numbers.point(2.0), numbers.point(1.0)))
            .collect();
        let mut line = format!("{kind:?} {parameters:?}");
        for rays in [&rays, &grazing(&double, &rays)] {
            let (units, wrong) = units(&single, &double, rays);
            let (median, worst) = (units[units.len() / 2], units[units.len() - 1]);
            line += &format!(" | {:5} {wrong} {median:5.2} {worst:6.2}", units.len());
            if median > 1.0 || worst > 16.0 || wrong > 3 {
                failures.push(line.clone());
            }
        }
        println!("{line}");
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

#[test]
fn single_precision_is_exact_near_the_tips_of_cones() {
    let parameters = [0.9, 1.35, 0.0];
    let single = Shape::<f32>::new(ShapeKind::Cone, &parameters).unwrap();
    let double = Shape::<f64>::new(ShapeKind::Cone, &parameters).unwrap();
    let mut numbers = Numbers(11);
    let rays: Vec<Ray> = (0..20_000)
        .map(|i| {
            let near = numbers.point([1e-1, 1e-2, 1e-3, 1e-4][i % 4]);
            let d = numbers.point(1.0);
            let o = [near[0] - d[0], near[1] + 1.35 - d[1], near[2] - d[2]];
            Ray::new(o.map(|x| f64::from(x as f32)), d)
        })
        .collect();
    let (units, _) = units(&single, &double, &rays);
    let (median, worst) = (units[units.len() / 2], units[units.len() - 1]);
    println!("tip: {} {median} {worst}", units.len());
    assert!(units.len() > 5000 && median < 1.0 && worst < 16.0);
}
