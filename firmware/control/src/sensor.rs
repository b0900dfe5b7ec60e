//! The sensor board's behaviour: it reads line and distance, and sends packets to the Pi and words
//! to the steering board (S1-S10).
//!
//! ```text
//!   every 5 ms, and not before everything of the last pass has left (S10):
//!
//!     read 11 line sensors --> ExDe word, every pass
//!                          --> FlipFlop --.-- line packet (raw line packet before it, if set)
//!                                         '-- read IR --> distance packet
//!                                             or, when due, an answer to a setting, board status;
//!                                             in a calibration, every other time, what one line
//!                                             sensor reads
//! ```
//!
//! A rarer packet takes the place of a distance, twice a second for the board status. The
//! document's FlipFlop takes strict turns instead. But a pass that sends two things is longer, and
//! delays the next word to the wheels by 0.3 ms. In a calibration, one line sensor's reading takes
//! the place of every other distance, each sensor in its turn.
//!
//! The two handshakes are independent: without the steering board the unit still serves the Pi, and
//! without the Pi the steering board. Interrupts send packets and words beside the loop (S4).

use lager_wire::link::{BoardEvent, BoardLink};
use lager_wire::{
    BoardStatus, Callsign, LineBits, Payload, Profile, ResetCause, SensorProfile, Setting,
    SettingKey, SettingReply, SettingStatus,
};

use crate::calibration::{CHANNELS, Calibration};
use crate::ir::Curve;
use crate::line::LineReader;
use crate::load::Load;
use crate::replies::Replies;
use crate::store::{Place, Store};
use crate::time::{first, reached};
use crate::told::{self, Told};
use crate::{
    Board, EEPROM_POLL_US, MOST_BYTES, PACKET_GAP_US, SensorBoard, UART_POLL_US, outbox::Outbox,
};

/// The sensor board's numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SensorConfig {
    /// Time between two passes, in microseconds; longer on a slower UART.
    pub loop_period_us: u32,
    /// What the board obeys until the Pi has told it its robot, which it keeps in EEPROM.
    pub robot: SensorProfile,
    /// A line sensor that reads this or more sees tape, leftmost sensor first. A calibration
    /// replaces these thresholds and keeps its own in EEPROM.
    pub thresholds: [u8; CHANNELS],
    /// Time between two board statuses, in microseconds.
    pub status_period_us: u32,
    /// How long a calibration watches the sensors, in microseconds.
    pub calibration_us: u32,
    /// The board gives a packet up after this silence inside it, in microseconds.
    pub gap_us: u32,
}

impl SensorConfig {
    /// For the chip: passes follow as fast as packets and words leave at 500 000 Bd. The
    /// simulator's passes take ten times as long, which is fast enough to drive and costs a tenth.
    pub const FAST: Self = Self {
        loop_period_us: 500,
        ..Self::USUAL
    };

    const USUAL: Self = Self {
        loop_period_us: 5_000,
        robot: SensorProfile::USUAL,
        thresholds: [128; CHANNELS],
        // Twice a second. It is due a little before its pass, so that a few microseconds do not
        // decide which pass sends it.
        status_period_us: 499_750,
        calibration_us: 5_000_000,
        gap_us: PACKET_GAP_US,
    };
}

impl Default for SensorConfig {
    fn default() -> Self {
        Self::USUAL
    }
}

/// The longest time between two steps, in microseconds; well below the watchdog's 64 ms.
const LONGEST_SLEEP_US: u32 = 20_000;

/// The last turn of a round over all line sensors; each has two turns: its reading, then a
/// distance.
const LAST_TURN: u8 = 2 * LineBits::SENSORS - 1;

/// Which packet the next pass sends to the Pi (S3).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum FlipFlop {
    Line,
    Distance,
}

/// The sensor board's whole behaviour.
#[derive(Debug, Clone)]
pub struct SensorUnit {
    config: SensorConfig,
    reset: ResetCause,
    link: BoardLink,
    outbox: Outbox,
    replies: Replies,
    refused: u8,
    reader: LineReader,
    calibration: Calibration,
    /// Which turn is next in a calibration: twice the sensor's index, plus one if it is a distance.
    turn: u8,
    store: Store<CHANNELS>,
    robot: SensorProfile,
    told: Told<SensorProfile>,
    /// The robot in EEPROM.
    robot_store: Store<12>,
    curve: Curve,
    raw_line: bool,
    flip_flop: FlipFlop,
    pass_due_us: u32,
    /// When the last pass began; `None` before the first.
    last_pass_us: Option<u32>,
    status_due_us: u32,
    load: Load,
}

impl SensorUnit {
    /// A board that has just started.
    #[must_use]
    pub fn new(board: &impl Board, config: SensorConfig) -> Self {
        let now_us = board.now_us();
        let reset = board.reset_cause();
        let (store, thresholds) = Store::load(board, Place::Settings);
        let (robot_store, kept) = Store::load(board, Place::Robot);
        let robot = kept
            .and_then(|kept| told::obeyed(&kept))
            .unwrap_or(config.robot);
        Self {
            reset,
            link: BoardLink::new(Callsign::Sensor, reset, config.gap_us),
            outbox: Outbox::new(),
            replies: Replies::new(),
            refused: 0,
            reader: LineReader::new(),
            calibration: Calibration::new(thresholds.unwrap_or(config.thresholds)),
            turn: 0,
            store,
            told: Told::new(&robot),
            robot_store,
            curve: Curve::new(&robot.ranger),
            robot,
            raw_line: false,
            flip_flop: FlipFlop::Line,
            pass_due_us: now_us,
            last_pass_us: None,
            status_due_us: now_us,
            load: Load::new(now_us),
            config,
        }
    }

    /// Takes in everything that has arrived, decides and acts. Returns the board time by which the
    /// next step must come; any input needs a step at once.
    pub fn step<B: SensorBoard>(&mut self, board: &mut B) -> u32 {
        let now_us = board.now_us();
        board.kick_watchdog();
        self.listen(board, now_us);
        self.ask_for_pi(board, now_us);
        self.outbox.flush(board);
        if reached(now_us, self.pass_due_us) {
            if !self.has_sent_all(board) {
                // A step that finds everything sent must come as soon as it is.
                return now_us.wrapping_add(UART_POLL_US);
            }
            self.pass(board, now_us);
        }
        self.store.poll(board);
        self.robot_store.poll(board);
        self.load.worked(now_us, board.now_us());
        self.next_due_us(board.now_us())
    }

    fn listen<B: SensorBoard>(&mut self, board: &mut B, now_us: u32) {
        for _ in 0..MOST_BYTES {
            let Some(byte) = board.uart_read() else {
                return;
            };
            match self.link.push(byte, now_us) {
                None => {}
                Some(BoardEvent::Up) => self.status_due_us = now_us,
                Some(BoardEvent::Packet(packet)) => match packet.payload {
                    Payload::Setting(setting) => {
                        let reply = self.set(setting, now_us);
                        self.replies.push(reply);
                    }
                    Payload::Reset(order) => board.reset(order),
                    _ => self.refused = self.refused.saturating_add(1),
                },
            }
        }
    }

    fn set(&mut self, setting: Setting, now_us: u32) -> SettingReply {
        let (value, status) = match (setting.key, setting.value) {
            (SettingKey::RawLine, 0 | 1) => {
                self.raw_line = setting.value == 1;
                (setting.value, SettingStatus::Accepted)
            }
            (SettingKey::RawLine, _) => (i16::from(self.raw_line), SettingStatus::OutOfRange),
            (SettingKey::Calibrate, 1) => {
                self.calibration
                    .start(setting.seq, self.config.calibration_us, now_us);
                (1, SettingStatus::Accepted)
            }
            (SettingKey::Calibrate, 2) => {
                if self.calibration.take_back(setting.seq) {
                    let before = self.store.restore(self.config.thresholds);
                    self.calibration.put(before);
                }
                (2, SettingStatus::Accepted)
            }
            (SettingKey::Calibrate, _) => (
                i16::from(self.calibration.is_running()),
                SettingStatus::OutOfRange,
            ),
            _ => self.hear_robot(setting),
        };
        SettingReply {
            key: setting.key,
            seq: setting.seq,
            value,
            status,
        }
    }

    /// Takes in what the Pi tells of the robot, which counts once it is whole.
    fn hear_robot(&mut self, setting: Setting) -> told::Answer {
        let Some((answer, robot)) = self.told.hear(setting, &self.robot) else {
            return (0, SettingStatus::NotHere);
        };
        if let Some(robot) = robot {
            self.robot = robot;
            self.curve = Curve::new(&robot.ranger);
            self.robot_store.save(told::kept(&robot.told()));
        }
        answer
    }

    fn ask_for_pi<B: SensorBoard>(&mut self, board: &mut B, now_us: u32) {
        if self.outbox.is_empty()
            && let Some(syn) = self.link.poll(now_us)
        {
            self.outbox.send(board, syn);
        }
    }

    fn has_sent_all<B: SensorBoard>(&self, board: &B) -> bool {
        self.outbox.is_empty() && board.uart_idle() && !board.exde_is_sending()
    }

    fn pass<B: SensorBoard>(&mut self, board: &mut B, now_us: u32) {
        self.note_pass(now_us);
        let bits = self.read_line(board);
        // The wheels wait for the word, so it leaves first. If the steering board does not listen
        // yet, that is no failure: the next pass sends a newer word.
        let _ = board.exde_send(bits.0);
        let reading = self.reader.read(bits, now_us);
        self.finish_calibration(now_us);
        match self.flip_flop {
            FlipFlop::Line => {
                if self.raw_line {
                    self.send(board, Payload::RawLine(bits));
                }
                self.send(board, Payload::Line(reading.state));
                self.flip_flop = FlipFlop::Distance;
            }
            FlipFlop::Distance => {
                let payload = self
                    .rarer_thing(now_us)
                    .unwrap_or_else(|| Payload::Distance(self.curve.distance(board.read_ir())));
                self.send(board, payload);
                self.flip_flop = FlipFlop::Line;
            }
        }
    }

    fn note_pass(&mut self, now_us: u32) {
        if let Some(last_us) = self.last_pass_us {
            self.load.passed(now_us.wrapping_sub(last_us));
        }
        self.last_pass_us = Some(now_us);
        let period_us = self.config.loop_period_us;
        let late_us = now_us.wrapping_sub(self.pass_due_us);
        let from_us = if late_us < period_us {
            self.pass_due_us
        } else {
            now_us
        };
        self.pass_due_us = from_us.wrapping_add(period_us);
    }

    fn read_line<B: SensorBoard>(&mut self, board: &mut B) -> LineBits {
        let mut bits = 0;
        for channel in 0..LineBits::SENSORS {
            let reading = board.read_line_sensor(channel);
            let tape = self.calibration.judge(usize::from(channel), reading);
            bits = bits << 1 | u16::from(tape);
        }
        // Thresholds are kept as the sensors read, so a calibration needs no polarity.
        LineBits::new(if self.robot.line.dark_is_high {
            bits
        } else {
            !bits
        })
    }

    /// Sends the second answer to a calibration: how many channels have a new threshold. The status
    /// is out of range unless all have one.
    fn finish_calibration(&mut self, now_us: u32) {
        let Some(calibrated) = self.calibration.finish(now_us) else {
            return;
        };
        if calibrated.channels > 0 {
            self.store.save(*self.calibration.thresholds());
        }
        let complete = usize::from(calibrated.channels) == CHANNELS;
        self.replies.push(SettingReply {
            key: SettingKey::Calibrate,
            seq: calibrated.seq,
            value: i16::from(calibrated.channels),
            status: if complete {
                SettingStatus::Accepted
            } else {
                SettingStatus::OutOfRange
            },
        });
    }

    /// The packet that takes the place of a distance, if one is due.
    fn rarer_thing(&mut self, now_us: u32) -> Option<Payload> {
        if !self.link.is_up() {
            return None;
        }
        if let Some(reply) = self.replies.pop() {
            return Some(Payload::SettingReply(reply));
        }
        if !reached(now_us, self.status_due_us) {
            return self.reading();
        }
        self.status_due_us = now_us.wrapping_add(self.config.status_period_us);
        let (load_percent, longest_loop_100us) = self.load.report(now_us);
        Some(Payload::BoardStatus(BoardStatus {
            reset: self.reset,
            bad_packets: self.link.bad_packets(),
            lost_packets: self.link.lost_packets(),
            refused: self.refused,
            exde_errors: 0,
            servo_timeouts: 0,
            load_percent,
            longest_loop_100us,
        }))
    }

    /// What the next sensor has read in the running calibration, every other time.
    fn reading(&mut self) -> Option<Payload> {
        let turn = self.turn;
        let seen = self.calibration.seen(turn / 2)?;
        self.turn = if turn == LAST_TURN { 0 } else { turn + 1 };
        turn.is_multiple_of(2).then_some(Payload::LineReading(seen))
    }

    fn send<B: SensorBoard>(&mut self, board: &mut B, payload: Payload) {
        if let Some(packet) = self.link.encode(payload) {
            self.outbox.send(board, packet);
        }
    }

    fn next_due_us(&self, now_us: u32) -> u32 {
        let mut due_us = now_us.wrapping_add(LONGEST_SLEEP_US);
        let pass_us = if !self.outbox.is_empty() || reached(now_us, self.pass_due_us) {
            now_us.wrapping_add(UART_POLL_US)
        } else {
            self.pass_due_us
        };
        let syn_us = self
            .link
            .us_to_syn(now_us)
            .map(|us| now_us.wrapping_add(us));
        let save_us = (self.store.is_saving() || self.robot_store.is_saving())
            .then(|| now_us.wrapping_add(EEPROM_POLL_US));
        for other_us in [Some(pass_us), syn_us, save_us].into_iter().flatten() {
            due_us = first(now_us, due_us, other_us);
        }
        due_us
    }
}
