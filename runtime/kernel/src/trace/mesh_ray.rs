//! A ray on its way through the triangles of a mesh, step by step.
//!
//! A ray knows where to go next only when it is done with a node, and which children it meets
//! there no processor can predict: alone it waits most of the time. So rays of a batch take turns.
//! A step, which is a node or a block of triangles, has no branch on what the boxes say; when
//! the turn comes again, what was asked for has arrived.
use super::Nearest;
use super::precision::{Halves, Precision, block_ray, intersect_block, restrict_block_ray};
use super::single::TreeRay;
use super::tree_rays::TreeRays;
use crate::bvh::{Child, Node, NodeRay, Row, WIDTH};
use crate::instance::{LevelRays, Parameter};
use crate::lanes::{Isa, Lanes, Mask, axes};
use crate::prefetch::prefetch_at;
use crate::scene::{Mesh, TriangleBlock};
use crate::shapes::TurnedRays;

/// Origins are slid to where they are nearest to the mesh, which has size 2: rays that are farther
/// from it there pass it by.
const FAR: f32 = (1u64 << 30) as f32;

/// One ray, in the space of a mesh.
pub(super) struct MeshRay<'s, F: Precision> {
    nodes: &'s [Node],
    blocks: &'s [TriangleBlock<F>],
    node_ray: NodeRay<f32>,
    /// Where the planes of nodes are through which it enters boxes, and leaves them.
    entry: [Row; 3],
    exit: [Row; 3],
    /// Where nodes are and where blocks are, and their sizes.
    places: [(*const u8, usize); 2],
    after: f32,
    before: f32,
    /// The last entry that may hold a nearer hit.
    reach: u64,
    triangle_ray: TurnedRays<F>,
    /// The axes in the order of `triangle_ray`.
    turned: [usize; 3],
    parameter: Parameter<f64>,
    /// The number of the mesh's instance.
    leaf: i64,
    /// Whether it is anywhere near the mesh, and no number of a node can make NaN.
    finite: bool,
    /// Whether a hit was taken.
    pub taken: bool,
    /// Nodes and blocks to be visited, the next one last; from place 1 on. An entry is a
    /// child and, as its upper half, how far behind `after` the ray enters that one's box: they are in
    /// the order of these distances, which are not negative.
    stack: Vec<u64>,
    top: usize,
    /// The node or the block that the ray is at.
    current: usize,
}

/// W rays brought into the space of a mesh.
pub(super) struct MeshPacket<'s, I: Isa, F: Precision> {
    pub mesh: &'s Mesh<F>,
    /// The number of the mesh's instance.
    pub leaf: i64,
    pub parameter: Halves<Parameter<I::F64>>,
    pub tree_rays: TreeRays<I>,
    /// Ready for triangles.
    pub prepared: F::PacketRays<I>,
}

/// What a ray does next.
#[derive(Clone, Copy)]
pub(super) enum Next {
    /// Visits a node or a block.
    Visit { is_block: bool },
    /// Leaves the mesh.
    Done,
}

impl<'s, F: Precision> MeshRay<'s, F> {
    pub fn new() -> Self {
        let ray = LevelRays::SOME;
        MeshRay {
            nodes: &[],
            blocks: &[],
            node_ray: NodeRay::new([0.0; 3], [1.0; 3]),
            entry: [Row::default(); 3],
            exit: [Row::default(); 3],
            places: [(std::ptr::null(), 0); 2],
            after: 0.0,
            before: 0.0,
            reach: 0,
            triangle_ray: block_ray::<F>(&ray, 0.0, 0.0).0,
            turned: [0, 1, 2],
            parameter: ray.parameter,
            leaf: -1,
            finite: false,
            taken: false,
            stack: vec![0; 128],
            top: 0,
            current: 0,
        }
    }

    /// Begins with a mesh, of an instance that is that leaf.
    #[inline(always)]
    pub fn enter(
        &mut self,
        mesh: &'s Mesh<F>,
        ray: &LevelRays<f64>,
        leaf: i64,
        [t_min, t_max]: [f64; 2],
    ) {
        let tree_ray = TreeRay::new(
            ray.origin,
            ray.direction,
            ray.parameter.start,
            ray.parameter.per_rate,
            [t_min, t_max],
        );
        let triangle_ray = block_ray::<F>(ray, t_min, t_max);
        self.begin(mesh, leaf, ray.parameter, &tree_ray, triangle_ray);
    }

    /// Begins with a mesh that the ray has entered as one of a packet.
    #[inline(always)]
    pub fn enter_from<I: Isa>(&mut self, packet: &MeshPacket<'s, I, F>, lane: usize) {
        self.begin(
            packet.mesh,
            packet.leaf,
            packet.parameter[lane / I::F64::WIDTH].get(lane % I::F64::WIDTH),
            &packet.tree_rays.get(lane),
            F::packet_get::<I>(&packet.prepared, lane),
        );
    }

    // All that is kept is written number by number: what was just written in small parts is slow to
    // copy.
    #[inline(always)]
    fn begin(
        &mut self,
        mesh: &'s Mesh<F>,
        leaf: i64,
        parameter: Parameter<f64>,
        tree_ray: &TreeRay,
        (triangle_ray, turned): (TurnedRays<F>, [usize; 3]),
    ) {
        self.nodes = &mesh.tree.nodes;
        self.blocks = &mesh.blocks;
        self.node_ray = tree_ray.node_ray;
        let down = self.node_ray.descending();
        self.entry = axes!(|i| Row::of(i, down[i]));
        self.exit = axes!(|i| Row::of(i, !down[i]));
        self.places = [
            (mesh.tree.nodes.as_ptr().cast(), size_of::<Node>()),
            (mesh.blocks.as_ptr().cast(), size_of::<TriangleBlock<F>>()),
        ];
        self.after = tree_ray.after;
        self.before = tree_ray.before;
        (self.triangle_ray, self.turned) = (triangle_ray, turned);
        self.parameter = parameter;
        self.leaf = leaf;
        self.taken = false;
        self.current = 0;
        self.top = 0;
        self.look_to();
        self.finite = tree_ray.origin.iter().all(|x| x.abs() < FAR)
            && tree_ray.direction.iter().all(|x| x.is_finite());
    }

    /// Visits the root of the mesh.
    #[inline(always)]
    pub fn visit_root<I: Isa>(&mut self) -> Next {
        if !self.finite || self.nodes.is_empty() || self.before < self.after {
            return Next::Done;
        }
        self.visit_node::<I>()
    }

    /// Lets no entry behind `before` in.
    #[inline(always)]
    fn look_to(&mut self) {
        let distance = self.before - self.after;
        self.reach = u64::from(distance.to_bits()) << 32 | u64::from(u32::MAX);
        if distance < 0.0 {
            self.top = 0;
        }
    }

    /// At a node: pushes the children whose boxes the ray meets, the nearest last, and goes on.
    #[inline(always)]
    pub fn visit_node<I: Isa>(&mut self) -> Next {
        let Some(room) = self
            .stack
            .get_mut(self.top..)
            .and_then(<[_]>::first_chunk_mut)
        else {
            self.grow();
            return Next::Visit { is_block: false };
        };
        let [last, room @ ..]: &mut [u64; 1 + WIDTH] = room;
        let node = &self.nodes[self.current];
        let mut met = 0;
        let mut distances = [0.0; WIDTH];
        let node_ray: NodeRay<I::F32UpTo8> = self.node_ray.in_lanes();
        let after = I::F32UpTo8::splat(self.after);
        let before = I::F32UpTo8::splat(self.before);
        for first in (0..WIDTH).step_by(I::F32UpTo8::WIDTH) {
            let entry = axes!(|i| node.planes_from::<I::F32UpTo8>(self.entry[i], first));
            let exit = axes!(|i| node.planes_from::<I::F32UpTo8>(self.exit[i], first));
            let (near, far) = node_ray.interval(entry, exit, after, before);
            (near - after).store(&mut distances[first..]);
            met |= near.le(far).bits() << first;
        }
        let numbers = Child::all_bits(&node.children);
        let (least, others) = I::without_least(met, &distances, numbers, room);
        let next = if met == 0 { *last } else { least };
        if met == 0 && self.top == 0 {
            return Next::Done;
        }
        self.top = self.top + others - usize::from(met == 0);
        self.go_to(next)
    }

    /// At a block: takes its nearest hit, and goes on; with ANY, not after a hit.
    #[inline(always)]
    pub fn visit_block<I: Isa, const ANY: bool>(
        &mut self,
        nearest: &mut Nearest,
        t_min: f64,
    ) -> Next {
        let block = &self.blocks[self.current];
        let lanes: TurnedRays<F::Block<I>> = self.triangle_ray.in_lanes();
        let mut taken = false;
        intersect_block(&lanes, self.turned, &self.parameter, block, |lane, t| {
            taken |= nearest.offer(t, self.leaf, block.triangles[lane]);
        });
        if taken {
            self.taken = true;
            if ANY {
                return Next::Done;
            }
            self.before = self.parameter.of_world(nearest.t) as f32;
            self.look_to();
            restrict_block_ray(&mut self.triangle_ray, &self.parameter, t_min, nearest.t);
        }
        if self.top == 0 {
            return Next::Done;
        }
        self.top -= 1;
        self.go_to(self.stack[self.top + 1])
    }

    /// Goes on to an entry that was taken from the stack, or to one below it, and asks for it.
    #[inline(always)]
    fn go_to(&mut self, mut next: u64) -> Next {
        while next > self.reach {
            if self.top == 0 {
                return Next::Done;
            }
            next = self.stack[self.top];
            self.top -= 1;
        }
        let child = Child::from_bits(next as u32);
        self.current = child.number() as usize;
        let is_block = !child.is_node();
        let (start, size) = self.places[usize::from(is_block)];
        prefetch_at(start, self.current * size);
        Next::Visit { is_block }
    }

    #[cold]
    #[inline(never)]
    fn grow(&mut self) {
        self.stack.resize(2 * self.stack.len(), 0);
    }
}
