//! What the kernel reports about processes in `/proc`.

use std::fs;

/// The children of all threads of a process.
#[must_use]
pub fn children(parent: u32) -> Vec<u32> {
    let lists = of_threads(parent, "children");
    let pids = |list: String| -> Vec<u32> {
        let pids = list.split_whitespace();
        pids.filter_map(|pid| pid.parse().ok()).collect()
    };
    lists.flat_map(pids).collect()
}

/// The processor time that all threads of a process have used, in ns.
#[must_use]
pub fn processor_ns(process: u32) -> u64 {
    // The first number of a thread's `schedstat` is its time on a processor, in ns.
    of_threads(process, "schedstat")
        .filter_map(|text| text.split_whitespace().next()?.parse::<u64>().ok())
        .sum()
}

/// Whether a thread of a process is ready to run. For a process that should have answered long ago:
/// if none is, the process sleeps and waits for a wake-up.
#[must_use]
pub fn wants_to_run(process: u32) -> bool {
    // The state follows the name, which is in brackets.
    of_threads(process, "stat")
        .any(|stat| matches!(stat.rsplit_once(") "), Some((_, rest)) if rest.starts_with('R')))
}

/// The content of one file in `/proc` for each thread.
fn of_threads(process: u32, file: &'static str) -> impl Iterator<Item = String> {
    let threads = fs::read_dir(format!("/proc/{process}/task"));
    let threads = threads.into_iter().flatten().flatten();
    threads.filter_map(move |thread| fs::read_to_string(thread.path().join(file)).ok())
}
