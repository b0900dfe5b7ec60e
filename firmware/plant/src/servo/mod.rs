//! The arm's AX-12 servos and the half-duplex wire they share with the steering board (A1).
//!
//! Each servo has the control table of the original's listing (A3) and answers as the real one
//! does: after its return delay, at 1 Mbit/s. It does not answer a broadcast, nor a packet that its
//! return level excludes. It moves at its goal speed, and pushes harder the farther something keeps
//! it from its goal. Without torque, shoulder and elbow sink.
//!
//! ```text
//!  board  | FF FF id .. sum |
//!  servo                      return delay  | FF FF id .. sum |      10 us a byte
//! ```
//! The board does not hear its own bytes here: the owner of the wire mutes the board's receiver
//! while it sends (AMB-26). Not modelled: heat, shutdown by overload, change of the baud rate.
//! RESET is refused, because it would give eight servos the same id.

mod device;

use core::time::Duration;
use std::collections::VecDeque;

use device::{Sag, Servo};
use lager_ax12::table::{ID, MAX_POSITION, RETURN_DELAY_TIME};
use lager_ax12::{BROADCAST_ID, ErrorBits, Frame, Instruction, InstructionDecoder, Packet};

use crate::arm::SERVOS;
use crate::build::ArmBuild;
use crate::make::Make;
use crate::noise::Noise;

/// The joints that carry weight, as the indices of their two servos.
const PAIRS: [[usize; 2]; 2] = [[1, 2], [3, 4]];
/// Where such a joint rests without torque, as the position of its first servo.
const LYING: f64 = 300.0;
/// How fast it sinks, at least and at most, in units of position a second.
const SAGS: [f64; 2] = [10.0, 80.0];
/// Time of one byte at 1 Mbit/s.
const BYTE_NS: u64 = 10_000;

/// The faults of one servo; none by default.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ServoFault {
    /// Errors that it reports in every answer, besides those of the question.
    pub errors: ErrorBits,
    /// Whether its answers arrive with a wrong checksum.
    pub garbled: bool,
}

/// The servos on their wire.
#[derive(Clone, Debug)]
pub struct ServoBus {
    servos: [Servo; SERVOS],
    /// Whether the arm has it.
    fitted: [bool; SERVOS],
    /// Whether it is plugged in.
    present: [bool; SERVOS],
    faults: [ServoFault; SERVOS],
    decoder: InstructionDecoder,
    replies: VecDeque<(u64, u8)>,
    free_ns: u64,
    collisions: u64,
}

impl ServoBus {
    /// Servos 1 to 8 without torque at the given positions.
    pub fn new(positions: [u16; SERVOS]) -> Self {
        Self {
            servos: core::array::from_fn(|index| Servo::new(index as u8 + 1, positions[index])),
            fitted: [true; SERVOS],
            present: [true; SERVOS],
            faults: [ServoFault::default(); SERVOS],
            decoder: InstructionDecoder::new(),
            replies: VecDeque::new(),
            free_ns: 0,
            collisions: 0,
        }
    }

    /// Servos whose joints sink without torque, as a worn arm's do.
    pub fn sagging(positions: [u16; SERVOS], mut noise: Noise, make: Make) -> Self {
        let mut bus = Self::new(positions);
        for [servo, mirrored] in PAIRS {
            let units_per_s = make.draw(&mut noise, 0.0, SAGS[0], SAGS[1]);
            let to = LYING;
            bus.servos[servo].sags = Some(Sag { to, units_per_s });
            let to = f64::from(MAX_POSITION) - LYING;
            bus.servos[mirrored].sags = Some(Sag { to, units_per_s });
        }
        bus
    }

    /// Gives the arm these servos, without torque.
    pub fn fit(&mut self, arm: &ArmBuild) {
        for (index, servo) in self.servos.iter_mut().enumerate() {
            let id = arm.ids[index];
            (self.fitted[index], self.present[index]) = (id.is_some(), id.is_some());
            servo.table[usize::from(ID)] = id.unwrap_or(BROADCAST_ID);
            servo.mount(arm, index);
        }
    }

    /// The board sends `bytes` from `now` on.
    pub fn transmit(&mut self, now: Duration, bytes: &[u8]) {
        let now = nanoseconds(now);
        if now < self.free_ns && !self.replies.is_empty() {
            // Board and servo both drive the wire: the rest of the answer is lost.
            self.replies.retain(|(at, _)| *at <= now);
            self.collisions += 1;
        }
        let mut end = now.max(self.free_ns.min(now + BYTE_NS));
        for &byte in bytes {
            end += BYTE_NS;
            let mut packet = self.decoder.push(byte);
            while let Some(found) = packet {
                let answer = act(&mut self.servos, &self.present, &self.faults, &found);
                if let Some((delay, frame, fault)) = answer {
                    let mut at = end + delay;
                    let bytes = frame.as_bytes();
                    for (place, &byte) in bytes.iter().enumerate() {
                        at += BYTE_NS;
                        let spoilt = fault.garbled && place + 1 == bytes.len();
                        self.replies
                            .push_back((at, if spoilt { !byte } else { byte }));
                    }
                    self.free_ns = at;
                }
                packet = self.decoder.pending();
            }
        }
        self.free_ns = self.free_ns.max(end);
    }

    /// The next byte from a servo, once it has arrived.
    pub fn receive(&mut self, now: Duration) -> Option<u8> {
        let (at, byte) = *self.replies.front()?;
        (at <= nanoseconds(now)).then(|| {
            self.replies.pop_front();
            byte
        })
    }

    /// When the next byte arrives, if one is under way.
    pub fn next_byte(&self) -> Option<Duration> {
        self.replies
            .front()
            .map(|(at, _)| Duration::from_nanos(*at))
    }

    /// Moves all servos for `seconds`; the claw cannot close beyond `claw_stop`. A joint sinks
    /// when neither of its two servos has torque.
    pub fn step(&mut self, seconds: f64, claw_stop: f64) {
        self.servos[SERVOS - 1].stop = claw_stop;
        for servo in &mut self.servos {
            servo.step(seconds);
        }
        for pair in PAIRS {
            if pair.iter().all(|servo| !self.servos[*servo].has_torque()) {
                for servo in pair {
                    self.servos[servo].sag(seconds);
                }
            }
        }
    }

    /// Present positions in units, as the arm as drawn counts. Where a joint has only one servo, the
    /// second one would stand as if it faced the first.
    pub fn positions(&self) -> [f64; SERVOS] {
        core::array::from_fn(|index| match self.fitted[index] {
            true => self.servos[index].position,
            false => f64::from(MAX_POSITION) - self.servos[index - 1].position,
        })
    }

    /// Moves the servos to these positions, where they hold with torque.
    pub fn set_positions(&mut self, positions: [u16; SERVOS]) {
        for (index, servo) in self.servos.iter_mut().enumerate() {
            if self.fitted[index] {
                servo.position = f64::from(positions[index]);
                servo.hold(positions[index]);
            }
        }
    }

    /// A person brings a joint, by its first servo's index, to a position, as far as it goes, and
    /// holds it there until it has torque. A joint that has torque stays where it is.
    pub fn bring(&mut self, joint: usize, position: f64) {
        let second = PAIRS.iter().find(|pair| pair[0] == joint);
        let all = second.map_or_else(|| vec![joint], |pair| pair.to_vec());
        if all.iter().any(|servo| self.servos[*servo].has_torque()) {
            return;
        }
        for servo in all {
            let mirrored = f64::from(MAX_POSITION) - position;
            self.servos[servo].bring(if servo == joint { position } else { mirrored });
        }
    }

    /// Plugs the servo with this id in or out; an absent one never answers.
    pub fn set_present(&mut self, id: u8, present: bool) {
        if let Some(index) = self.with_id(id) {
            self.present[index] = present;
        }
    }

    /// Gives the servo with this id a fault; the default mends it.
    pub fn set_fault(&mut self, id: u8, fault: ServoFault) {
        if let Some(index) = self.with_id(id) {
            self.faults[index] = fault;
        }
    }

    fn with_id(&self, id: u8) -> Option<usize> {
        (0..SERVOS)
            .find(|index| self.fitted[*index] && self.servos[*index].table[usize::from(ID)] == id)
    }

    /// How often the board sent while a servo was answering.
    pub fn collisions(&self) -> u64 {
        self.collisions
    }
}

/// Lets the servos act on a packet. If one answers, returns its return delay in ns, its answer, and
/// its fault.
fn act(
    servos: &mut [Servo; SERVOS],
    present: &[bool; SERVOS],
    faults: &[ServoFault; SERVOS],
    packet: &Packet<'_>,
) -> Option<(u64, Frame, ServoFault)> {
    let instruction = packet.instruction();
    let plugged = servos.iter_mut().zip(present).zip(faults);
    let mut reached = plugged
        .filter(|((_, present), _)| **present)
        .map(|((servo, _), fault)| (servo, *fault));
    if packet.id == BROADCAST_ID {
        for (servo, _) in reached {
            match (instruction, packet.parameters) {
                (Some(Instruction::SyncWrite), [address, width, rest @ ..]) => {
                    let id = servo.table[usize::from(ID)];
                    for values in rest.chunks_exact(usize::from(*width) + 1) {
                        if values[0] == id {
                            servo.write(*address, &values[1..]);
                        }
                    }
                }
                _ => {
                    servo.obey(instruction, packet.parameters);
                }
            }
        }
        return None;
    }
    let (servo, fault) = reached.find(|(servo, _)| servo.table[usize::from(ID)] == packet.id)?;
    let (errors, registers) = servo.obey(instruction, packet.parameters);
    let delay = u64::from(servo.table[usize::from(RETURN_DELAY_TIME)]) * 2_000;
    let errors = errors.union(fault.errors);
    let frame = Frame::status(packet.id, errors, &registers).ok()?;
    let answers = servo.answers(instruction);
    answers.then_some((delay, frame, fault))
}

fn nanoseconds(time: Duration) -> u64 {
    time.as_nanos() as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use lager_ax12::table::{
        CCW_ANGLE_LIMIT_L, GOAL_POSITION_L, PRESENT_LOAD_L, PRESENT_POSITION_L, RETURN_LEVEL,
    };

    fn bus() -> ServoBus {
        ServoBus::new([512; SERVOS])
    }

    fn ask(bus: &mut ServoBus, frame: &Frame) -> Vec<u8> {
        let now = Duration::from_nanos(bus.free_ns);
        bus.transmit(now, frame.as_bytes());
        let mut answer = Vec::new();
        while let Some(byte) = bus.receive(now + Duration::from_millis(5)) {
            answer.push(byte);
        }
        answer
    }

    fn run(bus: &mut ServoBus, milliseconds: usize, claw_stop: f64) {
        for _ in 0..milliseconds {
            bus.step(0.001, claw_stop);
        }
    }

    #[test]
    fn a_ping_is_answered_as_in_the_manual() {
        // e-Manual, protocol 1.0: FF FF 01 02 01 FB -> FF FF 01 02 00 FC.
        let answer = ask(&mut bus(), &Frame::ping(1));
        assert_eq!(answer, [0xFF, 0xFF, 0x01, 0x02, 0x00, 0xFC]);
    }

    #[test]
    fn an_answer_comes_after_the_packet_the_delay_and_its_own_bytes() {
        let mut bus = bus();
        bus.transmit(Duration::ZERO, Frame::ping(3).as_bytes());
        let first = Duration::from_micros(60 + 500 + 10);
        assert_eq!(bus.next_byte(), Some(first));
        assert_eq!(bus.receive(first - Duration::from_nanos(1)), None);
        assert_eq!(bus.receive(first), Some(0xFF));
        assert_eq!(bus.next_byte(), Some(first + Duration::from_micros(10)));
    }

    #[test]
    fn a_goal_is_reached_at_the_goal_speed() {
        let mut bus = bus();
        // Speed 100 is 11.1 revolutions a minute, 227 units a second.
        let goal = [0x58, 0x02, 100, 0];
        let answer = ask(&mut bus, &Frame::write(2, GOAL_POSITION_L, &goal).unwrap());
        assert_eq!(answer[4], 0);
        run(&mut bus, 100, 0.0);
        let position = bus.positions()[1];
        assert!((position - 534.7).abs() < 0.5, "{position}");
        run(&mut bus, 400, 0.0);
        assert_eq!(bus.positions()[1], 600.0);
        assert_eq!(bus.positions()[0], 512.0);
        let answer = ask(&mut bus, &Frame::read(2, PRESENT_POSITION_L, 2));
        assert_eq!(answer[5..7], [0x58, 0x02]);
    }

    #[test]
    fn a_blocked_claw_pushes_harder_and_stays() {
        let mut bus = bus();
        let load = |bus: &mut ServoBus, goal: u16| {
            ask(
                bus,
                &Frame::write(8, GOAL_POSITION_L, &goal.to_le_bytes()).unwrap(),
            );
            run(bus, 300, 462.0);
            let answer = ask(bus, &Frame::read(8, PRESENT_LOAD_L, 2));
            lager_ax12::table::signed(u16::from_le_bytes([answer[5], answer[6]]))
        };
        let little = load(&mut bus, 459);
        let much = load(&mut bus, 440);
        assert_eq!(bus.positions()[7], 462.0);
        assert!(
            little < 0 && much < 3 * little && much >= -1023,
            "{little} {much}"
        );
    }

    #[test]
    fn a_broadcast_moves_all_and_nobody_answers() {
        let mut bus = bus();
        let goal = 600_u16.to_le_bytes();
        let servos: Vec<(u8, &[u8])> = (1..=8).map(|id| (id, &goal[..])).collect();
        let answer = ask(
            &mut bus,
            &Frame::sync_write(GOAL_POSITION_L, &servos).unwrap(),
        );
        assert!(answer.is_empty());
        run(&mut bus, 200, 0.0);
        assert_eq!(bus.positions(), [600.0; SERVOS]);
    }

    #[test]
    fn a_write_held_back_waits_for_its_action() {
        let mut bus = bus();
        ask(
            &mut bus,
            &Frame::reg_write(4, GOAL_POSITION_L, &[0, 1]).unwrap(),
        );
        run(&mut bus, 300, 0.0);
        assert_eq!(bus.positions()[3], 512.0);
        ask(&mut bus, &Frame::action(BROADCAST_ID));
        run(&mut bus, 300, 0.0);
        assert_eq!(bus.positions()[3], 256.0);
        assert_eq!(
            ask(&mut bus, &Frame::action(4))[4],
            ErrorBits::INSTRUCTION.bits()
        );
    }

    #[test]
    fn what_a_servo_cannot_do_it_says() {
        let mut bus = bus();
        let error = |bus: &mut ServoBus, frame: &Frame| ask(bus, frame)[4];
        let write = |address, values: &[u8]| Frame::write(1, address, values).unwrap();
        assert_eq!(
            error(&mut bus, &write(PRESENT_POSITION_L, &[1, 1])),
            ErrorBits::RANGE.bits()
        );
        assert_eq!(
            error(&mut bus, &write(49, &[1, 1])),
            ErrorBits::RANGE.bits()
        );
        ask(&mut bus, &write(CCW_ANGLE_LIMIT_L, &600_u16.to_le_bytes()));
        let too_far = write(GOAL_POSITION_L, &601_u16.to_le_bytes());
        assert_eq!(error(&mut bus, &too_far), ErrorBits::ANGLE_LIMIT.bits());
        let reset = Frame::instruction(1, Instruction::Reset, &[]).unwrap();
        assert_eq!(error(&mut bus, &reset), ErrorBits::INSTRUCTION.bits());
    }

    #[test]
    fn silence_where_no_servo_should_speak() {
        let mut bus = bus();
        assert!(ask(&mut bus, &Frame::ping(9)).is_empty());
        bus.set_present(5, false);
        assert!(ask(&mut bus, &Frame::ping(5)).is_empty());
        ask(&mut bus, &Frame::write(6, RETURN_LEVEL, &[1]).unwrap());
        assert!(
            ask(
                &mut bus,
                &Frame::write(6, GOAL_POSITION_L, &[0, 2]).unwrap()
            )
            .is_empty()
        );
        assert!(!ask(&mut bus, &Frame::read(6, ID, 1)).is_empty());
    }

    #[test]
    fn an_ill_servo_says_so_and_a_garbled_answer_has_a_wrong_checksum() {
        let mut bus = bus();
        bus.set_fault(
            2,
            ServoFault {
                errors: ErrorBits::OVERLOAD,
                garbled: false,
            },
        );
        let answer = ask(&mut bus, &Frame::ping(2));
        assert_eq!(answer, [0xFF, 0xFF, 0x02, 0x02, 0x20, 0xDB]);
        bus.set_fault(
            2,
            ServoFault {
                errors: ErrorBits::NONE,
                garbled: true,
            },
        );
        let answer = ask(&mut bus, &Frame::ping(2));
        assert_eq!(answer, [0xFF, 0xFF, 0x02, 0x02, 0x00, !0xFB]);
        assert_eq!(ask(&mut bus, &Frame::ping(3))[4], 0);
    }

    #[test]
    fn a_joint_without_torque_sinks_until_one_of_its_servos_has_it() {
        let mut bus = ServoBus::sagging([512; SERVOS], Noise::new(1, 1), Make::Varied);
        run(&mut bus, 1_000, 0.0);
        let [base, shoulder, mirrored, ..] = bus.positions();
        assert_eq!(base, 512.0);
        assert!(shoulder < 505.0 && shoulder > 430.0, "{shoulder}");
        assert!((512.0 - shoulder - (mirrored - 512.0)).abs() < 1e-6);
        let goal = 500_u16.to_le_bytes();
        ask(&mut bus, &Frame::write(2, GOAL_POSITION_L, &goal).unwrap());
        let held = bus.positions()[2];
        run(&mut bus, 1_000, 0.0);
        assert_eq!(bus.positions()[1], 500.0);
        assert_eq!(bus.positions()[2], held);
        // The elbow sinks to where it rests.
        run(&mut bus, 30_000, 0.0);
        assert_eq!(bus.positions()[3], LYING);
    }

    #[test]
    fn another_arm_has_other_ids_and_counts_the_other_way() {
        let mut bus = ServoBus::sagging([512; SERVOS], Noise::new(1, 1), Make::Varied);
        let mut arm = ArmBuild::default();
        arm.ids[0] = Some(253);
        arm.ids[2] = None;
        arm.ids[7] = Some(1);
        (arm.reversed[1], arm.reversed[7]) = (true, true);
        bus.fit(&arm);
        for (id, answers) in [(253, true), (1, true), (3, false), (8, false)] {
            assert_eq!(!ask(&mut bus, &Frame::ping(id)).is_empty(), answers, "{id}");
        }
        // The shoulder has one servo. It sinks as far as it would as drawn, and says so its way.
        run(&mut bus, 30_000, 0.0);
        let positions = bus.positions();
        assert_eq!(positions[1..3], [LYING, 1_023.0 - LYING]);
        let look = |bus: &mut ServoBus, id, address| {
            let answer = ask(bus, &Frame::read(id, address, 2));
            u16::from_le_bytes([answer[5], answer[6]])
        };
        assert_eq!(look(&mut bus, 2, PRESENT_POSITION_L), 1_023 - 300);
        // Its goal is meant its way, too.
        let goal = 423_u16.to_le_bytes();
        ask(&mut bus, &Frame::write(2, GOAL_POSITION_L, &goal).unwrap());
        run(&mut bus, 2_000, 0.0);
        assert_eq!(bus.positions()[1..3], [600.0, 423.0]);
        // The claw closes on something, and pushes towards closed.
        let goal = (1_023_u16 - 440).to_le_bytes();
        ask(&mut bus, &Frame::write(1, GOAL_POSITION_L, &goal).unwrap());
        run(&mut bus, 300, 462.0);
        assert_eq!(bus.positions()[7], 462.0);
        let load = lager_ax12::table::signed(look(&mut bus, 1, PRESENT_LOAD_L));
        assert!(load > 300, "{load}");
    }

    #[test]
    fn sending_into_an_answer_spoils_it() {
        let mut bus = bus();
        bus.transmit(Duration::ZERO, Frame::ping(1).as_bytes());
        bus.transmit(Duration::from_micros(575), Frame::ping(2).as_bytes());
        assert_eq!(bus.collisions(), 1);
        let mut answer = Vec::new();
        while let Some(byte) = bus.receive(Duration::from_millis(9)) {
            answer.push(byte);
        }
        // The first byte of the first answer had arrived; the second answer is complete.
        assert_eq!(answer, [0xFF, 0xFF, 0xFF, 0x02, 0x02, 0x00, 0xFB]);
    }
}
