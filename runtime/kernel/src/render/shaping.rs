//! How a light's radiance depends on the direction in which it leaves: UsdLuxShapingAPI.
use super::vector::Vec3;

/// A cone around an axis, and a power of the cosine to it.
#[derive(Clone, Copy, Debug)]
pub struct Shaping {
    axis: Vec3,
    inner: f64,
    outer: f64,
    focus: f64,
}

impl Shaping {
    /// Nothing leaves at more than `cone` degrees from `axis` (unit); between
    /// (1 - `softness`) · `cone` and there it falls smoothly. None where nothing is shaped.
    pub fn new(axis: Vec3, cone: f64, softness: f64, focus: f64) -> Option<Shaping> {
        let outer = cone.to_radians();
        (cone < 180.0 || focus > 0.0).then(|| Shaping {
            axis,
            inner: outer * (1.0 - softness.clamp(0.0, 1.0)),
            outer,
            focus: focus.max(0.0),
        })
    }

    /// The part of the light that leaves against `towards`, the unit vector to the light.
    #[inline]
    pub fn factor(&self, towards: Vec3) -> f64 {
        let cos = (-self.axis.dot(towards)).clamp(-1.0, 1.0);
        let angle = libm::acos(cos);
        let focused = if self.focus > 0.0 {
            libm::pow(cos.max(0.0), self.focus)
        } else {
            1.0
        };
        let inside = if angle >= self.outer {
            0.0
        } else if angle <= self.inner {
            1.0
        } else {
            let x = (self.outer - angle) / (self.outer - self.inner);
            x * x * (3.0 - 2.0 * x)
        };
        focused * inside
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn factor(degrees: f64, cone: f64, softness: f64, focus: f64) -> f64 {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let towards = Vec3::new(sin, cos, 0.0);
        Shaping::new(Vec3::new(0.0, -1.0, 0.0), cone, softness, focus)
            .map_or(1.0, |shaping| shaping.factor(towards))
    }

    #[test]
    fn cones_end_where_they_say() {
        assert_eq!(
            [29.9, 30.1, 179.0].map(|a| factor(a, 30.0, 0.0, 0.0)),
            [1.0, 0.0, 0.0]
        );
        assert_eq!([14.9, 30.1].map(|a| factor(a, 30.0, 0.5, 0.0)), [1.0, 0.0]);
        assert!((factor(22.5, 30.0, 0.5, 0.0) - 0.5).abs() < 1e-9);
        assert_eq!(factor(179.0, 180.0, 0.0, 0.0), 1.0);
    }

    #[test]
    fn focus_is_a_power_of_the_cosine() {
        assert!((factor(60.0, 180.0, 0.0, 3.0) - 0.125).abs() < 1e-12);
        assert_eq!(factor(91.0, 180.0, 0.0, 3.0), 0.0);
    }
}
