//! What traversal does at a level of instancing, whether of packets or of single rays.
use crate::bvh::{NormalSpace, Tree};
use crate::instance::Entrance;
use crate::scalar::Scalar;
use crate::scene::{Group, Mesh, Prototype, Scene};

/// What the leaves of a level's tree mean.
pub enum Content<'s, F: Scalar> {
    /// Instances of a group, whose first leaf has this number.
    Group(&'s Group, i64),
    /// Triangle blocks of a mesh, which is one leaf, of this number.
    Mesh(&'s Mesh<F>, i64),
}

impl<F: Scalar> Clone for Content<'_, F> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<F: Scalar> Copy for Content<'_, F> {}

impl<'s, F: Scalar> Content<'s, F> {
    #[inline(always)]
    pub fn tree(&self) -> &'s Tree {
        match self {
            Content::Group(group, _) => &group.tree,
            Content::Mesh(mesh, _) => &mesh.tree,
        }
    }

    /// From the space of the level's rays to that of the tree: rays enter meshes normalised.
    #[inline(always)]
    pub fn space(&self) -> NormalSpace {
        match self {
            Content::Group(group, _) => group.tree.space,
            Content::Mesh(..) => NormalSpace::IDENTITY,
        }
    }

    /// Offsets of the instances that every ray is to be tested with.
    #[inline(always)]
    pub fn unbounded(&self) -> &'s [u32] {
        match self {
            Content::Group(group, _) => &group.unbounded,
            Content::Mesh(..) => &[],
        }
    }
}

/// What an instance is of.
pub(crate) enum Target<'s, F: Scalar> {
    Prototype(&'s Prototype<F>),
    Group(&'s Group),
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
