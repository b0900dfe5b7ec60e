//! Text of bounded length inside a sample.
//!
//! Its own type and not a standard container, because any bytes a foreign writer leaves in
//! shared memory must be readable without undefined behaviour.

use core::fmt;

use iceoryx2::prelude::ZeroCopySend;
use serde::de::{Error, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::hash;
use crate::schema::Field;

/// Up to `N` (at most 255) bytes of UTF-8. Longer text is cut at a character's border.
///
/// `write!` appends to it without allocating and never fails; what does not fit is dropped.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Text<const N: usize> {
    bytes: [u8; N],
    length: u8,
}

// SAFETY: bytes only; every bit pattern is valid and it refers to nothing.
#[allow(unsafe_code)]
unsafe impl<const N: usize> ZeroCopySend for Text<N> {
    unsafe fn type_name() -> &'static str {
        "lager::Text"
    }
}

impl<const N: usize> Field for Text<N> {
    const SHAPE: u64 = hash::number(hash::bytes(hash::START, b"text"), N as u64);
    const BLANK: Self = {
        assert!(N <= 255, "a Text counts its bytes in one byte");
        Self {
            bytes: [0; N],
            length: 0,
        }
    };
}

impl<const N: usize> Text<N> {
    /// As much of `text` as fits.
    pub fn new(text: &str) -> Self {
        let mut new = Self::BLANK;
        new.push_str(text);
        new
    }

    /// Appends as much of `text` as fits, whole characters only.
    pub fn push_str(&mut self, text: &str) {
        let used = self.as_str().len();
        let mut taken = text.len().min(N - used);
        while !text.is_char_boundary(taken) {
            taken -= 1;
        }
        self.bytes[used..used + taken].copy_from_slice(&text.as_bytes()[..taken]);
        // At most `N`, which is at most 255.
        self.length = (used + taken) as u8;
    }

    /// The text; if a writer left invalid UTF-8, what is valid before it.
    pub fn as_str(&self) -> &str {
        let bytes = &self.bytes[..usize::from(self.length).min(N)];
        match core::str::from_utf8(bytes) {
            Ok(text) => text,
            Err(error) => core::str::from_utf8(&bytes[..error.valid_up_to()]).unwrap_or(""),
        }
    }
}

impl<const N: usize> Default for Text<N> {
    fn default() -> Self {
        Self::BLANK
    }
}

impl<const N: usize> From<&str> for Text<N> {
    fn from(text: &str) -> Self {
        Self::new(text)
    }
}

impl<const N: usize> PartialEq for Text<N> {
    fn eq(&self, other: &Self) -> bool {
        self.as_str() == other.as_str()
    }
}

impl<const N: usize> Eq for Text<N> {}

impl<const N: usize> fmt::Write for Text<N> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.push_str(text);
        Ok(())
    }
}

impl<const N: usize> fmt::Debug for Text<N> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self.as_str(), formatter)
    }
}

impl<const N: usize> fmt::Display for Text<N> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.as_str())
    }
}

impl<const N: usize> Serialize for Text<N> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.as_str())
    }
}

impl<'de, const N: usize> Deserialize<'de> for Text<N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct AnyText<const N: usize>;

        impl<const N: usize> Visitor<'_> for AnyText<N> {
            type Value = Text<N>;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(formatter, "text of at most {N} bytes")
            }

            fn visit_str<X: Error>(self, text: &str) -> Result<Text<N>, X> {
                if text.len() > N {
                    return Err(X::invalid_length(text.len(), &self));
                }
                Ok(Text::new(text))
            }
        }

        deserializer.deserialize_str(AnyText)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::fmt::Write as _;
    use proptest::prelude::*;

    #[test]
    fn long_text_is_cut_between_characters() {
        let text = Text::<5>::new("lådan");
        assert_eq!(text.as_str(), "låda");
        assert_eq!(Text::<2>::new("lå").as_str(), "l");
    }

    #[test]
    fn formatting_appends_and_drops_what_does_not_fit() {
        let mut text = Text::<8>::default();
        write!(text, "node {} of {}", 7, 12).unwrap();
        assert_eq!(text.as_str(), "node 7 o");
    }

    #[test]
    fn any_bytes_read_as_text() {
        let text = Text::<4> {
            bytes: [b'a', 0xFF, 0xC3, 0x28],
            length: 200,
        };
        assert_eq!(text.as_str(), "a");
    }

    #[test]
    fn json_refuses_what_would_be_cut() {
        assert_eq!(
            serde_json::from_str::<Text<4>>("\"four\"").unwrap(),
            Text::new("four")
        );
        assert!(serde_json::from_str::<Text<4>>("\"fiver\"").is_err());
    }

    proptest! {
        #[test]
        fn what_fits_comes_back_whole(text in "\\PC{0,20}") {
            let kept = Text::<255>::new(&text);
            prop_assert_eq!(kept.as_str(), text.as_str());
        }

        #[test]
        fn what_is_kept_is_a_beginning(text in "\\PC{0,20}") {
            let kept = Text::<7>::new(&text);
            prop_assert!(text.starts_with(kept.as_str()));
            prop_assert!(kept.as_str().len() + 4 > text.len().min(7));
        }
    }
}
