//! A mesh of many triangles against the sphere that it is nearly.
use proptest::prelude::*;

use super::{Instance, MESH, SPHERE, arrays, found, lists, matrices, scene};
use crate::lanes::InstructionSet;
use crate::ray::Ray;
use crate::scene::SceneArrays;
use crate::trace::{Bundling, Precision};

/// A unit sphere of triangles, `rows` by 2 `rows`, and how far its faces may lie within it.
pub fn round_mesh(rows: i32) -> (SceneArrays, f64) {
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
