//! `Kernel.trace` and `Kernel.occluded`: ray batches from arrays to arrays.
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use rayon::prelude::*;

use super::arrays::Rows;
use crate::ray::{Hit, Ray, Trace};

/// An array of one answer per ray.
pub(super) type Answers<'py, T> = Bound<'py, PyArray1<T>>;

/// Rays handed to the tracer at once.
const BATCH: usize = 1024;
/// Rays between two looks at pending signals.
const POLL: usize = 64 * BATCH;

/// The arguments that both functions share.
pub(super) struct Rays<'py> {
    origins: Rows<'py, [f64; 3]>,
    directions: Rows<'py, [f64; 3]>,
    t_min: Rows<'py, f64>,
    t_max: Rows<'py, f64>,
}

/// The same without Python.
#[derive(Clone, Copy)]
struct RaySlices<'a> {
    origins: &'a [[f64; 3]],
    directions: &'a [[f64; 3]],
    t_min: &'a [f64],
    t_max: &'a [f64],
}

impl<'py> Rays<'py> {
    pub fn new(
        origins: &Bound<'py, PyAny>,
        directions: &Bound<'py, PyAny>,
        t_min: &Bound<'py, PyAny>,
        t_max: &Bound<'py, PyAny>,
    ) -> PyResult<Rays<'py>> {
        let rays = Rays {
            origins: Rows::new("origins", origins)?,
            directions: Rows::new("directions", directions)?,
            t_min: Rows::new("t_min", t_min)?,
            t_max: Rows::new("t_max", t_max)?,
        };
        let n = rays.origins.rows().len();
        let lengths = [
            ("directions", rays.directions.rows().len(), false),
            ("t_min", rays.t_min.rows().len(), true),
            ("t_max", rays.t_max.rows().len(), true),
        ];
        for (name, len, may_be_one) in lengths {
            if len != n && !(may_be_one && len == 1) {
                return Err(PyValueError::new_err(format!(
                    "{name} has {len} rows for {n} origins"
                )));
            }
        }
        Ok(rays)
    }

    fn slices(&self) -> RaySlices<'_> {
        RaySlices {
            origins: self.origins.rows(),
            directions: self.directions.rows(),
            t_min: self.t_min.rows(),
            t_max: self.t_max.rows(),
        }
    }
}

impl RaySlices<'_> {
    fn ray(&self, i: usize) -> Ray {
        let bound = |values: &[f64]| values[if values.len() == 1 { 0 } else { i }];
        Ray {
            origin: self.origins[i],
            direction: self.directions[i],
            t_min: bound(self.t_min),
            t_max: bound(self.t_max),
        }
    }

    fn batch(&self, start: usize, len: usize) -> Vec<Ray> {
        (start..start + len).map(|i| self.ray(i)).collect()
    }
}

/// Where the answers to a stretch of rays go.
struct Hits<'a> {
    t: &'a mut [f64],
    normal: &'a mut [f64],
    position: &'a mut [f64],
    instance: &'a mut [i64],
    prototype: &'a mut [i32],
    material: &'a mut [i32],
}

impl<'a> Hits<'a> {
    /// The first `n` rays' part, and the rest.
    fn split(self, n: usize) -> (Hits<'a>, Hits<'a>) {
        let (t, t_rest) = self.t.split_at_mut(n);
        let (normal, normal_rest) = self.normal.split_at_mut(3 * n);
        let (position, position_rest) = self.position.split_at_mut(3 * n);
        let (instance, instance_rest) = self.instance.split_at_mut(n);
        let (prototype, prototype_rest) = self.prototype.split_at_mut(n);
        let (material, material_rest) = self.material.split_at_mut(n);
        let first = Hits {
            t,
            normal,
            position,
            instance,
            prototype,
            material,
        };
        let rest = Hits {
            t: t_rest,
            normal: normal_rest,
            position: position_rest,
            instance: instance_rest,
            prototype: prototype_rest,
            material: material_rest,
        };
        (first, rest)
    }

    fn set(&mut self, i: usize, hit: &Hit) {
        self.t[i] = hit.t;
        self.normal[3 * i..][..3].copy_from_slice(&hit.normal);
        self.position[3 * i..][..3].copy_from_slice(&hit.position);
        self.instance[i] = hit.instance;
        self.prototype[i] = hit.prototype;
        self.material[i] = hit.material;
    }
}

/// Stretches of rays with where their answers go, at most BATCH each.
fn batches<'a>(mut hits: Hits<'a>, start: usize) -> Vec<(usize, Hits<'a>)> {
    let mut parts = Vec::new();
    let mut start = start;
    while !hits.t.is_empty() {
        let n = hits.t.len().min(BATCH);
        let (part, rest) = hits.split(n);
        parts.push((start, part));
        start += n;
        hits = rest;
    }
    parts
}

/// A pool of that many threads; None for the one that all share.
fn pool(threads: usize) -> PyResult<Option<rayon::ThreadPool>> {
    if threads == 0 {
        return Ok(None);
    }
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map(Some)
        .map_err(|error| PyRuntimeError::new_err(error.to_string()))
}

/// Runs `work` on the pool with the GIL released, then lets a pending KeyboardInterrupt through.
fn run(
    py: Python<'_>,
    pool: Option<&rayon::ThreadPool>,
    work: impl FnOnce() + Send,
) -> PyResult<()> {
    py.detach(|| match pool {
        Some(pool) => pool.install(work),
        None => work(),
    });
    py.check_signals()
}

/// The numbers of an array that was made just now.
macro_rules! slice_of {
    ($array:expr) => {
        // SAFETY: nobody else knows the array yet.
        unsafe { $array.as_slice_mut() }?
    };
}

pub(super) fn closest<'py>(
    py: Python<'py>,
    scene: &dyn Trace,
    rays: &Rays<'py>,
    threads: usize,
) -> PyResult<Bound<'py, PyTuple>> {
    let slices = rays.slices();
    let n = slices.origins.len();
    let t = PyArray1::<f64>::zeros(py, n, false);
    let normal = PyArray2::<f64>::zeros(py, [n, 3], false);
    let position = PyArray2::<f64>::zeros(py, [n, 3], false);
    let instance = PyArray1::<i64>::zeros(py, n, false);
    let prototype = PyArray1::<i32>::zeros(py, n, false);
    let material = PyArray1::<i32>::zeros(py, n, false);
    let mut rest = Hits {
        t: slice_of!(t),
        normal: slice_of!(normal),
        position: slice_of!(position),
        instance: slice_of!(instance),
        prototype: slice_of!(prototype),
        material: slice_of!(material),
    };
    let pool = pool(threads)?;
    for start in (0..n).step_by(POLL) {
        let (part, after) = rest.split(POLL.min(n - start));
        rest = after;
        run(py, pool.as_ref(), || {
            batches(part, start)
                .into_par_iter()
                .for_each(|(start, mut part)| {
                    let rays = slices.batch(start, part.t.len());
                    let mut hits = vec![Hit::MISS; rays.len()];
                    scene.closest(&rays, &mut hits);
                    for (i, hit) in hits.iter().enumerate() {
                        part.set(i, hit);
                    }
                });
        })?;
    }
    (t, normal, position, instance, prototype, material)
        .into_bound_py_any(py)?
        .downcast_into::<PyTuple>()
        .map_err(PyErr::from)
}

pub(super) fn occluded<'py>(
    py: Python<'py>,
    scene: &dyn Trace,
    rays: &Rays<'py>,
    threads: usize,
) -> PyResult<Answers<'py, bool>> {
    let slices = rays.slices();
    let n = slices.origins.len();
    let answers = PyArray1::<bool>::zeros(py, n, false);
    let pool = pool(threads)?;
    for (poll, part) in slice_of!(answers).chunks_mut(POLL).enumerate() {
        run(py, pool.as_ref(), || {
            part.par_chunks_mut(BATCH)
                .enumerate()
                .for_each(|(batch, part)| {
                    let rays = slices.batch(poll * POLL + batch * BATCH, part.len());
                    scene.occluded(&rays, part);
                });
        })?;
    }
    Ok(answers)
}
