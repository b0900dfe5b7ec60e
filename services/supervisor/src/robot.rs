//! A running robot as its supervisor sees it: its processes, and the attendant's messages.
//!
//! It carries out what the [`Course`] wants: it starts, ends and kills processes, asks the
//! attendant and shows lines. On a busy machine everything takes longer although nothing is
//! damaged. So a process counts as silent only for the time in which it could have run.
//!
//! Every wait here is one sleep; children, signals and the attendant can end it
//! ([`Children::wait`]).

use std::net::TcpListener;
use std::os::fd::{AsFd, OwnedFd};
use std::path::PathBuf;
use std::process::Stdio;
use std::time::{Duration, Instant};

use anyhow::{Result, bail};
use lager_home::{ChanceClock, LockError, Watched};
use lager_ports::BusConfig;

use crate::children::{Children, PATIENCE, Start};
use crate::console;
use crate::course::{Course, Event, Services, Step};
use crate::figures::Figures;
use crate::kept_orders::Keeping;
use crate::link::{AttendantLink, SILENCE};
use crate::manager::ServiceManager;
use crate::mission::Mission;
use crate::narrator::Note;
use crate::protocol::{Begin, Line, Pulse, Request, Sweep, Word};
use crate::report::MissionReport;
use crate::runtime_folder::NameLock;
use crate::service::Service;
use crate::signals::Signals;
use crate::state_folder::WarehouseCopy;
use crate::terminal::Terminal;

/// How often this process wakes up by itself.
const LOOK: Duration = Duration::from_millis(500);
/// How long a service may take to stop on a damaged bus; a bridge stops the motors in less.
const HASTE: Duration = Duration::from_millis(500);

/// Everything with which a robot starts.
pub struct Plan {
    /// The configuration of its processes, in TOML.
    pub config: String,
    /// Its bus.
    pub bus: BusConfig,
    /// The service that stands for the boards, if they are not real.
    pub body: Option<Service>,
    /// The services that talk to others, in the order of their start.
    pub talkers: Vec<Service>,
    /// The socket for robots of a station of its own.
    pub listener: Option<TcpListener>,
    /// The folder of the EEPROMs of simulated or emulated boards.
    pub eeprom: Option<PathBuf>,
    /// The copy of its warehouse's file, if it runs in one.
    pub warehouse: Option<WarehouseCopy>,
    /// Finds out with what it starts again when a person wants what is saved to be used.
    pub renewal: Option<Box<dyn Fn() -> Result<Renewed>>>,
    /// The products that it has to fetch.
    pub mission: Mission,
    /// Its orders, and the file that keeps them for another `up`.
    pub keeping: Keeping,
    /// What to tell people before it starts.
    pub first_notes: Vec<String>,
    /// Whether to end when the mission has ended.
    pub exit_when_done: bool,
}

/// With what a robot starts again.
pub struct Renewed {
    /// The configuration of the robot's processes, in TOML.
    pub config: String,
    /// The copy of its warehouse's file, if it runs in one.
    pub warehouse: Option<WarehouseCopy>,
    /// If its world is another one: the products that this has.
    pub products: Option<Vec<i32>>,
}

/// A robot that is up.
pub struct Robot {
    // The first field is dropped first: nothing may run in a folder that is removed.
    children: Children,
    lock: NameLock,
    plan: Plan,
    course: Course,
    attendant: AttendantLink,
    /// Products that were delivered but do not lie where they should.
    misplaced: Vec<i32>,
    figures: Figures,
    signals: Signals,
    terminal: Terminal,
    /// How long the body could have run while services waited for its clock.
    body: Option<ChanceClock>,
    /// With what the robot starts again now, because a person wants it.
    renewed: Option<Renewed>,
    began: Instant,
    folder_looked: Instant,
    /// What others were told last of the services.
    told: Vec<Watched>,
    manager: ServiceManager,
}

impl Robot {
    /// A robot of which nothing has started.
    ///
    /// # Errors
    /// This program's own file is not found, or the system has no thread.
    pub fn new(plan: Plan, lock: NameLock, signals: Signals, terminal: Terminal) -> Result<Self> {
        let now = Instant::now();
        let children = Children::new(plan.config.clone())?;
        // The services' times begin with their supervisor. Only an emulated body has a time of its
        // own.
        let real_start = Duration::from_nanos(children.started_ns());
        let robot_start = match plan.bus.clock {
            None => Some(real_start.mul_f64(plan.bus.speed)),
            Some(_) => None,
        };
        let services = Services {
            body: plan.body,
            talkers: plan.talkers.clone(),
        };
        Ok(Self {
            children,
            lock,
            course: Course::new(services, plan.exit_when_done),
            plan,
            attendant: AttendantLink::absent(),
            misplaced: Vec::new(),
            figures: Figures::new(now, robot_start),
            signals,
            terminal,
            body: None,
            renewed: None,
            began: now,
            folder_looked: now,
            told: Vec::new(),
            manager: ServiceManager::of_this_process()?,
        })
    }

    /// Runs until a signal, or until the mission has ended if the robot ends with it.
    ///
    /// # Errors
    /// The robot does not start, or the bus is damaged again and again.
    pub fn run(&mut self) -> Result<()> {
        for line in core::mem::take(&mut self.plan.first_notes) {
            self.note(&line);
        }
        self.manager.status("starts its services");
        let steps = self.course.begin(self.now());
        self.carry_out(steps)?;
        while !self.signals.end_asked() {
            self.turn()?;
            self.tell_services();
            self.tell_manager();
            let ended = self.plan.mission.outcome().is_some();
            let over = ended || self.children.hopeless().is_some();
            // Clear a damaged bus before the end, too.
            if self.plan.exit_when_done && over && self.course.is_swept() {
                break;
            }
            self.wait();
        }
        if self.course.rests() {
            self.clear();
        }
        Ok(())
    }

    /// Ends all services and reports the result. Returns whether the mission was delivered.
    ///
    /// # Errors
    /// The JSON line cannot be written.
    pub fn finish(mut self, json: bool) -> Result<bool> {
        let hopeless = self.children.hopeless();
        self.manager.stopping();
        // Stop the robot before anything else.
        self.stop(PATIENCE);
        let mission = core::mem::take(&mut self.plan.mission);
        let failure = match mission.outcome() {
            Some(Err(why)) => Some(why.to_owned()),
            None if self.plan.exit_when_done => Some(match hopeless {
                Some(service) => format!("the {service} ends at every start"),
                None => "interrupted before the mission was delivered".into(),
            }),
            _ => (self.misplaced.first())
                .map(|product| format!("goods {product} do not lie at the delivery station")),
        };
        let report = MissionReport {
            delivered: mission.delivered().to_vec(),
            sim_seconds: self.figures.robot_time.as_secs_f64(),
            wall_seconds: self.figures.started.elapsed().as_secs_f64(),
            frames: self.figures.frames,
            lost: self.figures.lost + self.figures.lost_elsewhere,
            restarts: self.children.restarts(),
            failure,
            failure_kind: mission.failure_kind(),
            hold: mission.hold(),
        };
        if json {
            self.terminal.finish();
            console::print(&serde_json::to_string(&report)?)?;
        } else {
            self.note(&report.sentence());
            self.terminal.finish();
        }
        Ok(report.failure.is_none())
    }

    /// Real time since the start.
    fn now(&self) -> Duration {
        self.began.elapsed()
    }

    /// Takes what has come, and does what must be done now.
    fn turn(&mut self) -> Result<()> {
        // While it rests, too: a request that stays unread would never let it sleep.
        if self.signals.renewal_asked() {
            self.renew()?;
        }
        let due = self.course.look(self.now());
        self.carry_out(due)?;
        if !self.attendant.joined {
            // This loop goes round, and it waits for no longer than the course allows.
            self.manager.goes_on();
        }
        if self.course.rests() {
            return Ok(());
        }
        self.hear()?;
        for ended in self.children.reap() {
            if ended.service == Service::Attendant {
                self.forget_attendant();
            }
            self.happened(Event::Ended(ended))?;
        }
        self.look_at_attendant()?;
        self.look_at_folder()?;
        for service in self.children.due() {
            self.happened(Event::Due(service))?;
        }
        Ok(())
    }

    /// Tells others how the services are, when that has changed.
    fn tell_services(&mut self) {
        let services = self.children.watched();
        if services != self.told {
            self.lock.tell(&services);
            self.told = services;
        }
    }

    /// Tells the service manager that the robot is up, once its services are at work. Those that
    /// talk to others need not: a port may be taken for long. Nor need the boards be there: a
    /// missing board is a state of the robot.
    fn tell_manager(&mut self) {
        if self.manager.knows() || !self.course.is_whole() {
            return;
        }
        let running: Vec<Service> = self
            .children
            .running()
            .map(|(service, _)| service)
            .collect();
        let mut movers = self
            .plan
            .body
            .into_iter()
            .chain([Service::Bridge, Service::Logic]);
        // The attendant is one of them, and tells of the others.
        let services = running.len() - 1;
        if movers.all(|mover| running.contains(&mover)) && self.figures.last.at_work >= services {
            self.manager.ready();
            self.manager.status(&format!("{services} services are up"));
        }
    }

    /// Stops the robot, and starts it again with what is saved: its description and, if it is
    /// simulated, the warehouse of its own station, on whose delivery node it is put. Either way it
    /// stands until a person releases this stop: one who has released an earlier stop did not know of
    /// the new start.
    fn renew(&mut self) -> Result<()> {
        let renewed = self.lock.stop().and_then(|()| match &self.plan.renewal {
            Some(renewal) => renewal(),
            None => bail!("it ends with its mission"),
        });
        let renewed = match renewed {
            Ok(renewed) => renewed,
            Err(error) => {
                self.note(&format!(
                    "the robot is stopped, and goes on with what it had: {error:#}"
                ));
                return Ok(());
            }
        };
        self.note(match renewed.products {
            Some(_) => "the robot is stopped and put on the delivery node of the warehouse that was saved; `lager resume` lets it move",
            None => "the robot is stopped and starts again with what was saved; `lager resume` lets it move",
        });
        self.children.configure(renewed.config.clone());
        self.plan.config.clone_from(&renewed.config);
        self.plan.warehouse.clone_from(&renewed.warehouse);
        self.renewed = Some(renewed);
        self.happened(Event::Renewed)
    }

    fn happened(&mut self, event: Event) -> Result<()> {
        let steps = self.course.take(event, self.now());
        self.carry_out(steps)
    }

    fn carry_out(&mut self, steps: Vec<Step>) -> Result<()> {
        for step in steps {
            match step {
                Step::Attend(sweep) => self.start_attendant(sweep)?,
                Step::Start(service, resume) => self.start(service, resume),
                Step::Kill(service) => self.children.kill(service),
                Step::HandOver(service) => {
                    if !self.tell(&Request::HandOver(service)) {
                        self.happened(Event::HandedOver(service))?;
                    }
                }
                Step::Say(text) => {
                    self.manager.status(&text);
                    self.note(&text);
                }
                Step::StopAll(lost) => {
                    self.stop(HASTE);
                    lost.iter().for_each(|why| self.give_mission_up(why));
                }
                Step::Restore => self.restore()?,
                Step::Clear => self.clear(),
                Step::Fail(why) => bail!(why),
            }
        }
        Ok(())
    }

    /// Prepares a new start. If that fails, the cause may pass, such as a full memory.
    ///
    /// # Errors
    /// Somebody else has taken the robot's name, or the robot ends with its mission.
    fn restore(&mut self) -> Result<()> {
        let Plan {
            bus,
            config,
            eeprom,
            warehouse,
            keeping,
            mission,
            ..
        } = &mut self.plan;
        let restored = self
            .lock
            .restore(bus, config, eeprom.as_deref())
            .and_then(|()| warehouse.as_ref().map(WarehouseCopy::write).transpose())
            // Somebody may have released the stop before the last service ended.
            .and_then(|_| self.renewed.as_ref().map(|_| self.lock.hold()).transpose());
        if let Err(error) = restored {
            if matches!(error.downcast_ref(), Some(LockError::Up { .. })) {
                return Err(error);
            }
            return self.happened(Event::Damaged(format!("{error:#}")));
        }
        self.told.clear();
        // Nobody knows the robot's orders any more, and a simulated world is a new one.
        keeping.begin_again();
        let renewed = self.renewed.take();
        if renewed.is_some() {
            mission.begin_again("the robot was started again in the middle of it");
        }
        let products = renewed.and_then(|renewed| renewed.products);
        let dropped = products.map(|products| keeping.keep_only(&products));
        for product in dropped.unwrap_or_default() {
            self.note(&format!(
                "the order for goods {product} is dropped: they are not in this warehouse"
            ));
        }
        self.happened(Event::Restored)
    }

    fn give_mission_up(&mut self, why: &str) {
        if self.plan.mission.outcome().is_some() {
            return;
        }
        self.plan.mission.give_up(&format!(
            "the robot was started again in the middle of it: {why}"
        ));
        self.note("the mission is given up, since nobody knows where the robot stands: put it down, say where (`lager place`, `lager reset`), release the stop (`lager resume`), and order anew");
    }

    /// Has the bus cleared while nothing runs on it.
    fn clear(&mut self) {
        self.stop(HASTE);
        let began = Instant::now();
        let _ = self.start_attendant(Sweep::EverythingAndEnd);
        while let Some(line) = &self.attendant.line
            && began.elapsed() < SILENCE
        {
            match line.receive() {
                Ok(Some(Word::Swept)) | Err(_) => break,
                Ok(_) => self.wait(),
            }
        }
    }

    /// Ends all services in order and takes the attendant's last messages.
    fn stop(&mut self, patience: Duration) {
        let told = self.children.stop(patience, &mut self.signals);
        while let Some(line) = &self.attendant.line
            && let Ok(Some(word)) = line.receive()
        {
            // The robot leaves its bus and its services, so nothing more must be done about them.
            let _ = self.take_down(word);
        }
        self.forget_attendant();
        self.body = None;
        for line in told {
            self.note(&line);
        }
    }

    fn forget_attendant(&mut self) {
        self.figures.attendant_ended();
        self.attendant = AttendantLink::absent();
    }

    fn wait(&self) {
        let at_most = self
            .manager
            .rhythm()
            .map_or(LOOK, |rhythm| rhythm.min(LOOK));
        let at_most = self.course.idle(self.now(), at_most);
        let mut sources = vec![self.signals.as_fd(), self.signals.renewal()];
        sources.extend(self.attendant.line.as_ref().map(AsFd::as_fd));
        self.children.wait(&sources, at_most);
    }

    /// Takes the attendant's messages.
    fn hear(&mut self) -> Result<()> {
        while let Some(line) = &self.attendant.line {
            match line.receive() {
                Ok(Some(word)) => {
                    self.course.attended(self.attendant.look());
                    self.attendant.spoke = self.attendant.ran;
                    self.manager.goes_on();
                    if let Some(event) = self.take_down(word) {
                        self.happened(event)?;
                    }
                }
                Ok(None) => break,
                // It has ended, or something else is at the other end.
                Err(_) => {
                    self.children.kill(Service::Attendant);
                    self.attendant.line = None;
                }
            }
        }
        Ok(())
    }

    /// Keeps the content of a message. Returns the events for the course.
    fn take_down(&mut self, word: Word) -> Option<Event> {
        match word {
            Word::Swept => return Some(Event::Swept),
            Word::Pulse(pulse) => return self.take_pulse(pulse),
            Word::Note(note) => {
                self.manager.status(&format!("{} {}", note.who, note.text));
                self.terminal.show(&note);
            }
            Word::HandedOver(service) => return Some(Event::HandedOver(service)),
            Word::Silent(silence) => {
                let is_it = self.children.process(silence.service) == Some(silence.pid);
                return is_it.then_some(Event::Silent(silence));
            }
            Word::Damaged(why) => return Some(Event::Damaged(why)),
            Word::Mission(mission) => self.plan.mission = mission,
            Word::Kept { left, all } => self.plan.keeping.take(left, all),
            Word::Misplaced(products) => self.misplaced = products,
        }
        None
    }

    fn take_pulse(&mut self, pulse: Pulse) -> Option<Event> {
        self.figures.take(pulse);
        self.attendant.joined |= pulse.robot_time.is_some();
        self.attendant.joined.then_some(Event::Joined)
    }

    fn look_at_attendant(&mut self) -> Result<()> {
        self.course.attended(self.attendant.look());
        if self.children.process(Service::Attendant).is_none() {
            return Ok(());
        }
        if self.course.waits_for_clock() {
            let ran = self.body_ran();
            self.happened(Event::NoClock(ran))?;
        } else {
            self.body = None;
        }
        if self.attendant.is_silent() {
            self.attendant.spoke = self.attendant.ran;
            self.happened(Event::AttendantSilent)?;
        }
        Ok(())
    }

    /// How long the body could have run while services waited for its clock.
    fn body_ran(&mut self) -> Option<Duration> {
        let pid = self.children.process(self.plan.body?)?;
        let ran = self
            .body
            .get_or_insert_with(|| ChanceClock::of_process(pid));
        Some(ran.look(LOOK * 2))
    }

    fn look_at_folder(&mut self) -> Result<()> {
        if self.folder_looked.elapsed() < LOOK {
            return Ok(());
        }
        self.folder_looked = Instant::now();
        self.lock.renew();
        match self.lock.is_held() {
            true => Ok(()),
            false => self.happened(Event::Damaged("the robot's folder was removed".into())),
        }
    }

    fn start_attendant(&mut self, sweep: Sweep) -> Result<()> {
        let (line, output) = Line::pair()?;
        let start = Start {
            resume: false,
            output,
            errors: self.terminal.errors(),
        };
        self.attendant = AttendantLink::absent();
        match self.children.start(Service::Attendant, start) {
            Ok(pid) => self.attendant.clock = Some(ChanceClock::of_process(pid)),
            Err(error) => {
                self.note(&format!("{error:#}"));
                return Ok(());
            }
        }
        self.attendant.line = Some(line);
        self.tell(&Request::Begin(Begin {
            robot_start: self.figures.robot_start,
            mission: self.plan.mission.clone(),
            kept: self.plan.keeping.left().clone(),
            joins_late: self.figures.is_told && sweep == Sweep::TheDead,
            sweep,
        }));
        for (service, pid) in self.children.running() {
            if service != Service::Attendant {
                self.tell(&Request::Started(service, pid));
            }
        }
        Ok(())
    }

    /// Starts a service. If that fails, the service counts as one that ended at once.
    fn start(&mut self, service: Service, resume: bool) {
        let output = match &self.plan.listener {
            Some(listener) if service == Service::Station => match listener.try_clone() {
                Ok(listener) => OwnedFd::from(listener).into(),
                Err(error) => return self.note(&format!("the station has no socket: {error}")),
            },
            // Standard output of this process is for its JSON line.
            _ => Stdio::null(),
        };
        let start = Start {
            resume,
            output,
            errors: self.terminal.errors(),
        };
        match self.children.start(service, start) {
            Ok(pid) => {
                self.tell(&Request::Started(service, pid));
            }
            Err(error) => self.note(&format!("{error:#}")),
        }
    }

    /// Sends the attendant a message. Returns whether that worked. An attendant that does not read
    /// soon falls silent, too.
    fn tell(&self, request: &Request) -> bool {
        let line = self.attendant.line.as_ref();
        line.is_some_and(|line| line.send(request).is_ok())
    }

    /// A line of this process's own.
    fn note(&self, text: &str) {
        self.terminal.show(&Note {
            at: self.figures.now(&self.plan.bus),
            who: "up".to_owned(),
            text: text.to_owned(),
        });
    }
}
