//! What a tab is told of its scene, as JSON.

use std::collections::HashSet;

use glam::Vec3;
use serde_json::{Map, Value, json};

use super::document::Document;
use super::{MAX_UPLOAD_BYTES, MAX_UPLOAD_FILES, MAX_VIEW_PIXELS, document};
use crate::sampling::{Decision, MAX_SAMPLES, Points, Preset, SamplerSet, SamplerSpec, every_legal_spec};
use crate::scene::compile::Scene;
use crate::scene::load::LoadedScene;

/// What never changes: the vocabulary of samplers, and bounds.
pub fn vocabulary(can_save: bool) -> Value {
    let mut presets = Map::new();
    for preset in [Preset::Sheet, Preset::Best, Preset::Plain] {
        for &points in Points::ALL.iter().filter(|&&p| p != Points::Center) {
            if let Some(spec) = preset.of(points) {
                presets.insert(format!("{}:{}", points.word(), word(preset)), json!(spec.to_string()));
            }
        }
    }
    let legal: Vec<String> = every_legal_spec().iter().map(SamplerSpec::to_string).collect();
    let decisions: Vec<Value> =
        Decision::ALL.iter().map(|d| json!({"key": d.key(), "name": d.name(), "dimensions": d.dimensions()})).collect();
    json!({
        "is": "hello", "version": env!("CARGO_PKG_VERSION"), "presets": presets, "legal": legal, "decisions": decisions,
        "most_pixels": MAX_VIEW_PIXELS, "most_samples": MAX_SAMPLES, "can_save": can_save,
        "most_files": MAX_UPLOAD_FILES, "most_bytes": MAX_UPLOAD_BYTES,
    })
}

fn word(preset: Preset) -> &'static str {
    match preset {
        Preset::Sheet => "sheet",
        Preset::Best => "best",
        Preset::Plain => "plain",
    }
}

/// A set of samplers by decision.
pub fn samplers(set: &SamplerSet) -> Value {
    Decision::ALL.iter().map(|&d| (d.key().to_owned(), json!(set.of(d).to_string()))).collect::<Map<_, _>>().into()
}

/// The document and everything that depends on it.
pub fn whole(document: &Document, loaded: &LoadedScene, scene: &Scene, moving: bool) -> Value {
    let text = document.config.to_json();
    let config: Value = serde_json::from_str(&text).expect("what we print is JSON");
    let (focal, decisions) = (scene.focal_depth(), scene.layout.claims().iter().map(|c| c.decision.key()));
    let mut state = json!({
        "is": "state", "name": document.name, "config": config,
        // Beyond 2^53 a page's numbers are not ours.
        "seed": document.seed.to_string(),
        "samplers": samplers(&document.set), "sampler": document.set.to_string(),
        "made": decisions.collect::<Vec<_>>(), "focal_depth": focal, "moving": moving,
    });
    if !moving {
        let (centre, radius) = document::bounds(&scene.mesh);
        let notes = [loaded.warnings.clone(), scene.warnings.clone()].concat();
        let about = json!({
            "layout": scene.layout.to_string(),
            "materials": materials(loaded),
            "lights": lights(scene),
            "triangles": scene.mesh.len(),
            "centre": centre.to_array(), "radius": radius,
            // How far things are, for the speed of the camera.
            "depth": scene.camera.auto_focus(&scene.accel),
            "notes": notes,
            "neighbours": document.neighbours(),
        });
        merge(&mut state, about);
    }
    state
}

fn merge(into: &mut Value, from: Value) {
    if let (Value::Object(into), Value::Object(from)) = (into, from) {
        into.extend(from);
    }
}

/// Materials by name: a patch of the scene file is one for all of a name.
fn materials(loaded: &LoadedScene) -> Vec<Value> {
    let mut told: Vec<Value> = Vec::new();
    let mut names: HashSet<&str> = HashSet::new();
    for (index, material) in loaded.mesh.materials.iter().enumerate() {
        let Some((albedo, strength)) = loaded.unpatched(index) else { continue };
        if !names.insert(&material.name) {
            continue;
        }
        let patch = loaded.config.materials.iter().find(|patch| patch.name == material.name);
        told.push(json!({
            "name": material.name, "emits": material.is_emitter, "textured": material.texture.is_some(),
            "albedo": plain(material.albedo),
            "strength": patch.and_then(|p| p.emissive_strength).unwrap_or(strength),
            "own_albedo": plain(albedo), "own_strength": strength,
        }));
    }
    told
}

fn lights(scene: &Scene) -> Vec<Value> {
    let lights = scene.lights.as_ref().map_or(&[][..], |lights| lights.lights());
    lights
        .iter()
        .map(|l| json!({"name": l.name, "power": l.power, "area": l.area, "emission": plain(l.emission)}))
        .collect()
}

/// Numbers that read like the floats they are: 0.3, not 0.30000001192092896.
fn plain(v: Vec3) -> Value {
    v.to_array().map(|c| c.to_string().parse::<f64>().unwrap_or(f64::from(c))).to_vec().into()
}
