//! The lines that `up` shows while it runs; only this file writes them.
//!
//! A terminal that is held (Ctrl-S, a pager) takes no more, and a thread that writes to it waits.
//! So a separate thread writes the lines, and drops those that it cannot write for long.

use std::io::Write;
use std::sync::mpsc::{self, Receiver, SyncSender};
use std::time::Duration;

use anyhow::{Context, Result};

use crate::report::Note;
use crate::voice;

/// How many lines may wait; at a few lines a second that is minutes.
const WAITING: usize = 1_024;
/// How long the last lines may take.
const LAST_LINES: Duration = Duration::from_millis(500);

/// Where the lines go.
pub struct Terminal {
    lines: SyncSender<Note>,
    written: Receiver<()>,
}

impl Terminal {
    /// Writes to standard output, or with `to_stderr` to standard error, so that standard output
    /// stays free for the JSON line.
    pub fn new(to_stderr: bool) -> Result<Self> {
        let (lines, waiting) = mpsc::sync_channel::<Note>(WAITING);
        let (done, written) = mpsc::sync_channel(1);
        std::thread::Builder::new()
            .name("terminal".into())
            .spawn(move || {
                for note in waiting {
                    show(&note, to_stderr);
                }
                let _ = done.send(());
            })
            .context("cannot start a thread for the terminal")?;
        Ok(Self { lines, written })
    }

    /// Shows a line, at once or never.
    pub fn show(&self, note: Note) {
        let _ = self.lines.try_send(note);
    }

    /// Waits until the last line is written, but not for ever.
    pub fn finish(self) {
        drop(self.lines);
        let _ = self.written.recv_timeout(LAST_LINES);
    }
}

fn show(note: &Note, to_stderr: bool) {
    let line = voice::line(note.at, &note.who, &note.text);
    // A closed terminal is no reason to stop a robot.
    let _ = if to_stderr {
        writeln!(std::io::stderr(), "{line}")
    } else {
        writeln!(std::io::stdout(), "{line}")
    };
}
