//! Light on its way to a vertex, and the shadow rays that decide whether it arrives.
use super::direct::LAYERS;
use super::dome::Dome;
use super::frame::Frame;
use super::light::Light;
use super::material::{Material, Materials};
use super::rays::{RayLists, make_room};
use super::samples::Samples;
use super::vector::Vec3;
use super::vertex::{Vertices, beyond};
use crate::lanes::{Lanes, Mask, take_bit};
use crate::ray::Hits;

/// A batch of shadow rays, and what each adds to its slot unless it is occluded.
#[derive(Default)]
pub struct Shadows {
    rays: RayLists,
    slots: Vec<u32>,
    light: [Vec<f64>; 3],
    occluded: Vec<bool>,
    hits: Hits,
}

/// A vertex that light arrives at.
struct Lit<'m> {
    material: &'m Material,
    normal: Vec3,
    view: Vec3,
    weight: f64,
}

impl Shadows {
    /// Begins a batch for so many vertices.
    #[inline(always)]
    fn start(&mut self, count: usize) {
        self.rays.resize(count);
        self.rays.t_min.fill(0.0);
        self.slots.clear();
        make_room(&mut self.light, count);
    }

    /// Makes the batch that of a light on all vertices, at one sample point for each if its shadows
    /// are soft.
    #[inline(always)]
    pub fn light<L: Lanes<Scalar = f64>>(
        &mut self,
        vertices: &Vertices,
        materials: Materials,
        light: &Light,
        points: Option<&[Vec<f64>; 2]>,
    ) {
        self.start(vertices.len());
        let only = vertices.only_material();
        for first in (0..vertices.len()).step_by(L::WIDTH) {
            let len = L::WIDTH.min(vertices.len() - first);
            let origin = Vec3::load(&vertices.origin, first);
            let point = match points {
                Some([u, v]) => [L::load(&u[first..]), L::load(&v[first..])],
                None => [L::zero(); 2],
            };
            let (shines, light) = light.illuminate(origin, point);
            let normal = Vec3::load(&vertices.normal, first);
            let view = Vec3::load(&vertices.view, first);
            let numbers = &vertices.materials[first..first + L::WIDTH];
            let mut reflected = Vec3::splat(Vec3::ZERO);
            let mut left = (shines & Mask::first(len)).bits();
            while left != 0 {
                let number = numbers[left.trailing_zeros() as usize];
                let mut same = u32::MAX;
                if only.is_none() {
                    same = 0;
                    for (lane, &other) in numbers.iter().enumerate() {
                        same |= u32::from(other == number) << lane;
                    }
                }
                let of_material = materials.get(number).reflect_light(normal, view, &light);
                let same = same & left;
                reflected = Vec3::select(Mask::from_bits(same), of_material, reflected);
                left &= !same;
            }
            let reflected = reflected * L::load(&vertices.weights[first..]);
            let zero = L::zero();
            let dark = reflected.x.eq(zero) & reflected.y.eq(zero) & reflected.z.eq(zero);
            let lit = L::Mask::first(len).and_not(dark).bits();
            self.push(
                vertices,
                first,
                lit,
                reflected,
                light.towards,
                light.distance,
            );
        }
        self.rays.truncate(self.slots.len());
    }

    /// Adds the lit ones of W vertices from number `first` on.
    #[inline(always)]
    fn push<L: Lanes<Scalar = f64>>(
        &mut self,
        vertices: &Vertices,
        first: usize,
        lit: u32,
        light: Vec3<L>,
        towards: Vec3<L>,
        distance: L,
    ) {
        // Written whole: what follows the lit ones is written over.
        let base = self.slots.len();
        let origin: Vec3<L> = Vec3::load(&vertices.origin, first);
        let mask = L::Mask::from_bits(lit);
        light.packed(mask).store(&mut self.light, base);
        origin.packed(mask).store(&mut self.rays.origin, base);
        towards.packed(mask).store(&mut self.rays.direction, base);
        (distance.packed(mask)).store(&mut self.rays.t_max[base..]);
        let slots = &vertices.slots[first..];
        if lit == (1 << L::WIDTH) - 1 {
            self.slots.extend_from_slice(&slots[..L::WIDTH]);
            return;
        }
        let mut left = lit;
        while let Some(lane) = take_bit(&mut left) {
            self.slots.push(slots[lane]);
        }
    }

    /// Makes the batch that of a sky on all vertices, in one direction drawn for each.
    #[inline(always)]
    pub fn sky(
        &mut self,
        vertices: &Vertices,
        materials: Materials,
        radiance: Vec3,
        points: &[Vec<f64>; 2],
    ) {
        self.distant(vertices, materials, points, |at, point| {
            let (direction, weight) = at.material.draw(at.normal, at.view, point)?;
            Some((direction, weight * radiance * at.weight))
        });
    }

    /// Makes the batch that of a dome on all vertices, in one direction drawn for each.
    ///
    /// Half of the directions are drawn where the dome is bright, half where the material reflects,
    /// and all are weighted as if drawn from the mean of both densities (the one-sample balance
    /// heuristic of Veach, 1997, § 9.2.4): neither a small sun nor a smooth surface makes noise.
    #[inline(always)]
    pub fn dome(
        &mut self,
        vertices: &Vertices,
        materials: Materials,
        dome: &Dome,
        points: &[Vec<f64>; 2],
    ) {
        self.distant(vertices, materials, points, |at, [u, v]| {
            let u = 2.0 * u;
            let (direction, of_dome) = if u < 1.0 {
                dome.draw([u, v])
            } else {
                let direction = at
                    .material
                    .draw_direction(at.normal, at.view, [u - 1.0, v])?;
                (direction, dome.density(direction))
            };
            let (reflectance, of_material) = at.material.reflect(at.normal, at.view, direction)?;
            let weight = at.weight * 2.0 / (of_dome + of_material);
            Some((direction, reflectance * dome.radiance(direction) * weight))
        });
    }

    /// Makes the batch that of light from beyond all surfaces: `draw` gives a direction for a vertex
    /// and a sample point, and the light that arrives if nothing hides it.
    #[inline(always)]
    fn distant<'m>(
        &mut self,
        vertices: &Vertices,
        materials: Materials<'m>,
        [u, v]: &[Vec<f64>; 2],
        draw: impl Fn(Lit<'m>, [f64; 2]) -> Option<(Vec3, Vec3)>,
    ) {
        self.start(vertices.len());
        for vertex in 0..vertices.len() {
            let at = Lit {
                material: materials.get(vertices.materials[vertex]),
                normal: Vec3::load(&vertices.normal, vertex),
                view: Vec3::load(&vertices.view, vertex),
                weight: vertices.weights[vertex],
            };
            if let Some((direction, light)) = draw(at, [u[vertex], v[vertex]]) {
                let lit = u32::from(light != Vec3::ZERO);
                self.push(vertices, vertex, lit, light, direction, f64::INFINITY);
            }
        }
        self.rays.truncate(self.slots.len());
    }

    /// Adds light to the sample of number `i` of the batch.
    #[inline(always)]
    fn arrive(&self, i: usize, samples: &mut Samples) {
        samples.add(self.slots[i] as usize, Vec3::load(&self.light, i));
    }

    /// Traces the rays and adds what arrives to the samples.
    #[inline(always)]
    pub fn gather(&mut self, frame: &Frame, samples: &mut Samples) {
        if frame.transparent {
            self.gather_through(frame, samples);
        } else if !frame.is_cancelled() {
            frame.occluded(&self.rays, &mut self.occluded);
            for i in 0..self.rays.len() {
                if !self.occluded[i] {
                    self.arrive(i, samples);
                }
            }
        }
    }

    /// The same where surfaces may let a part of the light through.
    fn gather_through(&mut self, frame: &Frame, samples: &mut Samples) {
        for _ in 0..LAYERS {
            if self.rays.is_empty() || frame.is_cancelled() {
                return;
            }
            frame.closest(&self.rays, &mut self.hits);
            let mut left = 0;
            for i in 0..self.rays.len() {
                let hit = self.hits.get(i);
                if hit.instance < 0 {
                    self.arrive(i, samples);
                    continue;
                }
                let opacity = frame.opacity(&hit);
                if opacity < 1.0 {
                    self.slots[left] = self.slots[i];
                    let light: Vec3 = Vec3::load(&self.light, i);
                    (light * (1.0 - opacity)).store(&mut self.light, left);
                    let ray = beyond(&self.rays.get(i), &hit);
                    self.rays.set(left, &ray);
                    left += 1;
                }
            }
            self.rays.truncate(left);
        }
    }
}
