//! Scenes: config files, meshes, camera, lights.
