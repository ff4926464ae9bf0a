//! `report.html` of a small experiment: what is on its canvases is what the library says of the same images.

use std::path::{Path, PathBuf};

use sampler_lab::experiment::execute::{Options, execute};
use sampler_lab::experiment::lab::Lab;
use sampler_lab::experiment::plan::plan;
use sampler_lab::experiment::progress::Silent;
use sampler_lab::experiment::results::{Row, read, read_image, read_timings, timings_path};
use sampler_lab::experiment::spec::Experiment;
use sampler_lab::film::{Image, screen_light, to_screen};
use sampler_lab::report::page::packed::{from_half, to_half};
use sampler_lab::report::pictures::{error_map, error_scale};
use sampler_lab::report::{Written, write};
use sampler_lab::stats::flip::{DEFAULT_PPD, Seen};
use serde_json::{Value, json};

use crate::accessibility::findings;
use crate::chromium::{Browser, Page};

const SMALL: &str = r#"{
    "name": "small", "seed": 3, "scenes": ["cornell"], "size": "8x8",
    "samplers": ["uniform", "ld:sheet", "ld:best", "halton:plain"], "spp": [1, 8], "replicates": 2,
    "reference": {"sampler": "sobol", "spp": 16},
    "pictures": {"scene": "cornell", "size": "96x64", "spp": [2, 4, 8], "reference_spp": 32}
}"#;
const SIZE: (usize, usize) = (96, 64);

/// A report and what the library knows of its pictures.
struct Reported {
    folder: tempfile::TempDir,
    written: Written,
    /// Labels and images at equal samples, the reference first.
    pictures: Vec<(String, Image)>,
    exposure: f32,
}

impl Reported {
    /// Runs the small experiment; a picture costs its samples per pixel, those of `ld` half of it.
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let place = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/experiments/small.json");
        let value = sampler_lab::scene::json::parse(SMALL.as_bytes(), "small.json").unwrap();
        let experiment = Experiment::from_value(&value, "small.json").unwrap();
        let lab = Lab::new(&place, Default::default());
        let plan = plan(&experiment, &lab).unwrap();
        let options = Options::new(2, "sampler-lab run small.json");
        assert_eq!(execute(&plan, &lab, folder.path(), &Silent, &options).unwrap().failures, []);
        let rows = read(&folder.path().join("results.jsonl")).unwrap();
        let mut timings = read_timings(&timings_path(folder.path())).unwrap();
        for timing in &mut timings {
            if let Some(Row::Image(row)) = rows.iter().find(|row| row.id() == timing.id) {
                let speed = if row.sampler.starts_with("ld") { 2.0 } else { 1.0 };
                timing.seconds = f64::from(row.spp.taken) / speed * row.size.pixels() as f64;
            }
        }
        let lines: Vec<String> = timings.iter().map(|timing| serde_json::to_string(timing).unwrap() + "\n").collect();
        std::fs::write(timings_path(folder.path()), lines.concat()).unwrap();
        let written = write(folder.path()).unwrap();
        assert!(written.check().is_ok(), "{:?}", written.summary.missing);
        let pictures = pictures(folder.path(), &written);
        let exposure = written.summary.pictured[0].exposure;
        Self { folder, written, pictures, exposure }
    }

    fn file(&self) -> PathBuf {
        self.folder.path().join("report.html")
    }

    fn open(&self, browser: &Browser) -> Page {
        let page = browser.page();
        page.set_offline();
        page.open(&format!("file://{}", self.file().display()));
        page.wait_for("document.querySelector('.viewer').dataset.ready === 'yes'");
        page.evaluate("document.querySelector('.viewer').scrollIntoView()");
        page.settle();
        page
    }

    /// A picture on a screen, as bytes.
    fn on_screen(&self, index: usize, exposure: f32) -> Vec<u8> {
        to_screen(&self.pictures[index].1, exposure)
    }
}

fn pictures(dir: &Path, written: &Written) -> Vec<(String, Image)> {
    let summary = &written.summary;
    let set = &summary.pictured[0];
    let [a, b] = set.reference.as_ref().unwrap().halves.clone().unwrap().map(|id| read_image(dir, &id, None).unwrap());
    let mean = |(a, b): (&[f32; 3], &[f32; 3])| [0, 1, 2].map(|c| ((f64::from(a[c]) + f64::from(b[c])) / 2.0) as f32);
    let pixels = std::iter::zip(&a.pixels, &b.pixels).map(mean).collect();
    let mut all = vec![("reference".to_owned(), Image { width: a.width, height: a.height, pixels })];
    for shot in set.at_equal_spp() {
        let image = read_image(dir, &shot.row.id, None).unwrap();
        all.push((summary.samplers[shot.sampler].label.clone(), image));
    }
    all
}

/// The colours of those pixels of the picture that the pane shows whole, as `(number, [r, g, b])`, read from the canvas's middle of
/// each; with outlines off nothing else lies on it.
fn seen(page: &Page, pane: usize) -> Vec<(usize, [u8; 3])> {
    let found = page.evaluate(&format!(
        "(() => {{ const viewer = viewers[0], pane = viewer.panes[{pane}], factor = viewer.factorNow(); \
         const bytes = pane.canvas.getContext('2d').getImageData(0, 0, pane.canvas.width, pane.canvas.height).data; const found = []; \
         for (let y = 0; y < {1}; y++) for (let x = 0; x < {0}; x++) {{ \
           const at = [x, y].map((c, i) => Math.floor(pane.left[i] + (c + 0.5) * factor)); \
           if (at[0] < 0 || at[1] < 0 || at[0] >= pane.canvas.width || at[1] >= pane.canvas.height) continue; \
           const k = 4 * (at[1] * pane.canvas.width + at[0]); found.push([y * {0} + x, bytes[k], bytes[k + 1], bytes[k + 2]]); }} \
         return found; }})()",
        SIZE.0, SIZE.1
    ));
    let number = |value: &Value| value.as_u64().unwrap();
    let pixel = |p: &Value| (number(&p[0]) as usize, [1, 2, 3].map(|c| number(&p[c]) as u8));
    found.as_array().unwrap().iter().map(pixel).collect()
}

/// Mean absolute difference in code values of what is seen from what is expected at the same pixels.
fn distance(seen: &[(usize, [u8; 3])], expected: &[u8]) -> f64 {
    assert!(!seen.is_empty(), "nothing is seen");
    let off = |(at, colour): &(usize, [u8; 3])| -> f64 {
        (0..3).map(|c| f64::from(colour[c].abs_diff(expected[3 * at + c]))).sum()
    };
    seen.iter().map(off).sum::<f64>() / (3 * seen.len()) as f64
}

/// The canvas shows what is expected up to the rounding to half floats, a code value here and there, and nothing like `other`.
#[track_caller]
fn shows(page: &Page, pane: usize, expected: &[u8], other: Option<&[u8]>) {
    let seen = seen(page, pane);
    let near = distance(&seen, expected);
    assert!(near < 0.5, "{near} code values off");
    if let Some(other) = other {
        let far = distance(&seen, other);
        assert!(far > 5.0 * near.max(0.2), "{near} from what it is, {far} from what it is not");
    }
}

fn label(page: &Page, pane: usize) -> String {
    page.evaluate(&format!("viewers[0].panes[{pane}].label.textContent")).as_str().unwrap().to_owned()
}

#[test]
fn the_report_flips_from_disk_without_a_network() {
    let Some(browser) = Browser::start() else { return };
    let report = Reported::new();
    let page = report.open(&browser);
    page.key("o");
    let on_screen: Vec<Vec<u8>> = (0..report.pictures.len()).map(|i| report.on_screen(i, report.exposure)).collect();
    for index in 1..on_screen.len() {
        page.key(&index.to_string());
        shows(&page, 0, &on_screen[index], Some(&on_screen[index % (on_screen.len() - 1) + 1]));
        assert!(
            label(&page, 0).starts_with(&format!("{} · 4 spp · RMSE ", report.pictures[index].0)),
            "{}",
            label(&page, 0)
        );
        page.key_down("Shift");
        shows(&page, 0, &on_screen[0], Some(&on_screen[index]));
        page.key_up("Shift");
        shows(&page, 0, &on_screen[index], Some(&on_screen[0]));
    }
    page.key("ArrowRight");
    shows(&page, 0, &on_screen[0], None);
    page.key("ArrowLeft");
    page.key("ArrowLeft");
    shows(&page, 0, &on_screen[on_screen.len() - 2], None);
    page.key("1");
    page.key("e");
    page.key("e");
    shows(&page, 0, &report.on_screen(1, 2.0 * report.exposure), Some(&on_screen[1]));
    page.key("q");
    page.key("q");
    let requests = page.requests();
    let own = requests.iter().filter(|url| url.starts_with("file://")).count();
    assert!(
        own == 1 && requests.iter().all(|url| ["file:", "data:", "blob:"].iter().any(|s| url.starts_with(s))),
        "{requests:?}"
    );
    assert_eq!(page.errors(), Vec::<String>::new());
    let size = std::fs::metadata(report.file()).unwrap().len();
    assert!(size < 3_000_000, "{size} bytes of a small experiment");
    side_by_side_and_with_a_slider(&page, &on_screen);
    maps(&page, &report);
    in_step(&page, &on_screen);
    values(&page, &report);
    words(&page, &report);
    assert_eq!(page.errors(), Vec::<String>::new());
}

/// Picture 1 and, as the compared one, the reference; then a slider between them, moved by keys and by the mouse.
fn side_by_side_and_with_a_slider(page: &Page, on_screen: &[Vec<u8>]) {
    page.key("v");
    shows(page, 0, &on_screen[1], Some(&on_screen[0]));
    shows(page, 1, &on_screen[0], Some(&on_screen[1]));
    page.key("2");
    page.key("g");
    page.key("1");
    shows(page, 1, &on_screen[2], Some(&on_screen[0]));
    page.key("v");
    let halves = |page: &Page| {
        // The slider's white line, 2 pixels wide, lies on the middle of column 30.
        let columns = seen(page, 0).into_iter().filter(|(at, _)| at % SIZE.0 != 30);
        let (left, right): (Vec<_>, Vec<_>) = columns.partition(|(at, _)| at % SIZE.0 < 30);
        (distance(&left, &on_screen[1]), distance(&right, &on_screen[1]), distance(&right, &on_screen[2]))
    };
    page.evaluate("viewers[0].put({split: 30.5 / 96})");
    let (left, right, other) = halves(page);
    assert!(left < 0.5 && right > 2.0 && other < 0.5, "{left} {right} {other}");
    let text = label(page, 0);
    assert!(text.starts_with("left: ") && text.contains("\nright: "), "{text}");
    let before = page.evaluate("viewers[0].split").as_f64().unwrap();
    page.key(".");
    assert!(page.evaluate("viewers[0].split").as_f64().unwrap() > before);
    let at = page.evaluate("(() => { const b = viewers[0].panes[0].canvas.getBoundingClientRect(); return [b.x, b.y, b.width, b.height, viewers[0].split]; })()");
    let at: Vec<f64> = at.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
    let middle = at[1] + at[3] / 2.0;
    page.drag((at[0] + at[2] * at[4], middle), (at[0] + at[2] * 0.75, middle));
    let split = page.evaluate("viewers[0].split").as_f64().unwrap();
    assert!((split - 0.75).abs() < 0.01, "{split}");
    page.key("v");
    page.evaluate("viewers[0].put({other: 0})");
}

/// The difference is the report's own error map, the FLIP map the library's.
fn maps(page: &Page, report: &Reported) {
    let (reference, test) = (&report.pictures[0].1, &report.pictures[1].1);
    let tests = report.pictures[1..].iter().map(|(_, image)| image);
    let scale = error_scale(tests, reference).unwrap();
    page.key("x");
    let map = error_map(test, reference, scale).unwrap();
    // Half floats move a difference by a 2000th of the radiance, here up to a few code values where that is bright.
    let off = distance(&seen(page, 0), &map.bytes);
    assert!(off < 1.5, "{off}");
    assert!(label(page, 0).contains(" − reference"), "{}", label(page, 0));
    page.key("f");
    let eye =
        |image: &Image| Seen::new(SIZE.0, SIZE.1, DEFAULT_PPD, |at| screen_light(image.pixels[at], report.exposure));
    let expected = eye(reference).differences(&eye(test));
    let found = page.evaluate("[...viewers[0].main().flips]");
    let off = |(i, flip): (usize, &f64)| (found[i].as_f64().unwrap() / 255.0 - flip).abs();
    let worst = expected.iter().enumerate().map(off).fold(0.0, f64::max);
    assert!(worst < 0.501 / 255.0, "{worst}");
    assert!(label(page, 0).starts_with("FLIP map of "), "{}", label(page, 0));
    page.key("p");
}

/// Zoomed and panned by keys, wheel and mouse, both panes show the same part of their pictures.
fn in_step(page: &Page, on_screen: &[Vec<u8>]) {
    page.key("v");
    for key in ["+", "+", "+", "+", "d", "s", "d"] {
        page.key(key);
    }
    let in_both = |page: &Page| {
        let numbers = |pane| seen(page, pane).iter().map(|(at, _)| *at).collect::<Vec<_>>();
        assert_eq!(numbers(0), numbers(1), "another part");
        shows(page, 0, &on_screen[1], Some(&on_screen[0]));
        shows(page, 1, &on_screen[0], Some(&on_screen[1]));
        numbers(0)
    };
    let zoomed = in_both(page);
    assert!(zoomed.len() < SIZE.0 * SIZE.1 / 2 && zoomed[0] > SIZE.0, "{} pixels from {}", zoomed.len(), zoomed[0]);
    page.key("z");
    assert_eq!(seen(page, 1).len(), SIZE.0 * SIZE.1, "all is seen again");
    // The wheel zooms where the mouse is, once the stage has the focus.
    page.evaluate("viewers[0].stage.focus({preventScroll: true})");
    let (x, y) = page.middle(".pane canvas");
    let at = (x + 30.0, y + 10.0);
    page.mouse_move(at);
    let before = page.evaluate("viewers[0].pixel");
    page.wheel(at, -120.0);
    page.wheel(at, -120.0);
    page.mouse_move(at);
    assert_eq!(page.evaluate("viewers[0].pixel"), before, "the pixel under the mouse stays");
    assert!(in_both(page).len() < SIZE.0 * SIZE.1);
    let left = page.evaluate("viewers[0].panes.map(pane => pane.left[0])");
    page.drag(at, (at.0 - 40.0, at.1));
    let moved = page.evaluate("viewers[0].panes.map(pane => pane.left[0])");
    for pane in 0..2 {
        assert_eq!(left[pane].as_f64().unwrap() - moved[pane].as_f64().unwrap(), 40.0, "dragged in step");
    }
    page.key("z");
    page.key("v");
    page.key("v");
}

/// The values of the pixel under the mouse, and of the one that keys move to, are those of the images as half floats.
fn values(page: &Page, report: &Reported) {
    let check = || {
        let pixel = page.evaluate("viewers[0].pixel");
        let at = pixel[1].as_u64().unwrap() as usize * SIZE.0 + pixel[0].as_u64().unwrap() as usize;
        let cells = page.evaluate(
            "[...viewers[0].values.querySelectorAll('td')].map(td => Number(td.textContent.replace('−', '-')))",
        );
        let place = page.evaluate("viewers[0].values.querySelector('.place').textContent");
        assert!(place.as_str().unwrap().starts_with(&format!("Pixel ({}, {})", pixel[0], pixel[1])), "{place}");
        for c in 0..3 {
            let half = |index: usize| f64::from(from_half(to_half(report.pictures[index].1.pixels[at][c])));
            for (row, expected) in [half(1), half(0), half(1) - half(0)].into_iter().enumerate() {
                let found = cells[3 * row + c].as_f64().unwrap();
                // Four digits are shown.
                assert!((found - expected).abs() <= 5.01e-4 * expected.abs(), "row {row}: {found} for {expected}");
            }
        }
        at
    };
    page.mouse_move(page.middle(".pane canvas"));
    let at = check();
    page.key("l");
    page.key("k");
    assert_eq!(check(), at + SIZE.0 + 1, "one to the right, one down");
}

/// What the page says of its details, and the pictures at equal time.
fn words(page: &Page, report: &Reported) {
    let scene = "cornell";
    let details = &report.written.figures.details[scene];
    let said =
        |page: &Page| page.evaluate("[...document.querySelectorAll('.crops figcaption')].map(c => c.textContent)");
    page.key("1");
    let captions = said(page);
    assert_eq!(captions.as_array().unwrap().len(), details.len());
    for (i, name) in details.iter().enumerate() {
        let caption = captions[i].as_str().unwrap();
        let start = format!("{name}\n{}: RMSE ", report.pictures[1].0);
        assert!(caption.starts_with(&start) && caption.ends_with("]\nreference"), "{caption}");
    }
    // Halton's points are the same in every pixel.
    page.key("4");
    assert!(said(page)[0].as_str().unwrap().ends_with("(no interval)\nreference"), "{}", said(page));
    page.key("c");
    assert!(page.evaluate("viewers[0].zoom").as_u64().unwrap() > 1, "zoomed to the first detail");
    page.key("z");
    page.key("3");
    page.key("t");
    // A picture of ld costs half of uniform's at the same count.
    assert!(label(page, 0).starts_with("ld:best · 8 spp in "), "{}", label(page, 0));
    page.key("t");
    assert!(label(page, 0).starts_with("ld:best · 4 spp · "), "{}", label(page, 0));
}

#[test]
fn the_report_serves_keyboards_narrow_windows_and_both_colours() {
    let Some(browser) = Browser::start() else { return };
    let report = Reported::new();
    let page = report.open(&browser);
    for (width, layout) in [(1000, "one"), (400, "one"), (400, "beside"), (400, "slider"), (320, "one")] {
        page.resize(width, 700);
        page.evaluate(&format!("viewers[0].put({{layout: '{layout}', pixel: [3, 3]}})"));
        page.settle();
        let wide = page.evaluate("document.documentElement.scrollWidth").as_u64().unwrap();
        assert!(wide <= u64::from(width), "{layout} in {width} pixels is {wide} wide");
    }
    for (scheme, paper) in [("light", "rgb(255, 255, 255)"), ("dark", "rgb(20, 22, 26)")] {
        page.prefer(scheme);
        for width in [1000, 400] {
            page.resize(width, 800);
            page.settle();
            assert_eq!(page.evaluate("getComputedStyle(document.body).backgroundColor"), paper);
            assert_eq!(findings(&page), Vec::<String>::new(), "{scheme}, {width} pixels wide");
        }
    }
    page.evaluate("document.querySelector('#theme select').focus()");
    page.evaluate("(() => { const s = document.querySelector('#theme select'); s.value = 'light'; s.dispatchEvent(new Event('change')); })()");
    assert_eq!(
        page.evaluate("getComputedStyle(document.body).backgroundColor"),
        "rgb(255, 255, 255)",
        "chosen against the system"
    );
    by_keys_alone(&page);
    assert_eq!(page.errors(), Vec::<String>::new());
}

/// From the top of the page with nothing but Tab and Enter to a picture's button and on to the stage.
fn by_keys_alone(page: &Page) {
    page.evaluate("(() => { document.activeElement.blur(); scrollTo(0, 0); viewers[0].put({layout: 'one'}); })()");
    page.evaluate("document.querySelector('.skip').focus()");
    let until = |wanted: &str| {
        for _ in 0..400 {
            if page.evaluate(&format!("document.activeElement.matches({})", json!(wanted))) == Value::Bool(true) {
                return;
            }
            page.key("Tab");
        }
        panic!("Tab does not reach {wanted}");
    };
    until(".viewer [data-index='2']");
    page.key("Enter");
    assert!(label(page, 0).starts_with("ld:sheet"), "{}", label(page, 0));
    assert_eq!(page.evaluate("document.activeElement.getAttribute('aria-pressed')"), "true");
    until(".viewer [data-value='flip']");
    page.key("Enter");
    assert!(label(page, 0).starts_with("FLIP map of ld:sheet"), "{}", label(page, 0));
    until(".stage");
    page.key("p");
    page.key("ArrowRight");
    assert!(label(page, 0).starts_with("ld:best"), "{}", label(page, 0));
    let said = page.evaluate("document.querySelector('[aria-live]').textContent");
    assert!(said.as_str().unwrap().starts_with("ld:best"), "{said}");
}
