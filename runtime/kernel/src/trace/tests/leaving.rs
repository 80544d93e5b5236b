//! Rays that leave a surface do not hit it again, and need not look for the object they leave.
use proptest::prelude::*;

use super::round_mesh::round_mesh;
use super::{
    BOX, Instance, MESH, PLANE, SPHERE, an_instance, arrays, grouped, lists, scene, some_rays,
};
use crate::lanes::InstructionSet;
use crate::ray::{Hit, Hits, Ray, Trace};
use crate::scene::SceneArrays;
use crate::trace::{Bundling, Precision};

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

/// Rays from a hit to the side that was seen, some of them nearly along the surface.
fn fan(hit: &Hit, seen: [f64; 3]) -> Vec<Ray> {
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let side = -1f64.copysign(dot(hit.normal, seen));
    let up = hit.normal.map(|x| side * x);
    let rays = (0..26).map(|i| {
        // The middle one of 27 is no direction.
        let i = if i < 13 { i } else { i + 1 };
        let along = [i % 3, i / 3 % 3, i / 9].map(|x| f64::from(x) - 1.0);
        let rise = dot(up, along);
        let height = if i % 2 == 0 { 1e-6 } else { rise.abs() };
        Ray {
            origin: hit.spawn(up),
            direction: [0, 1, 2].map(|axis| (height - rise).mul_add(up[axis], along[axis])),
            t_min: 0.0,
            t_max: f64::INFINITY,
        }
    });
    rays.collect()
}

/// What is left for good changes no answer; how many rays left something.
fn nothing_is_lost<F: Precision>(arrays: &SceneArrays, seeing: &[Ray]) -> usize {
    let mut count = 0;
    for set in InstructionSet::available() {
        let scene = scene::<F>(arrays.clone(), set);
        let mut hits = Hits::default();
        scene.closest(lists(seeing).as_rays(), &mut hits);
        let (mut rays, mut left) = (Vec::new(), Vec::new());
        for (i, seeing) in seeing.iter().enumerate() {
            let hit = hits.get(i);
            if hit.instance < 0 {
                continue;
            }
            let fan = fan(&hit, seeing.direction);
            let from_front = (0..3)
                .map(|i| hit.normal[i] * seeing.direction[i])
                .sum::<f64>()
                < 0.0;
            let is_left = scene.is_left_for_good(&hits, i, from_front);
            left.extend(
                fan.iter()
                    .map(|_| if is_left { hit.instance as f64 } else { -1.0 }),
            );
            rays.extend(fan);
        }
        let mut lists = lists(&rays);
        for bundling in [Bundling::Never, Bundling::Always, Bundling::Coherent] {
            lists.left.clear();
            let mut expected = vec![false; rays.len()];
            scene.batch(lists.as_rays(), bundling, expected.as_mut_slice());
            lists.left.clone_from(&left);
            let mut occluded = vec![false; rays.len()];
            scene.batch(lists.as_rays(), bundling, occluded.as_mut_slice());
            let wrong = (0..rays.len()).find(|&i| occluded[i] != expected[i]);
            let wrong = wrong.map(|i| (rays[i], left[i]));
            assert_eq!(wrong, None, "{} {bundling:?}", set.name());
        }
        count += left.iter().filter(|&&leaf| leaf >= 0.0).count();
    }
    count
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn rays_need_not_look_for_what_they_leave(
        instances in prop::collection::vec(an_instance(), 1..12), rays in some_rays(),
    ) {
        for arrays in [arrays(&instances, 1.0), grouped(&instances, 1.0)] {
            nothing_is_lost::<f32>(&arrays, &rays);
            nothing_is_lost::<f64>(&arrays, &rays);
        }
    }
}

/// Whether rays leave each triangle for good outwards, and inwards.
fn sides<F: Precision>(arrays: &SceneArrays) -> Vec<[bool; 2]> {
    let scene = scene::<F>(arrays.clone(), InstructionSet::available()[0]);
    let prototype = &scene.prototypes[MESH as usize];
    (0..arrays.mesh_triangles.len() as u32)
        .map(|triangle| [true, false].map(|side| prototype.is_left_for_good(triangle, side)))
        .collect()
}

#[test]
fn what_reaches_above_a_triangle_is_found() {
    let dented = arrays(&[], 1.0);
    // Found by looking at all corners.
    let expected: Vec<[bool; 2]> = (dented.mesh_triangles.iter())
        .map(|&corners| {
            let [a, b, c] = corners.map(|i| dented.mesh_points[i as usize]);
            let [u, v] = [b, c].map(|p| [0, 1, 2].map(|i| p[i] - a[i]));
            let normal = [0, 1, 2].map(|i| {
                let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                u[j] * v[k] - u[k] * v[j]
            });
            let height = |p: &[f64; 3]| (0..3).map(|i| normal[i] * (p[i] - a[i])).sum::<f64>();
            let heights: Vec<f64> = dented.mesh_points.iter().map(height).collect();
            [
                heights.iter().all(|&h| h < 1e-9),
                heights.iter().all(|&h| h > -1e-9),
            ]
        })
        .collect();
    assert!(expected.contains(&[true, false]) && expected.contains(&[false, false]));
    assert_eq!(sides::<f32>(&dented), expected);
    assert_eq!(sides::<f64>(&dented), expected);
    let (round, _) = round_mesh(30);
    assert!(
        sides::<f32>(&round)
            .iter()
            .all(|&sides| sides == [true, false])
    );
}

#[test]
fn rays_leave_convex_shapes_outwards_and_flat_ones_to_both_sides() {
    let scene = scene::<f32>(arrays(&[], 1.0), InstructionSet::available()[0]);
    let sides =
        |of: i32| [true, false].map(|side| scene.prototypes[of as usize].is_left_for_good(0, side));
    assert_eq!(
        [SPHERE, BOX, PLANE].map(sides),
        [[true, false], [true, false], [true, true]]
    );
}
