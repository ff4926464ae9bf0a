//! Seconds of what is done once: building trees, reading files, measuring point sets.

use std::rc::Rc;

use super::lab::Lab;
use super::scenes::Landscape;
use super::timing::{Case, Part, Repeat, seconds};
use crate::accel::Accel;
use crate::error::{Error, Result};
use crate::sampling::{Preset, SamplerSpec, point_set};
use crate::scene::geometry::triangles;
use crate::scene::load::{OpenOptions, open};
use crate::stats::discrepancy::{L2Kind, Points, l2_squared, min_toroidal_distance, star_2d, t_value};

pub fn build_cases(lab: &Rc<Lab>) -> Vec<Case> {
    let case = |(which, landscape): (usize, Landscape)| {
        let lab = Rc::clone(lab);
        Case::one(format!("build/{}", landscape.name), "s", move || {
            let scene = lab.landscape(which).borrow();
            let (corners, reach) = (triangles(&scene.mesh), scene.reach());
            let once: Box<dyn FnMut() -> f64> = Box::new(move || seconds(|| Accel::new(&corners, reach)));
            Ok(once)
        })
    };
    Landscape::ALL.into_iter().enumerate().map(case).collect()
}

/// The scene file with all that it refers to, beside tobj's own time for the same OBJ, in turn.
pub fn load_cases(lab: &Rc<Lab>) -> Vec<Case> {
    let lab = Rc::clone(lab);
    let prepare = move || {
        let paths = Landscape::MEDIUM.write(lab.folder()?)?;
        let repeat: Repeat = Box::new(move || {
            let _folder_stays = &lab;
            let mut ours = None;
            let own = seconds(|| ours = Some(open(&paths[0], &OpenOptions::default())));
            ours.expect("opened above")?;
            let mut theirs = None;
            let tobj = seconds(|| theirs = Some(read_with_tobj(&paths[1])));
            theirs.expect("read above")?;
            Ok(vec![own, tobj, own / tobj])
        });
        Ok(repeat)
    };
    let part = |(suffix, unit): (&str, &'static str)| Part { suffix: suffix.to_owned(), unit };
    vec![Case {
        name: format!("load/{}", Landscape::MEDIUM.name),
        parts: [("", "s"), ("/tobj", "s"), ("/times-tobj", "1")].map(part).into(),
        sizes: None,
        most: super::timing::MOST,
        prepare: Box::new(prepare),
    }]
}

fn read_with_tobj(path: &std::path::Path) -> Result<usize> {
    let options = tobj::LoadOptions { single_index: true, ..tobj::LoadOptions::default() };
    let (models, _) = tobj::load_obj(path, &options).map_err(|e| Error::input(path.display(), e))?;
    Ok(models.len())
}

/// A metric by name, and the n at which it is measured.
type Metric = (&'static str, fn(&Points) -> f64, &'static [u32]);

const METRICS: [Metric; 6] = [
    ("star-2d", |p| star_2d(p).value, &[4096, 65_536]),
    ("l2-star", |p| l2_squared(p, L2Kind::Star).unwrap_or(f64::NAN), &[16_384]),
    ("l2-centred", |p| l2_squared(p, L2Kind::Centred).unwrap_or(f64::NAN), &[16_384]),
    ("l2-wrap-around", |p| l2_squared(p, L2Kind::WrapAround).unwrap_or(f64::NAN), &[16_384]),
    ("t-value", |p| t_value(p).map_or(f64::NAN, f64::from), &[16_384]),
    ("min-distance", |p| min_toroidal_distance(p).unwrap_or(f64::NAN), &[16_384]),
];

/// The first `n` of Owen-scrambled Sobol' points.
pub fn points(n: u32) -> Result<Points> {
    let spec = SamplerSpec::parse("sobol", Preset::Best)?;
    Points::new_2d(&point_set(spec, n, 1)?).map_err(|e| Error::input("bench", format!("{e:?}")))
}

pub fn metric_cases(_: &Rc<Lab>) -> Vec<Case> {
    let case = |name: &str, n: u32, metric: fn(&Points) -> f64| {
        Case::one(format!("metric/{name}/{n}"), "s", move || {
            let points = points(n)?;
            let once: Box<dyn FnMut() -> f64> = Box::new(move || seconds(|| metric(&points)));
            Ok(once)
        })
    };
    METRICS.iter().flat_map(|(name, metric, ns)| ns.iter().map(move |&n| case(name, n, *metric))).collect()
}
