//! Samplers against exact variances, nets, marginals and couplings.
//!
//! | what is certified | for | file |
//! |---|---|---|
//! | mean and mean square error of x, y, xy, step (diagonal, disk), E(L2*²) | every legal sampler, three decisions | [`variance`], exact values from [`laws`] |
//! | numbers in [0, 1) | every legal sampler, counts up to 2²⁴ | [`range`] |
//! | (0,m,2)-nets on integers and floats | every block of `ld` and `sobol`, whole Hammersley sets | [`nets`] |
//! | each index's own distribution over seeds | every legal sampler, every index, three decisions | [`marginals`] |
//! | scrambles bit for bit; variance ratios within 5 % | `owen`, `xor`, `shift`, `digits` | [`scrambles`], [`equivalence`] |
//! | products across decisions | every preset, all pairs of coordinates | [`coupling`] |
//! | slopes of RMSE in n | six samplers, five integrands | [`slopes`] |
//!
//! Each statistical check keeps the false-alarm rate that its [`Context`](super::Context) gives it, divided among its tests by Šidák; each file
//! says what it would catch.

pub mod coupling;
pub mod equivalence;
pub mod laws;
pub mod marginals;
pub mod nets;
pub mod range;
pub mod reading;
pub mod scrambles;
pub mod slopes;
pub mod variance;

use super::Check;

/// Name of this group.
const GROUP: &str = "samplers";

/// The checks of this group.
pub fn checks() -> Vec<Check> {
    [
        variance::checks(),
        range::checks(),
        nets::checks(),
        marginals::checks(),
        scrambles::checks(),
        coupling::checks(),
        slopes::checks(),
    ]
    .concat()
}
