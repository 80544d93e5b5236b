//! W coherent rays at a time.
use super::best::Best;
use super::bundle::Bundle;
use super::columns::RayColumns;
use super::entries::{Entries, Entry};
use super::level::Target;
use super::mesh_ray::MeshPacket;
use super::parting::{Begin, Part, PartInMesh, are_apart, are_few, large_leaves};
use super::precision::{Halves, PacketMask, Precision};
use super::singles::Singles;
use super::tree_rays::TreeRays;
use crate::bvh::Child;
use crate::instance::LevelRays;
use crate::lanes::{Isa, Lanes, Mask, halves};
use crate::scene::{Geometry, Group, Mesh, Scene, TriangleBlock};

/// The rays in the space of a group on their way down.
#[derive(Clone)]
pub(super) struct Level<'s, I: Isa> {
    pub rays: Halves<LevelRays<I::F64>>,
    pub bundle: Bundle<I>,
    pub group: &'s Group,
    /// The number of the group's first leaf.
    pub first_leaf: i64,
    /// Rays that came in.
    active: PacketMask<I>,
    /// Entries below belong to the levels above.
    pub stack_base: usize,
}

/// Stacks, kept from packet to packet.
pub(super) struct Packet<'s, I: Isa, F: Precision> {
    pub scene: &'s Scene<F>,
    /// Which children of the root are large leaves of simple instances, as bits.
    pub large: u32,
    above: Vec<Level<'s, I>>,
    pub stack: Entries,
    pub t_min: Halves<I::F64>,
    /// The leaves that rays leave for good, or −1.
    pub left: Halves<I::F64>,
    /// What was found; with ANY nothing is kept here.
    pub best: Best<I>,
    /// Rays that still look for something: with ANY, those that have not hit.
    pub alive: PacketMask<I>,
}

impl<'s, I: Isa, F: Precision> Packet<'s, I, F> {
    /// Rays of a packet.
    pub const WIDTH: usize = I::F32::WIDTH;

    #[inline(always)]
    pub fn new(scene: &'s Scene<F>) -> Self {
        let zero = [I::F64::zero(); 2];
        Packet {
            scene,
            large: large_leaves::<I, F>(scene),
            above: Vec::new(),
            stack: Entries::new(),
            t_min: zero,
            left: zero,
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

    /// Begins with rays that are at the root, where many are likely to meet the same; whether there
    /// is anything of that kind.
    #[inline(always)]
    pub fn begin<const ANY: bool>(
        &mut self,
        rays: &RayColumns<I>,
        singles: &mut Singles<'s, I, F>,
    ) -> bool {
        I::call(Begin::<'_, 's, I, F, ANY> {
            packet: self,
            singles,
            rays: rays.clone(),
        })
    }

    /// Takes rays in, none of which has hit anything.
    #[inline(always)]
    pub fn load(&mut self, rays: &RayColumns<I>) {
        self.stack.truncate(0);
        self.above.clear();
        self.t_min = rays.t_min;
        self.left = rays.left;
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
    pub fn descend<const ANY: bool, const COHERENT: bool>(
        &mut self,
        mut level: Level<'s, I>,
        singles: &mut Singles<'s, I, F>,
    ) {
        loop {
            while let Some((child, mut active)) = level.bundle.next_leaf::<ANY, COHERENT>(
                &level.group.tree.nodes,
                &mut self.stack,
                level.stack_base,
                level.active & self.alive,
            ) {
                if ANY && child.is_item() {
                    active = active.and_not(self.leave(&level, child));
                    if !active.any() {
                        continue;
                    }
                }
                let rays = active.bits().count_ones();
                if are_few::<F, COHERENT>(self.scene, level.group, child, rays) {
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
                    (level.bundle).visit_block(block, active, &mut self.stack);
                    continue;
                }
                if let Some(inner) = self.visit::<ANY>(&mut level, number, active, singles) {
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
    pub fn level(
        &self,
        rays: Halves<LevelRays<I::F64>>,
        group: &'s Group,
        first_leaf: i64,
        active: PacketMask<I>,
    ) -> Level<'s, I> {
        let interval = [&self.t_min, &self.best.t];
        let tree_rays = TreeRays::in_group(&rays, &group.tree.space, interval);
        Level {
            rays,
            bundle: Bundle::new(tree_rays, active),
            group,
            first_leaf,
            active,
            stack_base: self.stack.len(),
        }
    }

    /// The rays that leave an instance of an object for good.
    #[inline(always)]
    fn leave(&self, level: &Level<'s, I>, child: Child) -> PacketMask<I> {
        let offset = child.number() as usize;
        let row = level.group.start + offset;
        if matches!(self.scene.target(row), Target::Group(_)) {
            return Mask::none();
        }
        let leaf = level.first_leaf + level.group.leaves_before(offset);
        let [low, high] = halves!(|h| self.left[h].eq(I::F64::splat(leaf as f64)));
        I::join(low, high)
    }

    /// Tests an instance; a level to go on with if that is one.
    #[inline(always)]
    fn visit<const ANY: bool>(
        &mut self,
        level: &mut Level<'s, I>,
        offset: usize,
        active: PacketMask<I>,
        singles: &mut Singles<'s, I, F>,
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
            Geometry::Mesh(mesh) => self.visit_mesh::<ANY>(&rays, mesh, leaf, active, singles),
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
        mesh: &'s Mesh<F>,
        leaf: i64,
        active: PacketMask<I>,
        singles: &mut Singles<'s, I, F>,
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
        let tree_rays = TreeRays::in_mesh(rays, [&self.t_min, &self.best.t]);
        if are_apart(mesh.blocks.len(), &tree_rays, active) {
            return I::call(PartInMesh::<'_, 's, I, F, ANY> {
                packet: self,
                singles,
                mesh: MeshPacket {
                    mesh,
                    leaf,
                    parameter: halves!(|h| rays[h].parameter),
                    tree_rays,
                    prepared,
                },
                active,
            });
        }
        let mut bundle = Bundle::<I>::new(tree_rays, active);
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
            let mut along = F::packet_along::<I>(prepared, axis) & active;
            for lane in 0..block.len as usize {
                if !along.any() {
                    break;
                }
                let (hit, t) = F::packet_triangle::<I>(prepared, axis, rays, block, lane, along);
                if hit.any() {
                    taken = taken | self.take::<ANY>(hit, &t, leaf, block.triangles[lane]);
                    if ANY {
                        along = along.and_not(taken);
                    }
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
