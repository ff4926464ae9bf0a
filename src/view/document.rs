//! The document of a tab: a scene file with nothing left open, and where its meshes are looked for.

use std::path::{Path, PathBuf};

use glam::Vec3;

use super::{MAX_VIEW_PIXELS, Options};
use crate::error::{Error, Result};
use crate::sampling::{Preset, SamplerSet};
use crate::scene::compile::{Scene, Stage};
use crate::scene::config::{SceneConfig, Shading, ViewConfig};
use crate::scene::load::{self, Limits, LoadedScene};
use crate::scene::mesh::Mesh;

/// The samplers of a document that names none: as `render`'s.
const SAMPLER: &str = "sobol";

/// The seed of a document that names none: as `render`'s.
const SEED: u64 = 1;

/// Triangles take about 250 bytes with their tree, texels 3 to 12: at most a gigabyte for each tab.
const LIMITS: Limits = Limits { triangles: 1 << 22, texels: 1 << 26 };

/// A scene file with sampler, seed and view made explicit.
#[derive(Debug, Clone, PartialEq)]
pub struct Document {
    /// Everything a scene file says; samplers (in full), seed and view are there.
    pub config: SceneConfig,
    /// The samplers.
    pub set: SamplerSet,
    /// Those of a second picture, if there is one.
    pub second: Option<SamplerSet>,
    /// The seed.
    pub seed: u64,
    /// Its file name, for messages and downloads.
    pub name: String,
    /// Folders of mesh files, in the order of looking.
    pub places: Vec<PathBuf>,
    /// Where other scene files are; nowhere if absent.
    pub folder: Option<PathBuf>,
    /// What its files gave to say when it was first read.
    pub warnings: Vec<String>,
}

impl Document {
    /// The document that tabs begin with.
    ///
    /// # Errors
    /// Those of reading a scene, and of [`Document::new`].
    pub fn first(options: &Options) -> Result<Self> {
        let (config, name, mut places) = match &options.scene {
            Some(path) => {
                let config = SceneConfig::read(path, &options.sets)?;
                (config, load::file_name(path), load::search_places(path, &options.data)?)
            }
            None => {
                let config = SceneConfig::parse(b"{}", "scene", &options.sets)?;
                (config, "scene.json".to_owned(), load::search_places(Path::new("configs/scene.json"), &options.data)?)
            }
        };
        // Who starts the program may name meshes anywhere, as for `render`; their folders become places.
        let all = places.clone();
        for name in &config.mesh_files {
            let found = all.iter().map(|place| place.join(name)).find(|path| path.is_file());
            places.extend(found.and_then(|path| path.parent().map(Path::to_owned)));
        }
        let folder = match &options.scene {
            Some(path) => std::path::absolute(path).ok().and_then(|path| path.parent().map(Path::to_owned)),
            None => Some(PathBuf::from("configs")).filter(|folder| folder.is_dir()),
        };
        let first = Self::new(config, &name, places, folder)?;
        let mut loaded = first.open()?;
        let scene = first.compile(&mut loaded)?;
        let warnings = [loaded.warnings, scene.warnings].concat();
        Ok(Self { warnings, ..first })
    }

    /// A document of `config`, checked but for its files.
    ///
    /// # Errors
    /// Kind `Input` for samplers that mean nothing, and more pixels than [`MAX_VIEW_PIXELS`].
    pub fn new(mut config: SceneConfig, name: &str, places: Vec<PathBuf>, folder: Option<PathBuf>) -> Result<Self> {
        let samplers = |key: &str, text: &str| {
            let named = |e: Error| Error { place: format!("{name}: {key}: {}", e.place), ..e };
            SamplerSet::parse(text, Preset::Best).map_err(named)
        };
        let set = samplers("sampler", config.sampler.as_deref().unwrap_or(SAMPLER))?;
        let view = config.view.get_or_insert_default();
        let second = view.second.as_deref().map(|text| samplers("view.second", text)).transpose()?;
        view.second = second.map(|set| set.to_string());
        let seed = config.seed.unwrap_or(SEED);
        let (w, h) = (config.framebuffer.res_w, config.framebuffer.res_h);
        if u64::from(w) * u64::from(h) > MAX_VIEW_PIXELS {
            let what = format!("expected at most {MAX_VIEW_PIXELS} pixels in the view, found {w} times {h}");
            return Err(Error::input(format!("{name}: framebuffer"), format!("{what} (remedy: `sampler-lab render`)")));
        }
        config.sampler = Some(set.to_string());
        config.seed = Some(seed);
        Ok(Self { config, set, second, seed, name: name.to_owned(), places, folder, warnings: Vec::new() })
    }

    /// How it is shown.
    ///
    /// # Panics
    /// Never: a document's view is there.
    pub fn view(&self) -> &ViewConfig {
        self.config.view.as_ref().expect("made explicit with the document")
    }

    /// The same with `text` for its JSON, under another name: from the page, so that its meshes have to lie in our places. One without a
    /// view is shown as this one is.
    ///
    /// # Errors
    /// Those of reading a scene file, and of [`Document::new`].
    pub fn with_text(&self, text: &[u8], name: &str) -> Result<Self> {
        let mut config = SceneConfig::parse(text, name, &[])?;
        config.view = config.view.or_else(|| self.config.view.clone());
        Self::new(config, name, self.places.clone(), self.folder.clone())
    }

    /// The same after `--set`.
    ///
    /// # Errors
    /// As [`Document::with_text`].
    pub fn with_sets(&self, sets: &[String]) -> Result<Self> {
        let config = SceneConfig::parse(self.config.to_json().as_bytes(), &self.name, sets)?;
        Self::new(config, &self.name, self.places.clone(), self.folder.clone())
    }

    /// Columns and rows.
    pub fn size(&self) -> (u32, u32) {
        (self.config.framebuffer.res_w, self.config.framebuffer.res_h)
    }

    /// Reads its meshes.
    ///
    /// # Errors
    /// Those of [`load::open_within`].
    pub fn open(&self) -> Result<LoadedScene> {
        load::open_within(self.config.clone(), &self.name, &self.places, LIMITS)
    }

    /// Compiles what was loaded, whose triangles move into the scene; materials, and which triangle has which, stay.
    ///
    /// # Errors
    /// Those of [`Scene::new`].
    pub fn compile(&self, loaded: &mut LoadedScene) -> Result<Scene> {
        let mesh = std::mem::take(&mut loaded.mesh);
        loaded.mesh.materials.clone_from(&mesh.materials);
        loaded.mesh.material_of.clone_from(&mesh.material_of);
        Scene::new(&self.config, mesh, self.size(), Stage::Final)
    }

    /// Whether the picture's truth is the same: only how it is sampled, weighted and shown differs.
    pub fn has_the_truth_of(&self, other: &Self) -> bool {
        let truth = |d: &Self| {
            let mut config = d.config.clone();
            config.sampler = None;
            config.seed = None;
            config.view = None;
            config.estimator = crate::scene::config::Estimator::Unbiased;
            config.framebuffer.sppx = 1;
            config.framebuffer.exposure = 1.0;
            config
        };
        self.places == other.places && truth(self) == truth(other)
    }

    /// Whether every sample is the same: only how it is shown differs ([`is_of_showing`](super::message::is_of_showing)).
    pub fn has_the_samples_of(&self, other: &Self) -> bool {
        let mut config = other.config.clone();
        config.framebuffer.exposure = self.config.framebuffer.exposure;
        let ViewConfig { second, seconds, .. } = other.view().clone();
        config.view = Some(ViewConfig { second, seconds, ..self.view().clone() });
        self.places == other.places && self.name == other.name && self.config == config
    }

    /// Scene files beside the first one, by name.
    pub fn neighbours(&self) -> Vec<String> {
        let Some(entries) = self.folder.as_ref().and_then(|folder| std::fs::read_dir(folder).ok()) else {
            return Vec::new();
        };
        let names = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
        let mut names: Vec<String> = names.filter(|name| name.ends_with(".json")).take(200).collect();
        names.sort();
        names
    }

    /// The document in the file `name` beside the first one.
    ///
    /// # Errors
    /// Kind `Input` where it is none of [`Document::neighbours`], and as [`Document::with_text`].
    pub fn neighbour(&self, name: &str) -> Result<Self> {
        let folder = self.folder.as_ref().filter(|_| self.neighbours().iter().any(|n| n == name));
        let Some(folder) = folder else {
            let what = format!("expected one of the scene files {}, found {name:?}", self.neighbours().join(" "));
            return Err(Error::input("load", what));
        };
        let path = folder.join(name);
        let bytes = std::fs::read(&path)
            .map_err(|e| Error::input(name, format!("expected a readable scene file (JSON), found: {e}")))?;
        self.with_text(&bytes, name)
    }

    /// The document of a mesh alone, looked at from outside: for one that was dropped without a config.
    ///
    /// # Errors
    /// Those of reading it, and of [`Document::new`].
    pub fn of_mesh(&self, meshes: Vec<String>, places: Vec<PathBuf>) -> Result<Self> {
        let mut config = self.config.clone();
        config.materials.clear();
        config.mesh_files = meshes;
        config.unmodelled.clear();
        let name = "dropped.json";
        let loaded = load::open_within(config.clone(), name, &places, LIMITS)?;
        let (centre, radius) = bounds(&loaded.mesh);
        let half = libm::tan(f64::from(config.camera.fov_degrees).to_radians() / 2.0) as f32;
        let back = Vec3::new(0.5, 0.4, 1.0).normalize();
        config.camera.pos = rounded(centre + back * (radius * 1.1 / half.min(1.0)));
        config.camera.dir = rounded_direction(-back);
        config.camera.up = Vec3::Y;
        config.camera.lens_radius = 0.0;
        let has_light = loaded.mesh.materials.iter().any(|material| material.is_emitter);
        config.shading = if has_light { Shading::Direct } else { Shading::Albedo };
        Self::new(config, name, places, self.folder.clone())
    }
}

/// Middle and half diagonal of the box around all triangles; a unit around the origin where there are none.
pub fn bounds(mesh: &Mesh) -> (Vec3, f32) {
    let corners = || mesh.positions.iter().flatten();
    if mesh.is_empty() {
        return (Vec3::ZERO, 1.0);
    }
    let low = corners().fold(Vec3::INFINITY, |low, p| low.min(*p));
    let high = corners().fold(Vec3::NEG_INFINITY, |high, p| high.max(*p));
    (low + (high - low) / 2.0, ((high - low).length() / 2.0).max(f32::MIN_POSITIVE))
}

/// Four significant digits, as a person would write.
fn rounded(v: Vec3) -> Vec3 {
    v.to_array().map(|c| format!("{c:.3e}").parse().unwrap_or(c)).into()
}

fn rounded_direction(v: Vec3) -> Vec3 {
    v.to_array().map(|c| format!("{c:.4}").parse().unwrap_or(c)).into()
}
