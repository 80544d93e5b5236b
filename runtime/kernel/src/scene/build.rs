//! From flat arrays to a [`Scene`].
use std::sync::Arc;

use rayon::prelude::*;

use super::arrays::{Affine, SceneArrays};
use super::instance_block::{InstanceBlock, Outline};
use super::mesh::Mesh;
use super::reuse::Reuse;
use super::validate::{range, validate};
use super::{Anchor, Geometry, Group, Prototype, Scene, SceneError};
use crate::bvh::{Bounds, Child, LARGEST_LEAF, MAX_ITEMS, NormalSpace, Tree, build as build_tree};
use crate::huge_pages;
use crate::lanes::InstructionSet;
use crate::scalar::Scalar;
use crate::shapes::{Shape, ShapeKind};

pub(super) fn build<F: Scalar>(
    arrays: SceneArrays,
    set: InstructionSet,
    before: Option<&Scene<F>>,
) -> Result<Scene<F>, SceneError> {
    let checked = validate(&arrays)?;
    let mut reuse = Reuse::new(before, &arrays);
    let (prototypes, hulls) = prototypes(&arrays, &mut reuse)?;
    let mut groups: Vec<Option<Arc<Group>>> = arrays.group_ranges.iter().map(|_| None).collect();
    let mut group_hulls: Vec<Hull> = groups.iter().map(|_| Hull::Boxes(Vec::new())).collect();
    let mut outlines = Outlines {
        prototypes: hulls.iter().map(Hull::outline).collect(),
        groups: vec![None; groups.len()],
    };
    for &index in &checked.order {
        let ends = arrays.group_ranges[index];
        let range = ends[0] as usize..ends[1] as usize;
        let placed: Vec<Placed> = range
            .clone()
            .into_par_iter()
            .map(|i| {
                let hull = match usize::try_from(arrays.instance_target[i]) {
                    Ok(prototype) => &hulls[prototype],
                    Err(_) => &group_hulls[!arrays.instance_target[i] as usize],
                };
                if is_regular(&arrays, i) {
                    hull.placed(&arrays.world_from_object[i])
                } else {
                    Placed::NOWHERE
                }
            })
            .collect();
        let group = match reuse.group(index) {
            Some(group) => group,
            None => Arc::new(group(
                &arrays,
                &checked.leaf_counts,
                range,
                &placed,
                &outlines,
                &prototypes,
            )),
        };
        group_hulls[index] = Hull::of_tree(&group.tree, &group.bounds, !group.unbounded.is_empty());
        outlines.groups[index] = group_hulls[index].outline();
        groups[index] = Some(group);
    }
    Ok(Scene {
        set,
        instance_target: arrays.instance_target.clone(),
        world_from_object: arrays.world_from_object.clone(),
        object_from_world: arrays.object_from_world.clone(),
        translation_low: arrays.translation_low.clone(),
        instance_material: arrays.instance_material.clone(),
        prototypes,
        groups: groups.into_iter().flatten().collect(),
        leaf_count: checked.leaf_counts[0],
        made_from: arrays,
    })
}

fn prototypes<F: Scalar>(
    arrays: &SceneArrays,
    reuse: &mut Reuse<F>,
) -> Result<(Vec<Prototype<F>>, Vec<Hull>), SceneError> {
    let mut prototypes = Vec::with_capacity(arrays.prototype_kind.len());
    let mut hulls = Vec::with_capacity(arrays.prototype_kind.len());
    for (index, (&code, &data)) in arrays
        .prototype_kind
        .iter()
        .zip(&arrays.prototype_data)
        .enumerate()
    {
        let what = format!("prototype {index}");
        let (prototype, hull) = match ShapeKind::from_index(code) {
            None if usize::from(code) != ShapeKind::ALL.len() => {
                return Err(SceneError(format!("{what} has the unknown kind {code}")));
            }
            None => {
                let mesh = range(
                    &what,
                    [data, data.saturating_add(1)],
                    arrays.mesh_ranges.len(),
                )?;
                mesh_prototype(arrays, mesh.start, reuse)?
            }
            Some(kind) => {
                let end = data.saturating_add(kind.parameter_count() as i64);
                let range = range(&what, [data, end], arrays.shape_parameters.len())?;
                shape_prototype(kind, &arrays.shape_parameters[range])
                    .map_err(|reason| SceneError(format!("{what}: {reason}")))?
            }
        };
        prototypes.push(prototype);
        hulls.push(hull);
    }
    Ok((prototypes, hulls))
}

fn mesh_prototype<F: Scalar>(
    arrays: &SceneArrays,
    mesh: usize,
    reuse: &mut Reuse<F>,
) -> Result<(Prototype<F>, Hull), SceneError> {
    let mesh = match reuse.mesh(mesh) {
        Some(mesh) => mesh,
        None => Arc::new(Mesh::new(arrays, mesh)?),
    };
    let bounds = mesh.bounds();
    let hull = Hull::of_mesh(&mesh, &bounds);
    let prototype = Prototype {
        anchor: Anchor::around(Some(&bounds)),
        space: mesh.tree.space,
        geometry: Geometry::Mesh(mesh),
    };
    Ok((prototype, hull))
}

fn shape_prototype<F: Scalar>(
    kind: ShapeKind,
    parameters: &[f64],
) -> Result<(Prototype<F>, Hull), String> {
    let shape = Shape::<F>::new(kind, parameters)?;
    let bounds = shape.bounds().map(|[lower, upper]| Bounds { lower, upper });
    let hull = match (&bounds, kind) {
        (Some(bounds), ShapeKind::Sphere) => Hull::Ball([0.0; 3], bounds.upper[0]),
        (Some(bounds), _) => Hull::Boxes(vec![*bounds]),
        (None, _) => Hull::Unbounded(Vec::new()),
    };
    let anchor = Anchor {
        flat: matches!(
            kind,
            ShapeKind::Disc | ShapeKind::Rectangle | ShapeKind::Plane
        ),
        ..Anchor::around(bounds.as_ref())
    };
    let frame = shape.frame();
    let space = NormalSpace {
        center: frame.center,
        scale: frame.scale,
    };
    let prototype = Prototype {
        geometry: Geometry::Shape(shape),
        anchor,
        space,
    };
    Ok((prototype, hull))
}

fn linear_entries(matrix: &Affine) -> impl Iterator<Item = f64> {
    matrix.iter().flat_map(|row| row[..3].iter().copied())
}

/// Whether an instance can be hit: its matrices are finite, and its object space is not all of
/// the world squeezed into a point.
fn is_regular(arrays: &SceneArrays, i: usize) -> bool {
    let inverse = &arrays.object_from_world[i];
    let finite = |matrix: &Affine| matrix.iter().flatten().all(|x| x.is_finite());
    finite(&arrays.world_from_object[i])
        && finite(inverse)
        && linear_entries(inverse).any(|x| x != 0.0)
}

/// An instance in the space of its group.
#[derive(Clone, Copy)]
struct Placed {
    /// Around its bounded content.
    bounds: Bounds,
    /// It has content beyond those bounds.
    unbounded: bool,
}

impl Placed {
    const NOWHERE: Placed = Placed {
        bounds: Bounds::EMPTY,
        unbounded: false,
    };
}

/// A simple outline of an object, tighter when transformed than its box.
enum Hull {
    /// A ball about a centre: its image has the exact bounds |row of M|·radius.
    Ball([f64; 3], f64),
    /// The union of boxes.
    Boxes(Vec<Bounds>),
    /// As `Boxes`, and content without bounds.
    Unbounded(Vec<Bounds>),
}

/// Outlines of what instances are of.
struct Outlines {
    prototypes: Vec<Option<Outline>>,
    groups: Vec<Option<Outline>>,
}

impl Outlines {
    fn of(&self, target: i32) -> Option<Outline> {
        match usize::try_from(target) {
            Ok(prototype) => self.prototypes[prototype],
            Err(_) => self.groups[!target as usize],
        }
    }
}

impl Hull {
    /// None for content without bounds, and for none at all.
    fn outline(&self) -> Option<Outline> {
        match self {
            Hull::Ball(center, radius) => Some(Outline::ball(*center, *radius)),
            Hull::Boxes(boxes) => {
                let all = boxes.iter().fold(Bounds::EMPTY, |all, b| all.union(b));
                all.is_finite().then(|| Outline::cuboid(&all))
            }
            Hull::Unbounded(_) => None,
        }
    }

    /// A ball if its shadow is smaller than that of the box, which on average is a quarter of the
    /// surface (Cauchy); else boxes.
    fn of_mesh<F: Scalar>(mesh: &Mesh<F>, bounds: &Bounds) -> Hull {
        let NormalSpace { center, scale } = mesh.tree.space;
        let [x, y, z] = bounds.half_extent().map(|half| half * scale);
        let reach = mesh.reach() * (1.0 + 8.0 * f64::EPSILON);
        if std::f64::consts::PI * reach * reach < 2.0 * (x * y + y * z + z * x) {
            Hull::Ball(center, reach / scale)
        } else {
            Hull::of_tree(&mesh.tree, bounds, false)
        }
    }

    /// The boxes of a tree's root, or those it stands for.
    fn of_tree(tree: &Tree, bounds: &Bounds, unbounded: bool) -> Hull {
        let mut boxes = Vec::new();
        if let (Some(root), true) = (tree.nodes.first(), bounds.is_finite()) {
            for i in 0..crate::bvh::WIDTH {
                let back = |plane: usize| {
                    f64::from(root.planes[plane][i]) / tree.space.scale
                        + tree.space.center[plane % 3]
                };
                let part = Bounds {
                    lower: std::array::from_fn(|i| back(i).next_down().max(bounds.lower[i])),
                    upper: std::array::from_fn(|i| back(i + 3).next_up().min(bounds.upper[i])),
                };
                if root.planes[0][i] <= root.planes[3][i] {
                    boxes.push(part);
                }
            }
        } else if !bounds.is_empty() {
            boxes.push(*bounds);
        }
        if unbounded {
            Hull::Unbounded(boxes)
        } else {
            Hull::Boxes(boxes)
        }
    }

    fn placed(&self, world_from_object: &Affine) -> Placed {
        let union = |boxes: &[Bounds]| {
            boxes.iter().fold(Bounds::EMPTY, |all, b| {
                let half = b.half_extent();
                all.union(&transformed(world_from_object, b.center(), |row| {
                    row[0].abs() * half[0] + row[1].abs() * half[1] + row[2].abs() * half[2]
                }))
            })
        };
        let (bounds, unbounded) = match self {
            Hull::Ball(center, radius) => {
                let bounds = transformed(world_from_object, *center, |row| radius * length(row));
                (bounds, false)
            }
            Hull::Boxes(boxes) => (union(boxes), false),
            Hull::Unbounded(boxes) => (union(boxes), true),
        };
        if bounds.is_empty() || bounds.is_finite() {
            Placed { bounds, unbounded }
        } else {
            Placed {
                bounds: Bounds::EMPTY,
                unbounded: true,
            }
        }
    }
}

/// The length of the linear part of a row.
fn length(row: &[f64; 4]) -> f64 {
    let square = row[0] * row[0] + row[1] * row[1] + row[2] * row[2];
    if (1e-280..1e280).contains(&square) {
        square.sqrt()
    } else {
        row[0].hypot(row[1]).hypot(row[2])
    }
}

/// Bounds of the image of a body about `center` whose half width along a row of the matrix is
/// `half(row)`, rounded outward.
///
/// The sums have at most seven roundings of terms below the sum of the magnitudes, hence γ₈.
fn transformed(matrix: &Affine, center: [f64; 3], half: impl Fn(&[f64; 4]) -> f64) -> Bounds {
    const GAMMA: f64 = 8.0 * f64::EPSILON;
    let mut bounds = Bounds::EMPTY;
    for (axis, row) in matrix.iter().enumerate() {
        let terms = [
            row[0] * center[0],
            row[1] * center[1],
            row[2] * center[2],
            row[3],
        ];
        let middle: f64 = terms.iter().sum();
        let half = half(row);
        let error = GAMMA * (terms.iter().map(|x| x.abs()).sum::<f64>() + half) + f64::MIN_POSITIVE;
        bounds.lower[axis] = middle - half - error;
        bounds.upper[axis] = middle + half + error;
    }
    bounds
}

/// See [`Group::dear`].
fn are_dear<F: Scalar>(targets: &[i32], prototypes: &[Prototype<F>]) -> bool {
    let mut dear = 0;
    for &target in targets {
        let Ok(prototype) = usize::try_from(target) else {
            return false;
        };
        match &prototypes[prototype].geometry {
            Geometry::Shape(shape) => dear += usize::from(shape.is_dear()),
            Geometry::Mesh(mesh) if mesh.blocks.len() > 1 => return false,
            Geometry::Mesh(_) => {}
        }
    }
    4 * dear > 3 * targets.len()
}

fn group<F: Scalar>(
    arrays: &SceneArrays,
    leaf_counts: &[i64],
    range: std::ops::Range<usize>,
    placed: &[Placed],
    outlines: &Outlines,
    prototypes: &[Prototype<F>],
) -> Group {
    let mut offsets = Vec::with_capacity(placed.len());
    let mut boxes = Vec::with_capacity(placed.len());
    let mut unbounded = Vec::new();
    let mut bounds = Bounds::EMPTY;
    for (offset, placed) in placed.iter().enumerate() {
        bounds = bounds.union(&placed.bounds);
        if placed.unbounded {
            unbounded.push(offset as u32);
        } else if !placed.bounds.is_empty() {
            offsets.push(offset as u32);
            boxes.push(placed.bounds);
        }
    }
    debug_assert!(boxes.len() <= MAX_ITEMS);
    let mut leaves = Vec::new();
    let targets = &arrays.instance_target[range.clone()];
    let tree = build_tree(&boxes, LARGEST_LEAF, |leaf| {
        if let &[item] = leaf {
            let offset = offsets[item as usize];
            let outline = outlines.of(targets[offset as usize]);
            let row = range.start + offset as usize;
            if outline.is_none_or(|outline| outline.is_upright(&arrays.world_from_object[row])) {
                return Child::item(offset);
            }
        }
        let mut instances = [0; LARGEST_LEAF];
        for (instance, &item) in instances.iter_mut().zip(leaf) {
            *instance = offsets[item as usize];
        }
        leaves.push((instances, leaf.len()));
        Child::leaf(leaves.len() as u32 - 1)
    });
    let block = |instances: &[u32]| {
        InstanceBlock::new(instances, &tree.space, |offset| {
            let row = range.start + offset as usize;
            (
                outlines.of(targets[offset as usize]),
                &arrays.world_from_object[row],
                &arrays.object_from_world[row],
            )
        })
    };
    let mut blocks = huge_pages::with_capacity(leaves.len());
    leaves
        .par_iter()
        .map(|(instances, len)| block(&instances[..*len]))
        .collect_into_vec(&mut blocks);
    let leaves_before = if targets.iter().all(|&target| target >= 0) {
        Vec::new()
    } else {
        targets
            .iter()
            .scan(0, |before, &target| {
                let inner = if target >= 0 {
                    1
                } else {
                    leaf_counts[!target as usize]
                };
                *before += inner;
                Some(*before - inner)
            })
            .collect()
    };
    Group {
        start: range.start,
        tree,
        blocks,
        anchor: Anchor::around(unbounded.is_empty().then_some(&bounds)),
        unbounded,
        leaves_before,
        dear: are_dear(targets, prototypes),
        bounds,
    }
}
