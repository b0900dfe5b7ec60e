//! Why a process does not get real time, in sentences that say how to get it and how to do without.

use std::io;

use thiserror::Error;

use super::{CoreSet, LOCKED_AT_MOST};

/// Why a process does not get what it asks of the machine.
#[derive(Debug, Error)]
pub enum RealtimeError {
    /// The user's rights are too small.
    #[error(
        "real-time priority {priority} is not granted: this user may use {} \
         (allow it with LimitRTPRIO={priority} in the systemd unit, a line `USER - rtprio {priority}` in \
         /etc/security/limits.conf and a new login, `ulimit -r {priority}` as root before the start, or the \
         capability CAP_SYS_NICE; or run without: leave --realtime away, [realtime] priority = 0)",
        at_most(*allowed)
    )]
    PriorityDenied {
        /// The wished priority.
        priority: u8,
        /// The limit of this process.
        allowed: u64,
    },
    /// The rights are sufficient, but the kernel gives real-time threads no time here.
    #[error(
        "real-time priority {priority} is within this user's rights and the kernel refuses it all the same: \
         there is no time for real-time threads where this process runs (see that /proc/sys/kernel/sched_rt_runtime_us \
         is not 0 and, with control groups, that cpu.rt_runtime_us of this group is not 0 or start the robot \
         in the root group; a container needs --cap-add=sys_nice; or leave --realtime away, [realtime] priority = 0)"
    )]
    NoTimeForGroup {
        /// The wished priority.
        priority: u8,
    },
    /// The kernel has another reason.
    #[error(
        "real-time priority {priority} is not granted: {error}; leave --realtime away to run without"
    )]
    Priority {
        /// The wished priority.
        priority: u8,
        /// The kernel's reason.
        error: io::Error,
    },
    /// The user may lock too little memory.
    #[error(
        "memory cannot be locked: a service needs up to {} MiB and this user may lock {} KiB \
         (allow it with LimitMEMLOCK={}M in the systemd unit, a line `USER - memlock {}` in /etc/security/limits.conf \
         and a new login, `ulimit -l {}` as root before the start, or the capability CAP_IPC_LOCK; or run without: \
         leave --lock-memory away, [realtime] lock_memory = false)",
        LOCKED_AT_MOST >> 20,
        allowed >> 10,
        LOCKED_AT_MOST >> 20,
        LOCKED_AT_MOST >> 10,
        LOCKED_AT_MOST >> 10
    )]
    LockDenied {
        /// The limit of this process in bytes.
        allowed: u64,
    },
    /// The memory is not there, or the kernel has another reason.
    #[error(
        "memory cannot be locked: {0}; free some, or leave --lock-memory away ([realtime] lock_memory = false)"
    )]
    Lock(io::Error),
    /// The machine does not have this core.
    #[error(
        "there is no core {core}: this machine has the cores {existing}; choose others with --core or [realtime.cores], \
         or leave the choice away"
    )]
    NoSuchCore {
        /// The wished core.
        core: usize,
        /// The machine's cores.
        existing: CoreSet,
    },
    /// A control group forbids this core.
    #[error(
        "core {core} is withheld from this process, which may use the cores {allowed}: choose among them with --core or \
         [realtime.cores], or give it core {core} (AllowedCPUs= in the systemd unit, --cpuset-cpus of a container, \
         cpuset.cpus of its control group)"
    )]
    CoreNotAllowed {
        /// The wished core.
        core: usize,
        /// The allowed cores.
        allowed: CoreSet,
    },
    /// The kernel has another reason.
    #[error(
        "the process cannot be bound to cores: {0}; leave --core and [realtime.cores] away to run without"
    )]
    Pin(io::Error),
    /// Services that never sleep would take all cores.
    #[error(
        "waiting = \"spin\" at a real-time priority keeps {spinners} of the {cores} cores this robot may use busy for good, \
         and nothing else would run there, this shell included: use [bus] waiting = \"adaptive\" or \"block\", \
         or priority 0, or give it more cores"
    )]
    NoCoreLeft {
        /// How many services would spin.
        spinners: usize,
        /// How many cores there are for all.
        cores: usize,
    },
    /// Services that never sleep would keep each other from running.
    #[error(
        "waiting = \"spin\" at a real-time priority needs a core for each service, and those bound to {cores} are more \
         than that: one of them would never run; give each a core of its own in [realtime.cores], \
         or use [bus] waiting = \"adaptive\" or \"block\""
    )]
    SpinnersShare {
        /// The cores they share.
        cores: CoreSet,
    },
    /// The system gives no thread for the trial.
    #[error("no thread can be started: {0}; see `ulimit -u`")]
    Rehearsal(io::Error),
}

/// A limit of priorities, in words.
fn at_most(limit: u64) -> String {
    match limit {
        0 => "none".to_owned(),
        limit => format!("{limit} at most"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_refused_says_how_to_get_it_and_how_to_do_without() {
        for (error, words) in [
            (
                RealtimeError::PriorityDenied {
                    priority: 20,
                    allowed: 0,
                },
                &[
                    "may use none",
                    "LimitRTPRIO=20",
                    "ulimit -r 20",
                    "CAP_SYS_NICE",
                    "priority = 0",
                ][..],
            ),
            (
                RealtimeError::LockDenied { allowed: 8 << 20 },
                &[
                    "8192 KiB",
                    "LimitMEMLOCK=64M",
                    "ulimit -l 65536",
                    "lock_memory = false",
                ][..],
            ),
            (
                RealtimeError::NoTimeForGroup { priority: 20 },
                &["sched_rt_runtime_us", "cpu.rt_runtime_us", "priority = 0"][..],
            ),
        ] {
            let said = error.to_string();
            for word in words {
                assert!(said.contains(word), "`{word}` is missing: {said}");
            }
        }
    }
}
