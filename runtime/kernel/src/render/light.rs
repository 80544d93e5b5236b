//! Lights: what arrives at a point, and from where; surfaces are in `area.rs`.
//!
//! A sun of angular diameter 2α and a ball of radius r at distance D (sin α = r / D) are both a
//! cone of uniform radiance whose irradiance E on a surface that faces the axis is given; from
//! E = L π sin² α and the density 1 / (2π (1 - cos α)) of a direction drawn uniformly, every
//! direction has the same weight L / density = 2 E / (1 + cos α). No sample is an outlier.
use super::area::AreaLight;
use super::camera::Camera;
use super::direction::{Basis, cone};
use super::shaping::Shaping;
use super::vector::Vec3;
use std::f64::consts::{FRAC_PI_2, PI};

/// Light that arrives from within a cone of directions.
#[derive(Clone, Copy, Debug)]
pub enum Light {
    /// The same at every point.
    Sun {
        /// Unit vector towards the sun, and two beside it.
        basis: Basis,
        /// Unit vector towards the sun.
        towards: Vec3,
        /// The constant weight of a direction.
        weight: Vec3,
        /// 1 - cos α.
        one_minus_cos: f64,
        /// sin α.
        sin: f64,
    },
    /// A ball, or a point if the radius is 0.
    Point {
        /// The centre.
        position: Vec3,
        /// Power per solid angle: irradiance at distance D is intensity / D².
        intensity: Vec3,
        /// Radius of the ball.
        radius: f64,
        /// In which directions it shines how much.
        shaping: Option<Shaping>,
    },
    /// A surface.
    Area(AreaLight),
}

/// One direction in which a light shines on a point.
#[derive(Clone, Copy, Debug)]
pub struct Illumination {
    /// Unit vector towards the drawn part of the light.
    pub towards: Vec3,
    /// Unit vector towards the middle of the light.
    pub axis: Vec3,
    /// sin α, the light's angular radius.
    pub sin: f64,
    /// Irradiance on a surface that faces `towards`, if all of the light shone from there.
    pub irradiance: Vec3,
    /// Where along `towards` the light is.
    pub distance: f64,
}

impl Light {
    /// A sun shining along `direction` (unit) with an angular diameter of `degrees`, at most 180.
    pub fn sun(direction: Vec3, irradiance: Vec3, degrees: f64) -> Light {
        let alpha = (degrees * (PI / 360.0)).clamp(0.0, FRAC_PI_2);
        let half = libm::sin(0.5 * alpha);
        let one_minus_cos = 2.0 * half * half;
        Light::Sun {
            basis: Basis::new(-direction),
            towards: -direction,
            weight: irradiance * (2.0 / (2.0 - one_minus_cos)),
            one_minus_cos,
            sin: libm::sin(alpha),
        }
    }

    /// Whether shadows are soft: [`Light::illuminate`] then uses its sample point.
    #[inline(always)]
    pub fn is_soft(&self) -> bool {
        match *self {
            Light::Sun { sin, .. } => sin > 0.0,
            Light::Point { radius, .. } => radius > 0.0,
            Light::Area(_) => true,
        }
    }

    /// How the light shines on `point`, or None where it has no direction (in its centre).
    #[inline(always)]
    pub fn illuminate(&self, point: Vec3, sample: [f64; 2]) -> Option<Illumination> {
        match *self {
            Light::Area(ref area) => area.illuminate(point, sample),
            Light::Sun {
                basis,
                towards,
                weight,
                one_minus_cos,
                sin,
            } => Some(Illumination {
                towards: if sin > 0.0 {
                    basis.world(cone(sample, one_minus_cos))
                } else {
                    towards
                },
                axis: towards,
                sin,
                irradiance: weight,
                distance: f64::INFINITY,
            }),
            Light::Point {
                position,
                intensity,
                radius,
                shaping,
            } => {
                let shaped =
                    |towards| intensity * shaping.map_or(1.0, |shaping| shaping.factor(towards));
                let offset = position - point;
                let distance = offset.dot(offset).sqrt();
                if !(distance > 0.0 && distance < f64::INFINITY) {
                    return None;
                }
                let axis = offset * (1.0 / distance);
                let fall = 1.0 / distance;
                if radius == 0.0 {
                    return Some(Illumination {
                        towards: axis,
                        axis,
                        sin: 0.0,
                        irradiance: shaped(axis) * fall * fall,
                        distance,
                    });
                }
                let sin = (radius / distance).min(1.0);
                let cos = ((1.0 - sin) * (1.0 + sin)).sqrt();
                let local = cone(sample, sin * sin / (1.0 + cos));
                // Where the direction enters the ball: nothing inside the ball shadows.
                let across = distance * ((1.0 - local.z) * (1.0 + local.z)).sqrt();
                let half_chord = ((radius - across) * (radius + across)).max(0.0).sqrt();
                let towards = Basis::new(axis).world(local);
                Some(Illumination {
                    towards,
                    axis,
                    sin,
                    irradiance: shaped(towards) * fall * fall * (2.0 / (1.0 + cos)),
                    distance: distance * local.z - half_chord,
                })
            }
        }
    }
}

/// All lights of a scene; black ones are left out.
#[derive(Clone, Debug, Default)]
pub struct Lights {
    /// Suns, points and surfaces, each traced with one shadow ray per camera sample.
    pub local: Vec<Light>,
    /// Uniform radiance from every direction that nothing hides; black costs no rays.
    pub sky: Vec3,
    /// Radiance seen where a camera ray hits nothing; None leaves the picture transparent there.
    pub background: Option<Vec3>,
}

impl Lights {
    /// Adds a light, unless it is black.
    pub fn push(&mut self, light: Light) {
        let power = match light {
            Light::Sun { weight, .. } => weight,
            Light::Point { intensity, .. } => intensity,
            Light::Area(area) => area.radiance(),
        };
        if power != Vec3::ZERO {
            self.local.push(light);
        }
    }

    /// Adds a sky, which is also the background.
    pub fn push_sky(&mut self, radiance: Vec3) {
        self.sky += radiance;
        self.background = Some(self.sky);
    }

    /// The light for scenes that have none: a sun over the camera's left shoulder and a dim sky
    /// that fills the shadows but is no background. Facing white surfaces come out white.
    pub fn headlight(camera: &Camera) -> Lights {
        let towards = camera.back + camera.up * 0.6 - camera.right * 0.4;
        Lights {
            local: vec![Light::sun(
                -towards.normalized(),
                Vec3::ONE * (0.75 * PI),
                2.0,
            )],
            sky: Vec3::ONE * 0.25,
            background: None,
        }
    }

    /// Whether there is any light at all.
    pub fn is_dark(&self) -> bool {
        self.local.is_empty() && self.sky == Vec3::ZERO && self.background.is_none()
    }
}

#[cfg(test)]
mod tests {
    use super::super::sampler::PixelKey;
    use super::*;

    /// Mean of irradiance · max(0, n·l) over the light, by 4096 samples.
    fn irradiance(light: &Light, point: Vec3, normal: Vec3) -> f64 {
        let key = PixelKey::new(0, 0, 1);
        let count = 4096;
        (0..count)
            .map(|i| {
                let light = light.illuminate(point, key.point(i, 0)).unwrap();
                light.irradiance.x * light.towards.dot(normal).max(0.0)
            })
            .sum::<f64>()
            / f64::from(count)
    }

    #[test]
    fn a_facing_surface_receives_the_stated_irradiance_whatever_the_size() {
        for degrees in [0.0, 0.53, 20.0, 120.0, 180.0, 400.0] {
            let sun = Light::sun(Vec3::new(0.0, -1.0, 0.0), Vec3::ONE * 3.0, degrees);
            let got = irradiance(&sun, Vec3::ZERO, Vec3::new(0.0, 1.0, 0.0));
            assert!((got - 3.0).abs() < 3e-3, "{degrees}: {got}");
        }
    }

    #[test]
    fn a_ball_shines_like_a_point_on_what_faces_it() {
        for radius in [0.0, 0.1, 1.0, 1.9] {
            let position = Vec3::new(0.0, 2.0, 0.0);
            let ball = Light::Point {
                position,
                intensity: Vec3::ONE * 8.0,
                radius,
                shaping: None,
            };
            let got = irradiance(&ball, Vec3::ZERO, Vec3::new(0.0, 1.0, 0.0));
            assert!((got - 2.0).abs() < 2e-3, "{radius}: {got}");
        }
    }

    #[test]
    fn shadow_rays_end_on_the_ball() {
        let key = PixelKey::new(0, 0, 1);
        let position = Vec3::new(0.3, 2.0, -0.5);
        let ball = Light::Point {
            position,
            intensity: Vec3::ONE,
            radius: 0.5,
            shaping: None,
        };
        for i in 0..100 {
            let light = ball.illuminate(Vec3::ZERO, key.point(i, 0)).unwrap();
            let from_centre = light.towards * light.distance - position;
            assert!((from_centre.dot(from_centre).sqrt() - 0.5).abs() < 1e-7);
        }
        assert!(ball.illuminate(position, [0.5, 0.5]).is_none());
    }

    #[test]
    fn black_lights_cost_nothing() {
        let mut lights = Lights::default();
        lights.push(Light::sun(Vec3::new(0.0, -1.0, 0.0), Vec3::ZERO, 1.0));
        assert!(lights.is_dark() && lights.local.is_empty());
        lights.push_sky(Vec3::ZERO);
        assert!(!lights.is_dark(), "a black sky was asked for: no headlight");
    }
}
