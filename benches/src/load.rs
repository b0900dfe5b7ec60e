//! `--load`: other work on the machine during a measurement, and the machine's own floor beside it.
//!
//! ```text
//!   lager-bench ──line──> keeper ──> stress-ng ──> its stressors        the load
//!                            └─────> cyclictest, cyclictest in real time   the floor
//! ```
//!
//! `stress-ng` makes the load. `cyclictest` sleeps on the second core until a time and notes how late it
//! woke: no software on this machine can be woken earlier. Both are programs of the system.
//!
//! The keeper is a process that only waits for the end of its line. However the measurement ends, by
//! Ctrl-C, `kill`, `kill -9` or an error, the kernel closes the line. Then the keeper kills all that it
//! has started, and all that these have started: whoever loses its parent becomes its child.

use std::error::Error;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use lager_rig::proc::children;
use lager_rig::process::Main;
use lager_rig::schedule::usable_cores;
use lager_rig::{Parent, Process};
use rustix::process::{
    Pid, Signal, WaitOptions, getpid, kill_process, set_child_subreaper,
    set_parent_process_death_signal, wait,
};
use serde::{Deserialize, Serialize};

use crate::error::BenchError;
use crate::path::may_have_real_time;
use crate::report::{Load, Mode, Ratio, Regime, Row};
use crate::stats::Distribution;

const KEEPER: &str = "keeper of the load";

pub(crate) const PROCESSES: &[(&str, Main)] = &[(KEEPER, keep)];

const STRESS: &str = "stress-ng";
const CYCLIC: &str = "cyclictest";
/// The label of the second one, in real time.
const CYCLIC_FIFO: &str = "cyclictest/fifo";

/// As the services of `path@observed`.
const PRIORITY: &str = "40";

/// How long the programs may take to begin.
const BEGIN: Duration = Duration::from_secs(10);

/// What `stress-ng` is told.
fn arguments(load: Load, cores: usize) -> Vec<String> {
    let words = match load {
        Load::Cpu => format!("--cpu {cores}"),
        Load::Memory => format!("--stream {cores} --vm 1 --vm-bytes 64M"),
        Load::Io => "--hdd 2 --hdd-bytes 64M --hdd-opts fsync".to_owned(),
        Load::Irq => "--timer 1 --timer-freq 20000".to_owned(),
    };
    words.split(' ').map(str::to_owned).collect()
}

/// The message to the keeper.
#[derive(Serialize, Deserialize)]
struct Setup {
    load: Load,
    cores: usize,
    /// The core whose floor is measured.
    core: usize,
    /// Whether this user may have real time.
    fifo: bool,
    /// For the files of `stress-ng`.
    folder: PathBuf,
}

/// The machine under load, until this is dropped.
pub(crate) struct Loaded {
    load: Load,
    regime: Regime,
    keeper: Option<Process>,
}

impl Loaded {
    /// Loads the machine; the floor is that of `core`.
    pub(crate) fn begin(load: Load, core: usize, regime: Regime) -> Result<Self, BenchError> {
        for (program, package) in [(STRESS, STRESS), (CYCLIC, "rt-tests")] {
            if !is_installed(program) {
                return Err(BenchError::NoProgram(program, package));
            }
        }
        let own = format!("{}-{}-load", crate::FAMILY, std::process::id());
        let setup = Setup {
            load,
            cores: usable_cores().len(),
            core,
            fifo: may_have_real_time().is_ok(),
            folder: std::env::temp_dir().join(own),
        };
        let mut loaded = Self {
            load,
            regime,
            keeper: Some(Process::start(KEEPER)?),
        };
        if let Some(keeper) = &mut loaded.keeper {
            keeper.tell(&setup);
            let () = keeper.hear_within(2 * BEGIN)?;
        }
        Ok(loaded)
    }

    /// Ends the load. Names it in each row, and adds the floor and the ratios to it.
    pub(crate) fn end(mut self, rows: &mut Vec<Row>) -> Result<(), BenchError> {
        let Some(mut keeper) = self.keeper.take() else {
            return Ok(());
        };
        keeper.tell(&());
        let floors = keeper.hear_within::<Vec<Distribution>>(2 * BEGIN);
        self.keeper = Some(keeper);
        let load = self.load;
        let floor = |(label, times): (&str, Distribution)| {
            let what = format!("floor under {load}");
            Row::new(&what, label, Mode::Block, self.regime, times.quantiles())
        };
        let labels = [CYCLIC, CYCLIC_FIFO].into_iter();
        let floors: Vec<Row> = labels.zip(floors?).map(floor).collect();
        for row in rows.iter_mut() {
            let own = if row.what.starts_with("path@") { 1 } else { 0 };
            if row.name == "lager"
                && row.mode != Mode::Spin
                && let Some(floor) = floors.get(own)
            {
                row.ratios.extend(ratio(row, floor));
            }
            row.what = format!("{} under {load}", row.what);
        }
        rows.extend(floors);
        Ok(())
    }
}

impl Drop for Loaded {
    fn drop(&mut self) {
        if let Some(keeper) = self.keeper.take() {
            // Dropped, it would be killed before it has cleared up.
            keeper.end();
        }
    }
}

/// A row's times over the floor's, of all runs together.
fn ratio(row: &Row, floor: &Row) -> Option<Ratio> {
    let times = row.service.unwrap_or(row.times);
    let over = |own: Option<u64>, floor: Option<u64>| {
        Some(own? as f64 / floor.filter(|ns| *ns > 0)? as f64)
    };
    let p50 = over(times.p50_ns, floor.times.p50_ns)?;
    let p99 = over(times.p99_ns, floor.times.p99_ns);
    Some(Ratio {
        to: floor.label(),
        p50,
        p99,
        runs: vec![(p50, p99)],
    })
}

fn is_installed(program: &str) -> bool {
    let folders = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&folders).any(|folder| folder.join(program).is_file())
}

/// Keeps the load until the line ends; at a message, ends the floor and answers with its times.
fn keep(parent: &mut Parent) -> Result<(), Box<dyn Error>> {
    let setup: Setup = parent.told()?;
    // It outlives its parent, to clear up.
    set_parent_process_death_signal(None)?;
    set_child_subreaper(Some(getpid()))?;
    let cleared = Cleared(&setup.folder);
    std::fs::create_dir_all(cleared.0)?;
    let mut stress = Command::new(STRESS)
        .args(["--quiet", "--timeout", "0", "--temp-path"])
        .arg(cleared.0)
        .args(arguments(setup.load, setup.cores))
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .spawn()?;
    let mut floors = vec![cyclictest(setup.core, &["--policy=other"])?];
    if setup.fifo {
        let urgent = ["--policy=fifo", "--priority", PRIORITY];
        floors.push(cyclictest(setup.core, &urgent)?);
    }
    let begun = Instant::now();
    while children(stress.id()).is_empty() {
        if stress.try_wait()?.is_some() || begun.elapsed() > BEGIN {
            return Err("`stress-ng` does no work here; its own message stands above".into());
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    parent.say(&())?;
    while let Some(()) = parent.hear::<()>()? {
        if stress.try_wait()?.is_some() {
            return Err(
                "`stress-ng` ended by itself, so the load was not there all the time".into(),
            );
        }
        let times = floors.drain(..).map(times_of);
        parent.say(&times.collect::<Result<Vec<_>, _>>()?)?;
    }
    Ok(())
}

/// Wakes a thousand times a second on that core. It leaves the idle states as they are.
fn cyclictest(core: usize, how: &[&str]) -> std::io::Result<Child> {
    Command::new(CYCLIC)
        .args([
            "--quiet",
            "--threads=1",
            "--interval=1000",
            "--histogram=100000",
        ])
        .arg("--default-system")
        .arg(format!("--affinity={core}"))
        .args(how)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
}

/// Ends one, and reads its times.
fn times_of(mut child: Child) -> Result<Distribution, Box<dyn Error>> {
    kill_process(Pid::from_child(&child), Signal::INT)?;
    let mut said = String::new();
    if let Some(out) = &mut child.stdout {
        out.read_to_string(&mut said)?;
    }
    child.wait()?;
    let times = read_histogram(&said);
    match times.quantiles().n {
        0 => Err("`cyclictest` has measured nothing here; try it by itself".into()),
        _ => Ok(times),
    }
}

/// The times in what `cyclictest` prints: a line for each microsecond with how often it was that late,
/// and how many were later than all lines. Of these only the longest is known.
fn read_histogram(said: &str) -> Distribution {
    const NS: u64 = 1_000;
    let number = |text: &str| text.trim().parse::<u64>().ok();
    let after = |title: &str| {
        said.lines()
            .find_map(|line| number(line.strip_prefix(title)?))
    };
    let longest = after("# Max Latencies:").unwrap_or(0);
    let mut times = Distribution::default();
    for line in said.lines() {
        let pair = line.split_once(' ').filter(|_| !line.starts_with('#'));
        let pair = pair.and_then(|(us, many)| Some((number(us)?, number(many)?)));
        if let Some((us, many)) = pair {
            times.extend((0..many).map(|_| us * NS));
        }
    }
    let later = after("# Histogram Overflows:").unwrap_or(0);
    times.extend((0..later).map(|_| longest * NS));
    times
}

/// Kills every process below this one when it is dropped, and removes the folder.
struct Cleared<'a>(&'a Path);

impl Drop for Cleared<'_> {
    fn drop(&mut self) {
        loop {
            let below = children(std::process::id());
            if below.is_empty() {
                break;
            }
            below.into_iter().for_each(kill_with_children);
            while let Ok(Some(_)) = wait(WaitOptions::NOHANG) {}
            std::thread::sleep(Duration::from_millis(1));
        }
        let _ = std::fs::remove_dir_all(self.0);
    }
}

/// A parent first, so that it starts no other.
fn kill_with_children(process: u32) {
    let below = children(process);
    if let Some(pid) = Pid::from_raw(process.cast_signed()) {
        let _ = kill_process(pid, Signal::KILL);
    }
    below.into_iter().for_each(kill_with_children);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_histogram_of_cyclictest_is_read_with_what_was_later() {
        let said = "# /dev/cpu_dma_latency set to 0us\n# Histogram\n000060 000030\n000061 000005\n\
                    000062 000000\n# Total: 000000035\n# Min Latencies: 00060\n# Max Latencies: 03941\n\
                    # Histogram Overflows: 00002\n# Thread 0: 00001\n";
        let times = read_histogram(said).quantiles();
        assert_eq!((times.n, times.max_ns), (37, 3_941_000));
        assert!(
            times.p50_ns.is_some_and(|ns| ns.abs_diff(60_000) < 100),
            "{times:?}"
        );
        assert_eq!(read_histogram("").quantiles().n, 0);
    }

    #[test]
    fn a_ratio_to_the_floor_is_of_what_the_software_takes() {
        let times = |p50: u64| crate::stats::Quantiles {
            p50_ns: Some(p50),
            ..Default::default()
        };
        let mut row = Row::new("path", "lager", Mode::Block, Regime::Plain, times(900));
        row.service = Some(times(300));
        let floor = Row::new("floor", CYCLIC_FIFO, Mode::Block, Regime::Plain, times(100));
        let found = ratio(&row, &floor).expect("both have a median");
        assert_eq!((&*found.to, found.p50, found.p99), (CYCLIC_FIFO, 3.0, None));
    }
}
