//! Vectorised ray tracing over a flat, instanced scene.
//!
//! Pure Rust but for [`python`]: `cargo test` alone tests it.
pub mod lanes;
pub mod ray;
pub mod render;
pub mod scalar;
pub mod shapes;

#[cfg(feature = "python")]
mod python;
