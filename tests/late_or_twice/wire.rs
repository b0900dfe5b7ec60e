//! A connection from one process to the next. It may delay messages and may be cut for a while, but
//! it keeps their order and loses none, as TCP does.

use std::collections::VecDeque;

/// One direction of a connection.
#[derive(Debug)]
pub(crate) struct Wire<T> {
    under_way: VecDeque<(u64, T)>,
}

impl<T> Default for Wire<T> {
    fn default() -> Self {
        let under_way = VecDeque::new();
        Self { under_way }
    }
}

impl<T> Wire<T> {
    /// Sends something at `now` (ms) that takes `delay` ms.
    pub(crate) fn send(&mut self, now: u64, delay: u64, what: T) {
        let before = self.under_way.back().map_or(0, |(at, _)| *at);
        self.under_way.push_back((before.max(now + delay), what));
    }

    /// The messages that have arrived by `now`; none while the wire is cut.
    pub(crate) fn receive(&mut self, now: u64, is_cut: bool) -> Vec<T> {
        let mut arrived = Vec::new();
        while !is_cut && self.under_way.front().is_some_and(|(at, _)| *at <= now) {
            arrived.extend(self.under_way.pop_front().map(|(_, what)| what));
        }
        arrived
    }

    /// Whether no message is under way.
    pub(crate) fn is_empty(&self) -> bool {
        self.under_way.is_empty()
    }

    /// The receiver closes the connection: the messages under way are lost.
    pub(crate) fn drop_all(&mut self) {
        self.under_way.clear();
    }
}
