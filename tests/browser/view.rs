//! The live view in a browser: what its canvases show is what the library renders, whatever way it came about.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

use sampler_lab::film::to_screen;
use sampler_lab::render::render;
use sampler_lab::sampling::{Preset, Sampler, SamplerSet};
use sampler_lab::scene::compile::{Scene, Stage};
use sampler_lab::scene::config::SceneConfig;
use sampler_lab::scene::load;
use sampler_lab::view::{Options, Server};
use serde_json::{Value, json};

use crate::accessibility::findings;
use crate::chromium::{Browser, Page};

/// A server of a small picture, and what ends it.
struct Serving {
    address: String,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Serving {
    fn new(scene: &str, sets: &[&str]) -> Self {
        let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs").join(scene);
        let sets = sets.iter().map(|s| (*s).to_owned()).collect();
        let server = Server::bind(&Options { scene: Some(scene), sets, ..Options::default() }).unwrap();
        let (address, stop) = (server.address(), Arc::new(AtomicBool::new(false)));
        let told = stop.clone();
        let thread = Some(std::thread::spawn(move || server.serve(&told).unwrap()));
        Self { address, stop, thread }
    }
}

impl Drop for Serving {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        let ended = self.thread.take().unwrap().join();
        assert!(ended.is_ok() || std::thread::panicking());
    }
}

const SIZE: (u32, u32) = (96, 64);

fn small() -> Serving {
    Serving::new("a01.json", &["framebuffer.res_w=96", "framebuffer.res_h=64", "framebuffer.sppx=4"])
}

/// Waits for the picture of the document that the page has now, with all its samples.
fn finished(page: &Page) {
    page.settle();
    // In one look: no change is on the way, and what is shown is of the page's document, and of the picture that is said to be finished,
    // with all its samples.
    page.wait_for(
        "(({ asked, answered, connected, state, shown, version, epoch, stateEpoch }) => connected === 'yes' && asked === answered \
         && /finished|reference/.test(state) && shown === version && epoch === stateEpoch)(document.body?.dataset ?? {}) \
         && / (\\d+) of \\1 spp$/.test(document.querySelector('#caption-a').textContent)",
    );
}

/// RGB of what a canvas shows.
fn shown(page: &Page, canvas: &str) -> Vec<u8> {
    let script = format!(
        "(() => {{ const c = document.querySelector({}); \
         return Array.from(c.getContext('2d').getImageData(0, 0, c.width, c.height).data); }})()",
        json!(canvas)
    );
    let rgba = page.evaluate(&script);
    let rgba: Vec<u8> = rgba.as_array().unwrap().iter().map(|v| v.as_u64().unwrap() as u8).collect();
    rgba.chunks(4).flat_map(|p| [p[0], p[1], p[2]]).collect()
}

fn document(page: &Page) -> Value {
    serde_json::from_str(page.evaluate("document.body.dataset.document").as_str().unwrap()).unwrap()
}

/// What the library makes of the page's document.
fn rendered(page: &Page) -> Vec<u8> {
    let config = SceneConfig::parse(document(page).to_string().as_bytes(), "page", &[]).unwrap();
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("data");
    let limits = load::Limits { triangles: 1 << 20, texels: 1 << 24 };
    let loaded = load::open_within(config, "page", &[data], limits).unwrap();
    let scene = Scene::new(&loaded.config, loaded.mesh.clone(), SIZE, Stage::Final).unwrap();
    let set = SamplerSet::parse(loaded.config.sampler.as_deref().unwrap(), Preset::Best).unwrap();
    let asked = loaded.config.framebuffer.sppx;
    let sampler = Sampler::new(set, &scene.layout, asked, loaded.config.seed.unwrap()).unwrap();
    to_screen(&render(&scene, &sampler).unwrap().image, loaded.config.framebuffer.exposure)
}

/// Chooses in a list by the name that assistive technology reads.
fn choose(page: &Page, label: &str, value: &str) {
    page.evaluate(&format!(
        "(() => {{ const s = [...document.querySelectorAll('select')].find(s => s.ariaLabel === {0} || s.labels[0]?.textContent === {0}); \
         s.value = {1}; s.dispatchEvent(new Event('change')); }})()",
        json!(label),
        json!(value)
    ));
}

/// Drops a text as a file.
fn drop_file(page: &Page, name: &str, text: &str) {
    page.evaluate(&format!(
        "(() => {{ const t = new DataTransfer(); t.items.add(new File([{}], {})); \
         window.dispatchEvent(new DragEvent('drop', {{ dataTransfer: t, bubbles: true, cancelable: true }})); }})()",
        json!(text),
        json!(name)
    ));
}

#[test]
fn the_page_shows_what_render_makes_of_its_document_however_it_is_driven() {
    let Some(browser) = Browser::start() else { return };
    let serving = small();
    let page = browser.page();
    page.open(&serving.address);
    finished(&page);
    assert!(shown(&page, "#screen-a") == rendered(&page), "as loaded");
    // Keys, without a click first; the last place counts.
    let before = document(&page);
    for key in ["w", "a", "r"] {
        page.key_down(key);
        std::thread::sleep(std::time::Duration::from_millis(120));
        page.key_up(key);
    }
    page.wait_for(&format!("document.body.dataset.document !== {}", json!(before.to_string())));
    let at = page.middle("#screen-a");
    page.drag(at, (at.0 + 60.0, at.1 + 20.0));
    finished(&page);
    let after = document(&page);
    assert!(after["camera"]["pos"] != before["camera"]["pos"] && after["camera"]["dir"] != before["camera"]["dir"]);
    assert!(shown(&page, "#screen-a") == rendered(&page), "after moving");
    // The sampler of one decision.
    choose(&page, "lens: sampler", "ld:sheet");
    page.wait_for("document.querySelector('#caption-a').textContent.includes('lens=ld:sheet')");
    finished(&page);
    assert_eq!(document(&page)["sampler"].as_str().unwrap().matches("ld:sheet").count(), 1);
    assert!(shown(&page, "#screen-a") == rendered(&page), "another sampler");
    // What a click finds, and the points there.
    page.click(page.middle("#screen-a"), "right");
    page.wait_for("/Distance [\\d.]+, depth [\\d.]+: \\w+/.test(document.querySelector('#picked').textContent)");
    page.key("p");
    page.wait_for("document.querySelector('#points-out').textContent.includes('star discrepancy D*')");
    // Escape stops, space goes on.
    page.key("Escape");
    page.wait_for("document.body.dataset.state === 'stopped'");
    page.key(" ");
    finished(&page);
    page.evaluate("document.querySelector('#reset').click()");
    page.wait_for(&format!("document.body.dataset.document === {}", json!(before.to_string())));
    assert_eq!(page.errors(), Vec::<String>::new());
    let elsewhere = page.requests().into_iter().filter(|url| !url.contains("127.0.0.1") && !url.starts_with("data:"));
    assert_eq!(elsewhere.count(), 0, "nothing comes from elsewhere");
}

#[test]
fn a_downloaded_config_that_is_dropped_again_is_the_same_picture() {
    let Some(browser) = Browser::start() else { return };
    let serving = small();
    let page = browser.page();
    page.open(&serving.address);
    finished(&page);
    page.evaluate("window.saved = []; const make = URL.createObjectURL; URL.createObjectURL = b => { window.saved.push(b); return make.call(URL, b); }; 0");
    choose(&page, "All: sampler", "halton:step:none");
    page.wait_for("document.querySelector('#caption-a').textContent.startsWith('halton:step:none')");
    page.evaluate("(() => { const i = [...document.querySelectorAll('input')].find(i => i.labels[0]?.textContent === 'Exposure'); i.value = 6; i.onchange(); })()");
    page.wait_for("JSON.parse(document.body.dataset.document).framebuffer.exposure === 6");
    finished(&page);
    let picture = shown(&page, "#screen-a");
    assert!(picture == rendered(&page));
    let download = |button: &str| {
        page.evaluate(&format!("window.saved.length = 0; document.querySelector({}).click()", json!(button)));
        page.wait_for("window.saved.length === 1");
        page.evaluate("window.saved[0].text()").as_str().unwrap().to_owned()
    };
    let text = download("#download-json");
    page.evaluate("document.querySelector('#reset').click()");
    page.wait_for("JSON.parse(document.body.dataset.document).framebuffer.exposure === 3");
    finished(&page);
    assert!(shown(&page, "#screen-a") != picture);
    drop_file(&page, "again.json", &text);
    page.wait_for("document.title.startsWith('again.json')");
    finished(&page);
    assert!(shown(&page, "#screen-a") == picture, "the same picture");
    assert_eq!(download("#download-json"), text, "the same bytes");
    // A broken one is refused in words, and changes nothing.
    drop_file(&page, "broken.json", "{\"camera\": {\"fvo\": 3}}");
    page.wait_for("document.querySelector('#message').textContent.includes('did you mean \"fov\"')");
    assert!(shown(&page, "#screen-a") == picture);
    drop_file(&page, "mine.csv", "0.25,0.75\n0.5,0.5\n");
    page.wait_for("document.querySelector('#points-out').textContent.includes('mine.csv')");
    assert_eq!(page.errors(), Vec::<String>::new());
}

#[test]
fn two_samplers_are_compared_and_flipped_and_the_page_fits_a_narrow_dark_window() {
    let Some(browser) = Browser::start() else { return };
    let serving = small();
    let page = browser.page();
    page.open(&serving.address);
    finished(&page);
    page.evaluate("(() => { document.querySelector('#compare-other').value = 'ld:sheet'; const on = document.querySelector('#compare-on'); on.checked = true; on.onchange(); })()");
    page.wait_for("/^ld:sheet .* 4 of 4 spp$/.test(document.querySelector('#caption-b').textContent)");
    finished(&page);
    let [a, b] = ["#screen-a", "#screen-b"].map(|canvas| shown(&page, canvas));
    assert!(a == rendered(&page) && a != b);
    let visible = |panel: &str| page.evaluate(&format!("document.querySelector('.panel-{panel}').checkVisibility()"));
    assert_eq!((visible("a"), visible("b")), (json!(true), json!(true)));
    choose(&page, "Show", "flip");
    assert_eq!((visible("a"), visible("b")), (json!(true), json!(false)));
    page.key("x");
    assert_eq!((visible("a"), visible("b")), (json!(false), json!(true)));
    page.key("x");
    // Errors come with the reference; a map of them is blue, white and red.
    page.wait_for("/RMSE against reference\\s*[\\d.]+/.test(document.querySelector('#numbers').textContent)");
    page.key("3");
    page.wait_for("document.querySelector('#caption-a').textContent.includes('signed error')");
    let map = shown(&page, "#screen-a");
    let count = |f: &dyn Fn(&[u8]) -> bool| map.chunks(3).filter(|p| f(p)).count();
    assert!(count(&|p| p[0] > p[2]) > 20 && count(&|p| p[2] > p[0]) > 20, "brighter and darker pixels");
    page.key("1");
    for (width, scheme) in [(1000, "light"), (400, "dark")] {
        page.prefer(scheme);
        page.resize(width, 700);
        for panel in 0..9 {
            page.evaluate(&format!(
                "document.querySelectorAll('nav details').forEach((d, i) => d.open = i === {panel})"
            ));
            page.settle();
            let overflow = page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth");
            assert_eq!(overflow, 0, "panel {panel} at {width} pixels");
            assert_eq!(findings(&page), Vec::<String>::new(), "panel {panel} at {width} pixels");
        }
    }
    assert_eq!(page.errors(), Vec::<String>::new());
}

#[test]
fn a_page_of_another_site_is_not_let_in() {
    let Some(browser) = Browser::start() else { return };
    let serving = small();
    let page = browser.page();
    page.open("data:text/html,<title>elsewhere</title>");
    let live = serving.address.replacen("http", "ws", 1).replace("/?", "/live?");
    let tried = page.evaluate(&format!(
        "new Promise(done => {{ const s = new WebSocket({}); s.onopen = () => done('let in'); s.onerror = () => done('refused'); }})",
        json!(live)
    ));
    assert_eq!(tried, "refused");
    let read = page.evaluate(&format!(
        "fetch({}).then(r => r.text()).then(() => 'read', () => 'refused')",
        json!(serving.address)
    ));
    assert_eq!(read, "refused");
}
