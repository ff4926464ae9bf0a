//! Sample points: sets, orders, randomisations, and who reads which numbers.
//!
//! A number is R_key(P(π(i), D)): point set P, index order π, dimensions D of the decision, randomisation R under a key.

pub mod divisor;
mod domain;
pub mod halton;
pub mod hash;
mod layout;
pub mod radical;
mod sampler;
mod set;
pub mod sobol;
mod spec;
pub mod strata;
pub mod warp;

pub use domain::{Domain, LAYOUT_DIMENSIONS, domain_table};
pub use layout::{Claim, Decision, Dim1, Dim2, SampleLayout};
pub use sampler::{ALGORITHM, PixelKey, PointSource, Sampler, point_set};
pub use set::SamplerSet;
pub use spec::{MAX_SAMPLES, Order, Points, Preset, Random, SamplerSpec, Scope, every_legal_spec};

/// What `f` makes of each element. A loop, as `array::map` is a function of its own that the kernels of wide vectors would call.
#[inline(always)]
fn each<T: Copy, U: Copy + Default, const N: usize>(from: &[T; N], f: impl Fn(T) -> U) -> [U; N] {
    let mut to = [U::default(); N];
    for (to, from) in to.iter_mut().zip(from) {
        *to = f(*from);
    }
    to
}

/// `first` and the indices after it, where `first` may lie less than N below 0 (modulo 2³²): 0 in place of what is below it.
#[inline(always)]
fn row<const N: usize>(first: u32) -> [u32; N] {
    let mut row = [0; N];
    for (lane, index) in (0..).zip(&mut row) {
        *index = (first.wrapping_add(lane) as i32).max(0) as u32;
    }
    row
}

/// Lanes in a row.
const ROW: usize = 16;

/// Masks that begin in a lane: no bits, then all bits. To be read from a table, as choices that depend on a lane's number
/// become branches or a patchwork of small vectors.
static STEP: [u32; 2 * ROW] = {
    let mut step = [0; 2 * ROW];
    let mut i = ROW;
    while i < step.len() {
        step[i] = u32::MAX;
        i += 1;
    }
    step
};

/// All bits from lane `first` ≤ [`ROW`] on, none before it.
#[inline(always)]
fn mask_from(first: usize) -> &'static [u32; ROW] {
    STEP[ROW - first..][..ROW].try_into().expect("a row")
}
