//! Removing what killed processes left behind.
//!
//! The transport does nearly all of it, but leaves two kinds of node for ever. It cannot remove a
//! node that was killed while it wrote one of its tags, because its list leaves that tag out and
//! the node's folder is then never empty. And it cannot remove a node that was killed while it took
//! itself down, because it looks for a node without details on another bus. So this module removes
//! the files of the first before the transport's sweep, and those of the second in its place; only
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

/// Where the transport's nodes say that they live.
type Monitors = <Ipc as Service>::Monitoring;

/// How long a sweep waits for another one that has the same dead process in hand.
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

/// Whether the process of every node lives. The transport's list of nodes would tell, too, but it
/// reads the details of each.
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

/// Whether the files by which others find this node are there. Writing the tag of a port makes the
/// folder again, but the details are only written with the node.
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
        // A node removes its ports before its details. Details that are there but cannot be read,
        // for want of rights or of files, are of a node that may have ports.
        return files.are_without_details() && files.remove_as_cleaner(config);
    }
    files.remove_half_written_tags();
    dead.blocking_remove_stale_resources(OTHERS_SWEEP).is_ok()
}

/// A node's files: a folder of tags and details, and beside it some with the node's name.
struct Files {
    /// The node's name among its monitors.
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

    /// Needs no cleaner's lock: only the node's own process writes tags into this folder, a node is
    /// listed as dead only when the kernel has taken that process's lock back or the process has
    /// already removed the folder itself, and no other node ever has the same number.
    fn remove_half_written_tags(&self) {
        for tag in entries(&self.folder) {
            let mode = tag.metadata().map(|tag| tag.permissions().mode() & 0o777);
            if matches!(mode, Ok(BEING_WRITTEN)) {
                remove_file(&tag);
            }
        }
    }

    /// Removes them all, those beside the folder by giving the cleaner's lock back; says whether
    /// nothing is left. Without that lock another process may be sweeping the same node.
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

/// The transport's lock on what a dead node has left. Nobody gets it for a living one.
fn cleaner(config: &Config, id: &str) -> Option<<Monitors as Monitoring>::Cleaner> {
    let name = FileName::new(id.as_bytes()).ok()?;
    <Monitors as Monitoring>::Builder::new(&name)
        .config(&monitors(config))
        .cleaner()
        .ok()
}

/// Where the monitors of a bus are, and how they are named.
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
