//! Samples a second, and the error that they leave.

use std::rc::Rc;

use super::lab::{Lab, SIZE};
use super::scenes::Landscape;
use super::timing::{Case, Part, Repeat, seconds};
use crate::error::{Error, Result};
use crate::film::Image;
use crate::render::render;
use crate::sampling::{PointSource, Preset, Sampler, SamplerSpec};
use crate::scene::compile::Scene;

const SAMPLERS: [&str; 3] = ["uniform", "stratified", "sobol"];
const CORNELL_SIZE: (u32, u32) = (512, 512);

pub fn cases(lab: &Rc<Lab>) -> Vec<Case> {
    let mut cases = Vec::new();
    for sampler in SAMPLERS {
        let shared = Rc::clone(lab);
        cases.push(case(Landscape::MEDIUM.name, sampler, 4, move || {
            let mut previous = None;
            let repeat: RenderOnce =
                Box::new(move |spp, seed| once(&shared.landscape(0).borrow(), sampler, spp, seed, &mut previous));
            Ok(repeat)
        }));
    }
    for sampler in SAMPLERS {
        let lab = Rc::clone(lab);
        cases.push(case("cornell", sampler, 16, move || {
            let scene = lab.cornell(CORNELL_SIZE)?;
            let mut previous = None;
            let repeat: RenderOnce = Box::new(move |spp, seed| once(&scene, sampler, spp, seed, &mut previous));
            Ok(repeat)
        }));
    }
    cases
}

/// Samples a pixel and seed → samples a second and error.
type RenderOnce = Box<dyn FnMut(u32, u64) -> Result<Vec<f64>>>;

fn case(scene: &str, sampler: &str, spp: u32, prepare: impl FnOnce() -> Result<RenderOnce> + 'static) -> Case {
    let (w, h) = if scene == "cornell" { CORNELL_SIZE } else { SIZE };
    let prepare = move || {
        let mut render_once = prepare()?;
        let mut seed = 0;
        let repeat: Repeat = Box::new(move || {
            seed += 1;
            render_once(spp, seed)
        });
        Ok(repeat)
    };
    Case {
        name: format!("render/{scene}-{w}x{h}/{sampler}-{spp}spp"),
        parts: vec![
            Part { suffix: String::new(), unit: "Msamples/s" },
            Part { suffix: "/rmse".to_owned(), unit: "radiance" },
        ],
        sizes: None,
        most: super::timing::MOST,
        prepare: Box::new(prepare),
    }
}

/// Renders once, and compares with the image of the seed before.
fn once(scene: &Scene, sampler: &str, spp: u32, seed: u64, previous: &mut Option<Image>) -> Result<Vec<f64>> {
    let spec = SamplerSpec::parse(sampler, Preset::Best)?;
    let sampler = Sampler::new(spec, &scene.layout, spp, seed)?;
    let mut rendered = None;
    let taken = seconds(|| rendered = Some(render(scene, &sampler)));
    let image = rendered.expect("rendered above").map_err(|bad| Error::incomplete("bench", bad))?.image;
    let samples = image.pixels.len() as f64 * f64::from(sampler.samples());
    let error = previous.as_ref().map_or(f64::NAN, |other| rmse_of_pair(&image, other));
    *previous = Some(image);
    Ok(vec![samples / taken / 1e6, error])
}

/// Root mean square error of one image, over pixels and channels, from two independent ones: √(mean (a − b)² / 2), since the
/// variance of a difference is the sum of the variances, and an unbiased image has no other error. No reference is needed.
pub fn rmse_of_pair(a: &Image, b: &Image) -> f64 {
    let squares =
        a.pixels.iter().zip(&b.pixels).flat_map(|(a, b)| (0..3).map(|c| (f64::from(a[c]) - f64::from(b[c])).powi(2)));
    (squares.sum::<f64>() / (3 * a.pixels.len()) as f64 / 2.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values ±1, of which independent images share half.
    #[test]
    fn the_error_of_a_pair_is_that_of_one_image() {
        let image = |signs: [f32; 4]| Image { width: 4, height: 1, pixels: signs.map(|s| [s; 3]).into() };
        assert_eq!(rmse_of_pair(&image([1.0, -1.0, 1.0, -1.0]), &image([1.0, 1.0, -1.0, -1.0])), 1.0);
        assert_eq!(rmse_of_pair(&image([1.0; 4]), &image([1.0; 4])), 0.0);
    }
}
