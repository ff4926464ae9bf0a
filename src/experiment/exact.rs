//! Scenes whose every pixel is known in closed form, recognised by their numbers rather than by their name.

use glam::{DVec3, Vec3};

use super::backend::Size;
use crate::analytic::penumbra::Penumbra;
use crate::error::Result;
use crate::film::Image;
use crate::scene::config::Shading;
use crate::scene::load::LoadedScene;
use crate::scene::mesh::{Material, Mesh};

/// Raised whenever the bits of an exact image may change.
pub const ALGORITHM: u32 = 1;

/// The closed form of a scene, where the scene is the lab's `penumbra` number by number and the image shows its plane
/// alone: an edited file has none.
pub fn closed_form(loaded: &LoadedScene, size: Size) -> Option<Penumbra> {
    // Images too wide for the plane alone are refused there.
    let exact = Penumbra::standard(size.width, size.height).ok()?;
    (has_its_camera(loaded, &exact) && has_its_surfaces(&loaded.mesh, &exact, size)).then_some(exact)
}

/// The exact image, rounded once to `f32`; the scene is grey.
///
/// # Errors
/// Kind `Input` where a pixel's quadrature does not reach its tolerance.
pub fn image(exact: &Penumbra, size: Size) -> Result<Image> {
    let pixels = exact.image()?.into_iter().map(|radiance| [radiance as f32; 3]).collect();
    Ok(Image { width: size.width, height: size.height, pixels })
}

/// A pinhole in the same place, looking the same way, at surfaces that are lit.
fn has_its_camera(loaded: &LoadedScene, exact: &Penumbra) -> bool {
    let (found, expected) = (&loaded.config.camera, exact.camera());
    let frame = |dir: DVec3, up: DVec3| [dir.normalize(), dir.cross(up).normalize()];
    let found_frame = frame(found.dir.as_dvec3(), found.up.as_dvec3());
    let expected_frame = frame(expected.direction, expected.up);
    loaded.config.shading == Shading::Direct
        && found.lens_radius == 0.0
        && f64::from(found.fov_degrees) == expected.fov_y_degrees
        && found.pos.as_dvec3() == expected.position
        // A direction may have any length: what the lengths' roundings leave is far below a pixel.
        && std::iter::zip(found_frame, expected_frame).all(|(a, b)| a.distance(b) < 1e-12)
}

/// Every triangle belongs to the plane, the light or the blocker, each with its own numbers, and the plane fills the
/// picture.
fn has_its_surfaces(mesh: &Mesh, exact: &Penumbra, size: Size) -> bool {
    let mut parts = [Part::of(exact.light().corners.clone()), Part::of(exact.blocker().to_vec()), Part::of(Vec::new())];
    for triangle in 0..mesh.len() {
        let corners = mesh.positions[triangle].map(Vec3::as_dvec3);
        let material = &mesh.materials[mesh.material_of[triangle] as usize];
        let winding = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        let (part, is_right) = if material.is_emitter {
            (0, emits(material, exact.light().emission) && winding == DVec3::NEG_Y)
        } else if corners.iter().all(|corner| corner.y == exact.plane().point.y) {
            let is_flat = mesh.normals[triangle].iter().all(|normal| normal.as_dvec3() == exact.plane().normal);
            (2, is_flat && winding == exact.plane().normal && is_grey(material, exact.plane().albedo))
        } else {
            (1, true)
        };
        if !is_right || !parts[part].take(corners) {
            return false;
        }
    }
    let [light, blocker, plane] = &parts;
    light.is_complete(area(&light.corners)) && blocker.is_complete(area(&blocker.corners)) && plane.covers(exact, size)
}

/// Area of a convex polygon.
fn area(corners: &[DVec3]) -> f64 {
    let fan = corners.windows(2).map(|pair| (pair[0] - corners[0]).cross(pair[1] - corners[0]));
    fan.sum::<DVec3>().length() / 2.0
}

fn emits(material: &Material, emission: f64) -> bool {
    material.emission.as_dvec3() == DVec3::splat(emission)
}

fn is_grey(material: &Material, albedo: f64) -> bool {
    material.texture.is_none() && material.albedo.as_dvec3() == DVec3::splat(albedo)
}

/// The triangles of one of the scene's three surfaces.
struct Part {
    /// Corners that its triangles may have; any, where there are none.
    corners: Vec<DVec3>,
    area: f64,
    low: DVec3,
    high: DVec3,
}

impl Part {
    fn of(corners: Vec<DVec3>) -> Self {
        Self { corners, area: 0.0, low: DVec3::INFINITY, high: DVec3::NEG_INFINITY }
    }

    /// Adds a triangle; whether it may belong here.
    fn take(&mut self, triangle: [DVec3; 3]) -> bool {
        let [a, b, c] = triangle;
        self.area += (b - a).cross(c - a).length() / 2.0;
        self.low = triangle.iter().fold(self.low, |low, &corner| low.min(corner));
        self.high = triangle.iter().fold(self.high, |high, &corner| high.max(corner));
        self.corners.is_empty() || triangle.iter().all(|corner| self.corners.contains(corner))
    }

    /// Triangles between a quad's corners whose areas add up to the quad's are the quad.
    fn is_complete(&self, area: f64) -> bool {
        (self.area / area - 1.0).abs() < 1e-12
    }

    /// The triangles fill a rectangle along the axes that reaches beyond everything the picture shows.
    fn covers(&self, exact: &Penumbra, size: Size) -> bool {
        let extent = self.high - self.low;
        let (width, height) = (f64::from(size.width), f64::from(size.height));
        let corners = [(0.0, 0.0), (width, 0.0), (0.0, height), (width, height)];
        let is_inside = |(x, y)| {
            let seen = exact.receiver(x, y).point;
            seen.x > self.low.x && seen.x < self.high.x && seen.z > self.low.z && seen.z < self.high.z
        };
        self.is_complete(extent.x * extent.z) && corners.into_iter().all(is_inside)
    }
}
