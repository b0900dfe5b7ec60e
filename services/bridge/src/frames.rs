//! Makes samples of packets: one sample may come in several packets.
//!
//! It is pure and stands apart from the threads, so that the simulation in one process makes the
//! same samples.

use lager_topics::{LineFrame, SERVO_UNKNOWN, SteeringReport};
use lager_wire::{ArmData, LineBits, LineState, PacketId, SteerData};

use crate::arbiter::Arbiter;

/// Joins a line packet with the raw reading that a board may send just before it.
#[derive(Clone, Copy, Debug, Default)]
pub struct LineAssembler {
    raw: Option<(PacketId, LineBits)>,
}

impl LineAssembler {
    /// A raw line packet has come.
    pub fn raw(&mut self, id: PacketId, bits: LineBits) {
        self.raw = Some((id, bits));
    }

    /// A line packet has come. Returns its sample. A raw reading counts only if it came in the
    /// packet just before, so that a lost packet cannot join two moments.
    pub fn line(&mut self, id: PacketId, state: LineState, link_epoch: u32) -> LineFrame {
        let bits = match self.raw.take() {
            Some((raw_id, bits)) if raw_id.next() == id => bits.0,
            _ => LineFrame::NO_BITS,
        };
        LineFrame {
            link_epoch,
            bits,
            state: state.into(),
            packet_id: id.get(),
        }
    }
}

/// The last report of each servo.
#[derive(Clone, Copy, Debug)]
pub struct ServoTable {
    position: [u16; 8],
    load: [i16; 8],
}

impl Default for ServoTable {
    fn default() -> Self {
        Self {
            position: [SERVO_UNKNOWN; 8],
            load: [0; 8],
        }
    }
}

impl ServoTable {
    /// A servo has reported. A ninth servo is not the robot's.
    pub fn hear(&mut self, data: &ArmData) {
        let index = usize::from(data.servo).wrapping_sub(1);
        if let Some(position) = self.position.get_mut(index) {
            *position = data.position;
            self.load[index] = data.load;
        }
    }
}

/// The sample of a report of the steering board that came `age_ms` ago, in robot time.
pub fn steering_report(
    link_epoch: u32,
    data: &SteerData,
    age_ms: u16,
    servos: &ServoTable,
    arbiter: &Arbiter,
) -> SteeringReport {
    let mut report = SteeringReport {
        link_epoch,
        code: data.code,
        left_duty: data.left_duty,
        right_duty: data.right_duty,
        flags: data.flags.0,
        line_error: data.line_error,
        servo_errors: data.servo_errors,
        battery_decivolts: data.battery_decivolts,
        age_ms,
        servo_position: servos.position,
        servo_load: servos.load,
        ..SteeringReport::default()
    };
    arbiter.fill_report(&mut report);
    report
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_raw_reading_joins_the_line_packet_right_after_it() {
        let mut lines = LineAssembler::default();
        lines.raw(PacketId::new(15), LineBits(0b111));
        let frame = lines.line(PacketId::new(0), LineState::LeftOfLine, 3);
        assert_eq!(frame.bits, 0b111);
        assert_eq!(frame.state.get(), Some(LineState::LeftOfLine));
        assert_eq!((frame.link_epoch, frame.packet_id), (3, 0));
    }

    #[test]
    fn a_raw_reading_does_not_join_a_later_line_packet() {
        let mut lines = LineAssembler::default();
        lines.raw(PacketId::new(1), LineBits(0b111));
        let frame = lines.line(PacketId::new(3), LineState::OnLine, 1);
        assert_eq!(frame.bits, LineFrame::NO_BITS);
        let frame = lines.line(PacketId::new(2), LineState::OnLine, 1);
        assert_eq!(frame.bits, LineFrame::NO_BITS, "it was used up");
    }

    #[test]
    fn servos_are_numbered_from_one_and_strangers_are_passed_over() {
        let mut servos = ServoTable::default();
        for servo in [0, 1, 8, 9, 255] {
            servos.hear(&ArmData {
                servo,
                errors: 0,
                position: 500 + u16::from(servo),
                load: -7,
                decivolts: 110,
                celsius: 40,
            });
        }
        assert_eq!(servos.position[0], 501);
        assert_eq!(servos.position[7], 508);
        assert_eq!(servos.position[1..7], [SERVO_UNKNOWN; 6]);
        assert_eq!(servos.load, [-7, 0, 0, 0, 0, 0, 0, -7]);
    }
}
