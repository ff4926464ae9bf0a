//! How fast the live view answers: from a change to its first picture, and pictures a second while the camera moves.
//!
//! `cargo run --release --example view_latency [SCENE]` serves the scene in this process and is its page: a websocket that acknowledges every
//! frame as soon as it is there. A browser adds its decoding and drawing. Medians, with the 10th and 90th percentile.

use std::net::TcpStream;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use sampler_lab::view::{Options, Server};
use serde_json::{Value, json};
use tungstenite::client::IntoClientRequest;
use tungstenite::protocol::WebSocketConfig;
use tungstenite::{Message, WebSocket};

/// How many changes are made from rest.
const CHANGES: usize = 30;

/// How long the camera moves.
const FLIGHT: Duration = Duration::from_secs(5);

fn main() {
    let scene = std::env::args().nth(1).unwrap_or_else(|| "configs/a01.json".to_owned());
    println!("{scene}, {} threads", std::thread::available_parallelism().map_or(1, usize::from));
    println!("size       first picture after a change, ms     one pixel in  | updates a second moving   gaps, ms");
    for (width, height) in [(640, 360), (1280, 720)] {
        let sets = vec![format!("framebuffer.res_w={width}"), format!("framebuffer.res_h={height}")];
        let options = Options { scene: Some(PathBuf::from(&scene)), sets, ..Options::default() };
        let server = Server::bind(&options).expect("a scene that can be shown");
        let address = server.address();
        let stop = Arc::new(AtomicBool::new(false));
        let told = stop.clone();
        let serving = std::thread::spawn(move || server.serve(&told));
        let mut page = Page::open(&address);
        let (first, blocks) = page.changes_from_rest();
        let (rate, gaps) = page.flight();
        println!("{width}x{height}  {}  {:>12}  | {rate:>23.1}   {}", spread(first), blocks, spread(gaps));
        stop.store(true, Ordering::Relaxed);
        drop(page);
        let _ = serving.join();
    }
}

/// Median, and the 10th and 90th percentile.
fn spread(mut values: Vec<f64>) -> String {
    values.sort_by(f64::total_cmp);
    let at = |share: f64| values[((values.len() - 1) as f64 * share).round() as usize];
    format!("{:6.1} ({:.1} to {:.1}), n = {}", at(0.5), at(0.1), at(0.9), values.len())
}

struct Page {
    socket: WebSocket<TcpStream>,
    epoch: u64,
}

impl Page {
    fn open(address: &str) -> Self {
        let rest = address.strip_prefix("http://").expect("an address of ours");
        let (host, query) = rest.split_once("/?").expect("an address of ours");
        let stream = TcpStream::connect(host).expect("a server");
        stream.set_nodelay(true).expect("a socket");
        let mut request = format!("ws://{host}/live?{query}").into_client_request().expect("a request");
        request.headers_mut().insert("Origin", format!("http://{host}").parse().expect("a header"));
        let config = WebSocketConfig::default().max_message_size(None).max_frame_size(None);
        let (socket, _) = tungstenite::client::client_with_config(request, stream, Some(config)).expect("let in");
        let mut page = Self { socket, epoch: 0 };
        page.frame();
        page
    }

    fn say(&mut self, value: &Value) {
        self.socket.send(Message::text(value.to_string())).expect("a server that listens");
    }

    /// The next frame's header, acknowledged.
    fn frame(&mut self) -> Value {
        loop {
            let Message::Binary(bytes) = self.socket.read().expect("a server that speaks") else { continue };
            let length = u32::from_le_bytes(bytes[..4].try_into().expect("four bytes")) as usize;
            let header: Value = serde_json::from_slice(&bytes[4..4 + length]).expect("JSON");
            if header["is"] == "frame" {
                let shown = json!({"ask": "shown", "frame": header["frame"]});
                self.say(&shown);
                self.epoch = header["epoch"].as_u64().unwrap_or(0);
                return header;
            }
        }
    }

    /// Milliseconds from a change to the first frame of its picture, with the reference growing in between; and the largest block.
    fn changes_from_rest(&mut self) -> (Vec<f64>, u64) {
        let mut coarsest = 0;
        let took = (0..CHANGES).map(|i| {
            // At different moments of whatever is being done.
            let until = Instant::now() + Duration::from_millis(900 + 37 * (i as u64 % 7));
            while Instant::now() < until {
                self.frame_or_wait(Duration::from_millis(20));
            }
            let (before, fov) = (self.epoch, 50 + i);
            let started = Instant::now();
            self.say(&json!({"ask": "set", "sets": [format!("camera.fov={fov}")]}));
            loop {
                let frame = self.frame();
                if self.epoch > before {
                    coarsest = coarsest.max(frame["panels"][0]["block"].as_u64().unwrap_or(0).pow(2));
                    return 1e3 * started.elapsed().as_secs_f64();
                }
            }
        });
        (took.collect(), coarsest)
    }

    /// Takes a frame if one comes in time.
    fn frame_or_wait(&mut self, patience: Duration) {
        let mut byte = [0u8];
        let stream = self.socket.get_ref();
        stream.set_read_timeout(Some(patience)).expect("a socket");
        let comes = matches!(stream.peek(&mut byte), Ok(n) if n > 0);
        stream.set_read_timeout(None).expect("a socket");
        // What comes may be a text: read one message, whatever it is.
        if comes && let Ok(Message::Binary(bytes)) = self.socket.read() {
            let length = u32::from_le_bytes(bytes[..4].try_into().expect("four bytes")) as usize;
            let header: Value = serde_json::from_slice(&bytes[4..4 + length]).expect("JSON");
            if header["is"] == "frame" {
                self.epoch = header["epoch"].as_u64().unwrap_or(0);
                self.say(&json!({"ask": "shown", "frame": header["frame"]}));
            }
        }
    }

    /// Pictures a second of a camera that is told a new place 60 times a second, and milliseconds between pictures of different places.
    fn flight(&mut self) -> (f64, Vec<f64>) {
        let started = Instant::now();
        let (mut told, mut last) = (0u32, Instant::now());
        let mut gaps = Vec::new();
        while started.elapsed() < FLIGHT {
            let due = (started.elapsed().as_secs_f64() * 60.0) as u32;
            if due >= told {
                let x = -0.565_43 + 0.5 * libm::sin(f64::from(due) / 60.0);
                self.say(
                    &json!({"ask": "set", "sets": [format!("camera.pos=[{x}, 3.2923, -4.4922]")], "moving": true}),
                );
                told = due + 1;
            }
            let before = self.epoch;
            self.frame_or_wait(Duration::from_millis(2));
            if self.epoch > before {
                gaps.push(1e3 * last.elapsed().as_secs_f64());
                last = Instant::now();
            }
        }
        (gaps.len() as f64 / started.elapsed().as_secs_f64(), gaps)
    }
}
