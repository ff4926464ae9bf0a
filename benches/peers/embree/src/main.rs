//! Embree's queries and ours in turn, on the same triangles and rays; prints a table. See ../README.md.
//!
//! usage: embree-peer [--scene 200k|3200k] [--rounds N] [--threads N,N]

mod library;

use std::time::Instant;

use glam::Vec3;
use library::{Device, LANES, NOTHING, RayHit, RayHit16, Valid};
use rayon::prelude::*;
use sampler_lab::accel::{Accel, Ray};
use sampler_lab::bench::scenes::Landscape;
use sampler_lab::bench::{self, Batches, KINDS, Kind, Query};
use sampler_lab::scene::compile::Scene;
use sampler_lab::scene::geometry::triangles;

/// Parts into which the rays of a kind are cut: all programs trace one part before the next comes.
const PARTS: usize = 24;
/// Packets that a thread takes at once.
const CHUNK: usize = 64;

struct Options {
    scenes: Vec<Landscape>,
    rounds: usize,
    threads: Vec<usize>,
}

fn options() -> Result<Options, String> {
    let mut options = Options { scenes: Landscape::ALL.to_vec(), rounds: 10, threads: vec![1, 2] };
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let value = words.next().ok_or(format!("{word}: expected a value"))?;
        let whole = |text: &str| text.parse::<usize>().ok().filter(|n| *n > 0);
        match word.as_str() {
            "--scene" => options.scenes.retain(|landscape| landscape.name.ends_with(&format!("-{value}"))),
            "--rounds" => options.rounds = whole(&value).ok_or("--rounds: expected a count")?,
            "--threads" => {
                options.threads =
                    value.split(',').map(whole).collect::<Option<_>>().ok_or("--threads: expected counts")?;
            }
            _ => return Err(format!("expected --scene, --rounds or --threads, found {word}")),
        }
    }
    if options.scenes.is_empty() { Err("--scene: expected 200k or 3200k".to_owned()) } else { Ok(options) }
}

fn main() -> Result<(), String> {
    let options = options()?;
    let version = Device::new(1).version();
    println!("{}; Embree {}.{}.{}", bench::host(), version / 10_000, version / 100 % 100, version % 100);
    for landscape in &options.scenes {
        let scene = landscape.scene((1280, 720));
        println!("\n{}, {} triangles", landscape.name, scene.mesh.len());
        let mut theirs = None;
        for &threads in &options.threads {
            theirs = Some(build(&scene, threads));
        }
        let theirs = theirs.expect("at least one count of threads");
        for (batches, (kind, name)) in bench::all_kinds(&scene).into_iter().zip(KINDS) {
            let parts: Vec<Part> = batches.parts(PARTS).into_iter().map(Part::new).collect();
            for &threads in &options.threads {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().map_err(|e| e.to_string())?;
                pool.install(|| compare(&scene.accel, &theirs, &parts, kind, options.rounds))
                    .print(&format!("{name}, {threads} threads"));
            }
        }
    }
    Ok(())
}

/// Builds both trees three times in turn, prints the medians, and gives Embree's.
fn build(scene: &Scene, threads: usize) -> library::Scene {
    let device = Device::new(threads);
    let corners: Vec<[[f32; 3]; 3]> = scene.mesh.positions.iter().map(|t| t.map(|c| c.to_array())).collect();
    let (ours, mut seconds, mut built) = (triangles(&scene.mesh), [const { Vec::new() }; 3], None);
    for _ in 0..3 {
        let started = Instant::now();
        let accel = Accel::new(&ours, scene.reach());
        seconds[0].push(started.elapsed().as_secs_f64());
        let started = Instant::now();
        accel.occluded_one(&Ray { origin: Vec3::ZERO, direction: Vec3::ONE }, 0.0);
        seconds[1].push(started.elapsed().as_secs_f64());
        drop(accel);
        drop(built.take());
        let (theirs, taken) = device.scene(&corners);
        seconds[2].push(taken);
        built = Some(theirs);
    }
    let [ours, single, embree] = seconds.map(median);
    println!("build, {threads} threads: ours {ours:.3} s, and {single:.3} s for single rays; Embree {embree:.3} s");
    built.expect("built above")
}

/// Some of the rays, as each side takes them.
struct Part {
    ours: Batches,
    packets: Vec<(Valid, RayHit16)>,
}

impl Part {
    fn new(ours: Batches) -> Self {
        let packets =
            ours.packets().map(|(origin, direction, limit)| library::packet(origin, direction, limit)).collect();
        Self { ours, packets }
    }

    /// Traces the rays through Embree one by one; how many met something.
    fn single(&self, scene: &library::Scene, any: bool) -> usize {
        let chunk = |packets: &[(Valid, RayHit16)]| {
            let mut met = 0;
            for (valid, rays) in packets {
                for lane in (0..LANES).filter(|&lane| valid.0[lane] != 0) {
                    let mut ray = RayHit::of(rays, lane);
                    scene.trace_one(&mut ray, any);
                    met += usize::from(if any { ray.far < 0.0 } else { ray.geometry != NOTHING });
                }
            }
            met
        };
        self.packets.par_chunks(CHUNK).map(chunk).sum()
    }

    /// The same in packets.
    fn packets(&self, scene: &library::Scene, any: bool, coherent: bool) -> usize {
        let chunk = |packets: &[(Valid, RayHit16)]| {
            let mut met = 0;
            for (valid, rays) in packets {
                let mut rays = *rays;
                scene.trace_packet(valid, &mut rays, any, coherent);
                let hit = |lane: usize| if any { rays.far[lane] < 0.0 } else { rays.geometry[lane] != NOTHING };
                met += (0..LANES).filter(|&lane| valid.0[lane] != 0 && hit(lane)).count();
            }
            met
        };
        self.packets.par_chunks(CHUNK).map(chunk).sum()
    }
}

const WAYS: [&str; 5] = ["ours single", "Embree single", "ours packet", "Embree packet", "Embree packet, coherent"];

/// Rays a second by part and round, for each of [`WAYS`].
struct Comparison {
    rates: [Vec<f64>; 5],
    met: [usize; 5],
}

/// All ways in turn on each part, for so many rounds after one that does not count.
fn compare(accel: &Accel, theirs: &library::Scene, parts: &[Part], kind: Kind, rounds: usize) -> Comparison {
    let any = kind == Kind::Shadow;
    let mut found = Comparison { rates: [const { Vec::new() }; 5], met: [0; 5] };
    for round in 0..=rounds {
        for part in parts {
            for way in 0..WAYS.len() {
                let started = Instant::now();
                let met = match way {
                    0 => part.ours.trace(accel, kind, Query::Single),
                    1 => part.single(theirs, any),
                    2 => part.ours.trace(accel, kind, Query::Packet),
                    _ => part.packets(theirs, any, way == 4),
                };
                let taken = started.elapsed().as_secs_f64();
                if round == 0 {
                    found.met[way] += met;
                } else {
                    found.rates[way].push(part.ours.count as f64 / taken / 1e6);
                }
            }
        }
    }
    found
}

impl Comparison {
    fn print(&self, name: &str) {
        println!("{name}; hits {:?}", self.met);
        for (way, rates) in WAYS.iter().zip(&self.rates) {
            println!("    {way:24} {:7.2} Mrays/s", median(rates.clone()));
        }
        // Embree's faster way with packets is its own.
        let better = if median(self.rates[4].clone()) > median(self.rates[3].clone()) { 4 } else { 3 };
        for (what, ours, theirs) in [("single", 0, 1), ("packet", 2, better)] {
            let mut ratios: Vec<f64> = self.rates[ours].iter().zip(&self.rates[theirs]).map(|(a, b)| a / b).collect();
            ratios.sort_by(f64::total_cmp);
            let at = |q: f64| ratios[((ratios.len() - 1) as f64 * q) as usize];
            println!("    {what}: {:.3} x Embree (middle half {:.3} to {:.3})", at(0.5), at(0.25), at(0.75));
        }
    }
}

/// Of at least one number.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    0.5 * (values[(n - 1) / 2] + values[n / 2])
}
