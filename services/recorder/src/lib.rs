//! The recorder writes the samples of a bus into a file. It also reads such a file: it plays it
//! onto a bus, or shows it as text.
//!
//! ```text
//!   bus ──polls──> listener ──queue──> keeper ──> file            (record)
//!   file ──> info, check, recover, export
//!   file ──> player ──> bus of a robot that is not up             (play)
//!   file ──> navigator ──> compared with the file                 (play --verify)
//! ```
//!
//! It is an observer: it polls, wakes nobody, and nobody wakes it. It costs each writer one queue
//! entry. `lager-journal` knows the structure of a file; here are threads, clocks and files.
//!
//! **It counts each sample that it misses, and where.** A sample is lost if its writer overwrites
//! it before the listener looks; its stamp's number shows that. It is dropped if the queue is full
//! because the disk is slow. Each message and the file's end have both counts.
//!
//! **A killed recorder loses little.** The keeper ends a chunk and calls `fdatasync` every 150 ms.
//! After a kill the samples since then are lost, and the file needs `lager bag recover`. On a full
//! disk the keeper ends the file in the room that it has reserved, so the file is undamaged.
//!
//! **Each file can be used alone.** It begins with the last sample of every topic that carries a
//! state. These samples stand in an earlier file as well, so no count has them. A player that
//! begins later than the recording publishes them, too.
//!
//! **A date is only as good as the machine's calendar.** The recorder warns of a date before 2024.
//! If somebody sets the calendar during the recording, the recorder reports it and writes it into
//! the file.
//!
//! **A player moves nothing.** See `play.rs`.

mod bag;
mod config;
mod disk;
mod error;
mod export;
mod keeper;
mod latest;
mod listener;
mod look;
mod part;
mod play;
mod record;
mod recover;
mod samples;
mod tally;
mod verify;

pub use bag::BagError;
pub use config::{RecordConfig, Split};
pub use disk::Fate;
pub use error::RecordError;
pub use export::export_csv;
pub use lager_journal::utc;
pub use latest::{Latest, latest};
pub use look::{check, doubt, info};
pub use play::{PlayConfig, PlayError, Stamps, play};
pub use record::{LiveCount, Progress, Recorded, record};
pub use recover::recover;
pub use samples::{FileSample, samples};
pub use verify::{
    Compared, Did, Difference, Gap, OfTopic, Rerun, SampleDifference, Verified, VerifyError, Why,
    verify,
};
