//! Files at paths that a person has chosen: read without hanging, replaced as a whole, and held by
//! one process at a time.
//!
//! A path may name anything: a pipe that nobody writes to, a device that never ends, a symbolic
//! link, or a file of another format. None of them may hang a process that drives a robot. Saving a
//! file changes only its content, and not its mode or owner.
//!
//! This module knows no format. The caller knows the format.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read as _, Write as _};
use std::os::unix::fs::{MetadataExt as _, OpenOptionsExt as _, fchown};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use rustix::fs::OFlags;
use serde::de::DeserializeOwned;
use thiserror::Error;

/// The longest text that is read, in bytes.
pub const MOST_BYTES: u64 = 1 << 20;

/// How many symbolic links may follow each other; the kernel allows as many.
const MOST_LINKS: usize = 40;

/// Why a file could not be read.
#[derive(Debug, Error)]
pub enum ReadError {
    /// It could not be read.
    #[error("cannot read {}: {error}", .path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// The file has not the right content.
    #[error("{}: {}", .path.display(), in_words(.error))]
    Toml {
        /// The file.
        path: PathBuf,
        /// What is wrong, and where.
        error: toml::de::Error,
    },
}

impl ReadError {
    /// Whether the file exists with other content, so that a second attempt fails as well.
    pub fn is_damage(&self) -> bool {
        match self {
            Self::Toml { .. } => true,
            Self::Read { error, .. } => matches!(
                error.kind(),
                io::ErrorKind::InvalidData | io::ErrorKind::InvalidInput
            ),
        }
    }
}

/// Says what is wrong with a text of TOML, and suggests the right word for a mistyped key or value.
fn in_words(error: &toml::de::Error) -> String {
    let hint = lager_lines::hint(error.message());
    format!("{}{hint}", error.to_string().trim_end())
}

/// Reads a text from a regular file.
///
/// # Errors
/// The file cannot be read, is not a regular file, is longer than [`MOST_BYTES`], or is not text.
pub fn read(path: &Path) -> io::Result<String> {
    // This check comes before the file is opened: to open a device may already have an effect.
    refuse_others(&fs::metadata(path)?)?;
    let file = OpenOptions::new()
        .read(true)
        .custom_flags((OFlags::NONBLOCK | OFlags::NOCTTY).bits() as i32)
        .open(path)?;
    refuse_others(&file.metadata()?)?;
    let mut text = String::new();
    file.take(MOST_BYTES + 1).read_to_string(&mut text)?;
    match text.len() as u64 > MOST_BYTES {
        true => Err(invalid("it is longer than 1 MiB, which is no such file")),
        false => Ok(text),
    }
}

/// Reads a value from a file of TOML.
///
/// # Errors
/// As [`read`], or the file does not hold such a value.
pub fn read_toml<T: DeserializeOwned>(path: &Path) -> Result<T, ReadError> {
    let at = || path.to_owned();
    let text = read(path).map_err(|error| ReadError::Read { path: at(), error })?;
    parse_toml(path, &text)
}

/// Reads a value from a text of TOML that came from `path`.
///
/// # Errors
/// The text does not hold such a value.
pub fn parse_toml<T: DeserializeOwned>(path: &Path, text: &str) -> Result<T, ReadError> {
    toml::from_str(text).map_err(|error| ReadError::Toml {
        path: path.to_owned(),
        error,
    })
}

fn refuse_others(metadata: &fs::Metadata) -> io::Result<()> {
    match metadata.is_file() {
        true => Ok(()),
        false if metadata.is_dir() => Err(invalid("it is a folder")),
        false => Err(invalid("it is no file but a pipe, a socket or a device")),
    }
}

fn invalid(why: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, why)
}

/// Replaces the content of a file. Even after a loss of power, a reader finds either the old text
/// or the new one, never a mixture. A new file is written beside the old one, synchronised, and
/// then takes its name. If the path is a symbolic link, the file at its end is replaced. The file
/// keeps its mode and its owner, as far as this process may set them.
///
/// Only one process may do this at a time ([`Hold`]). If it is killed half way, the new file stays
/// as `NAME.new`, and the next process overwrites it.
///
/// # Errors
/// The disk refuses the new file, or the path is not a regular file. The old text stays. If only
/// the folder could not be synchronised, the new text stands there, but a loss of power may bring
/// the old one back.
pub fn replace(path: &Path, text: &str) -> io::Result<()> {
    let target = behind_links(path)?;
    let before = match fs::symlink_metadata(&target) {
        Ok(before) => {
            refuse_others(&before)?;
            Some(before)
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => None,
        Err(error) => return Err(error),
    };
    let beside = beside(&target, "new");
    let replaced = put(&target, &beside, text, before.as_ref());
    if replaced.is_err() {
        // A half-written file is useless, and its name must be free for the next attempt.
        let _ = fs::remove_file(&beside);
    }
    replaced
}

fn put(target: &Path, beside: &Path, text: &str, before: Option<&fs::Metadata>) -> io::Result<()> {
    // The path may be an old file, or a link to elsewhere: never write into that.
    let _ = fs::remove_file(beside);
    let mut file = File::create_new(beside)?;
    if let Some(before) = before {
        // Only the superuser may give a file to another user; for others the owner is already
        // right.
        let _ = fchown(&file, Some(before.uid()), Some(before.gid()));
        file.set_permissions(before.permissions())?;
    }
    file.write_all(text.as_bytes())?;
    file.sync_all()?;
    fs::rename(beside, target)?;
    let folder = target
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    File::open(folder.unwrap_or(Path::new(".")))?.sync_all()
}

/// Where a path leads. The file at its end need not exist yet.
fn behind_links(path: &Path) -> io::Result<PathBuf> {
    let mut at = path.to_owned();
    for _ in 0..MOST_LINKS {
        match fs::read_link(&at) {
            Ok(to) => {
                at = match at.parent() {
                    Some(folder) => folder.join(to),
                    None => to,
                }
            }
            // It is not a link, or there is nothing.
            Err(error)
                if matches!(
                    error.kind(),
                    io::ErrorKind::InvalidInput | io::ErrorKind::NotFound
                ) =>
            {
                return Ok(at);
            }
            Err(error) => return Err(error),
        }
    }
    Err(invalid("its symbolic links lead in a circle"))
}

/// `NAME.ending` in the same folder.
pub(crate) fn beside(path: &Path, ending: &str) -> PathBuf {
    let mut name = OsString::from(path);
    name.push(".");
    name.push(ending);
    name.into()
}

/// Moves a damaged file out of the way, to `NAME.damaged-TIME` with the time in seconds since 1970.
/// Returns the new path.
///
/// # Errors
/// It cannot be moved.
pub fn set_aside(path: &Path) -> io::Result<PathBuf> {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    let seconds = since.unwrap_or_default().as_secs();
    let aside = beside(path, &format!("damaged-{seconds}"));
    fs::rename(path, &aside)?;
    Ok(aside)
}

/// Why this process could not get a file for itself.
#[derive(Debug, Error)]
#[error(
    "{} is kept by process {pid}, and two would overwrite each other's changes; end that one, or \
     name another file",
    .path.display()
)]
pub struct HeldBy {
    /// The file.
    pub path: PathBuf,
    /// The process that holds it, as it says itself; 0 if it does not say.
    pub pid: u32,
}

/// Only this process may replace the file, until this value is dropped or the process ends in any
/// way. Every process may read it.
///
/// The lock is on `NAME.lock` beside the file, because each change makes a new file.
#[derive(Debug)]
pub struct Hold {
    lock: PathBuf,
    /// Locked while it is open.
    _file: File,
}

/// How long a process that ends may still hold its files: those of a supervisor that was killed end
/// a moment after it.
const ENDING: Duration = Duration::from_secs(2);

impl Hold {
    /// Holds the file at `path`, which need not exist yet. `None` where no lock can be made: nobody
    /// can replace a file there either.
    ///
    /// # Errors
    /// Another process holds it, and does not end within two seconds.
    pub fn of(path: &Path) -> Result<Option<Self>, HeldBy> {
        let Ok(target) = behind_links(path) else {
            return Ok(None);
        };
        let lock = beside(&target, "lock");
        let since = Instant::now();
        loop {
            let mut options = OpenOptions::new();
            options.read(true).write(true).create(true).truncate(false);
            let flags = OFlags::NONBLOCK | OFlags::NOFOLLOW;
            let Ok(mut file) = options.custom_flags(flags.bits() as i32).open(&lock) else {
                return Ok(None);
            };
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) if since.elapsed() < ENDING => {
                    std::thread::sleep(ENDING / 100);
                    continue;
                }
                Err(TryLockError::WouldBlock) => {
                    let mut pid = String::new();
                    let _ = file.take(16).read_to_string(&mut pid);
                    return Err(HeldBy {
                        path: path.to_owned(),
                        pid: pid.trim().parse().unwrap_or_default(),
                    });
                }
                Err(TryLockError::Error(_)) => return Ok(None),
            }
            // The process that held the file before may have removed the lock between the two
            // calls.
            let is_it = |there: fs::Metadata, own: fs::Metadata| {
                (there.dev(), there.ino()) == (own.dev(), own.ino())
            };
            if let (Ok(there), Ok(own)) = (fs::symlink_metadata(&lock), file.metadata())
                && is_it(there, own)
            {
                let _ = file.set_len(0);
                let _ = writeln!(file, "{}", std::process::id());
                return Ok(Some(Self { lock, _file: file }));
            }
        }
    }
}

impl Drop for Hold {
    fn drop(&mut self) {
        // It is still locked, so nobody else can have taken it.
        let _ = fs::remove_file(&self.lock);
    }
}
