//! The little of HTTP that a page and its websocket take: a request's head is read, checked, and answered once.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::sync::Arc;
use std::time::{Duration, Instant};

use tungstenite::handshake::derive_accept_key;

use super::{House, session};

/// Longest head of a request, bytes.
const MAX_HEAD: usize = 16 << 10;

/// How long a request's head may take.
const HEAD_TIME: Duration = Duration::from_secs(10);

/// The page's files: path, type, content.
const FILES: [(&str, &str, &str); 11] = [
    ("/", "text/html; charset=utf-8", include_str!("page/index.html")),
    ("/view.css", "text/css; charset=utf-8", include_str!("page/view.css")),
    ("/view.js", "text/javascript; charset=utf-8", include_str!("page/view.js")),
    ("/link.js", "text/javascript; charset=utf-8", include_str!("page/link.js")),
    ("/comparison.js", "text/javascript; charset=utf-8", include_str!("page/comparison.js")),
    ("/controls.js", "text/javascript; charset=utf-8", include_str!("page/controls.js")),
    ("/samplers.js", "text/javascript; charset=utf-8", include_str!("page/samplers.js")),
    ("/camera.js", "text/javascript; charset=utf-8", include_str!("page/camera.js")),
    ("/screen.js", "text/javascript; charset=utf-8", include_str!("page/screen.js")),
    ("/charts.js", "text/javascript; charset=utf-8", include_str!("page/charts.js")),
    ("/files.js", "text/javascript; charset=utf-8", include_str!("page/files.js")),
];

/// What a request's head says, as far as it matters.
#[derive(Debug, PartialEq)]
struct Request {
    method: String,
    /// Path without the query.
    path: String,
    token: Option<String>,
    host: Option<String>,
    origin: Option<String>,
    /// The key of a request for a websocket.
    key: Option<String>,
}

/// Why a request is refused: status and message.
type Refusal = (&'static str, String);

/// Reads one request and answers it; a websocket lives on in this thread.
pub fn serve(mut stream: TcpStream, house: &Arc<House>) {
    let set_up = || -> std::io::Result<()> {
        stream.set_nonblocking(false)?;
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(Duration::from_secs(2)))?;
        stream.set_write_timeout(Some(Duration::from_secs(20)))
    };
    if set_up().is_err() {
        return;
    }
    match read_head(&mut stream).and_then(|head| parse(&head)).and_then(|request| answer(&request, house)) {
        Ok(Answer::File(kind, content)) => respond(&mut stream, "200 OK", kind, content.as_bytes()),
        Ok(Answer::Upgrade(accept)) => {
            let head = format!(
                "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\
                 Sec-WebSocket-Accept: {accept}\r\n\r\n"
            );
            if stream.write_all(head.as_bytes()).is_ok() {
                session::run(stream, house);
            }
        }
        Err((status, message)) => {
            respond(&mut stream, status, "text/plain; charset=utf-8", format!("{message}\n").as_bytes());
        }
    }
}

/// Turns a connection away that there is no thread for.
pub fn refuse_busy(mut stream: &TcpStream) {
    let _ = stream.write_all(b"HTTP/1.1 503 Service Unavailable\r\nContent-Length: 0\r\nConnection: close\r\n\r\n");
}

enum Answer {
    File(&'static str, &'static str),
    /// A websocket, by the key it is accepted with.
    Upgrade(String),
}

/// Reads to the blank line. Nothing that is served has a body, so what follows is left.
fn read_head(stream: &mut TcpStream) -> Result<Vec<u8>, Refusal> {
    let started = Instant::now();
    let mut head = Vec::new();
    let mut part = [0u8; 2048];
    loop {
        if started.elapsed() > HEAD_TIME {
            return Err(("408 Request Timeout", "expected a request within ten seconds".to_owned()));
        }
        match stream.read(&mut part) {
            Ok(0) => return Err(("400 Bad Request", "expected a whole request, found its beginning".to_owned())),
            Ok(n) => head.extend_from_slice(&part[..n]),
            Err(e) if matches!(e.kind(), std::io::ErrorKind::WouldBlock | std::io::ErrorKind::TimedOut) => continue,
            Err(e) => return Err(("400 Bad Request", format!("expected a whole request, found: {e}"))),
        }
        if head.windows(4).any(|w| w == b"\r\n\r\n") {
            return Ok(head);
        }
        if head.len() > MAX_HEAD {
            let what = format!("expected a request's head of at most {MAX_HEAD} bytes, found more");
            return Err(("431 Request Header Fields Too Large", what));
        }
    }
}

fn parse(head: &[u8]) -> Result<Request, Refusal> {
    let bad = |what: String| ("400 Bad Request", what);
    let mut headers = [httparse::EMPTY_HEADER; 64];
    let mut request = httparse::Request::new(&mut headers);
    let parsed = request.parse(head).map_err(|e| bad(format!("expected a request of HTTP, found: {e}")))?;
    if parsed.is_partial() {
        return Err(bad("expected a whole request, found its beginning".to_owned()));
    }
    let value = |name: &str| {
        let mut found = request.headers.iter().filter(|h| h.name.eq_ignore_ascii_case(name));
        let first = found.next().and_then(|h| std::str::from_utf8(h.value).ok()).map(|v| v.trim().to_owned());
        // Given twice it is nobody's.
        first.filter(|_| found.next().is_none())
    };
    let (path, query) = request.path.unwrap_or("/").split_once('?').unwrap_or((request.path.unwrap_or("/"), ""));
    let token = query.split('&').find_map(|pair| pair.strip_prefix("token=")).map(str::to_owned);
    let wants_socket = value("upgrade").is_some_and(|v| v.eq_ignore_ascii_case("websocket"));
    Ok(Request {
        method: request.method.unwrap_or("").to_owned(),
        path: path.to_owned(),
        token,
        host: value("host"),
        origin: value("origin"),
        key: value("sec-websocket-key").filter(|_| wants_socket),
    })
}

/// What a request gets: the token is asked for at the page and at the websocket, the page's other files say nothing.
fn answer(request: &Request, house: &House) -> Result<Answer, Refusal> {
    let forbidden = |what: &str| ("403 Forbidden", what.to_owned());
    let host = request.host.as_deref().unwrap_or("");
    // The name alone: a tunnel may have another port at its far end. Another name is another site's that points here.
    let name =
        host.rsplit_once(':').filter(|(_, port)| port.bytes().all(|b| b.is_ascii_digit())).map_or(host, |(n, _)| n);
    if !["127.0.0.1", "localhost", "[::1]"].contains(&name) {
        return Err(forbidden(
            "expected the host 127.0.0.1 or localhost, found another: open the address that was printed",
        ));
    }
    if request.method != "GET" {
        return Err(("405 Method Not Allowed", format!("expected GET, found {}", request.method)));
    }
    let knows_token = request.token.as_deref().is_some_and(|t| is_same(t.as_bytes(), house.token.as_bytes()));
    if request.path == "/live" {
        let Some(key) = &request.key else {
            return Err(("426 Upgrade Required", "expected a request for a websocket, found none".to_owned()));
        };
        if request.origin.as_deref() != Some(&format!("http://{host}")) {
            return Err(forbidden("expected a page of this server, found another origin"));
        }
        if !knows_token {
            return Err(forbidden("expected the token of the address that was printed, found another or none"));
        }
        return Ok(Answer::Upgrade(derive_accept_key(key.as_bytes())));
    }
    let Some((path, kind, content)) = FILES.iter().find(|(path, ..)| *path == request.path) else {
        return Err(("404 Not Found", "expected a file of the page, found none of that name".to_owned()));
    };
    if *path == "/" && !knows_token {
        return Err(forbidden("expected the token of the address that was printed, found another or none"));
    }
    Ok(Answer::File(kind, content))
}

/// Compared in a time that does not tell how much of it was right.
fn is_same(a: &[u8], b: &[u8]) -> bool {
    a.len() == b.len() && a.iter().zip(b).fold(0, |differ, (a, b)| differ | (a ^ b)) == 0
}

/// Answers and ends the connection. The page may load from here alone, and no other page may frame or read it.
fn respond(stream: &mut TcpStream, status: &str, kind: &str, body: &[u8]) {
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {}\r\nConnection: close\r\nCache-Control: no-store\r\n\
         Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; \
         connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'\r\n\
         X-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\nCross-Origin-Resource-Policy: same-origin\r\n\r\n",
        body.len()
    );
    // A reader that has gone away has no use for an answer.
    let _ = stream.write_all(head.as_bytes()).and_then(|()| stream.write_all(body));
    let _ = stream.shutdown(std::net::Shutdown::Write);
    // What the other side still sends is read, a little: closing on it would take the answer back.
    let _ = stream.set_read_timeout(Some(Duration::from_millis(200)));
    let mut rest = [0u8; 4096];
    for _ in 0..16 {
        if !matches!(stream.read(&mut rest), Ok(n) if n > 0) {
            break;
        }
    }
}
