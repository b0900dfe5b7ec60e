//! What of the robots' states is written: everything new at 20 Hz, and once a second what a map
//! needs. It is pure: views of robots in, lines out.

use std::collections::BTreeMap;
use std::time::Duration;

use lager_lines::Name;
use lager_lines::extension::Report;

use crate::handle::View;
use crate::history::Entry;
use crate::shown::LastTold;
use crate::station::RobotSaid;

/// The lines that are written next, by kind.
#[derive(Debug, Default)]
pub(super) struct Lines {
    /// When the first of them was taken, in ms since 1970.
    pub(super) begin_ms: Option<u64>,
    pub(super) fine: String,
    pub(super) coarse: String,
    pub(super) events: String,
}

impl Lines {
    /// Those of each kind, in the order of [`Kind::ALL`](crate::history::parts::Kind::ALL).
    pub(super) fn of_kinds(&self) -> [&str; 3] {
        [&self.fine, &self.coarse, &self.events]
    }

    pub(super) fn are_none(&self) -> bool {
        self.of_kinds().iter().all(|lines| lines.is_empty())
    }
}

/// What was written of one robot.
#[derive(Debug, Default)]
struct Written {
    fine: LastTold,
    coarse: LastTold,
    /// The last second in which coarse lines were written.
    second: Option<u64>,
}

/// What was written of each robot.
#[derive(Debug, Default)]
pub(super) struct Sampler {
    robots: BTreeMap<Name, Written>,
}

/// When something was that the station's clock shows as `at`, in ms since 1970.
fn wall_ms(now_ms: u64, now: Duration, at: Duration) -> u64 {
    now_ms.saturating_sub(now.saturating_sub(at).as_millis() as u64)
}

impl Sampler {
    /// Takes what is new of the robots at this moment, in ms since 1970.
    pub(super) fn states(&mut self, now_ms: u64, views: &[View], lines: &mut Lines) {
        lines.begin_ms.get_or_insert(now_ms);
        self.robots
            .retain(|name, _| views.iter().any(|view| view.name == *name));
        for view in views {
            let written = self.robots.entry(view.name.clone()).or_default();
            let put = |at, report: &Report, lines: &mut String| {
                let entry = Entry {
                    at_ms: wall_ms(now_ms, view.now, at),
                    robot: view.name.as_str(),
                    line: &report.to_string(),
                };
                entry.put(lines);
            };
            for (at, report) in written.fine.newer(&view.shown) {
                if matches!(
                    report,
                    Report::State(_) | Report::Truth(_) | Report::Latency(_)
                ) {
                    put(at, &report, &mut lines.fine);
                }
            }
            let second = now_ms / 1_000;
            if written.second.replace(second) != Some(second) {
                for (at, report) in written.coarse.newer(&view.shown) {
                    put(at, &report, &mut lines.coarse);
                }
            }
        }
    }

    /// A new part of the coarse kind begins: everything is written again, so that the part can be
    /// read by itself.
    pub(super) fn begin_coarse(&mut self) {
        for written in self.robots.values_mut() {
            written.coarse = LastTold::default();
            written.second = None;
        }
    }

    /// Takes an event, at this moment by both clocks.
    pub(super) fn event(now_ms: u64, now: Duration, news: &RobotSaid, lines: &mut Lines) {
        if let Some(line) = news.told.line() {
            let entry = Entry {
                at_ms: wall_ms(now_ms, now, news.at),
                robot: news.robot.as_str(),
                line: &line,
            };
            entry.put(&mut lines.events);
        }
    }
}
