//! Sample points: sets, orders, randomisations, and who reads which numbers.
//!
//! A number is R_key(P(π(i), D)): point set P, index order π, dimensions D of the decision, randomisation R under a key.

pub mod divisor;
mod domain;
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
