//! [`Writer`]: sends samples to a topic's actors, rings them, and then sends to everybody else and
//! has those watchers woken that sleep.

use core::cell::Cell;
use std::sync::atomic::{AtomicU64, Ordering};

use lager_home::Clock;
use lager_sample::Stamp;
use lager_wake::{PartRinger, WatchRinger};

use super::copies::Copies;
use super::outlet::{Lent, Outlet};
use super::standard::StandardListeners;
use crate::bus::Bus;
use crate::cause::Cause;
use crate::error::{PortError, SendError};
use crate::here::{Here, ends_here};
use crate::kind::{Kind, Side};

/// [`crate::Publisher`] without the payload's type.
pub(crate) struct Writer {
    /// The service that the actors read: their own, or the topic's only one.
    outlet: Outlet,
    /// The service that everybody else reads, if the actors have their own.
    copies: Option<Copies>,
    /// Everybody but the actors must still get the last sample.
    behind: Cell<bool>,
    standard: Here<StandardListeners>,
    ringers: Box<[PartRinger]>,
    watchers: WatchRinger,
    next_sequence: Cell<u64>,
    epoch: u64,
    writer: u32,
}

ends_here!(StandardListeners);

/// Who gets a sample at once.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum To {
    /// The actors, who are rung, then everybody else.
    All,
    /// The same without a ring: the actors look when they next wake.
    AllQuietly,
    /// The actors, who are rung. Everybody else gets it when the writer catches up, sends or ends.
    Actors,
}

impl Writer {
    #[inline(never)]
    pub(crate) fn new(bus: &Bus, kind: &Kind) -> Result<Self, PortError> {
        let ringers = kind
            .qos
            .actors
            .iter()
            .map(|actor| {
                PartRinger::to(bus.board(), *actor, kind.id)
                    .map_err(|fault| PortError::of_bell(*actor, fault))
            })
            .collect::<Result<_, _>>()?;
        let watchers = WatchRinger::to(bus.board(), kind.id)
            .map_err(|fault| PortError::of_bell(bus.part(), fault))?;
        let standard = StandardListeners::of(bus, kind)?;
        let (copies, side) = if kind.qos.serves_actors_first() {
            (Some(Copies::new(bus, kind)?), Side::Actors)
        } else {
            (None, Side::Public)
        };
        Ok(Self {
            outlet: Outlet::new(bus, kind, side)?,
            copies,
            behind: Cell::new(false),
            standard: Here::new(standard),
            ringers,
            watchers,
            next_sequence: Cell::new(0),
            // Taken after the ports exist: a subscriber that is older than the epoch was there for
            // every sample, so it may count losses from number 0 on.
            epoch: new_epoch(),
            writer: std::process::id(),
        })
    }

    /// Takes a sample. Its payload is whatever was there before.
    #[inline(never)]
    pub(crate) fn lend(&self) -> Result<Lent, SendError> {
        self.outlet.lend()
    }

    /// Sends a sample that follows from `cause`, published at that time.
    #[inline(never)]
    pub(crate) fn deliver(
        &self,
        lent: Lent,
        cause: Cause,
        publish_time_ns: u64,
        to: To,
    ) -> Result<(), SendError> {
        let sequence = self.next_sequence.get();
        self.next_sequence.set(sequence + 1);
        let stamp = cause.stamp(Stamp {
            sequence,
            publish_time_ns,
            epoch: self.epoch,
            writer: self.writer,
            ..Stamp::default()
        });
        self.hand_over(lent, stamp, to)
    }

    /// Sends a sample with that stamp.
    #[inline(never)]
    pub(crate) fn deliver_stamped(
        &self,
        lent: Lent,
        stamp: Stamp,
        to: To,
    ) -> Result<(), SendError> {
        self.hand_over(lent, stamp, to)
    }

    #[inline(always)]
    fn hand_over(&self, lent: Lent, stamp: Stamp, to: To) -> Result<(), SendError> {
        let before = self.catch_up();
        if let Some(copies) = &self.copies {
            copies.take(&stamp, lent.payload());
        }
        let sent = lent.send(stamp);
        for ringer in &self.ringers {
            match to {
                To::All | To::Actors => ringer.ring(),
                To::AllQuietly => ringer.leave(),
            }
        }
        self.behind.set(true);
        let after = match to {
            To::All | To::AllQuietly => self.catch_up(),
            To::Actors => Ok(()),
        };
        sent.and(before).and(after)
    }

    /// Sends the last sample to everybody but the actors, unless that was already done.
    #[inline]
    pub(crate) fn catch_up(&self) -> Result<(), SendError> {
        if !self.behind.replace(false) {
            return Ok(());
        }
        let copied = self.copies.as_ref().map_or(Ok(()), Copies::publish);
        self.watchers.ring();
        self.standard.notify();
        copied
    }

    /// Connects to new readers and sends them their history.
    #[inline(never)]
    pub(crate) fn tick(&self) {
        self.outlet.tick();
        if let Some(copies) = &self.copies {
            copies.tick();
        }
    }

    /// When this writer was made.
    pub(crate) fn epoch(&self) -> u64 {
        self.epoch
    }

    /// Samples sent so far.
    pub(crate) fn sent(&self) -> u64 {
        self.next_sequence.get()
    }
}

impl Drop for Writer {
    fn drop(&mut self) {
        // If this fails, readers of the public service count the sample as lost.
        let _ = self.catch_up();
    }
}

/// The current time, changed if need be so that no two writers of this process have the same.
pub(super) fn new_epoch() -> u64 {
    static LAST: AtomicU64 = AtomicU64::new(0);
    let now = Clock::monotonic_ns();
    let last = LAST
        .fetch_update(Ordering::Relaxed, Ordering::Relaxed, |last| {
            Some(now.max(last + 1))
        })
        .unwrap_or_default();
    now.max(last + 1)
}
