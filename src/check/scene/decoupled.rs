//! A sampler with one decision taken out of step.

use crate::sampling::hash::{derive, permute};
use crate::sampling::{Decision, Dim1, Dim2, PixelKey, PointSource, Sampler};

/// Reads `inner` for all decisions but one, whose numbers come from `other` (the same sampler under another seed), in an
/// order drawn for each pixel. The sets stay what they are; only who meets whom changes.
pub struct Decoupled {
    /// The sampler as it is.
    pub inner: Sampler,
    /// The same under another seed.
    pub other: Sampler,
    /// The decision that reads `other`.
    pub apart: Decision,
    /// Key of the orders.
    pub key: u64,
}

impl Decoupled {
    fn place(&self, pixel: PixelKey, index: u32) -> u32 {
        permute(index, self.inner.samples(), derive(self.key, &[pixel.word()]))
    }
}

impl PointSource for Decoupled {
    fn samples(&self) -> u32 {
        self.inner.samples()
    }

    fn fill_1d(&self, pixel: PixelKey, first: u32, dim: &Dim1, out: &mut [f32]) {
        if dim.decision() != self.apart {
            return self.inner.fill_1d(pixel, first, dim, out);
        }
        for (index, out) in (first..).zip(out) {
            *out = self.other.get_1d(pixel, self.place(pixel, index), dim);
        }
    }

    fn fill_2d(&self, pixel: PixelKey, first: u32, dim: &Dim2, x: &mut [f32], y: &mut [f32]) {
        if dim.decision() != self.apart {
            return self.inner.fill_2d(pixel, first, dim, x, y);
        }
        for (index, (x, y)) in (first..).zip(x.iter_mut().zip(y)) {
            [*x, *y] = self.other.get_2d(pixel, self.place(pixel, index), dim);
        }
    }
}
