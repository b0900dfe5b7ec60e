//! A running robot as its supervisor sees it: processes, and what the attendant tells of them.
//!
//! ```text
//!            swept             joined the bus
//!  attendant ------> the body ----------------> station, comm, bridge, logic
//!     ^                                             │
//!     +-- all ended, in order; what is left swept <-+ the bus is damaged (at most three times)
//! ```
//! A service that ends or falls silent is restarted alone. The bus counts as damaged where that
//! would not help: a process that hangs before its first sample, or whose memory was gone, has met
//! shared files that its successor would meet too.
//!
//! Every wait here is one sleep that children, signals and the attendant end
//! ([`Supervisor::wait`]).

use std::os::fd::{AsFd, OwnedFd};
use std::process::Stdio;
use std::time::{Duration, Instant};

use anyhow::{Result, bail};

use super::external::External;
use super::resets::{MOST, Remedy, Resets};
use crate::config::Config;
use crate::kept::{Kept, KeptFile};
use crate::mission::Mission;
use crate::outcome::Outcome;
use crate::report::Note;
use crate::runtime::NameLock;
use crate::services::Service;
use crate::signals::Signals;
use crate::state::World;
use crate::supervisor::{Ended, PATIENCE, Start, Supervisor};
use crate::terminal::Terminal;
use crate::words::{Begin, Line, Pulse, Request, Silence, Sweep, Word};

/// How often this process looks up by itself.
const LOOK: Duration = Duration::from_millis(500);
/// How long a successor may have to wait for what is kept for it.
const HAND_OVER: Duration = Duration::from_millis(100);
/// How long the attendant may be silent.
const SILENCE: Duration = Duration::from_secs(2);
/// How long an emulated body may take until it has a clock.
const BODY_START: Duration = Duration::from_secs(30);
/// How long a service may take to stop on a damaged bus; a bridge stops the motors in less.
const HASTE: Duration = Duration::from_millis(500);

/// How long after a pulse an emulated body's time is taken to go on.
const PULSE: Duration = Duration::from_millis(200);

/// A robot that is up.
pub struct Robot {
    // First, so that nothing is left running in a folder that is removed.
    supervisor: Supervisor,
    lock: NameLock,
    config: Config,
    attendant: Attendant,
    /// The services that wait for a successor.
    owed: Vec<Owed>,
    /// The external computer, and where it listens if it is this robot's own.
    external: External,
    mission: Option<Mission>,
    /// What the robot is still to be given back, all that is to be kept, and where.
    left: Kept,
    kept: Kept,
    kept_file: Option<KeptFile>,
    /// What people are told before it starts.
    pub first_notes: Vec<String>,
    /// The copy of its warehouse's file, if it runs in one.
    pub world: Option<World>,
    /// Products that were delivered and do not lie where they should.
    misplaced: Vec<i32>,
    figures: Figures,
    signals: Signals,
    terminal: Terminal,
    resets: Resets,
    stage: Stage,
    stage_began: Instant,
    folder_looked: Instant,
}

/// How far the robot has been started.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// The attendant removes what is left on the bus.
    Sweeping,
    /// The body runs, and the attendant joins the bus with the body's clock.
    Joining,
    /// Everything has been started.
    Whole,
}

/// The attendant, as far as it is heard.
struct Attendant {
    line: Option<Line>,
    joined: bool,
    /// How long it has been silent, and when that was looked at.
    silent: Duration,
    looked: Instant,
}

/// A service that has ended, and what is kept for its successor.
struct Owed {
    service: Service,
    ended: Instant,
    served: bool,
}

/// What the robot has done, over the lives of all attendants.
struct Figures {
    started: Instant,
    robot_start: Option<Duration>,
    robot_time: Duration,
    told: Instant,
    last: Pulse,
    /// Frames of the attendants before this one, and those that they lost themselves.
    frames: u64,
    lost: u64,
    /// Frames lost on the wires and by the services.
    lost_elsewhere: u64,
}

impl Robot {
    /// A robot of which nothing has been started yet.
    pub fn new(
        config: Config,
        lock: NameLock,
        external: External,
        mission: Option<Mission>,
        signals: Signals,
        terminal: Terminal,
    ) -> Result<Self> {
        let now = Instant::now();
        Ok(Self {
            supervisor: Supervisor::new(toml::to_string(&config)?)?,
            lock,
            config,
            attendant: Attendant::absent(),
            owed: Vec::new(),
            external,
            mission,
            left: Kept::default(),
            kept: Kept::default(),
            kept_file: None,
            first_notes: Vec::new(),
            world: None,
            misplaced: Vec::new(),
            figures: Figures::new(now),
            signals,
            terminal,
            resets: Resets::default(),
            stage: Stage::Sweeping,
            stage_began: now,
            folder_looked: now,
        })
    }

    /// It is given back `kept`, and what it has to do from then on is kept in a file.
    pub fn goes_on_with(&mut self, kept: Kept, file: KeptFile) {
        file.keep(kept.clone());
        (self.left, self.kept) = (kept.clone(), kept);
        self.kept_file = Some(file);
    }

    /// Runs until a signal asks for the end, or with `exit_when_done` the mission has ended.
    ///
    /// # Errors
    /// The robot does not start, or the bus does not hold.
    pub fn run(&mut self, exit_when_done: bool) -> Result<()> {
        self.note(&self.external.told);
        let external = self.external.panel.iter().chain(&self.external.gateway);
        for line in external.chain(&self.first_notes) {
            self.note(line);
        }
        self.begin()?;
        while !self.signals.end_asked() {
            if let Some(why) = self.turn()? {
                self.begin_again(&why)?;
            }
            let ended = self.mission.as_ref().and_then(Mission::outcome).is_some();
            let over = ended || self.supervisor.hopeless().is_some();
            // A damaged bus is swept before the end, too.
            if exit_when_done && over && self.stage != Stage::Sweeping {
                break;
            }
            self.wait();
        }
        Ok(())
    }

    /// Ends all services and says what came of it.
    ///
    /// # Errors
    /// The JSON line cannot be written.
    pub fn finish(mut self, exit_when_done: bool, json: bool) -> Result<Outcome> {
        let hopeless = self.supervisor.hopeless();
        // The robot is stopped before anything else is looked at.
        self.stop(PATIENCE);
        let mission = self.mission.take().unwrap_or_default();
        let failure = match mission.outcome() {
            Some(Err(why)) => Some(why.to_owned()),
            None if exit_when_done => Some(match hopeless {
                Some(service) => format!("the {service} ends at every start"),
                None => "interrupted before the mission was delivered".into(),
            }),
            _ => (self.misplaced.first())
                .map(|product| format!("product {product} does not lie at the delivery station")),
        };
        let outcome = Outcome {
            delivered: mission.delivered().to_vec(),
            sim_seconds: self.figures.robot_time.as_secs_f64(),
            wall_seconds: self.figures.started.elapsed().as_secs_f64(),
            frames: self.figures.frames,
            lost: self.figures.lost + self.figures.lost_elsewhere,
            restarts: self.supervisor.restarts(),
            failure,
            failure_kind: mission.failure_kind(),
            hold: mission.hold(),
        };
        if json {
            self.terminal.finish();
            crate::say(&serde_json::to_string(&outcome)?)?;
        } else {
            self.note(&outcome.sentence());
            self.terminal.finish();
        }
        Ok(outcome)
    }

    /// Starts the first of everything.
    fn begin(&mut self) -> Result<()> {
        self.enter(Stage::Sweeping);
        self.owed.clear();
        self.start_attendant(self.sweep())
    }

    /// Ends everything, and starts it again on a bus from which all of it is swept.
    fn begin_again(&mut self, why: &str) -> Result<()> {
        match self.resets.damaged(Instant::now()) {
            Remedy::StartAgain(count) => self.note(&format!(
                "the bus is damaged: {why}; starting everything again ({count} of {MOST})"
            )),
            Remedy::GiveUp => {
                self.leave();
                bail!(
                    "the bus does not hold: {why}; {MOST} new starts were in vain. See whether its memory is full (`df /dev/shm`), and what `lager doctor` finds"
                )
            }
        }
        self.stop(HASTE);
        if let Some(mission) = &mut self.mission {
            mission.give_up(&format!(
                "the robot was started again in the middle of it: {why}"
            ));
        }
        self.lock.restore(&self.config)?;
        self.world.as_ref().map(World::write).transpose()?;
        // Nobody knows any more what it had to do, and a simulated world is a new one.
        self.left = self.kept.clone();
        self.begin()
    }

    /// Ends everything on a damaged bus, and has it cleared.
    fn leave(&mut self) {
        self.stop(HASTE);
        self.enter(Stage::Sweeping);
        let _ = self.start_attendant(Sweep::EverythingAndEnd);
        while let Some(line) = &self.attendant.line
            && self.stage_began.elapsed() < SILENCE
        {
            match line.receive() {
                Ok(Some(Word::Swept)) | Err(_) => break,
                Ok(_) => self.wait(),
            }
        }
    }

    /// Ends all services in order and hears the attendant's last words.
    fn stop(&mut self, patience: Duration) {
        let told = self.supervisor.stop(patience, &mut self.signals);
        let _ = self.hear();
        self.figures.attendant_ended();
        self.attendant = Attendant::absent();
        for line in told {
            self.note(&line);
        }
    }

    fn enter(&mut self, stage: Stage) {
        self.stage = stage;
        self.stage_began = Instant::now();
    }

    /// Takes what has come and does what is due; returns why the bus counts as damaged, if it does.
    fn turn(&mut self) -> Result<Option<String>> {
        let mut damage = self.hear();
        for ended in self.supervisor.reap() {
            damage = damage.or(self.take_end(&ended)?);
        }
        damage = damage.or_else(|| self.look_at_attendant());
        damage = damage.or_else(|| self.look_at_folder());
        if damage.is_none() {
            self.start_due()?;
        }
        Ok(damage)
    }

    fn wait(&self) {
        let unserved = self.owed.iter().filter(|owed| !owed.served);
        let at_most = unserved
            .map(|owed| HAND_OVER.saturating_sub(owed.ended.elapsed()))
            .fold(LOOK, Duration::min);
        let mut sources = vec![self.signals.as_fd()];
        sources.extend(self.attendant.line.as_ref().map(AsFd::as_fd));
        self.supervisor.wait(&sources, at_most);
    }

    /// Takes what the attendant has said.
    fn hear(&mut self) -> Option<String> {
        let mut damage = None;
        while let Some(line) = &self.attendant.line {
            match line.receive() {
                Ok(Some(word)) => {
                    self.attendant.silent = Duration::ZERO;
                    damage = damage.or(self.take_word(word));
                }
                Ok(None) => break,
                // It has ended, or something else is at the other end.
                Err(_) => {
                    self.supervisor.kill(Service::Attendant);
                    self.attendant.line = None;
                }
            }
        }
        damage
    }

    fn take_word(&mut self, word: Word) -> Option<String> {
        match word {
            Word::Swept if self.stage == Stage::Sweeping => {
                self.enter(Stage::Joining);
                if let Some(body) = self.config.body.service() {
                    // After a new start there is no world to resume: no process keeps it.
                    self.start(body, false);
                }
            }
            Word::Swept => {}
            Word::Pulse(pulse) => self.take_pulse(pulse),
            Word::Note(note) => self.terminal.show(note),
            Word::HandedOver(service) => {
                for owed in self.owed.iter_mut().filter(|owed| owed.service == service) {
                    owed.served = true;
                }
            }
            Word::Silent(silence) => return self.take_silence(silence),
            Word::Damaged(why) => return Some(why),
            Word::Mission(mission) => self.mission = Some(mission),
            Word::Kept { left, all } => {
                self.left = left;
                let file = self.kept_file.as_ref().filter(|_| self.kept != all);
                file.into_iter().for_each(|file| file.keep(all.clone()));
                self.kept = all;
            }
            Word::Misplaced(products) => self.misplaced = products,
        }
        None
    }

    fn take_pulse(&mut self, pulse: Pulse) {
        self.figures.take(pulse);
        self.attendant.joined |= pulse.robot_time.is_some();
        if self.attendant.joined && self.stage == Stage::Joining {
            // A service that has run before resumes, or stands if its state is lost.
            let resume = self.resets.whole(Instant::now());
            // What talks goes first, so that it ends after what moves the robot.
            if self.external.listener.is_some() {
                self.start(Service::Station, resume);
            }
            if self.config.station.wanted {
                self.start(Service::Comm, resume);
            }
            if self.config.gateway.is_wanted() {
                self.start(Service::Gateway, resume);
            }
            self.start(Service::Bridge, resume);
            self.start(Service::Logic, resume);
            self.enter(Stage::Whole);
        }
    }

    /// A service lives and is silent. If it was heard before, it hangs, and its successor may do
    /// better. If it was never heard, it cannot get onto the bus.
    fn take_silence(&mut self, silence: Silence) -> Option<String> {
        let service = silence.service;
        if self.supervisor.process(service) != Some(silence.pid) {
            return None;
        }
        self.supervisor.kill(service);
        if !silence.was_heard {
            return Some(format!("nothing is heard of the {service}, which runs"));
        }
        self.note(&format!(
            "the {service} does not answer any more and is killed"
        ));
        None
    }

    fn take_end(&mut self, ended: &Ended) -> Result<Option<String>> {
        let (service, how) = (ended.service, &ended.how);
        self.note(&format!("the {service} ended ({how})"));
        let lost = ended
            .lost_memory
            .then(|| format!("memory of the {service} was gone ({how})"));
        let first_start = self.stage != Stage::Whole && !self.resets.have_been();
        if first_start && ended.by_itself {
            bail!("the {service} does not start ({how})");
        }
        if service == Service::Attendant {
            // One that was killed may do better next time.
            let refused = !self.attendant.joined && ended.by_itself;
            self.figures.attendant_ended();
            self.attendant = Attendant::absent();
            return Ok(
                lost.or_else(|| refused.then(|| format!("the attendant cannot join it ({how})")))
            );
        }
        self.owed.retain(|owed| owed.service != service);
        self.owed.push(Owed {
            service,
            ended: Instant::now(),
            served: !self.tell(&Request::HandOver(service)) || !self.attendant.joined,
        });
        Ok(lost)
    }

    fn look_at_attendant(&mut self) -> Option<String> {
        let now = Instant::now();
        let attendant = &mut self.attendant;
        // Time during which this process slept is not the attendant's silence.
        attendant.silent += (now - attendant.looked).min(LOOK * 2);
        attendant.looked = now;
        self.supervisor.process(Service::Attendant)?;
        if self.stage == Stage::Joining && self.stage_began.elapsed() > BODY_START {
            return Some("there is no clock of the body to follow".into());
        }
        if attendant.silent < SILENCE {
            return None;
        }
        attendant.silent = Duration::ZERO;
        let joined = attendant.joined;
        self.supervisor.kill(Service::Attendant);
        if !joined {
            return Some("whoever opens it hangs".into());
        }
        self.note("the attendant does not answer any more and is killed");
        None
    }

    fn look_at_folder(&mut self) -> Option<String> {
        if self.folder_looked.elapsed() < LOOK {
            return None;
        }
        self.folder_looked = Instant::now();
        self.lock.renew();
        (!self.lock.is_held()).then(|| "the robot's folder was removed".into())
    }

    /// Starts again what has ended, once what is kept for it can be found, or cannot be waited for.
    fn start_due(&mut self) -> Result<()> {
        for service in self.supervisor.due() {
            if service == Service::Attendant {
                self.start_attendant(self.sweep())?;
                continue;
            }
            let owed = self.owed.iter().find(|owed| owed.service == service);
            if owed.is_none_or(|owed| owed.served || owed.ended.elapsed() >= HAND_OVER) {
                self.start(service, true);
            }
        }
        Ok(())
    }

    /// What the attendant is to remove.
    fn sweep(&self) -> Sweep {
        match self.stage == Stage::Sweeping && self.resets.have_been() {
            true => Sweep::Everything,
            false => Sweep::TheDead,
        }
    }

    fn start_attendant(&mut self, sweep: Sweep) -> Result<()> {
        let (line, output) = Line::pair()?;
        let start = Start {
            resume: false,
            output,
        };
        self.attendant = Attendant::absent();
        if let Err(error) = self.supervisor.start(Service::Attendant, start) {
            self.note(&format!("{error:#}"));
            return Ok(());
        }
        self.attendant.line = Some(line);
        self.tell(&Request::Begin(Begin {
            robot_start: self.figures.robot_start,
            mission: self.mission.clone(),
            kept: self.left.clone(),
            sweep,
        }));
        for (service, pid) in self.supervisor.running() {
            if service != Service::Attendant {
                self.tell(&Request::Started(service, pid));
            }
        }
        Ok(())
    }

    /// Starts a service. One that cannot be started counts as one that ended at once.
    fn start(&mut self, service: Service, resume: bool) {
        self.owed.retain(|owed| owed.service != service);
        let output = match &self.external.listener {
            Some(listener) if service == Service::Station => match listener.try_clone() {
                Ok(listener) => OwnedFd::from(listener).into(),
                Err(error) => return self.note(&format!("the station has no socket: {error}")),
            },
            // This process's own is for its JSON line.
            _ => Stdio::null(),
        };
        let start = Start { resume, output };
        match self.supervisor.start(service, start) {
            Ok(pid) => {
                self.tell(&Request::Started(service, pid));
            }
            Err(error) => self.note(&format!("{error:#}")),
        }
    }

    /// Tells the attendant something; whether that was possible. One that does not listen falls
    /// silent, too.
    fn tell(&self, request: &Request) -> bool {
        let line = self.attendant.line.as_ref();
        line.is_some_and(|line| line.send(request).is_ok())
    }

    /// A line of this process's own.
    fn note(&self, text: &str) {
        let since_told = match self.config.chip.clock {
            Some(_) => self.figures.told.elapsed().min(PULSE),
            None => self.figures.told.elapsed(),
        };
        self.terminal.show(Note {
            at: self.figures.robot_time + since_told.mul_f64(self.config.speed),
            who: "up".to_owned(),
            text: text.to_owned(),
        });
    }
}

impl Attendant {
    fn absent() -> Self {
        Self {
            line: None,
            joined: false,
            silent: Duration::ZERO,
            looked: Instant::now(),
        }
    }
}

impl Figures {
    fn new(now: Instant) -> Self {
        Self {
            started: now,
            robot_start: None,
            robot_time: Duration::ZERO,
            told: now,
            last: Pulse::default(),
            frames: 0,
            lost: 0,
            lost_elsewhere: 0,
        }
    }

    fn take(&mut self, pulse: Pulse) {
        self.last = pulse;
        if let Some(now) = pulse.robot_time {
            self.robot_time = now.saturating_sub(*self.robot_start.get_or_insert(now));
            self.told = Instant::now();
        }
    }

    /// Keeps what the attendant has counted; the next one counts from 0.
    fn attendant_ended(&mut self) {
        let last = core::mem::take(&mut self.last);
        self.frames += last.frames;
        self.lost += last.lost_here;
        // This is told whole by whoever looks.
        self.lost_elsewhere = self.lost_elsewhere.max(last.lost_elsewhere);
    }
}
