//! Rays that leave a surface do not hit it again.
use super::{BOX, Instance, SPHERE, arrays, lists, scene};
use crate::lanes::InstructionSet;
use crate::ray::{Hit, Hits, Ray, Trace};
use crate::trace::Precision;

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
