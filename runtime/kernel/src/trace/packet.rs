//! W coherent rays at a time.
use super::best::Best;
use super::bundle::{Bundle, Entry, large_children};
use super::columns::RayColumns;
use super::level::Target;
use super::precision::{Halves, PacketMask, Precision};
use super::single;
use super::singles::Singles;
use super::take_bit;
use crate::bvh::{Child, WIDTH};
use crate::instance::LevelRays;
use crate::lanes::{Isa, Lanes, Mask, Task, axes, halves};
use crate::scene::{Geometry, Group, Mesh, Scene, TriangleBlock};

// As many rays as are faster one at a time, measured: in the tree of a group, in an instance of a
// group, and in one of a mesh. With a shape a packet takes no longer than one ray.
const FEW_AT_ONCE: u32 = 2;
const FEW_IN_TREE: u32 = 1;
const FEW_IN_GROUP: u32 = 8;
const FEW_IN_MESH: u32 = 4;

/// The rays in the space of a group on their way down.
#[derive(Clone)]
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

/// The children of the root that are large leaves of simple instances, as bits.
fn large_leaves<I: Isa, F: Precision>(scene: &Scene<F>) -> u32 {
    let root = &scene.groups[0];
    let Some(node) = root.tree.nodes.first() else {
        return 0;
    };
    let is_simple = |child: &Child| {
        !child.is_node() && {
            let block = &root.blocks[child.number() as usize];
            let row = |item: &Child| root.start + item.number() as usize;
            (block.instances[..block.len as usize].iter())
                .all(|item| scene.target(row(item)).is_simple())
        }
    };
    (0..WIDTH)
        .filter(|&i| large_children::<I>(node) >> i & 1 != 0 && is_simple(&node.children[i]))
        .fold(0, |leaves, i| leaves | 1 << i)
}

/// The task of [`Packet::part`], out of the way of packets that stay together.
struct Part<'a, 's, I: Isa, F: Precision, const ANY: bool> {
    packet: &'a mut Packet<'s, I, F>,
    singles: &'a mut Singles<'s, I, F>,
    level: &'a Level<'s, I>,
    child: Child,
    active: PacketMask<I>,
}

impl<I: Isa, F: Precision, const ANY: bool> Task for Part<'_, '_, I, F, ANY> {
    type Output = ();

    #[inline(always)]
    fn run<J: Isa>(self) {
        self.packet
            .part::<ANY>(self.singles, self.level, self.child, self.active);
    }
}

/// Stacks, kept from packet to packet.
pub(super) struct Packet<'s, I: Isa, F: Precision> {
    scene: &'s Scene<F>,
    /// Which children of the root are large leaves of simple instances, as bits.
    large: u32,
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
            large: large_leaves::<I, F>(scene),
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
    pub fn trace<const ANY: bool>(
        &mut self,
        rays: &RayColumns<I>,
        singles: &mut Singles<'s, I, F>,
    ) {
        self.load(rays);
        let level = self.enter::<ANY>(rays.level, &self.scene.groups[0], 0, self.alive);
        self.descend::<ANY, true>(level, singles);
    }

    /// Begins with rays that are at the root: finds the nearest hits of large leaves of the
    /// root's tree and of unbounded instances, which many are likely to meet; or of all, where that
    /// pays. Whether there are any.
    #[inline(always)]
    pub fn begin<const ANY: bool>(
        &mut self,
        rays: &RayColumns<I>,
        singles: &mut Singles<'s, I, F>,
    ) -> bool {
        // Out of the way of packets that are coherent.
        struct Begin<'a, 's, I: Isa, F: Precision, const ANY: bool> {
            packet: &'a mut Packet<'s, I, F>,
            rays: &'a RayColumns<I>,
            singles: &'a mut Singles<'s, I, F>,
        }
        impl<I: Isa, F: Precision, const ANY: bool> Task for Begin<'_, '_, I, F, ANY> {
            type Output = bool;
            #[inline(always)]
            fn run<J: Isa>(self) -> bool {
                self.packet.begin_here::<ANY>(self.rays, self.singles)
            }
        }
        I::call(Begin::<'_, 's, I, F, ANY> {
            packet: self,
            rays,
            singles,
        })
    }

    #[inline(always)]
    fn begin_here<const ANY: bool>(
        &mut self,
        rays: &RayColumns<I>,
        singles: &mut Singles<'s, I, F>,
    ) -> bool {
        self.load(rays);
        let root = &self.scene.groups[0];
        let together = !ANY
            && root.dear
            && singles.roots.rays_share()
            && rays.start_together(&root.tree.space);
        let valid = rays.valid();
        for &offset in &root.unbounded {
            self.stack
                .push(Entry::first(Child::item(offset), valid.bits()));
        }
        let mut large = if together { 0 } else { self.large };
        while large != 0 {
            let i = large.trailing_zeros() as usize;
            large &= large - 1;
            let met = singles.roots.met[i];
            if met.count_ones() > FEW_AT_ONCE {
                singles.roots.pass(1 << i);
                self.stack
                    .push(Entry::first(root.tree.nodes[0].children[i], met));
            }
        }
        let has_begun = together || !self.stack.is_empty();
        if has_begun {
            let mut level = self.level(rays.level, root, 0, self.alive);
            level.stack_base = 0;
            if together {
                let (bundle, nodes) = (&level.bundle, &root.tree.nodes);
                if bundle.share_node(nodes, 0, valid & self.alive, &mut self.stack) {
                    singles.roots.pass(u32::MAX);
                }
            }
            self.descend::<ANY, false>(level, singles);
        }
        has_begun
    }

    #[inline(always)]
    fn load(&mut self, rays: &RayColumns<I>) {
        self.stack.clear();
        self.above.clear();
        self.t_min = rays.t_min;
        self.best = Best {
            t: rays.t_max,
            leaf: [I::F64::splat(-1.0); 2],
            triangle: [I::F64::zero(); 2],
        };
        self.alive = Mask::first(rays.len);
    }

    /// Visits what is on the stack, which is of that level. Rays that are not coherent part as soon
    /// as they can.
    #[inline(always)]
    fn descend<const ANY: bool, const COHERENT: bool>(
        &mut self,
        mut level: Level<'s, I>,
        singles: &mut Singles<'s, I, F>,
    ) {
        loop {
            while let Some((child, active)) = level.bundle.next_leaf::<ANY, COHERENT>(
                &level.group.tree.nodes,
                &mut self.stack,
                level.stack_base,
                level.active & self.alive,
            ) {
                if self.are_few::<COHERENT>(level.group, child, active) {
                    I::call(Part::<'_, 's, I, F, ANY> {
                        packet: self,
                        singles,
                        level: &level.clone(),
                        child,
                        active,
                    });
                    if !ANY {
                        level.bundle.restrict(&self.best.t, level.active);
                    }
                    if ANY && !self.alive.any() {
                        return;
                    }
                    continue;
                }
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
        let level = self.level(rays, group, first_leaf, active);
        if !group.tree.nodes.is_empty() {
            (level.bundle).visit_node::<ANY>(&group.tree.nodes, 0, &mut self.stack);
        }
        for &offset in &group.unbounded {
            let entry = Entry::first(Child::item(offset), u32::MAX);
            self.stack.push(entry);
        }
        level
    }

    /// The rays in the space of a group, with nothing to visit yet.
    #[inline(always)]
    fn level(
        &self,
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
        Level {
            rays,
            bundle,
            rounded: [origin, direction],
            group,
            first_leaf,
            active,
            stack_base: self.stack.len(),
        }
    }

    /// Whether so few rays come to a child of a group's tree that they better go on one at a time.
    #[inline(always)]
    fn are_few<const COHERENT: bool>(
        &self,
        group: &Group,
        child: Child,
        active: PacketMask<I>,
    ) -> bool {
        let rays = active.bits().count_ones();
        if rays > FEW_IN_GROUP && COHERENT {
            return false;
        }
        if !child.is_item() {
            return rays <= FEW_IN_TREE || child.is_node();
        }
        let few = match self.scene.target(group.start + child.number() as usize) {
            target if target.is_simple() => return false,
            Target::Group(_) => FEW_IN_GROUP,
            Target::Prototype(_) => FEW_IN_MESH,
        };
        rays <= few || !COHERENT
    }

    /// Lets a few rays go on one at a time with a child of the level's tree.
    #[inline(always)]
    fn part<const ANY: bool>(
        &mut self,
        singles: &mut Singles<'s, I, F>,
        level: &Level<'s, I>,
        child: Child,
        active: PacketMask<I>,
    ) {
        let mut left = active.bits();
        while let Some(lane) = take_bit(&mut left) {
            let (half, place) = (lane / I::F64::WIDTH, lane % I::F64::WIDTH);
            let start = single::Level {
                ray: level.rays[half].get(place),
                tree_ray: level.bundle.tree_ray(lane, level.rounded),
                group: level.group,
                first_leaf: level.first_leaf,
                stack_base: 0,
            };
            let (t_min, best) = (self.t_min[half].get(place), self.best.get(lane));
            singles.start_at::<ANY>(lane, start, child, t_min, best);
        }
        singles.finish::<ANY>();
        let mut hit = 0;
        let mut left = active.bits();
        while let Some(lane) = take_bit(&mut left) {
            let nearest = singles.found[lane];
            if nearest != self.best.get(lane) {
                hit |= 1 << lane;
                self.best.set(lane, nearest);
            }
        }
        if ANY {
            self.alive = self.alive.and_not(Mask::from_bits(hit));
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
            let next = bundle.next_leaf::<false, true>(nodes, &mut self.stack, stack_base, left);
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
