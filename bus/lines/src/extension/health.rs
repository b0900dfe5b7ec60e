//! `health`: how the robot's machine, its services and its boards are, once a second.
//!
//! ```text
//! health release=0.1.0 load_percent=37 cores=4 services=bridge:up:812:0,logic:down:3:2
//! ```

use core::fmt;

use super::fields::{Value, fields};
use crate::text::Name;

fields! {
    /// How a robot is. `None` is not known.
    pub struct Health {
        /// The release of its program.
        release: Release = "a release such as 0.1.0",
        /// How many processes want a core, of the cores that there are, over the last minute.
        load_percent: u32 = "a load in percent",
        /// How many cores its machine has.
        cores: u16 = "a number of cores",
        /// The memory of its machine, in MiB.
        memory_mib: u32 = "a size in MiB",
        /// How much of that programs can still get.
        memory_free_mib: u32 = "a size in MiB",
        /// How long its last sign took to the station and back, in ms.
        trip_ms: u32 = "a time in ms",
        /// How long ago the sensor board was heard.
        sensor_age_ms: u32 = "a time in ms",
        /// How long ago the steering board was heard.
        steering_age_ms: u32 = "a time in ms",
        /// The version of the packets that the sensor board speaks; 0 is an original board.
        sensor_version: u8 = "a number from 0 to 255",
        /// The same of the steering board.
        steering_version: u8 = "a number from 0 to 255",
        /// The build number of the sensor board's image; 0 is an original board, or an image
        /// without one.
        sensor_build: u16 = "a number from 0 to 65535",
        /// The same of the steering board.
        steering_build: u16 = "a number from 0 to 65535",
        /// The build number of the images that fit the robot's program.
        program_build: u16 = "a number from 0 to 65535",
        /// How often the sensor board has restarted.
        sensor_restarts: u32 = "a number from 0 to 4294967295",
        /// How often the steering board has restarted.
        steering_restarts: u32 = "a number from 0 to 4294967295",
        /// Packets of the sensor board that were refused, because their check value was wrong.
        sensor_damaged: u32 = "a number from 0 to 4294967295",
        /// The same of the steering board.
        steering_damaged: u32 = "a number from 0 to 4294967295",
        /// The services that `lager up` watches.
        services: Services = "services such as bridge:up:812:0 with commas between",
        /// What `lager doctor` would find wrong with the machine.
        found: Findings = "findings such as shared_memory:12 with commas between",
    }
}

/// A release of a program: three numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Release(pub [u16; 3]);

impl Release {
    /// The release that `text` spells, such as `0.1.0`; what stands behind a `-` or a `+` is left
    /// out.
    pub fn new(text: &str) -> Option<Self> {
        let numbers = text.split(['-', '+']).next()?;
        let numbers: Option<Vec<u16>> = numbers.split('.').map(u16::of).collect();
        numbers?.try_into().ok().map(Self)
    }
}

impl fmt::Display for Release {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [major, minor, patch] = self.0;
        write!(formatter, "{major}.{minor}.{patch}")
    }
}

impl Value for Release {
    fn of(text: &str) -> Option<Self> {
        Self::new(text).filter(|_| !text.contains(['-', '+']))
    }

    fn put(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{self}")
    }
}

/// A service of the robot: a process that is started again when it dies.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Service {
    /// What it is called.
    pub name: Name,
    /// Whether it runs.
    pub is_up: bool,
    /// How long that has been so, in s.
    pub since_s: u32,
    /// How often it has been started again.
    pub restarts: u32,
}

/// Services; only the first [`FIT`](Self::FIT) of them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Services(Vec<Service>);

/// Something wrong with the machine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// What: a name in the table of sentences, behind `finding_`.
    pub code: Name,
    /// The number in the sentence.
    pub seen: u32,
}

/// Findings; only the first [`FIT`](Self::FIT) of them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Findings(Vec<Finding>);

/// One of a list with commas between.
trait Item: Sized {
    fn of(text: &str) -> Option<Self>;
    fn put(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result;
}

/// Lets a field list a type, of which so many always fit in the line.
macro_rules! listed {
    ($list:ty, $item:ty, $fit:literal) => {
        impl $list {
            /// How many always fit in the line.
            pub const FIT: usize = $fit;

            /// The first of `all`.
            pub fn new(all: impl IntoIterator<Item = $item>) -> Self {
                Self(all.into_iter().take(Self::FIT).collect())
            }

            /// Each of them.
            pub fn get(&self) -> &[$item] {
                &self.0
            }
        }

        impl Value for $list {
            fn of(text: &str) -> Option<Self> {
                let items = text.split(',').filter(|_| !text.is_empty());
                let items: Option<Vec<$item>> = items.map(<$item as Item>::of).collect();
                items.map(Self)
            }

            fn put(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                for (index, item) in self.0.iter().enumerate() {
                    formatter.write_str(if index > 0 { "," } else { "" })?;
                    Item::put(item, formatter)?;
                }
                Ok(())
            }
        }
    };
}

listed!(Services, Service, 7);
listed!(Findings, Finding, 4);

impl Item for Service {
    fn of(text: &str) -> Option<Self> {
        let mut parts = text.split(':');
        let mut next = || parts.next();
        let service = Self {
            name: Name::new(next()?).ok()?,
            is_up: match next()? {
                "up" => true,
                "down" => false,
                _ => return None,
            },
            since_s: u32::of(next()?)?,
            restarts: u32::of(next()?)?,
        };
        next().is_none().then_some(service)
    }

    fn put(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            name,
            is_up,
            since_s,
            restarts,
        } = self;
        let state = if *is_up { "up" } else { "down" };
        write!(formatter, "{name}:{state}:{since_s}:{restarts}")
    }
}

impl Item for Finding {
    fn of(text: &str) -> Option<Self> {
        let (code, seen) = text.split_once(':')?;
        Some(Self {
            code: Name::new(code).ok()?,
            seen: u32::of(seen)?,
        })
    }

    fn put(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}:{}", self.code, self.seen)
    }
}
