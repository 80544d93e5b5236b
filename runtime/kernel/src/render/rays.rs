//! The rays of a tile, by coordinate.
use crate::lanes::MAX_WIDTH;
use crate::ray::{Ray, Rays};

/// Rays, an array for each number; the arrays are longer than there are rays, by what lanes may
/// write beyond the last.
#[derive(Default)]
pub struct RayLists {
    len: usize,
    /// [`Ray::origin`], by coordinate.
    pub origin: [Vec<f64>; 3],
    /// [`Ray::direction`], by coordinate.
    pub direction: [Vec<f64>; 3],
    /// [`Ray::t_min`] of each.
    pub t_min: Vec<f64>,
    /// [`Ray::t_max`] of each.
    pub t_max: Vec<f64>,
    /// The leaf that each leaves for good, or −1; empty if none does. See [`Rays::Axes`].
    pub left: Vec<f64>,
}

/// Makes room in columns for so many numbers and what lanes write beyond them.
pub fn make_room(columns: &mut [Vec<f64>], len: usize) {
    for column in columns {
        column.resize(len + MAX_WIDTH, 0.0);
    }
}

impl RayLists {
    /// How many there are.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there is none.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Makes them `len`; what they are is not said.
    pub fn resize(&mut self, len: usize) {
        self.len = len;
        make_room(&mut self.origin, len);
        make_room(&mut self.direction, len);
        make_room(std::slice::from_mut(&mut self.t_min), len);
        make_room(std::slice::from_mut(&mut self.t_max), len);
    }

    /// Leaves the first `len`.
    #[inline(always)]
    pub fn truncate(&mut self, len: usize) {
        self.len = len;
    }

    /// All of them.
    #[inline(always)]
    pub fn as_rays(&self) -> Rays<'_> {
        let [x, y, z] = &self.origin;
        let [u, v, w] = &self.direction;
        Rays::Axes {
            len: self.len,
            origin: [x, y, z],
            direction: [u, v, w],
            t_min: &self.t_min,
            t_max: &self.t_max,
            left: if self.left.is_empty() {
                &[-1.0]
            } else {
                &self.left
            },
        }
    }

    /// Ray number `i`.
    #[inline(always)]
    pub fn get(&self, i: usize) -> Ray {
        self.as_rays().get(i)
    }

    /// Replaces ray number `i`.
    #[inline(always)]
    pub fn set(&mut self, i: usize, ray: &Ray) {
        for axis in 0..3 {
            self.origin[axis][i] = ray.origin[axis];
            self.direction[axis][i] = ray.direction[axis];
        }
        self.t_min[i] = ray.t_min;
        self.t_max[i] = ray.t_max;
    }
}
