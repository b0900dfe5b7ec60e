//! What other threads see of the station and do with it.
//!
//! The station is behind one lock that nobody holds while he waits for a peer or for the disk.
//!
//! ```no_run
//! use std::time::Duration;
//!
//! use lager_lines::Name;
//! use lager_lines::command::read_wheels;
//! use lager_lines::extension::{Action, Mode};
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
use std::path::PathBuf;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use lager_lines::Name;
use lager_lines::command::Wheels;
use lager_lines::extension::Action;
use lager_wire::OperatorArm;

use crate::awaited::{Awaited, Outlets, Saved, Saving, Subscription};
use crate::given::Given;
use crate::robot::Doing;
use crate::shown::{Shown, Told};
use crate::station::{News, Station, Wish, WishRefused};
use crate::warehouse::{Warehouse, WarehouseError};
use crate::wheel::Key;

/// What the station's clock shows when it starts: what robots tell of before that has a moment, too.
const ORIGIN: Duration = Duration::from_secs(24 * 3_600);

/// The station, for any thread; clones are of the same one.
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
    /// The origin of the station's clock.
    start: Instant,
}

#[derive(Debug)]
struct State {
    station: Station,
    /// Grows with whatever may have changed.
    revision: u64,
    outlets: Outlets,
}

/// What is to be seen of one robot at a moment.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Its name.
    pub name: Name,
    /// What its questions tell of what it is doing.
    pub doing: Doing,
    /// Whether it takes actions.
    pub is_extended: bool,
    /// Who drives it by actions.
    pub driver: Option<String>,
    /// The last of each kind that it has shown.
    pub shown: Shown,
    /// The moment, by the station's clock; see [`Seen::age`](crate::Seen::age).
    pub now: Duration,
}

/// What people do with robots.
impl Handle {
    /// All robots that are known, with the last that each has shown and when.
    pub fn robots(&self) -> Vec<View> {
        let now = self.now();
        self.look(|station| {
            let view = |(name, robot): (&Name, &crate::robot::Robot)| View {
                name: name.clone(),
                doing: robot.doing(),
                is_extended: robot.name().is_some(),
                driver: robot.driver().map(str::to_owned),
                shown: robot.shown().clone(),
                now,
            };
            station.robots().map(view).collect()
        })
    }

    /// What robots say from now on.
    pub fn subscribe(&self) -> Subscription {
        self.lock().outlets.subscribe(false)
    }

    /// What robots have said lately, the last [`Subscription::KEPT`] of all robots together, and
    /// then what they say from now on.
    pub fn recall(&self) -> Subscription {
        self.lock().outlets.subscribe(true)
    }

    /// Gives a robot an action, and lets its answer be awaited. Whoever moves it is its
    /// [`Driver`].
    ///
    /// # Errors
    ///
    /// When it takes no action, or this one is its driver's.
    pub fn act(
        &self,
        robot: &Name,
        action: impl Into<Given<Action>>,
    ) -> Result<Awaited, WishRefused> {
        self.ask(robot, |station| station.act(robot, action))
    }

    /// Stops a robot, whoever drives it. `None`: it is told, and speaks only the document's
    /// language, which confirms nothing.
    ///
    /// # Errors
    ///
    /// When it speaks only that and does not ask for commands.
    pub fn stop(&self, robot: &Name) -> Result<Option<Awaited>, WishRefused> {
        let stopped = self.work(|state| {
            let number = state.station.stop(robot)?;
            Ok(number.map(|number| state.outlets.wait(robot, number)))
        });
        self.wake();
        stopped
    }

    /// Keeps that somebody here has asked something of a robot, for whoever reads what has happened.
    pub fn note(&self, robot: &Name, by: &str, what: &str) {
        let told = Told::Asked {
            by: by.to_owned(),
            what: what.to_owned(),
        };
        let (robot, at) = (robot.clone(), self.now());
        self.work(|state| state.outlets.hand_on(vec![News { robot, at, told }]));
    }

    /// Lets `who` drive a robot, and nobody else as long as the driver is there and says something
    /// every 3 s.
    ///
    /// # Errors
    ///
    /// When somebody else drives it; the error names him.
    pub fn take_wheel(&self, robot: &Name, who: &str) -> Result<Driver, WishRefused> {
        let key = self.change(|station| station.take_wheel(robot, who))?;
        Ok(Driver {
            handle: self.clone(),
            robot: robot.clone(),
            key,
        })
    }

    /// Does what a person wants of a robot in the document's language.
    ///
    /// # Errors
    ///
    /// When it cannot be done; nothing has changed then.
    pub fn wish(&self, robot: &Name, wish: Wish) -> Result<(), WishRefused> {
        let result = self.change(|station| station.wish(robot, wish));
        self.wake();
        result
    }

    /// Gives the station another warehouse, which is then saved. It is in force even if the disk
    /// does not take it. What robots do with it that know another one already, the sentence of the
    /// [`Saving`] says.
    ///
    /// # Errors
    ///
    /// When there can be no such warehouse.
    pub fn set_warehouse(&self, warehouse: Warehouse) -> Result<Saving, WarehouseError> {
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

/// Who drives a robot. When it is dropped the robot stands, and somebody else may drive.
#[derive(Debug)]
pub struct Driver {
    handle: Handle,
    robot: Name,
    key: Key,
}

impl Driver {
    /// Turns the wheels for 150 ms from when the robot hears it, unless this is called again: every
    /// 100 ms, say. A turn of 45 degrees ends by itself, and standing lasts.
    ///
    /// # Errors
    ///
    /// When he drives it no more, or the robot takes no action.
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

    /// Says that he is still there, though he drives nowhere.
    ///
    /// # Errors
    ///
    /// When he drives it no more.
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

/// The station as it is.
impl Handle {
    pub(crate) fn new(station: Station, waker: UnixStream, kept_in: Option<PathBuf>) -> Self {
        Self {
            shared: Arc::new(Shared {
                state: Mutex::new(State {
                    station,
                    revision: 0,
                    outlets: Outlets::default(),
                }),
                changed: Condvar::new(),
                waker,
                kept_in,
                start: Instant::now(),
            }),
        }
    }

    /// Looks at the station, which stands still meanwhile: copy, do not work.
    pub fn look<R>(&self, look: impl FnOnce(&Station) -> R) -> R {
        look(&self.lock().station)
    }

    /// The number of the last change: equal numbers mean equal content.
    pub fn revision(&self) -> u64 {
        self.lock().revision
    }

    /// Waits until the number of the last change is another one than `seen`, at most `timeout`, and
    /// returns it.
    pub fn wait(&self, seen: u64, timeout: Duration) -> u64 {
        let shared = &self.shared;
        let waited = shared
            .changed
            .wait_timeout_while(self.lock(), timeout, |state| state.revision == seen);
        waited.unwrap_or_else(PoisonError::into_inner).0.revision
    }

    /// Takes from the station what nobody sees.
    pub(crate) fn take<R>(&self, take: impl FnOnce(&mut Station) -> R) -> R {
        take(&mut self.lock().station)
    }

    /// Takes the warehouse that is to be saved, and who waits for that.
    pub(crate) fn unsaved(&self) -> (Option<Warehouse>, Vec<Saved>) {
        let mut state = self.lock();
        (state.station.unsaved(), state.outlets.savings())
    }

    /// Time has passed.
    pub(crate) fn turn(&self) {
        let mut state = self.lock();
        state.turn(self.now());
    }

    /// Changes the station and tells who waits.
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
        // One that is full wakes as well.
        let _ = (&self.shared.waker).write(&[0]);
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // It is never left half changed: a panic below comes from the handling of one line.
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
