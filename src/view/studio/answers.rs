//! What a tab asks for, one by one.

use std::path::{Path, PathBuf};
use std::time::Instant;

use glam::Vec2;
use serde_json::{Value, json};

use super::super::analyst::{self, MAX_POINTS, PointSet};
use super::super::document::Document;
use super::super::message::{Ask, Download};
use super::super::side::Side;
use super::{Open, Studio};
use crate::error::{Error, Result};
use crate::film::write_whole;
use crate::points::read_csv_file;
use crate::sampling::{Decision, Dim2, PixelKey, PointSource, Sampler};
use crate::scene::camera::{Aperture, PixelSample};
use crate::scene::compile::Scene;
use crate::scene::light::LightSet;

/// What takes a while.
#[derive(Clone, Copy)]
enum Errand {
    Points,
    Spectrum,
    File,
}

impl Errand {
    fn name(self) -> &'static str {
        match self {
            Self::Points => "points",
            Self::Spectrum => "spectrum",
            Self::File => "download",
        }
    }
}

impl Studio {
    /// Does, or begins, what is asked for.
    ///
    /// # Errors
    /// What the page shows; nothing changed.
    pub(super) fn answer(&mut self, ask: Ask) -> Result<()> {
        match ask {
            Ask::Set { sets, moving } => {
                let changed = self.document()?.with_sets(&sets)?;
                self.take_document(changed, moving)
            }
            Ask::Document { text, name } => {
                let document = self.document()?.with_text(text.as_bytes(), &short(&name))?;
                self.take_anew(document)
            }
            Ask::Load { name } => {
                let document = self.document()?.neighbour(&name)?;
                self.take_anew(document)
            }
            Ask::Reset {} => {
                let first = self.house.first.clone();
                self.take_anew(first)
            }
            Ask::Restart {} => {
                self.stopped = false;
                self.begin(true)
            }
            Ask::Stop {} => {
                self.stopped = true;
                Ok(())
            }
            // The inbox keeps the last one itself.
            Ask::Shown { .. } => Ok(()),
            Ask::Save { name } => self.save(&name),
            Ask::Download { what, panel } => self.download(what, panel),
            Ask::Probe { x, y } => self.probe(x, y),
            Ask::Pick { x, y } => self.pick(x, y),
            Ask::Points { x, y, decision } => self.points(x, y, &decision),
            Ask::Spectrum {} => self.spectrum(),
            Ask::Dropped { folder, names } => self.dropped(&folder, &names),
        }
    }

    fn opened(&self) -> Result<&Open> {
        self.open.as_ref().ok_or_else(|| Error::input("scene", "expected one that is open, found none"))
    }

    /// What changes are made to: the first document where none could be opened.
    fn document(&self) -> Result<&Document> {
        Ok(self.open.as_ref().map_or(&self.house.first, |open| &open.document))
    }

    /// Another document, from its beginning.
    fn take_anew(&mut self, document: Document) -> Result<()> {
        self.take_document(document, false)?;
        self.stopped = false;
        Ok(())
    }

    fn check_pixel(&self, x: u32, y: u32) -> Result<()> {
        let (w, h) = self.opened()?.scene.camera.size();
        match x < w && y < h {
            true => Ok(()),
            false => Err(Error::input("pixel", format!("expected one of {w} times {h}, found ({x}, {y})"))),
        }
    }

    fn probe(&self, x: u32, y: u32) -> Result<()> {
        self.check_pixel(x, y)?;
        let panel = |side: &Side| {
            let n = side.growing.samples();
            let error = side.growing.luma_variance(x, y).map(|v| (v / f64::from(n)).sqrt());
            json!({"mean": side.growing.mean(x, y), "samples": n, "standard_error": error})
        };
        let panels: Vec<Value> = self.sides.iter().map(panel).collect();
        let reference = self.reference.as_ref().and_then(|reference| reference.pixel(x, y));
        self.outbox.say(&json!({"is": "probe", "x": x, "y": y, "panels": panels, "reference": reference}));
        Ok(())
    }

    /// What the ray through a pixel's middle meets. Where there is a lens and auto focus is off, the plane of focus goes there.
    fn pick(&mut self, x: u32, y: u32) -> Result<()> {
        self.check_pixel(x, y)?;
        let Open { document, scene, .. } = self.opened()?;
        let ray = scene.camera.pinhole_ray(Vec2::new(x as f32 + 0.5, y as f32 + 0.5));
        let Some(hit) = scene.accel.closest_one(&ray, f32::INFINITY) else {
            self.outbox.say(&json!({"is": "pick", "x": x, "y": y, "distance": null}));
            return Ok(());
        };
        let camera = &document.config.camera;
        let depth = hit.t * ray.direction.dot(camera.dir.normalize());
        let material = &scene.mesh.materials[scene.mesh.material_of[hit.triangle as usize] as usize];
        let focuses = !document.config.auto_focus && camera.lens_radius > 0.0 && depth > 0.0;
        self.outbox.say(&json!({
            "is": "pick", "x": x, "y": y, "distance": hit.t, "depth": depth, "focused": focuses,
            "material": if material.name.is_empty() { "(default grey)" } else { &material.name },
            "emits": material.is_emitter, "point": (ray.origin + ray.direction * hit.t).to_array(),
        }));
        match focuses {
            true => self.answer(Ask::Set { sets: vec![format!("camera.focal_depth={depth}")], moving: false }),
            false => Ok(()),
        }
    }

    /// The numbers that a pixel's decision reads, of every panel, with their discrepancies.
    fn points(&mut self, x: u32, y: u32, decision: &str) -> Result<()> {
        self.check_pixel(x, y)?;
        let scene = &self.opened()?.scene;
        let Some(decision) = Decision::ALL.into_iter().find(|d| d.key() == decision) else {
            let keys = Decision::ALL.map(Decision::key).join(" ");
            return Err(Error::input("points", format!("expected a decision ({keys}), found {decision:?}")));
        };
        if scene.layout.find(decision).is_none() {
            let what =
                format!("expected a decision that the scene makes ({}), found {}", scene.layout, decision.name());
            return Err(Error::input("points", what));
        }
        let sets = self.sides.iter().map(|side| set_of(side, scene, PixelKey::new(x, y), decision)).collect();
        let about = json!({"x": x, "y": y, "decision": decision.key(), "name": decision.name()});
        let outbox = self.outbox.clone();
        self.errand(Errand::Points, move || analyst::points(&about, sets, &outbox))
    }

    fn spectrum(&mut self) -> Result<()> {
        self.wants_truth = true;
        let halves = self.reference.as_ref().and_then(|reference| reference.images());
        let is_ready = !self.sides.is_empty() && self.sides.iter().all(|side| side.growing.samples() > 0);
        let (Some(halves), true) = (halves, is_ready) else {
            let wait = "Waiting for a reference with a sample in every pixel.";
            self.outbox.say(&json!({"is": "spectrum", "panels": [], "wait": wait}));
            return Ok(());
        };
        let panel = |side: &Side| (side.set.to_string(), side.growing.image(), side.growing.samples());
        let panels: Vec<_> = self.sides.iter().map(panel).collect();
        let (samples, outbox) = (self.reference.as_ref().map_or(0, |r| r.samples()), self.outbox.clone());
        self.errand(Errand::Spectrum, move || analyst::spectrum(&panels, &halves, samples, &outbox))
    }

    /// Does something that takes a while, one of its kind at a time.
    fn errand(&self, kind: Errand, work: impl FnOnce() + Send + 'static) -> Result<()> {
        match self.errands[kind as usize].start(work) {
            true => Ok(()),
            false => Err(Error::input(kind.name(), "expected one such request at a time, found another under way")),
        }
    }

    /// Writes the document into the folder of `--data`, under a name that nobody has.
    fn save(&self, name: &str) -> Result<()> {
        let Some(folder) = &self.house.save_to else {
            let what = "expected a folder to save in, found none (remedy: start with --data DIR, or download)";
            return Err(Error::input("save", what));
        };
        let stem = name.strip_suffix(".json").unwrap_or(name);
        let is_plain = |c: char| c.is_alphanumeric() || matches!(c, '-' | '_' | ' ' | '.');
        if stem.is_empty() || stem.len() > 100 || stem.starts_with('.') || !stem.chars().all(is_plain) {
            let what = format!("expected a name of letters, digits, - and _, found {:?}", short(name));
            return Err(Error::input("save", what));
        }
        let text = self.document()?.config.to_json();
        let names = std::iter::once(format!("{stem}.json")).chain((2..1000).map(|i| format!("{stem}-{i}.json")));
        for name in names {
            let path = folder.join(&name);
            // The name is taken first, so that two tabs never write one file; then the file is written whole.
            match std::fs::File::options().write(true).create_new(true).open(&path) {
                Ok(_) => {
                    write_whole(&path, text.as_bytes())?;
                    self.outbox.say(&json!({"is": "saved", "name": name}));
                    return Ok(());
                }
                Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => {}
                Err(e) => return Err(Error::write(&path, format!("cannot write: {e}"))),
            }
        }
        Err(Error::input("save", "expected a name that is free, found a thousand of it"))
    }

    fn download(&self, what: Download, panel: usize) -> Result<()> {
        let Open { document, scene, .. } = self.opened()?;
        let stem = document.name.strip_suffix(".json").unwrap_or(&document.name).to_owned();
        if what == Download::Document {
            let header = json!({"is": "file", "name": format!("{stem}.json"), "type": "application/json"});
            self.outbox.send_bytes(&header, document.config.to_json().as_bytes());
            return Ok(());
        }
        let Some(side) = self.sides.get(panel).filter(|side| side.growing.samples() > 0) else {
            return Err(Error::input("download", "expected a picture with a sample in every pixel, found none yet"));
        };
        let (image, exposure, outbox) = (side.growing.image(), self.exposure, self.outbox.clone());
        let name = format!("{stem}-{}spp", side.growing.samples());
        if what == Download::Png {
            return self.errand(Errand::File, move || analyst::png(&format!("{name}.png"), &image, exposure, &outbox));
        }
        let text = |name: &str, value: &dyn std::fmt::Display| (name.to_owned(), value.to_string());
        let provenance = [
            text("version", &env!("CARGO_PKG_VERSION")),
            text("scene", &document.name),
            text("sampler", &side.set),
            // Of a picture that is not finished, the count that its set was made for differs.
            text("spp", &side.growing.samples()),
            text("spp_of_set", &side.sampler.samples()),
            text("seed", &document.seed),
            text("estimator", &scene.estimator.name()),
        ];
        self.errand(Errand::File, move || analyst::exr(&format!("{name}.exr"), &image, &provenance, &outbox))
    }

    /// A config, a mesh with what belongs to it, or a point set.
    fn dropped(&mut self, folder: &Path, names: &[String]) -> Result<()> {
        let of = |end: &str| names.iter().find(|name| name.to_lowercase().ends_with(end));
        let places = |document: &Document| -> Vec<PathBuf> {
            std::iter::once(folder.to_owned()).chain(document.places.iter().cloned()).collect()
        };
        if let Some(name) = of(".json") {
            let bytes = read(folder, name)?;
            let mut document = self.document()?.with_text(&bytes, name)?;
            if names.len() > 1 {
                document.places = places(&document);
            }
            return self.take_anew(document);
        }
        let meshes: Vec<String> = names.iter().filter(|n| n.to_lowercase().ends_with(".obj")).cloned().collect();
        if !meshes.is_empty() {
            let document = self.document()?;
            let document = document.of_mesh(meshes, places(document))?;
            return self.take_anew(document);
        }
        let Some(name) = of(".csv").or_else(|| of(".txt")) else {
            let what = "expected a config (.json), a mesh (.obj, with its .mtl and textures) or a point set (.csv)";
            return Err(Error::input("drop", format!("{what}, found {}", names.join(" "))));
        };
        let path = folder.join(name);
        let called = |e: Error| Error { place: e.place.replace(&path.display().to_string(), name), ..e };
        let found = read_csv_file(&path).map_err(called)?;
        if found.n() > MAX_POINTS {
            let what =
                format!("expected at most {MAX_POINTS} points, found {} (remedy: `sampler-lab measure`)", found.n());
            return Err(Error::input(name, what));
        }
        let coordinates = found.iter().flatten().copied().collect();
        let set = PointSet { source: name.clone(), dimension: found.dimension(), coordinates };
        let (about, outbox) = (json!({"file": name}), self.outbox.clone());
        self.errand(Errand::Points, move || analyst::points(&about, vec![set], &outbox))?;
        self.changed = Instant::now();
        Ok(())
    }
}

fn read(folder: &Path, name: &str) -> Result<Vec<u8>> {
    std::fs::read(folder.join(name))
        .map_err(|e| Error::input(name, format!("expected the file that was dropped, found: {e}")))
}

/// A name as messages show it.
fn short(name: &str) -> String {
    name.chars().filter(|c| !c.is_control()).take(100).collect()
}

/// The numbers of a decision in a pixel, at most [`MAX_POINTS`]; a place on a line gets its index for the other axis.
fn set_of(side: &Side, scene: &Scene, pixel: PixelKey, decision: Decision) -> PointSet {
    let n = (side.sampler.samples() as usize).min(MAX_POINTS);
    let source = match n < side.sampler.samples() as usize {
        true => format!("{}: the first {n} of {}", side.set.of(decision), side.sampler.samples()),
        false => format!("{}: {n} points", side.set.of(decision)),
    };
    let (mut x, mut y) = (vec![0.0; n], vec![0.0; n]);
    if let (Decision::LightPick, Some(LightSet::Many { pick, .. })) = (decision, &scene.lights) {
        side.sampler.fill_1d(pixel, 0, pick, &mut x);
        return PointSet { source, dimension: 1, coordinates: x.into_iter().map(f64::from).collect() };
    }
    if let Some(ticket) = ticket(scene, decision) {
        Sampler::fill_2d(&side.sampler, pixel, 0, ticket, &mut x, &mut y);
    }
    let coordinates = x.into_iter().zip(y).flat_map(|(x, y)| [f64::from(x), f64::from(y)]).collect();
    PointSet { source, dimension: 2, coordinates }
}

/// The ticket of a decision in the plane.
fn ticket(scene: &Scene, decision: Decision) -> Option<&Dim2> {
    match (decision, &scene.camera.pixel, &scene.camera.aperture, &scene.lights) {
        (Decision::Pixel, PixelSample::Sampled(dim), ..) => Some(dim),
        (Decision::Lens, _, Aperture::ThinLens { lens, .. }, _) => Some(lens),
        (Decision::LightPoint, .., Some(LightSet::One { point, .. } | LightSet::Many { point, .. })) => Some(point),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_shown_without_control_characters_and_cut() {
        assert_eq!(short("a\n\u{1b}[31mb"), "a[31mb");
        assert_eq!(short(&"x".repeat(1000)).len(), 100);
    }
}
