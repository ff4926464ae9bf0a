//! The light transport loop: camera ray, surface, light, shadow ray.
//!
//! L_o = k_a · V · L_i · (ω_i·n) and L_i = k_e · A · (−ω_i·n_l) / r², no 1/π: the sheet's equations and nothing more.

mod direct;
mod tiles;

pub use direct::{Contribution, light_contribution};
pub use tiles::{NonFinite, Rendered, render, render_observed, render_sample};

/// Raised whenever the bits of an image may change.
pub const ALGORITHM: u32 = 1;
