//! What traversal does at a level of instancing, whether of packets or of single rays.
use crate::instance::Entrance;
use crate::scalar::Scalar;
use crate::scene::{Geometry, Group, Prototype, Scene};

/// What an instance is of.
pub(crate) enum Target<'s, F: Scalar> {
    Prototype(&'s Prototype<F>),
    Group(&'s Group),
}

impl<F: Scalar> Target<'_, F> {
    /// Whether a packet is through with it as soon as one ray is.
    #[inline(always)]
    pub(crate) fn is_simple(&self) -> bool {
        match self {
            Target::Group(_) => false,
            Target::Prototype(prototype) => match &prototype.geometry {
                Geometry::Mesh(mesh) => mesh.blocks.len() <= 1,
                Geometry::Shape(_) => true,
            },
        }
    }
}

impl<F: Scalar> Scene<F> {
    /// What instance `row` is of.
    #[inline(always)]
    pub(crate) fn target(&self, row: usize) -> Target<'_, F> {
        let target = self.instance_target[row];
        match usize::try_from(target) {
            Ok(prototype) => Target::Prototype(&self.prototypes[prototype]),
            Err(_) => Target::Group(&self.groups[!target as usize]),
        }
    }

    /// The way into instance `row`, whose target has that anchor.
    #[inline(always)]
    pub(crate) fn entrance(&self, row: usize, target: &Target<'_, F>) -> Entrance<'_> {
        Entrance {
            object_from_world: &self.object_from_world[row],
            translation: self.world_from_object[row].map(|r| r[3]),
            translation_low: self.translation_low.get(row).copied().unwrap_or_default(),
            anchor: match target {
                Target::Prototype(prototype) => prototype.anchor,
                Target::Group(group) => group.anchor,
            },
        }
    }
}
