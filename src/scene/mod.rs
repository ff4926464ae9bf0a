//! Scenes: config files, meshes, camera, lights.
pub mod json;
