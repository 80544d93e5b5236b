//! Construction by the surface area heuristic, straight to eight children a node.
//!
//! A node begins with all its items as one part; the part of the largest area is cut in two
//! until there are eight. Each cut is the best of the planes between equal bins of the box
//! centres along each axis (Wald, "On fast construction of SAH-based bounding volume
//! hierarchies", 2007); cutting the largest part first is the greedy form of collapsing a binary
//! tree (Wald, Benthin, Boulos, "Getting rid of packets", 2008). Large parts are built in
//! parallel; the tree does not depend on the number of threads.
use super::item::{Cuboid, Item, Vector};
use super::{Bounds, Child, Node, NormalSpace, Tree, WIDTH};
use crate::huge_pages;

/// Most items of a leaf.
pub const LARGEST_LEAF: usize = 8;
/// Most items of a tree: leaves hold where their items begin in 28 bits.
pub const MAX_ITEMS: usize = 1 << LEAF_START_BITS;

const LEAF_START_BITS: u32 = 28;
const BINS: usize = 16;
/// Parts from here on are worth a task of their own.
const PARALLEL: usize = 4096;
/// Splits above a node after which parts are halved by number: bounds the depth at
/// SAH_DEPTH + log₂ of the items for any input.
const SAH_DEPTH: u32 = 48;

/// Builds over finite boxes `bounds`, at most `leaf_size` ≤ [`LARGEST_LEAF`] to a leaf.
///
/// `leaf` refers to each leaf, given the indices of its boxes; it is called in
/// the order of the leaves in the tree.
pub fn build(bounds: &[Bounds], leaf_size: usize, mut leaf: impl FnMut(&[u32]) -> Child) -> Tree {
    use rayon::prelude::*;
    assert!(bounds.len() <= MAX_ITEMS && (1..=LARGEST_LEAF).contains(&leaf_size));
    if bounds.is_empty() {
        return Tree::empty();
    }
    let all = bounds.iter().fold(Bounds::EMPTY, |all, b| all.union(b));
    let space = NormalSpace::around(&all);
    let mut items: Vec<Item> = bounds
        .par_iter()
        .with_min_len(PARALLEL)
        .enumerate()
        .map(|(index, b)| Item::new(&space.normalize(b), index as u32))
        .collect();
    let part = Part::over(&items, 0, 0);
    let mut nodes = subtree(&mut items, &part, leaf_size);
    let order: Vec<u32> = items.iter().map(Item::index).collect();
    drop(items);
    for node in &mut nodes {
        for (i, child) in node.children.iter_mut().enumerate() {
            if !child.is_node() && node.planes[0][i] <= node.planes[3][i] {
                let place = child.0 & !Child::LEAF;
                let start = (place & (MAX_ITEMS as u32 - 1)) as usize;
                let count = (place >> LEAF_START_BITS) as usize + 1;
                *child = leaf(&order[start..start + count]);
            }
        }
    }
    nodes.shrink_to_fit();
    Tree { space, nodes }
}

/// Consecutive items, with the boxes around them and around their centres.
#[derive(Clone)]
struct Part {
    start: usize,
    count: usize,
    bounds: Cuboid,
    centers: Cuboid,
    depth: u32,
}

impl Part {
    fn over(items: &[Item], start: usize, depth: u32) -> Part {
        let mut part = Part {
            start,
            count: items.len(),
            bounds: Cuboid::EMPTY,
            centers: Cuboid::EMPTY,
            depth,
        };
        for item in items {
            part.bounds.add(&item.0);
            part.centers.add_point(&item.center());
        }
        part
    }

    fn range(&self) -> std::ops::Range<usize> {
        self.start..self.start + self.count
    }
}

/// Nodes over the items of one part, root first; `items` is the whole slice that starts where
/// part.start counts from.
fn subtree(items: &mut [Item], part: &Part, leaf_size: usize) -> Vec<Node> {
    if part.count >= PARALLEL {
        return parallel_subtree(items, part, leaf_size);
    }
    let mut nodes = Vec::with_capacity(part.count / leaf_size.min(4) + 1);
    append(items, part.start, part, leaf_size, &mut nodes);
    nodes
}

/// Appends the nodes over a part; `items` begins at item number `first`.
fn append(items: &mut [Item], first: usize, part: &Part, leaf_size: usize, nodes: &mut Vec<Node>) {
    let index = nodes.len();
    nodes.push(Node::EMPTY);
    let parts = children(items, first, part, leaf_size);
    for (i, child) in parts.iter().enumerate() {
        let reference = if child.count <= leaf_size {
            leaf(child)
        } else {
            let reference = Child::node(nodes.len());
            append(items, first, child, leaf_size, nodes);
            reference
        };
        nodes[index].set(i, &child.bounds.bounds(), reference);
    }
}

/// As `append`, the children in parallel. `items` begins at the part's first item.
fn parallel_subtree(items: &mut [Item], part: &Part, leaf_size: usize) -> Vec<Node> {
    use rayon::prelude::*;
    let mut parts = children(items, part.start, part, leaf_size);
    parts.sort_by_key(|child| child.start);
    let mut slices = Vec::with_capacity(parts.len());
    let mut rest = items;
    for child in &parts {
        let (slice, after) = rest.split_at_mut(child.count);
        slices.push((child, slice));
        rest = after;
    }
    let subtrees: Vec<Vec<Node>> = slices
        .into_par_iter()
        .map(|(child, slice)| {
            if child.count <= leaf_size {
                Vec::new()
            } else {
                subtree(slice, child, leaf_size)
            }
        })
        .collect();
    let total: usize = subtrees.iter().map(Vec::len).sum();
    let mut nodes = huge_pages::with_capacity(1 + total);
    nodes.push(Node::EMPTY);
    for (i, (child, subtree)) in parts.iter().zip(subtrees).enumerate() {
        let offset = nodes.len();
        let reference = if subtree.is_empty() {
            leaf(child)
        } else {
            Child::node(offset)
        };
        nodes[0].set(i, &child.bounds.bounds(), reference);
        nodes.extend(subtree.into_iter().map(|mut node| {
            for child in node.children.iter_mut().filter(|child| child.is_node()) {
                *child = Child::node(child.number() as usize + offset);
            }
            node
        }));
    }
    nodes
}

/// A leaf that still says where its items are.
fn leaf(part: &Part) -> Child {
    Child(Child::LEAF | part.start as u32 | ((part.count as u32 - 1) << LEAF_START_BITS))
}

/// Cuts a part into two to eight (one, if it has only one item), reordering its items; `items`
/// begins at item number `first`.
fn children(items: &mut [Item], first: usize, part: &Part, leaf_size: usize) -> Vec<Part> {
    let mut parts = Vec::with_capacity(WIDTH);
    parts.push(part.clone());
    // Parts that fill no more than one node stay whole for now: cut up here they would leave
    // their own nodes nearly empty.
    let one_node = WIDTH * leaf_size;
    while parts.len() < WIDTH && cut_largest(items, first, &mut parts, |part| part.count > one_node)
    {
    }
    // Dissolve those for whose leaves there is room.
    let mut room = WIDTH + 1 - parts.len();
    let leaves = |part: &Part| part.count.div_ceil(leaf_size);
    loop {
        let mut pieces: Vec<Part>;
        let dissolvable = |part: &Part| part.count > leaf_size && leaves(part) <= room;
        let Some(i) = largest(&parts, dissolvable) else {
            break parts;
        };
        pieces = vec![parts.swap_remove(i)];
        while pieces.len() < room
            && cut_largest(items, first, &mut pieces, |piece| piece.count > leaf_size)
        {}
        room -= pieces.len() - 1;
        parts.append(&mut pieces);
    }
}

/// The part of the largest area of those that satisfy `eligible`.
fn largest(parts: &[Part], eligible: impl Fn(&Part) -> bool) -> Option<usize> {
    let area = |i: usize| parts[i].bounds.half_area();
    (0..parts.len())
        .filter(|&i| eligible(&parts[i]))
        .max_by(|&i, &j| area(i).total_cmp(&area(j)).then(j.cmp(&i)))
}

/// Cuts the largest eligible part in two; false if there is none.
fn cut_largest(
    items: &mut [Item],
    first: usize,
    parts: &mut Vec<Part>,
    eligible: impl Fn(&Part) -> bool,
) -> bool {
    let Some(i) = largest(parts, eligible) else {
        return false;
    };
    let part = parts.swap_remove(i);
    let range = part.range();
    parts.extend(split(
        &mut items[range.start - first..range.end - first],
        &part,
    ));
    true
}

/// Reorders the items of a part of two or more into two, the better way.
fn split(items: &mut [Item], part: &Part) -> [Part; 2] {
    if part.depth < SAH_DEPTH
        && let Some(plane) = Plane::best(items, part)
        && let Some(halves) = plane.split(items, part)
    {
        return halves;
    }
    let extent = |axis: usize| part.centers.upper[axis] - part.centers.lower[axis];
    let axis = (0..3).fold(0, |best, i| if extent(i) > extent(best) { i } else { best });
    let middle = items.len() / 2;
    items.select_nth_unstable_by(middle, |a, b| {
        (a.center()[axis].total_cmp(&b.center()[axis])).then(a.index().cmp(&b.index()))
    });
    let (left, right) = items.split_at(middle);
    [
        Part::over(left, part.start, part.depth + 1),
        Part::over(right, part.start + middle, part.depth + 1),
    ]
}

/// From centres to bins, by axis.
struct Binning {
    scale: Vector,
    offset: Vector,
}

impl Binning {
    /// Bins between the outermost centres; scale 0 along axes where these are nearly the same.
    fn new(part: &Part) -> Binning {
        let lower = part.centers.lower;
        let scale: Vector = std::array::from_fn(|axis| {
            let extent = part.centers.upper[axis] - lower[axis];
            if axis < 3 && extent > 1e-30 {
                BINS as f32 * 0.999_99 / extent
            } else {
                0.0
            }
        });
        Binning {
            scale,
            offset: lower,
        }
    }

    /// The bin of a centre along each axis.
    #[inline(always)]
    fn bins(&self, center: &Vector) -> [usize; 4] {
        // A number added to this one is rounded to an integer, in the last bits.
        const ROUND: f32 = (3 << 22) as f32;
        std::array::from_fn(|i| {
            let place = (center[i] - self.offset[i]) * self.scale[i];
            (place - 0.5 + ROUND).to_bits() as usize % BINS
        })
    }
}

/// Between two bins along an axis; the boxes on either side.
struct Plane {
    binning: Binning,
    axis: usize,
    /// The last bin of the left side.
    bin: usize,
    bounds: [Cuboid; 2],
}

impl Plane {
    /// The cheapest; None when all centres are (nearly) the same.
    fn best(items: &[Item], part: &Part) -> Option<Plane> {
        let binning = Binning::new(part);
        let mut boxes = [[Cuboid::EMPTY; BINS]; 3];
        let mut counts = [[0u32; BINS]; 3];
        for item in items {
            let bins = binning.bins(&item.center());
            for axis in 0..3 {
                boxes[axis][bins[axis]].add(&item.0);
                counts[axis][bins[axis]] += 1;
            }
        }
        let mut best = None;
        let mut cheapest = f32::INFINITY;
        for axis in (0..3).filter(|&axis| binning.scale[axis] > 0.0) {
            let mut rights = [(f32::INFINITY, Cuboid::EMPTY); BINS];
            let mut right = (Cuboid::EMPTY, 0);
            for bin in (1..BINS).rev() {
                right.0.add(&boxes[axis][bin]);
                right.1 += counts[axis][bin];
                if right.1 > 0 {
                    rights[bin] = (right.0.half_area() * right.1 as f32, right.0);
                }
            }
            let mut left = (Cuboid::EMPTY, 0);
            for bin in 0..BINS - 1 {
                left.0.add(&boxes[axis][bin]);
                left.1 += counts[axis][bin];
                let cost = left.0.half_area() * left.1 as f32 + rights[bin + 1].0;
                if left.1 > 0 && cost < cheapest {
                    cheapest = cost;
                    best = Some((axis, bin, [left.0, rights[bin + 1].1]));
                }
            }
        }
        best.map(|(axis, bin, bounds)| Plane {
            binning,
            axis,
            bin,
            bounds,
        })
    }

    /// Moves the items left of the plane to the front. None if all are on one side.
    fn split(&self, items: &mut [Item], part: &Part) -> Option<[Part; 2]> {
        let mut centers = [Cuboid::EMPTY; 2];
        let mut middle = 0;
        // Without a branch, which could not be predicted.
        for i in 0..items.len() {
            let center = items[i].center();
            let is_left = self.binning.bins(&center)[self.axis] <= self.bin;
            centers[usize::from(!is_left)].add_point(&center);
            items.swap(i, middle);
            middle += usize::from(is_left);
        }
        if middle == 0 || middle == items.len() {
            return None;
        }
        let half = |start: usize, count: usize, i: usize| Part {
            start,
            count,
            bounds: self.bounds[i],
            centers: centers[i],
            depth: part.depth + 1,
        };
        Some([
            half(part.start, middle, 0),
            half(part.start + middle, items.len() - middle, 1),
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::super::NormalBounds;
    use super::*;
    use proptest::prelude::*;

    /// Walks a tree; asserts that every box of a parent holds those of its children, and returns
    /// how often each item came up and the number of levels.
    fn walk(tree: &Tree, bounds: &[Bounds], leaves: &[Vec<u32>]) -> (Vec<u32>, usize) {
        let mut seen = vec![0; bounds.len()];
        let mut deepest = 0;
        let everything = NormalBounds {
            lower: [-2.0; 3],
            upper: [2.0; 3],
        };
        let mut stack = vec![(0, everything, 1)];
        while let Some((index, around, depth)) = stack.pop() {
            deepest = deepest.max(depth);
            let node: &Node = &tree.nodes[index];
            for (i, child) in node.children.iter().enumerate() {
                let own = NormalBounds {
                    lower: std::array::from_fn(|axis| node.planes[axis][i]),
                    upper: std::array::from_fn(|axis| node.planes[axis + 3][i]),
                };
                if own.lower[0] > own.upper[0] {
                    continue;
                }
                assert_eq!(around.union(&own), around);
                if child.is_node() {
                    stack.push((child.number() as usize, own, depth + 1));
                    continue;
                }
                for &item in &leaves[child.number() as usize] {
                    seen[item as usize] += 1;
                    let item = tree.space.normalize(&bounds[item as usize]);
                    assert_eq!(own.union(&item), own);
                }
            }
        }
        (seen, deepest)
    }

    fn check(bounds: &[Bounds], leaf_size: usize) -> (Tree, usize) {
        let mut leaves: Vec<Vec<u32>> = Vec::new();
        let tree = build(bounds, leaf_size, |leaf| {
            assert!((1..=leaf_size).contains(&leaf.len()));
            leaves.push(leaf.to_vec());
            Child::leaf(leaves.len() as u32 - 1)
        });
        let (seen, deepest) = walk(&tree, bounds, &leaves);
        assert!(seen.iter().all(|&times| times == 1));
        (tree, deepest)
    }

    fn cube(center: [f64; 3], half: f64) -> Bounds {
        Bounds {
            lower: center.map(|x| x - half),
            upper: center.map(|x| x + half),
        }
    }

    proptest! {
        #[test]
        fn every_item_is_in_one_leaf_inside_all_boxes_above(
            boxes in prop::collection::vec(([-9.0..9.0f64, -9.0..9.0, -9.0..9.0], 0.0..1.0f64), 1..300),
            leaf_size in 1..=LARGEST_LEAF,
        ) {
            let bounds: Vec<Bounds> = boxes.iter().map(|&(center, half)| cube(center, half)).collect();
            check(&bounds, leaf_size);
        }
    }

    #[test]
    fn nodes_are_well_filled_and_parallel_parts_join() {
        let n = 20_000;
        let bounds: Vec<Bounds> = (0..n)
            .map(|i| cube([7, 11, 13].map(|k| f64::from(i * k % 9973)), 5.0))
            .collect();
        let (tree, deepest) = check(&bounds, 1);
        assert!(
            tree.nodes.len() < n as usize / 4,
            "{} nodes",
            tree.nodes.len()
        );
        assert!(deepest <= 12, "{deepest} levels");
    }

    #[test]
    fn hostile_boxes_do_not_make_deep_trees() {
        let shrinking: Vec<Bounds> = (0..3000)
            .map(|i| cube([libm::exp2(-f64::from(i % 1000)), 0.0, 0.0], 0.0))
            .collect();
        assert!(check(&shrinking, 1).1 < 60);
        let same = vec![cube([1.0; 3], 1.0); 5000];
        assert!(check(&same, 1).1 <= 8);
    }
}
