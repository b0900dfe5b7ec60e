//! Ranger, line sensors, battery and arm, as messages.

use core::f64::consts::PI;

use lager_battery::Battery;
use lager_home::Clock;
use lager_topics::{DistanceFrame, LineFrame, SERVO_UNKNOWN, SteeringReport};

use crate::messages::{BatteryState, JointState, Range, UInt8, UInt16};
use crate::told::{Calendar, Frames, Measures};

/// The joints of the arm and, at which index, the servo that tells of each. The second servo of a pair
/// faces the first and adds nothing.
const JOINTS: [(&str, usize); 6] = [
    ("base", 0),
    ("shoulder", 1),
    ("elbow", 3),
    ("wrist", 5),
    ("rotation", 6),
    ("gripper", 7),
];
/// The middle of a servo's range.
const MIDDLE: f64 = 512.0;
/// The angle at which the ranger sees, in rad: its datasheet draws a beam 12 cm wide at 80 cm.
const BEAM: f32 = 0.15;

/// What the ranger sees: infinitely far if nothing is in range, and infinitely near if something is
/// nearer than it can measure (REP-117).
pub fn range(
    frame: &DistanceFrame,
    measures: &Measures,
    (calendar, at_ns): (Calendar, u64),
    frames: &Frames,
) -> Range {
    let (near, far) = measures.ranger_cm;
    let metres = |cm: u8| f32::from(cm) / 100.0;
    Range {
        header: calendar.header(at_ns, frames.ranger()),
        radiation_type: Range::INFRARED,
        field_of_view: BEAM,
        min_range: metres(near),
        max_range: metres(far),
        range: match frame.distance_cm {
            cm if cm < near => f32::NEG_INFINITY,
            cm if cm > far => f32::INFINITY,
            cm => metres(cm),
        },
        variance: 0.0,
    }
}

/// The eleven line sensors as bits, bit 10 the leftmost; 65535 if the board tells only what it makes
/// of them.
pub fn line(frame: &LineFrame) -> UInt16 {
    UInt16 { data: frame.bits }
}

/// What the sensor board makes of the line, as `lager topic info sensor/line` explains.
pub fn line_state(frame: &LineFrame) -> UInt8 {
    let data = frame.state.raw();
    UInt8 { data }
}

/// The battery. Nobody measures its current or whether it is being charged.
pub fn battery(
    report: &SteeringReport,
    battery: &mut Battery,
    (clock, calendar, at_ns): (&Clock, Calendar, u64),
    frames: &Frames,
) -> BatteryState {
    battery.read(clock.at(at_ns), report.battery_decivolts);
    let is_known = report.battery_decivolts != 0;
    BatteryState {
        header: calendar.header(at_ns, frames.base()),
        voltage: match is_known {
            true => f32::from(report.battery_decivolts) / 10.0,
            false => f32::NAN,
        },
        temperature: f32::NAN,
        current: f32::NAN,
        charge: f32::NAN,
        capacity: f32::NAN,
        design_capacity: f32::NAN,
        percentage: match battery.percent() {
            Some(percent) if is_known => f32::from(percent) / 100.0,
            _ => f32::NAN,
        },
        power_supply_status: BatteryState::UNKNOWN,
        power_supply_health: BatteryState::UNKNOWN,
        power_supply_technology: BatteryState::LIPO,
        present: true,
        cell_voltage: Vec::new(),
        cell_temperature: Vec::new(),
        location: String::new(),
        serial_number: String::new(),
    }
}

/// The arm's joints that have been heard, in rad from the middle of their servos' range. Speeds and
/// torques are not measured.
pub fn joints(
    report: &SteeringReport,
    (calendar, at_ns): (Calendar, u64),
    frames: &Frames,
) -> JointState {
    let heard = JOINTS.map(|(name, servo)| (name, report.servo_position[servo]));
    let heard = heard.iter().filter(|(_, at)| *at != SERVO_UNKNOWN);
    let (name, position) = heard
        .map(|(name, at)| {
            let turned = (f64::from(*at) - MIDDLE) * lager_plant::arm::UNIT;
            ((*name).to_owned(), turned)
        })
        .unzip();
    JointState {
        header: calendar.header(at_ns, frames.base()),
        name,
        position,
        velocity: Vec::new(),
        effort: Vec::new(),
    }
}

/// An angle between -pi and pi.
pub fn wrapped(angle: f64) -> f64 {
    (angle + PI).rem_euclid(2.0 * PI) - PI
}

#[cfg(test)]
mod tests {
    use lager_battery::Pack;
    use lager_home::ClockSource;
    use lager_wire::LineState;

    use super::*;

    const MEASURES: Measures = Measures {
        ranger_cm: (10, 80),
        ranger_ahead_mm: 100.0,
        line_ahead_mm: 160.0,
        pack: Pack {
            cells: 3,
            low_decivolts: 105,
        },
    };

    fn seen(distance_cm: u8) -> Range {
        let frame = DistanceFrame {
            distance_cm,
            ..DistanceFrame::default()
        };
        let frames = Frames::of("r1");
        range(&frame, &MEASURES, (Calendar::new(0), 7), &frames)
    }

    #[test]
    fn no_echo_is_infinitely_far_and_too_near_is_infinitely_near() {
        assert_eq!(seen(255).range, f32::INFINITY);
        assert_eq!(seen(81).range, f32::INFINITY);
        assert_eq!(seen(9).range, f32::NEG_INFINITY);
        for (cm, metres) in [(10, 0.1), (42, 0.42), (80, 0.8)] {
            let seen = seen(cm);
            assert_eq!(seen.range, metres);
            assert!(seen.min_range <= seen.range && seen.range <= seen.max_range);
        }
        assert!(seen(42).field_of_view > 0.0);
        assert_eq!(seen(42).header.frame_id, "r1/ranger");
    }

    #[test]
    fn what_nobody_measures_is_not_a_number_and_a_percentage_is_a_part_of_one() {
        let clock = Clock::new(&ClockSource::new(1.0, None).expect("a clock"));
        let mut known = Battery::new(MEASURES.pack);
        let frames = Frames::of("r1");
        let report = |battery_decivolts| SteeringReport {
            battery_decivolts,
            ..SteeringReport::default()
        };
        let calendar = Calendar::new(0);
        let full = battery(&report(126), &mut known, (&clock, calendar, 1), &frames);
        assert_eq!((full.voltage, full.percentage), (12.6, 1.0));
        assert!(full.current.is_nan() && full.capacity.is_nan() && full.present);
        let unread = battery(&report(0), &mut known, (&clock, calendar, 1), &frames);
        assert!(unread.voltage.is_nan() && unread.percentage.is_nan());
    }

    #[test]
    fn only_joints_that_were_heard_are_told() {
        let mut report = SteeringReport::default();
        report.servo_position[1] = 512;
        report.servo_position[2] = 511;
        report.servo_position[7] = 1023;
        let told = joints(&report, (Calendar::new(0), 1), &Frames::of("r1"));
        assert_eq!(told.name, ["shoulder", "gripper"]);
        assert_eq!(told.position[0], 0.0);
        let degrees = told.position[1].to_degrees();
        assert!((149.8..150.0).contains(&degrees), "{degrees}");
    }

    #[test]
    fn the_line_is_as_the_bus_has_it() {
        let frame = LineFrame {
            bits: 0b100_0010_0000,
            state: LineState::LeftOfLine.into(),
            ..LineFrame::default()
        };
        assert_eq!((line(&frame).data, line_state(&frame).data), (0x420, 2));
    }
}
