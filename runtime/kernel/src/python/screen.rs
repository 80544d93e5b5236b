//! `runtime._kernel.screen`, `png` and `jpeg`: from linear colours to bytes.
use std::fmt::Display;

use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use super::arrays::Rows;
use crate::screen as shown;

/// See `runtime/_kernel.pyi`.
#[pyfunction]
#[pyo3(signature = (color, factor))]
pub fn screen<'py>(
    py: Python<'py>,
    color: &Bound<'py, PyAny>,
    factor: Option<f32>,
) -> PyResult<Bound<'py, PyArray2<u8>>> {
    let color = Rows::<[f32; 4]>::new("color", color)?;
    let color = color.rows();
    let display = factor.map_or(shown::Display::Data, shown::Display::Light);
    let pixels = py.detach(|| shown::show(color, display));
    PyArray1::from_vec(py, pixels.into_flattened()).reshape([color.len(), 4])
}

/// See `runtime/_kernel.pyi`.
#[pyfunction]
pub fn png<'py>(
    py: Python<'py>,
    pixels: &Bound<'py, PyAny>,
    width: usize,
) -> PyResult<Bound<'py, PyBytes>> {
    file(py, pixels, |pixels| shown::png(pixels, width))
}

/// See `runtime/_kernel.pyi`.
#[pyfunction]
pub fn jpeg<'py>(
    py: Python<'py>,
    pixels: &Bound<'py, PyAny>,
    width: usize,
) -> PyResult<Bound<'py, PyBytes>> {
    file(py, pixels, |pixels| shown::jpeg(pixels, width))
}

fn file<'py, E: Display>(
    py: Python<'py>,
    pixels: &Bound<'py, PyAny>,
    encode: impl FnOnce(&[[u8; 4]]) -> Result<Vec<u8>, E> + Send,
) -> PyResult<Bound<'py, PyBytes>> {
    let pixels = Rows::<[u8; 4]>::new("pixels", pixels)?;
    let pixels = pixels.rows();
    let file = py.detach(move || encode(pixels).map_err(|error| error.to_string()));
    let file = file.map_err(PyValueError::new_err)?;
    Ok(PyBytes::new(py, &file))
}
