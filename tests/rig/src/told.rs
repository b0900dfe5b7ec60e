//! What the kernel tells of processes, in `/proc`.

use std::fs;

/// The children of a process, of all its threads.
#[must_use]
pub fn children(parent: u32) -> Vec<u32> {
    let lists = of_threads(parent, "children");
    let pids = |list: String| -> Vec<u32> {
        let pids = list.split_whitespace();
        pids.filter_map(|pid| pid.parse().ok()).collect()
    };
    lists.flat_map(pids).collect()
}

/// Processor time of all threads of a process, in ns.
#[must_use]
pub fn processor_ns(process: u32) -> u64 {
    // The kernel counts each thread's time on a processor in ns, first in its `schedstat`.
    of_threads(process, "schedstat")
        .filter_map(|text| text.split_whitespace().next()?.parse::<u64>().ok())
        .sum()
}

/// Whether a thread of a process is ready to run. Asked of one that should have answered long ago:
/// who waits for a wake-up sleeps.
#[must_use]
pub fn wants_to_run(process: u32) -> bool {
    // The state follows the name, which stands in brackets.
    of_threads(process, "stat")
        .any(|stat| matches!(stat.rsplit_once(") "), Some((_, rest)) if rest.starts_with('R')))
}

/// One file of each thread.
fn of_threads(process: u32, file: &'static str) -> impl Iterator<Item = String> {
    let threads = fs::read_dir(format!("/proc/{process}/task"));
    let threads = threads.into_iter().flatten().flatten();
    threads.filter_map(move |thread| fs::read_to_string(thread.path().join(file)).ok())
}
