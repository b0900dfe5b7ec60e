//! A running robot as its supervisor sees it: processes, and what the attendant tells of them.
//!
//! ```text
//!            swept             joined the bus
//!  attendant ------> the body ----------------> station, comm, bridge, logic
//!     ^                                             │
//!     +-- all ended, in order; what is left swept <-+ the bus is damaged
//!         after a while, each time a longer one (`resets.rs`)
//! ```
//! A service that ends or falls silent is restarted alone. The bus counts as damaged where that
//! would not help: a process that hangs before its first sample, or whose memory was gone, has met
//! shared files that its successor would meet too. On a busy machine all of it takes longer and
//! nothing is damaged, so a process is silent only for as long as it could have run.
//!
//! Every wait here is one sleep that children, signals and the attendant end
//! ([`Supervisor::wait`]).

use std::os::fd::{AsFd, OwnedFd};
use std::process::Stdio;
use std::time::{Duration, Instant};

use anyhow::{Result, bail};
use lager_ports::{ChanceClock, LockError};

use super::attendant::{Attendant, SILENCE};
use super::external::External;
use super::figures::Figures;
use super::resets::{MOST, Remedy, Resets, SELDOM};
use super::stage::{Owed, Stage};
use crate::config::Config;
use crate::kept::Keeping;
use crate::mission::Mission;
use crate::outcome::Outcome;
use crate::report::Note;
use crate::runtime::NameLock;
use crate::services::{Service, Sign};
use crate::signals::Signals;
use crate::state::World;
use crate::supervisor::{Ended, PATIENCE, Start, Supervisor};
use crate::terminal::Terminal;
use crate::words::{Begin, Line, Pulse, Request, Silence, Sweep, Word};

/// How often this process looks up by itself.
const LOOK: Duration = Duration::from_millis(500);
/// How long a successor may have to wait for what is kept for it.
const HAND_OVER: Duration = Duration::from_millis(100);
/// How often in a row an attendant may end by itself before it has joined the bus.
const MOST_REFUSALS: u32 = 5;
/// How long an emulated body may take until it has a clock.
const BODY_START: Duration = Duration::from_secs(30);
/// How long a service may take to stop on a damaged bus; a bridge stops the motors in less.
const HASTE: Duration = Duration::from_millis(500);

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
    mission: Mission,
    /// What the robot has to do, so that another `up` goes on with it.
    pub keeping: Keeping,
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
    /// The attendants in a row that ended by themselves before they had joined.
    refusals: u32,
    stage: Stage,
    stage_began: Instant,
    /// How long the body could run in this stage.
    body: Option<ChanceClock>,
    folder_looked: Instant,
    /// How long an attendant could serve successors, in all.
    attended: Duration,
}

impl Robot {
    /// A robot of which nothing has been started yet.
    pub fn new(
        config: Config,
        lock: NameLock,
        external: External,
        mission: Mission,
        signals: Signals,
        terminal: Terminal,
    ) -> Result<Self> {
        let now = Instant::now();
        let supervisor = Supervisor::new(toml::to_string(&config)?)?;
        // The services' times begin with their supervisor. Only an emulated body has a time of its
        // own.
        let real_start = Duration::from_nanos(supervisor.started_ns());
        let robot_start = match config.chip.clock {
            None => Some(real_start.mul_f64(config.speed)),
            Some(_) => None,
        };
        Ok(Self {
            supervisor,
            lock,
            config,
            attendant: Attendant::absent(),
            owed: Vec::new(),
            external,
            mission,
            keeping: Keeping::default(),
            first_notes: Vec::new(),
            world: None,
            misplaced: Vec::new(),
            figures: Figures::new(now, robot_start),
            signals,
            terminal,
            resets: Resets::default(),
            refusals: 0,
            stage: Stage::Sweeping,
            stage_began: now,
            body: None,
            folder_looked: now,
            attended: Duration::ZERO,
        })
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
            if let Stage::Resting(until) = self.stage {
                if Instant::now() >= until {
                    self.try_again(exit_when_done)?;
                }
            } else if let Some(why) = self.turn()? {
                self.begin_again(&why, exit_when_done)?;
            }
            let ended = self.mission.outcome().is_some();
            let over = ended || self.supervisor.hopeless().is_some();
            // A damaged bus is swept before the end, too.
            let is_swept = matches!(self.stage, Stage::Joining | Stage::Whole);
            if exit_when_done && over && is_swept {
                break;
            }
            self.wait();
        }
        if matches!(self.stage, Stage::Resting(_)) {
            self.leave();
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
        let mission = core::mem::take(&mut self.mission);
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

    /// Ends everything, and starts it again after a while on a bus from which all of it is swept.
    ///
    /// # Errors
    /// That was in vain, and somebody waits for the end of the mission.
    fn begin_again(&mut self, why: &str, exit_when_done: bool) -> Result<()> {
        let remedy = self.resets.damaged(Instant::now());
        let how = match remedy {
            Remedy::StartAgain(count, Duration::ZERO) => {
                format!("starting everything again ({count} of {MOST})")
            }
            Remedy::StartAgain(count, pause) => format!(
                "starting everything again in {} s ({count} of {MOST})",
                pause.as_secs()
            ),
            _ if exit_when_done => {
                self.leave();
                bail!(
                    "the bus does not hold: {why}; {MOST} new starts were in vain. See whether its memory is full (`df /dev/shm`), and what `lager doctor` finds"
                )
            }
            Remedy::Seldom => format!(
                "{MOST} new starts were in vain, so it is tried every {} s from now on. See whether its memory is full (`df /dev/shm`), and what `lager doctor` finds",
                SELDOM.as_secs()
            ),
            Remedy::StillSeldom => String::new(),
        };
        if !how.is_empty() {
            self.note(&format!("the bus is damaged: {why}; {how}"));
        }
        self.stop(HASTE);
        self.give_mission_up(why);
        self.enter(Stage::Resting(Instant::now() + remedy.pause()));
        Ok(())
    }

    /// Starts everything after a rest. What keeps it from that may pass, such as a full memory.
    ///
    /// # Errors
    /// Somebody else has taken the robot's name, or somebody waits for the end of the mission.
    fn try_again(&mut self, exit_when_done: bool) -> Result<()> {
        let begun = self.start_anew();
        match begun {
            Err(error) if !matches!(error.downcast_ref(), Some(LockError::Up { .. })) => {
                self.begin_again(&format!("{error:#}"), exit_when_done)
            }
            begun => begun,
        }
    }

    fn start_anew(&mut self) -> Result<()> {
        self.lock.restore(&self.config)?;
        self.world.as_ref().map(World::write).transpose()?;
        // Nobody knows any more what it had to do, and a simulated world is a new one.
        self.keeping.begin_again();
        self.begin()
    }

    /// Gives the mission up if services have run already: their successors do not know where the
    /// robot stands. Else it is carried out as if nothing had been.
    fn give_mission_up(&mut self, why: &str) {
        if !self.resets.was_whole() || self.mission.outcome().is_some() {
            return;
        }
        self.mission.give_up(&format!(
            "the robot was started again in the middle of it: {why}"
        ));
        self.note("the mission is given up, since nobody knows where the robot stands: put it down, say where (`lager place`, `lager reset`), release the stop (`lager resume`), and order anew");
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
        self.body = None;
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
            .map(|owed| HAND_OVER.saturating_sub(self.attended.saturating_sub(owed.since)))
            .fold(LOOK, Duration::min);
        let at_most = match self.stage {
            Stage::Resting(until) => at_most.min(until.saturating_duration_since(Instant::now())),
            _ => at_most,
        };
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
                    self.attended += self.attendant.look();
                    self.attendant.spoke = self.attendant.ran;
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
            Word::Note(note) => self.terminal.show(&note),
            Word::HandedOver(service) => {
                for owed in self.owed.iter_mut().filter(|owed| owed.service == service) {
                    owed.served = true;
                }
            }
            Word::Silent(silence) => return self.take_silence(silence),
            Word::Damaged(why) => return Some(why),
            Word::Mission(mission) => self.mission = mission,
            Word::Kept { left, all } => self.keeping.take(left, all),
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
        if !silence.was_heard && service.sign() == Sign::Topic {
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
        if first_start && ended.by_itself && !ended.may_try_again {
            bail!("the {service} cannot start ({how})");
        }
        if service == Service::Attendant {
            // One that was killed may do better next time.
            self.refusals = match !self.attendant.joined && ended.by_itself {
                true => self.refusals + 1,
                false => 0,
            };
            let most = match ended.may_try_again {
                true => MOST_REFUSALS,
                false => 1,
            };
            let refused = self.refusals >= most;
            self.figures.attendant_ended();
            self.attendant = Attendant::absent();
            return Ok(
                lost.or_else(|| refused.then(|| format!("the attendant cannot join it ({how})")))
            );
        }
        self.owed.retain(|owed| owed.service != service);
        self.owed.push(Owed {
            service,
            since: self.attended,
            served: !self.tell(&Request::HandOver(service)) || !self.attendant.joined,
        });
        Ok(lost)
    }

    fn look_at_attendant(&mut self) -> Option<String> {
        self.attended += self.attendant.look();
        self.supervisor.process(Service::Attendant)?;
        if self.stage == Stage::Joining && self.body_has_no_clock() {
            return Some("there is no clock of the body to follow".into());
        }
        if !self.attendant.is_silent() {
            return None;
        }
        self.attendant.spoke = self.attendant.ran;
        let joined = self.attendant.joined;
        self.supervisor.kill(Service::Attendant);
        if !joined {
            return Some("whoever opens it hangs".into());
        }
        self.note("the attendant does not answer any more and is killed");
        None
    }

    /// Whether the body has run for too long without a clock that the attendant could follow.
    fn body_has_no_clock(&mut self) -> bool {
        let body = self.config.body.service();
        let body = body.and_then(|body| self.supervisor.process(body));
        let Some(pid) = body else {
            return self.stage_began.elapsed() > BODY_START;
        };
        let could_run = self
            .body
            .get_or_insert_with(|| ChanceClock::of_process(pid));
        could_run.look(LOOK * 2) > BODY_START
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
            if owed.is_none_or(|owed| owed.served || self.attended - owed.since >= HAND_OVER) {
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
            errors: self.terminal.errors(),
        };
        self.attendant = Attendant::absent();
        match self.supervisor.start(Service::Attendant, start) {
            Ok(pid) => self.attendant.clock = Some(ChanceClock::of_process(pid)),
            Err(error) => {
                self.note(&format!("{error:#}"));
                return Ok(());
            }
        }
        self.attendant.line = Some(line);
        self.tell(&Request::Begin(Begin {
            robot_start: self.figures.robot_start,
            mission: self.mission.clone(),
            kept: self.keeping.left().clone(),
            joins_late: self.figures.is_told && sweep == Sweep::TheDead,
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
        let start = Start {
            resume,
            output,
            errors: self.terminal.errors(),
        };
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
        self.terminal.show(&Note {
            at: self.figures.now(&self.config),
            who: "up".to_owned(),
            text: text.to_owned(),
        });
    }
}
