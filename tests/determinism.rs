//! The same scene and numbers give the same bits: on any number of threads, pixel by pixel, sample by sample, today and after
//! the next change.

use std::collections::BTreeMap;
use std::sync::Mutex;

use glam::Vec3;
use sampler_lab::accel::{self, Kernel};
use sampler_lab::check::room::{Room, ceiling, looking_at, spec};
use sampler_lab::film::Image;
use sampler_lab::render::{self, draw_numbers, render, render_sample};
use sampler_lab::sampling::{
    self, Dim1, Dim2, PixelKey, PointSource, Points, Preset, Sampler, SamplerSpec, every_legal_spec,
};
use sampler_lab::scene::compile::{Scene, Stage};
use sampler_lab::scene::config::Estimator;
use sha2::{Digest, Sha256};

/// All four decisions: sampled pixel, lens, two lights (one of them a mesh), a blocker for shadows. 11 × 9 pixels and odd
/// counts cut tiles and packets where they do not fit.
fn scene(stage: Stage) -> Scene {
    let mut room = Room::default();
    room.floor(6.0, 0.7);
    room.light(&ceiling(Vec3::new(-1.0, 3.0, 0.5), 0.5, 0.4), 8.0);
    let pentagon = [(1.0, 0.0), (2.0, 0.0), (2.5, 1.0), (1.5, 2.0), (0.5, 1.0)];
    room.light(&pentagon.map(|(x, z)| Vec3::new(x, 2.5, z)), 3.0);
    let blocker = room.material(0.4, None);
    room.polygon(&ceiling(Vec3::new(0.1, 1.2, 0.3), 0.6, 0.35), blocker);
    let mut camera = looking_at(Vec3::new(0.5, 1.0, -4.0), Vec3::new(0.0, 0.5, 0.0), 50.0);
    camera.lens_radius = 0.1;
    camera.focal_depth = 4.0;
    room.scene_with(&camera, (11, 9), stage, Estimator::Unbiased)
}

fn image(scene: &Scene, sampler: &Sampler) -> Image {
    render(scene, sampler).unwrap().image
}

fn bits(image: &Image) -> Vec<u32> {
    image.pixels.iter().flatten().map(|c| c.to_bits()).collect()
}

/// `center` has no numbers for lights: it draws the stages without.
fn stage_for(s: SamplerSpec) -> Stage {
    if s.points == Points::Center { Stage::Dof } else { Stage::Final }
}

#[test]
fn one_two_and_seven_threads_give_the_same_bytes_for_every_sampler() {
    let pools = [1, 2, 7].map(|threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap());
    let scenes = [scene(Stage::Final), scene(Stage::Dof)];
    let mut lit = 0;
    for s in every_legal_spec() {
        let scene = &scenes[usize::from(stage_for(s) == Stage::Dof)];
        let sampler = Sampler::new(s, &scene.layout, 5, 1234).unwrap();
        let [one, two, seven] = [0, 1, 2].map(|p: usize| pools[p].install(|| bits(&image(scene, &sampler))));
        assert!(one == two && one == seven, "{s}");
        lit += one.iter().filter(|&&b| b != 0).count();
    }
    assert!(lit > 1000, "the images are not black");
}

/// Those that this processor has. Counts that fill no packet.
#[test]
fn every_kernel_gives_the_same_bytes_on_one_thread_and_on_two() {
    let pools = [1, 2].map(|threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap());
    for stage in Stage::ALL {
        let mut scene = scene(stage);
        let names: &[&str] = if stage == Stage::Start { &["center"] } else { &["uniform", "sobol", "halton", "ld"] };
        for name in names {
            let sampler = Sampler::new(spec(name), &scene.layout, 21, 7).unwrap();
            let mut images = Vec::new();
            for kernel in Kernel::available() {
                scene.accel.set_kernel(kernel);
                images.extend(pools.iter().map(|pool| (kernel, pool.install(|| bits(&image(&scene, &sampler))))));
            }
            let first = &images[0].1;
            assert!(first.iter().any(|&b| b != 0), "{stage:?}, {name}: black");
            for (kernel, found) in &images {
                assert!(found == first, "{stage:?}, {name}: {kernel} gives other bits than {}", images[0].0);
            }
        }
    }
}

/// Numbers that somebody asked for: pixel, decision and index, with how often.
struct Asked<'a> {
    sampler: &'a Sampler,
    seen: Mutex<BTreeMap<(u64, &'static str, u32), u32>>,
}

impl Asked<'_> {
    fn note(&self, pixel: PixelKey, decision: &'static str, first: u32, count: usize) {
        let mut seen = self.seen.lock().unwrap();
        (first..first + count as u32).for_each(|i| *seen.entry((pixel.word(), decision, i)).or_default() += 1);
    }
}

impl PointSource for Asked<'_> {
    fn samples(&self) -> u32 {
        self.sampler.samples()
    }

    fn fill_1d(&self, pixel: PixelKey, first: u32, dim: &Dim1, out: &mut [f32]) {
        self.note(pixel, dim.decision().name(), first, out.len());
        self.sampler.fill_1d(pixel, first, dim, out);
    }

    fn fill_2d(&self, pixel: PixelKey, first: u32, dim: &Dim2, x: &mut [f32], y: &mut [f32]) {
        self.note(pixel, dim.decision().name(), first, x.len());
        self.sampler.fill_2d(pixel, first, dim, x, y);
    }
}

#[test]
fn the_numbers_drawn_alone_are_those_of_the_image_each_once() {
    for (stage, decisions) in [(Stage::Final, 4), (Stage::Dof, 2)] {
        let scene = scene(stage);
        let sampler = Sampler::new(SamplerSpec::parse("ld", Preset::Best).unwrap(), &scene.layout, 21, 5).unwrap();
        let asked = || Asked { sampler: &sampler, seen: Mutex::default() };
        let (image, alone) = (asked(), asked());
        render(&scene, &image).unwrap();
        draw_numbers(&scene, &alone);
        let (image, alone) = (image.seen.into_inner().unwrap(), alone.seen.into_inner().unwrap());
        assert_eq!(alone.len(), 11 * 9 * sampler.samples() as usize * decisions);
        assert!(alone.values().all(|&times| times == 1) && image == alone);
    }
}

/// A pixel is the f64 sum of its samples in the order of their indices, over their count, rounded once.
#[test]
fn a_pixel_rendered_alone_is_the_pixel_of_the_image_for_every_sampler() {
    let scenes = [scene(Stage::Final), scene(Stage::Dof)];
    for s in every_legal_spec() {
        let scene = &scenes[usize::from(stage_for(s) == Stage::Dof)];
        let sampler = Sampler::new(s, &scene.layout, 5, 99).unwrap();
        let whole = image(scene, &sampler);
        for (x, y) in [(0, 0), (7, 3), (8, 8), (10, 5)] {
            let mut sums = [0.0f64; 3];
            for index in 0..sampler.samples() {
                let radiance = render_sample(scene, &sampler, x, y, index);
                sums.iter_mut().zip(radiance.to_array()).for_each(|(sum, c)| *sum += f64::from(c));
            }
            let alone = sums.map(|sum| (sum / f64::from(sampler.samples())) as f32);
            let within = whole.pixels[(y * whole.width + x) as usize];
            assert_eq!(alone.map(f32::to_bits), within.map(f32::to_bits), "{s}: pixel ({x}, {y})");
        }
    }
}

#[test]
fn another_seed_gives_another_image_exactly_where_something_is_random() {
    let scene = scene(Stage::Final);
    for s in every_legal_spec().into_iter().filter(|s| s.points != Points::Center) {
        let [a, b] = [1, 2].map(|seed| image(&scene, &Sampler::new(s, &scene.layout, 4, seed).unwrap()));
        let is_random = sampling::SamplerSet::from(s).is_random(&scene.layout);
        assert_eq!(bits(&a) != bits(&b), is_random, "{s}");
    }
}

/// SHA-256 over the bits of one small image for each of the best presets, in order. The bits may change only together with an
/// algorithm number, since stored results are known by those numbers.
#[test]
fn the_bits_of_a_known_image_are_those_of_these_algorithm_numbers() {
    let scene = scene(Stage::Final);
    let mut hash = Sha256::new();
    for name in ["uniform", "stratified", "halton", "hammersley", "ld", "sobol", "ld:sheet"] {
        let sampler = Sampler::new(spec(name), &scene.layout, 5, 42).unwrap();
        bits(&image(&scene, &sampler)).iter().for_each(|b| hash.update(b.to_le_bytes()));
    }
    let found: String = hash.finalize().iter().map(|b| format!("{b:02x}")).collect();
    let numbers = (render::ALGORITHM, sampling::ALGORITHM, accel::ALGORITHM);
    assert_eq!(
        (numbers, found.as_str()),
        ((1, 1, 1), "e94c847d734f03c192124990f5c1cf5be8b0116181599a62618ec10690dbb2a5"),
        "an image's bits changed: raise render::, sampling:: or accel::ALGORITHM, whose bits they are, and pin both here"
    );
}
