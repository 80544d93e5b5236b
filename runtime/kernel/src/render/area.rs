//! Light from surfaces of uniform radiance: rectangles, discs and the walls of cylinders.
//!
//! A surface p(s, t) has the area vector N = ∂p/∂s × ∂p/∂t ds dt, and what it shines on x is
//! L max(0, N · (x - p)) / |x - p|³ on a surface that faces p. All three are affine images of
//! simple sets, so scales and shears of the light cost nothing. Points are drawn uniformly in s
//! and t; of a cylinder only where it faces x, which affine maps keep: seen from distance D in the
//! space in which its radius is 1, these are the angles within acos(1/D) of the nearest one.
use super::direction::sin_cos_turns;
use super::light::Illumination;
use super::shaping::Shaping;
use super::vector::Vec3;
use std::f64::consts::PI;

/// The three surfaces that shine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Surface {
    /// centre + s u + t v, s and t in -1 … 1, towards w.
    Rectangle,
    /// centre + s u + t v, s² + t² ≤ 1, towards w.
    Disc,
    /// centre + s u + cos φ v + sin φ w, outwards; its ends are dark.
    Cylinder,
}

/// A light that is a surface.
#[derive(Clone, Copy, Debug)]
pub struct AreaLight {
    surface: Surface,
    center: Vec3,
    axes: [Vec3; 3],
    /// Of a flat light N for the whole square of samples.
    area: Vec3,
    /// Of a cylinder the sign that turns N outwards.
    outward: f64,
    /// Of a cylinder what gives the parts of a vector along v and w.
    across: [Vec3; 2],
    radiance: Vec3,
    shaping: Option<Shaping>,
}

/// Shadow rays end this part of their way before the light: what lies in it does not shadow it.
const SHORT: f64 = 1.0 - 1e-6;

impl AreaLight {
    /// A light around `center` with the axes u, v and w of its surface.
    pub fn new(
        surface: Surface,
        center: Vec3,
        axes: [Vec3; 3],
        radiance: Vec3,
        shaping: Option<Shaping>,
    ) -> AreaLight {
        let [u, v, w] = axes;
        let normal = u.cross(v);
        let volume = normal.dot(w);
        let size = match surface {
            Surface::Rectangle => 4.0,
            Surface::Disc => PI,
            Surface::Cylinder => 0.0,
        };
        AreaLight {
            surface,
            center,
            axes,
            area: normal * size.copysign(volume),
            outward: 1f64.copysign(-volume),
            across: [w.cross(u), normal].map(|axis| axis * (1.0 / volume)),
            radiance,
            shaping,
        }
    }

    /// What it emits.
    pub fn radiance(&self) -> Vec3 {
        self.radiance
    }

    /// How a drawn part of it shines on `point`; None from behind, and from within a cylinder.
    #[inline]
    pub fn illuminate(&self, point: Vec3, sample: [f64; 2]) -> Option<Illumination> {
        let [u, v, w] = self.axes;
        let [a, b] = sample;
        let (offset, area) = match self.surface {
            Surface::Rectangle => (u * (2.0 * a - 1.0) + v * (2.0 * b - 1.0), self.area),
            Surface::Disc => {
                let (sin, cos) = sin_cos_turns(b);
                let radius = a.sqrt();
                (u * (radius * cos) + v * (radius * sin), self.area)
            }
            Surface::Cylinder => {
                let from = point - self.center;
                let [y, z] = self.across.map(|axis| axis.dot(from));
                let distance = (y * y + z * z).sqrt();
                if distance.is_nan() || distance <= 1.0 {
                    return None;
                }
                let (near_y, near_z) = (y / distance, z / distance);
                let half = libm::acos(1.0 / distance);
                let (sin, cos) = libm::sincos(half * (2.0 * b - 1.0));
                let (y, z) = (near_y * cos - near_z * sin, near_y * sin + near_z * cos);
                let around = (w * y - v * z) * (4.0 * half * self.outward);
                (u * (2.0 * a - 1.0) + v * y + w * z, u.cross(around))
            }
        };
        let way = self.center + offset - point;
        let square = way.dot(way);
        let distance = square.sqrt();
        let towards = way * (1.0 / distance);
        let solid_angle = -area.dot(towards) / square;
        if !(solid_angle > 0.0 && solid_angle < f64::INFINITY) {
            return None;
        }
        let shaped = self.shaping.map_or(1.0, |shaping| shaping.factor(towards));
        Some(Illumination {
            towards,
            axis: towards,
            // A quarter of the light's solid angle: highlights keep its outline, and no sample
            // is brighter than a few times the light.
            sin: (solid_angle / (4.0 * PI)).sqrt().min(1.0),
            irradiance: self.radiance * (solid_angle * shaped),
            distance: distance * SHORT,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::sampler::PixelKey;
    use super::*;

    /// Mean of irradiance · max(0, n·l) over the light, by 16384 samples.
    fn irradiance(light: &AreaLight, point: Vec3, normal: Vec3) -> f64 {
        let key = PixelKey::new(0, 0, 1);
        let count = 1 << 14;
        (0..count)
            .filter_map(|i| light.illuminate(point, key.point(i, 0)))
            .map(|light| light.irradiance.x * light.towards.dot(normal).max(0.0))
            .sum::<f64>()
            / f64::from(count)
    }

    const UP: Vec3 = Vec3 {
        x: 0.0,
        y: 1.0,
        z: 0.0,
    };
    const DOWN: Vec3 = Vec3 {
        x: 0.0,
        y: -1.0,
        z: 0.0,
    };

    fn flat(surface: Surface, x: f64, z: f64, height: f64) -> AreaLight {
        let axes = [Vec3::new(x, 0.0, 0.0), Vec3::new(0.0, 0.0, z), DOWN];
        AreaLight::new(surface, UP * height, axes, Vec3::ONE * 3.0, None)
    }

    #[test]
    fn a_disc_above_a_plane_has_the_closed_form() {
        for (radius, height) in [(0.1, 2.0), (1.0, 1.0), (3.0, 0.5)] {
            let got = irradiance(&flat(Surface::Disc, radius, radius, height), Vec3::ZERO, UP);
            let expected = 3.0 * PI * radius * radius / (radius * radius + height * height);
            assert!(
                (got / expected - 1.0).abs() < 2e-3,
                "{radius} {height}: {got} {expected}"
            );
        }
    }

    #[test]
    fn a_rectangle_above_a_plane_has_the_closed_form() {
        for (x, z, height) in [(1.0, 1.0, 1.0), (0.2, 2.0, 0.7), (3.0, 1.0, 2.0)] {
            let got = irradiance(&flat(Surface::Rectangle, x, z, height), Vec3::ZERO, UP);
            // The view factor from below a corner, four times (Hottel's C-11 of Howell's catalogue).
            let (a, b): (f64, f64) = (x / height, z / height);
            let part = |a: f64, b: f64| {
                let root = (1.0 + a * a).sqrt();
                a / root * (b / root).atan()
            };
            let expected = 3.0 * PI * 4.0 * (part(a, b) + part(b, a)) / (2.0 * PI);
            assert!(
                (got / expected - 1.0).abs() < 2e-3,
                "{x} {z} {height}: {got} {expected}"
            );
        }
    }

    #[test]
    fn flat_lights_shine_to_one_side() {
        for surface in [Surface::Rectangle, Surface::Disc] {
            let light = flat(surface, 1.0, 1.0, 1.0);
            assert!(irradiance(&light, UP * 2.0, DOWN).abs() < 1e-12);
            assert!(irradiance(&light, Vec3::ZERO, UP) > 1.0);
        }
    }

    #[test]
    fn cylinders_shine_as_their_walls_do() {
        let unit = [Vec3::new(0.5, 0.0, 0.0), UP, Vec3::new(0.0, 0.0, -1.0)];
        // Far away: radiance times its shadow over the square of the distance.
        let light = AreaLight::new(Surface::Cylinder, UP * 1000.0, unit, Vec3::ONE, None);
        let got = irradiance(&light, Vec3::ZERO, UP) * 1e6;
        assert!((got / 2.0 - 1.0).abs() < 2e-3, "{got}");
        // Infinitely long: a plane at distance D of the axis sees π L r / D.
        let long = [Vec3::new(1e4, 0.0, 0.0), UP * 0.5, Vec3::new(0.0, 0.0, 0.5)];
        let axis = AreaLight::new(Surface::Cylinder, UP * 2.0, long, Vec3::ONE, None);
        let count = 1 << 18;
        let key = PixelKey::new(0, 0, 1);
        let sum: f64 = (0..count)
            .filter_map(|i| axis.illuminate(Vec3::ZERO, key.point(i, 0)))
            .map(|light| light.irradiance.x * light.towards.y)
            .sum();
        let got = sum / f64::from(count);
        assert!((got / (PI * 0.25) - 1.0).abs() < 0.05, "{got}");
        assert!(light.illuminate(UP * 1000.0, [0.5, 0.5]).is_none());
    }

    #[test]
    fn images_of_lights_shine_as_finer_ones_do() {
        // A disc that is scaled unevenly and sheared, against small rectangles that fill it.
        let (u, v) = (Vec3::new(1.0, 0.2, 0.0), Vec3::new(0.4, 0.0, 0.5));
        let light = AreaLight::new(Surface::Disc, UP * 1.5, [u, v, DOWN], Vec3::ONE, None);
        let normal = Vec3::new(0.1, 1.0, 0.3).normalized();
        let got = irradiance(&light, Vec3::new(0.3, 0.0, 0.1), normal);
        let count = 200;
        let mut expected = 0.0;
        for i in 0..count {
            for j in 0..count {
                let at = |k: i32| (2.0 * f64::from(k) + 1.0) / f64::from(count) - 1.0;
                if at(i) * at(i) + at(j) * at(j) < 1.0 {
                    let small = 1.0 / f64::from(count);
                    let axes = [u * small, v * small, DOWN];
                    let center = UP * 1.5 + u * at(i) + v * at(j);
                    let part = AreaLight::new(Surface::Rectangle, center, axes, Vec3::ONE, None);
                    let light = part.illuminate(Vec3::new(0.3, 0.0, 0.1), [0.5, 0.5]);
                    expected += light.map_or(0.0, |l| l.irradiance.x * l.towards.dot(normal));
                }
            }
        }
        assert!((got / expected - 1.0).abs() < 5e-3, "{got} {expected}");
    }
}
