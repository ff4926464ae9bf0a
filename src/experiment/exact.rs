//! Scenes whose every pixel is known in closed form, recognised by their numbers rather than by their name.

use glam::{DVec3, Vec2, Vec3};

use super::backend::Size;
use crate::analytic::Horizon;
use crate::analytic::penumbra::{Penumbra, Pinhole};
use crate::error::Result;
use crate::film::Image;
use crate::scene::config::Shading;
use crate::scene::load::LoadedScene;
use crate::scene::mesh::{Material, Mesh, Texture};

/// Raised whenever the bits of an exact image may change.
pub const ALGORITHM: u32 = 1;

/// A scene of which every pixel is known.
#[derive(Debug)]
pub enum ClosedForm {
    /// The lab's `penumbra`.
    Penumbra(Penumbra),
    /// The lab's `horizon`, whose colours are its files'.
    Horizon {
        /// What is seen of the plane.
        shape: Horizon,
        /// Linear colours of the pale tile, the dark tile and the sky.
        colours: [Vec3; 3],
    },
}

/// The closed form of a scene, where the scene is one of the lab's number by number and the image shows nothing else: an
/// edited file has none.
pub fn closed_form(loaded: &LoadedScene, size: Size) -> Option<ClosedForm> {
    penumbra(loaded, size).map(ClosedForm::Penumbra).or_else(|| {
        let (shape, colours) = horizon(loaded, size)?;
        Some(ClosedForm::Horizon { shape, colours })
    })
}

/// The exact image, rounded once to `f32`.
///
/// # Errors
/// Kind `Input` where a pixel's quadrature does not reach its tolerance.
pub fn image(exact: &ClosedForm, size: Size) -> Result<Image> {
    let pixels = match exact {
        ClosedForm::Penumbra(exact) => exact.image()?.into_iter().map(|radiance| [radiance as f32; 3]).collect(),
        ClosedForm::Horizon { shape, colours } => {
            let [pale, dark, sky] = colours.map(|colour| colour.as_dvec3().to_array());
            let seen = shape.image()?.into_iter();
            seen.map(|seen| std::array::from_fn(|c| seen.colour(pale[c], dark[c], sky[c]) as f32)).collect()
        }
    };
    Ok(Image { width: size.width, height: size.height, pixels })
}

fn penumbra(loaded: &LoadedScene, size: Size) -> Option<Penumbra> {
    // Images too wide for the plane alone are refused there.
    let exact = Penumbra::standard(size.width, size.height).ok()?;
    let is_it = loaded.config.shading == Shading::Direct
        && has_camera(loaded, exact.camera())
        && has_its_surfaces(&loaded.mesh, &exact, size);
    is_it.then_some(exact)
}

/// A pinhole in the same place, looking the same way.
fn has_camera(loaded: &LoadedScene, expected: &Pinhole) -> bool {
    let found = &loaded.config.camera;
    let frame = |dir: DVec3, up: DVec3| [dir.normalize(), dir.cross(up).normalize()];
    let found_frame = frame(found.dir.as_dvec3(), found.up.as_dvec3());
    let expected_frame = frame(expected.direction, expected.up);
    found.lens_radius == 0.0
        && f64::from(found.fov_degrees) == expected.fov_y_degrees
        && found.pos.as_dvec3() == expected.position
        // A direction may have any length: what the lengths' roundings leave is far below a pixel.
        && std::iter::zip(found_frame, expected_frame).all(|(a, b)| a.distance(b) < 1e-12)
}

/// The plane and its sky, shown as albedo; colours are free.
fn horizon(loaded: &LoadedScene, size: Size) -> Option<(Horizon, [Vec3; 3])> {
    // Images too wide for plane and sky are refused there.
    let exact = Horizon::standard(size.width, size.height).ok()?;
    if loaded.config.shading != Shading::Albedo || !has_camera(loaded, exact.camera()) {
        return None;
    }
    let mesh = &loaded.mesh;
    let [near, far, spread] = Horizon::STANDARD;
    let quad = |corners: [[f64; 3]; 4]| corners.map(DVec3::from_array).to_vec();
    let side = spread * far;
    let mut parts = vec![Part::of(quad([[-side, 0.0, far], [side, 0.0, far], [side, far, far], [-side, far, far]]))];
    // The plane's bands, each twice as deep as the one before it.
    let mut depth = near;
    while depth < far {
        let [low, high] = [spread * depth, spread * 2.0 * depth];
        let (z, next) = (depth, 2.0 * depth);
        parts.push(Part::of(quad([[-low, 0.0, z], [-high, 0.0, next], [high, 0.0, next], [low, 0.0, z]])));
        depth = next;
    }
    let mut materials = [None, None];
    for triangle in 0..mesh.len() {
        let corners = mesh.positions[triangle].map(Vec3::as_dvec3);
        let part = parts.iter().position(|part| corners.iter().all(|corner| part.corners.contains(corner)))?;
        parts[part].take(corners);
        let is_plane = part > 0;
        let material = mesh.material_of[triangle];
        let is_right = *materials[usize::from(is_plane)].get_or_insert(material) == material
            && (!is_plane
                || std::iter::zip(corners, mesh.uvs[triangle]).all(|(corner, uv)| has_its_tiles(&exact, corner, uv)));
        if !is_right {
            return None;
        }
    }
    if !parts.iter().all(|part| part.is_complete(area(&part.corners))) {
        return None;
    }
    let [sky, plane] = materials.map(|m| m.map(|m| &mesh.materials[m as usize]));
    let (sky, plane) = (sky?, plane?);
    let [pale, dark] = checker(&mesh.textures[plane.texture? as usize], exact.plane().ramp)?;
    sky.texture.is_none().then_some((exact, [plane.albedo * pale, plane.albedo * dark, sky.albedo]))
}

/// The texture holds two tiles a side.
fn has_its_tiles(exact: &Horizon, corner: DVec3, uv: Vec2) -> bool {
    let tiles = exact.plane().tiles(corner.x, corner.z);
    [f64::from(uv.x), f64::from(uv.y)] == tiles.map(|tile| tile / 2.0)
}

/// Colours of the pale and the dark tile of a texture that holds 2 × 2 of them, the lower left one pale, each of 1/`ramp`
/// texels a side.
fn checker(texture: &Texture, ramp: f64) -> Option<[Vec3; 2]> {
    let (width, height) = (texture.width, texture.height);
    if [width, height].map(f64::from) != [2.0 / ramp; 2] {
        return None;
    }
    let is_pale = |column: u32, row: u32| (column < width / 2) == (row >= height / 2);
    let [pale, dark] = [texture.texel(0, height - 1), texture.texel(0, 0)];
    let is_checker = (0..height).all(|row| {
        (0..width).all(|column| texture.texel(column, row) == if is_pale(column, row) { pale } else { dark })
    });
    is_checker.then_some([pale, dark].map(Vec3::from_array))
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
