//! One page: what it may do, what it has asked, and what the panel has told it. Nothing here waits.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::sync::{MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use lager_lines::Name;
use lager_lines::extension::Spelled;
use lager_orders::{Action, Code, Commission, Late, Mode, Reason};
use lager_plant::Warehouse;
use lager_station::{
    Awaited, Doing, Driver, Given, History, LastTold, Reply, Saving, Subscription, Uses, View,
};
use tokio::sync::watch;

use crate::OpenPage;
use crate::access::Rank;
use crate::handover::{Handover, Request};
use crate::speech::{Said, Unread, read};

/// How often a page tells the station that its driver is still there while nothing moves.
const STAY: Duration = Duration::from_secs(1);
/// How often the panel tells a page about a robot that says nothing.
const ABOUT: Duration = Duration::from_millis(100);
/// The panel tells a page the age of everything that is older than this.
const JUST_NOW: Duration = Duration::from_secs(1);
/// Lines without a number that a page may say.
const MOST_UNREAD: u32 = 20;

/// A page that is open.
#[derive(Debug)]
pub(crate) struct Visit {
    page: OpenPage,
    rank: Rank,
    /// The robots that this page drives.
    wheels: BTreeMap<Name, Driver>,
    /// The robots whose drivers it has asked for the wheel, with the page's number.
    asks: BTreeMap<Name, u32>,
    late: Late,
    /// The actions that robots have not answered yet, with the page's numbers.
    asked: Vec<(u32, Awaited)>,
    /// Warehouses that are being saved, with the page's numbers.
    saving: Vec<(u32, Saving)>,
    subscription: Subscription,
    /// When it began, by the station's clock.
    began: Duration,
    /// Lines for the page.
    lines: String,
    robots: BTreeMap<Name, Told>,
    warehouse: Option<Option<Warehouse>>,
    revision: Option<u64>,
    looked: Instant,
    /// What follows the station's time in the line that is due, if one is.
    wants_time: Option<String>,
    stayed: Instant,
    there: bool,
    unread: u32,
}

/// What a page has been told about a robot.
#[derive(Debug, Default)]
struct Told {
    /// When it was told anything.
    at: Option<Instant>,
    /// The last line about the robot, without the age of what it said.
    about: String,
    reports: LastTold,
}

impl Visit {
    pub(crate) fn new(page: OpenPage, rank: Rank) -> Self {
        let now = Instant::now();
        Self {
            lines: format!(
                "you {} {} {}\n",
                page.name,
                rank.as_str(),
                env!("CARGO_PKG_VERSION")
            ),
            subscription: page.shared.handle.recall(),
            began: page.shared.handle.now(),
            page,
            rank,
            wheels: BTreeMap::new(),
            asks: BTreeMap::new(),
            late: Late::default(),
            asked: Vec::new(),
            saving: Vec::new(),
            robots: BTreeMap::new(),
            warehouse: None,
            revision: None,
            looked: now,
            wants_time: Some(String::new()),
            stayed: now,
            there: true,
            unread: 0,
        }
    }

    /// The page has said something, at least that it is there.
    pub(crate) fn is_there(&mut self) {
        self.there = true;
    }

    /// Changes whenever the station knows something new.
    pub(crate) fn changes(&self) -> watch::Receiver<u64> {
        self.page.shared.changes.subscribe()
    }

    /// Carries out a line. Returns whether the page may go on.
    pub(crate) fn heard(&mut self, line: &str) -> bool {
        match read(line) {
            Ok(said) => self.carry_out(said),
            Err(Unread { number, why }) => {
                self.unread += u32::from(number.is_none());
                if let Some(number) = number {
                    self.refuse(number, why);
                }
            }
        }
        self.unread <= MOST_UNREAD
    }

    fn carry_out(&mut self, said: Said) {
        let handle = self.page.shared.handle.clone();
        if let Said::Stop { robot, number } = said {
            match handle.stop(&robot) {
                Ok(Some(awaited)) => self.asked.push((number, awaited)),
                // The robot speaks the document's language, which confirms nothing.
                Ok(None) => self.answer(number, "done"),
                Err(why) => return self.refuse(number, &why),
            }
            return handle.note(&robot, &self.page.name, "stop");
        }
        if let Said::Here { said_ms } = said {
            self.late.hear(said_ms, handle.now());
            self.wants_time = Some(format!(" {said_ms}"));
            return;
        }
        let (Said::Do { number, .. }
        | Said::Stop { number, .. }
        | Said::Keep { number, .. }
        | Said::Renew { number, .. }
        | Said::Take { number, .. }
        | Said::Free { number, .. }
        | Said::Warehouse { number, .. }) = said
        else {
            return;
        };
        if self.rank != Rank::Driver {
            return self.refuse(number, Code::OnlyLooks);
        }
        match said {
            Said::Do {
                robot,
                action,
                said_ms,
                ..
            } => {
                let late = self.late.hear(said_ms, handle.now());
                self.act(&robot, number, Given { what: action, late });
            }
            Said::Take { robot, .. } => self.take(robot, number),
            Said::Free { robot, .. } => {
                if self.wheels.remove(&robot).is_some() {
                    self.note(&robot, "free");
                }
                self.answer(number, "done");
            }
            Said::Keep { robot, .. } if self.wheels.contains_key(&robot) => {
                self.handover().keep(&robot);
                self.note(&robot, "keep");
                self.answer(number, "done");
            }
            Said::Keep { .. } => self.refuse(number, Code::NotDriver),
            Said::Renew { robot, .. } => match self.renew(&robot) {
                Ok(()) => self.answer(number, "done"),
                Err(why) => self.refuse(number, why),
            },
            Said::Warehouse { warehouse, .. } => match handle.set_warehouse(*warehouse) {
                Ok(saving) => {
                    self.saving.push((number, saving));
                    for view in handle.robots() {
                        self.note(&view.name, "warehouse");
                    }
                }
                Err(why) => self.refuse(number, why),
            },
            Said::Stop { .. } | Said::Here { .. } => {}
        }
    }

    /// Stops a simulated robot, and has it put into the saved warehouse.
    fn renew(&self, robot: &Name) -> Result<(), Reason> {
        let world = self.page.shared.world.as_ref();
        let Some(world) = world.filter(|world| world.robot == *robot) else {
            return Err(Reason::new(Code::FloorElsewhere, &[robot]));
        };
        let driver = self
            .driver_of(robot)
            .filter(|_| !self.wheels.contains_key(robot));
        if let Some(by) = driver {
            return Err(Reason::new(Code::AskDriver, &[&by]));
        }
        // The supervisor stops one, too, that this stop does not reach.
        if self.page.shared.handle.stop(robot).is_ok() {
            self.note(robot, "stop");
        }
        (world.renew)()
    }

    /// Takes a free wheel, or asks another page for it.
    fn take(&mut self, robot: Name, number: u32) {
        if self.wheels.contains_key(&robot) {
            return self.answer(number, "done");
        }
        let (page, now) = (self.page.number, Instant::now());
        let another = self.handover().who(&robot).map(str::to_owned);
        let another = another.filter(|another| *another != self.page.name);
        if another.is_none() && self.driver_of(&robot).is_none() {
            return self.seat(robot, number);
        }
        let asked = self.handover().ask(&robot, page, &self.page.name, now);
        match asked {
            Ok(()) => {
                self.note(&robot, "ask");
                if let Some(before) = self.asks.insert(robot, number) {
                    self.refuse(before, Code::AskedAnew);
                }
            }
            Err(who) => self.refuse(number, Reason::new(Code::WheelAsked, &[&who])),
        }
    }

    fn seat(&mut self, robot: Name, number: u32) {
        match self.page.shared.handle.take_wheel(&robot, &self.page.name) {
            Ok(driver) => {
                self.note(&robot, "take");
                self.wheels.insert(robot, driver);
                self.answer(number, "done");
            }
            Err(why) => self.refuse(number, &why),
        }
    }

    /// Takes the wheel if its driver has left for this page, or reports the driver's refusal.
    fn take_asked(&mut self) {
        for (robot, number) in std::mem::take(&mut self.asks) {
            let driver = self.driver_of(&robot);
            let request = self
                .handover()
                .look(&robot, self.page.number, Instant::now());
            if request == Request::Waits && driver.is_some() {
                self.asks.insert(robot, number);
                continue;
            }
            self.handover().withdraw(&robot, self.page.number);
            match (driver, request) {
                (None, _) => self.seat(robot, number),
                (Some(by), Request::Kept) => {
                    self.refuse(number, Reason::new(Code::WheelKept, &[&by]));
                }
                (Some(by), _) => {
                    self.refuse(number, Reason::new(Code::WheelUnanswered, &[&by]));
                }
            }
        }
    }

    fn handover(&self) -> MutexGuard<'_, Handover> {
        let handover = self.page.shared.handover.lock();
        handover.unwrap_or_else(PoisonError::into_inner)
    }

    fn act(&mut self, robot: &Name, number: u32, action: Given<Action>) {
        let driver = self.wheels.get(robot);
        let late = action.late;
        let asked = match (action.what, driver) {
            (Action::Drive { .. } | Action::Arm(_) | Action::Commission(_), None) => {
                return self.refuse(number, Code::NotDriver);
            }
            // Its lease is the station's.
            (Action::Drive { wheels, .. }, Some(driver)) => {
                driver.drive(Given { what: wheels, late })
            }
            (Action::Arm(step), Some(driver)) => driver.arm(Given { what: step, late }),
            (action, None) if is_the_drivers(action) && self.driver_of(robot).is_some() => {
                let by = self.driver_of(robot).unwrap_or_default();
                return self.refuse(number, Reason::new(Code::AskDriver, &[&by]));
            }
            // Whoever takes it by hand is there to drive it.
            (Action::Mode(Mode::Manual), None) => return self.refuse(number, Code::NotDriver),
            (_, _) => self.page.shared.handle.act(robot, action),
        };
        match asked {
            Ok(awaited) => self.asked.push((number, awaited)),
            Err(why) => return self.refuse(number, &why),
        }
        // What is held, steps and answers would be all that there is to read.
        let is_many = matches!(
            action.what,
            Action::Drive { .. }
                | Action::Arm(_)
                | Action::Commission(
                    Commission::Here | Commission::Stand | Commission::Answer { .. }
                )
        );
        if !is_many {
            self.note(robot, &Spelled(&action.what).to_string());
        }
    }

    fn note(&self, robot: &Name, what: &str) {
        self.page.shared.handle.note(robot, &self.page.name, what);
    }

    fn driver_of(&self, robot: &Name) -> Option<String> {
        self.page
            .shared
            .handle
            .look(|station| station.robot(robot)?.driver().map(str::to_owned))
    }

    fn answer(&mut self, number: u32, what: &str) {
        let _ = writeln!(self.lines, "answer {number} {what}");
    }

    fn refuse(&mut self, number: u32, why: impl Into<Reason>) {
        self.answer(number, &format!("refused {}", why.into().as_str()));
    }

    /// The news that the page has not been told yet.
    pub(crate) fn news(&mut self) -> String {
        if let Some(here) = self.wants_time.take() {
            let _ = writeln!(self.lines, "time {}{here}", History::now_ms());
        }
        self.take_answers();
        self.take_asked();
        self.keep_wheels();
        self.tell_events();
        let handle = self.page.shared.handle.clone();
        if handle.is_behind() {
            return std::mem::take(&mut self.lines);
        }
        let revision = handle.revision();
        if self.revision != Some(revision) || self.looked.elapsed() >= ABOUT {
            self.revision = Some(revision);
            self.looked = Instant::now();
            self.tell_warehouse();
            for view in handle.robots() {
                self.tell_robot(&view);
            }
        }
        std::mem::take(&mut self.lines)
    }

    fn take_answers(&mut self) {
        let asked = std::mem::take(&mut self.asked);
        for (number, awaited) in asked {
            match awaited.wait(Duration::ZERO) {
                None => self.asked.push((number, awaited)),
                Some(Reply::Done) => self.answer(number, "done"),
                Some(Reply::Stopped { after_ms }) => {
                    self.answer(number, &format!("stopped {after_ms}"));
                }
                Some(Reply::Refused(why)) => self.refuse(number, why),
                Some(Reply::Lost) => {
                    self.answer(number, &format!("lost {}", Code::RobotSilent.as_str()));
                }
            }
        }
        for (number, saving) in std::mem::take(&mut self.saving) {
            match saving.wait(Duration::ZERO) {
                None => self.saving.push((number, saving)),
                Some(Ok(())) => {
                    let told: Vec<_> = saving.told().map(|told| told.as_str().to_owned()).collect();
                    self.answer(number, &format!("done {}", told.join("; ")));
                }
                Some(Err(why)) => self.refuse(number, why),
            }
        }
    }

    /// Keeps the wheels as long as the page is there.
    fn keep_wheels(&mut self) {
        if self.stayed.elapsed() < STAY {
            return;
        }
        self.stayed = Instant::now();
        if std::mem::take(&mut self.there) {
            // A page that has lost the wheel reads it in the next line about the robot.
            let (handle, name) = (&self.page.shared.handle, &self.page.name);
            self.wheels.retain(|robot, driver| {
                let has_stayed = driver.stay().is_ok();
                if !has_stayed {
                    handle.note(robot, name, "free");
                }
                has_stayed
            });
        }
    }

    fn tell_events(&mut self) {
        while let Some(news) = self.subscription.next(Duration::ZERO) {
            let robot = news.robot;
            let Some(line) = news.told.line() else {
                continue;
            };
            let age = self.page.shared.handle.now().saturating_sub(news.at);
            let _ = match news.at < self.began || age > JUST_NOW {
                true => writeln!(self.lines, "past {robot} {} {line}", age.as_millis()),
                false => writeln!(self.lines, "from {robot} {line}"),
            };
        }
    }

    fn tell_warehouse(&mut self) {
        let told = self.warehouse.as_ref();
        let changed = self.page.shared.handle.look(|station| {
            let now = station.warehouse();
            (told.map(Option::as_ref) != Some(now)).then(|| now.cloned())
        });
        let Some(now) = changed else { return };
        // What a file of TOML can say JSON can say, too.
        if let Ok(json) = serde_json::to_string(&now) {
            let _ = writeln!(self.lines, "warehouse {json}");
        }
        if let Some(path) = self.page.shared.handle.kept_in() {
            let _ = writeln!(self.lines, "kept {}", path.display());
        }
        self.warehouse = Some(now);
    }

    fn tell_robot(&mut self, view: &View) {
        let View { name, shown, .. } = view;
        let connected = u8::from(view.doing != Doing::Away);
        let speaks = u8::from(view.is_extended);
        let driver = view.driver.as_deref().unwrap_or("-");
        let uses = view.uses.as_ref().map_or("-", Uses::as_str);
        let world = self.page.shared.world.as_ref();
        let renews = u8::from(world.is_some_and(|world| world.robot == *name));
        let age = shown.state.as_ref().map(|state| state.age(view.now));
        let mut about =
            format!("about {name} connected={connected} speaks={speaks} driver={driver}");
        if let Some(who) = self.handover().who(name) {
            let _ = write!(about, " asks={who}");
        }
        let _ = write!(about, " uses={uses} renews={renews}");

        let told = self.robots.entry(name.clone()).or_default();
        let reports = told.reports.newer(shown);
        // Most of what the station has heard says only that the robot is there, as its next state
        // does.
        let is_told = told.at.is_some_and(|at| at.elapsed() < ABOUT) && told.about == about;
        if is_told && reports.is_empty() {
            return;
        }
        told.at = Some(Instant::now());
        self.lines.push_str(&about);
        told.about = about;
        if let Some(age) = age {
            let _ = write!(self.lines, " age_ms={}", age.as_millis());
        }
        self.lines.push('\n');
        for (_, report) in reports {
            let _ = writeln!(self.lines, "from {name} {report}");
        }
    }
}

impl Drop for Visit {
    fn drop(&mut self) {
        for robot in std::mem::take(&mut self.asks).into_keys() {
            self.handover().withdraw(&robot, self.page.number);
        }
        // Nobody has the wheel of a page that is closed.
        for robot in std::mem::take(&mut self.wheels).into_keys() {
            self.note(&robot, "free");
        }
    }
}

/// Whether only the driver may do this while there is one, because it moves the robot, lets it
/// move, or changes how it drives. Everybody may change the queue of orders, and things in a
/// simulated world.
fn is_the_drivers(action: Action) -> bool {
    matches!(
        action,
        Action::Resume { .. }
            | Action::Mode(_)
            | Action::Pick(_)
            | Action::Picked { .. }
            | Action::Reset
            | Action::Place(_)
            | Action::Gains { .. }
            | Action::Calibrate
            | Action::Restart(_)
    )
}
