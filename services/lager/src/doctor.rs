//! `lager doctor`: says what is wrong with this machine, and how to mend it.
//!
//! Each check looks at one thing and returns a finding. Only `--fix` changes anything: it removes
//! what dead processes left on the bus, and restarts a board that answers and does not work. This process opens nothing of the bus that could block it.

mod boards;
mod realtime;
pub mod soon;

use std::fs;
use std::os::unix::fs::{FileTypeExt, MetadataExt};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use anyhow::Result;
use lager_bridge::serial::{find, holders};
use lager_home::Clock;
use lager_machine::{Conditions, Machine, Observed};
use lager_ports::NodeState;
use lager_supervisor::console;
use rustix::process::{Resource, getrlimit};

use crate::config::{Body, Config};
use crate::overload::{self, Load};
use crate::{diagnose, exit};

/// Shared memory that a robot needs, in MiB: 1 when it runs alone, more with every observer.
const SHARED_MEMORY_MIB: u64 = 16;
/// Open files that one process of the bus may need: each port and connection holds some.
const OPEN_FILES: u64 = 4096;

/// From this share of all cores on, other virtual machines make measured latencies worthless.
const STOLEN_PERCENT: f64 = 1.0;

/// The longest first clause that stands in a line of its own.
const LONGEST_CLAUSE: usize = 76;

/// The result of a check.
enum Finding {
    Good(String),
    /// It works, but not as well as it could.
    Hint(String),
    /// The robot will not run like this.
    Bad(String),
}

use Finding::{Bad, Good, Hint};

/// One check: its subject and its result.
type Check = (&'static str, Finding);

/// How long it may take to look at the bus, and to mend it.
const LOOK: Duration = Duration::from_millis(2_500);
const MEND: Duration = Duration::from_secs(60);
/// The same on an overloaded machine.
const BUSY_LOOK: Duration = Duration::from_secs(20);

/// Runs all checks; fails when a result is bad.
pub fn run(config: &Config, fix: bool, as_json: bool) -> Result<ExitCode> {
    let observed = Observed::begin(None);
    // First what every robot needs, then what this robot's body needs, then what makes it faster.
    let mut checks = vec![
        ("bus", bus_in_time(config, fix)),
        ("shared memory", shared_memory()),
        ("open files", open_files()),
        ("load", load()),
        ("robot", robot(config)),
        ("serial rights", serial(config)),
        ("original boards", original_boards(config)),
        ("emulated boards", emulated(config)),
        ("session clean-up", remove_ipc()),
        ("versions", versions()),
        ("calendar", calendar()),
    ];
    checks.extend(boards::findings(config, fix));
    checks.extend(realtime::findings(config));
    let conditions = observed.end();
    checks.push(("machine", machine(&Machine::here(), &conditions)));
    checks.push(("meanwhile", meanwhile(&conditions)));
    // Bad results come first.
    checks.sort_by_key(|(_, finding)| !matches!(finding, Bad(_)));
    let told = match as_json {
        true => json(&checks),
        false => text(&checks),
    };
    console::print(told.trim_end())?;
    Ok(match count(&checks, "BAD") {
        0 => ExitCode::SUCCESS,
        _ => exit::FAILED,
    })
}

impl Finding {
    /// This finding about a board, which was restarted before if `was_restarted`.
    fn after(self, was_restarted: bool) -> Self {
        let told = |said| match was_restarted {
            true => format!("it was restarted; {said}"),
            false => said,
        };
        match self {
            Good(said) => Good(told(said)),
            Hint(said) => Hint(told(said)),
            Bad(said) => Bad(told(said)),
        }
    }

    fn mark(&self) -> &'static str {
        match self {
            Good(_) => "ok",
            Hint(_) => "hint",
            Bad(_) => "BAD",
        }
    }

    fn said(&self) -> &str {
        let (Good(said) | Hint(said) | Bad(said)) = self;
        said
    }
}

fn count(checks: &[Check], mark: &str) -> usize {
    let of_that_mark = checks.iter().filter(|(_, finding)| finding.mark() == mark);
    of_that_mark.count()
}

/// What decides about times of this machine, in the words of a report of `lager bench`.
fn machine(machine: &Machine, conditions: &Conditions) -> Finding {
    Good(format!("{machine}; {}", conditions.settings()))
}

/// What else it did while the checks ran. Other virtual machines take time that nobody here sees.
fn meanwhile(conditions: &Conditions) -> Finding {
    let told = conditions.meanwhile();
    match conditions.stolen_percent {
        STOLEN_PERCENT.. => Hint(format!(
            "{told}; other virtual machines take the cores, so no latency measured now is this machine's"
        )),
        _ => Good(told),
    }
}

/// Whether the dates of recordings can be right. Nothing else uses the calendar.
fn calendar() -> Finding {
    let now_ns = Clock::monotonic_ns().saturating_add_signed(Clock::unix_offset_ns());
    match lager_recorder::doubt(now_ns) {
        Some(doubt) => Hint(format!(
            "{doubt}; set it with `date -s`, or give the machine a network or a clock chip"
        )),
        None => Good(format!("it says {} UTC", lager_recorder::utc(now_ns))),
    }
}

/// A line for each check, then what to do about the results that are not good, then a summary.
fn text(checks: &[Check]) -> String {
    let mut lines = Vec::new();
    let mut advice = Vec::new();
    for (what, finding) in checks {
        // The first clause is the result, the others say why and what to do.
        let (stands, rest) = finding
            .said()
            .split_once("; ")
            .unwrap_or((finding.said(), ""));
        let long = stands.chars().count() > LONGEST_CLAUSE;
        let mark = finding.mark();
        match finding {
            Good(_) => lines.push(format!("{mark:4}  {what:16}  {}", finding.said())),
            _ if long => {
                let clause: String = stands.chars().take(LONGEST_CLAUSE).collect();
                let cut = clause.rfind(' ').unwrap_or(clause.len());
                lines.push(format!("{mark:4}  {what:16}  {} ...", &clause[..cut]));
                advice.push(format!("{what}: {}", finding.said()));
            }
            _ => {
                lines.push(format!("{mark:4}  {what:16}  {stands}"));
                if !rest.is_empty() {
                    advice.push(format!("{what}: {rest}"));
                }
            }
        }
    }
    if !advice.is_empty() {
        lines.push("\nWhat to do:".into());
        lines.extend(advice.iter().map(|advice| format!("  - {advice}")));
    }
    let hints = match count(checks, "hint") {
        0 => String::new(),
        1 => "; one hint".into(),
        hints => format!("; {hints} hints"),
    };
    lines.push(match count(checks, "BAD") {
        0 => format!("\nA robot can run here{hints}."),
        1 => format!("\nOne thing keeps a robot from running here{hints}."),
        bad => format!("\n{bad} things keep a robot from running here{hints}."),
    });
    lines.join("\n")
}

/// The same for programs, in one line.
fn json(checks: &[Check]) -> String {
    let findings: Vec<_> = checks
        .iter()
        .map(|(what, finding)| {
            let state = finding.mark().to_lowercase();
            serde_json::json!({"check": what, "state": state, "text": finding.said()})
        })
        .collect();
    let is_well = count(checks, "BAD") == 0;
    serde_json::json!({"ok": is_well, "findings": findings}).to_string()
}

/// Looks at the bus in a thread of its own. If the thread hangs, that is the result.
fn bus_in_time(config: &Config, fix: bool) -> Finding {
    let (send, found) = mpsc::channel();
    let looked_at = config.clone();
    let look = move || {
        let _ = send.send(bus(&looked_at, fix));
    };
    if let Err(error) = std::thread::Builder::new().spawn(look) {
        return Bad(format!(
            "cannot start a thread ({error}); see `ulimit -u` and `ulimit -v`"
        ));
    }
    let patience = match (fix, overload::cause()) {
        (true, _) => MEND,
        (false, None) => LOOK,
        (false, Some(_)) => BUSY_LOOK,
    };
    found
        .recv_timeout(patience)
        .unwrap_or_else(|_| {
            let mut causes = diagnose::causes(config);
            causes.extend(overload::cause());
            let why = match causes.is_empty() {
                true => "a process that was killed while it made a shared file leaves such a bus, and `lager doctor --fix` mends it".into(),
                false => causes.join("; "),
            };
            Bad(format!("it does not answer; {why}"))
        })
}

fn versions() -> Finding {
    let kernel = rustix::system::uname();
    Good(format!(
        "lager {}, {}, Linux {}",
        env!("CARGO_PKG_VERSION"),
        lager_ports::BUS_VERSION,
        kernel.release().to_string_lossy()
    ))
}

/// How many MiB of shared memory are free.
fn free_shared_memory() -> rustix::io::Result<u64> {
    let stat = rustix::fs::statvfs("/dev/shm")?;
    Ok(stat.f_bavail * stat.f_frsize / (1024 * 1024))
}

fn shared_memory() -> Finding {
    let free = match free_shared_memory() {
        Ok(free) => free,
        Err(error) => {
            return Bad(format!(
                "/dev/shm cannot be used ({error}); mount a tmpfs there"
            ));
        }
    };
    if free < SHARED_MEMORY_MIB {
        return Bad(format!(
            "/dev/shm has {free} MiB free and a robot needs {SHARED_MEMORY_MIB}; enlarge it (mount -o remount,size=256M /dev/shm; in a container --shm-size=256m)"
        ));
    }
    if tempfile_in("/dev/shm").is_err() {
        return Bad("this user may not write to /dev/shm; it needs mode 1777".into());
    }
    Good(format!("/dev/shm has {free} MiB free"))
}

/// Makes and removes a file of this process's own.
fn tempfile_in(folder: &str) -> std::io::Result<()> {
    let path = Path::new(folder).join(format!("lager-doctor-{}", std::process::id()));
    fs::write(&path, b"")?;
    fs::remove_file(&path)
}

/// How many files this process may open, and each that `up` starts.
fn most_open_files() -> u64 {
    getrlimit(Resource::Nofile).current.unwrap_or(u64::MAX)
}

fn open_files() -> Finding {
    let limit = most_open_files();
    if limit < OPEN_FILES {
        return Hint(format!(
            "a process may open {limit} files; many observers need {OPEN_FILES} (ulimit -n {OPEN_FILES}, or LimitNOFILE= in the unit)"
        ));
    }
    Good(format!("a process may open {limit}"))
}

/// How the robot is built, as its boards are told, and where that stands.
fn robot(config: &Config) -> Finding {
    let built = config.built();
    match config.robot_file() {
        Ok(Some(file)) => Good(format!("{built}, says {}", file.display())),
        Ok(None) if config.body == Body::Serial => Bad(
            "nobody has said how this robot is built, so it drives only by hand; `lager commission` asks for it, or `lager config --robot` prints a description to be kept"
                .into(),
        ),
        Ok(None) => Good(built),
        Err(error) => Hint(format!("{error:#}")),
    }
}

/// systemd removes a user's shared memory at logout unless its configuration says otherwise.
fn remove_ipc() -> Finding {
    let off = ["/etc/systemd/logind.conf", "/usr/lib/systemd/logind.conf"]
        .iter()
        .filter_map(|path| fs::read_to_string(path).ok())
        .any(|text| text.lines().any(|line| line.trim() == "RemoveIPC=no"));
    let systemd = Path::new("/run/systemd/system").is_dir();
    if systemd && !off && !rustix::process::geteuid().is_root() {
        return Hint(
            "systemd removes this user's shared memory at logout; set RemoveIPC=no in /etc/systemd/logind.conf or run the robot as a system user"
                .into(),
        );
    }
    Good("nothing removes shared memory at logout".into())
}

fn serial(config: &Config) -> Finding {
    if config.body != Body::Serial {
        return Good("not needed by a simulated or emulated robot".into());
    }
    let Some(ports) = config.serial.named() else {
        return to_be_found(config);
    };
    for port in &ports {
        let name = port.display();
        let Ok(metadata) = fs::metadata(port) else {
            return Bad(format!(
                "{name} does not exist; plug the board in, or name the port in the configuration's [serial]"
            ));
        };
        if !metadata.file_type().is_char_device() {
            return Bad(format!("{name} is no serial port"));
        }
        let access = rustix::fs::Access::READ_OK | rustix::fs::Access::WRITE_OK;
        if rustix::fs::access(port, access).is_err() {
            return Bad(format!(
                "{name} belongs to group {} and this user may not use it; add the user to that group (often `dialout`) and log in again",
                metadata.gid()
            ));
        }
    }
    let [sensor, steering] = &ports;
    match holders::others(&[sensor, steering], &own(config)).as_slice() {
        [] => Good(format!(
            "{} and {} can be used",
            sensor.display(),
            steering.display()
        )),
        others => {
            let said: Vec<String> = others.iter().map(holders::Other::said).collect();
            Bad(said.join("; "))
        }
    }
}

/// The serial devices among which the robot finds its boards. Which board is where is another check's.
fn to_be_found(config: &Config) -> Finding {
    let devices = find::devices(&config.serial.devices);
    if devices.is_empty() {
        let folder = config.serial.devices.clone();
        return Bad(find::NotFound::NoDevice { folder }.to_string());
    }
    let names: Vec<String> = devices
        .iter()
        .map(|path| path.display().to_string())
        .collect();
    let ports: Vec<&PathBuf> = devices.iter().collect();
    let others = holders::others(&ports, &own(config));
    let said: Vec<String> = others.iter().map(holders::Other::said).collect();
    let names = names.join(", ");
    match said.is_empty() {
        true => Good(format!("the boards are looked for at {names}")),
        false => Hint(format!(
            "the boards are looked for at {names}; {}",
            said.join("; ")
        )),
    }
}

/// The processes of the robot itself: its bridge, and the service that stands for the boards. They
/// have the ports open.
fn own(config: &Config) -> Vec<u32> {
    let bus = config.bus().ok();
    let holders = bus.and_then(|bus| bus.home().ok()?.up().remove(&bus.unit));
    let holders = holders.into_iter().flatten();
    holders.map(|holder| holder.pid).collect()
}

/// Whether other programs leave the robot enough processor time.
fn load() -> Finding {
    let Some(load) = Load::now() else {
        return Good("the kernel does not tell how busy this machine is".into());
    };
    if !load.is_too_much() {
        return Good(format!("there is room: {}", load.said()));
    }
    let greedy = overload::greediest();
    let who = match greedy.is_empty() {
        true => "see `top` for who wants them".to_owned(),
        false => greedy.join(", "),
    };
    Hint(format!(
        "this machine is overloaded: {}; {who}; the robot stands when its services get no core in time, and goes on by itself; end what is not needed, or start it with `lager up --realtime 20`",
        load.said()
    ))
}

fn original_boards(config: &Config) -> Finding {
    if config.body != Body::Serial || !config.serial.original_boards {
        return Good("none is driven: whatever dies, the wheels stop within 200 ms".into());
    }
    Hint(
        "[serial] original_boards = true: an original steering board has no age limit on commands and drives on if this machine dies, so the wheels do not stop within 200 ms; keep its power switch at hand"
            .into(),
    )
}

fn emulated(config: &Config) -> Finding {
    match config.chip.parts(config.serial.baud) {
        Ok(parts) => Good(format!(
            "{} runs {} and {}",
            parts.emulator.display(),
            parts.sensor_elf.display(),
            parts.steering_elf.display()
        )),
        Err(missing) if config.body == Body::Chip => Bad(missing.to_string()),
        Err(missing) => Hint(format!("only `lager up --body chip` needs them: {missing}")),
    }
}

fn bus(config: &Config, fix: bool) -> Finding {
    match bus_state(config, fix) {
        Ok(finding) => finding,
        Err(error) => Bad(format!("{error:#}")),
    }
}

fn bus_state(config: &Config, fix: bool) -> Result<Finding> {
    let bus = config.bus()?;
    let count = |state| {
        let nodes = lager_ports::nodes(&bus)?;
        let those = nodes.iter().filter(|node| node.state == state);
        Ok::<usize, lager_ports::IntrospectError>(those.count())
    };
    let mut removed = 0;
    if fix {
        // A process that joins the bus removes what dead processes have registered with living
        // ones.
        if count(NodeState::Alive)? > 0 && count(NodeState::Stale)? > 0 {
            sweep_beside(&bus)?;
        }
        removed = lager_home::mend(&bus.home()?, bus.application.kept).removed;
    }
    if let Some(segment) = lager_home::damaged(&bus.home()?).first() {
        return Ok(Bad(match users_of(segment).as_slice() {
            [] => format!(
                "{} is damaged and nobody uses it; `lager doctor --fix` removes it",
                segment.display()
            ),
            users => format!(
                "{} is damaged (emptied, or another user's) and still used; end {}, then run `lager doctor --fix`",
                segment.display(),
                users.join(", ")
            ),
        }));
    }
    let alive = count(NodeState::Alive)?;
    let unknown = count(NodeState::Unknown)?;
    let folder = bus.home()?.folder().display().to_string();
    Ok(match count(NodeState::Stale)? {
        0 if unknown > 0 => Hint(format!(
            "{alive} processes are on the bus in {folder}, and {unknown} that belong to another user; one user should run all of a robot's services"
        )),
        0 => match diagnose::others_folder().filter(|_| alive == 0) {
            Some(others) => Hint(format!(
                "nobody is on the bus in {folder}; {removed} files were removed; {others}"
            )),
            None => Good(format!(
                "{alive} processes are on the bus in {folder}; {removed} files of dead ones were removed"
            )),
        },
        stale if fix => Bad(format!(
            "{stale} dead processes cannot be removed from the bus in {folder}; stop every process on it, then run this again"
        )),
        stale => Hint(format!(
            "{stale} dead processes left something in {folder}; `lager doctor --fix` removes it (a starting robot does so too)"
        )),
    })
}

/// Starts another process that joins the bus, which sweeps it, and waits three seconds for it. That
/// process opens files that may be damaged; this one must not hang.
fn sweep_beside(bus: &lager_ports::BusConfig) -> Result<()> {
    const PATIENCE: Duration = Duration::from_secs(3);
    let mut child = Command::new(std::env::current_exe()?)
        .arg("--bus")
        .arg(bus.home()?.folder())
        .args(["--name", bus.unit.as_str(), "topic", "list"])
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()?;
    let start = Instant::now();
    while child.try_wait()?.is_none() {
        if start.elapsed() > PATIENCE {
            child.kill()?;
            child.wait()?;
            break;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    Ok(())
}

/// The processes that have a file mapped, each as a text.
fn users_of(file: &Path) -> Vec<String> {
    let file = file.to_string_lossy();
    let processes = fs::read_dir("/proc").into_iter().flatten().flatten();
    processes
        .filter_map(|process| {
            let pid: u32 = process.file_name().to_str()?.parse().ok()?;
            let maps = fs::read_to_string(process.path().join("maps")).ok()?;
            let name = fs::read_to_string(process.path().join("comm")).ok()?;
            maps.contains(&*file)
                .then(|| format!("process {pid} ({})", name.trim()))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_machine_that_shares_its_cores_is_no_place_to_measure() {
        let took = |stolen_percent| {
            meanwhile(&Conditions {
                stolen_percent,
                ..Conditions::default()
            })
        };
        assert_eq!((took(0.2).mark(), took(3.0).mark()), ("ok", "hint"));
        let here = machine(&Machine::here(), &Observed::begin(None).end());
        assert!(
            here.said().contains("interrupts on mask"),
            "{}",
            here.said()
        );
    }

    #[test]
    fn what_is_bad_stands_first_and_long_texts_below() {
        let checks = [
            ("bus", Good("nobody is on it; all is swept".into())),
            ("serial rights", Bad("no port; plug it in".into())),
            ("real time", Hint(format!("slow {}", "word ".repeat(40)))),
        ];
        let told = text(&checks);
        let lines: Vec<&str> = told.lines().collect();
        assert_eq!(
            lines[0],
            "ok    bus               nobody is on it; all is swept"
        );
        assert_eq!(lines[1], "BAD   serial rights     no port");
        assert!(lines[2].ends_with(" word ..."), "{told}");
        assert!(lines[..3].iter().all(|line| line.chars().count() <= 104));
        assert!(told.contains("  - serial rights: plug it in"), "{told}");
        assert!(told.ends_with("One thing keeps a robot from running here; one hint."));
        let read: serde_json::Value = serde_json::from_str(&json(&checks)).expect("JSON");
        assert_eq!(read["ok"], false);
        assert_eq!(read["findings"][1]["state"], "bad");
    }
}
