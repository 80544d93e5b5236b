//! Vectorised ray tracing over a flat, instanced scene.
//!
//! Pure Rust but for [`python`]: `cargo test` alone tests it.
pub mod bvh;
mod huge_pages;
mod instance;
pub mod lanes;
mod prefetch;
pub mod ray;
pub mod render;
pub mod scalar;
pub mod scene;
pub mod screen;
pub mod shapes;
pub mod trace;

#[cfg(feature = "python")]
mod python;
