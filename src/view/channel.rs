//! A tab's two ways: what it asks for, coalesced, and what it is sent, never more than one picture ahead of its acknowledgement.

use std::collections::VecDeque;
use std::io::{Read, Write};
use std::net::{Shutdown, TcpStream};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use tungstenite::protocol::{Role, WebSocketConfig};
use tungstenite::{Message, WebSocket};

use super::message::Ask;
use super::uploads::MAX_UPLOAD_BYTES;

/// Most requests that wait; changes of one key count once.
const MAX_WAITING: usize = 64;

/// Most changes of keys that join into one.
const MAX_JOINED: usize = 256;

/// Most messages that wait to be sent; a tab that does not take them is gone.
const MAX_UNSENT: usize = 256;

/// How often a tab is asked whether it is there.
const PING: Duration = Duration::from_secs(10);

/// A lock whose holder may have panicked: what it protects is whole between any two statements.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// How large messages may be: an upload with its name.
pub fn socket_config() -> WebSocketConfig {
    let most = MAX_UPLOAD_BYTES + (64 << 10);
    WebSocketConfig::default()
        .max_message_size(Some(most))
        .max_frame_size(Some(most))
        .read_buffer_size(16 << 10)
        .write_buffer_size(0)
}

/// What a tab asks for, until it is taken.
#[derive(Default)]
pub struct Inbox {
    waiting: Mutex<Waiting>,
    arrived: Condvar,
    /// Counts what makes the pictures under way stale.
    changes: AtomicU64,
}

#[derive(Default)]
struct Waiting {
    asks: VecDeque<Ask>,
    shown: Shown,
    /// How many changes of keys there were so far, joined ones too.
    sets: u64,
    closed: bool,
}

/// What [`Inbox::take`] gives.
pub struct Taken {
    /// Everything that waited.
    pub asks: Vec<Ask>,
    /// The last frame that was shown.
    pub shown: Shown,
    /// How many changes there were so far.
    pub changes: u64,
    /// How many of these were changes of keys, as the page counts them too.
    pub sets: u64,
}

/// The last frame that was shown, and when that was heard.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Shown {
    /// Its number.
    pub frame: u64,
    /// Absent before the first.
    pub at: Option<Instant>,
}

impl Inbox {
    /// Adds a request; `false` where too many wait. A change of keys joins one that waits, with the last word.
    pub fn push(&self, ask: Ask) -> bool {
        let mut waiting = lock(&self.waiting);
        if ask.is_change() {
            self.changes.fetch_add(1, Ordering::Relaxed);
        }
        waiting.sets += u64::from(matches!(ask, Ask::Set { .. }));
        let (is_full, last_shown) = (waiting.asks.len() >= MAX_WAITING, waiting.shown.frame);
        match (waiting.asks.back_mut(), ask) {
            (_, Ask::Shown { frame }) if frame > last_shown => {
                waiting.shown = Shown { frame, at: Some(Instant::now()) };
            }
            (_, Ask::Shown { .. }) => {}
            (Some(Ask::Set { sets: old, moving: was }), Ask::Set { sets, moving }) if old.len() < MAX_JOINED => {
                join(old, sets);
                *was = moving;
            }
            (Some(last @ Ask::Probe { .. }), ask @ Ask::Probe { .. }) => *last = ask,
            _ if is_full => return false,
            (_, ask) => waiting.asks.push_back(ask),
        }
        self.arrived.notify_all();
        true
    }

    /// Ends the session: work under way stops.
    pub fn close(&self) {
        lock(&self.waiting).closed = true;
        self.changes.fetch_add(1, Ordering::Relaxed);
        self.arrived.notify_all();
    }

    /// Whether the session has ended.
    pub fn is_closed(&self) -> bool {
        lock(&self.waiting).closed
    }

    /// How many changes there were so far.
    pub fn changes(&self) -> u64 {
        self.changes.load(Ordering::Relaxed)
    }

    /// Everything that waits. Waits up to `patience` for anything to come.
    pub fn take(&self, patience: Duration) -> Taken {
        let mut waiting = lock(&self.waiting);
        if patience > Duration::ZERO && waiting.asks.is_empty() && !waiting.closed {
            let shown = waiting.shown;
            let idle = |w: &mut Waiting| w.asks.is_empty() && !w.closed && w.shown == shown;
            let waited = self.arrived.wait_timeout_while(waiting, patience, idle);
            waiting = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
        let asks = waiting.asks.drain(..).collect();
        Taken { asks, shown: waiting.shown, changes: self.changes(), sets: waiting.sets }
    }
}

/// Later sets take the place of earlier ones of the same key.
fn join(old: &mut Vec<String>, new: Vec<String>) {
    let key = |set: &str| set.split_once('=').map_or(set, |(key, _)| key).to_owned();
    for set in new {
        old.retain(|o| key(o) != key(&set));
        old.push(set);
    }
}

/// What a tab is sent; a thread of its own writes, so nobody waits for a slow line.
pub struct Outbox {
    unsent: Mutex<Unsent>,
    arrived: Condvar,
    stream: TcpStream,
    /// Held while a message is written: the reader answers pings on the same stream.
    writing: Arc<Mutex<()>>,
}

#[derive(Default)]
struct Unsent {
    messages: VecDeque<Message>,
    closed: bool,
}

impl Outbox {
    /// An outbox for the stream, and the thread that empties it.
    pub fn start(stream: &TcpStream) -> std::io::Result<(Arc<Self>, std::thread::JoinHandle<()>)> {
        let outbox = Arc::new(Self {
            unsent: Mutex::default(),
            arrived: Condvar::new(),
            stream: stream.try_clone()?,
            writing: Arc::default(),
        });
        let (writer, socket) = (outbox.clone(), stream.try_clone()?);
        let thread = std::thread::Builder::new().name("writer".to_owned()).spawn(move || writer.write_all(socket))?;
        Ok((outbox, thread))
    }

    /// Sends JSON.
    pub fn say(&self, value: &serde_json::Value) {
        self.send(Message::text(value.to_string()));
    }

    /// Sends bytes under a JSON header: its length in 4 bytes, low ones first, the header, the bytes.
    pub fn send_bytes(&self, header: &serde_json::Value, bytes: &[u8]) {
        let header = header.to_string();
        let mut message = Vec::with_capacity(4 + header.len() + bytes.len());
        message.extend((header.len() as u32).to_le_bytes());
        message.extend(header.as_bytes());
        message.extend(bytes);
        self.send(Message::binary(message));
    }

    fn send(&self, message: Message) {
        let mut unsent = lock(&self.unsent);
        if unsent.messages.len() >= MAX_UNSENT {
            unsent.closed = true;
        }
        if !unsent.closed {
            unsent.messages.push_back(message);
        }
        self.arrived.notify_all();
    }

    /// Sends what waits, says good-bye, and ends.
    pub fn close(&self) {
        lock(&self.unsent).closed = true;
        self.arrived.notify_all();
    }

    fn write_all(&self, socket: TcpStream) {
        let mut socket = WebSocket::from_raw_socket(socket, Role::Server, Some(socket_config()));
        let mut last = Instant::now();
        loop {
            let (message, closed) = self.next();
            let sent = match message {
                Some(message) => self.write(&mut socket, message),
                None if closed => break,
                None if last.elapsed() >= PING => {
                    last = Instant::now();
                    self.write(&mut socket, Message::Ping(tungstenite::Bytes::new()))
                }
                None => true,
            };
            if !sent {
                break;
            }
        }
        self.close();
        let _ = self.write(&mut socket, Message::Close(None));
        // The reader wakes up.
        let _ = self.stream.shutdown(Shutdown::Both);
    }

    fn next(&self) -> (Option<Message>, bool) {
        let mut unsent = lock(&self.unsent);
        if unsent.messages.is_empty() && !unsent.closed {
            let idle = |u: &mut Unsent| u.messages.is_empty() && !u.closed;
            let waited = self.arrived.wait_timeout_while(unsent, Duration::from_secs(1), idle);
            unsent = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
        (unsent.messages.pop_front(), unsent.closed)
    }

    fn write(&self, socket: &mut WebSocket<TcpStream>, message: Message) -> bool {
        let _whole = lock(&self.writing);
        socket.send(message).is_ok()
    }

    /// The reading side of the socket: what the protocol answers on its own (pings, good-byes) goes between the writer's messages.
    pub fn reader(&self, stream: TcpStream) -> WebSocket<Reader> {
        let reader = Reader { stream, writing: self.writing.clone() };
        WebSocket::from_raw_socket(reader, Role::Server, Some(socket_config()))
    }
}

/// A stream whose writes wait for the writer's message to be whole.
pub struct Reader {
    stream: TcpStream,
    writing: Arc<Mutex<()>>,
}

impl Read for Reader {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        self.stream.read(buffer)
    }
}

impl Write for Reader {
    fn write(&mut self, buffer: &[u8]) -> std::io::Result<usize> {
        let _whole = lock(&self.writing);
        self.stream.write_all(buffer).map(|()| buffer.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}
