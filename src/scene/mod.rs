//! Scenes: config files, meshes, camera, lights.
pub mod camera;
pub mod compile;
pub mod config;
pub mod cut;
pub mod geometry;
pub mod json;
pub mod light;
pub mod load;
pub mod mesh;
pub mod obj;
pub mod scale;
