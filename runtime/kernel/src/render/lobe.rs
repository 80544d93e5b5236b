//! Microfacet lobes: GGX distribution, height-correlated Smith shadowing (Heitz, "Understanding the
//! masking-shadowing function", JCGT 3(2) 2014), Schlick's Fresnel factor.
use super::direction::sin_cos_turns;
use super::vector::Vec3;
use crate::lanes::Lanes;
use std::f64::consts::PI;

/// One microfacet lobe.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lobe {
    pub alpha: f64,
    /// Reflectance at normal incidence.
    pub f0: Vec3,
    /// Reflectance at grazing incidence.
    pub f90: f64,
}

/// Cosines below this are taken as this: grazing views have no half vector to speak of.
pub(super) const SMALLEST_COSINE: f64 = 1e-6;

/// The cosines on which a lobe depends.
pub(super) struct Angles<L = f64> {
    cos_view: L,
    cos_light: L,
    cos_normal: L,
    pub cos_half: L,
}

impl<L: Lanes<Scalar = f64>> Angles<L> {
    #[inline(always)]
    pub fn new(normal: Vec3<L>, view: Vec3<L>, light: Vec3<L>) -> Angles<L> {
        let (zero, one) = (L::zero(), L::splat(1.0));
        let half = (view + light).normalized();
        Angles {
            cos_view: normal.dot(view).max(L::splat(SMALLEST_COSINE)),
            cos_light: normal.dot(light),
            cos_normal: normal.dot(half).max(zero).min(one),
            cos_half: view.dot(half).max(zero).min(one),
        }
    }
}

impl Lobe {
    /// Schlick's factor.
    #[inline(always)]
    pub fn fresnel<L: Lanes<Scalar = f64>>(&self, cos: L) -> Vec3<L> {
        let one = L::splat(1.0);
        let x = one - cos;
        let square = x * x;
        let grazing = square * square * x;
        let edge = grazing * L::splat(self.f90);
        Vec3::splat(self.f0) * (one - grazing) + Vec3::new(edge, edge, edge)
    }

    /// Distribution times shadowing times cosine over 4 cos cos: the lobe without its Fresnel
    /// factor.
    #[inline(always)]
    pub fn scale<L: Lanes<Scalar = f64>>(&self, angles: &Angles<L>, widening: L) -> L {
        let &Angles {
            cos_view,
            cos_light,
            cos_normal,
            ..
        } = angles;
        let one = L::splat(1.0);
        let a2 = L::splat(self.alpha * self.alpha) + widening;
        let slope_view = (a2 + (one - a2) * cos_view * cos_view).sqrt();
        let slope_light = (a2 + (one - a2) * cos_light * cos_light).sqrt();
        let d = one - (one - a2) * cos_normal * cos_normal;
        // D · shadowing · cos = a² / (π d²) · 1 / (2 (l·slope(v) + v·slope(l))) · l
        let below = d * d * (cos_light * slope_view + cos_view * slope_light);
        let scale = a2 * cos_light / below * L::splat(0.5 / PI);
        L::select(cos_light.gt(L::zero()), scale, L::zero())
    }

    /// Density with which [`Lobe::draw`] gives the direction of these angles.
    #[inline]
    pub fn density(&self, angles: &Angles) -> f64 {
        let &Angles {
            cos_view,
            cos_normal,
            ..
        } = angles;
        let a2 = self.alpha * self.alpha;
        let slope = (a2 + (1.0 - a2) * cos_view * cos_view).sqrt();
        distribution(a2, cos_normal) / (2.0 * (cos_view + slope))
    }

    /// The mirror direction of `view` about a visible microfacet normal, in local components, by
    /// Dupuy and Benyoub, "Sampling visible GGX normals with spherical caps", HPG 2023.
    #[inline]
    pub fn draw(&self, view: Vec3, [u, v]: [f64; 2]) -> Vec3 {
        let stretched = Vec3::new(view.x * self.alpha, view.y * self.alpha, view.z).normalized();
        let (sin, cos) = sin_cos_turns(v);
        let z = (1.0 - u) * (1.0 + stretched.z) - stretched.z;
        let radius = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
        let half = Vec3::new(radius * cos, radius * sin, z) + stretched;
        let half = Vec3::new(half.x * self.alpha, half.y * self.alpha, half.z).normalized();
        half * (2.0 * view.dot(half)) - view
    }
}

/// The GGX distribution of microfacet normals, `a2` being α².
#[inline(always)]
fn distribution(a2: f64, cos_normal: f64) -> f64 {
    let d = 1.0 - (1.0 - a2) * cos_normal * cos_normal;
    a2 / (PI * d * d)
}
