//! Scenes: config files, meshes, camera, lights.
pub mod config;
pub mod json;
pub mod load;
pub mod mesh;
pub mod obj;
