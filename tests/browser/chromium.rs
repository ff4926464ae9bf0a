//! Headless Chromium, driven over its debugging pipe: one page to load, ask, click and look at.
//!
//! The protocol's messages are JSON with a zero byte behind each. The pipe needs no port and no package, and Chromium
//! ends with it, so nothing is left behind by a test that was killed.

use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::rc::Rc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

/// Longest wait for an answer: many times what a busy machine needs, so that only a browser that hangs reaches it.
const PATIENCE: Duration = Duration::from_secs(60);

/// The program: `CHROMIUM`, or the first of its usual names on the path.
fn program() -> Option<PathBuf> {
    if let Some(named) = std::env::var_os("CHROMIUM").filter(|named| !named.is_empty()) {
        let named = PathBuf::from(named);
        assert!(named.is_file(), "CHROMIUM: expected the path of a Chromium, found {}", named.display());
        return Some(named);
    }
    let names = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome"];
    let folders: Vec<PathBuf> = std::env::split_paths(&std::env::var_os("PATH")?).collect();
    names.iter().flat_map(|name| folders.iter().map(move |folder| folder.join(name))).find(|path| path.is_file())
}

/// Whether a sandbox can be had: Chromium refuses to run as root in one.
fn is_root() -> bool {
    use std::os::unix::fs::MetadataExt;
    std::fs::metadata("/proc/self").is_ok_and(|process| process.uid() == 0)
}

/// A browser that runs, and goes when this does.
pub struct Browser {
    wire: Rc<RefCell<Wire>>,
    child: Child,
    _profile: tempfile::TempDir,
}

impl Browser {
    /// Starts Chromium. `None`, with a line that says so, where there is none; with `BROWSER_TESTS=required`, as in CI, that
    /// fails the test instead.
    pub fn start() -> Option<Self> {
        let Some(program) = program() else {
            let what = "expected a Chromium on the path or in CHROMIUM, found none; install it, on Debian and Ubuntu by \
                        `apt-get update && apt-get install -y chromium`";
            assert!(std::env::var_os("BROWSER_TESTS").is_none_or(|v| v != "required"), "browser tests: {what}");
            eprintln!("skipped: browser tests: {what}");
            return None;
        };
        let profile = tempfile::tempdir().unwrap();
        let mut child = command(&program, profile.path()).spawn().unwrap();
        let wire = Wire::new(child.stdin.take().unwrap(), child.stdout.take().unwrap());
        let wire = Rc::new(RefCell::new(wire));
        wire.borrow_mut().call(None, "Browser.getVersion", json!({}));
        Some(Self { wire, child, _profile: profile })
    }

    /// A new empty page of 1000 × 800 pixels that writes down what it asks of the network.
    pub fn page(&self) -> Page {
        let mut wire = self.wire.borrow_mut();
        let target = wire.call(None, "Target.createTarget", json!({"url": "about:blank"}));
        let asked = json!({"targetId": target["targetId"], "flatten": true});
        let session = wire.call(None, "Target.attachToTarget", asked)["sessionId"].as_str().unwrap().to_owned();
        drop(wire);
        let page = Page { wire: self.wire.clone(), session, held: Cell::new(0) };
        for domain in ["Page", "Runtime", "Network", "Log", "DOM", "Accessibility"] {
            page.call(&format!("{domain}.enable"), json!({}));
        }
        page.call("Emulation.setFocusEmulationEnabled", json!({"enabled": true}));
        page.resize(1000, 800);
        page
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Chromium reads its pipe from descriptor 3 and writes it to 4; the shell puts stdin and stdout there.
fn command(program: &Path, profile: &Path) -> Command {
    let mut command = Command::new("sh");
    command.args(["-c", "exec \"$0\" \"$@\" 3<&0 4>&1"]).arg(program);
    command.args(["--headless=new", "--remote-debugging-pipe", "--disable-gpu", "--disable-dev-shm-usage"]);
    command.args(["--no-first-run", "--disable-extensions", "--disable-background-networking", "--mute-audio"]);
    // Colours as they are in the page, whatever screen the machine believes to have.
    command.args(["--force-color-profile=srgb", "--force-device-scale-factor=1", "--hide-scrollbars"]);
    if is_root() {
        command.arg("--no-sandbox");
    }
    let mut profile_is = std::ffi::OsString::from("--user-data-dir=");
    profile_is.push(profile);
    command.arg(profile_is).arg("about:blank");
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null());
    command
}

/// Messages to and from the browser.
struct Wire {
    stdin: ChildStdin,
    messages: Receiver<Value>,
    last_id: u64,
    /// What happened, by session, oldest first.
    events: VecDeque<(Option<String>, Value)>,
}

impl Wire {
    fn new(stdin: ChildStdin, stdout: ChildStdout) -> Self {
        let (sender, messages) = channel();
        std::thread::spawn(move || {
            let mut pipe = BufReader::new(stdout);
            let mut message = Vec::new();
            while pipe.read_until(0, &mut message).is_ok_and(|n| n > 0) {
                message.pop();
                let Ok(value) = serde_json::from_slice(&message) else { break };
                if sender.send(value).is_err() {
                    break;
                }
                message.clear();
            }
        });
        Self { stdin, messages, last_id: 0, events: VecDeque::new() }
    }

    /// The result of a command; events that come before it are kept.
    #[track_caller]
    fn call(&mut self, session: Option<&str>, method: &str, params: Value) -> Value {
        self.last_id += 1;
        let mut message = json!({"id": self.last_id, "method": method, "params": params});
        if let Some(session) = session {
            message["sessionId"] = json!(session);
        }
        let mut bytes = serde_json::to_vec(&message).unwrap();
        bytes.push(0);
        self.stdin.write_all(&bytes).and_then(|()| self.stdin.flush()).unwrap_or_else(|e| panic!("{method}: {e}"));
        let until = Instant::now() + PATIENCE;
        loop {
            let mut message = self.next(until).unwrap_or_else(|| panic!("{method}: no answer in {PATIENCE:?}"));
            if message["id"] == json!(self.last_id) {
                assert!(message.get("error").is_none(), "{method}: {}", message["error"]);
                return message["result"].take();
            }
            self.keep(message);
        }
    }

    fn next(&self, until: Instant) -> Option<Value> {
        match self.messages.recv_timeout(until.saturating_duration_since(Instant::now())) {
            Ok(message) => Some(message),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => panic!("the browser ended"),
        }
    }

    fn keep(&mut self, message: Value) {
        if message.get("method").is_some() {
            self.events.push_back((message["sessionId"].as_str().map(str::to_owned), message));
        }
    }
}

/// A page of the browser.
pub struct Page {
    wire: Rc<RefCell<Wire>>,
    session: String,
    /// Modifier keys that are held: 8 is Shift.
    held: Cell<u32>,
}

/// Shift, as a modifier of the protocol.
const SHIFT: u32 = 8;

impl Page {
    /// Any command of the protocol, and its result.
    #[track_caller]
    pub fn call(&self, method: &str, params: Value) -> Value {
        self.wire.borrow_mut().call(Some(&self.session), method, params)
    }

    /// Loads `url` and waits until it is loaded.
    #[track_caller]
    pub fn open(&self, url: &str) {
        let went = self.call("Page.navigate", json!({"url": url}));
        assert!(went.get("errorText").is_none(), "{url}: {went}");
        self.wait_for("document.readyState === 'complete' && location.href !== 'about:blank'");
    }

    /// The value of a JavaScript expression, a promise's when it is kept; an exception fails the test.
    #[track_caller]
    pub fn evaluate(&self, expression: &str) -> Value {
        let asked = json!({"expression": expression, "awaitPromise": true, "returnByValue": true});
        let mut answer = self.call("Runtime.evaluate", asked);
        assert!(answer.get("exceptionDetails").is_none(), "{expression}: {}", answer["exceptionDetails"]);
        answer["result"]["value"].take()
    }

    /// Waits until an expression is true.
    #[track_caller]
    pub fn wait_for(&self, expression: &str) {
        let until = Instant::now() + PATIENCE;
        while self.evaluate(&format!("!!({expression})")) != Value::Bool(true) {
            assert!(Instant::now() < until, "not within {PATIENCE:?}: {expression}");
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    /// Waits until two frames have been painted: what was asked for before is seen.
    pub fn settle(&self) {
        self.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => done(1))))");
    }

    /// Presses and releases a key, by its name: `a`, `1`, `ArrowLeft`, `Escape`, `Tab`, `Shift`, ` `.
    pub fn key(&self, name: &str) {
        self.key_down(name);
        self.key_up(name);
    }

    /// Presses a key and holds it.
    pub fn key_down(&self, name: &str) {
        if name == "Shift" {
            self.held.set(self.held.get() | SHIFT);
        }
        self.key_event(if name.chars().count() == 1 || name == "Enter" { "keyDown" } else { "rawKeyDown" }, name);
        self.settle();
    }

    /// Releases a key.
    pub fn key_up(&self, name: &str) {
        if name == "Shift" {
            self.held.set(self.held.get() & !SHIFT);
        }
        self.key_event("keyUp", name);
        self.settle();
    }

    fn key_event(&self, event: &str, name: &str) {
        let letter = name.chars().next().filter(|_| name.chars().count() == 1);
        let (code, number) = match (name, letter) {
            ("Shift", _) => ("ShiftLeft".to_owned(), 16),
            ("Tab", _) => ("Tab".to_owned(), 9),
            ("Enter", _) => ("Enter".to_owned(), 13),
            ("Escape", _) => ("Escape".to_owned(), 27),
            ("ArrowLeft", _) => (name.to_owned(), 37),
            ("ArrowUp", _) => (name.to_owned(), 38),
            ("ArrowRight", _) => (name.to_owned(), 39),
            ("ArrowDown", _) => (name.to_owned(), 40),
            ("Home", _) => (name.to_owned(), 36),
            ("End", _) => (name.to_owned(), 35),
            (_, Some(' ')) => ("Space".to_owned(), 32),
            (_, Some(c)) if c.is_ascii_digit() => (format!("Digit{c}"), u32::from(c)),
            (_, Some(c)) if c.is_ascii_alphabetic() => {
                (format!("Key{}", c.to_ascii_uppercase()), u32::from(c.to_ascii_uppercase()))
            }
            ("+", _) => ("NumpadAdd".to_owned(), 107),
            ("-", _) => ("Minus".to_owned(), 189),
            (",", _) => ("Comma".to_owned(), 188),
            (".", _) => ("Period".to_owned(), 190),
            ("[", _) => ("BracketLeft".to_owned(), 219),
            ("]", _) => ("BracketRight".to_owned(), 221),
            _ => panic!("expected the name of a key, found {name:?}"),
        };
        let mut params = json!({
            "type": event, "key": name, "code": code, "windowsVirtualKeyCode": number, "modifiers": self.held.get(),
        });
        if event == "keyDown" {
            params["text"] = json!(if name == "Enter" { "\r" } else { name });
        }
        self.call("Input.dispatchKeyEvent", params);
    }

    /// Moves the mouse, without a button held.
    pub fn mouse_move(&self, (x, y): (f64, f64)) {
        self.mouse("mouseMoved", (x, y), json!({}));
        self.settle();
    }

    /// Clicks with `left` or `right`.
    pub fn click(&self, (x, y): (f64, f64), button: &str) {
        self.mouse("mouseMoved", (x, y), json!({}));
        for event in ["mousePressed", "mouseReleased"] {
            self.mouse(event, (x, y), json!({"button": button, "clickCount": 1}));
        }
        self.settle();
    }

    /// Drags with the left button, in ten steps.
    pub fn drag(&self, from: (f64, f64), to: (f64, f64)) {
        self.mouse("mouseMoved", from, json!({}));
        self.mouse("mousePressed", from, json!({"button": "left", "buttons": 1, "clickCount": 1}));
        for step in 1..=10 {
            let along = |a: f64, b: f64| a + (b - a) * f64::from(step) / 10.0;
            self.mouse(
                "mouseMoved",
                (along(from.0, to.0), along(from.1, to.1)),
                json!({"button": "left", "buttons": 1}),
            );
        }
        self.mouse("mouseReleased", to, json!({"button": "left", "clickCount": 1}));
        self.settle();
    }

    /// Turns the wheel by `down` pixels.
    pub fn wheel(&self, at: (f64, f64), down: f64) {
        self.mouse("mouseWheel", at, json!({"deltaX": 0, "deltaY": down}));
        self.settle();
    }

    fn mouse(&self, event: &str, (x, y): (f64, f64), more: Value) {
        let mut params = json!({"type": event, "x": x, "y": y, "modifiers": self.held.get()});
        for (key, value) in more.as_object().unwrap() {
            params[key] = value.clone();
        }
        self.call("Input.dispatchMouseEvent", params);
    }

    /// The middle of the first element of a selector, scrolled into sight.
    #[track_caller]
    pub fn middle(&self, selector: &str) -> (f64, f64) {
        let quoted = json!(selector);
        let at = self.evaluate(&format!(
            "(() => {{ const e = document.querySelector({quoted}); e.scrollIntoView({{block: 'nearest'}}); \
             const r = e.getBoundingClientRect(); return [r.x + r.width / 2, r.y + r.height / 2]; }})()"
        ));
        (at[0].as_f64().unwrap(), at[1].as_f64().unwrap())
    }

    /// What the window shows.
    pub fn screenshot(&self) -> image::RgbImage {
        self.settle();
        let answer = self.call("Page.captureScreenshot", json!({"format": "png"}));
        let png = from_base64(answer["data"].as_str().unwrap());
        image::load_from_memory(&png).unwrap().to_rgb8()
    }

    /// Sets the size of the window's inside.
    pub fn resize(&self, width: u32, height: u32) {
        let size = json!({"width": width, "height": height, "deviceScaleFactor": 1, "mobile": false});
        self.call("Emulation.setDeviceMetricsOverride", size);
    }

    /// What the user's system prefers: `dark` or `light`.
    pub fn prefer(&self, scheme: &str) {
        let features = json!([{"name": "prefers-color-scheme", "value": scheme}]);
        self.call("Emulation.setEmulatedMedia", json!({"features": features}));
    }

    /// Takes the network away.
    pub fn set_offline(&self) {
        let conditions = json!({"offline": true, "latency": 0, "downloadThroughput": -1, "uploadThroughput": -1});
        self.call("Network.emulateNetworkConditions", conditions);
    }

    /// Names of events with their contents, so far, of this page; `method` is as in the protocol.
    pub fn events(&self, method: &str) -> Vec<Value> {
        // Whatever came before this answer has come.
        self.evaluate("0");
        let wire = self.wire.borrow();
        let ours = wire.events.iter().filter(|(session, _)| session.as_deref() == Some(&self.session));
        ours.filter(|(_, event)| event["method"] == method).map(|(_, event)| event["params"].clone()).collect()
    }

    /// The address of everything that the page asked for, websockets too.
    pub fn requests(&self) -> Vec<String> {
        let address = |value: &Value| value.as_str().unwrap().to_owned();
        let requests = self.events("Network.requestWillBeSent");
        let sockets = self.events("Network.webSocketCreated");
        requests
            .iter()
            .map(|e| address(&e["request"]["url"]))
            .chain(sockets.iter().map(|e| address(&e["url"])))
            .collect()
    }

    /// Exceptions that nothing caught, and errors in the console.
    pub fn errors(&self) -> Vec<String> {
        let thrown = self.events("Runtime.exceptionThrown").into_iter().map(|e| e["exceptionDetails"].to_string());
        let logged = self.events("Log.entryAdded").into_iter().map(|mut e| e["entry"].take());
        thrown.chain(logged.filter(|entry| entry["level"] == "error").map(|entry| entry.to_string())).collect()
    }
}

/// The bytes of a base64 text.
pub fn from_base64(text: &str) -> Vec<u8> {
    let digit = |c: u8| match c {
        b'A'..=b'Z' => c - b'A',
        b'a'..=b'z' => c - b'a' + 26,
        b'0'..=b'9' => c - b'0' + 52,
        b'+' => 62,
        b'/' => 63,
        _ => panic!("no digit of base64: {c}"),
    };
    let digits: Vec<u32> = text.bytes().filter(|&c| c != b'=').map(|c| u32::from(digit(c))).collect();
    let bytes = |four: &[u32]| {
        let bits = (0..4).fold(0, |bits, i| bits << 6 | four.get(i).copied().unwrap_or(0));
        bits.to_be_bytes()[1..four.len()].to_vec()
    };
    digits.chunks(4).flat_map(bytes).collect()
}
