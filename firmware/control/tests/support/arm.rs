//! Gives arm commands and waits for their ends.

use lager_control::SteeringConfig;
use lager_wire::{ArmData, ArmProfile, Payload, SteerFlags};

use super::Bench;

/// A board that starts with this profile of the arm.
pub fn with_arm(profile: ArmProfile) -> SteeringConfig {
    let mut config = SteeringConfig::default();
    config.arm.profile = profile.into();
    config
}

/// Gives a command, waits for its end, and returns the flags of the report about it.
pub fn finish(bench: &mut Bench, code: u8, limit_ms: u32) -> SteerFlags {
    let seq = bench.command(code);
    bench.run_until(limit_ms, |bench| {
        bench
            .reports()
            .last()
            .is_some_and(|(_, data)| data.finished_seq == seq)
    });
    bench.report().flags
}

/// As `finish`; the command must be done.
pub fn done(bench: &mut Bench, code: u8, limit_ms: u32) {
    let flags = finish(bench, code, limit_ms);
    assert!(
        !flags.contains(SteerFlags::ABORTED),
        "code {code:#04x} was aborted"
    );
    assert!(
        !flags.contains(SteerFlags::REFUSED),
        "code {code:#04x} was refused"
    );
    assert!(!flags.contains(SteerFlags::BUSY));
}

/// As `finish`; the command must be aborted.
pub fn aborted(bench: &mut Bench, code: u8, limit_ms: u32) {
    assert!(
        finish(bench, code, limit_ms).contains(SteerFlags::ABORTED),
        "code {code:#04x}"
    );
}

/// Gives a command, which the board must refuse.
pub fn refused(bench: &mut Bench, code: u8) {
    assert!(
        finish(bench, code, 100).contains(SteerFlags::REFUSED),
        "code {code:#04x}"
    );
}

/// Every servo state that the Pi has received.
pub fn arm_data(bench: &Bench) -> Vec<(u32, ArmData)> {
    bench.pi.all(|payload| match payload {
        Payload::ArmData(data) => Some(data),
        _ => None,
    })
}
