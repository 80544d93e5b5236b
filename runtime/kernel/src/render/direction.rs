//! Directions drawn from points of the unit square.
use super::vector::Vec3;
use crate::lanes::{Lanes, each};

/// A right-handed orthonormal basis whose third vector is the unit vector `n`, by Duff et al.,
/// "Building an orthonormal basis, revisited", JCGT 6(1) 2017.
#[derive(Clone, Copy, Debug)]
pub struct Basis<L = f64> {
    tangent: Vec3<L>,
    bitangent: Vec3<L>,
    normal: Vec3<L>,
}

impl Basis {
    /// The same basis in all lanes.
    #[inline(always)]
    pub fn in_lanes<L: Lanes<Scalar = f64>>(&self) -> Basis<L> {
        Basis {
            tangent: Vec3::splat(self.tangent),
            bitangent: Vec3::splat(self.bitangent),
            normal: Vec3::splat(self.normal),
        }
    }
}

impl<L: Lanes<Scalar = f64>> Basis<L> {
    /// The basis around `normal`.
    #[inline(always)]
    pub fn new(normal: Vec3<L>) -> Basis<L> {
        let Vec3 { x, y, z } = normal;
        let one = L::splat(1.0);
        let sign = one.copy_sign(z);
        let a = -one / (sign + z);
        let b = x * y * a;
        Basis {
            tangent: Vec3::new(one + sign * x * x * a, sign * b, -sign * x),
            bitangent: Vec3::new(b, sign + y * y * a, -y),
            normal,
        }
    }

    /// World-space vector of local components (tangent, bitangent, normal).
    #[inline(always)]
    pub fn world(&self, local: Vec3<L>) -> Vec3<L> {
        self.tangent * local.x + self.bitangent * local.y + self.normal * local.z
    }

    /// Local components of a world-space vector.
    #[inline(always)]
    pub fn local(&self, world: Vec3<L>) -> Vec3<L> {
        Vec3::new(
            world.dot(self.tangent),
            world.dot(self.bitangent),
            world.dot(self.normal),
        )
    }
}

/// A unit vector around +z with density cos θ / π.
#[inline(always)]
pub fn cosine_hemisphere<L: Lanes<Scalar = f64>>([u, v]: [L; 2]) -> Vec3<L> {
    let (sin, cos) = sin_cos_turns(v);
    let radius = u.sqrt();
    Vec3::new(radius * cos, radius * sin, (L::splat(1.0) - u).sqrt())
}

/// A unit vector uniformly distributed in the cone around +z of which `one_minus_cos` is 1 minus
/// the cosine of the half angle (given so, because narrow cones lose the angle in the cosine).
#[inline(always)]
pub fn cone<L: Lanes<Scalar = f64>>([u, v]: [L; 2], one_minus_cos: L) -> Vec3<L> {
    let (sin, cos) = sin_cos_turns(v);
    let below = u * one_minus_cos;
    let radius = (below * (L::splat(2.0) - below)).sqrt();
    Vec3::new(radius * cos, radius * sin, L::splat(1.0) - below)
}

/// Sine and cosine of `turns` in [0, 1) whole turns, to 1e-8.
///
/// One of these is drawn for every secondary ray, where `libm` would cost as much as tracing:
/// reduced to an eighth of a turn either way, the Taylor polynomials of degree 9 and 10 suffice.
#[inline(always)]
pub fn sin_cos_turns<L: Lanes<Scalar = f64>>(turns: L) -> (L, L) {
    /// Adding and subtracting it rounds small numbers to integers.
    const ROUNDER: f64 = 1.5 * (1u64 << 52) as f64;
    let quarter = (turns * L::splat(4.0) + L::splat(ROUNDER)) - L::splat(ROUNDER);
    let x = (turns - quarter * L::splat(0.25)) * L::splat(std::f64::consts::TAU);
    let s = x * x;
    let sin = L::splat(1.0 / 5040.0) - s * L::splat(1.0 / 362_880.0);
    let sin = L::splat(1.0 / 6.0) - s * (L::splat(1.0 / 120.0) - s * sin);
    let sin = x * (L::splat(1.0) - s * sin);
    let cos = L::splat(1.0 / 40320.0) - s * L::splat(1.0 / 3_628_800.0);
    let cos = L::splat(1.0 / 24.0) - s * (L::splat(1.0 / 720.0) - s * cos);
    let cos = L::splat(1.0) - s * (L::splat(0.5) - s * cos);
    // Quarter by quarter (sin, cos), (cos, -sin), (-sin, -cos), (-cos, sin).
    let [first, second, third] = each!([1.0, 2.0, 3.0], |q| quarter.eq(L::splat(q)));
    let odd = first | third;
    let (sin, cos) = (L::select(odd, cos, sin), L::select(odd, sin, cos));
    (
        L::select(second | third, -sin, sin),
        L::select(first | second, -cos, cos),
    )
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
