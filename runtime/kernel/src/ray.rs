//! Rays, hits, and the one interface between who traces and who shades.
use crate::instance::dot;
use crate::lanes::axes;
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
    /// One after the other.
    Records(&'a [Ray]),
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
}

/// A stretch of the bounds of rays, which may be one for all.
#[inline(always)]
fn bounds(of: &[f64], range: Range<usize>) -> &[f64] {
    if of.len() == 1 { of } else { &of[range] }
}

impl<'a> Rays<'a> {
    /// How many there are.
    #[inline(always)]
    pub fn len(&self) -> usize {
        match self {
            Rays::Records(rays) => rays.len(),
            Rays::Columns { origins, .. } => origins.len(),
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
            Rays::Records(rays) => rays[i],
            Rays::Columns {
                origins,
                directions,
                t_min,
                t_max,
            } => Ray {
                origin: origins[i],
                direction: directions[i],
                t_min: bounds(t_min, i..i + 1)[0],
                t_max: bounds(t_max, i..i + 1)[0],
            },
        }
    }

    /// [`Ray::t_min`] of ray number `i`.
    #[inline(always)]
    pub fn t_min(&self, i: usize) -> f64 {
        match *self {
            Rays::Records(rays) => rays[i].t_min,
            Rays::Columns { t_min, .. } => bounds(t_min, i..i + 1)[0],
        }
    }

    /// Some of the rays.
    pub fn part(&self, range: Range<usize>) -> Rays<'a> {
        match *self {
            Rays::Records(rays) => Rays::Records(&rays[range]),
            Rays::Columns {
                origins,
                directions,
                t_min,
                t_max,
            } => Rays::Columns {
                origins: &origins[range.clone()],
                directions: &directions[range.clone()],
                t_min: bounds(t_min, range.clone()),
                t_max: bounds(t_max, range),
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
    /// Closest hits: `hits[i]` for `rays[i]`. Panics if the lengths differ.
    fn closest(&self, rays: &[Ray], hits: &mut [Hit]);
    /// Whether anything is hit.
    fn occluded(&self, rays: &[Ray], occluded: &mut [bool]);
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
    /// The surfaces where these rays were found to hit: `closest` is `find` and then this.
    /// Instances or primitives that the scene does not have are misses.
    fn surfaces(&self, rays: &[Ray], found: &[Found], hits: &mut [Hit]);
}
