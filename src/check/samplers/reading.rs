//! The numbers of a sampler as the renderer gets them, set by set.

use std::f64::consts::FRAC_1_PI;

use crate::sampling::{
    Decision, Dim1, Dim2, PixelKey, PointSource, Points, Preset, SampleLayout, Sampler, SamplerSpec, every_legal_spec,
};

/// The pixel that checks read: none in particular, but not the first.
pub const PIXEL: PixelKey = PixelKey::new(3, 5);

/// Half of the renderer's last place, 2⁻²⁵: a delivered number is a fraction's top 24 bits, on average this much
/// below it.
pub const HALF_PLACE: f64 = 1.0 / 33_554_432.0;

/// The four decisions of a scene that needs them all, and their dimensions in a joint sequence: 0–1, 2–3, 4, 5–6.
pub struct Tickets {
    /// The layout that gave the tickets.
    pub layout: SampleLayout,
    /// The pixel's.
    pub pixel: Dim2,
    /// The lens's.
    pub lens: Dim2,
    /// The light pick's.
    pub pick: Dim1,
    /// The light point's.
    pub light: Dim2,
}

impl Tickets {
    /// One of each.
    pub fn new() -> Self {
        let mut layout = SampleLayout::default();
        let (pixel, lens) = (layout.claim_2d(Decision::Pixel), layout.claim_2d(Decision::Lens));
        let (pick, light) = (layout.claim_1d(Decision::LightPick), layout.claim_2d(Decision::LightPoint));
        Self { layout, pixel, lens, pick, light }
    }

    /// The ticket of a 2-D decision, and its first dimension.
    ///
    /// # Panics
    /// For the light pick, which is 1-D.
    pub fn two_d(&self, decision: Decision) -> &Dim2 {
        match decision {
            Decision::Pixel => &self.pixel,
            Decision::Lens => &self.lens,
            Decision::LightPoint => &self.light,
            Decision::LightPick => panic!("the light pick is a 1-D decision"),
        }
    }

    /// First dimension of a decision.
    pub fn first(&self, decision: Decision) -> u32 {
        self.layout.find(decision).expect("every decision is claimed").first
    }
}

impl Default for Tickets {
    fn default() -> Self {
        Self::new()
    }
}

/// A sampler with room for one set.
pub struct Reader {
    /// The sampler.
    pub sampler: Sampler,
    x: Vec<f32>,
    y: Vec<f32>,
}

impl Reader {
    /// Readies `spec` for `asked` points.
    ///
    /// # Panics
    /// Where the count is out of range or `center` meets a layout with lights: checks ask for neither.
    pub fn new(spec: SamplerSpec, tickets: &Tickets, asked: u32) -> Self {
        let sampler = Sampler::new(spec, &tickets.layout, asked, 0).expect("a legal sampler for a legal count");
        let n = sampler.samples() as usize;
        Self { sampler, x: vec![0.0; n], y: vec![0.0; n] }
    }

    /// The pairs of a 2-D decision under a seed, as f64, lifted by [`HALF_PLACE`].
    pub fn pairs(&mut self, seed: u64, dim: &Dim2) -> impl ExactSizeIterator<Item = [f64; 2]> + Clone + '_ {
        self.sampler.reseed(seed);
        self.sampler.fill_2d(PIXEL, 0, dim, &mut self.x, &mut self.y);
        self.x.iter().zip(&self.y).map(|(&x, &y)| [f64::from(x) + HALF_PLACE, f64::from(y) + HALF_PLACE])
    }

    /// The numbers of a 1-D decision under a seed, as f64, lifted by [`HALF_PLACE`].
    pub fn numbers(&mut self, seed: u64, dim: &Dim1) -> impl ExactSizeIterator<Item = f64> + Clone + '_ {
        self.sampler.reseed(seed);
        self.sampler.fill_1d(PIXEL, 0, dim, &mut self.x);
        self.x.iter().map(|&x| f64::from(x) + HALF_PLACE)
    }
}

/// An integrand on the square with a known integral.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Integrand {
    /// x.
    X,
    /// y.
    Y,
    /// xy.
    Product,
    /// 1(x < 1/π).
    Step,
    /// 1(y > x).
    Diagonal,
    /// 1[x² + y² < 2/π]: a quarter disk.
    Disk,
    /// exp(−x² − y²).
    Gaussian,
}

impl Integrand {
    /// f(x, y).
    #[inline(always)]
    pub fn at(self, [x, y]: [f64; 2]) -> f64 {
        match self {
            Self::X => x,
            Self::Y => y,
            Self::Product => x * y,
            Self::Step => f64::from(x < FRAC_1_PI),
            Self::Diagonal => f64::from(y > x),
            Self::Disk => f64::from(x * x + y * y < 2.0 * FRAC_1_PI),
            Self::Gaussian => libm::exp(-x * x - y * y),
        }
    }

    /// Its integral over the unit square (`integrands.json`).
    pub fn integral(self) -> f64 {
        match self {
            Self::X | Self::Y | Self::Diagonal | Self::Disk => 0.5,
            Self::Product => 0.25,
            Self::Step => FRAC_1_PI,
            Self::Gaussian => 0.557_746_285_351_033_6,
        }
    }

    /// Mean over points less the integral.
    pub fn error(self, points: impl ExactSizeIterator<Item = [f64; 2]>) -> f64 {
        let n = points.len() as f64;
        points.map(|p| self.at(p)).sum::<f64>() / n - self.integral()
    }
}

/// Every legal sampler that has numbers.
pub fn numbered_specs() -> Vec<SamplerSpec> {
    every_legal_spec().into_iter().filter(|s| s.points != Points::Center).collect()
}

/// The sampler of a name.
///
/// # Panics
/// Where there is none: a mistake of the check.
pub fn spec(text: &str) -> SamplerSpec {
    SamplerSpec::parse(text, Preset::Best).unwrap_or_else(|e| panic!("{e}"))
}
