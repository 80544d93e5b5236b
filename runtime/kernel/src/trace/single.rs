//! One ray at a time, against eight boxes at a time.
use super::Nearest;
use super::level::Target;
use super::mesh_ray::{MeshRay, Next};
use super::precision::{Precision, block_ray, intersect_block, intersect_shape};
use super::roots::Roots;
use super::stack::Stack;
use crate::bvh::{Child, LARGEST_LEAF, Node, NodeRay, WIDTH};
use crate::instance::LevelRays;
use crate::lanes::{Isa, Lanes, Mask, axes, each};
use crate::scene::{Geometry, Group, InstanceBlock, Scene, TriangleBlock};

/// The ray in the space of a tree.
#[derive(Clone, Copy)]
pub(super) struct TreeRay {
    pub origin: [f32; 3],
    pub direction: [f32; 3],
    pub node_ray: NodeRay<f32>,
    /// The tree's parameter of world t is (t − start)·per_rate.
    pub start: f64,
    pub per_rate: f64,
    pub after: f32,
    pub before: f32,
}

impl TreeRay {
    /// With hits in the world's interval.
    #[inline(always)]
    pub fn new(
        origin: [f64; 3],
        direction: [f64; 3],
        start: f64,
        per_rate: f64,
        [t_min, t_max]: [f64; 2],
    ) -> TreeRay {
        let (origin, direction) = (each!(origin, |x| x as f32), each!(direction, |x| x as f32));
        let mut ray = TreeRay {
            origin,
            direction,
            node_ray: NodeRay::new(origin, direction),
            start,
            per_rate,
            after: 0.0,
            before: 0.0,
        };
        ray.after = ray.tree_parameter(t_min);
        ray.before = ray.tree_parameter(t_max);
        ray
    }

    #[inline(always)]
    fn tree_parameter(&self, t: f64) -> f32 {
        ((t - self.start) * self.per_rate) as f32
    }

    /// Draws in the far end to a nearest hit.
    #[inline(always)]
    fn restrict(&mut self, t_max: f64) {
        self.before = self.tree_parameter(t_max);
    }
}

/// A ray against the boxes of nodes, a copy in every lane.
struct BoxLanes<L: Lanes> {
    node_ray: NodeRay<L>,
    /// Whether it enters boxes through their upper planes, by axis.
    descending: [bool; 3],
    after: L,
    before: L,
}

impl<L: Lanes<Scalar = f32>> BoxLanes<L> {
    #[inline(always)]
    fn new(ray: &TreeRay) -> BoxLanes<L> {
        BoxLanes {
            node_ray: ray.node_ray.in_lanes(),
            descending: ray.node_ray.descending(),
            after: L::splat(ray.after),
            before: L::splat(ray.before),
        }
    }

    /// The nearest of the children that the ray meets; pushes the others.
    #[inline(always)]
    fn visit<const ANY: bool>(
        &self,
        node: &Node,
        stack: &mut Stack,
        seen: impl Fn(Child),
    ) -> Option<Child> {
        let mut met = 0;
        let mut nears = [0.0; WIDTH];
        for first in (0..WIDTH).step_by(L::WIDTH) {
            let entry = axes!(|i| {
                L::load(&node.planes[i + 3 * usize::from(self.descending[i])][first..])
            });
            let exit = axes!(|i| {
                L::load(&node.planes[i + 3 * usize::from(!self.descending[i])][first..])
            });
            let (near, far) = self.node_ray.interval(entry, exit, self.after, self.before);
            near.store(&mut nears[first..]);
            met |= near.le(far).bits() << first;
        }
        stack.nearest::<ANY>(met, |lane| nears[lane], &node.children, seen)
    }
}

/// The ray in the space of a group on its way down.
pub(super) struct Level<'s> {
    pub ray: LevelRays<f64>,
    pub tree_ray: TreeRay,
    pub group: &'s Group,
    /// The number of the group's first leaf.
    pub first_leaf: i64,
    /// Entries below belong to the levels above.
    pub stack_base: usize,
}

impl<'s> Level<'s> {
    /// Of a ray that looks for nothing.
    fn new(group: &'s Group) -> Level<'s> {
        Level {
            ray: LevelRays::SOME,
            tree_ray: TreeRay::new([0.0; 3], [1.0; 3], 0.0, 1.0, [0.0; 2]),
            group,
            first_leaf: 0,
            stack_base: 0,
        }
    }
}

/// What comes of an instance.
enum Visited {
    /// It is done with.
    Done,
    /// A group: the ray is at a level inside.
    Group,
    /// A mesh, and what the ray does there next.
    Mesh(Next),
}

/// A ray on its way; stacks are kept from ray to ray.
pub(super) struct Single<'s, I: Isa, F: Precision> {
    scene: &'s Scene<F>,
    /// From the root down; those from `depth` on are room. What was just written in small parts is
    /// slow to copy: levels are written where they stay.
    levels: Vec<Level<'s>>,
    depth: usize,
    stack: Stack,
    /// The way through the mesh that the ray is in.
    pub mesh_ray: MeshRay<'s, F>,
    pub t_min: f64,
    /// The leaf that it leaves for good, or −1.
    left: i64,
    pub nearest: Nearest,
    set: std::marker::PhantomData<I>,
}

impl<'s, I: Isa, F: Precision> Single<'s, I, F> {
    pub fn new(scene: &'s Scene<F>) -> Self {
        Single {
            scene,
            levels: vec![Level::new(&scene.groups[0])],
            depth: 0,
            stack: Stack::new(),
            mesh_ray: MeshRay::new(),
            t_min: 0.0,
            left: -1,
            nearest: Nearest::none(0.0),
            set: std::marker::PhantomData,
        }
    }

    /// Begins with one of the rays that were taken to the root, which has a hit already, if any.
    #[inline(always)]
    pub fn begin<const ANY: bool>(&mut self, roots: &Roots, ray: usize, nearest: Nearest) {
        let root = &self.scene.groups[0];
        self.t_min = roots.interval(ray)[0];
        self.left = roots.left(ray);
        self.nearest = nearest;
        self.stack.clear();
        roots.push_met::<ANY>(ray, root, &mut self.stack);
        let level = &mut self.levels[0];
        (level.ray, level.tree_ray) = roots.ray(ray);
        if nearest.leaf >= 0 {
            level.tree_ray.restrict(nearest.t);
        }
        (level.group, level.first_leaf) = (root, 0);
        self.depth = 1;
    }

    /// Begins with a ray that has come to a level some other way: for what it meets below `child` of
    /// the group's tree, and nearer than the hit that it has, if any.
    #[inline(always)]
    pub fn begin_at(
        &mut self,
        level: Level<'s>,
        child: Child,
        t_min: f64,
        left: i64,
        nearest: Nearest,
    ) {
        self.t_min = t_min;
        self.left = left;
        self.nearest = nearest;
        self.stack.clear();
        self.stack.push(child);
        self.levels[0] = level;
        self.depth = 1;
    }

    /// Begins with a ray that is in a mesh, and nowhere else.
    #[inline(always)]
    pub fn begin_in_mesh(&mut self, t_min: f64, nearest: Nearest) {
        self.t_min = t_min;
        self.nearest = nearest;
        self.stack.clear();
        self.depth = 0;
    }

    /// Ends a visit of a mesh.
    #[inline(always)]
    pub fn leave_mesh<const ANY: bool>(&mut self) {
        if self.mesh_ray.taken {
            if ANY {
                self.depth = 0;
            } else if let Some(level) = self.levels[..self.depth].last_mut() {
                level.tree_ray.restrict(self.nearest.t);
            }
        }
    }

    /// Goes on into the next mesh, or is done. With ANY, ends with whichever hit is found first.
    #[inline(always)]
    pub fn advance<const ANY: bool>(&mut self) -> Next {
        let mut levels = std::mem::take(&mut self.levels);
        let mut next = Next::Done;
        while self.depth > 0 {
            if levels.len() == self.depth {
                levels.push(Level::new(&self.scene.groups[0]));
            }
            let (outer, inner) = levels.split_at_mut(self.depth);
            let (Some(level), Some(inner)) = (outer.last_mut(), inner.first_mut()) else {
                break;
            };
            let Some(offset) = self.next_item::<ANY>(level) else {
                self.depth -= 1;
                if let Some(outer) = levels[..self.depth].last_mut() {
                    outer.tree_ray.restrict(self.nearest.t);
                }
                continue;
            };
            match self.visit::<ANY>(level, inner, offset) {
                Visited::Group => self.depth += 1,
                Visited::Mesh(visit) => {
                    next = visit;
                    break;
                }
                Visited::Done if ANY && self.nearest.leaf >= 0 => break,
                Visited::Done => {}
            }
        }
        self.levels = levels;
        next
    }

    /// Begins a level: its root and its unbounded instances are on the stack.
    #[inline(always)]
    fn enter(
        &mut self,
        level: &mut Level<'s>,
        ray: LevelRays<f64>,
        group: &'s Group,
        first_leaf: i64,
    ) {
        let space = group.tree.space;
        let (origin, slide) = ray.in_space(&space);
        level.ray = ray;
        level.tree_ray = TreeRay::new(
            origin,
            ray.direction,
            ray.parameter.world(slide / space.scale),
            ray.parameter.per_rate * space.scale,
            [self.t_min, self.nearest.t],
        );
        level.group = group;
        level.first_leaf = first_leaf;
        level.stack_base = self.stack.len();
        if !group.tree.nodes.is_empty() {
            self.stack.push(Child::ROOT);
        }
        for &offset in &group.unbounded {
            self.stack.push(Child::item(offset));
        }
    }

    /// The next instance of the level's group that the ray may hit.
    #[inline(always)]
    fn next_item<const ANY: bool>(&mut self, level: &Level<'s>) -> Option<usize> {
        let lanes = BoxLanes::<I::F32UpTo8>::new(&level.tree_ray);
        let group = level.group;
        while let Some((near, mut child)) = self.stack.pop(level.stack_base) {
            if near > level.tree_ray.before {
                continue;
            }
            loop {
                let number = child.number() as usize;
                let next = if child.is_node() {
                    let node = &group.tree.nodes[number];
                    lanes.visit::<ANY>(node, &mut self.stack, |child| group.prefetch(child))
                } else if child.is_item() {
                    return Some(number);
                } else {
                    self.visit_block::<ANY>(level, &group.blocks[number])
                };
                match next {
                    Some(next) => child = next,
                    None => break,
                }
            }
        }
        None
    }

    /// The nearest of the instances of a block that the ray may hit; pushes the others.
    #[inline(always)]
    fn visit_block<const ANY: bool>(
        &mut self,
        level: &Level<'s>,
        block: &InstanceBlock,
    ) -> Option<Child> {
        let ray = &level.tree_ray;
        let mut all_met = 0;
        let mut nears = [0.0; LARGEST_LEAF];
        for first in (0..LARGEST_LEAF).step_by(I::F32UpTo8::WIDTH) {
            let (met, near) = block.meets::<I::F32UpTo8>(
                first,
                (ray.origin, ray.direction),
                ray.after,
                ray.before,
            );
            near.store(&mut nears[first..]);
            all_met |= met.bits() << first;
        }
        let near = |lane: usize| nears[lane];
        let scene = self.scene;
        self.stack
            .nearest::<ANY>(all_met, near, &block.instances, |item| {
                scene.prefetch(level.group.start + item.number() as usize);
            })
    }

    /// Tests an instance, or goes into it.
    #[inline(always)]
    fn visit<const ANY: bool>(
        &mut self,
        level: &mut Level<'s>,
        inner: &mut Level<'s>,
        offset: usize,
    ) -> Visited {
        let row = level.group.start + offset;
        let target = self.scene.target(row);
        let leaf = level.first_leaf + level.group.leaves_before(offset);
        if ANY && leaf == self.left && matches!(target, Target::Prototype(_)) {
            return Visited::Done;
        }
        let entrance = self.scene.entrance(row, &target);
        let prototype = match target {
            Target::Group(group) => {
                let ray = entrance.enter_group(&level.ray);
                self.enter(inner, ray, group, leaf);
                return Visited::Group;
            }
            Target::Prototype(prototype) => prototype,
        };
        let ray = entrance.enter_prototype(&level.ray, &prototype.space);
        let interval = [self.t_min, self.nearest.t];
        let taken = match &prototype.geometry {
            Geometry::Mesh(mesh) => {
                if let [block] = &mesh.blocks[..] {
                    self.visit_block_of_mesh(&ray, block, leaf)
                } else {
                    self.mesh_ray.enter(mesh, &ray, leaf, interval);
                    match self.mesh_ray.visit_root::<I>() {
                        Next::Done => false,
                        next => return Visited::Mesh(next),
                    }
                }
            }
            Geometry::Shape(shape) => {
                let t = intersect_shape::<I, F>(shape, &ray, self.t_min, self.nearest.t);
                t.is_some_and(|t| self.nearest.offer(t, leaf, 0))
            }
        };
        if !ANY && taken {
            level.tree_ray.restrict(self.nearest.t);
        }
        Visited::Done
    }

    /// Tests the only block of a mesh; whether a hit was taken.
    #[inline(always)]
    fn visit_block_of_mesh(
        &mut self,
        ray: &LevelRays<f64>,
        block: &TriangleBlock<F>,
        leaf: i64,
    ) -> bool {
        let (prepared, turned) = block_ray::<F::Block<I>>(ray, self.t_min, self.nearest.t);
        let mut taken = false;
        intersect_block(&prepared, turned, &ray.parameter, block, |lane, t| {
            taken |= self.nearest.offer(t, leaf, block.triangles[lane]);
        });
        taken
    }
}
