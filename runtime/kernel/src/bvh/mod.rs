//! Bounding volume hierarchies: eight boxes a node, in single precision.
//!
//! A tree lives in the [`NormalSpace`] of its content, so that it is precise whatever the scale
//! and the place of the scene, and the same for both precisions of the intersectors. What a leaf
//! means is its owner's business: an instance of a group, or a block of triangles of a mesh.
mod bounds;
mod build;
mod item;
mod ray;

pub use bounds::{Bounds, NormalBounds, NormalSpace, exponent, power_of_two};
pub use build::{LARGEST_LEAF, MAX_ITEMS, build};
pub use ray::NodeRay;

use crate::lanes::Lanes;

/// Children of a node.
pub const WIDTH: usize = 8;

/// Bounds and references of up to eight children; unused ones are empty boxes and come last.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct Node {
    /// By plane: x, y, z of the lower corners, then x, y, z of the upper ones.
    pub planes: [[f32; WIDTH]; 6],
    /// Where the children are.
    pub children: [Child; WIDTH],
}

impl Node {
    /// A node without children.
    pub const EMPTY: Node = Node {
        planes: [
            [f32::INFINITY; WIDTH],
            [f32::INFINITY; WIDTH],
            [f32::INFINITY; WIDTH],
            [f32::NEG_INFINITY; WIDTH],
            [f32::NEG_INFINITY; WIDTH],
            [f32::NEG_INFINITY; WIDTH],
        ],
        children: [Child::ROOT; WIDTH],
    };

    /// Of a row of planes those of the children from number `first` on.
    #[inline(always)]
    pub fn planes_from<L: Lanes<Scalar = f32>>(&self, row: Row, first: usize) -> L {
        // SAFETY: there are six rows of planes, and `Row::of` makes no others.
        let row = unsafe {
            self.planes
                .as_flattened()
                .get_unchecked(row.0..row.0 + WIDTH)
        };
        L::load(&row[first..])
    }

    /// The plane of one row and child.
    #[inline(always)]
    pub fn plane(&self, row: Row, child: usize) -> f32 {
        // SAFETY: as above; the child is one of the row's.
        unsafe {
            *self
                .planes
                .as_flattened()
                .get_unchecked(row.0 + child % WIDTH)
        }
    }

    /// Sets child `i`.
    fn set(&mut self, i: usize, bounds: &NormalBounds, child: Child) {
        for axis in 0..3 {
            self.planes[axis][i] = bounds.lower[axis];
            self.planes[axis + 3][i] = bounds.upper[axis];
        }
        self.children[i] = child;
    }
}

/// Where the planes of one axis and side are in a node.
#[derive(Clone, Copy, Debug, Default)]
pub struct Row(usize);

impl Row {
    /// The lower or the upper ones of an axis.
    #[inline(always)]
    pub fn of(axis: usize, upper: bool) -> Row {
        Row(WIDTH * (axis % 3 + 3 * usize::from(upper)))
    }
}

/// A reference to a node, or to a leaf that carries its owner's number, or to one item of a leaf.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(transparent)]
pub struct Child(u32);

impl Child {
    /// The root of every tree.
    pub const ROOT: Child = Child(0);
    const LEAF: u32 = 1 << 31;
    const ITEM: u32 = 1 << 30;

    fn node(index: usize) -> Child {
        Child(index as u32)
    }

    /// A leaf of that number, below 2³⁰.
    #[inline(always)]
    pub fn leaf(number: u32) -> Child {
        debug_assert!(number < Child::ITEM);
        Child(number | Child::LEAF)
    }

    /// An item of that number, below 2³⁰: trees have none, but traversal comes to them.
    #[inline(always)]
    pub fn item(number: u32) -> Child {
        debug_assert!(number < Child::ITEM);
        Child(number | Child::LEAF | Child::ITEM)
    }

    /// As a number.
    #[inline(always)]
    pub fn bits(self) -> u32 {
        self.0
    }

    /// As numbers.
    #[inline(always)]
    pub fn all_bits(children: &[Child; WIDTH]) -> &[u32; WIDTH] {
        // SAFETY: a child is represented as a number.
        unsafe { &*std::ptr::from_ref(children).cast() }
    }

    /// From what [`Child::bits`] gave.
    #[inline(always)]
    pub fn from_bits(bits: u32) -> Child {
        Child(bits)
    }

    /// Whether it refers to nothing: nobody has the root as a child.
    #[inline(always)]
    pub fn is_unused(self) -> bool {
        self == Child::ROOT
    }

    /// Whether it is a node.
    #[inline(always)]
    pub fn is_node(self) -> bool {
        self.0 & Child::LEAF == 0
    }

    /// Whether it is an item.
    #[inline(always)]
    pub fn is_item(self) -> bool {
        self.0 & Child::ITEM != 0
    }

    /// The number of a leaf or an item, or the index of a node.
    #[inline(always)]
    pub fn number(self) -> u32 {
        self.0 & !(Child::LEAF | Child::ITEM)
    }
}

/// A hierarchy over the boxes it was built from. The root is node 0; an empty tree has no nodes.
#[derive(Clone, Debug)]
pub struct Tree {
    /// Maps the owner's space to that of the nodes.
    pub space: NormalSpace,
    /// All nodes; children come after their parents.
    pub nodes: Vec<Node>,
}

impl Tree {
    /// A tree over nothing.
    pub fn empty() -> Tree {
        Tree {
            space: NormalSpace::around(&Bounds::EMPTY),
            nodes: Vec::new(),
        }
    }

    /// Bytes held.
    pub fn nbytes(&self) -> usize {
        self.nodes.capacity() * size_of::<Node>()
    }
}
