//! How exact f32 is: against f64 on the same rays, in units of what rounding the inputs costs.
//!
//! One unit is eps (c + |t|), where c is how far t moves when each number of ray and shape moves by its rounding:
//! (Σ |n_i o_i| + |t| Σ |n_i d_i| + size) / |n·d|.
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

/// Units of many hits, in increasing order, and how many rays the precisions disagree on.
fn units(kind: ShapeKind, parameters: &[f64]) -> (Vec<f64>, usize) {
    let (single, double) = (
        Shape::<f32>::new(kind, parameters).unwrap(),
        Shape::<f64>::new(kind, parameters).unwrap(),
    );
    assert_eq!(
        single.frame().scale,
        1.0,
        "{kind:?} {parameters:?} is not of unit size"
    );
    let mut numbers = Numbers(7);
    let rays: Vec<Ray> = (0..20_000)
        .map(|_| Ray::new(numbers.point(2.0), numbers.point(1.0)))
        .collect();
    let set = InstructionSet::available()[0];
    let (mut units, mut wrong) = (Vec::new(), 0);
    for ((ray, a), b) in rays
        .iter()
        .zip(trace(set, &single, &rays))
        .zip(trace(set, &double, &rays))
    {
        let eps = f64::from(f32::EPSILON) / 2.0;
        let (Some(a), Some(b)) = (a, b) else {
            wrong += usize::from(a.is_some() != b.is_some());
            continue;
        };
        let (_, n) = double.surface(ray.at(b));
        let sum = |v: [f64; 3]| (0..3).map(|i| (n[i] * v[i]).abs()).sum::<f64>();
        let facing = (0..3).map(|i| n[i] * ray.d[i]).sum::<f64>().abs();
        let c = (sum(ray.o) + b * sum(ray.d) + 1.0) / facing;
        units.push((a - b).abs() / (eps * (c + b)));
    }
    units.sort_by(f64::total_cmp);
    (units, wrong)
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
    println!(
        "{:44} {:>6} {:>7} {:>7} {:>7}",
        "units of t, f32 against f64", "hits", "median", "p99", "worst"
    );
    let mut failures = Vec::new();
    for (kind, parameters) in cases {
        let (units, wrong) = units(kind, parameters);
        let at = |share: f64| units[((units.len() - 1) as f64 * share) as usize];
        let name = format!("{kind:?} {parameters:?}");
        println!(
            "{name:44} {:6} {:7.2} {:7.2} {:7.2}",
            units.len(),
            at(0.5),
            at(0.99),
            at(1.0)
        );
        if at(0.5) > 1.0 || at(1.0) > 16.0 || wrong > 3 {
            failures.push(format!(
                "{name}: median {}, worst {}, {wrong} wrong",
                at(0.5),
                at(1.0)
            ));
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}
