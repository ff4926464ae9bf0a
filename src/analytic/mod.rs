//! Closed forms: what a pixel or a point must see, without sampling.
//!
//! | module | truth |
//! |---|---|
//! | [`quadrature`] | adaptive integrals with an error estimate, for what follows from a closed form by integration |
//! | [`camera`] | a pixel's coverage by an edge, the blur of a thin lens |
pub mod camera;
pub mod quadrature;
