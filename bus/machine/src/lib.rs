//! What decides about times besides the code: the machine, and what it did meanwhile. A report of
//! `lager bench` names it, because a figure without it cannot be compared with any other, and `lager
//! doctor` tells the same of a machine before anything is measured. It only reads.

use core::fmt;

use rustix::thread::{CpuSet, sched_getaffinity};
use serde::{Deserialize, Serialize};

/// The cores this thread may use, in ascending order.
#[must_use]
pub fn usable_cores() -> Vec<usize> {
    let Ok(set) = sched_getaffinity(None) else {
        return Vec::new();
    };
    (0..CpuSet::MAX_CPU)
        .filter(|core| set.is_set(*core))
        .collect()
}

/// The cores of the two processes of a measurement.
pub type Cores = (usize, usize);

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
        let kernel = rustix::system::uname();
        Self {
            processor: processor_of(&line("/proc/cpuinfo"))
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
    #[must_use]
    pub fn differs(&self, other: &Self) -> Option<(&'static str, String, String)> {
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

/// What the machine was set to, and what else it did while it measured.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Conditions {
    /// The cores of the two processes.
    pub cores: Option<Cores>,
    /// Whether these two are threads of one physical core, which share its units.
    pub siblings: bool,
    /// The states in which an idle core may rest, the deepest last; empty if it only halts.
    pub idle_states: Vec<String>,
    /// The cores that the kernel's scheduler leaves alone; empty if there are none.
    pub isolated: String,
    /// The cores that may serve interrupts, as a mask.
    pub interrupts: String,
    /// The load average over a minute before the measurement.
    pub load: String,
    /// The time that other virtual machines took of all cores, in percent.
    pub stolen_percent: f64,
    /// The processor time of programs that were not part of the measurement, in percent of a core.
    pub others_percent: f64,
}

impl fmt::Display for Conditions {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some((first, second)) = self.cores {
            write!(formatter, "cores {first} and {second}")?;
            if self.siblings {
                write!(formatter, " (same physical core)")?;
            }
            write!(formatter, ", ")?;
        }
        match &*self.idle_states {
            [] => write!(formatter, "idle cores halt")?,
            states => write!(formatter, "idle states {}", states.join(" "))?,
        }
        if !self.isolated.is_empty() {
            write!(formatter, ", isolated {}", self.isolated)?;
        }
        write!(
            formatter,
            ", interrupts on mask {}\n{}",
            self.interrupts,
            self.meanwhile()
        )
    }
}

impl Conditions {
    /// What else the machine did.
    #[must_use]
    pub fn meanwhile(&self) -> String {
        format!(
            "load before {}; meanwhile {:.1} % stolen, others {:.0} % of a core",
            self.load, self.stolen_percent, self.others_percent
        )
    }

    /// What it was set to.
    #[must_use]
    pub fn settings(&self) -> String {
        let told = self.to_string();
        told.lines().next().unwrap_or_default().to_owned()
    }
}

/// Takes note of what the machine does from its beginning on.
#[derive(Debug)]
pub struct Observed {
    conditions: Conditions,
    before: Ticks,
}

impl Observed {
    /// Begins, for a measurement on these cores.
    #[must_use]
    pub fn begin(cores: Option<Cores>) -> Self {
        let states = |folder: &str| {
            let names = (0..16).map_while(|state| {
                let path = format!("{folder}/state{state}/name");
                let name = std::fs::read_to_string(path).ok()?;
                Some(name.trim().to_owned())
            });
            names.collect()
        };
        let load = line("/proc/loadavg");
        Self {
            conditions: Conditions {
                cores,
                siblings: cores
                    .is_some_and(|(first, second)| first != second && are_siblings(first, second)),
                idle_states: states("/sys/devices/system/cpu/cpu0/cpuidle"),
                isolated: line("/sys/devices/system/cpu/isolated"),
                interrupts: line("/proc/irq/default_smp_affinity"),
                load: load.split(' ').next().unwrap_or_default().to_owned(),
                ..Conditions::default()
            },
            before: Ticks::now(),
        }
    }

    /// What it has seen until now.
    #[must_use]
    pub fn end(self) -> Conditions {
        let (before, now) = (self.before, Ticks::now());
        let all = now.all.saturating_sub(before.all).max(1) as f64;
        let cores = usable_cores().len().max(1) as f64;
        let own = now.own.saturating_sub(before.own);
        let others = now.busy.saturating_sub(before.busy).saturating_sub(own);
        Conditions {
            stolen_percent: 100.0 * now.stolen.saturating_sub(before.stolen) as f64 / all,
            others_percent: 100.0 * cores * others as f64 / all,
            ..self.conditions
        }
    }
}

/// Whether two cores are threads of one physical core.
fn are_siblings(first: usize, second: usize) -> bool {
    let path = format!("/sys/devices/system/cpu/cpu{first}/topology/thread_siblings_list");
    in_list(&line(&path), second)
}

/// Whether a list of the kernel, such as `0-2,7`, has that number.
fn in_list(list: &str, number: usize) -> bool {
    list.split(',').any(|part| {
        let (from, to) = part.split_once('-').unwrap_or((part, part));
        let ends = from.parse().ok().zip(to.parse().ok());
        ends.is_some_and(|(from, to): (usize, usize)| (from..=to).contains(&number))
    })
}

/// Processor time so far in the kernel's ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Ticks {
    /// Of all cores, whatever they did.
    all: u64,
    /// In which they ran something.
    busy: u64,
    /// In which another virtual machine had them.
    stolen: u64,
    /// Of this process and its children that have ended.
    own: u64,
}

impl Ticks {
    fn now() -> Self {
        Self::of(&line("/proc/stat"), &line("/proc/self/stat"))
    }

    /// Reads the first line of `/proc/stat`, and `/proc/self/stat`.
    fn of(machine: &str, process: &str) -> Self {
        let numbers = |text: &str| -> Vec<u64> {
            text.split_whitespace()
                .map(|word| word.parse().unwrap_or(0))
                .collect()
        };
        let first = machine.lines().next().unwrap_or_default();
        // user nice system idle iowait irq softirq steal
        let cores = numbers(first.strip_prefix("cpu").unwrap_or_default());
        let at = |place: usize| cores.get(place).copied().unwrap_or(0);
        // The name may hold spaces; it ends at the last parenthesis, and its state follows.
        let after = process.rsplit_once(')').map_or("", |(_, after)| after);
        let own = numbers(after);
        Self {
            all: (0..8).map(at).sum(),
            busy: [0, 1, 2, 5, 6].map(at).iter().sum(),
            stolen: at(7),
            // utime stime cutime cstime
            own: own.get(11..15).unwrap_or_default().iter().sum(),
        }
    }
}

fn line(path: &str) -> String {
    std::fs::read_to_string(path)
        .unwrap_or_default()
        .trim()
        .to_owned()
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
    fn what_others_did_is_told_from_what_was_measured() {
        let ticks = Ticks::of(
            "cpu  100 10 20 1000 5 3 2 7 0 0\ncpu0 1 1 1 1 1 1 1 1 0 0",
            "12 (a (b) c) R 1 1 1 0 -1 4194304 1 2 3 4 30 9 6 5 20 0 1",
        );
        let expected = Ticks {
            all: 1147,
            busy: 135,
            stolen: 7,
            own: 50,
        };
        assert_eq!(ticks, expected);
        let here = Observed::begin(None).end();
        assert!(
            here.stolen_percent >= 0.0 && !here.load.is_empty(),
            "{here:?}"
        );
    }

    #[test]
    fn two_threads_of_one_core_are_siblings() {
        for (list, number, is_in) in [
            ("0-1", 1, true),
            ("0,2", 2, true),
            ("0", 1, false),
            ("", 0, false),
        ] {
            assert_eq!(in_list(list, number), is_in, "{number} in {list}");
        }
    }
}
