//! [`Profile`]: a part of the description of a robot, and how a board learns it.
//!
//! ```text
//!  Pi                                              board
//!   | -- setting FIRST, value --------------------> |  the board stores it and answers
//!   |    ... one setting for each value ...         |
//!   | -- setting CHECK, check value --------------> |  all values are in force, or none
//!   | <------- reply, check value in force -------- |
//! ```
//!
//! A board obeys a profile as a whole, because half of a new one beside half of the old one may
//! allow what neither of them allows.

use crate::crc::checksum_of;
use crate::setting::{Setting, SettingKey};

/// A part of the description of a robot that one board is told.
pub trait Profile: Sized {
    /// An array of the values that the board receives.
    type Values: AsRef<[u16]> + AsMut<[u16]> + for<'a> TryFrom<&'a [u16]> + Copy + core::fmt::Debug;

    /// The setting that carries the first value; the others follow it without a gap.
    const FIRST: SettingKey;

    /// The setting that puts the values in force.
    const CHECK: SettingKey;

    /// The values that the board receives, each at most `i16::MAX`.
    fn told(&self) -> Self::Values;

    /// The profile with these values, if a board can obey it.
    fn obeyed(values: &Self::Values) -> Option<Self>;

    /// The same check, without the profile.
    fn is_sound(values: &Self::Values) -> bool {
        Self::obeyed(values).is_some()
    }

    /// The setting that carries value `index`, if there is such a value.
    fn key(index: usize) -> Option<SettingKey> {
        let code = u8::try_from(index).ok()?.checked_add(Self::FIRST.code())?;
        SettingKey::from_code(code).filter(|key| Self::index(*key).is_some())
    }

    /// The index of the value that a setting carries, if it carries one.
    fn index(key: SettingKey) -> Option<usize> {
        let index = usize::from(key.code().checked_sub(Self::FIRST.code())?);
        (index < size_of::<Self::Values>() / size_of::<u16>()).then_some(index)
    }

    /// The check value of a profile's values, as the setting [`Profile::CHECK`] carries it: 0 to
    /// 255.
    fn check(values: &Self::Values) -> i16 {
        checksum_of(values.as_ref()).into()
    }

    /// Everything that the board is told, in this order. The numbers are 0.
    fn settings(&self) -> impl Iterator<Item = Setting> {
        let values = self.told();
        let count = values.as_ref().len();
        (0..=count).map(move |index| {
            let (key, value) = match (Self::key(index), values.as_ref().get(index)) {
                (Some(key), Some(value)) => (key, value.cast_signed()),
                _ => (Self::CHECK, Self::check(&values)),
            };
            Setting { key, seq: 0, value }
        })
    }
}

/// Declares a profile, which is also a section of the configuration: its keys, their defaults, and
/// the explanations that `lager config` prints.
macro_rules! profile {
    (
        $(#[doc = $about:literal])*
        pub struct $name:ident {
            $(
                $(#[doc = $explained:literal])*
                pub $key:ident: $kind:ty = $default:expr,
            )*
        }
    ) => {
        $(#[doc = $about])*
        // The file has [lowest, highest] for limits, which is no link.
        #[allow(rustdoc::broken_intra_doc_links)]
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        #[cfg_attr(feature = "serde", serde(deny_unknown_fields, default))]
        pub struct $name {
            $(
                $(#[doc = $explained])*
                pub $key: $kind,
            )*
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($key: $default,)* }
            }
        }

        impl $name {
            /// The lines that explain the section to a person.
            pub const ABOUT: &[&str] = &[$($about),*];
            /// The keys of the section, each with the lines that explain it.
            pub const KEYS: &[(&str, &[&str])] = &[$((stringify!($key), &[$($explained),*])),*];
        }
    };
}

pub(crate) use profile;
