//! Memory of the large scene: what is stated before work starts, and what the process took at most.

use std::rc::Rc;

use super::lab::{Lab, SIZE};
use super::scenes::Landscape;
use super::timing::{Case, Part, Repeat};
use crate::error::Error;
use crate::render::render;
use crate::sampling::{Preset, Sampler, SamplerSpec};
use crate::scene::compile::Scene;

const MIB: f64 = 1_048_576.0;

pub fn cases(lab: &Rc<Lab>) -> Vec<Case> {
    let lab = Rc::clone(lab);
    let parts = ["/stated", "/peak"].map(|suffix| Part { suffix: suffix.to_owned(), unit: "MiB" });
    let prepare = move || {
        let repeat: Repeat = Box::new(move || {
            let scene = lab.landscape(1).borrow();
            let stated = Scene::most_bytes(&scene.mesh, u64::from(SIZE.0) * u64::from(SIZE.1)) as f64 / MIB;
            let spec = SamplerSpec::parse("sobol", Preset::Best)?;
            let sampler = Sampler::new(spec, &scene.layout, 1, 1)?;
            render(&scene, &sampler).map_err(|bad| Error::incomplete(Landscape::LARGE.name, bad))?;
            Ok(vec![stated, peak_bytes().map_or(f64::NAN, |bytes| bytes / MIB)])
        });
        Ok(repeat)
    };
    vec![Case {
        name: format!("memory/{}", Landscape::LARGE.name),
        parts: parts.into(),
        sizes: None,
        most: 1,
        prepare: Box::new(prepare),
    }]
}

/// Largest resident size of this process so far, where the system tells it.
fn peak_bytes() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<f64>().ok()? * 1024.0)
}
