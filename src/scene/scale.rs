//! A scene in another unit of length.

use super::config::SceneConfig;
use super::mesh::Mesh;

/// The scene with every length multiplied by `factor`: corners of triangles, camera position, lens radius, focal depth.
///
/// Directions, angles, colours and emitted radiance have no length in them, and radiance does not change with the unit of
/// length, so the picture is the same but for roundings; for a power of two there are none, as long as nothing leaves the
/// range of normal numbers (auto focus, which takes logarithms of depths, may round otherwise).
pub fn scaled(config: &SceneConfig, mesh: &Mesh, factor: f32) -> (SceneConfig, Mesh) {
    let (mut config, mut mesh) = (config.clone(), mesh.clone());
    config.camera.pos *= factor;
    config.camera.lens_radius *= factor;
    config.camera.focal_depth *= factor;
    for corner in mesh.positions.iter_mut().flatten() {
        *corner *= factor;
    }
    (config, mesh)
}
