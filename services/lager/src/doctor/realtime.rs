//! `lager doctor` about real time: it tries what `lager up` would ask for, and looks for settings
//! of this machine that make reactions late.
//!
//! If the user asks for an option and the machine refuses it, the result is bad. Without such a
//! wish it is at most a hint.

use std::fs;
use std::path::{Path, PathBuf};

use lager_topics::Role;

use super::Finding::{self, Bad, Good, Hint};
use crate::config::{Config, RealtimeSection, Waiting};
use crate::realtime::{self, CoreSet, RealtimeError, Wanted};

/// The priority to try if none is configured.
const SUGGESTED_PRIORITY: u8 = 20;
/// The priority of the kernel's interrupt threads on `PREEMPT_RT`.
const INTERRUPT_PRIORITY: u8 = 50;
/// An idle core that takes longer than this to wake up makes a hop slower, in µs.
const LATE_IDLE_US: u64 = 20;
/// The kernel's default slack, in ns.
const USUAL_SLACK_NS: u64 = 50_000;
/// On which cores the kernel's workers may run; some of them pass on a serial port's bytes. The
/// file has hexadecimal numbers of 32 bits with commas between them.
const WORKERS: &str = "/sys/devices/virtual/workqueue/cpumask";

/// All checks of real time, each with its name.
pub fn findings(config: &Config) -> Vec<(&'static str, Finding)> {
    let cpus = Path::new("/sys/devices/system/cpu");
    vec![
        ("real time", priority(config.realtime.priority)),
        ("locked memory", memory(config.realtime.lock_memory)),
        ("cores", cores(config)),
        ("waiting", waiting(config)),
        (
            "serial workers",
            workers(&worker_cores(Path::new(WORKERS)), config),
        ),
        ("real-time share", share(realtime::throttle(), config)),
        ("core speed", governor(&governors(cpus))),
        ("core idling", idling(&idle_states(cpus))),
        ("timer slack", slack()),
    ]
}

fn priority(configured: u8) -> Finding {
    let tried = if configured == 0 {
        SUGGESTED_PRIORITY
    } else {
        configured
    };
    let wanted = Wanted {
        priority: tried,
        ..Wanted::default()
    };
    let preemptible = rustix::system::uname()
        .version()
        .to_string_lossy()
        .contains("PREEMPT_RT");
    match (wanted.rehearse(), configured) {
        (Ok(()), INTERRUPT_PRIORITY..) if preemptible => Hint(format!(
            "priority {tried} is granted, but it goes before the interrupt threads (at {INTERRUPT_PRIORITY}) that bring the boards' bytes; choose one below"
        )),
        (Ok(()), 0) => Good(format!(
            "not used, but granted: `lager up --realtime {tried}` keeps other load from delaying the robot"
        )),
        (Ok(()), _) => Good(format!("priority {tried} is granted")),
        (Err(error), 0) => unasked(&format!("--realtime {tried}"), &error),
        (Err(error), _) => Bad(error.to_string()),
    }
}

fn memory(configured: bool) -> Finding {
    let wanted = Wanted {
        lock_memory: true,
        ..Wanted::default()
    };
    match (wanted.rehearse(), configured) {
        (Ok(()), true) => Good("each service may lock what it needs".into()),
        (Ok(()), false) => Good(
            "not used, but granted: with `lager up --lock-memory` no part of a service is ever paged out"
                .into(),
        ),
        (Err(error), true) => Bad(error.to_string()),
        (Err(error), false) => unasked("--lock-memory", &error),
    }
}

/// The result if the machine refuses what nobody has asked for.
fn unasked(flag: &str, error: &RealtimeError) -> Finding {
    Hint(format!("not used; with {flag}: {error}"))
}

fn cores(config: &Config) -> Finding {
    for role in [Role::Bridge, Role::Logic, Role::Simulator] {
        let wanted = Wanted {
            cores: config.realtime.wanted(role).cores,
            ..Wanted::default()
        };
        if let Err(error) = wanted.rehearse() {
            return Bad(error.to_string());
        }
    }
    let existing = realtime::existing_cores();
    match realtime::allowed_cores() {
        Err(error) => Bad(error.to_string()),
        Ok(allowed) if allowed.len() < existing.len() => Good(format!(
            "this process may use {allowed} of the machine's {existing}"
        )),
        Ok(allowed) if allowed.len() == 1 => Hint(
            "there is only one: whatever else runs delays the robot unless it has a real-time priority"
                .into(),
        ),
        Ok(allowed) => Good(format!("{allowed} may be used, {} in all", allowed.len())),
    }
}

fn waiting(config: &Config) -> Finding {
    let roles = RealtimeSection::ON_PATH.map(|role| config.realtime.wanted(role).cores);
    if config.bus.waiting == Waiting::Adaptive
        && roles[0].len() == 1
        && roles.iter().all(|cores| *cores == roles[0])
    {
        return Hint(format!(
            "waiting = \"adaptive\" gains nothing where bridge and logic share core {}: give each its own, such as `--core bridge=0 --core logic=1`",
            roles[0]
        ));
    }
    if config.bus.waiting != Waiting::Spin {
        return Good("services sleep when nothing comes".into());
    }
    let allowed = match realtime::allowed_cores() {
        Ok(allowed) => allowed,
        Err(error) => return Bad(error.to_string()),
    };
    match realtime::refuse_starvation(&roles, &allowed) {
        Err(error) if config.realtime.priority > 0 => Bad(error.to_string()),
        Err(_) => Hint(format!(
            "waiting = \"spin\" keeps {} cores busy and leaves too few of {allowed} for the rest; waiting = \"adaptive\" is as fast while samples come fast",
            roles.len()
        )),
        Ok(()) => Good(format!(
            "waiting = \"spin\" keeps {} of the cores {allowed} busy for good",
            roles.len()
        )),
    }
}

/// The cores on which the kernel's workers may run; empty if the kernel does not say.
fn worker_cores(mask: &Path) -> CoreSet {
    let mask = line(mask).unwrap_or_default();
    let digits = mask.chars().rev().filter_map(|digit| digit.to_digit(16));
    digits
        .enumerate()
        .flat_map(|(place, digit)| {
            let cores = (0..4).filter(move |bit| digit >> bit & 1 == 1);
            cores.map(move |bit| 4 * place + bit)
        })
        .collect()
}

/// Where the kernel passes on the bytes of serial ports. A worker on the core of a service that
/// spins runs at once; a worker that must be called from another core runs late.
fn workers(may_run_on: &CoreSet, config: &Config) -> Finding {
    if may_run_on.is_empty() {
        return Good("where they run is not shown by this kernel".into());
    }
    let bridge = config.realtime.wanted(Role::Bridge).cores;
    // A bridge in real time would keep a worker off its core while it spins.
    let matters = config.bus.waiting == Waiting::Adaptive && config.realtime.priority == 0;
    if !matters || (bridge.len() == 1 && *may_run_on == bridge) {
        return Good(format!(
            "the kernel's workers may run on cores {may_run_on}"
        ));
    }
    let gains_little = format!(
        "the kernel hands over serial bytes on cores {may_run_on}, so waiting = \"adaptive\" gains little; it gains most if that happens on the bridge's core"
    );
    match bridge.iter().next() {
        Some(core) if bridge.len() == 1 => Hint(format!(
            "{gains_little}: `echo {:x}{} > {WORKERS}` as root takes all workers that are bound to no core there, until the next start of the machine",
            1_u32 << (core % 32),
            ",00000000".repeat(core / 32)
        )),
        _ => Hint(format!(
            "{gains_little}: give bridge and logic a core each, `--core bridge=0 --core logic=1`, and ask again"
        )),
    }
}

/// How much time the kernel gives to real-time threads.
fn share(throttle: Option<(i64, i64)>, config: &Config) -> Finding {
    let spins = config.bus.waiting == Waiting::Spin && config.realtime.priority > 0;
    match throttle {
        None => Good("the kernel has no limit on real-time threads that could be read".into()),
        Some((0, _)) => {
            let text = "real-time threads get no time at all; `sysctl kernel.sched_rt_runtime_us=950000` gives them the usual 95 %";
            if config.realtime.priority > 0 {
                Bad(text.into())
            } else {
                Hint(text.into())
            }
        }
        Some((runtime, period)) if runtime < 0 || runtime >= period => {
            if spins {
                Hint(
                    "a spinning service keeps its core for good: before Linux 6.12 nothing is reserved for others; `sysctl kernel.sched_rt_runtime_us=950000` gives them 5 %"
                        .into(),
                )
            } else {
                Good("real-time threads may take all of a core's time".into())
            }
        }
        Some((runtime, period)) => {
            let (runtime, period) = (runtime / 1000, period / 1000);
            if spins {
                Hint(format!(
                    "a spinning service loses its core for {} of every {period} ms when others want it; isolcpus= on the kernel's command line keeps them away from that core",
                    period - runtime
                ))
            } else {
                Good(format!(
                    "real-time threads may take {runtime} of every {period} ms, more than services that sleep ever do"
                ))
            }
        }
    }
}

/// Each core's governor of its clock frequency, where it has one.
fn governors(cpus: &Path) -> Vec<String> {
    folders(cpus, "cpu")
        .iter()
        .filter_map(|cpu| line(&cpu.join("cpufreq/scaling_governor")))
        .collect()
}

fn governor(governors: &[String]) -> Finding {
    match governors.iter().find(|governor| *governor != "performance") {
        None if governors.is_empty() => {
            Good("the clock's frequency is not this kernel's to choose".into())
        }
        None => Good("every core keeps its full clock (performance)".into()),
        Some(other) => Hint(format!(
            "cores run under `{other}`, so the clock rises only once there has been load; `cpupower frequency-set -g performance` keeps it up"
        )),
    }
}

/// A state in which an idle core rests.
#[derive(Debug)]
struct IdleState {
    name: String,
    exit_us: u64,
}

/// The states of the first core that are in use.
fn idle_states(cpus: &Path) -> Vec<IdleState> {
    folders(&cpus.join("cpu0/cpuidle"), "state")
        .iter()
        .filter(|state| line(&state.join("disable")).is_none_or(|disable| disable == "0"))
        .filter_map(|state| {
            Some(IdleState {
                name: line(&state.join("name"))?,
                exit_us: line(&state.join("latency"))?.parse().ok()?,
            })
        })
        .collect()
}

fn idling(states: &[IdleState]) -> Finding {
    match states.iter().max_by_key(|state| state.exit_us) {
        None => Good("how cores rest is not shown by this kernel".into()),
        Some(deepest) if deepest.exit_us > LATE_IDLE_US => Hint(format!(
            "a core that rests in `{}` needs {} µs to come back, which every wake pays that meets it; `cpupower idle-set -D {LATE_IDLE_US}` turns off what is slower than {LATE_IDLE_US} µs, for more power drawn",
            deepest.name, deepest.exit_us
        )),
        Some(deepest) => Good(format!(
            "an idle core comes back within {} µs as far as this kernel knows (a virtual machine's host may take longer)",
            deepest.exit_us
        )),
    }
}

fn slack() -> Finding {
    match rustix::thread::current_timer_slack() {
        Ok(slack) if slack > USUAL_SLACK_NS => Hint(format!(
            "time-outs may be {} µs late because this shell was started so; services at a real-time priority are exempt",
            slack / 1000
        )),
        Ok(slack) => Good(format!(
            "time-outs may be {} µs late, none at a real-time priority",
            slack / 1000
        )),
        Err(error) => Good(format!("not known ({error})")),
    }
}

/// The folders of `parent` that are named `prefix` and a number.
fn folders(parent: &Path, prefix: &str) -> Vec<PathBuf> {
    fs::read_dir(parent)
        .into_iter()
        .flatten()
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| {
            path.file_name()
                .and_then(|name| name.to_str()?.strip_prefix(prefix))
                .is_some_and(|number| number.parse::<u32>().is_ok())
        })
        .collect()
}

fn line(file: &Path) -> Option<String> {
    Some(fs::read_to_string(file).ok()?.trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(finding: &Finding) -> (&'static str, &str) {
        match finding {
            Good(text) => ("good", text),
            Hint(text) => ("hint", text),
            Bad(text) => ("bad", text),
        }
    }

    fn config(text: &str) -> Config {
        toml::from_str(text).expect("valid TOML")
    }

    #[test]
    fn the_kernels_limit_matters_to_those_who_spin_and_none_at_all_to_those_who_asked() {
        let plain = config("");
        let sleeping = config("[realtime]\npriority = 20");
        let spinning = config("[realtime]\npriority = 20\n[bus]\nwaiting = \"spin\"");
        for (throttle, config, expected) in [
            (
                (950_000, 1_000_000),
                &sleeping,
                ("good", "950 of every 1000 ms"),
            ),
            (
                (950_000, 1_000_000),
                &spinning,
                ("hint", "50 of every 1000 ms"),
            ),
            ((-1, 1_000_000), &sleeping, ("good", "all of a core")),
            ((-1, 1_000_000), &spinning, ("hint", "for good")),
            ((0, 1_000_000), &sleeping, ("bad", "950000")),
            ((0, 1_000_000), &plain, ("hint", "950000")),
        ] {
            let finding = share(Some(throttle), config);
            let (mark, text) = said(&finding);
            assert_eq!(mark, expected.0, "{throttle:?}: {text}");
            assert!(text.contains(expected.1), "{throttle:?}: {text}");
        }
    }

    #[test]
    fn who_waits_adaptively_hears_of_cores_that_are_in_the_way() {
        let adaptive = "[bus]\nwaiting = \"adaptive\"\n";
        let bound = "[realtime]\ncores = { bridge = [3], logic = [2] }";
        let far = "[realtime]\ncores = { bridge = [33] }";
        let together = "[realtime]\ncores = { bridge = [1], logic = [1] }";
        let in_real_time = format!("{bound}\npriority = 20");
        for (text, workers_on, expected) in [
            (String::new(), "0-3", ("good", "cores 0-3")),
            (adaptive.into(), "0-63", ("hint", "bridge=0")),
            (format!("{adaptive}{bound}"), "0-3", ("hint", "`echo 8 > /")),
            (format!("{adaptive}{bound}"), "2", ("hint", "`echo 8 > /")),
            (format!("{adaptive}{far}"), "0-3", ("hint", "2,00000000 >")),
            (format!("{adaptive}{bound}"), "3", ("good", "cores 3")),
            (format!("{adaptive}{in_real_time}"), "0-3", ("good", "0-3")),
        ] {
            let cores = workers_on.parse().expect("cores");
            let finding = workers(&cores, &config(&text));
            let (mark, said) = said(&finding);
            assert_eq!(mark, expected.0, "{text} {workers_on}: {said}");
            assert!(said.contains(expected.1), "{text} {workers_on}: {said}");
        }
        let unknown = workers(&CoreSet::default(), &config(adaptive));
        assert_eq!(said(&unknown).0, "good");

        let finding = waiting(&config(&format!("{adaptive}{together}")));
        let (mark, text) = said(&finding);
        assert_eq!(mark, "hint");
        assert!(text.contains("share core 1"), "{text}");
        assert_eq!(
            said(&waiting(&config(&format!("{adaptive}{bound}")))).0,
            "good"
        );
    }

    #[test]
    fn the_kernels_mask_of_workers_is_read_group_by_group() {
        let file = std::env::temp_dir().join(format!("lager-mask-{}", std::process::id()));
        for (mask, cores) in [
            ("3\n", "0-1"),
            ("00000002,0000000c\n", "2-3,33"),
            ("0\n", ""),
        ] {
            fs::write(&file, mask).expect("a temporary file");
            assert_eq!(worker_cores(&file).to_string(), cores, "{mask}");
        }
        fs::remove_file(&file).expect("a temporary file");
        assert!(worker_cores(&file).is_empty());
    }

    #[test]
    fn slow_clocks_and_deep_rest_are_hints_with_a_command() {
        let folder = std::env::temp_dir().join(format!("lager-doctor-{}", std::process::id()));
        let write = |file: &str, text: &str| {
            let file = folder.join(file);
            fs::create_dir_all(file.parent().expect("a folder")).expect("a temporary folder");
            fs::write(file, text).expect("a temporary file");
        };
        for (state, name, latency, disable) in [
            (0, "POLL", 0, 0),
            (1, "C1", 2, 0),
            (2, "C6", 133, 0),
            (3, "C10", 900, 1),
        ] {
            let at = |file| format!("cpu0/cpuidle/state{state}/{file}");
            write(&at("name"), &format!("{name}\n"));
            write(&at("latency"), &format!("{latency}\n"));
            write(&at("disable"), &format!("{disable}\n"));
        }
        write("cpu0/cpufreq/scaling_governor", "performance\n");
        write("cpu1/cpufreq/scaling_governor", "ondemand\n");
        write("cpufreq/policy0/scaling_governor", "not a core\n");

        let finding = idling(&idle_states(&folder));
        let (mark, text) = said(&finding);
        assert_eq!(mark, "hint");
        assert!(
            text.contains("`C6` needs 133 µs") && text.contains("idle-set -D"),
            "{text}"
        );

        let finding = governor(&governors(&folder));
        let (mark, text) = said(&finding);
        assert_eq!(mark, "hint");
        assert!(
            text.contains("`ondemand`") && text.contains("frequency-set"),
            "{text}"
        );

        write("cpu1/cpufreq/scaling_governor", "performance\n");
        assert_eq!(said(&governor(&governors(&folder))).0, "good");
        assert_eq!(said(&governor(&[])).0, "good");
        assert_eq!(said(&idling(&[])).0, "good");
        fs::remove_dir_all(folder).expect("a temporary folder");
    }

    #[test]
    fn a_core_that_is_not_there_is_bad_for_real_time_or_not() {
        let finding = cores(&config("[realtime]\ncores = { logic = [1000] }"));
        let (mark, text) = said(&finding);
        assert_eq!(mark, "bad");
        assert!(text.contains("no core 1000"), "{text}");
    }
}
