//! Deliberate slow-downs, with which the guard's own test shows that the guard notices them.
//!
//! They are in the bench code around calls of what is measured, never in a crate that runs on the
//! robot. Without the feature `slow-downs` every function here is empty, so the usual figures are
//! of unchanged code. With it, `LAGER_BENCH_SLOW` chooses one.

use core::sync::atomic::AtomicU32;
use std::hint::black_box;
use std::sync::OnceLock;

use lager_sample::Topic as _;
use lager_topics::SensorLine;

/// The environment variable with the slow-down's name: `allocation` or `system-call`.
pub const VARIABLE: &str = "LAGER_BENCH_SLOW";

/// Whether they are built in. If not, the code does not even read the variable.
const BUILT_IN: bool = cfg!(feature = "slow-downs");

#[derive(PartialEq)]
enum Slow {
    Not,
    Allocation,
    SystemCall,
}

/// Call it beside each publish.
#[inline]
pub fn publish() {
    match which() {
        Slow::Not => {}
        Slow::Allocation => allocate(),
        Slow::SystemCall => wake_nobody(SensorLine::QOS.observers),
    }
}

/// Call it beside work of so many steps, for instance to decode as many packets.
#[inline]
pub fn work(steps: usize) {
    if *which() == Slow::SystemCall {
        wake_nobody(steps);
    }
}

/// Call it beside each receive.
#[inline]
pub fn receive() {
    if *which() == Slow::Allocation {
        allocate();
    }
}

/// Ends the process if the variable has an unknown name or one that is not built in: a measurement
/// without the slow-down would prove nothing.
pub fn refuse_in_vain() {
    if !BUILT_IN && std::env::var_os(VARIABLE).is_some() {
        eprintln!(
            "{VARIABLE} is set, but this was built without the feature `slow-downs`; build it with that feature, or unset the variable"
        );
        std::process::exit(2);
    }
    which();
}

#[inline(always)]
fn which() -> &'static Slow {
    static NOT: Slow = Slow::Not;
    if BUILT_IN { chosen() } else { &NOT }
}

fn chosen() -> &'static Slow {
    static WHICH: OnceLock<Slow> = OnceLock::new();
    WHICH.get_or_init(|| {
        let Ok(text) = std::env::var(VARIABLE) else {
            return Slow::Not;
        };
        read(&text).unwrap_or_else(|| {
            eprintln!("{VARIABLE} is `{text}`; set it to allocation or system-call");
            std::process::exit(2);
        })
    })
}

fn read(text: &str) -> Option<Slow> {
    match text {
        "allocation" => Some(Slow::Allocation),
        "system-call" => Some(Slow::SystemCall),
        _ => None,
    }
}

/// Does what plain iceoryx2's `loan` does for each sample: allocates a small cell on the heap.
fn allocate() {
    drop(black_box(Box::new([0_u8; 64])));
}

/// Makes the system call that a ring of an observer would need even if nobody sleeps, for so many.
fn wake_nobody(times: usize) {
    static WORD: AtomicU32 = AtomicU32::new(0);
    for _ in 0..times {
        // Nobody waits on the word, and the kernel says so.
        let _ = rustix::thread::futex::wake(&WORD, rustix::thread::futex::Flags::PRIVATE, 1);
    }
}
