//! Lights: what arrives at a point, and from where; surfaces are in `area.rs`.
//!
//! A sun of angular diameter 2α and a ball of radius r at distance D (sin α = r / D) are both a
//! cone of uniform radiance whose irradiance E on a surface that faces the axis is given; from
//! E = L π sin² α and the density 1 / (2π (1 - cos α)) of a direction drawn uniformly, every
//! direction has the same weight L / density = 2 E / (1 + cos α). No sample is an outlier.
use super::area::AreaLight;
use super::camera::Camera;
use super::direction::{Basis, cone};
use super::dome::Dome;
use super::shaping::Shaping;
use super::vector::Vec3;
use crate::lanes::{Lanes, MAX_WIDTH, Mask};
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

/// One direction in which a light shines on a point, for each lane.
#[derive(Clone, Copy, Debug)]
pub struct Illumination<L = f64> {
    /// Unit vector towards the drawn part of the light.
    pub towards: Vec3<L>,
    /// Unit vector towards the middle of the light.
    pub axis: Vec3<L>,
    /// sin α, the light's angular radius.
    pub sin: L,
    /// Irradiance on a surface that faces `towards`, if all of the light shone from there.
    pub irradiance: Vec3<L>,
    /// Where along `towards` the light is.
    pub distance: L,
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

    /// How the light shines on points, and on which: not on those where it has no direction (in its
    /// centre).
    #[inline(always)]
    pub fn illuminate<L: Lanes<Scalar = f64>>(
        &self,
        point: Vec3<L>,
        sample: [L; 2],
    ) -> (L::Mask, Illumination<L>) {
        let one = L::splat(1.0);
        match *self {
            Light::Area(ref area) => Illumination::one_by_one(area, point, sample),
            Light::Sun {
                basis,
                towards,
                weight,
                one_minus_cos,
                sin,
            } => {
                let axis = Vec3::splat(towards);
                let towards = if sin > 0.0 {
                    let local = cone(sample, L::splat(one_minus_cos));
                    basis.in_lanes().world(local)
                } else {
                    axis
                };
                let illumination = Illumination {
                    towards,
                    axis,
                    sin: L::splat(sin),
                    irradiance: Vec3::splat(weight),
                    distance: L::splat(f64::INFINITY),
                };
                (L::Mask::full(), illumination)
            }
            Light::Point {
                position,
                intensity,
                radius,
                shaping,
            } => {
                let offset = Vec3::splat(position) - point;
                let distance = offset.dot(offset).sqrt();
                let shines = distance.gt(L::zero()) & distance.lt(L::splat(f64::INFINITY));
                let per_distance = one / distance;
                let axis = offset * per_distance;
                let irradiance = Vec3::splat(intensity) * per_distance * per_distance;
                if radius == 0.0 {
                    let illumination = Illumination {
                        towards: axis,
                        axis,
                        sin: L::zero(),
                        irradiance: irradiance * factor(&shaping, axis),
                        distance,
                    };
                    return (shines, illumination);
                }
                let radius = L::splat(radius);
                let sin = (radius / distance).min(one);
                let cos = ((one - sin) * (one + sin)).sqrt();
                let local = cone(sample, sin * sin / (one + cos));
                // Where the direction enters the ball: nothing inside the ball shadows.
                let across = distance * ((one - local.z) * (one + local.z)).sqrt();
                let chord_square = (radius - across) * (radius + across);
                let half_chord = chord_square.max(L::zero()).sqrt();
                let towards = Basis::new(axis).world(local);
                let size = L::splat(2.0) / (one + cos);
                let illumination = Illumination {
                    towards,
                    axis,
                    sin,
                    irradiance: irradiance * factor(&shaping, towards) * size,
                    distance: distance * local.z - half_chord,
                };
                (shines, illumination)
            }
        }
    }
}

/// The part of a light that leaves against each of these directions to it.
#[inline(always)]
fn factor<L: Lanes<Scalar = f64>>(shaping: &Option<Shaping>, towards: Vec3<L>) -> L {
    let Some(shaping) = shaping else {
        return L::splat(1.0);
    };
    let mut factors = [0.0; MAX_WIDTH];
    for (lane, factor) in factors[..L::WIDTH].iter_mut().enumerate() {
        *factor = shaping.factor(towards.get(lane));
    }
    L::load(&factors)
}

impl<L: Lanes<Scalar = f64>> Illumination<L> {
    /// How a surface shines on points: it is seen from one after the other.
    #[inline(always)]
    fn one_by_one(area: &AreaLight, point: Vec3<L>, [u, v]: [L; 2]) -> (L::Mask, Self) {
        let mut shines = 0;
        let mut columns = [[0.0; MAX_WIDTH]; 8];
        for lane in 0..L::WIDTH {
            let seen = area.illuminate(point.get(lane), [u.get(lane), v.get(lane)]);
            if let Some(light) = seen {
                shines |= 1 << lane;
                let [x, y, z] = light.towards.to_array();
                let [r, g, b] = light.irradiance.to_array();
                let numbers = [x, y, z, r, g, b, light.sin, light.distance];
                for (column, number) in columns.iter_mut().zip(numbers) {
                    column[lane] = number;
                }
            }
        }
        let [x, y, z, r, g, b, sin, distance] = &columns;
        let towards = Vec3::new(L::load(x), L::load(y), L::load(z));
        let illumination = Illumination {
            towards,
            axis: towards,
            sin: L::load(sin),
            irradiance: Vec3::new(L::load(r), L::load(g), L::load(b)),
            distance: L::load(distance),
        };
        (L::Mask::from_bits(shines), illumination)
    }
}

/// All lights of a scene; black ones are left out.
#[derive(Default)]
pub struct Lights {
    /// Suns, points and surfaces, each traced with one shadow ray per camera sample.
    pub local: Vec<Light>,
    /// Uniform radiance from every direction that nothing hides; black costs no rays.
    pub sky: Vec3,
    /// Skies with pictures, each traced with one shadow ray per camera sample.
    pub domes: Vec<Dome>,
    /// Radiance seen where a camera ray hits nothing, but for that of the domes; None leaves the
    /// picture transparent there.
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

    /// Adds a sky with a picture, which is also the background.
    pub fn push_dome(&mut self, dome: Dome) {
        self.domes.push(dome);
        self.background = Some(self.sky);
    }

    /// Radiance seen where a camera ray of a direction hits nothing; None leaves the picture
    /// transparent there.
    #[inline(always)]
    pub fn behind_all(&self, direction: impl FnOnce() -> Vec3) -> Option<Vec3> {
        let uniform = self.background?;
        if self.domes.is_empty() {
            return Some(uniform);
        }
        let direction = direction();
        let radiance = self.domes.iter().map(|dome| dome.radiance(direction));
        Some(radiance.fold(uniform, |sum, light| sum + light))
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
            ..Lights::default()
        }
    }

    /// Whether light arrives from directions that are drawn.
    pub fn draw(&self) -> bool {
        self.sky != Vec3::ZERO || !self.domes.is_empty() || self.local.iter().any(Light::is_soft)
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
                let light = light.illuminate(point, key.point(i, 0)).1;
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
            let light = ball.illuminate(Vec3::ZERO, key.point(i, 0)).1;
            let from_centre = light.towards * light.distance - position;
            assert!((from_centre.dot(from_centre).sqrt() - 0.5).abs() < 1e-7);
        }
        assert!(!ball.illuminate(position, [0.5, 0.5]).0);
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
