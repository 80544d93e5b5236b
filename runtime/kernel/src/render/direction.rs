//! Directions drawn from points of the unit square.
use super::vector::Vec3;

/// A right-handed orthonormal basis whose third vector is the unit vector `n`, by Duff et al.,
/// "Building an orthonormal basis, revisited", JCGT 6(1) 2017.
#[derive(Clone, Copy, Debug)]
pub struct Basis {
    tangent: Vec3,
    bitangent: Vec3,
    normal: Vec3,
}

impl Basis {
    /// The basis around `normal`.
    #[inline(always)]
    pub fn new(normal: Vec3) -> Basis {
        let Vec3 { x, y, z } = normal;
        let sign = 1f64.copysign(z);
        let a = -1.0 / (sign + z);
        let b = x * y * a;
        Basis {
            tangent: Vec3::new(1.0 + sign * x * x * a, sign * b, -sign * x),
            bitangent: Vec3::new(b, sign + y * y * a, -y),
            normal,
        }
    }

    /// World-space vector of local components (tangent, bitangent, normal).
    #[inline(always)]
    pub fn world(&self, local: Vec3) -> Vec3 {
        self.tangent * local.x + self.bitangent * local.y + self.normal * local.z
    }

    /// Local components of a world-space vector.
    #[inline(always)]
    pub fn local(&self, world: Vec3) -> Vec3 {
        Vec3::new(
            world.dot(self.tangent),
            world.dot(self.bitangent),
            world.dot(self.normal),
        )
    }
}

/// A unit vector around +z with density cos θ / π.
#[inline(always)]
pub fn cosine_hemisphere([u, v]: [f64; 2]) -> Vec3 {
    let (sin, cos) = sin_cos_turns(v);
    let radius = u.sqrt();
    Vec3::new(radius * cos, radius * sin, (1.0 - u).sqrt())
}

/// A unit vector uniformly distributed in the cone around +z of which `one_minus_cos` is 1 minus
/// the cosine of the half angle (given so, because narrow cones lose the angle in the cosine).
#[inline(always)]
pub fn cone([u, v]: [f64; 2], one_minus_cos: f64) -> Vec3 {
    let (sin, cos) = sin_cos_turns(v);
    let below = u * one_minus_cos;
    let radius = (below * (2.0 - below)).sqrt();
    Vec3::new(radius * cos, radius * sin, 1.0 - below)
}

/// Sine and cosine of `turns` in [0, 1) whole turns, to 1e-8.
///
/// One of these is drawn for every secondary ray, where `libm` would cost as much as tracing:
/// reduced to an eighth of a turn either way, the Taylor polynomials of degree 9 and 10 suffice.
#[inline(always)]
pub fn sin_cos_turns(turns: f64) -> (f64, f64) {
    let quarter = (turns * 4.0 + 0.5) as i32;
    let x = (turns - f64::from(quarter) * 0.25) * std::f64::consts::TAU;
    let s = x * x;
    let sin = 1.0 / 5040.0 - s * (1.0 / 362_880.0);
    let sin = x * (1.0 - s * (1.0 / 6.0 - s * (1.0 / 120.0 - s * sin)));
    let cos = 1.0 / 40320.0 - s * (1.0 / 3_628_800.0);
    let cos = 1.0 - s * (0.5 - s * (1.0 / 24.0 - s * (1.0 / 720.0 - s * cos)));
    // Quarter by quarter (sin, cos), (cos, -sin), (-sin, -cos), (-cos, sin), without branches,
    // which nothing could predict.
    let swap = quarter & 1 != 0;
    let (sin, cos) = (if swap { cos } else { sin }, if swap { sin } else { cos });
    let negated = |value: f64, bit: i32| f64::from_bits(value.to_bits() ^ ((bit as u64 & 2) << 62));
    (negated(sin, quarter), negated(cos, quarter + 1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn unit() -> impl Strategy<Value = Vec3> {
        ([-1.0..1.0f64, -1.0..1.0, -1.0..1.0])
            .prop_filter("direction", |v| v.iter().map(|c| c * c).sum::<f64>() > 1e-3)
            .prop_map(|v| Vec3::from(v).normalized())
    }

    proptest! {
        #[test]
        fn bases_are_orthonormal_and_right_handed(n in unit()) {
            let basis = Basis::new(n);
            let (t, b) = (basis.tangent, basis.bitangent);
            let cross = Vec3::new(t.y * b.z - t.z * b.y, t.z * b.x - t.x * b.z, t.x * b.y - t.y * b.x);
            prop_assert!((cross - n).dot(cross - n) < 1e-24);
            prop_assert!(t.dot(b).abs() < 1e-12 && (t.dot(t) - 1.0).abs() < 1e-12);
            let v = Vec3::new(0.3, -0.5, 0.7);
            let back = basis.world(basis.local(v));
            prop_assert!((back - v).dot(back - v) < 1e-24);
        }

        #[test]
        fn sines_agree_with_libm(turns in 0.0..1.0f64) {
            let (sin, cos) = sin_cos_turns(turns);
            let angle = turns * std::f64::consts::TAU;
            prop_assert!((sin - libm::sin(angle)).abs() < 1e-8);
            prop_assert!((cos - libm::cos(angle)).abs() < 1e-8);
        }

        #[test]
        fn cones_hold_their_directions(u in 0.0..1.0f64, v in 0.0..1.0f64, exponent in -14.0..0.0f64) {
            let one_minus_cos = 10f64.powf(exponent);
            let d = cone([u, v], one_minus_cos);
            prop_assert!((d.dot(d) - 1.0).abs() < 1e-8);
            prop_assert!(1.0 - d.z <= one_minus_cos * (1.0 + 1e-9) + 1e-16);
        }
    }
}
