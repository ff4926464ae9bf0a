//! The stored truths: `irradiance.json` (sixty-digit contour sums, variances by independent quadrature) and `camera.json` (exact
//! rationals and closed forms), row by row.

use glam::DVec3;

use crate::analytic::{PolygonLight, Receiver, ThinLens};
use crate::scene::json::{Value, parse};

/// A polygon light and a receiver.
#[derive(Debug, Clone)]
pub struct PolygonRow {
    /// The row's name.
    pub name: String,
    /// The light.
    pub light: PolygonLight,
    /// The receiver.
    pub at: Receiver,
    /// Irradiance E.
    pub irradiance: f64,
    /// Variance of one uniform-area sample.
    pub variance: f64,
    /// Relative tolerance that the stored variance's own digits allow.
    pub variance_tolerance: f64,
    /// The light's area.
    pub area: f64,
}

/// A disk light that faces the receiver.
#[derive(Debug, Clone)]
pub struct DiskRow {
    /// The row's name.
    pub name: String,
    /// Radius.
    pub radius: f64,
    /// Distance from the disk's plane.
    pub height: f64,
    /// Distance from the disk's axis.
    pub offset: f64,
    /// Emitted radiance.
    pub emission: f64,
    /// Irradiance E.
    pub irradiance: f64,
    /// Variance of one uniform-area sample.
    pub variance: f64,
}

/// A half-plane a x + b y ≤ c over the unit pixel.
#[derive(Debug, Clone, Copy)]
pub struct CoverageRow {
    /// Coefficients a, b, c.
    pub edge: [f64; 3],
    /// Covered area, a rational.
    pub area: f64,
    /// Variance of one random sample, area · (1 − area).
    pub variance: f64,
}

/// A thin lens and what it does to a point off its plane of focus.
#[derive(Debug, Clone, Copy)]
pub struct BlurRow {
    /// The lens.
    pub lens: ThinLens,
    /// Depth z of the point.
    pub depth: f64,
    /// Vertical field of view, degrees.
    pub fov_degrees: f64,
    /// Rows of the image.
    pub height_px: u32,
    /// Radius of the disc that the rays of one image point fill at depth z.
    pub ray_disc: f64,
    /// Radius of the point's blur in the plane of focus.
    pub in_focus_plane: f64,
    /// Radius of the point's blur in pixels.
    pub px: f64,
}

fn document(text: &str, name: &str) -> Value {
    parse(text.as_bytes(), name).unwrap_or_else(|error| panic!("{error}"))
}

fn irradiance() -> Value {
    document(include_str!("../../../tests/reference/irradiance.json"), "irradiance.json")
}

fn camera() -> Value {
    document(include_str!("../../../tests/reference/camera.json"), "camera.json")
}

fn get<'a>(row: &'a Value, key: &str) -> &'a Value {
    row.get(key).unwrap_or_else(|| panic!("{key}: expected in {row}"))
}

fn items(value: &Value) -> &[Value] {
    let Value::Array(items) = value else { panic!("expected an array, found {value}") };
    items
}

fn text<'a>(row: &'a Value, key: &str) -> &'a str {
    let Value::Text(text) = get(row, key) else { panic!("{key}: expected a text in {row}") };
    text
}

/// A number, a decimal text with more digits than f64 holds (perhaps with a remark after it), or a fraction.
fn number(value: &Value) -> f64 {
    let text = match value {
        Value::Number(number) => return number.as_f64(),
        Value::Text(text) => text.split(' ').next().unwrap_or_default(),
        other => panic!("expected a number, found {other}"),
    };
    let parse = |text: &str| text.parse::<f64>().unwrap_or_else(|e| panic!("{text:?}: {e}"));
    text.split_once('/').map_or_else(|| parse(text), |(p, q)| parse(p) / parse(q))
}

fn vector(value: &Value) -> DVec3 {
    let [x, y, z] = items(value) else { panic!("expected three numbers, found {value}") };
    DVec3::new(number(x), number(y), number(z))
}

/// The polygon rows of `irradiance.json`.
pub fn polygons() -> Vec<PolygonRow> {
    let file = irradiance();
    let row = |row: &Value| {
        let corners = items(row.get("light_ccw_from_front")?).iter().map(vector).collect();
        let variance = text(row, "per_sample_variance_uniform_area");
        Some(PolygonRow {
            name: text(row, "name").to_owned(),
            light: PolygonLight { corners, emission: number(get(row, "k_e")) },
            at: Receiver { point: vector(get(row, "point")), normal: vector(get(row, "normal")) },
            irradiance: number(get(row, "E")),
            variance: number(get(row, "per_sample_variance_uniform_area")),
            // Eight digits are given; rows from a midpoint grid say so.
            variance_tolerance: if variance.contains("midpoint") { 1e-5 } else { 1e-6 },
            area: number(get(row, "area")),
        })
    };
    items(get(&file, "cases")).iter().filter_map(row).collect()
}

/// The disk rows of `irradiance.json`.
pub fn disks() -> Vec<DiskRow> {
    let file = irradiance();
    let row = |row: &Value| {
        row.get("shape")?;
        let of = |key: &str| number(get(row, key));
        Some(DiskRow {
            name: text(row, "name").to_owned(),
            radius: of("R"),
            height: of("h"),
            offset: of("offset"),
            emission: of("k_e"),
            irradiance: of("E"),
            variance: of("per_sample_variance_uniform_area"),
        })
    };
    items(get(&file, "cases")).iter().filter_map(row).collect()
}

/// The pixel coverages of `camera.json`.
pub fn coverages() -> Vec<CoverageRow> {
    let row = |row: &Value| {
        let of = |key: &str| number(get(row, key));
        assert!((of("area") - of("area_rational")).abs() <= 1e-15, "the file contradicts itself: {row}");
        CoverageRow {
            edge: ["a", "b", "c"].map(of),
            area: of("area_rational"),
            variance: of("variance_one_random_sample"),
        }
    };
    items(get(&camera(), "pixel_coverage")).iter().map(row).collect()
}

/// The shares of a disc of `camera.json`: t, and the share on the side x ≤ t.
pub fn disc_shares() -> Vec<[f64; 2]> {
    items(get(&camera(), "disc")).iter().map(|row| ["t", "share"].map(|key| number(get(row, key)))).collect()
}

/// The circles of confusion of `camera.json`.
pub fn blurs() -> Vec<BlurRow> {
    let row = |row: &Value| {
        let of = |key: &str| number(get(row, key));
        BlurRow {
            lens: ThinLens { radius: of("R"), focal_depth: of("f") },
            depth: of("z"),
            fov_degrees: of("fov_y_deg"),
            height_px: of("image_height_px") as u32,
            ray_disc: of("radius_of_ray_cone_at_z"),
            in_focus_plane: of("blur_radius_in_focus_plane_of_point_at_z"),
            px: of("blur_radius_px"),
        }
    };
    items(get(&camera(), "coc")).iter().map(row).collect()
}
