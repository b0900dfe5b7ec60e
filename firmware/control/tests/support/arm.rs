//! Giving arm commands and waiting for their ends.

use lager_wire::{ArmData, Payload, SteerFlags};

use super::Bench;

/// Gives a command and waits for its end; the flags of the report that tells it.
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

/// The same, and the command has to be done.
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

/// The same, and the command has to be aborted.
pub fn aborted(bench: &mut Bench, code: u8, limit_ms: u32) {
    assert!(
        finish(bench, code, limit_ms).contains(SteerFlags::ABORTED),
        "code {code:#04x}"
    );
}

/// The same, and the command has to be refused.
pub fn refused(bench: &mut Bench, code: u8) {
    assert!(
        finish(bench, code, 100).contains(SteerFlags::REFUSED),
        "code {code:#04x}"
    );
}

/// Every servo's state the Pi was told.
pub fn arm_data(bench: &Bench) -> Vec<(u32, ArmData)> {
    bench.pi.all(|payload| match payload {
        Payload::ArmData(data) => Some(data),
        _ => None,
    })
}
