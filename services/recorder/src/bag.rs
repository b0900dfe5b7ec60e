//! Reads recordings: the I/O around the readers of `lager-journal`.

use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

use lager_journal::{
    Learnt, Ordered, Overview, OverviewReader, Part, Placed, ReadError, Scan, Selection, Step,
    Times, Visit, Walk, WriteError,
};

/// Bytes that are read at a time.
const PIECE: usize = 1 << 20;

/// Why a file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum BagError {
    /// It cannot be opened or read.
    #[error("cannot read {}: {error}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// It cannot be made or written.
    #[error("cannot write {}: {error}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// Its index cannot be read.
    #[error("{}: {error}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        error: ReadError,
    },
    /// It is undamaged, but another program recorded it.
    #[error(
        "{} was not recorded by lager; other MCAP files can be looked at with `info` and `check`",
        path.display()
    )]
    Foreign {
        /// The file.
        path: PathBuf,
    },
    /// Nothing of it can be recovered.
    #[error("{}: nothing can be recovered: {why}", path.display())]
    Nothing {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        why: String,
    },
    /// It does not have this topic.
    #[error("{} has no topic {topic}; it has {there}", path.display())]
    NoTopic {
        /// The file.
        path: PathBuf,
        /// The topic.
        topic: String,
        /// The topics that it has.
        there: String,
    },
    /// A message cannot be packed.
    #[error(transparent)]
    Pack(#[from] WriteError),
    /// The text could not be written.
    #[error("cannot write the output: {0}")]
    Output(#[from] io::Error),
}

impl BagError {
    /// Whether only the output's reader has gone, as after `| head`.
    pub fn is_closed_output(&self) -> bool {
        matches!(self, Self::Output(error) if error.kind() == io::ErrorKind::BrokenPipe)
    }

    /// Whether the request itself makes no sense, whatever the file contains.
    pub fn is_usage(&self) -> bool {
        matches!(self, Self::NoTopic { .. })
    }
}

/// A file that is read.
#[derive(Debug)]
pub(crate) struct Bag {
    file: File,
    path: PathBuf,
}

impl Bag {
    pub(crate) fn open(path: &Path) -> Result<Self, BagError> {
        let path = path.to_owned();
        let opened = File::open(&path).and_then(|file| {
            if file.metadata()?.is_dir() {
                return Err(io::ErrorKind::IsADirectory.into());
            }
            Ok(file)
        });
        match opened {
            Ok(file) => Ok(Self { file, path }),
            Err(error) => Err(BagError::Io { path, error }),
        }
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    pub(crate) fn length(&self) -> Result<u64, BagError> {
        let metadata = self.file.metadata();
        Ok(metadata.map_err(|error| self.io(error))?.len())
    }

    /// Reads the whole file.
    pub(crate) fn walk(&self, known: Learnt, visit: &mut impl Visit) -> Result<Learnt, BagError> {
        self.walk_and(known, visit, |_| Ok(()))
    }

    /// Reads the whole file, and calls a function after each piece.
    pub(crate) fn walk_and<V: Visit>(
        &self,
        known: Learnt,
        visit: &mut V,
        mut then: impl FnMut(&mut V) -> Result<(), BagError>,
    ) -> Result<Learnt, BagError> {
        let mut walk = Walk::knowing(known);
        let mut piece = vec![0; PIECE];
        let mut at = 0;
        loop {
            let read = self.read(at, &mut piece)?;
            if read == 0 {
                return Ok(walk.finish(visit));
            }
            at += read as u64;
            walk.feed(&piece[..read], visit);
            then(visit)?;
        }
    }

    /// The file's overview: from its end, or from all of it if the end does not say enough.
    pub(crate) fn overview(&self) -> Result<Overview, BagError> {
        let overview = match self.end()? {
            Err(ReadError::NoIndex) => {
                let mut scan = Scan::default();
                let learnt = self.walk(Learnt::default(), &mut scan)?;
                scan.finish(&learnt)
            }
            told => told,
        };
        overview.map_err(|error| self.unreadable(error))
    }

    /// The overview from the file's end.
    fn end(&self) -> Result<Result<Overview, ReadError>, BagError> {
        let mut reader = OverviewReader::new(self.length()?);
        loop {
            match reader.wants() {
                Ok(Some(part)) => reader.supply(&self.part(part)?),
                Ok(None) => return Ok(reader.finish()),
                Err(error) => return Ok(Err(error)),
            }
        }
    }

    /// The last message of a topic before a moment, in ns since 1970.
    pub(crate) fn last_before(
        &self,
        overview: &Overview,
        topic: &str,
        unix_ns: u64,
    ) -> Result<Option<(Times, Vec<u8>)>, BagError> {
        let selection = Selection {
            topics: Some(vec![topic.to_owned()]),
            before_ns: Some(unix_ns),
            is_backwards: true,
            ..Selection::default()
        };
        let mut last = None;
        self.ordered(overview, &selection, |placed| {
            last = Some((placed.times, placed.message.to_vec()));
            Ok::<bool, BagError>(false)
        })?;
        Ok(last)
    }

    /// The selected messages, by their time. `each` returns whether to go on.
    pub(crate) fn ordered<E: From<BagError>>(
        &self,
        overview: &Overview,
        selection: &Selection,
        mut each: impl FnMut(Placed<'_>) -> Result<bool, E>,
    ) -> Result<(), E> {
        let unreadable = |error| E::from(self.unreadable(error));
        let mut ordered = Ordered::new(overview, selection).map_err(unreadable)?;
        while let Some(step) = ordered.step() {
            let part = match step.map_err(unreadable)? {
                Step::Wants(part) => part,
                Step::Message(placed) => match each(placed)? {
                    true => continue,
                    false => break,
                },
            };
            ordered.supply(&self.part(part)?).map_err(unreadable)?;
        }
        Ok(())
    }

    /// Refuses a topic that the file does not have, and a file of another program.
    pub(crate) fn must_have(&self, overview: &Overview, topics: &[String]) -> Result<(), BagError> {
        if overview.start.is_none() {
            let path = self.path.clone();
            return Err(BagError::Foreign { path });
        }
        let samples = || overview.topics.iter().filter(|topic| !topic.is_derived);
        let there = || samples().map(|topic| topic.name.as_str());
        for topic in topics {
            if !there().any(|name| name == topic) {
                return Err(BagError::NoTopic {
                    path: self.path.clone(),
                    topic: topic.clone(),
                    there: there().collect::<Vec<_>>().join(" "),
                });
            }
        }
        Ok(())
    }

    /// Fewer bytes than the reader wanted mean that the file ends there.
    fn part(&self, part: Part) -> Result<Vec<u8>, BagError> {
        // A damaged index may want more bytes than the file has.
        let left = self.length()?.saturating_sub(part.at);
        let mut bytes = vec![0; part.length.min(usize::try_from(left).unwrap_or(usize::MAX))];
        let mut read = 0;
        while read < bytes.len() {
            match self.read(part.at + read as u64, &mut bytes[read..])? {
                0 => break,
                more => read += more,
            }
        }
        bytes.truncate(read);
        Ok(bytes)
    }

    fn read(&self, at: u64, into: &mut [u8]) -> Result<usize, BagError> {
        loop {
            match self.file.read_at(into, at) {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                read => return read.map_err(|error| self.io(error)),
            }
        }
    }

    fn io(&self, error: io::Error) -> BagError {
        let path = self.path.clone();
        BagError::Io { path, error }
    }

    fn unreadable(&self, error: ReadError) -> BagError {
        let path = self.path.clone();
        BagError::Read { path, error }
    }
}
