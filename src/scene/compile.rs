//! From configuration and mesh to a scene: features become types, and what is absent claims no numbers.

use glam::Vec3;

use crate::accel::Accel;
use crate::error::{Error, Result};
use crate::sampling::{Decision, SampleLayout};

use super::camera::{Aperture, Camera, PixelSample};
use super::config::{Estimator, SceneConfig, Shading};
use super::geometry::{self, Face};
use super::light::LightSet;
use super::mesh::{Material, Mesh, Texture};

/// The four stages of the sheet's Figure 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// Pixel centres, albedo.
    Start,
    /// + a sampled place in the pixel.
    Aa,
    /// + the lens.
    Dof,
    /// + area lights: the whole scene.
    Final,
}

impl Stage {
    /// All stages, in the sheet's order.
    pub const ALL: [Self; 4] = [Self::Start, Self::Aa, Self::Dof, Self::Final];

    /// The word on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Start => "start",
            Self::Aa => "aa",
            Self::Dof => "dof",
            Self::Final => "final",
        }
    }
}

/// A scene ready to render. It knows no sampler, only which decisions it makes.
#[derive(Debug)]
pub struct Scene {
    /// Triangles, materials, textures.
    pub mesh: Mesh,
    /// The triangles as shading reads them.
    pub faces: Vec<Face>,
    /// Tree over the triangles.
    pub accel: Accel,
    /// Where rays start.
    pub camera: Camera,
    /// What lights there are; `None` where albedo is shown and no light is asked.
    pub lights: Option<LightSet>,
    /// Whether the choice among lights is divided by its probability.
    pub estimator: Estimator,
    /// Who reads which numbers.
    pub layout: SampleLayout,
    /// Things a user should hear of, among them what could not be focused on.
    pub warnings: Vec<String>,
    focus: Focus,
    /// What the tree's boxes are padded for.
    tree_reach: f32,
}

/// What of a scene does not depend on camera and lights.
struct Body {
    mesh: Mesh,
    faces: Vec<Face>,
    accel: Accel,
    tree_reach: f32,
}

/// Which tree a changed scene has to have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tree {
    /// The one that [`Scene::new`] builds, for the same bits.
    Exact,
    /// One that finds every hit: for a camera on its way.
    Roomy,
}

/// How the plane of focus came about.
#[derive(Debug, Clone, Copy)]
struct Focus {
    auto: bool,
    configured: f32,
}

/// Largest extent of a scene and distance of its camera: products of three coordinates must stay finite in f32.
const MAX_REACH: f32 = 1e12;

/// Largest ratio of lens radius to focal depth: a ray from the lens's rim to the point in focus is that much steeper than any
/// other, and the square of it must stay finite in f32 with room to spare.
const MAX_STEEPNESS: f32 = 1e12;

/// Bytes a triangle takes at most, see [`Scene::most_bytes`].
const BUILD_BYTES: u64 = 460;

/// Bytes a pixel takes: 32 for tiles' results and the image, or 36 for the image, its compressed blocks and the file.
const PIXEL_BYTES: u64 = 36;

impl Scene {
    /// Compiles a loaded scene for an image of `size` (columns, rows).
    ///
    /// # Errors
    /// Kind `Input` where coordinates or the lens are too large for single precision, or the focal depth too small beside the lens.
    pub fn new(config: &SceneConfig, mesh: Mesh, size: (u32, u32), stage: Stage) -> Result<Self> {
        let reach = reach(&mesh, config.camera.pos);
        check_reach(reach)?;
        let accel = Accel::new(&geometry::triangles(&mesh), reach);
        // After the tree, as what it took while it was built is free again.
        let faces = geometry::faces(&mesh);
        let body = Body { faces, accel, tree_reach: reach, mesh };
        Self::assemble(config, body, size, stage).map_err(|(error, _)| error)
    }

    /// The same meshes under another config, with `materials` in place of theirs: what [`Scene::new`] gives, without what did
    /// not change being made again. On an error the scene stays as it is.
    ///
    /// Boxes are padded by how far rays reach, so a camera that leaves the scene's surroundings takes a new tree. With
    /// [`Tree::Roomy`] a tree that is padded for more is kept, and a new one is padded for twice the reach: every ray then meets
    /// what it should, but the last bits of a distance may not be those of [`Scene::new`]. [`Tree::Exact`] makes up for that.
    /// Returns whether the tree was built.
    ///
    /// # Errors
    /// As [`Scene::new`].
    pub fn revise(
        &mut self,
        config: &SceneConfig,
        materials: &[Material],
        size: (u32, u32),
        stage: Stage,
        tree: Tree,
    ) -> Result<bool> {
        let reach = reach(&self.mesh, config.camera.pos);
        check_reach(reach)?;
        let keeps = match tree {
            Tree::Exact => reach == self.tree_reach,
            Tree::Roomy => reach <= self.tree_reach,
        };
        let mut body = self.take_body();
        let old = std::mem::replace(&mut body.mesh.materials, materials.to_vec());
        if !keeps {
            body.tree_reach = if tree == Tree::Roomy { (2.0 * reach).min(MAX_REACH) } else { reach };
            body.accel = Accel::new(&geometry::triangles(&body.mesh), body.tree_reach);
        }
        match Self::assemble(config, body, size, stage) {
            Ok(scene) => *self = scene,
            Err((error, mut body)) => {
                body.mesh.materials = old;
                let Body { mesh, faces, accel, tree_reach } = *body;
                (self.mesh, self.faces, self.accel, self.tree_reach) = (mesh, faces, accel, tree_reach);
                return Err(error);
            }
        }
        Ok(!keeps)
    }

    /// Whether the tree is padded for exactly what rays reach, as that of [`Scene::new`].
    pub fn has_exact_tree(&self) -> bool {
        self.tree_reach == self.reach()
    }

    fn take_body(&mut self) -> Body {
        Body {
            mesh: std::mem::take(&mut self.mesh),
            faces: std::mem::take(&mut self.faces),
            accel: std::mem::replace(&mut self.accel, Accel::new(&[], 0.0)),
            tree_reach: self.tree_reach,
        }
    }

    /// Puts camera and lights to triangles and tree; an error gives these back.
    fn assemble(
        config: &SceneConfig,
        body: Body,
        size: (u32, u32),
        stage: Stage,
    ) -> std::result::Result<Self, (Error, Box<Body>)> {
        let Body { mesh, faces, accel, tree_reach } = body;
        let mut layout = SampleLayout::default();
        let pixel = match stage {
            Stage::Start => PixelSample::Center,
            _ => PixelSample::Sampled(layout.claim_2d(Decision::Pixel)),
        };
        let has_lens = config.camera.lens_radius > 0.0 && matches!(stage, Stage::Dof | Stage::Final);
        let aperture = if has_lens {
            let lens = layout.claim_2d(Decision::Lens);
            Aperture::ThinLens { radius: config.camera.lens_radius, focal_depth: config.camera.focal_depth, lens }
        } else {
            Aperture::Pinhole
        };
        let direct = stage == Stage::Final && config.shading == Shading::Direct;
        let lights = direct.then(|| LightSet::new(&mesh, &mut layout));
        let mut warnings = Vec::new();
        if matches!(lights, Some(LightSet::Dark)) {
            warnings.push("the scene has no light of positive power: all but emitters is black".to_owned());
        }
        if stage == Stage::Dof && !has_lens {
            warnings.push("the camera is a pinhole: stage dof adds nothing to stage aa".to_owned());
        }
        let camera = Camera::new(&config.camera, size, pixel, aperture);
        let focus = Focus { auto: config.auto_focus, configured: config.camera.focal_depth };
        let estimator = config.estimator;
        let mut scene = Self { mesh, faces, accel, camera, lights, estimator, layout, warnings, focus, tree_reach };
        scene.refocus();
        match scene.check_lens() {
            Ok(()) => Ok(scene),
            Err(error) => Err((error, Box::new(scene.take_body()))),
        }
    }

    /// Whether single precision can hold the lens's rays: else their directions would overflow, meet nothing, and the picture be black.
    fn check_lens(&self) -> Result<()> {
        let Aperture::ThinLens { radius, focal_depth, .. } = self.camera.aperture else { return Ok(()) };
        if 2.0 * radius > MAX_REACH {
            let what = format!("expected a length up to {:e}, found {radius:e}", 0.5 * MAX_REACH);
            return Err(Error::input("camera.lens_radius", what));
        }
        if radius / focal_depth > MAX_STEEPNESS {
            let least = radius / MAX_STEEPNESS;
            let what = format!("expected at least {least:e} with a lens of radius {radius:e}, found {focal_depth:e}");
            return Err(Error::input("camera.focal_depth", what));
        }
        Ok(())
    }

    /// Changes the image's size; with auto focus on, the plane of focus is found anew.
    pub fn resize(&mut self, size: (u32, u32)) {
        if size != self.camera.size() {
            self.camera.resize(size);
            self.refocus();
        }
    }

    fn refocus(&mut self) {
        let Focus { auto: true, configured } = self.focus else { return };
        if !matches!(self.camera.aperture, Aperture::ThinLens { .. }) {
            return;
        }
        let found = self.camera.auto_focus(&self.accel);
        if found.is_none() {
            let warning = format!("auto focus: no ray meets anything; the focal depth stays {configured}");
            if !self.warnings.contains(&warning) {
                self.warnings.push(warning);
            }
        }
        if let Aperture::ThinLens { focal_depth, .. } = &mut self.camera.aperture {
            *focal_depth = found.unwrap_or(configured);
        }
    }

    /// The focal depth in use, where there is a lens.
    pub fn focal_depth(&self) -> Option<f32> {
        match self.camera.aperture {
            Aperture::Pinhole => None,
            Aperture::ThinLens { focal_depth, .. } => Some(focal_depth),
        }
    }

    /// Bound for coordinates and distances of everything a ray can start from or meet, scene units.
    pub fn reach(&self) -> f32 {
        reach(&self.mesh, self.camera.pos())
    }

    /// Bytes that making a scene of this mesh and rendering `pixels` of it take at most: known before the work starts.
    ///
    /// A triangle takes 100 bytes of the mesh, and what was read of its file, some 40, may not be back with the system yet. While the tree
    /// is built, 36 of corners, 32 of its box, and in the builder 4 of an index, 16 of keys to sort by, 96 of nodes that are merged and 96
    /// of the tree's are added: 420. Afterwards 128 of its face, 75 of the binary tree and 89 of the one for wide registers: 432 as
    /// measured on landscapes, 460 (`BUILD_BYTES`) for trees whose nodes are less full.
    pub fn most_bytes(mesh: &Mesh, pixels: u64) -> u64 {
        BUILD_BYTES * mesh.len() as u64
            + mesh.textures.iter().map(|texture| texture.bytes() as u64).sum::<u64>()
            + PIXEL_BYTES * pixels
    }

    /// Bytes that triangles, tree and textures take.
    pub fn bytes(&self) -> usize {
        let mesh = &self.mesh;
        self.accel.bytes()
            + size_of_val(self.faces.as_slice())
            + size_of_val(mesh.positions.as_slice())
            + size_of_val(mesh.normals.as_slice())
            + size_of_val(mesh.uvs.as_slice())
            + mesh.textures.iter().map(Texture::bytes).sum::<usize>()
    }
}

/// Whether single precision can hold a scene of this reach.
///
/// # Errors
/// Kind `Input` with the bound.
pub fn check_reach(reach: f32) -> Result<()> {
    // Written so that a reach which is no number is refused, too.
    if reach <= MAX_REACH {
        return Ok(());
    }
    Err(Error::input("scene", format!("expected coordinates up to {MAX_REACH:e}, found a reach of {reach:e}")))
}

/// Bound for coordinates and distances of everything a ray can start from or meet.
fn reach(mesh: &Mesh, eye: Vec3) -> f32 {
    let largest = mesh.positions.iter().flatten().fold(eye.abs(), |m, p| m.max(p.abs())).max_element();
    2.0 * largest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::scenes::Landscape;

    /// What is stated is enough for what is there afterwards, and no more than three times as much.
    #[test]
    fn the_memory_that_is_stated_holds_the_scene() {
        for quads in [3, 8] {
            let landscape = Landscape::of_quads(quads);
            let stated = Scene::most_bytes(&landscape.mesh(), 64 * 36);
            let there = (landscape.scene((64, 36)).bytes() + 12 * 64 * 36) as u64;
            assert!((there..3 * there).contains(&stated), "{quads} quads: {stated} stated for {there}");
        }
        let mut mesh = Landscape::of_quads(1).mesh();
        let without = Scene::most_bytes(&mesh, 1);
        mesh.textures.push(Texture::new(5, vec![[0.5; 3]; 20]));
        assert_eq!(Scene::most_bytes(&mesh, 2) - without, 20 * 12 + PIXEL_BYTES);
    }
}
