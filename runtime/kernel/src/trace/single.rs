//! One ray at a time, against eight boxes at a time.
use super::Nearest;
use super::level::{Content, Target};
use super::precision::{Precision, block_ray, intersect_block, intersect_shape};
use crate::bvh::{Child, LARGEST_LEAF, NodeRay, WIDTH};
use crate::instance::LevelRays;
use crate::lanes::{Isa, Lanes, Mask, axes, each};
use crate::ray::Ray;
use crate::scene::{Geometry, Group, InstanceBlock, Mesh, Scene};
use crate::shapes::TriangleRays;

/// A node or leaf to be visited, and where the ray enters its box.
#[derive(Clone, Copy)]
struct Entry {
    near: f32,
    child: Child,
}

/// The ray in one space on its way down.
struct Level<'s, I: Isa, F: Precision> {
    ray: LevelRays<f64>,
    content: Content<'s, F>,
    node_ray: NodeRay<I::F32UpTo8>,
    /// Origin and direction in the tree's space.
    rounded: ([f32; 3], [f32; 3]),
    /// Row of the planes through which the ray enters boxes, by axis.
    entry_planes: [usize; 3],
    /// The tree's parameter of world t is (t − start)·per_rate.
    start: f64,
    per_rate: f64,
    after: f32,
    before: f32,
    block_ray: Option<TriangleRays<F::Block<I>>>,
    /// Entries below belong to the levels above.
    stack_base: usize,
}

impl<I: Isa, F: Precision> Level<'_, I, F> {
    #[inline(always)]
    fn to_tree(&self, t: f64) -> f32 {
        ((t - self.start) * self.per_rate) as f32
    }
}

/// Stacks, kept from ray to ray.
pub(super) struct Single<'s, I: Isa, F: Precision> {
    scene: &'s Scene<F>,
    above: Vec<Level<'s, I, F>>,
    stack: Vec<Entry>,
    t_min: f64,
    nearest: Nearest,
}

impl<'s, I: Isa, F: Precision> Single<'s, I, F> {
    pub fn new(scene: &'s Scene<F>) -> Self {
        Single {
            scene,
            above: Vec::new(),
            stack: Vec::new(),
            t_min: 0.0,
            nearest: Nearest::none(0.0),
        }
    }

    /// The nearest hit of a valid ray; with ANY, whichever is found first.
    #[inline(always)]
    pub fn trace<const ANY: bool>(&mut self, ray: &Ray) -> Nearest {
        self.stack.clear();
        self.above.clear();
        self.t_min = ray.t_min;
        self.nearest = Nearest::none(ray.t_max);
        let root = Content::Group(&self.scene.groups[0], 0);
        let mut level = self.enter(LevelRays::from_ray(ray), root);
        loop {
            while self.stack.len() > level.stack_base {
                let Some(entry) = self.stack.pop() else { break };
                if entry.near > level.before {
                    continue;
                }
                if entry.child.is_node() {
                    self.visit_node(&level, entry.child);
                    continue;
                }
                let found = self.nearest.leaf;
                match level.content {
                    Content::Mesh(mesh, leaf) => {
                        self.visit_triangles(&mut level, mesh, leaf, entry.child.number());
                    }
                    Content::Group(group, _) if !entry.child.is_item() => {
                        self.visit_block(&level, &group.blocks[entry.child.number() as usize]);
                        continue;
                    }
                    Content::Group(group, first_leaf) => {
                        let offset = entry.child.number() as usize;
                        if let Some(inner) =
                            self.visit_instance(&mut level, group, first_leaf, offset)
                        {
                            self.above.push(std::mem::replace(&mut level, inner));
                        }
                    }
                }
                if ANY && self.nearest.leaf != found {
                    return self.nearest;
                }
            }
            let Some(outer) = self.above.pop() else {
                return self.nearest;
            };
            level = outer;
            level.before = level.to_tree(self.nearest.t);
        }
    }

    /// Begins a level: its root and its unbounded instances are on the stack.
    #[inline(always)]
    fn enter(&mut self, ray: LevelRays<f64>, content: Content<'s, F>) -> Level<'s, I, F> {
        let tree = content.tree();
        let space = content.space();
        let (origin, slide) = ray.in_space(&space);
        let rounded = (
            each!(origin, |x| x as f32),
            each!(ray.direction, |x| x as f32),
        );
        let mut level = Level {
            ray,
            content,
            node_ray: NodeRay::new(
                I::F32UpTo8::splats(rounded.0),
                I::F32UpTo8::splats(rounded.1),
            ),
            rounded,
            entry_planes: axes!(|i| {
                if ray.direction[i].is_sign_negative() {
                    i + 3
                } else {
                    i
                }
            }),
            start: (slide / space.scale).mul_add(ray.rate, ray.start),
            per_rate: ray.per_rate * space.scale,
            after: 0.0,
            before: 0.0,
            block_ray: None,
            stack_base: self.stack.len(),
        };
        level.after = level.to_tree(self.t_min);
        level.before = level.to_tree(self.nearest.t);
        if !tree.nodes.is_empty() {
            self.stack.push(Entry {
                near: f32::NEG_INFINITY,
                child: Child::ROOT,
            });
        }
        self.stack
            .extend(content.unbounded().iter().map(|&offset| Entry {
                near: f32::NEG_INFINITY,
                child: Child::item(offset),
            }));
        level
    }

    /// Pushes the children that the ray meets, the nearest on top.
    #[inline(always)]
    fn visit_node(&mut self, level: &Level<'s, I, F>, child: Child) {
        type N<I> = <I as Isa>::F32UpTo8;
        let node = &level.content.tree().nodes[child.number() as usize];
        let base = self.stack.len();
        for first in (0..WIDTH).step_by(N::<I>::WIDTH) {
            let enters = &level.entry_planes;
            let entry = axes!(|i| N::<I>::load(&node.planes[enters[i]][first..]));
            let exit = axes!(|i| N::<I>::load(&node.planes[2 * i + 3 - enters[i]][first..]));
            let (near, far) = level.node_ray.interval(
                entry,
                exit,
                N::<I>::splat(level.after),
                N::<I>::splat(level.before),
            );
            let met = near.le(far).bits();
            self.push(met, near, |lane| node.children[first + lane]);
        }
        self.sort_from(base);
    }

    /// Pushes the instances of a block that the ray may hit, the nearest on top.
    #[inline(always)]
    fn visit_block(&mut self, level: &Level<'s, I, F>, block: &InstanceBlock) {
        let base = self.stack.len();
        for first in (0..LARGEST_LEAF).step_by(I::F32UpTo8::WIDTH) {
            let (met, near) =
                block.meets::<I::F32UpTo8>(first, level.rounded, level.after, level.before);
            self.push(met, near, |lane| Child::item(block.instances[first + lane]));
        }
        self.sort_from(base);
    }

    /// Pushes the lanes that are met.
    #[inline(always)]
    fn push(&mut self, mut met: u32, near: I::F32UpTo8, child: impl Fn(usize) -> Child) {
        if met == 0 {
            return;
        }
        let mut nears = [0.0; WIDTH];
        near.store(&mut nears);
        while met != 0 {
            let lane = met.trailing_zeros() as usize;
            met &= met - 1;
            self.stack.push(Entry {
                near: nears[lane],
                child: child(lane),
            });
        }
    }

    /// Brings the nearest of the entries from `base` on to the top: by insertion, for there
    /// seldom are more than three.
    #[inline(always)]
    fn sort_from(&mut self, base: usize) {
        for i in base + 1..self.stack.len() {
            let mut j = i;
            while j > base && self.stack[j].near > self.stack[j - 1].near {
                self.stack.swap(j, j - 1);
                j -= 1;
            }
        }
    }

    /// Tests a block of triangles.
    #[inline(always)]
    fn visit_triangles(
        &mut self,
        level: &mut Level<'s, I, F>,
        mesh: &Mesh<F>,
        leaf: i64,
        number: u32,
    ) {
        let ray = &level.ray;
        let prepared = match level.block_ray {
            Some(prepared) => prepared,
            None => *level.block_ray.insert(block_ray(ray)),
        };
        let block = &mesh.blocks[number as usize];
        let (t_min, t_max) = (self.t_min, self.nearest.t);
        let nearest = &mut self.nearest;
        intersect_block(&prepared, ray, block, t_min, t_max, |lane, t| {
            nearest.offer(t, leaf, block.triangles[lane]);
        });
        if self.nearest.t < t_max {
            level.before = level.to_tree(self.nearest.t);
        }
    }

    /// Enters an instance of a group: tests what it is of, or returns that as the level to go on
    /// with.
    #[inline(always)]
    fn visit_instance(
        &mut self,
        level: &mut Level<'s, I, F>,
        group: &Group,
        first_leaf: i64,
        offset: usize,
    ) -> Option<Level<'s, I, F>> {
        let row = group.start + offset;
        let target = self.scene.target(row);
        let entrance = self.scene.entrance(row, &target);
        let leaf = first_leaf + group.leaves_before(offset);
        let prototype = match target {
            Target::Group(inner) => {
                let ray = entrance.enter_group(&level.ray);
                return Some(self.enter(ray, Content::Group(inner, leaf)));
            }
            Target::Prototype(prototype) => prototype,
        };
        let ray = entrance.enter_prototype(&level.ray, &prototype.space);
        match &prototype.geometry {
            Geometry::Mesh(mesh) => Some(self.enter(ray, Content::Mesh(mesh, leaf))),
            Geometry::Shape(shape) => {
                let t = intersect_shape::<I, F>(shape, &ray, self.t_min, self.nearest.t);
                if t.is_some_and(|t| self.nearest.offer(t, leaf, 0)) {
                    level.before = level.to_tree(self.nearest.t);
                }
                None
            }
        }
    }
}
