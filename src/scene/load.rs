//! Opens a scene: config, OBJ meshes, MTL materials and textures become plain data, or an error that says where.
//!
//! Nothing is written and nothing printed; what a person should know comes back as warnings.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use glam::Vec3;
use rayon::prelude::*;
use sha2::{Digest, Sha256};

use super::config::{Estimator, FramebufferConfig, MaterialPatch, SceneConfig};
use super::cut::{self, Told, Triangles};
use super::json::suggestion;
use super::light::luma;
use super::mesh::{Material, Mesh, Texture};
use super::obj::{self, Faces, MtlMaterial, Obj};
use crate::error::{Error, Result};
use crate::film::srgb_decode;

/// Albedo of faces without a material, and of materials without a colour.
const DEFAULT_ALBEDO: f32 = 0.8;

/// Strength of an emitter (by its name or type) that gives none.
const DEFAULT_STRENGTH: f32 = 10.0;

/// Most pixels a texture, 2^26 (8192 × 8192): with 16 bits a channel its linear texels take 0.8 GB.
const MAX_TEXELS: u64 = 1 << 26;

/// Most bytes a mesh file, 2^30: reading takes about three times as much memory.
const MAX_MESH_BYTES: u64 = 1 << 30;

/// Parts of a file whose polygons are cut at a time.
const PARTS_AT_ONCE: usize = 64;

/// Where to look, and what to change, beyond the scene file itself.
#[derive(Debug, Clone, Default)]
pub struct OpenOptions {
    /// Folders of `--data`, searched last, in order.
    pub data: Vec<PathBuf>,
    /// `--set KEY=VALUE`, applied in order before anything is checked; see [`SceneConfig::parse`].
    pub sets: Vec<String>,
}

/// How large a scene of [`open_within`] may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Triangles of all its meshes.
    pub triangles: usize,
    /// Texels of all its textures.
    pub texels: u64,
}

/// What a scene may read, and how much.
struct Within {
    /// The folders that files have to lie in, links followed.
    folders: Vec<PathBuf>,
    limits: Limits,
}

/// One file that was read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InputFile {
    /// Its name as the file that refers to it writes it; for the scene file, its file name. No folder of this machine.
    pub name: String,
    /// SHA-256 of its bytes, 64 lower-case hexadecimal digits.
    pub sha256: String,
}

/// A scene as its files describe it.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadedScene {
    /// The full state, every default explicit.
    pub config: SceneConfig,
    /// All triangles of all mesh files.
    pub mesh: Mesh,
    /// The files in the order they were first read: scene file, then mesh by mesh its OBJ, MTL and textures.
    pub inputs: Vec<InputFile>,
    /// What a person should know about the picture, one line each; emitters and simplifications among it.
    pub warnings: Vec<String>,
    /// The materials as their MTL files give them, one for each of the mesh; `None` for the default grey.
    declared: Vec<Option<MtlMaterial>>,
    /// Names of all materials that the MTL files declare, used or not.
    known: Vec<String>,
    /// What the mesh files gave to say, whatever the config.
    file_warnings: Vec<String>,
}

impl LoadedScene {
    /// SHA-256, in hex, of everything that decides the picture but for what an experiment sets itself (size, samples,
    /// exposure, estimator, sampler, seed) and how the live view shows it: the full state, defaults and `--set` applied, and the other files' names and bytes. The
    /// scene file's own layout does not count.
    pub fn content_sha256(&self) -> String {
        let state = SceneConfig {
            framebuffer: FramebufferConfig::default(),
            estimator: Estimator::Unbiased,
            sampler: None,
            seed: None,
            view: None,
            ..self.config.clone()
        };
        let mut text = state.to_json();
        for input in self.inputs.iter().skip(1) {
            text.push_str(&format!("{} {}\n", input.sha256, input.name));
        }
        sha256(text.as_bytes())
    }

    /// Takes another config over the same meshes: no file is read. On an error nothing changes.
    ///
    /// # Errors
    /// Kind `Input` for a material that cannot be, as [`open`].
    ///
    /// # Panics
    /// Where the config's meshes are others.
    pub fn repaint(&mut self, config: SceneConfig) -> Result<()> {
        assert_eq!(config.mesh_files, self.config.mesh_files, "other meshes have to be read");
        let mut said = Vec::new();
        let paint = |(old, declared): (&Material, &Option<MtlMaterial>)| {
            paint(declared.as_ref(), &config, old.file, old.texture, &mut said)
        };
        self.mesh.materials =
            self.mesh.materials.iter().zip(&self.declared).map(paint).collect::<Result<Vec<Material>>>()?;
        self.config = config;
        self.warnings = self.all_warnings(said);
        Ok(())
    }

    /// The material at `index` as it is without its patch: albedo, emissive strength. `None` for the default grey.
    pub fn unpatched(&self, index: usize) -> Option<(Vec3, f32)> {
        let declared = self.declared.get(index)?.as_ref()?;
        Some((own_albedo(declared, &mut Vec::new()), strength(declared, None)))
    }

    /// Everything to say: of the config, the files, the materials (`painted`), the patches, the emitters.
    fn all_warnings(&self, painted: Vec<String>) -> Vec<String> {
        let mut warnings = self.config.warnings();
        if self.config.mesh_files.is_empty() {
            warnings.push("scene.mesh_files is empty: the picture will be black".to_owned());
        }
        warnings.extend(self.file_warnings.iter().cloned());
        warnings.extend(painted);
        for (i, patch) in self.config.materials.iter().enumerate() {
            if !self.known.contains(&patch.name) {
                let near = suggestion(&patch.name, self.known.iter().map(String::as_str));
                warnings.push(format!("scene.materials[{i}].name: no material is called {:?}{near}", patch.name));
            }
        }
        warnings.extend(emitter_list(&self.mesh, &self.config));
        warnings
    }
}

/// Reads the scene file at `config_path` and everything it refers to.
///
/// # Errors
/// Kind `Input` naming the file and its line or key, what was expected and what was found: `tests/scene_files.rs` has each.
pub fn open(config_path: &Path, options: &OpenOptions) -> Result<LoadedScene> {
    let mut inputs = Inputs::default();
    let bytes =
        inputs.read(config_path, &file_name(config_path), "a readable scene file (JSON)", config_path.display())?;
    let config = SceneConfig::parse(&bytes, &config_path.display().to_string(), &options.sets)?;
    let places = search_places(config_path, &options.data)?;
    assemble(config, inputs, &places, &config_path.display().to_string())
}

/// Reads everything that a config without a file of its own refers to; it is called `name` in messages.
///
/// Mesh files are looked for in `places`, in order. No file is read that does not lie in one of them, whatever the
/// config, the meshes or their materials say, and nothing grows beyond `limits`: for scenes that come from strangers.
///
/// # Errors
/// As [`open`], and kind `Input` for a file outside, and beyond the limits.
pub fn open_within(config: SceneConfig, name: &str, places: &[PathBuf], limits: Limits) -> Result<LoadedScene> {
    let folders = places.iter().filter_map(|place| place.canonicalize().ok()).collect();
    let within = Within { folders, limits };
    let own = InputFile { name: name.to_owned(), sha256: sha256(config.to_json().as_bytes()) };
    assemble(config, Inputs { files: vec![own], within: Some(within) }, places, name)
}

/// Reads the meshes of `config` from `places`.
fn assemble(config: SceneConfig, inputs: Inputs, places: &[PathBuf], called: &str) -> Result<LoadedScene> {
    let mut builder = Builder {
        config: &config,
        mesh: Mesh::default(),
        inputs,
        painted: Vec::new(),
        said: Vec::new(),
        known: Vec::new(),
        declared: Vec::new(),
        textures: HashMap::new(),
    };
    for (index, name) in config.mesh_files.iter().enumerate() {
        let key = format!("{called}: scene.mesh_files[{index}]");
        let path = find_mesh(name, places, &key)?;
        builder.add_file(index as u32, name, &path)?;
    }
    let Builder { mesh, inputs, painted, said, known, declared, .. } = builder;
    let (inputs, file_warnings) = (inputs.files, said);
    let mut loaded = LoadedScene { config, mesh, inputs, warnings: Vec::new(), declared, known, file_warnings };
    loaded.warnings = loaded.all_warnings(painted);
    Ok(loaded)
}

fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The last part of a path.
pub fn file_name(path: &Path) -> String {
    path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
}

/// The files read so far.
#[derive(Default)]
struct Inputs {
    files: Vec<InputFile>,
    /// Absent where files may be anywhere and of any size.
    within: Option<Within>,
}

impl Inputs {
    /// Reads `path` and records it under `name`; `place` is where it is asked for.
    fn read(&mut self, path: &Path, name: &str, expected: &str, place: impl std::fmt::Display) -> Result<Vec<u8>> {
        let bytes = self.fetch(path, name, expected, place)?;
        let slot = self.reserve(name);
        self.settle(slot, sha256(&bytes));
        Ok(bytes)
    }

    /// Reads `path`, called `name` where it is asked for, at `place`; only from the folders that files must be within, if any are named.
    fn fetch(&self, path: &Path, name: &str, expected: &str, place: impl std::fmt::Display) -> Result<Vec<u8>> {
        if let Some(within) = &self.within {
            // Links are followed before the question is asked.
            let real = path.canonicalize().ok().filter(|real| real.is_file());
            if !real.is_some_and(|real| within.folders.iter().any(|folder| real.starts_with(folder))) {
                let what = format!("expected {expected} in a folder of this scene, found none there: {name:?}");
                return Err(Error::input(&place, what));
            }
        }
        std::fs::read(path)
            .map_err(|e| Error::input(&place, format!("expected {expected}, found {}: {e}", path.display())))
    }

    /// Keeps the next place of the list for a file whose hash is not known yet.
    fn reserve(&mut self, name: &str) -> usize {
        self.files.push(InputFile { name: name.to_owned(), sha256: String::new() });
        self.files.len() - 1
    }

    /// Gives the hash of a reserved place; the same file read before keeps its first place.
    fn settle(&mut self, slot: usize, sha256: String) {
        self.files[slot].sha256 = sha256;
        if self.files[..slot].contains(&self.files[slot]) {
            self.files.remove(slot);
        }
    }
}

/// The folders in which mesh files are looked for: beside the config, `data/` of each folder above, then `--data`.
///
/// # Errors
/// Kind `Input` for a path that the system cannot make absolute.
pub fn search_places(config_path: &Path, data: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let absolute = std::path::absolute(config_path)
        .map_err(|e| Error::input(config_path.display(), format!("expected a path to a file, found: {e}")))?;
    let beside = absolute.parent().unwrap_or(&absolute);
    let mut places = vec![beside.to_owned()];
    places.extend(beside.ancestors().map(|folder| folder.join("data")));
    places.extend_from_slice(data);
    Ok(places)
}

/// The first place that has the mesh file `name`.
fn find_mesh(name: &str, places: &[PathBuf], key: &str) -> Result<PathBuf> {
    if let Some(found) = places.iter().map(|place| place.join(name)).find(|path| path.is_file()) {
        return Ok(found);
    }
    let looked: Vec<String> = places.iter().map(|place| place.display().to_string()).collect();
    Err(Error::input(
        key,
        format!("expected the mesh file {name:?}, found it in none of: {} (remedy: --data DIR)", looked.join(", ")),
    ))
}

/// `name` relative to the folder of `referrer`; a name with backslashes that is no file there is tried with slashes.
fn beside(referrer: &Path, name: &str) -> PathBuf {
    let folder = referrer.parent().unwrap_or(Path::new(""));
    let literal = folder.join(name);
    if !literal.is_file() && name.contains('\\') { folder.join(name.replace('\\', "/")) } else { literal }
}

/// The mesh as it grows, file by file.
struct Builder<'a> {
    config: &'a SceneConfig,
    mesh: Mesh,
    inputs: Inputs,
    /// What materials gave to say, with their patches.
    painted: Vec<String>,
    /// What files gave to say.
    said: Vec<String>,
    /// Names of all materials declared, for patches.
    known: Vec<String>,
    /// The declarations of the mesh's materials.
    declared: Vec<Option<MtlMaterial>>,
    /// Textures by path.
    textures: HashMap<PathBuf, u32>,
}

impl Builder<'_> {
    /// Adds the triangles of mesh file `file`, called `name`.
    fn add_file(&mut self, file: u32, name: &str, path: &Path) -> Result<()> {
        let size = std::fs::metadata(path).map(|m| m.len()).unwrap_or(0);
        if size > MAX_MESH_BYTES {
            return Err(Error::input(
                name,
                format!("expected a mesh file of at most {MAX_MESH_BYTES} bytes, found {size}"),
            ));
        }
        let bytes = self.inputs.fetch(path, name, "a readable mesh file", name)?;
        let mut libraries: Vec<PathBuf> = Vec::new();
        // The OBJ stands before what it refers to.
        let slot = self.inputs.reserve(name);
        let (hash, obj) = rayon::join(
            || sha256(&bytes),
            || {
                obj::read_obj(&bytes, name, |rest, place| {
                    open_libraries(rest, place, path, &mut self.inputs, &mut self.said, &mut libraries)
                })
            },
        );
        let obj = obj?;
        drop(bytes);
        self.inputs.settle(slot, hash);
        self.said.extend(obj.warnings.iter().cloned());
        self.known.extend(obj.materials.iter().map(|m| m.name.clone()));
        if let Some(line) = obj.first_bare_face {
            self.said.push(format!(
                "{name}:{line}: faces before any usemtl have the default material, grey {DEFAULT_ALBEDO}"
            ));
        }
        self.add_faces(&obj, file, path)
    }

    /// Whether there are no more triangles than there may be.
    fn check_triangles(&self, name: &str, found: usize) -> Result<()> {
        match self.inputs.within.as_ref().map(|within| within.limits.triangles) {
            Some(most) if found > most => {
                Err(Error::input(name, format!("expected at most {most} triangles in all here, found {found}")))
            }
            _ => Ok(()),
        }
    }

    /// Whether there are no more texels than there may be.
    fn check_texels(&self, place: &str) -> Result<()> {
        let found: u64 = self.mesh.textures.iter().map(|t| u64::from(t.width) * u64::from(t.height)).sum();
        match self.inputs.within.as_ref().map(|within| within.limits.texels) {
            Some(most) if found > most => {
                Err(Error::input(place, format!("expected at most {most} texels in all here, found {found}")))
            }
            _ => Ok(()),
        }
    }

    /// Adds the triangles of all faces, part by part, in their order.
    fn add_faces(&mut self, obj: &Obj, file: u32, path: &Path) -> Result<()> {
        let name = &self.config.mesh_files[file as usize];
        let most: usize = obj.faces.iter().map(Faces::most_triangles).sum();
        // Before they take memory; those without area count here too.
        self.check_triangles(name, self.mesh.len() + most)?;
        let normals: Vec<Option<Vec3>> = obj.normals.par_iter().map(|n| cut::unit(n.as_dvec3())).collect();
        let mut index_of: HashMap<Option<usize>, u32> = HashMap::new();
        let mut told = Told::default();
        self.mesh.reserve(most);
        // Some at a time, so that a large mesh is not there twice.
        for some in obj.faces.chunks(PARTS_AT_ONCE) {
            let parts: Vec<Triangles> = some.par_iter().map(|faces| cut::triangles(obj, faces, &normals)).collect();
            for part in parts {
                self.mesh.positions.extend_from_slice(&part.positions);
                self.mesh.normals.extend_from_slice(&part.normals);
                self.mesh.uvs.extend_from_slice(&part.uvs);
                told.add(part.told);
                for (id, count) in part.runs.into_iter().filter(|(_, count)| *count > 0) {
                    let index = match index_of.get(&id) {
                        Some(index) => *index,
                        None => {
                            let material = self.material(id.map(|i| &obj.materials[i]), file, path)?;
                            self.mesh.materials.push(material);
                            self.declared.push(id.map(|i| obj.materials[i].clone()));
                            let index = self.mesh.materials.len() as u32 - 1;
                            index_of.insert(id, index);
                            index
                        }
                    };
                    self.mesh.material_of.resize(self.mesh.material_of.len() + count, index);
                }
            }
        }
        self.said.extend(told.warnings(name));
        Ok(())
    }

    /// The material that `declared` and its patch make, its texture read.
    fn material(&mut self, declared: Option<&MtlMaterial>, file: u32, obj_path: &Path) -> Result<Material> {
        let mut material = paint(declared, self.config, file, None, &mut self.painted)?;
        if let Some((place, name)) = declared.and_then(|mtl| mtl.map_kd.as_ref()) {
            material.texture = Some(self.texture(&beside(obj_path, name), name, place)?);
        }
        Ok(material)
    }

    /// The index of the texture at `path`, loaded at its first use.
    fn texture(&mut self, path: &Path, name: &str, place: &str) -> Result<u32> {
        if let Some(&index) = self.textures.get(path) {
            return Ok(index);
        }
        let bytes = self.inputs.read(path, name, &format!("the texture {name:?} (PNG or JPEG)"), place)?;
        let texture = decode_texture(&bytes).map_err(|found| {
            Error::input(place, format!("expected a PNG or JPEG image in {name:?}, found: {found}"))
        })?;
        let index = self.mesh.textures.len() as u32;
        self.mesh.textures.push(texture);
        self.check_texels(place)?;
        self.textures.insert(path.to_owned(), index);
        Ok(index)
    }
}

/// The material that `declared` and its patch in `config` make; without `declared`, the default grey, without a name.
fn paint(
    declared: Option<&MtlMaterial>,
    config: &SceneConfig,
    file: u32,
    texture: Option<u32>,
    said: &mut Vec<String>,
) -> Result<Material> {
    let Some(mtl) = declared else {
        let (name, albedo) = (String::new(), Vec3::splat(DEFAULT_ALBEDO));
        return Ok(Material { name, file, albedo, texture: None, emission: Vec3::ZERO, is_emitter: false });
    };
    let patch = config.materials.iter().find(|patch| patch.name == mtl.name);
    let albedo = patch.and_then(|p| p.albedo_col).unwrap_or_else(|| own_albedo(mtl, said));
    let emission = emission(mtl, albedo, strength(mtl, patch))?;
    let is_emitter = emission != Vec3::ZERO;
    for note in notes(mtl, patch, albedo, is_emitter) {
        said.push(format!("{}: {:?} {note}", mtl.place, mtl.name));
    }
    Ok(Material { name: mtl.name.clone(), file, albedo, texture, emission, is_emitter })
}

/// Opens the libraries of one `mtllib` line: one name that may hold blanks or, where no such file exists, several.
fn open_libraries(
    rest: &str,
    place: &str,
    obj_path: &Path,
    inputs: &mut Inputs,
    warnings: &mut Vec<String>,
    opened: &mut Vec<PathBuf>,
) -> Result<Vec<MtlMaterial>> {
    let names: Vec<&str> = match beside(obj_path, rest).is_file() {
        true => vec![rest],
        false => rest.split_whitespace().collect(),
    };
    let mut materials = Vec::new();
    for name in names {
        let path = beside(obj_path, name);
        let bytes = inputs.read(&path, name, &format!("the material library {name:?}"), place)?;
        let (found, said) = obj::read_mtl(&bytes, name)?;
        if !opened.contains(&path) {
            warnings.extend(said);
            materials.extend(found);
            opened.push(path);
        }
    }
    Ok(materials)
}

/// Kd; where it is black, Ks; where neither is given, white under a texture and else the default grey.
fn own_albedo(mtl: &MtlMaterial, warnings: &mut Vec<String>) -> Vec3 {
    let [kd, ks] = [mtl.kd, mtl.ks].map(|colour| colour.map(Vec3::from_array));
    let bright = |colour: Option<Vec3>| colour.filter(|c| *c != Vec3::ZERO);
    let albedo = match (bright(kd), bright(ks), kd) {
        (Some(kd), _, _) => kd,
        (None, None, None) if mtl.map_kd.is_some() => Vec3::ONE,
        (None, Some(ks), _) => ks,
        (None, None, Some(black)) => black,
        (None, None, None) => {
            warnings.push(format!("{}: {:?} has no colour (Kd, Ks): grey {DEFAULT_ALBEDO}", mtl.place, mtl.name));
            Vec3::splat(DEFAULT_ALBEDO)
        }
    };
    if albedo.max_element() > 1.0 {
        warnings
            .push(format!("{}: {:?} has an albedo above 1: it reflects more than it receives", mtl.place, mtl.name));
    }
    albedo
}

/// Emissive strength: the patch's, else luma(Ke) (Rec. 709), else [`DEFAULT_STRENGTH`] where name or type says emitter.
fn strength(mtl: &MtlMaterial, patch: Option<&MaterialPatch>) -> f32 {
    if let Some(given) = patch.and_then(|p| p.emissive_strength) {
        return given;
    }
    let [r, g, b] = mtl.ke.unwrap_or_default().map(f64::from);
    let luma = (0.2126 * r + 0.7152 * g + 0.0722 * b) as f32;
    let says = says_emitter(&mtl.name) || patch.and_then(|p| p.kind.as_deref()).is_some_and(says_emitter);
    if luma > 0.0 || !says { luma } else { DEFAULT_STRENGTH }
}

/// Emitted radiance: albedo × strength.
fn emission(mtl: &MtlMaterial, albedo: Vec3, strength: f32) -> Result<Vec3> {
    if strength > 0.0 && albedo == Vec3::ZERO {
        let what = "expected a colour for what emits (Kd, else Ks, or albedo_col of a patch)";
        return Err(Error::input(&mtl.place, format!("{what}, found black in material {:?}", mtl.name)));
    }
    let emission = albedo * strength;
    if emission.is_finite() {
        return Ok(emission);
    }
    let what = format!("expected an emission below 3.4e38, found albedo {albedo} times strength {strength}");
    Err(Error::input(&mtl.place, format!("{what} in material {:?}", mtl.name)))
}

/// What of a material does not show in the picture.
fn notes(mtl: &MtlMaterial, patch: Option<&MaterialPatch>, albedo: Vec3, is_emitter: bool) -> Vec<String> {
    let mut notes = Vec::new();
    match (patch.and_then(|p| p.kind.as_deref()), mtl.illum) {
        (Some(kind), _) if is_diffuse(kind) || (is_emitter && says_emitter(kind)) => {}
        (Some(kind), _) => notes.push(format!("(type {kind:?}) is rendered as diffuse")),
        // The MTL models from 3 up reflect or refract; the scene file's type has the last word.
        (None, Some(illum)) if illum >= 3 => notes.push(format!("(illum {illum}) is rendered as diffuse")),
        (None, _) => {}
    }
    let takes_luma = is_emitter && patch.is_none_or(|p| p.emissive_strength.is_none());
    if takes_luma && mtl.ke.is_some_and(|[r, g, b]| r != g || g != b) {
        notes.push("has a coloured Ke: only its luma counts, times the albedo".to_owned());
    }
    if mtl.map_kd.is_some() && albedo == Vec3::ZERO {
        notes.push("has a texture that does not show: it multiplies black".to_owned());
    }
    if mtl.map_kd.is_some() && is_emitter {
        notes.push("has a texture that does not change what it emits".to_owned());
    }
    notes
}

/// Whether a name or type means an emitter.
fn says_emitter(word: &str) -> bool {
    let word = word.to_ascii_lowercase();
    word.contains("light") || word.contains("emissive")
}

/// Whether a type means what is rendered anyway.
fn is_diffuse(kind: &str) -> bool {
    let kind = kind.to_ascii_lowercase();
    kind.contains("diffuse") || kind.contains("lambert")
}

/// More emitters than this are listed in one line.
const MOST_EMITTER_LINES: usize = 8;

/// One line for each emitter: file, name, radiance, number of triangles; one for all where they are many.
fn emitter_list(mesh: &Mesh, config: &SceneConfig) -> Vec<String> {
    let mut triangles = vec![0usize; mesh.materials.len()];
    for &material in &mesh.material_of {
        triangles[material as usize] += 1;
    }
    let emitters: Vec<(&Material, usize)> =
        mesh.materials.iter().zip(triangles).filter(|(material, _)| material.is_emitter).collect();
    let place = |material: &Material| format!("{}: {:?}", config.mesh_files[material.file as usize], material.name);
    if emitters.len() > MOST_EMITTER_LINES {
        let lumas = emitters.iter().map(|(material, _)| luma(material.emission));
        let (low, high) = lumas.fold((f32::MAX, 0.0f32), |(low, high), luma| (low.min(luma), high.max(luma)));
        let names: Vec<String> = emitters.iter().map(|(material, _)| place(material)).collect();
        let count = emitters.len();
        return vec![format!("{count} materials emit radiance of luma {low:.3e} to {high:.3e}: {}", names.join(", "))];
    }
    let line = |&(material, n): &(&Material, usize)| {
        let [r, g, b] = material.emission.to_array();
        format!("{} emits radiance [{r}, {g}, {b}] from {n} triangles", place(material))
    };
    emitters.iter().map(line).collect()
}

/// PNG or JPEG bytes → linear texels; an alpha channel is not used.
fn decode_texture(bytes: &[u8]) -> std::result::Result<Texture, String> {
    let open = || image::ImageReader::new(std::io::Cursor::new(bytes)).with_guessed_format().map_err(|e| e.to_string());
    let (width, height) = open()?.into_dimensions().map_err(|e| e.to_string())?;
    if u64::from(width) * u64::from(height) > MAX_TEXELS || width == 0 || height == 0 {
        return Err(format!("{width} times {height} pixels (1 to {MAX_TEXELS} are possible)"));
    }
    let mut reader = open()?;
    // The size is checked above; the crate's own limit on memory is lower than ours.
    reader.no_limits();
    let decoded = reader.decode().map_err(|e| e.to_string())?;
    Ok(match decoded.color().bytes_per_pixel() / decoded.color().channel_count() {
        1 => {
            let linear = std::array::from_fn(|code| srgb_decode(code as f32 / 255.0));
            Texture::coded(width, decoded.to_rgb8().pixels().map(|p| p.0).collect(), Box::new(linear))
        }
        _ => {
            let texel = |p: &image::Rgb<u16>| p.0.map(|v| srgb_decode(f32::from(v) / 65535.0));
            Texture::new(width, decoded.to_rgb16().pixels().map(texel).collect())
        }
    })
}
