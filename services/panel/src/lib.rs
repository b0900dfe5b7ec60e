//! The operator panel: one page in the browser that shows the station's robots and acts on them.
//!
//! ```text
//!   browser <── files ──── Panel ──> Handle of the station ──> robots, by TCP
//!           <── socket ──>   │
//!                            └ one task for each socket: lines both ways
//! ```
//!
//! - [`Panel`]: the server, in one thread with tasks of its own.
//! - `page`: the files, embedded and packed, and `bundle`: their scripts as one, and as another one
//!   what a page needs later.
//! - `stop`: STOP by a form, which needs no script and no socket.
//! - `history`: what the station keeps of the last day, as a table or as lines.
//! - `access`: who may open the files. `lager_door` decides how many may ask, and for how long.
//! - `speech`: the lines that page and panel say to each other.
//! - `socket`: one page's conversation, and `visit`: what one page may do, has asked and has been
//!   told.
//! - `handover`: who asks whom for the wheel. [`lager_orders::Late`] finds out how late a line comes.
//!
//! The panel knows of a robot only what the station knows. It joins no bus, and has no right that
//! the station does not have. When a page's socket closes, its driver loses the wheel.

#![forbid(unsafe_code)]

mod access;
mod bundle;
mod handover;
mod history;
mod page;
mod socket;
mod speech;
mod stop;
mod visit;

use std::collections::BTreeSet;
use std::fmt;
use std::io;
use std::net::{SocketAddr, TcpListener};
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use axum::Router;
use axum::extract::{
    ConnectInfo, DefaultBodyLimit, Path, RawQuery, Request, State, WebSocketUpgrade,
};
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::{any, get, post};
use lager_door::{Door, Limits, Visitor};
use lager_lines::Name;
use lager_orders::{Code, Language, Reason};
use lager_station::{Handle, History};
use thiserror::Error;
use tokio::sync::{Semaphore, watch};

pub use access::Tokens;
use access::{Access, Rank, said};
use handover::Handover;

/// Pages that may look at once.
const MOST_PAGES: usize = 32;
/// Connections at once: those of the pages, and twice as many for their files.
const LIMITS: Limits = Limits {
    most: 96,
    whose: "the panel",
};
/// The longest message of a page, in bytes: a warehouse with all its goods.
const LONGEST_MESSAGE: usize = 64 * 1024;
/// How often the panel looks whether it should end.
const LOOK: Duration = Duration::from_millis(100);

/// Why there is no panel.
#[derive(Debug, Error)]
pub enum PanelError {
    /// The panel cannot listen at the address.
    #[error("the panel cannot listen at {address}: {error}; choose another one with --panel")]
    Listen {
        /// Which.
        address: SocketAddr,
        /// Why.
        error: io::Error,
    },
    /// The system does not let it run.
    #[error("the panel cannot run: {0}")]
    Run(#[from] io::Error),
}

/// A panel that listens and does not answer yet.
#[derive(Debug)]
pub struct Panel {
    listener: TcpListener,
    shared: Arc<Shared>,
}

/// The simulated world of one robot, in place of which another one can be made.
pub struct World {
    pub(crate) robot: Name,
    pub(crate) renew: Box<dyn Fn() -> Result<(), Reason> + Send + Sync>,
}

impl World {
    /// `renew` has the robot's supervisor stop the robot and make the world of the warehouse that
    /// the station has saved, or says why there can be no such world.
    pub fn new(
        robot: Name,
        renew: impl Fn() -> Result<(), Reason> + Send + Sync + 'static,
    ) -> Self {
        Self {
            robot,
            renew: Box::new(renew),
        }
    }
}

impl fmt::Debug for World {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_tuple("World").field(&self.robot).finish()
    }
}

/// What all its pages share.
#[derive(Debug)]
pub(crate) struct Shared {
    pub(crate) handle: Handle,
    /// What the station knows, as its revision; whoever tells a page waits for it.
    pub(crate) changes: watch::Sender<u64>,
    /// Who asks for which robot's wheel.
    pub(crate) handover: Mutex<Handover>,
    /// The simulated robot that can get another world.
    pub(crate) world: Option<World>,
    access: Access,
    /// Numbers for pages.
    pages: AtomicU32,
    /// What the open pages are called.
    names: Mutex<BTreeSet<String>>,
    open: AtomicUsize,
    /// Answers of the history that may begin.
    reads: Arc<Semaphore>,
}

impl Shared {
    fn names(&self) -> MutexGuard<'_, BTreeSet<String>> {
        self.names.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Panel {
    /// Listens at `address`, for whoever has one of the tokens.
    ///
    /// # Errors
    ///
    /// When it cannot listen at the address.
    pub fn open(address: SocketAddr, tokens: Tokens, handle: Handle) -> Result<Self, PanelError> {
        let listener =
            TcpListener::bind(address).map_err(|error| PanelError::Listen { address, error })?;
        Self::on(listener, tokens, handle)
    }

    /// Answers at a socket that listens already.
    ///
    /// # Errors
    ///
    /// When it is no socket that listens.
    pub fn on(listener: TcpListener, tokens: Tokens, handle: Handle) -> Result<Self, PanelError> {
        listener.set_nonblocking(true)?;
        let address = listener.local_addr()?;
        Ok(Self {
            listener,
            shared: Arc::new(Shared {
                handle,
                changes: watch::Sender::new(0),
                handover: Mutex::default(),
                world: None,
                access: Access::new(address, tokens),
                pages: AtomicU32::new(0),
                names: Mutex::default(),
                open: AtomicUsize::new(0),
                reads: Arc::new(Semaphore::new(history::MOST)),
            }),
        })
    }

    /// Lets pages put this simulated robot into the warehouse that the station has saved.
    #[must_use]
    pub fn with_world(mut self, world: World) -> Self {
        // No page shares it yet.
        if let Some(shared) = Arc::get_mut(&mut self.shared) {
            shared.world = Some(world);
        }
        self
    }

    /// Where it listens.
    ///
    /// # Errors
    ///
    /// When the system does not say.
    pub fn address(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }

    /// Answers until `end` is set.
    ///
    /// # Errors
    ///
    /// When the system does not let it run.
    pub fn run(self, end: &AtomicBool) -> Result<(), PanelError> {
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()?;
        let shared = Arc::clone(&self.shared);
        let served = AtomicBool::new(true);
        std::thread::scope(|scope| {
            // The station's changes are waited for in a thread: it has no tasks.
            let wait = || {
                while served.load(Ordering::Relaxed) {
                    let seen = *shared.changes.borrow();
                    let revision = shared.handle.wait(seen, LOOK);
                    if revision != seen {
                        shared.changes.send_replace(revision);
                    }
                }
            };
            std::thread::Builder::new().spawn_scoped(scope, wait)?;
            let result = self.serve(&runtime, end);
            served.store(false, Ordering::Relaxed);
            result
        })
    }

    fn serve(self, runtime: &tokio::runtime::Runtime, end: &AtomicBool) -> Result<(), PanelError> {
        runtime.block_on(async {
            let listener = tokio::net::TcpListener::from_std(self.listener)?;
            let router = Router::new()
                .route("/live", any(live))
                .route("/stop", post(stop))
                .route("/history/{what}", get(past))
                .layer(DefaultBodyLimit::max(stop::LONGEST_BODY))
                .fallback(get(file))
                .with_state(self.shared)
                .into_make_service_with_connect_info::<Visitor>();
            let ended = async {
                while !end.load(Ordering::Relaxed) {
                    tokio::time::sleep(LOOK).await;
                }
            };
            tokio::select! {
                served = axum::serve(Door::new(listener, LIMITS), router) => served,
                () = ended => Ok(()),
            }
        })?;
        Ok(())
    }
}

/// One of the page's files.
async fn file(
    State(shared): State<Arc<Shared>>,
    ConnectInfo(visitor): ConnectInfo<Visitor>,
    request: Request,
) -> Response {
    visitor.has_asked();
    let headers = request.headers();
    if host(&shared.access, headers).is_none() {
        return refuse(StatusCode::MISDIRECTED_REQUEST, Code::OtherHost);
    }
    let path = request.uri().path();
    // The token is taken out of the address, which people copy and histories keep.
    if let Some((token, rest)) = request.uri().query().and_then(taken_out) {
        if shared.access.rank(Some(token)).is_none() {
            return refuse(StatusCode::FORBIDDEN, Code::NoToken);
        }
        visitor.admit();
        // Two slashes would be somebody else's address.
        let path = format!("/{}", path.trim_start_matches('/'));
        let mut response = StatusCode::SEE_OTHER.into_response();
        let name = shared.access.cookie();
        let cookie = format!("{name}={token}; HttpOnly; SameSite=Strict; Path=/");
        for (name, value) in [
            (header::LOCATION, path + &rest),
            (header::SET_COOKIE, cookie),
        ] {
            if let Ok(value) = HeaderValue::from_str(&value) {
                response.headers_mut().insert(name, value);
            }
        }
        return guarded(response);
    }
    if rank(&shared.access, headers).is_none() {
        return refuse(StatusCode::FORBIDDEN, Code::NoToken);
    }
    visitor.admit();
    let robot = chosen(&shared.handle, request.uri().query());
    let Some((kind, content)) = page::file(path, &robot) else {
        return refuse(StatusCode::NOT_FOUND, Code::NoFile);
    };
    // A browser asks each time whether what it has is still so.
    let tag = format!("\"{}-{robot}\"", *page::EDITION);
    if text(request.headers(), &header::IF_NONE_MATCH) == Some(&tag) {
        return guarded(([(header::ETAG, tag)], StatusCode::NOT_MODIFIED).into_response());
    }
    let takes = text(request.headers(), &header::ACCEPT_ENCODING).unwrap_or_default();
    let head = [
        (header::CONTENT_TYPE, kind.to_owned()),
        (header::ETAG, tag),
        (header::VARY, "accept-encoding".to_owned()),
    ];
    guarded(match takes.contains("deflate") {
        true => {
            let packed = [(header::CONTENT_ENCODING, "deflate")];
            (head, packed, page::packed(path, &content)).into_response()
        }
        false => (head, content).into_response(),
    })
}

/// The robot that the page's address names, or the only one there is; empty: none.
fn chosen(handle: &Handle, query: Option<&str>) -> String {
    if let Some(name) = query.and_then(|query| Name::new(query).ok()) {
        return name.to_string();
    }
    match &handle.robots()[..] {
        [one] => one.name.to_string(),
        _ => String::new(),
    }
}

/// STOP by the page's form; the same doors as to the page's socket.
async fn stop(
    State(shared): State<Arc<Shared>>,
    ConnectInfo(visitor): ConnectInfo<Visitor>,
    headers: HeaderMap,
    body: String,
) -> Response {
    visitor.has_asked();
    let Some(host) = host(&shared.access, &headers) else {
        return refuse(StatusCode::MISDIRECTED_REQUEST, Code::OtherHost);
    };
    if !is_ours(&shared.access, &headers, host) {
        return refuse(StatusCode::FORBIDDEN, Code::OtherPage);
    }
    if rank(&shared.access, &headers).is_none() {
        return refuse(StatusCode::FORBIDDEN, Code::NoToken);
    }
    visitor.admit();
    let became = stop::stop(&shared.handle, &stop::by(&body), stop::names(&body)).await;
    let wants = text(&headers, &header::ACCEPT).unwrap_or_default();
    guarded(match wants.contains("text/html") {
        true => axum::response::Html(stop::page(&became)).into_response(),
        false => stop::lines(&became).into_response(),
    })
}

/// What the station keeps of the last day; the same doors as to the page's files, and no page of
/// another site gets through them.
async fn past(
    State(shared): State<Arc<Shared>>,
    ConnectInfo(visitor): ConnectInfo<Visitor>,
    Path(what): Path<String>,
    RawQuery(query): RawQuery,
    headers: HeaderMap,
) -> Response {
    visitor.has_asked();
    if host(&shared.access, &headers).is_none() {
        return refuse(StatusCode::MISDIRECTED_REQUEST, Code::OtherHost);
    }
    // A program, and an address that a person has written, come from no page.
    let from = text(&headers, &FETCH_SITE).unwrap_or("none");
    if !["same-origin", "none"].contains(&from) {
        return refuse(StatusCode::FORBIDDEN, Code::OtherPage);
    }
    if rank(&shared.access, &headers).is_none() {
        return refuse(StatusCode::FORBIDDEN, Code::NoToken);
    }
    visitor.admit();
    let query = query.unwrap_or_default();
    let wanted = match history::Wanted::read(&what, &query, History::now_ms()) {
        Ok(wanted) => wanted,
        Err(why) => return refuse(StatusCode::BAD_REQUEST, Reason::new(Code::Misread, &[&why])),
    };
    let Some(history) = shared.handle.history() else {
        return refuse(StatusCode::NOT_FOUND, Code::NoHistory);
    };
    let Ok(permit) = Arc::clone(&shared.reads).try_acquire_owned() else {
        return refuse(StatusCode::SERVICE_UNAVAILABLE, Code::HistoryBusy);
    };
    // The number of answers and the time of each are limited.
    visitor.let_stay();
    guarded(history::answer(history, wanted, permit))
}

/// Whether the panel's own page asks: by its origin, or by what the browser says of it.
fn is_ours(access: &Access, headers: &HeaderMap, host: &str) -> bool {
    match text(headers, &header::ORIGIN) {
        Some(origin) if origin != "null" => access.is_origin(origin, host),
        _ => text(headers, &FETCH_SITE) == Some("same-origin"),
    }
}

/// How the page that asks stands to this panel, as browsers say it.
const FETCH_SITE: HeaderName = HeaderName::from_static("sec-fetch-site");

/// The token in what follows the path, and the rest of that with its question mark.
fn taken_out(query: &str) -> Option<(&str, String)> {
    let token = |word: &str| word.starts_with("token=");
    let found = query.split('&').find(|word| token(word))?;
    let rest: Vec<_> = query.split('&').filter(|word| !token(word)).collect();
    let rest = match rest.is_empty() {
        true => String::new(),
        false => format!("?{}", rest.join("&")),
    };
    Some((found.trim_start_matches("token="), rest))
}

/// The answer with what keeps others out of it.
fn guarded(mut response: Response) -> Response {
    for (name, value) in page::HEADERS {
        let (name, value) = (
            HeaderName::from_static(name),
            HeaderValue::from_static(value),
        );
        response.headers_mut().insert(name, value);
    }
    response
}

/// A page's socket.
async fn live(
    State(shared): State<Arc<Shared>>,
    ConnectInfo(visitor): ConnectInfo<Visitor>,
    headers: HeaderMap,
    RawQuery(query): RawQuery,
    upgrade: WebSocketUpgrade,
) -> Response {
    visitor.has_asked();
    let Some(host) = host(&shared.access, &headers) else {
        return refuse(StatusCode::MISDIRECTED_REQUEST, Code::OtherHost);
    };
    let origin = text(&headers, &header::ORIGIN).unwrap_or_default();
    if !shared.access.is_origin(origin, host) {
        return refuse(StatusCode::FORBIDDEN, Code::OtherPage);
    }
    let Some(rank) = rank(&shared.access, &headers) else {
        return refuse(StatusCode::FORBIDDEN, Code::NoToken);
    };
    let query = query.unwrap_or_default();
    // It was opened before this program was replaced, and may mean other things by the same words.
    if said(&query, "edition").is_some_and(|edition| edition != *page::EDITION) {
        return upgrade.on_upgrade(|socket| socket::send_away(socket, Code::OtherLanguage));
    }
    let Some(page) = OpenPage::take(&shared, said(&query, "name").unwrap_or_default()) else {
        return refuse(StatusCode::SERVICE_UNAVAILABLE, Code::PagesFull);
    };
    visitor.let_stay();
    upgrade
        .max_message_size(LONGEST_MESSAGE)
        // Half a frame is kept until the rest of it has come.
        .max_frame_size(LONGEST_MESSAGE)
        .on_upgrade(move |socket| socket::converse(socket, page, rank))
}

/// One of the places for pages; it is free again when this is dropped.
#[derive(Debug)]
pub(crate) struct OpenPage {
    pub(crate) shared: Arc<Shared>,
    /// The page's number, which no other has had.
    pub(crate) number: u32,
    /// What other people see when this page drives or stops; no other open page has this name.
    pub(crate) name: String,
}

impl OpenPage {
    /// One for a page whose person wants to be called `wish`; without a name it is a guest's.
    fn take(shared: &Arc<Shared>, wish: &str) -> Option<Self> {
        let taken = shared
            .open
            .fetch_update(Ordering::Relaxed, Ordering::Relaxed, |open| {
                (open < MOST_PAGES).then_some(open + 1)
            });
        taken.ok()?;
        let number = shared.pages.fetch_add(1, Ordering::Relaxed) + 1;
        let mut names = shared.names();
        let mut name = access::person(wish).unwrap_or_else(|| format!("panel-{number}"));
        if !names.insert(name.clone()) {
            name = format!("{name}-{number}");
            names.insert(name.clone());
        }
        drop(names);
        Some(Self {
            shared: Arc::clone(shared),
            number,
            name,
        })
    }
}

impl Drop for OpenPage {
    fn drop(&mut self) {
        self.shared.names().remove(&self.name);
        self.shared.open.fetch_sub(1, Ordering::Relaxed);
    }
}

/// The host that was asked, if it is this panel.
fn host<'h>(access: &Access, headers: &'h HeaderMap) -> Option<&'h str> {
    text(headers, &header::HOST).filter(|host| access.is_host(host))
}

/// What the sender of these headers may do.
fn rank(access: &Access, headers: &HeaderMap) -> Option<Rank> {
    let cookies = text(headers, &header::COOKIE).unwrap_or_default();
    let name = access.cookie();
    let token = cookies
        .split("; ")
        .find_map(|cookie| cookie.strip_prefix(&name)?.strip_prefix('='));
    access.rank(token)
}

fn text<'h>(headers: &'h HeaderMap, name: &HeaderName) -> Option<&'h str> {
    headers.get(name)?.to_str().ok()
}

/// Says no in both languages: a person who is not let in has no page that knows the language.
fn refuse(status: StatusCode, why: impl Into<Reason>) -> Response {
    let why = why.into();
    let said = [Language::English, Language::Swedish].map(|language| why.sentence(language));
    guarded((status, said.join("\n") + "\n").into_response())
}
