//! Surface appearance: the parameters of UsdPreviewSurface, prepared for shading.
//!
//! The reflectance is Lambert's, below a specular lobe, below a clear coat; α is roughness². A lobe
//! whose reflectance at normal incidence is 0 (ior 1, black specular) is left out.
use super::direction::{Basis, cosine_hemisphere};
use super::light::Illumination;
use super::lobe::{Angles, Lobe, SMALLEST_COSINE};
use super::vector::Vec3;
use crate::lanes::{Lanes, Mask};
use std::f64::consts::PI;

/// A material as in `compiler.ir.MATERIAL`, colours linear.
#[derive(Clone, Copy, Debug)]
pub struct Parameters {
    /// Diffuse colour; of metals the reflectance at normal incidence.
    pub diffuse: Vec3,
    /// Emitted radiance.
    pub emission: Vec3,
    /// Take the reflectance at normal incidence from `specular`, not from `ior` and `metallic`.
    pub specular_workflow: bool,
    /// Reflectance at normal incidence in the specular workflow.
    pub specular: Vec3,
    /// 0 dielectric … 1 metal.
    pub metallic: f64,
    /// 0 mirror … 1 dull.
    pub roughness: f64,
    /// Weight of the clear coat.
    pub clearcoat: f64,
    /// Roughness of the clear coat.
    pub clearcoat_roughness: f64,
    /// 0 transparent … 1 opaque.
    pub opacity: f64,
    /// Above 0: parts with less opacity are cut out, the others opaque.
    pub opacity_threshold: f64,
    /// Index of refraction.
    pub ior: f64,
}

impl Parameters {
    /// How much of what lies behind is hidden, 0 … 1; cut-outs resolved.
    pub fn hides(&self) -> f64 {
        let opacity = self.opacity.clamp(0.0, 1.0);
        if self.opacity_threshold > 0.0 {
            f64::from(u8::from(opacity >= self.opacity_threshold))
        } else {
            opacity
        }
    }
}

/// A material prepared for shading.
#[derive(Clone, Copy, Debug)]
pub struct Material {
    /// Emitted radiance.
    pub emission: Vec3,
    /// How much of what lies behind is hidden, 0 … 1; cut-outs resolved.
    pub opacity: f64,
    albedo: Vec3,
    specular: Option<Lobe>,
    coat: Option<Lobe>,
}

/// The materials of a scene, and those that are a vertex's own, numbered on from them.
#[derive(Clone, Copy)]
pub struct Materials<'a> {
    /// The scene's.
    pub scene: &'a [Material],
    /// Vertices' own.
    pub own: &'a [Material],
}

impl<'a> Materials<'a> {
    /// Material of that number.
    #[inline(always)]
    pub fn get(&self, number: u32) -> &'a Material {
        let number = number as usize;
        let of_scene = self.scene.get(number);
        of_scene.unwrap_or_else(|| &self.own[number - self.scene.len()])
    }
}

/// How often [`Material::draw`] draws each lobe of a view.
struct Chances {
    diffuse: f64,
    first: (Lobe, f64),
    second: Option<(Lobe, f64)>,
}

impl Chances {
    #[inline]
    fn draw(&self, normal: Vec3, view: Vec3, [u, v]: [f64; 2]) -> Vec3 {
        if u < self.diffuse {
            return diffuse_direction(normal, [u / self.diffuse, v]);
        }
        let (lobe, u) = match self.second {
            Some((coat, chance)) if u >= 1.0 - chance => (coat, (u - (1.0 - chance)) / chance),
            _ => {
                let (lobe, chance) = self.first;
                (lobe, ((u - self.diffuse) / chance).min(1.0))
            }
        };
        let basis = Basis::new(normal);
        basis.world(lobe.draw(basis.local(view), [u, v]))
    }

    /// The density with which directions of these angles are drawn; `facing` is the cosine.
    #[inline]
    fn density(&self, facing: f64, angles: &Angles) -> f64 {
        let (first, chance) = self.first;
        let of_second = |(coat, chance): (Lobe, f64)| chance * coat.density(angles);
        self.diffuse * facing / PI
            + chance * first.density(angles)
            + self.second.map_or(0.0, of_second)
    }
}

#[inline]
fn diffuse_direction(normal: Vec3, sample: [f64; 2]) -> Vec3 {
    Basis::new(normal).world(cosine_hemisphere(sample))
}

/// Narrower lobes are widened to this: their highlights would fall between the samples.
const SMALLEST_ALPHA: f64 = 1e-3;

impl Material {
    /// The prepared material. Parameters outside of their ranges are clamped.
    pub fn new(parameters: &Parameters) -> Material {
        let p = parameters;
        let metallic = p.metallic.clamp(0.0, 1.0);
        let ratio = (1.0 - p.ior) / (1.0 + p.ior);
        let dielectric = ratio * ratio;
        let (albedo, f0) = if p.specular_workflow {
            (p.diffuse, p.specular)
        } else {
            let f0 = Vec3::ONE * (dielectric * (1.0 - metallic)) + p.diffuse * metallic;
            (p.diffuse * (1.0 - metallic), f0)
        };
        let lobe = |roughness: f64, f0: Vec3, f90: f64| {
            let roughness = roughness.clamp(0.0, 1.0);
            let alpha = (roughness * roughness).max(SMALLEST_ALPHA);
            (f0 != Vec3::ZERO).then_some(Lobe { alpha, f0, f90 })
        };
        let clearcoat = p.clearcoat.clamp(0.0, 1.0);
        Material {
            emission: p.emission,
            opacity: p.hides(),
            albedo,
            // Below 2 % no real surface is: it fades out at grazing incidence too (Lagarde and de
            // Rousiers, "Moving Frostbite to PBR", 2014).
            specular: lobe(p.roughness, f0, (50.0 * f0.x.max(f0.y).max(f0.z)).min(1.0)),
            coat: lobe(
                p.clearcoat_roughness,
                Vec3::ONE * (dielectric * clearcoat),
                clearcoat,
            ),
        }
    }

    /// Radiance towards `view` that the light causes on a surface of unit normal `normal`.
    ///
    /// The lobes are evaluated once, at the axis of the light, widened by its angular radius (a
    /// half vector turns half as far as the light): highlights of small lights on smooth
    /// surfaces are then free of noise.
    #[inline(always)]
    pub fn reflect_light<L: Lanes<Scalar = f64>>(
        &self,
        normal: Vec3<L>,
        view: Vec3<L>,
        light: &Illumination<L>,
    ) -> Vec3<L> {
        let facing = normal.dot(light.towards);
        let lit = facing.gt(L::zero());
        let black = Vec3::splat(Vec3::ZERO);
        if !lit.any() {
            return black;
        }
        let reflected = if self.is_matte() {
            Vec3::splat(self.albedo) * light.irradiance * (facing * L::splat(1.0 / PI))
        } else {
            let angles = Angles::new(normal, view, light.axis);
            let widening = L::splat(0.25) * light.sin * light.sin;
            self.reflectance(facing, &angles, widening) * light.irradiance
        };
        Vec3::select(lit, reflected, black)
    }

    /// A direction drawn for light from everywhere, and its weight: reflectance times cosine over
    /// density. None for directions below the surface, which carry nothing.
    ///
    /// One of the lobes is drawn by its importance and all are evaluated (the one-sample balance
    /// heuristic of Veach, 1997, § 9.2.4), so that no weight is large.
    #[inline]
    pub fn draw(&self, normal: Vec3, view: Vec3, sample: [f64; 2]) -> Option<(Vec3, Vec3)> {
        if self.is_matte() {
            return Some((diffuse_direction(normal, sample), self.albedo));
        }
        let chances = self.chances(normal, view)?;
        let direction = chances.draw(normal, view, sample);
        let (reflectance, density) = self.reflect_lobes(&chances, normal, view, direction)?;
        Some((direction, reflectance * (1.0 / density)))
    }

    /// The direction of [`Material::draw`]; None where all lobes are black.
    #[inline]
    pub fn draw_direction(&self, normal: Vec3, view: Vec3, sample: [f64; 2]) -> Option<Vec3> {
        if self.is_matte() {
            return Some(diffuse_direction(normal, sample));
        }
        Some(self.chances(normal, view)?.draw(normal, view, sample))
    }

    /// Reflectance times cosine of light from a direction, and the density with which
    /// [`Material::draw_direction`] gives it. None below the surface.
    #[inline]
    pub fn reflect(&self, normal: Vec3, view: Vec3, direction: Vec3) -> Option<(Vec3, f64)> {
        if self.is_matte() {
            let cosine = normal.dot(direction) * (1.0 / PI);
            return (cosine > 0.0).then(|| (self.albedo * cosine, cosine));
        }
        self.reflect_lobes(&self.chances(normal, view)?, normal, view, direction)
    }

    #[inline]
    fn reflect_lobes(
        &self,
        chances: &Chances,
        normal: Vec3,
        view: Vec3,
        direction: Vec3,
    ) -> Option<(Vec3, f64)> {
        let facing = normal.dot(direction);
        if facing <= 0.0 {
            return None;
        }
        let angles = Angles::new(normal, view, direction);
        let density = chances.density(facing, &angles);
        Some((self.reflectance(facing, &angles, 0.0), density))
    }

    /// Whether all that it reflects is diffuse.
    #[inline(always)]
    pub fn is_matte(&self) -> bool {
        self.specular.is_none() && self.coat.is_none()
    }

    /// How often each lobe is drawn; None where none of them shines, or all are black.
    #[inline]
    fn chances(&self, normal: Vec3, view: Vec3) -> Option<Chances> {
        let specular = self.specular.or(self.coat)?;
        let cos_view = normal.dot(view).max(SMALLEST_COSINE);
        let importance = |lobe: Lobe| lobe.fresnel(cos_view).luminance();
        let diffuse = self.albedo.luminance();
        let first = importance(specular);
        // With a coat and a base lobe, `second` is the coat.
        let coat = self.specular.and(self.coat);
        let second = coat.map_or(0.0, importance);
        let total = diffuse + first + second;
        (total > 0.0).then(|| Chances {
            diffuse: diffuse / total,
            first: (specular, first / total),
            second: coat.map(|coat| (coat, second / total)),
        })
    }

    /// Reflectance times cosine: `facing` is the cosine for the diffuse part, `angles` are for
    /// the lobes, whose α² grows by `widening`.
    #[inline(always)]
    fn reflectance<L: Lanes<Scalar = f64>>(
        &self,
        facing: L,
        angles: &Angles<L>,
        widening: L,
    ) -> Vec3<L> {
        let mut result = Vec3::splat(self.albedo) * (facing * L::splat(1.0 / PI));
        for lobe in [&self.specular, &self.coat].into_iter().flatten() {
            let fresnel = lobe.fresnel(angles.cos_half);
            let passed = Vec3::splat(Vec3::ONE) - fresnel;
            result = result * passed + fresnel * lobe.scale(angles, widening);
        }
        result
    }
}

#[cfg(test)]
mod tests {
    use super::super::sampler::PixelKey;
    use super::*;
    use proptest::prelude::*;

    const PLASTIC: Parameters = Parameters {
        diffuse: Vec3::new(0.8, 0.5, 0.2),
        emission: Vec3::ZERO,
        specular_workflow: false,
        specular: Vec3::ZERO,
        metallic: 0.0,
        roughness: 0.5,
        clearcoat: 0.0,
        clearcoat_roughness: 0.01,
        opacity: 1.0,
        opacity_threshold: 0.0,
        ior: 1.5,
    };

    const UP: Vec3 = Vec3::new(0.0, 0.0, 1.0);

    fn view(sin: f64) -> Vec3 {
        Vec3::new(sin, 0.0, (1.0 - sin * sin).sqrt())
    }

    /// What a surface reflects of a sky of radiance 1, by importance.
    fn white_sky(material: &Material, view: Vec3, count: u32) -> Vec3 {
        let key = PixelKey::new(0, 0, 1);
        let mut sum = Vec3::ZERO;
        for i in 0..count {
            if let Some((_, weight)) = material.draw(UP, view, key.point(i, 0)) {
                sum += weight;
            }
        }
        sum * (1.0 / f64::from(count))
    }

    /// The same by directions drawn with the cosine, as from one light after another.
    fn white_sky_by_lights(material: &Material, view: Vec3, count: u32) -> Vec3 {
        let key = PixelKey::new(0, 0, 2);
        let mut sum = Vec3::ZERO;
        for i in 0..count {
            let towards = cosine_hemisphere(key.point(i, 0));
            let light = Illumination {
                towards,
                axis: towards,
                sin: 0.0,
                irradiance: Vec3::ONE,
                distance: f64::INFINITY,
            };
            sum += material.reflect_light(UP, view, &light) * (PI / towards.z.max(1e-9));
        }
        sum * (1.0 / f64::from(count))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        /// Two independent estimates of the same integral agree, and no energy is made.
        #[test]
        fn drawing_and_evaluating_agree(
            roughness in 0.4..1.0f64, coat_roughness in 0.5..1.0f64,
            metallic in 0.0..1.0f64, clearcoat in 0.0..1.0f64, sin in 0.0..0.95f64,
        ) {
            let material = Material::new(&Parameters {
                roughness, metallic, clearcoat, clearcoat_roughness: coat_roughness, ..PLASTIC
            });
            let drawn = white_sky(&material, view(sin), 1 << 13);
            let lit = white_sky_by_lights(&material, view(sin), 1 << 13);
            let difference = drawn - lit;
            prop_assert!(difference.dot(difference).sqrt() < 0.02, "{drawn:?} {lit:?}");
            prop_assert!(drawn.x <= 1.0 + 1e-3);
        }

        #[test]
        fn weights_are_bounded_and_finite(
            roughness in 0.0..1.0f64, metallic in 0.0..1.0f64, clearcoat in 0.0..1.0f64,
            sin in 0.0..1.0f64, seed: u64,
        ) {
            let material = Material::new(&Parameters { roughness, metallic, clearcoat, ..PLASTIC });
            let key = PixelKey::new(0, 0, seed);
            for i in 0..64 {
                if let Some((direction, weight)) = material.draw(UP, view(sin), key.point(i, 0)) {
                    prop_assert!(weight.is_finite() && weight.x <= 4.0, "{weight:?}");
                    prop_assert!((direction.dot(direction) - 1.0).abs() < 1e-7);
                }
            }
        }
    }

    #[test]
    fn no_lobe_is_left_of_ior_one_or_black_specular() {
        let matte = Material::new(&Parameters {
            ior: 1.0,
            ..PLASTIC
        });
        let black = Material::new(&Parameters {
            specular_workflow: true,
            ..PLASTIC
        });
        for material in [matte, black] {
            assert!(material.specular.is_none());
            assert_eq!(white_sky(&material, view(0.3), 4), PLASTIC.diffuse);
        }
    }

    #[test]
    fn a_mirror_reflects_the_sky_in_its_colour() {
        let mirror = Material::new(&Parameters {
            roughness: 0.0,
            metallic: 1.0,
            ..PLASTIC
        });
        let difference = white_sky(&mirror, UP, 1 << 10) - PLASTIC.diffuse;
        assert!(difference.dot(difference).sqrt() < 1e-2);
    }

    #[test]
    fn thresholds_cut_out() {
        let at = |opacity, opacity_threshold| {
            Material::new(&Parameters {
                opacity,
                opacity_threshold,
                ..PLASTIC
            })
            .opacity
        };
        assert_eq!([at(0.4, 0.0), at(0.4, 0.5), at(0.5, 0.5)], [0.4, 0.0, 1.0]);
    }
}
