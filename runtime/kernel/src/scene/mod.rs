//! A scene made ready for tracing at one precision.
//!
//! Groups hold trees over their instances, meshes hold trees over their triangles; analytic
//! shapes are shared by all their instances. Matrices stay where the IR has them.
mod arrays;
mod build;
mod horizon;
mod instance_block;
mod mesh;
mod reuse;
mod validate;

pub use arrays::{Affine, Buffer, SceneArrays};
pub use instance_block::InstanceBlock;
pub use mesh::{BLOCK, Mesh, TriangleBlock};

use std::sync::Arc;

use crate::bvh::{Bounds, Child, NormalSpace, Tree};
use crate::lanes::InstructionSet;
use crate::prefetch::{prefetch, prefetch_either};
use crate::scalar::Scalar;
use crate::shapes::Shape;

/// What is wrong with an IR.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneError(pub String);

impl std::fmt::Display for SceneError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for SceneError {}

/// A scene for intersectors of scalar F.
pub struct Scene<F: Scalar> {
    /// What the vector code is compiled for.
    pub(crate) set: InstructionSet,
    pub(crate) instance_target: Buffer<i32>,
    pub(crate) world_from_object: Buffer<Affine>,
    pub(crate) object_from_world: Buffer<Affine>,
    pub(crate) translation_low: Buffer<[f32; 3]>,
    pub(crate) instance_material: Buffer<i32>,
    pub(crate) prototypes: Vec<Prototype<F>>,
    pub(crate) groups: Vec<Arc<Group>>,
    /// Leaves of the root.
    pub(crate) leaf_count: i64,
    /// What it was made from, for scenes that come after it.
    made_from: SceneArrays,
}

/// What is instanced.
pub(crate) struct Prototype<F: Scalar> {
    pub geometry: Geometry<F>,
    pub anchor: Anchor,
    /// The space in which `geometry` is stored and intersected.
    pub space: NormalSpace,
}

pub(crate) enum Geometry<F: Scalar> {
    Shape(Shape<F>),
    Mesh(Arc<Mesh<F>>),
}

/// Instances under one tree.
pub(crate) struct Group {
    /// Row of the first instance.
    pub start: usize,
    /// Over the bounded instances; leaves are indices of `blocks`, or the only item there.
    pub tree: Tree,
    /// The instances that the tree holds.
    pub blocks: Vec<InstanceBlock>,
    /// Instances to be tested by every ray, as offsets from `start`.
    pub unbounded: Vec<u32>,
    /// Leaves before each instance of the group; empty when they are the offset.
    pub leaves_before: Vec<i64>,
    /// Nearly all instances are of shapes that take longer to intersect than to enter, none of
    /// groups or large meshes: rays better stay together even if they are not coherent.
    pub dear: bool,
    /// Around all bounded leaves.
    pub bounds: Bounds,
    pub anchor: Anchor,
}

impl Group {
    /// Asks for what a child of the tree refers to, before it is needed.
    #[inline(always)]
    pub fn prefetch(&self, child: Child) {
        let number = child.number() as usize;
        prefetch_either(child.is_node(), &self.tree.nodes, &self.blocks, number);
    }

    /// How many leaves the group has before its instance at `offset`.
    #[inline(always)]
    pub fn leaves_before(&self, offset: usize) -> i64 {
        if self.leaves_before.is_empty() {
            offset as i64
        } else {
            self.leaves_before[offset]
        }
    }

    /// The instance, as an offset, that holds a leaf of the group, and its first leaf.
    pub fn find_leaf(&self, leaf: i64) -> (usize, i64) {
        if self.leaves_before.is_empty() {
            return (leaf as usize, leaf);
        }
        let after = self.leaves_before.partition_point(|&before| before <= leaf);
        (after - 1, self.leaves_before[after - 1])
    }
}

/// Where an object wants the origins of rays to be: near itself, so that rounding them to F
/// costs nothing. They are slid there along the ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Anchor {
    /// Middle of the object, in its space.
    pub center: [f64; 3],
    /// Origins whose squared distance from the centre is larger slide to their closest approach.
    pub reach: f64,
    /// The object lies in y = 0: origins slide there instead, which is the hit but for rounding.
    pub flat: bool,
}

impl Anchor {
    /// For an object within these bounds; without any, origins stay.
    fn around(bounds: Option<&Bounds>) -> Anchor {
        match bounds {
            Some(bounds) if bounds.is_finite() => {
                let half = bounds.half_extent();
                Anchor {
                    center: bounds.center(),
                    reach: 4.0 * half.iter().map(|h| h * h).sum::<f64>(),
                    flat: false,
                }
            }
            _ => Anchor {
                center: [0.0; 3],
                reach: f64::INFINITY,
                flat: false,
            },
        }
    }
}

impl<F: Scalar> Scene<F> {
    /// Validates and prepares a scene. Errors name what is wrong with the arrays.
    pub fn new(arrays: SceneArrays, set: InstructionSet) -> Result<Scene<F>, SceneError> {
        build::build(arrays, set, None)
    }

    /// Prepares another scene, likely to be much like this one: shares with it the trees of meshes
    /// that both have, and those of groups whose instances have not changed. The same as `new` but
    /// for the time it takes.
    pub fn updated(&self, arrays: SceneArrays) -> Result<Scene<F>, SceneError> {
        build::build(arrays, self.set, Some(self))
    }

    /// Asks for the way into instance `row`, before it is needed.
    #[inline(always)]
    pub(crate) fn prefetch(&self, row: usize) {
        prefetch(&self.instance_target, row);
        prefetch(&self.object_from_world, row);
        prefetch(&self.world_from_object, row);
    }

    /// Whether any of its objects is a mesh.
    pub(crate) fn has_meshes(&self) -> bool {
        let is_mesh = |prototype: &Prototype<F>| matches!(prototype.geometry, Geometry::Mesh(_));
        self.prototypes.iter().any(is_mesh)
    }

    /// World-space box of all bounded leaves.
    pub fn bounds(&self) -> Bounds {
        self.groups[0].bounds
    }

    /// The instruction set that traces.
    pub fn instruction_set(&self) -> InstructionSet {
        self.set
    }

    /// Bytes held beyond the arrays the scene was built from.
    pub fn nbytes(&self) -> usize {
        let prototypes: usize = self
            .prototypes
            .iter()
            .map(|prototype| match &prototype.geometry {
                Geometry::Shape(_) => 0,
                Geometry::Mesh(mesh) => mesh.nbytes(),
            })
            .sum();
        let groups: usize = self
            .groups
            .iter()
            .map(|group| {
                group.tree.nbytes()
                    + group.blocks.capacity() * size_of::<InstanceBlock>()
                    + group.unbounded.capacity() * size_of::<u32>()
                    + group.leaves_before.capacity() * size_of::<i64>()
            })
            .sum();
        size_of::<Self>()
            + prototypes
            + groups
            + self.prototypes.capacity() * size_of::<Prototype<F>>()
            + self.groups.capacity() * size_of::<Group>()
    }
}
