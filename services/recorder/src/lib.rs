//! The recorder: what is on the bus into a file, and what is in a file back onto a bus or into
//! text.
//!
//! ```text
//!   bus ──polls──> listener ──queue──> keeper ──> file            (record)
//!   file ──> info, check, recover, export
//!   file ──> player ──> bus of a robot that is not up             (play)
//!   file ──> navigator ──> compared with the file                 (play --verify)
//! ```
//!
//! It is an observer: it polls, wakes nobody and is woken by nobody, and costs a writer one queue
//! entry. The structure of a file is `lager-journal`'s; here are threads, clocks and files.
//!
//! **What is lost is counted, and where.** A sample may be overwritten before the listener looks
//! (lost, from the stamps), or find the queue full because the disk is slow (dropped). Both stand
//! in each message and in the file's counts.
//!
//! **What survives.** The keeper ends a chunk and calls `fdatasync` every 150 ms. A recorder
//! that is killed loses at most what came since, and its file needs `lager bag recover`. On a full
//! disk the file is ended in room that was reserved beforehand, so it is whole.
//!
//! **Each file can be used alone.** It begins with the last sample of every topic that holds, which
//! stands in an earlier file as well and is in no count. A player that begins later than the
//! recording publishes them, too.
//!
//! **A date is only as good as the machine's calendar.** One from before 2024 is called doubtful,
//! and when the calendar is set meanwhile, that is told and stands in the file.
//!
//! **A player moves nothing.** See `play.rs`.

mod bag;
mod config;
mod disk;
mod error;
mod export;
mod keeper;
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
pub use look::{check, doubt, info};
pub use play::{PlayConfig, PlayError, Stamps, play};
pub use record::{LiveCount, Progress, Recorded, record};
pub use recover::recover;
pub use samples::{FileSample, samples};
pub use verify::{
    Compared, Did, Difference, Gap, OfTopic, Rerun, SampleDifference, Verified, VerifyError, Why,
    verify,
};
