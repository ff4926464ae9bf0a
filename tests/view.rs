//! The live view as its page meets it: what it lets in, what it answers, and that nothing brings it down.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use sampler_lab::film::read_exr;
use sampler_lab::render::{Growing, render};
use sampler_lab::sampling::{PointSource, Preset, Sampler, SamplerSet};
use sampler_lab::scene::compile::{Scene, Stage, Tree};
use sampler_lab::scene::load::{self, OpenOptions};
use sampler_lab::view::{MAX_TABS, MAX_UPLOAD_BYTES, MAX_UPLOAD_FILES, MAX_VIEW_PIXELS, Options, Server};
use serde_json::{Value, json};
use tungstenite::client::IntoClientRequest;
use tungstenite::protocol::WebSocketConfig;
use tungstenite::{Message, WebSocket};

/// How long anything may take before a test gives up: many times what it takes on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

fn config(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("configs").join(name)
}

/// A server on a port of its own.
struct Running {
    address: String,
    port: u16,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

fn start(scene: &str, sets: &[&str], data: &[&Path]) -> Running {
    let options = Options {
        scene: Some(config(scene)),
        data: data.iter().map(|d| d.to_path_buf()).collect(),
        sets: sets.iter().map(|s| (*s).to_owned()).collect(),
        port: 0,
    };
    let server = Server::bind(&options).unwrap();
    let (address, port, stop) = (server.address(), server.port(), Arc::new(AtomicBool::new(false)));
    let told = stop.clone();
    let thread = std::thread::spawn(move || server.serve(&told).unwrap());
    Running { address, port, stop, thread: Some(thread) }
}

/// A small picture that is soon done.
fn small() -> Running {
    start("cornell.json", &["framebuffer.res_w=32", "framebuffer.res_h=24", "framebuffer.sppx=4"], &[])
}

impl Drop for Running {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        let ended = self.thread.take().unwrap().join();
        assert!(ended.is_ok() || std::thread::panicking(), "the server stays up");
    }
}

impl Running {
    fn token(&self) -> &str {
        self.address.split_once("token=").unwrap().1
    }

    /// What a plain request is answered with.
    fn ask(&self, request: &str) -> String {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        stream.write_all(request.as_bytes()).unwrap();
        let mut answer = String::new();
        let _ = stream.read_to_string(&mut answer);
        answer
    }

    fn tab(&self) -> Tab {
        let mut tab = self.socket();
        tab.until("hello");
        tab
    }

    /// A tab that has heard nothing yet.
    fn socket(&self) -> Tab {
        let stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let host = format!("127.0.0.1:{}", self.port);
        let mut request = format!("ws://{host}/live?token={}", self.token()).into_client_request().unwrap();
        request.headers_mut().insert("Origin", format!("http://{host}").parse().unwrap());
        let config = WebSocketConfig::default().max_message_size(None).max_frame_size(None);
        let (socket, _) = tungstenite::client::client_with_config(request, stream, Some(config)).unwrap();
        Tab { socket, acknowledges: true }
    }
}

/// One tab of a browser.
struct Tab {
    socket: WebSocket<TcpStream>,
    acknowledges: bool,
}

impl Tab {
    fn say(&mut self, value: &Value) {
        self.socket.send(Message::text(value.to_string())).unwrap();
    }

    fn set(&mut self, sets: &[&str]) {
        self.say(&json!({"ask": "set", "sets": sets}));
    }

    /// The next message, and its bytes where it has any.
    fn next(&mut self) -> (Value, Vec<u8>) {
        loop {
            match self.socket.read().unwrap() {
                Message::Text(text) => return (serde_json::from_str(text.as_str()).unwrap(), Vec::new()),
                Message::Binary(bytes) => {
                    let length = u32::from_le_bytes(bytes[..4].try_into().unwrap()) as usize;
                    let header: Value = serde_json::from_slice(&bytes[4..4 + length]).unwrap();
                    if header["is"] == "frame" && self.acknowledges {
                        let shown = json!({"ask": "shown", "frame": header["frame"]});
                        self.say(&shown);
                    }
                    return (header, bytes[4 + length..].to_vec());
                }
                _ => {}
            }
        }
    }

    /// Reads on to a message that `wanted` takes.
    fn find(&mut self, what: &str, mut wanted: impl FnMut(&Value) -> bool) -> (Value, Vec<u8>) {
        let started = Instant::now();
        let mut seen = Vec::new();
        while started.elapsed() < PATIENCE {
            let (message, bytes) = self.next();
            if wanted(&message) {
                return (message, bytes);
            }
            if message["is"] != "frame" {
                seen.push(message.to_string());
            }
        }
        panic!("expected {what}, found {seen:#?}");
    }

    fn until(&mut self, kind: &str) -> (Value, Vec<u8>) {
        self.find(kind, |message| message["is"] == kind)
    }

    /// The error that a request is answered with.
    fn error(&mut self, request: &Value) -> String {
        self.say(request);
        self.until("error").0["text"].as_str().unwrap().to_owned()
    }

    /// The frame of a picture with all its samples.
    fn finished(&mut self) -> (Value, Vec<u8>) {
        self.find("a finished frame", |m| {
            m["is"] == "frame"
                && m["panels"].as_array().unwrap().iter().all(|p| p["samples"] == p["of"] && p["timing"] == false)
        })
    }

    fn download(&mut self, what: &str) -> Vec<u8> {
        self.say(&json!({"ask": "download", "what": what}));
        self.until("file").1
    }

    fn upload(&mut self, drop: u64, name: &str, last: bool, bytes: &[u8]) {
        let header = json!({"upload": drop, "name": name, "last": last}).to_string();
        let mut message = (header.len() as u32).to_le_bytes().to_vec();
        message.extend(header.as_bytes());
        message.extend(bytes);
        self.socket.send(Message::binary(message)).unwrap();
    }
}

#[test]
fn only_its_own_page_with_the_token_is_let_in() {
    let server = small();
    let (port, token) = (server.port, server.token().to_owned());
    let get = |path: &str, host: &str, more: &str| format!("GET {path} HTTP/1.1\r\nHost: {host}\r\n{more}\r\n");
    let here = format!("127.0.0.1:{port}");
    let socket = |origin: &str| {
        format!(
            "{origin}Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n\
             Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
        )
    };
    let own = socket(&format!("Origin: http://{here}\r\n"));
    let page = server.ask(&get(&format!("/?token={token}"), &here, ""));
    assert!(page.starts_with("HTTP/1.1 200 ") && page.contains("<title>sampler-lab"), "{page}");
    assert!(page.contains("Content-Security-Policy: default-src 'none'"), "{page}");
    // A tunnel may end at another port and be called localhost.
    for host in ["localhost:9000", "127.0.0.1:1", "localhost"] {
        assert!(server.ask(&get(&format!("/?token={token}"), host, "")).starts_with("HTTP/1.1 200 "), "{host}");
    }
    let live = format!("/live?token={token}");
    let wrong = format!("/live?token={}", "0".repeat(32));
    for (what, request) in [
        ("page without token", get("/", &here, "")),
        ("page with another token", get(&format!("/?token={}", "0".repeat(32)), &here, "")),
        ("name of another site that leads here", get(&format!("/?token={token}"), "evil.example:80", "")),
        ("no host", format!("GET /?token={token} HTTP/1.1\r\n\r\n")),
        ("socket without origin", get(&live, &here, &socket(""))),
        ("socket of another site", get(&live, &here, &socket("Origin: https://evil.example\r\n"))),
        ("socket of a file", get(&live, &here, &socket("Origin: null\r\n"))),
        ("socket of another port", get(&live, &here, &socket("Origin: http://127.0.0.1:1\r\n"))),
        ("socket with two origins", get(&live, &here, &format!("Origin: http://evil\r\n{own}"))),
        ("socket without token", get("/live", &here, &own)),
        ("socket with another token", get(&wrong, &here, &own)),
        ("socket under another name", get(&live, "evil.example", &socket("Origin: http://evil.example\r\n"))),
    ] {
        let answer = server.ask(&request);
        assert!(answer.starts_with("HTTP/1.1 403 "), "{what}: {answer}");
    }
    for (status, request) in [
        ("404", get("/../Cargo.toml", &here, "")),
        ("404", get("/%2e%2e/etc/passwd", &here, "")),
        ("405", format!("POST /?token={token} HTTP/1.1\r\nHost: {here}\r\nContent-Length: 2\r\n\r\nhi")),
        ("426", get(&live, &here, "")),
        ("400", "nonsense\r\n\r\n".to_owned()),
        ("400", "\u{0}\u{1}\r\n\r\n".to_owned()),
        ("431", get(&"a".repeat(20_000), &here, "")),
        ("101", get(&live, &here, &own)),
    ] {
        // The last one is let in, and its client goes away without a word.
        let mut stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
        stream.write_all(request.as_bytes()).unwrap();
        let mut start = [0u8; 12];
        stream.read_exact(&mut start).unwrap();
        assert_eq!(&start[9..], status.as_bytes(), "{}", &request[..request.len().min(80)]);
    }
    server.tab().finished();
}

#[test]
fn a_picture_that_grows_ends_with_the_bits_of_render() {
    let open = |sets: &[&str]| {
        let sets = sets.iter().map(|s| (*s).to_owned()).collect();
        load::open(&config("a01.json"), &OpenOptions { data: Vec::new(), sets }).unwrap()
    };
    let size = (29, 19);
    let loaded = open(&[]);
    let scene = Scene::new(&loaded.config, loaded.mesh.clone(), size, Stage::Final).unwrap();
    for (text, asked) in [("sobol", 9), ("stratified", 7), ("halton:sheet", 1), ("hammersley", 20), ("uniform", 33)] {
        let set = SamplerSet::parse(text, Preset::Best).unwrap();
        let sampler = Sampler::new(set, &scene.layout, asked, 5).unwrap();
        let whole = render(&scene, &sampler).unwrap();
        let mut growing = Growing::new(size);
        // Also in memory that another picture has left.
        for blocks in [&[8, 4, 2, 1][..], &[16, 1], &[1]] {
            growing.clear(size);
            assert_eq!(growing.block(), None);
            for &block in blocks {
                assert!(growing.begin(&scene, &sampler, block, &|| true).unwrap().is_whole);
                assert_eq!(growing.block(), Some(block));
            }
            for to in [2, 3, 17, sampler.samples()] {
                if to > growing.samples() && to <= sampler.samples() {
                    growing.add(&scene, &sampler, to, &|| true).unwrap();
                }
            }
            assert_eq!(
                (growing.image(), growing.samples()),
                (whole.image.clone(), sampler.samples()),
                "{text} {blocks:?}"
            );
        }
        // Stopped again and again, each time after a tile or so of each thread: nothing is lost, and the bits are the same.
        growing.clear(size);
        let mut stops = 0;
        let asked = AtomicUsize::new(0);
        let now_and_then = || asked.fetch_add(1, Ordering::Relaxed) % 2 == 0;
        growing.begin(&scene, &sampler, 4, &|| true).unwrap();
        assert!(!growing.begin(&scene, &sampler, 2, &|| false).unwrap().is_whole);
        assert_eq!(growing.block(), Some(4), "{text}: what was known is");
        let first = growing.mean(8, 8);
        while growing.block() != Some(1) {
            stops += u32::from(!growing.begin(&scene, &sampler, 1, &now_and_then).unwrap().is_whole);
            assert_eq!(growing.mean(8, 8), first);
        }
        for to in [2, 5, sampler.samples()].into_iter().filter(|&to| to <= sampler.samples()) {
            while growing.samples() < to {
                let before = growing.samples();
                stops += u32::from(!growing.add(&scene, &sampler, to, &now_and_then).unwrap().is_whole);
                assert!(
                    growing.samples() >= before
                        && growing.image().pixels.iter().all(|p| p.iter().all(|c| c.is_finite()))
                );
            }
        }
        assert!(stops > 0, "{text}");
        assert_eq!(
            (growing.image(), growing.samples()),
            (whole.image, sampler.samples()),
            "{text}: after {stops} stops"
        );
    }
}

#[test]
fn a_scene_that_is_revised_is_the_scene_that_is_made_anew() {
    let open = |sets: &[&str]| {
        let sets = sets.iter().map(|s| (*s).to_owned()).collect();
        load::open(&config("many-lights.json"), &OpenOptions { data: Vec::new(), sets }).unwrap()
    };
    let mut loaded = open(&[]);
    let mut scene = Scene::new(&loaded.config, loaded.mesh.clone(), (24, 16), Stage::Final).unwrap();
    let image = |scene: &Scene| {
        let sampler = Sampler::new(SamplerSet::parse("ld", Preset::Best).unwrap(), &scene.layout, 4, 1).unwrap();
        render(scene, &sampler).unwrap().image
    };
    // Far away and back: the tree is built for another reach and built again.
    for sets in [
        &["camera.fov=40"][..],
        &["camera.lens_radius=0"],
        &["camera.lens_radius=0.1", "auto_focus=false", "camera.focal_depth=3"],
        &["camera.pos=[0, 300, 0]", "camera.dir=[0, -1, 0]", "camera.up=[1, 0, 0]"],
        &["shading=albedo"],
        &["estimator=sheet"],
        &[],
    ] {
        let new = open(sets);
        let made = Scene::new(&new.config, new.mesh.clone(), (30, 20), Stage::Final).unwrap();
        loaded.repaint(new.config.clone()).unwrap();
        assert_eq!((&loaded.mesh.materials, &loaded.warnings), (&new.mesh.materials, &new.warnings));
        scene.revise(&new.config, &loaded.mesh.materials, (30, 20), Stage::Final, Tree::Roomy).unwrap();
        // Every hit is found, whatever the boxes are padded for.
        let (rough, exact) = (image(&scene), image(&made));
        let near = |(a, b): (&f32, &f32)| (a - b).abs() <= 1e-3 * (1.0 + b.abs());
        let same = rough.pixels.as_flattened().iter().zip(exact.pixels.as_flattened()).filter(|p| near(*p)).count();
        assert!(same * 100 >= exact.pixels.len() * 300 - 300 * 2, "{sets:?}: {same} of {}", exact.pixels.len() * 3);
        scene.revise(&new.config, &loaded.mesh.materials, (30, 20), Stage::Final, Tree::Exact).unwrap();
        assert_eq!(image(&scene), exact, "{sets:?}");
        assert!(scene.has_exact_tree());
    }
    let before = image(&scene);
    let bad = open(&["camera.focal_depth=1e-30", "camera.lens_radius=1", "auto_focus=false"]).config;
    let refused = scene.revise(&bad, &loaded.mesh.materials, (30, 20), Stage::Final, Tree::Exact);
    assert!(refused.unwrap_err().to_string().starts_with("camera.focal_depth: expected at least "));
    assert_eq!(image(&scene), before, "on an error nothing changes");
}

#[test]
fn a_tab_s_picture_is_render_s_and_its_document_reads_back_to_the_same_bytes_and_picture() {
    let server = small();
    let mut tab = server.tab();
    tab.finished();
    tab.say(&json!({"ask": "set", "sets": ["sampler=\"halton\"", "seed=18446744073709551615", "camera.fov=50"]}));
    tab.find("a state", |m| m["is"] == "state" && m["seed"] == "18446744073709551615");
    let (_, shown) = tab.finished();
    let document = tab.download("document");
    let exr = tab.download("exr");

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tab.exr");
    std::fs::write(&path, exr).unwrap();
    let (image, provenance) = read_exr(&path).unwrap();
    let scene_file = folder.path().join("tab.json");
    std::fs::write(&scene_file, &document).unwrap();
    let options = OpenOptions { data: vec![config("../data")], sets: Vec::new() };
    let loaded = load::open(&scene_file, &options).unwrap();
    let scene = Scene::new(&loaded.config, loaded.mesh.clone(), (32, 24), Stage::Final).unwrap();
    let set = SamplerSet::parse(loaded.config.sampler.as_deref().unwrap(), Preset::Best).unwrap();
    let sampler = Sampler::new(set, &scene.layout, 4, loaded.config.seed.unwrap()).unwrap();
    assert_eq!(image, render(&scene, &sampler).unwrap().image);
    assert!(provenance.contains(&("seed".to_owned(), u64::MAX.to_string())), "{provenance:?}");

    // In another tab, after another scene.
    let mut other = server.tab();
    other.finished();
    other.say(&json!({"ask": "load", "name": "penumbra.json"}));
    other.find("another scene", |m| m["is"] == "state" && m["name"] == "penumbra.json");
    other.say(&json!({"ask": "document", "name": "tab.json", "text": String::from_utf8(document.clone()).unwrap()}));
    other.find("the document", |m| m["is"] == "state" && m["name"] == "tab.json");
    assert_eq!(other.finished().1, shown);
    assert_eq!(other.download("document"), document);
    // And by a drop.
    other.say(&json!({"ask": "reset"}));
    other.upload(1, "tab.json", true, &document);
    other.find("the drop", |m| m["is"] == "state" && m["name"] == "tab.json");
    assert_eq!(other.finished().1, shown);
    assert_eq!(other.download("document"), document);
}

#[test]
fn bad_requests_are_refused_with_their_place_and_the_last_good_picture_stays() {
    let server = small();
    let mut tab = server.tab();
    tab.finished();
    let good = tab.download("document");
    let set = |text: &str| json!({"ask": "set", "sets": [text]});
    let document = |text: &str| json!({"ask": "document", "name": "mine.json", "text": text});
    let most = MAX_VIEW_PIXELS.to_string();
    for (request, needle) in [
        (set("camera.fov=200"), "camera.fov: expected an angle between 0 and 180"),
        (set("camera.fvo=20"), "did you mean \"fov\"?"),
        (set("camera.pos=[0, 0]"), "camera.pos: expected a position"),
        (set("camera.fov=1e999"), "camera.fov"),
        (set("nonsense"), "expected KEY=VALUE"),
        (set("framebuffer.res_w=1000000"), most.as_str()),
        (set("framebuffer.res_w=99999999999"), "whole number"),
        (set("framebuffer.sppx=0"), "framebuffer.sppx"),
        (set("sampler=\"haltn\""), "did you mean \"halton\""),
        (set("sampler=\"center\""), "center"),
        (set("seed=-1"), "seed"),
        (set("scene.mesh_files=[\"../../../../etc/passwd\"]"), "in a folder of this scene"),
        (set("scene.mesh_files=[\"/etc/passwd\"]"), "in a folder of this scene"),
        (set("scene.mesh_files=[\"absent.obj\"]"), "absent.obj"),
        (set("camera.pos=[1e30, 0, 0]"), "reach"),
        (document("{"), "mine.json: line 1"),
        (document("[]"), "mine.json: expected an object"),
        (document("{\"a\": 1, \"a\": 2}"), "twice"),
        (document(&"[".repeat(100_000)), "recursion"),
        (document("{\"framebuffer\": {\"res_w\": 8192, \"res_h\": 8192}}"), "sampler-lab render"),
        (json!({"ask": "load", "name": "../Cargo.toml"}), "expected one of the scene files"),
        (json!({"ask": "load", "name": "experiments"}), "expected one of the scene files"),
        (json!({"ask": "save", "name": "a"}), "--data DIR"),
        (json!({"ask": "probe", "x": 32, "y": 0}), "expected one of 32 times 24"),
        (json!({"ask": "pick", "x": 0, "y": 4_000_000_000u32}), "expected one of 32 times 24"),
        (json!({"ask": "points", "x": 0, "y": 0, "decision": "colour"}), "expected a decision"),
        (set("view.second=\"sobol:sheet\""), "view.second: sampler"),
        (set("view.seconds=1e12"), "view.seconds: expected seconds, 0.1 to 3600"),
        (json!({"ask": "download", "what": "png", "panel": 7}), "download"),
        (json!({"ask": "format-disk"}), "expected a request of the page"),
        (json!([1, 2]), "expected a request of the page"),
    ] {
        let error = tab.error(&request);
        assert!(error.contains(needle), "{request}: {error}");
    }
    tab.socket.send(Message::text("no JSON at all \u{0}")).unwrap();
    assert!(tab.until("error").0["text"].as_str().unwrap().contains("message: expected a request"));
    tab.socket.send(Message::binary(vec![0xff; 100])).unwrap();
    assert!(tab.until("error").0["text"].as_str().unwrap().contains("upload: expected a file"));
    assert_eq!(tab.download("document"), good);
    tab.say(&json!({"ask": "restart"}));
    tab.finished();
}

const TRIANGLE: &str = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n";

#[test]
fn uploads_stay_in_their_folder_and_go_with_the_tab() {
    let server = small();
    let folders = || {
        let entries =
            std::fs::read_dir(std::env::temp_dir()).unwrap().filter_map(|e| e.ok()?.file_name().into_string().ok());
        entries.filter(|name| name.starts_with("sampler-lab-view-")).collect::<Vec<_>>()
    };
    let before = folders();
    let mut tab = server.tab();
    tab.finished();
    let good = tab.download("document");
    for name in
        ["../evil.obj", "/tmp/evil.obj", "a/../../evil.obj", ".profile", "", "a\\..\\b.obj", "C:evil.obj", "a\u{0}.obj"]
    {
        tab.upload(1, name, true, b"x");
        let error = tab.until("error").0["text"].as_str().unwrap().to_owned();
        assert!(error.contains("expected a plain file name"), "{name:?}: {error}");
    }
    tab.upload(2, "a.obj", false, TRIANGLE.as_bytes());
    tab.upload(2, "a.obj", true, b"again");
    assert!(tab.until("error").0["text"].as_str().unwrap().contains("each name once"));
    // What a mesh refers to has to be there, and within reach.
    for library in ["../../../../../../etc/passwd", "/etc/passwd", "absent.mtl"] {
        tab.upload(3, "evil.obj", true, TRIANGLE.replace("m.mtl", library).as_bytes());
        let error = tab.until("error").0["text"].as_str().unwrap().to_owned();
        assert!(
            error.contains("evil.obj:1") && error.contains("in a folder of this scene") && !error.contains("root:"),
            "{error}"
        );
    }
    tab.upload(4, "texture.obj", false, TRIANGLE.as_bytes());
    tab.upload(4, "m.mtl", true, b"newmtl red\nKd 1 0 0\nmap_Kd /etc/hostname\n");
    assert!(tab.until("error").0["text"].as_str().unwrap().contains("in a folder of this scene"));
    for (name, bytes, needle) in [
        ("bad.obj", &b"f 1 2 3\n"[..], "bad.obj"),
        ("bad.json", b"\xff\xfe", "bad.json"),
        ("bad.csv", b"0.5,0.5\n0.5,nan\n", "bad.csv: line 2"),
        ("photo.heic", b"?", "expected a config (.json), a mesh"),
    ] {
        tab.upload(5, name, true, bytes);
        let error = tab.until("error").0["text"].as_str().unwrap().to_owned();
        assert!(error.contains(needle), "{name}: {error}");
    }
    assert_eq!(tab.download("document"), good, "nothing changed so far");
    // A good one, with its material, is looked at from outside.
    tab.upload(6, "tri.obj", false, TRIANGLE.as_bytes());
    tab.upload(6, "m.mtl", true, b"newmtl red\nKd 1 0 0\n");
    let (state, _) = tab.find("the mesh", |m| m["is"] == "state" && m["name"] == "dropped.json");
    assert_eq!((&state["triangles"], &state["config"]["shading"]), (&json!(1), &json!("albedo")));
    let (_, bytes) = tab.finished();
    assert!(bytes.chunks(3).any(|p| p[0] > 50 && p[1] == 0), "red is seen");
    // A point set is measured.
    tab.upload(7, "mine.csv", true, b"x,y\n0.25,0.75\n0.75,0.25\n");
    let (points, _) = tab.until("points");
    assert_eq!(points["sets"][0]["points"], json!([[0.25, 0.75], [0.75, 0.25]]));
    assert!(points["sets"][0]["measured"]["star"]["value"].as_f64().unwrap() > 0.4);
    // Too many.
    for i in 0..MAX_UPLOAD_FILES {
        tab.upload(100 + i as u64, "m.mtl", false, b"");
    }
    assert!(tab.until("error").0["text"].as_str().unwrap().contains("at most 64 files"));

    let made: Vec<String> = folders().into_iter().filter(|f| !before.contains(f)).collect();
    assert!(!made.is_empty());
    drop(tab);
    drop(server);
    // Other tests run at the same time: those of this server are gone with it.
    let left = |f: &String| std::env::temp_dir().join(f).join("1").join("6").join("tri.obj").exists();
    assert!(!made.iter().any(left));
}

#[test]
fn a_message_that_is_too_large_is_refused_in_words_before_it_is_kept() {
    let server = small();
    let mut tab = server.tab();
    tab.upload(1, "huge.obj", true, &vec![b' '; MAX_UPLOAD_BYTES + (1 << 20)]);
    let (refused, _) = tab.until("refused");
    assert!(refused["text"].as_str().unwrap().contains("expected one of bounded size"), "{refused}");
    server.tab().finished();
}

#[test]
fn scenes_of_strangers_stay_within_their_folders_and_bounds() {
    let loaded = load::open(&config("a01.json"), &OpenOptions::default()).unwrap();
    let texels: u64 = loaded.mesh.textures.iter().map(|t| u64::from(t.width) * u64::from(t.height)).sum();
    let (triangles, data) = (loaded.mesh.len(), vec![config("../data")]);
    let open =
        |triangles, texels| load::open_within(loaded.config.clone(), "a01", &data, load::Limits { triangles, texels });
    assert_eq!(open(triangles, texels).unwrap().mesh, loaded.mesh);
    let what = |error: sampler_lab::error::Error| error.to_string();
    assert!(what(open(triangles - 1, texels).unwrap_err()).contains(&format!("at most {} triangles", triangles - 1)));
    assert!(what(open(triangles, texels - 1).unwrap_err()).contains(&format!("at most {} texels", texels - 1)));
    // A link out of the folder is followed before it is judged.
    #[cfg(unix)]
    {
        let folder = tempfile::tempdir().unwrap();
        std::os::unix::fs::symlink(config("../data/checkerpots/checkerpots.obj"), folder.path().join("link.obj"))
            .unwrap();
        let mut linked = loaded.config.clone();
        linked.mesh_files = vec!["link.obj".to_owned()];
        let limits = load::Limits { triangles, texels };
        let error = load::open_within(linked, "linked", &[folder.path().to_owned()], limits).unwrap_err();
        assert!(error.to_string().contains("in a folder of this scene"), "{error}");
    }
}

#[test]
fn tabs_are_counted_and_one_that_vanishes_frees_its_place() {
    let server =
        start("cornell.json", &["framebuffer.res_w=640", "framebuffer.res_h=360", "framebuffer.sppx=100000"], &[]);
    let mut tabs: Vec<Tab> = (0..MAX_TABS).map(|_| server.tab()).collect();
    let (refused, _) = server.socket().next();
    assert!(refused["is"] == "refused" && refused["text"].as_str().unwrap().contains("tabs at a time"), "{refused}");
    // In the middle of its work, without a good-bye.
    drop(tabs.pop());
    let started = Instant::now();
    loop {
        let mut tab = server.socket();
        let (first, _) = tab.next();
        if first["is"] == "hello" {
            break;
        }
        assert!(started.elapsed() < PATIENCE, "a place is free again");
        std::thread::sleep(Duration::from_millis(50));
    }
}

#[test]
fn no_picture_is_sent_before_the_last_one_was_shown_and_the_last_change_wins() {
    let server = small();
    let mut tab = server.tab();
    tab.acknowledges = false;
    let (first, _) = tab.until("frame");
    for fov in 20..=120 {
        tab.say(&json!({"ask": "set", "sets": [format!("camera.fov={fov}")], "moving": true}));
    }
    tab.say(&json!({"ask": "set", "sets": ["camera.fov=33"]}));
    // Everything is answered, and the first frame stays the only one.
    tab.say(&json!({"ask": "download", "what": "document"}));
    let (_, text) = tab.find("the document", |m| {
        assert_ne!(m["is"], "frame", "a second frame without the first being shown");
        m["is"] == "file"
    });
    let document: Value = serde_json::from_slice(&text).unwrap();
    assert_eq!(document["camera"]["fov"], 33.0);
    tab.acknowledges = true;
    tab.say(&json!({"ask": "shown", "frame": first["frame"]}));
    let (last, _) = tab.finished();
    let sent = last["frame"].as_u64().unwrap() - first["frame"].as_u64().unwrap();
    assert!(sent <= 20, "{sent} frames for the one picture that still counts");
}

#[test]
fn saving_takes_a_new_name_each_time() {
    let folder = tempfile::tempdir().unwrap();
    let server = start("cornell.json", &["framebuffer.res_w=16", "framebuffer.res_h=16"], &[folder.path()]);
    let mut tab = server.tab();
    tab.finished();
    for expected in ["mine.json", "mine-2.json", "mine-3.json"] {
        tab.say(&json!({"ask": "save", "name": "mine.json"}));
        assert_eq!(tab.until("saved").0["name"], expected);
        let document = tab.download("document");
        assert_eq!(std::fs::read(folder.path().join(expected)).unwrap(), document);
    }
    for bad in ["../mine", "/tmp/mine", "", ".hidden", "a\u{0}", "a/b", &"x".repeat(300)] {
        assert!(tab.error(&json!({"ask": "save", "name": bad})).contains("expected a name of letters"), "{bad:?}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 3, "nothing else, and nothing partial");
}

#[test]
fn a_tab_answers_with_values_points_distances_errors_and_spectra() {
    let server = start(
        "a01.json",
        &["framebuffer.res_w=64", "framebuffer.res_h=36", "framebuffer.sppx=8", "auto_focus=false"],
        &[],
    );
    let mut tab = server.tab();
    tab.finished();
    tab.say(&json!({"ask": "pick", "x": 32, "y": 30}));
    let (pick, _) = tab.until("pick");
    let depth = pick["depth"].as_f64().unwrap();
    assert!(
        pick["focused"] == true
            && pick["material"].is_string()
            && depth > 0.0
            && depth <= pick["distance"].as_f64().unwrap()
    );
    let (state, _) = tab.find("the new focus", |m| m["is"] == "state");
    assert!((state["focal_depth"].as_f64().unwrap() / depth - 1.0).abs() < 1e-5, "{pick} {state}");
    // Two samplers on the same samples, then on the same seconds.
    tab.set(&["view.second=\"ld:sheet\""]);
    let (frame, bytes) = tab.find("two panels", |m| {
        m["is"] == "frame"
            && m["panels"].as_array().unwrap().len() == 2
            && m["panels"].as_array().unwrap().iter().all(|p| p["samples"] == 8)
    });
    assert_eq!(bytes.len(), 2 * 3 * 64 * 36);
    assert_eq!(frame["panels"][1]["sampler"], "ld:sheet");
    tab.say(&json!({"ask": "points", "x": 3, "y": 4, "decision": "lens"}));
    let (points, _) = tab.until("points");
    let sets = points["sets"].as_array().unwrap();
    assert_eq!((sets.len(), sets[0]["points"].as_array().unwrap().len()), (2, 8));
    assert!(sets.iter().all(|s| s["measured"]["star"]["value"].as_f64().unwrap() > 0.0));
    assert!(
        tab.error(&json!({"ask": "points", "x": 3, "y": 4, "decision": "light-pick"})).contains("that the scene makes")
    );
    let (status, _) = tab.find("errors of both", |m| {
        m["is"] == "status"
            && m["panels"].as_array().unwrap().iter().all(|p| p["errors"]["rmse"]["value"].as_f64() > Some(0.0))
    });
    assert!(status["panels"][0]["errors"]["rmse"]["ci95"].is_array(), "with the interval of the reference's noise");
    for view in ["reference", "error", "variance", "image"] {
        tab.set(&[&format!("view.look={view:?}")]);
        tab.find(view, |m| m["is"] == "frame" && m["panels"][0]["view"] == view);
    }
    tab.say(&json!({"ask": "probe", "x": 5, "y": 6}));
    let (probe, _) = tab.until("probe");
    assert!(probe["panels"][1]["mean"][0].is_number() && probe["reference"][2].is_number());
    // Points and a spectrum at the same time: neither waits for the other.
    tab.say(&json!({"ask": "spectrum"}));
    tab.say(&json!({"ask": "points", "x": 3, "y": 4, "decision": "pixel"}));
    let mut spectrum = Value::Null;
    let mut has_points = false;
    while spectrum.is_null() || !has_points {
        let (answer, _) =
            tab.find("a spectrum and points", |m| ["spectrum", "points", "error"].contains(&m["is"].as_str().unwrap()));
        assert_ne!(answer["is"], "error", "{answer}");
        match answer["is"] == "points" {
            true => has_points = true,
            false => spectrum = answer,
        }
    }
    assert_eq!(spectrum["panels"].as_array().unwrap().len(), 2, "{spectrum}");
    let rings = |i: usize| spectrum["panels"][i]["spectrum"]["power"].as_array().unwrap().len();
    assert!(rings(0) > 10 && rings(0) == rings(1));
    tab.set(&["view.second=\"stratified\"", "view.seconds=0.2"]);
    let (frame, _) = tab.find("both by seconds", |m| {
        m["is"] == "frame"
            && m["panels"].as_array().unwrap().iter().all(|p| p["timing"] == false && p["samples"] == p["of"])
            && m["panels"][1]["sampler"] == "stratified:shuffle:jitter@each"
    });
    assert!(frame["panels"][0]["seconds"].as_f64().unwrap() > 0.0);
    // Stopped, nothing grows; a restart goes on.
    tab.set(&["view.second=null", "view.seconds=null"]);
    tab.set(&["framebuffer.sppx=1000000"]);
    tab.say(&json!({"ask": "stop"}));
    tab.find("a stop", |m| m["is"] == "status" && m["state"] == "stopped");
    tab.say(&json!({"ask": "restart"}));
    tab.find("work", |m| m["is"] == "status" && m["state"] == "rendering");
}

#[test]
fn a_refused_change_and_another_way_of_looking_leave_the_running_picture_alone() {
    let server =
        start("cornell.json", &["framebuffer.res_w=96", "framebuffer.res_h=64", "framebuffer.sppx=1000000"], &[]);
    let mut tab = server.tab();
    // With the tree that it ends with, and in the midst of it.
    let (first, _) = tab.find("a picture under way", |m| {
        m["is"] == "frame"
            && m["panels"][0]["samples"].as_u64() > Some(1)
            && m["panels"][0]["reference"].as_u64() > Some(0)
    });
    let epoch = first["epoch"].clone();
    let mut samples = first["panels"][0]["samples"].as_u64().unwrap();
    let mut goes_on = |tab: &mut Tab, what: &str| {
        let (frame, _) = tab.until("frame");
        assert_eq!(frame["epoch"], epoch, "{what}: begun anew");
        let now = frame["panels"][0]["samples"].as_u64().unwrap();
        assert!(now >= samples, "{what}: {now} samples after {samples}");
        samples = now;
    };
    for refused in [
        "camera.fov=190",
        "framebuffer.sppx=0",
        "framebuffer.res_w=1000000",
        "sampler=\"ld:none\"",
        "view.second=\"nonsense\"",
        "view.seconds=0",
        "scene.mesh_files=[\"absent.obj\"]",
        "camera.pos=[1e30, 0, 0]",
    ] {
        let error = tab.error(&json!({"ask": "set", "sets": [refused]}));
        assert!(error.contains("expected"), "{refused}: {error}");
        goes_on(&mut tab, refused);
    }
    for shown in
        ["framebuffer.exposure=2", "view.look=\"variance\"", "view.show=\"flip\"", "view.speed=3", "view.refine=false"]
    {
        tab.set(&[shown]);
        tab.until("state");
        goes_on(&mut tab, shown);
    }
    // Stopped, it stays what it is and can be saved.
    tab.say(&json!({"ask": "stop"}));
    tab.find("a stop", |m| m["is"] == "status" && m["state"] == "stopped");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("stopped.exr");
    std::fs::write(&path, tab.download("exr")).unwrap();
    let (image, provenance) = read_exr(&path).unwrap();
    let kept: u64 = provenance.iter().find(|(key, _)| key == "spp").unwrap().1.parse().unwrap();
    assert!(kept >= samples && image.pixels.iter().any(|p| p[0] > 0.0), "{kept} samples after {samples}");
}

#[test]
fn how_a_tab_compares_and_shows_is_in_the_document_and_comes_back_with_it() {
    let server = small();
    let mut tab = server.tab();
    tab.finished();
    let plain = tab.download("document");
    tab.set(&[
        "view.second=\"ld:sheet\"",
        "view.seconds=0.25",
        "view.show=\"flip\"",
        "view.look=\"error\"",
        "view.refine=false",
        "view.speed=1.5",
    ]);
    let is_set = |m: &Value| {
        m["is"] == "state"
            && m["config"]["view"]
                == json!({"second": "ld:sheet", "seconds": 0.25, "show": "flip", "look": "error", "refine": false, "speed": 1.5})
    };
    tab.find("the view", is_set);
    let document = tab.download("document");
    tab.say(&json!({"ask": "reset"}));
    let (frame, _) = tab.find("one panel", |m| m["is"] == "frame" && m["panels"].as_array().unwrap().len() == 1);
    assert_eq!(frame["panels"][0]["view"], "image");
    assert_eq!(tab.download("document"), plain);
    tab.upload(1, "again.json", true, &document);
    tab.find("the view again", is_set);
    tab.find("two panels by seconds", |m| {
        m["is"] == "frame" && m["panels"].as_array().unwrap().len() == 2 && m["panels"][1]["sampler"] == "ld:sheet"
    });
    assert_eq!(tab.download("document"), document);
    // A scene file that says nothing of it is shown as the one before.
    tab.say(&json!({"ask": "load", "name": "penumbra.json"}));
    tab.find("another scene", |m| m["name"] == "penumbra.json" && is_set(m));
    // For `render` it is the same picture.
    let picture = |bytes: &[u8]| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        std::fs::write(&path, bytes).unwrap();
        load::open(&path, &OpenOptions { data: vec![config("../data")], sets: Vec::new() }).unwrap().content_sha256()
    };
    assert_eq!(picture(&document), picture(&plain));
}

#[test]
fn the_scene_that_cannot_be_shown_is_refused_before_the_port_is_taken() {
    let bind = |scene: &str, sets: &[&str]| {
        let sets = sets.iter().map(|s| (*s).to_owned()).collect();
        Server::bind(&Options { scene: Some(config(scene)), data: Vec::new(), sets, port: 0 }).map(|_| ()).unwrap_err()
    };
    for (scene, sets, needle) in [
        ("absent.json", &[][..], "absent.json"),
        ("cornell.json", &["framebuffer.res_w=8000", "framebuffer.res_h=8000"], "pixels in the view"),
        ("cornell.json", &["sampler=nonsense"], "nonsense"),
        ("cornell.json", &["scene.mesh_files=[\"absent.obj\"]"], "absent.obj"),
    ] {
        let error = bind(scene, sets);
        assert!(error.exit_code() == 2 && error.to_string().contains(needle), "{error}");
    }
    let taken = small();
    let again = Options { scene: Some(config("cornell.json")), port: taken.port, ..Options::default() };
    let error = Server::bind(&again).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("--port: expected a port that is free"), "{error}");
}
