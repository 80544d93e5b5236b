//! Triangle meshes: a tree over blocks of triangles, shared by all instances.
use super::arrays::SceneArrays;
use super::validate::range;
use super::{Buffer, SceneError};
use crate::bvh::{Bounds, Child, MAX_ITEMS, Tree, build};
use crate::huge_pages;
use crate::scalar::Scalar;
use std::sync::OnceLock;
use std::sync::atomic::AtomicU8;

/// Triangles of a block, and most that share a leaf.
///
/// Blocks are as small as they can be: large meshes are traced at the speed of the cache.
pub const BLOCK: usize = 4;

/// Up to [`BLOCK`] triangles by coordinate, in the normalised space of their mesh.
#[derive(Clone)]
#[repr(C, align(64))]
pub struct TriangleBlock<F> {
    /// `corners[corner][axis][lane]`; NaN in unused lanes, which nothing hits.
    pub corners: [[[F; BLOCK]; 3]; 3],
    /// Which triangle of the mesh each lane holds.
    pub triangles: [u32; BLOCK],
    /// Lanes in use.
    pub len: u32,
}

/// A mesh made ready.
pub struct Mesh<F> {
    /// Leaves are indices of `blocks`; its space is that of the blocks.
    pub tree: Tree,
    /// All triangles.
    pub blocks: Vec<TriangleBlock<F>>,
    points: Buffer<[f64; 3]>,
    triangles: Buffer<[i32; 3]>,
    first_point: usize,
    first_triangle: usize,
    /// How many triangles there are.
    pub triangle_count: usize,
    /// What `super::horizon` knows of each, if anybody asked.
    pub(super) sides: OnceLock<Vec<AtomicU8>>,
}

impl<F: Scalar> Mesh<F> {
    /// Prepares mesh number `mesh` of the arrays.
    pub(super) fn new(arrays: &SceneArrays, mesh: usize) -> Result<Mesh<F>, SceneError> {
        let fail = |message: String| Err(SceneError(format!("mesh {mesh}: {message}")));
        let [first_point, end_point, first_triangle, end_triangle] = arrays.mesh_ranges[mesh];
        let point_range = range(
            &format!("mesh {mesh}: points"),
            [first_point, end_point],
            arrays.mesh_points.len(),
        )?;
        let triangle_range = range(
            &format!("mesh {mesh}: triangles"),
            [first_triangle, end_triangle],
            arrays.mesh_triangles.len(),
        )?;
        let points = &arrays.mesh_points[point_range.clone()];
        let triangles = &arrays.mesh_triangles[triangle_range.clone()];
        if triangles.len() > MAX_ITEMS {
            return fail(format!(
                "{} triangles; the limit is {MAX_ITEMS}",
                triangles.len()
            ));
        }
        if points.iter().flatten().any(|x| !x.is_finite()) {
            return fail("a point is not finite".into());
        }
        let in_range = |&index: &i32| index >= 0 && (index as usize) < points.len();
        if !triangles.iter().flatten().all(in_range) {
            return fail("a triangle has an index that is not one of its points".into());
        }
        let corners = |triangle: u32| triangles[triangle as usize].map(|i| points[i as usize]);
        let bounds: Vec<Bounds> = (0..triangles.len() as u32)
            .map(|i| {
                corners(i)
                    .iter()
                    .fold(Bounds::EMPTY, |b, &p| b.with_point(p))
            })
            .collect();
        let mut leaves: Vec<Vec<u32>> = Vec::new();
        let tree = build(&bounds, BLOCK, |leaf| {
            leaves.push(leaf.to_vec());
            Child::leaf(leaves.len() as u32 - 1)
        });
        drop(bounds);
        let mut blocks = huge_pages::with_capacity(leaves.len());
        blocks.extend(leaves.into_iter().map(|leaf| {
            let mut block = TriangleBlock {
                corners: [[[F::from_f64(f64::NAN); BLOCK]; 3]; 3],
                triangles: [0; BLOCK],
                len: leaf.len() as u32,
            };
            for (lane, &triangle) in leaf.iter().enumerate() {
                block.triangles[lane] = triangle;
                for (corner, p) in corners(triangle).into_iter().enumerate() {
                    for (axis, x) in tree.space.to_normal(p).into_iter().enumerate() {
                        block.corners[corner][axis][lane] = F::from_f64(x);
                    }
                }
            }
            block
        }));
        Ok(Mesh {
            tree,
            blocks,
            points: arrays.mesh_points.clone(),
            triangles: arrays.mesh_triangles.clone(),
            first_point: point_range.start,
            first_triangle: triangle_range.start,
            triangle_count: triangle_range.len(),
            sides: OnceLock::new(),
        })
    }

    /// The corners of a triangle in object space.
    pub fn corners(&self, triangle: u32) -> [[f64; 3]; 3] {
        self.corner_points(triangle)
            .map(|i| self.points[self.first_point + i])
    }

    /// The corners of a triangle as points of the mesh.
    pub fn corner_points(&self, triangle: u32) -> [usize; 3] {
        self.triangles[self.first_triangle + triangle as usize].map(|i| i as usize)
    }

    /// Around all points that triangles use.
    pub fn bounds(&self) -> Bounds {
        (0..self.blocks.len())
            .flat_map(|block| {
                let block = &self.blocks[block];
                &block.triangles[..block.len as usize]
            })
            .flat_map(|&triangle| self.corners(triangle))
            .fold(Bounds::EMPTY, |bounds, p| bounds.with_point(p))
    }

    /// How far from the middle of their bounds the triangles reach, in normalised space.
    pub fn reach(&self) -> f64 {
        (0..self.triangle_count as u32)
            .flat_map(|triangle| self.corners(triangle))
            .map(|p| self.tree.space.to_normal(p).iter().map(|x| x * x).sum())
            .fold(0.0, f64::max)
            .sqrt()
    }

    /// Bytes held.
    pub fn nbytes(&self) -> usize {
        let sides = self.sides.get().map_or(0, Vec::capacity);
        self.tree.nbytes() + self.blocks.capacity() * size_of::<TriangleBlock<F>>() + sides
    }
}
