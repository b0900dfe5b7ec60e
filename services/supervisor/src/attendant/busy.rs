//! Notices that the machine is so busy that the robot's services wait for a core most of the time.
//!
//! Then frames are late or lost, and the robot stands again and again although nothing is broken.
//! This module tells people once why, and tells them once when it is over.
//!
//! ```text
//!            waits for more than half of the last 5 s
//!  has room ------------------------------------------> busy, told
//!      ^                                                  |
//!      +------ nobody waits for more than a fifth --------+ told
//! ```

use std::collections::BTreeMap;
use std::time::Duration;

use lager_home::Chance;

use crate::service::Service;

/// How many looks it judges by, at one a second.
const LOOKS: usize = 5;
/// From which share of the time a wait is too long, and below which share all is well.
const BUSY: f64 = 0.5;
const HAS_ROOM: f64 = 0.2;

/// How long each service has waited.
#[derive(Debug, Default)]
pub(crate) struct Busy {
    services: BTreeMap<u32, Waits>,
    is_busy: bool,
}

#[derive(Debug)]
struct Waits {
    service: Service,
    chance: Chance,
    looked: Duration,
    /// The shares of time for which it waited, between the last looks.
    shares: Vec<f64>,
}

impl Busy {
    /// Looks at a process, about once a second; `now` is real time.
    pub(crate) fn look(&mut self, service: Service, pid: u32, now: Duration) {
        self.take(service, pid, now, |waits, piece| waits.chance.of(piece));
    }

    fn take(
        &mut self,
        service: Service,
        pid: u32,
        now: Duration,
        chance: impl FnOnce(&mut Waits, Duration) -> Duration,
    ) {
        let waits = self.services.entry(pid).or_insert_with(|| Waits {
            service,
            chance: Chance::of_process(pid),
            looked: now,
            shares: Vec::new(),
        });
        let piece = now.saturating_sub(core::mem::replace(&mut waits.looked, now));
        let had = chance(waits, piece);
        if !piece.is_zero() {
            waits.shares.push(1.0 - had.div_duration_f64(piece));
            let too_many = waits.shares.len().saturating_sub(LOOKS);
            waits.shares.drain(..too_many);
        }
    }

    /// What to tell people, after a look at all processes at `now`.
    pub(crate) fn told(&mut self, now: Duration) -> Option<String> {
        // Forget those that have ended.
        self.services.retain(|_, waits| waits.looked == now);
        let waits = self.services.values();
        let known = waits.filter(|waits| waits.shares.len() == LOOKS);
        let share = |waits: &Waits| waits.shares.iter().sum::<f64>() / LOOKS as f64;
        let most = known.max_by(|a, b| share(a).total_cmp(&share(b)))?;
        let waited = share(most);
        if !self.is_busy && waited > BUSY {
            self.is_busy = true;
            return Some(format!(
                "WARNING: this machine is overloaded: the {} waits for a core for {:.0} % of the time, so the robot may stand until there is room; `lager doctor` says more",
                most.service,
                waited * 100.0
            ));
        }
        if self.is_busy && waited < HAS_ROOM {
            self.is_busy = false;
            return Some("the machine has room for the robot again".to_owned());
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is told in so many seconds in which logic waits for that share of the time.
    fn told(busy: &mut Busy, from: &mut u64, seconds: u64, share: f64) -> Vec<String> {
        let mut told = Vec::new();
        for _ in 0..seconds {
            *from += 1;
            let now = Duration::from_secs(*from);
            busy.take(Service::Bridge, 7, now, |_, piece| piece);
            busy.take(Service::Logic, 8, now, |_, piece| {
                piece.mul_f64(1.0 - share)
            });
            told.extend(busy.told(now));
        }
        told
    }

    #[test]
    fn an_overload_and_its_end_are_told_once_each() {
        let (mut busy, mut now) = (Busy::default(), 0);
        assert!(told(&mut busy, &mut now, 30, 0.3).is_empty());
        let begun = told(&mut busy, &mut now, 30, 0.9);
        assert_eq!(begun.len(), 1, "{begun:?}");
        assert!(begun[0].contains("the logic waits for a core"), "{begun:?}");
        // It is neither here nor there.
        assert!(told(&mut busy, &mut now, 30, 0.4).is_empty());
        let over = told(&mut busy, &mut now, 30, 0.0);
        assert_eq!(over, ["the machine has room for the robot again"]);
    }

    #[test]
    fn a_service_that_has_ended_is_forgotten() {
        let (mut busy, mut now) = (Busy::default(), 0);
        assert_eq!(told(&mut busy, &mut now, 10, 0.9).len(), 1);
        for second in 11..30 {
            let now = Duration::from_secs(second);
            busy.take(Service::Bridge, 7, now, |_, piece| piece);
            let said = busy.told(now);
            assert_eq!(said.is_some(), second == 11, "{said:?}");
        }
    }
}
