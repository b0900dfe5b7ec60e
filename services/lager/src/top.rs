//! `lager top`: joins the bus, calls a robot's gateway, or reads a recording, for the monitor's screen.

use std::io::{BufWriter, IsTerminal, Write};
use std::path::Path;
use std::time::Duration;

use anyhow::{Context, Result};
use lager_monitor::{Lacking, Load, Origin, Recorded, ToolError, Tools, TopConfig};
use lager_topics::Role;

use crate::cli::TopArgs;
use crate::config::Config;
use crate::time_limit::TimeLimit;
use crate::{afar, diagnose, exit, overload, topic};

/// How long to measure for the one picture.
const ONCE: Duration = Duration::from_secs(2);

/// Shows it until a key, or prints one picture.
pub fn run(config: &Config, args: &TopArgs, patience: &TimeLimit) -> Result<()> {
    if !args.once && !std::io::stdout().is_terminal() {
        let what = "standard output is not a terminal; `lager top --once` prints one picture";
        return Err(exit::Usage(what.to_owned()).into());
    }
    if let Some(file) = &args.bag {
        return over(file, args, patience);
    }
    if let Some(endpoint) = &args.remote {
        let remote = afar::call_quietly(config, endpoint, &patience.shutdown)?;
        // Only the robot's own load would say something of it.
        return show(&remote, Load::default, config, args, patience);
    }
    diagnose::must_be_up(config)?;
    let bus = topic::join(config, Role::Monitor, &patience.watchdog)?;
    show(&bus, load, config, args, patience)
}

fn show(
    place: &impl Origin,
    load: fn() -> Load,
    config: &Config,
    args: &TopArgs,
    patience: &TimeLimit,
) -> Result<()> {
    let out = &mut BufWriter::new(std::io::stdout());
    let mut tools = Tools {
        place,
        watchdog: &patience.watchdog,
        shutdown: &patience.shutdown,
        as_json: args.json,
        out,
    };
    let measured = args.duration.map_or(ONCE, Duration::from_secs_f64);
    let shown = tools.top(&TopConfig {
        filter: args.filter.clone(),
        once: args.once.then_some(measured),
        pack: config.pack(),
        load,
    });
    match shown.and_then(|()| Ok(out.flush()?)) {
        Err(error) if error.is_closed_output() => Ok(()),
        shown => Ok(shown?),
    }
}

/// How busy this machine is; nobody wants a core where the kernel does not say.
fn load() -> Load {
    let known = overload::Load::now();
    known.map_or_else(Load::default, |load| Load {
        minute: load.wanting(),
        cores: load.cores(),
    })
}

/// The same over a recording.
fn over(file: &Path, args: &TopArgs, patience: &TimeLimit) -> Result<()> {
    let name = file.display().to_string();
    let mut recorded = None;
    let layouts = lager_recorder::samples(file, &mut |sample| {
        let begin = || Recorded::new(&name, sample.robot, &args.filter);
        let recorded = recorded.get_or_insert_with(begin);
        let envelope = sample.envelope;
        if sample.is_repeated {
            return recorded.repeat(sample.topic, &envelope.stamp, envelope.payload);
        }
        let lacking = Lacking {
            lost: envelope.lost,
            dropped: envelope.dropped,
        };
        recorded.take(sample.topic, &envelope.stamp, lacking, envelope.payload);
    })?;
    let mut recorded = recorded.with_context(|| format!("{name} has no samples"))?;
    for (topic, layout) in &layouts {
        recorded.describe(topic, layout);
    }
    let out = &mut BufWriter::new(std::io::stdout());
    let shown = recorded
        .show(args.once, args.json, &patience.shutdown, out)
        .and_then(|()| out.flush());
    match shown.map_err(ToolError::from) {
        Err(error) if error.is_closed_output() => Ok(()),
        shown => Ok(shown?),
    }
}
