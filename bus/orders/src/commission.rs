//! [`Commission`]: what a person at a page says to the commissioning of a robot.

use core::fmt;

/// What a person says to a commissioning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Commission {
    /// `begin`: find out how the robot is built.
    Begin,
    /// `undo`: put back the description from before the last commissioning.
    Undo,
    /// `restart`: start the robot again, so that all of it uses the description that is saved.
    Restart,
    /// `here`: the person is there. A movement goes on only while somebody says so.
    Here,
    /// `stand`: a movement ends, and its step begins anew.
    Stand,
    /// `quit`: end it; the boards are told what they were told before.
    Quit,
    /// `answer`: the answer to what is asked.
    Answer {
        /// The number of what was asked. An answer to anything else counts for nothing.
        asked: u32,
        /// The answer, as a person would type it.
        word: AnswerWord,
    },
}

impl Commission {
    /// Whether the robot moves by it, or goes on moving.
    pub const fn may_move(self) -> bool {
        matches!(self, Self::Here | Self::Answer { .. })
    }

    /// Whether nothing moves after it, so that it is never too late.
    pub const fn is_end(self) -> bool {
        matches!(self, Self::Stand | Self::Quit)
    }
}

/// An answer in one word: 1 to 16 of a-z, 0-9, `.`, `,` and `-`.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct AnswerWord {
    /// The rest is 0.
    bytes: [u8; Self::MOST],
}

impl AnswerWord {
    /// The most characters.
    pub const MOST: usize = 16;

    /// The word, if it is such a one.
    pub fn new(word: &str) -> Option<Self> {
        let is_fit = |byte: u8| matches!(byte, b'a'..=b'z' | b'0'..=b'9' | b'.' | b',' | b'-');
        let mut bytes = [0; Self::MOST];
        let place = bytes
            .get_mut(..word.len())
            .filter(|place| !place.is_empty())?;
        place.copy_from_slice(word.as_bytes());
        word.bytes().all(is_fit).then_some(Self { bytes })
    }

    /// The word.
    pub fn as_str(&self) -> &str {
        let length = self.bytes.iter().position(|byte| *byte == 0);
        let word = &self.bytes[..length.unwrap_or(Self::MOST)];
        // It is made of ASCII alone.
        str::from_utf8(word).unwrap_or("")
    }
}

impl fmt::Debug for AnswerWord {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self.as_str(), formatter)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_answer_is_one_word_that_a_line_can_hold() {
        for word in ["yes", "12,5", "fb", "-3", "a234567890123456"] {
            assert_eq!(AnswerWord::new(word).expect(word).as_str(), word);
        }
        for word in ["", "two words", "Yes", "å", "a2345678901234567", "a\n"] {
            assert_eq!(AnswerWord::new(word), None, "{word}");
        }
    }
}
