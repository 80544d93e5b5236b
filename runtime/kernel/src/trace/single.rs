//! One ray at a time, against eight boxes at a time.
use super::Nearest;
use super::bundle::SHARED;
use super::columns::RayColumns;
use super::level::Target;
use super::precision::{
    Precision, block_ray, intersect_block, intersect_shape, restrict_block_ray,
};
use super::roots::Roots;
use super::stack::Stack;
use crate::bvh::{Child, LARGEST_LEAF, Node, NodeRay, WIDTH};
use crate::instance::LevelRays;
use crate::lanes::{Isa, Lanes, Mask, axes, each};
use crate::scene::{Geometry, Group, InstanceBlock, Mesh, Scene};

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
    fn new(
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

/// Stacks, kept from ray to ray.
pub(super) struct Single<'s, I: Isa, F: Precision> {
    scene: &'s Scene<F>,
    roots: Roots,
    /// From the root down.
    levels: Vec<Level<'s>>,
    stack: Stack,
    t_min: f64,
    nearest: Nearest,
    set: std::marker::PhantomData<I>,
}

impl<'s, I: Isa, F: Precision> Single<'s, I, F> {
    pub fn new(scene: &'s Scene<F>) -> Self {
        Single {
            scene,
            roots: Roots::default(),
            levels: Vec::new(),
            stack: Stack::new(),
            t_min: 0.0,
            nearest: Nearest::none(0.0),
            set: std::marker::PhantomData,
        }
    }

    /// Takes rays, which are then traced one at a time.
    #[inline(always)]
    pub fn take(&mut self, rays: &RayColumns<I>) {
        self.roots.take(rays, &self.scene.groups[0]);
    }

    /// Of the rays that were taken, as bits, those that meet child `i` of the root.
    #[inline(always)]
    pub fn met(&self, i: usize) -> u32 {
        self.roots.met[i]
    }

    /// The greatest parameter of a ray that was taken.
    #[inline(always)]
    pub fn t_max(&self, ray: usize) -> f64 {
        self.roots.interval(ray)[1]
    }

    /// Passes over these children of the root, given as bits.
    #[inline(always)]
    pub fn pass(&mut self, children: u32) {
        for (i, met) in self.roots.met.iter_mut().enumerate() {
            if children >> i & 1 != 0 {
                *met = 0;
            }
        }
    }

    /// Whether the rays that were taken meet few children of the root for their number.
    #[inline(always)]
    pub fn rays_share(&self) -> bool {
        let (mut rays, mut children) = (0, 0);
        for met in self.roots.met {
            rays += met.count_ones();
            children += u32::from(met != 0);
        }
        children > 0 && rays >= SHARED * children
    }

    /// Of the rays that were taken, as bits, those that still meet something.
    #[inline(always)]
    pub fn waiting(&self) -> u32 {
        self.roots.met.iter().fold(0, |all, met| all | met)
    }

    /// The nearest hit of a ray that was taken, which has one already, if any; with ANY, whichever
    /// is found first.
    #[inline(always)]
    pub fn trace<const ANY: bool>(&mut self, ray: usize, nearest: Nearest) -> Nearest {
        let root = &self.scene.groups[0];
        self.t_min = self.roots.interval(ray)[0];
        self.nearest = nearest;
        self.stack.clear();
        self.roots.push_met::<ANY>(ray, root, &mut self.stack);
        let (ray, mut tree_ray) = self.roots.ray(ray);
        if nearest.leaf >= 0 {
            tree_ray.restrict(nearest.t);
        }
        self.descend::<ANY>(Level {
            ray,
            tree_ray,
            group: root,
            first_leaf: 0,
            stack_base: 0,
        })
    }

    /// The nearest hit of a ray that has come to a level some other way: of `nearest`, and what
    /// it meets below `child` of the group's tree; with ANY, whichever is found first.
    #[inline(always)]
    pub fn go_on<const ANY: bool>(
        &mut self,
        level: Level<'s>,
        child: Child,
        t_min: f64,
        nearest: Nearest,
    ) -> Nearest {
        self.t_min = t_min;
        self.nearest = nearest;
        self.stack.clear();
        self.stack.push(child);
        self.descend::<ANY>(level)
    }

    /// Visits what is on the stack, which is of that level.
    #[inline(always)]
    fn descend<const ANY: bool>(&mut self, level: Level<'s>) -> Nearest {
        // Levels stay in their places: what was just written in small parts is slow to copy.
        let mut levels = std::mem::take(&mut self.levels);
        levels.clear();
        levels.push(level);
        while let Some(level) = levels.last_mut() {
            let Some(offset) = self.next_item::<ANY>(level) else {
                levels.pop();
                if let Some(outer) = levels.last_mut() {
                    outer.tree_ray.restrict(self.nearest.t);
                }
                continue;
            };
            if let Some(inner) = self.visit::<ANY>(level, offset) {
                levels.push(inner);
            } else if ANY && self.nearest.leaf >= 0 {
                break;
            }
        }
        self.levels = levels;
        self.nearest
    }

    /// Begins a level: its root and its unbounded instances are on the stack.
    #[inline(always)]
    fn enter(&mut self, ray: LevelRays<f64>, group: &'s Group, first_leaf: i64) -> Level<'s> {
        let space = group.tree.space;
        let (origin, slide) = ray.in_space(&space);
        let tree_ray = TreeRay::new(
            origin,
            ray.direction,
            (slide / space.scale).mul_add(ray.rate, ray.start),
            ray.per_rate * space.scale,
            [self.t_min, self.nearest.t],
        );
        let stack_base = self.stack.len();
        if !group.tree.nodes.is_empty() {
            self.stack.push(Child::ROOT);
        }
        for &offset in &group.unbounded {
            self.stack.push(Child::item(offset));
        }
        Level {
            ray,
            tree_ray,
            group,
            first_leaf,
            stack_base,
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

    /// Tests an instance; a level to go on with if that is a group.
    #[inline(always)]
    fn visit<const ANY: bool>(
        &mut self,
        level: &mut Level<'s>,
        offset: usize,
    ) -> Option<Level<'s>> {
        let row = level.group.start + offset;
        let target = self.scene.target(row);
        let entrance = self.scene.entrance(row, &target);
        let leaf = level.first_leaf + level.group.leaves_before(offset);
        let prototype = match target {
            Target::Group(inner) => {
                let ray = entrance.enter_group(&level.ray);
                return Some(self.enter(ray, inner, leaf));
            }
            Target::Prototype(prototype) => prototype,
        };
        let ray = entrance.enter_prototype(&level.ray, &prototype.space);
        let taken = match &prototype.geometry {
            Geometry::Mesh(mesh) => self.visit_mesh::<ANY>(&ray, mesh, leaf),
            Geometry::Shape(shape) => {
                let t = intersect_shape::<I, F>(shape, &ray, self.t_min, self.nearest.t);
                t.is_some_and(|t| self.nearest.offer(t, leaf, 0))
            }
        };
        if !ANY && taken {
            level.tree_ray.restrict(self.nearest.t);
        }
        None
    }

    /// Tests the triangles of a mesh with a ray in its space; whether a hit was taken.
    #[inline(always)]
    fn visit_mesh<const ANY: bool>(
        &mut self,
        ray: &LevelRays<f64>,
        mesh: &Mesh<F>,
        leaf: i64,
    ) -> bool {
        let nodes = &mesh.tree.nodes;
        if nodes.is_empty() {
            return false;
        }
        let mut all_taken = false;
        let interval = [self.t_min, self.nearest.t];
        let tree_ray = TreeRay::new(ray.origin, ray.direction, ray.start, ray.per_rate, interval);
        let mut before = tree_ray.before;
        let mut lanes = BoxLanes::<I::F32UpTo8>::new(&tree_ray);
        let (mut prepared, axis) = block_ray::<F::Block<I>>(ray, self.t_min, self.nearest.t);
        let base = self.stack.len();
        self.stack.push(Child::ROOT);
        'entries: while let Some((near, mut child)) = self.stack.pop(base) {
            if near > before {
                continue;
            }
            while child.is_node() {
                let node = &nodes[child.number() as usize];
                match lanes.visit::<ANY>(node, &mut self.stack, |child| mesh.prefetch(child)) {
                    Some(next) => child = next,
                    None => continue 'entries,
                }
            }
            let block = &mesh.blocks[child.number() as usize];
            let nearest = &mut self.nearest;
            let mut taken = false;
            intersect_block(&prepared, axis, ray, block, |lane, t| {
                taken |= nearest.offer(t, leaf, block.triangles[lane]);
            });
            if taken {
                all_taken = true;
                if ANY {
                    return true;
                }
                before = tree_ray.tree_parameter(self.nearest.t);
                lanes.before = I::F32UpTo8::splat(before);
                restrict_block_ray(&mut prepared, ray, self.t_min, self.nearest.t);
            }
        }
        all_taken
    }
}
