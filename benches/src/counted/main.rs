//! `lager-counted STEP`: carries out one step of the path between two marks, for a counter that sees
//! system calls. `tests/aarch64/run` counts the instructions between them on aarch64, where callgrind
//! cannot look. The steps are those of the bench `instructions`, by the same names.
//!
//! A mark is a question for the group of a process that cannot be. Nothing else asks it, and it changes
//! nothing. `nothing` is no step at all, so its count is that of the marks.

use core::time::Duration;
use std::hint::black_box;
use std::process::ExitCode;

use lager_benches::steps::{self, Ports};
use rustix::process::{Pid, getpgid};

/// The process that a mark asks for: more than Linux gives numbers to. `tests/aarch64/count.c` knows it.
const MARK: i32 = 0x6C61_6765;

fn main() -> ExitCode {
    let step = std::env::args().nth(1).unwrap_or_default();
    match step.as_str() {
        "nothing" => counted(|| ()),
        "decode/second-of-packets" => {
            let bytes = steps::a_second_of_bytes();
            counted(|| steps::decode(&bytes));
        }
        "encode/second-of-packets" => {
            let packets = steps::a_second_of_packets();
            counted(|| steps::encode(&packets));
        }
        "publish/to-1" => publish(1),
        "publish/to-64" => publish(64),
        "receive/sample" => {
            let mut ports = Ports::published();
            counted(|| ports.receive());
        }
        "poll/nothing" => {
            let mut ports = Ports::meet(1);
            counted(|| ports.receive());
        }
        "wait/rung" => {
            let ports = Ports::published();
            counted(|| ports.wait(Duration::from_millis(20)));
        }
        "navigate/second-of-frames" => {
            let mut navigator = steps::driving();
            counted(|| steps::navigate(&mut navigator, Duration::ZERO));
            steps::still_driving(&navigator);
        }
        "arbitrate/new-order" => {
            let mut arbiter = steps::steering();
            counted(|| steps::arbitrate(&mut arbiter, 2));
        }
        _ => {
            eprintln!(
                "lager-counted: there is no step `{step}`; benches/limits.toml has their names"
            );
            return ExitCode::from(2);
        }
    }
    ExitCode::SUCCESS
}

fn publish(readers: usize) {
    let ports = Ports::meet(readers);
    counted(|| ports.publish());
}

/// Carries out a step between two marks.
#[inline(always)]
fn counted<T>(step: impl FnOnce() -> T) {
    mark();
    let done = step();
    mark();
    black_box(done);
}

#[inline(never)]
fn mark() {
    // There is no such process.
    let _ = black_box(getpgid(Pid::from_raw(MARK)));
}
