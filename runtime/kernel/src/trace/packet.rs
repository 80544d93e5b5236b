//! W coherent rays at a time.
use super::bundle::{Bundle, Entry};
use super::columns::RayColumns;
use super::level::Target;
use super::precision::{Halves, PacketMask, Precision};
use crate::instance::LevelRays;
use crate::lanes::{Isa, Lanes, Mask, axes, halves};
use crate::scene::{Geometry, Group, Mesh, Scene, TriangleBlock};

type F64Mask<I> = <<I as Isa>::F64 as Lanes>::Mask;

/// The rays in the space of a group on their way down.
struct Level<'s, I: Isa> {
    rays: Halves<LevelRays<I::F64>>,
    bundle: Bundle<I>,
    /// Origins and directions in the tree's space.
    rounded: [[I::F32; 3]; 2],
    group: &'s Group,
    /// The number of the group's first leaf.
    first_leaf: i64,
    /// Rays that came in.
    active: PacketMask<I>,
    /// Entries below belong to the levels above.
    stack_base: usize,
}

/// The nearest hits so far.
pub struct Best<I: Isa> {
    pub t: Halves<I::F64>,
    /// Leaf numbers, which are exact in f64; −1 where nothing was hit.
    pub leaf: Halves<I::F64>,
    pub triangle: Halves<I::F64>,
}

impl<I: Isa> Best<I> {
    /// Takes the hits that are nearer, or as near and of a lower leaf or triangle; which these
    /// were. With ANY only tells which are near enough.
    #[inline(always)]
    pub fn offer<const ANY: bool>(
        &mut self,
        hit: PacketMask<I>,
        t: &Halves<I::F64>,
        leaf: i64,
        triangle: u32,
    ) -> PacketMask<I> {
        let hit = I::split(hit);
        if ANY {
            return I::join(hit.0 & t[0].lt(self.t[0]), hit.1 & t[1].lt(self.t[1]));
        }
        let leaf = I::F64::splat(leaf as f64);
        let triangle = I::F64::splat(f64::from(triangle));
        let low = self.offer_half(0, hit.0, t[0], leaf, triangle);
        let high = self.offer_half(1, hit.1, t[1], leaf, triangle);
        I::join(low, high)
    }

    #[inline(always)]
    fn offer_half(
        &mut self,
        h: usize,
        hit: F64Mask<I>,
        t: I::F64,
        leaf: I::F64,
        triangle: I::F64,
    ) -> F64Mask<I> {
        let lower = leaf.lt(self.leaf[h]) | (leaf.eq(self.leaf[h]) & triangle.lt(self.triangle[h]));
        let taken = hit & (t.lt(self.t[h]) | (t.eq(self.t[h]) & lower));
        self.t[h] = I::F64::select(taken, t, self.t[h]);
        self.leaf[h] = I::F64::select(taken, leaf, self.leaf[h]);
        self.triangle[h] = I::F64::select(taken, triangle, self.triangle[h]);
        taken
    }
}

/// Stacks, kept from packet to packet.
pub(super) struct Packet<'s, I: Isa, F: Precision> {
    scene: &'s Scene<F>,
    above: Vec<Level<'s, I>>,
    stack: Vec<Entry>,
    t_min: Halves<I::F64>,
    /// What was found; with ANY nothing is kept here.
    pub best: Best<I>,
    /// Rays that still look for something: with ANY, those that have not hit.
    pub alive: PacketMask<I>,
}

impl<'s, I: Isa, F: Precision> Packet<'s, I, F> {
    /// Rays of a packet.
    pub const WIDTH: usize = I::F32::WIDTH;

    pub fn new(scene: &'s Scene<F>) -> Self {
        let zero = [I::F64::zero(); 2];
        Packet {
            scene,
            above: Vec::new(),
            stack: Vec::with_capacity(64),
            t_min: zero,
            best: Best {
                t: zero,
                leaf: zero,
                triangle: zero,
            },
            alive: Mask::none(),
        }
    }

    /// Finds the nearest hits of valid rays; with ANY, whether there are any.
    #[inline(always)]
    pub fn trace<const ANY: bool>(&mut self, rays: &RayColumns<I>) {
        self.stack.clear();
        self.above.clear();
        self.t_min = rays.t_min;
        self.best = Best {
            t: rays.t_max,
            leaf: [I::F64::splat(-1.0); 2],
            triangle: [I::F64::zero(); 2],
        };
        self.alive = Mask::first(rays.len);
        let mut level = self.enter::<ANY>(rays.level, &self.scene.groups[0], 0, self.alive);
        loop {
            while let Some((child, active)) = level.bundle.next_leaf::<ANY>(
                &level.group.tree.nodes,
                &mut self.stack,
                level.stack_base,
                level.active & self.alive,
            ) {
                let number = child.number() as usize;
                if !child.is_item() {
                    let block = &level.group.blocks[number];
                    level
                        .bundle
                        .visit_block(block, level.rounded, active, &mut self.stack);
                    continue;
                }
                if let Some(inner) = self.visit::<ANY>(&mut level, number, active) {
                    self.above.push(std::mem::replace(&mut level, inner));
                }
                if ANY && !self.alive.any() {
                    return;
                }
            }
            let Some(outer) = self.above.pop() else {
                return;
            };
            level = outer;
            if !ANY {
                level.bundle.restrict(&self.best.t, level.active);
            }
        }
    }

    /// Begins a level: what its root holds and its unbounded instances are on the stack.
    #[inline(always)]
    fn enter<const ANY: bool>(
        &mut self,
        rays: Halves<LevelRays<I::F64>>,
        group: &'s Group,
        first_leaf: i64,
        active: PacketMask<I>,
    ) -> Level<'s, I> {
        let space = group.tree.space;
        let [(low, low_slide), (high, high_slide)] =
            [rays[0].in_space(&space), rays[1].in_space(&space)];
        let scale = I::F64::splat(space.scale);
        let unscale = I::F64::splat(1.0 / space.scale);
        let origin = axes!(|i| I::narrow(low[i], high[i]));
        let direction = axes!(|i| I::narrow(rays[0].direction[i], rays[1].direction[i]));
        let bundle = Bundle::<I>::new(
            origin,
            direction,
            [
                (low_slide * unscale).mul_add(rays[0].rate, rays[0].start),
                (high_slide * unscale).mul_add(rays[1].rate, rays[1].start),
            ],
            [rays[0].per_rate * scale, rays[1].per_rate * scale],
            [&self.t_min, &self.best.t],
            active,
        );
        let stack_base = self.stack.len();
        if !group.tree.nodes.is_empty() {
            bundle.visit_node::<ANY>(&group.tree.nodes, 0, &mut self.stack);
        }
        for &offset in &group.unbounded {
            self.stack.push(Entry::unbounded(offset));
        }
        Level {
            rays,
            bundle,
            rounded: [origin, direction],
            group,
            first_leaf,
            active,
            stack_base,
        }
    }

    /// Tests an instance; a level to go on with if that is one.
    #[inline(always)]
    fn visit<const ANY: bool>(
        &mut self,
        level: &mut Level<'s, I>,
        offset: usize,
        active: PacketMask<I>,
    ) -> Option<Level<'s, I>> {
        let row = level.group.start + offset;
        let target = self.scene.target(row);
        let entrance = self.scene.entrance(row, &target);
        let leaf = level.first_leaf + level.group.leaves_before(offset);
        let prototype = match target {
            Target::Prototype(prototype) => prototype,
            Target::Group(inner) => {
                let rays = halves!(|h| entrance.enter_group(&level.rays[h]));
                return Some(self.enter::<ANY>(rays, inner, leaf, active));
            }
        };
        let rays: Halves<LevelRays<I::F64>> =
            halves!(|h| entrance.enter_prototype(&level.rays[h], &prototype.space));
        let taken = match &prototype.geometry {
            Geometry::Mesh(mesh) => self.visit_mesh::<ANY>(&rays, mesh, leaf, active),
            Geometry::Shape(shape) => {
                let (hit, t) =
                    F::packet_shape::<I>(shape, &rays, &self.t_min, &self.best.t, active);
                if hit.any() {
                    self.take::<ANY>(hit, &t, leaf, 0)
                } else {
                    hit
                }
            }
        };
        if !ANY && taken.any() {
            level.bundle.restrict(&self.best.t, level.active);
        }
        None
    }

    /// Tests the triangles of a mesh with rays in its space; which rays took a hit.
    #[inline(always)]
    fn visit_mesh<const ANY: bool>(
        &mut self,
        rays: &Halves<LevelRays<I::F64>>,
        mesh: &Mesh<F>,
        leaf: i64,
        active: PacketMask<I>,
    ) -> PacketMask<I> {
        let nodes = &mesh.tree.nodes;
        let mut all_taken = Mask::none();
        if nodes.is_empty() {
            return all_taken;
        }
        let mut prepared = F::packet_rays::<I>(rays, &self.t_min, &self.best.t);
        if let [block] = &mesh.blocks[..] {
            return self.visit_triangles::<ANY>(rays, &prepared, block, leaf, active);
        }
        let mut bundle = Bundle::<I>::of_mesh(rays, [&self.t_min, &self.best.t], active);
        let stack_base = self.stack.len();
        bundle.visit_node::<false>(nodes, 0, &mut self.stack);
        loop {
            let left = active & self.alive;
            let next = bundle.next_leaf::<false>(nodes, &mut self.stack, stack_base, left);
            let Some((child, met)) = next else {
                return all_taken;
            };
            let block = &mesh.blocks[child.number() as usize];
            let taken = self.visit_triangles::<ANY>(rays, &prepared, block, leaf, met);
            if !taken.any() {
                continue;
            }
            all_taken = all_taken | taken;
            if ANY {
                if !(active & self.alive).any() {
                    self.stack.truncate(stack_base);
                    return all_taken;
                }
            } else {
                bundle.restrict(&self.best.t, active);
                F::packet_restrict::<I>(&mut prepared, rays, &self.t_min, &self.best.t);
            }
        }
    }

    /// Tests the triangles of a block; which rays took a hit.
    #[inline(always)]
    fn visit_triangles<const ANY: bool>(
        &mut self,
        rays: &Halves<LevelRays<I::F64>>,
        prepared: &F::PacketRays<I>,
        block: &TriangleBlock<F>,
        leaf: i64,
        active: PacketMask<I>,
    ) -> PacketMask<I> {
        let mut taken = Mask::none();
        for axis in 0..3 {
            let along = F::packet_along::<I>(prepared, axis) & active;
            if !along.any() {
                continue;
            }
            for lane in 0..block.len as usize {
                let (hit, t) = F::packet_triangle::<I>(prepared, axis, rays, block, lane, along);
                if hit.any() {
                    taken = taken | self.take::<ANY>(hit, &t, leaf, block.triangles[lane]);
                }
            }
        }
        taken
    }

    /// Takes hits if they are nearer; which these were.
    #[inline(always)]
    fn take<const ANY: bool>(
        &mut self,
        hit: PacketMask<I>,
        t: &Halves<I::F64>,
        leaf: i64,
        triangle: u32,
    ) -> PacketMask<I> {
        let taken = self.best.offer::<ANY>(hit, t, leaf, triangle);
        if ANY {
            self.alive = self.alive.and_not(taken);
        }
        taken
    }
}
