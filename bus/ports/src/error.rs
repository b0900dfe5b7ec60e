//! What can go wrong, one enum per operation; every message says what to do.

use std::io::{Error, ErrorKind};
use std::path::{Path, PathBuf};

use lager_topics::Role;

use crate::fault::{Difference, TransportFault};
use crate::shortage::Shortage;

/// Why a process could not join the bus.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum OpenError {
    /// The folder is not an absolute path.
    #[error("`{0}` cannot be the bus's folder; give an absolute path, in UTF-8")]
    RelativeFolder(PathBuf),
    /// The folder leaves no room for the names of sockets.
    #[error("the bus's folder {folder} is too long; use at most {limit} bytes")]
    FolderTooLong {
        /// The folder.
        folder: PathBuf,
        /// The longest that works, in bytes.
        limit: usize,
    },
    /// A file or a link.
    #[error(
        "{0} is a file or a symbolic link and cannot be the bus's folder; remove it, or name a folder with --bus"
    )]
    NoFolder(PathBuf),
    /// Another user's.
    #[error(
        "{folder} belongs to UID {uid} ({name}); use `sudo -u {name} lager ...` for that user's robots, or name another folder with --bus"
    )]
    ForeignFolder {
        /// The folder.
        folder: PathBuf,
        /// Its owner.
        uid: u32,
        /// The owner as `sudo -u` knows him.
        name: String,
    },
    /// Other users may enter it.
    #[error(
        "other users may enter the bus's folder {folder} (mode {mode:04o}); use `chmod 700 {folder}`, if nobody else's files are in it"
    )]
    SharedFolder {
        /// The folder.
        folder: PathBuf,
        /// Its mode.
        mode: u32,
    },
    /// Another user has put a segment where the bus's are.
    #[error(
        "{path} belongs to UID {uid} ({name}), who could end every process of this bus with it; remove it (`sudo rm {path}`), or name another folder with --bus"
    )]
    ForeignSegment {
        /// The segment.
        path: PathBuf,
        /// Its owner.
        uid: u32,
        /// The owner's name.
        name: String,
    },
    /// It cannot be made or looked at.
    #[error(
        "the bus's folder {folder} cannot be used ({detail}); make it for this user, or name another one with --bus"
    )]
    Folder {
        /// The folder.
        folder: PathBuf,
        /// What the system says.
        detail: String,
    },
    /// This process or this machine has run out of something.
    #[error("the bus could not be opened: {0}")]
    Short(Shortage),
    /// The speed is not a positive number.
    #[error("a robot cannot live {0} times as fast as real time; give a positive number")]
    Speed(f64),
    /// The body's clock page cannot be read.
    #[error(
        "the clock page {path} cannot be read ({detail}); the emulated boards publish it: is the robot up, and with `--body chip`?"
    )]
    NoClock {
        /// The page's file.
        path: PathBuf,
        /// What the system says.
        detail: String,
    },
    /// The clock's file is something else.
    #[error(
        "{0} is no clock page, or one of another build; name the file that the emulator was given with --clock"
    )]
    ForeignClock(PathBuf),
    /// The user may not write where the bus lives.
    #[error(
        "no permission to use the bus's files in {folder} and /dev/shm; run all of a robot's processes as one user, or remove files left by another user"
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
    /// The bridge cannot use its stop word.
    #[error(transparent)]
    Stop(#[from] StopError),
    /// All places for observers are taken.
    #[error(
        "`{topic}` already has {limit} observers, which is the limit; stop one of them (`lager topic info {topic}` lists them) and try again"
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
        "{role} is already waited for {limit} times, which is the limit; stop a {role} that runs twice and try again"
    )]
    TooManyWaiters {
        /// The role.
        role: Role,
        /// Places for waiters of one role.
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
        "`{topic}` is in use with another layout or other limits ({difference}): a process of another build of lager is running; stop all processes of this robot, bring them to one build and start them again"
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
        "the shared files of `{topic}` are damaged or belong to another version of iceoryx2 than 0.10.0; stop every process on this bus, start again, and if it stays so run `lager doctor`"
    )]
    Damaged {
        /// The topic or request.
        topic: String,
    },
    /// The user may not use the shared files.
    #[error(
        "no permission to use the shared files of `{topic}`; run all of a robot's processes as one user"
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
        /// What was met last.
        fault: TransportFault,
    },
    /// This process or this machine has run out of something.
    #[error("`{topic}` could not be opened: {shortage}")]
    Short {
        /// The topic or request.
        topic: String,
        /// What there is too little of.
        shortage: Shortage,
    },
    /// A part of the service that has a thread of its own could not be started.
    #[error(
        "there is no thread for {what} ({fault}); the limit of processes (ulimit -u) or of memory (ulimit -v) is reached"
    )]
    Thread {
        /// What it would do.
        what: &'static str,
        /// What the system says.
        fault: TransportFault,
    },
    /// Only services that act on a topic may wait.
    #[error("{role} is not woken by any topic: observers poll on a timer")]
    NotAnActor {
        /// The role.
        role: Role,
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

/// Why a sample was not sent.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SendError {
    /// Too many loans are open.
    #[error("{limit} samples are on loan and not sent yet; send or drop one first")]
    TooManyLoans {
        /// Loans at the same time.
        limit: usize,
    },
    /// The transport failed; the sample is counted as lost by its readers.
    #[error("the sample could not be sent ({0}); if it happens again, restart this service")]
    Transport(#[from] TransportFault),
}

/// Why a sample could not be received.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ReceiveError {
    /// Too many samples are held.
    #[error("{limit} samples are held; drop one before receiving the next")]
    TooManyHeld {
        /// Samples at the same time.
        limit: usize,
    },
    /// The transport failed.
    #[error("the writer could not be reached ({0}); the next attempt may succeed")]
    Transport(#[from] TransportFault),
}

/// Why a request was not answered.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CallError {
    /// No process answers such requests.
    #[error("{actor} is not running, so nobody answers `{request}`; start it and try again")]
    NoServer {
        /// The request.
        request: &'static str,
        /// Who would answer.
        actor: Role,
    },
    /// The answer did not come in time.
    #[error("{actor} did not answer `{request}` in time; it may be restarting, try again")]
    NoAnswer {
        /// The request.
        request: &'static str,
        /// Who would answer.
        actor: Role,
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

/// Why the bus could not be looked over.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum IntrospectError {
    /// The configuration names no bus.
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
    /// The transport does not say that it was for want of something.
    fn from(fault: TransportFault) -> Self {
        match Shortage::now() {
            Some(shortage) => Self::Short(shortage),
            None => Self::Transport(fault),
        }
    }
}

/// Why the stop word cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum StopError {
    /// There is no room for the file.
    #[error(
        "the stop word {path} has no room: make some (`df {path}` tells where), or switch the robot off at its battery"
    )]
    Full {
        /// The file.
        path: PathBuf,
    },
    /// The user may not.
    #[error(
        "this user may not use the stop word {path}: stop the robot as the user who runs it (sudo -u USER)"
    )]
    Permission {
        /// The file.
        path: PathBuf,
    },
    /// No file can be opened.
    #[error("the stop word {path} cannot be used: {shortage}")]
    Short {
        /// The file.
        path: PathBuf,
        /// What there is too little of.
        shortage: Shortage,
    },
    /// Anything else the system says.
    #[error("the stop word {path} cannot be used ({detail}); is its folder there and a folder?")]
    System {
        /// The file.
        path: PathBuf,
        /// The system's words.
        detail: String,
    },
}

impl StopError {
    /// What `error` means for the file at `path`.
    pub(crate) fn new(path: &Path, error: &Error) -> Self {
        let path = path.to_owned();
        if let Some(shortage) = Shortage::behind(error) {
            return Self::Short { path, shortage };
        }
        match error.kind() {
            ErrorKind::StorageFull | ErrorKind::QuotaExceeded => Self::Full { path },
            ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => {
                Self::Permission { path }
            }
            _ => Self::System {
                path,
                detail: error.to_string(),
            },
        }
    }
}
