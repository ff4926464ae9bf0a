//! The closed forms against every row of the stored tables.

use super::reference::{blurs, coverages, disc_shares, disks, polygons};
use super::{Check, Context, Finding, exact};
use crate::analytic::{DiskLight, disc_share, pixel_coverage, variance_of_one_area_sample};
use crate::check::Tally;

/// The checks of this file.
pub fn checks() -> Vec<Check> {
    vec![
        exact(
            "irradiance-table",
            "the closed forms give each of 14 stored irradiances to 1e-12 and each stored variance to its own digits",
            irradiance_table,
        ),
        exact(
            "camera-table",
            "the closed forms give every stored pixel coverage, disc share and circle of confusion to 1e-14",
            camera_table,
        ),
    ]
}

/// Would catch a wrong term of any closed form that the other checks stand on.
fn irradiance_table(_: &Context) -> Finding {
    let mut tally = Tally::new();
    for row in polygons() {
        let name = &row.name;
        let found = row.light.irradiance(&row.at);
        tally.near(format!("{name}: E"), found, row.irradiance, 1e-12 * row.irradiance);
        tally.near(format!("{name}: area"), row.light.area(), row.area, 1e-15 * row.area);
        let found = variance_of_one_area_sample(&row.light, &row.at, None);
        tally.near(format!("{name}: variance"), found, row.variance, row.variance_tolerance * row.variance);
    }
    for row in disks() {
        let name = &row.name;
        let disk = DiskLight { radius: row.radius, emission: row.emission };
        tally.near(
            format!("{name}: E"),
            disk.irradiance(row.height, row.offset),
            row.irradiance,
            1e-12 * row.irradiance,
        );
        let found = disk.variance_of_one_area_sample(row.height, row.offset).unwrap_or(f64::NAN);
        tally.near(format!("{name}: variance"), found, row.variance, 1e-6 * row.variance);
    }
    let rows = polygons().len() + disks().len();
    tally.fact(format!("the table has 14 rows: {rows}"), rows == 14);
    tally.saying("14 rows: E to 1e-12, variances to 1e-6 (two from a midpoint grid: 1e-5)")
}

/// As above, for the camera.
fn camera_table(_: &Context) -> Finding {
    let mut tally = Tally::new();
    for row in coverages() {
        let [a, b, c] = row.edge;
        let found = pixel_coverage(a, b, c);
        tally.near(format!("{a} x + {b} y ≤ {c}"), found, row.area, 1e-14);
        tally.near(format!("{a} x + {b} y ≤ {c}: variance"), found * (1.0 - found), row.variance, 1e-14);
    }
    for [t, share] in disc_shares() {
        tally.near(format!("share of a disc on x ≤ {t}"), disc_share(t), share, 1e-14);
    }
    for row in blurs() {
        let place = format!("{:?} at depth {}", row.lens, row.depth);
        let mut near = |what: &str, found: f64, expected: f64| {
            tally.near(format!("{place}: {what}"), found, expected, 1e-14 * expected.max(1.0));
        };
        near("disc of rays", row.lens.ray_disc_radius(row.depth), row.ray_disc);
        near("blur in the plane of focus", row.lens.blur_radius_in_focus_plane(row.depth), row.in_focus_plane);
        near("blur in pixels", row.lens.blur_radius_px(row.depth, row.fov_degrees, f64::from(row.height_px)), row.px);
    }
    let rows = [coverages().len(), disc_shares().len(), blurs().len()];
    tally.fact(format!("the table has 11, 7 and 5 rows: {rows:?}"), rows == [11, 7, 5]);
    tally.saying("11 coverages, 7 shares of a disc and 5 circles of confusion to 1e-14")
}
