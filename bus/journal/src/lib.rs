//! Recordings: the structure of an MCAP file, written and read without I/O.
//!
//! ```text
//!  samples ──> Journal ──bytes──> file ──bytes──> Walk ──> Check: what is wrong with it
//!                                   │               └────> Recovery ──> Journal
//!                                   └──parts──> Overview ──> Ordered: samples by their time
//! ```
//!
//! Bytes go out of [`Journal`] and into the readers by hand: nothing here opens a file, starts a
//! thread or reads a clock. So a file that is cut off at any byte is a test without a disk.
//!
//! # The file
//!
//! A file is plain MCAP, which other people's tools read: a channel for each topic, chunks packed
//! with LZ4, every CRC that the format has. A message is JSON with a JSON Schema beside it:
//!
//! ```text
//! {"stamp":{"sequence":41,"source_time_ns":…,…},"lost":0,"dropped":0,"payload":{…}}
//! ```
//!
//! `lost` and `dropped` count the topic's samples since the recording began that never reached the
//! recorder and that it had no time for ([`Envelope`]). They stand in each message, so a file that
//! was cut off still says what it lacks. The metadata record `lager.counts` has them for the file,
//! and `lager.recording` says of which robot it is ([`Start`]).
//!
//! Each file of a recording can be used alone: it begins with the last sample of every topic that
//! holds, in a channel of its own whose metadata has the key `lager.repeated` ([`Content`]). Such a
//! sample keeps its stamp and its publish time; its log time is the file's begin. It is in no count.
//!
//! Beside the topics stand channels with the exact `foxglove.*` schemas ([`View`]), derived from
//! what the topics say ([`Scene`]) so that viewers show map and robot without set-up. Their
//! channel's metadata has the key `lager.derived`. They are no samples: nobody counts, plays or
//! exports them.
//!
//! A message's publish time is its stamp's and its log time the same, but never before the
//! recording began nor after the sample was received; both are ns since 1970, so that tools show a
//! date. Whether that date can be believed, and when the machine's calendar was set meanwhile, says
//! the metadata record `lager.calendar` ([`CalendarStep`]).
//!
//! Whole chunks are what survives: a file that was cut off has all of them and no index, and
//! [`Recovery`] makes a new file of them.

#![forbid(unsafe_code)]

mod calendar;
mod check;
mod counts;
mod date;
mod envelope;
mod numbers;
mod ordered;
mod overview;
mod read;
mod recover;
mod scene;
mod unpack;
mod walk;
mod write;

pub use calendar::{Calendar, Step as CalendarStep, is_doubtful};
pub use check::{Check, Fault, Report, TopicReport};
pub use counts::{Count, Counts};
pub use date::utc;
pub use envelope::{Content, Envelope, EnvelopeSchema};
pub use ordered::{Ordered, Placed, Selection, Step};
pub use overview::{Overview, OverviewReader, Scan, TopicOverview};
pub use read::{Part, ReadError};
pub use recover::{Recovered, Recovery};
pub use scene::{Kind, Scene, Shown, View};
pub use walk::{Damage, Learnt, Message, Topic, Visit, Walk};
pub use write::{Channel, Journal, Start, Times, WriteError};
