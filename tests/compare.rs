//! `compare`: images of other programs give the numbers that numpy finds, what cannot be compared is refused with its reason, and
//! no file brings the readers down. The images and numbers of `tests/data/compare` are of other programs; see the README there.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use sampler_lab::compare::{Errors, Metric, Reference};
use sampler_lab::film::{Image, Picture, read_exr, read_picture, write_exr, write_pfm, write_png};
use serde_json::Value;
use tempfile::TempDir;

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/compare").join(name)
}

fn read(name: &str) -> Picture {
    read_picture(&data(name), None).unwrap_or_else(|e| panic!("{e}"))
}

fn expected() -> Value {
    serde_json::from_slice(&std::fs::read(data("expected.json")).unwrap()).unwrap()
}

fn references(two: bool) -> Reference {
    let second = two.then(|| ("reference2.exr", read("reference2.exr")));
    Reference::new(("reference.exr", read("reference.exr")), second).unwrap()
}

fn metric(name: &str) -> Metric {
    Metric::ALL.into_iter().find(|metric| metric.name() == name).unwrap_or_else(|| panic!("{name}"))
}

/// Every number of `expected` to 1e-9 relative, the issue's tolerance; both sides compute in f64, so 1e-13 is usual.
#[track_caller]
fn assert_meets(found: &Errors, expected: &Value, whose: &str) {
    let mut count = 0;
    for (name, value) in expected.as_object().unwrap().iter().filter(|(name, _)| *name != "file" && *name != "layer") {
        let value = value.as_f64().or(value["value"].as_f64()).unwrap();
        let estimate = found.get(metric(name)).unwrap_or_else(|| panic!("{whose}: no {name}"));
        assert!((estimate.value - value).abs() <= 1e-9 * value.abs(), "{whose}: {name} {} {value}", estimate.value);
        count += 1;
    }
    assert!(count >= 9, "{whose}: {count} numbers");
}

#[test]
fn images_of_other_programs_have_the_errors_that_numpy_finds() {
    let expected = expected();
    for (name, two) in [("one_reference", false), ("two_references", true)] {
        let reference = references(two);
        for case in expected[name].as_array().unwrap() {
            let file = case["file"].as_str().unwrap();
            let image = read_picture(&data(file), case["layer"].as_str()).unwrap();
            reference.check(file, &image).unwrap();
            assert_meets(&reference.errors(&image), case, file);
        }
        assert!(expected[name].as_array().unwrap().len() >= 18);
    }
    let noise = expected["reference_noise_mse"].as_f64().unwrap();
    assert!((references(true).noise_mse().unwrap() - noise).abs() <= 1e-12 * noise);
    assert_eq!(references(false).noise_mse(), None);
}

/// Ends are rounded to six digits, so they agree to 5e-6 relative; values keep all of theirs.
#[test]
fn replicates_have_the_means_and_intervals_that_numpy_finds() {
    let images: Vec<Picture> = (0..4).map(|i| read(&format!("replicate{i}.pfm"))).collect();
    for (name, two) in [("replicates_one_reference", false), ("replicates_two_references", true)] {
        let (reference, expected) = (references(two), &expected()[name]);
        let each: Vec<Errors> = images.iter().map(|image| reference.errors(image)).collect();
        let all = reference.ensemble(&images, &each);
        assert_meets(&all, expected, name);
        for (metric_name, numbers) in expected.as_object().unwrap() {
            let ends = all.get(metric(metric_name)).unwrap().ci95.expect("four replicates have an interval");
            for (found, wanted) in ends.iter().zip(numbers["ci95"].as_array().into_iter().flatten()) {
                let wanted = wanted.as_f64().unwrap();
                assert!((found - wanted).abs() <= 5.001e-6 * wanted.abs(), "{name}: {metric_name} {found} {wanted}");
            }
        }
        let mse = all.get(Metric::Mse).unwrap();
        let rmse = all.get(Metric::Rmse).unwrap();
        assert_eq!(rmse.value, mse.value.sqrt());
        assert_eq!(all.get(Metric::MseUnbiased).is_some(), two);
    }
}

#[test]
fn the_file_s_place_in_the_whole_image_is_read_and_a_difference_is_said() {
    let window = read("float-window.exr");
    assert_eq!(window.corner, Some((-3, 5)));
    let notes = references(false).check("w", &window).unwrap();
    assert!(notes.len() == 1 && notes[0].contains("(-3, 5)"), "{notes:?}");
}

/// The message of a refusal of `name`, read as `layer`.
#[track_caller]
fn refusal(name: &str, layer: Option<&str>) -> String {
    let error = read_picture(&data(name), layer).unwrap_err();
    assert_eq!(error.exit_code(), 2);
    assert!(error.place.ends_with(name), "{error}");
    error.what
}

#[test]
fn a_file_of_several_layers_is_read_by_name_or_refused_with_their_names() {
    let parts = refusal("parts.exr", None);
    assert!(["--layer", "\"left\", \"right\""].iter().all(|part| parts.contains(part)), "{parts}");
    let misspelt = refusal("layers.exr", Some("difuse"));
    assert!(["\"\", \"diffuse\"", "did you mean \"diffuse\"?"].iter().all(|p| misspelt.contains(p)), "{misspelt}");
    assert_eq!(read_picture(&data("layers.exr"), Some("")).unwrap().pixels, read("layers.exr").pixels);
    // One --layer is for images and references: a file with unnamed channels alone has nothing to mistake.
    assert_eq!(read_picture(&data("grey.exr"), Some("diffuse")).unwrap().pixels, read("grey.exr").pixels);
}

#[test]
fn a_single_layer_is_read_under_its_own_name_alone() {
    let file = tempfile::NamedTempFile::new().unwrap();
    let read_as = |layer: Option<&str>| read_picture(file.path(), layer);
    let layers = std::fs::read(data("layers.exr")).unwrap();
    // Without an R of its own, the unnamed layer is no image, and "diffuse" is the only one.
    std::fs::write(file.path(), patched(layers.clone(), b"\x01\0\0\0R\0", b"\x01\0\0\0S\0")).unwrap();
    let diffuse = read_picture(&data("layers.exr"), Some("diffuse")).unwrap();
    assert_eq!(read_as(None).unwrap().pixels, diffuse.pixels);
    assert_eq!(read_as(Some("diffuse")).unwrap().pixels, diffuse.pixels);
    for wanted in ["difuse", "specular", ""] {
        let error = read_as(Some(wanted)).unwrap_err();
        let found = format!("expected one of the layers \"diffuse\", found \"{wanted}\"");
        assert!(error.exit_code() == 2 && error.what.contains(&found), "{error}");
    }
    // The other way round: a layer that is there but has no colours is not the unnamed one.
    std::fs::write(file.path(), patched(layers, b"diffuse.R\0", b"diffuse.S\0")).unwrap();
    assert_eq!(read_as(Some("specular")).unwrap().pixels, read("layers.exr").pixels);
    for wanted in ["diffuse", "N"] {
        let error = read_as(Some(wanted)).unwrap_err();
        assert!(error.what.contains(&format!("found \"{wanted}\"")), "{error}");
    }
}

#[test]
fn what_is_not_read_is_refused_by_its_name() {
    assert!(refusal("half-htj2k.exr", None).contains("found HTJ2K"));
    let chroma = refusal("luminance-chroma.exr", None);
    assert!(chroma.contains("expected channels R, G, B or Y, found BY, RY, Y"), "{chroma}");
    assert!(refusal("make.py", None).contains("another kind of file"));
    assert!(refusal("missing.exr", None).contains("No such file"));
    let folder = read_picture(&data(""), None).unwrap_err();
    assert!(folder.exit_code() == 2 && folder.what.contains("no regular file"), "{folder}");
    for (start, kind) in [("#?RADIANCE\n", "Radiance"), ("P6\n1 1\n255\n   ", "PNM"), ("", "empty")] {
        let what = read_bytes(start.as_bytes()).unwrap_err().what;
        assert!(what.contains(kind), "{what}");
    }
}

/// What becomes of a file with these bytes.
fn read_bytes(bytes: &[u8]) -> sampler_lab::error::Result<Picture> {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), bytes).unwrap();
    read_picture(file.path(), None)
}

/// Small files of every kind.
const KINDS: [&str; 11] = [
    "half-zip.exr",
    "half-piz.exr",
    "half-b44a.exr",
    "half-dwaa.exr",
    "float-pxr24.exr",
    "float-rle.exr",
    "half-tiled-mip.exr",
    "grey.exr",
    "grey.pfm",
    "gamma16.png",
    "palette.png",
];

#[test]
fn every_torn_image_is_refused() {
    let file = tempfile::NamedTempFile::new().unwrap();
    for name in KINDS {
        let (whole, bytes) = (read(name), std::fs::read(data(name)).unwrap());
        for length in (0..bytes.len()).step_by(if name.ends_with("exr") { 7 } else { 2 }) {
            std::fs::write(file.path(), &bytes[..length]).unwrap();
            match read_picture(file.path(), None) {
                Err(error) => assert_eq!(error.exit_code(), 2),
                // PNG ends with a chunk that holds nothing, OpenEXR may with blocks of lower resolutions.
                Ok(picture) => assert_eq!(picture.pixels, whole.pixels, "{name} cut at {length}"),
            }
        }
    }
}

/// A PNG has checksums, so a flip leaves its pixels or is refused; in the others a flipped bit may be another picture, but a
/// whole one of finite numbers. What a decoder asserts is an error too.
#[test]
fn a_flipped_bit_is_an_error_or_a_whole_picture() {
    let file = tempfile::NamedTempFile::new().unwrap();
    for name in KINDS {
        let (whole, bytes) = (read(name), std::fs::read(data(name)).unwrap());
        // Every byte of the header, where sizes and kinds stand, and some of the rest.
        for at in (0..bytes.len().min(400)).chain((400..bytes.len()).step_by(11)) {
            let mut flipped = bytes.clone();
            flipped[at] ^= 1 << (at % 8);
            std::fs::write(file.path(), &flipped).unwrap();
            match read_picture(file.path(), None) {
                Err(error) => assert_eq!(error.exit_code(), 2),
                Ok(picture) if name.ends_with("png") => assert_eq!(picture.pixels, whole.pixels, "{name} at {at}"),
                Ok(picture) => {
                    assert_eq!(picture.pixels.len(), picture.width as usize * picture.height as usize);
                    assert!(picture.pixels.as_flattened().iter().all(|c| c.is_finite()), "{name} at {at}");
                }
            }
        }
    }
}

/// Bytes of `whole` with `from`, which stands in it once, replaced by `to`.
fn patched(mut whole: Vec<u8>, from: &[u8], to: &[u8]) -> Vec<u8> {
    let places: Vec<usize> = (0..=whole.len() - from.len()).filter(|&at| whole[at..].starts_with(from)).collect();
    assert_eq!(places.len(), 1);
    whole[places[0]..][..to.len()].copy_from_slice(to);
    whole
}

#[test]
fn a_claimed_size_beyond_the_limit_is_refused_before_memory_is_asked_for() {
    let pfm = read_bytes(b"PF\n100000 100000\n-1.0\n").unwrap_err();
    assert!(pfm.what.contains("at most 67108864 pixels, found 100000×100000"), "{pfm}");
    let pfm = read_bytes(b"PF\n4294967296 4294967296\n-1.0\n").unwrap_err();
    assert!(pfm.what.contains("at most"), "{pfm}");
    assert!(read_bytes(b"PF\n0 7\n-1.0\n").unwrap_err().what.contains("at least one pixel"));
    // A header that claims what a zlib bomb would hold; its checksum is right (computed by Python's zlib).
    let png =
        [b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\x01\x86\xa0\0\x01\x86\xa0\x08\x02\0\0\0".as_slice(), &PNG_SUM].concat();
    let png = read_bytes(&[png.as_slice(), b"\0\0\0\x01IDAT\0", &[0; 4]].concat()).unwrap_err();
    assert!(png.exit_code() == 2 && !png.what.is_empty(), "{png}");
    // dataWindow (0, 0) to (23, 15), with another far corner.
    let exr = std::fs::read(data("half-zip.exr")).unwrap();
    let window = b"dataWindow\0box2i\0\x10\0\0\0";
    let before = [window.as_slice(), &[0; 8], &23_i32.to_le_bytes(), &15_i32.to_le_bytes()].concat();
    let claims = |x: i32, y: i32| [window.as_slice(), &[0; 8], &x.to_le_bytes(), &y.to_le_bytes()].concat();
    let wide = read_bytes(&patched(exr.clone(), &before, &claims(9_999_999, 15))).unwrap_err();
    assert!(wide.what.contains("at most 67108864 pixels, found 10000000×16"), "{wide}");
    let high = read_bytes(&patched(exr, &before, &claims(23, 2_500_000))).unwrap_err();
    assert!(high.what.contains("too few for the 156251 blocks"), "{high}");
}

/// CRC-32 of the header of 100000 × 100000 pixels above.
const PNG_SUM: [u8; 4] = [39, 48, 156, 159];

#[test]
fn pixels_that_are_not_finite_are_counted_and_the_first_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.pfm");
    let mut image = Image::black(5, 4);
    image.pixels[7][1] = f32::NAN;
    image.pixels[13] = [f32::INFINITY, 0.0, f32::NEG_INFINITY];
    write_pfm(&path, &image).unwrap();
    let error = read_picture(&path, None).unwrap_err();
    let parts = ["3 of 60 pixel-channels", "NaN in channel G of pixel (2, 1)", "top left"];
    assert!(error.exit_code() == 2 && parts.iter().all(|part| error.what.contains(part)), "{error}");
}

#[test]
fn a_pfm_is_read_as_it_was_written_and_its_faults_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.pfm");
    let pixels = (0..6).map(|i| [i as f32, -0.5 * i as f32, 1e-30]).collect();
    let image = Image { width: 3, height: 2, pixels };
    write_pfm(&path, &image).unwrap();
    assert_eq!(read_picture(&path, None).unwrap().to_image(), image);
    for (bytes, part) in [
        (b"PF\n3 two\n-1\n".as_slice(), "expected a height in its header, found \"two\""),
        (b"PF\n3 2\n0\n", "a scale other than 0"),
        (b"PF\n3 2\n-1e160\n", "that a 32-bit number holds in its header, found \"-1e160\""),
        (b"PF\n3 2\n1e-160\n", "that a 32-bit number holds in its header, found \"1e-160\""),
        (b"PF\n3 2\nNaN\n", "a scale other than 0"),
        (b"Pf\n1 1\n3e38\n\x40\0\0\0", "expected values of at most 3.40"),
        (b"PF\n3 2\n-1\n1234", "expected 72 bytes for 3×2 pixels after the header, found 4"),
        (b"Pf\n1 1\n-1\n12345", "expected 4 bytes for 1×1 pixels after the header, found 5"),
        (b"PF\n3", "expected a PFM header with"),
        (b"PF4\n3 2\n-1\n", "a PFM of four channels"),
    ] {
        let what = read_bytes(bytes).unwrap_err().what;
        assert!(what.contains(part), "{what}");
    }
}

/// The largest values that a file may hold are still far from where squares of errors, or of those, leave f64.
#[test]
fn the_largest_values_have_finite_errors() {
    let folder = tempfile::tempdir().unwrap();
    for (name, value) in
        [("a.pfm", f32::MAX), ("b.pfm", 0.5 * f32::MAX), ("c.pfm", 0.25 * f32::MAX), ("r.pfm", f32::MIN)]
    {
        write_pfm(&folder.path().join(name), &Image { width: 2, height: 2, pixels: vec![[value; 3]; 4] }).unwrap();
    }
    let found =
        compare(folder.path(), &["a.pfm", "b.pfm", "c.pfm", "--replicates", "--reference", "r.pfm", "--json"]).json();
    for metric in ["mse", "rmse", "rel_mse", "mae", "smape", "bias", "max_abs", "mse_trimmed", "bias2", "variance"] {
        let value = &found["replicates"][metric];
        assert!(value["value"].is_f64() && value["ci95"][0].is_f64() && value["ci95"][1].is_f64(), "{metric} {value}");
    }
}

/// `gamma16.png` with another `gAMA` and its checksum, computed by Python's zlib.
#[test]
fn a_png_of_a_gamma_without_meaning_is_refused() {
    let whole = std::fs::read(data("gamma16.png")).unwrap();
    let at = whole.windows(4).position(|name| name == b"gAMA").unwrap() + 4;
    for (gamma, sum) in GAMMA_SUMS {
        let mut bytes = whole.clone();
        bytes[at..at + 4].copy_from_slice(&gamma.to_be_bytes());
        bytes[at + 4..at + 8].copy_from_slice(&sum.to_be_bytes());
        let error = read_bytes(&bytes).unwrap_err();
        let what = format!("expected a gAMA of 1000 to 10000000 (in 1/100000), found {gamma}");
        assert!(error.exit_code() == 2 && error.what.contains(&what), "{error}");
    }
}

/// Values of `gAMA` and the CRC-32 of their chunks.
const GAMMA_SUMS: [(u32, u32); 3] = [(0, 0x8b25_604d), (1, 0xfc22_50db), (u32::MAX, 0x559e_40ae)];

/// An image of 4 × 4 pixels of `value` as EXR that says it is of `seed` and `spp`.
fn rendered(folder: &TempDir, name: &str, value: f32, seed: u64, spp: u32) -> PathBuf {
    rendered_by(folder, name, value, "ld:best", seed, spp)
}

/// The same of any sampler.
fn rendered_by(folder: &TempDir, name: &str, value: f32, sampler: &str, seed: u64, spp: u32) -> PathBuf {
    let path = folder.path().join(name);
    let image = Image { width: 4, height: 4, pixels: vec![[value; 3]; 16] };
    let says = [
        ("scene", "configs/a01.json".to_owned()),
        ("sampler", sampler.to_owned()),
        ("seed", seed.to_string()),
        ("spp", spp.to_string()),
        ("stage", "final".to_owned()),
        ("estimator", "unbiased".to_owned()),
    ];
    let says = says.map(|(name, value)| (name.to_owned(), value));
    write_exr(&path, &image, &says).unwrap();
    path
}

/// What the program said and how it ended.
struct Ran {
    code: Option<i32>,
    stdout: String,
    stderr: String,
}

fn compare(folder: &Path, args: &[&str]) -> Ran {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sampler-lab"));
    let output = command.current_dir(folder).arg("compare").args(args).stdin(Stdio::null()).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    Ran { code: output.status.code(), stdout: text(output.stdout), stderr: text(output.stderr) }
}

impl Ran {
    /// Ended with `code`, and with all `parts` in one error on stderr.
    #[track_caller]
    fn ends(self, code: i32, parts: &[&str]) -> Self {
        assert_eq!(self.code, Some(code), "{}{}", self.stdout, self.stderr);
        assert_eq!(self.stderr.matches("error: ").count(), usize::from(code != 0), "{}", self.stderr);
        assert!(parts.iter().all(|part| self.stderr.contains(part)), "{parts:?} {}", self.stderr);
        assert!(!self.stderr.contains("panicked"), "{}", self.stderr);
        self
    }

    /// Refused, with nothing on stdout.
    #[track_caller]
    fn refused(self, parts: &[&str]) {
        assert_eq!(self.ends(2, parts).stdout, "");
    }

    #[track_caller]
    fn json(self) -> Value {
        serde_json::from_str(&self.ends(0, &[]).stdout).unwrap()
    }
}

#[test]
fn an_image_that_shares_its_reference_s_random_numbers_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let short = rendered(&folder, "short.exr", 0.5, 1, 16);
    let long = rendered(&folder, "long.exr", 0.625, 1, 1024);
    let other = rendered(&folder, "other.exr", 0.75, 2, 1024);
    let again = rendered(&folder, "again.exr", 0.5, 1, 16);
    let [short, long, other, again] = [&short, &long, &other, &again].map(|path| path.to_str().unwrap());
    let here = folder.path();
    compare(here, &[short, "--reference", long]).refused(&["share random numbers", "seed 1", "scene a01", "--seed"]);
    compare(here, &[short, "--reference", other]).ends(0, &[]);
    // Numbers are drawn by decision and seed, so another sampler draws the same; as many samples or not.
    for spp in [16, 1024] {
        let halton = rendered_by(&folder, "halton.exr", 0.5, "halton:best", 1, spp);
        let halton = halton.to_str().unwrap();
        compare(here, &[halton, "--reference", short]).refused(&["share random numbers", "whatever the samplers"]);
        compare(here, &[other, "--reference", short, "--reference2", halton]).refused(&["independent of"]);
        compare(here, &[halton, "--reference", other]).ends(0, &[]);
    }
    compare(here, &[short, "--reference", other, "--reference2", long]).refused(&["share random numbers"]);
    compare(here, &[other, "--reference", short, "--reference2", again]).refused(&["no second"]);
    compare(here, &[other, "--reference", short, "--reference2", long]).refused(&["independent of", "no second"]);
    // The same render of two versions of a program is what a regression gate compares: allowed, and said.
    let same = compare(here, &[short, "--reference", again, "--gate", "max_abs <= 0", "--json"]);
    same.ends(0, &["note: ", "the same render"]);
}

fn names() -> [String; 3] {
    ["half-zip.exr", "reference.exr", "reference2.exr"].map(|name| data(name).display().to_string())
}

#[test]
fn json_has_the_documented_shape_and_nothing_else_is_on_stdout() {
    let [image, reference, second] = names();
    let folder = tempfile::tempdir().unwrap();
    let one = compare(folder.path(), &[&image, "--reference", &reference, "--json"]).json();
    assert_eq!(one["reference"], reference.as_str());
    assert!(one["reference2"].is_null() && one["replicates"].is_null() && one["gate"].is_null());
    let found = &one["images"][0];
    assert_eq!((found["file"].as_str(), found["nonfinite"].as_u64()), (Some(image.as_str()), Some(0)));
    for name in ["mse", "rmse", "rel_mse", "mae", "smape", "bias", "max_abs", "mse_trimmed", "rel_mse_trimmed"] {
        assert!(found[name]["value"].is_f64() && found[name]["ci95"].is_null(), "{name}");
    }
    assert!(found["mse_unbiased"].is_null() && found.get("mse_unbiased").is_some());
    let two = compare(folder.path(), &[&image, "--reference", &reference, "--reference2", &second, "--json"]).json();
    assert!(two["images"][0]["mse_unbiased"]["value"].is_f64() && two["reference_noise_mse"].is_f64());
    let text = compare(folder.path(), &[&image, "--reference", &reference]).ends(0, &[]).stdout;
    assert!(["rmse", "half-zip.exr", "mse_trimmed"].iter().all(|part| text.contains(part)), "{text}");
}

#[test]
fn replicates_are_judged_together_with_intervals() {
    let folder = tempfile::tempdir().unwrap();
    let [_, reference, second] = names();
    let replicates: Vec<String> = (0..4).map(|i| data(&format!("replicate{i}.pfm")).display().to_string()).collect();
    let mut args: Vec<&str> = replicates.iter().map(String::as_str).collect();
    args.extend(["--replicates", "--reference", &reference, "--reference2", &second, "--json"]);
    let found = compare(folder.path(), &args).json();
    assert_eq!(found["images"].as_array().unwrap().len(), 4);
    let all = &found["replicates"];
    assert_eq!(all["count"], 4);
    let [low, high] = [0, 1].map(|end| all["mse_unbiased"]["ci95"][end].as_f64().unwrap());
    let value = all["mse_unbiased"]["value"].as_f64().unwrap();
    assert!(low < value && value < high && all["variance"]["value"].as_f64().unwrap() > 0.0);
    // The noise was 0.08 and the offset 0.004: a variance of 0.0064.
    args.extend(["--gate", "variance.low > 0.004 and variance.high < 0.009"]);
    compare(folder.path(), &args).ends(0, &[]);
    *args.last_mut().unwrap() = "mse_unbiased.high < 0.001";
    compare(folder.path(), &args).ends(1, &["--gate: expected mse_unbiased.high < 0.001, found ", "the 4 replicates"]);

    compare(folder.path(), &[&replicates[0], "--replicates", "--reference", &reference]).refused(&["at least 2"]);
    let twice = [&replicates[0], &replicates[0], "--replicates", "--reference", &reference];
    compare(folder.path(), &twice).refused(&["twice"]);
    let copy = folder.path().join("copy.pfm");
    std::fs::copy(&replicates[0], &copy).unwrap();
    let equal = [copy.to_str().unwrap(), &replicates[0], "--replicates", "--reference", &reference];
    compare(folder.path(), &equal).refused(&["independent of the others", "equal to", "in every pixel", "--seed"]);
    let own = [copy.to_str().unwrap(), &replicates[1], "--replicates", "--reference", &replicates[0]];
    compare(folder.path(), &own).refused(&["copy.pfm", "equal to the reference in every pixel"]);
}

#[test]
fn replicates_that_share_random_numbers_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let reference = rendered(&folder, "reference.exr", 0.625, 9, 1024);
    let first = rendered(&folder, "first.exr", 0.5, 1, 16);
    let second = rendered(&folder, "second.exr", 0.75, 2, 16);
    let again = rendered(&folder, "again.exr", 0.875, 1, 16);
    let halton = rendered_by(&folder, "halton.exr", 0.25, "halton:best", 1, 16);
    let own = rendered(&folder, "own.exr", 0.25, 9, 1024);
    let all = [&reference, &first, &second, &again, &halton, &own].map(|path| path.to_str().unwrap());
    let [reference, first, second, again, halton, own] = all;
    let run = |images: &[&str]| {
        compare(folder.path(), &[images, &["--replicates", "--reference", reference, "--diff", "d.exr"]].concat())
    };
    // Another version's render of the same numbers is no replicate either, though one image alone may be compared with it.
    run(&[first, second, again]).refused(&["again.exr: ", "the same render as ", "first.exr", "--seed"]);
    run(&[first, second, halton]).refused(&["halton.exr: ", "shares random numbers with ", "scene a01 and seed 1"]);
    run(&[first, own]).refused(&["own.exr: ", "the same render as the reference"]);
    assert!(!folder.path().join("d.exr").exists());
    run(&[first, second]).ends(0, &[]);
}

#[test]
fn a_gate_decides_the_exit_code() {
    let folder = tempfile::tempdir().unwrap();
    let [image, reference, _] = names();
    let gate = |text: &str| compare(folder.path(), &[&image, "--reference", &reference, "--gate", text]);
    assert!(gate("rmse < 5 and bias > -1").ends(0, &[]).stdout.contains("gate  rmse < 5 and bias > -1: holds"));
    let failed =
        gate("rmse < 0.001 and mae < 5 and max_abs<=1").ends(1, &["expected rmse < 0.001", "; expected max_abs <= 1"]);
    assert!(
        failed.stdout.contains("FAILS") && failed.stderr.contains("half-zip.exr") && !failed.stderr.contains("mae")
    );
    gate("rmes < 1").refused(&["--gate: at character 1", "did you mean \"rmse\"?"]);
    gate("mse_unbiased < 1").refused(&["--reference2", "mse_unbiased"]);
    gate("rmse.high < 1").refused(&["--replicates", "rmse.high"]);
    gate("bias2 < 1").refused(&["--replicates"]);
    // Every image is judged.
    let other = data("grey.exr").display().to_string();
    let both = compare(folder.path(), &[&image, &other, "--reference", &reference, "--gate", "mae < 0.2"]);
    let both = both.ends(1, &["grey.exr"]);
    assert!(!both.stderr.contains("half-zip.exr"), "{}", both.stderr);
}

/// Radiance from black to far above white, and how its PNG shows it.
fn waves(phase: f32) -> Image {
    let pixel = |p: usize| {
        let (x, y) = ((p % 24) as f32, (p / 24) as f32);
        [0.0, 1.0, 2.0].map(|c| (1.5 + 2.0 * libm::sinf(0.4 * x + 0.3 * y + c + phase)).max(0.0))
    };
    Image { width: 24, height: 16, pixels: (0..24 * 16).map(pixel).collect() }
}

#[test]
fn flip_of_radiance_is_flip_of_the_pngs_that_show_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    for (name, image) in [("a", waves(0.0)), ("b", waves(0.5))] {
        write_exr(&path(&format!("{name}.exr")), &image, &[]).unwrap();
        for exposure in [3.0, 0.7] {
            write_png(&path(&format!("{name}-{exposure}.png")), &image, exposure).unwrap();
        }
    }
    let flip = |arguments: &[&str]| {
        let found = compare(folder.path(), &[arguments, &["--json"]].concat()).json();
        assert!(found["images"][0]["flip"]["ci95"].is_null());
        let viewing = (&found["viewing"]["pixels_per_degree"], &found["viewing"]["exposure"]);
        assert!(viewing.0.as_f64().is_some() && viewing.1.as_f64().is_some(), "{found}");
        ["flip", "flip_weighted_median"].map(|name| found["images"][0][name]["value"].as_f64().unwrap())
    };
    let radiance = flip(&["a.exr", "--reference", "b.exr"]);
    assert!(radiance[0] > 0.01 && radiance[1] >= radiance[0] && radiance[1] < 1.0, "{radiance:?}");
    let close = |a: [f64; 2], b: [f64; 2]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6);
    assert!(close(radiance, flip(&["a-3.png", "--reference", "b-3.png"])));
    // A PNG is shown as it is, beside radiance too; the order does not matter.
    assert!(close(radiance, flip(&["b-3.png", "--reference", "a.exr"])));
    let darker = flip(&["a.exr", "--reference", "b.exr", "--exposure", "0.7"]);
    assert!(close(darker, flip(&["a-0.7.png", "--reference", "b-0.7.png"])) && !close(darker, radiance));
    // From further away less is seen.
    assert!(flip(&["a.exr", "--reference", "b.exr", "--ppd", "200"])[0] < radiance[0]);
    assert_eq!(flip(&["a.exr", "--reference", "a-3.png"]), [0.0, 0.0]);
    let whole = compare(folder.path(), &["a.exr", "--reference", "b.exr", "--gate", "flip < 0.9"]).ends(0, &[]);
    assert!(
        whole.stdout.contains("67.0206 pixels a degree") && whole.stdout.contains("exposure 3"),
        "{}",
        whole.stdout
    );
    compare(folder.path(), &["a.exr", "--reference", "b.exr", "--gate", "flip < 1e-3"])
        .ends(1, &["expected flip < 1e-3"]);
    compare(folder.path(), &["a.exr", "--reference", "b.exr", "--ppd", "0.5"]).refused(&["--ppd", "1 to 1000"]);
    compare(folder.path(), &["a.exr", "--reference", "b.exr", "--exposure", "0"]).refused(&["--exposure", "above 0"]);
}

#[test]
fn flip_of_replicates_has_an_interval() {
    let folder = tempfile::tempdir().unwrap();
    for (name, phase) in [("a", 0.1), ("b", -0.1), ("c", 0.2), ("r", 0.0)] {
        write_exr(&folder.path().join(format!("{name}.exr")), &waves(phase), &[]).unwrap();
    }
    let arguments =
        ["a.exr", "b.exr", "c.exr", "--replicates", "--reference", "r.exr", "--json", "--gate", "flip.low > 0"];
    let found = compare(folder.path(), &arguments).json();
    let (flip, values) = (&found["replicates"]["flip"], &found["images"]);
    let value = |v: &Value| v["value"].as_f64().unwrap();
    let mean = (0..3).map(|i| value(&values[i]["flip"])).sum::<f64>() / 3.0;
    assert!((value(flip) - mean).abs() < 1e-15);
    assert!(flip["ci95"][0].as_f64().unwrap() < mean && mean < flip["ci95"][1].as_f64().unwrap());
}

#[test]
fn the_difference_is_written_in_each_format() {
    let folder = tempfile::tempdir().unwrap();
    let [image, reference, _] = names();
    let path = |name: &str| folder.path().join(name);
    for name in ["d.exr", "d.pfm", "d.png"] {
        let ran = compare(folder.path(), &[&image, "--reference", &reference, "--diff", name]);
        let parts: &[&str] = if name == "d.png" { &["note: d.png: luminance", "full red at +0."] } else { &[] };
        ran.ends(0, parts);
    }
    let (t, r) = (read("half-zip.exr"), read("reference.exr"));
    let signed: Vec<[f32; 3]> =
        t.pixels.iter().zip(&r.pixels).map(|(t, r)| std::array::from_fn(|c| (t[c] - r[c]) as f32)).collect();
    let (exr, provenance) = read_exr(&path("d.exr")).unwrap();
    assert_eq!(exr.pixels, signed);
    assert!(provenance.contains(&("kind".to_owned(), "difference".to_owned())));
    assert_eq!(read_picture(&path("d.pfm"), None).unwrap().to_image().pixels, signed);
    let map = image::open(path("d.png")).unwrap().to_rgb8();
    assert_eq!(map.dimensions(), (24, 16));
    // The firefly is brighter than the reference: red. Black stays black: white.
    assert_eq!((map.get_pixel(20, 9).0, map.get_pixel(5, 3).0), ([178, 24, 43], [255; 3]));
}

#[test]
fn what_cannot_be_compared_is_refused_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let [image, reference, _] = names();
    let small = folder.path().join("small.pfm");
    write_pfm(&small, &Image::black(3, 2)).unwrap();
    let small = small.to_str().unwrap();
    compare(folder.path(), &[small, "--reference", &reference, "--diff", "d/d.exr"])
        .refused(&["small.pfm: expected the reference's 24×16 pixels, found 3×2"]);
    compare(folder.path(), &[&image, "--reference", "no.exr"]).refused(&["no.exr: ", "No such file"]);
    compare(folder.path(), &[&image, "--reference", &reference, "--diff", "d.jpg"])
        .refused(&["--diff", ".pfm or .png"]);
    compare(folder.path(), &[&image, &image, "--reference", &reference, "--diff", "d.exr"])
        .refused(&["--diff", "2 images"]);
    compare(folder.path(), &["small.pfm", "--reference", small, "--diff", small]).refused(&["--diff", "is compared"]);
    compare(folder.path(), &[&image, "--reference", &reference, "--diff", "small.pfm/d.exr"])
        .ends(3, &["cannot write"]);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}
