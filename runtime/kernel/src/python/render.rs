//! `Kernel.render`, and the IR's appearance.
use super::detail::{detail, image};
use crate::lanes::InstructionSet;
use crate::ray::Trace;
use crate::render::area::{AreaLight, Surface};
use crate::render::camera::{Camera, Projection};
use crate::render::dome::Dome;
use crate::render::film::Film;
use crate::render::light::{Light, Lights};
use crate::render::material::{Material, Parameters};
use crate::render::shaping::Shaping;
use crate::render::vector::Vec3;
use crate::render::{self, Appearance, Integrator, Picture};
use numpy::ndarray::arr0;
use numpy::{PyArray0, PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// What `Kernel.render` is called with; see `runtime/_kernel.pyi`.
pub struct Request<'py> {
    pub camera: Bound<'py, PyAny>,
    pub width: u32,
    pub height: u32,
    pub samples: u32,
    pub integrator: &'py str,
    pub occlusion_distance: f64,
    pub seed: u64,
    pub threads: usize,
    pub progress: Option<Bound<'py, PyAny>>,
    pub surfaces: bool,
    pub set: InstructionSet,
}

/// Reads how the scene of an IR looks; ValueError if that is not as `compiler.ir` says. With it,
/// the bytes that had to be copied.
pub fn appearance(
    ir: &Bound<'_, PyAny>,
    images: &Bound<'_, PyAny>,
    skies: &Bound<'_, PyDict>,
) -> PyResult<(Appearance, usize)> {
    let materials = materials(&ir.getattr("materials")?)?;
    let (detail, mut copied) = detail(ir, images, &materials)?;
    let appearance = Appearance {
        lights: lights(&ir.getattr("lights")?, skies, &mut copied)?,
        materials: materials.iter().map(Material::new).collect(),
        detail,
    };
    Ok((appearance, copied))
}

/// Renders with the GIL released; signals and what `progress` raises end the render.
pub fn render<'py>(
    py: Python<'py>,
    trace: &dyn Trace,
    appearance: &Appearance,
    request: &Request<'py>,
) -> PyResult<Bound<'py, PyDict>> {
    let picture = picture(request)?;
    let progress = request.progress.clone().map(Bound::unbind);
    let mut raised = None;
    let film = py.detach(|| {
        render::render(trace, appearance, &picture, &mut |done, rays| {
            let told = Python::attach(|py| {
                py.check_signals()?;
                if let Some(progress) = &progress {
                    progress.call1(py, (done, rays))?;
                }
                Ok(())
            });
            raised = told.err();
            raised.is_none()
        })
    });
    match (film, raised) {
        (Some(film), _) => arrays(py, film),
        (None, Some(error)) => Err(error),
        (None, None) => unreachable!("a render ends early only where `progress` raises"),
    }
}

fn picture(request: &Request) -> PyResult<Picture> {
    let &Request {
        width,
        height,
        samples,
        ..
    } = request;
    if width == 0 || height == 0 || samples == 0 {
        return Err(PyValueError::new_err(
            "width, height and samples are at least 1",
        ));
    }
    let integrator = match request.integrator {
        "direct" => Integrator::Direct,
        "ambient_occlusion" => Integrator::AmbientOcclusion {
            distance: request.occlusion_distance,
        },
        "normals" => Integrator::Normals,
        "ids" => Integrator::Ids,
        other => {
            return Err(PyValueError::new_err(format!(
                "unknown integrator {other:?}"
            )));
        }
    };
    Ok(Picture {
        camera: camera(&request.camera)?,
        width,
        height,
        samples,
        integrator,
        seed: request.seed,
        threads: request.threads,
        set: request.set,
        surfaces: request.surfaces,
    })
}

fn camera(record: &Bound<'_, PyAny>) -> PyResult<Camera> {
    let number = |name: &str| record.get_item(name)?.extract::<f64>();
    let matrix: PyReadonlyArray2<f64> = record.get_item("world_from_camera")?.extract()?;
    let matrix = matrix.as_array();
    if matrix.shape() != [3, 4] {
        return Err(PyValueError::new_err("world_from_camera is (3, 4)"));
    }
    let column = |j: usize| Vec3::new(matrix[[0, j]], matrix[[1, j]], matrix[[2, j]]);
    let shift: [f64; 2] = record.get_item("shift")?.extract()?;
    Ok(Camera {
        projection: match record.get_item("projection")?.extract::<i64>()? {
            0 => Projection::Perspective,
            1 => Projection::Orthographic,
            other => return Err(PyValueError::new_err(format!("unknown projection {other}"))),
        },
        right: column(0),
        up: column(1),
        back: column(2),
        position: column(3),
        height: number("height")?,
        aspect: number("aspect")?,
        shift,
        near: number("near")?,
        far: number("far")?,
    })
}

/// A table of the IR: one array per field.
pub struct Table<'a, 'py>(pub &'a Bound<'py, PyAny>);

impl Table<'_, '_> {
    pub fn numbers(&self, name: &str) -> PyResult<Vec<f64>> {
        let column: PyReadonlyArray1<f64> = self.0.get_item(name)?.extract()?;
        Ok(column.as_array().to_vec())
    }

    pub fn integers(&self, name: &str) -> PyResult<Vec<i32>> {
        let column: PyReadonlyArray1<i32> = self.0.get_item(name)?.extract()?;
        Ok(column.as_array().to_vec())
    }

    pub fn wholes(&self, name: &str) -> PyResult<Vec<i64>> {
        let column: PyReadonlyArray1<i64> = self.0.get_item(name)?.extract()?;
        Ok(column.as_array().to_vec())
    }

    pub fn vectors(&self, name: &str) -> PyResult<Vec<Vec3>> {
        let column: PyReadonlyArray2<f64> = self.0.get_item(name)?.extract()?;
        let column = column.as_array();
        if column.shape()[1] != 3 {
            return Err(PyValueError::new_err(format!("{name} is (n, 3)")));
        }
        Ok(column
            .rows()
            .into_iter()
            .map(|row| Vec3::new(row[0], row[1], row[2]))
            .collect())
    }
}

fn materials(table: &Bound<'_, PyAny>) -> PyResult<Vec<Parameters>> {
    let table = Table(table);
    let diffuse = table.vectors("diffuse")?;
    let emission = table.vectors("emission")?;
    let specular = table.vectors("specular")?;
    let metallic = table.numbers("metallic")?;
    let roughness = table.numbers("roughness")?;
    let clearcoat = table.numbers("clearcoat")?;
    let clearcoat_roughness = table.numbers("clearcoat_roughness")?;
    let opacity = table.numbers("opacity")?;
    let opacity_threshold = table.numbers("opacity_threshold")?;
    let ior = table.numbers("ior")?;
    let specular_workflow = table.integers("specular_workflow")?;
    let material = |i: usize| Parameters {
        diffuse: diffuse[i],
        emission: emission[i],
        specular_workflow: specular_workflow[i] != 0,
        specular: specular[i],
        metallic: metallic[i],
        roughness: roughness[i],
        clearcoat: clearcoat[i],
        clearcoat_roughness: clearcoat_roughness[i],
        opacity: opacity[i],
        opacity_threshold: opacity_threshold[i],
        ior: ior[i],
    };
    Ok((0..diffuse.len()).map(material).collect())
}

fn lights(
    table: &Bound<'_, PyAny>,
    skies: &Bound<'_, PyDict>,
    copied: &mut usize,
) -> PyResult<Lights> {
    let table = Table(table);
    let kinds = table.integers("kind")?;
    let vectors = table.vectors("vector")?;
    let colors = table.vectors("color")?;
    let sizes = table.numbers("size")?;
    let axes = [
        table.vectors("u")?,
        table.vectors("v")?,
        table.vectors("w")?,
    ];
    let cones = table.numbers("cone")?;
    let softness = table.numbers("softness")?;
    let focus = table.numbers("focus")?;
    let mut lights = Lights::default();
    for (i, kind) in kinds.into_iter().enumerate() {
        let (vector, color) = (vectors[i], colors[i]);
        let [u, v, w] = [axes[0][i], axes[1][i], axes[2][i]];
        let shaping = |axis: Vec3| Shaping::new(axis.normalized(), cones[i], softness[i], focus[i]);
        let area = |surface: Surface, axis: Vec3| {
            Light::Area(AreaLight::new(
                surface,
                vector,
                [u, v, w],
                color,
                shaping(axis),
            ))
        };
        let normal = u.cross(v) * 1f64.copysign(u.cross(v).dot(w));
        match kind {
            0 => lights.push(Light::sun(vector, color, sizes[i])),
            1 => lights.push(Light::Point {
                position: vector,
                intensity: color,
                radius: sizes[i],
                shaping: shaping(w),
            }),
            2 => match skies.get_item(i)? {
                // "auto": bytes are colours for screens, floats are light.
                Some(given) => {
                    lights.push_dome(Dome::new(image(&given, 0, copied)?, color, [u, v, w]));
                }
                None => lights.push_sky(color),
            },
            3 => lights.push(area(Surface::Rectangle, normal)),
            4 => lights.push(area(Surface::Disc, normal)),
            5 => lights.push(area(Surface::Cylinder, w)),
            other => {
                return Err(PyValueError::new_err(format!(
                    "unknown kind of light {other}"
                )));
            }
        }
    }
    Ok(lights)
}

fn arrays(py: Python<'_>, film: Film) -> PyResult<Bound<'_, PyDict>> {
    let Film {
        width,
        height,
        pixels,
        rays,
    } = film;
    let arrays = PyDict::new(py);
    arrays.set_item(
        "color",
        PyArray1::from_vec(py, pixels.color).reshape([height, width, 4])?,
    )?;
    arrays.set_item(
        "error",
        PyArray1::from_vec(py, pixels.error).reshape([height, width])?,
    )?;
    if let Some(seen) = pixels.surfaces {
        arrays.set_item(
            "depth",
            PyArray1::from_vec(py, seen.depth).reshape([height, width])?,
        )?;
        arrays.set_item(
            "normal",
            PyArray1::from_vec(py, seen.normal).reshape([height, width, 3])?,
        )?;
        let instance = PyArray1::from_vec(py, seen.instance).reshape([height, width])?;
        arrays.set_item("instance", instance)?;
    }
    let rays = PyArray0::from_owned_array(py, arr0(rays));
    arrays.set_item("rays", rays)?;
    Ok(arrays)
}
