//! [`Shortage`]: which resource this process or this machine has used up. A port that could not be
//! made asks this if the transport does not say why.

use core::fmt;
use std::fs;

use rustix::process::{Resource, getrlimit};

/// The folder of the transport's shared memory.
pub const SHARED_MEMORY: &str = "/dev/shm";

/// A process that can open only this many more files cannot open a port, which may need as many.
const FILES_LEFT: u64 = 8;
/// The largest segment that a topic needs, in bytes.
const SEGMENT: u64 = 1024 * 1024;
/// The longest segment of a bus is shorter than this, in bytes.
const LONGEST: u64 = 16 * 1024 * 1024;

/// The resource of which there is too little.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shortage {
    /// This process has opened as many files as it may.
    Files {
        /// How many it may open.
        limit: u64,
    },
    /// The files of this process may not become as long as those of the bus.
    Lengths {
        /// How long they may be, in KiB.
        limit_kib: u64,
    },
    /// `/dev/shm` is full.
    Memory {
        /// What is free, in KiB.
        free_kib: u64,
    },
    /// `/dev/shm` can hold no more files.
    Names,
    /// This user may not write to `/dev/shm`.
    Rights,
}

impl Shortage {
    /// Whether files may not become long enough for any port.
    pub fn of_any_port() -> Option<Self> {
        Self::of_lengths(SEGMENT)
    }

    fn of_lengths(needed: u64) -> Option<Self> {
        let limit = getrlimit(Resource::Fsize).current?;
        let limit_kib = limit / 1024;
        (limit < needed).then_some(Self::Lengths { limit_kib })
    }

    /// The shortage that caused this error, if it is a shortage of open files.
    pub fn behind(error: &std::io::Error) -> Option<Self> {
        let raw = error.raw_os_error()?;
        let limit = getrlimit(Resource::Nofile).current?;
        (raw == rustix::io::Errno::MFILE.raw_os_error()).then_some(Self::Files { limit })
    }

    /// The present shortage, if there is one.
    pub fn now() -> Option<Self> {
        let files = getrlimit(Resource::Nofile).current;
        let open = fs::read_dir("/proc/self/fd").map(|open| open.count() as u64);
        if let Some(limit) = files
            // If even the folder of open files cannot be opened, no file is left.
            && open.map_or(true, |open| open + FILES_LEFT > limit)
        {
            return Some(Self::Files { limit });
        }
        if let Some(lengths) = Self::of_lengths(LONGEST) {
            return Some(lengths);
        }
        let write = rustix::fs::Access::WRITE_OK | rustix::fs::Access::EXEC_OK;
        if rustix::fs::access(SHARED_MEMORY, write).is_err() {
            return Some(Self::Rights);
        }
        let stat = rustix::fs::statvfs(SHARED_MEMORY).ok()?;
        let free = stat.f_bavail.saturating_mul(stat.f_frsize);
        if free < SEGMENT {
            let free_kib = free / 1024;
            return Some(Self::Memory { free_kib });
        }
        // A file system without a limit reports 0 of 0.
        (stat.f_files > 0 && stat.f_favail == 0).then_some(Self::Names)
    }
}

impl fmt::Display for Shortage {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Files { limit } => write!(
                formatter,
                "this process may open {limit} files and has almost all of them open (EMFILE); `ulimit -n 4096` or LimitNOFILE= in the unit allows more"
            ),
            Self::Lengths { limit_kib } => write!(
                formatter,
                "files of this process may have {limit_kib} KiB (EFBIG), and the bus needs longer ones; `ulimit -f unlimited` or LimitFSIZE= in the unit allows more"
            ),
            Self::Memory { free_kib } => write!(
                formatter,
                "{SHARED_MEMORY} is full, {free_kib} KiB are left (ENOSPC); remove what dead processes left there, or enlarge it: `mount -o remount,size=256M {SHARED_MEMORY}`"
            ),
            Self::Names => write!(
                formatter,
                "{SHARED_MEMORY} can hold no more files (ENOSPC); remove some, or mount it with more (nr_inodes=)"
            ),
            Self::Rights => write!(
                formatter,
                "this user may not write to {SHARED_MEMORY} (EACCES); it needs mode 1777"
            ),
        }
    }
}
