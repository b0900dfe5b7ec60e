//! `lager topic`: joins the bus for the topic tools, and gives them standard input and output.

use std::io::{BufWriter, Write};
use std::sync::mpsc::{Receiver, sync_channel};

use anyhow::{Context, Result, anyhow};
use lager_monitor::{EchoConfig, Origin, Payloads, PublishError, Publishing, ToolError, Tools};
use lager_ports::{Bus, Place};
use lager_remote::Endpoint;
use lager_topics::{Role, TOPICS, UnknownTopic};
use lager_wake::Watchdog;
use serde_json::Value;

use crate::cli::{TopicArgs, TopicCommand};
use crate::config::Config;
use crate::meant::unknown_topic;
use crate::time_limit::TimeLimit;
use crate::{afar, diagnose, exit};

/// How many payloads are read before the tool publishes them.
const READ_AHEAD: usize = 16;

/// The topic tools, on standard output.
pub fn run(
    config: &Config,
    args: TopicArgs,
    every_robot: bool,
    patience: &TimeLimit,
) -> Result<()> {
    if let Some(endpoint) = args.remote.clone() {
        return from_afar(config, &endpoint, args, patience);
    }
    if let TopicCommand::Echo { watch, .. }
    | TopicCommand::Hz { watch }
    | TopicCommand::Bw { watch }
    | TopicCommand::Delay { watch } = &args.command
        && !watch.wait
        // Topics of other programs need no robot.
        && TOPICS.iter().any(|entry| entry.name == watch.topic)
    {
        diagnose::must_be_up(config)?;
    }
    let role = match args.command {
        TopicCommand::Pub { .. } => Role::Operator,
        _ => Role::Observer,
    };
    let bus = join(config, role, &patience.watchdog)?;
    let mut tools = Tools {
        place: &bus,
        watchdog: &patience.watchdog,
        shutdown: &patience.shutdown,
        as_json: args.json,
        out: &mut BufWriter::new(std::io::stdout().lock()),
    };
    let shown = match args.command {
        TopicCommand::List => {
            let listed = match every_robot {
                true => tools.list_every_robot(),
                false => tools.list(),
            };
            // A name under which nothing is open belongs to nobody.
            if matches!(listed, Ok(0)) && !every_robot {
                diagnose::must_be_up(config)?;
            }
            listed.map(drop)
        }
        TopicCommand::Pub {
            topic,
            payload,
            rate,
            until,
            live,
        } => {
            let mut limits = until.limits();
            let payloads = match &payload {
                Some(text) => {
                    if rate.is_none() {
                        limits.count = limits.count.or(Some(1));
                    }
                    Payloads::One(parsed(text)?)
                }
                None => Payloads::Each(read_on()?),
            };
            let what = Publishing {
                payloads,
                rate,
                limits,
                live,
            };
            let published = tools.publish(&topic, &what);
            let refused = |error| refused(error, payload.is_some(), &bus, &patience.watchdog);
            return ended(published.map_err(refused), tools.out);
        }
        command => look(&mut tools, command),
    };
    let as_usage = |error| as_usage(error, &bus, &patience.watchdog);
    ended(shown.map_err(as_usage), tools.out)
}

/// The tools over a robot's gateway.
fn from_afar(
    config: &Config,
    endpoint: &Endpoint,
    args: TopicArgs,
    patience: &TimeLimit,
) -> Result<()> {
    if let TopicCommand::Pub { .. } = args.command {
        let what = "--remote only listens; use `lager topic pub` on the robot";
        return Err(exit::Usage(what.to_owned()).into());
    }
    let remote = afar::call(config, endpoint, &patience.shutdown)?;
    let mut tools = Tools {
        place: &remote,
        watchdog: &patience.watchdog,
        shutdown: &patience.shutdown,
        as_json: args.json,
        out: &mut BufWriter::new(std::io::stdout().lock()),
    };
    let shown = look(&mut tools, args.command);
    let as_usage = |error| as_usage(error, &remote, &patience.watchdog);
    ended(shown.map_err(as_usage), tools.out)
}

/// The tools that only look.
fn look<W: Write, P: Origin>(
    tools: &mut Tools<'_, W, P>,
    command: TopicCommand,
) -> Result<(), ToolError> {
    match command {
        TopicCommand::List => tools.list().map(drop),
        TopicCommand::Info { topic } => tools.info(&topic),
        TopicCommand::Echo { watch, field } => {
            let echo = EchoConfig {
                fields: field,
                limits: watch.until.limits(),
            };
            tools.echo(&watch.topic, &echo)
        }
        TopicCommand::Hz { watch } => tools.hz(&watch.topic, watch.until.limits()),
        TopicCommand::Bw { watch } => tools.bandwidth(&watch.topic, watch.until.limits()),
        TopicCommand::Delay { watch } => tools.delay(&watch.topic, watch.until.limits()),
        TopicCommand::Schema { .. } => unreachable!("it needs no bus"),
        TopicCommand::Pub { .. } => unreachable!("it does not only look"),
    }
}

/// Joins the bus.
pub fn join(config: &Config, role: Role, watchdog: &Watchdog) -> Result<Bus> {
    let join = || Bus::open(&config.bus()?, role).map_err(anyhow::Error::from);
    watchdog.over("joining the bus", join)
}

/// If the output's reader has gone, as after `| head`, that is not an error.
fn ended(shown: Result<()>, out: &mut impl Write) -> Result<()> {
    let flushed = shown.and_then(|()| Ok(out.flush().map_err(ToolError::Output)?));
    match flushed {
        Err(error)
            if error
                .downcast_ref()
                .is_some_and(ToolError::is_closed_output) =>
        {
            Ok(())
        }
        flushed => flushed,
    }
}

/// An unknown field or topic makes no sense, whatever the robot does.
fn as_usage(error: ToolError, place: &impl Place, watchdog: &Watchdog) -> anyhow::Error {
    match error {
        ToolError::NoField(error) => exit::Usage(error.to_string()).into(),
        ToolError::Unknown(UnknownTopic(topic)) => anyhow!(unknown(&topic, place, watchdog)),
        error => error.into(),
    }
}

/// Says that there is no such topic, and suggests one of the open topics.
fn unknown(topic: &str, place: &impl Place, watchdog: &Watchdog) -> String {
    let open = watchdog.over("listing the topics", || place.every_topic());
    let open: Vec<String> = open.into_iter().flatten().map(|topic| topic.name).collect();
    unknown_topic(topic, open.iter().map(String::as_str))
}

fn refused(
    error: PublishError,
    is_argument: bool,
    bus: &Bus,
    watchdog: &Watchdog,
) -> anyhow::Error {
    match error {
        PublishError::Payload { topic, error, .. } if is_argument => {
            exit::Usage(format!("{topic}: {error}")).into()
        }
        PublishError::Unknown(ref topic) => {
            let meant = unknown(topic, bus, watchdog);
            anyhow!("{error}; {meant}")
        }
        PublishError::Up {
            topic,
            remedy,
            lock,
        } => {
            let what = format!("{topic} is not published beside a robot: {remedy}");
            // Its own exit code.
            anyhow::Error::from(lock).context(what)
        }
        error => error.into(),
    }
}

fn parsed(text: &str) -> Result<Value> {
    let parsed = serde_json::from_str(text);
    parsed.map_err(|error| exit::Usage(format!("the payload is no JSON: {error}")).into())
}

/// The JSON values on standard input. A thread reads them and ends with the process, because a read
/// from a terminal cannot be stopped.
fn read_on() -> Result<Receiver<Result<Value, String>>> {
    let (to, from) = sync_channel(READ_AHEAD);
    let read = move || {
        let values = serde_json::Deserializer::from_reader(std::io::stdin()).into_iter();
        for value in values {
            let is_end = value.is_err();
            if to.send(value.map_err(|error| error.to_string())).is_err() || is_end {
                break;
            }
        }
    };
    let thread = std::thread::Builder::new().name("input".to_owned());
    thread.spawn(read).context("cannot start a thread")?;
    Ok(from)
}
