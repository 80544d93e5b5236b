//! Whole pictures of a few spheres, traced by brute force.
use super::*;
use crate::ray::{Hit, Hits, Ray, Rays};
use camera::Projection;
use dome::Dome;
use film::SurfaceLayers;
use light::Light;
use material::Parameters;
use texture::{Image, Texels};
use vector::Vec3;

/// Spheres: centre, radius, material.
struct Spheres(Vec<(Vec3, f64, i32)>);

impl Spheres {
    fn hit(&self, ray: &Ray) -> Hit {
        let (o, d) = (Vec3::from(ray.origin), Vec3::from(ray.direction));
        let mut best = Hit::MISS;
        for (index, &(center, radius, material)) in self.0.iter().enumerate() {
            let f = o - center;
            let a = d.dot(d);
            let closest = -f.dot(d) / a;
            let l = f + d * closest;
            let discriminant = radius * radius - l.dot(l);
            if discriminant < 0.0 {
                continue;
            }
            let half = (discriminant / a).sqrt();
            for t in [closest - half, closest + half] {
                if t > ray.t_min && t < ray.t_max && t < best.t {
                    let normal = (o + d * t - center).normalized();
                    best = Hit {
                        t,
                        position: (center + normal * radius).to_array(),
                        normal: normal.to_array(),
                        offset: radius * 1e-9,
                        instance: index as i64,
                        prototype: 0,
                        material,
                        primitive: 0,
                    };
                }
            }
        }
        best
    }
}

impl Trace for Spheres {
    fn closest(&self, rays: Rays, hits: &mut Hits) {
        hits.resize(rays.len());
        for i in 0..rays.len() {
            hits.set(i, &self.hit(&rays.get(i)));
        }
    }

    fn occluded(&self, rays: Rays, occluded: &mut [bool]) {
        for (i, occluded) in occluded.iter_mut().enumerate() {
            *occluded = self.hit(&rays.get(i)).instance >= 0;
        }
    }
}

fn matte(color: f64, opacity: f64) -> Material {
    Material::new(&Parameters {
        diffuse: Vec3::ONE * color,
        emission: Vec3::ZERO,
        specular_workflow: false,
        specular: Vec3::ZERO,
        metallic: 0.0,
        roughness: 0.5,
        clearcoat: 0.0,
        clearcoat_roughness: 0.01,
        opacity,
        opacity_threshold: 0.0,
        ior: 1.0,
    })
}

/// Looks from (0, 0, 10) along -z at a window of 4 × 4 around the origin.
fn picture(size: u32, samples: u32, integrator: Integrator) -> Picture {
    let camera = Camera {
        projection: Projection::Orthographic,
        right: Vec3::new(1.0, 0.0, 0.0),
        up: Vec3::new(0.0, 1.0, 0.0),
        back: Vec3::new(0.0, 0.0, 1.0),
        position: Vec3::new(0.0, 0.0, 10.0),
        height: 4.0,
        aspect: f64::NAN,
        shift: [0.0, 0.0],
        near: 0.0,
        far: f64::INFINITY,
    };
    Picture {
        camera,
        width: size,
        height: size,
        samples,
        integrator,
        seed: 0,
        threads: 2,
        set: InstructionSet::available()[0],
        surfaces: true,
    }
}

fn sky(radiance: f64) -> Lights {
    let mut lights = Lights::default();
    lights.push_sky(Vec3::ONE * radiance);
    lights
}

/// A dome of grey texels.
fn dome(width: usize, height: usize, texels: Vec<f32>) -> Dome {
    let image = Image::new(width, height, 1, Texels::Floats(texels.into())).unwrap();
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(Vec3::from);
    Dome::new(image, Vec3::ONE, axes)
}

fn sun(direction: Vec3, degrees: f64) -> Lights {
    let mut lights = Lights::default();
    lights.push(Light::sun(
        direction.normalized(),
        Vec3::ONE * std::f64::consts::PI,
        degrees,
    ));
    lights
}

fn film(scene: &Spheres, lights: Lights, materials: Vec<Material>, picture: &Picture) -> Film {
    let appearance = Appearance {
        lights,
        materials,
        detail: None,
    };
    render(scene, &appearance, picture, &mut |_, _| true).unwrap()
}

/// The colour of the pixel at column x and row y.
fn surfaces(film: &Film) -> &SurfaceLayers {
    film.pixels.surfaces.as_ref().unwrap()
}

fn pixel(film: &Film, x: usize, y: usize) -> [f32; 4] {
    let start = 4 * (y * film.width + x);
    film.pixels.color[start..start + 4].try_into().unwrap()
}

fn unit_sphere() -> Spheres {
    Spheres(vec![(Vec3::ZERO, 1.0, 0)])
}

#[test]
fn a_picture_is_the_same_on_any_number_of_threads() {
    let ground = (Vec3::new(0.0, -101.0, 0.0), 100.0, 1);
    let scene = Spheres(vec![(Vec3::ZERO, 1.0, 0), ground]);
    let lights = || {
        let mut lights = sun(Vec3::new(-1.0, -2.0, -1.0), 5.0);
        lights.push_sky(Vec3::new(0.2, 0.3, 0.5));
        lights.push_dome(dome(3, 2, (1..7u8).map(f32::from).collect()));
        lights
    };
    let occlusion = Integrator::AmbientOcclusion { distance: 3.0 };
    for integrator in [
        Integrator::Direct,
        occlusion,
        Integrator::Normals,
        Integrator::Ids,
    ] {
        let films: Vec<Film> = [1, 2, 3]
            .map(|threads| {
                let picture = Picture {
                    threads,
                    ..picture(50, 6, integrator)
                };
                film(
                    &scene,
                    lights(),
                    vec![matte(0.8, 1.0), matte(0.5, 0.6)],
                    &picture,
                )
            })
            .into();
        for other in &films[1..] {
            assert_eq!(films[0].pixels.color, other.pixels.color, "{integrator:?}");
            assert_eq!(surfaces(&films[0]).instance, surfaces(other).instance);
            assert_eq!(films[0].rays, other.rays);
        }
    }
}

#[test]
fn a_picture_is_the_same_for_all_instruction_sets() {
    let scene = Spheres(vec![
        (Vec3::ZERO, 1.0, 0),
        (Vec3::new(1.5, 0.0, 0.0), 1.0, 0),
    ]);
    for integrator in [
        Integrator::Direct,
        Integrator::AmbientOcclusion { distance: 9.0 },
    ] {
        let mut films = InstructionSet::available().into_iter().map(|set| {
            let picture = Picture {
                set,
                ..picture(30, 5, integrator)
            };
            film(&scene, sky(1.0), vec![matte(0.8, 1.0)], &picture)
                .pixels
                .color
        });
        let first = films.next().unwrap();
        assert!(films.all(|film| film == first), "{integrator:?}");
    }
}

#[test]
fn a_convex_surface_below_a_uniform_sky_shows_its_albedo() {
    let picture = picture(32, 4, Integrator::Direct);
    let film = film(&unit_sphere(), sky(2.0), vec![matte(0.25, 1.0)], &picture);
    assert_eq!(pixel(&film, 16, 16), [0.5, 0.5, 0.5, 1.0]);
    assert_eq!(
        pixel(&film, 0, 0),
        [2.0, 2.0, 2.0, 1.0],
        "the sky is the background"
    );
}

#[test]
fn a_sun_lights_by_the_cosine_and_what_faces_away_is_dark() {
    let picture = Picture {
        samples: 1,
        ..picture(129, 1, Integrator::Direct)
    };
    let lights = sun(Vec3::new(-1.0, 0.0, 0.0), 0.0);
    let film = film(&unit_sphere(), lights, vec![matte(0.5, 1.0)], &picture);
    // Column x sees x position (x + 0.5) * 4 / 129 - 2, which is the cosine.
    for x in [66, 80, 90] {
        let cosine = (x as f64 + 0.5) * 4.0 / 129.0 - 2.0;
        let [red, _, _, alpha] = pixel(&film, x, 64);
        assert!((f64::from(red) - 0.5 * cosine).abs() < 1e-6, "{x}: {red}");
        assert_eq!(alpha, 1.0);
    }
    assert_eq!(pixel(&film, 40, 64), [0.0, 0.0, 0.0, 1.0]);
    assert_eq!(pixel(&film, 0, 0), [0.0; 4]);
}

#[test]
fn a_sphere_before_the_sun_casts_its_shadow() {
    // A ground below, the sun straight above, an occluder between: outside of the picture.
    let ground = (Vec3::new(0.0, 0.0, -1e4), 1e4, 0);
    let scene = Spheres(vec![ground, (Vec3::new(0.0, 0.0, 20.0), 1.0, 0)]);
    let at_centre = |degrees| {
        let lights = sun(Vec3::new(0.0, 0.0, -1.0), degrees);
        let picture = picture(8, 256, Integrator::Direct);
        f64::from(pixel(&film(&scene, lights, vec![matte(1.0, 1.0)], &picture), 4, 4)[0])
    };
    assert_eq!(at_centre(0.0), 0.0);
    // The occluder's angular radius is asin(1 / 20): 2.866°; it hides that part of a larger sun.
    let hidden = (2.866f64 / 7.5).powi(2);
    assert!(
        (at_centre(15.0) - (1.0 - hidden)).abs() < 0.02,
        "{}",
        at_centre(15.0)
    );
}

#[test]
fn inside_everything_is_occluded_and_outside_nothing() {
    let inside = Picture {
        camera: Camera {
            position: Vec3::ZERO,
            ..picture(8, 4, Integrator::Normals).camera
        },
        ..picture(
            8,
            64,
            Integrator::AmbientOcclusion {
                distance: f64::INFINITY,
            },
        )
    };
    let huge = Spheres(vec![(Vec3::ZERO, 100.0, 0)]);
    let closed = film(&huge, Lights::default(), vec![matte(1.0, 1.0)], &inside);
    assert!(
        closed
            .pixels
            .color
            .chunks(4)
            .all(|c| c == [0.0, 0.0, 0.0, 1.0])
    );
    let outside = picture(32, 64, inside.integrator);
    let open = film(
        &unit_sphere(),
        Lights::default(),
        vec![matte(1.0, 1.0)],
        &outside,
    );
    assert!(open.pixels.color.iter().all(|&value| value == 1.0));
    let near = Picture {
        integrator: Integrator::AmbientOcclusion { distance: 1.0 },
        ..inside
    };
    let short = film(&huge, Lights::default(), vec![matte(1.0, 1.0)], &near);
    assert!(
        short.pixels.color.chunks(4).any(|c| c[0] > 0.5),
        "the distance bounds occlusion"
    );
}

#[test]
fn a_dome_of_one_colour_is_the_sky_of_that_colour() {
    let glossy = |roughness: f64, coat: f64| {
        Material::new(&Parameters {
            diffuse: Vec3::ONE * 0.5,
            emission: Vec3::ZERO,
            specular_workflow: false,
            specular: Vec3::ZERO,
            metallic: 0.5,
            roughness,
            clearcoat: coat,
            clearcoat_roughness: 0.1,
            opacity: 0.9,
            opacity_threshold: 0.0,
            ior: 1.5,
        })
    };
    let ground = (Vec3::new(0.0, -101.0, 0.0), 100.0, 0);
    let scene = Spheres(vec![(Vec3::ZERO, 1.0, 0), ground]);
    for material in [matte(0.8, 1.0), glossy(0.05, 0.0), glossy(0.6, 1.0)] {
        let picture = picture(16, 256, Integrator::Direct);
        let mut lights = Lights::default();
        lights.push_dome(dome(5, 3, vec![2.0; 15]));
        let by_dome = film(&scene, lights, vec![material], &picture);
        let by_sky = film(&scene, sky(2.0), vec![material], &picture);
        let mut difference = 0.0;
        for (a, b) in by_dome.pixels.color.iter().zip(&by_sky.pixels.color) {
            assert!((a - b).abs() < 0.15 * b.max(0.5), "{a} {b}");
            difference += f64::from(a - b);
        }
        difference /= by_sky.pixels.color.len() as f64;
        assert!(difference.abs() < 3e-3, "{difference}");
    }
}

#[test]
fn layers_of_transparent_surfaces_multiply() {
    // Two surfaces of opacity 1/4 each: front and back of the sphere.
    let picture = picture(16, 4, Integrator::Direct);
    let lights = Lights {
        sky: Vec3::ONE,
        ..Lights::default()
    };
    let glass = film(&unit_sphere(), lights, vec![matte(1.0, 0.25)], &picture);
    let [red, _, _, alpha] = pixel(&glass, 8, 8);
    assert!(
        (f64::from(alpha) - (1.0 - 0.75 * 0.75)).abs() < 1e-6,
        "{alpha}"
    );
    // Outside sees all of the sky; inside sees it through one more layer.
    let expected = 0.25 + 0.75 * 0.25 * 0.75;
    assert!((f64::from(red) - expected).abs() < 1e-6, "{red}");
    assert_eq!(surfaces(&glass).depth[8 * 16 + 8].round(), 9.0);
    let cut = film(&unit_sphere(), sky(1.0), vec![matte(1.0, 0.0)], &picture);
    assert_eq!(pixel(&cut, 8, 8), [1.0; 4]);
    assert_eq!(
        surfaces(&cut).instance[8 * 16 + 8],
        -1,
        "what is cut out is not seen"
    );
}

#[test]
fn images_of_the_first_hit_are_those_of_the_pixel_centre() {
    let single = film(
        &unit_sphere(),
        sky(1.0),
        vec![matte(1.0, 1.0)],
        &picture(32, 1, Integrator::Normals),
    );
    let center = 16 * 32 + 16;
    let (x, y) = (2.0 / 32.0, -2.0 / 32.0);
    let z = (1.0f64 - x * x - y * y).sqrt();
    assert!((f64::from(surfaces(&single).depth[center]) - (10.0 - z)).abs() < 1e-6);
    let normal = &surfaces(&single).normal[3 * center..3 * center + 3];
    for (got, expected) in normal.iter().zip([x, y, z]) {
        assert!((f64::from(*got) - expected).abs() < 1e-6, "{normal:?}");
    }
    assert_eq!(surfaces(&single).instance[center], 0);
    assert_eq!(surfaces(&single).instance[0], -1);
    assert_eq!(surfaces(&single).depth[0], f32::INFINITY);
    assert!(single.pixels.error[0].is_nan(), "one sample tells no error");
}

#[test]
fn the_error_estimate_is_the_spread_of_the_mean() {
    // Half of a pixel is covered: samples are 0 or 1, the mean of n has deviation 0.5 / √n.
    let scene = Spheres(vec![(Vec3::new(-1e6, 0.0, 0.0), 1e6, 0)]);
    let wide = film(
        &scene,
        sky(1.0),
        vec![matte(0.0, 1.0)],
        &picture(1, 64, Integrator::Direct),
    );
    assert!(
        (wide.pixels.error[0] - 0.5 / 63f32.sqrt()).abs() < 1e-3,
        "{:?}",
        wide.pixels.error
    );
}

#[test]
fn a_scene_without_lights_is_lit_from_the_camera() {
    let lit = film(
        &unit_sphere(),
        Lights::default(),
        vec![matte(0.8, 1.0)],
        &picture(32, 4, Integrator::Direct),
    );
    let [red, _, _, alpha] = pixel(&lit, 16, 16);
    assert!(red > 0.5 && red < 1.0 && alpha == 1.0, "{red}");
    assert_eq!(
        pixel(&lit, 0, 0),
        [0.0; 4],
        "the headlight is no background"
    );
}

#[test]
fn an_observer_ends_the_render() {
    let appearance = Appearance {
        lights: sky(1.0),
        materials: vec![matte(0.8, 1.0)],
        detail: None,
    };
    let long = picture(4096, 1024, Integrator::Direct);
    let mut calls = 0;
    let film = render(&unit_sphere(), &appearance, &long, &mut |done, _| {
        calls += 1;
        assert!(done > 0.0 && done < 0.5);
        calls < 2
    });
    assert!(film.is_none() && calls == 2);
}
