//! Traversal against brute force: every way of bundling on every instruction set.
use proptest::prelude::*;

use super::{Bundling, Nearest, Precision};
use crate::lanes::InstructionSet;
use crate::ray::{Found, FoundColumns, Hit, Hits, Ray, Rays, Trace};
use crate::render::rays::RayLists;
use crate::scene::{Affine, Scene, SceneArrays};

/// One-level scenes of instances of a sphere, a box, a plane and a mesh.
#[derive(Clone, Debug)]
struct Instance {
    prototype: i32,
    angle: f64,
    scale: [f64; 3],
    place: [f64; 3],
}

const SPHERE: i32 = 0;
const BOX: i32 = 1;
const MESH: i32 = 2;
const PLANE: i32 = 3;

fn matrices(instance: &Instance, unit: f64) -> (Affine, Affine) {
    let (sin, cos) = (libm::sin(instance.angle), libm::cos(instance.angle));
    let turn = [[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]];
    let place = instance.place.map(|x| x * unit);
    let forward = std::array::from_fn(|i| {
        let entry = |j: usize| turn[i][j] * instance.scale[j] * unit;
        [entry(0), entry(1), entry(2), place[i]]
    });
    let back = std::array::from_fn(|i| {
        let entry = |j: usize| turn[j][i] / (instance.scale[i] * unit);
        let moved = (0..3).map(|j| entry(j) * place[j]).sum::<f64>();
        [entry(0), entry(1), entry(2), -moved]
    });
    (forward, back)
}

fn arrays(instances: &[Instance], unit: f64) -> SceneArrays {
    let (forward, back): (Vec<_>, Vec<_>) = instances
        .iter()
        .map(|instance| matrices(instance, unit))
        .unzip();
    let n = instances.len();
    SceneArrays {
        prototype_kind: vec![0, 1, 11, 7],
        prototype_data: vec![0, 1, 0, 0],
        shape_parameters: vec![1.0, -1.0, -0.5, -0.75, 1.0, 0.5, 0.75, 0.125],
        mesh_ranges: vec![[0, 5, 0, 6]],
        mesh_points: vec![
            [1.0, 0.0, -1.0],
            [-1.0, 1.0, -1.0],
            [-1.0, -1.0, -1.0],
            [0.0, 0.0, 1.0],
            [0.5, 0.9, -0.2],
        ]
        .into(),
        mesh_triangles: vec![
            [0, 1, 2],
            [0, 3, 1],
            [1, 3, 2],
            [2, 3, 0],
            [0, 4, 3],
            [1, 4, 0],
        ]
        .into(),
        group_ranges: vec![[0, n as i64]],
        instance_target: instances
            .iter()
            .map(|i| i.prototype)
            .collect::<Vec<_>>()
            .into(),
        world_from_object: forward.into(),
        object_from_world: back.into(),
        instance_material: vec![-1; n].into(),
        ..SceneArrays::default()
    }
}

/// The instances, and twice a group of the same, turned and smaller.
fn grouped(instances: &[Instance], unit: f64) -> SceneArrays {
    let group = |angle: f64, place: [f64; 3]| Instance {
        prototype: !1,
        angle,
        scale: [0.5, 0.7, 0.4],
        place,
    };
    let mut all = instances.to_vec();
    all.push(group(0.0, [2.0, 0.0, 1.0]));
    all.push(group(1.0, [-1.0, 2.0, 0.0]));
    let root = all.len() as i64;
    all.extend_from_slice(instances);
    SceneArrays {
        group_ranges: vec![[0, root], [root, all.len() as i64]],
        ..arrays(&all, unit)
    }
}

fn scene<F: Precision>(arrays: SceneArrays, set: InstructionSet) -> Scene<F> {
    Scene::new(arrays, set).unwrap()
}

fn lists(rays: &[Ray]) -> RayLists {
    let mut lists = RayLists::default();
    lists.resize(rays.len());
    for (i, ray) in rays.iter().enumerate() {
        lists.set(i, ray);
    }
    lists
}

fn found<F: Precision>(scene: &Scene<F>, rays: Rays, bundling: Bundling) -> Vec<Found> {
    let n = rays.len();
    let (mut t, mut instance, mut primitive) = (vec![0.0; n], vec![0; n], vec![0; n]);
    let columns = FoundColumns {
        t: &mut t,
        instance: &mut instance,
        primitive: &mut primitive,
    };
    scene.batch(rays, bundling, columns);
    (0..n)
        .map(|i| Found {
            t: t[i],
            instance: instance[i],
            primitive: primitive[i],
        })
        .collect()
}

/// Each instance in a scene of its own, the best taken.
fn brute_force<F: Precision>(instances: &[Instance], unit: f64, rays: &[Ray]) -> Vec<Found> {
    let mut best: Vec<Nearest> = rays.iter().map(|ray| Nearest::none(ray.t_max)).collect();
    for (leaf, instance) in instances.iter().enumerate() {
        let alone = arrays(std::slice::from_ref(instance), unit);
        let alone = scene::<F>(alone, InstructionSet::Portable);
        let found = found(&alone, lists(rays).as_rays(), Bundling::Never);
        for (best, found) in best.iter_mut().zip(found) {
            if found.instance == 0 {
                best.offer(found.t, leaf as i64, found.primitive);
            }
        }
    }
    best.iter()
        .zip(rays)
        .map(|(best, ray)| best.found(ray.t_min))
        .collect()
}

fn check<F: Precision>(instances: &[Instance], unit: f64, rays: &[Ray]) {
    let expected = brute_force::<F>(instances, unit, rays);
    for set in InstructionSet::available() {
        let scene = scene::<F>(arrays(instances, unit), set);
        for bundling in [Bundling::Never, Bundling::Always, Bundling::Coherent] {
            let name = set.name();
            let columns = Rays::Columns {
                origins: &rays.iter().map(|ray| ray.origin).collect::<Vec<_>>(),
                directions: &rays.iter().map(|ray| ray.direction).collect::<Vec<_>>(),
                t_min: &[0.0],
                t_max: &rays.iter().map(|ray| ray.t_max).collect::<Vec<_>>(),
            };
            for rays in [lists(rays).as_rays(), columns] {
                assert_eq!(
                    found(&scene, rays, bundling),
                    expected,
                    "{name} {bundling:?}"
                );
                let mut occluded = vec![false; rays.len()];
                scene.batch(rays, bundling, occluded.as_mut_slice());
                let expected: Vec<bool> = expected.iter().map(|hit| hit.instance >= 0).collect();
                assert_eq!(occluded, expected, "{name} {bundling:?}");
            }
        }
    }
}

/// Whichever way rays go into groups, they find the same.
fn check_groups<F: Precision>(instances: &[Instance], rays: &[Ray]) {
    let lists = lists(rays);
    let rays = lists.as_rays();
    let alone = scene::<F>(grouped(instances, 1.0), InstructionSet::Portable);
    let expected = found(&alone, rays, Bundling::Never);
    for set in InstructionSet::available() {
        let scene = scene::<F>(grouped(instances, 1.0), set);
        for bundling in [Bundling::Never, Bundling::Always, Bundling::Coherent] {
            let name = set.name();
            assert_eq!(
                found(&scene, rays, bundling),
                expected,
                "{name} {bundling:?}"
            );
            let mut occluded = vec![false; rays.len()];
            scene.batch(rays, bundling, occluded.as_mut_slice());
            let expected: Vec<bool> = expected.iter().map(|hit| hit.instance >= 0).collect();
            assert_eq!(occluded, expected, "{name} {bundling:?}");
        }
    }
}

fn an_instance() -> impl Strategy<Value = Instance> {
    let scale = prop_oneof![4 => 0.1..2.0f64, 1 => -2.0..-0.1f64, 1 => Just(1e-5)];
    (
        prop_oneof![4 => Just(SPHERE), 4 => Just(BOX), 4 => Just(MESH), 1 => Just(PLANE)],
        prop_oneof![Just(0.0), 0.0..6.3f64],
        [scale.clone(), scale.clone(), scale],
        // Few places, so that some instances coincide.
        [-3i32..4, -3i32..4, -3i32..4],
    )
        .prop_map(|(prototype, angle, scale, place)| Instance {
            prototype,
            angle,
            scale,
            place: place.map(f64::from),
        })
}

fn some_rays() -> impl Strategy<Value = Vec<Ray>> {
    let number = prop_oneof![3 => -5.0..5.0f64, 1 => Just(0.0), 1 => Just(1.0)];
    let vector = [number.clone(), number.clone(), number];
    let ray = (
        vector.clone(),
        vector,
        prop_oneof![3 => Just(f64::INFINITY), 1 => 0.0..9.0f64],
    );
    let ray = ray.prop_map(|(origin, direction, t_max)| Ray {
        origin,
        direction,
        t_min: 0.0,
        t_max,
    });
    prop::collection::vec(ray, 1..40)
}

/// Rays as from a camera, some exactly along an axis.
fn coherent_rays(origin: [f64; 3], towards: [f64; 3], spread: f64) -> Vec<Ray> {
    (0..50)
        .map(|i| {
            let (x, y) = (f64::from(i % 8) - 4.0, f64::from(i / 8) - 4.0);
            Ray {
                origin,
                direction: [towards[0] + spread * x, towards[1] + spread * y, towards[2]],
                t_min: 0.0,
                t_max: f64::INFINITY,
            }
        })
        .collect()
}

/// Rays from one point, and spheres made boxes, which rounded as they are take long to intersect.
fn burst(instances: &[Instance], rays: &[Ray]) -> (Vec<Instance>, Vec<Ray>) {
    let prototype = |of: i32| if of == SPHERE { BOX } else { of };
    let instances = instances.iter().map(|instance| Instance {
        prototype: prototype(instance.prototype),
        ..instance.clone()
    });
    let rays = rays.iter().map(|ray| Ray {
        origin: rays[0].origin,
        ..*ray
    });
    (instances.collect(), rays.collect())
}

fn scaled(rays: &[Ray], unit: f64) -> Vec<Ray> {
    let scale = |v: [f64; 3]| v.map(|x| x * unit);
    rays.iter()
        .map(|ray| Ray {
            origin: scale(ray.origin),
            direction: scale(ray.direction),
            ..*ray
        })
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn any_order_finds_what_brute_force_finds(
        instances in prop::collection::vec(an_instance(), 1..24),
        rays in some_rays(),
        exponent in prop_oneof![Just(0), Just(-100), Just(100)],
    ) {
        let unit = crate::bvh::power_of_two(exponent);
        check::<f32>(&instances, unit, &scaled(&rays, unit));
        check::<f64>(&instances, unit, &scaled(&rays, unit));
        check_groups::<f32>(&instances, &rays);
        check_groups::<f64>(&instances, &rays);
        let (instances, rays) = burst(&instances, &rays);
        check::<f32>(&instances, 1.0, &rays);
        check::<f64>(&instances, 1.0, &rays);
    }

    #[test]
    fn packets_find_what_brute_force_finds(
        instances in prop::collection::vec(an_instance(), 1..24),
        origin in [-9.0..9.0f64, -9.0..9.0, 5.0..9.0],
        spread in prop_oneof![Just(0.0), Just(0.02), Just(0.2)],
        far in prop_oneof![Just(0.0), Just(1e6), Just(1e9)],
    ) {
        let towards = origin.map(|x| -x);
        let mut rays = coherent_rays(origin, towards, spread);
        for ray in &mut rays {
            for i in 0..3 {
                ray.origin[i] -= far * ray.direction[i];
            }
        }
        check::<f32>(&instances, 1.0, &rays);
        check::<f64>(&instances, 1.0, &rays);
        check_groups::<f32>(&instances, &rays);
        check_groups::<f64>(&instances, &rays);
    }
}

#[test]
fn coherent_rays_are_bundled_and_others_are_not() {
    let sphere = Instance {
        prototype: SPHERE,
        angle: 0.0,
        scale: [1.0; 3],
        place: [0.0; 3],
    };
    let scene = scene::<f32>(arrays(&[sphere], 1.0), InstructionSet::Portable);
    let rays = coherent_rays([0.0, 0.0, 9.0], [0.0, 0.0, -9.0], 0.01);
    let are_coherent = |rays: &[Ray]| {
        use crate::lanes::{Isa, Task, dispatch};
        struct Coherent<'a>(&'a [Ray], crate::bvh::NormalSpace);
        impl Task for Coherent<'_> {
            type Output = bool;
            fn run<I: Isa>(self) -> bool {
                super::RayColumns::<I>::new(lists(self.0).as_rays(), 0).are_coherent(&self.1)
            }
        }
        dispatch(scene.set, Coherent(rays, scene.groups[0].tree.space))
    };
    assert!(are_coherent(&rays[..4]));
    let opposite = [
        rays[0],
        Ray {
            direction: [0.0, 0.0, 1.0],
            ..rays[0]
        },
    ];
    assert!(!are_coherent(&opposite));
    let apart = [
        rays[0],
        Ray {
            origin: [15.0, 0.0, 9.0],
            ..rays[0]
        },
    ];
    assert!(!are_coherent(&apart));
}

/// Rays that leave the surface at its offset, outwards and inwards along the normal.
fn leaving(hit: &Hit) -> [Ray; 2] {
    [1.0, -1.0].map(|side| Ray {
        origin: std::array::from_fn(|i| {
            (side * hit.offset).mul_add(hit.normal[i], hit.position[i])
        }),
        direction: hit.normal.map(|x| side * x),
        t_min: 0.0,
        t_max: f64::INFINITY,
    })
}

fn offsets_clear_the_surface<F: Precision>(unit: f64, far: f64) {
    let instance = Instance {
        prototype: SPHERE,
        angle: 0.5,
        scale: [1.0, 3.0, 0.3],
        place: [far, -far, 0.5 * far],
    };
    for prototype in [SPHERE, BOX] {
        let instance = Instance {
            prototype,
            ..instance.clone()
        };
        let scene = scene::<F>(arrays(&[instance], unit), InstructionSet::available()[0]);
        let center = [far, -far, 0.5 * far];
        for i in 0..200 {
            let angle = f64::from(i);
            let away = [
                libm::cos(angle) * 5.0,
                libm::sin(angle) * 5.0,
                f64::from(i % 7) - 3.0,
            ];
            let ray = Ray {
                origin: std::array::from_fn(|i| (center[i] + away[i]) * unit),
                direction: away.map(|x| -x * unit),
                t_min: 0.0,
                t_max: f64::INFINITY,
            };
            let mut hits = Hits::default();
            scene.closest(lists(&[ray]).as_rays(), &mut hits);
            if hits.instance[0] < 0 {
                continue;
            }
            let mut occluded = [false; 2];
            let leaving = lists(&leaving(&hits.get(0)));
            scene.occluded(leaving.as_rays(), &mut occluded);
            assert_eq!(occluded, [false, true], "unit {unit}, far {far}, ray {i}");
        }
    }
}

#[test]
fn rays_leave_surfaces_without_hitting_them_again() {
    for unit in [1e-18, 1.0, 1e18] {
        for far in [0.0, 1e3, 1e9] {
            offsets_clear_the_surface::<f32>(unit, far);
            offsets_clear_the_surface::<f64>(unit, far);
        }
    }
}

/// A unit sphere of triangles, `rows` by 2 `rows`, and how far its faces may lie within it.
fn round_mesh(rows: i32) -> (SceneArrays, f64) {
    let step = std::f64::consts::PI / f64::from(rows);
    let ring = |row: i32| {
        (
            1 + (row - 1) * 2 * rows,
            libm::sincos(f64::from(row) * step),
        )
    };
    let (mut points, mut triangles) = (vec![[0.0, 1.0, 0.0]], Vec::new());
    let pole = 1 + (rows - 1) * 2 * rows;
    for row in 1..=rows {
        let (start, (sin, cos)) = ring(row);
        for i in 0..2 * rows {
            let (next, above) = ((i + 1) % (2 * rows), start - 2 * rows);
            if row < rows {
                let (x, z) = libm::sincos(f64::from(i) * step);
                points.push([sin * x, cos, sin * z]);
                let up = if row == 1 { 0 } else { above + i };
                triangles.push([up, start + i, start + next]);
            }
            if row > 1 {
                let down = if row == rows { pole } else { start + next };
                triangles.push([above + i, down, above + next]);
            }
        }
    }
    points.push([0.0, -1.0, 0.0]);
    let whole = Instance {
        prototype: MESH,
        angle: 0.3,
        scale: [2.0; 3],
        place: [0.5, -1.0, 7.0],
    };
    let arrays = SceneArrays {
        mesh_ranges: vec![[0, points.len() as i64, 0, triangles.len() as i64]],
        mesh_points: points.into(),
        mesh_triangles: triangles.into(),
        ..arrays(&[whole], 1.0)
    };
    // The corners of a triangle lie within step of its middle, on the sphere.
    (arrays, 1.0 - libm::cos(step))
}

fn a_round_mesh_is_nearly_a_sphere<F: Precision>(rays: &[Ray]) {
    let (mesh, depth) = round_mesh(60);
    let sphere = SceneArrays {
        instance_target: vec![SPHERE].into(),
        ..mesh.clone()
    };
    for set in InstructionSet::available() {
        let [mesh, sphere] = [&mesh, &sphere].map(|arrays| scene::<F>(arrays.clone(), set));
        for bundling in [Bundling::Never, Bundling::Always] {
            let flat = found(&mesh, lists(rays).as_rays(), bundling);
            let round = found(&sphere, lists(rays).as_rays(), bundling);
            for (i, ray) in rays.iter().enumerate() {
                // o and d in the sphere's own units: it is hit if they pass within 1 of its middle.
                let o: [f64; 3] = [0, 1, 2].map(|k| 0.5 * (ray.origin[k] - [0.5, -1.0, 7.0][k]));
                let d = ray.direction.map(|x| 0.5 * x);
                let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
                let along = -dot(o, d) / dot(d, d);
                let nearest: [f64; 3] = [0, 1, 2].map(|k| along.mul_add(d[k], o[k]));
                let distance = dot(nearest, nearest).sqrt();
                let hits = [flat[i].instance >= 0, round[i].instance >= 0];
                let start = dot(o, o).sqrt();
                if (start - 1.0 + 0.5 * depth).abs() < 0.5 * depth + 1e-6 {
                    // It starts between the two.
                } else if distance < 1.0 - depth - 1e-6 {
                    assert_eq!(hits, [true; 2], "{ray:?}");
                    let side = if start < 1.0 { -1.0 } else { 1.0 };
                    let lag = side * (flat[i].t - round[i].t) * dot(d, d).sqrt();
                    let half = |radius: f64| (radius * radius - distance * distance).sqrt();
                    let most = half(1.0) - half(1.0 - depth);
                    // Faces at a grazing angle amplify rounding.
                    let grazes = distance > 0.95;
                    assert!(
                        grazes || (-1e-5..most + 1e-5).contains(&lag),
                        "{ray:?} {lag}"
                    );
                } else if distance > 1.0 + 1e-6 {
                    assert_eq!(hits, [false; 2], "{ray:?}");
                }
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 4, failure_persistence: None, max_shrink_iters: 0, ..ProptestConfig::default() })]

    #[test]
    fn round_meshes_are_hit_where_spheres_are(
        ends in prop::collection::vec(([-1.5..1.5f64, -1.5..1.5, -1.5..1.5], 0usize..6950, 0usize..3), 150),
    ) {
        let (mesh, _) = round_mesh(60);
        let corners: &[[f64; 3]] = &mesh.mesh_points;
        let (forward, _) = matrices(&Instance { prototype: MESH, angle: 0.3, scale: [2.0; 3], place: [0.5, -1.0, 7.0] }, 1.0);
        let world = |p: [f64; 3]| forward.map(|[x, y, z, w]| x * p[0] + y * p[1] + z * p[2] + w);
        // From outside and inside, at corners and at the middles between them.
        let rays: Vec<Ray> = ends.into_iter().map(|(from, i, shift)| {
            let (a, b) = (corners[i], corners[i + [0, 1, 120][shift]]);
            let [from, to] = [from, [0, 1, 2].map(|k| 0.5 * (a[k] + b[k]))].map(world);
            Ray { origin: from, direction: [0, 1, 2].map(|k| to[k] - from[k]), t_min: 0.0, t_max: f64::INFINITY }
        }).collect();
        a_round_mesh_is_nearly_a_sphere::<f32>(&rays);
        a_round_mesh_is_nearly_a_sphere::<f64>(&rays);
    }
}

#[test]
fn rays_that_overflow_in_the_space_of_a_tree_end() {
    let small = Instance {
        prototype: MESH,
        angle: 0.0,
        scale: [1.0; 3],
        place: [0.0; 3],
    };
    let past = |distance: f64, direction: [f64; 3]| Ray {
        origin: [distance; 3],
        direction,
        t_min: 0.0,
        t_max: f64::INFINITY,
    };
    let rays: Vec<Ray> = [1e9, 1e12, 1e30, 1e200]
        .into_iter()
        .flat_map(|distance| {
            [[-1.0, -0.0, -0.0], [0.0, -1.0, 1e-40], [1e-300, 0.0, 1.0]]
                .map(|direction| past(distance, direction))
        })
        .collect();
    for set in InstructionSet::available() {
        let scene = scene::<f32>(arrays(std::slice::from_ref(&small), 1.0), set);
        for bundling in [Bundling::Never, Bundling::Always] {
            let found = found(&scene, lists(&rays).as_rays(), bundling);
            assert!(found.iter().all(|found| *found == Found::NOTHING));
        }
    }
}
