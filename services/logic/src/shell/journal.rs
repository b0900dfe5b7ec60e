//! The shell's journal, `nav/inputs`: what the navigator was told and when, with proofs of what it
//! did. It is written after everything that went out because of an input.
//!
//! Entries are gathered and published in pieces, for observers only: an entry takes no allocation
//! and no call of the system. A piece goes out when it is full, and at the latest at the end of the
//! first turn 50 ms after its first entry. That much is not told if the process is killed.

use core::time::Duration;

use lager_ports::{Bus, Clock, PortError, Publisher, SendError};
use lager_topics::{
    NavInputs, Sent, SteeringReport, TextKind, Told, ToldInputs, ToldKind, WarehouseMap,
};
use serde::Serialize;

use crate::navigator::{Input, Navigator};
use crate::output::Output;
use crate::told::{self, Beginning};

/// How long an entry may wait to be published, in real time.
const FLUSH_NS: u64 = 50_000_000;

/// Room for a map with products on every place, so that a new one takes no allocation.
const LONGEST_TEXT: usize = 16 << 10;

/// How far the shell's publishers have come.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Places {
    pub(super) commands: Sent,
    pub(super) statuses: Sent,
    pub(super) events: Sent,
}

/// Writes down what the navigator is told.
pub(super) struct Journal {
    to: Publisher<NavInputs>,
    piece: Box<ToldInputs>,
    /// When the piece has to go out, by the stamps' clock.
    due_ns: u64,
    /// Number of the next entry.
    next: u64,
    /// How far the publishers had come before the next entry.
    before: Places,
    /// The map that was told last.
    map: Option<Box<WarehouseMap>>,
    text: Vec<u8>,
}

impl Journal {
    /// Of a navigator that has begun like this.
    pub(super) fn begin(
        bus: &Bus,
        beginning: &Beginning,
        before: Places,
    ) -> Result<Self, PortError> {
        let mut journal = Self {
            to: bus.publisher()?,
            piece: Box::default(),
            due_ns: 0,
            next: 0,
            before,
            map: None,
            text: Vec::with_capacity(LONGEST_TEXT),
        };
        if let Err(error) = journal.say(TextKind::Began, beginning) {
            tracing::warn!("how the navigator began cannot be told: {error}");
        }
        Ok(journal)
    }

    /// Writes an input down that the navigator has handled, when all that follows from it is out.
    pub(super) fn told(
        &mut self,
        now: Duration,
        input: &Input<'_>,
        navigator: &Navigator,
        output: &Output,
        after: Places,
    ) -> Result<(), SendError> {
        let mut entry = told::entry(now, input);
        told::answer(&mut entry, navigator, output);
        let learnt = match *input {
            Input::Map(map) => self.learn(map),
            _ => Ok(()),
        };
        let report = match *input {
            Input::Steering(report) => Some(report),
            _ => None,
        };
        let added = self.add(entry, report, after);
        learnt.and(added)
    }

    /// Writes down that the order or the status went out again.
    pub(super) fn again(
        &mut self,
        now: Duration,
        kind: ToldKind,
        after: Places,
    ) -> Result<(), SendError> {
        let entry = told::again(now.as_nanos() as u64, kind);
        self.add(entry, None, after)
    }

    /// Publishes what has waited for long enough.
    pub(super) fn keep_time(&mut self) -> Result<(), SendError> {
        match Clock::monotonic_ns() >= self.due_ns {
            true => self.end(),
            false => Ok(()),
        }
    }

    /// Publishes what waits.
    pub(super) fn end(&mut self) -> Result<(), SendError> {
        match self.piece.entries_used > 0 {
            true => self.publish(),
            false => Ok(()),
        }
    }

    fn add(
        &mut self,
        entry: Told,
        report: Option<&SteeringReport>,
        after: Places,
    ) -> Result<(), SendError> {
        if self.piece.entries_used == 0 {
            self.due_ns = Clock::monotonic_ns() + FLUSH_NS;
            self.open();
        }
        let piece = &mut *self.piece;
        if let Some(report) = report {
            piece.reports[usize::from(piece.reports_used)] = *report;
            piece.reports_used += 1;
        }
        piece.entries[usize::from(piece.entries_used)] = entry;
        piece.entries_used += 1;
        self.next += 1;
        self.before = after;
        let is_full = piece.entries().len() == piece.entries.len()
            || piece.reports().len() == piece.reports.len();
        match is_full {
            true => self.publish(),
            false => Ok(()),
        }
    }

    /// Says a map that the next entry means, unless it was the last one already.
    fn learn(&mut self, map: &WarehouseMap) -> Result<(), SendError> {
        if self.map.as_deref() == Some(map) {
            return Ok(());
        }
        let ended = self.end();
        match &mut self.map {
            Some(known) => **known = *map,
            None => self.map = Some(Box::new(*map)),
        }
        ended.and(self.say(TextKind::Map, map))
    }

    /// Publishes a text, piece after piece.
    fn say(&mut self, kind: TextKind, what: &impl Serialize) -> Result<(), SendError> {
        let mut text = core::mem::take(&mut self.text);
        text.clear();
        // Into memory, numbers and names only.
        serde_json::to_writer(&mut text, what).expect("what is told is JSON");
        let mut left = text.len();
        let mut sent = Ok(());
        for part in text.chunks(size_of_val(&self.piece.text)) {
            left -= part.len();
            self.open();
            let piece = &mut *self.piece;
            piece.text_kind = kind.into();
            piece.text_used = part.len() as u16;
            piece.text_left = left as u32;
            piece.text.as_flattened_mut()[..part.len()].copy_from_slice(part);
            sent = sent.and(self.publish());
        }
        self.text = text;
        if sent.is_err() {
            // A hole in the numbers: what follows means a text that is not there.
            self.next += 1;
        }
        sent
    }

    /// Says in a blank piece where it stands.
    fn open(&mut self) {
        let (piece, before) = (&mut *self.piece, self.before);
        piece.first = self.next;
        (piece.commands, piece.statuses) = (before.commands, before.statuses);
        piece.events = before.events;
    }

    fn publish(&mut self) -> Result<(), SendError> {
        let sent = self.to.loan_uninit().and_then(|mut loan| {
            *loan = *self.piece;
            loan.send_quietly()
        });
        *self.piece = ToldInputs::default();
        sent
    }
}
