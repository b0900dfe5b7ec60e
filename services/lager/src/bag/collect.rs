//! `lager bag record --every-robot`: records every robot whose gateway is at a router, each into a file
//! of its own, by the recorder's own code.

use std::process::ExitCode;

use anyhow::{Context, Result};
use lager_wake::Shutdown;

use crate::cli::RecordArgs;
use crate::config::Config;

/// Records until somebody ends it, also robots that come later.
///
/// # Errors
/// The router does not answer, or one of the recordings has ended before its time.
#[cfg(feature = "zenoh")]
pub fn run(
    config: &Config,
    args: RecordArgs,
    as_json: bool,
    shutdown: &Shutdown,
) -> Result<ExitCode> {
    use std::collections::BTreeSet;
    use std::time::Duration;

    use lager_remote::{Hub, Remote};
    use lager_supervisor::console;
    use lager_wake::Watchdog;

    use super::{named_after, sum_up, wanted};
    use crate::time_limit::TimeLimit;
    use crate::traces::Speaker;
    use crate::{afar, exit};

    /// How often it looks for robots that have come.
    const LOOK: Duration = Duration::from_millis(500);

    let endpoint = args.remote.as_ref().context("clap demands it")?;
    let folder = args.file.clone().unwrap_or_else(|| ".".into());
    std::fs::create_dir_all(&folder)
        .with_context(|| format!("cannot make the folder {}", folder.display()))?;
    let patience = TimeLimit::in_order(config, shutdown)?;
    let proof = config.gateway.zenoh.proof()?;
    let hub = Hub::open(endpoint, proof.as_ref(), shutdown).map_err(afar::failed)?;
    let one = |remote: Remote| {
        let robot = remote.robot().as_str();
        let mut config = wanted(&args, Some(folder.join(named_after(robot))), robot);
        config.or_another = true;
        // Nothing of a link can hang.
        let watchdog = Watchdog::default();
        let mut tell = |progress: &lager_recorder::Progress| {
            for news in &progress.news {
                console::complain(&Speaker::Tool.line(&format!("{robot}: {news}")));
            }
        };
        let recorded = lager_recorder::record(&remote, &watchdog, shutdown, &config, &mut tell)?;
        sum_up(robot, &recorded, as_json)?;
        recorded.ended_by.map_or(Ok(()), |error| Err(error.into()))
    };
    let mut began: BTreeSet<_> = BTreeSet::new();
    std::thread::scope(|scope| {
        let mut recordings = Vec::new();
        while !shutdown.is_requested() {
            for robot in hub.robots()? {
                if began.contains(&robot) {
                    continue;
                }
                // It has just gone, or it has no topic yet; it is asked again.
                let Ok(remote) = hub.remote(&robot) else {
                    continue;
                };
                console::complain(&Speaker::Tool.line(&format!("records {robot}")));
                began.insert(robot.clone());
                let thread = std::thread::Builder::new().name(robot.to_string());
                let recording = thread.spawn_scoped(scope, || one(remote));
                recordings.push((robot, recording.context("cannot start a thread")?));
            }
            patience
                .pause(LOOK)
                .or_else(|error| match error.is::<exit::Interrupted>() {
                    true => Ok(()),
                    false => Err(error),
                })?;
        }
        let mut is_whole = true;
        for (robot, recording) in recordings {
            let ended: Result<()> = recording.join().expect("a recording does not panic");
            if let Err(error) = ended {
                console::complain(&Speaker::Tool.line(&format!("{robot}: {error:#}")));
                is_whole = false;
            }
        }
        Ok(if is_whole {
            ExitCode::SUCCESS
        } else {
            exit::FAILED
        })
    })
}

/// This program cannot.
///
/// # Errors
/// Always, as it was built without the feature `zenoh`.
#[cfg(not(feature = "zenoh"))]
pub fn run(
    _config: &Config,
    _args: RecordArgs,
    _as_json: bool,
    _shutdown: &Shutdown,
) -> Result<ExitCode> {
    Err(crate::afar::without()).context("--every-robot")
}
