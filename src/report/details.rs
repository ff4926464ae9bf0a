//! Windows of a picture worth a closer look, found by score, and the error inside each.

use crate::experiment::results::Stage;
use crate::film::Image;

use super::figure::Colour;
use super::pictures::Crop;

/// Edge of a window, in pixels of the image, where the image is large enough.
const EDGE: u32 = 28;
/// Pixels of a strip for one of the image.
const ZOOM: u32 = 4;
/// Outlines: of edges, of defocus, of shadow.
const COLOURS: [Colour; 3] = [[230, 159, 0], [86, 180, 233], [0, 158, 115]];

/// A part of the picture worth a closer look, and why.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Detail {
    /// What is to be seen there, and how it was found.
    pub name: &'static str,
    /// Where.
    pub crop: Crop,
}

/// The two images that a picture is compared with: independent halves, or a closed form twice.
pub(super) struct Truth {
    /// Their mean, as shown.
    pub mean: Image,
    /// Both.
    pub halves: [Image; 2],
}

impl Truth {
    /// RMSE of `image` in the window, freed of the reference's noise: √mean((T − R₁)(T − R₂)) over its pixels and channels; `None`
    /// where that mean is not above 0.
    pub fn rmse_in(&self, image: &Image, crop: &Crop) -> Option<f64> {
        let [a, b] = &self.halves;
        let mut sum = 0.0;
        for y in crop.y..crop.y + crop.height {
            for x in crop.x..crop.x + crop.width {
                let i = (y * image.width + x) as usize;
                for c in 0..3 {
                    let [t, a, b] = [image, a, b].map(|image| f64::from(image.pixels[i][c]));
                    sum += (t - a) * (t - b);
                }
            }
        }
        let mean = sum / (3.0 * f64::from(crop.width) * f64::from(crop.height));
        (mean > 0.0).then(|| mean.sqrt())
    }
}

/// The stages of the sheet's Figure 1 that a scene has.
pub(super) struct Stages {
    /// Pixel centres, and the sampled pixel.
    pub start: Image,
    /// The sampled pixel.
    pub aa: Image,
    /// The sampled lens, where there is one.
    pub dof: Option<Image>,
    /// The whole picture, where there are lights.
    pub lit: Option<Image>,
}

impl Stages {
    /// Sorts images by their stage; `None` where one that every scene has is missing.
    pub fn new(images: Vec<(Stage, Image)>) -> Option<Self> {
        let [mut start, mut aa, mut dof, mut lit] = [const { None }; 4];
        for (stage, image) in images {
            match stage {
                Stage::Start => start = Some(image),
                Stage::Aa => aa = Some(image),
                Stage::Dof => dof = Some(image),
                Stage::Final => lit = Some(image),
            }
        }
        Some(Self { start: start?, aa: aa?, dof, lit })
    }

    fn all(&self) -> impl Iterator<Item = &Image> {
        [&self.start, &self.aa].into_iter().chain(&self.dof).chain(&self.lit)
    }
}

/// The windows to enlarge, one for each decision that the scene has, each scored where light falls: where sampling the pixel
/// changes most and the lens does not, where the lens does, and where the relative errors of all pictures are largest though neither
/// does. None where windows do not fit.
pub(super) fn details(stages: &Stages, reference: &Image, pictures: &[&Image]) -> Vec<Detail> {
    let (width, height) = (reference.width, reference.height);
    let fits = |i: &Image| (i.width, i.height) == (width, height);
    if width < 3 * EDGE || height < EDGE || !stages.all().chain(pictures.iter().copied()).all(fits) {
        return Vec::new();
    }
    let grey = |image: &Image, i: usize| image.pixels[i].iter().map(|&c| f64::from(c)).sum::<f64>() / 3.0;
    let square = |a: &Image, b: &Image, i: usize| (grey(a, i) - grey(b, i)) * (grey(a, i) - grey(b, i));
    let edge = |i: usize| square(&stages.start, &stages.aa, i);
    let blur = |i: usize| stages.dof.as_ref().map_or(0.0, |dof| square(&stages.aa, dof, i));
    // A change of albedo below 0.02 is none.
    let even = |change: f64| 1.0 / (1.0 + change / 4e-4);
    let unlit = stages.dof.as_ref().unwrap_or(&stages.aa);
    let light = |i: usize| stages.lit.as_ref().map_or(1.0, |lit| (grey(lit, i) / grey(unlit, i).max(0.02)).min(1.0));
    let bright = |i: usize| grey(reference, i) * grey(reference, i) + 0.01;
    let error = |i: usize| pictures.iter().map(|p| square(p, reference, i)).sum::<f64>() / bright(i);
    let score = |f: &dyn Fn(usize) -> f64| (0..reference.pixels.len()).map(f).collect::<Vec<f64>>();
    let edges = match stages.dof {
        Some(_) => "edges (the pixel matters most, the lens does not)",
        None => "edges (the pixel matters most)",
    };
    let wanted = [
        (true, edges, score(&|i| edge(i) * light(i) * even(blur(i)))),
        (stages.dof.is_some(), "defocus (the lens matters most)", score(&|i| blur(i) * light(i))),
        (stages.lit.is_some(), "shadow (the light matters most)", score(&|i| error(i) * even(edge(i)) * even(blur(i)))),
    ];
    let mut found: Vec<Detail> = Vec::new();
    for ((_, name, score), colour) in wanted.into_iter().zip(COLOURS).filter(|((is_there, ..), _)| *is_there) {
        if let Some((x, y)) = best_window(&score, (width, height), &found) {
            found.push(Detail { name, crop: Crop { x, y, width: EDGE, height: EDGE, zoom: ZOOM, colour } });
        }
    }
    found
}

/// The corner of the window of the largest sum that does not touch those found before; none where nothing is to be seen.
fn best_window(score: &[f64], (width, height): (u32, u32), taken: &[Detail]) -> Option<(u32, u32)> {
    let free = |x: u32, y: u32| taken.iter().all(|d| x.abs_diff(d.crop.x) >= EDGE || y.abs_diff(d.crop.y) >= EDGE);
    let sum = |x: u32, y: u32| -> f64 {
        (y..y + EDGE)
            .flat_map(|row| (x..x + EDGE).map(move |column| (row * width + column) as usize))
            .map(|i| score[i])
            .sum()
    };
    let corners = (0..=height - EDGE).step_by(4).flat_map(|y| (0..=width - EDGE).step_by(4).map(move |x| (x, y)));
    corners
        .filter(|&(x, y)| free(x, y))
        .map(|at| (sum(at.0, at.1), at))
        .filter(|(sum, _)| *sum > 0.0)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, at)| at)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An image of 128 × 48 pixels, 0.5 but where `at` says otherwise.
    fn image(at: impl Fn(u32, u32) -> f32) -> Image {
        let pixels = (0..48).flat_map(|y| (0..128).map(move |x| (x, y))).map(|(x, y)| [at(x, y); 3]).collect();
        Image { width: 128, height: 48, pixels }
    }

    fn inside(crop: &Crop, (x, y): (u32, u32)) -> bool {
        (crop.x..crop.x + crop.width).contains(&x) && (crop.y..crop.y + crop.height).contains(&y)
    }

    #[test]
    fn each_window_is_found_where_its_decision_changes_the_picture() {
        let spot = |cx: u32, value: f32| move |x: u32, _: u32| if x.abs_diff(cx) < 3 { value } else { 0.5 };
        let stages = Stages {
            start: image(|_, _| 0.5),
            aa: image(spot(10, 0.9)),
            dof: Some(image(|x, y| if x < 48 { spot(10, 0.9)(x, y) } else { spot(50, 0.8)(x, y) })),
            lit: Some(image(|_, _| 0.5)),
        };
        let truth = image(|_, _| 0.5);
        let noisy = image(spot(110, 0.7));
        let found = details(&stages, &truth, &[&noisy]);
        let words: Vec<&str> = found.iter().map(|d| d.name.split(' ').next().unwrap()).collect();
        assert_eq!(words, ["edges", "defocus", "shadow"]);
        for (detail, at) in found.iter().zip([10, 50, 110]) {
            assert!(inside(&detail.crop, (at, detail.crop.y)), "{detail:?}");
        }
    }

    #[test]
    fn a_scene_without_lens_or_lights_has_no_window_for_them() {
        let edge = image(|x, _| if x > 40 { 0.9 } else { 0.5 });
        let pinhole = Stages { start: image(|_, _| 0.5), aa: edge.clone(), dof: None, lit: None };
        let found = details(&pinhole, &edge, &[&edge]);
        assert_eq!(found.iter().map(|d| d.name).collect::<Vec<_>>(), ["edges (the pixel matters most)"]);
        let nothing = Stages { start: edge.clone(), aa: edge.clone(), dof: None, lit: None };
        assert!(details(&nothing, &edge, &[&edge]).is_empty(), "nothing changes, so nothing is enlarged");
        let small = Image::black(8, 8);
        let tiny = Stages { start: small.clone(), aa: small.clone(), dof: None, lit: None };
        assert!(details(&tiny, &small, &[&small]).is_empty());
    }

    #[test]
    fn the_error_in_a_window_is_that_of_its_pixels_alone_and_free_of_the_halves_noise() {
        let test = image(|x, _| if x < 28 { 0.8 } else { 0.5 });
        let halves =
            [image(|x, _| if x % 2 == 0 { 0.6 } else { 0.4 }), image(|x, _| if (x / 2) % 2 == 0 { 0.6 } else { 0.4 })];
        let truth = Truth { mean: image(|_, _| 0.5), halves };
        let crop = |x| Crop { x, y: 0, width: 28, height: 28, zoom: 4, colour: [0; 3] };
        // Noise of the halves, ±0.1, is uncorrelated over four columns: (0.3 ∓ 0.1)(0.3 ∓ 0.1) averages to 0.09.
        assert!((truth.rmse_in(&test, &crop(0)).unwrap() - 0.3).abs() < 1e-7);
        assert!(truth.rmse_in(&test, &crop(28)).is_none_or(|rmse| rmse < 1e-3));
    }
}
