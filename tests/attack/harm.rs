//! The ways to damage a bus's files, and the files that are damaged.

use std::fs::{self, OpenOptions, Permissions};
use std::os::unix::fs::{FileExt, PermissionsExt};
use std::path::{Path, PathBuf};

use lager_home::Home;
use lager_tests::wait_for;

/// A way to damage a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Harm {
    Emptied,
    /// Cut to half of its length, at most 24 bytes.
    Shortened,
    Deleted,
    Overwritten,
}

pub(crate) const HARMS: [Harm; 4] = [
    Harm::Emptied,
    Harm::Shortened,
    Harm::Deleted,
    Harm::Overwritten,
];

impl Harm {
    /// Damages a file. Does nothing if the file is removed meanwhile.
    fn to(self, file: &Path) {
        if self == Harm::Deleted {
            let _ = fs::remove_file(file);
            return;
        }
        let _ = fs::set_permissions(file, Permissions::from_mode(0o600));
        let Ok(opened) = OpenOptions::new().write(true).open(file) else {
            return;
        };
        let length = opened.metadata().map_or(0, |found| found.len());
        let _ = match self {
            Harm::Emptied => opened.set_len(0),
            Harm::Shortened => opened.set_len(length.min(48) / 2),
            Harm::Overwritten => opened.write_all_at(&vec![0xa5; length as usize], 0),
            Harm::Deleted => Ok(()),
        };
    }
}

/// The files to damage.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Target {
    /// The segments whose names end with this.
    Segments(&'static str),
    /// The files of the folder whose names contain this.
    Files(&'static str),
    /// Everything in the folder.
    Contents,
    /// The folder itself.
    Folder,
}

pub(crate) const SEGMENTS: [&str; 4] = [".dynamic", ".data", ".connection", ".global_mgmt"];
pub(crate) const FILES: [&str; 11] = [
    ".service",
    ".details",
    ".node_monitor",
    "_tag",
    "bells",
    ".lock",
    "lager.toml",
    "stop",
    "warehouse.toml",
    "warehouse.toml.queue",
    // A socket, which has a name but no content to damage.
    "gag",
];

impl Target {
    /// Damages all of these files, which must be at least one.
    pub(crate) fn spoil(self, place: &Home, harm: Harm) {
        let mut spoilt = 0;
        let mut spoil = |file: &Path| {
            harm.to(file);
            spoilt += 1;
        };
        match self {
            Target::Segments(end) => {
                for segment in place.segments() {
                    if segment.to_string_lossy().ends_with(end) {
                        spoil(&segment);
                    }
                }
            }
            Target::Files(part) => {
                for file in files(place.folder()) {
                    let name = file.file_name().unwrap_or_default().to_string_lossy();
                    if name.contains(part) {
                        spoil(&file);
                    }
                }
            }
            Target::Contents => {
                for entry in fs::read_dir(place.folder()).into_iter().flatten().flatten() {
                    let _ = fs::remove_dir_all(entry.path());
                    spoilt += 1;
                }
            }
            Target::Folder => {
                // The robot makes new files in the folder meanwhile.
                wait_for("the folder to go", || {
                    fs::remove_dir_all(place.folder()).ok()
                });
                spoilt += 1;
            }
        }
        assert!(spoilt > 0, "{self:?}: there is no such file");
    }
}

pub(crate) fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        match entry.path() {
            below if below.is_dir() => found.extend(files(&below)),
            file => found.push(file),
        }
    }
    found
}
