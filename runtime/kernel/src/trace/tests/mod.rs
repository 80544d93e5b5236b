//! Traversal against brute force: every way of bundling on every instruction set.
mod leaving;
mod round_mesh;

use proptest::prelude::*;

use super::{Bundling, Nearest, Precision};
use crate::lanes::InstructionSet;
use crate::ray::{Found, FoundColumns, Ray, Rays};
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

/// Rays find what is expected on every instruction set, bundled and laid out in any way.
fn check_all_ways<F: Precision>(arrays: &SceneArrays, rays: &[Ray], expected: &[Found]) {
    let hits: Vec<bool> = expected.iter().map(|hit| hit.instance >= 0).collect();
    let lists = lists(rays);
    let columns = Rays::Columns {
        origins: &rays.iter().map(|ray| ray.origin).collect::<Vec<_>>(),
        directions: &rays.iter().map(|ray| ray.direction).collect::<Vec<_>>(),
        t_min: &[0.0],
        t_max: &rays.iter().map(|ray| ray.t_max).collect::<Vec<_>>(),
    };
    for set in InstructionSet::available() {
        let scene = scene::<F>(arrays.clone(), set);
        for bundling in [Bundling::Never, Bundling::Always, Bundling::Coherent] {
            for rays in [lists.as_rays(), columns] {
                let way = format!("{} {bundling:?}", set.name());
                assert_eq!(found(&scene, rays, bundling), expected, "{way}");
                let mut occluded = vec![false; rays.len()];
                scene.batch(rays, bundling, occluded.as_mut_slice());
                assert_eq!(occluded, hits, "{way}");
            }
        }
    }
}

fn check<F: Precision>(instances: &[Instance], unit: f64, rays: &[Ray]) {
    let expected = brute_force::<F>(instances, unit, rays);
    check_all_ways::<F>(&arrays(instances, unit), rays, &expected);
}

/// Whichever way rays go into groups, they find the same.
fn check_groups<F: Precision>(instances: &[Instance], rays: &[Ray]) {
    let grouped = grouped(instances, 1.0);
    let alone = scene::<F>(grouped.clone(), InstructionSet::Portable);
    let expected = found(&alone, lists(rays).as_rays(), Bundling::Never);
    check_all_ways::<F>(&grouped, rays, &expected);
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
