//! `lager bag`: runs the recorder's tools as the command line says.

mod collect;
mod verify;

use std::io::{BufWriter, IsTerminal, Write};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use anyhow::Result;
use lager_home::Clock;
use lager_ports::{Bus, Place};
use lager_recorder::{
    BagError, PlayConfig, PlayError, Progress, RecordConfig, Recorded, Split, Stamps,
};
use lager_supervisor::console;
use lager_topics::{Role, TOPICS};
use lager_wake::Shutdown;
use serde_json::json;

use crate::cli::{BagArgs, BagCommand, PlayArgs, RecordArgs, StampsArg};
use crate::config::Config;
use crate::time_limit::TimeLimit;
use crate::traces::Speaker;
use crate::{afar, diagnose, exit};

/// How often the recorder writes the samples to the disk. A kill loses the samples since the last
/// finished write: on a busy machine less than 300 ms.
const FLUSH: Duration = Duration::from_millis(150);

/// Runs the chosen tool.
pub fn run(config: &Config, args: BagArgs, shutdown: &Shutdown) -> Result<ExitCode> {
    let command = match args.command {
        BagCommand::Record(record_args) => return record(config, record_args, args.json, shutdown),
        BagCommand::Play(play_args) => return play(config, play_args, args.json, shutdown),
        command => command,
    };
    // Not before: recordings of several robots print from threads of their own.
    let out = &mut BufWriter::new(std::io::stdout().lock());
    let done = match command {
        BagCommand::Record(_) | BagCommand::Play(_) => unreachable!("they print by themselves"),
        BagCommand::Info { file } => lager_recorder::info(&file, args.json, out).map(|()| true),
        BagCommand::Check { file } => file.iter().try_fold(true, |whole, file| {
            Ok(lager_recorder::check(file, args.json, out)? && whole)
        }),
        BagCommand::Recover { file, output } => {
            lager_recorder::recover(&file, output.as_deref(), args.json, out).map(|()| true)
        }
        BagCommand::Export { file, csv, topic } => {
            lager_recorder::export_csv(&file, &topic, &csv, args.json, out).map(|()| true)
        }
    };
    match done.and_then(|is_whole| Ok((out.flush()?, is_whole).1)) {
        Ok(true) => Ok(ExitCode::SUCCESS),
        Ok(false) => Ok(exit::FAILED),
        Err(error) if error.is_closed_output() => Ok(ExitCode::SUCCESS),
        Err(error) => Err(refused(error)),
    }
}

fn refused(error: BagError) -> anyhow::Error {
    match error.is_usage() {
        true => exit::Usage(error.to_string()).into(),
        false => error.into(),
    }
}

fn record(
    config: &Config,
    args: RecordArgs,
    as_json: bool,
    shutdown: &Shutdown,
) -> Result<ExitCode> {
    if args.every_robot {
        return collect::run(config, args, as_json, shutdown);
    }
    let in_table = |name: &String| TOPICS.iter().any(|entry| entry.name == name);
    // Topics of other programs need no robot.
    let needs_robot = args.topic.is_empty() || args.topic.iter().any(in_table);
    if args.remote.is_none() && !args.wait && needs_robot {
        diagnose::must_be_up(config)?;
    }
    let wanted = wanted(&args, args.file.clone(), &config.name);
    let patience = TimeLimit::in_order(config, shutdown)?;
    if let Some(endpoint) = &args.remote {
        let remote = afar::call(config, endpoint, shutdown)?;
        return record_at(&remote, &wanted, as_json, &patience);
    }
    let join = || Bus::open(&config.bus()?, Role::Recorder).map_err(anyhow::Error::from);
    let bus = patience.watchdog.over("joining the bus", join)?;
    record_at(&bus, &wanted, as_json, &patience)
}

/// What is recorded of `robot`, into `file` if one is named.
fn wanted(args: &RecordArgs, file: Option<PathBuf>, robot: &str) -> RecordConfig {
    RecordConfig {
        or_another: file.is_none(),
        file: file.unwrap_or_else(|| named_after(robot)),
        topics: args.topic.clone(),
        split: Split {
            bytes: args.split_size.map(|mib| mib << 20),
            time: args.split_time.map(Duration::from_secs_f64),
        },
        queue: args.queue,
        flush: FLUSH,
    }
}

fn record_at(
    place: &impl Place,
    wanted: &RecordConfig,
    as_json: bool,
    patience: &TimeLimit,
) -> Result<ExitCode> {
    let mut live = Live::new(as_json);
    let mut tell = |progress: &Progress| live.tell(progress);
    let (watchdog, shutdown) = (&patience.watchdog, &patience.shutdown);
    let recorded = lager_recorder::record(place, watchdog, shutdown, wanted, &mut tell);
    live.end();
    let recorded = recorded?;
    sum_up(place.unit().as_str(), &recorded, as_json)?;
    match recorded.ended_by {
        None => Ok(ExitCode::SUCCESS),
        Some(error) => Err(error.into()),
    }
}

/// `r1-20261123-154906.mcap`, in UTC.
fn named_after(robot: &str) -> PathBuf {
    let now = Clock::monotonic_ns().saturating_add_signed(Clock::unix_offset_ns());
    let now = lager_recorder::utc(now);
    let digits: String = now.chars().filter(char::is_ascii_digit).collect();
    PathBuf::from(format!("{robot}-{}-{}.mcap", &digits[..8], &digits[8..14]))
}

/// What people and programs see while it records: on a terminal a line that changes, for programs
/// JSON lines; and for both the warnings.
struct Live {
    as_json: bool,
    has_line: bool,
    missing: (u64, u64),
}

impl Live {
    fn new(as_json: bool) -> Self {
        Self {
            as_json,
            has_line: std::io::stderr().is_terminal() && !as_json,
            missing: (0, 0),
        }
    }

    fn tell(&mut self, progress: &Progress) {
        for news in &progress.news {
            self.say(news);
        }
        let total = progress.total();
        if total.dropped > self.missing.1 {
            let more = total.dropped - self.missing.1;
            self.say(&format!(
                "the disk is too slow: {more} samples were dropped"
            ));
        }
        self.missing = (total.lost, total.dropped);
        if self.as_json {
            // Go on even if the output's reader has gone: the file matters.
            let _ = writeln!(std::io::stdout(), "{}", as_json(progress));
        } else if self.has_line {
            eprint!(
                "\r{:8.1} s  {:9} samples  {:8.2} MiB  {} lost  {} dropped ",
                progress.time.as_secs_f64(),
                total.received,
                mib(progress.bytes),
                total.lost,
                total.dropped
            );
        }
    }

    fn say(&mut self, what: &str) {
        self.end();
        console::complain(&Speaker::Tool.line(what));
    }

    /// Ends the line that changes.
    fn end(&self) {
        if self.has_line {
            eprintln!();
        }
    }
}

fn as_json(progress: &Progress) -> serde_json::Value {
    let topics: Vec<_> = progress
        .topics
        .iter()
        .map(|topic| {
            json!({
                "topic": topic.name, "received": topic.count.received,
                "lost": topic.count.lost, "dropped": topic.count.dropped,
            })
        })
        .collect();
    json!({
        "seconds": progress.time.as_secs_f64(), "bytes": progress.bytes, "topics": topics,
    })
}

fn mib(bytes: u64) -> f64 {
    bytes as f64 / f64::from(1 << 20)
}

/// The last lines: the files, and for each topic how many samples were recorded and lost.
fn sum_up(robot: &str, recorded: &Recorded, as_json_line: bool) -> Result<()> {
    for absent in &recorded.absent {
        let line = format!("{absent} was never there, so nothing of it is recorded");
        console::complain(&Speaker::Tool.line(&line));
    }
    let progress = &recorded.progress;
    let files: Vec<_> = recorded
        .files
        .iter()
        .map(|file| file.display().to_string())
        .collect();
    if as_json_line {
        let mut value = as_json(progress);
        value["files"] = json!(files);
        value["robot"] = json!(robot);
        return console::print(&value.to_string());
    }
    let total = progress.total();
    console::print(&format!(
        "{}: {} samples in {:.1} s, {:.2} MiB; {} lost before the recorder, {} dropped by it",
        files.join(" "),
        total.received - total.dropped,
        progress.time.as_secs_f64(),
        mib(progress.bytes),
        total.lost,
        total.dropped
    ))?;
    for topic in &progress.topics {
        let count = topic.count;
        if count.missing() > 0 {
            console::print(&format!(
                "  {}: {} received, {} lost, {} dropped",
                topic.name, count.received, count.lost, count.dropped
            ))?;
        }
    }
    Ok(())
}

fn play(config: &Config, args: PlayArgs, as_json: bool, shutdown: &Shutdown) -> Result<ExitCode> {
    if args.verify {
        // It needs no bus, and ends at the first Ctrl-C.
        let _patience = TimeLimit::new(config, shutdown)?;
        return verify::verify(&args.file, args.with, as_json);
    }
    if args.to.is_some_and(|to| to <= args.from) {
        let what = "--to must be later than --from".to_owned();
        return Err(exit::Usage(what).into());
    }
    let wanted = PlayConfig {
        file: args.file,
        topics: args.topic,
        rate: args.rate,
        repeat: args.repeat,
        from: Duration::from_secs_f64(args.from),
        to: args.to.map(Duration::from_secs_f64),
        stamps: match args.stamps {
            StampsArg::New => Stamps::New,
            StampsArg::Recorded => Stamps::Recorded,
        },
    };
    let patience = TimeLimit::in_order(config, shutdown)?;
    let join = || Bus::open(&config.bus()?, Role::Recorder).map_err(anyhow::Error::from);
    let bus = patience.watchdog.over("joining the bus", join)?;
    let mut begun = |left_out: &[String]| {
        for topic in left_out {
            let line = format!(
                "{topic} is not played: this build does not know it and nobody has it open"
            );
            console::complain(&Speaker::Tool.line(&line));
        }
    };
    let played = lager_recorder::play(&bus, &patience.watchdog, shutdown, &wanted, &mut begun);
    let played = played.map_err(|error| match error {
        PlayError::Bag(error) => refused(error),
        // Its own exit code.
        PlayError::Lock(error) => error.into(),
        other => other.into(),
    })?;
    let robot = bus.unit();
    console::print(&match as_json {
        true => json!({"robot": robot.as_str(), "samples": played.samples}).to_string(),
        false => format!("{} samples played onto robot `{robot}`", played.samples),
    })?;
    match played.is_done || wanted.repeat {
        true => Ok(ExitCode::SUCCESS),
        false => Err(exit::Interrupted.into()),
    }
}
