//! Deliberate slow-downs, with which the guard's own test shows that the guard notices them.
//!
//! They are in the bench code around calls of `lager-ports`, never in a crate that runs on the
//! robot. Without the feature `slow-downs` every function here is empty, so the usual figures are
//! of unchanged code. With it, `LAGER_BENCH_SLOW` chooses one.

use core::sync::atomic::AtomicU32;
use std::hint::black_box;
use std::sync::OnceLock;

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

/// Call it beside each publish on a topic with `observers` observers.
#[inline]
pub fn publish(observers: usize) {
    match which() {
        Slow::Not => {}
        Slow::Allocation => allocate(),
        Slow::SystemCall => (0..observers).for_each(|_| wake_nobody()),
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

/// Makes the system call that a ring of an observer would need even if nobody sleeps.
fn wake_nobody() {
    static WORD: AtomicU32 = AtomicU32::new(0);
    // Nobody waits on the word, and the kernel says so.
    let _ = rustix::thread::futex::wake(&WORD, rustix::thread::futex::Flags::PRIVATE, 1);
}
