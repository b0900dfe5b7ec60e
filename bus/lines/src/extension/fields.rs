//! Lines of fields, `key=value`: they stand in any order, each at most once, and what is not known
//! is left out. A field that a reader does not know is passed over, so that there may be more of
//! them one day.

use core::fmt;

use lager_floor::{Heading, Node, ProductId};
use lager_orders::{Mode, Pick, Reason};
use lager_wire::{Binary, LineBits};

use crate::floor::product;
use crate::misread::Misread;
use crate::reader::Reader;
use crate::text::Name;

/// Defines a struct, how each field is read and in which order they are written.
macro_rules! fields {
    (
        $(#[$outer:meta])*
        pub struct $name:ident {
            $( $(#[$meta:meta])* $key:ident: $type:ty = $wanted:literal, )*
        }
    ) => {
        $(#[$outer])*
        #[derive(Clone, Debug, Default, PartialEq, Eq)]
        pub struct $name {
            $( $(#[$meta])* pub $key: Option<$type>, )*
        }

        impl $name {
            pub(super) fn read(
                reader: &mut $crate::reader::Reader<'_>,
            ) -> Result<Self, $crate::misread::Misread> {
                use $crate::extension::fields::Value;

                let mut read = Self::default();
                while !reader.ahead().text.is_empty() {
                    let field = reader.word();
                    let Some((key, value)) = field.split('=') else {
                        return Err(field.misread("a field such as x_mm=400"));
                    };
                    match key.text {
                        $( stringify!($key) => {
                            if read.$key.is_some() {
                                return Err(key.misread("a field that has not been given yet"));
                            }
                            read.$key = Some(value.read($wanted, <$type as Value>::of)?);
                        } )*
                        _ => {}
                    }
                }
                Ok(read)
            }
        }

        impl core::fmt::Display for $name {
            /// The fields, with a blank before each.
            fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                use $crate::extension::fields::Value as _;

                $( if let Some(value) = &self.$key {
                    write!(formatter, concat!(" ", stringify!($key), "="))?;
                    value.put(formatter)?;
                } )*
                Ok(())
            }
        }
    };
}

pub(super) use fields;

/// An angle in whole degrees, 0 to 359, clockwise from up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Degrees(u16);

impl Degrees {
    pub(super) const WANTED: &str = "an angle from 0 to 359 degrees";

    /// This angle, brought into the range.
    pub const fn new(degrees: i32) -> Self {
        // Below 360.
        Self(degrees.rem_euclid(360) as u16)
    }

    /// The angle, 0 to 359.
    pub const fn get(self) -> u16 {
        self.0
    }

    pub(super) fn of(text: &str) -> Option<Self> {
        u16::of(text).filter(|degrees| *degrees < 360).map(Self)
    }
}

impl fmt::Display for Degrees {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}", self.0)
    }
}

/// Where servo n stands at index n - 1, 0 to 1023; `None` has not been heard.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Servos([Option<u16>; 8]);

impl Servos {
    /// These positions; a servo that stands beyond 1023 has not been heard.
    pub fn new(positions: [Option<u16>; 8]) -> Self {
        Self(positions.map(|position| position.filter(|position| *position <= 1023)))
    }

    /// The positions.
    pub const fn get(self) -> [Option<u16>; 8] {
        self.0
    }
}

/// How hard servo n works at index n - 1, -1023 to 1023; the sign is the direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Loads([i16; 8]);

impl Loads {
    const MOST: i16 = 1023;

    /// These loads; one beyond the range is the most that there is.
    pub fn new(loads: [i16; 8]) -> Self {
        Self(loads.map(|load| load.clamp(-Self::MOST, Self::MOST)))
    }

    /// The loads.
    pub const fn get(self) -> [i16; 8] {
        self.0
    }
}

/// The number that stands next.
pub(super) fn number(reader: &mut Reader<'_>) -> Result<u32, Misread> {
    let wanted = "a number from 0 to 4294967295";
    reader.word().number(wanted, 0, i64::from(u32::MAX))
}

/// How a field's value is written behind the `=`.
pub(super) trait Value: Sized {
    fn of(text: &str) -> Option<Self>;
    fn put(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result;
}

macro_rules! numbers {
    ($($type:ty),*) => { $(
        impl Value for $type {
            fn of(text: &str) -> Option<Self> {
                // Only what `put` may write: `parse` would take a `+` too.
                text.parse().ok().filter(|_| !text.starts_with('+'))
            }

            fn put(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(formatter, "{self}")
            }
        }
    )* };
}

numbers!(u8, u16, u32, u64, i8, i16, i32);

macro_rules! words {
    ($($type:ty),*) => { $(
        impl Value for $type {
            fn of(text: &str) -> Option<Self> {
                Self::from_word(text)
            }

            fn put(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str(self.as_str())
            }
        }
    )* };
}

words!(Heading, Mode, Pick);

impl Value for bool {
    fn of(text: &str) -> Option<Self> {
        match text {
            "0" => Some(false),
            "1" => Some(true),
            _ => None,
        }
    }

    fn put(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(if *self { "1" } else { "0" })
    }
}

impl Value for Degrees {
    fn of(text: &str) -> Option<Self> {
        Self::of(text)
    }

    fn put(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{self}")
    }
}

impl Value for Node {
    fn of(text: &str) -> Option<Self> {
        let (x, y) = text.split_once(',')?;
        Some(Self {
            x: u8::of(x)?,
            y: u8::of(y)?,
        })
    }

    fn put(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{},{}", self.x, self.y)
    }
}

impl Value for Name {
    fn of(text: &str) -> Option<Self> {
        Self::new(text).ok()
    }

    fn put(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{self}")
    }
}

impl Value for ProductId {
    fn of(text: &str) -> Option<Self> {
        product(text)
    }

    fn put(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{self}")
    }
}

/// In one word: a blank is written `%20`, `%` and `=` `%25` and `%3D`.
impl Value for Reason {
    fn of(text: &str) -> Option<Self> {
        let text = text.replace("%20", " ").replace("%3D", "=");
        (!text.is_empty()).then(|| Self::read(&text.replace("%25", "%")))
    }

    fn put(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        for letter in self.as_str().chars() {
            match letter {
                '%' => formatter.write_str("%25")?,
                '=' => formatter.write_str("%3D")?,
                ' ' | '\t' | '\r' | '\n' => formatter.write_str("%20")?,
                letter => write!(formatter, "{letter}")?,
            }
        }
        Ok(())
    }
}

impl Value for LineBits {
    fn of(text: &str) -> Option<Self> {
        digits(text, usize::from(Self::SENSORS)).map(Self)
    }

    fn put(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{:011b}", self.0 & Self::MASK)
    }
}

impl Value for Binary {
    fn of(text: &str) -> Option<Self> {
        digits(text, 8)
            .and_then(|code| u8::try_from(code).ok())
            .map(Self)
    }

    fn put(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{self}")
    }
}

impl Value for Servos {
    fn of(text: &str) -> Option<Self> {
        let of = |word: &str| match word {
            "-" => Some(None),
            number => u16::of(number)
                .filter(|position| *position <= 1023)
                .map(Some),
        };
        row(text, of).map(Self)
    }

    fn put(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        put_row(formatter, self.0, |position, formatter| match position {
            Some(position) => write!(formatter, "{position}"),
            None => formatter.write_str("-"),
        })
    }
}

impl Value for Loads {
    fn of(text: &str) -> Option<Self> {
        let range = -Self::MOST..=Self::MOST;
        row(text, |word| {
            i16::of(word).filter(|load| range.contains(load))
        })
        .map(Self)
    }

    fn put(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        put_row(formatter, self.0, |load, formatter| {
            write!(formatter, "{load}")
        })
    }
}

/// Eight values with commas between.
fn row<T: Copy>(text: &str, of: impl Fn(&str) -> Option<T>) -> Option<[T; 8]> {
    let values: Option<Vec<T>> = text.split(',').map(of).collect();
    values?.try_into().ok()
}

fn put_row<T>(
    formatter: &mut fmt::Formatter<'_>,
    values: [T; 8],
    put: impl Fn(T, &mut fmt::Formatter<'_>) -> fmt::Result,
) -> fmt::Result {
    for (index, value) in values.into_iter().enumerate() {
        if index > 0 {
            formatter.write_str(",")?;
        }
        put(value, formatter)?;
    }
    Ok(())
}

/// The number that so many digits of 0 and 1 write, at most sixteen.
fn digits(text: &str, length: usize) -> Option<u16> {
    let is_binary = text.bytes().all(|byte| matches!(byte, b'0' | b'1'));
    (is_binary && text.len() == length).then(|| u16::from_str_radix(text, 2).ok())?
}
