//! From a leaf number and t to the surface there.
//!
//! The way down through the levels is found again from the leaf number, so traversal carries no
//! path. The point is computed where it is small: in object space, moved onto the surface, and
//! only then transformed, translations last.
//!
//! # Offset
//!
//! A ray that starts at the point is traced like any other: its origin is rounded to F in the
//! normalised space of the object, and intersectors err by some units of F there. Together that
//! stays below δ = 32·ε_F·size along the object's normal n_o. Displacing the start by h along the
//! world normal n = Wᵀn_o/|Wᵀn_o| moves it by n_o·W·n·h = |Wᵀn_o|·h along n_o in object space, so
//! h = δ/|Wᵀn_o| clears the surface under any affine map (after Wächter & Binder's and NVIDIA's
//! self-intersection-avoidance bounds for instances). Each transform adds its own rounding,
//! γ·(|M||p| + |T|) in f64, likewise divided by the normal's length there. Flat shapes meet rays
//! in f64 (see `instance`), so their δ is of f64.
//!
//! # Edges
//!
//! Within an edge two faces meet, and a start that is clear of one may have been rounded beyond the
//! other: a ray would leave a closed box next to its edge, once in some million. So points keep
//! [`EDGE_ROOM`] units and the rounding of world coordinates away from the edges of their face.
//! They keep within the face as a rule, but beyond the edge if the ray came over that: it has met a
//! solid at the seam where it touches another, and its next one must not start in that.
//!
//! # Lanes
//!
//! Neighbours often hit the same instance: those that do are one vector, whose matrices are the
//! same in every lane.
use super::columns::RayColumns;
use super::level::Target;
use super::precision::Precision;
use crate::bvh::NormalSpace;
use crate::instance::{LevelRays, dot};
use crate::lanes::{Isa, Lanes, MAX_WIDTH, Mask, Task, axes, each, halves, take_bit};
use crate::ray::{Hit, Hits, Rays};
use crate::scalar::Scalar;
use crate::scene::{Affine, Geometry, Group, Mesh, Prototype, Scene};
use crate::shapes::triangle_surface;

/// Rounding errors of one transform of a point, in units of the magnitudes of its terms.
const TRANSFORM_ERROR: f64 = 8.0 * f64::EPSILON;

/// Rounding error of a coordinate, and of the start that is computed from it, in units of itself.
const COORDINATE_ERROR: f64 = 2.0 * f64::EPSILON;

/// How far points stay from edges, in ε_F of the object's size.
const EDGE_ROOM: f64 = 8.0;

/// How far before its hit a ray tells on which side of an edge it came, in rooms.
const ROOMS_BEFORE: f64 = 64.0;

/// Completes hits of which t, instance and primitive are known.
pub(super) struct Surfaces<'a, F: Precision> {
    pub scene: &'a Scene<F>,
    pub rays: Rays<'a>,
    pub hits: &'a mut Hits,
}

impl<F: Precision> Task for Surfaces<'_, F> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let Surfaces { scene, rays, hits } = self;
        let width = I::F64::WIDTH;
        let mut path = Vec::new();
        for packet in (0..rays.len()).step_by(I::F32::WIDTH) {
            let left = (rays.len() - packet).min(I::F32::WIDTH);
            let hit: [u32; 2] = halves!(|h| {
                let len = left.saturating_sub(h * width).min(width);
                let first = packet + h * width;
                let hit = lanes_where(&hits.instance[first..first + width], |leaf| {
                    (0..scene.leaf_count).contains(&leaf)
                });
                let lanes = (1 << len) - 1;
                store_misses::<I::F64>(Mask::from_bits(lanes & !hit), first, hits);
                hit & lanes
            });
            if hit == [0; 2] {
                continue;
            }
            let lanes = RayColumns::<I>::new(rays, packet);
            for (half, mut left) in hit.into_iter().enumerate() {
                let first = packet + half * width;
                while left != 0 {
                    let leaf = hits.instance[first + left.trailing_zeros() as usize];
                    let instances = &hits.instance[first..first + width];
                    let same = left & lanes_where(instances, |other| other == leaf);
                    left &= !same;
                    let surface = I::call(OfLeaf {
                        scene,
                        leaf,
                        rays: &lanes.level[half],
                        t: I::F64::load(&hits.t[first..]),
                        triangles: &hits.primitive[first..],
                        lanes: Mask::from_bits(same),
                        path: &mut path,
                    });
                    surface.store(first, hits);
                    let missed = same & !surface.lanes.bits();
                    store_misses::<I::F64>(Mask::from_bits(missed), first, hits);
                }
            }
        }
    }
}

/// Where leaf numbers are as asked for.
#[inline(always)]
fn lanes_where(leaves: &[i64], is: impl Fn(i64) -> bool) -> u32 {
    let mut lanes = 0;
    for (lane, &leaf) in leaves.iter().enumerate() {
        lanes |= u32::from(is(leaf)) << lane;
    }
    lanes
}

/// Makes some of W hits from number `first` on misses.
#[inline(always)]
fn store_misses<L: Lanes<Scalar = f64>>(lanes: L::Mask, first: usize, hits: &mut Hits) {
    if !lanes.any() {
        return;
    }
    let miss = Hit::MISS;
    put(lanes, L::splat(miss.t), &mut hits.t[first..]);
    put(lanes, L::splat(miss.offset), &mut hits.offset[first..]);
    for axis in 0..3 {
        put(
            lanes,
            L::splat(miss.position[axis]),
            &mut hits.position[axis][first..],
        );
        put(
            lanes,
            L::splat(miss.normal[axis]),
            &mut hits.normal[axis][first..],
        );
    }
    let (instance, primitive) = (&mut hits.instance[first..], &mut hits.primitive[first..]);
    let (prototype, material) = (&mut hits.prototype[first..], &mut hits.material[first..]);
    let lanes = lanes.bits();
    for lane in 0..L::WIDTH {
        if lanes >> lane & 1 != 0 {
            (instance[lane], primitive[lane]) = (miss.instance, miss.primitive);
            (prototype[lane], material[lane]) = (miss.prototype, miss.material);
        }
    }
}

/// [`Scene::surface`] in a function of its own: what is this large must not be part of a loop, which
/// compilers would try to move its numbers out of for minutes.
struct OfLeaf<'a, F: Precision, L: Lanes> {
    scene: &'a Scene<F>,
    leaf: i64,
    rays: &'a LevelRays<L>,
    t: L,
    triangles: &'a [u32],
    lanes: L::Mask,
    path: &'a mut Vec<usize>,
}

impl<F: Precision, L: Lanes<Scalar = f64>> Task for OfLeaf<'_, F, L> {
    type Output = Surface<L>;

    #[inline(always)]
    fn run<I: Isa>(self) -> Surface<L> {
        let OfLeaf {
            scene,
            leaf,
            rays,
            t,
            triangles,
            lanes,
            path,
        } = self;
        scene.surface(leaf, rays, t, triangles, lanes, path)
    }
}

/// Surfaces of one instance, in world space.
struct Surface<L: Lanes> {
    /// Where there is one.
    lanes: L::Mask,
    position: [L; 3],
    normal: [L; 3],
    offset: L,
    prototype: i32,
    material: i32,
}

/// Writes lanes into a stretch of numbers.
#[inline(always)]
fn put<L: Lanes<Scalar = f64>>(lanes: L::Mask, numbers: L, to: &mut [f64]) {
    L::select(lanes, numbers, L::load(to)).store(to);
}

impl<L: Lanes<Scalar = f64>> Surface<L> {
    /// Writes them to the hits from number `first` on.
    #[inline(always)]
    fn store(&self, first: usize, hits: &mut Hits) {
        for axis in 0..3 {
            put(
                self.lanes,
                self.position[axis],
                &mut hits.position[axis][first..],
            );
            put(
                self.lanes,
                self.normal[axis],
                &mut hits.normal[axis][first..],
            );
        }
        put(self.lanes, self.offset, &mut hits.offset[first..]);
        let lanes = self.lanes.bits();
        let (prototype, material) = (&mut hits.prototype[first..], &mut hits.material[first..]);
        for lane in 0..L::WIDTH {
            if lanes >> lane & 1 != 0 {
                (prototype[lane], material[lane]) = (self.prototype, self.material);
            }
        }
    }
}

impl<F: Scalar> Scene<F> {
    /// The surfaces where some of these world rays hit a leaf. `path` is scratch.
    #[inline(always)]
    fn surface<L: Lanes<Scalar = f64>>(
        &self,
        mut leaf: i64,
        rays: &LevelRays<L>,
        t: L,
        triangles: &[u32],
        lanes: L::Mask,
        path: &mut Vec<usize>,
    ) -> Surface<L> {
        path.clear();
        let mut rays = *rays;
        let mut group: &Group = &self.groups[0];
        let mut bound = 0;
        let mut forced = None;
        // How far from its space's origin the object lies, in units of the ray's direction.
        let mut reach = L::zero();
        let (prototype, index) = loop {
            let (offset, before) = group.find_leaf(leaf);
            let row = group.start + offset;
            path.push(row);
            leaf -= before;
            match self.instance_material[row] {
                -1 => {}
                material if material >= 0 => bound = material,
                forces => forced = forced.or(Some(-2 - forces)),
            }
            let target = self.target(row);
            let entrance = self.entrance(row, &target);
            match target {
                Target::Group(inner) => {
                    rays = entrance.enter_group(&rays);
                    reach = reach + L::splat(self.distance(row)) * rays.parameter.rate;
                    group = inner;
                }
                Target::Prototype(prototype) => {
                    rays = entrance.enter_prototype(&rays, &prototype.space);
                    let distance = self.distance(row) * prototype.space.scale;
                    reach = reach + L::splat(distance) * rays.parameter.rate;
                    break (prototype, self.instance_target[row]);
                }
            }
        };
        let tau = rays.parameter.of_world(t);
        let rounding = L::splat(COORDINATE_ERROR) * reach * rays.parameter.per_rate;
        let of_object = prototype.surface(&rays, tau, triangles, lanes, rounding);
        let ObjectSurface {
            lanes,
            mut point,
            mut normal,
            mut offset,
        } = of_object;
        for &row in path.iter().rev() {
            let matrix: &Affine = &self.world_from_object[row];
            let low = self.translation_low.get(row).copied().unwrap_or_default();
            let inverse = &self.object_from_world[row];
            let turned: [L; 3] = axes!(|i| {
                dot(
                    L::splats([inverse[0][i], inverse[1][i], inverse[2][i]]),
                    normal,
                )
            });
            let magnitude: [L; 3] = axes!(|i| {
                let [x, y, z, w] = matrix[i];
                let sizes = L::splats([x.abs(), y.abs(), z.abs()]);
                dot(sizes, each!(point, |x| x.abs())) + L::splat(w.abs())
            });
            let error = dot(each!(turned, |x| x.abs()), magnitude);
            offset = L::splat(TRANSFORM_ERROR).mul_add(error, offset);
            point = axes!(|i| {
                let [x, y, z, w] = matrix[i];
                dot(L::splats([x, y, z]), point) + L::splat(f64::from(low[i])) + L::splat(w)
            });
            let [x, y, z] = each!(turned, |x| x.abs());
            // A power of two, so that squares neither over- nor underflow.
            let unit = x.max(y).max(z).unit_scale();
            normal = each!(turned, |x| x * unit);
            offset = offset * unit;
        }
        let per_length = L::splat(1.0) / dot(normal, normal).sqrt();
        Surface {
            lanes,
            position: point,
            normal: each!(normal, |x| x * per_length),
            offset: offset * per_length,
            prototype: index,
            material: forced.unwrap_or(bound),
        }
    }

    /// How far instance `row` lies from its space's origin, in its own units.
    #[inline(always)]
    fn distance(&self, row: usize) -> f64 {
        let [x, y, z] = each!(self.object_from_world[row], |r| r[3].abs());
        x.max(y).max(z)
    }
}

/// Points and normals in object space, and δ.
struct ObjectSurface<L: Lanes> {
    /// Where there is one.
    lanes: L::Mask,
    point: [L; 3],
    normal: [L; 3],
    offset: L,
}

impl<F: Scalar> Prototype<F> {
    /// The surface where rays of normalised space hit at `tau`, where world coordinates are off by
    /// `rounding`; without the lanes whose triangle there is not.
    #[inline(always)]
    fn surface<L: Lanes<Scalar = f64>>(
        &self,
        rays: &LevelRays<L>,
        tau: L,
        triangles: &[u32],
        lanes: L::Mask,
        rounding: L,
    ) -> ObjectSurface<L> {
        let NormalSpace { center, scale } = self.space;
        let unit = L::splat(1.0 / scale);
        let center = L::splats(center);
        let offset = L::splat(F::EPS.to_f64() * 32.0 / scale);
        let room = L::splat(EDGE_ROOM * F::EPS.to_f64()) + rounding;
        let at = |t: L| -> [L; 3] { axes!(|i| t.mul_add(rays.direction[i], rays.origin[i])) };
        let local = at(tau);
        let from = -rays.parameter.start * rays.parameter.per_rate;
        let before = at((tau - L::splat(ROOMS_BEFORE) * room).max(from));
        match &self.geometry {
            Geometry::Shape(shape) => {
                let (point, normal) = shape.surface(local, before, room);
                let point = axes!(|i| point[i].mul_add(unit, center[i]));
                let offset = if self.anchor.flat {
                    let [x, y, z] = each!(point, |x| x.abs());
                    L::splat(TRANSFORM_ERROR) * (x + y + z)
                } else {
                    offset
                };
                ObjectSurface {
                    lanes,
                    point,
                    normal,
                    offset,
                }
            }
            Geometry::Mesh(mesh) => {
                let near = axes!(|i| local[i].mul_add(unit, center[i]));
                let (corners, lanes) = corners(mesh, triangles, lanes);
                let (point, normal) = triangle_surface(corners, near, room * unit);
                ObjectSurface {
                    lanes,
                    point,
                    normal,
                    offset,
                }
            }
        }
    }
}

/// The corners of a triangle for each lane, and the lanes whose triangle there is.
#[inline(always)]
fn corners<F: Scalar, L: Lanes<Scalar = f64>>(
    mesh: &Mesh<F>,
    triangles: &[u32],
    lanes: L::Mask,
) -> ([[L; 3]; 3], L::Mask) {
    let mut columns = [[[0.0; MAX_WIDTH]; 3]; 3];
    let mut found = lanes.bits();
    let mut left = found;
    while let Some(lane) = take_bit(&mut left) {
        let triangle = triangles[lane];
        if triangle as usize >= mesh.triangle_count {
            found &= !(1 << lane);
            continue;
        }
        let corners = mesh.corners(triangle);
        for corner in 0..3 {
            for axis in 0..3 {
                columns[corner][axis][lane] = corners[corner][axis];
            }
        }
    }
    let corners = axes!(|corner| axes!(|axis| L::load(&columns[corner][axis])));
    (corners, L::Mask::from_bits(found))
}
