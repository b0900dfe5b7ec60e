//! [`Part`]: the part that a process plays on a bus, such as bridge or logic.

use core::fmt;

/// The part that a process plays on a bus. The application chooses the parts. The part gives a
/// process its name, and says which processes a topic wakes and which processes only observe.
///
/// An application lists its parts once, each with a name and a number of its own:
///
/// ```
/// use lager_sample::Part;
///
/// const SAILOR: Part = Part::new(0, "sailor");
/// const ONLOOKER: Part = Part::new(1, "onlooker").observing();
/// assert!(ONLOOKER.is_observer() && !SAILOR.is_observer());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    number: u8,
    name: &'static str,
    observes: bool,
}

impl Part {
    /// The most parts that the processes of one bus can play.
    pub const MOST: usize = 32;

    /// A part with a number below [`Part::MOST`] and a name of `a`-`z`, `0`-`9`, `-` and `_`.
    ///
    /// Processes on one bus must agree on the numbers, because a ringer wakes waiters by number.
    ///
    /// # Panics
    /// The number or the name is not allowed; in a constant, the compiler reports this.
    pub const fn new(number: u8, name: &'static str) -> Self {
        assert!(
            (number as usize) < Self::MOST,
            "a part's number is below 32"
        );
        assert!(
            is_name(name.as_bytes()),
            "a part's name is 1 to 16 of a-z, 0-9, - and _"
        );
        Self {
            number,
            name,
            observes: false,
        }
    }

    /// The same for processes that only observe. They share each topic's places for observers, so
    /// they never take the place of a process that acts, and a sample wakes them last, if they ask
    /// for it.
    pub const fn observing(self) -> Self {
        Self {
            observes: true,
            ..self
        }
    }

    /// Its number, below [`Part::MOST`].
    #[inline]
    pub const fn number(self) -> u8 {
        self.number
    }

    /// Its name.
    pub const fn name(self) -> &'static str {
        self.name
    }

    /// Whether its processes only observe.
    pub const fn is_observer(self) -> bool {
        self.observes
    }
}

impl fmt::Display for Part {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name)
    }
}

const fn is_name(name: &[u8]) -> bool {
    let mut at = 0;
    while at < name.len() {
        if !matches!(name[at], b'a'..=b'z' | b'0'..=b'9' | b'-' | b'_') {
            return false;
        }
        at += 1;
    }
    at > 0 && at <= 16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_can_stand_in_the_names_of_nodes_and_files() {
        for name in ["bridge", "r2-d2", "a_b", "abcdefghijklmnop"] {
            assert!(is_name(name.as_bytes()), "{name}");
        }
        for name in ["", "Bridge", "a/b", "å", "abcdefghijklmnopq"] {
            assert!(!is_name(name.as_bytes()), "{name}");
        }
    }
}
