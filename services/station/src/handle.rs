//! The handle by which other threads see the station and act on it.
//!
//! One lock guards the station. No thread holds it while it waits for a peer or for the disk.
//!
//! ```no_run
//! use std::time::Duration;
//!
//! use lager_lines::Name;
//! use lager_lines::command::read_wheels;
//! use lager_orders::{Action, Mode};
//! use lager_station::{Handle, Reply};
//!
//! fn take_over(handle: &Handle, robot: &Name) -> Result<(), Box<dyn std::error::Error>> {
//!     let asked = handle.act(robot, Action::Mode(Mode::Manual))?;
//!     if asked.wait(Duration::from_secs(3)) == Some(Reply::Done) {
//!         let driver = handle.take_wheel(robot, "anna")?;
//!         // Forward for 150 ms; whoever goes on driving says it again every 100 ms.
//!         driver.drive(read_wheels("2")?)?;
//!     }
//!     Ok(())
//! }
//! ```

use std::io::Write as _;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use lager_lines::Name;
use lager_orders::lease::LATEST_MOVE;
use lager_orders::{Action, Reason, Wheels};
use lager_plant::Warehouse;
use lager_wire::OperatorArm;

use crate::awaited::{Awaited, Outlets, Saved, Saving, Subscription};
use crate::given::Given;
use crate::history::History;
use crate::robot::Doing;
use crate::shown::{Saying, Shown};
use crate::station::{RobotSaid, Station, Uses, Wish, WishRefused};
use crate::wheel::Key;

/// The station's clock starts at this time, so that earlier events of robots have a time as well.
const ORIGIN: Duration = Duration::from_secs(24 * 3_600);

/// The station for other threads. All clones lead to the same station.
#[derive(Clone, Debug)]
pub struct Handle {
    shared: Arc<Shared>,
}

#[derive(Debug)]
pub(crate) struct Shared {
    state: Mutex<State>,
    changed: Condvar,
    /// Wakes the thread of the sockets.
    waker: UnixStream,
    /// The warehouse's file, if it has one.
    kept_in: Option<PathBuf>,
    history: Option<History>,
    /// The origin of the station's clock.
    start: Instant,
}

#[derive(Debug)]
struct State {
    station: Station,
    /// Grows with every change.
    revision: u64,
    /// What peers had sent by then, the thread of the sockets has read. `None` before it runs.
    caught_up: Option<Duration>,
    outlets: Outlets,
}

/// What the station knows about one robot at one moment.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Its name.
    pub name: Name,
    /// What the robot is doing, as its questions show.
    pub doing: Doing,
    /// Whether the robot takes actions.
    pub is_extended: bool,
    /// The person who drives it by actions.
    pub driver: Option<String>,
    /// Which warehouse it uses, if it is here and the station has told it all of one.
    pub uses: Option<Uses>,
    /// The last report of each kind.
    pub shown: Shown,
    /// The moment, by the station's clock; see [`Dated::age`](crate::Dated::age).
    pub now: Duration,
}

/// The actions of people.
impl Handle {
    /// All robots that the station knows, with the last reports of each and their times.
    pub fn robots(&self) -> Vec<View> {
        let now = self.now();
        self.look(|station| {
            let view = |(name, robot): (&Name, &crate::robot::Robot)| View {
                name: name.clone(),
                doing: robot.doing(),
                is_extended: robot.name().is_some(),
                driver: robot.driver().map(str::to_owned),
                uses: robot.is_described().then(|| Uses::of(name.clone(), robot)),
                shown: robot.shown().clone(),
                now,
            };
            station.robots().map(view).collect()
        })
    }

    /// The warehouse's file, if it has one.
    pub fn kept_in(&self) -> Option<&Path> {
        self.shared.kept_in.as_deref()
    }

    /// What the station keeps of the last day, if it does.
    pub fn history(&self) -> Option<History> {
        self.shared.history.clone()
    }

    /// Subscribes to everything that robots tell from now on.
    pub fn subscribe(&self) -> Subscription {
        self.lock().outlets.subscribe(false)
    }

    /// The last news of all robots, at most [`Subscription::KEPT`], and then everything that robots
    /// tell from now on.
    pub fn recall(&self) -> Subscription {
        self.lock().outlets.subscribe(true)
    }

    /// Gives a robot an action, and returns a value that waits for the answer. To move the robot,
    /// use [`Driver`].
    ///
    /// # Errors
    ///
    /// The robot takes no action, or only its driver may give this one.
    pub fn act(
        &self,
        robot: &Name,
        action: impl Into<Given<Action>>,
    ) -> Result<Awaited, WishRefused> {
        self.ask(robot, |station| station.act(robot, action))
    }

    /// Stops a robot, whoever drives it. `None` if the robot speaks only the document's language:
    /// the station has sent the stop, but such a robot confirms nothing.
    ///
    /// # Errors
    ///
    /// The robot speaks only the document's language and does not ask for commands.
    pub fn stop(&self, robot: &Name) -> Result<Option<Awaited>, WishRefused> {
        let stopped = self.work(|state| {
            let number = state.station.stop(robot)?;
            Ok(number.map(|number| state.outlets.wait(robot, number)))
        });
        self.wake();
        stopped
    }

    /// Records that somebody has asked a robot for something, for those who read the news.
    pub fn note(&self, robot: &Name, by: &str, what: &str) {
        let told = Saying::Asked {
            by: by.to_owned(),
            what: what.to_owned(),
        };
        let (robot, at) = (robot.clone(), self.now());
        self.work(|state| state.outlets.hand_on(vec![RobotSaid { robot, at, told }]));
    }

    /// Lets only `who` drive a robot, as long as the driver exists and says something every 3 s.
    ///
    /// # Errors
    ///
    /// Another person drives it. The error says who.
    pub fn take_wheel(&self, robot: &Name, who: &str) -> Result<Driver, WishRefused> {
        let key = self.change(|station| station.take_wheel(robot, who))?;
        Ok(Driver {
            handle: self.clone(),
            robot: robot.clone(),
            key,
        })
    }

    /// Does what a person wants of a robot, in the document's language.
    ///
    /// # Errors
    ///
    /// The station cannot do it. Nothing has changed then.
    pub fn wish(&self, robot: &Name, wish: Wish) -> Result<(), WishRefused> {
        let result = self.change(|station| station.wish(robot, wish));
        self.wake();
        result
    }

    /// Gives the station another warehouse and saves it. The station uses it even if the disk
    /// refuses it. The [`Saving`] says what robots do that know another warehouse.
    ///
    /// # Errors
    ///
    /// Such a warehouse cannot exist.
    pub fn set_warehouse(&self, warehouse: Warehouse) -> Result<Saving, Reason> {
        let kept_in = self.shared.kept_in.clone();
        let result = self.work(|state| {
            state.station.set_warehouse(warehouse)?;
            let robots = state.station.tell_goods();
            Ok(state.outlets.save(kept_in, robots))
        });
        self.wake();
        result
    }

    fn ask(
        &self,
        robot: &Name,
        ask: impl FnOnce(&mut Station) -> Result<u32, WishRefused>,
    ) -> Result<Awaited, WishRefused> {
        let awaited = self.work(|state| {
            let number = ask(&mut state.station)?;
            Ok(state.outlets.wait(robot, number))
        });
        self.wake();
        awaited
    }
}

/// The right to drive a robot. When it is dropped the robot stands, and somebody else may drive.
#[derive(Debug)]
pub struct Driver {
    handle: Handle,
    robot: Name,
    key: Key,
}

impl Driver {
    /// Turns the wheels for 150 ms from the moment when the robot gets the command. To drive on,
    /// call this again every 100 ms. A turn of 45 degrees ends by itself. The command to stand
    /// lasts.
    ///
    /// # Errors
    ///
    /// This driver may not drive any more, or the robot takes no actions.
    pub fn drive(&self, wheels: impl Into<Given<Wheels>>) -> Result<Awaited, WishRefused> {
        let drive = |station: &mut Station| station.drive(&self.robot, self.key, wheels);
        self.handle.ask(&self.robot, drive)
    }

    /// Moves the arm by a step.
    ///
    /// # Errors
    ///
    /// As with [`Driver::drive`].
    pub fn arm(&self, step: impl Into<Given<OperatorArm>>) -> Result<Awaited, WishRefused> {
        let arm = |station: &mut Station| station.arm(&self.robot, self.key, step);
        self.handle.ask(&self.robot, arm)
    }

    /// Says that the driver is still there, and moves nothing.
    ///
    /// # Errors
    ///
    /// This driver may not drive any more.
    pub fn stay(&self) -> Result<(), WishRefused> {
        let stay = |station: &mut Station| station.stay(&self.robot, self.key);
        self.handle.change(stay)
    }
}

impl Drop for Driver {
    fn drop(&mut self) {
        let leave = |station: &mut Station| station.leave_wheel(&self.robot, self.key);
        self.handle.change(leave);
        self.handle.wake();
    }
}

/// What the threads share.
impl Handle {
    pub(crate) fn new(
        station: Station,
        waker: UnixStream,
        kept_in: Option<PathBuf>,
        history: Option<History>,
    ) -> Self {
        let handle = Self {
            shared: Arc::new(Shared {
                state: Mutex::new(State {
                    station,
                    revision: 0,
                    caught_up: None,
                    outlets: Outlets::default(),
                }),
                changed: Condvar::new(),
                waker,
                kept_in,
                history,
                start: Instant::now(),
            }),
        };
        handle.remember();
        handle
    }

    /// Takes the last news out of the history, so that a page of a new station shows them, too.
    fn remember(&self) {
        let Some(history) = &self.shared.history else {
            return;
        };
        let events = history.latest(Subscription::KEPT).unwrap_or_else(|error| {
            tracing::warn!("the events of before are not shown: {error}");
            Vec::new()
        });
        let (now_ms, now) = (History::now_ms(), self.now());
        let news = events.into_iter().filter_map(|(robot, at_ms, line)| {
            let ago = Duration::from_millis(now_ms.saturating_sub(at_ms));
            Some(RobotSaid {
                robot: Name::new(robot).ok()?,
                // What is older than a day was before this clock's time.
                at: now.checked_sub(ago)?,
                told: Saying::read(&line)?,
            })
        });
        news.for_each(|news| self.lock().outlets.keep(news));
    }

    /// Calls `look` with the station. The station waits meanwhile, so copy and do nothing else.
    pub fn look<R>(&self, look: impl FnOnce(&Station) -> R) -> R {
        look(&self.lock().station)
    }

    /// The number of the last change: equal numbers mean equal content.
    pub fn revision(&self) -> u64 {
        self.lock().revision
    }

    /// Whether the thread of the sockets was held up and has not read yet what peers sent meanwhile.
    /// Until it has, what the station knows of a robot is not what the robot said last.
    pub fn is_behind(&self) -> bool {
        let caught_up = self.lock().caught_up;
        caught_up.is_some_and(|at| self.now().saturating_sub(at) > LATEST_MOVE)
    }

    /// Waits until the number of the last change differs from `seen`, at most `timeout`, and
    /// returns it.
    pub fn wait(&self, seen: u64, timeout: Duration) -> u64 {
        let shared = &self.shared;
        let waited = shared
            .changed
            .wait_timeout_while(self.lock(), timeout, |state| state.revision == seen);
        waited.unwrap_or_else(PoisonError::into_inner).0.revision
    }

    /// Takes the station's outputs that nobody else sees.
    pub(crate) fn take<R>(&self, take: impl FnOnce(&mut Station) -> R) -> R {
        take(&mut self.lock().station)
    }

    /// Takes the warehouse that must be saved, and those who wait for that.
    pub(crate) fn unsaved(&self) -> (Option<Warehouse>, Vec<Saved>) {
        let mut state = self.lock();
        (state.station.unsaved(), state.outlets.savings())
    }

    /// Time has passed.
    pub(crate) fn turn(&self) {
        let mut state = self.lock();
        state.turn(self.now());
    }

    /// What peers had sent by then has been read.
    pub(crate) fn caught_up(&self, by: Duration) {
        self.lock().caught_up = Some(by);
    }

    /// Changes the station and tells the threads that wait.
    pub(crate) fn change<R>(&self, change: impl FnOnce(&mut Station) -> R) -> R {
        self.work(|state| change(&mut state.station))
    }

    fn work<R>(&self, work: impl FnOnce(&mut State) -> R) -> R {
        let mut state = self.lock();
        state.station.turn(self.now());
        state.revision += 1;
        let result = work(&mut state);
        state.hand_on();
        drop(state);
        self.shared.changed.notify_all();
        result
    }

    /// The station's clock.
    pub fn now(&self) -> Duration {
        ORIGIN + self.shared.start.elapsed()
    }

    fn wake(&self) {
        // A full pipe wakes the thread as well.
        let _ = (&self.shared.waker).write(&[0]);
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // A panic cannot leave the station half changed: below, it comes from the handling of one
        // line.
        let state = self.shared.state.lock();
        state.unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    fn turn(&mut self, now: Duration) {
        self.station.turn(now);
        self.hand_on();
        self.outlets.forget_gone();
    }

    fn hand_on(&mut self) {
        let news = self.station.news();
        self.outlets.hand_on(news);
    }
}
