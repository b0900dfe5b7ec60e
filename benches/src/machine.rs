//! The machine: its name and parts, the cores that a scenario uses, and the processes that keep
//! cores from halting.
//!
//! Every scenario binds its processes to cores and reports the machine it ran on, so this code
//! stands apart. It changes nothing for other processes.

use core::fmt;
use std::error::Error;

use lager_rig::process::Main;
use lager_rig::schedule::{pin, schedule, usable_cores};
use lager_rig::{Parent, Process, Refused};
use serde::{Deserialize, Serialize};

use crate::error::BenchError;
use crate::report::Regime;

const SPINNER: &str = "idle spinner";

pub(crate) const PROCESSES: &[(&str, Main)] = &[(SPINNER, keep_from_halting)];

/// What decides about times of this machine. Two measurements can be compared if it is the same.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Machine {
    /// The processor's name.
    pub processor: String,
    /// The number of cores that this process may use.
    pub cores: usize,
    /// The governor of the first core's frequency; empty if there is none.
    pub governor: String,
    /// The kernel's name and release, and how it may be preempted.
    pub kernel: String,
    /// The clock from which the kernel makes its time.
    pub clock_source: String,
}

impl Machine {
    /// This machine.
    #[must_use]
    pub fn here() -> Self {
        let read = |path: &str| std::fs::read_to_string(path).unwrap_or_default();
        let line = |path: &str| read(path).trim().to_owned();
        let kernel = rustix::system::uname();
        Self {
            processor: processor_of(&read("/proc/cpuinfo"))
                .unwrap_or_else(|| std::env::consts::ARCH.to_owned()),
            cores: usable_cores().len(),
            governor: line("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor"),
            kernel: format!(
                "{} {}{}",
                kernel.sysname().to_string_lossy(),
                kernel.release().to_string_lossy(),
                preemption(&kernel.version().to_string_lossy()),
            ),
            clock_source: line("/sys/devices/system/clocksource/clocksource0/current_clocksource"),
        }
    }

    /// The first thing in which another one differs: its name, and both values.
    pub(crate) fn differs(&self, other: &Self) -> Option<(&'static str, String, String)> {
        let fields = |machine: &Self| {
            [
                ("processor", machine.processor.clone()),
                ("cores", machine.cores.to_string()),
                ("governor", machine.governor.clone()),
                ("kernel", machine.kernel.clone()),
                ("clock source", machine.clock_source.clone()),
            ]
        };
        let mut pairs = fields(self).into_iter().zip(fields(other));
        pairs.find_map(|((name, a), (_, b))| (a != b).then_some((name, a, b)))
    }
}

impl fmt::Display for Machine {
    /// In one line.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}, {} cores", self.processor, self.cores)?;
        if !self.governor.is_empty() {
            write!(formatter, ", governor {}", self.governor)?;
        }
        write!(formatter, ", {}, clock {}", self.kernel, self.clock_source)
    }
}

/// How the kernel may be preempted, as its version says: ` PREEMPT_RT`, ` PREEMPT_DYNAMIC`, …
fn preemption(version: &str) -> String {
    let mut words = version.split_whitespace();
    let found = words.find(|word| word.starts_with("PREEMPT"));
    found.map(|word| format!(" {word}")).unwrap_or_default()
}

/// The processor's name in the text of `/proc/cpuinfo`: x86 says `model name`, some ARM boards
/// say `Model` for the whole board.
fn processor_of(cpuinfo: &str) -> Option<String> {
    ["model name", "Model", "Hardware"].iter().find_map(|key| {
        cpuinfo.lines().find_map(|line| {
            let (name, value) = line.split_once(':')?;
            (name.trim() == *key).then(|| value.trim().to_owned())
        })
    })
}

/// The cores of a scenario's two processes: the same one in [`Regime::SameCore`], otherwise one
/// each.
pub(crate) fn cores_for(regime: Regime) -> Result<(usize, usize), BenchError> {
    match (regime, usable_cores().as_slice()) {
        (Regime::SameCore, [.., last]) => Ok((*last, *last)),
        (Regime::SameCore, []) => Err(BenchError::TooFewCores(1, 0)),
        (_, [first, second, ..]) => Ok((*first, *second)),
        (_, few) => Err(BenchError::TooFewCores(2, few.len())),
    }
}

/// The processes that keep the cores from halting while they live; none if `regime` needs none.
pub(crate) fn kept_awake(regime: Regime) -> Result<Vec<Process>, BenchError> {
    let mut cores = usable_cores();
    if regime != Regime::NoHalt {
        cores.clear();
    }
    let started = cores.into_iter().map(|core| {
        let mut spinner = Process::start(SPINNER)?;
        let () = spinner.ask(&core)?;
        Ok(spinner)
    });
    started.collect()
}

/// Runs whenever nothing else needs the core, until it is killed.
///
/// It yields the core all the time. A process that only yields for a moment would otherwise get its
/// core back at the kernel's next tick, 4 ms later at 250 Hz. An adaptive receiver yields every 4
/// us (`lager_wake::Waiter`), and lost its core to this process that long.
fn keep_from_halting(parent: &mut Parent) -> Result<(), Box<dyn Error>> {
    pin(parent.told()?)?;
    schedule(libc::SCHED_IDLE).map_err(Refused::to_make("a process of the lowest priority"))?;
    parent.say(&())?;
    loop {
        core::hint::spin_loop();
        rustix::thread::sched_yield();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_processor_is_found_as_x86_and_as_arm_boards_name_it() {
        let x86 = "processor\t: 0\nmodel name\t: Some CPU @ 3 GHz\nprocessor\t: 1\n";
        assert_eq!(processor_of(x86).as_deref(), Some("Some CPU @ 3 GHz"));
        let arm = "processor\t: 0\nCPU part\t: 0xd08\n\nModel\t\t: Raspberry Pi 4 Model B\n";
        assert_eq!(processor_of(arm).as_deref(), Some("Raspberry Pi 4 Model B"));
        assert_eq!(processor_of(""), None);
    }

    #[test]
    fn a_kernel_says_how_it_may_be_preempted() {
        let version = "#1 SMP PREEMPT_DYNAMIC Debian 6.1.1-1 (2026-01-01)";
        assert_eq!(preemption(version), " PREEMPT_DYNAMIC");
        assert_eq!(preemption("#1 SMP 2026"), "");
        assert!(!Machine::here().clock_source.is_empty());
    }

    #[test]
    fn both_processes_share_a_core_only_where_that_is_asked_for() {
        let (first, second) = cores_for(Regime::SameCore).unwrap();
        assert_eq!(first, second);
        if usable_cores().len() > 1 {
            let (first, second) = cores_for(Regime::Plain).unwrap();
            assert_ne!(first, second);
        }
    }
}
