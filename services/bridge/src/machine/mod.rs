//! Every decision of the bridge, as a pure state machine: events in, effects out, time an argument.
//!
//! It stands apart from the service so that `lager simulate` runs the same bridge: boards that come
//! and go, what the boards are told of their robot and the settings on their way to the boards, requests, the stop, and
//! when to publish what. The process that runs it owns the ports, the bus, the stop word and the
//! clock, and decides nothing. Nothing here allocates.
//!
//! ```text
//!   port, order, press, ask, stop ──> what is due at once ─┐
//!                                                          ├──> next: one effect after the other
//!   decide, once a turn ────> health, commands, settings ──┘
//! ```
//!
//! One turn: hand in everything that has come, and after each event carry out what
//! [`BridgeCore::next`] returns. Then call [`BridgeCore::decide`] and carry out the rest. Look at
//! the stop word before each effect and hand a stop in. Then nothing that was decided before a stop
//! is written after it.
//!
//! The order of the effects matters. `link/health` goes out before the bytes are written, so that
//! no successor takes an order that was carried out for a new one. Only commands that may be sent
//! twice are written first: a setpoint that replaces a setpoint, and the standby of a stop. After
//! such a setpoint a successor leaves out one sequence byte, which may have been used. Turns and
//! steps of the arm run once, so they go out after the state.
//!
//! * `asks`: requests.
//! * `buttons`: what comes of a touch of the robot's own buttons, and who listens to their lines.
//! * `ports`: the events of the ports.
//! * `publishing`: the states that it publishes.
//! * `rest`: when a stop has come to its end.
//! * `start`: what a press of reset does to a stop.

mod asks;
mod buttons;
mod effect;
mod ports;
mod publishing;
mod rest;
mod start;
#[cfg(test)]
mod tests;

use core::time::Duration;

use heapless::Deque;
use lager_orders::lease::SETPOINT;
use lager_orders::{Mode, Moment};
use lager_stop::Stop;
use lager_topics::{Health, Outcome, Part, Refusal, SteeringOrder, SteeringReport, StopCause};
use lager_wire::link::HostTransmitter;
use lager_wire::{
    Callsign, Command, PACKET_LENGTH, Payload, ResetOrder, RobotProfile, Setting, SettingKey,
    SteerData, Version,
};

pub use effect::{Effect, Notice, ShownReport, Write};

use crate::arbiter::{Arbiter, Ended, OrderKey, Verdict};
use crate::boards::Boards;
use crate::calibration::Calibration;
use crate::frames::ServoTable;
use crate::loan::Loan;
use crate::profile::Profiles;
use crate::resets::Resets;
use crate::settings::Settings;
use rest::Rest;
pub use start::ResetPress;

/// How long `link/health` may wait if nothing changes, in robot time.
const HEALTH_PERIOD: Duration = Duration::from_millis(100);

/// How often the steering board reports at 500 000 Bd, in robot time. Work that is due before the
/// next report is done with this one. So no timer has to wake the bridge for it, least of all in
/// the middle of a frame's way.
const REPORT_PERIOD: Duration = Duration::from_millis(5);

/// How often a shutdown writes standby at least, if there is a board.
const PARKING_WRITES: u32 = 3;

/// One event brings less news than this.
const NEWS: usize = 8;

/// The core's configuration.
#[derive(Clone, Copy, Debug)]
pub struct CoreOptions {
    /// The ports' speed in baud, for `link/health`.
    pub baud: u32,
    /// Whether to ask the sensor board for its raw readings as well.
    pub raw_line: bool,
    /// Whether to drive an original steering board, whose commands have no age limit.
    pub original_boards: bool,
    /// What the boards are told of their robot. Its owner has validated it.
    pub robot: RobotProfile,
}

/// The bridge without ports, bus and clock.
#[derive(Debug)]
pub struct BridgeCore {
    options: CoreOptions,
    arbiter: Arbiter,
    boards: Boards,
    transmitters: [HostTransmitter; 2],
    settings: Settings,
    profiles: Profiles,
    calibration: Calibration,
    servos: ServoTable,
    resets: Resets,
    /// The last report of a version-1 steering board in this life of its link, and when it was
    /// read.
    report: Option<(SteerData, Moment)>,
    /// The stop in force.
    stop: Option<Stop>,
    /// Since when that stop is obeyed.
    stopped_at: Option<Duration>,
    /// The ports are lent.
    is_lent: bool,
    rest: Rest,
    asked: Option<Asked>,
    listener: buttons::Listener,
    /// The stop is being released for a press of reset, and not for a request.
    starts: bool,
    parking: Option<Parking>,
    due: Due,
    stage: Stage,
    /// `link/health` has news in this turn, and goes out after the command.
    tells: bool,
    writes_first: bool,
    told: Published,
    health_due: Duration,
    /// The time of the last call.
    awake: Option<Duration>,
}

/// A request under way.
#[derive(Clone, Copy, Debug)]
enum Asked {
    /// The answer is known.
    Answered(Outcome),
    /// The core is releasing the stop.
    Releasing,
    /// A board has these settings, and must answer until then.
    Setting {
        keys: &'static [SettingKey],
        until: Duration,
    },
    /// A board is told this part of the description.
    Describing(Part),
}

/// The progress of a shutdown.
#[derive(Clone, Copy, Debug, Default)]
struct Parking {
    standbys: u32,
    /// A report after the first standby shows the wheels at rest.
    at_rest: bool,
}

/// What to do at once.
#[derive(Debug, Default)]
struct Due {
    discard: [bool; 2],
    /// A stop has come: write its standby before everything else.
    halt: bool,
    handshake: [Option<Handshake>; 2],
    /// The board at this port is told to restart.
    restart: [bool; 2],
    release: Option<Stop>,
    stop: Option<StopCause>,
    shown: Option<ShownReport>,
    /// Publish `steering/state`, because of the report that was read then, in ns.
    state: Option<u64>,
    health: bool,
    news: Deque<Notice, NEWS>,
}

/// What the board at a port waits for.
#[derive(Clone, Copy, Debug)]
enum Handshake {
    Syn,
    Ack(Version),
}

/// The progress of the turn.
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
struct Published {
    /// The arbiter's revisions in `link/health` and `steering/state`.
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
    /// Its last sample.
    shown: SteeringReport,
}

/// How long a packet takes on the wire at `baud`: ten bits a byte.
fn packet_time(baud: u32) -> Duration {
    let bits = 10 * PACKET_LENGTH as u64;
    Duration::from_nanos(bits * 1_000_000_000 / u64::from(baud.max(1)))
}

impl BridgeCore {
    /// A bridge that goes on where an earlier one ended, if that bridge's state was kept: its last
    /// state, and when it was published (robot time).
    ///
    /// It does not take over a stop: the stop word decides, and the caller sets the stop again if
    /// the word is clear.
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
            profiles: Profiles::new(&options.robot, kept),
            calibration: Calibration::new(kept),
            servos: ServoTable::default(),
            resets: Resets::default(),
            report: None,
            stop: None,
            stopped_at: None,
            is_lent: false,
            rest: Rest::default(),
            asked: None,
            listener: buttons::Listener::default(),
            starts: false,
            parking: None,
            due: Due {
                health: true,
                ..Due::default()
            },
            stage: Stage::Over,
            tells: false,
            writes_first: false,
            told: Published {
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

    /// Notices a pause of this process. After a pause no order from before it moves anything,
    /// whether its command was already decided or comes now.
    fn wake(&mut self, now: Duration) {
        let before = self.awake.replace(now).unwrap_or(now);
        if now.saturating_sub(before) >= SETPOINT {
            self.arbiter.wake(now);
        }
    }

    /// Takes an order that its origin sent at `sent` (robot time, at most `now`); `age` is its age
    /// ([`Arbiter::order`]). Returns the order that it has put in force.
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

    /// The stop word has been set: standby is due before everything else.
    #[cold]
    pub fn stop(&mut self, stop: Stop) {
        self.stop = Some(stop);
        self.stopped_at = None;
        self.rest = Rest::default();
        self.arbiter.stop();
        // If a packet was cut in two, a board of ours finds the standby after it by its structure.
        // If the packet lacks only its check value, the standby's first byte may match it, once in
        // 256 times; then the board obeys the packet until the next standby, at most 40 ms later.
        // An original board would take the standby's first bytes for the rest of the packet and
        // obey it, so there the packet is finished first.
        if self.boards.version(Callsign::Steering) == Some(Version::One)
            && let Some(place) = self.boards.place(Callsign::Steering)
        {
            self.due.discard[place] = true;
        }
        self.due.halt = true;
        self.due.health = true;
    }

    /// Whether a stop is in force.
    pub fn is_stopped(&self) -> bool {
        self.stop.is_some()
    }

    /// Whether the ports may be lent: whoever wants them has stopped the robot, and it stands.
    pub fn may_lend(&self, now: Duration) -> bool {
        let is_asked = self
            .stop
            .is_some_and(|stop| stop.cause() == StopCause::BoardWork);
        let is_obeyed = self
            .stopped_at
            .is_some_and(|since| now >= since + Loan::AFTER);
        is_asked && is_obeyed
    }

    /// The ports are lent from now on, or are here again.
    pub fn lend(&mut self, is_lent: bool) {
        self.is_lent = is_lent;
        self.say(Notice::Lent(is_lent));
    }

    /// Shuts down: only standby is written from now on.
    pub fn park(&mut self) {
        self.arbiter.park();
        self.parking = Some(Parking::default());
    }

    /// Whether a shutdown has brought the robot to rest, as far as anybody can know.
    pub fn is_parked(&self) -> bool {
        let at_rest = self
            .parking
            .is_some_and(|parking| parking.standbys >= PARKING_WRITES && parking.at_rest);
        at_rest || self.boards.place(Callsign::Steering).is_none()
    }

    /// Everything of this turn was handed in: lets time pass and does what is due.
    pub fn decide(&mut self, now: Duration) {
        self.wake(now);
        self.take_back_trials(now);
        self.end_listening(now);
        self.arbiter.advance(now);
        if self.is_stopped() {
            self.stopped_at.get_or_insert(now);
        }
        self.hear_answer(now);
        self.tells = self.arbiter.revision() != self.told.health || self.health_due <= now;
        self.writes_first = self.told.setpoint
            && self.arbiter.has_setpoint()
            && self.told.mover == Some(self.who_may_move());
        self.stage = Stage::Health;
    }

    /// What to do now. Ask until it returns nothing, each time with the present moment: this
    /// process may have been held up since the last call.
    pub fn next(&mut self, now: Moment) -> Option<Effect> {
        self.wake(now.robot);
        loop {
            // All effects of one stage come before the next stage.
            if let Some(effect) = self.at_once(now) {
                return Some(effect);
            }
            if self.stage == Stage::Over {
                return None;
            }
            if let Some(effect) = self.in_turn(now) {
                return Some(effect);
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
        if self.is_stopped() {
            self.rest.written(now.ns);
        }
        if let Some(parking) = &mut self.parking {
            parking.standbys += 1;
        }
    }

    /// When [`BridgeCore::decide`] has something to do, if nothing comes before. A moment in the
    /// past means now.
    pub fn next_due(&self) -> Duration {
        let settings = [Callsign::Sensor, Callsign::Steering]
            .into_iter()
            .filter(|board| self.boards.place(*board).is_some())
            .filter_map(|board| self.settings.next_due(board))
            .chain(self.profiles.next_due())
            .chain(self.listener.next_due());
        settings
            .chain(self.arbiter.next_due())
            .fold(self.health_due, Duration::min)
    }

    /// The version of the protocol that a board speaks, while it is up.
    pub fn version(&self, board: Callsign) -> Option<Version> {
        self.boards.version(board)
    }

    /// Who drives.
    pub fn mode(&self) -> Mode {
        self.arbiter.mode()
    }

    /// The effects that wait, the most urgent first.
    fn at_once(&mut self, now: Moment) -> Option<Effect> {
        if let Some(place) = self.due.discard.iter().position(|discard| *discard) {
            self.due.discard[place] = false;
            return Some(Effect::Discard { place });
        }
        if self.due.halt {
            if let Some(write) = self.command(now) {
                return Some(Effect::Write(write));
            }
            self.due.halt = false;
        }
        if let Some(cause) = self.due.stop.take() {
            return Some(Effect::Stop(cause));
        }
        for place in 0..self.due.handshake.len() {
            if let Some(handshake) = self.due.handshake[place].take() {
                let transmitter = &mut self.transmitters[place];
                let packet = match handshake {
                    Handshake::Syn => transmitter.syn(),
                    Handshake::Ack(version) => transmitter.ack(version),
                };
                return Some(Effect::Write(Write {
                    place,
                    packet,
                    command: None,
                    order: None,
                }));
            }
        }
        if let Some(place) = self.due.restart.iter().position(|restart| *restart) {
            self.due.restart[place] = false;
            let restart = Payload::Reset(ResetOrder::Restart);
            if let Some(packet) = self.transmitters[place].encode(restart) {
                return Some(Effect::Write(Write {
                    place,
                    packet,
                    command: None,
                    order: None,
                }));
            }
        }
        if let Some(stop) = self.due.release.take() {
            return Some(Effect::Release(stop));
        }
        if let Some(shown) = self.due.shown.take() {
            return Some(Effect::ShowReport(shown));
        }
        if let Some(report_ns) = self.due.state.take() {
            let report_ns = Some(report_ns);
            return Some(Effect::PublishState { report_ns });
        }
        if core::mem::take(&mut self.due.health) {
            return Some(self.publish_health(now));
        }
        self.due.news.pop_front().map(Effect::Say)
    }

    /// The next effect of the turn, stage by stage; `None` goes on to the next stage.
    fn in_turn(&mut self, now: Moment) -> Option<Effect> {
        match self.stage {
            Stage::Over => {}
            Stage::Health => {
                self.stage = Stage::Commands;
                if self.tells && !self.writes_first {
                    return Some(self.publish_health(now));
                }
            }
            Stage::Commands => match self.command(now) {
                Some(write) => return Some(Effect::Write(write)),
                None => self.stage = Stage::HealthAfter,
            },
            Stage::HealthAfter => {
                self.stage = Stage::Settings;
                if self.tells && self.writes_first {
                    return Some(self.publish_health(now));
                }
            }
            Stage::Settings => match self.setting(now) {
                Some(write) => return Some(Effect::Write(write)),
                None => self.stage = Stage::State,
            },
            Stage::State => {
                self.stage = Stage::Over;
                // A report shows the order in force soon enough, but not every board reports.
                let is_told = self.arbiter.revision() == self.told.state;
                let unreported = self.report.is_none() && !is_told;
                if unreported || self.arbiter.last_ended() != self.told.end {
                    return Some(Effect::PublishState { report_ns: None });
                }
            }
        }
        None
    }

    /// The packet with the command that the arbiter wants on the wire.
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
                // The board would not understand this setting, and not answer.
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
        let before = self.profiles.states();
        let setting = self.profiles.poll(now, board);
        self.heed_profiles(before);
        setting
    }

    /// The part of the state that logic must know at once.
    fn who_may_move(&self) -> (Mode, bool, Refusal) {
        let arbiter = &self.arbiter;
        (arbiter.mode(), arbiter.is_stopped(), arbiter.blocked())
    }

    /// Keeps news for people; news beyond the limit is dropped.
    fn say(&mut self, news: Notice) {
        let _ = self.due.news.push_back(news);
    }
}
