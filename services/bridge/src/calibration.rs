//! The result of the last calibration of the line sensors, as `link/health` shows it.
//!
//! ```text
//!                begun                      the board's second answer
//!   any state ---------> running ------------------------------------> done | partly
//!                           |
//!                           +-- the board falls silent or restarts --> broken off
//! ```
//!
//! This file stands apart from the settings because the board answers a calibration twice. The
//! first answer comes when it begins, and answers the request. The second comes five seconds later
//! when it ends; no request waits for it. An end without a beginning belongs to a calibration that
//! an earlier bridge began. Between the two the board says what the sensors read, one after the
//! other.

use lager_topics::{CalibratedSensor, Calibration as State, Health};
use lager_wire::{LineReading, SettingReply, SettingStatus};

/// The last calibration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Calibration {
    state: State,
    /// How many sensors have a new threshold.
    sensors: u8,
    /// How many calibrations have ended, wrapping.
    ended: u8,
    /// What each line sensor read.
    readings: [CalibratedSensor; 11],
}

impl Calibration {
    /// As an earlier bridge published it.
    pub(crate) fn new(kept: Option<&Health>) -> Self {
        let kept = kept.copied().unwrap_or_default();
        Self {
            state: kept.calibration.get().unwrap_or(State::Never),
            sensors: kept.calibrated_sensors,
            ended: kept.calibrations_ended,
            readings: kept.calibrated,
        }
    }

    /// The board has begun one.
    pub(crate) fn begin(&mut self) {
        self.state = State::Running;
        self.readings = Default::default();
    }

    /// The board has said what one of the sensors reads.
    pub(crate) fn hear_reading(&mut self, reading: &LineReading) {
        if let Some(sensor) = self.readings.get_mut(usize::from(reading.sensor)) {
            *sensor = CalibratedSensor {
                reading: reading.reading,
                lowest: reading.lowest,
                highest: reading.highest,
                tells_apart: reading.tells_apart.into(),
            };
        }
    }

    /// The board has answered for the second time.
    pub(crate) fn hear(&mut self, reply: &SettingReply) {
        match (reply.status, reply.value) {
            // This repeats the first answer, or that it was taken back.
            (SettingStatus::Accepted, 1 | 2) => {}
            (SettingStatus::Accepted, sensors) => self.end(State::Done, sensors),
            (_, sensors) => self.end(State::Partly, sensors),
        }
    }

    /// The board has gone or has restarted, or somebody takes the calibration back.
    pub(crate) fn break_off(&mut self) {
        if self.state == State::Running {
            self.end(State::BrokenOff, 0);
        }
    }

    /// Writes its part of `link/health`.
    pub(crate) fn fill(&self, health: &mut Health) {
        health.calibration = self.state.into();
        health.calibrated_sensors = self.sensors;
        health.calibrations_ended = self.ended;
        health.calibrated = self.readings;
    }

    fn end(&mut self, state: State, sensors: i16) {
        self.state = state;
        self.sensors = u8::try_from(sensors).unwrap_or(0);
        self.ended = self.ended.wrapping_add(1);
    }
}

#[cfg(test)]
mod tests {
    use lager_wire::SettingKey;

    use super::*;

    fn reply(status: SettingStatus, value: i16) -> SettingReply {
        SettingReply {
            key: SettingKey::Calibrate,
            seq: 1,
            value,
            status,
        }
    }

    fn shown(calibration: &Calibration) -> (Option<State>, u8, u8) {
        let mut health = Health::default();
        calibration.fill(&mut health);
        (
            health.calibration.get(),
            health.calibrated_sensors,
            health.calibrations_ended,
        )
    }

    #[test]
    fn the_end_tells_how_many_sensors_have_a_new_threshold() {
        let mut calibration = Calibration::new(None);
        assert_eq!(shown(&calibration), (Some(State::Never), 0, 0));
        calibration.begin();
        calibration.hear(&reply(SettingStatus::Accepted, 1));
        assert_eq!(shown(&calibration), (Some(State::Running), 0, 0));
        calibration.hear(&reply(SettingStatus::Accepted, 11));
        assert_eq!(shown(&calibration), (Some(State::Done), 11, 1));
        calibration.begin();
        calibration.hear(&reply(SettingStatus::OutOfRange, 4));
        assert_eq!(shown(&calibration), (Some(State::Partly), 4, 2));
    }

    #[test]
    fn what_the_sensors_read_is_shown_until_another_calibration_begins() {
        let mut calibration = Calibration::new(None);
        calibration.begin();
        calibration.hear_reading(&LineReading {
            sensor: 10,
            reading: 90,
            lowest: 30,
            highest: 120,
            tells_apart: true,
        });
        let read = |calibration: &Calibration| {
            let mut health = Health::default();
            calibration.fill(&mut health);
            let [first, .., last] = health.calibrated;
            assert!(!first.is_heard());
            (last.is_heard(), last.reading, last.tells_apart)
        };
        calibration.hear(&reply(SettingStatus::OutOfRange, 1));
        assert_eq!(read(&calibration), (true, 90, 1));
        calibration.begin();
        assert!(!read(&calibration).0);
    }

    #[test]
    fn a_board_that_goes_breaks_off_what_runs_and_nothing_else() {
        let mut calibration = Calibration::new(None);
        calibration.break_off();
        assert_eq!(shown(&calibration), (Some(State::Never), 0, 0));
        calibration.begin();
        calibration.break_off();
        calibration.break_off();
        assert_eq!(shown(&calibration), (Some(State::BrokenOff), 0, 1));
    }

    #[test]
    fn a_restarted_bridge_hears_the_end_of_what_an_earlier_one_began() {
        let mut calibration = Calibration::new(None);
        calibration.begin();
        let mut health = Health::default();
        calibration.fill(&mut health);
        let mut successor = Calibration::new(Some(&health));
        successor.hear(&reply(SettingStatus::Accepted, 11));
        assert_eq!(shown(&successor), (Some(State::Done), 11, 1));
    }
}
