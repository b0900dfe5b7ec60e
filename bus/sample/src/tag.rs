//! [`Tag`] and [`Coded`]: enums inside samples, as a byte that may hold any value.
//!
//! With a Rust enum in shared memory, a foreign writer's mistake would be undefined behaviour in
//! the reader. A [`Tag`] is read as an `Option`, and an unknown code stays visible as a number.

use core::fmt;
use core::marker::PhantomData;

use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;
use serde::de::{Error, Unexpected, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::hash;
use crate::schema::{Field, Make};

/// An enum whose variants have fixed one-byte codes and names.
pub trait Coded: Copy + PartialEq + fmt::Debug + Send + Sync + 'static {
    /// The enum's name.
    const NAME: &'static str;
    /// Every variant with its name, in the order of declaration.
    const VARIANTS: &'static [(Self, &'static str)];
    /// Every variant's code and name, in the same order.
    const CODES: &'static [(u8, &'static str)];
    /// Hash over the enum's name and each variant's name and code.
    const SHAPE: u64;

    /// The byte of this variant.
    fn to_code(self) -> u8;

    /// The variant with this byte, if there is one.
    fn of_code(code: u8) -> Option<Self> {
        Self::VARIANTS
            .iter()
            .map(|(variant, _)| *variant)
            .find(|variant| variant.to_code() == code)
    }

    /// The variant's name as written in the source.
    fn name(self) -> &'static str {
        Self::VARIANTS
            .iter()
            .find(|(variant, _)| *variant == self)
            .map_or("", |(_, name)| name)
    }

    /// The variant with this name; letter case does not matter.
    fn of_name(name: &str) -> Option<Self> {
        Self::VARIANTS
            .iter()
            .find(|(_, known)| known.eq_ignore_ascii_case(name))
            .map(|(variant, _)| *variant)
    }
}

/// Describes an enum defined elsewhere. Its variants must cast to their codes.
#[macro_export]
macro_rules! coded_as_is {
    ($name:ident { $( $variant:ident ),* $(,)? }) => {
        impl $crate::Coded for $name {
            const NAME: &'static str = stringify!($name);
            const VARIANTS: &'static [(Self, &'static str)] =
                &[ $( ($name::$variant, stringify!($variant)) ),* ];
            const CODES: &'static [(u8, &'static str)] =
                &[ $( ($name::$variant as u8, stringify!($variant)) ),* ];
            const SHAPE: u64 = {
                let hash = $crate::hash::bytes($crate::hash::START, stringify!($name).as_bytes());
                $(
                    let hash = $crate::hash::bytes(hash, stringify!($variant).as_bytes());
                    let hash = $crate::hash::number(hash, $name::$variant as u64);
                )*
                hash
            };

            fn to_code(self) -> u8 {
                // A variant that is missing above does not compile, because of this match.
                match self {
                    $( $name::$variant => $name::$variant as u8, )*
                }
            }
        }
    };
}

/// Defines an enum with one-byte codes, and describes it, so that a payload may carry it as a
/// [`Tag`].
#[macro_export]
macro_rules! coded {
    (
        $(#[$meta:meta])*
        pub enum $name:ident {
            $( $(#[$variant_meta:meta])* $variant:ident = $code:literal ),* $(,)?
        }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[repr(u8)]
        pub enum $name {
            $( $(#[$variant_meta])* $variant = $code, )*
        }

        $crate::coded_as_is!($name { $( $variant ),* });
    };
}

/// One byte: the code of a variant of `E`, or an unknown code. Blank is code 0.
#[repr(transparent)]
pub struct Tag<E>(u8, PhantomData<E>);

// SAFETY: a transparent byte. Every bit pattern is valid, and it refers to nothing.
#[allow(unsafe_code)]
unsafe impl<E: Coded> ZeroCopySend for Tag<E> {
    unsafe fn type_name() -> &'static str {
        "u8"
    }
}

impl<E: Coded> Tag<E> {
    /// A tag with any code, known or not.
    pub const fn from_raw(code: u8) -> Self {
        Self(code, PhantomData)
    }

    /// The byte as it lies in memory.
    pub const fn raw(self) -> u8 {
        self.0
    }

    /// The variant, if the code has one.
    pub fn get(self) -> Option<E> {
        E::of_code(self.0)
    }
}

// SAFETY: as above.
#[allow(unsafe_code)]
unsafe impl<E: Coded> Field for Tag<E> {
    const MAKE: Make = Make::Tag {
        name: E::NAME,
        variants: E::CODES,
    };
    const SHAPE: u64 = hash::number(hash::bytes(hash::START, b"tag"), E::SHAPE);
    const BLANK: Self = Self::from_raw(0);
}

impl<E: Coded> From<E> for Tag<E> {
    fn from(variant: E) -> Self {
        Self::from_raw(variant.to_code())
    }
}

impl<E> Clone for Tag<E> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<E> Copy for Tag<E> {}

impl<E: Coded> Default for Tag<E> {
    fn default() -> Self {
        Self::BLANK
    }
}

impl<E> PartialEq for Tag<E> {
    fn eq(&self, other: &Self) -> bool {
        self.0 == other.0
    }
}

impl<E> Eq for Tag<E> {}

impl<E: Coded> PartialEq<E> for Tag<E> {
    fn eq(&self, other: &E) -> bool {
        self.0 == other.to_code()
    }
}

impl<E: Coded> fmt::Debug for Tag<E> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, formatter)
    }
}

impl<E: Coded> fmt::Display for Tag<E> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.get() {
            Some(variant) => formatter.write_str(variant.name()),
            None => write!(formatter, "{}", self.0),
        }
    }
}

impl<E: Coded> Serialize for Tag<E> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.get() {
            Some(variant) => serializer.serialize_str(variant.name()),
            None => serializer.serialize_u8(self.0),
        }
    }
}

impl<'de, E: Coded> Deserialize<'de> for Tag<E> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NameOrCode<E>(PhantomData<E>);

        impl<E: Coded> Visitor<'_> for NameOrCode<E> {
            type Value = Tag<E>;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(formatter, "a code 0..=255 or one of")?;
                for (_, name) in E::VARIANTS {
                    write!(formatter, " {name}")?;
                }
                Ok(())
            }

            fn visit_str<X: Error>(self, name: &str) -> Result<Tag<E>, X> {
                E::of_name(name)
                    .map(Tag::from)
                    .ok_or_else(|| X::invalid_value(Unexpected::Str(name), &self))
            }

            fn visit_u64<X: Error>(self, code: u64) -> Result<Tag<E>, X> {
                u8::try_from(code)
                    .map(Tag::from_raw)
                    .map_err(|_| X::invalid_value(Unexpected::Unsigned(code), &self))
            }

            fn visit_i64<X: Error>(self, code: i64) -> Result<Tag<E>, X> {
                u8::try_from(code)
                    .map(Tag::from_raw)
                    .map_err(|_| X::invalid_value(Unexpected::Signed(code), &self))
            }
        }

        deserializer.deserialize_any(NameOrCode(PhantomData))
    }
}

#[cfg(test)]
// The macro makes public types; here they stay inside the test.
#[allow(unreachable_pub)]
mod tests {
    use super::*;

    crate::coded! {
        /// A probe.
        pub enum Colour {
            /// Red.
            Red = 1,
            /// Green.
            Green = 7,
        }
    }

    #[test]
    fn a_known_code_is_its_variant() {
        let tag = Tag::from(Colour::Green);
        assert_eq!(tag.get(), Some(Colour::Green));
        assert_eq!(tag.raw(), 7);
        assert_eq!(tag, Colour::Green);
        assert_eq!(format!("{tag:?}"), "Green");
    }

    #[test]
    fn an_unknown_code_is_nothing_but_keeps_its_number() {
        let tag = Tag::<Colour>::from_raw(9);
        assert_eq!(tag.get(), None);
        assert_eq!(serde_json::to_string(&tag).unwrap(), "9");
        assert_eq!(serde_json::from_str::<Tag<Colour>>("9").unwrap(), tag);
    }

    #[test]
    fn json_carries_the_name_and_reads_name_or_code() {
        assert_eq!(
            serde_json::to_string(&Tag::from(Colour::Red)).unwrap(),
            "\"Red\""
        );
        for text in ["\"Red\"", "\"red\"", "1"] {
            let tag: Tag<Colour> = serde_json::from_str(text).unwrap();
            assert_eq!(tag, Colour::Red, "{text}");
        }
    }

    #[test]
    fn a_wrong_name_is_refused_with_the_right_ones() {
        let error = serde_json::from_str::<Tag<Colour>>("\"Blue\"").unwrap_err();
        assert!(error.to_string().contains("Red Green"), "{error}");
        assert!(serde_json::from_str::<Tag<Colour>>("256").is_err());
    }
}
