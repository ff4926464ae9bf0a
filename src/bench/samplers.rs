//! Nanoseconds that a sample's numbers take.

use std::hint::black_box;
use std::rc::Rc;

use super::lab::Lab;
use super::timing::{Case, seconds};
use crate::accel::{Kernel, LANES, Wide};
use crate::sampling::{
    Decision, Dim1, Dim2, PixelKey, PointSource, Points, Preset, SampleLayout, Sampler, SamplerSpec,
};

/// Samples a pixel: the count that assignment 4's largest images have.
const SPP: u32 = 1024;
/// Pixels of a repeat.
const PIXELS: u32 = 64;

pub fn cases(_: &Rc<Lab>) -> Vec<Case> {
    let mut cases = Vec::new();
    for &points in Points::ALL.iter().filter(|p| **p != Points::Center) {
        for (preset, word) in [(Preset::Sheet, "sheet"), (Preset::Best, "best"), (Preset::Plain, "plain")] {
            let Some(spec) = preset.of(points) else { continue };
            for two in [false, true] {
                for (kind, kernel) in kinds() {
                    let dimensions = if two { 2 } else { 1 };
                    let name = format!("sampler/{dimensions}d/{}:{word}/{kind}", points.word());
                    cases.push(Case::one(name, "ns", move || Ok(repeat(spec, two, kernel))));
                }
            }
        }
    }
    cases
}

/// Spans as the renderer reads them, for each kernel that this processor runs; single look-ups, as nobody should.
fn kinds() -> Vec<(String, Option<Kernel>)> {
    let spans = Kernel::available().into_iter().map(|kernel| (format!("span-{kernel}"), Some(kernel)));
    spans.chain([("single".to_owned(), None)]).collect()
}

struct Subject {
    sampler: Sampler,
    one: Dim1,
    two: Dim2,
}

fn repeat(spec: SamplerSpec, two: bool, kernel: Option<Kernel>) -> Box<dyn FnMut() -> f64> {
    let mut layout = SampleLayout::default();
    layout.claim_2d(Decision::Pixel);
    let one = layout.claim_1d(Decision::LightPick);
    // The second pair of a joint set, so that Halton's bases and Sobol' dimensions are not the easiest.
    let two_d = layout.claim_2d(Decision::LightPoint);
    let sampler = Sampler::new(spec, &layout, SPP, 1).expect("a count and decisions that every sampler takes");
    let subject = Subject { sampler, one, two: two_d };
    let mut pixel = 0;
    Box::new(move || {
        pixel += PIXELS;
        let samples = f64::from(PIXELS) * f64::from(subject.sampler.samples());
        let taken = match kernel {
            Some(kernel) => seconds(|| kernel.run(Spans { subject: &subject, two, pixel })),
            None => seconds(|| singles(&subject, two, pixel)),
        };
        1e9 * taken / samples
    })
}

/// All samples of some pixels in spans of 16.
struct Spans<'a> {
    subject: &'a Subject,
    two: bool,
    pixel: u32,
}

impl Wide for Spans<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Subject { sampler, one, two } = self.subject;
        let (mut x, mut y) = ([0.0; LANES], [0.0; LANES]);
        for pixel in 0..PIXELS {
            let key = PixelKey::new(pixel, self.pixel);
            let mut first = 0;
            while first < sampler.samples() {
                let count = LANES.min((sampler.samples() - first) as usize);
                if self.two {
                    sampler.fill_2d(key, first, two, &mut x[..count], &mut y[..count]);
                } else {
                    sampler.fill_1d(key, first, one, &mut x[..count]);
                }
                black_box((&mut x, &mut y));
                first += count as u32;
            }
        }
    }
}

/// The same samples one by one.
fn singles(subject: &Subject, two: bool, row: u32) {
    for pixel in 0..PIXELS {
        let key = PixelKey::new(pixel, row);
        for index in 0..subject.sampler.samples() {
            if two {
                black_box(subject.sampler.get_2d(key, index, &subject.two));
            } else {
                black_box(subject.sampler.get_1d(key, index, &subject.one));
            }
        }
    }
}
