//! What takes longer than a picture may wait: errors with their interval, spectra, discrepancies, files. One thread at a time for each kind.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use serde_json::{Value, json};

use super::channel::Outbox;
use crate::film::{Image, exr_bytes, png_rgb8_bytes, to_screen};
use crate::points::{Options, measure};
use crate::report::pictures::error_scale;
use crate::stats::Points;
use crate::stats::error_spectrum::{Power, error_spectrum};
use crate::stats::image_error::{ensemble, reference_noise};

/// Most points of a set that is measured while one waits.
pub const MAX_POINTS: usize = 4096;

/// Steps that an exact star discrepancy may take while one waits, about a second.
const STAR_COST: f64 = 3e8;

/// One kind of work at a time, off the thread that makes pictures.
#[derive(Default)]
pub struct Analyst {
    busy: Arc<AtomicBool>,
}

impl Analyst {
    /// Whether there is work under way.
    pub fn is_busy(&self) -> bool {
        self.busy.load(Ordering::Relaxed)
    }

    /// Does `work` on a thread of its own; `false` where there is work under way, or no thread to be had.
    pub fn start(&self, work: impl FnOnce() + Send + 'static) -> bool {
        if self.busy.swap(true, Ordering::Relaxed) {
            return false;
        }
        let done = Done(self.busy.clone());
        let thread = std::thread::Builder::new().name("analyst".to_owned());
        thread
            .spawn(move || {
                let _done = done;
                work();
            })
            .is_ok()
    }
}

/// Frees the analyst when dropped, however the work ended.
struct Done(Arc<AtomicBool>);

impl Drop for Done {
    fn drop(&mut self) {
        self.0.store(false, Ordering::Relaxed);
    }
}

/// Errors against the reference, of pictures that may since have grown.
#[derive(Debug, Clone, Default)]
pub struct Figures {
    /// The pictures' number: others are of no use.
    pub epoch: u64,
    /// Of each panel: samples, and the errors.
    pub panels: Vec<Value>,
    /// Where error maps end.
    pub error_scale: Option<f64>,
}

impl Figures {
    /// Whether they are of pictures and a reference of so many samples.
    pub fn is_of(&self, samples: &[u32], reference: u32) -> bool {
        let told = |panel: &Value, name: &str| panel[name].as_u64().unwrap_or(0);
        self.panels.len() == samples.len()
            && self.panels.iter().zip(samples).all(|(panel, &n)| {
                told(panel, "samples") == u64::from(n) && told(panel, "reference_samples") == u64::from(reference)
            })
    }
}

/// Figures that two threads look at.
pub type SharedFigures = Arc<Mutex<Figures>>;

/// Works out the panels' errors: pictures with their samples, the reference's halves and their samples.
pub fn figures(epoch: u64, panels: &[(Image, u32)], halves: &[Image; 2], samples: u32, shared: &SharedFigures) {
    let [r1, r2] = halves;
    let noise = reference_noise(r1.pixels.as_flattened(), r2.pixels.as_flattened());
    let mut mean = r1.clone();
    for (a, b) in mean.pixels.as_flattened_mut().iter_mut().zip(r2.pixels.as_flattened()) {
        *a = 0.5 * (*a + *b);
    }
    let of_panel = |(image, taken): &(Image, u32)| {
        let found = ensemble(&[image.pixels.as_slice()], &r1.pixels, &r2.pixels);
        json!({"samples": taken, "rmse": found.rmse, "mse": found.mse, "bias": found.bias,
               "reference_samples": samples, "reference_rmse": noise.sqrt()})
    };
    let found = Figures {
        epoch,
        panels: panels.iter().map(of_panel).collect(),
        error_scale: error_scale(panels.iter().map(|(image, _)| image), &mean).ok(),
    };
    *shared.lock().unwrap_or_else(PoisonError::into_inner) = found;
}

/// Tells the power of the panels' errors by frequency.
pub fn spectrum(panels: &[(String, Image, u32)], halves: &[Image; 2], samples: u32, outbox: &Outbox) {
    let of_panel = |(sampler, image, taken): &(String, Image, u32)| {
        let power = Power::of(&image.pixels, &halves[0].pixels, &halves[1].pixels, image.width as usize);
        let mse = power.mse();
        json!({"sampler": sampler, "samples": taken, "mse": mse, "spectrum": error_spectrum(&[power])})
    };
    let panels: Vec<Value> = panels.iter().map(of_panel).collect();
    outbox.say(&json!({"is": "spectrum", "panels": panels, "reference_samples": samples}));
}

/// A set of points with what is to be said of it.
pub struct PointSet {
    /// Where it comes from.
    pub source: String,
    /// Dimension, 1 or more.
    pub dimension: usize,
    /// Coordinates, point by point.
    pub coordinates: Vec<f64>,
}

/// Measures sets and tells them with their points: the first two coordinates of each.
pub fn points(title: &Value, sets: Vec<PointSet>, outbox: &Outbox) {
    let told = sets.into_iter().map(|set| {
        let shown: Vec<Vec<f64>> =
            set.coordinates.chunks(set.dimension).map(|p| p.iter().copied().take(2).collect()).collect();
        let measured = Points::new(set.dimension, set.coordinates).map_err(|e| e.to_string()).and_then(|points| {
            let exact = measure(&set.source, &points, Options { star_cost: Some(STAR_COST) });
            // Without the exact star discrepancy where it would take too long; the page says that it is left out.
            let found = exact.or_else(|_| measure(&set.source, &points, Options { star_cost: None }));
            found.map_err(|e| e.to_string())
        });
        match measured {
            Ok(measured) => json!({"source": set.source, "points": shown, "measured": measured}),
            Err(e) => json!({"source": set.source, "points": shown, "error": e}),
        }
    });
    let sets: Vec<Value> = told.collect();
    outbox.say(&json!({"is": "points", "about": title, "sets": sets}));
}

/// Sends a picture as PNG.
pub fn png(name: &str, image: &Image, exposure: f32, outbox: &Outbox) {
    let bytes = png_rgb8_bytes(image.width, image.height, &to_screen(image, exposure));
    send_file(name, "image/png", bytes, outbox);
}

/// Sends a picture's radiance as OpenEXR.
pub fn exr(name: &str, image: &Image, provenance: &[(String, String)], outbox: &Outbox) {
    send_file(name, "image/x-exr", exr_bytes(image, provenance), outbox);
}

fn send_file(name: &str, kind: &str, bytes: Result<Vec<u8>, String>, outbox: &Outbox) {
    match bytes {
        Ok(bytes) => outbox.send_bytes(&json!({"is": "file", "name": name, "type": kind}), &bytes),
        Err(e) => outbox.say(&json!({"is": "error", "text": format!("{name}: expected a file, found: {e}")})),
    }
}
