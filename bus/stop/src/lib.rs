//! The stop word: how any process of the robot's user stops the robot, without the bus.
//!
//! It is a crate of its own because it must work when nothing else does: when every place on the
//! bus is taken, when the bus's files are gone, when the bridge is frozen. A process that stops the
//! robot writes eight bytes into a file with one `pwrite`. It maps nothing, so no damage to the
//! file can end it. The bridge has the file's page in its memory and looks at the word before each
//! packet that it writes ([`StopPage`]). The file outlives every process. Only a resume clears the
//! word; the bridge does that with a compare-and-swap.
//!
//! The file `stop` in the robot's folder, mode 0600, 4096 bytes, in the machine's byte order:
//!
//! | byte | written by | contents |
//! |---|---|---|
//! | 0 | the process that stops; a resume clears it | the stop word, 0 = not stopped |
//! | 8 | the process that makes the file | the layout: the letters `lagstop1` |
//! | 64 | the bridge | when its main loop last ran |
//! | 72 | | its process id |
//! | 80 | | the word that it obeyed last, 0 = none |
//! | 88 | | when it obeyed |
//! | 96 | | the word after which the steering board reported wheels at rest |
//! | 104 | | when the board reported that |
//! | 112 | | the boards: sensor in bits 0 to 15, steering in 16 to 31 (1) |
//! | 120 | | when the steering board reported last, 0 = never |
//! | 128 | | the duties that it reported: left in bits 0 to 7, right in 8 to 15 |
//!
//! (1) Of each board's 16 bits, bit 0 says whether the board is connected, and bits 8 to 15 are the
//! version of its protocol.
//!
//! Every entry is an unsigned number of 64 bits, every time is in microseconds of
//! `CLOCK_MONOTONIC`. The word is:
//!
//! ```text
//!     63      62 .. 57    56 .. 52    51 .. 0
//!     1       cause       origin      when
//! ```
//!
//! Cause and origin are the codes of [`StopCause`] and [`Role`]. Any word but 0 stops the robot. A
//! word without bit 63 is damaged. If two processes stop at once, either word stops.

mod error;
mod mapping;
mod page;
mod verdict;
mod watching;

use core::fmt;
use core::num::NonZeroU64;
use core::time::Duration;
use std::fs::{File, OpenOptions};
use std::io::{Error, ErrorKind};
use std::os::unix::fs::{DirBuilderExt, FileExt, MetadataExt, OpenOptionsExt};
use std::path::Path;

use lager_home::Clock;
use lager_sample::Coded;
use lager_topics::{Role, StopCause};

pub use error::StopError;
pub use page::{Release, StopPage};
pub use verdict::{Verdict, judge, process_state, span};

/// The file's size in bytes.
pub(crate) const SIZE: u64 = 4096;

/// The eight letters that mark the layout of this table.
pub(crate) const LAYOUT: u64 = u64::from_ne_bytes(*b"lagstop1");

/// The positions of the entries, in words of 8 bytes.
pub(crate) mod at {
    pub(crate) const WORD: usize = 0;
    pub(crate) const LAYOUT: usize = 1;
    pub(crate) const TURN: usize = 8;
    pub(crate) const PROCESS: usize = 9;
    pub(crate) const OBEYED: usize = 10;
    pub(crate) const OBEYED_AT: usize = 11;
    pub(crate) const RESTED: usize = 12;
    pub(crate) const RESTED_AT: usize = 13;
    pub(crate) const BOARDS: usize = 14;
    pub(crate) const REPORTED_AT: usize = 15;
    pub(crate) const DUTIES: usize = 16;
    /// The number of words in use.
    pub(crate) const END: usize = 17;
}

const STOPPED: u64 = 1 << 63;
const CAUSE: (u32, u64) = (57, 0x3F);
const ORIGIN: (u32, u64) = (52, 0x1F);
const TIME: u64 = (1 << 52) - 1;

/// One stop: who set it, why and when.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stop(NonZeroU64);

impl Stop {
    /// A stop set at `at_ns` of `CLOCK_MONOTONIC`.
    pub fn new(origin: Role, cause: StopCause, at_ns: u64) -> Self {
        let word = STOPPED
            | (u64::from(cause.to_code()) & CAUSE.1) << CAUSE.0
            | (u64::from(origin.to_code()) & ORIGIN.1) << ORIGIN.0
            | ((at_ns / 1_000) & TIME);
        Self(NonZeroU64::new(word).expect("bit 63 is set"))
    }

    /// The stop that a word means; `None` if the word is 0.
    #[inline]
    pub fn of_word(word: u64) -> Option<Self> {
        NonZeroU64::new(word).map(Self)
    }

    /// The word as it stands in the file.
    #[inline]
    pub fn word(self) -> u64 {
        self.0.get()
    }

    /// The cause; a word that no process can have written counts as damaged.
    pub fn cause(self) -> StopCause {
        let code = self.field(CAUSE);
        self.is_sound()
            .then(|| StopCause::of_code(code))
            .flatten()
            .filter(|cause| *cause != StopCause::None)
            .unwrap_or(StopCause::WordDamaged)
    }

    /// The part that set the stop, if the word contains it.
    pub fn origin(self) -> Option<Role> {
        let code = self.field(ORIGIN);
        self.is_sound().then(|| Role::of_code(code)).flatten()
    }

    /// Whether `up` has set it because real boards start stopped. Any other stop says that a person
    /// or a part of the robot has seen a reason to stop.
    pub fn is_of_fresh_start(self) -> bool {
        (self.origin(), self.cause()) == (Some(Role::Supervisor), StopCause::FreshStart)
    }

    /// When the stop was set, in ns of `CLOCK_MONOTONIC`; 0 if the word does not contain it.
    pub fn at_ns(self) -> u64 {
        match self.is_sound() {
            true => (self.word() & TIME) * 1_000,
            false => 0,
        }
    }

    fn is_sound(self) -> bool {
        self.word() & STOPPED != 0
    }

    fn field(self, (shift, mask): (u32, u64)) -> u8 {
        (self.word() >> shift & mask) as u8
    }
}

impl fmt::Display for Stop {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.origin() {
            Some(role) => write!(formatter, "by {}: {}", role.as_author(), self.cause()),
            None => write!(formatter, "by nobody known: {}", self.cause()),
        }
    }
}

/// The stop word for a process that stops the robot. The bridge uses [`StopPage`] instead.
#[derive(Clone, Copy, Debug)]
pub struct StopWord;

impl StopWord {
    /// Stops the robot whose file is at `path`. Makes the file and its folder if they are missing,
    /// and mends a file that was cut short.
    ///
    /// This replaces a stop that is already set, and a resume must then name the new one. The new
    /// word differs even if both stops come within one microsecond.
    ///
    /// # Errors
    /// The word cannot be written. Then the robot may go on.
    pub fn set(path: &Path, origin: Role, cause: StopCause) -> Result<Stop, StopError> {
        let fail = |error: Error| StopError::new(path, &error);
        let now_ns = Clock::monotonic_ns();
        loop {
            let (file, _) = open(path).map_err(fail)?;
            let stop = unlike(&file, |later_ns| {
                Stop::new(origin, cause, now_ns + later_ns)
            });
            put(&file, at::WORD, stop.word()).map_err(fail)?;
            // The robot is stopped now. If this cannot mend the file, the bridge does.
            let _ = mend(&file);
            // No bridge sees a file that was removed between opening and writing.
            if file.metadata().map_err(fail)?.nlink() > 0 {
                return Ok(stop);
            }
        }
    }

    /// Removes the file unless a stop is set in it. For the process that takes the robot down, when
    /// no bridge runs any more.
    pub fn tidy(path: &Path) {
        let Ok(file) = File::open(path) else {
            return;
        };
        let word = || {
            let mut word = [0; 8];
            let _ = file.read_at(&mut word, 0);
            Stop::of_word(u64::from_ne_bytes(word))
        };
        if word().is_none() && std::fs::remove_file(path).is_ok() {
            // Keeps a stop that was set at this very moment.
            if let Some(stop) = word() {
                let _ = Self::set(path, stop.origin().unwrap_or(Role::Operator), stop.cause());
            }
        }
    }

    /// The contents of the file at `path`; `None` if there is none. This reads the file and does
    /// not map it, so cutting it short at this moment does no harm.
    ///
    /// # Errors
    /// The file exists and cannot be read.
    pub fn read(path: &Path) -> Result<Option<StopTold>, StopError> {
        let file = match File::open(path) {
            Ok(file) => file,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(StopError::new(path, &error)),
        };
        let mut bytes = [0; at::END * 8];
        let mut read = 0;
        while read < bytes.len() {
            match file.read_at(&mut bytes[read..], read as u64) {
                // Missing bytes read as 0.
                Ok(0) => break,
                Ok(count) => read += count,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(StopError::new(path, &error)),
            }
        }
        let mut words = [0; at::END];
        for (word, bytes) in words.iter_mut().zip(bytes.chunks_exact(8)) {
            *word = u64::from_ne_bytes(bytes.try_into().expect("eight bytes"));
        }
        Ok(Some(StopTold { words }))
    }
}

/// The contents of the file at one moment. The entries are read one after the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StopTold {
    words: [u64; at::END],
}

impl StopTold {
    /// The stop that is set.
    pub fn stop(&self) -> Option<Stop> {
        Stop::of_word(self.words[at::WORD])
    }

    /// The process that was the bridge last; `None` if there was none.
    pub fn bridge(&self) -> Option<u32> {
        u32::try_from(self.words[at::PROCESS])
            .ok()
            .filter(|process| *process != 0)
    }

    /// When the bridge's main loop last ran, in ns of `CLOCK_MONOTONIC`.
    pub fn turned_ns(&self) -> u64 {
        self.words[at::TURN] * 1_000
    }

    /// The stop that the bridge obeyed last, and when, in ns.
    pub fn obeyed(&self) -> Option<(Stop, u64)> {
        let stop = Stop::of_word(self.words[at::OBEYED])?;
        Some((stop, self.words[at::OBEYED_AT] * 1_000))
    }

    /// The stop after which the steering board reported wheels at rest, and when, in ns.
    pub fn rested(&self) -> Option<(Stop, u64)> {
        let stop = Stop::of_word(self.words[at::RESTED])?;
        Some((stop, self.words[at::RESTED_AT] * 1_000))
    }

    /// The version of the sensor board's protocol, if that board is connected.
    pub fn sensor(&self) -> Option<u8> {
        board(self.words[at::BOARDS])
    }

    /// The version of the steering board's protocol, if that board is connected.
    pub fn steering(&self) -> Option<u8> {
        board(self.words[at::BOARDS] >> 16)
    }

    /// When the steering board reported last, in ns, and the duties of its left and right motor.
    pub fn report(&self) -> Option<(u64, [u8; 2])> {
        let at = self.words[at::REPORTED_AT];
        let duties = self.words[at::DUTIES];
        (at != 0).then_some((at * 1_000, [duties as u8, (duties >> 8) as u8]))
    }

    /// The time from `then_ns` to `now_ns`.
    pub fn age(now_ns: u64, then_ns: u64) -> Duration {
        Duration::from_nanos(now_ns.saturating_sub(then_ns))
    }
}

/// A board's version, if the lower 16 bits say that the board is connected.
fn board(entry: u64) -> Option<u8> {
    (entry & 1 != 0).then_some((entry >> 8) as u8)
}

/// The entry of the two boards, each with its version if it is connected.
pub(crate) fn boards(sensor: Option<u8>, steering: Option<u8>) -> u64 {
    let entry = |board: Option<u8>| board.map_or(0, |version| u64::from(version) << 8 | 1);
    entry(sensor) | entry(steering) << 16
}

/// Opens the file, or makes it with its folder; returns whether it was made.
fn open(path: &Path) -> Result<(File, bool), Error> {
    let mut options = OpenOptions::new();
    options.read(true).write(true).mode(0o600);
    loop {
        match options.open(path) {
            Err(error) if error.kind() == ErrorKind::NotFound => {}
            opened => return Ok((opened?, false)),
        }
        if let Some(folder) = path.parent() {
            std::fs::DirBuilder::new()
                .recursive(true)
                .mode(0o700)
                .create(folder)?;
        }
        match options.clone().create_new(true).open(path) {
            Ok(file) => return Ok((file, true)),
            // Another process was quicker, or has removed the folder again.
            Err(error)
                if [ErrorKind::AlreadyExists, ErrorKind::NotFound].contains(&error.kind()) => {}
            Err(error) => return Err(error),
        }
    }
}

/// Whether the file has its whole length and the right layout.
fn is_whole(file: &File) -> Result<bool, Error> {
    let mut layout = [0; 8];
    let read = file.read_at(&mut layout, at::LAYOUT as u64 * 8)?;
    Ok(file.metadata()?.len() >= SIZE && read == 8 && layout == LAYOUT.to_ne_bytes())
}

/// A stop whose word differs from the one that is set and from the one that the bridge obeyed last.
/// `stop` makes a stop whose time is later by so many ns. An unreadable file prevents no stop.
fn unlike(file: &File, stop: impl Fn(u64) -> Stop) -> Stop {
    let known = [at::WORD, at::OBEYED].map(|place| {
        let mut word = [0; 8];
        let read = file.read_at(&mut word, place as u64 * 8);
        read.map_or(0, |_| u64::from_ne_bytes(word))
    });
    let mut later_us = 0..;
    later_us
        .find_map(|us| Some(stop(us * 1_000)).filter(|stop| !known.contains(&stop.word())))
        .expect("only two words are known")
}

/// Gives the file its length and layout.
fn mend(file: &File) -> Result<(), Error> {
    if !is_whole(file)? {
        if file.metadata()?.len() < SIZE {
            file.set_len(SIZE)?;
        }
        put(file, at::LAYOUT, LAYOUT)?;
    }
    Ok(())
}

/// Writes one entry with one system call.
fn put(file: &File, place: usize, value: u64) -> Result<(), Error> {
    file.write_all_at(&value.to_ne_bytes(), place as u64 * 8)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;
    use std::sync::atomic::{AtomicU32, Ordering};

    /// A folder that is removed at the end.
    pub(crate) struct Folder(PathBuf);

    impl Folder {
        pub(crate) fn new() -> Self {
            static COUNT: AtomicU32 = AtomicU32::new(0);
            let number = COUNT.fetch_add(1, Ordering::Relaxed);
            let name = format!("lager-stop-{}-{number}", std::process::id());
            let path = std::env::temp_dir().join(name);
            std::fs::create_dir_all(&path).unwrap();
            Self(path)
        }

        pub(crate) fn path(&self) -> &Path {
            &self.0
        }
    }

    impl Drop for Folder {
        fn drop(&mut self) {
            let _ = std::fs::remove_dir_all(&self.0);
        }
    }

    #[test]
    fn a_word_tells_who_why_and_when() {
        for (origin, cause) in [
            (Role::Operator, StopCause::Ordered),
            (Role::Supervisor, StopCause::FreshStart),
            (Role::Bridge, StopCause::BoardResets),
        ] {
            let stop = Stop::new(origin, cause, 1_234_567_890_123);
            assert_eq!(stop.origin(), Some(origin));
            assert_eq!(stop.cause(), cause);
            assert_eq!(stop.at_ns(), 1_234_567_890_000);
            assert_eq!(Stop::of_word(stop.word()), Some(stop));
        }
        let said = Stop::new(Role::Operator, StopCause::Ordered, 0).to_string();
        assert_eq!(said, "by a `lager` command: it was ordered");
    }

    #[test]
    fn any_word_but_zero_stops() {
        assert_eq!(Stop::of_word(0), None);
        for word in [1, 0xFFFF, u64::MAX >> 1, 1 << 63, u64::MAX] {
            let stop = Stop::of_word(word).expect("it stops");
            assert_eq!(stop.cause(), StopCause::WordDamaged, "{word:x}");
        }
        assert_eq!(Stop::of_word(1).unwrap().origin(), None);
    }

    #[test]
    fn a_stop_needs_neither_file_nor_folder() {
        let folder = Folder::new();
        let path = folder.path().join("robot").join("stop");
        assert_eq!(StopWord::read(&path), Ok(None));
        let stop = StopWord::set(&path, Role::Operator, StopCause::Ordered).unwrap();
        let told = StopWord::read(&path).unwrap().expect("a file");
        assert_eq!(told.stop(), Some(stop));
        assert_eq!(
            (told.bridge(), told.obeyed(), told.rested()),
            (None, None, None)
        );
        let file = File::open(&path).unwrap();
        assert!(is_whole(&file).unwrap());
    }

    #[test]
    fn a_file_cut_short_or_full_of_garbage_takes_a_stop_and_is_mended() {
        let folder = Folder::new();
        let path = folder.path().join("stop");
        for contents in [&b""[..], b"\0\0\0", &[0x5A; 5000]] {
            std::fs::write(&path, contents).unwrap();
            let before = StopWord::read(&path).unwrap().expect("a file");
            assert_eq!(before.stop().is_some(), contents.len() > 4000);
            let stop = StopWord::set(&path, Role::Operator, StopCause::Ordered).unwrap();
            let told = StopWord::read(&path).unwrap().expect("a file");
            assert_eq!(told.stop(), Some(stop));
            assert!(is_whole(&File::open(&path).unwrap()).unwrap());
        }
    }

    #[test]
    fn two_that_stop_at_once_leave_one_of_their_words() {
        let folder = Folder::new();
        let path = folder.path().join("stop");
        for _ in 0..50 {
            let set = |role| StopWord::set(&path, role, StopCause::Ordered).unwrap();
            let (one, other) = std::thread::scope(|scope| {
                let one = scope.spawn(|| set(Role::Operator));
                let other = scope.spawn(|| set(Role::Supervisor));
                (one.join().unwrap(), other.join().unwrap())
            });
            let left = StopWord::read(&path).unwrap().and_then(|told| told.stop());
            assert!(left == Some(one) || left == Some(other), "{left:?}");
            std::fs::remove_file(&path).unwrap();
        }
    }

    #[test]
    fn two_stops_of_one_microsecond_have_two_words() {
        let folder = Folder::new();
        let path = folder.path().join("stop");
        let at = |later_ns| Stop::new(Role::Operator, StopCause::Ordered, 5_000 + later_ns);
        let (file, _) = open(&path).unwrap();
        let first = unlike(&file, at);
        put(&file, at::WORD, first.word()).unwrap();
        let second = unlike(&file, at);
        put(&file, at::WORD, second.word()).unwrap();
        put(&file, at::OBEYED, first.word()).unwrap();
        let third = unlike(&file, at);
        assert_eq!([first, second, third], [at(0), at(1_000), at(2_000)]);
    }

    #[test]
    fn what_is_in_the_way_is_named() {
        let folder = Folder::new();
        let said = StopWord::set(folder.path(), Role::Operator, StopCause::Ordered)
            .unwrap_err()
            .to_string();
        assert!(said.contains(folder.path().to_str().unwrap()), "{said}");
        for (kind, words) in [
            (ErrorKind::StorageFull, "no room"),
            (ErrorKind::PermissionDenied, "sudo -u"),
        ] {
            let said = StopError::new(Path::new("/a/stop"), &Error::from(kind)).to_string();
            assert!(said.contains(words) && said.contains("/a/stop"), "{said}");
        }
    }

    #[test]
    fn a_stop_word_that_no_file_is_left_for_blames_no_folder() {
        let raw = |errno: rustix::io::Errno| Error::from_raw_os_error(errno.raw_os_error());
        for (errno, is_short) in [
            (rustix::io::Errno::MFILE, true),
            (rustix::io::Errno::NOTDIR, false),
        ] {
            let said = StopError::new(Path::new("/a/stop"), &raw(errno)).to_string();
            assert_eq!(said.contains("ulimit -n"), is_short, "{said}");
        }
    }
}
