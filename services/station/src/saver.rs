//! Saves warehouse and queues in its own thread, because a disk may take seconds and a robot's stop
//! must not wait for it.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Sender, channel};
use std::thread::{JoinHandle, spawn};

use crate::handle::Handle;
use crate::queues::Queues;
use crate::warehouse::{SaveError, Warehouse, save};

/// What has changed.
#[derive(Debug, Default)]
pub(crate) struct Changes {
    pub(crate) warehouse: Option<Warehouse>,
    pub(crate) queues: Option<Queues>,
}

impl Changes {
    fn is_nothing(&self) -> bool {
        self.warehouse.is_none() && self.queues.is_none()
    }

    /// Of each only the last one counts.
    fn add(&mut self, newer: Self) {
        self.warehouse = newer.warehouse.or(self.warehouse.take());
        self.queues = newer.queues.or(self.queues.take());
    }

    fn save(self, path: &Path) -> [Result<(), SaveError>; 2] {
        let warehouse = self.warehouse.map(|warehouse| save(path, &warehouse));
        let queues = (self.queues).map(|queues| queues.save(&Queues::beside(path)));
        [warehouse, queues].map(|saved| saved.unwrap_or(Ok(())))
    }
}

/// The thread. When it is dropped everything has been saved.
#[derive(Debug)]
pub(crate) struct Saver {
    changes: Option<Sender<Changes>>,
    thread: Option<JoinHandle<()>>,
}

impl Saver {
    /// Saves to `path`, and beside it, from now on; nothing where there is none.
    pub(crate) fn new(path: Option<PathBuf>, handle: Handle) -> Self {
        let (sender, changes) = channel::<Changes>();
        let work = move || {
            while let Ok(mut change) = changes.recv() {
                while let Ok(newer) = changes.try_recv() {
                    change.add(newer);
                }
                let Some(path) = &path else { continue };
                for error in change.save(path).into_iter().filter_map(Result::err) {
                    tracing::error!("{error}");
                    handle.change(|station| station.not_saved(&error.to_string()));
                }
            }
        };
        Self {
            changes: Some(sender),
            thread: Some(spawn(work)),
        }
    }

    /// Has what has changed saved.
    pub(crate) fn save(&self, changes: Changes) {
        if let Some(to) = &self.changes
            && !changes.is_nothing()
        {
            // It ends only when this is dropped.
            let _ = to.send(changes);
        }
    }
}

impl Drop for Saver {
    fn drop(&mut self) {
        self.changes = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
