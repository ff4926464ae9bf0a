//! Scenes: config files, meshes, camera, lights.
pub mod config;
pub mod json;
