//! The face the kernel shows to Python: `runtime._kernel`.
#[allow(dead_code)]
mod render;

use pyo3::prelude::*;

/// `runtime._kernel`: see `runtime/_kernel.pyi` for the contract.
#[pymodule]
fn _kernel(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    Ok(())
}
