//! All that the bridge decides, as a pure state machine: events in, actions out, time an argument.
//!
//! It is apart from the service so that `lager simulate` runs the very same bridge: boards that
//! come and go, the arm's profile and the settings on their way to them, requests, the stop, and
//! what is published when. The process that runs it owns the ports, the bus, the stop word and the
//! clock, and decides nothing. Nothing here allocates.
//!
//! ```text
//!   port, order, press, ask, stop ──> what is due at once ─┐
//!                                                          ├──> next: one action after the other
//!   decide, once a turn ────> health, commands, settings ──┘
//! ```
//!
//! One turn: hand in all that has come, and carry out what [`BridgeCore::next`] returns after each
//! event; then call [`BridgeCore::decide`] and carry out the rest. Look at the stop word before
//! each action and hand a stop in. Then nothing that was decided before a stop is written after it.
//!
//! The order of the actions matters. `link/health` goes out before the bytes are written, so that
//! no successor takes an order that was carried out for a new one. Only what may be said twice is
//! written first: a setpoint that replaces a setpoint, and the standby of a stop. For a setpoint a
//! successor leaves out one sequence number, which may have been used. Turns and steps of the arm
//! run once, so they go out after the state.
//!
//! * `asks`: requests.
//! * `ports`: what happens at the ports.
//! * `telling`: what is published.
//! * `rest`: when a stop has come to its end.

mod action;
mod asks;
mod ports;
mod rest;
mod telling;
#[cfg(test)]
mod tests;

use core::time::Duration;

use heapless::Deque;
use lager_ports::Stop;
use lager_topics::{Health, Mode, Outcome, Refusal, SteeringOrder, SteeringReport, StopCause};
use lager_wire::link::HostTransmitter;
use lager_wire::{
    ArmProfile, Callsign, Command, PACKET_LENGTH, Payload, Setting, SettingKey, SteerData, Version,
};

pub use action::{Action, News, ShownReport, Write};

use crate::arbiter::{Arbiter, Ended, LEASE, OrderKey, Verdict};
use crate::boards::Boards;
use crate::calibration::Calibration;
use crate::events::Moment;
use crate::frames::ServoTable;
use crate::presses::Presses;
use crate::profile::ProfileTeller;
use crate::resets::Resets;
use crate::settings::Settings;
use rest::Rest;

/// When `link/health` is published at the latest if nothing changes, in robot time.
const HEALTH_PERIOD: Duration = Duration::from_millis(100);

/// How often the steering board reports at 500 000 Bd, in robot time. What falls due before the
/// next report is done with this one: no timer has to wake the bridge for it, least of all in the
/// middle of a frame's way.
const REPORT_PERIOD: Duration = Duration::from_millis(5);

/// How often a shutdown writes standby at least, if there is a board.
const PARKING_WRITES: u32 = 3;

/// More news than one event can bring.
const NEWS: usize = 8;

/// What the core is told at start.
#[derive(Clone, Copy, Debug)]
pub struct CoreOptions {
    /// The ports' speed in baud, for `link/health`.
    pub baud: u32,
    /// Ask the sensor board for its raw readings besides the line's state.
    pub raw_line: bool,
    /// Drive an original steering board, whose commands have no age limit.
    pub original_boards: bool,
    /// What the arm may do, as the steering board is told. Its owner has validated it.
    pub arm: ArmProfile,
}

/// The bridge without ports, bus and clock.
#[derive(Debug)]
pub struct BridgeCore {
    options: CoreOptions,
    arbiter: Arbiter,
    boards: Boards,
    transmitters: [HostTransmitter; 2],
    settings: Settings,
    profile: ProfileTeller,
    calibration: Calibration,
    servos: ServoTable,
    resets: Resets,
    presses: Presses,
    /// The last report of a version-1 steering board in this life of its link, and when it was
    /// read.
    report: Option<(SteerData, Moment)>,
    /// The stop in force.
    stop: Option<Stop>,
    rest: Rest,
    asked: Option<Asked>,
    parking: Option<Parking>,
    due: Due,
    stage: Stage,
    /// `link/health` has something to tell in this turn, and goes out after the command.
    tells: bool,
    writes_first: bool,
    told: Told,
    health_due: Duration,
    /// When something was handed in last, or asked for.
    awake: Option<Duration>,
}

/// A request under way.
#[derive(Clone, Copy, Debug)]
enum Asked {
    /// It can be answered.
    Answered(Outcome),
    /// The stop is being released.
    Releasing,
    /// A board has been told these settings, and has until then to answer.
    Setting {
        keys: &'static [SettingKey],
        until: Duration,
    },
}

/// How far a shutdown has come.
#[derive(Clone, Copy, Debug, Default)]
struct Parking {
    standbys: u32,
    /// A report after the first standby shows the wheels at rest.
    at_rest: bool,
}

/// What is to be done at once.
#[derive(Debug, Default)]
struct Due {
    discard: [bool; 2],
    /// A stop has come: its standby, before everything else.
    halt: bool,
    handshake: [Option<Handshake>; 2],
    release: Option<Stop>,
    stop: Option<StopCause>,
    shown: Option<ShownReport>,
    /// `steering/state`, because of the report read then, in ns.
    state: Option<u64>,
    health: bool,
    news: Deque<News, NEWS>,
}

/// What a port's board is waiting for.
#[derive(Clone, Copy, Debug)]
enum Handshake {
    Syn,
    Ack(Version),
}

/// How far the turn has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Over,
    Health,
    Commands,
    HealthAfter,
    Settings,
    State,
}

/// What was published last.
#[derive(Clone, Copy, Debug)]
struct Told {
    /// The arbiter's revisions that `link/health` and `steering/state` showed.
    health: u32,
    state: u32,
    /// The order that ended last.
    end: Option<Ended>,
    /// Who may drive, whether a stop is latched, and why no origin may move.
    mover: Option<(Mode, bool, Refusal)>,
    /// The order in force was a setpoint.
    setpoint: bool,
    /// `steering/state` has shown the last report.
    report: bool,
    /// All that it has shown.
    shown: SteeringReport,
}

/// How long a packet takes on the wire at `baud`: ten bits a byte.
fn packet_time(baud: u32) -> Duration {
    let bits = 10 * PACKET_LENGTH as u64;
    Duration::from_nanos(bits * 1_000_000_000 / u64::from(baud.max(1)))
}

impl BridgeCore {
    /// A bridge that goes on where an earlier one ended, if that bridge's state was kept: what it
    /// published last, and when (robot time).
    ///
    /// A stop that was latched then is not taken over: the stop word decides, and the caller sets
    /// it again if it is clear.
    pub fn new(options: CoreOptions, kept: Option<(&Health, Duration)>) -> Self {
        let mut arbiter = kept.map_or_else(Arbiter::new, |(kept, published)| {
            Arbiter::resume(kept, published)
        });
        let kept = kept.map(|(kept, _)| kept);
        arbiter.resume_from_stop();
        arbiter.drive_original_boards(options.original_boards);
        arbiter.pace(packet_time(options.baud));
        let mut settings = Settings::default();
        if options.raw_line {
            settings.keep(SettingKey::RawLine, 1);
        }
        if let Some(kept) = kept {
            settings.resume(kept);
        }
        Self {
            options,
            boards: Boards::new(kept),
            transmitters: [HostTransmitter::new(), HostTransmitter::new()],
            settings,
            profile: ProfileTeller::new(&options.arm),
            calibration: Calibration::new(kept),
            servos: ServoTable::default(),
            resets: Resets::default(),
            presses: kept.map_or_else(Presses::default, Presses::resume),
            report: None,
            stop: None,
            rest: Rest::default(),
            asked: None,
            parking: None,
            due: Due {
                health: true,
                ..Due::default()
            },
            stage: Stage::Over,
            tells: false,
            writes_first: false,
            told: Told {
                health: arbiter.revision(),
                state: arbiter.revision(),
                end: arbiter.last_ended(),
                mover: None,
                setpoint: false,
                report: false,
                shown: SteeringReport::default(),
            },
            health_due: Duration::ZERO,
            awake: None,
            arbiter,
        }
    }

    /// Notices a pause of this process: whatever comes after it, and whatever was decided before it
    /// and not done yet, moves nothing by an order of before.
    fn wake(&mut self, now: Duration) {
        let before = self.awake.replace(now).unwrap_or(now);
        if now.saturating_sub(before) >= LEASE {
            self.arbiter.wake(now);
        }
    }

    /// Takes an order that its origin sent at `sent`, in robot time at most `now`, and that is as
    /// old as `age` says ([`Arbiter::order`]); the order that it has put in force.
    pub fn order(
        &mut self,
        now: Duration,
        sent: Duration,
        age: Duration,
        order: &SteeringOrder,
    ) -> Option<OrderKey> {
        self.wake(now);
        let verdict = self.arbiter.order(sent, age, order);
        let (key, _) = self.arbiter.current()?;
        (verdict == Verdict::Executes).then_some(key)
    }

    /// The switch was pressed at `pressed_ns` of `CLOCK_MONOTONIC`, which changes the mode.
    pub fn press(&mut self, now: Moment, id: u32, pressed_ns: u64) {
        self.wake(now.robot);
        if self.presses.take(id, pressed_ns, now.ns) {
            let mode = match self.arbiter.mode() {
                Mode::Manual => Mode::Autonomous,
                Mode::Autonomous => Mode::Manual,
            };
            self.say(News::Pressed(mode));
            self.arbiter.set_mode(mode);
        }
    }

    /// The switch was moved to `mode`.
    pub fn switch(&mut self, mode: Mode) {
        if self.arbiter.mode() != mode {
            self.say(News::Pressed(mode));
        }
        self.arbiter.set_mode(mode);
    }

    /// The stop word has been set: standby is due before everything else.
    #[cold]
    pub fn stop(&mut self, stop: Stop) {
        self.stop = Some(stop);
        self.rest = Rest::default();
        self.arbiter.stop();
        // A board of ours finds the standby behind a packet that was cut in two, by its structure.
        // A packet that lacks only its check value may find it in the standby's first byte, once in
        // 256 times; the packet is then carried out until the next standby, at most 40 ms later. An
        // original board would take the standby's first bytes for the rest of that packet and carry
        // it out, so there the packet is finished.
        if self.boards.version(Callsign::Steering) == Some(Version::One)
            && let Some(place) = self.boards.place(Callsign::Steering)
        {
            self.due.discard[place] = true;
        }
        self.due.halt = true;
        self.due.health = true;
    }

    /// Shuts down: only standby is written from now on.
    pub fn park(&mut self) {
        self.arbiter.park();
        self.parking = Some(Parking::default());
    }

    /// Whether a shutdown has brought the robot to rest, as far as that can be known.
    pub fn is_parked(&self) -> bool {
        let at_rest = self
            .parking
            .is_some_and(|parking| parking.standbys >= PARKING_WRITES && parking.at_rest);
        at_rest || self.boards.place(Callsign::Steering).is_none()
    }

    /// All that has come in this turn was handed in: lets time pass and settles what is due.
    pub fn decide(&mut self, now: Duration) {
        self.wake(now);
        self.arbiter.advance(now);
        self.hear_answer(now);
        self.tells = self.arbiter.revision() != self.told.health || self.health_due <= now;
        self.writes_first = self.told.setpoint
            && self.arbiter.has_setpoint()
            && self.told.mover == Some(self.who_may_move());
        self.stage = Stage::Health;
    }

    /// What to do now; ask until there is nothing, each time with the present moment: this process
    /// may have been held up since it asked last.
    pub fn next(&mut self, now: Moment) -> Option<Action> {
        self.wake(now.robot);
        loop {
            // The actions of one stage are carried out before the next stage.
            if let Some(action) = self.at_once(now) {
                return Some(action);
            }
            if self.stage == Stage::Over {
                return None;
            }
            if let Some(action) = self.in_turn(now) {
                return Some(action);
            }
        }
    }

    /// Whether the driver has taken the packet that [`BridgeCore::next`] gave.
    pub fn wrote(&mut self, write: &Write, is_taken: bool, now: Moment) {
        if write.command.is_none() {
            return;
        }
        if !is_taken {
            self.arbiter.not_written(now.robot);
            return;
        }
        if self.stop.is_some() {
            self.rest.written(now.ns);
        }
        if let Some(parking) = &mut self.parking {
            parking.standbys += 1;
        }
    }

    /// When [`BridgeCore::decide`] has something to do, if nothing comes before; a moment that is
    /// past means now.
    pub fn next_due(&self) -> Duration {
        let settings = [Callsign::Sensor, Callsign::Steering]
            .into_iter()
            .filter(|board| self.boards.place(*board).is_some())
            .filter_map(|board| self.settings.next_due(board))
            .chain(self.profile.next_due());
        settings
            .chain(self.arbiter.next_due())
            .fold(self.health_due, Duration::min)
    }

    /// The rules by which a board speaks, while it is up.
    pub fn version(&self, board: Callsign) -> Option<Version> {
        self.boards.version(board)
    }

    /// Who drives.
    pub fn mode(&self) -> Mode {
        self.arbiter.mode()
    }

    /// What was waiting when something happened, most urgent first.
    fn at_once(&mut self, now: Moment) -> Option<Action> {
        if let Some(place) = self.due.discard.iter().position(|discard| *discard) {
            self.due.discard[place] = false;
            return Some(Action::Discard { place });
        }
        if self.due.halt {
            if let Some(write) = self.command(now) {
                return Some(Action::Write(write));
            }
            self.due.halt = false;
        }
        if let Some(cause) = self.due.stop.take() {
            return Some(Action::Stop(cause));
        }
        for place in 0..self.due.handshake.len() {
            if let Some(handshake) = self.due.handshake[place].take() {
                let transmitter = &mut self.transmitters[place];
                let packet = match handshake {
                    Handshake::Syn => transmitter.syn(),
                    Handshake::Ack(version) => transmitter.ack(version),
                };
                return Some(Action::Write(Write {
                    place,
                    packet,
                    command: None,
                    order: None,
                }));
            }
        }
        if let Some(stop) = self.due.release.take() {
            return Some(Action::Release(stop));
        }
        if let Some(shown) = self.due.shown.take() {
            return Some(Action::ShowReport(shown));
        }
        if let Some(report_ns) = self.due.state.take() {
            let report_ns = Some(report_ns);
            return Some(Action::PublishState { report_ns });
        }
        if core::mem::take(&mut self.due.health) {
            return Some(self.publish_health(now));
        }
        self.due.news.pop_front().map(Action::Say)
    }

    /// The next thing of the turn, stage by stage; `None` goes on to the next stage.
    fn in_turn(&mut self, now: Moment) -> Option<Action> {
        match self.stage {
            Stage::Over => {}
            Stage::Health => {
                self.stage = Stage::Commands;
                if self.tells && !self.writes_first {
                    return Some(self.publish_health(now));
                }
            }
            Stage::Commands => match self.command(now) {
                Some(write) => return Some(Action::Write(write)),
                None => self.stage = Stage::HealthAfter,
            },
            Stage::HealthAfter => {
                self.stage = Stage::Settings;
                if self.tells && self.writes_first {
                    return Some(self.publish_health(now));
                }
            }
            Stage::Settings => match self.setting(now) {
                Some(write) => return Some(Action::Write(write)),
                None => self.stage = Stage::State,
            },
            Stage::State => {
                self.stage = Stage::Over;
                // A report tells the order in force soon enough, but not every board reports.
                let is_told = self.arbiter.revision() == self.told.state;
                let unreported = self.report.is_none() && !is_told;
                if unreported || self.arbiter.last_ended() != self.told.end {
                    return Some(Action::PublishState { report_ns: None });
                }
            }
        }
        None
    }

    /// The packet with what the arbiter wants written.
    fn command(&mut self, now: Moment) -> Option<Write> {
        let place = self.boards.place(Callsign::Steering)?;
        let command = self.arbiter.poll(now.robot)?;
        let Some(packet) = self.transmitters[place].encode(Payload::SteerCommand(command)) else {
            self.arbiter.not_written(now.robot);
            return None;
        };
        let carries =
            |(key, in_force): (OrderKey, Command)| (in_force.code() == command.code).then_some(key);
        Some(Write {
            place,
            packet,
            command: Some(command),
            order: self.arbiter.current().and_then(carries),
        })
    }

    /// The packet with the next setting that is due.
    fn setting(&mut self, now: Moment) -> Option<Write> {
        for board in [Callsign::Sensor, Callsign::Steering] {
            let Some(place) = self.boards.place(board) else {
                continue;
            };
            while let Some(setting) = self.due_setting(now.robot, board) {
                // What a board does not understand is not sent, and so not answered.
                if let Some(packet) = self.transmitters[place].encode(Payload::Setting(setting)) {
                    return Some(Write {
                        place,
                        packet,
                        command: None,
                        order: None,
                    });
                }
            }
        }
        None
    }

    fn due_setting(&mut self, now: Duration, board: Callsign) -> Option<Setting> {
        if let Some(setting) = self.settings.poll(now, board) {
            return Some(setting);
        }
        if board != Callsign::Steering {
            return None;
        }
        let before = self.profile.state();
        let setting = self.profile.poll(now);
        self.heed_profile(before);
        setting
    }

    /// What logic has to know at once.
    fn who_may_move(&self) -> (Mode, bool, Refusal) {
        let arbiter = &self.arbiter;
        (arbiter.mode(), arbiter.is_stopped(), arbiter.blocked())
    }

    /// Tells people; news that does not fit is dropped.
    fn say(&mut self, news: News) {
        let _ = self.due.news.push_back(news);
    }
}
