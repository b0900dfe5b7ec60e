//! The law of the ledger against the truth: a writer, a bus that loses samples, a gateway with a
//! limit, and a link that loses messages, each at random.

use lager_remote::{Account, Counts, Heard, Ledger, Limit, Note, Verdict};
use lager_sample::Stamp;
use proptest::prelude::*;

const MS: u64 = 1_000_000;
/// When the writers began.
const EPOCH: u64 = 1_000 * MS;

/// What the three places have really lost since a listener came.
#[derive(Clone, Copy, Debug, Default)]
struct Truth {
    published: u64,
    received: u64,
    lost: u64,
    left_out: u64,
    dropped: u64,
}

fn stamp(writer: u32, sequence: u64, at: u64) -> Stamp {
    Stamp {
        sequence,
        writer,
        epoch: EPOCH,
        publish_time_ns: at,
        source_time_ns: at,
        ..Stamp::default()
    }
}

/// A gateway of one topic, as `robot.rs` has it.
struct Gateway {
    counts: Counts,
    limit: Limit,
    held: Option<(Stamp, u64)>,
}

impl Gateway {
    fn new(run: u64, limit: Limit) -> Self {
        let counts = Counts {
            run,
            ..Counts::default()
        };
        Self {
            counts,
            limit,
            held: None,
        }
    }

    fn sent(&mut self, stamp: Stamp, lost: u64) -> Note {
        self.counts.next += 1;
        self.counts.left_out = self.limit.left_out();
        let counts = Counts {
            lost,
            ..self.counts
        };
        Note {
            stamp,
            is_answer: false,
            is_limited: self.limit.is_set(),
            counts,
            layout: 0,
        }
    }

    fn take(&mut self, stamp: Stamp) -> Option<Note> {
        match self.limit.offer(stamp.publish_time_ns) {
            Verdict::Send => {
                self.held = None;
                Some(self.sent(stamp, self.counts.lost))
            }
            Verdict::Hold => {
                self.held = Some((stamp, self.counts.lost));
                None
            }
            Verdict::LeaveOut => None,
        }
    }
}

/// What happens to one sample: the time until it, and whether bus and link lose it.
type Step = (u64, bool, bool, bool);

fn steps() -> impl Strategy<Value = Vec<Step>> {
    let rare = || proptest::bool::weighted(0.2);
    proptest::collection::vec((1..20 * MS, rare(), rare(), rare()), 1..300)
}

proptest! {
    #[test]
    fn each_place_counts_what_it_has_lost_and_the_sum_is_the_truth(
        steps in steps(), hz in proptest::option::of(20.0_f64..400.0), is_state in any::<bool>(), joins in 0_usize..40,
    ) {
        let mut gateway = Gateway::new(7, Limit::new(hz, is_state));
        let mut ledger = Ledger::new();
        let mut truth = Truth::default();
        let mut begun = None;
        let mut at = EPOCH;
        for (place, (step, by_bus, by_link, is_told)) in steps.into_iter().enumerate() {
            at += step;
            // A state that was held may become due before the next sample.
            for is_due in [true, false] {
                let sent = match is_due {
                    true => {
                        let due = gateway.limit.is_due(at).then(|| gateway.held.take());
                        due.flatten().map(|(held, lost)| gateway.sent(held, lost))
                    }
                    false if by_bus => {
                        gateway.counts.lost += 1;
                        None
                    }
                    false => gateway.take(stamp(1, place as u64, at)),
                };
                let Some(note) = sent else { continue };
                let came = place >= joins && !by_link;
                if came && begun.is_none() {
                    begun = Some((note.stamp.sequence, note.counts.lost, note.counts.left_out));
                }
                let Some((first, lost, left_out)) = begun else { continue };
                if !came {
                    truth.dropped += 1;
                    continue;
                }
                prop_assert_eq!(ledger.hear(&note), Heard::New);
                prop_assert_eq!(ledger.hear(&note), Heard::Repeated);
                truth.received += 1;
                truth.published = note.stamp.sequence + 1 - first;
                truth.lost = note.counts.lost - lost;
                truth.left_out = gateway.limit.left_out() - left_out;
                let account = ledger.account();
                prop_assert_eq!(account.received, truth.received);
                prop_assert_eq!(account.dropped, truth.dropped);
                prop_assert_eq!(account.left_out, truth.left_out);
                prop_assert_eq!(account.lost, truth.lost);
                prop_assert_eq!(account.unserved, 0);
                prop_assert_eq!(account.received + account.missing(), truth.published);
            }
            if is_told && begun.is_some() {
                gateway.counts.left_out = gateway.limit.left_out();
                ledger.tell(&gateway.counts);
                prop_assert_eq!(ledger.account().dropped, truth.dropped);
            }
        }
    }

    #[test]
    fn what_is_told_before_it_comes_is_no_loss(late in 0_u64..20, behind in 0_u64..20, gone in proptest::bool::ANY) {
        let mut gateway = Gateway::new(7, Limit::default());
        let mut ledger = Ledger::new();
        let notes: Vec<Note> = (0..late + behind + 1).filter_map(|n| gateway.take(stamp(1, n, EPOCH + n * MS))).collect();
        ledger.hear(&notes[0]);
        ledger.tell(&gateway.counts);
        prop_assert_eq!(ledger.account().dropped, late + behind);
        for note in &notes[1..] {
            if gone && note.number() == 1 { continue; }
            prop_assert_eq!(ledger.hear(note), Heard::New);
        }
        let is_gone = u64::from(gone && late + behind > 0);
        prop_assert_eq!(ledger.account().dropped, is_gone);
        prop_assert_eq!(ledger.account().received, late + behind + 1 - is_gone);
    }

    #[test]
    fn a_gateway_that_was_replaced_leaves_a_gap_of_the_right_length(
        heard in 1_u64..50, unsent in 0_u64..50, away in 0_u64..50, unheard in 0_u64..50, after in 1_u64..50,
    ) {
        let mut ledger = Ledger::new();
        let mut number = 0;
        let mut next = || {
            number += 1;
            stamp(1, number - 1, EPOCH + number * MS)
        };
        let mut first = Gateway::new(7, Limit::default());
        for _ in 0..heard {
            let note = first.take(next()).expect("no limit");
            ledger.hear(&note);
        }
        // It ends with what it has sent and what it has not; nobody tells how much that was.
        for _ in 0..unsent + away {
            next();
        }
        let mut second = Gateway::new(8, Limit::default());
        for place in 0..unheard + after {
            let note = second.take(next()).expect("no limit");
            if place >= unheard {
                ledger.hear(&note);
            }
        }
        let expected = Account {
            received: heard + after,
            dropped: unheard,
            unserved: unsent + away,
            ..Account::default()
        };
        prop_assert_eq!(ledger.account(), expected);
        prop_assert_eq!(expected.received + expected.missing(), number);
    }

    #[test]
    fn any_notes_at_all_are_entered_without_a_panic(
        notes in proptest::collection::vec((any::<[u64; 6]>(), 0_u64..3, any::<bool>(), any::<bool>()), 0..60),
    ) {
        let mut ledger = Ledger::new();
        for ([next, left_out, lost, sequence, at, epoch], run, is_answer, is_told) in notes {
            let counts = Counts { run, next, left_out, lost };
            match is_told {
                true => ledger.tell(&counts),
                false => {
                    let stamp = Stamp { epoch, ..stamp(1, sequence, at) };
                    ledger.hear(&Note { stamp, is_answer, is_limited: false, counts, layout: 0 });
                }
            }
            ledger.account();
        }
    }
}

#[test]
fn several_writers_are_one_account() {
    let mut gateway = Gateway::new(7, Limit::default());
    let mut ledger = Ledger::new();
    for n in 0..100 {
        for writer in 1..4 {
            if n % 10 == 3 {
                gateway.counts.lost += 1;
                continue;
            }
            let note = gateway
                .take(stamp(writer, n, EPOCH + n * MS))
                .expect("no limit");
            if n % 7 != 5 {
                ledger.hear(&note);
            }
        }
    }
    ledger.tell(&gateway.counts);
    let account = ledger.account();
    assert_eq!(account.lost, 30);
    assert_eq!(account.unserved, 0);
    assert_eq!(account.received + account.missing(), 300);
}

#[test]
fn a_late_listener_shows_the_last_value_once() {
    let mut gateway = Gateway::new(7, Limit::default());
    let notes: Vec<Note> = (0..5)
        .filter_map(|n| gateway.take(stamp(1, n, EPOCH + n * MS)))
        .collect();
    let answer = Note {
        is_answer: true,
        ..notes[4]
    };
    // The count may come before the answer or after it.
    for is_told_first in [true, false] {
        let mut ledger = Ledger::new();
        if is_told_first {
            ledger.tell(&gateway.counts);
        }
        assert_eq!(ledger.hear(&answer), Heard::New);
        assert_eq!(ledger.hear(&answer), Heard::Repeated);
        ledger.tell(&gateway.counts);
        let account = ledger.account();
        assert_eq!((account.received, account.missing()), (1, 0));
    }
}

#[test]
fn who_was_there_and_heard_nothing_learns_that_from_the_counts() {
    let mut ledger = Ledger::new();
    let told = |next| Counts {
        run: 7,
        next,
        left_out: 2 * next,
        lost: next,
    };
    ledger.tell(&told(10));
    assert_eq!(ledger.account(), Account::default());
    ledger.tell(&told(13));
    let account = ledger.account();
    assert_eq!((account.dropped, account.left_out, account.lost), (3, 6, 3));
}
