//! The JSON scene format, strict: unknown keys and wild values are errors, and what is not modelled is said aloud.
//!
//! A [`SceneConfig`] is the full state with every default made explicit. Printing it ([`SceneConfig::to_json`]) and
//! reading that back gives an equal one.

use std::path::Path;

use glam::Vec3;

use super::json::{self, Fields, Item, Place, Value, suggestion};
use crate::error::{Error, Result};

mod view;

pub use view::{Look, Show, ViewConfig};

/// Most samples a pixel, 2^24: above, a sample index has no exact `f32`.
pub const MAX_SPP: u32 = 1 << 24;

/// Most pixels an image, 2^26 (8192 × 8192): its `f64` sums take 1.6 GB.
pub const MAX_PIXELS: u64 = 1 << 26;

/// The one algorithm that is modelled.
const ALGORITHM: &str = "SimpleRenderer";

/// Everything a scene file says.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneConfig {
    /// Where the picture is taken from.
    pub camera: CameraConfig,
    /// Whether the focal depth is measured in the scene instead of taken from the camera.
    pub auto_focus: bool,
    /// The picture's size, samples and exposure.
    pub framebuffer: FramebufferConfig,
    /// Mesh files in the order given; their triangles add up.
    pub mesh_files: Vec<String>,
    /// Changes to materials, each matched by name over all mesh files.
    pub materials: Vec<MaterialPatch>,
    /// What a surface shows.
    pub shading: Shading,
    /// How several lights are weighted.
    pub estimator: Estimator,
    /// The sampler of each decision, as whoever renders reads it; absent where the file leaves it open.
    pub sampler: Option<String>,
    /// The seed of the randomisation; absent where the file leaves it open.
    pub seed: Option<u64>,
    /// How the live view shows it; absent where the file leaves it open.
    pub view: Option<ViewConfig>,
    /// Known keys that are kept and exported but not modelled, each with the object it stands in (`""` is the top).
    pub unmodelled: Vec<(Section, String, Value)>,
}

/// The camera as the file gives it: neither normalised nor made orthogonal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraConfig {
    /// Position, scene units.
    pub pos: Vec3,
    /// Viewing direction; its length is above 0 and has no meaning.
    pub dir: Vec3,
    /// Up; its length is above 0 and has no meaning, and it is not parallel to `dir`.
    pub up: Vec3,
    /// Vertical field of view, degrees, in (0, 180).
    pub fov_degrees: f32,
    /// Radius of the lens, scene units; 0 is a pinhole.
    pub lens_radius: f32,
    /// Distance of the plane of focus along `dir`, scene units, above 0.
    pub focal_depth: f32,
}

/// The picture's size, samples and exposure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FramebufferConfig {
    /// Columns, at least 1.
    pub res_w: u32,
    /// Rows, at least 1; `res_w · res_h` is at most [`MAX_PIXELS`].
    pub res_h: u32,
    /// Samples a pixel, 1 to [`MAX_SPP`].
    pub sppx: u32,
    /// Factor on radiance on its way to PNG, at least 0.
    pub exposure: f32,
}

/// A change to the material called `name`, in every mesh file that has one.
#[derive(Debug, Clone, PartialEq)]
pub struct MaterialPatch {
    /// The material's name, as in `newmtl`.
    pub name: String,
    /// The framework's type; one that contains `light` or `emissive` emits, all others are diffuse.
    pub kind: Option<String>,
    /// Takes the place of Kd. A texture still multiplies it.
    pub albedo_col: Option<Vec3>,
    /// Takes the place of luma(Ke); 0 switches an emitter off.
    pub emissive_strength: Option<f32>,
    /// Known keys that are kept and exported but not modelled.
    pub unmodelled: Vec<(String, Value)>,
}

/// What a surface shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shading {
    /// Light that reaches it straight from the emitters.
    Direct,
    /// Its albedo; no light is needed.
    Albedo,
}

/// How the light that was chosen is weighted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Estimator {
    /// Divided by the probability of the choice.
    Unbiased,
    /// The sheet's shortcut: not divided. Wrong as soon as there are two lights.
    Sheet,
}

/// An object of the format, by the keys it may have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Section {
    /// The document.
    Top,
    /// `camera`
    Camera,
    /// `framebuffer`
    Framebuffer,
    /// `scene`
    Scene,
    /// An element of `scene.materials`
    Patch,
    /// `view`
    View,
}

const SECTIONS: [Section; 6] =
    [Section::Top, Section::Camera, Section::Framebuffer, Section::Scene, Section::Patch, Section::View];

impl Section {
    /// The keys that mean something here.
    fn keys(self) -> &'static [&'static str] {
        match self {
            Self::Top => &[
                "camera",
                "auto_focus",
                "framebuffer",
                "scene",
                "algorithm",
                "shading",
                "estimator",
                "sampler",
                "seed",
                "view",
            ],
            Self::Camera => &["pos", "dir", "up", "fov", "lens_radius", "focal_depth"],
            Self::Framebuffer => &["res_w", "res_h", "sppx", "exposure"],
            Self::Scene => &["mesh_files", "materials", "sky", "volume"],
            Self::Patch => &["name", "type", "albedo_col", "emissive_strength"],
            Self::View => &["second", "seconds", "show", "look", "refine", "speed"],
        }
    }

    /// Whether `key` is known here, kept and exported, but not modelled.
    ///
    /// The settings of path length, roulette and light cuts belong to algorithms; which object a file keeps them in is
    /// the algorithm's business, so they are known everywhere but in a material.
    fn keeps(self, key: &str) -> bool {
        let of_an_algorithm = matches!(key, "beauty_render" | "error_eps")
            || (key.starts_with("max_") && key.ends_with("_path_length"))
            || key.starts_with("rr_")
            || key.starts_with("lightcuts_");
        match self {
            Self::Patch => matches!(key, "ior" | "roughness" | "absorb" | "coated" | "specular_col"),
            Self::Framebuffer => key == "hdr" || of_an_algorithm,
            Self::Top | Self::Camera | Self::Scene => of_an_algorithm,
            Self::View => false,
        }
    }

    /// Whether `key` asks for something that would change the picture and is not modelled: it must be null.
    fn must_be_null(self, key: &str) -> bool {
        self == Self::Scene && (key == "sky" || key.starts_with("volume"))
    }

    fn knows(self, key: &str) -> bool {
        self.keys().contains(&key) || self.keeps(key) || self.must_be_null(key)
    }

    /// The dotted path of this object.
    fn path(self) -> &'static str {
        match self {
            Self::Top => "",
            Self::Camera => "camera",
            Self::Framebuffer => "framebuffer",
            Self::Scene => "scene",
            Self::Patch => "scene.materials[…]",
            Self::View => "view",
        }
    }

    /// The section that `key` holds here, where it holds one.
    fn child(self, key: &str) -> Option<Self> {
        match (self, key) {
            (Self::Top, "camera") => Some(Self::Camera),
            (Self::Top, "framebuffer") => Some(Self::Framebuffer),
            (Self::Top, "scene") => Some(Self::Scene),
            (Self::Top, "view") => Some(Self::View),
            (Self::Scene, "materials") => Some(Self::Patch),
            _ => None,
        }
    }

    /// The error about `key`, unknown in this section's object at `place`: it names the object that the key belongs in, or
    /// else the nearest key here.
    fn unknown(self, place: &Place, key: &str) -> Error {
        let hint = match SECTIONS.iter().find(|s| **s != self && s.knows(key)) {
            Some(Self::Top) => "; it belongs at the top of the file".to_owned(),
            Some(home) => format!("; it belongs in {}", home.path()),
            None => suggestion(key, self.keys().iter().copied()),
        };
        let known = self.keys().join(" ");
        Error::input(place.key(key), format!("expected one of the keys {known}, found an unknown key{hint}"))
    }
}

impl Default for CameraConfig {
    fn default() -> Self {
        Self { pos: Vec3::ZERO, dir: Vec3::X, up: Vec3::Y, fov_degrees: 70.0, lens_radius: 0.025, focal_depth: 1.0 }
    }
}

impl Default for FramebufferConfig {
    fn default() -> Self {
        Self { res_w: 1280, res_h: 720, sppx: 10, exposure: 3.0 }
    }
}

impl Default for SceneConfig {
    fn default() -> Self {
        Self {
            camera: CameraConfig::default(),
            auto_focus: true,
            framebuffer: FramebufferConfig::default(),
            mesh_files: Vec::new(),
            materials: Vec::new(),
            shading: Shading::Direct,
            estimator: Estimator::Unbiased,
            sampler: None,
            seed: None,
            view: None,
            unmodelled: Vec::new(),
        }
    }
}

const SHADINGS: [(&str, Shading); 2] = [("direct", Shading::Direct), ("albedo", Shading::Albedo)];
const ESTIMATORS: [(&str, Estimator); 2] = [("unbiased", Estimator::Unbiased), ("sheet", Estimator::Sheet)];

impl Shading {
    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Direct => "direct",
            Self::Albedo => "albedo",
        }
    }
}

impl Estimator {
    /// Its name in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Unbiased => "unbiased",
            Self::Sheet => "sheet",
        }
    }

    /// The estimator called `name`, as `--estimator` takes it; `None` for any other word.
    pub fn from_name(name: &str) -> Option<Self> {
        ESTIMATORS.iter().find(|(n, _)| *n == name).map(|(_, e)| *e)
    }
}

impl SceneConfig {
    /// Reads and checks a scene file after `--set`; each of `sets` is `KEY=VALUE`, see [`SceneConfig::parse`].
    ///
    /// # Errors
    /// Kind `Input` where the file cannot be read, and those of [`SceneConfig::parse`].
    pub fn read(path: &Path, sets: &[String]) -> Result<Self> {
        let bytes = std::fs::read(path)
            .map_err(|e| Error::input(path.display(), format!("expected a readable scene file (JSON), found: {e}")))?;
        Self::parse(&bytes, &path.display().to_string(), sets)
    }

    /// Checks the scene file `bytes`, called `file` in errors, after applying `sets` in order.
    ///
    /// A set is `KEY=VALUE`: a dotted path such as `camera.fov` or `scene.materials.0.name`, and JSON, or else a
    /// string. It replaces what the file says before anything is checked, so it can mend a file that would be refused.
    ///
    /// # Errors
    /// Kind `Input` naming file and key, or the set that is to blame, what was expected and what was found.
    pub fn parse(bytes: &[u8], file: &str, sets: &[String]) -> Result<Self> {
        let mut value = json::parse(bytes, file)?;
        for set in sets {
            apply_set(&mut value, set)?;
        }
        Self::from_value(&value, file).map_err(|error| blame_set(error, file, sets))
    }

    /// Checks a parsed scene file, called `file` in errors. All keys are optional.
    ///
    /// # Errors
    /// Kind `Input` naming file and key, what was expected and what was found.
    pub fn from_value(value: &Value, file: &str) -> Result<Self> {
        let mut config = Self::default();
        let mut top = Item::top(value, file).fields()?;
        let kept = &mut config.unmodelled;
        if let Some(camera) = top.opt("camera", |item| read_camera(item, kept))? {
            config.camera = camera;
        }
        config.auto_focus = top.or("auto_focus", config.auto_focus, |i| i.bool())?;
        if let Some(framebuffer) = top.opt("framebuffer", |item| read_framebuffer(item, kept))? {
            config.framebuffer = framebuffer;
        }
        if let Some((mesh_files, materials)) = top.opt("scene", |item| read_scene(item, kept))? {
            config.mesh_files = mesh_files;
            config.materials = materials;
        }
        top.opt("algorithm", read_algorithm)?;
        config.shading = top.or("shading", config.shading, |i| i.choice(&SHADINGS))?;
        config.estimator = top.or("estimator", config.estimator, |i| i.choice(&ESTIMATORS))?;
        config.sampler = top.opt("sampler", |i| i.text("a sampler, or one for each decision").map(str::to_owned))?;
        config.seed = top.opt("seed", |i| i.integer(0..=u64::MAX))?;
        config.view = top.opt("view", ViewConfig::read)?;
        keep_rest(&mut top, Section::Top, kept)?;
        Ok(config)
    }

    /// What a reader of the picture should know: keys that are kept but not modelled, and albedos above 1.
    pub fn warnings(&self) -> Vec<String> {
        let mut kept: Vec<String> = Vec::new();
        for (section, key, _) in &self.unmodelled {
            let dot = if *section == Section::Top { "" } else { "." };
            kept.push(format!("{}{dot}{key}", section.path()));
        }
        for (i, patch) in self.materials.iter().enumerate() {
            kept.extend(patch.unmodelled.iter().map(|(key, _)| format!("scene.materials[{i}].{key}")));
        }
        let mut warnings = Vec::new();
        if !kept.is_empty() {
            warnings.push(format!("known and kept, but not modelled: {}", kept.join(", ")));
        }
        for (i, patch) in self.materials.iter().enumerate() {
            if let Some(albedo) = patch.albedo_col.filter(|a| a.max_element() > 1.0) {
                let [r, g, b] = albedo.to_array();
                warnings
                    .push(format!("scene.materials[{i}].albedo_col: [{r}, {g}, {b}] reflects more than it receives"));
            }
        }
        warnings
    }

    /// The full state with every default made explicit. `from_value` of it is equal to `self`.
    pub fn to_value(&self) -> Value {
        let kept = |section: Section| {
            self.unmodelled.iter().filter(move |(s, _, _)| *s == section).map(|(_, k, v)| (k.clone(), v.clone()))
        };
        let CameraConfig { pos, dir, up, fov_degrees, lens_radius, focal_depth } = self.camera;
        let camera = object([
            ("pos", Value::vec3(pos)),
            ("dir", Value::vec3(dir)),
            ("up", Value::vec3(up)),
            ("fov", Value::from_f32(fov_degrees)),
            ("lens_radius", Value::from_f32(lens_radius)),
            ("focal_depth", Value::from_f32(focal_depth)),
        ]);
        let FramebufferConfig { res_w, res_h, sppx, exposure } = self.framebuffer;
        let framebuffer = object([
            ("res_w", Value::integer(res_w)),
            ("res_h", Value::integer(res_h)),
            ("sppx", Value::integer(sppx)),
            ("exposure", Value::from_f32(exposure)),
        ]);
        let scene = object([
            ("mesh_files", Value::Array(self.mesh_files.iter().map(Value::text).collect())),
            ("materials", Value::Array(self.materials.iter().map(MaterialPatch::to_value).collect())),
            ("sky", Value::Null),
            ("volume", Value::Null),
        ]);
        let top = object([
            ("camera", Value::Object(camera.chain(kept(Section::Camera)).collect())),
            ("auto_focus", Value::Bool(self.auto_focus)),
            ("framebuffer", Value::Object(framebuffer.chain(kept(Section::Framebuffer)).collect())),
            ("scene", Value::Object(scene.chain(kept(Section::Scene)).collect())),
            ("algorithm", Value::text(ALGORITHM)),
            ("shading", Value::text(self.shading.name())),
            ("estimator", Value::text(self.estimator.name())),
        ]);
        // What renders the scene has its own defaults for these.
        let open = [
            self.sampler.as_ref().map(|sampler| ("sampler", Value::text(sampler))),
            self.seed.map(|seed| ("seed", Value::integer(seed))),
            self.view.as_ref().map(|view| ("view", view.to_value())),
        ];
        let open = object(open.into_iter().flatten());
        Value::Object(top.chain(open).chain(kept(Section::Top)).collect())
    }

    /// [`SceneConfig::to_value`] as indented JSON: what `config show` prints.
    pub fn to_json(&self) -> String {
        self.to_value().to_pretty()
    }
}

impl MaterialPatch {
    fn to_value(&self) -> Value {
        let given = [
            Some(("name", Value::text(&self.name))),
            self.kind.as_ref().map(|kind| ("type", Value::text(kind))),
            self.albedo_col.map(|albedo| ("albedo_col", Value::vec3(albedo))),
            self.emissive_strength.map(|strength| ("emissive_strength", Value::from_f32(strength))),
        ];
        Value::Object(object(given.into_iter().flatten()).chain(self.unmodelled.iter().cloned()).collect())
    }
}

/// The pairs of an object, with owned keys.
fn object(pairs: impl IntoIterator<Item = (&'static str, Value)>) -> impl Iterator<Item = (String, Value)> {
    pairs.into_iter().map(|(key, value)| (key.to_owned(), value))
}

/// Known keys that are left over go to `kept`; the first unknown one is an error.
fn keep_rest(fields: &mut Fields, section: Section, kept: &mut Vec<(Section, String, Value)>) -> Result<()> {
    for (key, value) in fields.take_rest() {
        if section.must_be_null(key) {
            if *value != Value::Null {
                let item = Item { value, place: fields.place().key(key) };
                return Err(item.unexpected(format!("null, as it is not modelled (remedy: --set scene.{key}=null)")));
            }
        } else if section.keeps(key) {
            kept.push((section, key.to_owned(), value.clone()));
        } else {
            return Err(section.unknown(fields.place(), key));
        }
    }
    Ok(())
}

fn read_camera(item: Item, kept: &mut Vec<(Section, String, Value)>) -> Result<CameraConfig> {
    let default = CameraConfig::default();
    let mut fields = item.fields()?;
    let direction = |i: Item| i.vec3("a direction, three numbers, of length 1e-12 to 1e12", is_direction);
    let camera = CameraConfig {
        pos: fields.or("pos", default.pos, |i| i.vec3("a position, three numbers", |_| true))?,
        dir: fields.or("dir", default.dir, direction)?,
        up: fields.or("up", default.up, direction)?,
        fov_degrees: fields.or("fov", default.fov_degrees, |i| {
            i.f32("an angle between 0 and 180 degrees", |x| x > 0.0 && x < 180.0)
        })?,
        lens_radius: fields
            .or("lens_radius", default.lens_radius, |i| i.f32("a length, 0 (a pinhole) or above", |x| x >= 0.0))?,
        focal_depth: fields.or("focal_depth", default.focal_depth, |i| i.f32("a length above 0", |x| x > 0.0))?,
    };
    if is_parallel(camera.dir, camera.up) {
        let ([a, b, c], [x, y, z]) = (camera.up.to_array(), camera.dir.to_array());
        return Err(Error::input(
            fields.place().key("up"),
            format!("expected a direction that is not parallel to dir [{x}, {y}, {z}], found [{a}, {b}, {c}]"),
        ));
    }
    keep_rest(&mut fields, Section::Camera, kept)?;
    Ok(camera)
}

/// Whether `v` can be normalised with `f32` arithmetic that squares its length.
fn is_direction(v: Vec3) -> bool {
    (1e-12..=1e12).contains(&v.as_dvec3().length())
}

/// Whether the angle between two directions, or one and the other's opposite, is below 1e-6 radians: `f32` leaves no digit
/// of the right vector then.
fn is_parallel(a: Vec3, b: Vec3) -> bool {
    a.as_dvec3().normalize().cross(b.as_dvec3().normalize()).length() < 1e-6
}

fn read_framebuffer(item: Item, kept: &mut Vec<(Section, String, Value)>) -> Result<FramebufferConfig> {
    let default = FramebufferConfig::default();
    let mut fields = item.fields()?;
    // The bounds make the conversions exact.
    let side = |i: Item| i.integer(1..=MAX_PIXELS).map(|n| n as u32);
    let framebuffer = FramebufferConfig {
        res_w: fields.or("res_w", default.res_w, side)?,
        res_h: fields.or("res_h", default.res_h, side)?,
        sppx: fields.or("sppx", default.sppx, |i| i.integer(1..=u64::from(MAX_SPP)).map(|n| n as u32))?,
        exposure: fields.or("exposure", default.exposure, |i| i.f32("a factor, 0 or above", |x| x >= 0.0))?,
    };
    let (w, h) = (framebuffer.res_w, framebuffer.res_h);
    if u64::from(w) * u64::from(h) > MAX_PIXELS {
        let what = format!("expected res_w times res_h of at most {MAX_PIXELS} pixels, found {w} times {h}");
        return Err(Error::input(fields.place(), what));
    }
    keep_rest(&mut fields, Section::Framebuffer, kept)?;
    Ok(framebuffer)
}

fn read_scene(item: Item, kept: &mut Vec<(Section, String, Value)>) -> Result<(Vec<String>, Vec<MaterialPatch>)> {
    let mut fields = item.fields()?;
    let read_name = |i: Item| match i.text("the name of a mesh file (OBJ)")? {
        "" => Err(i.unexpected("the name of a mesh file (OBJ)")),
        name => Ok(name.to_owned()),
    };
    let mesh_files = fields
        .opt("mesh_files", |i| i.items("an array of file names")?.into_iter().map(read_name).collect::<Result<_>>())?
        .unwrap_or_default();
    let patches =
        fields.opt("materials", |i| i.items("an array of materials")?.into_iter().map(read_patch).collect())?;
    let patches: Vec<MaterialPatch> = patches.unwrap_or_default();
    for (i, patch) in patches.iter().enumerate() {
        if let Some(first) = patches[..i].iter().position(|p| p.name == patch.name) {
            let what = format!("expected each name once, found {:?} again, first at index {first}", patch.name);
            return Err(Error::input(fields.place().key("materials").index(i).key("name"), what));
        }
    }
    keep_rest(&mut fields, Section::Scene, kept)?;
    Ok((mesh_files, patches))
}

fn read_patch(item: Item) -> Result<MaterialPatch> {
    let mut fields = item.fields()?;
    let mut kept = Vec::new();
    let patch = MaterialPatch {
        name: fields.need("name", |i| i.text("a material's name").map(str::to_owned))?,
        kind: fields.opt("type", |i| i.text("a material's type").map(str::to_owned))?,
        albedo_col: fields
            .opt("albedo_col", |i| i.vec3("a colour, three numbers of 0 or above", |c| c.cmpge(Vec3::ZERO).all()))?,
        emissive_strength: fields.opt("emissive_strength", |i| i.f32("a strength, 0 or above", |x| x >= 0.0))?,
        unmodelled: Vec::new(),
    };
    keep_rest(&mut fields, Section::Patch, &mut kept)?;
    Ok(MaterialPatch { unmodelled: kept.into_iter().map(|(_, key, value)| (key, value)).collect(), ..patch })
}

fn read_algorithm(item: Item) -> Result<()> {
    let expected = format!("\"{ALGORITHM}\", the one that is modelled (remedy: --set algorithm={ALGORITHM})");
    match item.text(&expected)? {
        ALGORITHM => Ok(()),
        other => {
            let mut error = item.unexpected(expected);
            error.what.push_str(&suggestion(other, [ALGORITHM]));
            Err(error)
        }
    }
}

/// Puts the value of `KEY=VALUE` into the document.
fn apply_set(document: &mut Value, set: &str) -> Result<()> {
    let place = format!("--set {set}");
    let Some((path, text)) = set.split_once('=') else {
        return Err(Error::input(place, "expected KEY=VALUE, such as camera.lens_radius=0, found no ="));
    };
    let value = json::parse(text.as_bytes(), &place).unwrap_or_else(|_| Value::text(text));
    *find_or_make(document, path, &place)? = value;
    Ok(())
}

/// The value at the dotted `path`; objects on the way there, and the value itself, are made where the file leaves them out.
fn find_or_make<'v>(document: &'v mut Value, path: &str, place: &str) -> Result<&'v mut Value> {
    let mut node = document;
    let mut section = Some(Section::Top);
    let mut walked = Place::top(place);
    for key in path.split('.') {
        node = match node {
            Value::Object(pairs) => {
                if let Some(unknown) = section.filter(|s| !s.knows(key)) {
                    return Err(unknown.unknown(&walked, key));
                }
                section = section.and_then(|s| s.child(key));
                let at = pairs.iter().position(|(k, _)| k == key).unwrap_or_else(|| {
                    pairs.push((key.to_owned(), Value::Object(Vec::new())));
                    pairs.len() - 1
                });
                &mut pairs[at].1
            }
            Value::Array(items) => {
                let n = items.len();
                let found = key.parse().ok().and_then(|i: usize| items.get_mut(i));
                found.ok_or_else(|| Error::input(&walked, format!("expected an index below {n}, found {key:?}")))?
            }
            other => {
                let item = Item { value: other, place: walked };
                return Err(item.unexpected(format!("an object that can hold {key:?}")));
            }
        };
        walked = walked.key(key);
    }
    Ok(node)
}

/// Where a value that a set put there is refused, the set is named in place of the file.
fn blame_set(error: Error, file: &str, sets: &[String]) -> Error {
    let Some(at) = error.place.strip_prefix(file).and_then(|rest| rest.strip_prefix(": ")) else { return error };
    let dotted = at.replace('[', ".").replace(']', "");
    let is_inside = |key: &str| dotted == key || dotted.strip_prefix(key).is_some_and(|rest| rest.starts_with('.'));
    let blamed = sets.iter().rev().find(|set| set.split_once('=').is_some_and(|(key, _)| is_inside(key)));
    match blamed {
        Some(set) => Error { place: format!("--set {set}: {at}"), ..error },
        None => error,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn read(text: &str) -> Result<SceneConfig> {
        SceneConfig::parse(text.as_bytes(), "a.json", &[])
    }

    fn read_with(text: &str, sets: &[&str]) -> Result<SceneConfig> {
        SceneConfig::parse(text.as_bytes(), "a.json", &sets.iter().map(|s| (*s).to_owned()).collect::<Vec<_>>())
    }

    #[test]
    fn an_empty_file_has_the_defaults_of_the_format() {
        let config = read("{}").unwrap();
        assert_eq!(config, SceneConfig::default());
        assert_eq!(
            config.to_value().get("framebuffer").unwrap().to_string(),
            r#"{"res_w": 1280, "res_h": 720, "sppx": 10, "exposure": 3.0}"#
        );
        assert!(config.to_json().contains("\"lens_radius\": 0.025,\n"));
        assert!(config.warnings().is_empty());
    }

    #[test]
    fn known_keys_that_are_not_modelled_are_kept_and_listed_once() {
        let text = r#"{"framebuffer": {"hdr": true}, "error_eps": 1e-4, "max_camera_path_length": 7, "rr_start": 5,
            "lightcuts_max": [1, {"a": null}], "beauty_render": false, "scene": {"sky": null, "volumes": null,
            "materials": [{"name": "glass", "ior": 1.5, "specular_col": [1, 1, 1]}]}}"#;
        let config = read(text).unwrap();
        assert_eq!(read(&config.to_json()).unwrap(), config);
        assert_eq!(config.to_value().get("lightcuts_max").unwrap().to_string(), r#"[1, {"a": null}]"#);
        assert_eq!(
            config.warnings(),
            ["known and kept, but not modelled: framebuffer.hdr, error_eps, max_camera_path_length, rr_start, \
              lightcuts_max, beauty_render, scene.materials[0].ior, scene.materials[0].specular_col"]
        );
    }

    #[test]
    fn a_set_is_applied_before_checks_and_blamed_for_its_own_value() {
        let file = r#"{"scene": {"sky": "noon.hdr", "materials": [{"name": "light"}]}, "algorithm": "PathTracer"}"#;
        assert_eq!(
            read(file).unwrap_err().to_string(),
            "a.json: scene.sky: expected null, as it is not modelled (remedy: --set scene.sky=null), found \"noon.hdr\""
        );
        let config = read_with(
            file,
            &[
                "scene.sky=null",
                "algorithm=SimpleRenderer",
                "camera.lens_radius=0",
                "scene.materials.0.emissive_strength=4",
            ],
        )
        .unwrap();
        assert_eq!((config.camera.lens_radius, config.materials[0].emissive_strength), (0.0, Some(4.0)));
        let error = |set: &str| read_with("{}", &[set]).unwrap_err().to_string();
        assert_eq!(
            error("camera.fov=190"),
            "--set camera.fov=190: camera.fov: expected an angle between 0 and 180 degrees, found 190"
        );
        assert!(error("camera.fob=40").ends_with("did you mean \"fov\"?"), "{}", error("camera.fob=40"));
        assert!(error("fov=40").ends_with("it belongs in camera"));
        assert!(error("camera").contains("expected KEY=VALUE"));
        assert!(error("camera.fov.x=3").contains("expected an angle"), "{}", error("camera.fov.x=3"));
        assert!(
            read_with(r#"{"camera": 3}"#, &["camera.fov=3"]).unwrap_err().to_string().contains("that can hold \"fov\"")
        );
        assert!(
            read_with(file, &["scene.materials.1.name=x"]).unwrap_err().what.contains("an index below 1, found \"1\"")
        );
        assert_eq!(read_with("{}", &["scene.mesh_files=[\"a=b.obj\"]"]).unwrap().mesh_files, ["a=b.obj"]);
    }

    /// Zeros, the ends of ranges and their neighbours beside everyday values.
    fn number(low: f32, high: f32) -> impl Strategy<Value = f32> {
        prop_oneof![
            low..high,
            Just(low),
            Just(high),
            Just(low.next_up()),
            Just(high.next_down()),
            Just(low + (high - low) / 3.0)
        ]
    }

    fn vector() -> impl Strategy<Value = Vec3> {
        (number(-9.0, 9.0), number(-1e-3, 1e-3), number(-1e6, 1e6)).prop_map(Vec3::from)
    }

    fn any_patch(name: String) -> impl Strategy<Value = MaterialPatch> {
        (
            prop::option::of("[a-z]{0,9}"),
            prop::option::of((number(0.0, 2.0), number(0.0, 1.0), Just(0.0)).prop_map(Vec3::from)),
            prop::option::of(number(0.0, 1e30)),
            prop::option::of(number(0.0, 1.0)),
        )
            .prop_map(move |(kind, albedo_col, emissive_strength, roughness)| MaterialPatch {
                name: name.clone(),
                kind,
                albedo_col,
                emissive_strength,
                unmodelled: roughness.map(|r| ("roughness".to_owned(), Value::from_f32(r))).into_iter().collect(),
            })
    }

    fn any_config() -> impl Strategy<Value = SceneConfig> {
        let camera =
            (vector(), vector(), vector(), number(f32::MIN_POSITIVE, 179.9), number(0.0, 1e9), number(1e-30, 1e30))
                .prop_filter("dir and up are directions, not parallel", |(_, dir, up, ..)| {
                    is_direction(*dir) && is_direction(*up) && !is_parallel(*dir, *up)
                })
                .prop_map(|(pos, dir, up, fov_degrees, lens_radius, focal_depth)| CameraConfig {
                    pos,
                    dir,
                    up,
                    fov_degrees,
                    lens_radius,
                    focal_depth,
                });
        let framebuffer = (1..=8192u32, 1..=8192u32, prop_oneof![1..=64u32, Just(MAX_SPP)], number(0.0, 100.0))
            .prop_map(|(res_w, res_h, sppx, exposure)| FramebufferConfig { res_w, res_h, sppx, exposure });
        let shading = prop_oneof![Just(Shading::Direct), Just(Shading::Albedo)];
        let estimator = prop_oneof![Just(Estimator::Unbiased), Just(Estimator::Sheet)];
        let files = prop::collection::vec(".{1,9}", 0..3);
        let patches = (0..3usize)
            .prop_flat_map(|n| (0..n).map(|i| any_patch(format!("teapot \"{i}\"\\.001"))).collect::<Vec<_>>());
        let kept = prop::option::of(any::<i64>())
            .prop_map(|n| n.map(|n| (Section::Camera, "rr_depth".to_owned(), Value::integer(n))).into_iter().collect());
        let open = (prop::option::of(".{0,9}"), prop::option::of(any::<u64>()));
        (camera, any::<bool>(), framebuffer, files, patches, shading, (estimator, open), kept).prop_map(
            |(camera, auto_focus, framebuffer, mesh_files, materials, shading, (estimator, open), unmodelled)| {
                SceneConfig {
                    camera,
                    auto_focus,
                    framebuffer,
                    mesh_files,
                    materials,
                    shading,
                    estimator,
                    sampler: open.0,
                    seed: open.1,
                    view: None,
                    unmodelled,
                }
            },
        )
    }

    #[test]
    fn a_printed_config_reads_back_equal() {
        let config = ProptestConfig { cases: 300, failure_persistence: None, ..Default::default() };
        let rng = proptest::test_runner::TestRng::from_seed(proptest::test_runner::RngAlgorithm::ChaCha, &[3; 32]);
        proptest::test_runner::TestRunner::new_with_rng(config, rng)
            .run(&any_config(), |config| {
                let again = read(&config.to_json()).map_err(|e| TestCaseError::fail(e.to_string()))?;
                prop_assert_eq!(again.to_json(), config.to_json());
                prop_assert_eq!(again, config);
                Ok(())
            })
            .unwrap();
    }
}
