//! Rays of a batch one at a time, but for meshes, where they take turns.
use super::Nearest;
use super::mesh_ray::{MeshPacket, Next};
use super::precision::Precision;
use super::roots::Roots;
use super::single::{Level, Single};
use crate::bvh::Child;
use crate::lanes::{Isa, Lanes, MAX_WIDTH, Task, take_bit};
use crate::scene::Scene;

/// Room for W rays on their way.
pub(super) struct Singles<'s, I: Isa, F: Precision> {
    pub roots: Roots,
    /// One for each lane; only one where none ever has to wait for its turn.
    rays: Vec<Single<'s, I, F>>,
    queues: Queues,
    /// What was found, by lane.
    pub found: [Nearest; MAX_WIDTH],
}

/// The lanes of rays in meshes, as bits, by where they are.
///
/// Bits, because memory written at a place that is known late holds up all that is read after it.
#[derive(Clone, Copy, Default)]
struct Queues {
    nodes: u32,
    blocks: u32,
    ends: u32,
}

impl Queues {
    /// Puts a lane, which is not in it, into the right one.
    #[inline(always)]
    fn push(&mut self, lane: usize, next: Next) {
        match next {
            Next::Done => self.ends |= 1 << lane,
            Next::Visit { is_block } => {
                self.nodes |= u32::from(!is_block) << lane;
                self.blocks |= u32::from(is_block) << lane;
            }
        }
    }
}

/// Lets the rays in meshes take turns until one or several have come to the end of theirs. In a
/// function of its own, which has the registers for it.
struct Turns<'a, 's, I: Isa, F: Precision, const ANY: bool> {
    rays: &'a mut [Single<'s, I, F>],
    queues: &'a mut Queues,
}

impl<I: Isa, F: Precision, const ANY: bool> Task for Turns<'_, '_, I, F, ANY> {
    type Output = ();

    #[inline(always)]
    fn run<J: Isa>(self) {
        let Turns { rays, queues: kept } = self;
        let mut queues = *kept;
        while queues.ends == 0 {
            let mut nodes = std::mem::take(&mut queues.nodes);
            while let Some(lane) = take_bit(&mut nodes) {
                let next = rays[lane].mesh_ray.visit_node::<J>();
                queues.push(lane, next);
            }
            let mut blocks = std::mem::take(&mut queues.blocks);
            while let Some(lane) = take_bit(&mut blocks) {
                let ray = &mut rays[lane];
                let next = (ray.mesh_ray).visit_block::<J, ANY>(&mut ray.nearest, ray.t_min);
                queues.push(lane, next);
            }
        }
        *kept = queues;
    }
}

/// Takes a ray into its next mesh.
struct Advance<'a, 's, I: Isa, F: Precision, const ANY: bool>(&'a mut Single<'s, I, F>);

impl<I: Isa, F: Precision, const ANY: bool> Task for Advance<'_, '_, I, F, ANY> {
    type Output = Next;

    #[inline(always)]
    fn run<J: Isa>(self) -> Next {
        self.0.advance::<ANY>()
    }
}

impl<'s, I: Isa, F: Precision> Singles<'s, I, F> {
    pub fn new(scene: &'s Scene<F>) -> Self {
        let room = if scene.has_meshes() { I::F32::WIDTH } else { 1 };
        Singles {
            roots: Roots::default(),
            rays: (0..room).map(|_| Single::new(scene)).collect(),
            queues: Queues::default(),
            found: [Nearest::none(0.0); MAX_WIDTH],
        }
    }

    /// Starts a ray that is at the root, with the hit that it has already, if any.
    #[inline(always)]
    pub fn start<const ANY: bool>(&mut self, lane: usize, nearest: Nearest) {
        let place = lane % self.rays.len();
        self.rays[place].begin::<ANY>(&self.roots, lane, nearest);
        self.advance::<ANY>(place, lane);
    }

    /// Starts a ray that has come to a level some other way: for what it meets below `child` of
    /// the group's tree, and nearer than the hit that it has, if any.
    #[inline(always)]
    pub fn start_at<const ANY: bool>(
        &mut self,
        lane: usize,
        level: Level<'s>,
        child: Child,
        t_min: f64,
        left: i64,
        nearest: Nearest,
    ) {
        let place = lane % self.rays.len();
        self.rays[place].begin_at(level, child, t_min, left, nearest);
        self.advance::<ANY>(place, lane);
    }

    /// Starts a ray that has come to a mesh.
    #[inline(always)]
    pub fn start_in_mesh(
        &mut self,
        lane: usize,
        packet: &MeshPacket<'s, I, F>,
        t_min: f64,
        nearest: Nearest,
    ) {
        let ray = &mut self.rays[lane];
        ray.begin_in_mesh(t_min, nearest);
        ray.mesh_ray.enter_from(packet, lane);
        self.found[lane] = nearest;
        match ray.mesh_ray.visit_root::<I>() {
            Next::Done => {}
            next => self.queues.push(lane, next),
        }
    }

    /// Finds the nearest hits of all that were started; with ANY, whichever come first.
    #[inline(always)]
    pub fn finish<const ANY: bool>(&mut self) {
        while self.queues.nodes | self.queues.blocks != 0 {
            I::call(Turns::<_, _, ANY> {
                rays: &mut self.rays,
                queues: &mut self.queues,
            });
            let mut ends = std::mem::take(&mut self.queues.ends);
            while let Some(lane) = take_bit(&mut ends) {
                self.rays[lane].leave_mesh::<ANY>();
                self.advance::<ANY>(lane, lane);
            }
        }
    }

    #[inline(always)]
    fn advance<const ANY: bool>(&mut self, place: usize, lane: usize) {
        let ray = &mut self.rays[place];
        match I::call(Advance::<_, _, ANY>(ray)) {
            Next::Done => self.found[lane] = ray.nearest,
            next => self.queues.push(lane, next),
        }
    }
}
