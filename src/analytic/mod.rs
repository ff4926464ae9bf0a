//! Closed forms: what a pixel or a point must see, without sampling.
//!
//! | module | truth |
//! |---|---|
//! | [`quadrature`] | adaptive integrals with an error estimate, for what follows from a closed form by integration |
//! | [`polygon`] | irradiance from a polygon light, whole or behind a convex blocker |
//! | [`disk`] | irradiance from a disk light that faces the receiver, and the variance of one sample of it |
//! | [`variance`] | variance of one uniform-area sample of a polygon light |
//! | [`penumbra`] | the image of a soft shadow, pixel by pixel |
//! | [`horizon`] | the image of a checkered plane that runs to the horizon, pixel by pixel |
//! | [`camera`] | a pixel's coverage by an edge, the blur of a thin lens |
pub mod camera;
pub mod disk;
pub mod horizon;
pub mod penumbra;
pub mod polygon;
pub mod quadrature;
pub mod variance;

#[cfg(test)]
mod reference_tests;

pub use camera::{ThinLens, disc_share, pixel_coverage};
pub use disk::DiskLight;
pub use horizon::{CheckeredPlane, Horizon};
pub use penumbra::{DiffusePlane, Penumbra, Pinhole};
pub use polygon::{PolygonLight, Receiver};
pub use variance::variance_of_one_area_sample;
