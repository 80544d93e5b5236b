//! The face the kernel shows to Python: `runtime._kernel`.
//!
//! See `runtime/_kernel.pyi` for the contract.
mod arrays;
mod detail;
mod render;
mod screen;
mod trace;

use numpy::PyArray2;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};

use self::arrays::Rows;
use self::trace::Answers;
use crate::bvh::Bounds;
use crate::lanes::InstructionSet;
use crate::ray::Find;
use crate::render::Appearance;
use crate::scene::{Scene, SceneError};

/// A scene prepared for tracing; immutable and safe to share between threads.
#[pyclass(frozen, module = "runtime._kernel")]
struct Kernel {
    scene: Prepared,
    appearance: Appearance,
    set: InstructionSet,
    /// Bytes of the IR that had to be copied.
    copied: usize,
}

/// A scene of either precision.
enum Prepared {
    Single(Scene<f32>),
    Double(Scene<f64>),
}

impl Prepared {
    fn as_find(&self) -> &dyn Find {
        match self {
            Prepared::Single(scene) => scene,
            Prepared::Double(scene) => scene,
        }
    }
}

fn refused(error: SceneError) -> PyErr {
    PyValueError::new_err(error.0)
}

#[pymethods]
impl Kernel {
    #[new]
    #[pyo3(signature = (ir, precision, isa=None, images=None, skies=None))]
    fn new(
        ir: &Bound<'_, PyAny>,
        precision: &str,
        isa: Option<&str>,
        images: Option<Bound<'_, PyAny>>,
        skies: Option<Bound<'_, PyDict>>,
    ) -> PyResult<Kernel> {
        let set = instruction_set(isa)?;
        let images = images.unwrap_or_else(|| PyList::empty(ir.py()).into_any());
        let skies = skies.unwrap_or_else(|| PyDict::new(ir.py()));
        let (appearance, more) = render::appearance(ir, &images, &skies)?;
        let (arrays, copied) = arrays::scene_arrays(ir)?;
        let prepare = || match precision {
            "float32" => Scene::new(arrays, set).map(Prepared::Single),
            _ => Scene::new(arrays, set).map(Prepared::Double),
        };
        if !["float32", "float64"].contains(&precision) {
            return Err(PyValueError::new_err(format!(
                "precision is \"float32\" or \"float64\", not {precision:?}"
            )));
        }
        let scene = ir.py().detach(prepare).map_err(refused)?;
        Ok(Kernel {
            scene,
            appearance,
            set,
            copied: copied + more,
        })
    }

    fn updated(&self, ir: &Bound<'_, PyAny>) -> PyResult<Kernel> {
        let (images, skies) = (PyList::empty(ir.py()).into_any(), PyDict::new(ir.py()));
        let (appearance, more) = render::appearance(ir, &images, &skies)?;
        let (arrays, copied) = arrays::scene_arrays(ir)?;
        let prepare = || match &self.scene {
            Prepared::Single(scene) => scene.updated(arrays).map(Prepared::Single),
            Prepared::Double(scene) => scene.updated(arrays).map(Prepared::Double),
        };
        let scene = ir.py().detach(prepare).map_err(refused)?;
        Ok(Kernel {
            scene,
            appearance,
            set: self.set,
            copied: copied + more,
        })
    }

    #[getter]
    fn isa(&self) -> &'static str {
        self.set.name()
    }

    #[getter]
    fn nbytes(&self) -> usize {
        let nbytes = match &self.scene {
            Prepared::Single(scene) => scene.nbytes(),
            Prepared::Double(scene) => scene.nbytes(),
        };
        nbytes + self.copied
    }

    #[getter]
    fn bounds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let Bounds { lower, upper } = match &self.scene {
            Prepared::Single(scene) => scene.bounds(),
            Prepared::Double(scene) => scene.bounds(),
        };
        Ok(PyArray2::from_vec2(py, &[lower.to_vec(), upper.to_vec()])?)
    }

    #[pyo3(signature = (origins, directions, t_min, t_max, threads=0))]
    fn trace<'py>(
        &self,
        py: Python<'py>,
        origins: &Bound<'py, PyAny>,
        directions: &Bound<'py, PyAny>,
        t_min: &Bound<'py, PyAny>,
        t_max: &Bound<'py, PyAny>,
        threads: usize,
    ) -> PyResult<Bound<'py, PyTuple>> {
        let rays = trace::Rays::new(origins, directions, t_min, t_max)?;
        trace::closest(py, self.scene.as_find(), &rays, threads)
    }

    #[pyo3(signature = (origins, directions, t, instance, primitive, threads=0))]
    #[allow(clippy::too_many_arguments)]
    fn surface<'py>(
        &self,
        py: Python<'py>,
        origins: &Bound<'py, PyAny>,
        directions: &Bound<'py, PyAny>,
        t: &Bound<'py, PyAny>,
        instance: &Bound<'py, PyAny>,
        primitive: &Bound<'py, PyAny>,
        threads: usize,
    ) -> PyResult<Bound<'py, PyTuple>> {
        let origins = Rows::new("origins", origins)?;
        let directions = Rows::new("directions", directions)?;
        let found = trace::Founds::new(t, instance, primitive)?;
        let scene = self.scene.as_find();
        trace::surfaces(py, scene, &origins, &directions, &found, threads)
    }

    #[pyo3(signature = (origins, directions, t_min, t_max, threads=0))]
    fn occluded<'py>(
        &self,
        py: Python<'py>,
        origins: &Bound<'py, PyAny>,
        directions: &Bound<'py, PyAny>,
        t_min: &Bound<'py, PyAny>,
        t_max: &Bound<'py, PyAny>,
        threads: usize,
    ) -> PyResult<Answers<'py, bool>> {
        let rays = trace::Rays::new(origins, directions, t_min, t_max)?;
        trace::occluded(py, self.scene.as_find(), &rays, threads)
    }

    #[pyo3(signature = (
        camera, width, height, samples, integrator, occlusion_distance,
        seed=0, threads=0, progress=None, surfaces=true,
    ))]
    #[allow(clippy::too_many_arguments)]
    fn render<'py>(
        &self,
        py: Python<'py>,
        camera: Bound<'py, PyAny>,
        width: u32,
        height: u32,
        samples: u32,
        integrator: &'py str,
        occlusion_distance: f64,
        seed: u64,
        threads: usize,
        progress: Option<Bound<'py, PyAny>>,
        surfaces: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let request = render::Request {
            camera,
            width,
            height,
            samples,
            integrator,
            occlusion_distance,
            seed,
            threads,
            progress,
            surfaces,
            set: self.set,
        };
        render::render(py, self.scene.as_find(), &self.appearance, &request)
    }
}

/// The set of that name, or the best of this CPU.
fn instruction_set(name: Option<&str>) -> PyResult<InstructionSet> {
    let available = InstructionSet::available();
    let Some(name) = name else {
        return Ok(available[0]);
    };
    InstructionSet::from_name(name)
        .filter(|set| available.contains(set))
        .ok_or_else(|| {
            let names: Vec<_> = available.iter().map(|set| set.name()).collect();
            PyValueError::new_err(format!(
                "this CPU has no instruction set {name:?}; it has {}",
                names.join(", ")
            ))
        })
}

/// Names of the instruction sets this CPU can run, best first; the last is "portable".
#[pyfunction]
fn instruction_sets() -> Vec<&'static str> {
    let available = InstructionSet::available();
    available.into_iter().map(InstructionSet::name).collect()
}

/// `runtime._kernel`.
#[pymodule]
fn _kernel(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_function(wrap_pyfunction!(instruction_sets, module)?)?;
    module.add_function(wrap_pyfunction!(screen::screen, module)?)?;
    module.add_function(wrap_pyfunction!(screen::png, module)?)?;
    module.add_function(wrap_pyfunction!(screen::jpeg, module)?)?;
    module.add_class::<Kernel>()
}
