//! `Kernel.trace`, `Kernel.surface` and `Kernel.occluded`: ray batches from arrays to arrays.
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::IntoPyObjectExt;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use rayon::prelude::*;

use super::arrays::Rows;
use crate::ray::{self, Find, FoundColumns, Hits};

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

    fn slices(&self) -> crate::ray::Rays<'_> {
        crate::ray::Rays::Columns {
            origins: self.origins.rows(),
            directions: self.directions.rows(),
            t_min: self.t_min.rows(),
            t_max: self.t_max.rows(),
        }
    }
}

/// The threads that share the rays of a call.
struct Threads {
    /// None for the caller's own thread, and for those that all calls share, one for each core.
    pool: Option<rayon::ThreadPool>,
    /// Batches that stay on one thread.
    together: usize,
}

impl Threads {
    /// That many, but no more than there are cores; 0 for as many. One is the caller's own, since
    /// a thread takes longer to begin than thousands of rays.
    fn new(threads: usize) -> PyResult<Threads> {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let pool = if (2..cores).contains(&threads) {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .map_err(|error| PyRuntimeError::new_err(error.to_string()))?;
            Some(pool)
        } else {
            None
        };
        let together = if threads == 1 { usize::MAX } else { 1 };
        Ok(Threads { pool, together })
    }

    /// Runs `work` with the GIL released, then lets a pending KeyboardInterrupt through.
    fn run(&self, py: Python<'_>, work: impl FnOnce() + Send) -> PyResult<()> {
        py.detach(|| match &self.pool {
            Some(pool) => pool.install(work),
            None => work(),
        });
        py.check_signals()
    }
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
    scene: &dyn Find,
    rays: &Rays<'py>,
    threads: usize,
) -> PyResult<Bound<'py, PyTuple>> {
    let slices = rays.slices();
    let n = slices.len();
    let t = PyArray1::<f64>::zeros(py, n, false);
    let instance = PyArray1::<i64>::zeros(py, n, false);
    let primitive = PyArray1::<u32>::zeros(py, n, false);
    let answers = slice_of!(t)
        .chunks_mut(POLL)
        .zip(slice_of!(instance).chunks_mut(POLL))
        .zip(slice_of!(primitive).chunks_mut(POLL));
    let threads = Threads::new(threads)?;
    for (poll, ((t, instance), primitive)) in answers.enumerate() {
        threads.run(py, || {
            t.par_chunks_mut(BATCH)
                .zip(instance.par_chunks_mut(BATCH))
                .zip(primitive.par_chunks_mut(BATCH))
                .enumerate()
                .with_min_len(threads.together)
                .for_each(|(batch, ((t, instance), primitive))| {
                    let start = poll * POLL + batch * BATCH;
                    let found = FoundColumns {
                        t,
                        instance,
                        primitive,
                    };
                    scene.find(slices.part(start..start + found.t.len()), found);
                });
        })?;
    }
    (t, instance, primitive)
        .into_bound_py_any(py)?
        .downcast_into::<PyTuple>()
        .map_err(PyErr::from)
}

/// Hits as `closest` found them.
pub(super) struct Founds<'py> {
    t: Rows<'py, f64>,
    instance: Rows<'py, i64>,
    primitive: Rows<'py, u32>,
}

impl<'py> Founds<'py> {
    pub fn new(
        t: &Bound<'py, PyAny>,
        instance: &Bound<'py, PyAny>,
        primitive: &Bound<'py, PyAny>,
    ) -> PyResult<Founds<'py>> {
        let found = Founds {
            t: Rows::new("t", t)?,
            instance: Rows::new("instance", instance)?,
            primitive: Rows::new("primitive", primitive)?,
        };
        let n = found.t.rows().len();
        if found.instance.rows().len() != n || found.primitive.rows().len() != n {
            return Err(PyValueError::new_err(
                "t, instance and primitive differ in the number of rays",
            ));
        }
        Ok(found)
    }
}

pub(super) fn surfaces<'py>(
    py: Python<'py>,
    scene: &dyn Find,
    origins: &Rows<'py, [f64; 3]>,
    directions: &Rows<'py, [f64; 3]>,
    found: &Founds<'py>,
    threads: usize,
) -> PyResult<Bound<'py, PyTuple>> {
    let (origins, directions) = (origins.rows(), directions.rows());
    let (t, instance) = (found.t.rows(), found.instance.rows());
    let primitive = found.primitive.rows();
    let n = t.len();
    if origins.len() != n || directions.len() != n {
        return Err(PyValueError::new_err(format!(
            "{} origins and {} directions for {n} hits",
            origins.len(),
            directions.len()
        )));
    }
    let normal = PyArray2::<f64>::zeros(py, [n, 3], false);
    let position = PyArray2::<f64>::zeros(py, [n, 3], false);
    let prototype = PyArray1::<i32>::zeros(py, n, false);
    let material = PyArray1::<i32>::zeros(py, n, false);
    let offset = PyArray1::<f64>::zeros(py, n, false);
    let answers = slice_of!(normal)
        .chunks_mut(3 * POLL)
        .zip(slice_of!(position).chunks_mut(3 * POLL))
        .zip(slice_of!(prototype).chunks_mut(POLL))
        .zip(slice_of!(material).chunks_mut(POLL))
        .zip(slice_of!(offset).chunks_mut(POLL));
    let threads = Threads::new(threads)?;
    for (poll, ((((normal, position), prototype), material), offset)) in answers.enumerate() {
        threads.run(py, || {
            normal
                .par_chunks_mut(3 * BATCH)
                .zip(position.par_chunks_mut(3 * BATCH))
                .zip(prototype.par_chunks_mut(BATCH))
                .zip(material.par_chunks_mut(BATCH))
                .zip(offset.par_chunks_mut(BATCH))
                .enumerate()
                .with_min_len(threads.together)
                .for_each(
                    |(batch, ((((normal, position), prototype), material), offset))| {
                        let start = poll * POLL + batch * BATCH;
                        let stretch = start..start + material.len();
                        let rays = ray::Rays::Columns {
                            origins: &origins[stretch.clone()],
                            directions: &directions[stretch.clone()],
                            t_min: &[0.0],
                            t_max: &[f64::INFINITY],
                        };
                        let n = stretch.len();
                        let mut hits = Hits::default();
                        hits.resize(n);
                        hits.t[..n].copy_from_slice(&t[stretch.clone()]);
                        hits.instance[..n].copy_from_slice(&instance[stretch.clone()]);
                        hits.primitive[..n].copy_from_slice(&primitive[stretch]);
                        scene.surfaces(rays, &mut hits);
                        for axis in 0..3 {
                            for i in 0..n {
                                normal[3 * i + axis] = hits.normal[axis][i];
                                position[3 * i + axis] = hits.position[axis][i];
                            }
                        }
                        prototype.copy_from_slice(&hits.prototype[..n]);
                        material.copy_from_slice(&hits.material[..n]);
                        offset.copy_from_slice(&hits.offset[..n]);
                    },
                );
        })?;
    }
    (normal, position, prototype, material, offset)
        .into_bound_py_any(py)?
        .downcast_into::<PyTuple>()
        .map_err(PyErr::from)
}

pub(super) fn occluded<'py>(
    py: Python<'py>,
    scene: &dyn Find,
    rays: &Rays<'py>,
    threads: usize,
) -> PyResult<Answers<'py, bool>> {
    let slices = rays.slices();
    let n = slices.len();
    let answers = PyArray1::<bool>::zeros(py, n, false);
    let threads = Threads::new(threads)?;
    for (poll, part) in slice_of!(answers).chunks_mut(POLL).enumerate() {
        threads.run(py, || {
            part.par_chunks_mut(BATCH)
                .enumerate()
                .with_min_len(threads.together)
                .for_each(|(batch, part)| {
                    let start = poll * POLL + batch * BATCH;
                    scene.find_any(slices.part(start..start + part.len()), part);
                });
        })?;
    }
    Ok(answers)
}
