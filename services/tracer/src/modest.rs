//! What can be said of late frames without the kernel's events: from the time that the robot's
//! threads ran and waited for a core, and their page faults.
//!
//! It does not say behind whom a thread waited, nor tell interrupts from own code, nor why all slept.
//! This file is pure: it gets the [`Shares`] of each frame.

use std::collections::BTreeMap;

use crate::frame::Cause;
use crate::proc::Shares;
use crate::report::{Report, Verdict};

/// Explains frames by shares of time.
#[derive(Clone, Debug)]
pub struct Modest {
    limit_ns: u64,
    frames: Vec<(u64, u64, u64, Shares)>,
}

impl Modest {
    /// Frames that take longer than this are late, in ns.
    pub fn new(limit_ns: u64) -> Self {
        Self {
            limit_ns,
            frames: Vec::new(),
        }
    }

    /// A frame: its number, its beginning and its time in ns, and what the threads got meanwhile.
    pub fn frame(&mut self, number: u64, start_ns: u64, took_ns: u64, shares: Shares) {
        self.frames.push((number, start_ns, took_ns, shares));
    }

    /// The verdicts. `why` says why there are no better ones.
    pub fn report(&self, why: &str) -> Report {
        let parts = |took_ns: u64, shares: &Shares| {
            let rest = took_ns.saturating_sub(shares.ran_ns + shares.waited_ns);
            let asleep = match shares.major_faults {
                0 => Cause::Unknown,
                _ => Cause::PageFault,
            };
            [
                (Cause::RunQueue, shares.waited_ns),
                (Cause::OwnCode, shares.ran_ns),
                (asleep, rest),
            ]
        };
        let mut usual = BTreeMap::new();
        let in_time = self.frames.iter().filter(|frame| frame.2 <= self.limit_ns);
        let in_time: Vec<_> = in_time.map(|frame| parts(frame.2, &frame.3)).collect();
        for place in 0..3 {
            let mut all: Vec<u64> = in_time.iter().map(|parts| parts[place].1).collect();
            if all.is_empty() {
                break;
            }
            let middle = all.len() / 2;
            let cause = [Cause::RunQueue, Cause::OwnCode, Cause::Unknown][place];
            usual.insert(cause, *all.select_nth_unstable(middle).1);
        }
        let late = self.frames.iter().filter(|frame| frame.2 > self.limit_ns);
        let late = late.map(|(number, start_ns, took_ns, shares)| {
            let beyond = parts(*took_ns, shares).map(|(cause, ns)| {
                let usual = usual.get(&cause).copied().unwrap_or(0);
                (ns.saturating_sub(usual), cause)
            });
            let (beyond_ns, cause) = beyond.into_iter().max().unwrap_or((0, Cause::Unknown));
            let detail = match cause {
                Cause::RunQueue => "behind somebody: only the kernel's events say whom",
                Cause::OwnCode => "or an interrupt on its core",
                Cause::PageFault => "it waited for a disk",
                _ => "all slept: a device, the kernel's workers, a sleeping core or a hypervisor",
            };
            Verdict {
                number: *number,
                start_ns: *start_ns,
                took_ns: *took_ns,
                cause,
                beyond_ns,
                detail: detail.to_owned(),
                stage: "",
                thread: String::new(),
                core: None,
            }
        });
        let late = late.collect();
        let count = self.frames.len() as u64;
        let mut report = Report::new(count, self.limit_ns, usual, late, 0);
        report.notes.push(why.to_owned());
        report
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_share_beyond_the_usual_is_the_cause() {
        let mut modest = Modest::new(200_000);
        let shares = |ran_ns, waited_ns, major_faults| Shares {
            ran_ns,
            waited_ns,
            major_faults,
        };
        for number in 0..99 {
            modest.frame(number, 0, 100_000, shares(60_000, 10_000, 0));
        }
        for (number, took, got) in [
            (100, 3_000_000, shares(60_000, 2_900_000, 0)),
            (101, 900_000, shares(800_000, 10_000, 0)),
            (102, 2_000_000, shares(60_000, 10_000, 4)),
            (103, 1_000_000, shares(60_000, 10_000, 0)),
        ] {
            modest.frame(number, 0, took, got);
        }
        let report = modest.report("no right");
        let causes: Vec<_> = report
            .late
            .iter()
            .map(|verdict| (verdict.number, verdict.cause))
            .collect();
        let expected = [
            (100, Cause::RunQueue),
            (102, Cause::PageFault),
            (103, Cause::Unknown),
            (101, Cause::OwnCode),
        ];
        assert_eq!(causes, expected);
        assert!(report.to_string().contains("no right"), "{report}");
    }
}
