//! [`Ledger`]: a listener's account of one topic, which tells three losses apart.
//!
//! ```text
//!   writer ──────> gateway ───────────────────> listener
//!           bus              limit        link
//!           lost             left_out     dropped
//! ```
//!
//! - `lost`: the bus lost the sample before the gateway, which counts by the stamps.
//! - `left_out`: the gateway left it out by its limit, and says how many.
//! - `dropped`: the gateway has sent it and it did not arrive. Messages are numbered, so a gap
//!   shows, and the gateway tells its last number once a second, so a loss at the end shows too.
//! - `unserved`: no gateway was there, or one that ended took the sample with it. Only the stamps
//!   show that, so with several writers it is a lower bound.
//!
//! **Law:** from the first sample that came to the last one that a note or a count tells of, those
//! that came and these four are all that were published. The tests hold it against the truth, with
//! losses at each of the three places at random.

use core::ops::Range;

use lager_ports::Streams;

use crate::note::{Counts, Note};

/// What became of the samples of a topic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Account {
    /// Samples that came.
    pub received: u64,
    /// Samples that the bus had lost before the gateway.
    pub lost: u64,
    /// Samples that the gateway has left out by its limit.
    pub left_out: u64,
    /// Samples that were lost between gateway and listener.
    pub dropped: u64,
    /// Samples that were published while no gateway was there to send them.
    pub unserved: u64,
}

impl Account {
    /// All samples that did not come.
    pub fn missing(&self) -> u64 {
        let parts = [self.lost, self.left_out, self.dropped, self.unserved];
        parts.into_iter().fold(0, u64::saturating_add)
    }
}

/// Whether a message is to be shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Heard {
    /// Its sample has not been shown before.
    New,
    /// Its sample came before, or is older than one that came.
    Repeated,
}

/// The account of one topic.
#[derive(Default)]
pub struct Ledger {
    /// The gateway that is heard now.
    run: Option<Run>,
    /// By the stamps alone; from the first sample on.
    streams: Option<Streams>,
    /// What is told of gateways that were heard before.
    before: Account,
    received: u64,
}

/// One gateway's life, as far as it is heard.
struct Run {
    /// What it had counted when this account began.
    base: Counts,
    /// What it has counted since.
    last: Counts,
    dropped: u64,
    /// The numbers that are counted as dropped only because the gateway has told of them. They may
    /// still be on their way.
    awaited: Range<u64>,
    /// Whether a sample of this run has come.
    is_heard: bool,
}

impl Ledger {
    /// An account without a sample.
    pub fn new() -> Self {
        Self::default()
    }

    /// Enters a message that has come.
    pub fn hear(&mut self, note: &Note) -> Heard {
        let number = note.number();
        let run = self.run_of(note.counts, number);
        let heard = run.take(number, note);
        if heard == Heard::New {
            self.received = self.received.saturating_add(1);
            let stamp = &note.stamp;
            let streams = self
                .streams
                .get_or_insert_with(|| Streams::new(stamp.publish_time_ns));
            streams.note(stamp, || stamp.publish_time_ns);
        }
        heard
    }

    /// Enters what the gateway tells of the topic. All messages up to that number were sent before.
    pub fn tell(&mut self, counts: &Counts) {
        let run = self.run_of(*counts, counts.next);
        if counts.next > run.last.next {
            let missed = run.last.next..counts.next;
            run.dropped = run.dropped.saturating_add(missed.end - missed.start);
            run.awaited = match run.awaited.end == missed.start {
                true => run.awaited.start..missed.end,
                false => missed,
            };
            run.last.next = counts.next;
        }
        run.count(counts);
    }

    /// The account so far.
    pub fn account(&self) -> Account {
        let mut account = self.before;
        account.received = self.received;
        if let Some(run) = &self.run {
            run.add_to(&mut account);
        }
        let by_stamps = self.streams.as_ref().map_or(0, Streams::lost);
        account.unserved = by_stamps.saturating_sub(account.missing());
        account
    }

    /// The gateway that has counted this. If it is another one than before, that one's account is
    /// closed, and of the new one everything counts from its beginning, as this listener was there
    /// before it. The account of the first gateway begins at `from`.
    fn run_of(&mut self, counts: Counts, from: u64) -> &mut Run {
        if self
            .run
            .as_ref()
            .is_none_or(|run| run.last.run != counts.run)
        {
            let base = match self.run.take() {
                None => Counts {
                    next: from,
                    ..counts
                },
                Some(ended) => {
                    ended.add_to(&mut self.before);
                    Counts {
                        run: counts.run,
                        ..Counts::default()
                    }
                }
            };
            self.run = Some(Run {
                base,
                last: base,
                dropped: 0,
                awaited: 0..0,
                is_heard: false,
            });
        }
        self.run.as_mut().expect("it was just put there")
    }
}

impl Run {
    fn take(&mut self, number: u64, note: &Note) -> Heard {
        if number >= self.last.next {
            self.dropped = self.dropped.saturating_add(number - self.last.next);
            self.awaited = 0..0;
            self.last.next = number.saturating_add(1);
        } else if self.awaited.contains(&number) {
            self.dropped = self.dropped.saturating_sub(1);
            self.awaited.start = number + 1;
        } else if note.is_answer && !self.is_heard {
            // The last message before this account began with what the gateway told.
            let between = self.last.next - number - 1;
            self.dropped = self.dropped.saturating_add(between);
        } else {
            return Heard::Repeated;
        }
        self.is_heard = true;
        self.count(&note.counts);
        Heard::New
    }

    fn count(&mut self, counts: &Counts) {
        self.last.left_out = self.last.left_out.max(counts.left_out);
        // The gateway takes back a loss that turns out to be none.
        self.last.lost = counts.lost;
    }

    fn add_to(&self, account: &mut Account) {
        let lost = self.last.lost.saturating_sub(self.base.lost);
        let left_out = self.last.left_out.saturating_sub(self.base.left_out);
        account.lost = account.lost.saturating_add(lost);
        account.left_out = account.left_out.saturating_add(left_out);
        account.dropped = account.dropped.saturating_add(self.dropped);
    }
}
