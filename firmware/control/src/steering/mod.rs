//! The steering board's behaviour: it takes commands, and moves wheels and arm (T1-T5).
//!
//! ```text
//!            .------------------------- one step -------------------------.
//!   UART --> | register --> dispatch --> wheels ---.                      |
//!   ExDe --> | line error --> PD ------------------+--> motors            | --> UART
//!   servos ->| arm <-- lock: only in standby       |                      |   reports
//!            | age of the command > 150 ms --> off-' scaled by the battery |
//!            '-------------------------------------------------------------'
//! ```
//!
//! Rules that always hold:
//! - The motors stand still from boot until the first valid command, while the command is too old,
//!   while the arm moves, and while the line to follow is not reported.
//! - The arm is locked from boot until the first standby, and while the wheels have another command
//!   (T4).
//! - A command that runs once (turns, arm commands) ends exactly once under its number: done,
//!   aborted or refused. A setpoint does not end; another command replaces it. Only following can
//!   end: when its words or its tape stay away, it is aborted with the failsafe's flag, and the
//!   wheels stand until another command comes.
//! - A refused command is counted and changes nothing: it neither stops nor renews the running one.
//! - Duties in orders and reports are meant for 11.1 V; the drivers get those with the same
//!   voltage.
//! - The board reports the servos' states before the end of the arm command that moved them.
//! - Left, right and forward mean the robot's everywhere; only the orders to the two drivers know how
//!   its motors are connected. When the Pi tells another way, the wheels stand until a new command.

mod ends;
mod messages;
mod orders;

use ends::End;
use lager_wire::link::BoardLink;
use lager_wire::{
    ArmCommand, ArmValues, COMMAND_AGE, Callsign, LineBits, LineState, ResetCause, SteeringProfile,
};

use crate::arm::{Arm, ArmConfig, ArmEnd, Start};
use crate::board::Motors;
use crate::failsafe::CommandAge;
use crate::line::LineReader;
use crate::load::Load;
use crate::pd::{Gains, Pd};
use crate::register::CommandRegister;
use crate::sides::Sides;
use crate::store::{Place, Store};
use crate::supply::Supply;
use crate::time::{first, reached};
use crate::told::{self, Told};
use crate::wheels::{STILL, Wheels};
use crate::{Board, EEPROM_POLL_US, PACKET_GAP_US, SteeringBoard, outbox::Outbox};
use messages::Reports;

/// The steering board's numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SteeringConfig {
    /// Gains until the Pi sets others, which the board keeps in EEPROM.
    pub gains: Gains,
    /// The board stops when its command is older than this, in microseconds.
    pub command_age_limit_us: u32,
    /// Time between two reports, in microseconds; longer on a slower UART.
    pub report_period_us: u32,
    /// Time between two board statuses, in microseconds.
    pub status_period_us: u32,
    /// When the last line word is older than this, in microseconds, there is no line to follow.
    pub line_age_limit_us: u32,
    /// The board gives a packet up after this silence inside it, in microseconds.
    pub gap_us: u32,
    /// What the board obeys until the Pi has told it its robot, which it keeps in EEPROM.
    pub robot: SteeringProfile,
    /// The arm's numbers.
    pub arm: ArmConfig,
}

impl Default for SteeringConfig {
    fn default() -> Self {
        Self {
            gains: Gains::default(),
            command_age_limit_us: COMMAND_AGE.as_micros() as u32,
            report_period_us: 5_000,
            status_period_us: 500_000,
            line_age_limit_us: 100_000,
            gap_us: PACKET_GAP_US,
            robot: SteeringProfile::default(),
            arm: ArmConfig::default(),
        }
    }
}

/// The longest time between two steps, in microseconds; well below the watchdog's 64 ms.
const LONGEST_SLEEP_US: u32 = 20_000;

/// While a word comes in, the next step waits this long, in microseconds, or until the word's last
/// bit.
const WORD_US: u32 = 300;
/// Step of `round`: odd, so that all 256 values come in turn, and large, so that two in a row
/// differ much.
const ROUND_STRIDE: u8 = 157;

/// The line sensors' information for the wheels.
#[derive(Debug, Clone)]
struct Line {
    reader: LineReader,
    pd: Pd,
    sides: Sides,
    /// The regulator's output for the last word.
    correction: i16,
    /// When the last word came; `None` if it is too old.
    fresh_since_us: Option<u32>,
}

/// An arm command that waits for the arm, or runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct ArmOrder {
    command: ArmCommand,
    seq: u8,
}

/// The steering board's whole behaviour.
#[derive(Debug, Clone)]
pub struct SteeringUnit {
    config: SteeringConfig,
    reset: ResetCause,
    link: BoardLink,
    outbox: Outbox,
    register: CommandRegister,
    age: CommandAge,
    refused: u8,
    /// Whether the Pi has ever ordered standby; the arm is locked until then (T4).
    standby_seen: bool,
    line: Line,
    wheels: Wheels,
    arm: Arm,
    arm_waiting: Option<ArmOrder>,
    arm_running: Option<ArmOrder>,
    /// The arm's profile that the Pi is sending.
    told_arm: Told<ArmValues>,
    /// The description of the robot that the Pi is sending.
    told: Told<SteeringProfile>,
    /// Whether the battery's voltage is at the board's input.
    divider: bool,
    motors: Option<Motors>,
    /// The duties that the drivers got for `motors`.
    at_pins: Option<Motors>,
    /// How fractions of a duty step are rounded now: down if low, up if high.
    round: u8,
    supply: Supply,
    reports: Reports,
    load: Load,
    /// The gains P and D in EEPROM.
    store: Store<2>,
    /// How much the motors differ, in EEPROM.
    sides_store: Store<2>,
    /// The robot in EEPROM.
    robot_store: Store<12>,
}

impl SteeringUnit {
    /// A board that has just started, with its motors off.
    #[must_use]
    pub fn new(board: &impl Board, config: SteeringConfig) -> Self {
        let now_us = board.now_us();
        let reset = board.reset_cause();
        let (store, kept) = Store::load(board, Place::Settings);
        let gains = kept.map_or(config.gains, |[p, d]| Gains { p, d });
        let (sides_store, bias) = Store::load(board, Place::Sides);
        let (robot_store, kept) = Store::load(board, Place::Robot);
        let robot = kept
            .and_then(|kept| told::obeyed(&kept))
            .unwrap_or(config.robot);
        Self {
            reset,
            link: BoardLink::new(Callsign::Steering, reset, config.gap_us),
            outbox: Outbox::new(),
            register: CommandRegister::new(),
            age: CommandAge::new(config.command_age_limit_us),
            refused: 0,
            standby_seen: false,
            line: Line {
                reader: LineReader::new(),
                pd: Pd::new(gains),
                sides: Sides::of_kept(bias),
                correction: 0,
                fresh_since_us: None,
            },
            wheels: Wheels::new(robot.wheels),
            arm: Arm::new(config.arm, now_us),
            arm_waiting: None,
            arm_running: None,
            told_arm: Told::new(&config.arm.profile),
            told: Told::new(&robot),
            divider: robot.divider,
            motors: None,
            at_pins: None,
            round: 0,
            supply: Supply::new(),
            reports: Reports::new(now_us),
            load: Load::new(now_us),
            store,
            sides_store,
            robot_store,
            config,
        }
    }

    /// Takes in everything that has arrived, decides and acts. Returns the board time by which the
    /// next step must come; any input needs a step at once.
    pub fn step<B: SteeringBoard>(&mut self, board: &mut B) -> u32 {
        let now_us = board.now_us();
        board.kick_watchdog();
        self.watch_age(now_us);
        self.follow(board, now_us);
        self.listen(board, now_us);
        self.watch_line(now_us);
        self.drive(board, now_us);
        let finished = self.take_time(board, now_us);
        let done_us = board.now_us();
        self.load.worked(now_us, done_us);
        if !finished {
            return now_us.wrapping_add(WORD_US);
        }
        self.load.passed(done_us.wrapping_sub(now_us));
        self.next_due_us(now_us)
    }

    /// Does the work that takes long, between two words, so that the wheels do not wait for it.
    /// Returns whether it could. A word ends within a millisecond, whole or broken off, whatever is
    /// on the wire.
    fn take_time<B: SteeringBoard>(&mut self, board: &mut B, now_us: u32) -> bool {
        if !self.is_between_words(board, now_us) {
            return false;
        }
        self.move_arm(board, now_us);
        if !self.is_between_words(board, now_us) {
            return false;
        }
        self.report(board, now_us);
        self.follow(board, now_us);
        self.keep(board);
        true
    }

    /// Begins and goes on to save.
    // Not inlined, as `Sides::observe`.
    #[inline(never)]
    fn keep<B: SteeringBoard>(&mut self, board: &mut B) {
        if let Some(bias) = self.line.sides.to_keep(self.sides_store.kept()) {
            self.sides_store.save(bias);
        }
        self.store.poll(board);
        // Before the robot: a bias that another robot has learnt is gone when that is saved.
        self.sides_store.poll(board);
        self.robot_store.poll(board);
    }

    /// Reads the line and sets the wheels. It runs first in a step and again between long work, so
    /// that the wheels do not wait.
    fn follow<B: SteeringBoard>(&mut self, board: &mut B, now_us: u32) {
        if let Some((state, at_us)) = self.read_words(board) {
            self.drive(board, now_us);
            // The bias is learnt only after the wheels have their duties.
            let Line {
                sides, correction, ..
            } = &mut self.line;
            if self.wheels.follows_forward() {
                sides.observe(*correction, state, at_us);
            } else {
                sides.pause();
            }
        }
    }

    /// Whether no word is half received. A word that has just come is followed first.
    fn is_between_words<B: SteeringBoard>(&mut self, board: &mut B, now_us: u32) -> bool {
        if board.exde_is_receiving() {
            return false;
        }
        self.follow(board, now_us);
        true
    }

    fn watch_line(&mut self, now_us: u32) {
        if let Some(due_us) = self.line_due_us()
            && reached(now_us, due_us)
        {
            self.line.fresh_since_us = None;
        }
        if let Some(seq) = self.wheels.give_up(now_us) {
            self.end(seq, End::Aborted, now_us);
        }
    }

    /// Takes in the words that have come. Returns the line's state and the time of the last one.
    fn read_words<B: SteeringBoard>(&mut self, board: &mut B) -> Option<(LineState, u32)> {
        let mut seen = None;
        while let Some((word, at_us)) = board.exde_word() {
            let bits = LineBits::new(word);
            let reading = self.line.reader.read(bits, at_us);
            let correction = self.line.pd.update(reading.error, at_us);
            // A mark does not show where the line is, and the last correction would bend the way by
            // degrees. So both wheels turn alike over a mark.
            let is_mark = matches!(
                reading.state,
                LineState::StationToLeft | LineState::StationToRight | LineState::FourWay
            );
            let correction = if is_mark { 0 } else { correction };
            self.line.correction = correction + self.line.sides.bias(self.round);
            self.line.fresh_since_us = Some(at_us);
            self.wheels.on_word(bits, at_us);
            seen = Some((reading.state, at_us));
        }
        seen
    }

    fn line_due_us(&self) -> Option<u32> {
        self.line
            .fresh_since_us
            .map(|since| since.wrapping_add(self.config.line_age_limit_us))
    }

    fn move_arm<B: SteeringBoard>(&mut self, board: &mut B, now_us: u32) {
        if let Some(outcome) = self.arm.poll(board, now_us)
            && let Some(order) = self.arm_running.take()
        {
            let end = match outcome {
                ArmEnd::Done => End::Done,
                ArmEnd::Aborted => End::Aborted,
            };
            self.end(order.seq, end, now_us);
        }
        let Some(order) = self.arm_waiting else {
            return;
        };
        match self.arm.start(order.command, now_us) {
            Start::NotYet => return,
            Start::Begun => self.arm_running = Some(order),
            Start::Outside => {
                self.count_refused();
                self.end(order.seq, End::Refused, now_us);
            }
        }
        self.arm_waiting = None;
    }

    /// Whether the wheels' command locks the arm (T4).
    fn arm_is_locked(&self) -> bool {
        !(self.standby_seen && self.wheels.is_standby())
    }

    fn watch_age(&mut self, now_us: u32) {
        if self.age.expires(now_us) {
            self.break_off(now_us);
        }
    }

    fn drive<B: SteeringBoard>(&mut self, board: &mut B, now_us: u32) {
        let may_turn = self.age.is_fresh() && !self.arm_is_active();
        if let Some(seq) = self.wheels.advance(may_turn, now_us) {
            self.end(seq, End::Done, now_us);
        }
        self.round = self.round.wrapping_add(ROUND_STRIDE);
        let correction = self.line.fresh_since_us.map(|_| self.line.correction);
        let motors = if may_turn {
            let motors = self.wheels.motors(correction);
            if self.wheels.follows() {
                motors
            } else {
                self.line.sides.alike(motors, self.round)
            }
        } else {
            STILL
        };
        self.motors = Some(motors);
        let at_pins = self.supply.at_pins(motors, self.round);
        let at_pins = self.wheels.pulses().at_pins(at_pins);
        let at_pins = self.wheels.at_drivers(at_pins);
        if self.at_pins != Some(at_pins) {
            self.at_pins = Some(at_pins);
            board.set_motors(at_pins.0, at_pins.1);
        }
    }

    fn arm_is_active(&self) -> bool {
        self.arm_waiting.is_some() || self.arm.is_busy()
    }

    fn next_due_us(&self, now_us: u32) -> u32 {
        let mut due_us = now_us.wrapping_add(LONGEST_SLEEP_US);
        due_us = first(now_us, due_us, self.arm.next_due_us(now_us));
        let syn_us = self
            .link
            .us_to_syn(now_us)
            .map(|us| now_us.wrapping_add(us));
        let saves =
            self.store.is_saving() || self.sides_store.is_saving() || self.robot_store.is_saving();
        let save_us = saves.then(|| now_us.wrapping_add(EEPROM_POLL_US));
        for other_us in [
            syn_us.or_else(|| self.report_due_us(now_us)),
            self.age.next_due_us(),
            self.line_due_us(),
            self.wheels.next_due_us(),
            save_us,
        ]
        .into_iter()
        .flatten()
        {
            due_us = first(now_us, due_us, other_us);
        }
        due_us
    }
}
