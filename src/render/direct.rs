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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::geometry::offset_length;

    /// A unit square at height 1 that shines downwards, and the first corner of a surface that reaches as far as `largest`.
    fn light() -> Light {
        let corner = |x: f32, z: f32| Vec3::new(x, 1.0, z);
        let [a, b, c, d] = [corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)];
        let light = Light::new("square".to_owned(), Vec3::ONE, &[[a, b, c], [a, c, d]]).expect("an area");
        assert!(light.is_parallelogram() && light.point(Vec2::splat(0.5)).normal.y < -0.999);
        light
    }

    fn receiver(position: Vec3, normal: Vec3, largest: f32) -> SurfacePoint {
        let offset = offset_length(&[position, Vec3::splat(largest), Vec3::ZERO]);
        SurfacePoint { position, normal, face_normal: normal, uv: Vec2::ZERO, material: 0, offset }
    }

    /// Of 64 × 64 points of the light, how many light the receiver.
    fn seen(from: &SurfacePoint) -> usize {
        let light = light();
        let at = |i: u32| (Vec2::new((i % 64) as f32, (i / 64) as f32) + 0.5) / 64.0;
        (0..64 * 64).filter(|&i| light_contribution(&light, at(i), from).is_some()).count()
    }

    /// Unit vectors on a lattice of the sphere.
    fn directions() -> impl Iterator<Item = Vec3> {
        let steps = || (-4..=4_i8).map(f32::from);
        let all = steps().flat_map(move |x| steps().flat_map(move |y| steps().map(move |z| Vec3::new(x, y, z))));
        all.filter(|v| *v != Vec3::ZERO).map(Vec3::normalize)
    }

    #[test]
    fn behind_a_light_is_dark_from_the_offset_of_the_receiver_on() {
        for (largest, behind) in [(1.0, 1.0_f32), (1.0, 1e-2), (1.0, 5e-6), (64.0, 3e-4), (1000.0, 5e-3)] {
            for normal in directions() {
                let from = receiver(Vec3::new(0.4, 1.0 + behind, 0.6), normal, largest);
                assert!(behind > from.offset, "further than its offset {}", from.offset);
                assert_eq!(seen(&from), 0, "{behind} behind, normal {normal}");
            }
        }
    }

    #[test]
    fn nearer_than_that_a_tilted_receiver_with_the_larger_offset_may_see_through() {
        // Rays start an offset off the receiver and end an offset before the light: 64/2^18 and 1/2^18 here. A steep receiver that lies
        // behind by less than the difference starts in front. A seam of relative width 2^-18, known and bounded by the test above.
        let steep = Vec3::new(0.8, -0.6, 0.0);
        assert!(seen(&receiver(Vec3::new(0.4, 1.0 + 1e-4, 0.6), steep, 64.0)) > 0);
        // With offsets alike it does not, and one that faces the light squarely never does.
        assert_eq!(seen(&receiver(Vec3::new(0.4, 1.0 + 1e-6, 0.6), steep, 1.0)), 0);
        assert_eq!(seen(&receiver(Vec3::new(0.4, 1.0 + 1e-4, 0.6), -Vec3::Y, 64.0)), 0);
    }
}
