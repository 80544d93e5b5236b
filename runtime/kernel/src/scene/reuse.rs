//! What a scene takes over from the one it is an update of.
//!
//! An editor that moves an object, or the next frame of an animation, compiles to arrays that are
//! mostly the old ones. Meshes are known again by their content, wherever they stand in the arrays;
//! a group by its place, if its instances' matrices and what they are of are the same. To compare
//! costs a pass over the arrays; whatever differs is built.
use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use super::arrays::{Affine, SceneArrays};
use super::mesh::Mesh;
use super::{Geometry, Group, Scene};
use crate::scalar::Scalar;
use crate::shapes::ShapeKind;

/// Looks for parts of a new scene in an old one.
pub(super) struct Reuse<'a, F: Scalar> {
    before: Option<&'a Scene<F>>,
    arrays: &'a SceneArrays,
    /// Old prototypes that are meshes, by their numbers of points and triangles.
    meshes: HashMap<[i64; 2], Vec<usize>>,
    /// Of prototypes whether the old one of that number is the same; filled when first asked for.
    prototypes: Vec<Option<bool>>,
    /// Of groups, likewise.
    groups: Vec<bool>,
}

impl<F: Scalar> Scene<F> {
    /// The prototypes that are meshes, and where in `made_from` those are.
    fn mesh_ranges(&self) -> impl Iterator<Item = (usize, [i64; 4])> {
        let meshes = self.prototypes.iter().enumerate();
        meshes.filter_map(|(number, prototype)| match prototype.geometry {
            Geometry::Mesh(_) => {
                let mesh = self.made_from.prototype_data[number] as usize;
                Some((number, self.made_from.mesh_ranges[mesh]))
            }
            Geometry::Shape(_) => None,
        })
    }
}

fn lengths([first_point, end_point, first, end]: [i64; 4]) -> [i64; 2] {
    [end_point - first_point, end - first]
}

/// Rows of a table, if it has them.
fn rows<T>(table: &[T], ends: [i64; 2]) -> Option<&[T]> {
    table.get(usize::try_from(ends[0]).ok()?..usize::try_from(ends[1]).ok()?)
}

/// Whether two meshes are the same; at once if they are where they were.
fn same_mesh(a: &SceneArrays, of_a: [i64; 4], b: &SceneArrays, of_b: [i64; 4]) -> bool {
    fn same<T: PartialEq>(a: Option<&[T]>, b: Option<&[T]>) -> bool {
        a.zip(b).is_some_and(|(a, b)| std::ptr::eq(a, b) || a == b)
    }
    let ([p, q, s, t], [i, j, k, l]) = (of_a, of_b);
    same(rows(&a.mesh_points, [p, q]), rows(&b.mesh_points, [i, j]))
        && same(
            rows(&a.mesh_triangles, [s, t]),
            rows(&b.mesh_triangles, [k, l]),
        )
}

impl<'a, F: Scalar> Reuse<'a, F> {
    /// Of the new scene's arrays, which are valid but for shapes and meshes.
    pub fn new(before: Option<&'a Scene<F>>, arrays: &'a SceneArrays) -> Reuse<'a, F> {
        let mut meshes: HashMap<_, Vec<usize>> = HashMap::new();
        for (number, range) in before.iter().flat_map(|before| before.mesh_ranges()) {
            meshes.entry(lengths(range)).or_default().push(number);
        }
        Reuse {
            before,
            arrays,
            meshes,
            prototypes: vec![None; arrays.prototype_kind.len()],
            groups: vec![false; arrays.group_ranges.len()],
        }
    }

    /// The old mesh that equals mesh number `mesh` of the new arrays.
    pub fn mesh(&self, mesh: usize) -> Option<Arc<Mesh<F>>> {
        let before = self.before?;
        let range = self.arrays.mesh_ranges[mesh];
        self.meshes
            .get(&lengths(range))?
            .iter()
            .find_map(|&number| match &before.prototypes[number].geometry {
                Geometry::Mesh(mesh) => {
                    let old = &before.made_from;
                    let old_range = old.mesh_ranges[old.prototype_data[number] as usize];
                    same_mesh(old, old_range, self.arrays, range).then(|| Arc::clone(mesh))
                }
                Geometry::Shape(_) => None,
            })
    }

    /// The old group of that number, if it is the same. To be asked for inner groups first.
    pub fn group(&mut self, group: usize) -> Option<Arc<Group>> {
        let before = self.before?;
        let old = &before.made_from;
        let ends = self.arrays.group_ranges[group];
        if old.group_ranges.get(group) != Some(&ends) {
            return None;
        }
        let range = ends[0] as usize..ends[1] as usize;
        let same = same_matrices(self.arrays, old, range.clone())
            && self.arrays.instance_target[range.clone()] == old.instance_target[range.clone()]
            && range.into_iter().all(|row| self.is_same_target(row));
        self.groups[group] = same;
        same.then(|| Arc::clone(&before.groups[group]))
    }

    fn is_same_target(&mut self, row: usize) -> bool {
        match usize::try_from(self.arrays.instance_target[row]) {
            Ok(prototype) => {
                let same =
                    self.prototypes[prototype].unwrap_or_else(|| self.is_same_prototype(prototype));
                self.prototypes[prototype] = Some(same);
                same
            }
            Err(_) => self.groups[!self.arrays.instance_target[row] as usize],
        }
    }

    fn is_same_prototype(&self, number: usize) -> bool {
        let Some(before) = self.before else {
            return false;
        };
        let (new, old) = (self.arrays, &before.made_from);
        let kind = new.prototype_kind[number];
        if old.prototype_kind.get(number) != Some(&kind) {
            return false;
        }
        let (data, old_data) = (new.prototype_data[number], old.prototype_data[number]);
        match ShapeKind::from_index(kind) {
            None => same_mesh(
                new,
                new.mesh_ranges[data as usize],
                old,
                old.mesh_ranges[old_data as usize],
            ),
            Some(kind) => {
                let count = kind.parameter_count() as i64;
                rows(&new.shape_parameters, [data, data + count])
                    == rows(&old.shape_parameters, [old_data, old_data + count])
            }
        }
    }
}

/// Whether instances stand where they stood.
fn same_matrices(new: &SceneArrays, old: &SceneArrays, range: Range<usize>) -> bool {
    let same = |new: &[Affine], old: &[Affine]| new[range.clone()] == old[range.clone()];
    same(&new.world_from_object, &old.world_from_object)
        && same(&new.object_from_world, &old.object_from_world)
}
