//! Decides whether the battery is low, and remembers whether a person knows.

use core::time::Duration;

/// What the navigator believes of the battery.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Battery {
    /// It is low.
    low: bool,
    /// A person has told the robot to work all the same.
    accepted: bool,
    /// Since when the reports say the opposite of `low`.
    contradicted: Option<Duration>,
}

/// When a battery counts as low, and when as charged again.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits {
    /// Tenths of a volt below which it is low; 0 = never.
    pub(crate) low: u8,
    /// How much higher it must be to count as charged again.
    pub(crate) charged_by: u8,
    /// How long it must be so.
    pub(crate) steady: Duration,
}

impl Battery {
    /// A low battery; an earlier navigator stood still because of it.
    pub(crate) const LOW: Self = Self {
        low: true,
        accepted: false,
        contradicted: None,
    };

    /// Whether the robot must begin no new way.
    pub(crate) fn forbids(self) -> bool {
        self.low && !self.accepted
    }

    /// A person knows and wants the robot to go on.
    pub(crate) fn accept(&mut self) {
        self.accepted = self.low;
    }

    /// Takes a reading, in tenths of a volt; 0 = unknown. Returns whether the battery is low, if
    /// that has changed.
    pub(crate) fn read(&mut self, now: Duration, decivolts: u8, limits: Limits) -> Option<bool> {
        if limits.low == 0 || decivolts == 0 {
            return None;
        }
        let contradicts = if self.low {
            decivolts >= limits.low.saturating_add(limits.charged_by)
        } else {
            decivolts < limits.low
        };
        if !contradicts {
            self.contradicted = None;
            return None;
        }
        let since = *self.contradicted.get_or_insert(now);
        if now.saturating_sub(since) < limits.steady {
            return None;
        }
        *self = Self {
            low: !self.low,
            ..Self::default()
        };
        Some(self.low)
    }
}
