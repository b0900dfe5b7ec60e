//! `state`: what the robot is doing, twenty times a second, as far as it is known.
//!
//! ```text
//! state time_ms=81250 x_mm=400 y_mm=0 heading_deg=90 node=1,0 looks=right phase=driving
//! ```
//!
//! Fields stand in any order, each at most once; what is not known is left out. A field that a
//! reader does not know is passed over, so that there may be more of them one day.

use core::fmt;

use lager_wire::{Binary, LineBits};

use super::order::Mode;
use crate::misread::Misread;
use crate::reader::Reader;
use crate::text::Name;
use crate::warehouse::{Coord, Direction, ProductId};

/// Defines the fields, how each is read and in which order they are written.
macro_rules! state {
    ($( $(#[$meta:meta])* $key:ident: $type:ty = $wanted:literal, )*) => {
        /// What the robot is doing. `None` is not known.
        #[derive(Clone, Debug, Default, PartialEq, Eq)]
        pub struct State {
            $( $(#[$meta])* pub $key: Option<$type>, )*
        }

        impl State {
            pub(super) fn read(reader: &mut Reader<'_>) -> Result<Self, Misread> {
                let mut state = Self::default();
                while !reader.ahead().text.is_empty() {
                    let field = reader.word();
                    let Some((key, value)) = field.split('=') else {
                        return Err(field.misread("a field such as x_mm=400"));
                    };
                    match key.text {
                        $( stringify!($key) => {
                            if state.$key.is_some() {
                                return Err(key.misread("a field that has not been given yet"));
                            }
                            state.$key = Some(value.read($wanted, <$type>::of)?);
                        } )*
                        _ => {}
                    }
                }
                Ok(state)
            }
        }

        impl fmt::Display for State {
            /// The fields, with a blank before each.
            fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                $( if let Some(value) = &self.$key {
                    write!(formatter, concat!(" ", stringify!($key), "="))?;
                    value.put(formatter)?;
                } )*
                Ok(())
            }
        }
    };
}

state! {
    /// The robot's clock in ms since its origin.
    time_ms: u64 = "a time in ms",
    /// Where the middle of the axle is by odometry, in mm to the right of node (0, 0).
    x_mm: i32 = "a way in mm",
    /// Where the middle of the axle is by odometry, in mm up from node (0, 0).
    y_mm: i32 = "a way in mm",
    /// Where the robot looks, by odometry.
    heading_deg: Degrees = "an angle from 0 to 359 degrees",
    /// The node last passed.
    node: Coord = "a node such as 2,1",
    /// Where the robot looks along the grid.
    looks: Direction = "left, up, right or down",
    /// The node it goes to.
    next: Coord = "a node such as 2,1",
    /// What it does, by the names of the phases of `nav/status`, such as `driving`.
    phase: Name = "a name of 1 to 32 of a-z, 0-9, - and _",
    /// Why it stands although it would drive, likewise.
    hold: Name = "a name of 1 to 32 of a-z, 0-9, - and _",
    /// Who drives.
    mode: Mode = "manual or autonomous",
    /// Whether a stop is in force.
    stopped: bool = "0 or 1",
    /// The order it is on.
    order: u32 = "an order from 0 to 4294967295",
    /// The product it fetches.
    product: ProductId = "a product's number from 0 to 2147483647",
    /// Products it has delivered.
    delivered: u32 = "a number from 0 to 4294967295",
    /// What the line sensors see, the leftmost first; 1 is tape (S6).
    line_bits: LineBits = "a row of eleven digits of 0 and 1",
    /// How far the line is off, in half sensors, positive to the right (AMB-20).
    line_error: i8 = "a number from -128 to 127",
    /// How far it is to what stands in front, in cm; left out where nothing is in range.
    distance_cm: u8 = "a distance from 0 to 255 cm",
    /// Duty of the left motor, of 255.
    left_duty: u8 = "a duty from 0 to 255",
    /// Duty of the right motor, of 255.
    right_duty: u8 = "a duty from 0 to 255",
    /// The command code that the steering board carries out.
    code: Binary = "a row of eight digits of 0 and 1",
    /// Where the servos stand.
    servos: Servos = "a row of eight positions from 0 to 1023 or - with commas between",
    /// The battery in tenths of a volt.
    battery_dv: u8 = "a voltage from 0 to 255 tenths of a volt",
    /// Whether the sensor board is heard.
    sensor_up: bool = "0 or 1",
    /// Whether the steering board is heard.
    steering_up: bool = "0 or 1",
    /// Packets lost from the sensor board, a lower bound.
    sensor_lost: u32 = "a number from 0 to 4294967295",
    /// Packets lost from the steering board, a lower bound.
    steering_lost: u32 = "a number from 0 to 4294967295",
    /// Samples that the robot's services have missed of each other.
    bus_lost: u64 = "a number from 0 to 18446744073709551615",
}

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

/// How a field's value is written behind the `=`.
trait Value: Sized {
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

numbers!(u8, u16, u32, u64, i8, i32);

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

impl Value for Coord {
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

impl Value for Direction {
    fn of(text: &str) -> Option<Self> {
        Self::from_word(text)
    }

    fn put(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{self}")
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

impl Value for Mode {
    fn of(text: &str) -> Option<Self> {
        Self::from_word(text)
    }

    fn put(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.as_str())
    }
}

impl Value for ProductId {
    fn of(text: &str) -> Option<Self> {
        i32::of(text).and_then(Self::new)
    }

    fn put(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{self}")
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
        let mut positions = [None; 8];
        let mut parts = text.split(',');
        for position in &mut positions {
            *position = match parts.next()? {
                "-" => None,
                number => Some(u16::of(number).filter(|position| *position <= 1023)?),
            };
        }
        parts.next().is_none().then_some(Self(positions))
    }

    fn put(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, position) in self.0.iter().enumerate() {
            if index > 0 {
                formatter.write_str(",")?;
            }
            match position {
                Some(position) => write!(formatter, "{position}")?,
                None => formatter.write_str("-")?,
            }
        }
        Ok(())
    }
}

/// The number that so many digits of 0 and 1 write, at most sixteen.
fn digits(text: &str, length: usize) -> Option<u16> {
    let is_binary = text.bytes().all(|byte| matches!(byte, b'0' | b'1'));
    (is_binary && text.len() == length).then(|| u16::from_str_radix(text, 2).ok())?
}
