//! The errors of this crate, one enum for each operation. Every message says what to do.

use std::io::ErrorKind;
use std::path::PathBuf;

use lager_home::{ClockError, HomeError, Shortage};
use lager_sample::Part;
use lager_wake::BoardFault;

use crate::fault::{Difference, TransportFault};

/// Why a process could not join the bus.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum OpenError {
    /// The folder in which the bus lives cannot be used.
    #[error(transparent)]
    Home(#[from] HomeError),
    /// The body's clock page cannot be used.
    #[error(transparent)]
    Clock(#[from] ClockError),
    /// This process or this machine has run out of something.
    #[error("the bus could not be opened: {0}")]
    Short(Shortage),
    /// The speed is not a positive number.
    #[error("no clock runs {0} times as fast as real time; give a positive number")]
    Speed(f64),
    /// The user may not write where the bus lives.
    #[error(
        "no permission to use the bus's files in {folder} and /dev/shm; run all processes of a bus as one user, or remove files left by another user"
    )]
    Permission {
        /// The bus's folder.
        folder: PathBuf,
    },
    /// The transport failed.
    #[error(
        "the bus could not be opened ({fault}); check that /dev/shm and {folder} exist and are not full, then try again"
    )]
    Transport {
        /// What went wrong.
        fault: TransportFault,
        /// The bus's folder.
        folder: PathBuf,
    },
}

/// Why a port could not be made.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PortError {
    /// All places for observers are taken.
    #[error(
        "`{topic}` already has {limit} observers, which is the limit; stop one of them and try again"
    )]
    TooManyObservers {
        /// The topic.
        topic: String,
        /// Places for observers.
        limit: usize,
    },
    /// All places for readers are taken.
    #[error(
        "`{topic}` has no place for another reader (limit {limit}); stop a service that runs twice and try again"
    )]
    TooManyReaders {
        /// The topic.
        topic: String,
        /// Places for readers.
        limit: usize,
    },
    /// All places on the bell board are taken.
    #[error(
        "{part} already has {limit} waiters, which is the limit; stop a {part} that runs twice and try again"
    )]
    TooManyWaiters {
        /// The part.
        part: Part,
        /// Places for waiters of one part.
        limit: usize,
    },
    /// All places for writers are taken.
    #[error(
        "`{topic}` already has {limit} writers, which is the limit; stop one of them and try again"
    )]
    TooManyWriters {
        /// The topic or request.
        topic: String,
        /// Places for writers.
        limit: usize,
    },
    /// Too many processes have it open.
    #[error("too many processes use `{topic}` (limit {limit}); stop one of them and try again")]
    TooManyProcesses {
        /// The topic or request.
        topic: String,
        /// Places for processes.
        limit: usize,
    },
    /// A running process uses another layout or other limits.
    #[error(
        "`{topic}` is in use with another layout or other limits ({difference}): a process of another build is running; stop all processes that use it, bring them to one build and start them again"
    )]
    OtherLayout {
        /// The topic or request.
        topic: String,
        /// Which property differs.
        difference: Difference,
    },
    /// A running process uses another version of the transport.
    #[error(
        "`{topic}` belongs to a process with another version of iceoryx2 (this build has 0.10.0, and versions do not mix); stop that process, update it and start again"
    )]
    OtherVersion {
        /// The topic or request.
        topic: String,
    },
    /// The shared files make no sense.
    #[error(
        "the shared files of `{topic}` are damaged or belong to another version of iceoryx2 than 0.10.0; stop every process on this bus and start again"
    )]
    Damaged {
        /// The topic or request.
        topic: String,
    },
    /// The user may not use the shared files.
    #[error(
        "no permission to use the shared files of `{topic}`; run all processes of a bus as one user"
    )]
    Permission {
        /// The topic or request.
        topic: String,
    },
    /// Others kept creating and removing it.
    #[error(
        "`{topic}` is being created or removed by other processes and did not settle ({fault}); try again"
    )]
    Busy {
        /// The topic or request.
        topic: String,
        /// The fault of the last attempt.
        fault: TransportFault,
    },
    /// This process or this machine has run out of something.
    #[error("`{topic}` could not be opened: {shortage}")]
    Short {
        /// The topic or request.
        topic: String,
        /// The resource of which there is too little.
        shortage: Shortage,
    },
    /// The thread of a part of this service could not be started.
    #[error(
        "the system has no thread for {what} ({fault}); the limit of processes (ulimit -u) or of memory (ulimit -v) is reached"
    )]
    Thread {
        /// What the thread was to do.
        what: &'static str,
        /// The fault that the system reports.
        fault: TransportFault,
    },
    /// Observers may not wait: only the actors of a topic are woken.
    #[error("{part} is not woken by any topic: observers poll on a timer")]
    NotAnActor {
        /// The part.
        part: Part,
    },
    /// The transport failed.
    #[error(
        "the port of `{topic}` could not be made ({fault}); check that /dev/shm is not full and that the limit of open files (ulimit -n) is not reached"
    )]
    Transport {
        /// The topic or request.
        topic: String,
        /// What went wrong.
        fault: TransportFault,
    },
}

impl PortError {
    /// The error of a bell of `part`, if the board of bells cannot be used.
    pub(crate) fn of_bell(part: Part, fault: BoardFault) -> Self {
        let topic = format!("bell of {part}");
        match fault {
            BoardFault::OtherLayout => Self::OtherLayout {
                topic,
                difference: Difference::Board,
            },
            BoardFault::Busy => Self::Busy {
                topic,
                fault: TransportFault::InMotion,
            },
            BoardFault::NoSeat => Self::TooManyWaiters {
                part,
                limit: lager_wake::SEATS_PER_PART,
            },
            BoardFault::File(error) if error.kind() == ErrorKind::PermissionDenied => {
                Self::Permission { topic }
            }
            BoardFault::File(error) => Self::Transport {
                topic,
                fault: error.into(),
            },
        }
    }
}

/// Why a sample was not sent.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SendError {
    /// Too many loans are open.
    #[error("{limit} samples are on loan and not sent yet; send or drop one first")]
    TooManyLoans {
        /// Loans at the same time.
        limit: usize,
    },
    /// The transport failed. The sample's readers count it as lost.
    #[error("the sample could not be sent ({0}); if it happens again, restart this service")]
    Transport(#[from] TransportFault),
}

/// Why a sample could not be received.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ReceiveError {
    /// This reader holds too many samples.
    #[error("{limit} samples are held; drop one before receiving the next")]
    TooManyHeld {
        /// How many it may hold at the same time.
        limit: usize,
    },
    /// The transport failed.
    #[error("the writer could not be reached ({0}); the next attempt may succeed")]
    Transport(#[from] TransportFault),
}

/// Why a request was not answered.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CallError {
    /// No running process answers such requests.
    #[error("{actor} is not running, so nobody answers `{request}`; start it and try again")]
    NoServer {
        /// The request.
        request: &'static str,
        /// The part that answers it.
        actor: Part,
    },
    /// The answer did not come in time.
    #[error("{actor} did not answer `{request}` in time; it may be restarting, try again")]
    NoAnswer {
        /// The request.
        request: &'static str,
        /// The part that answers it.
        actor: Part,
    },
    /// The transport failed.
    #[error("`{request}` could not be sent ({fault}); try again")]
    Transport {
        /// The request.
        request: &'static str,
        /// What went wrong.
        fault: TransportFault,
    },
}

/// Why this process could not list what is on the bus.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum IntrospectError {
    /// The configuration does not describe a usable bus.
    #[error(transparent)]
    Config(#[from] OpenError),
    /// This process or this machine has run out of something.
    #[error("the bus's files could not be listed: {0}")]
    Short(Shortage),
    /// The transport failed.
    #[error("the bus's files could not be listed ({0}); check the permissions of the bus's folder")]
    Transport(TransportFault),
}

impl From<TransportFault> for IntrospectError {
    /// The transport does not say whether a resource is used up, so this finds out.
    fn from(fault: TransportFault) -> Self {
        match Shortage::now() {
            Some(shortage) => Self::Short(shortage),
            None => Self::Transport(fault),
        }
    }
}
