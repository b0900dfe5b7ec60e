//! Holds the ends of commands, in order, until the Pi has been told.
//!
//! ```text
//!   done, aborted, refused --> waiting, in order --> one report each --> told
//! ```
//!
//! A report has room for one end, and of two ends in one step the second would hide the first. So
//! each end waits for its own report. The last reported end stays in every report until the next.

use heapless::Deque;

/// How a command ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum End {
    Done,
    Aborted,
    Refused,
}

/// The end of one command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Finish {
    pub(crate) seq: u8,
    pub(crate) end: End,
}

/// Ends that the Pi has not heard yet, and the last one that it has.
#[derive(Debug, Clone)]
pub(crate) struct Ends {
    waiting: Deque<Finish, 8>,
    told: Finish,
}

impl Ends {
    pub(crate) const fn new() -> Self {
        Self {
            waiting: Deque::new(),
            told: Finish {
                seq: 0,
                end: End::Done,
            },
        }
    }

    /// A command has ended. If no Pi listens, the oldest end is dropped.
    pub(crate) fn push(&mut self, finish: Finish) {
        if self.waiting.is_full() {
            self.waiting.pop_front();
        }
        let stored = self.waiting.push_back(finish).is_ok();
        debug_assert!(stored, "room was made");
    }

    /// Moves on to the next end; returns whether there was one.
    pub(crate) fn tell_next(&mut self) -> bool {
        match self.waiting.pop_front() {
            Some(finish) => {
                self.told = finish;
                true
            }
            None => false,
        }
    }

    /// The end for the report.
    pub(crate) fn told(&self) -> Finish {
        self.told
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_end_gets_a_report_of_its_own() {
        let mut ends = Ends::new();
        assert!(!ends.tell_next());
        ends.push(Finish {
            seq: 4,
            end: End::Aborted,
        });
        ends.push(Finish {
            seq: 5,
            end: End::Refused,
        });
        assert!(ends.tell_next());
        assert_eq!(
            ends.told(),
            Finish {
                seq: 4,
                end: End::Aborted
            }
        );
        assert!(ends.tell_next());
        assert_eq!(
            ends.told(),
            Finish {
                seq: 5,
                end: End::Refused
            }
        );
        assert!(!ends.tell_next());
        assert_eq!(ends.told().seq, 5);
    }

    #[test]
    fn unheard_ends_do_not_pile_up() {
        let mut ends = Ends::new();
        for seq in 0..20 {
            ends.push(Finish {
                seq,
                end: End::Done,
            });
        }
        let mut told = 0;
        while ends.tell_next() {
            told += 1;
        }
        assert_eq!((told, ends.told().seq), (8, 19));
    }
}
