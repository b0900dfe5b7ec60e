//! The files of one kind: which one is written now, and which ones are dropped. It is pure, except
//! for [`found`].

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// A part is closed at this size, in bytes. One write makes it at most as much longer.
pub(crate) const FULL_PART: u64 = 2 << 20;
/// The largest file that is a part, in bytes.
pub(crate) const MOST_OF_PART: u64 = 2 * FULL_PART;

/// What a part holds; the table stands in the module above.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Fine,
    Coarse,
    Events,
}

impl Kind {
    pub(crate) const ALL: [Self; 3] = [Self::Fine, Self::Coarse, Self::Events];

    const fn as_str(self) -> &'static str {
        match self {
            Self::Fine => "fine",
            Self::Coarse => "coarse",
            Self::Events => "events",
        }
    }

    /// How long one part lasts, in ms.
    const fn lasts_ms(self) -> u64 {
        let lasts = match self {
            Self::Fine => Duration::from_secs(60),
            Self::Coarse => Duration::from_secs(10 * 60),
            Self::Events => Duration::from_secs(60 * 60),
        };
        lasts.as_millis() as u64
    }

    /// How long what stands in it is kept, in ms.
    const fn keeps_ms(self) -> u64 {
        let keeps = match self {
            Self::Fine => Duration::from_secs(10 * 60),
            Self::Coarse | Self::Events => Duration::from_secs(24 * 60 * 60),
        };
        keeps.as_millis() as u64
    }

    /// The most that all its parts hold, in bytes.
    const fn most_bytes(self) -> u64 {
        let mib = match self {
            Self::Fine => 28,
            Self::Coarse => 136,
            Self::Events => 28,
        };
        mib << 20
    }
}

/// One file.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Part {
    /// Its first moment, in ms since 1970; its name.
    pub(crate) begin_ms: u64,
    pub(crate) bytes: u64,
}

/// A part is the same, however much it has grown.
impl PartialEq for Part {
    fn eq(&self, other: &Self) -> bool {
        self.begin_ms == other.begin_ms
    }
}

/// The path of a part.
pub(crate) fn path(folder: &Path, kind: Kind, begin_ms: u64) -> PathBuf {
    folder.join(format!("{}-{begin_ms}.log", kind.as_str()))
}

/// The parts of a kind in a folder, the oldest first, and the number of files that have the name of
/// a part of this kind and are none. No folder has no parts.
///
/// # Errors
/// The folder cannot be read.
pub(crate) fn found(folder: &Path, kind: Kind) -> io::Result<(Vec<Part>, usize)> {
    let (mut parts, mut others) = (Vec::new(), 0);
    let entries = match fs::read_dir(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok((parts, others)),
        entries => entries?,
    };
    for entry in entries {
        let entry = entry?;
        let name = entry.file_name();
        let name = name.to_str().and_then(|name| name.strip_suffix(".log"));
        let Some((word, begin)) = name.and_then(|name| name.split_once('-')) else {
            continue;
        };
        if word != kind.as_str() {
            continue;
        }
        // This does not follow links.
        let part = entry.metadata().ok().zip(begin.parse().ok());
        match part {
            Some((metadata, begin_ms)) if metadata.is_file() && metadata.len() <= MOST_OF_PART => {
                let bytes = metadata.len();
                parts.push(Part { begin_ms, bytes });
            }
            _ => others += 1,
        }
    }
    parts.sort_by_key(|part| part.begin_ms);
    Ok((parts, others))
}

/// The parts of one kind.
#[derive(Debug)]
pub(crate) struct Parts {
    kind: Kind,
    /// The oldest first.
    closed: Vec<Part>,
    open: Option<Part>,
}

impl Parts {
    pub(crate) const fn new(kind: Kind, found: Vec<Part>) -> Self {
        Self {
            kind,
            closed: found,
            open: None,
        }
    }

    /// Whether the part that is written now is complete: it has its time or its size, or the clock
    /// was set back.
    pub(crate) fn is_over(&self, now_ms: u64) -> bool {
        self.open.is_some_and(|open| {
            let lasts = open.begin_ms..open.begin_ms + self.kind.lasts_ms();
            !lasts.contains(&now_ms) || open.bytes >= FULL_PART
        })
    }

    /// The part that is written now, as its first moment. If there is none, one begins that has
    /// this first moment.
    pub(crate) fn open(&mut self, mut begin_ms: u64) -> u64 {
        while self.closed.iter().any(|part| part.begin_ms == begin_ms) {
            begin_ms += 1;
        }
        let new = Part { begin_ms, bytes: 0 };
        self.open.get_or_insert(new).begin_ms
    }

    /// So many bytes have been written to it.
    pub(crate) fn grows(&mut self, bytes: u64) {
        if let Some(open) = &mut self.open {
            open.bytes += bytes;
        }
    }

    /// Nothing more is written to it.
    pub(crate) fn close(&mut self) {
        self.closed.extend(self.open.take());
        self.closed.sort_by_key(|part| part.begin_ms);
    }

    /// Drops the parts that are too old, and the oldest ones while all together are too large.
    /// Returns their first moments.
    pub(crate) fn dropped(&mut self, now_ms: u64) -> Vec<u64> {
        let too_old =
            |part: &Part| part.begin_ms + self.kind.lasts_ms() + self.kind.keeps_ms() <= now_ms;
        let mut bytes = self.bytes();
        let mut dropped = Vec::new();
        self.closed.retain(|part| {
            // The part that is written now may fill up.
            let is_dropped = too_old(part) || bytes + MOST_OF_PART > self.kind.most_bytes();
            if is_dropped {
                bytes -= part.bytes;
                dropped.push(part.begin_ms);
            }
            !is_dropped
        });
        dropped
    }

    /// How many bytes the closed parts have.
    fn bytes(&self) -> u64 {
        self.closed.iter().map(|part| part.bytes).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MINUTE: u64 = 60_000;

    #[test]
    fn a_part_ends_with_its_time_its_size_or_when_the_clock_goes_back() {
        let mut parts = Parts::new(Kind::Fine, Vec::new());
        assert!(!parts.is_over(5 * MINUTE), "there is none");
        assert_eq!(parts.open(5 * MINUTE), 5 * MINUTE);
        assert_eq!(parts.open(5 * MINUTE + 7), 5 * MINUTE, "it goes on");
        assert!(!parts.is_over(6 * MINUTE - 1));
        assert!(parts.is_over(6 * MINUTE));
        assert!(parts.is_over(5 * MINUTE - 1));
        parts.grows(FULL_PART);
        assert!(parts.is_over(5 * MINUTE + 1));
        parts.close();
        assert_eq!(
            parts.open(5 * MINUTE),
            5 * MINUTE + 1,
            "no name comes twice"
        );
    }

    #[test]
    fn what_is_too_old_or_too_much_is_dropped_from_its_oldest_end() {
        let part = |minute: u64, bytes| Part {
            begin_ms: minute * MINUTE,
            bytes,
        };
        let mut parts = Parts::new(Kind::Fine, vec![part(0, 9), part(1, 9), part(30, 9)]);
        assert_eq!(parts.dropped(11 * MINUTE - 1), [0; 0]);
        assert_eq!(parts.dropped(11 * MINUTE), [0]);
        // A part of a clock that was wrong stays until its time has passed.
        assert_eq!(parts.dropped(12 * MINUTE), [MINUTE]);

        let full = (0..8).map(|minute| part(minute, MOST_OF_PART)).collect();
        let mut parts = Parts::new(Kind::Fine, full);
        let dropped = parts.dropped(8 * MINUTE);
        assert_eq!(dropped, [0, MINUTE], "28 MiB with a full part open");
        assert_eq!(parts.bytes(), 6 * MOST_OF_PART);
    }
}
