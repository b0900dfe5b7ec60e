//! The peers that have connected and have not said their names yet. Pure.
//!
//! A robot says its name at once. So only [`Waiting::MOST`] peers may wait, each for
//! [`Waiting::LONGEST`]. When all places are taken, a new peer replaces the oldest one of the
//! address that has the most peers. So nobody keeps others out by saying nothing, and an address
//! with many peers harms only itself.

use std::collections::BTreeMap;
use std::net::IpAddr;
use std::time::{Duration, Instant};

/// The peers that wait, by the numbers of their connections.
#[derive(Clone, Debug, Default)]
pub(crate) struct Waiting(BTreeMap<u64, Guest>);

#[derive(Clone, Copy, Debug)]
struct Guest {
    from: IpAddr,
    since: Instant,
}

impl Waiting {
    /// How many peers may wait at a time.
    pub(crate) const MOST: usize = 32;
    /// How long a peer may wait.
    pub(crate) const LONGEST: Duration = Duration::from_secs(5);

    /// A new peer waits. Returns the peer that it replaces, if any.
    pub(crate) fn comes(&mut self, link: u64, from: IpAddr, now: Instant) -> Option<u64> {
        let goes = (self.0.len() >= Self::MOST).then(|| self.first_of_most());
        let goes = goes.flatten();
        if let Some(goes) = goes {
            self.0.remove(&goes);
        }
        self.0.insert(link, Guest { from, since: now });
        goes
    }

    /// A peer does not wait any more.
    pub(crate) fn goes(&mut self, link: u64) {
        self.0.remove(&link);
    }

    /// The peers that have waited for too long.
    pub(crate) fn overdue(&self, now: Instant) -> Vec<u64> {
        let is_over = |guest: &Guest| now.saturating_duration_since(guest.since) > Self::LONGEST;
        let over = self.0.iter().filter(|(_, guest)| is_over(guest));
        over.map(|(&link, _)| link).collect()
    }

    /// The oldest peer of the address that has the most peers.
    fn first_of_most(&self) -> Option<u64> {
        let count = |from: IpAddr| self.0.values().filter(|guest| guest.from == from).count();
        let most = self
            .0
            .values()
            .map(|guest| guest.from)
            .max_by_key(|from| count(*from))?;
        let mut guests = self.0.iter();
        guests
            .find(|(_, guest)| guest.from == most)
            .map(|(&link, _)| link)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_says_nothing_keeps_nobody_out_but_his_own() {
        let now = Instant::now();
        let [many, few] = [[10, 0, 0, 1], [10, 0, 0, 2]].map(IpAddr::from);
        let mut waiting = Waiting::default();
        assert_eq!(waiting.comes(0, few, now), None);
        for link in 1..Waiting::MOST as u64 {
            assert_eq!(waiting.comes(link, many, now), None);
        }
        for link in 100..500 {
            let goes = waiting.comes(link, many, now).expect("all are taken");
            assert_ne!(goes, 0, "another address has more");
        }
        assert_eq!(
            waiting.comes(500, few, now),
            Some(500 - Waiting::MOST as u64 + 1)
        );
        assert_eq!(waiting.0.len(), Waiting::MOST);
        waiting.goes(500);
        assert_eq!(waiting.comes(501, many, now), None, "there is room again");
    }

    #[test]
    fn who_waits_too_long_is_overdue() {
        let now = Instant::now();
        let mut waiting = Waiting::default();
        let from = IpAddr::from([127, 0, 0, 1]);
        waiting.comes(1, from, now);
        waiting.comes(2, from, now + Duration::from_secs(1));
        assert_eq!(waiting.overdue(now + Waiting::LONGEST), [0; 0]);
        let later = now + Waiting::LONGEST + Duration::from_millis(1);
        assert_eq!(waiting.overdue(later), [1]);
    }
}
