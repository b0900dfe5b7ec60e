//! Deliberate slow-downs beside what is measured, so that the guard's own test can show that the
//! guard notices them.
//!
//! They stand where the code of `lager-ports` would do the same: in the bench code around its
//! calls, never in a crate that runs on the robot. Without the feature `slow-downs` every function
//! here is empty, so that the figures anybody else sees are of the code alone; with it,
//! `LAGER_BENCH_SLOW` says which one is at work. A spin is of single rows of a report, and as long
//! as `benches/guard --try` wants it; who measures a row tells its processes.

use core::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use core::time::Duration;
use std::hint::black_box;
use std::sync::OnceLock;
use std::time::Instant;

/// Names the slow-down: `allocation`, `system-call`, or `spin:ROW=NS;ROW=NS` with so many ns for
/// each of these rows, as in `spin:hop block same-core: lager=400`.
pub const VARIABLE: &str = "LAGER_BENCH_SLOW";

/// Whether they are built in: without them there is not even the question which one is at work.
const BUILT_IN: bool = cfg!(feature = "slow-downs");

#[derive(PartialEq)]
enum Slow {
    Not,
    Allocation,
    /// Rows of a report, each with its ns.
    Spin(Vec<(String, u64)>),
    SystemCall,
}

/// How long the row that is measured now spins, in ns.
static SPIN_NS: AtomicU64 = AtomicU64::new(0);

/// To be called beside each publishing on a topic that so many observers read.
#[inline]
pub fn publish(observers: usize) {
    match which() {
        Slow::Not => {}
        Slow::Allocation => allocate(),
        Slow::Spin(_) => spin(),
        Slow::SystemCall => (0..observers).for_each(|_| wake_nobody()),
    }
}

/// To be called beside each receiving.
#[inline]
pub fn receive() {
    if *which() == Slow::Allocation {
        allocate();
    }
}

/// To be called for each answer of the path.
#[inline]
pub fn answer() {
    if let Slow::Spin(_) = which() {
        spin();
    }
}

/// That row is measured now.
pub fn row(row: &str) {
    if let Slow::Spin(rows) = which() {
        let of_row = rows.iter().find(|(name, _)| name == row);
        spins_for(of_row.map_or(0, |(_, spin_ns)| *spin_ns));
    }
}

/// How long this row is to spin for each sample, in ns.
pub fn spin_ns() -> u64 {
    SPIN_NS.load(Ordering::Relaxed)
}

/// The process that measures a row has said so.
pub fn spins_for(spin_ns: u64) {
    SPIN_NS.store(spin_ns, Ordering::Relaxed);
}

/// Ends the process if the variable names no slow-down, or one that is not built in: measuring
/// without it would prove nothing.
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
            eprintln!("{VARIABLE} is `{text}`; set it to allocation, system-call or spin:ROW=NS");
            std::process::exit(2);
        })
    })
}

fn read(text: &str) -> Option<Slow> {
    match text {
        "allocation" => Some(Slow::Allocation),
        "system-call" => Some(Slow::SystemCall),
        _ => {
            let row = |row: &str| {
                let (name, spin_ns) = row.rsplit_once('=')?;
                Some((name.to_owned(), spin_ns.parse().ok()?))
            };
            let rows = text.strip_prefix("spin:")?.split(';');
            Some(Slow::Spin(rows.map(row).collect::<Option<_>>()?))
        }
    }
}

/// What `loan` of plain iceoryx2 does: a small cell on the heap for each sample.
fn allocate() {
    drop(black_box(Box::new([0_u8; 64])));
}

/// Nothing, for as long as the row wants.
fn spin() {
    let wanted = Duration::from_nanos(spin_ns());
    if wanted.is_zero() {
        return;
    }
    let start = Instant::now();
    while start.elapsed() < wanted {
        core::hint::spin_loop();
    }
}

/// What ringing an observer would cost even when nobody sleeps.
fn wake_nobody() {
    static WORD: AtomicU32 = AtomicU32::new(0);
    // Nobody waits on the word, which is what the kernel then says.
    let _ = rustix::thread::futex::wake(&WORD, rustix::thread::futex::Flags::PRIVATE, 1);
}
