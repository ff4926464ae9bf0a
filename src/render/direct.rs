//! Light that reaches a surface directly: the sheet's equations (1) and (2), and nothing else.

use glam::{Vec2, Vec3};

use crate::accel::Ray;
use crate::mutants::{Mutant, planted};
use crate::scene::config::Estimator;
use crate::scene::geometry::SurfacePoint;
use crate::scene::light::{Light, LightPoint, LightSet, pick_light};

/// What a point of a light sends to a surface if nothing stands between them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Arrival {
    /// Whether surface and light are in front of each other. Where they are not, the rest means nothing.
    pub lit: bool,
    /// A · (ω_i·n) · (−ω_i·n_l) / r²: times emission and albedo it is the light's share of eq. (1). Area sampling with
    /// `pdf_area` = 1/A.
    pub weight: f32,
    /// From the surface to the light's point, at t = 1; a hit at 0 < t < 1 takes the contribution away.
    pub shadow_ray: Ray,
}

/// Works out an [`Arrival`], without branches, so that a loop over lanes becomes vector instructions.
///
/// Lengths enter as ratios only, so the weight does not change with the scene's scale.
#[inline(always)]
pub(super) fn arrival(to: &LightPoint, area: f32, from: &SurfacePoint) -> Arrival {
    let geometric_side =
        if (to.position - from.position).dot(from.face_normal) < 0.0 { -from.offset } else { from.offset };
    let origin = from.position + from.face_normal * geometric_side;
    let way = to.position - origin;
    let r = way.length();
    let omega = way / r;
    let (mut cos_surface, mut cos_light) = (omega.dot(from.normal), -omega.dot(to.normal));
    if planted(Mutant::LitFromBehind) {
        cos_surface = cos_surface.abs();
    }
    if planted(Mutant::LightFromBehind) {
        cos_light = cos_light.abs();
    }
    let weight = match () {
        () if planted(Mutant::CosineSquared) => cos_surface * cos_surface * cos_light * (area / r / r),
        () if planted(Mutant::LightCosineForgotten) => cos_surface * (area / r / r),
        () if planted(Mutant::DistanceNotSquared) => cos_surface * cos_light * (area / r),
        () => cos_surface * cos_light * (area / r / r),
    };
    // Written so that what is no number is not lit.
    Arrival { lit: (cos_surface > 0.0) & (cos_light > 0.0), weight, shadow_ray: Ray { origin, direction: way } }
}

/// L_i = k_e · A · (−ω_i·n_l) / r², weighted by the surface's cosine: the light's share of eq. (1) but for albedo and
/// visibility, and the ray that decides the latter (see [`Ray`]: a hit at 0 < t < 1 takes the contribution away).
///
/// Area sampling with `pdf_area` = 1/A. `None` where the point is not in front of the light or the light not in front of the
/// surface.
#[inline]
pub fn light_contribution(light: &Light, u: Vec2, from: &SurfacePoint) -> Option<(Vec3, Ray)> {
    let arrival = arrival(&light.point(u), light.area, from);
    arrival.lit.then(|| (light.emission * arrival.weight, arrival.shadow_ray))
}

/// The light that `pick` in [0, 1) chooses, and what its contribution is divided by.
#[inline(always)]
pub(super) fn choose(lights: &LightSet, estimator: Estimator, pick: f32) -> Option<(&Light, f32)> {
    match lights {
        LightSet::Dark => None,
        LightSet::One { light, .. } => Some((light, 1.0)),
        LightSet::Many { lights, pmf, cumulative, .. } => {
            let index = pick_light(cumulative, pick);
            let probability = match estimator {
                Estimator::Unbiased if planted(Mutant::ProbabilityMissing) => 1.0,
                Estimator::Unbiased => pmf[index],
                // The sheet's shortcut: as if the light had been certain. Offered to show its error.
                Estimator::Sheet => 1.0,
            };
            Some((&lights[index], probability))
        }
    }
}
