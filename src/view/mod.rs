//! The live view: one page in a browser, pictures that grow while one looks, every control a key of the scene file.
//!
//! The program serves the page on 127.0.0.1 and everything else over one websocket a tab ([`message`]). Renderer and page are
//! apart: the page shows and asks, all pictures, numbers and point sets are made here by the library's own functions. Every tab is
//! a session of its own (`studio`): a scene, the pictures of one or two samplers, and a reference that is refined meanwhile.
//!
//! A request is answered only with the token that was printed, under this machine's own name, and a websocket only for a page that came
//! from here (`http`): a page of another site can neither read nor drive it.

mod analyst;
mod channel;
mod document;
mod http;
pub mod message;
mod picture;
mod reference;
mod session;
mod side;
mod speed;
mod state;
mod studio;
mod uploads;

use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;

use crate::error::{Error, Result};
use document::Document;

pub use uploads::{MAX_UPLOAD_BYTES, MAX_UPLOAD_FILES, MAX_UPLOAD_TOTAL};

/// Most tabs at a time: each has a scene and pictures of its own.
pub const MAX_TABS: usize = 4;

/// Most connections at a time; a page's files take a few short ones.
const MAX_CONNECTIONS: usize = 32;

/// Most pixels of a picture in the view, 2²²: sums, reference and copies take about 200 bytes each.
pub const MAX_VIEW_PIXELS: u64 = 1 << 22;

/// What to show, and where.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// The scene to begin with; an empty one where there is none.
    pub scene: Option<PathBuf>,
    /// Further folders of mesh files; what is saved goes into the first.
    pub data: Vec<PathBuf>,
    /// Changes to the scene file.
    pub sets: Vec<String>,
    /// The port; 0 takes one that is free.
    pub port: u16,
}

/// A server that holds its port.
pub struct Server {
    listener: TcpListener,
    house: Arc<House>,
}

/// What all tabs have in common.
struct House {
    /// What a page has to know to be let in: 32 hexadecimal digits.
    token: String,
    /// The document that a tab begins with.
    first: Document,
    /// Where documents are saved; nowhere if absent.
    save_to: Option<PathBuf>,
    uploads: uploads::Root,
    tabs: AtomicUsize,
    connections: AtomicUsize,
    /// The number of the next session.
    next_session: AtomicUsize,
    closing: AtomicBool,
}

impl Server {
    /// Reads the scene and takes the port.
    ///
    /// # Errors
    /// Kind `Input` for a scene that cannot be shown, a port that is taken, or a `--data` that is no folder.
    pub fn bind(options: &Options) -> Result<Self> {
        if let Some(folder) = options.data.iter().find(|folder| !folder.is_dir()) {
            return Err(Error::input("--data", format!("expected a folder, found {}", folder.display())));
        }
        let first = Document::first(options)?;
        let port = options.port;
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))
            .and_then(|listener| listener.set_nonblocking(true).map(|()| listener))
            .map_err(|e| Error::input("--port", format!("expected a port that is free, found {port}: {e}")))?;
        let house = House {
            token: token()?,
            first,
            save_to: options.data.first().cloned(),
            uploads: uploads::Root::default(),
            tabs: AtomicUsize::new(0),
            connections: AtomicUsize::new(0),
            next_session: AtomicUsize::new(1),
            closing: AtomicBool::new(false),
        };
        Ok(Self { listener, house: Arc::new(house) })
    }

    /// The port.
    ///
    /// # Panics
    /// Never: a bound socket has an address.
    pub fn port(&self) -> u16 {
        self.listener.local_addr().expect("a bound socket has an address").port()
    }

    /// What the browser has to open.
    pub fn address(&self) -> String {
        format!("http://127.0.0.1:{}/?token={}", self.port(), self.house.token)
    }

    /// What a person should know of the first scene, one line each.
    pub fn warnings(&self) -> &[String] {
        &self.house.first.warnings
    }

    /// Serves until `stop` is set; then every session ends, and with them what was uploaded.
    ///
    /// # Errors
    /// Kind `Incomplete` where the system takes the port away.
    pub fn serve(self, stop: &AtomicBool) -> Result<()> {
        let outcome = loop {
            if stop.load(Ordering::Relaxed) {
                break Ok(());
            }
            match self.listener.accept() {
                Ok((stream, _)) => self.house.clone().take(stream),
                Err(e) if e.kind() == std::io::ErrorKind::WouldBlock => std::thread::sleep(Duration::from_millis(5)),
                // A connection that went away before it was taken, or too many open files: the next may fare better.
                Err(e) if is_passing(&e) => std::thread::sleep(Duration::from_millis(50)),
                Err(e) => break Err(Error::incomplete("port", format!("expected connections, found: {e}"))),
            }
        };
        self.house.closing.store(true, Ordering::Relaxed);
        // Sessions look at it several times a second; one that hangs in the system is not waited for.
        for _ in 0..300 {
            if self.house.connections.load(Ordering::Relaxed) == 0 {
                break;
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        self.house.uploads.remove();
        outcome
    }
}

fn is_passing(e: &std::io::Error) -> bool {
    use std::io::ErrorKind::{ConnectionAborted, ConnectionReset, Interrupted};
    // 24 and 23: too many open files, of the process and of the system.
    matches!(e.kind(), ConnectionAborted | ConnectionReset | Interrupted) || matches!(e.raw_os_error(), Some(23 | 24))
}

impl House {
    /// Serves one connection on a thread of its own, or refuses it where there are too many.
    fn take(self: Arc<Self>, stream: TcpStream) {
        let Some(held) = Held::one(&self, |house| &house.connections, MAX_CONNECTIONS) else {
            http::refuse_busy(&stream);
            return;
        };
        let serve = move || http::serve(stream, &held.house);
        // No thread to be had: the connection closes, the next may fare better.
        let _ = std::thread::Builder::new().name("connection".to_owned()).spawn(serve);
    }
}

/// One of a bounded number, given back when dropped.
struct Held {
    house: Arc<House>,
    of: fn(&House) -> &AtomicUsize,
}

impl Held {
    fn one(house: &Arc<House>, of: fn(&House) -> &AtomicUsize, most: usize) -> Option<Self> {
        let more = |n| (n < most).then_some(n + 1);
        of(house).fetch_update(Ordering::Relaxed, Ordering::Relaxed, more).ok()?;
        Some(Self { house: house.clone(), of })
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        (self.of)(&self.house).fetch_sub(1, Ordering::Relaxed);
    }
}

/// 128 bits of the system's randomness.
fn token() -> Result<String> {
    let mut bytes = [0u8; 16];
    getrandom::fill(&mut bytes)
        .map_err(|e| Error::input("token", format!("expected random bytes of the system, found: {e}")))?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}
