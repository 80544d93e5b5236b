//! A packet in the space of one tree: as one against the boxes of nodes, each ray for itself
//! against those of leaves.
use super::entries::{Entries, Entry, insert};
use super::frustum::{Frustum, greatest, least};
use super::precision::{Halves, PacketMask};
use super::tree_rays::TreeRays;
use crate::bvh::{Child, Node, WIDTH};
use crate::lanes::{Isa, Lanes, Mask, axes, take_bit};
use crate::scene::InstanceBlock;

/// As many rays must meet a child of a node, on average, for rays that are not coherent to stay
/// together.
pub const SHARED: u32 = 4;

/// Leaves with more surface, halved, in the tree's space, whose cube has 12, are large: a ground,
/// a wall. If any hit will do, they are the first to be visited.
const LARGE: f32 = 1.0;

/// Half the surfaces of the boxes of children from number `first` on.
#[inline(always)]
fn extent<L: Lanes<Scalar = f32>>(node: &Node, first: usize) -> L {
    let [x, y, z] =
        axes!(|i| L::load(&node.planes[i + 3][first..]) - L::load(&node.planes[i][first..]));
    x.mul_add(y, y.mul_add(z, z * x))
}

/// The large children of a node, as bits; unused ones count.
#[inline(always)]
pub fn large_children<I: Isa>(node: &Node) -> u32 {
    type N<I> = <I as Isa>::F32UpTo8;
    let mut large = 0;
    for first in (0..WIDTH).step_by(N::<I>::WIDTH) {
        let extent = extent::<N<I>>(node, first);
        large |= N::<I>::splat(LARGE).lt(extent).bits() << first;
    }
    large
}

/// The rays, and what bounds them.
#[derive(Clone)]
pub struct Bundle<I: Isa> {
    pub rays: TreeRays<I>,
    frustum: Frustum,
}

impl<I: Isa> Bundle<I> {
    /// Of the rays in `active`.
    #[inline(always)]
    pub fn new(rays: TreeRays<I>, active: PacketMask<I>) -> Bundle<I> {
        let interval = [rays.after, rays.before];
        let frustum = Frustum::new::<I>(rays.origin, rays.node_ray.inverse(), interval, active);
        Bundle { rays, frustum }
    }

    /// Draws in the far end of the rays to their nearest hits; `active` still count.
    #[inline(always)]
    pub fn restrict(&mut self, t_max: &Halves<I::F64>, active: PacketMask<I>) {
        self.rays.restrict(t_max);
        self.frustum.latest = greatest(self.rays.before, active);
    }

    /// Pushes the children of a node that the packet as a whole meets, the nearest on top; with ANY,
    /// large leaves before them.
    #[inline(always)]
    pub fn visit_node<const ANY: bool>(&self, nodes: &[Node], index: u32, stack: &mut Entries) {
        type N<I> = <I as Isa>::F32UpTo8;
        let node = &nodes[index as usize];
        let room = stack.room();
        let mut count = 0;
        for first in (0..WIDTH).step_by(N::<I>::WIDTH) {
            let (mut met, near) = self.frustum.meets::<N<I>>(node, first);
            if met == 0 {
                continue;
            }
            let mut nears = [0.0; WIDTH];
            near.store(&mut nears);
            let large = if ANY {
                N::<I>::splat(LARGE).lt(extent::<N<I>>(node, first)).bits()
            } else {
                0
            };
            while let Some(lane) = take_bit(&mut met) {
                let i = (first + lane) % WIDTH;
                let child = node.children[i];
                let goes_first = ANY && !child.is_node() && large >> lane & 1 != 0;
                let entry = Entry {
                    near: if goes_first {
                        f32::NEG_INFINITY
                    } else {
                        nears[lane % WIDTH]
                    },
                    child,
                    place: index * WIDTH as u32 + i as u32,
                    rays: u32::MAX,
                };
                insert(room, count, entry);
                count += 1;
            }
        }
        stack.extend(count);
    }

    /// Pushes the children of a node that rays in `active` meet, which are not coherent, the nearest
    /// on top; none, and false, if they should part there.
    #[inline(always)]
    pub fn share_node(
        &self,
        nodes: &[Node],
        index: u32,
        active: PacketMask<I>,
        stack: &mut Entries,
    ) -> bool {
        let room = stack.room();
        let (mut count, mut rays) = (0, 0);
        for (i, &child) in nodes[index as usize].children.iter().enumerate() {
            if child.is_unused() {
                break;
            }
            let (near, far) = self.interval(&nodes[index as usize], i);
            let met = near.le(far) & active;
            if met.any() {
                rays += met.bits().count_ones();
                let entry = Entry {
                    near: least(near, met),
                    child,
                    place: index * WIDTH as u32 + i as u32,
                    rays: met.bits(),
                };
                insert(room, count, entry);
                count += 1;
            }
        }
        let shared = rays >= SHARED * count as u32;
        if shared {
            stack.extend(count);
        }
        shared
    }

    /// Pushes the instances of a block that any of the rays in `active` may hit, the nearest on top.
    #[inline(always)]
    pub fn visit_block(&self, block: &InstanceBlock, active: PacketMask<I>, stack: &mut Entries) {
        let rays = &self.rays;
        let room = stack.room();
        let mut count = 0;
        for i in 0..block.len as usize {
            let interval = block.interval_of(i, rays.origin, rays.direction, active);
            let Some((near, far)) = interval else {
                continue;
            };
            let met = near.le(far) & near.le(rays.before) & rays.after.le(far) & active;
            if met.any() {
                let entry = Entry {
                    near: least(near, met),
                    child: block.instances[i],
                    place: Entry::UNTESTED,
                    rays: met.bits(),
                };
                insert(room, count, entry);
                count += 1;
            }
        }
        stack.extend(count);
    }

    /// The next leaf or item that any of the rays in `active` may meet, and which; down to `base`
    /// of the stack. Or a node whose rays should part.
    #[inline(always)]
    pub fn next_leaf<const ANY: bool, const COHERENT: bool>(
        &self,
        nodes: &[Node],
        stack: &mut Entries,
        base: usize,
        active: PacketMask<I>,
    ) -> Option<(Child, PacketMask<I>)> {
        while let Some(entry) = stack.pop(base) {
            if entry.near > self.frustum.latest {
                continue;
            }
            let met = if entry.place == Entry::UNTESTED {
                active & Mask::from_bits(entry.rays)
            } else {
                let place = entry.place as usize;
                active & self.meets(&nodes[place / WIDTH], place % WIDTH)
            };
            if !met.any() {
                continue;
            }
            if !entry.child.is_node() {
                return Some((entry.child, met));
            }
            let number = entry.child.number();
            if COHERENT {
                self.visit_node::<ANY>(nodes, number, stack);
            } else if !self.share_node(nodes, number, met, stack) {
                return Some((entry.child, met));
            }
        }
        None
    }

    /// Which rays meet child `i` of a node.
    #[inline(always)]
    fn meets(&self, node: &Node, i: usize) -> PacketMask<I> {
        let (near, far) = self.interval(node, i);
        near.le(far)
    }

    /// Where rays enter and leave child `i` of a node; they do not unless near ≤ far.
    #[inline(always)]
    fn interval(&self, node: &Node, i: usize) -> (I::F32, I::F32) {
        let (entry, exit) = if self.frustum.agree {
            let axes = &self.frustum.axes;
            (
                axes!(|axis| I::F32::splat(node.plane(axes[axis].rows[0], i))),
                axes!(|axis| I::F32::splat(node.plane(axes[axis].rows[1], i))),
            )
        } else {
            let planes = &node.planes;
            let [lower, upper]: [[I::F32; 3]; 2] = [
                axes!(|axis| I::F32::splat(planes[axis][i])),
                axes!(|axis| I::F32::splat(planes[axis + 3][i])),
            ];
            let down = self.rays.node_ray.descending();
            (
                axes!(|j| I::F32::select(down[j], upper[j], lower[j])),
                axes!(|j| I::F32::select(down[j], lower[j], upper[j])),
            )
        };
        let rays = &self.rays;
        rays.node_ray.interval(entry, exit, rays.after, rays.before)
    }
}
