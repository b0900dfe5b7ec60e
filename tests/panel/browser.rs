//! A browser for the tests: Chromium without a window, which they control by the DevTools protocol.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;

use data_encoding::BASE64;
use lager_tests::wait_for;
use serde_json::{Value, json};
use tungstenite::{Message, WebSocket};

/// A browser and its profile, which is removed when this is dropped.
pub(crate) struct Browser {
    child: Child,
    profile: PathBuf,
    /// The port of its DevTools protocol.
    port: u16,
}

impl Browser {
    /// Starts a browser.
    ///
    /// # Panics
    /// When Chromium is missing: `tests/run` installs it.
    pub(crate) fn new() -> Self {
        static BROWSERS: AtomicU32 = AtomicU32::new(0);
        let number = BROWSERS.fetch_add(1, Ordering::Relaxed);
        let profile = format!("lager-browser-{}-{number}", std::process::id());
        let profile = std::env::temp_dir().join(profile);
        let mut command = Command::new("chromium");
        command
            .args([
                "--headless=new",
                "--disable-gpu",
                "--disable-quic",
                "--disable-sync",
                "--no-first-run",
                // It must not talk to anybody but the panel.
                "--disable-background-networking",
                "--disable-component-update",
                "--remote-debugging-port=0",
                "--window-size=1280,720",
                // Its pages are in English, whatever the language of this machine is.
                "--accept-lang=en-US",
            ])
            .arg(format!("--user-data-dir={}", profile.display()))
            .arg("about:blank")
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped());
        if rustix::process::geteuid().is_root() {
            // Chromium refuses its sandbox to root.
            command.arg("--no-sandbox");
        }
        let mut child = command
            .spawn()
            .unwrap_or_else(|error| panic!("chromium: {error}; `tests/run` installs it"));
        let mut said = BufReader::new(child.stderr.take().expect("a pipe")).lines();
        let port = said
            .by_ref()
            .map_while(Result::ok)
            .find_map(|line| {
                let (_, rest) = line.split_once("DevTools listening on ws://127.0.0.1:")?;
                rest.split('/').next()?.parse().ok()
            })
            .expect("a browser that says where it listens");
        // A thread reads the rest of its output, so that it never waits for a reader.
        std::thread::spawn(move || said.for_each(drop));
        Self {
            child,
            profile,
            port,
        }
    }

    /// Opens a page with this address.
    pub(crate) fn page(&self, url: &str) -> Page {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).expect("a browser");
        write!(
            stream,
            "PUT /json/new?about:blank HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"
        )
        .expect("a browser that listens");
        // The browser keeps the connection open even if it is asked to close it.
        let mut answer = BufReader::new(stream);
        let mut length = 0;
        loop {
            let mut line = String::new();
            answer.read_line(&mut line).expect("a head");
            let line = line.trim_end().to_ascii_lowercase();
            if let Some(given) = line.strip_prefix("content-length:") {
                length = given.trim().parse().expect("a length");
            }
            if line.is_empty() {
                break;
            }
        }
        let mut body = vec![0; length];
        answer.read_exact(&mut body).expect("a body");
        let target: Value = serde_json::from_slice(&body).expect("JSON");
        let at = target["webSocketDebuggerUrl"].as_str().expect("an address");
        let stream = TcpStream::connect(("127.0.0.1", self.port)).expect("a browser");
        stream
            .set_read_timeout(Some(lager_tests::WATCHDOG))
            .expect("a socket");
        let (socket, _) = tungstenite::client(at, stream).expect("a page's socket");
        let mut page = Page {
            socket,
            number: 0,
            paused: Vec::new(),
        };
        page.call("Page.enable", &json!({}));
        // Several pages may be open, and each behaves as if it were in front.
        page.call(
            "Emulation.setFocusEmulationEnabled",
            &json!({ "enabled": true }),
        );
        page.call("Page.navigate", &json!({ "url": url }));
        page
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
        // Its other processes write for a moment longer.
        for _ in 0..100 {
            let removed = std::fs::remove_dir_all(&self.profile);
            if removed.is_ok() || !self.profile.exists() {
                break;
            }
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

/// An open page.
pub(crate) struct Page {
    socket: WebSocket<TcpStream>,
    number: u64,
    /// Requests of the page that wait for what a test does with them (`Fetch.enable`).
    paused: Vec<String>,
}

impl Page {
    /// Closes the page, as a person closes a tab.
    pub(crate) fn close(mut self) {
        self.call("Page.close", &json!({}));
    }

    /// Calls a method of the DevTools protocol.
    pub(crate) fn call(&mut self, method: &str, params: &Value) -> Value {
        self.number += 1;
        let number = self.number;
        let call = json!({ "id": number, "method": method, "params": params });
        self.socket
            .send(Message::text(call.to_string()))
            .expect("a page that listens");
        loop {
            let said = self.read();
            if said["id"] == number {
                // The answer is lost with the page that gave it.
                let message = said["error"]["message"].as_str().unwrap_or_default();
                if method == "Runtime.evaluate" && message.contains("navigated") {
                    return json!({ "result": {} });
                }
                assert!(said["error"].is_null(), "{method}: {said}");
                return said["result"].clone();
            }
        }
    }

    /// The next thing that the browser says.
    fn read(&mut self) -> Value {
        loop {
            let Message::Text(text) = self.socket.read().expect("a page that answers") else {
                continue;
            };
            let said: Value = serde_json::from_str(&text).expect("JSON");
            if said["method"] == "Fetch.requestPaused" {
                let id = said["params"]["requestId"].as_str().expect("a request");
                self.paused.push(id.to_owned());
            }
            return said;
        }
    }

    /// Answers the page's next request that waits with this status and nothing else, or not at all.
    pub(crate) fn answer_next(&mut self, status: Option<u32>) {
        let id = loop {
            match self.paused.pop() {
                Some(id) => break id,
                None => drop(self.read()),
            }
        };
        if let Some(status) = status {
            let params = json!({ "requestId": id, "responseCode": status });
            self.call("Fetch.fulfillRequest", &params);
        }
    }

    /// The value of a JavaScript expression in the page; null if the page is left meanwhile.
    pub(crate) fn value(&mut self, expression: &str) -> Value {
        let params = json!({ "expression": expression, "returnByValue": true });
        let said = self.call("Runtime.evaluate", &params);
        assert!(said["exceptionDetails"].is_null(), "{expression}: {said}");
        said["result"]["value"].clone()
    }

    /// The text of the first element that matches.
    pub(crate) fn text(&mut self, selector: &str) -> String {
        let value = self.value(&format!(
            "document.querySelector({})?.textContent ?? ''",
            json!(selector)
        ));
        value.as_str().unwrap_or_default().to_owned()
    }

    /// Waits until an element's text contains `words`.
    pub(crate) fn wait_for(&mut self, selector: &str, words: &str) {
        wait_for(&format!("{selector} to say {words:?}"), || {
            self.text(selector).contains(words).then_some(())
        });
    }

    /// Waits until an expression of the page is true. While the page loads, parts that the expression
    /// names may be missing: then it is not true yet.
    pub(crate) fn wait_until(&mut self, expression: &str) {
        let once_loaded = format!(
            "(() => {{ try {{ return ({expression}); }} \
             catch (missing) {{ if (document.readyState === 'loading') return false; throw missing; }} }})()"
        );
        wait_for(expression, || {
            (self.value(&once_loaded) == true).then_some(())
        });
    }

    /// Orders goods until an expression of the page is true. What came too late is refused, and so is
    /// a press on an old picture; then a person orders again.
    pub(crate) fn order(&mut self, goods: &str, expression: &str) {
        self.do_until(expression, |page| {
            page.fill("#goods", goods);
            page.click("#fetch button");
        });
    }

    /// Whether the robot fetches these goods, as an expression of the page.
    pub(crate) fn fetches(goods: &str) -> String {
        format!("document.querySelector('#order-number').textContent.includes('{goods}')")
    }

    /// The middle of the first element that matches, in pixels.
    pub(crate) fn middle(&mut self, selector: &str) -> (f64, f64) {
        let place = self.value(&format!(
            "(() => {{ const element = document.querySelector({}); \
             element.scrollIntoView({{ block: 'nearest' }}); \
             const box = element.getBoundingClientRect(); \
             return [box.x + box.width / 2, box.y + box.height / 2]; }})()",
            json!(selector)
        ));
        (place[0].as_f64().expect("x"), place[1].as_f64().expect("y"))
    }

    /// Opens the view of a tab, and waits until its script is there.
    pub(crate) fn open_view(&mut self, tab: &str) {
        self.click(&format!("#tab-{tab}"));
        self.wait_until("!document.querySelector('[role=tabpanel]:not([hidden])').inert");
    }

    /// Changes the page's language, and waits until its words are there.
    pub(crate) fn change_language(&mut self) {
        let before = self.value("document.documentElement.lang");
        self.click("#language");
        self.wait_until(&format!("document.documentElement.lang !== {before}"));
    }

    /// Lets the page save files into this folder.
    pub(crate) fn save_into(&mut self, folder: &Path) {
        let params = json!({ "behavior": "allow", "downloadPath": folder });
        self.call("Browser.setDownloadBehavior", &params);
    }

    /// Presses or lets go of the mouse.
    pub(crate) fn mouse(&mut self, kind: &str, (x, y): (f64, f64)) {
        let params = json!({ "type": kind, "x": x, "y": y, "button": "left", "clickCount": 1 });
        self.call("Input.dispatchMouseEvent", &params);
    }

    /// Clicks on an element.
    pub(crate) fn click(&mut self, selector: &str) {
        let at = self.settled(|page| page.middle(selector));
        self.click_at(at);
    }

    /// Clicks until an expression of the page is true. What came too late is refused, and then a
    /// person clicks again.
    pub(crate) fn click_until(&mut self, selector: &str, expression: &str) {
        self.do_until(expression, |page| page.click(selector));
    }

    /// Does something again and again, with 5 s after each time, until an expression is true.
    fn do_until(&mut self, expression: &str, mut act: impl FnMut(&mut Self)) {
        wait_for(expression, || {
            act(self);
            for _ in 0..100 {
                if self.value(expression) == true {
                    return Some(());
                }
                std::thread::sleep(Duration::from_millis(50));
            }
            None
        });
    }

    /// A place once it has not moved for a moment, or after 2 s: what has just been shown moves what
    /// stands below it.
    pub(crate) fn settled(&mut self, place: impl Fn(&mut Self) -> (f64, f64)) -> (f64, f64) {
        let mut at = place(self);
        for _ in 0..40 {
            std::thread::sleep(Duration::from_millis(50));
            let now = place(self);
            if std::mem::replace(&mut at, now) == now {
                break;
            }
        }
        at
    }

    /// Clicks at a point in pixels.
    pub(crate) fn click_at(&mut self, at: (f64, f64)) {
        self.mouse("mouseMoved", at);
        self.mouse("mousePressed", at);
        self.mouse("mouseReleased", at);
    }

    /// Clicks at a point of the warehouse, in mm from node (0, 0).
    pub(crate) fn click_at_mm(&mut self, right: f64, up: f64) {
        // After a view has opened, the map gets its final size some frames later.
        std::thread::sleep(Duration::from_millis(100));
        let at = self.settled(|page| page.place_of_mm(right, up));
        self.click_at(at);
    }

    /// The pixels of a point of the floor.
    pub(crate) fn place_of_mm(&mut self, right: f64, up: f64) -> (f64, f64) {
        let at = self.value(&format!(
            "(() => {{ const map = document.querySelector('#map'); \
             const at = new DOMPoint({right}, -{up}).matrixTransform(map.getScreenCTM()); \
             return [at.x, at.y]; }})()"
        ));
        (at[0].as_f64().expect("x"), at[1].as_f64().expect("y"))
    }

    /// Shows the page in a theme and a size.
    pub(crate) fn dress(&mut self, theme: &str, width: u32, height: u32, in_hand: bool) {
        let size = json!({
            "width": width, "height": height, "deviceScaleFactor": 1, "mobile": in_hand,
        });
        self.call("Emulation.setDeviceMetricsOverride", &size);
        let theme = json!({ "features": [{ "name": "prefers-color-scheme", "value": theme }] });
        self.call("Emulation.setEmulatedMedia", &theme);
    }

    /// A picture of the page, as PNG.
    pub(crate) fn picture(&mut self) -> Vec<u8> {
        let said = self.call("Page.captureScreenshot", &json!({ "format": "png" }));
        let text = said["data"].as_str().expect("a picture");
        BASE64.decode(text.as_bytes()).expect("base 64")
    }

    /// Puts a finger on an element, or takes it away (`touchStart`, `touchEnd`, `touchCancel`).
    pub(crate) fn touch(&mut self, kind: &str, selector: &str) {
        let (x, y) = self.middle(selector);
        let points = if kind == "touchStart" {
            json!([{ "x": x, "y": y }])
        } else {
            json!([])
        };
        let params = json!({ "type": kind, "touchPoints": points });
        self.call("Input.dispatchTouchEvent", &params);
    }

    /// Presses a key.
    pub(crate) fn key_down(&mut self, key: &str) {
        self.key("keyDown", key);
    }

    /// Releases a key.
    pub(crate) fn key_up(&mut self, key: &str) {
        self.key("keyUp", key);
    }

    fn key(&mut self, kind: &str, key: &str) {
        let params = json!({ "type": kind, "key": key, "code": key });
        self.call("Input.dispatchKeyEvent", &params);
    }

    /// Presses and releases the Tab key, which moves to the next element in the tab order.
    pub(crate) fn tab(&mut self) {
        let params = json!({ "type": "rawKeyDown", "key": "Tab", "code": "Tab", "windowsVirtualKeyCode": 9 });
        self.call("Input.dispatchKeyEvent", &params);
        self.key_up("Tab");
    }

    /// From now on keeps the page's messages to the panel in `sent`, and its socket in `tapped`.
    pub(crate) fn listen_in(&mut self) {
        self.value(
            "window.sent = []; (() => { const send = WebSocket.prototype.send; \
             WebSocket.prototype.send = function (text) { \
               window.tapped = this; sent.push(text); return send.call(this, text); \
             }; })()",
        );
        self.wait_until("window.tapped !== undefined");
    }

    /// The page's commands to wheels and arm since the last call, without numbers and times.
    pub(crate) fn moves(&mut self) -> Vec<String> {
        let sent = self.value(
            "sent.splice(0).map((line) => line.split(' ')).filter(([verb, , , , what]) => \
             verb === 'do' && ['drive', 'arm'].includes(what)).map((words) => words.slice(4).join(' '))",
        );
        let sent = sent.as_array().expect("a list").iter();
        sent.map(|line| line.as_str().expect("a line").to_owned())
            .collect()
    }

    /// Fills in the last field that matches, as a person who then leaves it.
    pub(crate) fn fill(&mut self, selector: &str, value: &str) {
        self.value(&format!(
            "(() => {{ const field = [...document.querySelectorAll({})].at(-1); field.value = {}; \
             for (const name of ['input', 'change']) field.dispatchEvent(new Event(name, {{ bubbles: true }})); }})()",
            json!(selector),
            json!(value)
        ));
    }

    /// Waits a little, for changes that cannot be seen.
    pub(crate) fn pause(&mut self) {
        std::thread::sleep(Duration::from_millis(150));
    }
}
