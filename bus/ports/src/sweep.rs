//! Removes from the bus what killed processes left behind.
//!
//! The transport does nearly all of it, but leaves two kinds of node for ever. It cannot remove a
//! node that was killed while it wrote one of its tags: its list leaves that tag out, so the node's
//! folder never gets empty. And it cannot remove a node that was killed while it removed itself:
//! for a node without details it looks on another bus. So this module removes the files of the
//! first kind before the transport's sweep, and the files of the second kind in its place. Only
//! then is the node's name free again.

use std::fs::{self, DirEntry};
use std::io::ErrorKind;
use std::os::unix::fs::PermissionsExt;
use std::path::PathBuf;
use std::time::Duration;

use iceoryx2::config::Config;
use iceoryx2::node::{DeadNodeView, NodeListFailure, NodeState, NodeView};
use iceoryx2::prelude::{CallbackProgression, FileName, Node, SemanticString};
use iceoryx2::service::Service;
use iceoryx2_cal::monitoring::{
    Monitoring, MonitoringBuilder, MonitoringCleaner, MonitoringMonitor, State,
};
use iceoryx2_cal::named_concept::{
    NamedConceptBuilder, NamedConceptConfiguration, NamedConceptMgmt,
};

use crate::transport::Ipc;

/// The files with which the transport's nodes show that they live.
type Monitors = <Ipc as Service>::Monitoring;

/// How long a sweep waits for another sweep that is removing the same dead process.
const OTHERS_SWEEP: Duration = Duration::from_millis(100);

/// The mode of a tag file while it is being written (iceoryx2-cal's
/// `static_storage::file::INIT_PERMISSIONS`).
const BEING_WRITTEN: u32 = 0o600;

/// Removes the nodes of all processes that are dead; returns how many there were.
pub(crate) fn dead_nodes(config: &Config) -> Result<usize, NodeListFailure> {
    if all_live(config) {
        return Ok(0);
    }
    let mut removed = 0;
    Node::<Ipc>::list(config, |state| {
        if let NodeState::Dead(dead) = state {
            removed += usize::from(remove(config, dead));
        }
        CallbackProgression::Continue
    })?;
    Ok(removed)
}

/// Whether the process of every node lives. The transport's list of nodes says this too, but reads
/// the details of each node.
fn all_live(config: &Config) -> bool {
    let monitors = monitors(config);
    let Ok(names) = Monitors::list_cfg(&monitors) else {
        return false;
    };
    let lives = |name: &FileName| {
        let monitor = <Monitors as Monitoring>::Builder::new(name)
            .config(&monitors)
            .monitor();
        monitor.is_ok_and(|monitor| matches!(monitor.state(), Ok(State::Alive)))
    };
    names.iter().all(lives)
}

/// Whether the files exist by which others find this node. Creating a port makes the folder again
/// if it is gone, but the details are written only with the node.
pub(crate) fn is_listed(config: &Config, node: &Node<Ipc>) -> bool {
    let beside = PathBuf::from(config.global.node_dir().to_string());
    beside
        .join(node.id().value().to_string())
        .join(details_name(config))
        .is_file()
}

fn remove(config: &Config, dead: DeadNodeView<Ipc>) -> bool {
    let files = Files::of(config, &dead);
    if dead.details().is_none() {
        // A node removes its ports before its details. If the details exist but cannot be read (no
        // permission, or too many open files), the node may still have ports.
        return files.are_without_details() && files.remove_as_cleaner(config);
    }
    files.remove_half_written_tags();
    dead.blocking_remove_stale_resources(OTHERS_SWEEP).is_ok()
}

/// A node's files: its folder of tags and details, and the files beside the folder with its name.
struct Files {
    /// The node's name among the files of `Monitors`.
    id: String,
    details: PathBuf,
    folder: PathBuf,
}

impl Files {
    fn of(config: &Config, node: &DeadNodeView<Ipc>) -> Self {
        let id = node.id().value().to_string();
        let folder = PathBuf::from(config.global.node_dir().to_string()).join(&id);
        Self {
            details: folder.join(details_name(config)),
            folder,
            id,
        }
    }

    /// Whether the node has no details, or was killed while it wrote them.
    fn are_without_details(&self) -> bool {
        match fs::symlink_metadata(&self.details) {
            Ok(details) => details.permissions().mode() & 0o777 == BEING_WRITTEN,
            Err(error) => error.kind() == ErrorKind::NotFound,
        }
    }

    /// Needs no cleaner's lock. Only the node's own process writes tags into this folder. A node is
    /// listed as dead only when the kernel has released that process's lock or the process has
    /// removed the folder itself. And no other node ever gets the same number.
    fn remove_half_written_tags(&self) {
        for tag in entries(&self.folder) {
            let mode = tag.metadata().map(|tag| tag.permissions().mode() & 0o777);
            if matches!(mode, Ok(BEING_WRITTEN)) {
                remove_file(&tag);
            }
        }
    }

    /// Removes all files; those beside the folder go when the cleaner's lock is given back. Returns
    /// whether nothing is left. Without that lock, another process may be sweeping the same node.
    fn remove_as_cleaner(&self, config: &Config) -> bool {
        let Some(cleaner) = cleaner(config, &self.id) else {
            return false;
        };
        if self.are_without_details() {
            entries(&self.folder).iter().for_each(remove_file);
            let _ = fs::remove_dir(&self.folder);
        }
        let is_gone = !self.folder.exists();
        if !is_gone {
            cleaner.relinquish();
        }
        is_gone
    }
}

/// The transport's lock on the files of a dead node. Nobody gets the lock of a living node.
fn cleaner(config: &Config, id: &str) -> Option<<Monitors as Monitoring>::Cleaner> {
    let name = FileName::new(id.as_bytes()).ok()?;
    <Monitors as Monitoring>::Builder::new(&name)
        .config(&monitors(config))
        .cleaner()
        .ok()
}

/// The folder and the names of a bus's monitors.
fn monitors(config: &Config) -> <Monitors as NamedConceptMgmt>::Configuration {
    let global = &config.global;
    <Monitors as NamedConceptMgmt>::Configuration::default()
        .prefix(&global.prefix)
        .suffix(&global.node.monitor_suffix)
        .path_hint(&global.node_dir())
}

fn details_name(config: &Config) -> String {
    let global = &config.global;
    format!("{}node{}", global.prefix, global.node.static_config_suffix)
}

/// The entries of a folder; none if it cannot be read, because the next sweep tries again.
fn entries(folder: &PathBuf) -> Vec<DirEntry> {
    fs::read_dir(folder)
        .into_iter()
        .flatten()
        .flatten()
        .collect()
}

/// Another sweep may have removed the file first.
fn remove_file(file: &DirEntry) {
    let _ = fs::remove_file(file.path());
}
