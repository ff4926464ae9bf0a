//! Radiance along one camera ray: the sheet's equations (1) and (2), and nothing else.

use glam::{Vec2, Vec3};

use crate::accel::Ray;
use crate::mutants::{Mutant, planted};
use crate::scene::config::Estimator;
use crate::scene::geometry::SurfacePoint;
use crate::scene::light::{Light, LightSet, pick_light};

/// What a sample adds if nothing stands between surface and light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contribution {
    /// k_a · L_i · (ω_i·n), divided by the light's probability where the estimator is unbiased.
    pub radiance: Vec3,
    /// From the surface to the light's point, at t = 1; a hit at 0 < t < 1 takes the contribution away.
    pub shadow_ray: Ray,
}

/// L_i = k_e · A · (−ω_i·n_l) / r², weighted by the surface's cosine: the light's share of eq. (1) but for albedo and visibility.
///
/// Area sampling with `pdf_area` = 1/A. `None` where the point is not in front of the light or the light not in front of the
/// surface. Lengths enter as ratios only, so the value does not change with the scene's scale.
#[inline]
pub fn light_contribution(light: &Light, u: Vec2, from: &SurfacePoint) -> Option<(Vec3, Ray)> {
    let to = light.point(u);
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
    if !(cos_surface > 0.0 && cos_light > 0.0) {
        return None;
    }
    let weight = match () {
        () if planted(Mutant::CosineSquared) => cos_surface * cos_surface * cos_light * (light.area / r / r),
        () if planted(Mutant::LightCosineForgotten) => cos_surface * (light.area / r / r),
        () if planted(Mutant::DistanceNotSquared) => cos_surface * cos_light * (light.area / r),
        () => cos_surface * cos_light * (light.area / r / r),
    };
    Some((light.emission * weight, Ray { origin, direction: way }))
}

/// Chooses a light and a point on it, by `pick` and `point` in [0, 1).
#[inline]
pub(super) fn direct_light(
    lights: &LightSet,
    estimator: Estimator,
    pick: f32,
    point: Vec2,
    from: &SurfacePoint,
    albedo: Vec3,
) -> Option<Contribution> {
    let (light, probability) = match lights {
        LightSet::Dark => return None,
        LightSet::One { light, .. } => (light, 1.0),
        LightSet::Many { lights, pmf, cumulative, .. } => {
            let index = pick_light(cumulative, pick);
            match estimator {
                Estimator::Unbiased if planted(Mutant::ProbabilityMissing) => (&lights[index], 1.0),
                Estimator::Unbiased => (&lights[index], pmf[index]),
                // The sheet's shortcut: as if the light had been certain. Offered to show its error.
                Estimator::Sheet => (&lights[index], 1.0),
            }
        }
    };
    let (received, shadow_ray) = light_contribution(light, point, from)?;
    Some(Contribution { radiance: albedo * received / probability, shadow_ray })
}
