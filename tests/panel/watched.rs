//! What it costs that somebody watches: the robot's path while ten pages are open, and a page's
//! share of a core and its memory while the robot drives.

use std::net::TcpStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use lager_tests::compare;
use serde_json::json;
use tungstenite::client::IntoClientRequest as _;

use crate::Scene;

/// Pages that watch at once.
const PAGES: usize = 10;
/// How long a page is looked at before its memory is told again.
const LOOK: Duration = Duration::from_secs(60);
/// For how many of these, unless `LAGER_SOAK_MINUTES` says so.
const LOOKS: usize = 60;

/// A page's socket without a page: somebody who watches with a processor of his own.
struct Watcher {
    over: Arc<AtomicBool>,
    bytes: Arc<AtomicU64>,
    thread: Option<JoinHandle<()>>,
}

impl Watcher {
    fn new(url: &str) -> Self {
        let host = url.trim_start_matches("http://").trim_end_matches('/');
        let stream = TcpStream::connect(host).expect("the panel");
        let mut request = format!("ws://{host}/live")
            .into_client_request()
            .expect("an address");
        let origin = format!("http://{host}").parse().expect("a header");
        request.headers_mut().insert("origin", origin);
        let (mut socket, _) = tungstenite::client(request, stream).expect("its socket");
        let (over, bytes) = (
            Arc::new(AtomicBool::new(false)),
            Arc::new(AtomicU64::new(0)),
        );
        let (until, count) = (Arc::clone(&over), Arc::clone(&bytes));
        let thread = std::thread::spawn(move || {
            while !until.load(Ordering::Relaxed) {
                let said = socket.read().expect("the panel goes on");
                count.fetch_add(said.len() as u64, Ordering::Relaxed);
            }
        });
        let thread = Some(thread);
        Self {
            over,
            bytes,
            thread,
        }
    }
}

impl Drop for Watcher {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
        let ended = self.thread.take().expect("a thread").join();
        assert!(ended.is_ok() && self.bytes.load(Ordering::Relaxed) > 0);
    }
}

#[test]
#[ignore = "it prints figures: tests/soak watched"]
fn the_path_while_ten_pages_watch() {
    let scene = Scene::new(1.0, &["--mission", "1,2,3"]);
    let page = scene.page();
    drop(page);
    compare(&scene.domain, "ten pages elsewhere", || {
        let watchers: Vec<_> = (0..PAGES).map(|_| Watcher::new(&scene.url)).collect();
        // What has happened before is told in the first moments.
        std::thread::sleep(Duration::from_secs(1));
        watchers
    });
    compare(&scene.domain, "ten tabs of a browser here", || {
        let pages: Vec<_> = (0..PAGES).map(|_| scene.page()).collect();
        std::thread::sleep(Duration::from_secs(2));
        // A page goes with its browser unless it is closed.
        Tabs(pages)
    });
    scene.end();
}

struct Tabs(Vec<crate::browser::Page>);

impl Drop for Tabs {
    fn drop(&mut self) {
        for page in &mut self.0 {
            page.call("Page.close", &json!({}));
        }
    }
}

#[test]
#[ignore = "it prints figures for an hour: tests/soak watched"]
fn what_a_page_takes_in_an_hour() {
    let scene = Scene::new(1.0, &[]);
    let mut page = scene.page();
    page.call("Performance.enable", &json!({}));
    let looks = std::env::var("LAGER_SOAK_MINUTES").map_or(LOOKS, |minutes| {
        minutes.parse().expect("LAGER_SOAK_MINUTES is a number")
    });
    println!("minute   share of a core: page   all of the browser   memory: scripts   all");
    for minute in 1..=looks {
        // It drives all the time.
        let queue = page.value("document.querySelectorAll('#queue button').length");
        if queue.as_u64() < Some(4) {
            page.click("#fetch button");
            page.click("#fetch button");
        }
        let (began, before) = (Instant::now(), scene.browser.processor_times());
        std::thread::sleep(LOOK);
        let after = scene.browser.processor_times();
        let share = |which: usize| {
            let spent = after[which] - before[which];
            spent.as_secs_f64() / began.elapsed().as_secs_f64() * 100.0
        };
        page.call("HeapProfiler.collectGarbage", &json!({}));
        let metrics = page.call("Performance.getMetrics", &json!({}));
        let metrics = metrics["metrics"].as_array().expect("metrics");
        let heap = metrics
            .iter()
            .find(|metric| metric["name"] == "JSHeapUsedSize");
        let heap = heap.and_then(|heap| heap["value"].as_f64()).expect("bytes");
        let all = scene.browser.memory();
        println!(
            "{minute:>6}   {:>19.1} %   {:>16.1} %   {:>9.2} MiB   {:>5.0} MiB",
            share(0),
            share(1),
            heap / f64::from(1 << 20),
            all as f64 / f64::from(1 << 20),
        );
    }
    drop(page);
    scene.end();
}
