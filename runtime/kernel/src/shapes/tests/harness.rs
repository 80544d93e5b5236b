//! Tracing object-space rays as the scene does, and random shapes to trace.
use proptest::prelude::*;

use crate::lanes::{InstructionSet, Isa, Lanes, Mask, Task, dispatch};
use crate::scalar::Scalar;
use crate::shapes::{RayLanes, Shape, ShapeKind};

/// A ray in object space.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    pub o: [f64; 3],
    pub d: [f64; 3],
    pub t_min: f64,
    pub t_max: f64,
}

impl Ray {
    /// From o on.
    pub fn new(o: [f64; 3], d: [f64; 3]) -> Ray {
        Ray {
            o,
            d,
            t_min: 0.0,
            t_max: f64::INFINITY,
        }
    }

    pub fn at(&self, t: f64) -> [f64; 3] {
        [0, 1, 2].map(|i| t.mul_add(self.d[i], self.o[i]))
    }
}

/// The widest lanes of a precision.
pub trait Precision: Scalar {
    type Widest<I: Isa>: Lanes<Scalar = Self>;
}
impl Precision for f32 {
    type Widest<I: Isa> = I::F32;
}
impl Precision for f64 {
    type Widest<I: Isa> = I::F64;
}

struct Trace<'a, F> {
    shape: &'a Shape<F>,
    rays: &'a [Ray],
}

impl<F: Precision> Task for Trace<'_, F> {
    type Output = Vec<Option<f64>>;

    #[inline(always)]
    fn run<I: Isa>(self) -> Vec<Option<f64>> {
        let mut hits = Vec::new();
        for rays in self.rays.chunks(F::Widest::<I>::WIDTH) {
            let local: Vec<_> = rays
                .iter()
                .map(|ray| to_shape_space(self.shape, ray))
                .collect();
            let lanes = |pick: &dyn Fn(&(Ray, f64, f64)) -> f64| {
                F::Widest::<I>::from_fn(|i| F::from_f64(pick(&local[i.min(rays.len() - 1)])))
            };
            let ray = RayLanes {
                o: [0, 1, 2].map(|k| lanes(&|ray| ray.0.o[k])),
                d: [0, 1, 2].map(|k| lanes(&|ray| ray.0.d[k])),
                t_min: lanes(&|ray| ray.0.t_min),
                t_max: lanes(&|ray| ray.0.t_max),
            };
            let (hit, t) = self.shape.intersect::<I, _>(&ray, Mask::first(rays.len()));
            hits.extend(local.iter().enumerate().map(|(i, &(_, slide, rate))| {
                (hit.bits() >> i & 1 != 0).then(|| slide + t.get(i).to_f64() * rate)
            }));
        }
        hits
    }
}

/// The ray in shape space, slid to its closest approach in f64; then t = slide + t_local·rate.
fn to_shape_space<F: Scalar>(shape: &Shape<F>, ray: &Ray) -> (Ray, f64, f64) {
    let frame = shape.frame();
    let largest = ray.d.iter().fold(0.0, |a: f64, x| a.max(x.abs()));
    let unit = libm::scalbn(1.0, -libm::ilogb(largest));
    let d = ray.d.map(|x| x * unit);
    let o = frame.shape_from_object(ray.o);
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    // o is in shape units, so is t·d of the ray with direction d.
    let slide = -dot(o, d) / dot(d, d);
    let slide = if slide.abs() > 2.0 { slide } else { 0.0 };
    let rate = unit / frame.scale;
    let local = Ray {
        o: [0, 1, 2].map(|i| slide.mul_add(d[i], o[i])),
        d,
        t_min: ray.t_min / rate - slide,
        t_max: ray.t_max / rate - slide,
    };
    (local, slide * rate, rate)
}

/// Hits of rays with a shape on an instruction set, in object space.
pub fn trace<F: Precision>(
    set: InstructionSet,
    shape: &Shape<F>,
    rays: &[Ray],
) -> Vec<Option<f64>> {
    dispatch(set, Trace { shape, rays })
}

/// Hits on the best instruction set, after checking that all others agree to the bit.
pub fn trace_everywhere<F: Precision>(shape: &Shape<F>, rays: &[Ray]) -> Vec<Option<f64>> {
    let sets = InstructionSet::available();
    let hits = trace(sets[0], shape, rays);
    for &set in &sets[1..] {
        let others = trace(set, shape, rays);
        for (i, (a, b)) in hits.iter().zip(&others).enumerate() {
            assert_eq!(
                a.map(f64::to_bits),
                b.map(f64::to_bits),
                "{}: {:?} {a:?} {b:?}",
                set.name(),
                rays[i]
            );
        }
    }
    hits
}

fn length() -> impl Strategy<Value = f64> {
    prop_oneof![0.1..2.0, 0.01..20.0]
}

/// A fraction of the largest bevel: none, the largest, tiny, or any.
pub fn bevel(limit: f64) -> impl Strategy<Value = f64> {
    prop_oneof![
        2 => Just(0.0),
        1 => Just(limit),
        1 => Just(1e-9 * limit),
        1 => Just(1e-4 * limit),
        4 => (0.01..1.0).prop_map(move |share| share * limit),
    ]
}

fn angles() -> impl Strategy<Value = [f64; 2]> {
    let span = prop_oneof![
        prop::sample::select(vec![
            359.999, 180.0, 90.0, 270.0, 0.5, 60.0, 181.0, 179.0, 350.0
        ]),
        5.0..355.0,
    ];
    let start = prop_oneof![
        prop::sample::select(vec![0.0, 90.0, -45.0, 720.0]),
        -400.0..400.0
    ];
    (start, span).prop_map(|(start, span)| [start, start + span])
}

/// The largest bevel of a wedge.
pub fn wedge_limit(r: [f64; 2], height: f64, span: f64) -> f64 {
    let sine = crate::shapes::angle::sin_cos_degrees(0.5 * span.min(180.0)).0;
    let limit = (0.5 * (r[1] - r[0])).min(0.5 * height);
    if sine < 1.0 {
        limit.min(r[0] * sine / (1.0 - sine) * (1.0 - 1e-12))
    } else {
        limit
    }
}

/// A solid and its parameters.
pub fn solid() -> impl Strategy<Value = (ShapeKind, Vec<f64>)> {
    let sphere = length().prop_map(|r| (ShapeKind::Sphere, vec![r]));
    let cuboid = (
        [-3.0..3.0, -3.0..3.0, -3.0..3.0],
        [length(), length(), length()],
    )
        .prop_flat_map(|(low, size)| {
            let high = [0, 1, 2].map(|i| low[i] + size[i]);
            let least = (0..3)
                .map(|i| high[i] - low[i])
                .fold(f64::INFINITY, f64::min);
            bevel(0.5 * least).prop_map(move |b| {
                (
                    ShapeKind::Box,
                    vec![low[0], low[1], low[2], high[0], high[1], high[2], b],
                )
            })
        });
    let cylinder = (length(), -3.0..3.0, length()).prop_flat_map(|(r, y0, height)| {
        let y1: f64 = y0 + height;
        bevel(r.min(0.5 * (y1 - y0))).prop_map(move |b| (ShapeKind::Cylinder, vec![r, y0, y1, b]))
    });
    let cone = (length(), length()).prop_flat_map(|(r, h)| {
        bevel(r * h / (r + r.hypot(h)) * (1.0 - 1e-12))
            .prop_map(move |b| (ShapeKind::Cone, vec![r, h, b]))
    });
    let torus = (
        length(),
        prop_oneof![0.01..1.0, Just(1.0), 1.0..1.5, Just(1e-3)],
    )
        .prop_map(|(major, share)| (ShapeKind::Torus, vec![major, major * share]));
    let ring = (length(), length(), -3.0..3.0, length()).prop_flat_map(|(r0, wall, y0, height)| {
        let (r1, y1): (f64, f64) = (r0 + wall, y0 + height);
        bevel(0.5 * (r1 - r0).min(y1 - y0))
            .prop_map(move |b| (ShapeKind::Ring, vec![r0, r1, y0, y1, b]))
    });
    let wedge = (length(), length(), -3.0..3.0, length(), angles()).prop_flat_map(
        |(r0, wall, y0, height, [phi0, phi1])| {
            let (r1, y1): (f64, f64) = (r0 + wall, y0 + height);
            bevel(wedge_limit([r0, r1], y1 - y0, phi1 - phi0))
                .prop_map(move |b| (ShapeKind::Wedge, vec![r0, r1, y0, y1, phi0, phi1, b]))
        },
    );
    prop_oneof![1 => sphere, 2 => cuboid, 2 => cylinder, 3 => cone, 3 => torus, 3 => ring, 4 => wedge]
}

/// A flat shape and its parameters.
pub fn flat() -> impl Strategy<Value = (ShapeKind, Vec<f64>)> {
    prop_oneof![
        length().prop_map(|r| (ShapeKind::Disc, vec![r])),
        (length(), length()).prop_map(|(a, b)| (ShapeKind::Rectangle, vec![a, b])),
        Just((ShapeKind::Plane, vec![])),
        prop::collection::vec(-2.0..2.0, 9).prop_map(|corners| (ShapeKind::Triangle, corners)),
    ]
}

/// Points in the cube [-1, 1]³ to be scaled to a shape's bounds, some with zeros.
pub fn unit_point() -> impl Strategy<Value = [f64; 3]> {
    let number = || prop_oneof![6 => -1.0..1.0, 1 => Just(0.0)];
    [number(), number(), number()]
}

/// Middle and half the diagonal of a shape's bounds.
pub fn ball_around<F: Scalar>(shape: &Shape<F>) -> ([f64; 3], f64) {
    let [low, high] = shape.bounds().unwrap_or([[-1.0; 3], [1.0; 3]]);
    let middle = [0, 1, 2].map(|i| 0.5 * (low[i] + high[i]));
    (
        middle,
        [0, 1, 2]
            .iter()
            .map(|&i| (high[i] - low[i]).powi(2))
            .sum::<f64>()
            .sqrt()
            / 2.0,
    )
}
