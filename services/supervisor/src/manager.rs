//! The service manager that has started this program, such as systemd: it is told when the service
//! is ready, what it does, and that it goes on (`Type=notify` and `WatchdogSec=` of a unit).
//!
//! ```text
//!   main loop ── word, never waits ──> thread ── sd_notify ──> $NOTIFY_SOCKET
//! ```
//! A manager that does not read makes a writer wait, so a thread of its own writes. It sends a sign
//! of life only for each that the main loop has given, so a main loop that hangs gives none. Without
//! $NOTIFY_SOCKET nothing happens.

use std::sync::mpsc::{self, Receiver, SyncSender};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use sd_notify::NotifyState;

/// The variables by which a manager speaks to the process that it starts, and to no other.
pub(crate) const VARIABLES: [&str; 3] = ["NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID"];

/// How many words may wait for a manager that does not read.
const WAITING: usize = 16;
/// A manager that hears nothing for its watchdog's time kills the service. This many signs of life
/// fit into that time, so that a late one does no harm.
const SIGNS: u32 = 4;
/// The longest status, in characters. It is one line of `systemctl status`.
const LONGEST: usize = 200;

/// How long this process waits until its last word is sent.
const LAST_WORD: Duration = Duration::from_millis(100);

/// The manager, if there is one.
#[derive(Clone, Debug)]
pub struct ServiceManager {
    words: Option<SyncSender<Word>>,
    /// How often it gets a sign of life, if it wants any.
    rhythm: Option<Duration>,
    fed: Option<Instant>,
    is_ready: bool,
}

/// What it is told.
#[derive(Debug)]
enum Word {
    Ready,
    Status(String),
    GoesOn,
    /// The last one. The sender hears when it is sent.
    Stopping(SyncSender<()>),
}

impl ServiceManager {
    /// The manager of this process.
    ///
    /// # Errors
    /// The system has no thread for it.
    pub fn of_this_process() -> Result<Self> {
        let mut manager = Self {
            words: None,
            rhythm: sd_notify::watchdog_enabled().map(|limit| limit / SIGNS),
            fed: None,
            is_ready: false,
        };
        if std::env::var_os(VARIABLES[0]).is_none() {
            return Ok(manager);
        }
        let (words, waiting) = mpsc::sync_channel(WAITING);
        std::thread::Builder::new()
            .name("manager".into())
            .spawn(move || pass_on(&waiting))
            .context("cannot start a thread for the service manager")?;
        manager.words = Some(words);
        Ok(manager)
    }

    /// The service does its work from now on. Only the first call counts.
    pub fn ready(&mut self) {
        self.is_ready = self.is_ready || self.tell(Word::Ready);
    }

    /// Whether that was said, or nobody wants to know it.
    pub(crate) fn knows(&self) -> bool {
        self.is_ready || self.words.is_none()
    }

    /// What the service does, in one line. Every user can read it, so it holds no secret.
    pub fn status(&self, text: &str) {
        if self.words.is_some() {
            self.tell(Word::Status(one_line(text)));
        }
    }

    /// The main loop has made progress. Call it at least as often as [`Self::rhythm`] says.
    pub fn goes_on(&mut self) {
        let is_due = |fed: Instant| self.rhythm.is_some_and(|rhythm| fed.elapsed() >= rhythm);
        if self.rhythm.is_some() && self.fed.is_none_or(is_due) && self.tell(Word::GoesOn) {
            self.fed = Some(Instant::now());
        }
    }

    /// How often the manager wants a sign of life, if it wants any.
    #[must_use]
    pub fn rhythm(&self) -> Option<Duration> {
        self.rhythm
    }

    /// The service ends now. A manager that does not read holds this process up for a moment only.
    pub fn stopping(&self) {
        let (sent, is_sent) = mpsc::sync_channel(1);
        if self.tell(Word::Stopping(sent)) {
            let _ = is_sent.recv_timeout(LAST_WORD);
        }
    }

    /// Returns whether the word is on its way.
    fn tell(&self, word: Word) -> bool {
        let words = self.words.as_ref();
        words.is_some_and(|words| words.try_send(word).is_ok())
    }
}

/// Sends the words, as long as somebody may say one.
fn pass_on(words: &Receiver<Word>) {
    let mut is_deaf = false;
    while let Ok(word) = words.recv() {
        let state = match &word {
            Word::Ready => NotifyState::Ready,
            Word::Status(text) => NotifyState::Status(text),
            Word::GoesOn => NotifyState::Watchdog,
            Word::Stopping(_) => NotifyState::Stopping,
        };
        let sent = sd_notify::notify(&[state]);
        if let (Err(error), false) = (&sent, is_deaf) {
            tracing::warn!("the service manager does not hear this process: {error}");
        }
        is_deaf = sent.is_err();
        if let Word::Stopping(sent) = word {
            let _ = sent.send(());
        }
    }
}

/// The beginning of a text, without its ends of lines: each would begin another message.
fn one_line(text: &str) -> String {
    let begin: String = text.chars().take(LONGEST).collect();
    begin.replace(char::is_control, " ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_status_is_one_line_and_no_other_message() {
        assert_eq!(one_line("drives\nREADY=1"), "drives READY=1");
        let long = "å".repeat(LONGEST);
        assert_eq!(one_line(&(long.clone() + "s")), long);
    }
}
