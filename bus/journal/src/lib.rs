//! Recordings: the structure of an MCAP file, written and read without I/O.
//!
//! ```text
//!  samples ──> Journal ──bytes──> file ──bytes──> Walk ──> Check: what is wrong with it
//!                                   │               └────> Recovery ──> Journal
//!                                   └──parts──> Overview ──> Ordered: samples by their time
//! ```
//!
//! The caller takes bytes from [`Journal`] and gives bytes to the readers: nothing here opens a
//! file, starts a thread or reads a clock. So tests cut a file off at any byte without a disk.
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
//! `lost` counts the topic's samples since the recording began that never reached the recorder.
//! `dropped` counts those for which the disk was too slow ([`Envelope`]). Both stand in each
//! message, so a file that was cut off still says how many samples are missing. The metadata record
//! `lager.counts` has them for the whole file, and `lager.recording` names the robot ([`Start`]).
//!
//! Each file of a recording can be used alone. It begins with the last sample of every topic that
//! carries a state, in a channel of its own whose metadata has the key `lager.repeated`
//! ([`Content`]). Such a sample keeps its stamp and its publish time. Its log time is the beginning
//! of the file. No count has it.
//!
//! Beside the topics there are channels with the exact `foxglove.*` schemas ([`View`]). They are
//! derived from the topics ([`Scene`]), so that viewers show map and robot at once. The metadata of
//! such a channel has the key `lager.derived`. Its messages are no samples: nobody counts, plays or
//! exports them.
//!
//! A message's publish time is that of its stamp. Its log time is the same, but never before the
//! recording began nor after the recorder received the sample. Both are ns since 1970, so that
//! tools show a date. The metadata record `lager.calendar` says whether this date can be believed,
//! and when somebody has set the machine's calendar ([`CalendarStep`]).
//!
//! A file that was cut off still has its whole chunks, but no index. [`Recovery`] makes a new file
//! from these chunks.

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
pub use scene::{Kind, Scene, Shown, View, drawn, shapes};
pub use walk::{Damage, Learnt, Message, Topic, Visit, Walk};
pub use write::{Channel, Journal, Start, Times, WriteError};
