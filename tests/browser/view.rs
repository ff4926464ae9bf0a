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
    // By keys: the ring moves, and the points are those of its pixel.
    let ringed = || page.evaluate("document.querySelector('#pixel-place').textContent");
    let before_step = ringed();
    page.key("l");
    page.key("k");
    page.wait_for(&format!("document.querySelector('#pixel-place').textContent !== {before_step}"));
    page.wait_for("document.querySelector('.panel-a .mark').checkVisibility()");
    page.key("p");
    page.wait_for("document.querySelector('#points-out').textContent.includes(`Pixel ${document.querySelector('#pixel-place').textContent}`)");
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
    // One that the program would not take is not even sent.
    page.evaluate(
        "(() => { const t = new DataTransfer(); t.items.add(new File([new Uint8Array(65 << 20)], 'huge.obj')); \
         window.dispatchEvent(new DragEvent('drop', { dataTransfer: t, bubbles: true, cancelable: true })); })()",
    );
    page.wait_for(
        "document.querySelector('#message').textContent.includes('huge.obj: expected at most 67108864 bytes')",
    );
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
    // All of it is in the document, and comes back with it.
    page.evaluate("window.saved = []; const make = URL.createObjectURL; URL.createObjectURL = b => { window.saved.push(b); return make.call(URL, b); }; 0");
    page.evaluate("(() => { const s = document.querySelector('#compare-seconds'); document.querySelector('#compare-by').value = 'seconds'; s.value = 0.5; s.onchange(); })()");
    page.evaluate("document.querySelector('#refine').click()");
    page.wheel(page.middle("#screen-a"), -100.0);
    let speed = page.evaluate("Number(document.querySelector('#speed').textContent)");
    page.wait_for(
        "(v => v.seconds === 0.5 && !v.refine && v.speed !== null)(JSON.parse(document.body.dataset.document).view)",
    );
    let view = document(&page)["view"].clone();
    assert_eq!(
        view,
        json!({"second": "ld:sheet", "seconds": 0.5, "show": "flip", "look": "error", "refine": false, "speed": speed})
    );
    page.evaluate("document.querySelector('#download-json').click()");
    page.wait_for("window.saved.length === 1");
    let text = page.evaluate("window.saved[0].text()").as_str().unwrap().to_owned();
    page.evaluate("document.querySelector('#reset').click()");
    page.wait_for("!document.querySelector('#compare-on').checked && document.querySelector('#refine').checked");
    assert_eq!(page.evaluate("document.querySelector('#views input:checked').value"), "image");
    drop_file(&page, "again.json", &text);
    page.wait_for("document.title.startsWith('again.json')");
    assert_eq!(document(&page)["view"], view);
    let shown_again = page.evaluate(
        "['#compare-other', '#compare-by', '#compare-seconds', '#compare-how', '#views input:checked'].map(s => document.querySelector(s).value)",
    );
    assert_eq!(shown_again, json!(["ld:sheet", "seconds", "0.5", "flip", "error"]));
    // What is refused is marked where it was typed, and all else shows what is.
    page.evaluate("(() => { const o = document.querySelector('#compare-other'); o.closest('details').open = true; o.focus(); o.value = 'nonsense'; o.onchange(); })()");
    page.wait_for(
        "document.querySelector('#compare-other').ariaInvalid === 'true' && !document.querySelector('#message').hidden",
    );
    page.evaluate("document.querySelector('#compare-other').blur()");
    page.wait_for("document.querySelector('#compare-other').value === 'ld:sheet' && document.querySelector('#compare-other').ariaInvalid !== 'true'");
    page.evaluate("document.querySelector('#message button').click()");
    page.key("1");
    // By keys alone: a panel opens, its first control is next, and Escape leads back.
    page.evaluate("(document.querySelectorAll('nav details').forEach(d => d.open = false), document.querySelector('nav summary').focus())");
    page.key("Enter");
    page.wait_for("document.querySelector('nav details').open");
    page.key("Tab");
    assert_eq!(page.evaluate("document.activeElement.closest('.panel').id"), "camera-panel");
    page.key("Escape");
    page.wait_for("!document.querySelector('nav details').open && document.activeElement.matches('summary')");
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

/// All controls of the document (of the materials those of the first), and a change of the one at an index: its name, or null where it already is so.
const CONTROLS: &str = r##"
  window.every = () => [...document.querySelectorAll(".panel input, .panel select, #views input, #refine")].filter((c) =>
    !c.disabled && !c.closest("#keys-panel, #configs-panel") && c.ariaLabel !== "Usual sizes"
    && (!c.closest("#materials-panel") || c.closest("fieldset") === document.querySelector("#materials-panel fieldset")));
  window.nameOf = (c) => `${c.closest("fieldset")?.querySelector("legend")?.textContent ?? ""} ${c.ariaLabel || c.labels[0]?.textContent || c.id} (${c.type})`.trim();
  window.turn = (i) => {
    const c = every()[i];
    if (!c) return "none left";
    const name = nameOf(c);
    const fire = (...events) => events.forEach((event) => c.dispatchEvent(new Event(event, { bubbles: true })));
    if (c.type === "radio" && c.checked) return null;
    if (c.type === "checkbox" || c.type === "radio") c.click();
    else if (c.tagName === "SELECT") {
      c.value = [...c.options].find((o) => o.value && o.value !== c.value).value;
      fire("change");
    } else {
      const number = c.step === "1" ? Number(c.value) + 1 : Number((Number(c.value) * 0.9 + 0.01).toPrecision(4));
      c.value = { range: (Number(c.min) + Number(c.max)) / 2.1, color: "#336699", text: c.id === "seed" ? "77" : "ld:sheet" }[c.type] ?? number;
      fire("input", "change");
    }
    return name;
  };
"##;

#[test]
fn a_change_of_any_control_is_in_the_document_and_comes_back_with_it() {
    let Some(browser) = Browser::start() else { return };
    let serving = small();
    let page = browser.page();
    page.open(&serving.address);
    finished(&page);
    page.evaluate(&format!("{CONTROLS}; 0"));
    let mut changed = Vec::new();
    for i in 0.. {
        let before = page.evaluate("document.body.dataset.document");
        let name = page.evaluate(&format!("turn({i})"));
        if name == "none left" {
            break;
        }
        let Some(name) = name.as_str() else { continue };
        page.wait_for(&format!(
            "document.body.dataset.document !== {before} || !document.querySelector('#message').hidden"
        ));
        let said = page.evaluate(
            "document.querySelector('#message').hidden ? '' : document.querySelector('#message').textContent",
        );
        assert_eq!(said, "", "{name}: refused");
        if name.contains("(range)") || name.contains("(color)") {
            // One that moves says more than once what it comes to.
            page.wait_for("document.body.dataset.asked === document.body.dataset.answered");
        }
        changed.push(name.to_owned());
    }
    let has = |part: &str| changed.iter().any(|name| name.contains(part));
    for part in [
        "Position x",
        "Field of view",
        "Auto focus",
        "Focal depth",
        "Power",
        "Off: light",
        "Albedo",
        "Exposure",
        "Width",
        "lens: points",
        "Seed",
        "Estimator",
        "Sampler of B",
        "Seconds",
        "Show",
        "Variance",
        "refine",
    ] {
        assert!(has(part), "{part} is none of {changed:?}");
    }
    assert!(changed.len() > 50, "{changed:?}");
    let values = "every().map((c) => `${nameOf(c)}: ${['checkbox', 'radio'].includes(c.type) ? c.checked : c.value}`)";
    let (whole, shown) = (document(&page), page.evaluate(values));
    drop_file(&page, "plain.json", &json!({"framebuffer": {"res_w": 32, "res_h": 24, "sppx": 1}, "scene": {"mesh_files": ["checkerpots/checkerpots.obj"]}, "view": {}}).to_string());
    page.wait_for("document.title.startsWith('plain.json')");
    assert!(document(&page) != whole && page.evaluate(values) != shown);
    drop_file(&page, "again.json", &whole.to_string());
    page.wait_for("document.title.startsWith('again.json')");
    assert_eq!(document(&page), whole);
    assert_eq!(page.evaluate(values), shown);
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
