//! What varies over surfaces: materials with textures, and shading normals.
//!
//! Where a scene has none of it there is no [`Detail`], and shading knows materials only.
use super::attributes::{Attributes, Name, Place};
use super::material::{Material, Parameters};
use super::texture::{Image, Wrap};
use super::vector::Vec3;
use crate::ray::{Hit, Trace};

/// What a texture gives: an index of `compiler.ir.TEXTURED`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Parameter {
    Diffuse,
    Emission,
    SpecularWorkflow,
    Specular,
    Metallic,
    Roughness,
    Clearcoat,
    ClearcoatRoughness,
    Opacity,
    OpacityThreshold,
    Ior,
    /// The normal in tangent space.
    Normal,
}

impl Parameter {
    /// The parameters in order.
    pub const ALL: [Parameter; 12] = [
        Parameter::Diffuse,
        Parameter::Emission,
        Parameter::SpecularWorkflow,
        Parameter::Specular,
        Parameter::Metallic,
        Parameter::Roughness,
        Parameter::Clearcoat,
        Parameter::ClearcoatRoughness,
        Parameter::Opacity,
        Parameter::OpacityThreshold,
        Parameter::Ior,
        Parameter::Normal,
    ];

    /// Whether it decides how much light passes.
    fn is_opacity(self) -> bool {
        matches!(self, Parameter::Opacity | Parameter::OpacityThreshold)
    }
}

/// Which numbers of a texel are used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channels {
    /// One of red, green, blue and alpha, which is also every channel of a colour.
    One(usize),
    /// Red, green and blue; of a number, red.
    Rgb,
}

/// Where a texture's numbers come from.
pub enum Source {
    /// The attribute itself.
    Attribute,
    /// A picture, which the attribute's first two numbers have coordinates in.
    Image(Image),
    /// Pictures of unit squares, by column and row from the origin.
    Tiles(Vec<([i64; 2], Image)>),
    /// A picture that cannot be read.
    Missing,
}

/// `compiler.ir.TEXTURE`.
pub struct Texture {
    /// What it gives.
    pub parameter: Parameter,
    /// Where its numbers come from.
    pub source: Source,
    /// The attribute that it reads.
    pub attribute: Name,
    /// What of a texel is used.
    pub channels: Channels,
    /// What is beyond the picture, to the sides, and above and below.
    pub wrap: [Wrap; 2],
    /// What texels are multiplied by.
    pub scale: [f64; 4],
    /// What is added to them then.
    pub bias: [f64; 4],
    /// The value in place of a picture that cannot be read.
    pub fallback: [f64; 4],
    /// What coordinates are multiplied by: two rows.
    pub matrix: [[f64; 3]; 2],
}

impl Texture {
    fn coordinates(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        self.matrix.map(|[a, b, c]| a * u + b * v + c)
    }

    /// The value at a place; None where the attribute that is the value is missing.
    ///
    /// Coordinates that are missing are 0, as those of UsdPrimvarReader.
    fn value(&self, place: &Place) -> Option<[f64; 4]> {
        let at = || {
            let found = place.value::<2>(self.attribute);
            self.coordinates(found.map_or([0.0; 2], |(value, _)| value))
        };
        let texel = match &self.source {
            Source::Attribute => {
                let ([r, g, b, a], width) = place.value::<4>(self.attribute)?;
                return Some(match width {
                    1 => [r, r, r, 1.0],
                    4.. => [r, g, b, a],
                    _ => [r, g, b, 1.0],
                });
            }
            Source::Missing => return Some(self.fallback),
            Source::Image(image) => image.sample(at(), self.wrap),
            Source::Tiles(tiles) => {
                let [u, v] = at();
                let tile = [u.floor(), v.floor()];
                let number = tile.map(|x| x as i64);
                match tiles.iter().find(|(tile, _)| *tile == number) {
                    Some((_, image)) => image.sample([u - tile[0], v - tile[1]], [Wrap::Clamp; 2]),
                    None => return Some(self.fallback),
                }
            }
        };
        Some(std::array::from_fn(|i| {
            f64::from(texel[i]) * self.scale[i] + self.bias[i]
        }))
    }
}

/// A material and the textures that replace some of its parameters.
pub struct Textured {
    /// What holds where no texture does.
    pub parameters: Parameters,
    /// At most one for each parameter.
    pub textures: Vec<Texture>,
}

impl Textured {
    /// The parameters at a place, of those that are `wanted`.
    fn parameters(&self, place: &Place, wanted: impl Fn(Parameter) -> bool) -> Parameters {
        let mut parameters = self.parameters;
        for texture in &self.textures {
            if !wanted(texture.parameter) {
                continue;
            }
            let Some(value @ [r, g, b, _]) = texture.value(place) else {
                continue;
            };
            let (color, number) = match texture.channels {
                Channels::One(channel) => (Vec3::ONE * value[channel], value[channel]),
                Channels::Rgb => (Vec3::new(r, g, b), r),
            };
            match texture.parameter {
                Parameter::Diffuse => parameters.diffuse = color,
                Parameter::Emission => parameters.emission = color,
                Parameter::SpecularWorkflow => parameters.specular_workflow = number != 0.0,
                Parameter::Specular => parameters.specular = color,
                Parameter::Metallic => parameters.metallic = number,
                Parameter::Roughness => parameters.roughness = number,
                Parameter::Clearcoat => parameters.clearcoat = number,
                Parameter::ClearcoatRoughness => parameters.clearcoat_roughness = number,
                Parameter::Opacity => parameters.opacity = number,
                Parameter::OpacityThreshold => parameters.opacity_threshold = number,
                Parameter::Ior => parameters.ior = number,
                Parameter::Normal => {}
            }
        }
        parameters
    }

    /// The normal that a normal map gives for an outward one.
    fn bent(&self, place: &Place, normal: Vec3) -> Option<Vec3> {
        let mut textures = self.textures.iter();
        let map = textures.find(|texture| texture.parameter == Parameter::Normal)?;
        let [x, y, z, _] = map.value(place)?;
        let (corners, _) = place.corners::<2>(map.attribute)?;
        let at = corners.map(|corner| map.coordinates(corner.map(f64::from)));
        let [tangent, bitangent] = place.tangents(at)?;
        let tangent = (tangent - normal * normal.dot(tangent)).normalized();
        let across = normal.cross(tangent);
        let across = across * 1f64.copysign(across.dot(bitangent));
        let bent = (tangent * x + across * y + normal * z).normalized();
        bent.is_finite().then_some(bent)
    }
}

/// What is particular to a point of a surface.
pub struct Shading {
    /// The material there.
    pub material: Material,
    /// The outward normal to shade with, if it is not the geometric one.
    pub normal: Option<Vec3>,
}

/// Attributes of meshes and textures of materials.
pub struct Detail {
    /// Of meshes.
    attributes: Attributes,
    /// By material; None where it has no textures.
    textured: Vec<Option<Textured>>,
}

impl Detail {
    /// The detail of a scene.
    pub fn new(attributes: Attributes, textured: Vec<Option<Textured>>) -> Detail {
        Detail {
            attributes,
            textured,
        }
    }

    fn textured(&self, hit: &Hit) -> Option<&Textured> {
        self.textured.get(hit.material as usize)?.as_ref()
    }

    /// Whether a texture gives any of these parameters to a material.
    fn gives(&self, parameters: impl Fn(Parameter) -> bool) -> bool {
        let textures = self.textured.iter().flatten().flat_map(|t| &t.textures);
        textures.into_iter().any(|t| parameters(t.parameter))
    }

    /// Whether anything may be transparent.
    pub fn is_transparent(&self) -> bool {
        self.gives(Parameter::is_opacity)
    }

    /// Whether anything may glow.
    pub fn glows(&self) -> bool {
        self.gives(|parameter| parameter == Parameter::Emission)
    }

    /// The opacity at a hit, if it is not that of its material everywhere.
    pub fn opacity(&self, trace: &dyn Trace, hit: &Hit) -> Option<f64> {
        let textured = self.textured(hit)?;
        let mut textures = textured.textures.iter();
        if !textures.any(|texture| texture.parameter.is_opacity()) {
            return None;
        }
        let place = Place::new(&self.attributes, trace, hit);
        Some(textured.parameters(&place, Parameter::is_opacity).hides())
    }

    /// What is particular to a hit; `constant` is its material.
    pub fn shading(&self, trace: &dyn Trace, hit: &Hit, constant: &Material) -> Option<Shading> {
        let textured = self.textured(hit);
        if textured.is_none() && !self.attributes.has_normals(hit) {
            return None;
        }
        let place = Place::new(&self.attributes, trace, hit);
        let mut normal = place.normal();
        let Some(textured) = textured else {
            return Some(Shading {
                material: *constant,
                normal,
            });
        };
        let outward = normal.unwrap_or(hit.normal.into());
        normal = textured.bent(&place, outward).or(normal);
        Some(Shading {
            material: Material::new(&textured.parameters(&place, |_| true)),
            normal,
        })
    }
}
