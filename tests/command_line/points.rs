//! `points` and `measure`.

use super::*;

/// The keys of a `measure` document that hold a root and its square.
const ROOTS: [&str; 9] = [
    "l2_star",
    "centred_l2",
    "wrap_around_l2",
    "mixture_l2",
    "modified_l2",
    "extreme_l2",
    "symmetric_l2",
    "periodic_l2",
    "diaphony",
];

#[track_caller]
fn assert_is_measurement(document: &Value, source: &str, n: u64, dimension: u64) {
    assert_eq!(document["source"], source);
    assert_eq!((document["n"].as_u64(), document["dimension"].as_u64()), (Some(n), Some(dimension)));
    let star = &document["star"];
    assert!(star["value"].as_f64().is_some_and(|d| d > 0.0 && d <= 1.0), "{star}");
    assert_eq!(star["exact"], true);
    assert_eq!(star["corner"].as_array().map(Vec::len), Some(dimension as usize));
    assert!(star["side"] == "open" || star["side"] == "closed");
    for name in ROOTS {
        let (value, squared) = (document[name]["value"].as_f64(), document[name]["squared"].as_f64());
        let (value, squared) = (value.unwrap(), squared.unwrap());
        assert!((value * value - squared).abs() <= 1e-15 * squared.max(1.0), "{name}: {value}² is not {squared}");
    }
    for name in ["t_value", "min_toroidal_distance"] {
        assert!(document[name].is_null() || document[name].is_number(), "{name}");
    }
}

/// One point at the centre: D* = 3/4 at the closed box [0, 1/2]², its L2-star squared is 23/288 (Warnock's formula by hand).
#[test]
fn one_point_is_measured_from_stdin() {
    let args = ["measure", "-", "--json"];
    let mut child = lab(Folder::empty().0.path(), &args)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    std::io::Write::write_all(&mut child.stdin.take().unwrap(), b"u,v\r\n0.5,0.5\r\n").unwrap();
    let document = ran(&args, child.wait_with_output().unwrap()).json();
    assert_is_measurement(&document, "-", 1, 2);
    assert_eq!(document["star"]["value"], 0.75);
    assert_eq!(document["star"]["corner"], serde_json::json!([0.5, 0.5]));
    assert_eq!(document["star"]["side"], "closed");
    assert!((document["l2_star"]["squared"].as_f64().unwrap() - 23.0 / 288.0).abs() < 1e-15);
    assert_eq!(document["t_value"], 0);
    assert!(document["min_toroidal_distance"].is_null());
}

#[test]
fn duplicates_and_five_dimensions_are_measured() {
    let folder = Folder::new(&[("points.csv", "0.5,0.5,0.1,0.2,0.3\n0.5,0.5,0.1,0.2,0.3 # again\n1,1,1,1,1\n")]);
    let document = folder.run(&["measure", "points.csv", "--json"]).json();
    assert_is_measurement(&document, "points.csv", 3, 5);
    assert!(document["t_value"].is_null(), "3 is no power of two");
    assert_eq!(document["min_toroidal_distance"], 0.0);
    let text = folder.run(&["measure", "points.csv"]).fine();
    assert!(text.starts_with("points.csv: 3 points in 5 dimensions\n"), "{text}");
}

/// `star_prefixes.json`: 64 Halton points have D* = 5/96.
#[test]
fn a_sampler_and_the_file_that_points_wrote_of_it_measure_alike() {
    let folder = Folder::empty();
    folder.run(&["points", "halton", "-n", "64"]).fine();
    let mut of_file = folder.run(&["measure", "halton.csv", "--json"]).json();
    let mut of_sampler = folder.run(&["measure", "halton", "-n", "64", "--json", "--threads", "1"]).json();
    assert_is_measurement(&of_sampler, "halton", 64, 2);
    assert!((of_sampler["star"]["value"].as_f64().unwrap() - 5.0 / 96.0).abs() < 1e-14);
    let sampler = of_sampler.as_object_mut().unwrap().remove("sampler").unwrap();
    assert_eq!((&sampler["asked"], &sampler["seed"]), (&64.into(), &1.into()));
    of_file["source"] = of_sampler["source"].clone();
    assert_eq!(of_file, of_sampler);
}

// points

/// The sheet's Figure 2 painted again from the CSV: black, 5×5 dots, the point's own pixel in the middle, origin at the
/// bottom left, colour (t, 1 − t, 1 − t).
fn painted(csv: &str) -> image::RgbImage {
    let mut lines = csv.lines();
    assert_eq!(lines.next(), Some("x,y"));
    let points: Vec<(f64, f64)> = lines
        .map(|line| line.split_once(',').unwrap())
        .map(|(x, y)| (x.parse().unwrap(), y.parse().unwrap()))
        .collect();
    let mut panel = image::RgbImage::new(512, 512);
    for (i, (x, y)) in points.iter().enumerate() {
        let t = if points.len() == 1 { 0.0 } else { i as f64 / (points.len() - 1) as f64 };
        let colour = [t, 1.0 - t, 1.0 - t].map(|c| (c * 255.0).round() as u8);
        let (column, row) = ((x * 512.0) as i64, 511 - (y * 512.0) as i64);
        for (u, v) in (-2..=2).flat_map(|u| (-2..=2).map(move |v| (column + u, row + v))) {
            if (0..512).contains(&u) && (0..512).contains(&v) {
                panel.put_pixel(u as u32, v as u32, image::Rgb(colour));
            }
        }
    }
    panel
}

#[test]
fn points_draws_and_writes_the_sheet_s_five_sets() {
    let folder = Folder::empty();
    assert_eq!(folder.run(&["points", "--out", "deep/figure2"]).fine(), "");
    let names = ["halton", "hammersley", "ld", "stratified", "uniform"];
    let mut expected: Vec<String> = names.iter().flat_map(|n| [format!("{n}.csv"), format!("{n}.png")]).collect();
    expected.sort();
    let found = files(&folder.path("deep/figure2"));
    assert_eq!(found.keys().map(|p| p.display().to_string()).collect::<Vec<_>>(), expected);
    for name in names {
        let csv = String::from_utf8(folder.bytes(&format!("deep/figure2/{name}.csv"))).unwrap();
        assert_eq!(csv.lines().count(), 1025);
        let drawn = image::open(folder.path(&format!("deep/figure2/{name}.png"))).unwrap();
        assert_eq!((drawn.width(), drawn.height(), drawn.color()), (512, 512, image::ColorType::Rgb8));
        assert!(drawn.into_rgb8() == painted(&csv), "{name}");
    }
}

#[test]
fn a_set_s_files_are_named_after_it_and_one_point_is_cyan() {
    let folder = Folder::empty();
    folder.run(&["points", "ld:shuffle:owen@decision", "hammersley:plain", "-n", "1", "--quiet"]).fine();
    assert_eq!(folder.bytes("hammersley-plain.csv"), b"x,y\n0,0\n");
    // The dot at the origin is cut by the border: 3×3 pixels at the bottom left are left of it.
    let drawn = image::open(folder.path("hammersley-plain.png")).unwrap().into_rgb8();
    let lit: Vec<_> = drawn.enumerate_pixels().filter(|(_, _, p)| p.0 != [0; 3]).map(|(x, y, p)| (x, y, p.0)).collect();
    assert_eq!(lit, (509..512).flat_map(|y| (0..3).map(move |x| (x, y, [0, 255, 255]))).collect::<Vec<_>>());
    assert!(
        folder.path("ld-shuffle-owen-decision.png").is_file() && folder.path("ld-shuffle-owen-decision.csv").is_file()
    );
    // 26 strata are no grid: 28 are taken, and the file has them all.
    folder.run(&["points", "stratified", "-n", "26"]).fine();
    assert_eq!(folder.bytes("stratified.csv").split(|&b| b == b'\n').count(), 1 + 28 + 1);
}

#[test]
fn the_same_points_give_the_same_bytes_and_json_holds_the_csv_s_numbers() {
    let (one, two) = (Folder::empty(), Folder::empty());
    for folder in [&one, &two] {
        folder.run(&["points", "--seed", "9"]).fine();
    }
    assert_eq!(files(one.0.path()), files(two.0.path()));
    one.run(&["points", "ld", "--seed", "9", "--format", "json"]).fine();
    let document: Value = serde_json::from_slice(&one.bytes("ld.json")).unwrap();
    assert_eq!((&document["sampler"], &document["seed"]), (&"ld".into(), &9.into()));
    let csv = String::from_utf8(one.bytes("ld.csv")).unwrap();
    let points = document["points"].as_array().unwrap();
    assert_eq!(points.len(), 1024);
    for (line, point) in csv.lines().skip(1).zip(points) {
        assert_eq!(line, format!("{},{}", point[0].as_f64().unwrap(), point[1].as_f64().unwrap()));
    }
    two.run(&["points", "--seed", "10"]).fine();
    assert_ne!(one.bytes("uniform.csv"), two.bytes("uniform.csv"), "the seed counts");
}

// render
