//! How the robot's processes are, as `top` shows it.

use std::time::Duration;

use lager_topics::called;

/// Whether a process that writes a topic runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Life {
    /// It wrote a recording; nobody checks it any more.
    Recorded,
    /// It runs.
    #[default]
    Alive,
    /// A signal has frozen it.
    Frozen,
    /// Somebody killed it, and its ports are still on the bus.
    Dead,
}

impl Life {
    /// In a word.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Recorded => "-",
            Self::Alive => "alive",
            Self::Frozen => "frozen",
            Self::Dead => "dead",
        }
    }
}

/// A process of the robot that stands still.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failing {
    /// Its role, or its name on the command line.
    pub(crate) who: String,
    /// Its process; 0 if it is on another machine.
    pub(crate) pid: u32,
    /// How long it has given no sign of life; `None` if it is frozen.
    pub(crate) silent: Option<Duration>,
}

impl Failing {
    /// What is wrong, and what helps.
    pub(crate) fn said(&self) -> String {
        let (who, pid) = (called(&self.who), self.pid);
        match self.silent {
            Some(long) if pid == 0 => format!(
                "nothing has come from the robot's {who} for {}; all below is as old",
                span(long)
            ),
            None => {
                format!("the {who}, process {pid}, is frozen; `kill -CONT {pid}` lets it go on")
            }
            Some(long) => format!(
                "the {who}, process {pid}, has not gone on for {}",
                span(long)
            ),
        }
    }
}

/// A span in a few letters.
pub(crate) fn span(span: Duration) -> String {
    let seconds = span.as_secs_f64();
    match seconds {
        s if s < 1.0 => format!("{:.0} ms", s * 1e3),
        s if s < 60.0 => format!("{s:.1} s"),
        s if s < 3_600.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.0} h", s / 3_600.0),
    }
}
