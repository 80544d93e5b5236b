//! Rays of a packet that part, to go on one at a time, and rays apart that begin as a packet.
//!
//! Both are tasks called out of line, so that packets that stay together have the registers.
use super::bundle::large_children;
use super::columns::RayColumns;
use super::entries::Entry;
use super::level::Target;
use super::mesh_ray::MeshPacket;
use super::packet::{Level, Packet};
use super::precision::{Halves, PacketMask, Precision};
use super::single;
use super::singles::Singles;
use super::tree_rays::TreeRays;
use crate::bvh::Child;
use crate::instance::LevelRays;
use crate::lanes::{Isa, Lanes, Mask, Task, axes, each, halves, take_bit};
use crate::scene::{Geometry, Group, Scene};

// As many rays as are faster one at a time, measured: in the tree of a group, in an instance of a
// group, and in one of a mesh. With a shape a packet takes no longer than one ray.
const FEW_AT_ONCE: u32 = 2;
const FEW_IN_TREE: u32 = 1;
const FEW_IN_GROUP: u32 = 8;
const FEW_IN_MESH: u32 = 8;

/// The children of the root that are large leaves of instances of objects, as bits.
#[inline(always)]
pub(super) fn large_leaves<I: Isa, F: Precision>(scene: &Scene<F>) -> u32 {
    let root = &scene.groups[0];
    let Some(node) = root.tree.nodes.first() else {
        return 0;
    };
    let is_object = |child: &Child| {
        let is_object = |item: &Child| {
            let row = root.start + item.number() as usize;
            matches!(scene.target(row), Target::Prototype(_))
        };
        if child.is_item() {
            return is_object(child);
        }
        !child.is_node() && {
            let block = &root.blocks[child.number() as usize];
            (block.instances[..block.len as usize].iter()).all(is_object)
        }
    };
    let (large, mut leaves) = (large_children::<I>(node), 0);
    for (i, child) in node.children.iter().enumerate() {
        if large >> i & 1 != 0 && is_object(child) {
            leaves |= 1 << i;
        }
    }
    leaves
}

/// Begins with rays that are at the root: finds the nearest hits of large leaves of the root's tree
/// and of unbounded instances, which many are likely to meet; or of all, where that pays. Whether
/// there are any.
pub(super) struct Begin<'a, 's, I: Isa, F: Precision, const ANY: bool> {
    pub packet: &'a mut Packet<'s, I, F>,
    pub singles: &'a mut Singles<'s, I, F>,
    pub rays: RayColumns<I>,
}

impl<I: Isa, F: Precision, const ANY: bool> Task for Begin<'_, '_, I, F, ANY> {
    type Output = bool;

    #[inline(always)]
    fn run<J: Isa>(self) -> bool {
        let Begin {
            packet,
            singles,
            rays,
        } = self;
        packet.load(&rays);
        let root = &packet.scene.groups[0];
        let together = !ANY
            && root.dear
            && singles.roots.rays_share()
            && rays.start_together(&root.tree.space);
        let valid = rays.valid();
        for &offset in &root.unbounded {
            (packet.stack).push(Entry::first(Child::item(offset), valid.bits()));
        }
        let mut large = if together { 0 } else { packet.large };
        while let Some(i) = take_bit(&mut large) {
            let met = singles.roots.met[i];
            if met.count_ones() > FEW_AT_ONCE {
                singles.roots.pass(1 << i);
                (packet.stack).push(Entry::first(root.tree.nodes[0].children[i], met));
            }
        }
        let has_begun = together || packet.stack.len() > 0;
        if has_begun {
            let mut level = packet.level(rays.level, root, 0, packet.alive);
            level.stack_base = 0;
            if together {
                let (bundle, nodes) = (&level.bundle, &root.tree.nodes);
                if bundle.share_node(nodes, 0, valid & packet.alive, &mut packet.stack) {
                    singles.roots.pass(u32::MAX);
                }
            }
            packet.descend::<ANY, false>(level, singles);
        }
        has_begun
    }
}

/// Whether so few rays come to a child of a group's tree that they better go on one at a time.
#[inline(always)]
pub(super) fn are_few<F: Precision, const COHERENT: bool>(
    scene: &Scene<F>,
    group: &Group,
    child: Child,
    rays: u32,
) -> bool {
    if rays > FEW_IN_GROUP && COHERENT {
        return false;
    }
    if !child.is_item() {
        return rays <= FEW_IN_TREE || child.is_node();
    }
    let few = match scene.target(group.start + child.number() as usize) {
        target if target.is_simple() => return false,
        Target::Group(_) => FEW_IN_GROUP,
        Target::Prototype(_) => FEW_IN_MESH,
    };
    rays <= few || !COHERENT
}

/// Whether rays that enter a mesh of so many blocks run so far from each other there that they
/// better go on one at a time.
#[inline(always)]
pub(super) fn are_apart<I: Isa>(blocks: usize, rays: &TreeRays<I>, active: PacketMask<I>) -> bool {
    /// The squared distance of rays that are apart, in areas of blocks: a mesh has size 2.
    const BLOCKS_BETWEEN: f32 = 10.0;
    // Where each is nearest to the middle of the mesh.
    let (origin, direction) = (rays.origin, rays.direction);
    let [x, y, z] = axes!(|i| origin[i] * direction[i]);
    let [u, v, w] = axes!(|i| direction[i] * direction[i]);
    let along = (-(x + y + z) / (u + v + w)).max(I::F32::zero());
    let nearest = axes!(|i| along.mul_add(direction[i], origin[i]));
    let limit = I::F32::splat(BLOCKS_BETWEEN / blocks as f32);
    let far_from = |lane: u32| {
        let [x, y, z] = each!(nearest, |x| {
            let difference = x - I::F32::splat(x.get(lane as usize));
            difference * difference
        });
        (x + y + z).gt(limit)
    };
    // From two of them, one of which may be alone.
    let [first, last] = [active.bits().trailing_zeros(), active.bits().ilog2()];
    let apart = far_from(first) & far_from(last) & active;
    2 * apart.bits().count_ones() > active.bits().count_ones()
}

/// Lets a few rays go on one at a time with a child of the level's tree.
pub(super) struct Part<'a, 's, I: Isa, F: Precision, const ANY: bool> {
    pub packet: &'a mut Packet<'s, I, F>,
    pub singles: &'a mut Singles<'s, I, F>,
    pub level: &'a Level<'s, I>,
    pub child: Child,
    pub active: PacketMask<I>,
}

impl<I: Isa, F: Precision, const ANY: bool> Task for Part<'_, '_, I, F, ANY> {
    type Output = ();

    #[inline(always)]
    fn run<J: Isa>(self) {
        let Part {
            packet,
            singles,
            level,
            child,
            active,
        } = self;
        if let Some(mesh) = packet.enter_mesh(level, child) {
            packet.part_in_mesh::<ANY>(&mesh, active, singles);
        } else {
            let mut left = active.bits();
            while let Some(lane) = take_bit(&mut left) {
                let (half, place) = (lane / I::F64::WIDTH, lane % I::F64::WIDTH);
                let start = single::Level {
                    ray: level.rays[half].get(place),
                    tree_ray: level.bundle.rays.get(lane),
                    group: level.group,
                    first_leaf: level.first_leaf,
                    stack_base: 0,
                };
                let (t_min, best) = (packet.t_min(lane), packet.best.get(lane));
                let left = packet.left[half].get(place) as i64;
                singles.start_at::<ANY>(lane, start, child, t_min, left, best);
            }
            packet.collect::<ANY>(active, singles);
        }
    }
}

/// Lets rays that have entered a mesh go on there one at a time; which of them took a hit.
pub(super) struct PartInMesh<'a, 's, I: Isa, F: Precision, const ANY: bool> {
    pub packet: &'a mut Packet<'s, I, F>,
    pub singles: &'a mut Singles<'s, I, F>,
    pub mesh: MeshPacket<'s, I, F>,
    pub active: PacketMask<I>,
}

impl<I: Isa, F: Precision, const ANY: bool> Task for PartInMesh<'_, '_, I, F, ANY> {
    type Output = PacketMask<I>;

    #[inline(always)]
    fn run<J: Isa>(self) -> PacketMask<I> {
        (self.packet).part_in_mesh::<ANY>(&self.mesh, self.active, self.singles)
    }
}

impl<'s, I: Isa, F: Precision> Packet<'s, I, F> {
    /// The world's t from which on one of the rays looks for hits.
    #[inline(always)]
    fn t_min(&self, lane: usize) -> f64 {
        self.t_min[lane / I::F64::WIDTH].get(lane % I::F64::WIDTH)
    }

    /// Lets rays go on in a mesh one at a time; which of them took a hit.
    #[inline(always)]
    fn part_in_mesh<const ANY: bool>(
        &mut self,
        mesh: &MeshPacket<'s, I, F>,
        active: PacketMask<I>,
        singles: &mut Singles<'s, I, F>,
    ) -> PacketMask<I> {
        let mut left = active.bits();
        while let Some(lane) = take_bit(&mut left) {
            singles.start_in_mesh(lane, mesh, self.t_min(lane), self.best.get(lane));
        }
        self.collect::<ANY>(active, singles)
    }

    /// Takes what rays that went on one at a time have found; which of them took a hit.
    #[inline(always)]
    fn collect<const ANY: bool>(
        &mut self,
        active: PacketMask<I>,
        singles: &mut Singles<'s, I, F>,
    ) -> PacketMask<I> {
        singles.finish::<ANY>();
        let hit = self.best.replace(active.bits(), &singles.found);
        let hit = Mask::from_bits(hit);
        if ANY {
            self.alive = self.alive.and_not(hit);
        }
        hit
    }

    /// The rays in the space of a mesh, if the child of the level's tree is an instance of one.
    #[inline(always)]
    fn enter_mesh(&self, level: &Level<'s, I>, child: Child) -> Option<MeshPacket<'s, I, F>> {
        if !child.is_item() {
            return None;
        }
        let offset = child.number() as usize;
        let row = level.group.start + offset;
        let target = self.scene.target(row);
        let Target::Prototype(prototype) = target else {
            return None;
        };
        let Geometry::Mesh(mesh) = &prototype.geometry else {
            return None;
        };
        let entrance = self.scene.entrance(row, &target);
        let rays: Halves<LevelRays<I::F64>> =
            halves!(|h| entrance.enter_prototype(&level.rays[h], &prototype.space));
        Some(MeshPacket {
            mesh,
            leaf: level.first_leaf + level.group.leaves_before(offset),
            tree_rays: TreeRays::in_mesh(&rays, [&self.t_min, &self.best.t]),
            prepared: F::packet_rays::<I>(&rays, &self.t_min, &self.best.t),
            parameter: halves!(|h| rays[h].parameter),
        })
    }
}
