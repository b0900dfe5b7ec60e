//! Removing what killed processes left behind.
//!
//! The transport does nearly all of it, but leaves two kinds of node for ever. It cannot remove a
//! node that was killed while it wrote one of its tags, because its list leaves that tag out and
//! the node's folder is then never empty. And it cannot remove a node that was killed while it took
//! itself down, because it looks for a node without details on another bus. So this module removes
//! the files of the first before the transport's sweep, and those of the second in its place; only
//! then is the node's name free again.

use std::fs::{self, DirEntry};
use std::os::unix::fs::PermissionsExt;
use std::path::PathBuf;
use std::time::Duration;

use iceoryx2::config::Config;
use iceoryx2::node::{DeadNodeView, NodeListFailure, NodeState, NodeView};
use iceoryx2::prelude::{CallbackProgression, Node};

use crate::transport::Ipc;

/// How long a sweep waits for another one that has the same dead process in hand.
const OTHERS_SWEEP: Duration = Duration::from_millis(100);

/// The mode of a tag file while it is being written (iceoryx2-cal's
/// `static_storage::file::INIT_PERMISSIONS`).
const BEING_WRITTEN: u32 = 0o600;

/// Removes the nodes of all processes that are dead; returns how many there were.
pub(crate) fn dead_nodes(config: &Config) -> Result<usize, NodeListFailure> {
    let mut removed = 0;
    Node::<Ipc>::list(config, |state| {
        if let NodeState::Dead(dead) = state {
            removed += usize::from(remove(config, dead));
        }
        CallbackProgression::Continue
    })?;
    Ok(removed)
}

/// Whether the files by which others find this node are there. Writing the tag of a port makes the
/// folder again, but the details are only written with the node.
pub(crate) fn is_listed(config: &Config, node: &Node<Ipc>) -> bool {
    let beside = PathBuf::from(config.global.node_dir().to_string());
    let details = format!("{}node.details", config.global.prefix);
    beside
        .join(node.id().value().to_string())
        .join(details)
        .is_file()
}

fn remove(config: &Config, dead: DeadNodeView<Ipc>) -> bool {
    let files = Files::of(config, &dead);
    if dead.details().is_none() {
        // A node removes its ports before its details.
        return files.remove();
    }
    files.remove_half_written_tags();
    dead.blocking_remove_stale_resources(OTHERS_SWEEP).is_ok()
}

/// A node's files: a folder of tags and details, and beside it some with the node's name.
struct Files {
    beside: PathBuf,
    /// How those beside the folder begin.
    stem: String,
    folder: PathBuf,
}

impl Files {
    fn of(config: &Config, node: &DeadNodeView<Ipc>) -> Self {
        let id = node.id().value();
        let beside = PathBuf::from(config.global.node_dir().to_string());
        Self {
            folder: beside.join(id.to_string()),
            stem: format!("{}{id}.", config.global.prefix),
            beside,
        }
    }

    fn remove_half_written_tags(&self) {
        for tag in entries(&self.folder) {
            let mode = tag.metadata().map(|tag| tag.permissions().mode() & 0o777);
            if matches!(mode, Ok(BEING_WRITTEN)) {
                remove_file(&tag);
            }
        }
    }

    /// Removes them all; says whether nothing is left.
    fn remove(&self) -> bool {
        entries(&self.folder).iter().for_each(remove_file);
        let _ = fs::remove_dir(&self.folder);
        let ours = |file: &DirEntry| file.file_name().to_string_lossy().starts_with(&self.stem);
        let mut left = entries(&self.beside);
        left.retain(ours);
        left.iter().for_each(remove_file);
        !self.folder.exists() && left.iter().all(|file| !file.path().exists())
    }
}

/// What a folder contains; nothing if it cannot be read, as the next sweep sees it again.
fn entries(folder: &PathBuf) -> Vec<DirEntry> {
    fs::read_dir(folder)
        .into_iter()
        .flatten()
        .flatten()
        .collect()
}

/// Another sweep may have been first.
fn remove_file(file: &DirEntry) {
    let _ = fs::remove_file(file.path());
}
