//! Which rays that leave a surface cannot meet its object again.
//!
//! A ray leaves a face with outward normal n at a point that lies c or more above the plane of the
//! face, see `trace::surface`. If nothing of the object reaches that high, n·p ≤ n·a + c for all its
//! points p and any point a of the face, the ray does not meet it whichever way it goes upwards.
//! Most objects that scenes have many of are convex, at least from outside: their faces all are
//! such, and three of four rays that surfaces send out need not ask the object they come from.
use super::mesh::{BLOCK, Mesh};
use super::{Geometry, Prototype};
use crate::bvh::{Child, WIDTH};
use crate::scalar::Scalar;
use std::sync::atomic::{AtomicU8, Ordering};

/// How far above the plane of its face a ray starts at least, in ε_F of normalised space: half of
/// what `trace::surface` lets it start, which bears the rounding of triangles and of the start.
const CLEARANCE: f64 = 16.0;

/// What boxes and their heights are rounded by, in normalised space: 8 ε of f32 at most.
const BOX_ERROR: f32 = 1.0 / (1 << 20) as f32;

/// Nodes that are looked at for one side of a triangle. A convex mesh of 20 000 needs some fifty, and
/// more in proportion to the root of their number: so many boxes reach above one of its planes.
const MOST_NODES: usize = 128;

/// Triangles of a mesh that is looked at: beyond, most would take more nodes than that.
const MOST_TRIANGLES: usize = 1 << 17;

/// What is known of a triangle, bits of its front and of its back: anything; and that it is clear.
const KNOWN: [u8; 2] = [1, 2];
const CLEAR: [u8; 2] = [4, 8];

impl<F: Scalar> Prototype<F> {
    /// Whether rays that leave a surface outwards, or inwards, cannot meet the object again;
    /// false where that is not known.
    pub fn is_left_for_good(&self, triangle: u32, outwards: bool) -> bool {
        match &self.geometry {
            Geometry::Shape(shape) => outwards && shape.is_convex() || shape.is_flat(),
            Geometry::Mesh(mesh) => mesh.is_clear(triangle, outwards),
        }
    }
}

impl<F: Scalar> Mesh<F> {
    /// Whether nothing of the mesh reaches above the front of a triangle, or its back. Found out
    /// when it is first asked for.
    fn is_clear(&self, triangle: u32, front: bool) -> bool {
        if self.triangle_count > MOST_TRIANGLES {
            return false;
        }
        let unknown = || AtomicU8::new(0);
        let sides = (self.sides).get_or_init(|| {
            std::iter::repeat_with(unknown)
                .take(self.triangle_count)
                .collect()
        });
        let Some(sides) = sides.get(triangle as usize) else {
            return false;
        };
        let side = usize::from(!front);
        let known = sides.load(Ordering::Relaxed);
        if known & KNOWN[side] != 0 {
            return known & CLEAR[side] != 0;
        }
        let clear = self.finds_clear(triangle, front);
        let found = KNOWN[side] | if clear { CLEAR[side] } else { 0 };
        sides.fetch_or(found, Ordering::Relaxed);
        clear
    }

    fn finds_clear(&self, triangle: u32, front: bool) -> bool {
        let corners = self.corners(triangle);
        let [a, b, c] = corners.map(|p| self.tree.space.to_normal(p));
        let [u, v] = [b, c].map(|p| [p[0] - a[0], p[1] - a[1], p[2] - a[2]]);
        let normal = [
            u[1] * v[2] - u[2] * v[1],
            u[2] * v[0] - u[0] * v[2],
            u[0] * v[1] - u[1] * v[0],
        ];
        let length = along(normal, normal).sqrt();
        let unit = if front { length } else { -length };
        let normal = normal.map(|x| x / unit);
        let [a, b, c] = [a, b, c].map(|p| along(normal, p));
        let height = a.max(b).max(c) + CLEARANCE * F::EPS.to_f64();
        // A triangle without area has no normal, and nothing is known of it.
        length > 0.0 && !self.reaches(normal, height)
    }

    /// Whether a triangle reaches above that height along a normal; or it would take long to tell.
    fn reaches(&self, normal: [f64; 3], height: f64) -> bool {
        let (of_boxes, height_of_boxes) = (normal.map(|x| x as f32), height as f32 - BOX_ERROR);
        let (of_blocks, height) = (normal.map(F::from_f64), F::from_f64(height));
        let mut waiting = vec![Child::ROOT];
        let mut visited = 0;
        while let Some(child) = waiting.pop() {
            let number = child.number() as usize;
            if !child.is_node() {
                let corners = &self.blocks[number].corners;
                if (corners.iter()).any(|[x, y, z]| is_any_above(of_blocks, [x, y, z], height)) {
                    return true;
                }
                continue;
            }
            visited += 1;
            if visited > MOST_NODES {
                return true;
            }
            let node = &self.tree.nodes[number];
            let [x, y, z] = [0, 1, 2].map(|i| &node.planes[i + 3 * usize::from(of_boxes[i] > 0.0)]);
            let (mut highest, mut place) = (f32::NEG_INFINITY, waiting.len());
            for i in 0..WIDTH {
                // NaN of no box.
                let top = along(of_boxes, [x[i], y[i], z[i]]);
                if top > height_of_boxes {
                    if top > highest {
                        (highest, place) = (top, waiting.len());
                    }
                    waiting.push(node.children[i]);
                }
            }
            // What reaches above is mostly found where boxes are highest.
            if let Some(last) = waiting.len().checked_sub(1) {
                waiting.swap(place.min(last), last);
            }
        }
        false
    }
}

/// A point's height along a normal: plain products, since this is not compiled for an instruction
/// set that has fused ones.
#[inline(always)]
fn along<F: Scalar>(normal: [F; 3], [x, y, z]: [F; 3]) -> F {
    normal[0] * x + normal[1] * y + normal[2] * z
}

/// Whether one of the points, given by coordinate, is above that height; those that are NaN are not.
#[inline(always)]
fn is_any_above<F: Scalar>(normal: [F; 3], [x, y, z]: [&[F; BLOCK]; 3], height: F) -> bool {
    let mut above = false;
    for lane in 0..BLOCK {
        above |= along(normal, [x[lane], y[lane], z[lane]]) > height;
    }
    above
}
