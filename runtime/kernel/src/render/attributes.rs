//! Numbers that vary over meshes: `compiler.ir.MESH_ATTRIBUTE`.
use super::vector::Vec3;
use crate::ray::{Hit, OnTriangle, Trace};
use crate::scene::Buffer;
use std::ops::Range;

/// The number that stands for an attribute's name, the same for all meshes.
pub type Name = u32;

/// The name of shading normals.
pub const NORMALS: Name = 0;

/// One attribute of a mesh: rows of numbers.
#[derive(Clone, Copy, Debug)]
pub struct Attribute {
    /// Its name.
    pub name: Name,
    /// Numbers of a row.
    pub width: usize,
    /// Where its rows start.
    pub first_value: usize,
    /// Where the rows of the corners of the mesh's triangles start; None: rows are by point.
    pub first_corner: Option<usize>,
}

/// The attributes of a scene's meshes.
pub struct Attributes {
    values: Buffer<f32>,
    corners: Buffer<i32>,
    attributes: Vec<Attribute>,
    /// Of each prototype, which of them it has.
    prototypes: Vec<Range<usize>>,
}

impl Attributes {
    /// Attributes of which each prototype has a stretch.
    pub fn new(
        values: Buffer<f32>,
        corners: Buffer<i32>,
        attributes: Vec<Attribute>,
        prototypes: Vec<Range<usize>>,
    ) -> Attributes {
        Attributes {
            values,
            corners,
            attributes,
            prototypes,
        }
    }

    /// Whether what is hit has shading normals.
    pub fn has_normals(&self, hit: &Hit) -> bool {
        self.of(hit)
            .iter()
            .any(|attribute| attribute.name == NORMALS)
    }

    /// Those of what is hit.
    fn of(&self, hit: &Hit) -> &[Attribute] {
        let prototype = usize::try_from(hit.prototype).unwrap_or(usize::MAX);
        let range = self.prototypes.get(prototype).cloned();
        range.map_or(&[], |range| &self.attributes[range])
    }
}

/// A hit and the attributes there.
pub struct Place<'a> {
    attributes: &'a Attributes,
    own: &'a [Attribute],
    triangle: u32,
    on: Option<OnTriangle>,
}

impl<'a> Place<'a> {
    /// The place of a hit.
    pub fn new(attributes: &'a Attributes, trace: &dyn Trace, hit: &Hit) -> Place<'a> {
        let own = attributes.of(hit);
        Place {
            attributes,
            own,
            triangle: hit.primitive,
            on: (!own.is_empty()).then(|| trace.on_triangle(hit)).flatten(),
        }
    }

    /// The first N numbers of an attribute at the corners, and how many it has; missing ones are 0.
    pub fn corners<const N: usize>(&self, name: Name) -> Option<([[f32; N]; 3], usize)> {
        let on = self.on.as_ref()?;
        let attribute = self.own.iter().find(|attribute| attribute.name == name)?;
        let rows = match attribute.first_corner {
            None => on.points,
            Some(first) => {
                let first = first + 3 * self.triangle as usize;
                let rows = self.attributes.corners.get(first..first + 3)?;
                [rows[0] as usize, rows[1] as usize, rows[2] as usize]
            }
        };
        let mut corners = [[0.0; N]; 3];
        let count = attribute.width.min(N);
        for (corner, row) in corners.iter_mut().zip(rows) {
            let start = attribute.first_value + row * attribute.width;
            corner[..count].copy_from_slice(self.attributes.values.get(start..start + count)?);
        }
        Some((corners, attribute.width))
    }

    /// The first N numbers of an attribute here, and how many it has.
    pub fn value<const N: usize>(&self, name: Name) -> Option<([f64; N], usize)> {
        let (corners, width) = self.corners::<N>(name)?;
        let weights = self.on.as_ref()?.weights;
        let at = |i: usize| (0..3).map(|c| weights[c] * f64::from(corners[c][i])).sum();
        Some((std::array::from_fn(at), width))
    }

    /// The shading normal, unit and outward; None where the mesh has none.
    pub fn normal(&self) -> Option<Vec3> {
        let (corners, _) = self.corners::<3>(NORMALS)?;
        let OnTriangle {
            weights,
            object_from_world: m,
            ..
        } = self.on.as_ref()?;
        let mut sum = Vec3::ZERO;
        for (corner, weight) in corners.iter().zip(weights) {
            let normal = Vec3::from(corner.map(f64::from));
            // Normals of any length count the same; those of none do not.
            let length = normal.dot(normal).sqrt();
            if length > 0.0 {
                sum += normal * (weight / length);
            }
        }
        let largest = m
            .as_flattened()
            .iter()
            .fold(0.0, |l: f64, x| l.max(x.abs()));
        let row = |i: usize| Vec3::from(m[i]) * (1.0 / largest);
        let normal = (row(0) * sum.x + row(1) * sum.y + row(2) * sum.z).normalized();
        normal.is_finite().then_some(normal)
    }

    /// The directions in which the coordinates `at` the corners grow, in world space.
    pub fn tangents(&self, at: [[f64; 2]; 3]) -> Option<[Vec3; 2]> {
        let [u, v] = self.on.as_ref()?.edges.map(Vec3::from);
        let [[s1, t1], [s2, t2]] = [1, 2].map(|c| [at[c][0] - at[0][0], at[c][1] - at[0][1]]);
        let sign = 1f64.copysign(s1 * t2 - s2 * t1);
        let tangents = [(u * t2 - v * t1) * sign, (v * s1 - u * s2) * sign];
        Some(tangents.map(Vec3::normalized))
    }
}
