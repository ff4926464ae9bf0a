//! The stored irradiance cases: sixty-digit means, variances by independent quadrature.

use glam::DVec3;
use serde_json::Value;

use crate::analytic::disk::DiskLight;
use crate::analytic::polygon::{PolygonLight, Receiver};
use crate::analytic::quadrature::{Tolerance, integrate_rectangle};
use crate::analytic::variance::variance_of_one_area_sample;

fn cases() -> Vec<Value> {
    let file: Value = serde_json::from_str(include_str!("../../tests/reference/irradiance.json")).unwrap();
    file["cases"].as_array().unwrap().clone()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| value.as_str().unwrap().split(' ').next().unwrap().parse().unwrap())
}

fn vector(value: &Value) -> DVec3 {
    DVec3::new(number(&value[0]), number(&value[1]), number(&value[2]))
}

fn polygon_cases() -> Vec<(Value, PolygonLight, Receiver)> {
    let with_light = |case: Value| {
        let corners = case["light_ccw_from_front"].as_array()?.iter().map(vector).collect();
        let light = PolygonLight { corners, emission: number(&case["k_e"]) };
        let at = Receiver { point: vector(&case["point"]), normal: vector(&case["normal"]) };
        Some((case, light, at))
    };
    cases().into_iter().filter_map(with_light).collect()
}

fn disk_cases() -> Vec<(Value, DiskLight, f64, f64)> {
    let disk = |case: Value| {
        (case["shape"] == "disk").then(|| {
            let light = DiskLight { radius: number(&case["R"]), emission: number(&case["k_e"]) };
            let (height, offset) = (number(&case["h"]), number(&case["offset"]));
            (case, light, height, offset)
        })
    };
    cases().into_iter().filter_map(disk).collect()
}

fn assert_relative(found: f64, exact: f64, tolerance: f64, case: &Value) {
    assert!((found - exact).abs() <= tolerance * exact.abs(), "{}: found {found:e}, expected {exact:e}", case["name"]);
}

/// The file gives eight digits; the two clipped cases come from a midpoint grid and say so.
fn variance_tolerance(case: &Value) -> f64 {
    let text = case["per_sample_variance_uniform_area"].as_str().unwrap();
    if text.contains("midpoint") { 1e-5 } else { 1e-6 }
}

#[test]
fn the_file_holds_eleven_polygons_and_three_disks() {
    assert_eq!((polygon_cases().len(), disk_cases().len(), cases().len()), (11, 3, 14));
}

#[test]
fn polygon_irradiance_agrees_to_twelve_digits() {
    for (case, light, at) in polygon_cases() {
        assert_relative(light.irradiance(&at), number(&case["E"]), 1e-12, &case);
        assert_relative(light.area(), number(&case["area"]), 1e-15, &case);
    }
}

#[test]
fn disk_irradiance_agrees_to_twelve_digits() {
    for (case, light, height, offset) in disk_cases() {
        assert_relative(light.irradiance(height, offset), number(&case["E"]), 1e-12, &case);
    }
}

#[test]
fn the_variance_of_one_area_sample_agrees() {
    for (case, light, at) in polygon_cases() {
        let exact = number(&case["per_sample_variance_uniform_area"]);
        assert_relative(variance_of_one_area_sample(&light, &at, None), exact, variance_tolerance(&case), &case);
    }
    for (case, light, height, offset) in disk_cases() {
        let exact = number(&case["per_sample_variance_uniform_area"]);
        let found = light.variance_of_one_area_sample(height, offset).unwrap();
        assert_relative(found, exact, variance_tolerance(&case), &case);
    }
}

/// The twin: adaptive Gauss–Kronrod over the whole parallelogram, cosines clamped, no clipping and no contour.
#[test]
fn means_and_variances_agree_with_adaptive_quadrature_over_the_whole_light() {
    for (case, light, at) in polygon_cases() {
        let [origin, b, _, d] = light.corners[..] else { panic!("{case}") };
        let (along, across) = (b - origin, d - origin);
        let (area, facing) = (along.cross(across).length(), along.cross(across).normalize());
        let sample = |s: f64, t: f64| {
            let v = origin + along * s + across * t - at.point;
            let square = v.length_squared();
            area * light.emission * at.normal.dot(v).max(0.0) * (-facing.dot(v)).max(0.0) / (square * square)
        };
        let none = |_: f64, _: &mut Vec<f64>| {};
        let integral = |f: &dyn Fn(f64, f64) -> f64| {
            integrate_rectangle(f, [0.0, 1.0], [0.0, 1.0], &[], none, Tolerance::absolute(1e-10)).unwrap().value
        };
        let mean = integral(&sample);
        assert!((light.irradiance(&at) - mean).abs() <= 1e-10, "{}", case["name"]);
        let variance = integral(&|s, t| (sample(s, t) - mean) * (sample(s, t) - mean));
        assert!((variance_of_one_area_sample(&light, &at, None) - variance).abs() <= 2e-10, "{}", case["name"]);
    }
}
