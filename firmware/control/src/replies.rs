//! Holds answers to settings until the board can send them.

use heapless::Deque;
use lager_wire::SettingReply;

/// The latest answers, oldest first.
#[derive(Debug, Clone, Default)]
pub(crate) struct Replies {
    waiting: Deque<SettingReply, 4>,
}

impl Replies {
    pub(crate) const fn new() -> Self {
        Self {
            waiting: Deque::new(),
        }
    }

    /// Puts an answer behind the others. If there is no room it drops the oldest answer; the Pi
    /// then asks for it again.
    pub(crate) fn push(&mut self, reply: SettingReply) {
        if self.waiting.is_full() {
            self.waiting.pop_front();
        }
        let stored = self.waiting.push_back(reply).is_ok();
        debug_assert!(stored, "room was made");
    }

    /// The next answer to send.
    pub(crate) fn pop(&mut self) -> Option<SettingReply> {
        self.waiting.pop_front()
    }
}
