//! Saves warehouse and queues in a thread of its own. A disk may take seconds, and the stop of a
//! robot must not wait for it. If the disk refuses a file, the thread tries again until it is
//! saved.

use lager_plant::Warehouse;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::{JoinHandle, spawn};
use std::time::Duration;

use lager_orders::Reason;

use crate::awaited::Saved;
use crate::handle::Handle;
use crate::queues::Queues;
use crate::warehouse::{SaveError, save};

/// How long the thread waits before it tries again.
const AGAIN: Duration = Duration::from_secs(2);

/// What has changed.
#[derive(Debug, Default)]
pub(crate) struct Changes {
    pub(crate) warehouse: Option<Warehouse>,
    pub(crate) queues: Option<Queues>,
    /// Those who wait until the warehouse is saved.
    pub(crate) waits: Vec<Saved>,
}

impl Changes {
    fn is_nothing(&self) -> bool {
        self.warehouse.is_none() && self.queues.is_none()
    }

    /// Only the last change of each counts.
    fn add(&mut self, newer: Self) {
        self.warehouse = newer.warehouse.or(self.warehouse.take());
        self.queues = newer.queues.or(self.queues.take());
        self.waits.extend(newer.waits);
    }

    /// Saves warehouse and queues and tells those who wait; without a path it saves nothing. Keeps
    /// what the disk refuses, and returns why.
    fn save(&mut self, [path, queues]: [Option<&Path>; 2]) -> Vec<SaveError> {
        let mut errors = Vec::new();
        let saved = path.zip(self.warehouse.as_ref());
        let saved = saved.map(|(path, warehouse)| save(path, warehouse));
        let told = match saved {
            Some(Err(error)) => {
                let why = Reason::from(&error);
                errors.push(error);
                Err(why)
            }
            _ => {
                self.warehouse = None;
                Ok(())
            }
        };
        for to in self.waits.drain(..) {
            // The thread that asked may have given up.
            let _ = to.try_send(told.clone());
        }
        let saved = queues.zip(self.queues.as_ref());
        match saved.map(|(path, queues)| queues.save(path)) {
            Some(Err(error)) => errors.push(error),
            _ => self.queues = None,
        }
        errors
    }
}

/// Saves changes until no more can come.
fn work(paths: [Option<&Path>; 2], changes: &Receiver<Changes>, handle: &Handle) {
    let mut open = Changes::default();
    let mut has_ended = false;
    while !has_ended {
        let received = match open.is_nothing() {
            true => changes.recv().map_err(|_| RecvTimeoutError::Disconnected),
            false => changes.recv_timeout(AGAIN),
        };
        let is_new = received.is_ok();
        has_ended = matches!(received, Err(RecvTimeoutError::Disconnected));
        received.into_iter().for_each(|newer| open.add(newer));
        changes.try_iter().for_each(|newer| open.add(newer));
        for error in open.save(paths) {
            // Whoever heard of this error needs to hear it once only.
            if is_new {
                tracing::error!("{error}; the station tries again");
                handle.change(|station| station.not_saved(&error.to_string()));
            }
        }
    }
}

/// The thread. Dropping it waits until everything is saved, or until the disk has refused it.
#[derive(Debug)]
pub(crate) struct Saver {
    changes: Option<Sender<Changes>>,
    thread: Option<JoinHandle<()>>,
}

impl Saver {
    /// Saves to these files from now on; `None` saves nothing.
    pub(crate) fn new(warehouse: Option<PathBuf>, queues: Option<PathBuf>, handle: Handle) -> Self {
        let (sender, changes) = channel();
        Self {
            changes: Some(sender),
            thread: Some(spawn(move || {
                work([warehouse.as_deref(), queues.as_deref()], &changes, &handle);
            })),
        }
    }

    /// Saves a change.
    pub(crate) fn save(&self, changes: Changes) {
        if let Some(to) = &self.changes
            && !changes.is_nothing()
        {
            // The thread ends only when this is dropped.
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
