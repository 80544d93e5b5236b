//! W rays at the root of a scene, before they go on one at a time.
//!
//! What every ray has to do is done for W of them at once: they are brought into the space of the
//! root's tree and tested with the boxes of its first node. Many meet none and are done; one that
//! goes on finds its numbers here, the same to the last bit as if it had come alone.
use super::bundle::SHARED;
use super::columns::RayColumns;
use super::precision::Halves;
use super::single::TreeRay;
use super::stack::Stack;
use super::tree_rays::TreeRays;
use crate::bvh::{Node, NodeRay, WIDTH};
use crate::instance::{LevelRays, Parameter};
use crate::lanes::{Isa, Lanes, MAX_WIDTH, Mask, axes};
use crate::scene::Group;

/// A number of each ray.
type Column<T> = [T; MAX_WIDTH];

/// The rays, a column for each of their numbers.
#[derive(Default)]
pub struct Roots {
    t_min: Column<f64>,
    t_max: Column<f64>,
    left: Column<f64>,
    /// Of [`LevelRays`]; none was slid before the root.
    origin: [Column<f64>; 3],
    direction: [Column<f64>; 3],
    rate: Column<f64>,
    per_rate: Column<f64>,
    /// Of [`TreeRay`].
    tree_origin: [Column<f32>; 3],
    tree_direction: [Column<f32>; 3],
    tree_start: Column<f64>,
    tree_per_rate: Column<f64>,
    after: Column<f32>,
    before: Column<f32>,
    /// Where rays enter the boxes of the root's children.
    near: [Column<f32>; WIDTH],
    /// Which rays meet these, as bits, and can hit anything at all.
    pub met: [u32; WIDTH],
}

#[inline(always)]
fn keep<I: Isa>(column: &mut Column<f64>, halves: Halves<I::F64>) {
    halves[0].store(column);
    halves[1].store(&mut column[I::F64::WIDTH..]);
}

impl Roots {
    /// Takes rays to the root of a scene.
    #[inline(always)]
    pub fn take<I: Isa>(&mut self, rays: &RayColumns<I>, root: &Group) {
        let tree =
            TreeRays::<I>::in_group(&rays.level, &root.tree.space, [&rays.t_min, &rays.t_max]);
        self.met = match root.tree.nodes.first() {
            Some(node) => {
                let valid = rays.valid().bits();
                self.test::<I>(node, &tree).map(|met| met & valid)
            }
            None => [0; WIDTH],
        };
        keep::<I>(&mut self.t_min, rays.t_min);
        keep::<I>(&mut self.t_max, rays.t_max);
        keep::<I>(&mut self.left, rays.left);
        let [low, high] = &rays.level;
        for i in 0..3 {
            keep::<I>(&mut self.origin[i], [low.origin[i], high.origin[i]]);
            keep::<I>(
                &mut self.direction[i],
                [low.direction[i], high.direction[i]],
            );
            tree.origin[i].store(&mut self.tree_origin[i]);
            tree.direction[i].store(&mut self.tree_direction[i]);
        }
        keep::<I>(&mut self.rate, [low.parameter.rate, high.parameter.rate]);
        keep::<I>(
            &mut self.per_rate,
            [low.parameter.per_rate, high.parameter.per_rate],
        );
        keep::<I>(&mut self.tree_start, tree.start);
        keep::<I>(&mut self.tree_per_rate, tree.per_rate);
        tree.after.store(&mut self.after);
        tree.before.store(&mut self.before);
    }

    /// Which rays meet the boxes of a node, as bits; where they enter them is kept.
    #[inline(always)]
    fn test<I: Isa>(&mut self, node: &Node, rays: &TreeRays<I>) -> [u32; WIDTH] {
        let down = rays.node_ray.descending();
        let mut met = [0; WIDTH];
        for (child, (met, entry)) in met.iter_mut().zip(&mut self.near).enumerate() {
            let lower = axes!(|i| I::F32::splat(node.planes[i][child]));
            let upper = axes!(|i| I::F32::splat(node.planes[i + 3][child]));
            let (near, far) = rays.node_ray.interval(
                axes!(|i| I::F32::select(down[i], upper[i], lower[i])),
                axes!(|i| I::F32::select(down[i], lower[i], upper[i])),
                rays.after,
                rays.before,
            );
            *met = near.le(far).bits();
            near.store(entry);
        }
        met
    }

    /// Passes over these children of the root, given as bits.
    #[inline(always)]
    pub fn pass(&mut self, children: u32) {
        for (i, met) in self.met.iter_mut().enumerate() {
            if children >> i & 1 != 0 {
                *met = 0;
            }
        }
    }

    /// Whether the rays meet few children of the root for their number.
    #[inline(always)]
    pub fn rays_share(&self) -> bool {
        let (mut rays, mut children) = (0, 0);
        for met in self.met {
            rays += met.count_ones();
            children += u32::from(met != 0);
        }
        children > 0 && rays >= SHARED * children
    }

    /// Rays that meet anything, as bits.
    #[inline(always)]
    pub fn waiting(&self) -> u32 {
        self.met.iter().fold(0, |all, met| all | met)
    }

    /// The bounds of a ray.
    #[inline(always)]
    pub fn interval(&self, ray: usize) -> [f64; 2] {
        [self.t_min[ray], self.t_max[ray]]
    }

    /// The leaf that a ray leaves for good, or −1.
    #[inline(always)]
    pub fn left(&self, ray: usize) -> i64 {
        self.left[ray] as i64
    }

    /// Pushes the root's children that a ray meets.
    #[inline(always)]
    pub fn push_met<const ANY: bool>(&self, ray: usize, root: &Group, stack: &mut Stack) {
        let mut met = 0;
        for (child, rays) in self.met.iter().enumerate() {
            met |= (rays >> ray & 1) << child;
        }
        if met != 0 {
            let children = &root.tree.nodes[0].children;
            let near = |child: usize| self.near[child][ray];
            if let Some(nearest) = stack.nearest::<ANY>(met, near, children, |_| ()) {
                stack.push(nearest);
            }
        }
    }

    /// A ray in the space of the root, and in that of its tree.
    #[inline(always)]
    pub fn ray(&self, ray: usize) -> (LevelRays<f64>, TreeRay) {
        let level = LevelRays {
            origin: axes!(|i| self.origin[i][ray]),
            direction: axes!(|i| self.direction[i][ray]),
            parameter: Parameter {
                start: 0.0,
                rate: self.rate[ray],
                per_rate: self.per_rate[ray],
            },
        };
        let origin = axes!(|i| self.tree_origin[i][ray]);
        let direction = axes!(|i| self.tree_direction[i][ray]);
        let tree_ray = TreeRay {
            origin,
            direction,
            node_ray: NodeRay::new(origin, direction),
            start: self.tree_start[ray],
            per_rate: self.tree_per_rate[ray],
            after: self.after[ray],
            before: self.before[ray],
        };
        (level, tree_ray)
    }
}
