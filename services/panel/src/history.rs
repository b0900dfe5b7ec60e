//! The station's history for who looks: any time of a robot as a table or as lines of JSON.
//!
//! ```text
//!   GET /history/states.csv?robot=r1[&since=<ms>][&until=<ms>]   a table; the heads have the units
//!   GET /history/states?robot=r1[&since=<ms>][&until=<ms>]       the same, an object in each line
//!   GET /history/events?robot=r1[&since=<ms>][&until=<ms>]       {"at_ms": <ms>, "line": <line>}
//!     [&most=<number>][&only=<event>,<event>]
//!   GET /history/lines?robot=r1[&since=<ms>][&until=<ms>]        likewise, its states and latencies
//!   GET /history/moment?robot=r1&at=<ms>                         likewise, the last of each report
//! ```
//!
//! Times are in ms since 1970; in the table in s, as a number, because a program reads that in every
//! language and zone. Without `until` a time ends now, and without `since` it begins ten
//! minutes before its end. `<line>` is a line of the station's extension, `thought <text>` or
//! `asked <name> <what>`, as in [`speech`](crate::speech). With `most` only the newest events are
//! told, and with `only` those of these kinds; `lines` tells at most one state in [`APART_MS`].
//!
//! A thread of its own reads the files for each answer, and at most [`MOST`] answers are under way.
//! It reads on only as fast as the browser takes it in, and gives up when the browser takes in nothing
//! for [`SLOW`]. So no answer takes much memory or delays what else the panel does.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io;
use std::ops::{ControlFlow, RangeInclusive};
use std::time::{Duration, Instant};

use axum::body::{Body, Bytes};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse as _, Response};
use futures_util::stream::unfold;
use lager_lines::Name;
use lager_lines::extension::{Happened, Latency, Report};
use lager_station::{Entry, History};
use lager_topics::Durations;
use serde_json::{Map, Value, json};
use tokio::sync::mpsc::error::TrySendError;
use tokio::sync::{OwnedSemaphorePermit, mpsc};

/// Answers that may be under way at once.
pub(crate) const MOST: usize = 4;
/// How long a browser may take in nothing.
const SLOW: Duration = Duration::from_secs(10);
/// How often the thread looks whether the browser has taken something in.
const LOOK: Duration = Duration::from_millis(5);
/// An answer is sent in pieces of about so many bytes.
const PIECE: usize = 32 * 1024;
/// The time before the end that is meant when nobody says since when, in ms.
const USUAL_MS: u64 = 600_000;

/// `lines` leaves out a state that came sooner than this after the one before it, in ms: a curve of
/// a minute that is as wide as a hand needs no more.
const APART_MS: u64 = 400;

/// What somebody wants to know.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Wanted {
    /// The states of a time: as a table, or as JSON.
    States {
        robot: Name,
        span: RangeInclusive<u64>,
        is_table: bool,
    },
    /// What happened in a time.
    Events {
        robot: Name,
        span: RangeInclusive<u64>,
        /// The newest ones, at most so many.
        most: usize,
        /// Events of these kinds; empty: all that happened.
        only: Vec<String>,
    },
    /// What map and curves show of a time.
    Lines {
        robot: Name,
        span: RangeInclusive<u64>,
    },
    /// What was known at a moment.
    Moment { robot: Name, at_ms: u64 },
}

impl Wanted {
    /// Reads what follows `/history/`, and the words after the question mark.
    ///
    /// # Errors
    /// What is wrong with it, as a sentence.
    pub(crate) fn read(what: &str, query: &str, now_ms: u64) -> Result<Self, String> {
        let mut words = BTreeMap::new();
        for word in query.split('&').filter(|word| !word.is_empty()) {
            let (key, value) = word.split_once('=').unwrap_or((word, ""));
            if !["robot", "since", "until", "at", "most", "only"].contains(&key) {
                return Err(format!(
                    "{key} stands in the address; robot, since, until, at, most and only may stand there"
                ));
            }
            words.insert(key, value);
        }
        let robot = words.get("robot").copied().unwrap_or_default();
        let robot = Name::new(robot).map_err(|error| format!("robot={robot}: {error}"))?;
        let number = |key, wanted| match words.get(key) {
            None => Ok(None),
            Some(text) => match text.parse::<u64>() {
                Ok(number) => Ok(Some(number)),
                Err(_) => Err(format!("{key}={text}: {wanted} belongs here")),
            },
        };
        let time = |key| number(key, "a time in ms since 1970");
        let until = time("until")?.unwrap_or(now_ms);
        let since = time("since")?.unwrap_or(until.saturating_sub(USUAL_MS));
        let span = since..=until;
        match what {
            "states.csv" | "states" => Ok(Self::States {
                robot,
                span,
                is_table: what == "states.csv",
            }),
            "events" => Ok(Self::Events {
                robot,
                span,
                most: number("most", "a number of events")?
                    .map_or(usize::MAX, |most| most as usize),
                only: match words.get("only") {
                    None => Vec::new(),
                    Some(only) => only.split(',').map(event).collect::<Result<_, _>>()?,
                },
            }),
            "lines" => Ok(Self::Lines { robot, span }),
            "moment" => Ok(Self::Moment {
                robot,
                at_ms: time("at")?.unwrap_or(now_ms),
            }),
            _ => Err("the history has states.csv, states, events, lines and moment".to_owned()),
        }
    }
}

/// The word of an event, if it is one.
fn event(word: &str) -> Result<String, String> {
    match Happened::all().any(|kind| kind.as_str() == word) {
        true => Ok(word.to_owned()),
        false => {
            let all: Vec<_> = Happened::all().map(Happened::as_str).collect();
            Err(format!(
                "only={word}: {word} is no event; {} are",
                all.join(", ")
            ))
        }
    }
}

/// Begins an answer.
pub(crate) fn answer(history: History, wanted: Wanted, permit: OwnedSemaphorePermit) -> Response {
    let (to, from) = mpsc::channel(2);
    let kind = match &wanted {
        Wanted::States { is_table: true, .. } => "text/csv; charset=utf-8",
        _ => "application/x-ndjson",
    };
    let read = move || {
        let mut pieces = Pieces {
            to,
            next: String::new(),
        };
        let told = tell(&history, wanted, &mut pieces);
        let _ = pieces.flush();
        if let Err(error) = told {
            tracing::warn!("the history cannot be read: {error}");
            pieces.fail(error);
        }
    };
    let thread = std::thread::Builder::new().name("history-read".into());
    if let Err(error) = thread.spawn(read) {
        tracing::warn!("the history is not read: {error}");
        return StatusCode::SERVICE_UNAVAILABLE.into_response();
    }
    // The next answer may begin when this one is sent or its connection has ended.
    let pieces = unfold((from, permit), |(mut from, permit)| async move {
        let piece: io::Result<Bytes> = from.recv().await?;
        Some((piece, (from, permit)))
    });
    // A connection that may stay for this answer must not stay for others.
    let head = [(header::CONTENT_TYPE, kind), (header::CONNECTION, "close")];
    (head, Body::from_stream(pieces)).into_response()
}

/// The text on its way to the browser.
struct Pieces {
    to: mpsc::Sender<io::Result<Bytes>>,
    next: String,
}

impl Pieces {
    /// Adds a line. Breaks if the browser takes nothing in.
    fn line(&mut self, line: &str) -> ControlFlow<()> {
        self.next.push_str(line);
        self.next.push('\n');
        match self.next.len() < PIECE {
            true => ControlFlow::Continue(()),
            false => self.flush(),
        }
    }

    fn flush(&mut self) -> ControlFlow<()> {
        let piece = std::mem::take(&mut self.next);
        match piece.is_empty() {
            true => ControlFlow::Continue(()),
            false => self.send(Ok(Bytes::from(piece))),
        }
    }

    /// Ends the answer in a way that the browser takes for a failure.
    fn fail(&mut self, error: io::Error) {
        let _ = self.send(Err(error));
    }

    fn send(&mut self, mut piece: io::Result<Bytes>) -> ControlFlow<()> {
        let since = Instant::now();
        loop {
            piece = match self.to.try_send(piece) {
                Ok(()) => return ControlFlow::Continue(()),
                Err(TrySendError::Full(piece)) if since.elapsed() < SLOW => piece,
                Err(_) => return ControlFlow::Break(()),
            };
            std::thread::sleep(LOOK);
        }
    }
}

fn tell(history: &History, wanted: Wanted, pieces: &mut Pieces) -> io::Result<()> {
    let line = |at_ms: u64, line: &str| json!({ "at_ms": at_ms, "line": line }).to_string();
    match wanted {
        Wanted::States {
            robot,
            span,
            is_table,
        } => {
            if is_table {
                let heads: Vec<_> = COLUMNS.iter().map(|column| column.head).collect();
                // Whoever does not take the first line takes none.
                let _ = pieces.line(&format!("unix_time_s,{}", heads.join(",")));
            }
            let mut latency = None;
            history.states(&robot, &span, |entry| {
                if entry.word() == "latency" {
                    latency = quantiles(entry).or(latency);
                }
                match (entry.is_state(), is_table) {
                    (false, _) => ControlFlow::Continue(()),
                    (true, true) => pieces.line(&row(entry, latency)),
                    (true, false) => pieces.line(&object(entry, latency)),
                }
            })
        }
        Wanted::Events {
            robot,
            span,
            most,
            only,
        } => {
            let mut events = history.events(Some(&robot), &span)?;
            events.retain(|(_, _, text)| is_of(text, &only));
            let mut events = events.iter().skip(events.len().saturating_sub(most));
            let _ = events.try_for_each(|(_, at_ms, text)| pieces.line(&line(*at_ms, text)));
            Ok(())
        }
        Wanted::Lines { robot, span } => {
            let mut next_ms = 0;
            history.states(&robot, &span, |entry| {
                let is_wanted = match entry.word() {
                    "state" => entry.at_ms >= next_ms,
                    word => word == "latency",
                };
                if entry.is_state() && is_wanted {
                    next_ms = entry.at_ms + APART_MS;
                }
                match is_wanted {
                    true => pieces.line(&line(entry.at_ms, entry.line)),
                    false => ControlFlow::Continue(()),
                }
            })
        }
        Wanted::Moment { robot, at_ms } => {
            let known = history.moment(&robot, at_ms)?;
            let mut known = known.iter();
            let _ = known.try_for_each(|(at_ms, text)| pieces.line(&line(*at_ms, text)));
            Ok(())
        }
    }
}

/// Whether a line is an event of one of these kinds; if there are none, every line is.
fn is_of(line: &str, only: &[String]) -> bool {
    let kind = line
        .strip_prefix("event ")
        .and_then(|rest| rest.split(' ').next());
    only.is_empty() || kind.is_some_and(|kind| only.iter().any(|one| one == kind))
}

/// A column of the table.
struct Column {
    /// Its name, with the unit where there is one.
    head: &'static str,
    from: From,
}

/// Where a column's figure comes from.
enum From {
    /// A number under this key of the state.
    Number(&'static str),
    /// A text under this key.
    Text(&'static str),
    /// A number of tenths under this key.
    Tenths(&'static str),
    /// The sum of the numbers under these keys.
    Sum(&'static [&'static str]),
    /// One of the latencies.
    Latency(usize),
}

macro_rules! columns {
    ($($head:literal: $kind:ident($from:expr)),* $(,)?) => {
        &[$(Column { head: $head, from: From::$kind($from) }),*]
    };
}

/// What stands in the table (E11), by the keys of [`State`](lager_lines::extension::State).
const COLUMNS: &[Column] = columns! {
    "x_mm": Number("x_mm"),
    "y_mm": Number("y_mm"),
    "line_error_half_sensors": Number("line_error"),
    "left_duty_of_255": Number("left_duty"),
    "right_duty_of_255": Number("right_duty"),
    "distance_cm": Number("distance_cm"),
    "battery_V": Tenths("battery_dv"),
    "battery_percent": Number("battery_percent"),
    "battery_left_s": Number("battery_left_s"),
    "path_p50_us": Latency(0),
    "path_p99_us": Latency(1),
    "heading_deg": Number("heading_deg"),
    "looks": Text("looks"),
    "mode": Text("mode"),
    "phase": Text("phase"),
    "node": Text("node"),
    "next": Text("next"),
    "code": Text("code"),
    "stopped": Number("stopped"),
    "order": Number("order"),
    "product": Number("product"),
    "line_bits": Text("line_bits"),
    "servos_of_1023": Text("servos"),
    "loads_of_1023": Text("loads"),
    "servo_errors": Text("servo_errors"),
    "lost_packets": Sum(&["sensor_lost", "steering_lost", "bus_lost"]),
};

/// The figures of a state by their columns; `Null` is not known.
fn figures(entry: &Entry<'_>, latency: Option<[u64; 2]>) -> Vec<Value> {
    let fields = entry.line.split(' ').skip(1);
    let fields: BTreeMap<_, _> = fields.filter_map(|field| field.split_once('=')).collect();
    let number = |key: &str| fields.get(key)?.parse::<i64>().ok();
    let figure = |column: &Column| match column.from {
        From::Number(key) => json!(number(key)),
        From::Text(key) => json!(fields.get(key)),
        From::Tenths(key) => json!(number(key).map(|tenths| tenths as f64 / 10.0)),
        From::Sum(keys) => json!(keys.iter().filter_map(|key| number(key)).sum::<i64>()),
        From::Latency(which) => json!(latency.map(|both| both[which])),
    };
    COLUMNS.iter().map(figure).collect()
}

/// A line of the table. A text with a comma or a quotation mark stands in such marks, and each that
/// is in it is doubled (RFC 4180).
fn row(entry: &Entry<'_>, latency: Option<[u64; 2]>) -> String {
    let mut row = format!("{}.{:03}", entry.at_ms / 1_000, entry.at_ms % 1_000);
    for figure in figures(entry, latency) {
        row.push(',');
        // Writing to a text cannot fail.
        let _ = match figure {
            Value::Null => Ok(()),
            Value::String(text) if text.contains([',', '"']) => {
                write!(row, "\"{}\"", text.replace('"', "\"\""))
            }
            Value::String(text) => row.write_str(&text),
            number => write!(row, "{number}"),
        };
    }
    row
}

/// The same as an object of JSON.
fn object(entry: &Entry<'_>, latency: Option<[u64; 2]>) -> String {
    let heads = COLUMNS.iter().map(|column| column.head.to_owned());
    let mut object: Map<_, _> = heads.zip(figures(entry, latency)).collect();
    object.insert("at_ms".into(), json!(entry.at_ms));
    Value::Object(object).to_string()
}

/// Median and 99th percentile of a report of latencies, in us; `None` if it measured nothing.
fn quantiles(entry: &Entry<'_>) -> Option<[u64; 2]> {
    let Some(Ok(Report::Latency(latency))) = Report::read(entry.line) else {
        return None;
    };
    let Latency { max_us, buckets } = *latency;
    let counted = Durations {
        max_ns: u64::from(max_us) * 1_000,
        buckets: buckets.map(u64::from),
        ..Durations::default()
    };
    let is_counted = buckets.iter().any(|count| *count > 0);
    is_counted.then(|| [0.5, 0.99].map(|part| (counted.quantile_ns(part) + 500) / 1_000))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_wanted_has_its_usual_times_and_mistakes_are_named() {
        let now_ms = 1_795_449_546_120;
        let robot = Name::new("r1").unwrap();
        let read = |what, query| Wanted::read(what, query, now_ms);
        let span = now_ms - 600_000..=now_ms;
        let is_table = true;
        assert_eq!(
            read("states.csv", "robot=r1"),
            Ok(Wanted::States {
                robot: robot.clone(),
                span,
                is_table
            })
        );
        assert_eq!(
            read("events", "since=5&robot=r1&until=7"),
            Ok(Wanted::Events {
                robot: robot.clone(),
                span: 5..=7,
                most: usize::MAX,
                only: Vec::new(),
            })
        );
        assert_eq!(
            read("moment", "robot=r1&at=9"),
            Ok(Wanted::Moment { robot, at_ms: 9 })
        );
        for (what, query, words) in [
            ("states", "", "1 to 32 characters"),
            ("states", "robot=R1", "column 1"),
            ("states", "robot=r1&since=-5", "since=-5: a time in ms"),
            (
                "states",
                "robot=r1&untill=5",
                "untill stands in the address",
            ),
            (
                "all",
                "robot=r1",
                "states.csv, states, events, lines and moment",
            ),
            (
                "events",
                "robot=r1&most=all",
                "most=all: a number of events",
            ),
            ("events", "robot=r1&only=stopped,fell", "fell is no event"),
        ] {
            let why = read(what, query).unwrap_err();
            assert!(why.contains(words), "{why}");
        }
    }

    #[test]
    fn only_the_events_that_are_asked_for_are_told() {
        let only = ["stopped".to_owned()];
        assert!(is_of("event stopped 1 0 - - ordered comm", &only));
        assert!(!is_of("event next_node 1 0 - -", &only));
        assert!(!is_of("thought stopped", &only));
        assert!(is_of("thought stopped", &[]));
    }

    #[test]
    fn a_state_is_a_row_of_as_many_cells_as_there_are_heads() {
        let entry = Entry {
            at_ms: 1_795_449_546_007,
            robot: "r1",
            line: "state x_mm=-4 node=1,0 servos=1,2,3,4,5,6,7,- battery_dv=114 battery_percent=62 sensor_lost=2 bus_lost=3",
        };
        let row = row(&entry, Some([123, 456]));
        let known =
            "1795449546.007,-4,,,,,,11.4,62,,123,456,,,,,\"1,0\",,,,,,,\"1,2,3,4,5,6,7,-\",,,5";
        assert_eq!(row, known);
        let outside: String = row.split('"').step_by(2).collect();
        assert_eq!(outside.matches(',').count(), COLUMNS.len());
        let object: Value = serde_json::from_str(&object(&entry, None)).unwrap();
        assert_eq!(object["at_ms"], 1_795_449_546_007_u64);
        assert_eq!(object["battery_V"], 11.4);
        assert_eq!(object["battery_percent"], 62);
        assert_eq!(object["node"], "1,0");
        assert_eq!(object["path_p50_us"], Value::Null);
    }

    #[test]
    fn latencies_are_told_by_their_quantiles() {
        let entry = |line| Entry {
            at_ms: 0,
            robot: "r1",
            line,
        };
        assert_eq!(quantiles(&entry("latency 0")), None);
        let [median, most] = quantiles(&entry("latency 700 40 99 45 1")).unwrap();
        assert!(median < most && most <= 700, "{median} {most}");
    }
}
