//! One tab: its thread reads what is asked for, a second one works (`studio`), a third one writes (`channel`).

use std::net::TcpStream;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use serde_json::json;
use tungstenite::{Error as SocketError, Message};

use super::channel::{Inbox, Outbox};
use super::message::{Ask, Upload};
use super::studio::Studio;
use super::uploads::Uploads;
use super::{Held, House, MAX_TABS};
use crate::error::Error;

/// A tab that is not heard of for so long is gone: browsers answer the pings that come every ten seconds.
const SILENCE: Duration = Duration::from_secs(45);

/// Longest text of a request, bytes: a config.
const MAX_TEXT: usize = 4 << 20;

/// Serves a websocket until the tab is gone or the house closes.
pub fn run(stream: TcpStream, house: &Arc<House>) {
    let Ok((outbox, writer)) = Outbox::start(&stream) else { return };
    match Held::one(house, |house| &house.tabs, MAX_TABS) {
        Some(_tab) => serve(stream, house, &outbox),
        None => {
            let what = format!("expected at most {MAX_TABS} tabs at a time, found another: close one and reload this");
            outbox.say(&json!({"is": "refused", "text": what}));
        }
    }
    outbox.close();
    let _ = writer.join();
}

fn serve(stream: TcpStream, house: &Arc<House>, outbox: &Arc<Outbox>) {
    let inbox = Arc::new(Inbox::default());
    let number = house.next_session.fetch_add(1, Ordering::Relaxed);
    let mut uploads = Uploads::new(house, number);
    let worker = {
        let (house, inbox, outbox) = (house.clone(), inbox.clone(), outbox.clone());
        let work = move || {
            let _end = EndOfWork(outbox.clone(), inbox.clone());
            Studio::new(house, inbox, outbox).run();
        };
        std::thread::Builder::new().name("studio".to_owned()).spawn(work)
    };
    if let Ok(worker) = worker {
        // Short, so that a closing house is noticed.
        if stream.set_read_timeout(Some(Duration::from_millis(200))).is_ok() {
            listen(stream, house, outbox, &inbox, &mut uploads);
        }
        inbox.close();
        let _ = worker.join();
    }
    uploads.remove();
}

/// Tells the tab where the worker ended by itself, which only a mistake of the program makes it do.
struct EndOfWork(Arc<Outbox>, Arc<Inbox>);

impl Drop for EndOfWork {
    fn drop(&mut self) {
        if std::thread::panicking() {
            let text = "the program made a mistake and this session ended: reload the page to go on";
            self.0.say(&json!({"is": "refused", "text": text}));
        }
        self.1.close();
        self.0.close();
    }
}

/// Reads until the tab or the house ends.
fn listen(stream: TcpStream, house: &House, outbox: &Outbox, inbox: &Inbox, uploads: &mut Uploads) {
    let mut socket = outbox.reader(stream);
    let mut heard = Instant::now();
    while !house.closing.load(Ordering::Relaxed) && !inbox.is_closed() && heard.elapsed() < SILENCE {
        let asked = match socket.read() {
            Ok(Message::Text(text)) if text.len() > MAX_TEXT => {
                Err(Error::input("message", format!("expected at most {MAX_TEXT} bytes of text, found {}", text.len())))
            }
            Ok(Message::Text(text)) => Ask::parse(text.as_str()).map(Some),
            Ok(Message::Binary(bytes)) => Upload::parse(&bytes).and_then(|upload| uploads.take(&upload)),
            Ok(Message::Close(_)) => break,
            Ok(_) => Ok(None),
            Err(SocketError::Io(e))
                if matches!(e.kind(), std::io::ErrorKind::WouldBlock | std::io::ErrorKind::TimedOut) =>
            {
                continue;
            }
            Err(SocketError::Capacity(e)) => {
                outbox.say(
                    &json!({"is": "refused", "text": format!("message: expected one of bounded size, found: {e}")}),
                );
                drain(socket.get_mut());
                break;
            }
            Err(_) => break,
        };
        heard = Instant::now();
        match asked {
            Ok(Some(ask)) => {
                if !inbox.push(ask) {
                    say_error(outbox, "requests: expected a few at a time, found too many");
                }
            }
            Ok(None) => {}
            Err(e) => say_error(outbox, &e.to_string()),
        }
    }
}

/// Lets a tab say the rest of what is not listened to, for some seconds: a connection that is closed on it would take back what the tab
/// was told.
fn drain(stream: &mut impl std::io::Read) {
    let (started, mut heard) = (Instant::now(), Instant::now());
    let mut rest = vec![0u8; 64 << 10];
    while started.elapsed() < Duration::from_secs(10) && heard.elapsed() < Duration::from_secs(1) {
        match stream.read(&mut rest) {
            Ok(0) => break,
            Ok(_) => heard = Instant::now(),
            Err(e) if matches!(e.kind(), std::io::ErrorKind::WouldBlock | std::io::ErrorKind::TimedOut) => {}
            Err(_) => break,
        }
    }
}

fn say_error(outbox: &Outbox, text: &str) {
    outbox.say(&json!({"is": "error", "text": text}));
}
