//! The analytic shapes: prepared once, intersected W rays at a time.
//!
//! A [`Shape`] is traced in a space of its own, where it has about unit size ([`Frame`]). Bring a
//! ray of object space there by
//!
//! - o ↦ `frame.shape_from_object(o)`, after sliding o along the ray to near the shape, in f64;
//! - d ↦ d·scale·2^k, with k such that the largest component is in [1, 2): then t of shape space is t·2^-k,
//!   counted from where o was slid to;
//!
//! and round to the scalar last. Only [`Shape::bounds`] speaks of object space.
use crate::lanes::{Isa, Lanes, Task};
use crate::scalar::Scalar;

mod angle;
mod cell_walk;
mod dilation;
mod dop;
mod frame;
mod kind;
mod parameters;
mod ray_bevelled_box;
mod ray_bevelled_cone;
mod ray_bevelled_cylinder;
mod ray_bevelled_ring;
mod ray_bevelled_wedge;
mod ray_box;
mod ray_cone;
mod ray_cylinder;
mod ray_disc;
mod ray_lanes;
mod ray_plane;
mod ray_rectangle;
mod ray_ring;
mod ray_sphere;
mod ray_torus;
mod ray_triangle;
mod ray_wedge;
mod sector;
#[cfg(test)]
mod signed_distance;
#[cfg(test)]
mod tests;

pub use frame::Frame;
pub use kind::ShapeKind;
pub use ray_lanes::RayLanes;
pub use ray_triangle::{TriangleRays, TurnedRays, surface as triangle_surface, turned};

use parameters::{around_axis, bounds, is_valid};
use ray_bevelled_box::BevelledBox;
use ray_bevelled_cone::BevelledCone;
use ray_bevelled_cylinder::BevelledCylinder;
use ray_bevelled_ring::BevelledRing;
use ray_bevelled_wedge::BevelledWedge;
use ray_box::Cuboid;
use ray_cone::Cone;
use ray_cylinder::Cylinder;
use ray_disc::Disc;
use ray_lanes::Intersect;
use ray_rectangle::Rectangle;
use ray_ring::Ring;
use ray_sphere::Sphere;
use ray_torus::Torus;
use ray_triangle::Triangle;
use ray_wedge::Wedge;

/// An analytic shape, ready to be intersected in precision `F`.
#[derive(Clone, Debug)]
pub struct Shape<F> {
    frame: Frame,
    bounds: Option<[[f64; 3]; 2]>,
    traced: Solid<F>,
    exact: Solid<f64>,
}

/// What a shape is in shape space, with parameters rounded once. Solids without a bevel know
/// nothing of bevels.
#[derive(Clone, Debug)]
enum Solid<F> {
    Sphere(Sphere<F>),
    Cuboid(Cuboid<F>),
    Cylinder(Cylinder<F>),
    Disc(Disc<F>),
    Rectangle(Rectangle<F>),
    Plane,
    Triangle(Triangle<F>),
    Cone(Cone<F>),
    Torus(Torus<F>),
    Ring(Ring<F>),
    Wedge(Wedge<F>),
    BevelledBox(Box<BevelledBox<F>>),
    BevelledCylinder(Box<BevelledCylinder<F>>),
    BevelledCone(Box<BevelledCone<F>>),
    BevelledRing(Box<BevelledRing<F>>),
    BevelledWedge(Box<BevelledWedge<F>>),
}

impl<F: Scalar> Shape<F> {
    /// Prepares a shape; `parameters` as in `dsl.scene.SHAPE_PARAMETERS`.
    ///
    /// The compiler has checked them and told its user; this is the last wall: an error for the
    /// wrong number of parameters, for such as are not finite, and for sizes that make no solid.
    pub fn new(kind: ShapeKind, parameters: &[f64]) -> Result<Self, String> {
        if parameters.len() != kind.parameter_count() {
            return Err(format!(
                "{kind:?} has {} parameters, not {}",
                kind.parameter_count(),
                parameters.len()
            ));
        }
        if !parameters.iter().all(|x| x.is_finite()) {
            return Err(format!(
                "{kind:?} with parameters that are not finite: {parameters:?}"
            ));
        }
        let invalid = || format!("{kind:?} with invalid parameters: {parameters:?}");
        if !is_valid(kind, parameters) {
            return Err(invalid());
        }
        let bounds = bounds(kind, parameters);
        let frame = match bounds {
            Some(bounds) => Frame::new(around_axis(kind, bounds)).ok_or_else(invalid)?,
            None => Frame::IDENTITY,
        };
        // A bevel that is lost in rounding is no bevel.
        let least_bevel = 16.0 * F::EPS.to_f64();
        Ok(Shape {
            frame,
            bounds,
            traced: Solid::new(kind, parameters, &frame, least_bevel),
            exact: Solid::new(kind, parameters, &frame, least_bevel),
        })
    }

    /// The space that `intersect` and `surface` work in.
    #[inline(always)]
    pub fn frame(&self) -> &Frame {
        &self.frame
    }

    /// The least box in object space, up to rounding; `None` for a plane.
    pub fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        self.bounds
    }

    /// Whether intersecting one ray takes longer than bringing it here does.
    pub fn is_dear(&self) -> bool {
        matches!(
            self.traced,
            Solid::Cone(_)
                | Solid::Torus(_)
                | Solid::Ring(_)
                | Solid::Wedge(_)
                | Solid::BevelledBox(_)
                | Solid::BevelledCylinder(_)
                | Solid::BevelledCone(_)
                | Solid::BevelledRing(_)
                | Solid::BevelledWedge(_)
        )
    }

    /// Whether all of it lies behind each of its tangent planes.
    pub fn is_convex(&self) -> bool {
        match self.exact {
            Solid::Sphere(_)
            | Solid::Cuboid(_)
            | Solid::Cylinder(_)
            | Solid::Disc(_)
            | Solid::Rectangle(_)
            | Solid::Plane
            | Solid::Triangle(_)
            | Solid::Cone(_)
            | Solid::BevelledBox(_)
            | Solid::BevelledCylinder(_)
            | Solid::BevelledCone(_) => true,
            Solid::Torus(_)
            | Solid::Ring(_)
            | Solid::Wedge(_)
            | Solid::BevelledRing(_)
            | Solid::BevelledWedge(_) => false,
        }
    }

    /// Whether all of it lies in one plane.
    pub fn is_flat(&self) -> bool {
        matches!(
            self.exact,
            Solid::Disc(_) | Solid::Rectangle(_) | Solid::Plane | Solid::Triangle(_)
        )
    }

    /// For each active lane whether it hits with t_min < t < t_max, and the least such t; a ray
    /// that starts inside hits where it leaves. The ray is in shape space. t means nothing in the
    /// other lanes.
    #[inline(always)]
    pub fn intersect<I: Isa, L: Lanes<Scalar = F>>(
        &self,
        ray: &RayLanes<L>,
        active: L::Mask,
    ) -> (L::Mask, L) {
        match &self.traced {
            Solid::Sphere(shape) => shape.intersect(ray, active),
            Solid::Cuboid(shape) => shape.intersect(ray, active),
            Solid::Cylinder(shape) => shape.intersect(ray, active),
            Solid::Disc(shape) => shape.intersect(ray, active),
            Solid::Rectangle(shape) => shape.intersect(ray, active),
            Solid::Plane => ray_plane::intersect(ray, active),
            Solid::Triangle(shape) => shape.intersect(ray, active),
            Solid::Cone(shape) => apart::<I, F, L>(shape, ray, active),
            Solid::Torus(shape) => apart::<I, F, L>(shape, ray, active),
            Solid::Ring(shape) => apart::<I, F, L>(shape, ray, active),
            Solid::Wedge(shape) => apart::<I, F, L>(shape, ray, active),
            Solid::BevelledBox(shape) => apart::<I, F, L>(&**shape, ray, active),
            Solid::BevelledCylinder(shape) => apart::<I, F, L>(&**shape, ray, active),
            Solid::BevelledCone(shape) => apart::<I, F, L>(&**shape, ray, active),
            Solid::BevelledRing(shape) => apart::<I, F, L>(&**shape, ray, active),
            Solid::BevelledWedge(shape) => apart::<I, F, L>(&**shape, ray, active),
        }
    }

    /// The point of the surface nearest to `p` (which is on it but for rounding) that keeps `room`
    /// from the edges of its face, and the unit outward normal there; all in shape space.
    ///
    /// Next to an edge the point lies beyond it if the ray was there `before`.
    #[inline(always)]
    pub fn surface<L: Lanes<Scalar = f64>>(
        &self,
        p: [L; 3],
        before: [L; 3],
        room: L,
    ) -> ([L; 3], [L; 3]) {
        match &self.exact {
            Solid::Sphere(shape) => shape.surface(p),
            Solid::Cuboid(shape) => shape.surface(p, before, room),
            Solid::Cylinder(shape) => shape.surface(p, before, room),
            Solid::Disc(shape) => shape.surface(p),
            Solid::Rectangle(shape) => shape.surface(p),
            Solid::Plane => ray_plane::surface(p),
            Solid::Triangle(shape) => shape.surface(p),
            Solid::Cone(shape) => shape.surface(p, before, room),
            Solid::Torus(shape) => shape.surface(p),
            Solid::Ring(shape) => shape.surface(p, before, room),
            Solid::Wedge(shape) => shape.surface(p, before, room),
            Solid::BevelledBox(shape) => shape.surface(p),
            Solid::BevelledCylinder(shape) => shape.surface(p),
            Solid::BevelledCone(shape) => shape.surface(p),
            Solid::BevelledRing(shape) => shape.surface(p),
            Solid::BevelledWedge(shape) => shape.surface(p),
        }
    }
}

/// Intersects in a function of its own, compiled for the set: callers stay small.
#[inline(always)]
fn apart<I: Isa, F: Scalar, L: Lanes<Scalar = F>>(
    shape: &impl Intersect<F>,
    ray: &RayLanes<L>,
    active: L::Mask,
) -> (L::Mask, L) {
    struct Apart<'a, S, L: Lanes> {
        shape: &'a S,
        ray: &'a RayLanes<L>,
        active: L::Mask,
    }
    impl<S: Intersect<L::Scalar>, L: Lanes> Task for Apart<'_, S, L> {
        type Output = (L::Mask, L);
        #[inline(always)]
        fn run<I: Isa>(self) -> (L::Mask, L) {
            self.shape.intersect(self.ray, self.active)
        }
    }
    I::call(Apart { shape, ray, active })
}
