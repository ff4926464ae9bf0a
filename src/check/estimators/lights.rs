//! One uniform sample of one light, without the renderer around it: its mean is Lambert's closed form, its variance the
//! quadrature of the squared sample.

use glam::{DVec3, Vec2, Vec3};

use super::reference::polygons;
use super::{Check, Context, Finding, exact, statistical, uniform_points};
use crate::analytic::{PolygonLight, Receiver, variance_of_one_area_sample};
use crate::check::Tally;
use crate::check::room::Exact;
use crate::render::light_contribution;
use crate::scene::geometry::SurfacePoint;
use crate::scene::light::Light;
use crate::stats::hypothesis::t_test_of_squares;

/// The checks of this file.
pub fn checks() -> Vec<Check> {
    vec![
        statistical(
            "light-mean",
            "one area sample of a quad light has Lambert's irradiance as its mean: centred, corner, tilted, cut by the horizon, \
             tiny, far, near",
            |context| mean_of(context, &quads()),
        ),
        statistical(
            "light-variance",
            "one area sample of a quad light has exactly the variance of uniform sampling by area",
            |context| variance_of(context, &quads()),
        ),
        statistical(
            "mesh-light-mean",
            "a light of several triangles is sampled with Lambert's irradiance as its mean",
            |context| mean_of(context, &meshes()),
        ),
        statistical(
            "mesh-light-variance",
            "a light of several triangles is sampled by area: exactly its variance",
            |context| variance_of(context, &meshes()),
        ),
        exact(
            "light-dark-side",
            "behind a light, in its plane and on the far side of the receiver every sample is exactly 0",
            dark_side,
        ),
        statistical(
            "mean-alone-is-blind",
            "a wrong density with a factor that makes up for it passes the test of the mean and fails that of the variance",
            mean_alone_is_blind,
        ),
    ]
}

/// Offset of a shadow ray's start from a surface point, in these checks and as a share of the largest coordinate of lights.
const OFFSET: f32 = 1.0 / 262_144.0;

/// A light and a receiver, as the renderer and as the closed form have them.
struct Setting {
    name: String,
    light: Light,
    form: PolygonLight,
    at: Receiver,
}

impl Setting {
    /// Corners counter-clockwise from the front; the closed form takes them as rounded to single precision.
    fn new(name: &str, corners: &[DVec3], emission: f64, at: Receiver) -> Self {
        let c: Vec<Vec3> = corners.iter().map(|c| c.as_vec3()).collect();
        let triangles: Vec<[Vec3; 3]> = c[1..].windows(2).map(|pair| [c[0], pair[0], pair[1]]).collect();
        let light =
            Light::new(name.to_owned(), Vec3::splat(emission as f32), &triangles).expect("a light with an area");
        let form = PolygonLight { corners: c.iter().map(|c| c.as_dvec3()).collect(), emission };
        Self { name: name.to_owned(), light, form, at }
    }

    fn surface(&self) -> SurfacePoint {
        let normal = self.at.normal.as_vec3();
        SurfacePoint {
            position: self.at.point.as_vec3(),
            normal,
            face_normal: normal,
            uv: Vec2::ZERO,
            material: 0,
            offset: OFFSET,
        }
    }

    /// What each of `n` independent uniform samples of the light receives.
    fn received(&self, n: u32, seed: u64) -> Vec<f64> {
        let from = self.surface();
        uniform_points(seed, n).map(|u| contribution(&self.light, u, &from)).collect()
    }

    /// Lambert's irradiance, and how far the mean may be off it: both ends of a shadow ray are moved along their normals by
    /// 2⁻¹⁸ of the coordinates, which the closed form itself can follow, and some 64 roundings of single precision lie between.
    fn exact(&self) -> Exact {
        let value = self.form.irradiance(&self.at);
        let largest = self.form.corners.iter().fold(0.0, |m: f64, c| m.max(c.abs().max_element()));
        let c = &self.form.corners;
        let front = (c[1] - c[0]).cross(c[2] - c[0]).normalize();
        let moved = |receiver: f64, light: f64| {
            let at = Receiver { point: self.at.point + self.at.normal * receiver, ..self.at };
            let corners = c.iter().map(|&c| c + front * light).collect();
            (PolygonLight { corners, ..self.form.clone() }.irradiance(&at) - value).abs()
        };
        let step = f64::from(OFFSET);
        let allowance = 1.25 * (moved(step, 0.0) + moved(0.0, largest * step)) + 64.0 * 2f64.powi(-24) * value;
        Exact { value, allowance }
    }

    fn variance(&self) -> f64 {
        variance_of_one_area_sample(&self.form, &self.at, None)
    }
}

fn contribution(light: &Light, u: Vec2, from: &SurfacePoint) -> f64 {
    light_contribution(light, u, from).map_or(0.0, |(radiance, _)| f64::from(radiance.x))
}

fn up(x: f64, y: f64, z: f64) -> Receiver {
    Receiver { point: DVec3::new(x, y, z), normal: DVec3::Z }
}

/// The unit square in the plane z = 1 that shines downwards, of another size and about another centre.
fn square(half: f64, [x, y, z]: [f64; 3]) -> [DVec3; 4] {
    [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)].map(|(a, b)| DVec3::new(x + a * half, y + b * half, z))
}

/// Parallelograms: the lit rows of `irradiance.json`, and lights that are tiny, far and near.
fn quads() -> Vec<Setting> {
    let lit = polygons().into_iter().filter(|row| row.irradiance > 0.0);
    let mut settings: Vec<Setting> =
        lit.map(|row| Setting::new(&row.name, &row.light.corners, row.light.emission, row.at)).collect();
    settings.extend([
        Setting::new("tiny", &square(0.0005, [0.0, 0.0, 1.0]), 1e6, up(0.7, 0.3, 0.0)),
        Setting::new("far", &square(0.5, [0.0, 0.0, 1.0]), 1.0, up(200.0, -100.0, -250.0)),
        Setting::new("near", &square(0.5, [0.0, 0.0, 1.0]), 1.0, up(0.1, 0.2, 0.9)),
        Setting::new("skewed", &skewed(), 1.0, up(0.2, -0.4, 0.1)),
    ]);
    settings
}

/// A parallelogram whose sides are neither equal nor at right angles, tilted.
fn skewed() -> [DVec3; 4] {
    let (corner, e1, e2) = (DVec3::new(-1.0, -0.5, 1.5), DVec3::new(0.5, 1.25, 0.25), DVec3::new(1.5, 0.25, -0.5));
    [corner, corner + e1, corner + e1 + e2, corner + e2]
}

/// Lights that are no parallelogram take their triangle from the same 2-D decision: a pentagon, a triangle, and a
/// quadrilateral whose halves differ.
fn meshes() -> Vec<Setting> {
    let shapes: [(&str, &[(f64, f64)]); 3] = [
        ("pentagon", &[(1.0, 0.0), (2.0, 0.0), (2.5, 1.0), (1.5, 2.0), (0.5, 1.0)]),
        ("triangle", &[(-0.5, -1.0), (1.0, -0.5), (0.0, 2.0)]),
        ("unequal halves", &[(-1.0, -1.0), (0.5, -1.0), (2.0, 1.5), (-1.0, 0.25)]),
    ];
    let at = Receiver { point: DVec3::ZERO, normal: DVec3::new(0.6, 0.8, 0.0) };
    let setting = |(name, shape): (&str, &[(f64, f64)])| {
        let corners: Vec<DVec3> = shape.iter().map(|&(x, z)| DVec3::new(x, 1.25, z)).collect();
        let setting = Setting::new(name, &corners, 1.0, at);
        assert!(!setting.light.is_parallelogram());
        setting
    };
    shapes.map(setting).into()
}

const SAMPLES: u32 = 400_000;

/// Catches a bias of about 10 standard errors, 0.2 to 4 % of E: a cosine left out or squared, a wrong area, r in place of r²,
/// an absolute value on a cosine where the horizon cuts the light.
fn mean_of(context: &Context, settings: &[Setting]) -> Finding {
    let family = context.family(settings.len() as u32);
    let mut tally = Tally::new();
    for (part, setting) in settings.iter().enumerate() {
        let samples = setting.received(context.replicates(SAMPLES, 2_000), context.seed_of(part as u64, 0));
        let exact = setting.exact();
        tally.verdict(&setting.name, &exact.test(&samples, family), exact.value);
    }
    tally.finish()
}

/// Mean squared deviation from the *exact* mean. Catches a variance that is wrong by some 1 to 6 %: points that crowd, whatever
/// weight makes up for it; a triangle chosen by anything but its area; a forgotten square root.
fn variance_of(context: &Context, settings: &[Setting]) -> Finding {
    let family = context.family(settings.len() as u32);
    let mut tally = Tally::new();
    for (part, setting) in settings.iter().enumerate() {
        let samples = setting.received(context.replicates(2 * SAMPLES, 2_000), context.seed_of(part as u64, 1));
        let (mean, variance) = (setting.exact().value, setting.variance());
        let squares: Vec<f64> = samples.iter().map(|s| (s - mean).powi(2)).collect();
        tally.verdict(&setting.name, &t_test_of_squares(&squares, variance, family), variance);
    }
    tally.finish()
}

/// Nothing leaks through an absolute value: catches a light that shines to both sides or onto a surface's back.
fn dark_side(context: &Context) -> Finding {
    let mut tally = Tally::new();
    let mut all_dark = |name: &str, setting: &Setting| {
        let lit = setting.received(1_000, context.seed).iter().filter(|&&s| s != 0.0).count();
        tally.fact(
            format!("{name}: {lit} of 1000 samples above 0"),
            lit == 0 && setting.form.irradiance(&setting.at) == 0.0,
        );
    };
    for row in polygons().into_iter().filter(|row| row.irradiance == 0.0) {
        all_dark(&row.name, &Setting::new(&row.name, &row.light.corners, row.light.emission, row.at));
    }
    for lit in quads().into_iter().chain(meshes()) {
        let reversed: Vec<DVec3> = lit.form.corners.iter().rev().copied().collect();
        all_dark(&format!("{}, winding flipped", lit.name), &Setting::new("", &reversed, 1.0, lit.at));
    }
    let turned = Receiver { point: DVec3::ZERO, normal: DVec3::new(0.0, 0.28, -0.96) };
    all_dark("receiver turned away", &Setting::new("", &square(0.25, [0.0, 0.0, 1.0]), 1.0, turned));
    tally.finish()
}

/// The mistake by hand: a point at u² along one side of the light (so points crowd at that side, with density 1/(2u) in place of 1),
/// weighted by 2u. Its mean is Lambert's; its variance is not that of uniform sampling. One test of two would not see it.
fn mean_alone_is_blind(context: &Context) -> Finding {
    let family = context.family(2);
    let setting = &quads()[0];
    let from = setting.surface();
    let wrong = |u: Vec2| 2.0 * f64::from(u.x) * contribution(&setting.light, Vec2::new(u.x * u.x, u.y), &from);
    let samples: Vec<f64> = uniform_points(context.seed, context.replicates(SAMPLES, 2_000)).map(wrong).collect();
    let (exact, variance) = (setting.exact(), setting.variance());
    let squares: Vec<f64> = samples.iter().map(|s| (s - exact.value).powi(2)).collect();
    let (mean, spread) = (exact.test(&samples, family), t_test_of_squares(&squares, variance, family));
    let found = squares.iter().sum::<f64>() / squares.len() as f64;
    let mut tally = Tally::new();
    tally.verdict("the mean is right", &mean, exact.value);
    tally.fact(format!("the variance is seen to be wrong: {spread}"), !spread.holds());
    let p = mean.p_value.unwrap_or(f64::NAN);
    tally.saying(format!("mean: p = {p:.3}, nothing to see; variance {found:.4} in place of {variance:.4}, seen"))
}
