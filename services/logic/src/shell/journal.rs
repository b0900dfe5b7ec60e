//! The shell's journal, `nav/inputs`: the navigator's inputs with their times, and proofs of its
//! answers. The shell writes it after everything else has left.
//!
//! Entries are collected and published in pieces, only for observers; an entry costs no allocation
//! and no system call. A piece goes out when it is full, or at the end of the first turn 50 ms
//! after its first entry. If the process is killed, the entries since then are lost.

use core::time::Duration;

use lager_home::Clock;
use lager_ports::{Bus, PortError, Publisher, SendError};
use lager_topics::{
    Beside, NavInputs, NavigatorInput, NavigatorInputKind, NavigatorInputs, Sent, TextKind,
    WarehouseMap,
};
use serde::Serialize;

use crate::entry::{self, Beginning};
use crate::navigator::{Input, Navigator};
use crate::output::Output;

/// How long an entry may wait to be published, in real time.
const FLUSH_NS: u64 = 50_000_000;

/// Room for a map with products on every place, so that a new map needs no allocation.
const LONGEST_TEXT: usize = 16 << 10;

/// The numbers of the shell's publishers.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Places {
    pub(super) commands: Sent,
    pub(super) statuses: Sent,
    pub(super) events: Sent,
}

/// Writes the navigator's inputs down.
pub(super) struct Journal {
    to: Publisher<NavInputs>,
    piece: Box<NavigatorInputs>,
    /// When the piece has to go out, by the stamps' clock.
    due_ns: u64,
    /// Number of the next entry.
    next: u64,
    /// The numbers of the publishers before the next entry.
    before: Places,
    /// The last map that was written.
    map: Option<Box<WarehouseMap>>,
    text: Vec<u8>,
}

impl Journal {
    /// The journal of a navigator with this beginning.
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

    /// Writes down an input that the navigator has handled, when all its consequences have left.
    pub(super) fn told(
        &mut self,
        now: Duration,
        input: &Input<'_>,
        navigator: &Navigator,
        output: &Output,
        after: Places,
    ) -> Result<(), SendError> {
        let (mut entry, beside) = entry::of_input(now, input);
        entry::answer(&mut entry, navigator, output);
        let learnt = match *input {
            Input::Map(map) => self.learn(map),
            _ => Ok(()),
        };
        let added = self.add(entry, beside, after);
        learnt.and(added)
    }

    /// Writes down that the order or the status was sent again.
    pub(super) fn again(
        &mut self,
        now: Duration,
        kind: NavigatorInputKind,
        after: Places,
    ) -> Result<(), SendError> {
        self.add(entry::again(now, kind), Beside::Nothing, after)
    }

    /// Publishes entries that have waited long enough.
    pub(super) fn keep_time(&mut self) -> Result<(), SendError> {
        match Clock::monotonic_ns() >= self.due_ns {
            true => self.end(),
            false => Ok(()),
        }
    }

    /// Publishes the entries that wait.
    pub(super) fn end(&mut self) -> Result<(), SendError> {
        match self.piece.entries_used > 0 {
            true => self.publish(),
            false => Ok(()),
        }
    }

    fn add(
        &mut self,
        entry: NavigatorInput,
        beside: Beside<'_>,
        after: Places,
    ) -> Result<(), SendError> {
        if self.piece.entries_used == 0 {
            self.due_ns = Clock::monotonic_ns() + FLUSH_NS;
            self.open();
        }
        self.piece.add(entry, beside);
        self.next += 1;
        self.before = after;
        match self.piece.is_full() {
            true => self.publish(),
            false => Ok(()),
        }
    }

    /// Writes the map to which the next entry refers, unless it was the last one already.
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
            // Leave a gap in the numbers: the following entries refer to a text that is missing.
            self.next += 1;
        }
        sent
    }

    /// Writes into a blank piece where it stands.
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
        *self.piece = NavigatorInputs::default();
        sent
    }
}
