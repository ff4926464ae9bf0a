//! The light transport loop: camera ray, surface, light, shadow ray.
//!
//! L_o = k_a · V · L_i · (ω_i·n) and L_i = k_e · A · (−ω_i·n_l) / r², no 1/π: the sheet's equations and nothing more.

mod direct;
mod lanes;
mod numbers;
mod progressive;
mod tiles;

pub use direct::light_contribution;
pub use numbers::draw_numbers;
pub use progressive::{Growing, Pass};
pub use tiles::{NonFinite, Rendered, render, render_observed, render_sample, render_while};

use crate::accel;

/// Raised whenever this loop, or the camera, lights and textures that it reads, may change the bits of an image.
const OWN_ALGORITHM: u32 = 1;

/// Changes whenever the bits of an image may: the loop's own number and that of [`accel`]. Both only rise, so the sum changes
/// whenever one does.
pub const ALGORITHM: u32 = OWN_ALGORITHM + accel::ALGORITHM - 1;
