//! Keeps the latest events for a station that was not there, or that has started again and
//! forgotten them. Comm tells all of them on each connection; the station ignores those that it
//! knows.

use std::collections::VecDeque;

use lager_lines::extension::Report;

/// How much is kept. All of it fits into the queue for a peer.
const MOST: usize = 150;

/// Events and the values of thoughts, the oldest first, each with its time in ns of real time.
#[derive(Clone, Debug, Default)]
pub(crate) struct Memory {
    kept: VecDeque<(u64, Report)>,
}

impl Memory {
    pub(crate) fn keep(&mut self, now_ns: u64, report: Report) {
        if self.kept.len() == MOST {
            self.kept.pop_front();
        }
        self.kept.push_back((now_ns, report));
    }

    /// All of it, with its age at this moment.
    pub(crate) fn told(&self, now_ns: u64) -> impl Iterator<Item = Report> {
        self.kept.iter().map(move |(at_ns, report)| Report::Past {
            ago_ms: now_ns.saturating_sub(*at_ns) / 1_000_000,
            report: Box::new(report.clone()),
        })
    }
}
