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

mod guests;
mod pictures;
mod tab;

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
