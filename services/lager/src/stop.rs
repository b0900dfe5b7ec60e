//! `lager stop`: sets the robot's stop word and prints whether the wheels stand.
//!
//! It opens nothing of the bus. So it works when the bus is full, when the bus's files are gone or
//! damaged, and when the bridge is frozen. It reads the bridge's answers in the file of the stop
//! word, and asks the kernel about the bridge's process.

use std::fs;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use lager_home::Clock;
use lager_stop::{Stop, StopPage, StopTold, StopWord};
use lager_supervisor::stopped::span;
use lager_topics::{Role, StopCause};

use crate::config::{Body, Config};

/// How long the robot may take to stand, in real time.
const PATIENCE: Duration = Duration::from_millis(2_500);

/// How long to wait for a bridge that has not been seen yet.
const SHORT: Duration = Duration::from_millis(300);

/// How often the answer is checked.
const LOOK: Duration = Duration::from_millis(1);

/// A bridge turns at least every 20 ms.
const SILENT: Duration = Duration::from_millis(200);

/// Every failure begins with this.
const MOVING: &str = "the robot may still be moving";

/// The stop word of the robot in `config`.
pub fn path(config: &Config) -> Result<PathBuf> {
    let bus = config.bus()?;
    Ok(bus.home()?.folder_of(&bus.unit).join(StopPage::FILE))
}

/// The stop that is set, if there is one.
pub fn current(config: &Config) -> Result<Option<Stop>> {
    Ok(StopWord::read(&path(config)?)?.and_then(|told| told.stop()))
}

/// Stops the robot for this cause and waits until its wheels stand.
pub fn run(config: &Config, cause: StopCause) -> Result<String> {
    let path = path(config).context(MOVING)?;
    let folder = path.parent().unwrap_or(&path);
    let was_there = folder.exists();
    let start = Instant::now();
    let ordered_ns = Clock::monotonic_ns();
    let set = || StopWord::set(&path, Role::Operator, cause).context(MOVING);
    set()?;
    loop {
        let Some(told) = StopWord::read(&path).context(MOVING)? else {
            // Somebody has removed the file meanwhile.
            set()?;
            continue;
        };
        let now_ns = Clock::monotonic_ns();
        let bridge = told.bridge().map(|process| (process, state(process)));
        let why = match judge(&told, ordered_ns, now_ns, bridge) {
            Verdict::Stands(said) => return Ok(said),
            Verdict::Never(why) => bail!("{MOVING}: {why}"),
            Verdict::NotYet(why) => why,
        };
        let is_known = was_there && (told.bridge().is_some() || folder.join("up.lock").exists());
        let patience = if is_known { PATIENCE } else { SHORT };
        if start.elapsed() >= patience {
            if !was_there {
                bail!(
                    "no robot `{}` has ever been up in {}; one that starts there now is stopped until `lager resume`",
                    config.name,
                    folder.parent().unwrap_or(folder).display()
                );
            }
            bail!("{MOVING}: {why}");
        }
        std::thread::sleep(LOOK);
    }
}

/// Stops real boards before the robot starts. A stop that is already set stays.
pub fn at_start(config: &Config) -> Result<()> {
    if config.body == Body::Serial && current(config)?.is_none() {
        StopWord::set(&path(config)?, Role::Supervisor, StopCause::FreshStart)?;
    }
    Ok(())
}

/// What is known after a stop.
#[derive(Debug, PartialEq, Eq)]
enum Verdict {
    /// The wheels stand.
    Stands(String),
    /// They do not stand yet, for this reason.
    NotYet(String),
    /// Nobody can know whether they stand.
    Never(String),
}

/// Judges, from the file at `now_ns`, a stop that was ordered at `ordered_ns`. `bridge` is the last
/// bridge's process with its state, as the kernel says.
fn judge(
    told: &StopTold,
    ordered_ns: u64,
    now_ns: u64,
    bridge: Option<(u32, Option<char>)>,
) -> Verdict {
    let Some(stop) = told.stop() else {
        return Verdict::Never("somebody has released the stop meanwhile (`lager resume`)".into());
    };
    let age = |then_ns| span(StopTold::age(now_ns, then_ns));
    if let Some((of, at_ns)) = told.rested()
        && of == stop
        && at_ns >= ordered_ns
    {
        let sensor = match told.sensor() {
            Some(_) => "",
            None => " (the sensor board is not connected)",
        };
        return Verdict::Stands(format!(
            "stopped: the wheels stand, {} after the order{sensor}; `lager resume` lets it go on",
            span(StopTold::age(at_ns, ordered_ns))
        ));
    }
    let last = match told.report() {
        Some((at_ns, [left, right])) => format!(
            "its last report, {} ago, showed duty {left} and {right}",
            age(at_ns)
        ),
        None => "it has not reported".into(),
    };
    const BY_ITSELF: &str =
        "a steering board of ours stops by itself 150 ms after the last command it was given";
    let obeyed = told.obeyed().filter(|(of, _)| *of == stop);
    match (bridge, obeyed) {
        (None, _) => Verdict::NotYet(format!(
            "no bridge has answered here, so it was never up or its folder was emptied; {BY_ITSELF}"
        )),
        (Some((process, None | Some('Z'))), _) => Verdict::NotYet(format!(
            "no bridge runs (it was process {process}); {BY_ITSELF}"
        )),
        (Some((process, Some('T' | 't'))), _) => Verdict::NotYet(format!(
            "the bridge (process {process}) is frozen by a signal and obeys as soon as it goes on (kill -CONT {process}); {BY_ITSELF}"
        )),
        (Some((process, _)), None) => Verdict::NotYet(format!(
            "the bridge (process {process}) does not answer; its main loop last turned {} ago",
            age(told.turned_ns())
        )),
        (Some((process, _)), _) if StopTold::age(now_ns, told.turned_ns()) > SILENT => {
            Verdict::NotYet(format!(
                "the bridge (process {process}) does not answer any more; its main loop last turned {} ago",
                age(told.turned_ns())
            ))
        }
        (_, Some((_, at_ns))) => match told.steering() {
            Some(0) => Verdict::Never(format!(
                "the bridge obeys since {}, but the steering board is an original one, which reports nothing and has no age limit on commands: look at the wheels",
                span(StopTold::age(now_ns, at_ns))
            )),
            Some(_) => Verdict::NotYet(format!("the steering board was told to stand; {last}")),
            None => Verdict::NotYet(format!(
                "the steering board is not connected; {last}; {BY_ITSELF}"
            )),
        },
    }
}

/// The state of a process as the kernel says, if there is such a process.
fn state(process: u32) -> Option<char> {
    let stat = fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
    // The state follows the name, which is in parentheses and may contain anything.
    stat.rsplit(") ").next()?.chars().next()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn why(verdict: Verdict) -> String {
        match verdict {
            Verdict::Stands(said) | Verdict::NotYet(said) | Verdict::Never(said) => said,
        }
    }

    /// A file in which somebody has ordered a stop and no bridge has answered.
    fn ordered() -> (PathBuf, StopTold) {
        use std::sync::atomic::{AtomicU32, Ordering};
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        let path = std::env::temp_dir().join(format!("lager-st-{}-{number}", std::process::id()));
        StopWord::set(&path, Role::Operator, StopCause::Ordered).expect("a file");
        let told = StopWord::read(&path).expect("readable").expect("a file");
        (path, told)
    }

    #[test]
    fn each_way_of_not_knowing_has_its_sentence() {
        let (path, told) = ordered();
        fs::remove_file(path).expect("a file");
        let now_ns = Clock::monotonic_ns();
        for (bridge, words) in [
            (None, "never up"),
            (Some((7, None)), "no bridge runs (it was process 7)"),
            (Some((7, Some('T'))), "is frozen"),
            (Some((7, Some('S'))), "does not answer"),
        ] {
            let said = why(judge(&told, now_ns, now_ns, bridge));
            assert!(said.contains(words), "{said}");
        }
    }
}
