//! The node's services, each a `std_srvs/srv/Trigger`: `stop` for everybody, and for whoever started
//! the gateway as an operator `resume` and one `fetch/goods_N` for each product of the map.
//!
//! ```text
//!   stop:    request ──> stop word, at once ──> bridge ──> "the wheels stand" ──> answer
//!   resume,  request ──> not late? ──> lager resume | lager fetch N ──> answer
//!   fetch                              another process, one after the other
//! ```
//!
//! A stop goes into memory before anything else and needs no bus (`lager_stop`). What lets the robot
//! move goes the way of every operator, by the commands that people type; so this process opens no
//! port that writes. The answer is what came of it.
//!
//! **Nothing moves late.** DDS repeats a request that was lost on its way, so one may come seconds
//! after it was sent. A request that lets the robot move is refused when its sender's time stamp is
//! older than [`LATEST_MOVE`], lies in the future by more than that, or is missing.
//!
//! **Nobody is answered too early.** DDS gives an answer up for which no reader has been matched yet.
//! So an answer waits until the asker's reader is known, at most [`MATCH`].

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::io;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use lager_home::Clock;
use lager_orders::lease::{LATEST, LATEST_MOVE};
use lager_stop::{StopWord, Verdict, judge, process_state};
use lager_topics::{Role, StopCause, WarehouseMap};

use crate::messages::TriggerResponse;
use crate::node::{Asked, Asker, Node, NodeError, Server};

/// How long the robot may take to stand, in real time.
const PATIENCE: Duration = Duration::from_millis(1_800);
/// How long an answer waits for its reader.
const MATCH: Duration = Duration::from_secs(1);
/// Requests of one service that are read in one turn.
const TURN: usize = 16;
/// Orders that may wait for the one before. Each is late soon.
const QUEUE: usize = 8;
/// Products that have a service. Each costs every program of ROS 2 two endpoints.
const MOST_FETCHED: usize = 64;

/// One of the services.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Service {
    Stop,
    Resume,
    Fetch(i32),
}

impl Service {
    /// Its name below the node's.
    fn name(self) -> String {
        match self {
            Self::Stop => "stop".to_owned(),
            Self::Resume => "resume".to_owned(),
            Self::Fetch(product) => format!("fetch/goods_{product}"),
        }
    }

    /// The words of `lager` that carry it out; a stop needs none.
    fn words(self) -> Vec<String> {
        match self {
            Self::Stop => Vec::new(),
            Self::Resume => vec!["resume".to_owned()],
            Self::Fetch(product) => vec!["fetch".to_owned(), product.to_string()],
        }
    }

    /// How late it may come.
    const fn latest(self) -> Duration {
        match self {
            Self::Stop => Duration::MAX,
            Self::Resume => LATEST_MOVE,
            Self::Fetch(_) => LATEST,
        }
    }
}

/// A request on its way.
#[derive(Clone, Copy, Debug)]
struct Job {
    service: Service,
    asker: Asker,
    /// How old it was when it was read, and when that was.
    age: Duration,
    read: Instant,
}

/// A stop that was set and whose effect has not shown yet.
#[derive(Clone, Copy, Debug)]
struct Stopping {
    asker: Asker,
    ordered_ns: u64,
    since: Instant,
}

/// An answer that waits for its reader.
struct Answer {
    service: Service,
    asker: Asker,
    answer: TriggerResponse,
    since: Instant,
}

/// Whoever carries out what lets the robot move.
struct Operator {
    jobs: SyncSender<Job>,
    done: Receiver<(Service, Asker, TriggerResponse)>,
}

/// All services.
pub struct Services {
    servers: BTreeMap<Service, Server>,
    stop_word: PathBuf,
    stopping: Vec<Stopping>,
    answers: Vec<Answer>,
    operator: Option<Operator>,
    left_out: usize,
}

impl Services {
    /// The services of the robot with that stop word; with those of an operator if there is a command
    /// that is `lager` for this robot.
    ///
    /// # Errors
    /// A service cannot be offered, or there is no thread for the orders.
    pub fn open(
        node: &mut Node,
        stop_word: PathBuf,
        lager: Option<Vec<OsString>>,
    ) -> Result<Self, ServicesError> {
        let mut servers = BTreeMap::new();
        servers.insert(Service::Stop, node.server(&Service::Stop.name())?);
        let operator = match lager {
            Some(lager) => {
                servers.insert(Service::Resume, node.server(&Service::Resume.name())?);
                Some(Operator::start(lager)?)
            }
            None => None,
        };
        Ok(Self {
            servers,
            stop_word,
            stopping: Vec::new(),
            answers: Vec::new(),
            operator,
            left_out: 0,
        })
    }

    /// Learns the map: each product gets a service. One that leaves the map keeps its service, and
    /// the robot refuses it. Returns how many products have newly found no room.
    ///
    /// # Errors
    /// A service cannot be offered.
    pub fn map(&mut self, node: &mut Node, map: &WarehouseMap) -> Result<usize, NodeError> {
        if self.operator.is_none() {
            return Ok(0);
        }
        let mut left_out = 0_usize;
        for product in map.products() {
            let service = Service::Fetch(product.id);
            if self.servers.contains_key(&service) {
                continue;
            }
            if self.servers.len() >= MOST_FETCHED {
                left_out += 1;
                continue;
            }
            self.servers.insert(service, node.server(&service.name())?);
        }
        let new = left_out.saturating_sub(self.left_out);
        self.left_out = left_out;
        Ok(new)
    }

    /// Reads requests, looks at what came of earlier ones, and answers.
    pub fn turn(&mut self, node: &Node) {
        let now = Instant::now();
        for (service, server) in &self.servers {
            for _ in 0..TURN {
                match server.receive() {
                    Ok(None) => break,
                    Err(error) => log::warn!("a request of {} is none: {error}", service.name()),
                    Ok(Some(asked)) => match service {
                        Service::Stop => match self.set_stop() {
                            Ok(ordered_ns) => self.stopping.push(Stopping {
                                asker: asked.by,
                                ordered_ns,
                                since: now,
                            }),
                            Err(why) => self.answers.push(Answer::new(*service, asked.by, no(why))),
                        },
                        _ => {
                            if let Err(why) = self.take(*service, &asked, now) {
                                self.answers.push(Answer::new(*service, asked.by, no(why)));
                            }
                        }
                    },
                }
            }
        }
        self.look_at_stops(now);
        if let Some(operator) = &self.operator {
            let done = operator.done.try_iter();
            let done = done.map(|(service, asker, answer)| Answer::new(service, asker, answer));
            self.answers.extend(done);
        }
        self.answer(node, now);
    }

    /// Sets the stop word. Returns when.
    fn set_stop(&self) -> Result<u64, String> {
        let ordered_ns = Clock::monotonic_ns();
        StopWord::set(&self.stop_word, Role::Gateway, StopCause::Ordered)
            .map_err(|error| format!("{MOVING}: {error}"))?;
        Ok(ordered_ns)
    }

    /// Hands a request to the operator.
    fn take(&self, service: Service, asked: &Asked, read: Instant) -> Result<(), String> {
        let operator = self.operator.as_ref().ok_or("it is not offered")?;
        let unix = SystemTime::now().duration_since(UNIX_EPOCH);
        let now_ns = unix.map_or(0, |since| since.as_nanos() as u64);
        let age = age(asked.at_ns, now_ns, service.latest())?;
        if service == Service::Resume {
            self.must_have_been_seen(age)?;
        }
        let job = Job {
            service,
            asker: asked.by,
            age,
            read,
        };
        operator.jobs.try_send(job).map_err(|full| match full {
            TrySendError::Full(_) => "too many orders wait; try again".to_owned(),
            TrySendError::Disconnected(_) => "the gateway is ending".to_owned(),
        })
    }

    /// Refuses to release a stop that was set after somebody asked for its release.
    fn must_have_been_seen(&self, age: Duration) -> Result<(), String> {
        let told = StopWord::read(&self.stop_word).map_err(|error| error.to_string())?;
        let asked_ns = Clock::monotonic_ns().saturating_sub(age.as_nanos() as u64);
        match told.and_then(|told| told.stop()) {
            Some(stop) if stop.at_ns() > asked_ns => {
                Err("it stays stopped: a newer stop was set after you asked; ask again".to_owned())
            }
            _ => Ok(()),
        }
    }

    fn look_at_stops(&mut self, now: Instant) {
        if self.stopping.is_empty() {
            return;
        }
        let told = StopWord::read(&self.stop_word);
        let now_ns = Clock::monotonic_ns();
        let mut again = false;
        self.stopping.retain(|stopping| {
            let (is_over, answer) = match &told {
                Err(error) => (true, no(format!("{MOVING}: {error}"))),
                Ok(None) => {
                    again = true;
                    (
                        false,
                        no(format!(
                            "{MOVING}: its stop word was removed again and again"
                        )),
                    )
                }
                Ok(Some(told)) => {
                    let bridge = told
                        .bridge()
                        .map(|process| (process, process_state(process)));
                    match judge(told, stopping.ordered_ns, now_ns, bridge) {
                        Verdict::Stands(said) => (true, yes(said)),
                        Verdict::Never(why) => (true, no(format!("{MOVING}: {why}"))),
                        Verdict::NotYet(why) => (false, no(format!("{MOVING}: {why}"))),
                    }
                }
            };
            let is_over = is_over || now - stopping.since >= PATIENCE;
            if is_over {
                let answer = Answer::new(Service::Stop, stopping.asker, answer);
                self.answers.push(answer);
            }
            !is_over
        });
        if again {
            // Somebody has removed the file meanwhile; the next look sees what came of it.
            let _ = self.set_stop();
        }
    }

    fn answer(&mut self, node: &Node, now: Instant) {
        let servers = &self.servers;
        self.answers.retain(|one| {
            let Some(server) = servers.get(&one.service) else {
                return false;
            };
            let is_due = node.is_heard_by(server, &one.asker) || now - one.since >= MATCH;
            if is_due && server.answer(one.asker, one.answer.clone()).is_err() {
                log::warn!("there was no room for an answer of {}", one.service.name());
            }
            !is_due
        });
    }
}

/// Every answer to a stop that did not show its effect begins with this.
const MOVING: &str = "the robot may still be moving";

fn yes(message: String) -> TriggerResponse {
    TriggerResponse {
        success: true,
        message,
    }
}

fn no(message: String) -> TriggerResponse {
    TriggerResponse {
        success: false,
        message,
    }
}

impl Answer {
    fn new(service: Service, asker: Asker, answer: TriggerResponse) -> Self {
        Self {
            service,
            asker,
            answer,
            since: Instant::now(),
        }
    }
}

/// Why there are no services.
#[derive(Debug, thiserror::Error)]
pub enum ServicesError {
    /// One cannot be offered.
    #[error(transparent)]
    Node(#[from] NodeError),
    /// There is no thread.
    #[error("there is no thread for orders: {0}")]
    Thread(#[from] io::Error),
}

/// How old a request is.
///
/// # Errors
/// It is older than `latest`, or nobody can know how old it is.
fn age(at_ns: Option<u64>, now_ns: u64, latest: Duration) -> Result<Duration, String> {
    let Some(at_ns) = at_ns else {
        return Err(
            "refused: the request does not say when it was sent, and an old one must not \
                    move the robot"
                .to_owned(),
        );
    };
    let off = Duration::from_nanos(at_ns.abs_diff(now_ns));
    match at_ns > now_ns {
        true if off > LATEST_MOVE => Err(format!(
            "refused: the request was sent {} ms from now by its sender's clock; set the clocks of \
             both machines (chrony does)",
            off.as_millis()
        )),
        true => Ok(Duration::ZERO),
        false if off > latest => Err(late(off, latest)),
        false => Ok(off),
    }
}

fn late(age: Duration, latest: Duration) -> String {
    format!(
        "refused: the request is {} ms old, and one that is older than {} ms must not move the robot; \
         ask again, and if it happens again compare the clocks of both machines",
        age.as_millis(),
        latest.as_millis()
    )
}

impl Operator {
    /// Starts the thread that carries orders out, one after the other.
    fn start(lager: Vec<OsString>) -> io::Result<Self> {
        let (jobs, todo) = sync_channel::<Job>(QUEUE);
        let (finished, done) = sync_channel(QUEUE);
        let work = move || {
            for job in todo {
                let answer = carry_out(&lager, &job);
                if finished.send((job.service, job.asker, answer)).is_err() {
                    return;
                }
            }
        };
        std::thread::Builder::new()
            .name("orders".to_owned())
            .spawn(work)?;
        Ok(Self { jobs, done })
    }
}

fn carry_out(lager: &[OsString], job: &Job) -> TriggerResponse {
    let (age, latest) = (job.age + job.read.elapsed(), job.service.latest());
    if age > latest {
        return no(late(age, latest));
    }
    let Some((program, arguments)) = lager.split_first() else {
        return no("the gateway does not know the program `lager`".to_owned());
    };
    let ran = Command::new(program)
        .args(arguments)
        .args(job.service.words())
        .stdin(Stdio::null())
        .output();
    match ran {
        Ok(ran) if ran.status.success() => yes(said(&ran.stdout)),
        Ok(ran) => no(said(&ran.stderr)),
        Err(error) => no(format!("cannot start {}: {error}", program.display())),
    }
}

/// What a command has said, as one line.
fn said(output: &[u8]) -> String {
    let text = String::from_utf8_lossy(output);
    let lines = text
        .lines()
        .map(|line| line.trim().trim_start_matches("lager: "));
    let lines = lines.filter(|line| !line.is_empty());
    lines.collect::<Vec<_>>().join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_old_request_lets_nothing_move_and_one_without_a_time_neither() {
        const NOW: u64 = 1_700_000_000_000_000_000;
        let ms = |ms: u64| ms * 1_000_000;
        let ages = |at: Option<u64>| age(at, NOW, LATEST_MOVE);
        assert_eq!(ages(Some(NOW - ms(199))), Ok(Duration::from_millis(199)));
        assert_eq!(ages(Some(NOW + ms(50))), Ok(Duration::ZERO));
        for (at, words) in [
            (Some(NOW - ms(201)), "is 201 ms old"),
            (Some(NOW + ms(300)), "300 ms from now"),
            (None, "does not say when"),
        ] {
            let refused = ages(at).expect_err("it must not move");
            assert!(refused.contains(words), "{refused}");
        }
    }

    #[test]
    fn what_a_command_says_is_the_answer() {
        assert_eq!(
            said(b"it was stopped\n  released \n\n"),
            "it was stopped; released"
        );
    }

    #[test]
    fn services_are_named_as_people_of_ros_expect() {
        assert_eq!(Service::Fetch(12).name(), "fetch/goods_12");
        assert_eq!(Service::Fetch(12).words(), ["fetch", "12"]);
    }
}
