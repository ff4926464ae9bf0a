//! Smooth bodies as grids of points with analytic normals.

use glam::{DMat3, DVec3};

use super::obj::{Corner, Obj};

/// Where a body stands: turned about the vertical, scaled, moved.
#[derive(Debug, Clone, Copy)]
pub struct Place {
    /// Where the body's origin goes.
    pub origin: DVec3,
    /// Scene units per unit of the body.
    pub scale: f64,
    /// Turn about +y, counter-clockwise seen from above.
    pub turn_degrees: f64,
}

impl Place {
    /// A point of the body with its unit normal, in the scene.
    pub fn corner(&self, position: DVec3, normal: DVec3) -> Corner {
        let (sin, cos) = libm::sincos(self.turn_degrees.to_radians());
        let turn = DMat3::from_cols(DVec3::new(cos, 0.0, -sin), DVec3::Y, DVec3::new(sin, 0.0, cos));
        Corner { position: self.origin + turn * position * self.scale, normal: Some(turn * normal), uv: None }
    }
}

/// Adds the grid of `columns × rows` quads over the corners `at(column, row)`, both ends included.
pub fn grid(obj: &mut Obj, columns: usize, rows: usize, at: impl Fn(usize, usize) -> Corner) {
    for row in 0..rows {
        for column in 0..columns {
            obj.face(&[at(column, row), at(column + 1, row), at(column + 1, row + 1), at(column, row + 1)]);
        }
    }
}

/// A point of a profile in the half plane (distance from the axis, height), and its unit normal there.
#[derive(Debug, Clone, Copy)]
pub struct ProfilePoint {
    /// Distance from the axis, height.
    pub at: [f64; 2],
    /// Unit normal, same axes.
    pub normal: [f64; 2],
}

/// Adds the body that `profile` sweeps about the vertical axis, `around` steps a turn.
pub fn revolve(obj: &mut Obj, place: &Place, profile: &[ProfilePoint], around: usize) {
    grid(obj, around, profile.len() - 1, |column, row| {
        // The last column is the first: the seam closes exactly.
        let angle = std::f64::consts::TAU * (column % around) as f64 / around as f64;
        let (sin, cos) = libm::sincos(angle);
        let ProfilePoint { at: [radius, height], normal: [outward, upward] } = profile[row];
        place.corner(DVec3::new(radius * cos, height, radius * sin), DVec3::new(outward * cos, upward, outward * sin))
    });
}

/// The profile of a ball of radius 1 that stands on the origin.
pub fn ball(steps: usize) -> Vec<ProfilePoint> {
    (0..=steps)
        .map(|i| {
            let (sin, cos) = libm::sincos(std::f64::consts::PI * i as f64 / steps as f64);
            // On the axis exactly, so that the pole is one point with one normal.
            let sin = if i == 0 || i == steps { 0.0 } else { sin };
            ProfilePoint { at: [sin, 1.0 - cos], normal: [sin, -cos] }
        })
        .collect()
}

/// The profile through a chain of cubic Bézier segments in (distance from the axis, height), traced with the body on its
/// left: bottom outward, up the outside, down the inside. Each segment is cut into `steps`.
///
/// Neighbouring segments should share a tangent: each point keeps the normal of the segment that ends there.
pub fn bezier_profile(segments: &[[[f64; 2]; 4]], steps: usize) -> Vec<ProfilePoint> {
    let mut profile = vec![profile_point(&segments[0], 0.0)];
    for segment in segments {
        profile.extend((1..=steps).map(|i| profile_point(segment, i as f64 / steps as f64)));
    }
    profile
}

/// One cubic segment at parameter `t`; the normal is the tangent turned to the right.
fn profile_point(segment: &[[f64; 2]; 4], t: f64) -> ProfilePoint {
    let (weights, slopes) = (bernstein(t), bernstein_slopes(t));
    let sum = |w: &[f64; 4], axis: usize| (0..4).map(|i| w[i] * segment[i][axis]).sum::<f64>();
    let tangent = [sum(&slopes, 0), sum(&slopes, 1)];
    let length = (tangent[0] * tangent[0] + tangent[1] * tangent[1]).sqrt();
    ProfilePoint { at: [sum(&weights, 0), sum(&weights, 1)], normal: [tangent[1] / length, -tangent[0] / length] }
}

/// Cubic Bernstein polynomials B₀…B₃ at `t`.
pub fn bernstein(t: f64) -> [f64; 4] {
    let s = 1.0 - t;
    [s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t]
}

/// Their derivatives at `t`.
pub fn bernstein_slopes(t: f64) -> [f64; 4] {
    let s = 1.0 - t;
    [-3.0 * s * s, 3.0 * s * (s - 2.0 * t), 3.0 * t * (2.0 * s - t), 3.0 * t * t]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bernstein_polynomials_sum_to_one_and_their_slopes_to_zero() {
        for t in [0.0, 0.1, 0.5, 0.77, 1.0] {
            assert!((bernstein(t).iter().sum::<f64>() - 1.0).abs() < 1e-15);
            assert!(bernstein_slopes(t).iter().sum::<f64>().abs() < 1e-15);
        }
        assert_eq!(bernstein(0.5), [0.125, 0.375, 0.375, 0.125]);
        assert_eq!(bernstein_slopes(0.0), [-3.0, 3.0, 0.0, 0.0]);
        assert_eq!(bernstein_slopes(1.0), [0.0, 0.0, -3.0, 3.0]);
    }

    #[test]
    fn a_profile_traced_up_the_outside_has_normals_away_from_the_axis() {
        let wall = [[[2.0, 0.0], [2.0, 1.0], [2.0, 2.0], [2.0, 3.0]]];
        let profile = bezier_profile(&wall, 3);
        assert_eq!(profile.len(), 4);
        let near = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).abs() < 1e-15 && (a[1] - b[1]).abs() < 1e-15;
        assert!(profile.iter().all(|p| near(p.normal, [1.0, 0.0]) && near(p.at, [2.0, p.at[1]])));
    }

    #[test]
    fn a_quarter_turn_is_counter_clockwise_seen_from_above() {
        let place = Place { origin: DVec3::new(5.0, 0.0, 0.0), scale: 2.0, turn_degrees: 90.0 };
        let corner = place.corner(DVec3::X, DVec3::X);
        assert!(corner.position.distance(DVec3::new(5.0, 0.0, -2.0)) < 1e-15);
        assert!(corner.normal.is_some_and(|n| n.distance(-DVec3::Z) < 1e-15));
    }
}
