//! Whether this machine is so busy that a robot's services get a core too late, and who keeps it
//! busy.
//!
//! The kernel tells for which share of the last ten seconds somebody waited for a core
//! (`/proc/pressure/cpu`). Where it does not, the number of processes that want one is compared
//! with the cores.

use std::collections::BTreeMap;
use std::fs;
use std::time::Duration;

/// The share of time, in percent, in which somebody waited, from which on it is too much.
const WAITED: f64 = 60.0;
/// Processes that want a core for each that there is, as the mean of a minute, from which on it is
/// too much: with fewer, short waits are shared out.
const WANT: f64 = 2.0;
/// A clock tick of `/proc/PID/stat` on every Linux that people run.
const TICK: Duration = Duration::from_millis(10);
/// How long processes are watched to find the greediest.
const WATCHED: Duration = Duration::from_millis(200);
/// The share of a core from which on a process is worth naming.
const GREEDY: f64 = 0.1;
/// How many are named.
const NAMED: usize = 3;

/// How busy the machine is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Load {
    /// Processes that want a core, as the mean of a minute.
    wanting: f64,
    cores: usize,
    /// The share of the last ten seconds in which somebody waited for a core, in percent.
    waited: Option<f64>,
}

impl Load {
    /// As it is now; `None` if the kernel does not tell.
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

    /// Whether services of a robot would wait for a core for too long.
    pub fn is_too_much(&self) -> bool {
        let want_too_many = self.wanting > WANT * self.cores as f64;
        match self.waited {
            // Somebody always waits beside one who never rests, and that is no harm.
            Some(waited) => waited > WAITED && self.wanting > self.cores as f64,
            None => want_too_many,
        }
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

/// A sentence for whoever waits in vain: that the machine may be the cause.
pub fn cause() -> Option<String> {
    let load = Load::now().filter(Load::is_too_much)?;
    Some(format!(
        "this machine is overloaded: {}, so everything takes longer; `lager doctor` names the greediest",
        load.said()
    ))
}

/// The processes that take most of the cores, with the share of one that each takes, the greediest
/// first: those that are worth naming.
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

/// What every process has run so far, in ticks, with its name.
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

/// A process's name and what it has run, from its `stat`.
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
