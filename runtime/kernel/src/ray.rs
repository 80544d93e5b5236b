//! Rays, hits, and the one interface between who traces and who shades.
use crate::instance::dot;
use crate::lanes::{MAX_WIDTH, axes};
use std::ops::Range;

/// A half-line in world space. Directions are not normalised: `t` is in their units.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct Ray {
    /// Where t = 0.
    pub origin: [f64; 3],
    /// Any length; a zero or non-finite direction misses everything.
    pub direction: [f64; 3],
    /// Hits have t > t_min.
    pub t_min: f64,
    /// Hits have t < t_max.
    pub t_max: f64,
}

impl Ray {
    /// Rays as rows of numbers, in the order of the fields.
    #[inline(always)]
    pub fn as_rows(rays: &[Ray]) -> &[[f64; 8]] {
        // SAFETY: a ray is eight f64 in C's layout, and so is the row.
        unsafe { std::slice::from_raw_parts(rays.as_ptr().cast(), rays.len()) }
    }
}

/// Rays in one of the layouts in which callers have them.
#[derive(Clone, Copy, Debug)]
pub enum Rays<'a> {
    /// An array for each part: as many directions as origins, and as many bounds or one for all.
    Columns {
        /// [`Ray::origin`] of each.
        origins: &'a [[f64; 3]],
        /// [`Ray::direction`] of each.
        directions: &'a [[f64; 3]],
        /// [`Ray::t_min`] of each, or of all.
        t_min: &'a [f64],
        /// [`Ray::t_max`] of each, or of all.
        t_max: &'a [f64],
    },
    /// An array for each coordinate: of as many numbers as there are rays, or of one for all.
    Axes {
        /// How many rays there are.
        len: usize,
        /// [`Ray::origin`], by coordinate.
        origin: [&'a [f64]; 3],
        /// [`Ray::direction`], by coordinate.
        direction: [&'a [f64]; 3],
        /// [`Ray::t_min`].
        t_min: &'a [f64],
        /// [`Ray::t_max`].
        t_max: &'a [f64],
        /// The leaf that each leaves, and cannot meet again; −1 of none. Whoever asks whether
        /// anything is hit need not ask that one.
        left: &'a [f64],
    },
}

/// No ray leaves anything.
const NOTHING_LEFT: &[f64] = &[-1.0];

/// A stretch of numbers, which may be one for all.
#[inline(always)]
fn stretch(of: &[f64], range: Range<usize>) -> &[f64] {
    if of.len() == 1 { of } else { &of[range] }
}

/// Number `i`, or the one for all.
#[inline(always)]
fn number(of: &[f64], i: usize) -> f64 {
    if let [all] = of { *all } else { of[i] }
}

impl<'a> Rays<'a> {
    /// How many there are.
    #[inline(always)]
    pub fn len(&self) -> usize {
        match *self {
            Rays::Columns { origins, .. } => origins.len(),
            Rays::Axes { len, .. } => len,
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Ray number `i`.
    #[inline(always)]
    pub fn get(&self, i: usize) -> Ray {
        match *self {
            Rays::Columns {
                origins,
                directions,
                t_min,
                t_max,
            } => Ray {
                origin: origins[i],
                direction: directions[i],
                t_min: number(t_min, i),
                t_max: number(t_max, i),
            },
            Rays::Axes {
                origin,
                direction,
                t_min,
                t_max,
                ..
            } => Ray {
                origin: axes!(|axis| number(origin[axis], i)),
                direction: axes!(|axis| number(direction[axis], i)),
                t_min: number(t_min, i),
                t_max: number(t_max, i),
            },
        }
    }

    /// [`Ray::t_min`] of ray number `i`.
    #[inline(always)]
    pub fn t_min(&self, i: usize) -> f64 {
        let (Rays::Columns { t_min, .. } | Rays::Axes { t_min, .. }) = *self;
        number(t_min, i)
    }

    /// The leaves that rays leave for good: of each ray, or one for all.
    #[inline(always)]
    pub fn left(&self) -> &'a [f64] {
        match *self {
            Rays::Columns { .. } => NOTHING_LEFT,
            Rays::Axes { left, .. } => left,
        }
    }

    /// Some of the rays.
    pub fn part(&self, range: Range<usize>) -> Rays<'a> {
        match *self {
            Rays::Columns {
                origins,
                directions,
                t_min,
                t_max,
            } => Rays::Columns {
                origins: &origins[range.clone()],
                directions: &directions[range.clone()],
                t_min: stretch(t_min, range.clone()),
                t_max: stretch(t_max, range),
            },
            Rays::Axes {
                origin,
                direction,
                t_min,
                t_max,
                left,
                ..
            } => Rays::Axes {
                len: range.len(),
                origin: origin.map(|column| stretch(column, range.clone())),
                direction: direction.map(|column| stretch(column, range.clone())),
                t_min: stretch(t_min, range.clone()),
                t_max: stretch(t_max, range.clone()),
                left: stretch(left, range),
            },
        }
    }
}

/// The closest hit of a ray, or [`Hit::MISS`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct Hit {
    /// Ray parameter; infinite for a miss.
    pub t: f64,
    /// World-space point on the surface: reprojected in object space, then transformed.
    pub position: [f64; 3],
    /// World-space unit geometric normal, outward, not flipped towards the ray.
    pub normal: [f64; 3],
    /// A ray that leaves `position` starts this far along (or against) `normal`, so that it
    /// neither hits its own surface falsely nor leaks: an error bound, not a guess. See
    /// [`Hit::spawn`].
    pub offset: f64,
    /// Leaf number (see `compiler/ir.py`), or -1.
    pub instance: i64,
    /// Prototype, or -1.
    pub prototype: i32,
    /// Resolved material, or -1 for a miss.
    pub material: i32,
    /// Triangle of a mesh, else 0.
    pub primitive: u32,
}

impl Hit {
    /// Nothing was hit.
    pub const MISS: Hit = Hit {
        t: f64::INFINITY,
        position: [f64::NAN; 3],
        normal: [f64::NAN; 3],
        offset: 0.0,
        instance: -1,
        prototype: -1,
        material: -1,
        primitive: 0,
    };

    /// Where a ray that leaves the surface in a direction starts: off it to the side it goes to.
    #[inline(always)]
    pub fn spawn(&self, direction: [f64; 3]) -> [f64; 3] {
        let side = self.offset.copysign(dot(self.normal, direction));
        axes!(|i| side.mul_add(self.normal[i], self.position[i]))
    }
}

/// Hits, an array for each number; the arrays are longer than there are hits, by what lanes may
/// write beyond the last.
#[derive(Clone, Debug, Default)]
pub struct Hits {
    len: usize,
    /// [`Hit::t`] of each.
    pub t: Vec<f64>,
    /// [`Hit::position`], by coordinate.
    pub position: [Vec<f64>; 3],
    /// [`Hit::normal`], by coordinate.
    pub normal: [Vec<f64>; 3],
    /// [`Hit::offset`] of each.
    pub offset: Vec<f64>,
    /// [`Hit::instance`] of each.
    pub instance: Vec<i64>,
    /// [`Hit::prototype`] of each.
    pub prototype: Vec<i32>,
    /// [`Hit::material`] of each.
    pub material: Vec<i32>,
    /// [`Hit::primitive`] of each.
    pub primitive: Vec<u32>,
}

impl Hits {
    /// How many there are.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Makes them `len`; what they are is not said.
    pub fn resize(&mut self, len: usize) {
        self.len = len;
        let room = len + MAX_WIDTH;
        if self.t.len() >= room {
            return;
        }
        let miss = Hit::MISS;
        self.t.resize(room, miss.t);
        for axis in 0..3 {
            self.position[axis].resize(room, miss.position[axis]);
            self.normal[axis].resize(room, miss.normal[axis]);
        }
        self.offset.resize(room, miss.offset);
        self.instance.resize(room, miss.instance);
        self.prototype.resize(room, miss.prototype);
        self.material.resize(room, miss.material);
        self.primitive.resize(room, miss.primitive);
    }

    /// Hit number `i`.
    #[inline(always)]
    pub fn get(&self, i: usize) -> Hit {
        Hit {
            t: self.t[i],
            position: axes!(|axis| self.position[axis][i]),
            normal: axes!(|axis| self.normal[axis][i]),
            offset: self.offset[i],
            instance: self.instance[i],
            prototype: self.prototype[i],
            material: self.material[i],
            primitive: self.primitive[i],
        }
    }

    /// Replaces hit number `i`.
    pub fn set(&mut self, i: usize, hit: &Hit) {
        self.t[i] = hit.t;
        for axis in 0..3 {
            self.position[axis][i] = hit.position[axis];
            self.normal[axis][i] = hit.normal[axis];
        }
        self.offset[i] = hit.offset;
        self.instance[i] = hit.instance;
        self.prototype[i] = hit.prototype;
        self.material[i] = hit.material;
        self.primitive[i] = hit.primitive;
    }
}

/// The closest hit of a ray before anybody asks for the surface there, or [`Found::NOTHING`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// Ray parameter; infinite for a miss.
    pub t: f64,
    /// Leaf number, or -1.
    pub instance: i64,
    /// Triangle of a mesh, else 0.
    pub primitive: u32,
}

impl Found {
    /// Nothing was hit.
    pub const NOTHING: Found = Found {
        t: f64::INFINITY,
        instance: -1,
        primitive: 0,
    };
}

/// The parts of [`Found`], an array for each.
#[derive(Debug)]
pub struct FoundColumns<'a> {
    /// [`Found::t`] of each ray.
    pub t: &'a mut [f64],
    /// [`Found::instance`] of each ray.
    pub instance: &'a mut [i64],
    /// [`Found::primitive`] of each ray.
    pub primitive: &'a mut [u32],
}

/// The triangle of a mesh that a hit lies on.
#[derive(Clone, Copy, Debug)]
pub struct OnTriangle {
    /// Its corners, as points of the mesh.
    pub points: [usize; 3],
    /// How much of each corner the hit is: none negative, 1 in all.
    pub weights: [f64; 3],
    /// From the first corner to the second and to the third, in world space.
    pub edges: [[f64; 3]; 2],
    /// The linear map into the space of the mesh; its transpose brings normals out.
    pub object_from_world: [[f64; 3]; 3],
}

/// Whatever can answer batches of rays: scenes of either precision on any instruction set.
///
/// Batches of some hundreds of coherent rays are answered fastest. Answers do not depend on
/// how rays are batched. Ties in t go to the lowest leaf number.
pub trait Trace: Send + Sync {
    /// Closest hits, as many as rays.
    fn closest(&self, rays: Rays, hits: &mut Hits);
    /// Whether anything is hit. Panics if the lengths differ.
    fn occluded(&self, rays: Rays, occluded: &mut [bool]);
    /// Whether rays that leave hit number `i` outwards, or inwards, cannot meet its leaf again;
    /// false where that is not known.
    fn is_left_for_good(&self, _hits: &Hits, _i: usize, _outwards: bool) -> bool {
        false
    }
    /// The triangle that a hit lies on; None if it is not on a mesh.
    fn on_triangle(&self, _hit: &Hit) -> Option<OnTriangle> {
        None
    }
}

/// Whatever finds hits and the surfaces there apart, for those who may not need the surfaces.
pub trait Find: Trace {
    /// Closest hits. Panics if the lengths differ.
    fn find(&self, rays: Rays, found: FoundColumns);
    /// Whether anything is hit. Panics if the lengths differ.
    fn find_any(&self, rays: Rays, occluded: &mut [bool]);
    /// The surfaces where these rays were found to hit, of which t, instance and primitive are
    /// given: `closest` is `find` and then this. Instances or primitives that the scene does not
    /// have are misses. Panics if the lengths differ.
    fn surfaces(&self, rays: Rays, hits: &mut Hits);
}
