//! W coherent rays at a time, against one box, one instance, one triangle at a time.
use super::Nearest;
use super::columns::RayColumns;
use super::frustum::{Frustum, greatest, least};
use super::level::{Content, Target};
use super::precision::{Halves, PacketMask, Precision};
use crate::bvh::{Child, LARGEST_LEAF, NodeRay, WIDTH};
use crate::instance::LevelRays;
use crate::lanes::{Isa, Lanes, MAX_WIDTH, Mask, axes, halves};
use crate::scene::{Geometry, Group, InstanceBlock, Scene, TriangleBlock};

type F64Mask<I> = <<I as Isa>::F64 as Lanes>::Mask;

/// A node or leaf to be visited, and where each ray enters its box (NaN: it does not).
struct Entry<I: Isa> {
    near: I::F32,
    child: Child,
}

/// The rays in one space on their way down.
struct Level<'s, I: Isa, F: Precision> {
    rays: Halves<LevelRays<I::F64>>,
    content: Content<'s, F>,
    node_ray: NodeRay<I::F32>,
    /// Origins and directions in the tree's space.
    rounded: [[I::F32; 3]; 2],
    descending: [PacketMask<I>; 3],
    /// Row of the planes through which the rays enter boxes, by axis; None if they do not agree.
    entry_planes: Option<[usize; 3]>,
    /// The rays as one; `earliest` and `latest` bound their intervals.
    frustum: Frustum<I::F32UpTo8>,
    earliest: f32,
    latest: f32,
    /// The tree's parameter of world t is (t − start)·per_rate.
    start: Halves<I::F64>,
    per_rate: Halves<I::F64>,
    after: I::F32,
    before: I::F32,
    triangle_rays: Option<F::PacketRays<I>>,
    /// Rays that came in.
    active: PacketMask<I>,
    /// Entries below belong to the levels above.
    stack_base: usize,
}

impl<I: Isa, F: Precision> Level<'_, I, F> {
    #[inline(always)]
    fn to_tree(&self, t: &Halves<I::F64>) -> I::F32 {
        I::narrow(
            (t[0] - self.start[0]) * self.per_rate[0],
            (t[1] - self.start[1]) * self.per_rate[1],
        )
    }
}

#[inline(always)]
fn store_halves<I: Isa>(halves: &Halves<I::F64>) -> [f64; MAX_WIDTH] {
    let mut lanes = [0.0; MAX_WIDTH];
    halves[0].store(&mut lanes);
    halves[1].store(&mut lanes[I::F64::WIDTH..]);
    lanes
}

/// The nearest hits so far.
struct Best<I: Isa> {
    t: Halves<I::F64>,
    /// Leaf numbers, which are exact in f64.
    leaf: Halves<I::F64>,
    triangle: Halves<I::F64>,
}

impl<I: Isa> Best<I> {
    /// Takes the hits that are nearer, or as near and of a lower leaf or triangle; which these
    /// were.
    #[inline(always)]
    fn offer(
        &mut self,
        hit: PacketMask<I>,
        t: &Halves<I::F64>,
        leaf: i64,
        triangle: u32,
    ) -> PacketMask<I> {
        let hit = I::split(hit);
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
    above: Vec<Level<'s, I, F>>,
    stack: Vec<Entry<I>>,
    t_min: Halves<I::F64>,
    best: Best<I>,
    /// Rays that still look for something: with ANY, those that have not hit.
    alive: PacketMask<I>,
}

impl<'s, I: Isa, F: Precision> Packet<'s, I, F> {
    /// Rays of a packet.
    pub const WIDTH: usize = I::F32::WIDTH;

    pub fn new(scene: &'s Scene<F>) -> Self {
        let zero = [I::F64::zero(); 2];
        Packet {
            scene,
            above: Vec::new(),
            stack: Vec::new(),
            t_min: zero,
            best: Best {
                t: zero,
                leaf: zero,
                triangle: zero,
            },
            alive: Mask::none(),
        }
    }

    /// The nearest hits of valid rays; with ANY, whichever are found first.
    #[inline(always)]
    pub fn trace<const ANY: bool>(&mut self, rays: &RayColumns<I>, nearest: &mut [Nearest]) {
        assert!(nearest.len() == rays.len);
        self.stack.clear();
        self.above.clear();
        self.t_min = rays.t_min;
        self.best = Best {
            t: rays.t_max,
            leaf: [I::F64::splat(-1.0); 2],
            triangle: [I::F64::zero(); 2],
        };
        self.alive = Mask::first(rays.len);
        self.run::<ANY>(rays.level_rays());
        let t = store_halves::<I>(&self.best.t);
        let leaf = store_halves::<I>(&self.best.leaf);
        let triangle = store_halves::<I>(&self.best.triangle);
        for (lane, nearest) in nearest.iter_mut().enumerate() {
            *nearest = Nearest {
                t: t[lane],
                leaf: leaf[lane] as i64,
                triangle: triangle[lane] as u32,
            };
        }
    }

    #[inline(always)]
    fn run<const ANY: bool>(&mut self, world: Halves<LevelRays<I::F64>>) {
        let root = Content::Group(&self.scene.groups[0], 0);
        let mut level = self.enter(world, root, self.alive);
        loop {
            while self.stack.len() > level.stack_base {
                let Some(entry) = self.stack.pop() else { break };
                let active = entry.near.le(level.before) & level.active & self.alive;
                if !active.any() {
                    continue;
                }
                if entry.child.is_node() {
                    self.visit_node(&level, entry.child, active);
                    continue;
                }
                match level.content {
                    Content::Mesh(mesh, leaf) => {
                        let block = &mesh.blocks[entry.child.number() as usize];
                        self.visit_triangles::<ANY>(&mut level, block, leaf, active);
                    }
                    Content::Group(group, _) if !entry.child.is_item() => {
                        let block = &group.blocks[entry.child.number() as usize];
                        self.visit_block(&level, block, active);
                    }
                    Content::Group(group, first_leaf) => {
                        let offset = entry.child.number() as usize;
                        if let Some(inner) = self
                            .visit_instance::<ANY>(&mut level, group, first_leaf, offset, active)
                        {
                            self.above.push(std::mem::replace(&mut level, inner));
                        }
                    }
                }
                if ANY && !self.alive.any() {
                    return;
                }
            }
            let Some(outer) = self.above.pop() else {
                return;
            };
            level = outer;
            self.restrict(&mut level);
        }
    }

    /// Begins a level: its root and its unbounded instances are on the stack.
    #[inline(always)]
    fn enter(
        &mut self,
        rays: Halves<LevelRays<I::F64>>,
        content: Content<'s, F>,
        active: PacketMask<I>,
    ) -> Level<'s, I, F> {
        let space = content.space();
        let [(low, low_slide), (high, high_slide)] =
            [rays[0].in_space(&space), rays[1].in_space(&space)];
        let origin = axes!(|i| I::narrow(low[i], high[i]));
        let direction = axes!(|i| I::narrow(rays[0].direction[i], rays[1].direction[i]));
        let node_ray = NodeRay::new(origin, direction);
        let scale = I::F64::splat(space.scale);
        let descending = node_ray.descending();
        let agreed = axes!(|axis| {
            let bits = (descending[axis] & active).bits();
            if bits == 0 {
                Some(axis)
            } else if bits == active.bits() {
                Some(axis + 3)
            } else {
                None
            }
        });
        let mut level = Level {
            node_ray,
            rounded: [origin, direction],
            descending,
            entry_planes: match agreed {
                [Some(x), Some(y), Some(z)] => Some([x, y, z]),
                _ => None,
            },
            start: [
                (low_slide / scale).mul_add(rays[0].rate, rays[0].start),
                (high_slide / scale).mul_add(rays[1].rate, rays[1].start),
            ],
            per_rate: [rays[0].per_rate * scale, rays[1].per_rate * scale],
            rays,
            content,
            frustum: Frustum::new(origin, node_ray.inverse(), active),
            earliest: 0.0,
            latest: 0.0,
            after: I::F32::zero(),
            before: I::F32::zero(),
            triangle_rays: None,
            active,
            stack_base: self.stack.len(),
        };
        level.after = level.to_tree(&self.t_min);
        level.earliest = least(level.after, active);
        self.restrict(&mut level);
        let everywhere = I::F32::splat(f32::NEG_INFINITY);
        if !content.tree().nodes.is_empty() {
            self.stack.push(Entry {
                near: everywhere,
                child: Child::ROOT,
            });
        }
        for &offset in content.unbounded() {
            self.stack.push(Entry {
                near: everywhere,
                child: Child::item(offset),
            });
        }
        level
    }

    /// Draws in the far end of the rays to their nearest hits.
    #[inline(always)]
    fn restrict(&self, level: &mut Level<'s, I, F>) {
        level.before = level.to_tree(&self.best.t);
        level.latest = greatest(level.before, level.active & self.alive);
    }

    /// Pushes the children that any ray meets, the nearest on top.
    #[inline(always)]
    fn visit_node(&mut self, level: &Level<'s, I, F>, child: Child, active: PacketMask<I>) {
        type N<I> = <I as Isa>::F32UpTo8;
        let node = &level.content.tree().nodes[child.number() as usize];
        // Those that the packet as a whole meets, the farthest first; sorted by insertion, for
        // there seldom are more than three.
        let mut nears = [0.0; WIDTH];
        let mut order = [0usize; WIDTH];
        let mut count = 0;
        for first in (0..WIDTH).step_by(N::<I>::WIDTH) {
            let (mut met, near) = level
                .frustum
                .meets(node, first, level.earliest, level.latest);
            near.store(&mut nears[first..]);
            while met != 0 {
                let i = first + met.trailing_zeros() as usize;
                met &= met - 1;
                let mut j = count;
                while j > 0 && nears[order[j - 1]] < nears[i] {
                    order[j] = order[j - 1];
                    j -= 1;
                }
                order[j] = i;
                count += 1;
            }
        }
        let nowhere = I::F32::splat(f32::NAN);
        for &i in &order[..count] {
            let planes = &node.planes;
            let (entry, exit) = match level.entry_planes {
                Some(rows) => (
                    axes!(|axis| I::F32::splat(planes[rows[axis]][i])),
                    axes!(|axis| I::F32::splat(planes[2 * axis + 3 - rows[axis]][i])),
                ),
                None => {
                    let [lower, upper]: [[I::F32; 3]; 2] = [
                        axes!(|axis| I::F32::splat(planes[axis][i])),
                        axes!(|axis| I::F32::splat(planes[axis + 3][i])),
                    ];
                    let down = &level.descending;
                    (
                        axes!(|j| I::F32::select(down[j], upper[j], lower[j])),
                        axes!(|j| I::F32::select(down[j], lower[j], upper[j])),
                    )
                }
            };
            let (near, far) = level
                .node_ray
                .interval(entry, exit, level.after, level.before);
            let met = near.le(far) & active;
            if met.any() {
                let near = I::F32::select(met, near, nowhere);
                self.stack.push(Entry {
                    near,
                    child: node.children[i],
                });
            }
        }
    }

    /// Pushes the instances of a block that any ray may hit, the nearest on top.
    #[inline(always)]
    fn visit_block(
        &mut self,
        level: &Level<'s, I, F>,
        block: &InstanceBlock,
        active: PacketMask<I>,
    ) {
        let [o, d] = level.rounded;
        let nowhere = I::F32::splat(f32::NAN);
        let mut nears = [0.0; LARGEST_LEAF];
        let base = self.stack.len();
        for i in 0..block.len as usize {
            let (near, far) = block.interval_of(i, o, d);
            let met = near.le(far) & near.le(level.before) & level.after.le(far) & active;
            if !met.any() {
                continue;
            }
            let near = I::F32::select(met, near, nowhere);
            let first = near.horizontal_min();
            let child = Child::item(block.instances[i]);
            self.stack.push(Entry { near, child });
            let mut j = self.stack.len() - 1 - base;
            while j > 0 && nears[j - 1] < first {
                self.stack.swap(base + j, base + j - 1);
                nears[j] = nears[j - 1];
                j -= 1;
            }
            nears[j] = first;
        }
    }

    /// Tests a block of triangles.
    #[inline(always)]
    fn visit_triangles<const ANY: bool>(
        &mut self,
        level: &mut Level<'s, I, F>,
        block: &TriangleBlock<F>,
        leaf: i64,
        active: PacketMask<I>,
    ) {
        let rays = &level.rays;
        let prepared = match level.triangle_rays {
            Some(prepared) => prepared,
            None => *level.triangle_rays.insert(F::packet_rays::<I>(rays)),
        };
        let mut taken = PacketMask::<I>::none();
        let prepared = F::packet_within::<I>(prepared, rays, &self.t_min, &self.best.t);
        for lane in 0..block.len as usize {
            let (hit, t) = F::packet_triangle::<I>(&prepared, rays, block, lane, active);
            if hit.any() {
                let triangle = block.triangles[lane];
                taken = taken | self.best.offer(hit, &t, leaf, triangle);
            }
        }
        self.take::<ANY>(level, taken);
    }

    /// Enters an instance of a group: tests what it is of, or returns that as the level to go on
    /// with.
    #[inline(always)]
    fn visit_instance<const ANY: bool>(
        &mut self,
        level: &mut Level<'s, I, F>,
        group: &Group,
        first_leaf: i64,
        offset: usize,
        active: PacketMask<I>,
    ) -> Option<Level<'s, I, F>> {
        let row = group.start + offset;
        let target = self.scene.target(row);
        let entrance = self.scene.entrance(row, &target);
        let leaf = first_leaf + group.leaves_before(offset);
        let prototype = match target {
            Target::Prototype(prototype) => prototype,
            Target::Group(inner) => {
                let rays = halves!(|h| entrance.enter_group(&level.rays[h]));
                return Some(self.enter(rays, Content::Group(inner, leaf), active));
            }
        };
        let rays: Halves<LevelRays<I::F64>> =
            halves!(|h| entrance.enter_prototype(&level.rays[h], &prototype.space));
        match &prototype.geometry {
            Geometry::Mesh(mesh) => Some(self.enter(rays, Content::Mesh(mesh, leaf), active)),
            Geometry::Shape(shape) => {
                let (hit, t) =
                    F::packet_shape::<I>(shape, &rays, &self.t_min, &self.best.t, active);
                if hit.any() {
                    let taken = self.best.offer(hit, &t, leaf, 0);
                    self.take::<ANY>(level, taken);
                }
                None
            }
        }
    }

    /// Draws the consequences of new nearest hits.
    #[inline(always)]
    fn take<const ANY: bool>(&mut self, level: &mut Level<'s, I, F>, taken: PacketMask<I>) {
        if taken.any() {
            if ANY {
                self.alive = self.alive.and_not(taken);
            }
            self.restrict(level);
        }
    }
}
