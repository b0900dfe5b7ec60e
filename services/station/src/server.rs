//! The sockets: TCP for robots, and a unix socket of this user for one GaG. One thread waits for
//! all of them.
//!
//! - A new peer waits until it has said its name, and has proved it if the station has secrets
//!   (`waiting.rs`, `gate.rs`). Then it gets one of the places for robots (`station/links.rs`). The
//!   server closes a second GaG at once.
//! - When the system can open no more files, new peers wait in the system's queue, and this thread
//!   sleeps meanwhile.
//! - The server closes a peer that is too slow (`connection.rs`). The kernel finds a peer whose
//!   machine has vanished: it probes each silent peer after 5 s. It gives the peer up when the peer
//!   does not answer for 10 s, or does not confirm the server's bytes for 10 s.
//! - Each connection reads at most 4 KiB in one turn.
//! - If this thread was held up for more than 200 ms, it counts all bytes that wait as old by that
//!   time.

use std::collections::BTreeMap;
use std::fmt;
use std::fs;
use std::io::{self, Read as _};
use std::net::{IpAddr, SocketAddr, TcpListener, TcpStream};
use std::os::fd::AsFd;
use std::os::unix::fs::{FileTypeExt as _, PermissionsExt as _};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use lager_floor::ProductId;
use lager_lines::conversation::RobotLine;
use lager_lines::secret::{Nonce, Secrets};
use lager_lines::splitter::LineError;
use lager_lines::{Called, Name, UnknownProduct, to_line};
use lager_orders::lease::LATEST_MOVE;
use lager_plant::Warehouse;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::net::sockopt;

use crate::config::{Listen, ServerConfig, ServerError};
use crate::connection::{Connection, Stream};
use crate::files::{Hold, ReadError};
use crate::gate::{Gate, Verdict};
use crate::handle::Handle;
use crate::history::History;
use crate::keeper::Keeper;
use crate::queues::Queues;
use crate::saver::{Changes, Saver};
use crate::station::{Output, Peer, Station};
use crate::waiting::Waiting;
use crate::warehouse::{LoadError, find, load};

/// How often the thread looks for slow peers and for its end when nothing happens.
const GLANCE: Duration = Duration::from_millis(50);
/// How long the station accepts nobody after the system could open no more files.
const REST: Duration = Duration::from_millis(250);
/// After how long the kernel first probes a silent peer, and how often.
const KEEP_ALIVE: Duration = Duration::from_secs(5);
const KEEP_ALIVE_AGAIN: Duration = Duration::from_secs(2);
/// After how many ms the kernel gives up a peer that does not confirm.
const UNCONFIRMED_MS: u32 = 10_000;

/// The station with its sockets.
#[derive(Debug)]
pub struct Server {
    robots: TcpListener,
    gag: Option<(UnixListener, PathBuf)>,
    wakes: UnixStream,
    handle: Handle,
    saver: Saver,
    /// Keeps the history until it is dropped.
    _keeper: Option<Keeper>,
    /// Only this station saves in the warehouse's file. Dropped after the saver.
    _hold: Option<Hold>,
    /// The queues as they were saved last.
    saved: Queues,
    secrets: Secrets,
    connections: BTreeMap<Peer, Connection>,
    gates: BTreeMap<u64, Gate>,
    waiting: Waiting,
    next_link: u64,
    turned: Turned,
    /// How long this thread was held up before this turn, if that makes waiting bytes old.
    pause: Option<Duration>,
    /// Until when the station accepts nobody, because the system can open no more files.
    rests: Option<Instant>,
}

/// Called at each turn of the loop.
struct Turned(Box<dyn FnMut() + Send>);

impl fmt::Debug for Turned {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("Turned")
    }
}

impl Server {
    /// Opens the sockets and reads the warehouse. New peers wait until [`Server::run`].
    ///
    /// # Errors
    ///
    /// The machine refuses a socket, or such a warehouse cannot exist.
    pub fn open(config: ServerConfig) -> Result<Self, ServerError> {
        let hold = match &config.warehouse {
            Some(warehouse) => Hold::of(warehouse)?,
            None => None,
        };
        let warehouse = read(config.warehouse.as_deref())?.or(config.otherwise);
        let mut station = Station::new(config.name.clone(), warehouse)?;
        let saved = match &config.queues {
            Some(queues) => Queues::load(queues)?,
            None => Queues::default(),
        };
        put_back(&mut station, &saved);
        for (robot, called) in config.fetch {
            let product = match (called, station.warehouse()) {
                (Called::Number(product), _) => product,
                (called, Some(warehouse)) => {
                    let found = find(warehouse, &called);
                    found.map_err(|why| ServerError::Called {
                        robot: robot.clone(),
                        why,
                    })?
                }
                (called, None) => return Err(no_warehouse(robot, called)),
            };
            let waits = saved.0.get(robot.as_str());
            if waits.is_some_and(|waits| waits.contains(&product.get())) {
                // The product was ordered at an earlier start and still waits.
                continue;
            }
            let put = station.fetch(&robot, product);
            put.map_err(|why| ServerError::Fetch {
                robot,
                product,
                why,
            })?;
        }
        let robots = match config.listen {
            Listen::On(robots) => robots,
            Listen::At(at) => {
                TcpListener::bind(at).map_err(|error| ServerError::Listen { at, error })?
            }
        };
        robots.set_nonblocking(true)?;
        let gag = match &config.gag {
            None => None,
            Some(path) => Some((listen_for_gag(path)?, path.clone())),
        };
        let (wakes, waker) = UnixStream::pair()?;
        wakes.set_nonblocking(true)?;
        waker.set_nonblocking(true)?;
        let history = config.history.map(History::new);
        let handle = Handle::new(station, waker, config.warehouse.clone(), history.clone());
        let keeper = history.map(|history| Keeper::new(history, handle.clone()));
        Ok(Self {
            robots,
            gag,
            wakes,
            saver: Saver::new(config.warehouse, config.queues, handle.clone()),
            _keeper: keeper.transpose()?,
            _hold: hold,
            saved,
            handle,
            secrets: config.secrets,
            connections: BTreeMap::new(),
            gates: BTreeMap::new(),
            waiting: Waiting::default(),
            next_link: 0,
            turned: Turned(Box::new(|| {})),
            pause: None,
            rests: None,
        })
    }

    /// Where robots connect.
    ///
    /// # Errors
    ///
    /// The machine does not say it.
    pub fn address(&self) -> io::Result<SocketAddr> {
        self.robots.local_addr()
    }

    /// The station for other threads.
    pub fn handle(&self) -> Handle {
        self.handle.clone()
    }

    /// Calls `act` at each turn, at least ten times a second. It shows that the station goes on.
    pub fn each_turn(&mut self, act: impl FnMut() + Send + 'static) {
        self.turned = Turned(Box::new(act));
    }

    /// Serves until `shutdown` is set.
    ///
    /// # Errors
    ///
    /// The machine does not let the station wait for its sockets.
    pub fn run(mut self, shutdown: &AtomicBool) -> Result<(), ServerError> {
        let mut turned = Instant::now();
        while !shutdown.load(Ordering::SeqCst) {
            let lets_in = self.rests.is_none_or(|until| Instant::now() >= until);
            let began = self.handle.now();
            let ready = self.wait(lets_in)?;
            let now = Instant::now();
            (self.turned.0)();
            let pause = now.saturating_duration_since(turned);
            turned = now;
            self.pause = Some(pause).filter(|pause| *pause > LATEST_MOVE);
            if let Some(pause) = self.pause {
                for connection in self.connections.values_mut() {
                    connection.held_up(pause);
                }
            }
            self.handle.turn();
            for peer in ready.write {
                if let Some(connection) = self.connections.get_mut(&peer) {
                    connection.write(now);
                }
            }
            for peer in ready.read {
                self.hear(now, peer);
            }
            self.handle.caught_up(began);
            self.say(now);
            if lets_in {
                self.let_in(now);
            }
            self.close_overdue(now);
            self.say(now);
            self.watch_gag();
            self.save();
        }
        Ok(())
    }

    /// Saves the changes.
    fn save(&mut self) {
        let (warehouse, waits) = self.handle.unsaved();
        let queues = self.handle.look(Station::queues);
        let queues = (queues != self.saved).then_some(queues);
        if let Some(queues) = &queues {
            self.saved.clone_from(queues);
        }
        self.saver.save(Changes {
            warehouse,
            queues,
            waits,
        });
    }

    /// Waits until there is something to do.
    fn wait(&self, lets_in: bool) -> io::Result<Ready> {
        let mut waited: Vec<PollFd<'_>> = vec![PollFd::new(&self.wakes, PollFlags::IN)];
        let first = waited.len();
        for connection in self.connections.values() {
            let mut wants = PollFlags::IN;
            wants.set(PollFlags::OUT, connection.wants_to_write());
            waited.push(PollFd::from_borrowed_fd(connection.as_fd(), wants));
        }
        if lets_in {
            waited.push(PollFd::new(&self.robots, PollFlags::IN));
            let gag = self.gag.iter();
            waited.extend(gag.map(|(gag, _)| PollFd::new(gag, PollFlags::IN)));
        }
        let glance = Timespec {
            tv_sec: 0,
            tv_nsec: GLANCE.as_nanos() as i64,
        };
        match poll(&mut waited, Some(&glance)) {
            Ok(_) | Err(rustix::io::Errno::INTR) => {}
            Err(error) => return Err(error.into()),
        }
        let mut woken = [0; 64];
        while (&self.wakes).read(&mut woken).is_ok_and(|count| count > 0) {}
        let mut ready = Ready::default();
        for (peer, waited) in self.connections.keys().zip(&waited[first..]) {
            let events = waited.revents();
            if events.contains(PollFlags::OUT) {
                ready.write.push(*peer);
            }
            if events.intersects(PollFlags::IN | PollFlags::HUP | PollFlags::ERR) {
                ready.read.push(*peer);
            }
        }
        Ok(ready)
    }

    /// Accepts new peers.
    fn let_in(&mut self, now: Instant) {
        let mut failed = None;
        // Further peers wait for the next turn, as do the robots that speak.
        for _ in 0..Waiting::MOST {
            match self.robots.accept() {
                Ok((stream, from)) => match prepare(&stream) {
                    Ok(()) => self.greet_robot(now, stream, from.ip()),
                    Err(error) => tracing::warn!("a connection is refused: {error}"),
                },
                Err(error) => {
                    failed = Some(error);
                    break;
                }
            }
        }
        if let Some(accepted) = self.gag.as_ref().map(|(gag, _)| gag.accept()) {
            match accepted {
                Ok((stream, _)) => self.greet_gag(now, stream),
                Err(error) => failed = failed.filter(is_short).or(Some(error)),
            }
        }
        // The peer stays in the system's queue; a new attempt at once would fail, too.
        let Some(error) = failed.filter(is_short) else {
            self.rests = None;
            return;
        };
        if self.rests.replace(now + REST).is_none() {
            tracing::warn!(
                "nobody else is let in for now: {error}; robots that are connected stay so. \
                 `ulimit -n 4096` or LimitNOFILE= in the unit allows more open files"
            );
        }
    }

    /// Adds a connection. Its bytes may have come while this thread was held up.
    fn opened(&self, now: Instant, stream: Stream) -> Connection {
        let mut connection = Connection::new(stream, now);
        if let Some(pause) = self.pause {
            connection.held_up(pause);
        }
        connection
    }

    fn greet_robot(&mut self, now: Instant, stream: TcpStream, from: IpAddr) {
        let link = self.next_link;
        self.next_link += 1;
        let peer = Peer::Robot(link);
        if let Some(goes) = self.waiting.comes(link, from, now) {
            self.end(Peer::Robot(goes), "others wait to say who they are");
        }
        self.gates.insert(link, Gate::new(&self.secrets));
        let connection = self.opened(now, Stream::Tcp(stream));
        self.connections.insert(peer, connection);
        self.handle.change(|station| {
            station.connected(peer);
            station.comes_from(link, from);
        });
    }

    fn greet_gag(&mut self, now: Instant, stream: UnixStream) {
        let is_own = sockopt::socket_peercred(&stream)
            .is_ok_and(|peer| peer.uid == rustix::process::geteuid());
        let is_free = !self.connections.contains_key(&Peer::Gag);
        if is_own && is_free && stream.set_nonblocking(true).is_ok() {
            let connection = self.opened(now, Stream::Unix(stream));
            self.connections.insert(Peer::Gag, connection);
            self.handle.change(|station| station.connected(Peer::Gag));
        } else {
            tracing::warn!("a GaG is refused: there is one, or it is another user's");
        }
    }

    fn hear(&mut self, now: Instant, peer: Peer) {
        if peer == Peer::Gag {
            self.watch_gag();
        }
        self.read(now, peer);
    }

    /// Reads the lines that a peer has sent, without checking what the peer has read.
    fn read(&mut self, now: Instant, peer: Peer) {
        let Some(connection) = self.connections.get_mut(&peer) else {
            return;
        };
        let late = connection.late();
        let mut gate = match peer {
            Peer::Robot(link) => self.gates.get_mut(&link),
            Peer::Gag => None,
        };
        let (handle, secrets) = (&self.handle, &self.secrets);
        // In one step, so that nobody sees a state after which a newer one has been read.
        let heard = handle.change(|station| {
            connection.read(now, |line| match &mut gate {
                Some(gate) => hear_robot(station, secrets, gate, peer, line),
                None => station.heard_late(peer, late, line),
            })
        });
        if let Err(error) = heard {
            self.end(peer, &error.to_string());
        }
        if let Peer::Robot(link) = peer
            && self.handle.look(|station| station.is_seated(link))
        {
            self.waiting.goes(link);
        }
    }

    /// Sends and closes what the station wants.
    fn say(&mut self, now: Instant) {
        loop {
            let outputs = self.handle.take(Station::outputs);
            if outputs.is_empty() {
                return;
            }
            for output in outputs {
                match output {
                    Output::Say { to, line } => {
                        // The bytes that wait there came before this.
                        if to == Peer::Gag {
                            self.read(now, to);
                        }
                        let said = self.connections.get_mut(&to).map(|one| one.say(now, &line));
                        self.check(to, said);
                    }
                    Output::SayFirst { to, line } => {
                        let connection = self.connections.get_mut(&to);
                        let said = connection.map(|one| one.say_first(now, &line));
                        self.check(to, said);
                    }
                    Output::Close { peer, why } => self.end(peer, &why),
                }
            }
        }
    }

    /// Finds out what the GaG has read, if the station needs to know it.
    fn watch_gag(&mut self) {
        if let Some(gag) = self.connections.get(&Peer::Gag)
            && self.handle.look(Station::watches_gag)
        {
            let all = gag.has_read_all();
            self.handle
                .take(|station| station.gag_has_read(all && !station.has_outputs()));
        }
    }

    fn check(&mut self, peer: Peer, said: Option<io::Result<()>>) {
        if let Some(Err(error)) = said {
            self.end(peer, &error.to_string());
        }
    }

    fn close_overdue(&mut self, now: Instant) {
        let overdue = |(peer, one): (&Peer, &Connection)| Some((*peer, one.overdue(now)?));
        let overdue: Vec<_> = self.connections.iter().filter_map(overdue).collect();
        for (peer, why) in overdue {
            self.end(peer, why);
        }
        for link in self.waiting.overdue(now) {
            self.end(Peer::Robot(link), "it has not said its name");
        }
    }

    fn end(&mut self, peer: Peer, why: &str) {
        if self.connections.remove(&peer).is_some() {
            tracing::info!(?peer, "a connection has ended: {why}");
            if let Peer::Robot(link) = peer {
                self.gates.remove(&link);
                self.waiting.goes(link);
            }
            self.handle.change(|station| station.disconnected(peer));
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        if let Some((_, path)) = &self.gag {
            let _ = fs::remove_file(path);
        }
    }
}

/// The connections that can be read or written now.
#[derive(Debug, Default)]
struct Ready {
    read: Vec<Peer>,
    write: Vec<Peer>,
}

/// Passes a robot's line to the station, if its gate lets the line through.
fn hear_robot(
    station: &mut Station,
    secrets: &Secrets,
    gate: &mut Gate,
    peer: Peer,
    line: Result<&str, LineError>,
) {
    let verdict = match line {
        Ok(line) => gate.judge(secrets, line, Nonce::random),
        Err(_) => Verdict::Pass,
    };
    match (verdict, peer) {
        (Verdict::Pass, _) => station.heard(peer, line),
        (Verdict::Ask(proof), _) => station.prove(peer, &proof),
        (Verdict::Proved(proof, hello), Peer::Robot(link)) => {
            station.prove(peer, &proof);
            station.proved(link);
            if let Ok(hello) = to_line(&RobotLine::Hello(hello)) {
                station.heard(peer, Ok(hello.trim_end()));
            }
        }
        (Verdict::Refuse(why), _) => {
            tracing::warn!("{why}");
            station.refuse(peer, &why);
        }
        (Verdict::Proved(..), Peer::Gag) => {}
    }
}

/// Whether this process or the machine can open no more files.
fn is_short(error: &io::Error) -> bool {
    use rustix::io::Errno;
    let short = [Errno::MFILE, Errno::NFILE, Errno::NOBUFS, Errno::NOMEM];
    error
        .raw_os_error()
        .is_some_and(|raw| short.contains(&Errno::from_raw_os_error(raw)))
}

/// The answer before there is a warehouse: no product has a name.
fn no_warehouse(robot: Name, called: Called) -> ServerError {
    let known = "none, since it is not known yet".to_owned();
    let why = UnknownProduct { called, known };
    ServerError::Called { robot, why }
}

fn prepare(stream: &TcpStream) -> io::Result<()> {
    stream.set_nonblocking(true)?;
    // A command is one small packet; the kernel must not wait for more.
    stream.set_nodelay(true)?;
    sockopt::set_socket_keepalive(stream, true)?;
    sockopt::set_tcp_keepidle(stream, KEEP_ALIVE)?;
    sockopt::set_tcp_keepintvl(stream, KEEP_ALIVE_AGAIN)?;
    sockopt::set_tcp_user_timeout(stream, UNCONFIRMED_MS)?;
    Ok(())
}

/// Fills the robots' queues with the products that waited when the queues were saved.
fn put_back(station: &mut Station, queues: &Queues) {
    for (name, products) in &queues.0 {
        for product in products {
            let put = match (Name::new(name.clone()), ProductId::new(*product)) {
                (Ok(name), Some(product)) => {
                    let put = station.fetch(&name, product);
                    put.map_err(|error| error.to_string())
                }
                _ => Err("there is no such robot, or no such goods".into()),
            };
            if let Err(why) = put {
                tracing::warn!("robot {name} does not fetch goods {product} any more: {why}");
            }
        }
    }
}

fn read(path: Option<&Path>) -> Result<Option<Warehouse>, LoadError> {
    match path.map(load) {
        Some(Err(LoadError::Read(ReadError::Read { error, .. })))
            if error.kind() == io::ErrorKind::NotFound =>
        {
            Ok(None)
        }
        read => read.transpose(),
    }
}

/// A socket for this user alone. Removes the socket of a station that was killed.
fn listen_for_gag(path: &Path) -> Result<UnixListener, ServerError> {
    let failed = |error| ServerError::Gag {
        path: path.to_owned(),
        error,
    };
    if let Ok(there) = fs::symlink_metadata(path)
        && there.file_type().is_socket()
    {
        if UnixStream::connect(path).is_ok() {
            return Err(ServerError::GagInUse {
                path: path.to_owned(),
            });
        }
        fs::remove_file(path).map_err(failed)?;
    }
    let listener = UnixListener::bind(path).map_err(failed)?;
    // If a process of another user connects before that, `let_in` refuses it.
    fs::set_permissions(path, fs::Permissions::from_mode(0o600)).map_err(failed)?;
    listener.set_nonblocking(true).map_err(failed)?;
    Ok(listener)
}
