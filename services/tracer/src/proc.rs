//! What `/proc` says of the robot's processes and of the machine.

use std::collections::BTreeMap;
use std::fs;

use crate::event::Thread;
use crate::frame::Machine;

/// What the threads of some processes have got so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Shares {
    /// Time on a core, in ns.
    pub ran_ns: u64,
    /// Time in which they were ready and had no core, in ns.
    pub waited_ns: u64,
    /// Page faults that waited for a disk.
    pub major_faults: u64,
}

impl Shares {
    /// The shares of these processes so far. What cannot be read counts as 0.
    pub fn of(processes: &[u32]) -> Self {
        let mut shares = Self::default();
        for process in processes {
            for thread in threads(*process) {
                let path = format!("/proc/{process}/task/{thread}/schedstat");
                let text = fs::read_to_string(path).unwrap_or_default();
                let mut numbers = text
                    .split_whitespace()
                    .map(|word| word.parse().unwrap_or(0));
                shares.ran_ns += numbers.next().unwrap_or(0);
                shares.waited_ns += numbers.next().unwrap_or(0);
            }
            let faults = fields(*process).and_then(|fields| fields.get(9)?.parse().ok());
            shares.major_faults += faults.unwrap_or(0);
        }
        shares
    }

    /// What they got after `earlier`.
    pub fn since(&self, earlier: &Self) -> Self {
        Self {
            ran_ns: self.ran_ns.saturating_sub(earlier.ran_ns),
            waited_ns: self.waited_ns.saturating_sub(earlier.waited_ns),
            major_faults: self.major_faults.saturating_sub(earlier.major_faults),
        }
    }
}

/// The threads of a process.
pub fn threads(process: u32) -> Vec<Thread> {
    let folder = fs::read_dir(format!("/proc/{process}/task"));
    let names = folder.into_iter().flatten().flatten();
    names
        .filter_map(|thread| thread.file_name().to_str()?.parse().ok())
        .collect()
}

/// The words of `/proc/N/stat` from its third on, which is behind the name.
pub(crate) fn fields(process: u32) -> Option<Vec<String>> {
    let stat = fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
    let (_, behind) = stat.rsplit_once(')')?;
    Some(behind.split_whitespace().map(str::to_owned).collect())
}

/// Time that a hypervisor has given to others, of all cores together, in ms; in steps of 10 ms.
pub fn stolen_ms() -> u64 {
    let stat = fs::read_to_string("/proc/stat").unwrap_or_default();
    let all = stat.lines().next().unwrap_or_default();
    let ticks: u64 = all
        .split_whitespace()
        .nth(8)
        .and_then(|word| word.parse().ok())
        .unwrap_or(0);
    ticks * 1000 / rustix::param::clock_ticks_per_second().max(1)
}

/// What the kernel says of this machine's idle states.
pub fn machine() -> Machine {
    let mut idle_ns = BTreeMap::new();
    for state in 0.. {
        let path = format!("/sys/devices/system/cpu/cpu0/cpuidle/state{state}/latency");
        let Ok(text) = fs::read_to_string(path) else {
            break;
        };
        let us: Option<u64> = text.trim().parse().ok();
        idle_ns.extend(us.map(|us| (state, us * 1000)));
    }
    Machine {
        idle_ns,
        ..Machine::default()
    }
}
