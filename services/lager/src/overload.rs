//! Finds out whether this machine is so busy that a robot's services run too late, and which
//! programs keep it busy.
//!
//! The kernel says for which share of the last ten seconds some process waited for a core
//! (`/proc/pressure/cpu`). If it does not say so, the number of processes that want a core is
//! compared with the number of cores.

use std::collections::BTreeMap;
use std::fs;
use std::time::Duration;

/// The machine is overloaded if processes waited for more than this share of the time, in percent.
const WAITED: f64 = 60.0;
/// The machine is overloaded if more processes than this want each core, on average over a minute.
/// With fewer, all wait a little.
const WANT: f64 = 2.0;
/// Clock ticks a second in `/proc/PID/stat`, on every usual Linux.
const TICK: Duration = Duration::from_millis(10);
/// How long to watch processes to find the busiest.
const WATCHED: Duration = Duration::from_millis(200);
/// Processes that take less than this share of a core are not named.
const GREEDY: f64 = 0.1;
/// How many processes are named.
const NAMED: usize = 3;

/// How busy the machine is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Load {
    /// How many processes want a core, on average over a minute.
    wanting: f64,
    cores: usize,
    /// The share of the last ten seconds in which some process waited for a core, in percent.
    waited: Option<f64>,
}

impl Load {
    /// The load now; `None` if the kernel does not say.
    pub fn now() -> Option<Self> {
        let pressure = fs::read_to_string("/proc/pressure/cpu").ok();
        let load = fs::read_to_string("/proc/loadavg").ok()?;
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        Self::read(&load, pressure.as_deref(), cores)
    }

    fn read(load: &str, pressure: Option<&str>, cores: usize) -> Option<Self> {
        let wanting = load.split(' ').next()?.parse().ok()?;
        let some = pressure.and_then(|text| text.lines().find(|line| line.starts_with("some")));
        let waited = some.and_then(|line| {
            let mut fields = line.split(' ');
            fields.find_map(|field| field.strip_prefix("avg10=")?.parse().ok())
        });
        Some(Self {
            wanting,
            cores,
            waited,
        })
    }

    /// Whether a robot's services would wait too long for a core.
    pub fn is_too_much(&self) -> bool {
        let want_too_many = self.wanting > WANT * self.cores as f64;
        match self.waited {
            // Beside one process that never rests another always waits, and that is harmless.
            Some(waited) => waited > WAITED && self.wanting > self.cores as f64,
            None => want_too_many,
        }
    }

    /// How many processes want a core, on average over a minute.
    pub const fn wanting(&self) -> f64 {
        self.wanting
    }

    /// How many processes want a core, in percent of the cores.
    pub fn percent(&self) -> u32 {
        (self.wanting * 100.0 / self.cores as f64).round() as u32
    }

    /// How many cores there are.
    pub const fn cores(&self) -> usize {
        self.cores
    }

    /// How busy it is, in words.
    pub fn said(&self) -> String {
        let cores = match self.cores {
            1 => "1 core".to_owned(),
            cores => format!("{cores} cores"),
        };
        format!("{:.1} processes want {cores}", self.wanting)
    }
}

/// A sentence that says that the machine may be the cause, for a user who waits in vain.
pub fn cause() -> Option<String> {
    let load = Load::now().filter(Load::is_too_much)?;
    Some(format!(
        "this machine is overloaded: {}, so everything takes longer; `lager doctor` names the busiest programs",
        load.said()
    ))
}

/// The busiest processes, with the share of a core that each takes, the busiest first.
pub fn greediest() -> Vec<String> {
    let before = times();
    std::thread::sleep(WATCHED);
    let mut taken: Vec<(f64, u32, String)> = times()
        .into_iter()
        .filter_map(|(pid, (name, ticks))| {
            let before = before.get(&pid)?.1;
            let ran = TICK * u32::try_from(ticks.saturating_sub(before)).ok()?;
            let share = ran.div_duration_f64(WATCHED);
            (share >= GREEDY).then_some((share, pid, name))
        })
        .collect();
    taken.sort_by(|a, b| b.0.total_cmp(&a.0));
    let said = |(share, pid, name): (f64, u32, String)| {
        format!(
            "process {pid} ({name}) takes {:.0} % of a core",
            share * 100.0
        )
    };
    taken.into_iter().take(NAMED).map(said).collect()
}

/// How long every process has run so far, in ticks, with its name.
fn times() -> BTreeMap<u32, (String, u64)> {
    let processes = fs::read_dir("/proc").into_iter().flatten().flatten();
    processes
        .filter_map(|process| {
            let pid = process.file_name().to_str()?.parse().ok()?;
            let stat = fs::read_to_string(process.path().join("stat")).ok()?;
            Some((pid, ticks(&stat)?))
        })
        .collect()
}

/// A process's name and how long it has run, from its `stat`.
fn ticks(stat: &str) -> Option<(String, u64)> {
    // The name is in parentheses and may contain anything.
    let (before, rest) = stat.rsplit_once(") ")?;
    let (_, name) = before.split_once('(')?;
    // The times in user code and in the kernel stand eleven and twelve behind the state.
    let mut fields = rest.split(' ').skip(11);
    let mut next = || fields.next()?.parse::<u64>().ok();
    Some((name.to_owned(), next()? + next()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_machine_is_overloaded_when_processes_wait_for_most_of_the_time() {
        let some = |avg10: &str| {
            format!("some avg10={avg10} avg60=1.00 avg300=2.00 total=3\nfull avg10=0.00\n")
        };
        let is_too_much = |load: &str, pressure: Option<&str>, cores| {
            let load = Load::read(load, pressure, cores).expect("a load");
            load.is_too_much()
        };
        for (load, pressure, cores, too_much) in [
            ("25.1 9 4 30/400 7", Some(some("99.00")), 2, true),
            ("3.5 2 1 4/300 7", Some(some("85.10")), 2, true),
            ("1.9 2 1 4/300 7", Some(some("75.10")), 2, false),
            ("0.2 0.1 0 1/200 7", Some(some("1.22")), 2, false),
            // A kernel that does not tell who waits.
            ("5.0 2 1 4/300 7", None, 2, true),
            ("3.9 2 1 4/300 7", None, 2, false),
            ("25.1 9 4 30/400 7", Some("what".to_owned()), 16, false),
        ] {
            let told = is_too_much(load, pressure.as_deref(), cores);
            assert_eq!(told, too_much, "{load} {pressure:?} {cores}");
        }
        assert_eq!(Load::read("", None, 2), None);
        let load = Load::read("25.14 9 4", None, 2).expect("a load");
        assert_eq!((load.percent(), load.cores()), (1_257, 2));
        assert_eq!(load.said(), "25.1 processes want 2 cores");
    }

    #[test]
    fn what_a_process_has_run_is_read_whatever_its_name() {
        let stat = "7 (a) b (c) R 1 7 7 0 -1 4194304 1 0 0 0 30 12 0 0 20 0 1";
        assert_eq!(ticks(stat), Some(("a) b (c".to_owned(), 42)));
        assert_eq!(ticks("7 (a) R 1"), None);
        assert!(times().contains_key(&std::process::id()));
    }
}
