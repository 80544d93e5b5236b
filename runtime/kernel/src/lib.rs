//! Vectorised ray tracing over a flat, instanced scene.
//!
//! Pure Rust but for [`python`]: `cargo test` alone tests it.
pub mod ray;

#[cfg(feature = "python")]
mod python;
