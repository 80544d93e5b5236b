//! Rays, hits, and the one interface between who traces and who shades.
use crate::instance::dot;
use crate::lanes::axes;

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

/// Whatever can answer batches of rays: scenes of either precision on any instruction set.
///
/// Batches of some hundreds of coherent rays are answered fastest. Answers do not depend on
/// how rays are batched. Ties in t go to the lowest leaf number.
pub trait Trace: Send + Sync {
    /// Closest hits: `hits[i]` for `rays[i]`. Panics if the lengths differ.
    fn closest(&self, rays: &[Ray], hits: &mut [Hit]);
    /// Whether anything is hit.
    fn occluded(&self, rays: &[Ray], occluded: &mut [bool]);
}

/// Whatever finds hits and the surfaces there apart, for those who may not need the surfaces.
pub trait Find: Trace {
    /// Closest hits: `found[i]` for `rays[i]`. Panics if the lengths differ.
    fn find(&self, rays: &[Ray], found: &mut [Found]);
    /// The surfaces where these rays were found to hit: `closest` is `find` and then this.
    /// Instances or primitives that the scene does not have are misses.
    fn surfaces(&self, rays: &[Ray], found: &[Found], hits: &mut [Hit]);
}
