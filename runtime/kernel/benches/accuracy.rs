//! What accuracy costs: each intersector in f64 against itself in f32, and three against the
//! textbook's, in one run and on the same rays. `cargo bench`.
//!
//! An error is that of t against f64, along the normal, in eps of the shape's size: what rounding
//! one number of unit size costs is one.
use std::hint::black_box;
use std::time::Instant;

use _kernel::lanes::{InstructionSet, Isa, Lanes, Mask, Task, dispatch};
use _kernel::scalar::Scalar;
use _kernel::shapes::{RayLanes, Shape, ShapeKind, TriangleRays};

const RAYS: usize = 1 << 12;
const ROUNDS: usize = 15;

/// A fixed sequence of numbers in [-1, 1).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        f64::from((self.0 >> 40) as i32 - (1 << 23)) / f64::from(1 << 23)
    }
}

type Rays = [[[f64; 3]; 2]];

/// Rays to points that `towards` makes of three numbers in [-1, 1), from `distance` directions
/// before them; all run mostly along one axis, as those of a packet do.
fn rays(distance: f64, towards: impl Fn([f64; 3]) -> [f64; 3]) -> Vec<[[f64; 3]; 2]> {
    let mut numbers = Numbers(5);
    (0..RAYS)
        .map(|_| {
            let d = [0.0, 1.0, 0.0].map(|x| f64::from((x + 0.25 * numbers.next()) as f32));
            let to = towards([0; 3].map(|_| numbers.next()));
            let o = [0, 1, 2].map(|i| to[i] - distance * d[i]);
            [o.map(|x| f64::from(x as f32)), d]
        })
        .collect()
}

/// A way to intersect W rays.
trait Way<F> {
    fn meet<I: Isa, L: Lanes<Scalar = F>>(&self, ray: &RayLanes<L>) -> (L::Mask, L);
}

struct Ours<'a, F>(&'a Shape<F>);

impl<F: Scalar> Way<F> for Ours<'_, F> {
    #[inline(always)]
    fn meet<I: Isa, L: Lanes<Scalar = F>>(&self, ray: &RayLanes<L>) -> (L::Mask, L) {
        self.0.intersect::<I, L>(ray, L::Mask::full())
    }
}

#[inline(always)]
fn dot<L: Lanes>(a: [L; 3], b: [L; 3]) -> L {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn cross<L: Lanes>(a: [L; 3], b: [L; 3]) -> [L; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[inline(always)]
fn minus<L: Lanes>(a: [L; 3], b: [L; 3]) -> [L; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// The unit sphere by b² − ac.
struct TextbookSphere;

impl<F: Scalar> Way<F> for TextbookSphere {
    #[inline(always)]
    fn meet<I: Isa, L: Lanes<Scalar = F>>(&self, ray: &RayLanes<L>) -> (L::Mask, L) {
        let (a, b) = (dot(ray.d, ray.d), dot(ray.o, ray.d));
        let c = dot(ray.o, ray.o) - L::splat(F::ONE);
        let room = b * b - a * c;
        let (near, far) = ((-b - room.sqrt()) / a, (-b + room.sqrt()) / a);
        let t = L::select(near.gt(ray.t_min), near, far);
        (room.ge(L::zero()) & ray.accepts(t), t)
    }
}

type Corners = [[f64; 3]; 3];
const CORNERS: Corners = [[-1.0, 0.25, 0.125], [1.25, -0.5, 0.25], [0.125, 0.25, 1.75]];
/// It shares the edge from the first to the second corner.
const NEIGHBOUR: Corners = [CORNERS[1], CORNERS[0], [0.25, 0.5, -1.5]];
/// Triangles that a ray meets on its way, all the same one: ours prepares each ray once.
const MET: usize = 16;

/// The triangle by Möller and Trumbore.
struct TextbookTriangle(Corners);

impl<F: Scalar> Way<F> for TextbookTriangle {
    #[inline(always)]
    fn meet<I: Isa, L: Lanes<Scalar = F>>(&self, ray: &RayLanes<L>) -> (L::Mask, L) {
        let mut found = (L::Mask::none(), L::zero());
        for _ in 0..MET {
            let corners = black_box(&self.0);
            let mut at = [[L::zero(); 3]; 3];
            for i in 0..9 {
                at[i / 3][i % 3] = L::splat(F::from_f64(corners[i / 3][i % 3]));
            }
            let (e1, e2) = (minus(at[1], at[0]), minus(at[2], at[0]));
            let (p, from) = (cross(ray.d, e2), minus(ray.o, at[0]));
            let (q, inverse) = (cross(from, e1), L::splat(F::ONE) / dot(e1, p));
            let (u, v) = (dot(from, p) * inverse, dot(ray.d, q) * inverse);
            let (zero, t) = (L::zero(), dot(e2, q) * inverse);
            let within = u.ge(zero) & v.ge(zero) & (u + v).le(L::splat(F::ONE));
            let hit = within & ray.accepts(t);
            found = (found.0 | hit, L::select(hit, t, found.1));
        }
        found
    }
}

/// The triangle without cracks, as meshes are traced.
struct Watertight(Corners);

impl<F: Scalar> Way<F> for Watertight {
    #[inline(always)]
    fn meet<I: Isa, L: Lanes<Scalar = F>>(&self, ray: &RayLanes<L>) -> (L::Mask, L) {
        let prepared = TriangleRays::new(ray);
        let mut found = (L::Mask::none(), L::zero());
        for _ in 0..MET {
            let corners = black_box(&self.0).map(|corner| corner.map(F::from_f64));
            let (hit, t) = prepared.intersect_any_axis(&corners, L::Mask::full());
            found = (found.0 | hit, L::select(hit, t, found.1));
        }
        found
    }
}

/// Nanoseconds a ray, the best of many rounds, and the hits.
type Hits = (f64, Vec<Option<f64>>);

#[inline(always)]
fn timed<I: Isa, L: Lanes>(way: &impl Way<L::Scalar>, rays: &Rays) -> Hits {
    let packets: Vec<RayLanes<L>> = rays
        .chunks_exact(L::WIDTH)
        .map(|rays| {
            let [o, d] = [0, 1].map(|part| {
                [0, 1, 2].map(|k| L::from_fn(|i| L::Scalar::from_f64(rays[i][part][k])))
            });
            let (t_min, t_max) = (L::zero(), L::splat(L::Scalar::INFINITY));
            RayLanes { o, d, t_min, t_max }
        })
        .collect();
    let (mut best, mut hits) = (f64::INFINITY, Vec::new());
    for _ in 0..ROUNDS {
        hits.clear();
        let start = Instant::now();
        for ray in &packets {
            hits.push(black_box(way.meet::<I, L>(black_box(ray))));
        }
        best = best.min(start.elapsed().as_secs_f64() * 1e9 / rays.len() as f64);
    }
    let told = hits
        .iter()
        .flat_map(|&(hit, t)| {
            (0..L::WIDTH).map(move |i| (hit.bits() >> i & 1 != 0).then(|| t.get(i).to_f64()))
        })
        .collect();
    (best, told)
}

/// In f32.
struct Single<'a, W>(W, &'a Rays);

impl<W: Way<f32>> Task for Single<'_, W> {
    type Output = Hits;
    #[inline(always)]
    fn run<I: Isa>(self) -> Hits {
        timed::<I, I::F32>(&self.0, self.1)
    }
}

/// In f64.
struct Double<'a, W>(W, &'a Rays);

impl<W: Way<f64>> Task for Double<'_, W> {
    type Output = Hits;
    #[inline(always)]
    fn run<I: Isa>(self) -> Hits {
        timed::<I, I::F64>(&self.0, self.1)
    }
}

/// How many rays only one of them hits, and the worst error of those that both do.
fn compare(
    told: &[Option<f64>],
    truth: &[Option<f64>],
    shape: &Shape<f64>,
    rays: &Rays,
) -> (usize, f64) {
    let (mut wrong, mut worst) = (0, 0.0f64);
    for ((told, truth), [o, d]) in told.iter().zip(truth).zip(rays) {
        let (Some(told), Some(truth)) = (told, truth) else {
            wrong += usize::from(told.is_some() != truth.is_some());
            continue;
        };
        let p = [0, 1, 2].map(|i| truth * d[i] + o[i]);
        let (_, n) = shape.surface(p, p, 0.0);
        let facing = (0..3).map(|i| n[i] * d[i]).sum::<f64>().abs();
        worst = worst.max((told - truth).abs() * facing * 2f64.powi(24));
    }
    (wrong, worst)
}

fn main() {
    let set = InstructionSet::available()[0];
    println!(
        "{}, {RAYS} rays; ns a ray: float32, float64, ratio",
        set.name()
    );
    let around = |p: [f64; 3]| p.map(|x| 1.2 * x);
    let near = rays(1.5, around);
    let solids: [(&str, ShapeKind, &[f64]); 12] = [
        ("sphere", ShapeKind::Sphere, &[1.0]),
        (
            "box",
            ShapeKind::Box,
            &[-1.0, -0.75, -0.5, 1.0, 0.75, 0.5, 0.0],
        ),
        ("cylinder", ShapeKind::Cylinder, &[1.0, -0.75, 0.75, 0.0]),
        ("cone", ShapeKind::Cone, &[1.0, 1.5, 0.0]),
        ("torus", ShapeKind::Torus, &[1.0, 0.375]),
        ("thin torus", ShapeKind::Torus, &[1.0, 0.001]),
        (
            "wedge",
            ShapeKind::Wedge,
            &[0.5, 1.25, -0.5, 0.5, -70.0, 40.0, 0.0],
        ),
        (
            "bevelled box",
            ShapeKind::Box,
            &[-1.0, -0.75, -0.5, 1.0, 0.75, 0.5, 0.125],
        ),
        (
            "bevelled cylinder",
            ShapeKind::Cylinder,
            &[1.0, -0.75, 0.75, 0.125],
        ),
        ("bevelled cone", ShapeKind::Cone, &[1.0, 1.5, 0.125]),
        (
            "bevelled ring",
            ShapeKind::Ring,
            &[0.5, 1.25, -0.5, 0.5, 0.125],
        ),
        (
            "bevelled wedge",
            ShapeKind::Wedge,
            &[0.5, 1.25, -0.5, 0.5, -70.0, 40.0, 0.125],
        ),
    ];
    for (name, kind, parameters) in solids {
        let (single, double) = (
            Shape::<f32>::new(kind, parameters),
            Shape::<f64>::new(kind, parameters),
        );
        let (Ok(single), Ok(double)) = (single, double) else {
            panic!("{name} is no solid");
        };
        let (f32_ns, _) = dispatch(set, Single(Ours(&single), &near));
        let (f64_ns, _) = dispatch(set, Double(Ours(&double), &near));
        println!(
            "| {name} | {f32_ns:.2} | {f64_ns:.2} | {:.2} |",
            f64_ns / f32_ns
        );
    }
    println!("float32, ours against the textbook's: ns, ratio; rays wrong, worst error in eps");
    for distance in [1.5, 30.0, 1000.0] {
        let rays = rays(distance, around);
        let (Ok(single), Ok(double)) = (
            Shape::<f32>::new(ShapeKind::Sphere, &[1.0]),
            Shape::<f64>::new(ShapeKind::Sphere, &[1.0]),
        ) else {
            panic!("no sphere");
        };
        let (_, truth) = dispatch(set, Double(Ours(&double), &rays));
        let ours = dispatch(set, Single(Ours(&single), &rays));
        let theirs = dispatch(set, Single(TextbookSphere, &rays));
        report("sphere", distance, &ours, &theirs, &truth, &double, &rays);
        let corners = CORNERS.concat();
        let Ok(double) = Shape::<f64>::new(ShapeKind::Triangle, &corners) else {
            panic!("no triangle");
        };
        let (_, truth) = dispatch(set, Double(Watertight(CORNERS), &rays));
        let ours = dispatch(set, Single(Watertight(CORNERS), &rays));
        let theirs = dispatch(set, Single(TextbookTriangle(CORNERS), &rays));
        report("triangle", distance, &ours, &theirs, &truth, &double, &rays);
    }
    let edge = rays(1.5, |[x, ..]| {
        [0, 1, 2].map(|i| 0.5 * ((1.0 - x) * CORNERS[0][i] + (1.0 + x) * CORNERS[1][i]))
    });
    let both = [CORNERS, NEIGHBOUR];
    let ours = both.map(|corners| dispatch(set, Single(Watertight(corners), &edge)).1);
    let theirs = both.map(|corners| dispatch(set, Single(TextbookTriangle(corners), &edge)).1);
    let lost = [ours, theirs].map(|[one, other]| {
        one.iter()
            .zip(other)
            .filter(|(one, other)| one.is_none() && other.is_none())
            .count()
    });
    println!("rays aimed at a shared edge that slip through: {lost:?}");
}

fn report(
    name: &str,
    distance: f64,
    ours: &Hits,
    theirs: &Hits,
    truth: &[Option<f64>],
    shape: &Shape<f64>,
    rays: &Rays,
) {
    let [(wrong, worst), (their_wrong, their_worst)] =
        [ours, theirs].map(|told| compare(&told.1, truth, shape, rays));
    println!(
        "| {name}, {distance} directions away | {:.2} against {:.2} | {:.2} | {wrong} {worst:.1} | {their_wrong} {their_worst:.1} |",
        ours.0,
        theirs.0,
        ours.0 / theirs.0
    );
}
