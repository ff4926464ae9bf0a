//! Seconds of a render alone: `render SCENE DATA_FOLDER SPP STAGE`, the least of three in one thread. `features.sh` makes a crate of this
//! file and the modules that a render needs.

#[allow(dead_code, reason = "what the other modules of the crate use")]
mod accel;
#[allow(dead_code, reason = "as above")]
mod error;
#[allow(dead_code, unused_imports, reason = "as above")]
mod film;
#[allow(dead_code, reason = "as above")]
mod mutants;
#[allow(dead_code, unused_imports, reason = "as above")]
mod render;
#[allow(dead_code, unused_imports, reason = "as above")]
mod sampling;
#[allow(dead_code, reason = "as above")]
mod scene;

use std::path::Path;
use std::time::Instant;

use sampling::{Preset, Sampler, SamplerSpec};
use scene::compile::{Scene, Stage};
use scene::load::{OpenOptions, open};

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [path, data, spp, stage] = args.as_slice() else { panic!("usage: render SCENE DATA_FOLDER SPP STAGE") };
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().expect("a thread");
    let options = OpenOptions { data: vec![data.into()], sets: Vec::new() };
    let loaded = open(Path::new(path), &options).expect("a scene");
    let size = (loaded.config.framebuffer.res_w, loaded.config.framebuffer.res_h);
    let stage = Stage::ALL.into_iter().find(|s| s.name() == stage).expect("a stage");
    let scene = Scene::new(&loaded.config, loaded.mesh, size, stage).expect("a scene");
    let spec = SamplerSpec::parse("sobol", Preset::Best).expect("a sampler");
    let sampler = Sampler::new(spec, &scene.layout, spp.parse().expect("a count"), 1).expect("a sampler");
    let mut hash = 0;
    let seconds = (0..3).map(|_| {
        let started = Instant::now();
        let rendered = render::render(&scene, &sampler).expect("an image");
        let taken = started.elapsed().as_secs_f64();
        let bits = rendered.image.pixels.iter().flatten().map(|c| u64::from(c.to_bits()));
        hash = bits.fold(0, |hash, bits| sampling::hash::mix64(hash ^ bits));
        taken
    });
    let least = seconds.fold(f64::INFINITY, f64::min);
    println!("{least:.6} {hash:016x}");
}
