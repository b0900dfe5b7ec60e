//! The messages of this program: lines for people (`time who what`), and traces for debugging.
//!
//! ```text
//!     6.87 s  logic   drives from (3,0) heading left
//!     7.02 s  bridge  WARNING: the board on /dev/ttyUSB0 has fallen silent
//! ```
//!
//! `up`'s narrator says what the robot does. A fault in a service is an event of `tracing`; it
//! appears in the same form on standard error. Traces are for debugging. They appear in the form of
//! `tracing`, if `RUST_LOG` selects them or `--log` names a file for them. With `--log-json` each
//! trace is a JSON value with the spans around it: the service and its start, a link, a mission and
//! its orders. No frame causes a trace at `info`.

use std::fmt;
use std::fs::File;
use std::io::IsTerminal;
use std::path::Path;
use std::sync::Mutex;
use std::time::Duration;

use anyhow::{Context, Result};
use lager_home::Clock;
use lager_supervisor::Parent;
use lager_supervisor::console;
use tracing::field::{Field, Visit};
use tracing::level_filters::LevelFilter;
use tracing::{Event, Level, Subscriber};
use tracing_subscriber::filter::Targets;
use tracing_subscriber::fmt::FmtContext;
use tracing_subscriber::fmt::MakeWriter;
use tracing_subscriber::fmt::format::{FmtSpan, FormatEvent, FormatFields, Writer};
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::registry::LookupSpan;
use tracing_subscriber::util::SubscriberInitExt;
use tracing_subscriber::{Layer, Registry};

use crate::config::{Config, LogSection};

/// The traces that go into a file, or out as JSON, if `RUST_LOG` does not choose.
const UNASKED: LevelFilter = LevelFilter::INFO;

/// Who speaks, and where this speaker's time begins.
#[derive(Clone, Copy, Debug)]
pub enum Speaker {
    /// A tool for a person who waits; it says `lager: what`.
    Tool,
    /// A process of a robot that is up.
    Service {
        /// Its name.
        who: &'static str,
        /// When the robot was started, in ns of `CLOCK_MONOTONIC`.
        started_ns: u64,
        /// Robot time per real time.
        speed: f64,
    },
}

impl Speaker {
    /// The service `who`. If `parent` has started it, the robot's time begins with that supervisor.
    pub fn service(who: &'static str, parent: Option<Parent>, config: &Config) -> Self {
        Self::Service {
            who,
            started_ns: parent.map_or_else(Clock::monotonic_ns, |parent| parent.started_ns),
            speed: config.speed,
        }
    }

    /// A line of this speaker.
    pub fn line(&self, what: &str) -> String {
        match self {
            Self::Tool => format!("lager: {what}"),
            Self::Service {
                who,
                started_ns,
                speed,
            } => {
                let real = Duration::from_nanos(Clock::monotonic_ns().saturating_sub(*started_ns));
                console::line(real.mul_f64(*speed), who, what)
            }
        }
    }
}

/// From now on warnings of this process are lines of `speaker`, and traces go to their place.
///
/// # Errors
/// The file cannot be written, or `RUST_LOG` is not a list of targets and levels.
pub fn begin(speaker: Speaker, log: &LogSection) -> Result<()> {
    let wanted = wanted(std::env::var("RUST_LOG").ok().as_deref())?;
    let unasked = || Targets::new().with_default(UNASKED);
    let file = log.file.as_deref().map(open).transpose()?;
    let (in_file, on_terminal) = match file {
        Some(file) => {
            let filter = wanted.unwrap_or_else(unasked);
            (
                Some(traces(Mutex::new(file), false, log.json, filter)),
                None,
            )
        }
        None if log.json => (None, Some(wanted.unwrap_or_else(unasked))),
        None => (None, wanted),
    };
    let terminal = match on_terminal {
        Some(filter) => {
            let is_coloured = std::io::stderr().is_terminal();
            traces(std::io::stderr, is_coloured, log.json, filter)
        }
        None => tracing_subscriber::fmt::layer()
            .with_writer(std::io::stderr)
            .event_format(Lines(speaker))
            // If nobody reads standard error any more, there is no other place for that news.
            .log_internal_errors(false)
            .with_filter(faults())
            .boxed(),
    };
    let registry = Registry::default().with(terminal).with(in_file);
    #[cfg(feature = "zenoh")]
    let registry = registry.with(lager_remote::causes());
    registry.init();
    Ok(())
}

/// Whether processes of a robot write traces to standard error, and not lines.
pub fn are_shown(log: &LogSection) -> bool {
    let asked = std::env::var("RUST_LOG").is_ok_and(|text| !text.trim().is_empty());
    log.file.is_none() && (log.json || asked)
}

/// Which events appear by default. A broken connection of a viewer or a listener is not a fault of
/// the robot.
fn faults() -> Targets {
    Targets::new()
        .with_default(LevelFilter::WARN)
        .with_target("foxglove", LevelFilter::OFF)
        // And all its crates, whose names begin so.
        .with_target("zenoh", LevelFilter::OFF)
}

/// A layer in a box, whatever it writes.
type Traces<S> = Box<dyn Layer<S> + Send + Sync>;

/// Traces for people or programs, with a line for the begin and the end of each span.
fn traces<S>(
    to: impl for<'a> MakeWriter<'a> + Send + Sync + 'static,
    is_coloured: bool,
    as_json: bool,
    filter: Targets,
) -> Traces<S>
where
    S: Subscriber + for<'a> LookupSpan<'a>,
{
    let layer = tracing_subscriber::fmt::layer()
        .with_writer(to)
        .with_ansi(is_coloured)
        .log_internal_errors(false)
        .with_span_events(FmtSpan::NEW | FmtSpan::CLOSE);
    match as_json {
        true => layer.json().flatten_event(true).with_filter(filter).boxed(),
        false => layer.with_filter(filter).boxed(),
    }
}

/// What `RUST_LOG` selects: nothing if it is unset or empty.
fn wanted(text: Option<&str>) -> Result<Option<Targets>> {
    let Some(text) = text.filter(|text| !text.trim().is_empty()) else {
        return Ok(None);
    };
    let targets = text.parse().with_context(|| {
        format!("RUST_LOG is `{text}`; write levels and targets, such as `info` or `warn,lager_bridge=debug`")
    })?;
    Ok(Some(targets))
}

fn open(path: &Path) -> Result<File> {
    File::options()
        .append(true)
        .create(true)
        .open(path)
        .with_context(|| format!("cannot write the log {}", path.display()))
}

/// Events as lines of a speaker.
struct Lines(Speaker);

impl<S, N> FormatEvent<S, N> for Lines
where
    S: Subscriber + for<'a> LookupSpan<'a>,
    N: for<'a> FormatFields<'a> + 'static,
{
    fn format_event(
        &self,
        _: &FmtContext<'_, S, N>,
        mut writer: Writer<'_>,
        event: &Event<'_>,
    ) -> fmt::Result {
        let mut said = Said::default();
        event.record(&mut said);
        let mark = match *event.metadata().level() {
            Level::ERROR => "ERROR: ",
            Level::WARN => "WARNING: ",
            _ => "",
        };
        let Said { what, beside } = said;
        writeln!(writer, "{}", self.0.line(&format!("{mark}{what}{beside}")))
    }
}

/// The text of an event, and the values beside it.
#[derive(Default)]
struct Said {
    what: String,
    beside: String,
}

impl Visit for Said {
    fn record_debug(&mut self, field: &Field, value: &dyn fmt::Debug) {
        use fmt::Write;
        // Writing to a String cannot fail.
        let _ = match field.name() {
            "message" => write!(self.what, "{value:?}"),
            name => write!(self.beside, " ({name} {value:?})"),
        };
    }
}

/// From now on a fault of the program itself is a sentence as well. With `RUST_BACKTRACE` set, the
/// calls that led there follow. The process or its thread still ends.
pub fn say_of_faults(speaker: Speaker) {
    // The present hook prints those calls.
    let _ = std::panic::take_hook();
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |fault| {
        let payload = fault.payload();
        let text = payload.downcast_ref::<&str>().copied();
        let text = text.or_else(|| payload.downcast_ref::<String>().map(String::as_str));
        let place = fault.location().map(ToString::to_string);
        console::complain(&speaker.line(&fault_sentence(
            text.unwrap_or("nothing is said"),
            &place.unwrap_or_default(),
        )));
        if std::env::var_os("RUST_BACKTRACE").is_some() {
            usual(fault);
        }
    }));
}

fn fault_sentence(what: &str, place: &str) -> String {
    format!(
        "something that must not happen has happened: {what} (at {place}); if the machine is not \
         short of anything (`lager doctor`), it is a fault of this program: please report it"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_of_the_program_is_told_with_its_place_and_what_to_do() {
        let said = fault_sentence("the directory stream is invalid", "directory.rs:278:13");
        assert!(said.contains("the directory stream is invalid (at directory.rs:278:13)"));
        assert!(
            said.contains("`lager doctor`") && said.contains("report it"),
            "{said}"
        );
    }

    #[test]
    fn what_is_asked_for_is_levels_and_targets() {
        assert!(wanted(None).unwrap().is_none());
        assert!(wanted(Some(" ")).unwrap().is_none());
        let targets = wanted(Some("warn,lager_bridge=debug")).unwrap().unwrap();
        assert!(targets.would_enable("lager_bridge::reader", &Level::DEBUG));
        assert!(!targets.would_enable("lager_logic", &Level::INFO));
        let error = wanted(Some("lager_bridge=loud")).unwrap_err().to_string();
        assert!(
            error.contains("lager_bridge=loud") && error.contains("`info`"),
            "{error}"
        );
    }
}
