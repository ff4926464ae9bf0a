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
}

impl LoadedScene {
    /// SHA-256, in hex, of everything that decides the picture but for what an experiment sets itself (size, samples,
    /// exposure, estimator): the full state, defaults and `--set` applied, and the other files' names and bytes. The
    /// scene file's own layout does not count.
    pub fn content_sha256(&self) -> String {
        let state = SceneConfig {
            framebuffer: FramebufferConfig::default(),
            estimator: Estimator::Unbiased,
            ..self.config.clone()
        };
        let mut text = state.to_json();
        for input in self.inputs.iter().skip(1) {
            text.push_str(&format!("{} {}\n", input.sha256, input.name));
        }
        sha256(text.as_bytes())
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
    let mut warnings = config.warnings();
    if config.mesh_files.is_empty() {
        warnings.push("scene.mesh_files is empty: the picture will be black".to_owned());
    }
    let places = search_places(config_path, &options.data)?;
    let mut builder = Builder {
        config: &config,
        mesh: Mesh::default(),
        inputs,
        warnings,
        known: Vec::new(),
        textures: HashMap::new(),
    };
    for (index, name) in config.mesh_files.iter().enumerate() {
        let key = format!("{}: scene.mesh_files[{index}]", config_path.display());
        let path = find_mesh(name, &places, &key)?;
        builder.add_file(index as u32, name, &path)?;
    }
    builder.warn_of_unmatched_patches();
    let Builder { mesh, inputs, mut warnings, .. } = builder;
    warnings.extend(emitter_list(&mesh, &config));
    Ok(LoadedScene { config, mesh, inputs: inputs.files, warnings })
}

fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

fn file_name(path: &Path) -> String {
    path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
}

/// Reads `path`; `place` is where it is asked for.
fn read_file(path: &Path, expected: &str, place: impl std::fmt::Display) -> Result<Vec<u8>> {
    std::fs::read(path).map_err(|e| Error::input(&place, format!("expected {expected}, found {}: {e}", path.display())))
}

/// The files read so far.
#[derive(Default)]
struct Inputs {
    files: Vec<InputFile>,
}

impl Inputs {
    /// Reads `path` and records it under `name`; `place` is where it is asked for.
    fn read(&mut self, path: &Path, name: &str, expected: &str, place: impl std::fmt::Display) -> Result<Vec<u8>> {
        let bytes = read_file(path, expected, place)?;
        let slot = self.reserve(name);
        self.settle(slot, sha256(&bytes));
        Ok(bytes)
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
fn search_places(config_path: &Path, data: &[PathBuf]) -> Result<Vec<PathBuf>> {
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
    warnings: Vec<String>,
    /// Names of all materials declared, for patches.
    known: Vec<String>,
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
        let bytes = read_file(path, "a readable mesh file", name)?;
        let mut libraries: Vec<PathBuf> = Vec::new();
        // The OBJ stands before what it refers to.
        let slot = self.inputs.reserve(name);
        let (hash, obj) = rayon::join(
            || sha256(&bytes),
            || {
                obj::read_obj(&bytes, name, |rest, place| {
                    open_libraries(rest, place, path, &mut self.inputs, &mut self.warnings, &mut libraries)
                })
            },
        );
        let obj = obj?;
        drop(bytes);
        self.inputs.settle(slot, hash);
        self.warnings.extend(obj.warnings.iter().cloned());
        self.known.extend(obj.materials.iter().map(|m| m.name.clone()));
        if let Some(line) = obj.first_bare_face {
            self.warnings.push(format!(
                "{name}:{line}: faces before any usemtl have the default material, grey {DEFAULT_ALBEDO}"
            ));
        }
        self.add_faces(&obj, file, path)
    }

    /// Adds the triangles of all faces, part by part, in their order.
    fn add_faces(&mut self, obj: &Obj, file: u32, path: &Path) -> Result<()> {
        let name = &self.config.mesh_files[file as usize];
        let normals: Vec<Option<Vec3>> = obj.normals.par_iter().map(|n| cut::unit(n.as_dvec3())).collect();
        let mut index_of: HashMap<Option<usize>, u32> = HashMap::new();
        let mut told = Told::default();
        self.mesh.reserve(obj.faces.iter().map(Faces::most_triangles).sum());
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
                            let index = self.mesh.materials.len() as u32 - 1;
                            index_of.insert(id, index);
                            index
                        }
                    };
                    self.mesh.material_of.resize(self.mesh.material_of.len() + count, index);
                }
            }
        }
        self.warnings.extend(told.warnings(name));
        Ok(())
    }

    /// The material that `declared` and its patch make; without `declared`, the default grey, without a name.
    fn material(&mut self, declared: Option<&MtlMaterial>, file: u32, obj_path: &Path) -> Result<Material> {
        let Some(mtl) = declared else {
            let (name, albedo) = (String::new(), Vec3::splat(DEFAULT_ALBEDO));
            return Ok(Material { name, file, albedo, texture: None, emission: Vec3::ZERO, is_emitter: false });
        };
        let config = self.config;
        let patch = config.materials.iter().find(|patch| patch.name == mtl.name);
        let albedo = patch.and_then(|p| p.albedo_col).unwrap_or_else(|| own_albedo(mtl, &mut self.warnings));
        let emission = emission(mtl, albedo, strength(mtl, patch))?;
        let is_emitter = emission != Vec3::ZERO;
        let texture = match &mtl.map_kd {
            Some((place, name)) => Some(self.texture(&beside(obj_path, name), name, place)?),
            None => None,
        };
        for note in notes(mtl, patch, albedo, is_emitter) {
            self.warnings.push(format!("{}: {:?} {note}", mtl.place, mtl.name));
        }
        Ok(Material { name: mtl.name.clone(), file, albedo, texture, emission, is_emitter })
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
        self.textures.insert(path.to_owned(), index);
        Ok(index)
    }

    fn warn_of_unmatched_patches(&mut self) {
        for (i, patch) in self.config.materials.iter().enumerate() {
            if !self.known.contains(&patch.name) {
                let near = suggestion(&patch.name, self.known.iter().map(String::as_str));
                self.warnings.push(format!("scene.materials[{i}].name: no material is called {:?}{near}", patch.name));
            }
        }
    }
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
